//! A server against clients that mean no good: each is bounded, and none holds up another.

use std::io::{self, Read, Write};
use std::net::{Shutdown, SocketAddr, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use matterix_net::http::{Answer, Limits, Request, Server};

const LIMITS: Limits = Limits {
    connections: 8,
    listeners: 2,
    head: 1 << 10,
    body: 1 << 16,
    bodies: 1 << 17,
    unread: 1 << 16,
    request: SOON,
    idle: SOON,
    stalled: SOON,
};

/// The same with little patience.
const HASTY: Limits =
    Limits { request: Duration::from_secs(1), idle: Duration::from_secs(1), stalled: Duration::from_secs(1), ..LIMITS };

/// Long enough for a busy machine, short enough that nothing waits for an evil client.
const SOON: Duration = Duration::from_secs(20);

/// More than the buffers of both sockets hold.
const LARGE: usize = 32 << 20;

fn answer(request: &Request) -> Answer {
    match request.path() {
        "/events" => Answer::events(),
        "/large" => Answer::new(200, "text/plain", vec![b'x'; LARGE]),
        "/echo" => Answer::new(200, "text/plain", request.body.clone()),
        _ => Answer::text(200, "hello"),
    }
}

/// Serves while clients do what they do.
fn with<T>(limits: Limits, clients: impl FnOnce(SocketAddr) -> T) -> T {
    let mut server = Server::bind(0, limits).expect("a free port");
    let (address, stop) = (server.address(), AtomicBool::new(false));
    std::thread::scope(|scope| {
        scope.spawn(|| {
            let mut count = 0;
            while !stop.load(Ordering::Relaxed) {
                if let Some(asked) = server.next(Duration::from_millis(5)).expect("the port stays") {
                    server.answer(asked.client, answer(&asked.request));
                }
                count += 1;
                server.publish("turn", &format!("{count}\nand on"));
            }
        });
        // The server ends also where a client's expectation fails.
        let done = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| clients(address)));
        stop.store(true, Ordering::Relaxed);
        done.unwrap_or_else(|why| std::panic::resume_unwind(why))
    })
}

fn connect(address: SocketAddr) -> TcpStream {
    let stream = TcpStream::connect(address).expect("connects");
    stream.set_read_timeout(Some(SOON)).expect("a timeout");
    stream
}

/// What comes back until the server closes.
fn all(stream: &mut TcpStream) -> String {
    let mut bytes = Vec::new();
    // A reset after the answer is the server's way to end with one that goes on sending.
    let ended = stream.read_to_end(&mut bytes);
    assert!(!matches!(&ended, Err(e) if e.kind() == io::ErrorKind::WouldBlock), "nothing came for {SOON:?}");
    String::from_utf8_lossy(&bytes).into_owned()
}

fn ask(address: SocketAddr, request: &str) -> String {
    let mut stream = connect(address);
    stream.write_all(request.as_bytes()).expect("writes");
    all(&mut stream)
}

fn get(path: &str) -> String {
    format!("GET {path} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n")
}

/// Somebody else is served.
fn is_served(address: SocketAddr) {
    let answer = ask(address, &get("/"));
    assert!(answer.starts_with("HTTP/1.1 200 OK\r\n") && answer.ends_with("\r\n\r\nhello\n"), "{answer}");
}

#[test]
fn unfinished_heads_and_bodies_hold_nobody_up_and_are_ended() {
    with(HASTY, |address| {
        let begun = [
            "",
            "G",
            "GET / HTTP/1.1\r\nHost: x\r\nA: b",
            "POST /echo HTTP/1.1\r\nHost: x\r\nContent-Length: 9\r\n\r\n1234",
        ];
        let mut held: Vec<_> = begun.iter().map(|text| (connect(address), text)).collect();
        for (stream, text) in &mut held {
            stream.write_all(text.as_bytes()).expect("writes");
        }
        is_served(address);
        for (stream, text) in &mut held {
            let answer = all(stream);
            // One that said nothing gets nothing.
            assert!(
                if text.is_empty() { answer.is_empty() } else { answer.starts_with("HTTP/1.1 408") },
                "{text}: {answer}"
            );
        }
    });
}

