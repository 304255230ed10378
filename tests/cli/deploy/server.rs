//! Devices behind a server: a recorded exchange is replayed, strictly, and what servers refuse becomes the right failure.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::PathBuf;
use std::sync::{Arc, Mutex};

use serde_json::{Value, json};

use super::{Emulated, deploy};
use crate::harness::{Ended, flat, folder, matterixc_in, write};

/// A transfer on an OT-2, and what its server was asked and answered: recorded by `tests/peers/robot_server.py`, where the run
/// engine of Opentrons 8.8.2 answers.
const TRANSFER: &str = include_str!("../../deploy/transfer.mtx");
const RECORDED: &str = include_str!("../../deploy/transfer.jsonl");

/// The same with every module, and labware on modules, on an adapter and on a block.
const MODULES: &str = include_str!("../../deploy/modules.mtx");
const RECORDED_MODULES: &str = include_str!("../../deploy/modules.jsonl");

/// What becomes of one command.
#[derive(Clone)]
enum Spoiled {
    /// It is answered with this status and body.
    Says(u16, Value),
    /// It is taken, and fails so.
    Fails(Value),
    /// Nobody answers any more.
    Cut,
}

/// A server that knows one exchange: everything else is noted as wrong. Asking again for the same is allowed.
struct Replay {
    address: String,
    wrong: Arc<Mutex<Vec<String>>>,
    left: Arc<Mutex<usize>>,
}

