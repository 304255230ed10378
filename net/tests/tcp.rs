//! Bytes over TCP against clients that come and go, say nothing or do not read.

use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use matterix_net::tcp::{Heard, Limits, Server};

const LIMITS: Limits = Limits { connections: 8, unread: 1 << 16 };

/// Serves an echo.
fn with(clients: impl FnOnce(SocketAddr)) {
    let mut server = Server::bind(0, LIMITS).expect("a free port");
    let (address, stop) = (server.address(), AtomicBool::new(false));
    std::thread::scope(|scope| {
        scope.spawn(|| {
            while !stop.load(Ordering::Relaxed) {
                if let Some(Heard::Said(client, bytes)) = server.next(Duration::from_millis(5)).expect("the port stays")
                {
                    server.send(client, &bytes);
                }
            }
        });
        let done = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| clients(address)));
        stop.store(true, Ordering::Relaxed);
        done.unwrap_or_else(|why| std::panic::resume_unwind(why))
    });
}

fn connect(address: SocketAddr) -> TcpStream {
    let stream = TcpStream::connect(address).expect("connects");
    stream.set_read_timeout(Some(Duration::from_secs(20))).expect("a timeout");
    stream
}

fn is_echoed(stream: &mut TcpStream, word: &[u8]) {
    stream.write_all(word).expect("writes");
    let mut back = vec![0; word.len()];
    stream.read_exact(&mut back).expect("an echo");
    assert_eq!(back, word);
}

#[test]
fn clients_are_served_beside_those_that_say_nothing_or_do_not_read() {
    with(|address| {
        let mut first = connect(address);
        is_echoed(&mut first, b"one");
        let silent: Vec<_> = (0..3).map(|_| connect(address)).collect();
        let mut deaf = connect(address);
        deaf.set_write_timeout(Some(Duration::from_millis(200))).expect("a timeout");
        let sent = (0..1000).take_while(|_| deaf.write_all(&[0; 1 << 20]).is_ok()).count();
        assert!(sent < 1000, "what nobody reads back is taken without end");
        is_echoed(&mut connect(address), b"two");
        is_echoed(&mut first, b"three");
        drop((silent, deaf));
    });
}

#[test]
fn a_flood_of_silent_connections_keeps_nobody_out_and_ends_nobody_who_speaks() {
    with(|address| {
        let mut first = connect(address);
        is_echoed(&mut first, b"one");
        let flood: Vec<_> = (0..300).map(|_| connect(address)).collect();
        is_echoed(&mut connect(address), b"two");
        is_echoed(&mut first, b"three");
        drop(flood);
    });
}

#[test]
fn the_caller_hears_that_a_client_has_left() {
    let mut server = Server::bind(0, LIMITS).expect("a free port");
    let mut stream = connect(server.address());
    stream.write_all(b"x").expect("writes");
    drop(stream);
    let mut heard = std::iter::repeat_with(|| server.next(Duration::from_millis(5)).expect("a turn")).flatten();
    let Some(Heard::Said(client, bytes)) = heard.next() else { panic!("nothing was said") };
    assert_eq!(bytes, b"x");
    assert_eq!(heard.next(), Some(Heard::Left(client)));
}
