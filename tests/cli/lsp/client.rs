//! An editor for tests: speaks the protocol with the command and keeps what it is told.

use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, Write};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

use serde_json::{Value, json};

/// The longest that an answer may take, on a machine that does other work besides.
const PATIENCE: Duration = Duration::from_secs(120);

/// A client with a server of its own.
pub struct Client {
    child: Child,
    input: Option<ChildStdin>,
    came: Receiver<Value>,
    asked: i64,
    /// Answers that came before they were waited for, by the numbers of their requests.
    answers: BTreeMap<i64, Value>,
    /// What was told of texts, by address: the version, and the findings.
    pub told: BTreeMap<String, (Option<i64>, Vec<Value>)>,
    /// What the server says of itself.
    pub server: Value,
}

impl Client {
    /// Starts a server and agrees with it, columns counted in `encoding`.
    pub fn new(binary: &str, encoding: &str) -> Client {
        let mut client = Client::stranger(binary);
        let capabilities = json!({
            "general": { "positionEncodings": [encoding] },
            "textDocument": {
                "hover": { "contentFormat": ["markdown"] },
                "codeAction": { "codeActionLiteralSupport": { "codeActionKind": { "valueSet": [] } } },
                "documentSymbol": { "hierarchicalDocumentSymbolSupport": true },
            },
        });
        client.server = client.ask("initialize", json!({ "processId": null, "capabilities": capabilities })).unwrap();
        client.tell("initialized", json!({}));
        client
    }

    /// Starts a server and agrees nothing.
    pub fn stranger(binary: &str) -> Client {
        let mut command = Command::new(binary);
        command.arg("lsp").stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::inherit());
        command.env("XDG_CACHE_HOME", concat!(env!("CARGO_TARGET_TMPDIR"), "/lsp-cache"));
        let mut child = command.spawn().unwrap();
        let mut output = BufReader::new(child.stdout.take().unwrap());
        let (sender, came) = channel();
        std::thread::spawn(move || {
            while let Some(message) = read(&mut output) {
                if sender.send(message).is_err() {
                    break;
                }
            }
        });
        let input = child.stdin.take();
        Client { child, input, came, asked: 0, answers: BTreeMap::new(), told: BTreeMap::new(), server: Value::Null }
    }

    /// Writes bytes as they are.
    pub fn write(&mut self, bytes: &[u8]) {
        let input = self.input.as_mut().unwrap();
        input.write_all(bytes).unwrap();
        input.flush().unwrap();
    }

    fn send(&mut self, mut message: Value) {
        message["jsonrpc"] = json!("2.0");
        let text = message.to_string();
        self.write(format!("Content-Length: {}\r\n\r\n{text}", text.len()).as_bytes());
    }

    /// A notification.
    pub fn tell(&mut self, method: &str, params: Value) {
        self.send(json!({ "method": method, "params": params }));
    }

    /// A request that is not waited for; its number.
    pub fn request(&mut self, method: &str, params: Value) -> i64 {
        self.asked += 1;
        self.send(json!({ "id": self.asked, "method": method, "params": params }));
        self.asked
    }

    /// A request with its answer, or what is said instead.
    pub fn ask(&mut self, method: &str, params: Value) -> Result<Value, Value> {
        let id = self.request(method, params);
        self.answer(id)
    }

    /// The answer to a request.
    pub fn answer(&mut self, id: i64) -> Result<Value, Value> {
        while !self.answers.contains_key(&id) {
            self.next();
        }
        let message = self.answers.remove(&id).unwrap();
        match message.get("error") {
            Some(error) => Err(error.clone()),
            None => Ok(message["result"].clone()),
        }
    }

    /// The next message; findings and answers are kept.
    pub fn next(&mut self) -> Value {
        let message = self.came.recv_timeout(PATIENCE).expect("the server says something");
        if message["method"] == "textDocument/publishDiagnostics" {
            let params = &message["params"];
            let found = params["diagnostics"].as_array().unwrap().clone();
            self.told.insert(params["uri"].as_str().unwrap().to_string(), (params["version"].as_i64(), found));
        } else if let Some(id) = message["id"].as_i64().filter(|_| message.get("method").is_none()) {
            self.answers.insert(id, message.clone());
        }
        message
    }

    /// Opens a text.
    pub fn open(&mut self, uri: &str, text: &str) {
        let document = json!({ "uri": uri, "languageId": "mtx", "version": 1, "text": text });
        self.tell("textDocument/didOpen", json!({ "textDocument": document }));
    }

    /// Changes a text: of a range, or the whole.
    pub fn change(&mut self, uri: &str, version: i64, range: Option<Value>, text: &str) {
        let mut change = json!({ "text": text });
        if let Some(range) = range {
            change["range"] = range;
        }
        let document = json!({ "uri": uri, "version": version });
        self.tell("textDocument/didChange", json!({ "textDocument": document, "contentChanges": [change] }));
    }

    /// What is found in a version of a text.
    pub fn findings(&mut self, uri: &str, version: i64) -> Vec<Value> {
        loop {
            if let Some((Some(told), found)) = self.told.get(uri)
                && *told >= version
            {
                assert_eq!(*told, version, "a version that was not sent");
                return found.clone();
            }
            self.next();
        }
    }

    /// Says good-bye; the exit status.
    pub fn close(mut self) -> Option<i32> {
        assert_eq!(self.ask("shutdown", Value::Null), Ok(Value::Null));
        self.tell("exit", Value::Null);
        self.end()
    }

    /// Ends without a word more; the exit status.
    pub fn end(mut self) -> Option<i32> {
        self.input = None;
        self.child.wait().unwrap().code()
    }

    /// The number of the server's process.
    #[allow(dead_code, reason = "benchmarks ask for it")]
    pub fn process(&self) -> u32 {
        self.child.id()
    }
}

impl Drop for Client {
    fn drop(&mut self) {
        // One that a test has left alone.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn read(stream: &mut impl BufRead) -> Option<Value> {
    let mut length = 0;
    loop {
        let mut line = String::new();
        stream.read_line(&mut line).ok().filter(|read| *read > 0)?;
        match line.trim().split_once(": ") {
            Some((name, value)) if name.eq_ignore_ascii_case("content-length") => length = value.parse().ok()?,
            Some(_) => {}
            None => break,
        }
    }
    let mut bytes = vec![0; length];
    stream.read_exact(&mut bytes).ok()?;
    serde_json::from_slice(&bytes).ok()
}
