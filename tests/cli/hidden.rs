//! Characters that change how a text is shown: found in files, and never written to a terminal.

use std::os::unix::ffi::OsStringExt;

use crate::deploy::{Answer, Device, HEAT, bench, deploy};
use crate::harness::{Ended, command, folder, matterixc_in, root, write};

/// What a terminal obeys.
fn is_clean(ended: &Ended) {
    for text in [&ended.out, &ended.err] {
        let bad =
            |c: &char| (c.is_control() && *c != '\n') || ('\u{202a}'..='\u{202e}').contains(c) || *c == '\u{200f}';
        assert!(!text.chars().any(|c| bad(&c)), "{text:?}");
    }
}

#[test]
fn a_character_that_hides_or_moves_others_is_an_error_wherever_it_stands() {
    let dir = folder("hidden_places");
    let places = [
        ("    stir plate at 300 rpm", "    // \u{202e}mpr 003 ta\u{2069}\n    stir plate at 300 rpm"),
        ("workflow warm", "/// \u{2066}A workflow\nworkflow warm"),
        ("    stir plate", "    note \"300 \u{202d}rpm\"\n    stir plate"),
        ("stir plate at 300 rpm", "stir plate \u{202b}at 300 rpm"),
        ("lab bench", "lab \u{2067}bench"),
        ("    stir plate", "    // \u{1b}[1A\u{1b}[2K\n    stir plate"),
        ("    stir plate", "    // heat plate to 300 degC\r    stir\n    stir plate"),
        ("    stir plate", "    note \"300\u{8}\u{8}\u{8}40 degC\"\n    stir plate"),
        ("stir plate at", "stir plate \u{1b} at"),
    ];
    for (at, hidden) in places {
        write(&dir, "lab.mtx", HEAT.replacen(at, hidden, 1));
        let ended = matterixc_in(&dir, &["check", "lab.mtx"]);
        assert_eq!(ended.code, 1, "{hidden:?}");
        assert_eq!(ended.out.matches("error[").count(), 1, "{hidden:?}: {}", ended.out);
        assert!(ended.out.contains("error[hidden-character]: a hidden character (U+"), "{hidden:?}: {}", ended.out);
        is_clean(&ended);
        for form in ["json", "sarif", "concise"] {
            let ended = matterixc_in(&dir, &["check", "lab.mtx", "--format", form]);
            assert!(ended.out.contains("hidden-character"), "{}", ended.out);
            is_clean(&ended);
        }
        assert_eq!(matterixc_in(&dir, &["run", "lab.mtx"]).code, 1, "{hidden:?}");
    }
}

#[test]
fn a_mark_is_a_warning_and_other_writing_is_none() {
    let dir = folder("hidden_marks");
    write(&dir, "lab.mtx", HEAT.replacen("    stir", "    // \u{5e9}\u{5dc}\u{5d5}\u{5dd}\u{200f}!\n    stir", 1));
    let ended = matterixc_in(&dir, &["check", "lab.mtx"]);
    assert_eq!(ended.code, 0, "{}", ended.out);
    assert!(ended.out.contains("warning[hidden-character]") && ended.out.contains("U+200F"), "{}", ended.out);
    is_clean(&ended);
    write(&dir, "lab.mtx", HEAT.replacen("    stir", "    // \u{5e9}\u{5dc}\u{5d5}\u{5dd} – µL ≥ Ωμέγα\n    stir", 1));
    assert!(!matterixc_in(&dir, &["check", "lab.mtx"]).out.contains("hidden-character"));
}

#[test]
fn bindings_are_looked_through_too() {
    let dir = bench("hidden_bindings", HEAT, "plate", "127.0.0.1:1");
    write(&dir, "lab.toml", "[plate]\naddress = \"127.0.0.1:1\" # \u{202e}9999:1.0.0.721\n");
    let ended = matterixc_in(&dir, &["deploy", "lab.mtx", "--bind", "lab.toml"]);
    assert_ne!(ended.code, 0);
    assert!(ended.err.contains("error[hidden-character]") && ended.err.contains("lab.toml:2"), "{}", ended.err);
    is_clean(&ended);
}

#[test]
fn names_of_files_and_arguments_do_not_reach_the_terminal_as_they_are() {
    let dir = folder("hidden_names");
    let name = "a\u{1b}[2Jb\u{202e}.mtx";
    for args in [["check", name], ["run", name], [name, name], ["explain", name], ["view", name], ["verify", name]] {
        let ended = matterixc_in(&dir, &args);
        assert_ne!(ended.code, 0, "{args:?}");
        is_clean(&ended);
    }
    write(&dir, name, "mtx 1\nlab {\n");
    let ended = matterixc_in(&dir, &["check", name]);
    assert_eq!(ended.code, 1);
    is_clean(&ended);
    let broken = std::ffi::OsString::from_vec(b"\xff\x1b[2J.mtx".to_vec());
    let ended = command().current_dir(&dir).arg("check").arg(broken).output().expect("it starts");
    assert!(!ended.stderr.contains(&0x1b));
}

#[test]
fn what_a_device_answers_does_not_reach_the_terminal_as_it_is() {
    let device = Device::start(b'\n', |_, _| Answer::Says("\u{1b}]0;owned\u{7}\u{1b}[2J\u{202e}\r\n"));
    let dir = bench("hidden_answers", HEAT, "plate", &device.address);
    let ended = deploy(&dir, &["--mode", "real"]);
    assert_ne!(ended.code, 0);
    assert!(ended.err.contains("owned"), "{}", ended.err);
    is_clean(&ended);
}

#[test]
fn the_description_of_a_feature_is_shown_in_letters_and_no_fault_of_the_reader() {
    let dir = folder("hidden_feature");
    let read = |name: &str| std::fs::read_to_string(root().join("tests/deploy").join(name)).expect("it is there");
    write(&dir, "lab.mtx", read("hotplate.mtx"));
    let feature =
        read("hotplate.sila.xml").replacen("A plate that heats", "\u{202b}A plate&#13; that heats\u{202c}", 1);
    write(&dir, "hotplate.sila.xml", feature);
    let ended = matterixc_in(&dir, &["check", "lab.mtx"]);
    assert_eq!(ended.code, 0, "{}", ended.out);
    is_clean(&ended);
}
