//! Emulators at ports and pseudo-terminals.

use std::fs::{self, File};
use std::io::{Read, Write};
use std::net::TcpStream;
use std::os::unix::fs::symlink;
use std::path::Path;

use super::Server;
use crate::harness::{folder, matterixc_in, write};

const ASK: &[u8] = b"IN_PV_1 \r\n";

fn is_answered(stream: &mut (impl Read + Write)) {
    stream.write_all(ASK).expect("writes");
    let mut text = String::new();
    let mut byte = [0];
    while !text.ends_with('\n') {
        stream.read_exact(&mut byte).expect("an answer");
        text.push(char::from(byte[0]));
    }
    assert!(text.contains(" 1"), "{text}");
}

fn plate(name: &str) -> Server {
    Server::start(&folder(name), &["emulate", "IkaRetControl", "--tcp", "0"])
}

#[test]
fn several_masters_have_a_line_each() {
    let server = plate("servers_masters");
    let (mut one, mut two) = (server.connect(), server.connect());
    is_answered(&mut one);
    // Half a message of one is no beginning of another's.
    one.write_all(b"OUT_SP_").expect("writes");
    is_answered(&mut two);
    one.write_all(b"1 40\r\n").expect("writes");
    is_answered(&mut one);
    drop(one);
    is_answered(&mut two);
    assert_eq!(server.interrupted(), Some(0));
}

#[test]
fn masters_that_say_nothing_end_no_line_or_do_not_read_hold_up_nobody() {
    let server = plate("servers_silent");
    let mut first = server.connect();
    is_answered(&mut first);
    let before = server.memory();
    let silent: Vec<TcpStream> = (0..40).map(|_| server.connect()).collect();
    let mut endless = server.connect();
    endless.write_all(&vec![b'x'; 4 << 20]).expect("a line without an end is taken and thrown away");
    let mut deaf = server.connect();
    deaf.set_write_timeout(Some(std::time::Duration::from_millis(200))).expect("a timeout");
    let questions = ASK.repeat(10_000);
    let sent = (0..1000).take_while(|_| deaf.write_all(&questions).is_ok()).count();
    assert!(sent < 1000, "what nobody reads is answered without end");
    is_answered(&mut server.connect());
    is_answered(&mut first);
    assert!(server.memory() < before + (32 << 10), "{} KiB after {before}", server.memory());
    assert_eq!(server.interrupted(), Some(0));
    drop(silent);
}

fn line(name: &str, link: &str) -> (Server, std::path::PathBuf) {
    let dir = folder(name);
    let server = Server::start(&dir, &["emulate", "IkaRetControl", "--pty", "--link", link]);
    (server, dir)
}

fn open(path: &Path) -> File {
    File::options().read(true).write(true).open(path).expect("a pseudo-terminal")
}

#[test]
fn a_pseudo_terminal_that_nobody_reads_does_not_hold_up_ctrl_c() {
    let (server, dir) = line("servers_deaf", "port");
    is_answered(&mut open(&dir.join("port")));
    let mut deaf = open(&dir.join("port"));
    // More answers than the line's own buffers hold; a thread, since the line itself may stop taking questions.
    let asks = std::thread::spawn(move || (0..10_000).take_while(|_| deaf.write_all(ASK).is_ok()).count());
    std::thread::sleep(std::time::Duration::from_millis(300));
    assert_eq!(server.interrupted(), Some(0));
    assert!(fs::symlink_metadata(dir.join("port")).is_err(), "its link is left");
    let _ = asks.join();
}

#[test]
fn a_link_takes_the_place_of_a_link_only() {
    let dir = folder("servers_link");
    write(&dir, "data.csv", "kept");
    fs::create_dir(dir.join("folder")).expect("a folder");
    for taken in ["data.csv", "folder"] {
        let refused = matterixc_in(&dir, &["emulate", "IkaRetControl", "--pty", "--link", taken]);
        assert_eq!(refused.code, 2, "{}", refused.err);
        assert!(refused.err.contains(taken) && refused.err.contains("another file exists there"), "{}", refused.err);
    }
    assert_eq!(fs::read_to_string(dir.join("data.csv")).expect("still there"), "kept");
    assert!(dir.join("folder").is_dir());

    symlink(dir.join("data.csv"), dir.join("port")).expect("a link");
    let server = Server::start(&dir, &["emulate", "IkaRetControl", "--pty", "--link", "port"]);
    is_answered(&mut open(&dir.join("port")));
    assert_eq!(fs::read_to_string(dir.join("data.csv")).expect("still there"), "kept");
    // Another emulator takes the link over: it is not the first one's to remove.
    let other = Server::start(&dir, &["emulate", "IkaRetControl", "--pty", "--link", "port"]);
    assert_eq!(server.interrupted(), Some(0));
    is_answered(&mut open(&dir.join("port")));
    assert_eq!(other.interrupted(), Some(0));
    assert!(fs::symlink_metadata(dir.join("port")).is_err());
}