fn replay(recorded: &str, spoiled: Option<(&'static str, Spoiled)>) -> Replay {
    let mut recorded: Vec<Value> = recorded.lines().map(|l| serde_json::from_str(l).expect("recorded")).collect();
    // Whether a person has stopped it is asked for by the clock.
    recorded.retain(|e| !looks(e["method"].as_str().unwrap_or_default(), e["path"].as_str().unwrap_or_default()));
    recorded.iter_mut().for_each(|e| placed(&mut e["body"]));
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = listener.local_addr().expect("an address").to_string();
    let (wrong, left) = (Arc::new(Mutex::new(Vec::new())), Arc::new(Mutex::new(recorded.len())));
    let (told, rest) = (Arc::clone(&wrong), Arc::clone(&left));
    std::thread::spawn(move || {
        let (mut next, mut stopped) = (0, false);
        for stream in listener.incoming().flatten() {
            serve(stream, &recorded, (&mut next, &mut stopped), spoiled.as_ref(), &told);
            *rest.lock().expect("not poisoned") = recorded.len() - next;
        }
    });
    Replay { address, wrong, left }
}

/// Writes out how far a place in a well is from its origin: what is left out is none.
fn placed(body: &mut Value) {
    if let Some(location) = body.pointer_mut("/data/params/wellLocation") {
        for axis in ["x", "y", "z"] {
            let off = location["offset"][axis].as_f64().unwrap_or(0.0);
            location["offset"][axis] = off.into();
        }
    }
}

/// Whether a request asks how a run stands.
fn looks(method: &str, path: &str) -> bool {
    method == "GET" && path.starts_with("/runs/") && path.matches('/').count() == 2
}

/// Serves one connection.
fn serve(
    stream: TcpStream,
    recorded: &[Value],
    (next, stopped): (&mut usize, &mut bool),
    spoiled: Option<&(&str, Spoiled)>,
    wrong: &Mutex<Vec<String>>,
) {
    let mut out = stream.try_clone().expect("a stream");
    let mut reader = BufReader::new(stream);
    while let Some((method, path, version, mut body)) = request(&mut reader) {
        placed(&mut body);
        let name = body["data"]["commandType"].as_str().unwrap_or_default().to_owned();
        let expected = recorded.get(*next);
        let same = |e: &Value| e["method"] == method.as_str() && e["path"] == path.as_str() && e["body"] == body;
        *stopped |= body["data"]["actionType"] == "stop";
        let (status, answer) = match (expected, spoiled) {
            _ if looks(&method, &path) => {
                (200, json!({ "data": { "status": if *stopped { "stopped" } else { "running" } } }))
            }
            _ if version != "4" => (422, json!({ "errors": [{ "id": "InvalidRequest", "detail": "no version" }] })),
            (Some(e), Some((at, how))) if same(e) && *at == name => match how {
                Spoiled::Cut => return,
                Spoiled::Says(status, answer) => (*status, answer.clone()),
                Spoiled::Fails(error) => (201, json!({ "data": { "id": "x", "status": "failed", "error": error } })),
            },
            (Some(e), _) if same(e) => {
                *next += 1;
                (e["status"].as_u64().expect("a status") as u16, e["answer"].clone())
            }
            // After what was spoiled only what leaves the robot safe is of interest.
            (_, Some(_)) => (201, json!({ "data": { "id": "y", "status": "succeeded" } })),
            _ => {
                let wanted = expected.map(Value::to_string).unwrap_or_default();
                wrong.lock().expect("not poisoned").push(format!("{method} {path} {body}, not {wanted}"));
                (500, json!({}))
            }
        };
        let text = answer.to_string();
        let head =
            format!("HTTP/1.1 {status} x\r\nContent-Type: application/json\r\nContent-Length: {}\r\n\r\n", text.len());
        if out.write_all((head + &text).as_bytes()).is_err() {
            return;
        }
    }
}

/// Method, path, version header and body of the next request.
pub fn request(reader: &mut BufReader<TcpStream>) -> Option<(String, String, String, Value)> {
    let mut line = String::new();
    reader.read_line(&mut line).ok().filter(|n| *n > 0)?;
    let mut words = line.split_whitespace().map(str::to_owned);
    let (method, path) = (words.next()?, words.next()?);
    let (mut version, mut length) = (String::new(), 0);
    loop {
        let mut header = String::new();
        reader.read_line(&mut header).ok().filter(|n| *n > 0)?;
        let Some((name, value)) = header.trim().split_once(':') else { break };
        match name.to_ascii_lowercase().as_str() {
            "opentrons-version" => version = value.trim().to_owned(),
            "content-length" => length = value.trim().parse().ok()?,
            _ => {}
        }
    }
    let mut body = vec![0; length];
    reader.read_exact(&mut body).ok()?;
    let body = if body.is_empty() { Value::Null } else { serde_json::from_slice(&body).ok()? };
    Some((method, path, version, body))
}

fn bench(name: &str, address: &str) -> PathBuf {
    let dir = folder(&format!("deploy_{name}"));
    write(&dir, "lab.mtx", TRANSFER);
    write(&dir, "lab.toml", format!("[ot2]\nhttp = \"{address}\"\n"));
    dir
}

#[test]
fn a_plan_completes_against_the_recorded_exchange() {
    for (name, text, recorded) in [("replay", TRANSFER, RECORDED), ("replay_modules", MODULES, RECORDED_MODULES)] {
        let server = replay(recorded, None);
        let dir = bench(name, &server.address);
        write(&dir, "lab.mtx", text);
        let ended = deploy(&dir, &["--mode", "real"]);
        assert_eq!(*server.wrong.lock().expect("not poisoned"), Vec::<String>::new());
        assert_eq!(ended.code, 0, "{}{}", ended.out, ended.err);
        // The connection is closed with the command.
        std::thread::sleep(std::time::Duration::from_millis(100));
        assert_eq!(*server.left.lock().expect("not poisoned"), 0, "nothing of it is left out");
    }
}

#[test]
fn modules_work_on_the_emulated_robot_and_none_is_left_on() {
    let dir = bench("modules", "");
    write(&dir, "lab.mtx", MODULES);
    let emulated = Emulated::start(&dir, &["ot2", "--file", "lab.mtx"]);
    write(&dir, "lab.toml", format!("[ot2]\nhttp = \"{}\"\n", emulated.address));
    let ended = deploy(&dir, &["--mode", "real"]);
    assert_eq!(ended.code, 0, "{}{}", ended.out, ended.err);
    // A run that ends badly switches each of them off, by the identifier that the server gives to it.
    let off = [
        "heaterShaker/deactivateHeater",
        "heaterShaker/deactivateShaker",
        "temperatureModule/deactivate",
        "magneticModule/disengage",
        "thermocycler/deactivateBlock",
        "thermocycler/deactivateLid",
    ];
    let server = replay(RECORDED_MODULES, Some(("aspirate", Spoiled::Cut)));
    write(&dir, "lab.toml", format!("[ot2]\nhttp = \"{}\"\n", server.address));
    std::fs::remove_file(dir.join("journal")).expect("a journal");
    let ended = deploy(&dir, &["--mode", "real"]);
    assert_eq!(ended.code, 1, "{}", ended.err);
    let journal = std::fs::read_to_string(dir.join("journal")).expect("a journal");
    for kind in off {
        assert!(journal.lines().any(|l| l.contains("/commands?") && l.contains(kind)), "{kind}: {journal}");
    }
}

fn spoil(name: &str, at: &'static str, how: Spoiled) -> Ended {
    let server = replay(RECORDED, Some((at, how)));
    deploy(&bench(name, &server.address), &["--mode", "real"])
}

#[test]
fn what_the_server_refuses_is_the_right_failure_on_its_line() {
    let error = |kind: &str, detail: &str| json!({ "errorType": kind, "detail": detail });
    let cases: [(&str, &str, Spoiled, &str, &str); 4] = [
        (
            "tip",
            "aspirate",
            Spoiled::Fails(error("TipNotAttachedError", "Pipette should have a tip attached, but does not.")),
            "no_tip",
            "lab.mtx:16",
        ),
        (
            "volume",
            "aspirate",
            Spoiled::Fails(error("InvalidAspirateVolumeError", "Cannot aspirate 400 µL when only 300 is available")),
            "tip_overflow",
            "lab.mtx:16",
        ),
        (
            "stopped",
            "dispense",
            Spoiled::Says(409, json!({ "errors": [{ "id": "RunStopped", "detail": "The run was stopped." }] })),
            "run_stopped",
            "lab.mtx:17",
        ),
        ("cut", "dispense", Spoiled::Cut, "device-lost", "lab.mtx:17"),
    ];
    for (name, at, how, said, line) in cases {
        let ended = spoil(&format!("server_{name}"), at, how);
        assert_eq!(ended.code, 1, "{name}: {}", ended.err);
        assert!(ended.err.contains(said) && ended.err.contains(line), "{name}: {}", ended.err);
    }
}

#[test]
fn a_plan_completes_on_the_emulated_robot_as_in_the_recording() {
    let dir = bench("robot", "");
    let emulated = Emulated::start(&dir, &["ot2", "--file", "lab.mtx"]);
    write(&dir, "lab.toml", format!("[ot2]\nhttp = \"{}\"\n", emulated.address));
    let ended = deploy(&dir, &["--mode", "real"]);
    assert_eq!(ended.code, 0, "{}{}", ended.out, ended.err);
    let journal = std::fs::read_to_string(dir.join("journal")).expect("a journal");
    let sent = journal.lines().filter(|l| l.contains("\"event\":\"out\"") && l.contains("POST ")).count();
    let recorded = RECORDED.lines().filter(|l| l.contains("\"POST")).count();
    assert!(recorded > 3 && sent >= recorded && journal.contains("/runs/run-1/commands"), "{journal}");
}

#[test]
fn labware_of_ones_own_is_given_to_the_robot_first() {
    let dir = bench("own_labware", "");
    write(&dir, "plate.json", crate::emit::own_plate());
    let lab = TRANSFER.replace("lab deck {", "asset Own from labware \"plate.json\"\n\nlab deck {");
    write(&dir, "lab.mtx", lab.replace("plate = Corning96", "plate = Own"));
    let emulated = Emulated::start(&dir, &["ot2", "--file", "lab.mtx"]);
    write(&dir, "lab.toml", format!("[ot2]\nhttp = \"{}\"\n", emulated.address));
    let ended = deploy(&dir, &["--mode", "real"]);
    assert_eq!(ended.code, 0, "{}{}", ended.out, ended.err);
    let journal = std::fs::read_to_string(dir.join("journal")).expect("a journal");
    let sent: Vec<&str> = journal.lines().filter(|l| l.contains("\"event\":\"out\"")).collect();
    let given = |line: &&str| line.contains("/labware_definitions {") && line.contains("house");
    let (given, loaded) =
        (sent.iter().position(given), sent.iter().position(|l| l.contains("flat_96") && l.contains("loadLabware")));
    assert!(given.is_some() && given < loaded, "{journal}");
    assert_eq!(sent.iter().filter(|l| l.contains("labware_definitions")).count(), 1, "what it knows it is not given");
}

#[test]
fn what_was_measured_of_labware_is_told_once_a_person_confirms_it() {
    let dir = bench("measured", "");
    let emulated = Emulated::start(&dir, &["ot2", "--file", "lab.mtx"]);
    let measured = "[plate]\ncalibration = { offset_x = \"0.3 mm\", offset_z = \"-0.2 mm\" }\n";
    write(&dir, "lab.toml", format!("[ot2]\nhttp = \"{}\"\n{measured}", emulated.address));
    let given = ["deploy", "lab.mtx", "--bind", "lab.toml", "--mode", "real", "--speed", super::SPEED, "--journal"];
    let nobody = matterixc_in(&dir, &[&given[..], &["one"]].concat());
    assert!(nobody.code == 1 && nobody.err.contains("plate.offset_x: 0.3 mm"), "{}", nobody.err);
    assert!(nobody.err.contains("not confirmed: nothing was sent") && !dir.join("one").exists(), "{}", nobody.err);
    let ended = matterixc_in(&dir, &[&given[..], &["two", "--yes"]].concat());
    assert_eq!(ended.code, 0, "{}{}", ended.out, ended.err);
    let journal = std::fs::read_to_string(dir.join("two")).expect("a journal").replace('\\', "");
    let sent: Vec<&str> = journal.lines().filter(|l| l.contains("\"event\":\"out\"")).collect();
    let offsets: Vec<usize> = (0..sent.len()).filter(|i| sent[*i].contains("/labware_offsets {")).collect();
    let load = sent.iter().position(|l| l.contains("loadLabware") && l.contains("\"labwareId\":\"plate\""));
    let ([offset], Some(load)) = (offsets.as_slice(), load) else { panic!("{journal}") };
    assert!(*offset < load, "{journal}");
    for said in ["\"opentrons/corning_96_wellplate_360ul_flat/", "\"vector\":{\"x\":0.3,\"y\":0,\"z\":-0.2}"] {
        assert!(sent[*offset].contains(said), "{said}: {}", sent[*offset]);
    }
    // A file that it runs by itself is not what was confirmed.
    let played = matterixc_in(&dir, &["emit", "lab.mtx", "--target", "opentrons-json", "--play", "lab.toml"]);
    assert!(played.code == 1 && played.err.contains("this command does not ask anyone"), "{}", played.err);
}

#[test]
fn what_a_robot_cannot_do_its_emulator_refuses() {
    // The file of the emulated lab has no liquid.
    let dir = bench("empty", "");
    let lab = TRANSFER.split("workflow").next().expect("a lab").replace(" holding { A1: 6 mL of buffer }", "");
    write(&dir, "empty.mtx", lab + "workflow idle in deck { wait 1 s }\n");
    let emulated = Emulated::start(&dir, &["ot2", "--file", "empty.mtx"]);
    write(&dir, "lab.toml", format!("[ot2]\nhttp = \"{}\"\n", emulated.address));
    let ended = deploy(&dir, &["--mode", "real"]);
    assert_eq!(ended.code, 1, "{}{}", ended.out, ended.err);
    assert!(ended.err.contains("lab.mtx:16"), "{}", ended.err);
}

#[test]
fn a_line_of_another_kind_is_refused() {
    let dir = bench("kind", "127.0.0.1:1");
    write(&dir, "lab.toml", "[ot2]\naddress = \"127.0.0.1:1\"\n");
    let ended = matterixc_in(&dir, &["deploy", "lab.mtx", "--bind", "lab.toml"]);
    assert_eq!(ended.code, 1);
    assert!(ended.err.contains("needs HTTP") && ended.err.contains("write `http ="), "{}", ended.err);
}

#[test]
fn where_no_server_can_be_is_found_before_anything_is_opened() {
    let dir = bench("nonsense", "");
    let cases = [
        ("nonsense", "the port of `nonsense` is missing"),
        ("https://robot:31950", "`https://` is not supported here"),
    ];
    for (place, said) in cases {
        write(&dir, "lab.toml", format!("[ot2]\nhttp = \"{place}\"\n"));
        let ended = deploy(&dir, &["--mode", "real"]);
        assert_eq!(ended.code, 1);
        assert!(ended.err.contains("error[binding]") && ended.err.contains(said), "{}", ended.err);
        assert!(ended.err.contains("lab.toml:2:8"), "{}", ended.err);
        assert!(!dir.join("journal").exists());
    }
}

#[test]
fn what_to_write_for_a_device_is_said_by_its_driver() {
    let dir = bench("unbound", "");
    write(&dir, "lab.toml", "");
    let ended = matterixc_in(&dir, &["deploy", "lab.mtx", "--bind", "lab.toml"]);
    assert_eq!(ended.code, 1);
    assert_eq!(ended.err.matches("error[undriven]").count(), 1, "{}", ended.err);
    assert!(ended.err.contains("[ot2]\n") && ended.err.contains("http = \"HOST:PORT\""), "{}", ended.err);
}

#[test]
fn what_no_server_understands_is_found_before_anything_is_sent() {
    let dir = folder("deploy_messages");
    let text = |lines: &str| {
        format!(
            "mtx 1\nuse std::heating::IkaRetControl\ndriver Server for IkaRetControl over http(timeout: 1 s) {{\n{lines}\n}}\n"
        )
    };
    let cases = [
        ("open sends \"FETCH /state\"", "is not a method"),
        ("open sends \"GET state\"", "is not a path"),
        ("open sends \"POST /state on=1\"", "is not a member of a body"),
        ("open sends \"GET /jobs/<job>\"", "`<job>` is never set"),
        ("open sends \"GET /state\" expects \"fine\"", "is neither a status"),
        ("stop heating sends \"POST /off\" until asks \"GET /state\" timeout 1 s", "only a reply can report"),
    ];
    for (line, said) in cases {
        write(&dir, "lab.mtx", text(line));
        let ended = matterixc_in(&dir, &["check", "lab.mtx"]);
        assert_eq!(ended.code, 1, "{line}");
        let flat = flat(&ended.out);
        assert!(flat.contains("driver-line") && flat.contains(said), "{line}: {}", ended.out);
    }
    write(
        &dir,
        "lab.mtx",
        text("open sends \"POST /jobs\" expects \"201 /id=<job>\"\nclose sends \"DELETE /jobs/<job>\""),
    );
    let ended = matterixc_in(&dir, &["check", "lab.mtx"]);
    assert_eq!(ended.code, 0, "{}", ended.out);
}

#[test]
fn an_emitted_protocol_is_uploaded_and_played() {
    let dir = bench("play", "");
    let emulated = Emulated::start(&dir, &["ot2", "--file", "lab.mtx"]);
    write(&dir, "lab.toml", format!("[ot2]\nhttp = \"{}\"\n", emulated.address));
    for target in ["opentrons-json", "opentrons-python"] {
        let ended = matterixc_in(&dir, &["emit", "lab.mtx", "--target", target, "--play", "lab.toml"]);
        assert_eq!(ended.code, 0, "{target}: {}{}", ended.out, ended.err);
        assert!(ended.err.contains("`ot2` has run the file"), "{target}: {}", ended.err);
    }
}

#[test]
fn what_a_server_says_against_a_protocol_is_shown_where_it_is_bound() {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = listener.local_addr().expect("an address").to_string();
    std::thread::spawn(move || {
        for mut stream in listener.incoming().flatten() {
            // The form is not read: what comes of it is the same.
            let mut buffer = [0; 1 << 16];
            let _ = stream.read(&mut buffer);
            let body = "{\"errors\":[{\"id\":\"ProtocolFilesInvalid\",\"detail\":\"no metadata\"}]}";
            let _ = stream.write_all(
                format!("HTTP/1.1 422 x\r\nContent-Length: {}\r\nConnection: close\r\n\r\n{body}", body.len())
                    .as_bytes(),
            );
        }
    });
    let dir = bench("play_refused", &address);
    let ended = matterixc_in(&dir, &["emit", "lab.mtx", "--target", "opentrons-json", "--play", "lab.toml"]);
    assert_eq!(ended.code, 1, "{}", ended.err);
    assert!(ended.err.contains("ProtocolFilesInvalid") && ended.err.contains("no metadata"), "{}", ended.err);
    assert!(ended.err.contains("lab.toml:2:8"), "{}", ended.err);
    write(&dir, "lab.toml", "[ot2]\nhttp = \"127.0.0.1:1\"\n");
    let ended = matterixc_in(&dir, &["emit", "lab.mtx", "--target", "opentrons-json", "--play", "lab.toml"]);
    assert!(ended.err.contains("no program listens") && ended.err.contains("lab.toml:2:8"), "{}", ended.err);
}