#[test]
fn a_head_that_drips_is_ended_by_its_first_byte() {
    with(HASTY, |address| {
        let mut stream = connect(address);
        let drips = (0..10_000).take_while(|_| {
            std::thread::sleep(Duration::from_millis(20));
            stream.write_all(b"x").is_ok()
        });
        assert!(drips.count() < 1000);
    });
}

#[test]
fn endless_heads_and_bodies_are_refused() {
    with(LIMITS, |address| {
        let long = "x".repeat(LIMITS.head);
        let many = "A: b\r\n".repeat(100);
        let cases = [
            (format!("GET /{long}"), "431"),
            (format!("GET / HTTP/1.1\r\nHost: x\r\nA: {long}\r\n\r\n"), "431"),
            (format!("GET / HTTP/1.1\r\nHost: x\r\n{many}\r\n"), "431"),
            ("POST / HTTP/1.1\r\nHost: x\r\nContent-Length: 65537\r\n\r\n".to_owned(), "413"),
            (format!("POST / HTTP/1.1\r\nHost: x\r\nContent-Length: {}\r\n\r\n", "9".repeat(40)), "413"),
            ("POST / HTTP/1.1\r\nHost: x\r\nTransfer-Encoding: chunked\r\n\r\n10001\r\n".to_owned(), "413"),
            ("POST / HTTP/1.1\r\nHost: x\r\nContent-Length: 1\r\nContent-Length: 2\r\n\r\n".to_owned(), "400"),
            ("\u{1}\u{2}\r\n\r\n".to_owned(), "400"),
        ];
        for (request, status) in cases {
            let answer = ask(address, &request);
            assert!(answer.starts_with(&format!("HTTP/1.1 {status} ")), "{status}: {answer}");
        }
        is_served(address);
    });
}

#[test]
fn one_who_goes_on_sending_after_a_refusal_still_reads_why() {
    with(LIMITS, |address| {
        let mut stream = connect(address);
        stream.write_all(b"POST /echo HTTP/1.1\r\nHost: x\r\nContent-Length: 100000\r\n\r\n").expect("writes");
        let _ = stream.write_all(&[b'x'; 100_000]);
        assert!(all(&mut stream).starts_with("HTTP/1.1 413 "));
    });
}

#[test]
fn a_body_shorter_than_announced_is_no_request() {
    with(LIMITS, |address| {
        let mut stream = connect(address);
        stream.write_all(b"POST /echo HTTP/1.1\r\nHost: x\r\nContent-Length: 5\r\n\r\n1234").expect("writes");
        stream.shutdown(Shutdown::Write).expect("half closed");
        assert_eq!(all(&mut stream), "");
    });
}

#[test]
fn one_who_has_said_all_still_gets_an_answer() {
    with(LIMITS, |address| {
        let mut stream = connect(address);
        stream.write_all(b"GET / HTTP/1.1\r\nHost: x\r\n\r\n").expect("writes");
        stream.shutdown(Shutdown::Write).expect("half closed");
        assert!(all(&mut stream).ends_with("hello\n"));
    });
}

#[test]
fn requests_in_a_row_are_answered_in_their_order() {
    with(LIMITS, |address| {
        let one =
            |body: &str| format!("POST /echo HTTP/1.1\r\nHost: x\r\nContent-Length: {}\r\n\r\n{body}", body.len());
        let chunked = "POST /echo HTTP/1.1\r\nHost: x\r\nTransfer-Encoding: chunked\r\n\r\n3\r\ntwo\r\n0\r\n\r\n";
        let answer = ask(address, &format!("{}{chunked}\r\n{}{}", one("first"), one("third"), get("/")));
        let places: Vec<_> =
            ["first", "two", "third", "hello"].iter().map(|w| answer.find(w).expect("answered")).collect();
        assert!(places.is_sorted(), "{answer}");
    });
}

