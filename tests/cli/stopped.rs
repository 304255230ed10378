//! A run that is asked to end from outside: `finally` is done, and what it writes is whole.

use std::io::{BufRead, BufReader, Read};
use std::process::{Child, Command, Stdio};

use crate::harness::{command, folder, matterixc, names, write};

/// Heats, and then waits in many short steps: the run lasts far longer than the test.
const LONG: &str = "mtx 1
use std::glassware::Beaker250mL
use std::heating::IkaRetControl
lab bench {
    ambient: 22 degC
    plate = IkaRetControl at (0, 0, 0) m
    cup = Beaker250mL on plate holding 100 g of water
}
workflow stir_on in bench {
    record cup.contents.temperature every 10 s
    heat plate to 40 degC
    repeat while elapsed < 10000 h max 1000000 { wait 1 s }
} finally { stop heating plate }
";

/// Asks the process to terminate.
fn terminate(process: &Child) {
    let sent = Command::new("kill").args(["-TERM", &process.id().to_string()]).status();
    assert!(sent.expect("kill").success());
}

#[test]
fn a_request_to_terminate_ends_a_run_in_order() {
    let dir = folder("stopped_run");
    let file = write(&dir, "long.mtx", LONG);
    let mut run = command();
    run.current_dir(&dir).args(["run", &file, "--out", "out"]).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut run = run.spawn().expect("the command starts");
    let mut said = BufReader::new(run.stderr.take().expect("piped"));
    let mut progress = String::new();
    while !progress.contains("wait 1 s") {
        assert_ne!(said.read_line(&mut progress).expect("text"), 0, "it ended: {progress}");
    }
    terminate(&run);
    let after = std::thread::spawn(move || {
        let mut rest = String::new();
        said.read_to_string(&mut rest).map(|_| rest)
    });
    let ended = run.wait_with_output().expect("it ends");
    let said = after.join().expect("read").expect("text");
    assert_eq!(ended.status.code(), Some(1), "{said}");
    let (_, last) = said.split_once("stopping: what `finally` says is done first").expect("it says that it stops");
    assert!(last.contains("stop heating plate"), "{last}");

    let out = dir.join("out");
    assert_eq!(names(&out), ["plot.svg", "recording.mcap", "records.csv", "report.json", "states.csv"]);
    let read = |name: &str| std::fs::read_to_string(out.join(name)).expect("it was written");
    let report: serde_json::Value = serde_json::from_str(&read("report.json")).expect("a whole document");
    assert_eq!(report["status"], "cancelled");
    for table in ["records.csv", "states.csv"] {
        let table = read(table);
        let columns = table.lines().next().expect("a heading").split(',').count();
        assert!(table.lines().all(|line| line.split(',').count() == columns) && table.ends_with('\n'));
    }
    assert!(read("plot.svg").trim_end().ends_with("</svg>"));
    let recording = out.join("recording.mcap").display().to_string();
    let viewed = matterixc(&["view", &recording, "--export", &dir.join("page.html").display().to_string()]);
    assert_eq!(viewed.code, 0, "{}", viewed.err);
}
