//! The page of a deployment and signals: who answers, pauses, goes on and stops from elsewhere than its terminal.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::PathBuf;
use std::process::{Child, ChildStderr, Stdio};
use std::time::Duration;

use serde_json::{Value, json};

use super::stop::signal;
use super::{Emulated, bench, lines};
use crate::harness::{command, matterixc_in, write};

/// Seconds of lab time per second.
const SPEED: &str = "10";

const STIR: &str = "mtx 1
use std::heating::IkaRetControl
lab bench { ambient: 22 degC, plate = IkaRetControl at (0, 0, 0) m }
workflow stir_a_while in bench {
    heat plate to 40 degC
    ask \"add the reagent, then confirm\"
    stir plate at 300 rpm
    wait 10 s
    stop stirring plate
    wait until plate.temperature >= 24 degC timeout 1 h
} finally { stop stirring plate; stop heating plate }
";

/// A deployment without a terminal, with its page.
struct Served {
    dir: PathBuf,
    process: Child,
    said: BufReader<ChildStderr>,
    address: String,
    token: String,
    _emulated: Emulated,
}

impl Served {
    fn begin(name: &str, text: &str) -> Served {
        let dir = bench(name, text, "plate", "");
        let emulated = Emulated::at(SPEED, &dir, &["plate", "--file", "lab.mtx"]);
        write(&dir, "lab.toml", format!("[plate]\naddress = \"{}\"\n", emulated.address));
        let mut process = command();
        process.current_dir(&dir).args(["deploy", "lab.mtx", "--bind", "lab.toml", "--mode", "real", "--view"]);
        process.args(["--journal", "journal", "--speed", SPEED]).stdin(Stdio::null()).stdout(Stdio::null());
        let mut process = process.stderr(Stdio::piped()).spawn().expect("the command starts");
        let mut said = BufReader::new(process.stderr.take().expect("piped"));
        let mut line = String::new();
        said.read_line(&mut line).expect("a line");
        let url = line.trim().split("http://").nth(1).unwrap_or_else(|| panic!("an address: {line}"));
        let (address, token) = url.split_once("/?token=").expect("a token");
        let (address, token) = (address.to_owned(), token.to_owned());
        Served { dir, process, said, address, token, _emulated: emulated }
    }

    /// The status of an answer, and its body.
    fn ask(&self, method: &str, path: &str, headers: &str, body: &str) -> (u16, String) {
        let mut stream = TcpStream::connect(&self.address).expect("connects");
        let length = body.len();
        let head = format!("{method} {path} HTTP/1.1\r\nHost: {}\r\n{headers}", self.address);
        let request = format!("{head}Content-Length: {length}\r\nConnection: close\r\n\r\n{body}");
        stream.write_all(request.as_bytes()).expect("writes");
        let mut answer = String::new();
        stream.read_to_string(&mut answer).expect("reads");
        let status = answer.split(' ').nth(1).and_then(|s| s.parse().ok()).unwrap_or_else(|| panic!("{answer}"));
        (status, answer.split_once("\r\n\r\n").map_or(String::new(), |(_, body)| body.to_owned()))
    }

    fn acts(&self, act: &Value) -> u16 {
        let headers = format!("Authorization: Bearer {}\r\nContent-Type: application/json\r\n", self.token);
        self.ask("POST", "/act", &headers, &act.to_string()).0
    }

    fn state(&self) -> Value {
        let (status, body) = self.ask("GET", &format!("/state?token={}", self.token), "", "");
        assert_eq!(status, 200, "{body}");
        serde_json::from_str(&body).expect("JSON")
    }

    /// The state as soon as it is so.
    fn until(&self, is_so: impl Fn(&Value) -> bool) -> Value {
        for _ in 0..1000 {
            let state = self.state();
            if is_so(&state) {
                return state;
            }
            std::thread::sleep(Duration::from_millis(20));
        }
        panic!("{}", self.state());
    }

    fn end(mut self) -> (Option<i32>, String, Vec<Value>) {
        let mut said = String::new();
        self.said.read_to_string(&mut said).expect("text");
        let code = self.process.wait().expect("it ends").code();
        let journal = std::fs::read_to_string(self.dir.join("journal")).expect("a journal");
        (code, said, lines(&journal).lines().map(|l| serde_json::from_str(l).expect("JSON")).collect())
    }
}

fn events<'l>(journal: &'l [Value], name: &str) -> Vec<&'l Value> {
    journal.iter().filter(|l| l["event"] == name).collect()
}

