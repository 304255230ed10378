//! Framings that texts declare, numbers in forms of their own, Modbus, lines that several devices share, and devices that speak up.

use super::{Answer, Device, Emulated, bench, deploy};
use crate::harness::{folder, matterixc_in, root, write};

/// A bath with these lines in its driver, which speaks in the framing `packet`.
fn bath(framing: &str, over: &str, lines: &str) -> String {
    format!(
        "mtx 1
{framing}
asset Bath: Heater, Surface {{
    mass: 4 kg
    capacity: 2 kJ/K
    air: 2 W/K
    gain: 60 W/K
    power: 800 W
    limits: 25 degC .. 95 degC
    shape: box(200 mm, 300 mm, 150 mm)
}}
driver BathLine for Bath over serial(baud: 9600, frame: \"8N1\", {over}, timeout: 1 s) {{
{lines}
}}
lab bench {{ ambient: 22 degC, bath = Bath at (0, 0, 0) m }}
workflow warm in bench {{
    heat bath to 37 degC
    wait until bath.temperature >= 30 degC timeout 2 h
}} finally {{ stop heating bath }}
"
    )
}

const PACKET: &str =
    "framing packet { carries: text, frame: \"<{address :02}:{data}{check :u8 hex}>\", check: sum8(begin .. data) }";

const LINES: &str = "    heat to(t) sends \"SP{t as degC :05.1}\", \"ON\" expects \"SP OK\", \"ON OK\"
    stop heating sends \"OFF\" expects \"OFF OK\"
    reading temperature asks \"T?\" expects \"T={degC :i16 hex * 100} {<sensor>}\"
    reading active asks \"A?\" expects \"{YES = true | NO = false}\"
    ignores \"BOOT {_}\"
    reply \"ERR\" fails refused
    safe sends \"OFF\" expects \"OFF OK\"";

#[test]
fn the_examples_run_on_their_emulators() {
    let examples = [
        ("new_era", "pump", vec!["pump <- \\x02\\n0SAF60\\xfa)\\x03", "\\x02\\r0VOL250.0\\x87\\x85\\x03"]),
        ("huber", "bath", vec!["{M000EA6\\r\\n", "{M140001\\r\\n", "{M140000\\r\\n"]),
        ("julabo", "bath", vec!["OUT_SP_00 30.00\\r", "OUT_MODE_05 1\\r"]),
        ("heidolph", "stirrer", vec!["R0300\\r\\n", "R0000\\r\\n"]),
        ("keyence", "reader", vec!["\\x02LON\\x03", "\\x02LOFF\\x03"]),
        ("watlow", "block", vec!["\\x00\\x03\\x00\\x00\\x00\\x0b\\x01\\x10\\x08p\\x00\\x02\\x04B \\x00\\x00"]),
    ];
    for (name, device, sent) in examples {
        let text = std::fs::read_to_string(root().join(format!("examples/devices/{name}.mtx"))).expect("an example");
        let bindings = std::fs::read_to_string(root().join(format!("examples/devices/{name}.toml"))).expect("bindings");
        let dir = folder(&format!("deploy_example_{name}"));
        write(&dir, "lab.mtx", text);
        write(&dir, "lab.toml", &bindings);
        let dry = matterixc_in(&dir, &["deploy", "lab.mtx", "--bind", "lab.toml"]);
        assert_eq!(dry.code, 0, "{name}: {}", dry.err);
        for bytes in sent {
            assert!(dry.out.contains(bytes), "{name}: {bytes}\n{}", dry.out);
        }
        let driver = bindings.lines().find_map(|l| l.strip_prefix("driver = \"")?.strip_suffix('"'));
        let choice: Vec<&str> = driver.map(|d| vec!["--driver", d]).unwrap_or_default();
        let emulated = Emulated::start(&dir, &[&[device, "--file", "lab.mtx"], choice.as_slice()].concat());
        let place = |line: &str| match line.starts_with("port") || line.starts_with("address") {
            true => format!("address = \"{}\"\n", emulated.address),
            false => format!("{line}\n"),
        };
        write(&dir, "lab.toml", bindings.lines().map(place).collect::<String>());
        let ended = deploy(&dir, &["--mode", "real", "--yes"]);
        assert_eq!(ended.code, 0, "{name}: {}", ended.err);
    }
}

