//! Devices that are servers of SiLA 2, as far as no server is needed: definitions as declarations, what would be called.

use std::path::PathBuf;

use crate::harness::{Ended, folder, matterixc_in, root, write};

/// A folder with the plate of the tests, its lab changed like this.
fn bench(name: &str, changes: &[(&str, &str)]) -> PathBuf {
    let dir = folder(name);
    let read = |file: &str| std::fs::read_to_string(root().join("tests/deploy").join(file)).expect("it is there");
    write(&dir, "hotplate.sila.xml", read("hotplate.sila.xml"));
    let mut text = read("hotplate.mtx");
    for (from, to) in changes {
        assert!(text.contains(from), "{from}");
        text = text.replace(from, to);
    }
    write(&dir, "lab.mtx", text);
    write(&dir, "lab.toml", "[plate]\nsila = \"127.0.0.1:1\"\n");
    dir
}

fn check(name: &str, changes: &[(&str, &str)]) -> Ended {
    matterixc_in(&bench(name, changes), &["check", "lab.mtx"])
}

#[test]
fn a_definition_becomes_commands_and_readings() {
    let dir = bench("sila_import", &[]);
    let checked = matterixc_in(&dir, &["check", "lab.mtx"]);
    assert!(checked.code == 0 && !checked.out.contains("sila-file"), "{}", checked.out);
    // Nothing in a definition says what is safe: the asset does.
    let strict = matterixc_in(&dir, &["check", "--strict", "lab.mtx"]);
    assert!(strict.code == 1 && strict.out.contains("no-safe") && strict.out.contains("safe_call"), "{}", strict.out);
    let definition = "capability HotPlate from sila \"hotplate.sila.xml\"";
    let named = format!("{definition} {{\n    param safe_call: Text\n}}");
    let power = "    supposed_power: 250 W\n";
    let safe = [(definition, named.as_str()), (power, &format!("{power}    safe_call: \"Stop\"\n"))];
    let dir = bench("sila_import", &safe);
    let strict = matterixc_in(&dir, &["check", "--strict", "lab.mtx"]);
    let found = strict.out.replace("\n  ", " ");
    assert!(strict.code == 0 && found.contains("warning[sila-file]"), "{found}");
    assert!(found.contains("`Program`, whose parameter `Steps` is a list"), "{found}");
    assert!(found.contains("`SerialNumber`, which is of type String"), "{found}");
    let ran = matterixc_in(&dir, &["run", "lab.mtx"]);
    assert_eq!(ran.code, 0, "{}{}", ran.out, ran.err);
}

#[test]
fn a_dry_run_says_what_would_be_called() {
    let dir = bench("sila_dry", &[("target: 60 degC, mode", "target: 333.15 K, mode"), ("time: 1.2 s", "time: 3 min")]);
    let ended = matterixc_in(&dir, &["deploy", "lab.mtx", "--bind", "lab.toml"]);
    assert_eq!(ended.code, 0, "{}", ended.err);
    let said: Vec<&str> = ended.out.lines().filter_map(|l| l.split_once("<- ")).map(|(_, said)| said).collect();
    let wanted = [
        "SetTarget(Target: 60, Mode: fast, Quiet: true)",
        "HoldTemperature(Time: 3)",
        "CurrentTemperature",
        "HoldTemperature.FinalTemperature",
        "Power",
        "Stop",
    ];
    assert_eq!(said, wanted);
}

#[test]
fn what_a_definition_forbids_is_found_before_anything_runs() {
    let cases = [
        ("sila_high", "target: 60 degC, mode", "target: 400 degC, mode", "needs `target <= 340 °C`"),
        ("sila_word", "mode: fast", "mode: loud", "`loud` is not one of `slow`, `fast`"),
        ("sila_kind", "time: 1.2 s", "time: 1.2 m", "Duration"),
        ("sila_none", ", quiet: true", "", "needs the option `quiet`"),
        ("sila_zero", "time: 1.2 s", "time: 0 s", "time > 0"),
        ("sila_other", "from sila", "from urdf", "cannot be imported from `urdf`"),
        ("sila_file", "hotplate.sila.xml", "plate.sila.xml", "cannot read `plate.sila.xml`"),
    ];
    for (name, from, to, wanted) in cases {
        let checked = check(name, &[(from, to)]);
        assert_eq!(checked.code, 1, "{name}: {}", checked.out);
        assert!(checked.out.replace("\n  ", " ").contains(wanted), "{name}: {}", checked.out);
        assert!(checked.out.contains("lab.mtx:"), "{name}: {}", checked.out);
    }
}

