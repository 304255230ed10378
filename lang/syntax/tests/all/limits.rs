//! Nesting, size and bytes that no program has: a finding each time, in linear time.

// A test may look at the clock; a compilation may not.
#![allow(clippy::disallowed_methods)]

use std::time::{Duration, Instant};

use matterix_ir::FileId;
use matterix_syntax::{MAX_NESTING, MAX_SIZE, decode, parse};

use crate::nested::nested;

fn headlines(text: &str) -> Vec<String> {
    parse(FileId(0), text).1.into_iter().map(|f| f.headline).collect()
}

#[test]
fn nesting_up_to_200_is_read() {
    let good = |what: &str| !["junk after", "bad head", "bad tail", "bad laws"].contains(&what);
    for (what, text) in nested(200).into_iter().filter(|(what, _)| good(what)) {
        assert_eq!(headlines(&text), Vec::<String>::new(), "{what}");
    }
}

#[test]
fn deeper_nesting_is_one_finding() {
    for (what, text) in nested(MAX_NESTING) {
        let found = headlines(&text);
        assert!(found.contains(&"nested too deeply".to_owned()), "{what}: {found:?}");
    }
    assert_eq!(
        headlines(&format!("mtx 1\nconst c = {}1{}\n", "(".repeat(100_000), ")".repeat(100_000))),
        ["nested too deeply"]
    );
}

#[test]
fn groups_that_a_text_leaves_open_are_skipped_in_linear_time() {
    for open in ["(", "[", "{", "([{", "f([x"] {
        for core in ["1\"", "\"", "a \" b", "]\"", "// \""] {
            let text = format!("{}{core}", open.repeat(60));
            for text in
                [text.clone(), format!("mtx 1\nuse x{text}\n}}\n"), format!("mtx 1\nlab l {{\n  a = {text}\n}}\n")]
            {
                let start = Instant::now();
                parse(FileId(0), &text);
                assert!(start.elapsed() < Duration::from_secs(5), "{text}");
            }
        }
    }
}

#[test]
fn long_chains_do_not_make_deep_trees() {
    for link in [" + 1", ".a", "[1]", "(1)", " ^ 2", " and a", " .. 2"] {
        let found = headlines(&format!("mtx 1\nconst c = a{}\n", link.repeat(5_000)));
        assert_eq!(found, ["this expression is too long"], "{link}");
    }
    let ifs = format!("mtx 1\ntest t {{ if a {{ }}{} }}\n", " else if a { }".repeat(10_000));
    assert_eq!(headlines(&ifs), ["this `if` has more than 64 branches"]);
    let types = format!("mtx 1\nconst c: {}A{} = 1\n", "A<".repeat(10_000), ">".repeat(10_000));
    assert_eq!(headlines(&types), ["`<` and `>` of this type do not match"]);
}

#[test]
fn garbage_is_a_finding() {
    let size = 30_000;
    for piece in [
        "{",
        "}",
        "(",
        "\"",
        "\0",
        "x ",
        "x\n",
        "x (\n",
        "a: ",
        "µ\u{1a}\n",
        "\r",
        "\r\n",
        "/",
        "use x y\n",
        "[ ] ( } \n",
        "mtx 1\n",
        "'",
        "\\",
        "wait {\n",
        "lab x {\n",
    ] {
        for head in [
            "",
            "mtx 1\nworkflow w in l {\n",
            "mtx 1\nlab l {\n",
            "mtx 1\nprocess p {\n",
            "mtx 1\nspecies S {\n",
            "mtx 1\n",
        ] {
            let text = format!("{head}{}", piece.repeat(size / piece.len()));
            let start = Instant::now();
            let found = headlines(&text);
            let nothing = head == "mtx 1\n" && (piece.trim().is_empty() || piece == "/");
            assert!(!found.is_empty() || nothing, "{head:?} {piece:?}");
            assert!(found.len() <= 101, "{head:?} {piece:?}: {}", found.len());
            assert!(start.elapsed() < Duration::from_secs(30), "{head:?} {piece:?}: {:?}", start.elapsed());
        }
    }
}

#[test]
fn ten_megabytes_are_one_finding() {
    for piece in ["x", "{", "\0", "\n", "wait 3 s\n"] {
        assert_eq!(headlines(&piece.repeat(10_000_000 / piece.len())), ["the file is too large (10.0 MB)"]);
    }
}

#[test]
fn findings_beyond_the_hundredth_are_counted() {
    let found = headlines(&format!("mtx 1\nworkflow w in l {{\n{}}}\n", "expect x = 3\n".repeat(150)));
    assert_eq!(found.len(), 101);
    assert_eq!(found.last().map(String::as_str), Some("50 more syntax errors are not shown"));
}

#[test]
fn bytes_that_are_no_text_have_a_place() {
    assert_eq!(decode(b"mtx 1\n").as_deref(), Ok("mtx 1\n"));
    let error = decode(b"mtx 1\nlab \xff\xfe").expect_err("two bytes are no text");
    assert_eq!((error.offset, error.line), (10, 2));
    assert_eq!(error.message, "the file is not UTF-8 text: byte 0xff at offset 10; save it as UTF-8");
    let error = decode(b"\xff\xfem\0t\0x\0").expect_err("this is UTF-16");
    assert_eq!(error.message, "the file is encoded in UTF-16; save it as UTF-8");
}

#[test]
fn an_empty_file_lacks_its_header() {
    assert_eq!(headlines(""), ["the file does not start with `mtx 1`"]);
    assert_eq!(headlines("\u{feff}\r\n// nothing\r\n"), ["the file does not start with `mtx 1`"]);
    assert_eq!(headlines("mtx 1"), Vec::<String>::new());
}

/// Run with `cargo test --release -p matterix-lang speed -- --ignored`.
#[test]
#[ignore = "says something with optimisation only"]
fn speed_of_large_files() {
    let spec: String = crate::spec::spec_files().iter().map(|(_, text)| text.replacen("mtx 1", "", 1)).collect();
    let lines = 20_000;
    let text = format!("mtx 1\n{}", spec.repeat(lines / spec.lines().count() + 1));
    let start = Instant::now();
    assert_eq!(headlines(&text), Vec::<String>::new());
    println!("{} lines, {} bytes: {:?}", text.lines().count(), text.len(), start.elapsed());
    assert!(start.elapsed() < Duration::from_millis(500));
    let start = Instant::now();
    assert!(matterix_syntax::fmt::format(FileId(0), &text).is_ok());
    println!("formatted: {:?}", start.elapsed());
    for piece in [
        "{",
        "x ",
        "x\n",
        "wait 3 s 4\n",
        "\0",
        "a: (1\n",
        "\"\n",
        "expect x = 3\n",
        "(",
        "µ ",
        "// c\n",
        "note \"a\" +\n",
        "lab l {\n",
    ] {
        for head in ["mtx 1\n", "mtx 1\nworkflow w in l {\n", "mtx 1\nlab l {\n"] {
            let text = format!("{head}{}", piece.repeat(MAX_SIZE / piece.len() - head.len()));
            let start = Instant::now();
            let found = headlines(&text).len();
            println!("2 MB of {piece:?} after {head:?}: {found} findings, {:?}", start.elapsed());
        }
    }
}
