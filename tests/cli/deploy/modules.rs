//! Modules on a robot: they stay on when its run is stopped, by whomever, and are switched off outside of the run.

use std::collections::BTreeMap;
use std::io::{BufReader, Write};
use std::net::{TcpListener, TcpStream};
use std::process::Stdio;
use std::sync::{Arc, Mutex};

use serde_json::{Value, json};

use super::server::request;
use super::{Emulated, deploy_at};
use crate::harness::{command, folder, write};

/// A plate is heated and shaken, and then filled.
const COOK: &str = "mtx 1
use std::opentrons::{Corning96, HeaterShaker, OT2, P300Single, Reservoir12, TipRack300}
lab deck {
    ambient: 22 degC
    ot2 = OT2 { left: P300Single } at (0, 0, 0) m
    tips = TipRack300 on ot2.slot[10]
    shaker = HeaterShaker on ot2.slot[1]
    plate = Corning96 on shaker
    stock = Reservoir12 on ot2.slot[3] holding { A1: 10 mL of water }
}
workflow cook in deck {
    close latch shaker
    heat shaker to 60 degC
    shake shaker at 500 rpm
    wait 200 s
    stop shaking shaker
    transfer 50 uL from stock[A1] to plate[A1 .. H1] by ot2.left using tips { tips: once }
} finally { stop heating shaker }
";

