//! Writes pages without the command: `page sample OUT.html` of a made-up bench, `page still
//! OUT.html` of the same before anything happened, `page RUN.mcap OUT.html` of a recording.

mod sample {
    pub mod arm;
    pub mod bench;
}

use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [from, to] = arguments.as_slice() else {
        return Err("usage: page sample|still|RUN.mcap OUT.html".into());
    };
    let document = match from.as_str() {
        "sample" => sample::bench::document(),
        "still" => sample::bench::still(),
        file => matterix_view::from_recording::from_recording(&std::fs::read(file)?)?,
    };
    std::fs::write(to, matterix_view::page::page(&document)?)?;
    Ok(())
}