#[test]
fn devices_share_a_line_by_their_addresses() {
    let text = bath(PACKET, "framing: packet, address: 1", LINES)
        .replace("bath = Bath at (0, 0, 0) m", "bath = Bath at (0, 0, 0) m, other = Bath at (1, 0, 0) m")
        .replace("heat bath to 37 degC", "heat bath to 37 degC; heat other to 40 degC")
        .replace(
            "} finally {",
            "    wait until other.temperature >= 30 degC timeout 2 h\n} finally { stop heating other;",
        );
    let dir = bench("shared_line", &text, "bath", "");
    let emulated = Emulated::start(&dir, &["bath", "other@2", "--file", "lab.mtx"]);
    let bindings = |unit: &str| {
        let address = &emulated.address;
        format!("[bath]\naddress = \"{address}\"\n[other]\naddress = \"{address}\"\n{unit}\n")
    };
    for unit in ["", "unit = \"1\"", "unit = \"300\""] {
        write(&dir, "lab.toml", bindings(unit));
        let ended = matterixc_in(&dir, &["deploy", "lab.mtx", "--bind", "lab.toml"]);
        assert!(ended.code == 1 && ended.err.contains("error[binding]"), "{unit}: {}", ended.err);
    }
    write(&dir, "lab.toml", bindings("unit = \"2\""));
    let ended = deploy(&dir, &["--mode", "real", "--yes", "--trace"]);
    assert_eq!(ended.code, 0, "{}", ended.err);
    let said = |line: &str| format!("{}{}", ended.out, ended.err).contains(line);
    assert!(said("bath <- <01:SP037.0") && said("other <- <02:SP040.0"), "{}{}", ended.out, ended.err);
    // What an answer said beside the number is kept, once.
    let journal = std::fs::read_to_string(dir.join("journal")).expect("a journal");
    assert_eq!(journal.matches("\"word\":\"sensor\"").count(), 2, "{journal}");
}

/// Frames of `<01:...>` with their sum.
fn framed(text: &str) -> String {
    let begun = format!("<01:{text}");
    let sum = begun.bytes().fold(0_u8, u8::wrapping_add);
    format!("{begun}{sum:02X}>")
}

/// A bath that is warm and says other things before each answer.
fn talks(line: &str) -> String {
    let text = &line[line.find(':').map_or(0, |at| at + 1)..line.len() - 3];
    let answer = match text {
        "T?" => "T=0DAC PT100",
        "ON" => "ON OK",
        "OFF" => "OFF OK",
        _ => "SP OK",
    };
    format!("noise{}{}", framed("BOOT 1.2"), framed(answer))
}

#[test]
fn what_a_device_says_by_itself_answers_nothing() {
    let device = Device::start(b'>', |line, _| Answer::Says(talks(line).leak()));
    let lines = LINES.replace("    reading active asks \"A?\" expects \"{YES = true | NO = false}\"\n", "");
    let text = bath(PACKET, "framing: packet, address: 1", &lines);
    let dir = bench("unsolicited", &text, "bath", &device.address);
    let ended = deploy(&dir, &["--mode", "real", "--yes"]);
    assert_eq!(ended.code, 0, "{}", ended.err);
    // Where nothing says that they may come, they are no answer.
    let dir = bench("solicited", &text.replace("    ignores \"BOOT {_}\"\n", ""), "bath", &device.address);
    let ended = deploy(&dir, &["--mode", "real", "--yes"]);
    assert!(ended.code == 1 && ended.err.contains("BOOT"), "{}", ended.err);
}

#[test]
fn readings_are_heard_where_nobody_asks() {
    let text = bath(
        "framing packet { carries: text, frame: \"{data}\\r\" }",
        "framing: packet",
        "    heat to(t) sends \"SP{t as degC :.1}\" expects \"OK\"
    stop heating sends \"OFF\" expects \"OK\"
    reading temperature hears \"T {degC}\" every 4 s
    safe sends \"OFF\" expects \"OK\"",
    );
    let dir = bench("heard", &text, "bath", "");
    let emulated = Emulated::start(&dir, &["bath", "--file", "lab.mtx"]);
    write(&dir, "lab.toml", format!("[bath]\naddress = \"{}\"\n", emulated.address));
    let ended = deploy(&dir, &["--mode", "real", "--yes"]);
    assert_eq!(ended.code, 0, "{}", ended.err);
    // One that has gone silent is lost, and its last word is not taken for ever.
    let silent = Device::start(b'\r', |_, _| Answer::Says("OK\r"));
    let dir = bench("unheard", &text, "bath", &silent.address);
    let ended = deploy(&dir, &["--mode", "real", "--yes"]);
    assert!(ended.code == 1 && ended.err.contains("it sent nothing like `T {degC}`"), "{}", ended.err);
}

