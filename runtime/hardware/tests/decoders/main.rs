//! Decoders against inputs that are spoiled at random: a little in the gate, and for `MATTERIX_FUZZ` seconds each on request,
//! with what is found kept in the folder that `MATTERIX_CORPUS` names. `fuzz/` has the same with coverage as its guide.

mod any;

use std::io::Write;
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// What the inputs are made from, by decoder.
const WIRE: &[&str] = &[
    "/0`1500\u{3}\r\n",
    "\u{2}0`\u{3}Q",
    "\u{2}11I1A1274R\u{3}k",
    "/1I1A1274R\r",
    "25.3 2 \r\nS S    12.34 g\r\n",
    "[M010COK44\r[M0110ERR 3D8\r",
    "\u{2}\u{8}SAF0UC\u{3}",
    ":OK66;:T=23.410;",
    "\u{1}\u{3}\u{4}A\0\0\0\u{1}\u{4}\0d\0\u{2}",
    "\0\u{1}\0\0\0\u{5}\u{1}\u{3}\u{2}\0\t\0\u{1}\0\0\0\u{3}\u{1}A\u{2}",
];
const HTTP: &[&str] = &[
    "POST /runs/<run>/commands /data/volume=100 name='a b' params/x={}\n201 {\"data\":{\"id\":\"x\",\"volume\":100}}\n",
    "201 /data/id=<run> volume=\n404 {\"errors\":[{\"id\":\"none\",\"detail\":\"no\"}]}\n",
    "POST /protocols files=@\nPOST /runs {\"data\":{\"id\":[1,2,{\"a\":null}]}}\n",
    "GET /a?b=c&d=<e> /0/1=2 ~01~10=3\nGET /a?b=c&d=x-1 {\"0\":[1,2]}\n",
];
const REQUEST: &[&str] = &[
    "POST /runs?a=b HTTP/1.1\r\nHost: localhost:80\r\nContent-Length: 5\r\nConnection: close\r\n\r\n{\"a\"}GET / HTTP/1.1\r\n",
    "PUT / HTTP/1.1\r\nHost: [::1]\r\nTransfer-Encoding: chunked\r\nOrigin: null\r\n\r\n4;x=y\r\nWiki\r\n05\r\npedia\r\n0\r\nA: b\r\n\r\n",
    "GET / HTTP/1.0\r\n\r\n",
];
const JOURNAL: &[&str] = &[
    "{\"event\":\"begin\",\"version\":1,\"digest\":\"0\",\"workflow\":\"warm\",\"wall\":0.5,\"speed\":40.0}\n",
    "{\"event\":\"starting\",\"t\":1.5,\"ticket\":0,\"step\":3,\"label\":\"a\",\"span\":\"a:1:1\",\"device\":\"p\",\"sends\":[\"A\"]}\n",
    "{\"event\":\"ended\",\"t\":2e-3,\"ticket\":0,\"failed\":[\"refused\",\"no\"]}\n{\"event\":\"opened\",\"t\":-0.0}\n",
    "{\"event\":\"kept\",\"t\":0.0,\"device\":\"p\",\"word\":\"run\",\"text\":\"1\"}\n{\"event\":\"time\",\"t\":3.0,\"fired\":[0,2],\"wall\":1.0}\n",
];
/// Bytes that mean something to one of them.
const WORDS: &[&str] = &[
    "\r\n",
    "\u{2}",
    "\u{3}",
    "/",
    "'",
    "=",
    " ",
    "<run>",
    "{}",
    "[]",
    "null",
    "1e999",
    "-",
    ".",
    "\"",
    "\\",
    "201 ",
    "/data/",
    "@",
    "\u{1}",
    "~1",
    "18446744073709551616",
    "é",
    "\u{0}",
    "R",
    ",",
    "\r\n\r\n",
    "Content-Length: ",
    "ffffffffffffffff",
    "0\r\n",
];

/// Numbers from a seed.
struct Dice(u64);

impl Dice {
    fn below(&mut self, n: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 33) as usize) % n.max(1)
    }

    /// One of the inputs, spoiled a few times.
    fn input(&mut self, corpus: &[Vec<u8>]) -> Vec<u8> {
        let mut bytes = corpus[self.below(corpus.len())].clone();
        for _ in 0..=self.below(6) {
            let at = self.below(bytes.len() + 1);
            match self.below(6) {
                0 if at < bytes.len() => bytes[at] ^= 1 << self.below(8),
                1 if at < bytes.len() => drop(bytes.drain(at..(at + 1 + self.below(8)).min(bytes.len()))),
                2 => bytes.truncate(at),
                3 => {
                    let other = corpus[self.below(corpus.len())].clone();
                    let from = self.below(other.len() + 1);
                    bytes.truncate(at);
                    bytes.extend(&other[from..]);
                }
                _ => {
                    let word = WORDS[self.below(WORDS.len())].as_bytes().to_vec();
                    bytes.splice(at..at, word);
                }
            }
            bytes.truncate(10_000);
        }
        bytes
    }
}

#[allow(clippy::disallowed_methods, reason = "it goes on for a time")]
fn spoil(name: &str, seeds: &[&str], decode: fn(&[u8])) {
    let seconds = std::env::var("MATTERIX_FUZZ").ok().and_then(|s| s.parse().ok()).unwrap_or(1.0);
    let kept = std::env::var("MATTERIX_CORPUS").ok().map(|folder| PathBuf::from(folder).join(name));
    let mut corpus: Vec<Vec<u8>> = seeds.iter().map(|s| s.as_bytes().to_vec()).collect();
    let (mut dice, mut tried) = (Dice(1), 0_u64);
    let begun = Instant::now();
    while begun.elapsed() < Duration::from_secs_f64(seconds) {
        let input = dice.input(&corpus);
        let slow = Instant::now();
        if std::panic::catch_unwind(|| decode(&input)).is_err() || slow.elapsed() > Duration::from_secs(2) {
            keep(kept.as_deref(), "found", &input);
            panic!("{name} after {tried} inputs: `{}`", input.escape_ascii());
        }
        tried += 1;
        // What is spoiled is spoiled further.
        if tried % 64 == 0 && corpus.len() < 4096 {
            keep(kept.as_deref(), &format!("{tried}"), &input);
            corpus.push(input);
        }
    }
    println!("{name}: {tried} inputs in {seconds} s, none of them bad");
}

fn keep(folder: Option<&std::path::Path>, name: &str, input: &[u8]) {
    let Some(folder) = folder else { return };
    std::fs::create_dir_all(folder).expect("a folder");
    std::fs::File::create(folder.join(name)).and_then(|mut f| f.write_all(input)).expect("a file");
}

#[test]
fn no_line_upsets_a_framing() {
    spoil("wire", WIRE, any::wire);
}

#[test]
fn no_answer_upsets_the_messages_of_a_server() {
    spoil("http", HTTP, any::http);
}

#[test]
fn no_request_upsets_a_server() {
    spoil("request", REQUEST, any::request);
}

#[test]
fn no_journal_upsets_its_reader() {
    spoil("journal", JOURNAL, any::journal);
}
