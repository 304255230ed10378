//! What a device is believed: that it stopped, that it is the same one, that what it says by itself is of now, that it is there at all.

use std::io::{BufRead, BufReader, Write};
use std::net::{Shutdown, TcpListener, TcpStream};
use std::path::Path;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use super::{Answer, Device, bench, deploy_at};
use crate::harness::{Ended, flat, write};

/// A pump and a plate that tell what they do; each says who it is.
const LAB: &str = "mtx 1
capability Doser: Body {
    state going: Bool = false
    command run
        effect going = true
    command rest
        effect going = false
    ends not going else left_pumping \"stop it\"
}
asset MyDoser: Doser { mass: 2 kg }
driver DoserLine for MyDoser over tcp(framing: cr, timeout: 300 ms) {
    identity sends \"ID?\" expects \"ID {<serial>}\"
    run sends \"R\" expects \"OK\"
    rest sends \"H\" expects \"OK\"
    reading going asks \"G?\" expects \"G {0 = false | 1 = true}\"
    reply \"ERR {_}\" fails refused
    safe sends \"H\" expects \"OK\"
}
lab bench { ambient: 22 degC, pump = MyDoser at (1, 0, 0) m, other = MyDoser at (2, 0, 0) m }
workflow go in bench { run pump; wait 500 ms; rest pump }
workflow breaks in bench { run pump; wait 200 ms; expect pump.going; rest pump; run other; run other; rest other }
";

/// Runs a workflow of the lab on a pump and another one.
fn goes(dir: &Path, workflow: &str, pump: &str, other: &str, more: &str) -> Ended {
    write(dir, "lab.toml", format!("[pump]\naddress = \"{pump}\"\n{more}[other]\naddress = \"{other}\"\n"));
    deploy_at("1", dir, &["--mode", "real", "--workflow", workflow])
}

/// A pump that does what it is told, but for what `hook` answers.
fn doser(serial: &'static str, hook: impl Fn(&str, usize) -> Option<Answer> + Send + 'static) -> Device {
    let going = Mutex::new(false);
    Device::start(b'\r', move |line, before| {
        let mut going = going.lock().expect("not poisoned");
        if let Some(answer) = hook(line, before) {
            return answer;
        }
        match line {
            "ID?" => Answer::Says(serial),
            "G?" => Answer::Says(if *going { "G 1\r" } else { "G 0\r" }),
            "R" | "H" => {
                *going = line == "R";
                Answer::Says("OK\r")
            }
            _ => Answer::Says("ERR 2\r"),
        }
    })
}

#[test]
fn a_device_that_goes_on_after_it_took_safe_is_named() {
    // It says that it stops and does not, as under local control; the other one ends the run.
    let pump = doser("ID A\r", |line, _| (line == "H").then_some(Answer::Says("OK\r")));
    let other = doser("ID B\r", |line, _| (line == "R").then_some(Answer::HangsUp));
    let dir = bench("believed_safe", LAB, "pump", "");
    let text = LAB.replace("expect pump.going; rest pump; ", "");
    write(&dir, "lab.mtx", text);
    let ended = goes(&dir, "breaks", &pump.address, &other.address, "");
    let said = flat(&ended.err);
    assert_eq!(ended.code, 1, "{said}");
    let wanted =
        "could not be made safe: `pump`: it accepted the `safe` command, but still reports that it is left pumping";
    assert!(said.contains(wanted), "{said}");
}

/// One half of what should hold that is known to be broken decides it, whatever the driver does not tell.
#[test]
fn what_is_known_of_the_end_decides_whether_a_device_is_safe() {
    let pump = doser("ID A\r", |line, _| (line == "H").then_some(Answer::Says("OK\r")));
    let other = doser("ID B\r", |line, _| (line == "R").then_some(Answer::HangsUp));
    let dir = bench("believed_half", LAB, "pump", "");
    let text = LAB
        .replace("expect pump.going; rest pump; ", "")
        .replace("state going", "state warm: Bool = false\n    state going")
        .replace("ends not going", "ends not (going or warm)");
    write(&dir, "lab.mtx", text);
    let ended = goes(&dir, "breaks", &pump.address, &other.address, "");
    let said = flat(&ended.err);
    assert!(
        ended.code == 1 && said.contains("could not be made safe: `pump`: it accepted the `safe` command"),
        "{said}"
    );
}

