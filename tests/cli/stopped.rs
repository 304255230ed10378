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
    run.current_dir(&dir).args(["run", &file, "--csv", "--out", "out"]).stdout(Stdio::piped()).stderr(Stdio::piped());
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
    let (_, last) = said.split_once("stopping: `finally` runs first").expect("it says that it stops");
    assert!(last.contains("stop heating plate"), "{last}");

    let out = dir.join("out");
    assert_eq!(
        names(&out),
        ["plot.svg", "recording.mcap", "records.csv", "records.parquet", "report.json", "states.csv", "states.parquet",]
    );
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

/// Asks the process to terminate once it listens for that.
fn cut(process: &Child) {
    const TERM: u64 = 1 << 14;
    let listens = || {
        let status = std::fs::read_to_string(format!("/proc/{}/status", process.id())).unwrap_or_default();
        let caught = status.lines().find_map(|l| l.strip_prefix("SigCgt:"));
        caught.is_some_and(|mask| u64::from_str_radix(mask.trim(), 16).is_ok_and(|mask| mask & TERM != 0))
    };
    // One that has ended by itself never will; what it said then tells why.
    (0..5000).take_while(|_| !listens()).for_each(|_| std::thread::sleep(std::time::Duration::from_millis(2)));
    terminate(process);
}

/// Ten jobs on ten machines and more: no search for the shortest schedule ends soon.
fn shop() -> String {
    let (jobs, machines) = (22, 12);
    let mut text = "mtx 1\nasset Machine: Body { mass: 1 kg }\nlab shop {\n    ambient: 20 degC\n".to_owned();
    (0..machines).for_each(|m| text += &format!("    m{m} = Machine at ({m}, 0, 0) m\n"));
    text += "}\nworkflow jobs in shop {\n    parallel {\n";
    for job in 0..jobs {
        text += "        sequence {\n";
        for step in 0..machines {
            // Five is prime to twelve: every machine once, in another order for every job.
            let (machine, time) = ((job + step * [1, 5, 7, 11][job % 4]) % machines, 10 + (job * 31 + step * 17) % 89);
            text += &format!("            claim m{machine} {{ wait {time} s }}\n");
        }
        text += "        }\n";
    }
    text + "    }\n}\n"
}

#[test]
fn what_is_cut_short_says_so_and_never_passes_for_whole() {
    let dir = folder("stopped_others");
    let study = "study many of stir_on {\n    vary cup.initial[water] in 90 g .. 110 g by sobol\n    runs 4\n    report hottest = max_over_time(cup.contents.temperature)\n}\n";
    let test = "test at_length in bench {\n    repeat while elapsed < 10000 h max 1000000 { wait 1 s }\n}\ntest next in bench { wait 1 s }\n";
    write(&dir, "long.mtx", LONG);
    write(&dir, "study.mtx", format!("{LONG}{study}"));
    write(&dir, "test.mtx", format!("{LONG}{test}"));
    write(&dir, "shop.mtx", shop());
    let cases: [(&[&str], &str); 5] = [
        (&["plan", "shop.mtx", "--time-limit", "10 min"], "stopped before the end of the search"),
        (&["emit", "long.mtx", "--target", "commands", "--out", "steps.txt"], "nothing is written"),
        (&["bill", "long.mtx"], "stopped before the end of the run"),
        (&["test", "test.mtx"], "stopped before all tests had run"),
        (&["study", "study.mtx"], "stopped before all runs had ended"),
    ];
    for (args, said) in cases {
        let mut child = command();
        child.current_dir(&dir).args(args).stdout(Stdio::piped()).stderr(Stdio::piped());
        let child = child.spawn().expect("the command starts");
        cut(&child);
        let ended = child.wait_with_output().expect("it ends");
        let err = String::from_utf8_lossy(&ended.stderr);
        assert_eq!(ended.status.code(), Some(1), "{args:?}: {err}");
        assert!(err.contains(said), "{args:?}: {err}");
    }
    assert!(!dir.join("steps.txt").exists(), "a part of the steps is written as if it were all");
}

/// Ends soon, and leaves much behind.
const SHORT: &str = "mtx 1
use std::glassware::Beaker250mL
use std::heating::IkaRetControl
lab bench {
    ambient: 22 degC
    plate = IkaRetControl at (0, 0, 0) m
    cup = Beaker250mL on plate holding 100 g of water
}
workflow warm in bench {
    record cup.contents.temperature every 10 s
    repeat 8 times { heat plate to 50 degC; wait 100 s; heat plate to 40 degC; wait 100 s }
} finally { stop heating plate }
";

const FILES: [&str; 5] = ["plot.svg", "recording.mcap", "records.parquet", "report.json", "states.parquet"];

#[test]
fn a_folder_has_all_files_of_a_run_or_none_where_it_is_killed() {
    let dir = folder("stopped_killed");
    write(&dir, "short.mtx", SHORT);
    for files in [1, 3, 4] {
        let mut child = command();
        child.current_dir(&dir).args(["run", "short.mtx", "--out", "out"]).stdout(Stdio::null()).stderr(Stdio::null());
        let mut child = child.spawn().expect("the command starts");
        let staging = dir.join(format!(".out.{}-0.part", child.id()));
        // Until so many files are on their way, or all are in place.
        while child.try_wait().expect("a status").is_none() {
            if std::fs::read_dir(&staging).is_ok_and(|entries| entries.count() >= files) {
                break;
            }
        }
        let _ = child.kill();
        let _ = child.wait();
        let out = dir.join("out");
        assert!(!out.exists() || names(&out) == FILES, "{:?}", names(&out));
        let _ = std::fs::remove_dir_all(out);
    }
}

#[test]
fn a_full_disk_leaves_nothing_behind_and_what_was_there_as_it_was() {
    let dir = folder("stopped_full");
    write(&dir, "short.mtx", SHORT);
    let run = |blocks: &str| {
        let limited = format!("trap '' XFSZ; ulimit -f {blocks}; exec \"$0\" run short.mtx --out out");
        let mut shell = Command::new("sh");
        shell.args(["-c", &limited, env!("CARGO_BIN_EXE_matterixc")]).current_dir(&dir);
        shell.stdout(Stdio::null()).output().expect("a shell")
    };
    let refused = run("100");
    assert_eq!(refused.status.code(), Some(2));
    let err = String::from_utf8_lossy(&refused.stderr);
    assert!(err.contains("error: cannot write `out/recording.mcap`"), "{err}");
    assert_eq!(names(&dir), ["short.mtx"]);

    assert_eq!(run("unlimited").status.code(), Some(0));
    let before = std::fs::read(dir.join("out/report.json")).expect("written");
    assert_eq!(run("100").status.code(), Some(2));
    assert_eq!(names(&dir.join("out")), FILES);
    assert_eq!(std::fs::read(dir.join("out/report.json")).expect("still there"), before);
    assert_eq!(names(&dir), ["out", "short.mtx"]);
}