#[test]
fn an_exception_of_modbus_is_a_refusal_by_name() {
    let lines = "    heat to(t) sends \"write holding register at 300: {t as degC :i16 * 10}\"
    stop heating sends \"write coil at 5: off\"
    reading temperature asks \"read input register at 100\" expects \"{degC :i16 * 10}\"
    reply \"exception 3\" fails out_of_range
    safe sends \"write coil at 5: off\"";
    let text = bath("", "framing: modbus_rtu, address: 1", lines)
        .replace(
            "heat bath to 37 degC\n",
            "sequence { heat bath to 37 degC } on out_of_range { note \"too hot for it\" }\n",
        )
        .replace("wait until bath.temperature >= 30 degC timeout 2 h", "wait 1 s");
    // Whatever is written to a register is refused; coils are taken.
    let listener = std::net::TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = listener.local_addr().expect("an address").to_string();
    std::thread::spawn(move || {
        use std::io::{Read, Write};
        for mut stream in listener.incoming().flatten() {
            let mut frame = [0; 8];
            while stream.read_exact(&mut frame).is_ok() {
                let back = if frame[1] == 6 { vec![1, 0x86, 3, 0x02, 0x61] } else { frame.to_vec() };
                let _ = stream.write_all(&back);
            }
        }
    });
    let dir = bench("modbus_refused", &text, "bath", &address);
    let ended = deploy(&dir, &["--mode", "real", "--yes"]);
    assert!(ended.code == 0 && format!("{}{}", ended.out, ended.err).contains("too hot for it"), "{}", ended.err);
}

#[test]
fn a_number_without_room_is_found_before_anything_is_sent() {
    let text = bath(PACKET, "framing: packet, address: 1", &LINES.replace(":05.1", ":04.1 * 100"));
    let dir = bench("no_room", &text, "bath", "127.0.0.1:1");
    let ended = matterixc_in(&dir, &["deploy", "lab.mtx", "--bind", "lab.toml"]);
    assert!(ended.code == 1 && ended.out.is_empty(), "{}", ended.out);
    assert!(ended.err.contains("37 degC cannot be sent in this format"), "{}", ended.err);
}

