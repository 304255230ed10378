//! Nobody reads what a deployment says, or the process itself stands still: devices are told what is due, and a stop gets through.

use std::fs::File;
use std::io::{Read, Write};
use std::os::fd::OwnedFd;
use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use rustix::fs::{OFlags, fcntl_getfl, fcntl_setfl};

use super::stop::{signal, terminal};
use super::{Answer, Device, bench};
use crate::harness::{command, flat, matterixc_in};

/// A valve that is on for two seconds, with something said in between.
const TEXT: &str = "mtx 1
capability Valve {
    command give way
    command shut off
}
asset Line: Valve
driver LineOne for Line over tcp(framing: lf, timeout: 8 s) {
    give way sends \"ON\" expects \"OK\"
    shut off sends \"OFF\" expects \"OK\"
    safe sends \"SAFE\" expects \"OK\"
}
lab bench { ambient: 22 degC, valve = Line at (0, 0, 0) m }
workflow pulse in bench {
    give way valve
    wait 1 s
    note \"half of it\"
    wait 1 s
    shut off valve
} finally { shut off valve }
";

/// What a valve heard, and when.
type Heard = Arc<Mutex<Vec<(String, Instant)>>>;

#[allow(clippy::disallowed_methods, reason = "how long devices wait is what is tested")]
fn valve(name: &str, text: &str) -> (PathBuf, Heard) {
    let heard = Heard::default();
    let told = Arc::clone(&heard);
    let device = Device::start(b'\n', move |line, _| {
        told.lock().expect("not poisoned").push((line.to_owned(), Instant::now()));
        Answer::Says("OK\n")
    });
    (bench(name, text, "valve", &device.address), heard)
}

fn deployed(dir: &Path, stdin: Stdio, out: Stdio, err: Stdio) -> Child {
    let mut deployed = command();
    deployed.current_dir(dir).args(["deploy", "lab.mtx", "--bind", "lab.toml", "--mode", "real", "--trace"]);
    deployed.args(["--record", "record"]).stdin(stdin).stdout(out).stderr(err);
    deployed.spawn().expect("the command starts")
}