/// What a device is at the end is judged by what it shows, also where that is a reading of a true value.
#[test]
fn a_reading_says_how_a_device_is_at_the_end() {
    const FURNACE: &str = "mtx 1
capability Furnace {
    state hot: Bool = false
    state temp: Temperature = 25 degC
    reading temperature: Temperature = temp
    command heat
        effect hot = true
    command cool
        effect hot = false
    ends temp <= 60 degC else left_hot \"cool it\"
}
asset Oven: Furnace
driver OvenLine for Oven over tcp(framing: cr, timeout: 300 ms) {
    heat sends \"ON\" expects \"OK\"
    cool sends \"OFF\" expects \"OK\"
    reading temperature asks \"T?\" expects \"T={degC}\"
    safe sends \"OFF\" expects \"OK\"
}
lab bench { ambient: 22 degC, f = Oven }
workflow go in bench { heat f; wait 300 ms; cool f }
";
    let hot = Mutex::new(false);
    let device = Device::start(b'\r', move |line, _| {
        let mut hot = hot.lock().expect("not poisoned");
        *hot |= line == "ON";
        match line {
            "T?" => Answer::Says(if *hot { "T=150.0\r" } else { "T=25.0\r" }),
            _ => Answer::Says("OK\r"),
        }
    });
    let dir = bench("believed_shown", FURNACE, "f", &device.address);
    let ended = deploy_at("1", &dir, &["--mode", "real"]);
    let said = flat(&ended.err);
    assert!(ended.code == 1 && said.contains("`f` is left hot"), "{said}");
    assert!(
        said.contains(
            "could not be made safe: `f`: it accepted the `safe` command, but still reports that it is left hot"
        ),
        "{said}"
    );
}

