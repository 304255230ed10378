//! Calls leave nothing behind, in the client or in the server: alone in its process, whose memory is measured.

use std::net::{Ipv4Addr, SocketAddr};
use std::time::Duration;

use matterix_sila::read;
use matterix_sila_wire::{About, Access, Client, Door, News, Request, Value, serve};

const PLATE: &str = include_str!("../../../tests/deploy/hotplate.sila.xml");

/// Bytes of this process in memory.
fn resident() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").expect("this is Linux");
    let line = status.lines().find(|l| l.starts_with("VmRSS:")).expect("it is there");
    line.split_whitespace().nth(1).and_then(|n| n.parse::<u64>().ok()).expect("it is a number") * 1024
}

#[test]
fn a_thousand_calls_leak_nothing() {
    let any = SocketAddr::from((Ipv4Addr::LOCALHOST, 0));
    let about = About { name: "plate".into(), uuid: "7f3f5b0e-8c57-4d56-9a3e-2c1f0d9b6a11".into(), ..About::default() };
    let features = vec![read(PLATE).expect("the feature is sound")];
    let (server, requests) = serve(any, about, Door::default(), features).expect("a port is free");
    std::thread::spawn(move || {
        while let Ok(request) = requests.recv() {
            match request {
                Request::Read(read) => drop(read.answer.send(Ok(Value::Real(25.0)))),
                Request::Call(call) => drop(call.news.send(News::Done(vec![Value::Real(25.0)]))),
            }
        }
    });
    let access = Access { address: server.address.to_string(), ..Access::default() };
    let mut client =
        Client::connect(&access, "org.example/heating/HotPlate/v1", Duration::from_secs(10)).expect("it answers");
    let mut calls = |count: usize| {
        for _ in 0..count {
            assert_eq!(client.ask("CurrentTemperature"), Ok("25".into()));
            assert_eq!(client.say("Stop", false), Ok(String::new()));
            // The server keeps the ends of the last 1,000 of these, and no more.
            assert_eq!(client.say("HoldTemperature(Time: 0.5)", true), Ok("FinalTemperature: 25".into()));
        }
    };
    calls(1100);
    let before = resident();
    calls(1000);
    let more = resident().saturating_sub(before);
    assert!(more < 1 << 20, "1,000 calls of three kinds left {more} bytes behind");
}