#[test]
fn a_definition_that_is_none_is_refused_with_its_line() {
    let dir = bench("sila_broken", &[]);
    let text = std::fs::read_to_string(dir.join("hotplate.sila.xml")).expect("it is there");
    write(&dir, "hotplate.sila.xml", text.replace("<Basic>Boolean</Basic>", "<Basic>Bool</Basic>"));
    let checked = matterixc_in(&dir, &["check", "lab.mtx"]);
    assert!(checked.code == 1 && checked.out.contains("error[sila-file]"), "{}", checked.out);
    assert!(checked.out.contains("\n1 error\n"), "one mistake, one message: {}", checked.out);
    assert!(
        checked.out.replace("\n  ", " ").contains("unknown basic type `Bool`") && checked.out.contains("lab.mtx:4"),
        "{}",
        checked.out
    );
}

#[test]
fn what_a_capability_declares_itself_goes_before_its_definition() {
    let own = "from sila \"hotplate.sila.xml\" {
    state target: Temperature = ambient
    command set target
        option target: Temperature
        option mode: slow | fast
        option quiet: Bool
        needs target in 0 degC .. 340 degC
        fails sensor_failed
        effect self.target = target
    reading current_temperature: Temperature = target
}";
    let changes = [
        ("from sila \"hotplate.sila.xml\"", own),
        ("    supposed_current_temperature: 60 degC\n", ""),
        ("wait until", "expect plate.target == 60 degC\n    wait until"),
    ];
    let ran = matterixc_in(&bench("sila_own", &changes), &["run", "lab.mtx"]);
    assert_eq!(ran.code, 0, "{}{}", ran.out, ran.err);
}

#[test]
fn a_binding_fits_what_the_driver_speaks_to() {
    let dir = bench("sila_bound", &[]);
    for (bindings, wanted) in [
        ("[plate]\nport = \"x\"", "needs a SiLA 2 server"),
        ("[plate]\nsila = \"x:1\"\nport = \"y\"", "two lines"),
        ("[plate]\nsila = 3", "`sila` must be a text"),
        ("[plate]\nsila = \"x:1\"\nby = \"hand\"", "both to a person and to a line"),
        ("[plate]\nsila = \"x:1\"\nfingerprint = \"AB:CD\"", "a fingerprint must have 32 bytes in hexadecimal"),
        (
            "[plate]\nsila = \"x:1\"\ncertificate = \"a.pem\"\nfingerprint = \"AB\"",
            "either the certificate or the fingerprint",
        ),
        ("[plate]\nsila = \"x:1\"\nlock = \"10 minutes\"", "a lock needs a duration"),
        ("[plate]\nsila = \"x:1\"\nlock = \"1 s\"", "a lock must last from 10 s to 168 h"),
        ("[plate]\nsila = \"x:1\"\nuser = \"ana\"", "a user needs a password"),
        ("[plate]\nsila = \"x:1\"\npassword_env = \"P\"", "a password needs a user"),
        (
            "[plate]\nsila = \"x:1\"\nuser = \"ana\"\npassword_env = \"P\"",
            "a password cannot be sent without encryption",
        ),
        ("[plate]\nport = \"/dev/null\"\nlock = \"1 h\"", "`lock` is only for a SiLA 2 server"),
    ] {
        write(&dir, "lab.toml", bindings);
        let ended = matterixc_in(&dir, &["deploy", "lab.mtx", "--bind", "lab.toml"]);
        assert!(ended.code == 1 && ended.err.contains(wanted) && ended.err.contains("lab.toml:"), "{}", ended.err);
    }
}

#[test]
fn a_server_that_is_not_there_is_a_fault_of_the_device() {
    let dir = bench("sila_gone", &[]);
    let given = ["deploy", "lab.mtx", "--bind", "lab.toml", "--mode", "real", "--journal", "journal"];
    let ended = matterixc_in(&dir, &given);
    assert!(ended.code == 1 && ended.err.contains("error[device-lost]"), "{}", ended.err);
    assert!(ended.err.contains("cannot connect to `127.0.0.1:1`"), "{}", ended.err);
}
