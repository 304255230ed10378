//! A client of the Model Context Protocol, written by hand: a line of JSON each way.

use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Stdio};

use serde_json::{Value, json};

use crate::harness::command;

/// A session with a server of its own.
pub struct Client {
    child: Child,
    to: Option<ChildStdin>,
    from: BufReader<ChildStdout>,
    asked: u64,
}

impl Client {
    /// A session that has begun, with a server over a folder.
    pub fn new(root: &Path) -> Self {
        let mut client = Client::silent(root);
        let hello = json!({
            "protocolVersion": "2025-06-18",
            "capabilities": {},
            "clientInfo": { "name": "test", "version": "1" },
        });
        let begun = client.ask("initialize", hello);
        assert_eq!(begun["result"]["serverInfo"]["name"], "matterixc", "{begun}");
        client.send(&json!({ "jsonrpc": "2.0", "method": "notifications/initialized" }));
        client
    }

    /// A server to which nothing has been said.
    pub fn silent(root: &Path) -> Self {
        let mut command = command();
        command.args(["mcp", "--root"]).arg(root);
        let piped = command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::null());
        let mut child = piped.spawn().expect("the command starts");
        let to = child.stdin.take();
        let from = BufReader::new(child.stdout.take().expect("piped"));
        Client { child, to, from, asked: 0 }
    }

    /// Sends a line.
    pub fn line(&mut self, line: &str) {
        let to = self.to.as_mut().expect("the session goes on");
        to.write_all(line.as_bytes()).and_then(|()| to.write_all(b"\n")).and_then(|()| to.flush()).expect("it reads");
    }

    pub fn send(&mut self, message: &Value) {
        self.line(&message.to_string());
    }

    /// The next line it says, which is a message.
    pub fn next(&mut self) -> Value {
        let mut line = String::new();
        self.from.read_line(&mut line).expect("text");
        let message: Value = serde_json::from_str(&line).unwrap_or_else(|e| panic!("{e}: `{line}`"));
        assert_eq!(message["jsonrpc"], "2.0", "{message}");
        message
    }

    /// Sends a request without waiting for what it says; its number.
    pub fn begin(&mut self, method: &str, params: Value) -> u64 {
        self.asked += 1;
        let id = self.asked;
        self.send(&json!({ "jsonrpc": "2.0", "id": id, "method": method, "params": params }));
        id
    }

    /// Sends a request; what it says to that, errors too.
    pub fn ask(&mut self, method: &str, params: Value) -> Value {
        let id = self.begin(method, params);
        loop {
            let message = self.next();
            if message["id"] == id {
                return message;
            }
        }
    }

    /// What a tool answers: the result, an error of the tool too.
    pub fn call(&mut self, tool: &str, arguments: Value) -> Value {
        let mut answer = self.ask("tools/call", json!({ "name": tool, "arguments": arguments }));
        assert!(answer["error"].is_null(), "{tool}: {answer}");
        answer["result"].take()
    }

    /// The data that a tool answers with.
    pub fn data(&mut self, tool: &str, arguments: Value) -> Value {
        let mut result = self.call(tool, arguments);
        assert_eq!(result["isError"], false, "{tool}: {result}");
        result["structuredContent"].take()
    }

    /// In what words a tool refuses.
    pub fn refused(&mut self, tool: &str, arguments: Value) -> String {
        let result = self.call(tool, arguments);
        assert_eq!(result["isError"], true, "{tool}: {result}");
        read(&result)
    }

    /// Closes the client's end; how the server ends, and that it has nothing more to say.
    pub fn close(mut self) -> Option<i32> {
        self.to = None;
        let mut rest = String::new();
        std::io::Read::read_to_string(&mut self.from, &mut rest).expect("text");
        assert_eq!(rest, "", "nothing was asked");
        self.child.wait().expect("it ends").code()
    }
}

impl Drop for Client {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// The text of a result.
pub fn read(result: &Value) -> String {
    let texts = result["content"].as_array().expect("content").iter().map(|c| c["text"].as_str().expect("text"));
    texts.collect::<Vec<_>>().join("\n")
}