/// Findings of `check`, each at a framing or at a line of a driver.
#[test]
fn what_cannot_be_framed_or_read_back_is_found() {
    let framings = [
        ("carries: text", "give the layout of a frame once"),
        ("frame: \"{data}\\r\"", "a framing needs `carries`"),
        ("carries: words, frame: \"{data}\\r\"", "`text`, `bytes` or `modbus`"),
        ("carries: text, frame: \"{data}\"", "the end of a message is undefined"),
        ("carries: text, frame: \"<>\"", "no place for the message"),
        ("carries: text, frame: \"{data}{data}\\r\"", "contains `{data}` twice"),
        ("carries: text, frame: \"{dta}\\r\"", "has no part `dta`"),
        ("carries: text, frame: \"{data}OK\"", "the signs of its end"),
        ("carries: bytes, frame: \"\\x02{data}\\x03\"", "may contain the byte of its end mark"),
        (
            "carries: text, frame: \"{data}{check :u8}\\r\", check: sum8(data)",
            "checksum may contain the byte of the end mark",
        ),
        ("carries: text, frame: \"{data}{check :u8 hex}\\r\"", "has a checksum, but `check` is missing"),
        ("carries: text, frame: \"{data}\\r\", check: sum8(data)", "no `{check}`"),
        ("carries: text, frame: \"{data}{check :u8 hex}\\r\", check: crc16_modbus(data)", "does not fit its format"),
        ("carries: text, frame: \"{data}{check :u8 hex}\\r\", check: sum8(check)", "covers no part of the frame"),
        ("carries: text, frame: \"{data}{check :u8 hex}\\r\", check: sum8(address)", "covers no part of the frame"),
        ("carries: text, frame: \"{data}{check :u8 hex}\\r\", check: crc17(data)", "unknown checksum `crc17`"),
        ("carries: text, frame: \"{data}{check :u8 hex}\\r\", check: sum8(data, 3)", "unknown checksum `sum8`"),
        ("carries: bytes, frame: \"{length :u8}{data}\"", "has a length, but `length` is missing"),
        ("carries: bytes, frame: \"{data}{length :u8}\", length: count(data)", "before the part that it counts"),
        ("carries: bytes, frame: \"{length :u8}{data}\", length: count(length)", "does not count the message"),
        ("carries: bytes, frame: \"{length :f32 big}{data}\", length: count(data)", "a whole number of fixed width"),
        ("carries: bytes, frame: \"{length :u16}{data}\", length: count(data)", "the byte order is missing"),
        ("carries: text, frame: \"{data}\\r\", silence: 5 min", "at most 1 s"),
        ("carries: text, frame: \"{data}\\r\", ends: 3", "not a field of a framing"),
        ("carries: text, frame: \"{data\\r\"", "not closed"),
    ];
    let dir = folder("framing_findings");
    for (fields, wanted) in framings {
        write(&dir, "lab.mtx", format!("mtx 1\nframing packet {{ {fields} }}\n"));
        let ended = matterixc_in(&dir, &["check", "lab.mtx"]);
        assert_eq!(ended.out.matches("error[").count(), 1, "{fields}: {}", ended.out);
        assert!(ended.out.contains("error[framing]") && ended.out.contains(wanted), "{fields}: {}", ended.out);
    }
    let text = |line: &str| bath(PACKET, "framing: packet, address: 1", line);
    let lines = [
        ("heat to(t) sends \"SP{t as degC :i16 big}\"", "cannot carry the bytes of a number"),
        ("heat to(t) sends \"SP{t as degC :hex}\"", "needs the number of bytes"),
        ("heat to(t) sends \"SP{t as degC :bcd}\"", "needs the number of digits"),
        ("heat to(t) sends \"SP{t as degC :08q}\"", "not a format of a number"),
        ("heat to(t) sends \"SP{t as degC :.1}{t as degC :.1}\"", "the end of this number is ambiguous"),
        ("heat to(t) sends \"SP{t as degC :.1}0\"", "the end of this number is ambiguous"),
        ("heat to(t) sends \"S>{t as degC :.1}\"", "a message of this framing cannot contain"),
        ("heat to(t) sends \"S\\x02{t as degC :.1}\"", "a message of this framing cannot contain"),
        ("heat to(t) sends \"SP{t as degC :.1}\", \"ON\" expects \"A\", \"B\", \"C\"", "3 replies are expected for 2"),
        ("reading temperature asks \"T\" expects \"{degC}{_}\"", "a text between two values"),
        ("reading temperature asks \"T\" expects \"{degC :05.1\"", "an opening or closing brace is missing"),
        ("reading active asks \"T\" expects \"{}\"", "the word for `active` once"),
        ("reading active asks \"T\" expects \"{A = yes | B = no}\"", "`active` has no state `yes`"),
        ("reading active asks \"T\" expects \"{A = true | A = false}\"", "given for two words"),
        ("reading temperature hears \"T {degC}\" every 0 s", "the interval between messages"),
        ("reply \"x\\x7b\" fails refused", "a brace starts a value"),
        ("reply \"x\\xq\" fails refused", "two hexadecimal digits"),
    ];
    for (line, wanted) in lines {
        write(&dir, "lab.mtx", text(line).split("lab bench").next().expect("a driver"));
        let ended = matterixc_in(&dir, &["check", "lab.mtx"]);
        assert!(ended.code == 1 && ended.out.contains(wanted), "{line}: {}", ended.out);
    }
    let modbus = [
        ("heat to(t) sends \"write register at 3: {t as degC :i16 * 10}\"", "not an object of Modbus"),
        ("heat to(t) sends \"write holding register at 3: {t as degC :.0}\"", "needs a format in bytes"),
        ("heat to(t) sends \"write holding register at 3: {t as degC :f32 big}\"", "one for each"),
        ("heat to(t) sends \"write input register at 3: {t as degC :i16}\"", "read-only"),
        ("reading temperature asks \"read input register at 3\" expects \"{degC}\"", "needs a format in bytes"),
        (
            "reading temperature asks \"read 2 input registers at 3\" expects \"{degC :f32}\"",
            "the byte order is missing",
        ),
    ];
    for (line, wanted) in modbus {
        let whole = bath("", "framing: modbus_rtu, address: 1", line);
        write(&dir, "lab.mtx", whole.split("lab bench").next().expect("a driver"));
        let ended = matterixc_in(&dir, &["check", "lab.mtx"]);
        assert!(ended.code == 1 && ended.out.contains(wanted), "{line}: {}", ended.out);
    }
    for (over, wanted) in [
        ("framing: packet", "needs the `address`"),
        ("framing: packet, address: 100", "not an address of this framing"),
        ("framing: cr, address: 1", "no place for an address"),
        ("framing: pakcet, address: 1", "did you mean `packet`"),
    ] {
        write(&dir, "lab.mtx", bath(PACKET, over, LINES).split("lab bench").next().expect("a driver"));
        let ended = matterixc_in(&dir, &["check", "lab.mtx"]);
        assert!(ended.code == 1 && ended.out.contains(wanted), "{over}: {}", ended.out);
    }
    write(
        &dir,
        "lab.mtx",
        "mtx 1\nuse std::furniture\nlab l { ambient: 20 degC }\nworkflow w in l { note \"{1 s :i16 big}\" }\n",
    );
    let ended = matterixc_in(&dir, &["check", "lab.mtx"]);
    assert!(ended.out.contains("only for messages to devices"), "{}", ended.out);
}
