//! Values over the wire and in text; a server and a client of this crate against each other.

use std::net::{Ipv4Addr, SocketAddr};
use std::sync::mpsc::Receiver;
use std::time::Duration;

use matterix_sila::feature::{Basic, Constraints, DataType, Element};
use matterix_sila::{Feature, read};
use matterix_sila_wire::text::{call, shown, value};
use matterix_sila_wire::tls::{Trust, own};
use matterix_sila_wire::{
    About, Access, Client, Door, Failure, Lock, Login, News, Raw, Request, Server, Users, Value, decode, encode, serve,
};
use proptest::prelude::*;
use prost::Message;

const PLATE: &str = include_str!("../../../tests/deploy/hotplate.sila.xml");
const UUID: &str = "7f3f5b0e-8c57-4d56-9a3e-2c1f0d9b6a11";
const ID: &str = "org.example/heating/HotPlate/v1";

fn plate() -> Feature {
    read(PLATE).expect("the feature is sound")
}

fn about() -> About {
    let [name, description, version, uuid] = ["plate", "a plate", "1.0", UUID].map(str::to_owned);
    About { name, description, version, uuid }
}

fn plain(address: &str) -> Access {
    Access { address: address.to_owned(), ..Access::default() }
}

/// Does what is asked until nobody asks any more.
fn lab(requests: Receiver<Request>) {
    let mut target = 25.0;
    while let Ok(request) = requests.recv() {
        match request {
            Request::Read(read) => {
                let answer = match read.property {
                    0 => Ok(Value::Real(target)),
                    1 => Ok(Value::Text("A-17".into())),
                    _ => Err(Failure::Refused { name: "SensorFailed".into(), message: "no probe".into() }),
                };
                let _ = read.answer.send(answer);
            }
            Request::Call(call) => {
                let news = match (call.command, call.arguments.first()) {
                    (0, Some(Value::Real(13.0))) => {
                        News::Failed(Failure::Refused { name: "SensorFailed".into(), message: "no probe".into() })
                    }
                    (0, Some(Value::Real(t))) => {
                        target = *t;
                        News::Done(Vec::new())
                    }
                    (1, Some(Value::Real(n))) if *n > 100.0 => News::NotNow("it is in use".into()),
                    (1, _) => {
                        let _ = call.news.send(News::Begun);
                        std::thread::sleep(Duration::from_millis(50));
                        News::Done(vec![Value::Real(target)])
                    }
                    _ => News::Done(Vec::new()),
                };
                let _ = call.news.send(news);
            }
        }
    }
}

fn refused(result: Result<String, Failure>) -> (String, String) {
    match result {
        Err(Failure::Refused { name, message }) => (name, message),
        other => panic!("not refused: {other:?}"),
    }
}

#[test]
fn a_client_and_a_server_understand_each_other() {
    let any = SocketAddr::from((Ipv4Addr::LOCALHOST, 0));
    let (server, requests) = serve(any, about(), Door::default(), vec![plate()]).expect("a port is free");
    let working = std::thread::spawn(move || lab(requests));
    let (address, time) = (server.address.to_string(), Duration::from_secs(5));
    let mut client = Client::connect(&plain(&address), ID, time).expect("it answers");
    assert_eq!(client.feature().id(), ID);
    assert_eq!(client.ask("CurrentTemperature"), Ok("25".into()));
    assert_eq!(client.ask("SiLAService.ServerName"), Ok("plate".into()));
    assert_eq!(client.ask("SiLAService.ServerUUID"), Ok(UUID.into()));
    let unknown = refused(client.say(&format!("CancelController.CancelCommand(CommandExecutionUUID: {UUID})"), true));
    assert_eq!(unknown.0, "InvalidCommandExecutionUUID");
    assert_eq!(client.say("CancelController.CancelAll", true), Ok(String::new()));
    let said = "SetTarget(Target: 60.5, Mode: fast, Quiet: true)";
    assert_eq!(client.say(said, false), Ok(String::new()));
    assert_eq!(client.ask("CurrentTemperature"), Ok("60.5".into()));
    assert_eq!(refused(client.ask("Power")).0, "SensorFailed");
    let sensor = refused(client.say("SetTarget(Target: 13, Mode: fast, Quiet: false)", false));
    assert_eq!(sensor, ("SensorFailed".into(), "no probe".into()));
    assert_eq!(client.say("HoldTemperature(Time: 0.5)", true), Ok("FinalTemperature: 60.5".into()));
    assert_eq!(client.ask("HoldTemperature.FinalTemperature"), Ok("60.5".into()));
    assert_eq!(refused(client.say("HoldTemperature(Time: 101)", true)).0, "CommandExecutionNotAccepted");
    assert_eq!(client.say("HoldTemperature(Time: 0.5)", false), Ok(String::new()));
    while !client.is_done("HoldTemperature").expect("it goes on") {}
    for wrong in [
        "SetTarget(Target: 400, Mode: fast, Quiet: true)",
        "SetTarget(Target: 60, Mode: loud, Quiet: true)",
        "SetTarget(Target: 60, Mode: fast)",
        "SetTarget(Target: 60, Mode: fast, Quiet: true, More: 1)",
        "Heat",
        "Other.Heat",
        "SetTarget(",
    ] {
        assert!(matches!(client.say(wrong, false), Err(Failure::Garbled(_))), "{wrong}");
    }
    let other = Client::connect(&plain(&address), "org.example/heating/Oven/v1", time).err();
    assert!(matches!(other, Some(Failure::Garbled(why)) if why.contains("does not offer")));
    drop(server);
    assert!(matches!(client.say(said, false), Err(Failure::Lost(_))));
    drop(client);
    working.join().expect("the lab ends");
}

