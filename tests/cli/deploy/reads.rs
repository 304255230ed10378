//! Readings that get lost, come late or make no sense are asked for again; commands never are.

use std::io::{BufRead, BufReader, Write};
use std::net::TcpStream;
use std::sync::atomic::{AtomicUsize, Ordering};

use super::faulty::plate;
use super::{Answer, Device, Emulated, HEAT, bench, deploy};
use crate::harness::{flat, folder, write};

/// A plate that gets warm with its sixth temperature, and answers its third like this.
fn third(name: &str, answer: fn() -> Answer) -> (crate::harness::Ended, Vec<String>, String) {
    let asked = AtomicUsize::new(0);
    let device = Device::start(b'\n', move |line, _| match line {
        "IN_PV_2" => match asked.fetch_add(1, Ordering::SeqCst) {
            2 => answer(),
            0..=4 => plate(line),
            _ => Answer::Says("35.0 2 \r\n"),
        },
        other => plate(other),
    });
    let dir = bench(name, HEAT, "plate", &device.address);
    let ended = deploy(&dir, &["--mode", "real"]);
    let journal = std::fs::read_to_string(dir.join("journal")).expect("a journal");
    (ended, device.heard(), journal)
}

#[test]
fn one_reading_that_is_lost_or_garbled_is_asked_for_again() {
    /// What a device answers instead of a reading.
    type Spoiled = fn() -> Answer;
    let cases: [(&str, Spoiled); 7] = [
        ("lost", || Answer::Nothing),
        ("garbled", || Answer::Says("2\u{7f}x.3 2 \r\n")),
        ("half", || Answer::Says("25.")),
        ("dashes", || Answer::Says("----- 2 \r\n")),
        ("nan", || Answer::Says("NaN 2 \r\n")),
        ("hot", || Answer::Says("999.0 2 \r\n")),
        ("cold", || Answer::Says("-400.0 2 \r\n")),
    ];
    for (name, answer) in cases {
        let (ended, heard, journal) = third(&format!("reads_{name}"), answer);
        assert_eq!(ended.code, 0, "{name}: {}", ended.err);
        assert_eq!(journal.matches("\"event\":\"again\"").count(), 1, "{name}: {journal}");
        for command in ["START_1", "START_4"] {
            assert_eq!(heard.iter().filter(|l| *l == command).count(), 1, "{name}: {heard:?}");
        }
    }
}

#[test]
fn what_the_instrument_cannot_show_is_a_fault_where_it_stays_so() {
    for (name, reply, shown) in
        [("hot", "999.0 2 \r\n", "999 degC"), ("cold", "-400.0 2 \r\n", "-400 degC"), ("inf", "inf 2 \r\n", "inf")]
    {
        let device = Device::start(b'\n', move |line, _| match line {
            "IN_PV_2" => Answer::Says(reply),
            other => plate(other),
        });
        let dir = bench(&format!("reads_always_{name}"), HEAT, "plate", &device.address);
        let ended = deploy(&dir, &["--mode", "real"]);
        assert_eq!(ended.code, 1);
        assert!(ended.err.contains("error[device-garbled]") && ended.err.contains(shown), "{name}: {}", ended.err);
        assert_eq!(device.heard().iter().filter(|l| *l == "IN_PV_2").count(), 3, "{name}");
        assert!(super::faulty::is_safe(&device.heard()), "{name}");
    }
}

#[test]
fn a_command_that_is_not_answered_is_never_said_again() {
    let text = "mtx 1
use std::glassware::Beaker50mL
use std::pumps
lab bench {
    ambient: 22 degC
    pump = CavroXlp6000 at (0, 0, 0) m
    a = Beaker50mL at (1, 0, 0) m holding 20 mL of water
    between pump and a { piped: true, port: 1 }
}
workflow dose in bench { draw 1 mL from a by pump }
";
    let device = Device::start(b'\r', |line, _| match line {
        "/1I1A600R" => Answer::Nothing,
        _ => Answer::Says("/0`\u{3}\r\n"),
    });
    let dir = bench("reads_command", text, "pump", &device.address);
    crate::harness::write(
        &dir,
        "lab.toml",
        format!("[pump]\naddress = \"{}\"\ndriver = \"CavroDt\"\n", device.address),
    );
    let ended = deploy(&dir, &["--mode", "real"]);
    assert!(ended.code == 1 && ended.err.contains("error[device-lost]"), "{}", ended.err);
    assert_eq!(device.heard().iter().filter(|l| *l == "/1I1A600R").count(), 1);
}

const WEIGH: &str = "mtx 1
use std::balances::PrecisionBalance
lab bench { ambient: 22 degC, scale = PrecisionBalance at (0, 0, 0) m }
workflow weigh_it in bench {
    tare scale
    wait 1 s
    let m = scale.net
    note \"{m as g :.3}\"
    expect m < 5 g
}
";