#[test]
fn one_who_waits_for_a_go_ahead_gets_it() {
    with(LIMITS, |address| {
        let mut stream = connect(address);
        let head =
            b"POST /echo HTTP/1.1\r\nHost: x\r\nContent-Length: 2\r\nConnection: close\r\nExpect: 100-continue\r\n\r\n";
        stream.write_all(head).expect("writes");
        let mut go = [0; 25];
        stream.read_exact(&mut go).expect("a go-ahead");
        assert_eq!(&go, b"HTTP/1.1 100 Continue\r\n\r\n");
        stream.write_all(b"ok").expect("writes");
        assert!(all(&mut stream).ends_with("\r\n\r\nok"));
    });
}

#[test]
fn only_the_head_is_sent_where_only_that_is_asked_for() {
    with(LIMITS, |address| {
        let answer = ask(address, "HEAD / HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n");
        assert!(answer.contains("\r\nContent-Length: 6\r\n") && answer.ends_with("\r\n\r\n"), "{answer}");
    });
}

#[test]
fn answers_that_nobody_reads_hold_nobody_up() {
    with(LIMITS, |address| {
        let deaf: Vec<_> = (0..2 * LIMITS.connections)
            .map(|_| {
                let mut stream = connect(address);
                stream.write_all(get("/large").as_bytes()).expect("writes");
                stream
            })
            .collect();
        is_served(address);
        drop(deaf);
    });
}

#[test]
fn one_who_sends_ahead_without_reading_is_read_no_further() {
    with(LIMITS, |address| {
        let mut stream = connect(address);
        stream.set_write_timeout(Some(Duration::from_millis(200))).expect("a timeout");
        let requests = "GET /large HTTP/1.1\r\nHost: x\r\n\r\n".repeat(10_000);
        let sent = (0..1000).take_while(|_| stream.write_all(requests.as_bytes()).is_ok()).count();
        assert!(sent < 1000, "gigabytes were taken");
        is_served(address);
    });
}

#[test]
fn a_flood_of_connections_keeps_nobody_out() {
    with(LIMITS, |address| {
        let mut flood = Vec::new();
        for turn in 0..500 {
            let mut stream = connect(address);
            let _ = stream.write_all(b"GET / HTTP/1.1\r\nHost:");
            flood.push(stream);
            if turn % 100 == 99 {
                is_served(address);
            }
        }
    });
}

#[test]
fn events_go_to_those_who_listen_and_to_only_so_many() {
    with(LIMITS, |address| {
        let listen = || {
            let mut stream = connect(address);
            stream.write_all(get("/events").as_bytes()).expect("writes");
            stream
        };
        let (mut one, mut two) = (listen(), listen());
        for stream in [&mut one, &mut two] {
            let mut seen = String::new();
            while seen.matches("\n\n").count() < 3 {
                let mut bytes = [0; 256];
                let n = stream.read(&mut bytes).expect("an event");
                assert!(n > 0, "{seen}");
                seen.push_str(&String::from_utf8_lossy(&bytes[..n]));
            }
            assert!(seen.contains("Content-Type: text/event-stream\r\n"), "{seen}");
            assert!(seen.contains("event: turn\ndata: ") && seen.contains("\ndata: and on\n\n"), "{seen}");
        }
        assert!(all(&mut listen()).starts_with("HTTP/1.1 503 "));
        drop((one, two));
        is_served(address);
    });
}

#[test]
fn one_who_does_not_read_its_events_is_dropped() {
    let mut server = Server::bind(0, LIMITS).expect("a free port");
    let mut stream = connect(server.address());
    stream.write_all(get("/events").as_bytes()).expect("writes");
    let asked = std::iter::repeat_with(|| server.next(Duration::from_millis(5)).expect("a turn")).find_map(|a| a);
    server.answer(asked.expect("a request").client, Answer::events());
    let large = "x".repeat(LIMITS.unread / 2);
    for _ in 0..10_000 {
        server.publish("large", &large);
        if server.listeners() == 0 {
            return;
        }
    }
    panic!("gigabytes are kept for one who does not read");
}