#[test]
fn an_answer_that_looks_like_what_is_said_unasked_is_refused() {
    const HOSTED: &str = "mtx 1
capability Host: Body {
    state chamber: Temperature = 25 degC
    reading inside: Temperature = chamber
}
capability Probe: Body {
    state t: Temperature = 25 degC
    reading temperature: Temperature = t
}
asset Tip: Probe { mass: 1 kg }
asset Box: Host { mass: 1 kg, left = Tip { } }
driver HostLine for Box over tcp(framing: cr, timeout: 2 s) { reading inside hears \"T={degC}\" every 1 s }
driver TipLine for Tip over HostLine { reading temperature asks \"A?\" expects \"T={degC}\" }
lab bench { ambient: 22 degC, h = Box at (0, 0, 0) m }
workflow go in bench { let a = h.left.temperature; note \"{a}\" }
";
    let dir = bench("believed_alike", HOSTED, "h", "localhost:1");
    let ended = deploy_at("1", &dir, &[]);
    let said = flat(&ended.err);
    let wanted = "the reply `T={degC}` that `TipLine` expects looks like a message that `HostLine` sends by itself";
    assert!(ended.code == 1 && said.contains(wanted), "{said}");
    write(&dir, "lab.mtx", HOSTED.replace("expects \"T=", "expects \"A="));
    let ended = deploy_at("1", &dir, &[]);
    assert_eq!(ended.code, 0, "{}", ended.err);
}

/// Two devices with addresses on one line, which is cut while both are on: when it is back, another one has the second address.
#[test]
fn whoever_shares_a_line_that_was_opened_anew_is_asked_too() {
    let text = LAB
        .replace("driver DoserLine", "framing addressed { carries: text, request: \"{address}:{data}\\r\", reply: \"{address}:{data}\\r\" }\ndriver DoserLine")
        .replace("tcp(framing: cr, timeout: 300 ms)", "tcp(framing: addressed, timeout: 300 ms, address: 1)");
    let text = text.replace("workflow go in bench { run pump;", "workflow go in bench { run other; run pump;");
    let heard = Arc::new(Mutex::new(Vec::new()));
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = listener.local_addr().expect("an address").to_string();
    let told = Arc::clone(&heard);
    std::thread::spawn(move || {
        for (turn, stream) in listener.incoming().flatten().enumerate() {
            let mut out = stream.try_clone().expect("a stream");
            for line in BufReader::new(stream).split(b'\r').map_while(Result::ok) {
                let line = String::from_utf8_lossy(&line).into_owned();
                told.lock().expect("not poisoned").push((turn, line.clone()));
                let (unit, said) = line.split_once(':').expect("an address");
                let answer = match (said, unit, turn) {
                    ("ID?", "2", 1..) => "ID ZZ".to_owned(),
                    ("ID?", unit, _) => format!("ID {unit}"),
                    ("G?", ..) => "G 0".to_owned(),
                    ("H", "1", 0) => {
                        let _ = out.shutdown(Shutdown::Both);
                        break;
                    }
                    _ => "OK".to_owned(),
                };
                if out.write_all(format!("{unit}:{answer}\r").as_bytes()).is_err() {
                    break;
                }
            }
        }
    });
    let dir =
        bench("believed_shared", &text.replace("reading going asks", "reading going while not going asks"), "pump", "");
    let bindings = format!("[pump]\naddress = \"{address}\"\n[other]\naddress = \"{address}\"\nunit = \"2\"\n");
    write(&dir, "lab.toml", bindings);
    let ended = deploy_at("1", &dir, &["--mode", "real", "--workflow", "go"]);
    let said = flat(&ended.err);
    assert!(ended.code == 1 && said.contains("could not be made safe: `other`: it identifies as `ZZ`"), "{said}");
    let heard = heard.lock().expect("not poisoned");
    let later: Vec<&str> = heard.iter().filter(|(turn, _)| *turn > 0).map(|(_, line)| line.as_str()).collect();
    assert!(later.contains(&"2:ID?") && !later.contains(&"2:H"), "{later:?}");
}

#[test]
fn a_device_that_is_on_at_the_end_is_made_safe() {
    // Somebody starts it again at its panel after the plan has stopped it.
    let asked = Mutex::new(0);
    let pump = doser("ID A\r", move |line, _| {
        let mut asked = asked.lock().expect("not poisoned");
        *asked += usize::from(line == "H");
        (line == "G?" && *asked == 1).then_some(Answer::Says("G 1\r"))
    });
    let other = doser("ID B\r", |_, _| None);
    let dir =
        bench("believed_end", &LAB.replace("reading going asks", "reading going while not going asks"), "pump", "");
    let ended = goes(&dir, "go", &pump.address, &other.address, "");
    let said = flat(&ended.err);
    assert!(ended.code == 1, "{said}");
    assert_eq!(pump.heard().iter().filter(|line| *line == "H").count(), 2, "{:?} {said}", pump.heard());
}

#[test]
fn a_device_that_answers_nothing_at_the_start_ends_the_run() {
    let pump = doser("ID A\r", |_, _| None);
    for (answer, code) in
        [(None, "device-lost"), (Some("G 7\r"), "device-garbled"), (Some("ERR 9\r"), "device-refused")]
    {
        // What it shows makes no sense from beginning to end: nobody knows at the end whether it is off.
        let other =
            doser("ID B\r", move |line, _| (line == "G?").then(|| answer.map_or(Answer::Nothing, Answer::Says)));
        let dir = bench(&format!("believed_{code}"), LAB, "pump", "");
        let ended = goes(&dir, "go", &pump.address, &other.address, "");
        assert_eq!(ended.code, 1, "{}", ended.err);
        assert!(ended.err.contains(&format!("error[{code}]: `other`")), "{code}: {}", ended.err);
    }
}

/// What devices heard, each by its serial number.
type Heard = Vec<(&'static str, String)>;

/// A line whose devices change places when one of them has been told to begin: whoever connects again meets the other.
fn exchanged() -> (String, Arc<Mutex<Heard>>) {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = listener.local_addr().expect("an address").to_string();
    let heard = Arc::new(Mutex::new(Vec::new()));
    let told = Arc::clone(&heard);
    std::thread::spawn(move || {
        for (turn, stream) in listener.incoming().flatten().enumerate() {
            let serial = if turn == 0 { "A" } else { "B" };
            meet(stream, serial, &told);
        }
    });
    (address, heard)
}

fn meet(stream: TcpStream, serial: &'static str, heard: &Mutex<Heard>) {
    let mut out = stream.try_clone().expect("a stream");
    let mut going = false;
    for line in BufReader::new(stream).split(b'\r').map_while(Result::ok) {
        let line = String::from_utf8_lossy(&line).into_owned();
        heard.lock().expect("not poisoned").push((serial, line.clone()));
        let answer = match line.as_str() {
            "ID?" => format!("ID {serial}\r"),
            "G?" => format!("G {}\r", u8::from(going)),
            // The hub resets while the pump goes.
            "H" if serial == "A" => {
                let _ = out.shutdown(Shutdown::Both);
                return;
            }
            _ => {
                going = line == "R";
                "OK\r".to_owned()
            }
        };
        if out.write_all(answer.as_bytes()).is_err() {
            return;
        }
    }
}

#[test]
fn another_device_behind_the_line_is_not_made_safe_in_place_of_the_one_that_goes_on() {
    for bound in ["identity = \"A\"\n", ""] {
        let (address, heard) = exchanged();
        let other = doser("ID C\r", |_, _| None);
        let dir = bench(&format!("believed_same_{}", bound.len()), LAB, "pump", "");
        let ended = goes(&dir, "go", &address, &other.address, bound);
        let said = flat(&ended.err);
        assert_eq!(ended.code, 1, "{said}");
        assert!(said.contains("could not be made safe: `pump`: it identifies as `B`, but `A`"), "{said}");
        let heard = heard.lock().expect("not poisoned");
        let to_other: Vec<&str> = heard.iter().filter(|(of, _)| *of == "B").map(|(_, line)| line.as_str()).collect();
        assert!(!to_other.is_empty() && to_other.iter().all(|line| *line == "ID?"), "{to_other:?}");
    }
}

#[test]
fn two_bindings_are_not_the_same_device() {
    let dir = bench("believed_twice", LAB, "pump", "");
    let one = "identity = \"A\"\n";
    write(
        &dir,
        "lab.toml",
        format!("[pump]\naddress = \"localhost:1\"\n{one}[other]\naddress = \"localhost:2\"\n{one}"),
    );
    let ended = deploy_at("1", &dir, &["--workflow", "go"]);
    assert!(ended.code == 1 && ended.err.contains("`other` and `pump` cannot both be `A`"), "{}", ended.err);
}

/// A balance that tells its weight by itself.
const STREAM: &str = "mtx 1
capability Streamer: Body {
    state zeroed: Bool = false
    param supposed: Mass = 10 g
    reading net: Mass = supposed
    command zero
        effect zeroed = true
}
asset My: Streamer { mass: 1 kg }
driver MyLine for My over tcp(framing: cr, timeout: 2 s) {
    zero sends \"T\" expects \"OK\"
    reading net hears \"N {g in -1 .. 2000}\" every 200 ms
}
lab bench { ambient: 22 degC, v = My at (0, 0, 0) m }
workflow waits in bench {
    let a = v.net
    wait 4 s
    let b = v.net
    note \"weighed {b - a as g :.3} g\"
}
workflow at_once in bench { let a = v.net; zero v; let b = v.net; note \"weighed {b as g :.3} g\" }
workflow zeroes in bench { let a = v.net; wait 300 ms; zero v; let b = v.net; note \"weighed {b as g :.3} g\" }
";

/// It tells how long it has been there, in s as g, so often; `T` sets it to 0.
#[allow(clippy::disallowed_methods, reason = "a device lives by the clock of the room")]
fn streamer(every: Duration) -> String {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = listener.local_addr().expect("an address").to_string();
    let since = Arc::new(Mutex::new(std::time::Instant::now() - Duration::from_secs(20)));
    std::thread::spawn(move || {
        for stream in listener.incoming().flatten() {
            let (mut out, mut answers) = (stream.try_clone().expect("a stream"), stream.try_clone().expect("a stream"));
            let begun = Arc::clone(&since);
            std::thread::spawn(move || {
                let passed = || begun.lock().expect("not poisoned").elapsed().as_secs_f64();
                while out.write_all(format!("N {:.3}\r", passed()).as_bytes()).is_ok() {
                    std::thread::sleep(every);
                }
            });
            for _ in BufReader::new(stream).split(b'\r').map_while(Result::ok) {
                *since.lock().expect("not poisoned") = std::time::Instant::now();
                let _ = answers.write_all(b"OK\r");
            }
        }
    });
    address
}

#[test]
fn what_a_device_says_by_itself_is_of_now() {
    for (workflow, every, passed) in
        [("waits", 5, 3.7..4.3), ("waits", 200, 3.7..4.3), ("zeroes", 200, 0.0..0.5), ("at_once", 200, 0.0..0.5)]
    {
        let dir = bench(&format!("believed_{workflow}_{every}"), STREAM, "v", &streamer(Duration::from_millis(every)));
        let ended = deploy_at("1", &dir, &["--mode", "real", "--workflow", workflow]);
        let said = ended.err.split("weighed ").nth(1).and_then(|rest| rest.split(' ').next());
        let told: f64 = said.and_then(|n| n.parse().ok()).unwrap_or_else(|| panic!("{}{}", ended.out, ended.err));
        assert!(passed.contains(&told), "{workflow} every {every} ms: {}{}", ended.out, ended.err);
    }
}