#[test]
fn a_balance_tells_its_weight_in_the_unit_that_it_is_set_to() {
    for (name, reply) in [("g", "S S      1.25 g\r\n"), ("mg", "S S      1250 mg\r\n"), ("kg", "S S   0.00125 kg\r\n")]
    {
        let device = Device::start(b'\n', move |line, _| match line {
            "I4" | "@" => Answer::Says("I4 A \"1\"\r\n"),
            "T" => Answer::Says("T S 1.00 g\r\n"),
            _ => Answer::Says(reply),
        });
        let dir = bench(&format!("reads_unit_{name}"), WEIGH, "scale", &device.address);
        let ended = deploy(&dir, &["--mode", "real"]);
        assert!(ended.code == 0 && ended.err.contains("1.250"), "{name}: {}", ended.err);
    }
}

#[test]
fn an_emulated_balance_tells_its_weight_in_the_unit_that_it_is_set_to() {
    let text = "mtx 1
use std::balances::PrecisionBalance
use std::glassware::Beaker50mL
lab bench {
    ambient: 22 degC
    scale = PrecisionBalance { shows_in: UNIT } at (0, 0, 0) m
    beaker = Beaker50mL on scale holding 20 mL of water
}
workflow weigh_it in bench {
    let m = scale.net
    expect m in 40 g .. 60 g
    tare scale
    wait 2 s
    expect scale.net in -0.1 g .. 0.1 g
}
";
    for (unit, symbol, digits) in [("grams", "g", 2), ("milligrams", "mg", 0), ("kilograms", "kg", 5)] {
        let dir = bench(&format!("reads_shown_{unit}"), &text.replace("UNIT", unit), "scale", "");
        let emulated = Emulated::start(&dir, &["scale", "--file", "lab.mtx"]);
        write(&dir, "lab.toml", format!("[scale]\naddress = \"{}\"\n", emulated.address));
        // A balance may be set to another unit than the one that the text supposes.
        write(&dir, "lab.mtx", text.replace("UNIT", "grams"));
        let ended = deploy(&dir, &["--mode", "real", "--trace"]);
        assert_eq!(ended.code, 0, "{unit}: {}", ended.err);
        let answers = ended.out.lines().filter_map(|l| l.split("scale -> S S ").nth(1));
        let answers: Vec<&str> = answers.map(|l| l.trim_end_matches("\\r\\n").trim()).collect();
        assert!(!answers.is_empty(), "{unit}: {}", ended.out);
        for answer in answers {
            let (number, of) = answer.split_once(' ').expect("a unit");
            let shown = number.split_once('.').map_or(0, |(_, digits)| digits.len());
            assert!(of == symbol && shown == digits, "{unit}: {answer}");
        }
    }
}

#[test]
fn an_emulated_balance_answers_what_drivers_of_others_ask() {
    let dir = folder("deploy_reads_asked");
    let emulated = Emulated::start(&dir, &["PrecisionBalance"]);
    let line = TcpStream::connect(&emulated.address).expect("it answers");
    let mut answers = BufReader::new(line.try_clone().expect("a stream"));
    let asked = [
        ("@", "I4 A "),
        ("I0", "I0 A 1 \"S\""),
        ("I1", "I1 A \"01\""),
        ("I2", "I2 A "),
        ("I3", "I3 A "),
        ("I4", "I4 A "),
        ("S", "S S "),
        ("SI", "S D "),
        ("Z", "Z A"),
        ("ZI", "ZI S"),
        ("T", "T S 0.00 g"),
        ("TI", "TI S 0.00 g"),
        ("BLAH", "E"),
    ];
    for (question, begin) in asked {
        (&line).write_all(format!("{question}\r\n").as_bytes()).expect("said");
        let mut answer = String::new();
        answers.read_line(&mut answer).expect("answered");
        assert!(answer.starts_with(begin) && answer.ends_with("\r\n"), "{question}: {answer:?}");
    }
}

#[test]
fn a_balance_that_is_not_steady_is_asked_again_and_then_given_up() {
    for (name, reply) in [("busy", "S I\r\n"), ("dynamic", "S D      1.31 g\r\n")] {
        for (always, code) in [(false, 0), (true, 1)] {
            let asked = AtomicUsize::new(0);
            let device = Device::start(b'\n', move |line, _| match line {
                "I4" | "@" => Answer::Says("I4 A \"1\"\r\n"),
                "T" => Answer::Says("T S 1.00 g\r\n"),
                _ if always || asked.fetch_add(1, Ordering::SeqCst) == 0 => Answer::Says(reply),
                _ => Answer::Says("S S 1.25 g\r\n"),
            });
            let dir = bench(&format!("reads_{name}_{always}"), WEIGH, "scale", &device.address);
            let ended = deploy(&dir, &["--mode", "real"]);
            assert_eq!(ended.code, code, "{name} {always}: {}", ended.err);
            assert_eq!(ended.err.contains("error[device-refused]"), always, "{name}: {}", ended.err);
        }
    }
}

