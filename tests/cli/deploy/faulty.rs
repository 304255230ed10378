//! Devices that misbehave: each ends in a clear fault on its line, with what makes the device safe sent last.

use super::{Answer, Device, HEAT, bench, deploy};

/// A name, what the device answers, and the code of the fault that it is.
type Case = (&'static str, fn() -> Answer, &'static str);

/// What a plate answers that does as it is told.
pub fn plate(line: &str) -> Answer {
    Answer::Says(match line {
        "IN_NAME" => "RET \r\n",
        "OUT_WD1@60" => "60 \r\n",
        "OUT_WD2@0" => "0 \r\n",
        "IN_SP_1" => "50.0 1 \r\n",
        "IN_SP_4" => "300 4 \r\n",
        "IN_PV_2" => "25.0 2 \r\n",
        _ => return Answer::Nothing,
    })
}

/// Runs the plate's workflow on a plate that answers its third temperature and all after that like this.
fn with(name: &str, answer: impl Fn() -> Answer + Send + 'static) -> (crate::harness::Ended, Vec<String>) {
    let asked = std::sync::atomic::AtomicUsize::new(0);
    let device = Device::start(b'\n', move |line, _| {
        let third = line == "IN_PV_2" && asked.fetch_add(1, std::sync::atomic::Ordering::SeqCst) >= 2;
        if third { answer() } else { plate(line) }
    });
    let dir = bench(name, HEAT, "plate", &device.address);
    let ended = deploy(&dir, &["--mode", "real"]);
    // What was sent last may still be on its way.
    std::thread::sleep(std::time::Duration::from_millis(100));
    (ended, device.heard())
}

pub fn is_safe(heard: &[String]) -> bool {
    let stop = |word: &str| heard.iter().rposition(|l| l == word) > heard.iter().rposition(|l| l.starts_with("START"));
    stop("STOP_1") && stop("STOP_4")
}

#[test]
fn what_makes_no_sense_is_a_fault_and_leaves_the_device_safe() {
    let cases: [Case; 5] = [
        ("silent", || Answer::Nothing, "device-lost"),
        ("garbage", || Answer::Says("2\u{7f}x.3 2 \r\n"), "device-garbled"),
        ("other", || Answer::Says("25.0 1 \r\n"), "device-garbled"),
        ("half", || Answer::Says("25."), "device-garbled"),
        ("unplugged", || Answer::HangsUp, "device-lost"),
    ];
    for (name, answer, code) in cases {
        let (ended, heard) = with(&format!("faulty_{name}"), answer);
        assert_eq!(ended.code, 1, "{name}: {}", ended.err);
        assert!(ended.err.contains(&format!("error[{code}]")), "{name}: {}", ended.err);
        assert!(ended.err.contains("lab.mtx:12"), "{name} is shown on its line: {}", ended.err);
        assert!(is_safe(&heard), "{name}: {heard:?}");
    }
}

#[test]
fn a_set_point_that_the_device_changes_is_found() {
    let device = Device::start(b'\n', |line, _| match line {
        "IN_SP_1" => Answer::Says("45.0 1 \r\n"),
        other => plate(other),
    });
    let dir = bench("changed", HEAT, "plate", &device.address);
    let ended = deploy(&dir, &["--mode", "real"]);
    assert_eq!(ended.code, 1);
    assert!(ended.err.contains("error[diverged]") && ended.err.contains("45 degC"), "{}", ended.err);
    assert!(is_safe(&device.heard()));
}

const WEIGH: &str = "mtx 1
use std::balances::PrecisionBalance
lab bench { ambient: 22 degC, scale = PrecisionBalance at (0, 0, 0) m }
workflow weigh_it in bench {
    tare scale
    wait 1 s
    expect scale.net < 1 g
}
";

#[test]
fn an_overload_fails_a_command_and_is_a_fault_of_a_reading() {
    let cases = [("T", "T +\r\n", "run-failed"), ("S", "S +\r\n", "device-refused")];
    for (word, reply, code) in cases {
        let device = Device::start(b'\n', move |line, _| match line {
            "I4" | "@" => Answer::Says("I4 A \"1\"\r\n"),
            other if other == word => Answer::Says(reply),
            "T" => Answer::Says("T S 1.00 g\r\n"),
            _ => Answer::Says("S S 0.00 g\r\n"),
        });
        let dir = bench(&format!("overload_{word}"), WEIGH, "scale", &device.address);
        let ended = deploy(&dir, &["--mode", "real"]);
        assert_eq!(ended.code, 1);
        assert!(ended.err.contains(&format!("error[{code}]")), "{word}: {}", ended.err);
        assert!(ended.err.contains(reply.trim()), "{word}: {}", ended.err);
    }
}

#[test]
fn an_overload_of_a_plunger_is_a_failure_that_a_handler_takes() {
    let text = "mtx 1
use std::glassware::Beaker50mL
use std::pumps
lab bench {
    ambient: 22 degC
    pump = CavroXlp6000 at (0, 0, 0) m
    a = Beaker50mL at (1, 0, 0) m holding 20 mL of water
    between pump and a { piped: true, port: 1 }
}
workflow dose in bench {
    sequence { draw 1 mL from a by pump } on plunger_overload { note \"blocked\" }
}
";
    let device = Device::start(b'\r', |line, _| match line {
        "/1Q" => Answer::Says("/0i\u{3}\r\n"),
        _ => Answer::Says("/0@\u{3}\r\n"),
    });
    let quiet = Device::start(b'\r', |line, before| match line {
        "/1Q" if before < 3 => Answer::Says("/0`\u{3}\r\n"),
        "/1Q" => Answer::Says("/0i\u{3}\r\n"),
        _ => Answer::Says("/0@\u{3}\r\n"),
    });
    // While it is being initialised nothing can take it.
    let dir = bench("plunger_open", text, "pump", &device.address);
    crate::harness::write(
        &dir,
        "lab.toml",
        format!("[pump]\naddress = \"{}\"\ndriver = \"CavroDt\"\n", device.address),
    );
    let ended = deploy(&dir, &["--mode", "real"]);
    assert!(ended.code == 1 && ended.err.contains("device-refused"), "{}", ended.err);
    let dir = bench("plunger", text, "pump", &quiet.address);
    crate::harness::write(&dir, "lab.toml", format!("[pump]\naddress = \"{}\"\ndriver = \"CavroDt\"\n", quiet.address));
    let ended = deploy(&dir, &["--mode", "real"]);
    assert!(ended.code == 0 && ended.err.contains("blocked"), "{}", ended.err);
}