#[test]
fn modules_are_switched_off_outside_of_the_run() {
    let dir = folder("deploy_modules_off");
    write(&dir, "lab.mtx", COOK);
    let emulated = Emulated::at("20", &dir, &["ot2", "--file", "lab.mtx"]);
    write(&dir, "lab.toml", format!("[ot2]\nhttp = \"{}\"\n", emulated.address));
    let mut deployed = command();
    deployed.current_dir(&dir).args(["deploy", "lab.mtx", "--bind", "lab.toml", "--mode", "real"]);
    deployed.args(["--journal", "journal", "--speed", "20"]).stdin(Stdio::null()).stdout(Stdio::null());
    let deployed = deployed.stderr(Stdio::piped()).spawn().expect("the command starts");
    for _ in 0..4000 {
        if std::fs::read_to_string(dir.join("journal")).is_ok_and(|j| j.contains("setAndWaitForShakeSpeed")) {
            break;
        }
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    super::stop::signal("-INT", &deployed);
    let ended = deployed.wait_with_output().expect("it ends");
    let said = String::from_utf8_lossy(&ended.stderr);
    assert_eq!(ended.status.code(), Some(1), "{said}");
    assert!(!said.contains("could not be made safe"), "{said}");
    let journal = std::fs::read_to_string(dir.join("journal")).expect("a journal");
    let stop = journal.find("actionType\\\\\\\":\\\\\\\"stop").expect("the run is stopped");
    for off in ["deactivateHeater", "deactivateShaker"] {
        let at = journal.rfind(off).expect("it is switched off");
        assert!(at > stop && journal[stop..at].contains("POST /commands"), "{off}: {journal}");
    }
}

/// What a robot's server knows.
#[derive(Default)]
struct Robot {
    heard: Vec<String>,
    commands: BTreeMap<String, String>,
    stopped: bool,
}

/// A robot whose run a person stops once it was told this; commands of `slow` are under way until they were asked for `polls` times.
fn robot(stop_at: &'static str, slow: &'static str, polls: usize) -> (String, Arc<Mutex<Robot>>) {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = listener.local_addr().expect("an address").to_string();
    let robot = Arc::new(Mutex::new(Robot::default()));
    let told = Arc::clone(&robot);
    std::thread::spawn(move || {
        for stream in listener.incoming().flatten() {
            let told = Arc::clone(&told);
            std::thread::spawn(move || serve(stream, &told, (stop_at, slow, polls)));
        }
    });
    (address, robot)
}

fn serve(stream: TcpStream, robot: &Mutex<Robot>, (stop_at, slow, polls): (&str, &str, usize)) {
    let mut out = stream.try_clone().expect("a stream");
    let mut reader = BufReader::new(stream);
    while let Some((method, path, _, body)) = request(&mut reader) {
        let mut robot = robot.lock().expect("not poisoned");
        let kind = body["data"]["commandType"].as_str().unwrap_or_default().to_owned();
        robot.heard.push(format!("{method} {path} {kind}"));
        let (status, answer) = answer(&mut robot, &method, &path, &kind, (slow, polls));
        robot.stopped |= kind == stop_at;
        let text = answer.to_string();
        let head =
            format!("HTTP/1.1 {status} x\r\nContent-Type: application/json\r\nContent-Length: {}\r\n\r\n", text.len());
        if out.write_all((head + &text).as_bytes()).is_err() {
            return;
        }
    }
}

fn answer(robot: &mut Robot, method: &str, path: &str, kind: &str, (slow, polls): (&str, usize)) -> (u16, Value) {
    let stopped = json!({ "errors": [{ "id": "RunStopped", "detail": "The run has already stopped." }] });
    let modules = json!([{ "id": "other", "serialNumber": "HS1" }, { "id": "78b5", "serialNumber": "HS2" }]);
    match (method, path) {
        ("GET", "/modules") => (200, json!({ "data": modules })),
        ("GET", "/runs/R") => (200, json!({ "data": { "status": if robot.stopped { "stopped" } else { "running" } } })),
        ("POST", "/runs") => (201, json!({ "data": { "id": "R" } })),
        ("POST", "/runs/R/actions") if robot.stopped => (409, stopped),
        ("POST", "/runs/R/actions") => {
            robot.stopped = true;
            (201, json!({ "data": { "id": "a" } }))
        }
        ("POST", "/runs/R/commands") if robot.stopped => (409, stopped),
        ("POST", _) if path.starts_with("/runs/R/commands") => {
            let id = format!("c{}", robot.commands.len());
            robot.commands.insert(id.clone(), kind.to_owned());
            (201, json!({ "data": { "id": id, "status": "queued" } }))
        }
        ("GET", _) if path.starts_with("/runs/R/commands/") => {
            let kind = robot.commands.get(path.trim_start_matches("/runs/R/commands/")).cloned().unwrap_or_default();
            let asked = robot.heard.iter().filter(|h| h.starts_with(&format!("GET {path} "))).count();
            let status = if kind == slow && asked < polls { "running" } else { "succeeded" };
            (200, json!({ "data": { "status": status, "result": { "serialNumber": "HS2" } } }))
        }
        ("POST", _) if path.starts_with("/commands") => (201, json!({ "data": { "status": "succeeded" } })),
        _ => (404, json!({ "errors": [{ "id": "NotFound", "detail": path }] })),
    }
}

#[test]
fn a_run_that_a_person_stops_at_the_robot_ends_and_its_modules_are_switched_off() {
    let (address, robot) = robot("heaterShaker/setAndWaitForShakeSpeed", "", 0);
    let dir = folder("deploy_modules_person");
    write(&dir, "lab.mtx", COOK);
    write(&dir, "lab.toml", format!("[ot2]\nhttp = \"{address}\"\n"));
    let ended = deploy_at("20", &dir, &["--mode", "real"]);
    assert_eq!(ended.code, 1);
    assert!(ended.err.contains("run_stopped"), "{}", ended.err);
    assert!(!ended.err.contains("could not be made safe"), "{}", ended.err);
    // It is noticed while the workflow waits, not at its next command.
    let heard = robot.lock().expect("not poisoned").heard.clone();
    let after: Vec<&String> = heard.iter().skip_while(|h| !h.contains("ShakeSpeed")).collect();
    assert!(!after.iter().any(|h| h.contains("pickUpTip")), "{after:?}");
    assert!(ended.err.contains("`ot2`: it replied"), "{}", ended.err);
    for off in ["heaterShaker/deactivateHeater", "heaterShaker/deactivateShaker"] {
        let said = |h: &&String| h.starts_with("POST /commands?") && h.ends_with(off);
        assert_eq!(after.iter().filter(|h| said(h)).count(), 1, "{off}: {after:?}");
    }
}

#[test]
fn two_commands_that_go_on_at_a_time_are_asked_for_by_their_own_names() {
    let text = COOK.replace(
        "    shake shaker at 500 rpm\n    wait 200 s\n    stop shaking shaker\n    transfer 50 uL",
        "    transfer 50 uL",
    );
    let text = text.replace(
        "    heat shaker to 60 degC\n    transfer",
        "    parallel {\n    heat shaker to 60 degC\n    transfer",
    );
    let text = text.replace("{ tips: once }\n}", "{ tips: once }\n    }\n}");
    let (address, robot) = robot("never", "heaterShaker/setTargetTemperature", 6);
    let dir = folder("deploy_modules_names");
    write(&dir, "lab.mtx", text);
    write(&dir, "lab.toml", format!("[ot2]\nhttp = \"{address}\"\n"));
    let ended = deploy_at("20", &dir, &["--mode", "real"]);
    assert_eq!(ended.code, 0, "{}", ended.err);
    let robot = robot.lock().expect("not poisoned");
    for (id, kind) in &robot.commands {
        let asked = robot.heard.iter().filter(|h| h.starts_with(&format!("GET /runs/R/commands/{id} "))).count();
        let wanted = match kind.as_str() {
            "heaterShaker/setTargetTemperature" => 6,
            // It answers at its end.
            "moveToAddressableAreaForDropTip" => 0,
            _ => 1,
        };
        assert!(asked >= wanted, "`{kind}` was asked for {asked} times: {:?}", robot.heard);
    }
}
