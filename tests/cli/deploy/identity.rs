//! Devices say which one of their kind they are: another one than is bound, or than was there before, is told nothing.

use super::unreached::{Door, SLOW, WEIGH, killed};
use super::{Answer, Device, bench, deploy, deploy_at, lines};
use crate::harness::{flat, matterixc_in, write};

/// A balance with this answer to the question for its serial number.
fn balance(serial: &'static str) -> Device {
    Device::start(b'\n', move |line, _| match line {
        "I4" | "@" => Answer::Says(serial),
        "T" => Answer::Says("T S 0.00 g\r\n"),
        "S" => Answer::Says("S S 0.00 g\r\n"),
        _ => Answer::Nothing,
    })
}

const FIRST: &str = "I4 A \"B9021\"\r\n";
const SECOND: &str = "I4 A \"B9034\"\r\n";

#[test]
fn a_journal_is_not_gone_on_with_on_another_device() {
    let (first, second) = (balance(FIRST), balance(SECOND));
    let dir = bench("swapped", WEIGH, "scale", &first.address);
    killed(&dir);
    let before = std::fs::read_to_string(dir.join("journal")).expect("a journal");
    // As often as somebody tries: what the wrong one said does not count the next time.
    for _ in 0..2 {
        write(&dir, "lab.toml", format!("[scale]\naddress = \"{}\"\n", second.address));
        let ended = deploy_at(SLOW, &dir, &["--mode", "real", "--resume"]);
        let flat = flat(&ended.err);
        assert_eq!(ended.code, 1, "{flat}");
        assert!(flat.contains("error[other-device]: `scale` is another device"), "{flat}");
        assert!(flat.contains("`B9034`, but `B9021` was there before"), "{flat}");
        assert!(ended.err.contains("lab.toml:2:11") && ended.err.contains("with `--resume`"), "{}", ended.err);
    }
    assert_eq!(second.heard(), ["I4", "I4"], "it is asked who it is, and nothing else");
    let after = std::fs::read_to_string(dir.join("journal")).expect("a journal");
    assert!(lines(&after).starts_with(lines(&before)) && !after.contains("\"event\":\"end\""), "{after}");
    write(&dir, "lab.toml", format!("[scale]\naddress = \"{}\"\n", first.address));
    let ended = deploy_at(SLOW, &dir, &["--mode", "real", "--resume"]);
    assert_eq!(ended.code, 0, "{}{}", ended.out, ended.err);
}

/// Two balances, where each says who it is: nobody has to know which one was moved where.
#[test]
fn balances_that_were_exchanged_or_both_moved_are_told_apart() {
    let two = WEIGH
        .replace(", scale =", "\n left = PrecisionBalance at (1, 0, 0) m\n scale =")
        .replace(" }\nwork", "\n}\nwork");
    let two = two.replace("    tare scale\n", "    tare left\n    tare scale\n");
    for moved in [true, false] {
        let (first, second) = (balance(FIRST), balance(SECOND));
        let dir = bench(&format!("two_{moved}"), &two, "left", "");
        let bound = |left: &str, right: &str| format!("[left]\naddress = \"{left}\"\n[scale]\naddress = \"{right}\"\n");
        write(&dir, "lab.toml", bound(&first.address, &second.address));
        killed(&dir);
        let doors = [&first, &second].map(|device| Door::at(&device.address));
        let now = match moved {
            true => bound(&doors[0].address, &doors[1].address),
            false => bound(&doors[1].address, &doors[0].address),
        };
        write(&dir, "lab.toml", now);
        let ended = deploy_at(SLOW, &dir, &["--mode", "real", "--resume"]);
        match moved {
            true => assert_eq!(ended.code, 0, "{}{}", ended.out, ended.err),
            false => assert!(ended.code == 1 && ended.err.contains("error[other-device]"), "{}", ended.err),
        }
    }
}

