//! Servers over HTTP: the page of `view`, emulators of devices that are servers.

use std::io::{Read, Write};
use std::net::TcpStream;

use super::Server;
use crate::harness::{folder, root};

/// A page, and the emulator of a robot's server.
fn servers(name: &str) -> Vec<Server> {
    let dir = folder(name);
    let lab = root().join("examples/redox.mtx").display().to_string();
    vec![Server::start(&dir, &["view", &lab]), Server::start(&dir, &["emulate", "OT2", "--tcp", "0"])]
}

fn answer(mut stream: TcpStream, request: &str) -> String {
    stream.write_all(request.as_bytes()).expect("writes");
    let mut bytes = Vec::new();
    let _ = stream.read_to_end(&mut bytes);
    String::from_utf8_lossy(&bytes).into_owned()
}

/// Somebody who asks for something that may or may not be there.
fn is_served(server: &Server) {
    let answer = answer(server.connect(), "GET / HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n");
    assert!(answer.starts_with("HTTP/1.1 "), "{answer}");
}

#[test]
fn unfinished_requests_hold_up_neither_others_nor_ctrl_c() {
    for server in servers("servers_unfinished") {
        let begun = ["", "GET / HT", "POST /runs HTTP/1.1\r\nHost: x\r\nContent-Length: 900\r\n\r\n{"];
        let held: Vec<_> = (0..30)
            .flat_map(|_| begun)
            .map(|text| {
                let mut stream = server.connect();
                stream.write_all(text.as_bytes()).expect("writes");
                stream
            })
            .collect();
        is_served(&server);
        assert_eq!(server.interrupted(), Some(0));
        drop(held);
    }
}

#[test]
fn heads_and_bodies_without_end_are_refused_and_not_kept() {
    for server in servers("servers_endless") {
        is_served(&server);
        let before = server.memory();
        let long = "x".repeat(1 << 20);
        let mut requests = vec![format!("GET /{long}"), format!("GET / HTTP/1.1\r\nHost: x\r\nA: {long}")];
        requests
            .push(format!("POST / HTTP/1.1\r\nHost: x\r\nTransfer-Encoding: chunked\r\n\r\n{}\r\n", "f".repeat(15)));
        requests.push("POST / HTTP/1.1\r\nHost: x\r\nContent-Length: 99999999999\r\n\r\n".to_owned());
        for request in requests {
            let mut stream = server.connect();
            // The server may close before all of it is out.
            let _ = stream.write_all(request.as_bytes());
            let mut text = Vec::new();
            let _ = stream.read_to_end(&mut text);
            let text = String::from_utf8_lossy(&text);
            assert!(text.starts_with("HTTP/1.1 4") || text.is_empty(), "{text}");
        }
        is_served(&server);
        assert!(server.memory() < before + (32 << 10), "{} KiB after {before}", server.memory());
        assert_eq!(server.interrupted(), Some(0));
    }
}

#[test]
fn json_that_is_nested_too_deeply_is_refused() {
    let server = Server::start(&folder("servers_nested"), &["emulate", "OT2", "--tcp", "0"]);
    let body = "[".repeat(100_000);
    let head = "POST /runs HTTP/1.1\r\nHost: x\r\nOpentrons-Version: 4\r\nConnection: close\r\n";
    let answer = answer(server.connect(), &format!("{head}Content-Length: {}\r\n\r\n{body}", body.len()));
    assert!(answer.starts_with("HTTP/1.1 400 "), "{answer}");
    is_served(&server);
}

#[test]
fn a_page_is_only_for_those_who_name_this_machine() {
    let lab = root().join("examples/redox.mtx").display().to_string();
    let server = Server::start(&folder("servers_named"), &["view", &lab]);
    let ask =
        |host: &str| answer(server.connect(), &format!("GET / HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n"));
    assert!(ask("127.0.0.1").starts_with("HTTP/1.1 200 "));
    assert!(ask("localhost:9000").starts_with("HTTP/1.1 200 "), "a tunnel has a port of its own");
    assert!(ask("lab.example").starts_with("HTTP/1.1 403 "));
}
