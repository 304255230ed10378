//! `matterixc doc`: workflows as protocols, compared with pages that were read and found good.

use crate::harness::{folder, matterixc, matterixc_in, write};

/// File and page in `tests/protocols`.
const PAGES: [(&str, &str); 6] = [
    ("examples/sn1.mtx", "sn1"),
    ("examples/redox.mtx", "redox"),
    ("examples/titration.mtx", "titration"),
    ("examples/heat_network.mtx", "heat_network"),
    ("tests/cases/dilution.mtx", "dilution"),
    ("tests/cases/handled.mtx", "handled"),
];

#[test]
fn protocols_are_as_they_were_found_good() {
    for (file, page) in PAGES {
        let ended = matterixc(&["doc", file]);
        assert_eq!(ended.code, 0, "{file}: {}", ended.err);
        let path = format!("tests/protocols/{page}.md");
        if std::env::var_os("MATTERIX_UPDATE").is_some() {
            std::fs::write(&path, &ended.out).expect("the page is written");
        }
        let wanted = std::fs::read_to_string(&path).unwrap_or_default();
        assert_eq!(ended.out, wanted, "{file} against {path}");
    }
}

#[test]
fn values_from_outside_are_in_the_text() {
    let ended = matterixc(&["doc", "examples/sn1.mtx", "--set", "target=60 degC"]);
    assert!(ended.out.contains("With target = 60 °C."), "{}", ended.out);
    assert!(ended.out.contains("Set **hotplate** to 60 °C and switch its heating on."), "{}", ended.out);
}

#[test]
fn a_protocol_goes_into_a_file() {
    let dir = folder("doc_out");
    let text = std::fs::read_to_string("tests/cases/pump.mtx").expect("the case");
    write(&dir, "pump.mtx", text);
    let ended = matterixc_in(&dir, &["doc", "pump.mtx", "--out", "pump.md"]);
    assert_eq!((ended.code, ended.out.as_str()), (0, ""), "{}", ended.err);
    let page = std::fs::read_to_string(dir.join("pump.md")).expect("the page");
    assert!(page.contains("1. Pump 20 mL at 1 mL/s with **pump1**."), "{page}");
}

#[test]
fn how_a_verb_is_said_is_checked() {
    let dir = folder("doc_says");
    let file = |clause: &str| {
        format!(
            "mtx 1\ncapability Bell {{\n    state rung: Bool = false\n    command ring at(tone: Frequency)\n        option \
             loud: Bool = false\n        {clause}\n        effect rung = true\n}}\nasset Gong: Bell {{}}\nlab bench {{ \
             ambient: 22 degC, gong = Gong at (0, 0, 0) m }}\nworkflow w in bench {{ ring gong at 440 Hz {{ loud: true }} }}\n"
        )
    };
    write(&dir, "good.mtx", file("says \"ring {self} at {tone}\"\n        says \", loudly\" when loud"));
    let ended = matterixc_in(&dir, &["doc", "good.mtx"]);
    assert!(ended.out.contains("1. Ring **gong** at 440 Hz, loudly. _(line 12)_"), "{} {}", ended.out, ended.err);
    for (clause, code) in
        [("says \"ring {slef}\"", "unknown-name"), ("says \"softly\" when tone", "type-mismatch"), ("says", "syntax")]
    {
        write(&dir, "bad.mtx", file(clause));
        let ended = matterixc_in(&dir, &["doc", "bad.mtx"]);
        assert_eq!((ended.code, ended.out.as_str()), (1, ""), "{clause}");
        assert!(ended.err.contains(code), "{clause}: {}", ended.err);
    }
}

#[test]
fn bad_arguments_are_said_in_words() {
    let dir = folder("doc_wrong");
    write(&dir, "bad.mtx", "mtx 1\nworkflow w in nowhere { wait 1 s }\n");
    for (args, code, wanted) in [
        (vec!["doc"], 2, "required"),
        (vec!["doc", "none.mtx"], 2, "cannot read `none.mtx`"),
        (vec!["doc", "."], 2, "is a directory"),
        (vec!["doc", "bad.mtx"], 1, "unknown-name"),
    ] {
        let ended = matterixc_in(&dir, &args);
        assert_eq!((ended.code, ended.out.as_str()), (code, ""), "{args:?}");
        assert!(ended.err.contains(wanted), "{args:?}: {}", ended.err);
    }
}

#[test]
fn a_protocol_says_the_ph_of_what_is_put_together() {
    let ended = matterixc(&["doc", "examples/equilibria/carbonated.mtx"]);
    assert!(ended.out.contains("Its pH is 8.12."), "{}", ended.out);
    let plain = matterixc(&["doc", "examples/sn1.mtx"]);
    assert!(!plain.out.contains("Its pH"), "{}", plain.out);
}