/// A heater that tells whether it is on, and is left alone for longer than it stays so.
const LAZY: &str = "mtx 1
capability Hot { state active: Bool = false { counts_as: running }
    command warm effect active = true
    command cool effect active = false }
asset Box: Hot { }
driver BoxLine for Box over tcp(framing: lf, timeout: 1 s) {
    warm sends \"ON\" expects \"OK\"
    cool sends \"OFF\" expects \"OK\"
    reading active asks \"A?\" expects \"{1 = true | 0 = false}\"
    safe sends \"SAFE\" expects \"OK\"
}
lab bench { ambient: 22 degC, box = Box }
workflow warm_it in bench {
    warm box
    wait 13 s
    cool box
} finally { cool box; wait 11 s }
";

#[test]
fn a_device_that_switches_itself_off_while_a_plan_waits_is_noticed() {
    let asked = AtomicUsize::new(0);
    let device = Device::start(b'\n', move |line, _| match line {
        "A?" => Answer::Says(if asked.fetch_add(1, Ordering::SeqCst) == 0 { "1\n" } else { "0\n" }),
        _ => Answer::Says("OK\n"),
    });
    let dir = bench("reads_lazy", LAZY, "box", &device.address);
    let given = ["deploy", "lab.mtx", "--bind", "lab.toml", "--mode", "real", "--record", "record"];
    let ended = crate::harness::matterixc_in(&dir, &given);
    let said = flat(&ended.err);
    assert!(ended.code == 1 && said.contains("error[diverged]"), "{said}");
    assert!(said.contains("`box.active` is false on the device, but it was set to true"), "{said}");
    assert!(!said.contains("finally"), "it is carried out whole: {said}");
    assert_eq!(device.heard().iter().filter(|line| *line == "OFF").count(), 1, "{:?}", device.heard());
    let record = crate::harness::matterixc_in(&dir, &["verify", "record"]);
    assert_eq!(record.code, 0, "{}{}", record.out, record.err);
}

/// A box that tells two plain numbers.
const BOX: &str = "mtx 1
capability Tells { reading temperature: Temperature = 25 degC
    reading load: Ratio = 300 }
asset Box: Tells { }
driver BoxLine for Box over tcp(framing: lf, timeout: 1 s) {
    reading temperature asks \"T?\" expects \"{degC}\"
    reading load asks \"L?\" expects \"{}\"
}
lab bench { ambient: 22 degC, box = Box }
workflow look in bench {
    let t = box.temperature
    let l = box.load
    expect t in 24.9 degC .. 25.1 degC
    expect l in 299 .. 301
}
";

/// Deploys on a box that answers its first questions so late, one after the other, and breathes without end where it is restless.
fn slow(name: &str, lags: &'static [u64], is_restless: bool) -> crate::harness::Ended {
    let listener = std::net::TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = listener.local_addr().expect("an address").to_string();
    std::thread::spawn(move || {
        for stream in listener.incoming().flatten() {
            let mut out = stream.try_clone().expect("a stream");
            let mut asked = BufReader::new(stream).lines();
            let mut lags = lags.iter();
            while let Some(Ok(line)) = asked.next() {
                if let Some(lag) = lags.next() {
                    std::thread::sleep(std::time::Duration::from_millis(*lag));
                }
                let answer = if line == "T?" { "25.0\n" } else { "300\n" };
                if out.write_all(answer.as_bytes()).is_err() {
                    break;
                }
                let mut breath = out.try_clone().expect("a stream");
                if is_restless {
                    std::thread::spawn(move || {
                        while breath.write_all(b" ").is_ok() {
                            std::thread::sleep(std::time::Duration::from_millis(300));
                        }
                    });
                    std::thread::sleep(std::time::Duration::from_secs(60));
                }
            }
        }
    });
    let dir = bench(&format!("reads_slow_{name}"), BOX, "box", &address);
    super::deploy_at("1", &dir, &["--mode", "real"])
}

#[test]
fn a_late_answer_to_one_question_is_never_that_to_another() {
    let cases: [(&str, &[u64]); 3] = [("once", &[2100, 1500]), ("long", &[4100, 1200]), ("twice", &[2200, 900])];
    std::thread::scope(|all| {
        for (name, lags) in cases {
            all.spawn(move || {
                let ended = slow(name, lags, false);
                assert!(ended.code == 0 && ended.err.contains("2 met"), "{name}: {}", ended.err);
            });
        }
    });
}

#[test]
fn a_line_that_owes_an_answer_and_is_never_silent_is_named() {
    let ended = slow("restless", &[2100, 60_000], true);
    let said = flat(&ended.err);
    assert!(ended.code == 1 && said.contains("error[device-garbled]"), "{said}");
    assert!(said.contains("it still owes a reply to `T?`: nothing else is sent before"), "{said}");
}
