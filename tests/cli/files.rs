//! Files that cannot be read are usage errors; files that hold something else than text are findings.

use crate::harness::{folder, matterixc, matterixc_in, write};

#[test]
fn a_missing_file() {
    for command in ["check", "run", "fmt"] {
        let ended = matterixc(&[command, "nowhere.mtx"]);
        assert_eq!((ended.code, ended.out.as_str()), (2, ""));
        assert_eq!(ended.err, "error: cannot read `nowhere.mtx`: the file does not exist\n");
    }
}

#[test]
fn a_directory() {
    let dir = folder("directory");
    for command in ["check", "run", "fmt"] {
        let ended = matterixc_in(&dir, &[command, "."]);
        assert_eq!((ended.code, ended.out.as_str()), (2, ""));
        assert_eq!(ended.err, "error: `.` is a directory, not a file\n");
    }
}

#[cfg(unix)]
#[test]
fn a_file_without_permission() {
    use std::os::unix::fs::PermissionsExt;
    let file = write(&folder("permission"), "secret.mtx", "mtx 1\n");
    std::fs::set_permissions(&file, std::fs::Permissions::from_mode(0o000)).expect("the owner may");
    if std::fs::read(&file).is_ok() {
        return; // The superuser may read everything.
    }
    let ended = matterixc(&["check", &file]);
    assert_eq!(ended.code, 2);
    assert!(ended.err.ends_with("permission denied\n"), "{}", ended.err);
}

#[test]
fn a_file_that_is_not_text_is_a_finding() {
    let dir = folder("not_text");
    write(&dir, "bytes.mtx", b"mtx 1\n\xff\xfe\n");
    for args in [["check", "bytes.mtx"], ["run", "bytes.mtx"], ["fmt", "bytes.mtx"]] {
        let ended = matterixc_in(&dir, &args);
        assert_eq!(ended.code, 1, "{args:?}: {}{}", ended.out, ended.err);
        assert!(format!("{}{}", ended.out, ended.err).contains("bytes.mtx:2:1"), "{}{}", ended.out, ended.err);
    }
}

#[test]
fn one_unreadable_file_does_not_hide_the_findings_of_others() {
    let dir = folder("mixed");
    write(&dir, "bytes.mtx", b"\xff");
    let ended = matterixc_in(&dir, &["check", "--format", "concise", "nowhere.mtx", "bytes.mtx"]);
    assert_eq!(ended.code, 2);
    assert!(ended.err.contains("nowhere.mtx"), "{}", ended.err);
    assert!(ended.out.starts_with("bytes.mtx:1:1: error[syntax]: "), "{}", ended.out);
    assert!(ended.out.ends_with("\n1 error\n"), "{}", ended.out);
}

#[test]
fn findings_as_json_are_one_object_per_line() {
    let dir = folder("json");
    write(&dir, "bytes.mtx", b"mtx 1\n\xff");
    let ended = matterixc_in(&dir, &["check", "--format", "json", "bytes.mtx"]);
    let lines = ended.out_lines();
    assert_eq!((ended.code, lines.len(), ended.err.as_str()), (1, 1, ""));
    let found = &lines[0];
    assert_eq!(found["code"], "syntax");
    assert_eq!(found["severity"], "error");
    assert_eq!(found["span"]["file"], "bytes.mtx");
    assert_eq!(found["span"]["start"], serde_json::json!({ "line": 2, "column": 1, "utf16": 1, "byte": 6 }));
}

#[test]
fn findings_are_coloured_only_where_asked_for() {
    let dir = folder("colour");
    write(&dir, "bytes.mtx", b"\xff");
    let plain = matterixc_in(&dir, &["check", "bytes.mtx"]);
    assert!(!plain.out.contains('\x1b'));
    let colored = matterixc_in(&dir, &["check", "bytes.mtx", "--color", "always"]);
    assert!(colored.out.contains("\x1b[1;31m"), "{}", colored.out);
}

#[test]
fn a_folder_for_results_that_is_a_file_is_refused_before_the_run() {
    let dir = folder("out_is_a_file");
    write(&dir, "a.mtx", "mtx 1\n");
    let ended = matterixc_in(&dir, &["run", "a.mtx", "--out", "a.mtx"]);
    assert_eq!((ended.code, ended.err.as_str()), (2, "error: `a.mtx` is a file, not a directory\n"));
}
