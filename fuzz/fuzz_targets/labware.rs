//! Any text as a file of labware, and as a name of the library.
#![no_main]

use libfuzzer_sys::fuzz_target;
use matterix_ir::{FileId, Sources};
use matterix_lang::labware::{library, summary};
use matterix_lang::{Loader, Options, compile};

const BENCH: &str = "mtx 1\nasset It from labware \"it.json\"\nlab bench { ambient: 20 degC, it = It at (0, 0, 0) m }\n\
    workflow look in bench { wait 1 s }\n";

struct Beside(String);

impl Loader for Beside {
    fn load(&self, _: FileId, _: &str) -> Option<(String, String)> {
        None
    }

    fn bytes(&self, _: FileId, _: &str) -> Result<Vec<u8>, String> {
        Err("there is no such file".into())
    }

    fn file(&self, _: FileId, _: &str) -> Result<String, String> {
        Ok(self.0.clone())
    }
}

fuzz_target!(|bytes: &[u8]| {
    let text = String::from_utf8_lossy(bytes).into_owned();
    let _ = library::find(&text);
    if summary(&text).is_ok() {
        let mut sources = Sources::default();
        let file = sources.add("bench.mtx", BENCH);
        let _ = compile(&mut sources, file, &Beside(text), &Options::default());
    }
});