#[test]
fn a_text_keeps_its_quotes_commas_and_backslashes() {
    let feature = plate();
    let text = DataType::Basic(Basic::String);
    let call = call(r#"Stop(A: "say \"hi\", then \\", B: 2)"#).expect("it is a call");
    assert_eq!(call.arguments.len(), 2);
    let read = value(&feature, &text, &call.arguments[0].1);
    assert_eq!(read, Ok(Value::Text(r#"say "hi", then \"#.into())));
    for wrong in [r#""a"b"#, r#""a\b""#, r#""a"#] {
        assert!(value(&feature, &text, wrong).is_err(), "{wrong}");
    }
}

#[test]
fn lengths_patterns_and_counts_are_checked_through_nested_constraints() {
    let feature = plate();
    let constrained = |of, constraints| DataType::Constrained(Box::new(of), Box::new(constraints));
    let short = constrained(
        DataType::Basic(Basic::String),
        Constraints { length: (Some(2), Some(4)), ..Constraints::default() },
    );
    let letters = constrained(short, Constraints { pattern: Some("[a-z]+|Ä{3}".into()), ..Constraints::default() });
    for (text, good) in [("abc", true), ("ÄÄÄ", true), ("a", false), ("abcde", false), ("ab1", false), ("xÄÄÄ", false)]
    {
        assert_eq!(value(&feature, &letters, text).is_ok(), good, "{text}");
    }
    let pair =
        constrained(DataType::List(Box::new(letters)), Constraints { count: (Some(2), Some(2)), ..Default::default() });
    let element =
        Element { identifier: "A".into(), display: String::new(), description: String::new(), ty: pair.clone() };
    for (text, good) in [("[ab, cd]", true), ("[ab]", false), ("[ab, cd, ef]", false), ("[ab, c]", false)] {
        assert_eq!(value(&feature, &pair, text).is_ok(), good, "{text}");
    }
    let one = encode(&feature, std::slice::from_ref(&element), &[Value::List(vec![Value::Text("ab".into())])]);
    let told = decode(&feature, &[element], &one.expect("it is encoded"));
    assert!(told.is_err_and(|why| why.contains("1 elements")));
}

/// A server that takes a connection and answers like this.
fn answering(first: &'static [u8]) -> String {
    use std::io::{Read, Write};
    let listener = std::net::TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).expect("a port is free");
    let address = listener.local_addr().expect("it has one").to_string();
    std::thread::spawn(move || {
        for mut stream in listener.incoming().flatten() {
            let _ = stream.read(&mut [0; 64]);
            let _ = stream.write_all(first);
        }
    });
    address
}

#[test]
fn an_encrypted_server_is_named_as_such() {
    // An alert of TLS: a protocol version that the server does not speak.
    let address = answering(&[21, 3, 3, 0, 2, 2, 70]);
    let failed = Client::connect(&plain(&address), ID, Duration::from_secs(1)).err();
    assert!(matches!(&failed, Some(Failure::Garbled(why)) if why.contains("is encrypted (TLS)")), "{failed:?}");
    let failed = Client::connect(&plain(&answering(b"HTTP/1.1 400")), ID, Duration::from_secs(1)).err();
    assert!(failed.is_some_and(|f| !format!("{f:?}").contains("TLS")));
}

/// A plate that is served, and where.
fn served(door: Door) -> (Server, String) {
    let any = SocketAddr::from((Ipv4Addr::LOCALHOST, 0));
    let (server, requests) = serve(any, about(), door, vec![plate()]).expect("a port is free");
    std::thread::spawn(move || lab(requests));
    let address = server.address.to_string();
    (server, address)
}

const TIME: Duration = Duration::from_secs(10);

#[test]
fn encrypted_servers_are_trusted_by_certificate_or_fingerprint_and_no_others() {
    let identity = own(UUID, &["localhost".to_owned(), "127.0.0.1".to_owned()]).expect("it is made");
    let (_server, address) = served(Door { identity: Some(identity.clone()), users: None });
    let trusting = |trust| Access { trust, ..plain(&address) };
    let shown = identity.fingerprint().expect("it has one");

    let failed = Client::connect(&plain(&address), ID, TIME).err();
    assert!(matches!(&failed, Some(Failure::Garbled(why)) if why.contains(&shown)), "{failed:?}");

    let mut client =
        Client::connect(&trusting(Trust::Certificates(identity.chain.clone())), ID, TIME).expect("it is known");
    assert_eq!(client.ask("CurrentTemperature"), Ok("25".into()));

    let mut digest = [0; 32];
    for (byte, pair) in digest.iter_mut().zip(shown.split(':')) {
        *byte = u8::from_str_radix(pair, 16).expect("it is hexadecimal");
    }
    assert!(Client::connect(&trusting(Trust::Fingerprint(digest)), ID, TIME).is_ok());
    digest[0] ^= 1;
    let other = own(UUID, &["127.0.0.1".to_owned()]).expect("it is made");
    for wrong in [Trust::Fingerprint(digest), Trust::Certificates(other.chain)] {
        let failed = Client::connect(&trusting(wrong), ID, TIME).err();
        let named =
            matches!(&failed, Some(Failure::Garbled(why)) if why.contains("not trusted") && why.contains(&shown));
        assert!(named, "{failed:?}");
    }
    let none = Client::connect(&trusting(Trust::Certificates("no PEM".into())), ID, TIME).err();
    assert!(none.is_some_and(|f| format!("{f:?}").contains("no certificate in PEM")));

    let (_server, address) = served(Door::default());
    let failed = Client::connect(&Access { trust: Trust::Fingerprint(digest), ..plain(&address) }, ID, TIME).err();
    assert!(failed.is_some_and(|f| format!("{f:?}").contains("does not use TLS")));
}

#[test]
fn a_client_that_hangs_while_it_greets_holds_nobody_else() {
    let identity = own(UUID, &["127.0.0.1".to_owned()]).expect("it is made");
    let (server, address) = served(Door { identity: Some(identity.clone()), users: None });
    let _silent: Vec<_> = (0..20).map(|_| std::net::TcpStream::connect(server.address).expect("it listens")).collect();
    let trust = Trust::Certificates(identity.chain);
    assert!(Client::connect(&Access { trust, ..plain(&address) }, ID, TIME).is_ok());
}

#[test]
fn a_server_that_is_taken_answers_nobody_else() {
    let (_server, address) = served(Door::default());
    let lock = |name: &str| Some(Lock { name: name.to_owned(), lapse: Duration::from_secs(60) });
    let taking = |name: &str| Client::connect(&Access { lock: lock(name), ..plain(&address) }, ID, TIME);
    let mut other = Client::connect(&plain(&address), ID, TIME).expect("it answers");
    assert_eq!(other.ask("LockController.IsLocked"), Ok("0".into()));
    let mut ana = taking("ana").expect("it is free");
    assert_eq!(ana.ask("CurrentTemperature"), Ok("25".into()));
    assert_eq!(ana.say("HoldTemperature(Time: 0.5)", true), Ok("FinalTemperature: 25".into()));
    assert_eq!(ana.say("CancelController.CancelAll", true), Ok(String::new()));
    assert_eq!(other.ask("LockController.IsLocked"), Ok("1".into()));
    assert_eq!(refused(other.ask("CurrentTemperature")).0, "InvalidMetadata");
    assert_eq!(refused(other.say("Stop", false)).0, "InvalidMetadata");
    assert_eq!(refused(other.say("CancelController.CancelAll", true)).0, "InvalidMetadata");
    let failed = taking("bob").err();
    assert!(matches!(&failed, Some(Failure::Refused { name, .. }) if name == "ServerAlreadyLocked"), "{failed:?}");
    // Who was cut off takes it again.
    let again = taking("ana").expect("it is hers");
    drop(again);
    assert_eq!(other.ask("CurrentTemperature"), Ok("25".into()));
}

#[test]
fn only_those_who_log_in_may_call() {
    let hash = "$2y$04$abcdefghijklmnopqrstuu2r9OfJnfCsdneAXAGHnS4UpFFP8WIrW";
    let users = Users::read(&format!("ana:{hash}")).expect("it is sound");
    let (_server, address) = served(Door { identity: None, users: Some(users) });
    let mut nobody = Client::connect(&plain(&address), ID, TIME).expect("it answers");
    assert_eq!(nobody.ask("SiLAService.ServerName"), Ok("plate".into()));
    assert_eq!(refused(nobody.ask("CurrentTemperature")).0, "InvalidMetadata");
    assert_eq!(
        refused(nobody.say("LockController.LockServer(LockIdentifier: me, Timeout: 0)", true)).0,
        "InvalidMetadata"
    );
    let login = |user: &str, password: &str| Access {
        login: Some(Login { user: user.to_owned(), password: password.to_owned() }),
        lock: Some(Lock { name: "ana".to_owned(), lapse: Duration::from_secs(60) }),
        ..plain(&address)
    };
    for (user, password) in [("ana", "wrong"), ("bob", "secret"), ("", "")] {
        let failed = Client::connect(&login(user, password), ID, TIME).err();
        assert!(matches!(&failed, Some(Failure::Refused { name, .. }) if name == "AuthenticationFailed"), "{failed:?}");
    }
    let mut ana = Client::connect(&login("ana", "secret"), ID, TIME).expect("she is known");
    assert_eq!(ana.ask("CurrentTemperature"), Ok("25".into()));
    assert_eq!(ana.say("HoldTemperature(Time: 0.5)", true), Ok("FinalTemperature: 25".into()));
}

#[test]
fn bytes_and_moments_are_written_and_shown() {
    let feature = plate();
    let basic = |basic, text: &str| value(&feature, &DataType::Basic(basic), text);
    let file = std::env::temp_dir().join(format!("matterixc-bytes-{}", std::process::id()));
    std::fs::write(&file, b"abc").expect("it is written");
    let read = basic(Basic::Binary, &format!("file \"{}\"", file.display()));
    std::fs::remove_file(&file).expect("it was written");
    assert_eq!(read, Ok(Value::Bytes(b"abc".into())));
    assert_eq!(basic(Basic::Binary, "\"YWJj\""), read);
    // FIPS 180-2, appendix B.1.
    let digest = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
    assert_eq!(shown(&read.expect("it is read")), format!("(3 bytes, SHA-256 {digest})"));
    assert!(basic(Basic::Binary, "file \"/nowhere\"").is_err_and(|why| why.contains("cannot be read")));
    assert!(basic(Basic::Binary, "%%").is_err());
    let stamp = basic(Basic::Timestamp, "\"2026-11-23T14:30:00+01:00\"").expect("it is one");
    assert_eq!(shown(&stamp), "2026-11-23T14:30:00+01:00");
    assert!(basic(Basic::Date, "today").is_err());
}

#[test]
fn a_server_that_is_not_there_is_lost() {
    let gone = Client::connect(&plain("127.0.0.1:1"), ID, Duration::from_millis(500)).err();
    assert!(matches!(gone, Some(Failure::Lost(_))), "{gone:?}");
}

proptest! {
    #[test]
    fn any_bytes_are_understood_or_refused(bytes in proptest::collection::vec(any::<u8>(), 0..200)) {
        let feature = plate();
        if let Ok(raw) = Raw::decode(bytes.as_slice()) {
            for command in &feature.commands {
                if let Ok(values) = decode(&feature, &command.parameters, &raw) {
                    prop_assert!(encode(&feature, &command.parameters, &values).is_ok());
                }
            }
        }
    }

    #[test]
    fn any_text_is_a_call_or_refused(text in "\\PC{0,80}") {
        let feature = plate();
        let _ = call(&text);
        for parameter in feature.commands.iter().flat_map(|c| &c.parameters) {
            if let Ok(value) = value(&feature, &parameter.ty, &text) {
                prop_assert!(!shown(&value).is_empty());
            }
        }
    }

    #[test]
    fn values_go_over_the_wire_and_come_back(target in 0.0..340.0f64, fast in any::<bool>(), quiet in any::<bool>()) {
        let feature = plate();
        let parameters = &feature.commands[0].parameters;
        let mode = if fast { "fast" } else { "slow" };
        let values = vec![Value::Real(target), Value::Text(mode.into()), Value::Boolean(quiet)];
        let raw = encode(&feature, parameters, &values).expect("they fit");
        let back = Raw::decode(raw.encode_to_vec().as_slice()).expect("it is a message");
        prop_assert_eq!(decode(&feature, parameters, &back), Ok(values));
    }

    #[test]
    fn lists_go_over_the_wire_and_come_back(steps in proptest::collection::vec(-1e9..1e9f64, 0..5)) {
        let feature = plate();
        let parameters = &feature.command("Program").expect("it is there").parameters;
        let values = vec![Value::List(steps.into_iter().map(Value::Real).collect())];
        let raw = encode(&feature, parameters, &values).expect("they fit");
        prop_assert_eq!(decode(&feature, parameters, &raw), Ok(values));
    }
}