#[test]
fn people_answer_pause_and_go_on_over_the_page() {
    // It ends with a question: a page that has gone shows nothing.
    let text = STIR.replace("timeout 1 h\n", "timeout 1 h\n    ask \"is all well?\"\n");
    let served = Served::begin("panel", &text);
    let asked = served.until(|s| s["questions"].as_array().is_some_and(|q| !q.is_empty()));
    assert_eq!(asked["questions"][0]["text"], "add the reagent, then confirm");
    assert_eq!(asked["exposed"], json!(["plate"]));
    assert!(asked["steps"].to_string().contains("ask"), "{asked}");
    let question = &asked["questions"][0]["number"];
    assert_eq!(served.acts(&json!({ "who": "Ann", "do": "yes", "question": "77" })), 409, "no such question");
    assert_eq!(served.acts(&json!({ "who": "Ann", "do": "pause" })), 202);
    served.until(|s| s["gate"] == "pause");
    assert_eq!(served.acts(&json!({ "who": "Ann", "do": "yes", "question": question })), 202);
    assert_eq!(served.acts(&json!({ "who": "Bo", "do": "no", "question": question })), 409, "the first counts");
    std::thread::sleep(Duration::from_millis(300));
    assert!(!served.state()["log"].to_string().contains("stir plate at 300 rpm"), "nothing begins in a pause");
    assert_eq!(served.acts(&json!({ "who": "Bo", "do": "go" })), 202);
    served.until(|s| s["devices"][0]["told"]["plate.temperature"].as_str().is_some_and(|t| t.ends_with("degC")));
    let asked = served.until(|s| s["questions"][0]["text"] == "is all well?");
    let last = &asked["questions"][0]["number"];
    assert_eq!(served.acts(&json!({ "who": "Bo", "do": "yes", "question": last })), 202);
    let (code, said, journal) = served.end();
    assert_eq!(code, Some(0), "{said}");
    let answers = events(&journal, "answered");
    assert!(answers.len() == 2 && answers[0]["yes"] == true && answers[0]["who"] == "Ann, on the page", "{answers:?}");
    let gates: Vec<_> = events(&journal, "gate").iter().map(|l| (l["to"].clone(), l["who"].clone())).collect();
    assert_eq!(gates, [(json!("pause"), json!("Ann, on the page")), (json!("go"), json!("Bo, on the page"))]);
}

#[test]
fn who_does_not_know_the_address_learns_nothing_and_changes_nothing() {
    let served = Served::begin("panel_foreign", STIR);
    served.until(|s| s["questions"].as_array().is_some_and(|q| !q.is_empty()));
    let stop = json!({ "who": "Eve", "do": "stop" }).to_string();
    let json = "Content-Type: application/json\r\n";
    let known = format!("Authorization: Bearer {}\r\n", served.token);
    let (status, page) = served.ask("GET", "/", "", "");
    assert!(status == 401 && !page.contains("<html"), "{status} {page}");
    assert_eq!(served.ask("GET", "/state?token=0000", "", "").0, 401);
    assert_eq!(served.ask("GET", "/events", "", "").0, 401);
    assert_eq!(served.ask("POST", "/act", json, &stop).0, 401);
    assert_eq!(served.ask("POST", "/act", &format!("{known}{json}Origin: http://lab.example\r\n"), &stop).0, 403);
    assert_eq!(served.ask("POST", "/act", &known, &stop).0, 400, "a form of another page");
    assert_eq!(served.ask("GET", "/act", &known, "").0, 405);
    assert_eq!(served.ask("POST", "/act", &format!("{known}{json}"), r#"{"do": "stop"}"#).0, 422, "nobody");
    assert_eq!(served.ask("GET", "/", &known, "").0, 200);
    // A viewer who asks for events and reads none holds up nobody.
    let mut silent = TcpStream::connect(&served.address).expect("connects");
    let events = format!("GET /events?token={} HTTP/1.1\r\nHost: {}\r\n\r\n", served.token, served.address);
    silent.write_all(events.as_bytes()).expect("writes");
    assert_eq!(served.acts(&serde_json::json!({ "who": "Ann", "do": "stop" })), 202);
    let (code, said, journal) = served.end();
    assert!(code == Some(1) && said.contains("was stopped by a person"), "{said}");
    let stops: Vec<_> = journal.iter().filter(|l| l["event"] == "stop").map(|l| l["who"].clone()).collect();
    assert_eq!(stops, ["Ann, on the page"]);
    assert!(said.contains("stop: Ann, on the page"), "{said}");
}

#[test]
fn signals_pause_let_one_step_begin_and_go_on() {
    let text = STIR.replace("    ask \"add the reagent, then confirm\"\n", "    wait 10 s\n");
    let served = Served::begin("panel_signals", &text);
    served.until(|s| s["steps"].to_string().contains("wait 10 s"));
    signal("-TSTP", &served.process);
    served.until(|s| s["gate"] == "pause");
    // The wait is over, and nothing begins.
    std::thread::sleep(Duration::from_millis(1200));
    assert!(!served.state()["log"].to_string().contains("stir plate at 300 rpm"));
    signal("-URG", &served.process);
    served.until(|s| s["log"].to_string().contains("stir plate at 300 rpm"));
    signal("-USR2", &served.process);
    served.until(|s| s["gate"] == "go");
    signal("-USR1", &served.process);
    served.until(|s| s["gate"] == "pause");
    // Said again it changes nothing, and is no second entry.
    signal("-USR1", &served.process);
    std::thread::sleep(Duration::from_millis(300));
    signal("-USR2", &served.process);
    let (code, said, journal) = served.end();
    assert_eq!(code, Some(0), "{said}");
    let whos: Vec<String> = events(&journal, "gate").iter().map(|l| l["who"].to_string()).collect();
    let wanted = ["Ctrl-Z", "SIGURG", "SIGUSR2", "SIGUSR1", "SIGUSR2"];
    assert_eq!(whos.len(), wanted.len(), "{whos:?}");
    assert!(whos.iter().zip(wanted).all(|(who, signal)| who.contains(signal)), "{whos:?}");
}

#[test]
fn a_page_is_no_part_of_a_dry_run() {
    let dir = bench("panel_dry", STIR, "plate", "127.0.0.1:1");
    let ended = matterixc_in(&dir, &["deploy", "lab.mtx", "--bind", "lab.toml", "--view"]);
    assert!(ended.code == 2 && ended.err.contains("--view"), "{}", ended.err);
    let ended = matterixc_in(&dir, &["deploy", "lab.mtx", "--bind", "lab.toml", "--port", "80"]);
    assert!(ended.code == 2 && ended.err.contains("--view"), "{}", ended.err);
}