#[test]
fn a_device_that_the_bindings_name_is_told_from_others() {
    let (first, second) = (balance(FIRST), balance(SECOND));
    let dir = bench("named", &WEIGH.replace("40 s", "1 s"), "scale", "");
    let bound = |device: &Device| {
        write(&dir, "lab.toml", format!("[scale]\naddress = \"{}\"\nidentity = \"B9021\"\n", device.address));
        let _ = std::fs::remove_file(dir.join("journal"));
        deploy(&dir, &["--mode", "real"])
    };
    let ended = bound(&second);
    let flat = flat(&ended.err);
    assert_eq!(ended.code, 1, "{flat}");
    assert!(
        flat.contains("error[other-device]: `scale`: it identifies as `B9034`, but `B9021` is bound here"),
        "{flat}"
    );
    assert!(!flat.contains("could not be made safe"), "{flat}");
    assert_eq!(second.heard(), ["I4"]);
    let ended = bound(&first);
    assert_eq!(ended.code, 0, "{}{}", ended.out, ended.err);
    assert!(first.heard().len() > 3, "{:?}", first.heard());
}

/// An answer that got lost is asked for again, as moves nothing; one that never comes ends it before anything is said.
#[test]
fn who_a_device_is_is_asked_again() {
    let device = Device::start(b'\n', |line, before| match (line, before) {
        ("I4", 0) => Answer::Says("I4 A \"B90\r\n"),
        ("I4" | "@", _) => Answer::Says(FIRST),
        ("T", _) => Answer::Says("T S 0.00 g\r\n"),
        ("S", _) => Answer::Says("S S 0.00 g\r\n"),
        _ => Answer::Nothing,
    });
    let dir = bench("who", &WEIGH.replace("40 s", "1 s"), "scale", &device.address);
    let ended = deploy(&dir, &["--mode", "real"]);
    assert_eq!(ended.code, 0, "{}{}", ended.out, ended.err);
    assert_eq!(device.heard()[..3], ["I4", "I4", "@"]);
}

const PLAIN: &str = "mtx 1
capability Opens: Body {
    state opened: Bool = false
    command unlock
        effect opened = true
}
asset Valve: Opens {
    mass: 1 kg
    shape: box(10 mm, 10 mm, 10 mm)
}
driver ValveLine for Valve over serial(baud: 9600, frame: \"8N1\", framing: cr, timeout: 1 s) {
    LINE
    unlock sends \"OPEN\"
    safe sends \"SHUT\"
}
lab bench { ambient: 22 degC, valve = Valve at (0, 0, 0) m }
workflow w in bench { unlock valve }
";

#[test]
fn what_asks_for_an_identity_keeps_a_word_of_the_answer() {
    let dir = bench("asks", &PLAIN.replace("LINE", ""), "valve", "localhost:1");
    write(&dir, "lab.toml", "[valve]\naddress = \"localhost:1\"\nidentity = \"7\"\n");
    let ended = deploy(&dir, &[]);
    assert_eq!(ended.code, 1, "{}", ended.err);
    assert!(ended.err.contains("the driver `ValveLine` cannot ask `valve` for its identity"), "{}", ended.err);
    for (line, said) in [
        ("identity sends \"ID\" expects \"ID {_}\"", "`identity` must keep a word of the reply"),
        ("identity sends \"ID\"", "`identity` must keep a word of the reply"),
        ("identity sends \"A\", \"B\" expects \"{<serial>}\"", "`identity` needs exactly one message"),
    ] {
        write(&dir, "lab.mtx", PLAIN.replace("LINE", line));
        let ended = matterixc_in(&dir, &["check", "lab.mtx"]);
        assert!(ended.code == 1 && ended.out.contains(said), "{line}: {}{}", ended.out, ended.err);
    }
    write(&dir, "lab.mtx", PLAIN.replace("LINE", "identity sends \"ID\" expects \"ID {<serial>}\""));
    let ended = matterixc_in(&dir, &["check", "lab.mtx"]);
    assert_eq!(ended.code, 0, "{}{}", ended.out, ended.err);
    let ended = deploy(&dir, &[]);
    assert!(ended.code == 0 && ended.out.contains("valve <- ID"), "{}{}", ended.out, ended.err);
}