/// Waits until the valve has heard this; when that was.
fn until(heard: &Heard, word: &str) -> Instant {
    for _ in 0..2000 {
        if let Some((_, at)) = heard.lock().expect("not poisoned").iter().find(|(line, _)| line == word) {
            return *at;
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    panic!("no {word}: {heard:?}");
}

/// A pipe that has no room, and what may be read from it.
fn full_pipe() -> (std::io::PipeReader, OwnedFd) {
    let (reader, mut writer) = std::io::pipe().expect("a pipe");
    let flags = fcntl_getfl(&writer).expect("its flags");
    fcntl_setfl(&writer, flags | OFlags::NONBLOCK).expect("it does not wait");
    while writer.write(&[b'x'; 4096]).is_ok() {}
    while writer.write(b"x").is_ok() {}
    fcntl_setfl(&writer, flags).expect("it waits");
    (reader, writer.into())
}

#[test]
fn a_pipe_that_nobody_reads_holds_nothing_up() {
    let (dir, heard) = valve("held_pipe", TEXT);
    let (_reader, full) = full_pipe();
    let err = full.try_clone().expect("the same pipe");
    let mut process = deployed(&dir, Stdio::null(), full.into(), err.into());
    let on = until(&heard, "ON");
    let off = until(&heard, "OFF");
    assert!(off.duration_since(on) < Duration::from_secs(4), "{heard:?}");
    assert_eq!(process.wait().expect("it ends").code(), Some(0));
    let record = matterixc_in(&dir, &["verify", "record"]);
    assert_eq!(record.code, 0, "{}{}", record.out, record.err);
}

#[test]
fn what_a_person_did_not_read_is_counted() {
    let (dir, _heard) = valve("held_left_out", TEXT);
    let (_reader, full) = full_pipe();
    let process = deployed(&dir, Stdio::null(), full.into(), Stdio::piped());
    let ended = process.wait_with_output().expect("it ends");
    let said = String::from_utf8_lossy(&ended.stderr);
    assert_eq!(ended.status.code(), Some(0), "{said}");
    assert!(said.contains("not shown because nobody read them; a journal has all of them"), "{said}");
}

#[test]
#[allow(clippy::disallowed_methods, reason = "how long devices wait is what is tested")]
fn a_stop_gets_through_a_terminal_that_stands_still() {
    for signals in [1, 2] {
        let (dir, heard) = valve("held_terminal", &TEXT.replacen("wait 1 s\n    shut", "wait 1 min\n    shut", 1));
        let (mut keyboard, screen) = terminal();
        let [stdin, out] = [(); 2].map(|()| screen.try_clone().expect("the same terminal"));
        let mut process = deployed(&dir, stdin.into(), out.into(), screen.into());
        let on = until(&heard, "ON");
        // Ctrl-S.
        keyboard.write_all(&[0x13]).expect("typed");
        std::thread::sleep(Duration::from_millis(1500));
        let begun = Instant::now();
        for _ in 0..signals {
            signal("-TERM", &process);
            std::thread::sleep(Duration::from_millis(20));
        }
        let code = process.wait().expect("it ends").code();
        assert!(begun.elapsed() < Duration::from_secs(5), "{:?}", begun.elapsed());
        assert_eq!(code, Some(1));
        if signals == 1 {
            assert!(until(&heard, "OFF").duration_since(on) < Duration::from_secs(5), "{heard:?}");
        }
        drop(File::from(OwnedFd::from(keyboard)));
    }
}

#[test]
fn a_process_that_stood_still_does_not_pass() {
    let (dir, heard) = valve("held_stopped", TEXT);
    let mut process = deployed(&dir, Stdio::null(), Stdio::null(), Stdio::piped());
    until(&heard, "ON");
    signal("-STOP", &process);
    std::thread::sleep(Duration::from_secs(4));
    signal("-CONT", &process);
    let mut said = String::new();
    process.stderr.take().expect("piped").read_to_string(&mut said).expect("text");
    assert_eq!(process.wait().expect("it ends").code(), Some(1), "{said}");
    let one_line = flat(&said);
    assert!(one_line.contains("error[diverged]") && one_line.contains("this program was paused for"), "{said}");
    let report = std::fs::read_to_string(dir.join("record/report.json")).expect("a report");
    assert!(report.contains("\"held_up\": [\n    {"), "{report}");
    let record = matterixc_in(&dir, &["verify", "record"]);
    assert_eq!(record.code, 0, "{}{}", record.out, record.err);
}

/// A command whose effect depends on what was before is not said twice, whether it moves matter or not; nor is one that says nothing of
/// what it does.
#[test]
fn what_counts_on_is_not_said_twice() {
    for (name, effect) in [("adds", "\n        effect place = place + 1"), ("unsaid", "\n        takes 1 s")] {
        let text = format!(
            "mtx 1\ncapability Sampler: Body {{\n    state place: Ratio = 1\n    command advance{effect}\n}}\n\
             asset Carousel: Sampler {{ mass: 1 kg }}\n\
             driver Line for Carousel over tcp(framing: line, timeout: 30 s) {{\n    advance sends \"NEXT\" expects \"DONE\"\n    \
             safe sends \"STOP\"\n}}\n\
             lab bench {{ ambient: 22 degC, vials = Carousel at (0, 0, 0) m }}\nworkflow next in bench {{ advance vials }}\n"
        );
        let device = Device::start(b'\n', |_, _| Answer::Nothing);
        let dir = bench(&format!("counts_{name}"), &text, "vials", &device.address);
        let mut process = command();
        process.current_dir(&dir).args([
            "deploy",
            "lab.mtx",
            "--bind",
            "lab.toml",
            "--mode",
            "real",
            "--journal",
            "journal",
        ]);
        let mut process = process.stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("the command starts");
        for _ in 0..2000 {
            if device.heard().iter().any(|line| line == "NEXT") {
                break;
            }
            std::thread::sleep(Duration::from_millis(5));
        }
        process.kill().expect("it can be killed");
        process.wait().expect("it ends");
        let args = ["deploy", "lab.mtx", "--bind", "lab.toml", "--mode", "real", "--journal", "journal", "--resume"];
        let ended = matterixc_in(&dir, &args);
        assert!(ended.code == 1 && ended.err.contains("it is unknown whether"), "{name}: {}", ended.err);
        assert_eq!(device.heard().iter().filter(|line| *line == "NEXT").count(), 1, "{name}");
    }
}
