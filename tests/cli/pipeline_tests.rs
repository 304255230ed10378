//! The whole way from text to report, through the command.

use std::fs;
use std::path::{Path, PathBuf};

use crate::harness::{folder, matterixc, matterixc_in, names, root, write};

/// A folder that holds the project of `matterixc new`.
fn project(name: &str) -> PathBuf {
    let dir = folder(name);
    assert_eq!(matterixc_in(&dir, &["new", "."]).code, 0);
    dir
}

/// The new project's protocol with one text replaced by another.
fn altered(dir: &Path, name: &str, old: &str, new: &str) {
    let text = fs::read_to_string(dir.join("warm.mtx")).expect("the project is there");
    assert!(text.contains(old), "`{old}` is not in\n{text}");
    write(dir, name, text.replacen(old, new, 1));
}

fn protocols(folder: &str) -> Vec<String> {
    let dir = root().join(folder);
    let files = names(&dir).into_iter().filter(|n| n.ends_with(".mtx"));
    files.map(|n| dir.join(n).to_str().expect("the path is text").to_string()).collect()
}

#[test]
fn a_new_project_checks_runs_and_passes() {
    let dir = project("project");
    let checked = matterixc_in(&dir, &["check", "--strict", "warm.mtx"]);
    assert_eq!((checked.code, checked.out.as_str()), (0, "no findings\n"), "{}", checked.out);
    let styled = matterixc_in(&dir, &["fmt", "--check", "warm.mtx"]);
    assert_eq!((styled.code, styled.out.as_str()), (0, ""), "{}", styled.err);
    let ran = matterixc_in(&dir, &["run", "warm.mtx"]);
    assert_eq!(ran.code, 0, "{}{}", ran.out, ran.err);
    assert!(ran.err.contains(" s] "), "progress is missing: {}", ran.err);
    assert_eq!(names(&dir), [".gitignore", "README.md", "warm.mtx"], "a run writes nothing without --out");
}

#[test]
fn a_report_as_json_stands_alone_on_standard_output() {
    let ran = matterixc_in(&project("json_report"), &["run", "warm.mtx", "--format", "json"]);
    assert_eq!((ran.code, ran.err.as_str()), (0, ""));
    let report: serde_json::Value = serde_json::from_str(&ran.out).expect("one JSON value");
    assert!(report.is_object());
}

#[test]
fn the_same_run_twice_writes_the_same_bytes() {
    let dir = project("twice");
    for out in ["one", "two"] {
        let ran = matterixc_in(&dir, &["run", "warm.mtx", "--out", out, "--seed", "7"]);
        assert_eq!(ran.code, 0, "{}{}", ran.out, ran.err);
    }
    let files = names(&dir.join("one"));
    assert_eq!(files, names(&dir.join("two")));
    for ending in [".mcap", ".parquet", ".svg", "report.json"] {
        assert!(files.iter().any(|f| f.ends_with(ending)), "no {ending} in {files:?}");
    }
    for file in files {
        let read = |out: &str| fs::read(dir.join(out).join(&file)).expect("it was written");
        assert!(read("one") == read("two"), "{file} differs");
    }
}

#[test]
fn a_failed_expectation_and_a_failed_run_are_findings() {
    let dir = project("failing");
    altered(
        &dir,
        "expect.mtx",
        "expect beaker.contents.temperature in",
        "expect beaker.contents.temperature - 50 K in",
    );
    let ran = matterixc_in(&dir, &["run", "expect.mtx"]);
    assert_eq!(ran.code, 1, "{}{}", ran.out, ran.err);
    // The water cannot get warmer than the plate, so the wait times out; `finally` still switches the plate off.
    let ran = matterixc_in(&dir, &["run", "warm.mtx", "--set", "target=30 degC"]);
    assert_eq!(ran.code, 1, "{}{}", ran.out, ran.err);
    assert!(ran.err.contains("warm.mtx:18:"), "the line of the failure is missing: {}", ran.err);
    assert!(ran.err.contains("stop heating hotplate"), "{}", ran.err);
}

#[test]
fn misspelt_names_are_found_with_a_suggestion() {
    let dir = project("typos");
    let typos = [
        ("wait until beaker.contents", "wait until beeker.contents", "beaker"),
        ("Beaker250mL on", "Beaker250ml on", "Beaker250mL"),
        ("heat hotplate to", "haet hotplate to", "heat"),
        ("100 g of", "100 gg of", "g"),
        ("g of water", "g of watr", "water"),
        ("std::heating", "std::heatin", "heating"),
    ];
    for (old, new, suggestion) in typos {
        altered(&dir, "typo.mtx", old, new);
        let checked = matterixc_in(&dir, &["check", "typo.mtx"]);
        assert_eq!(checked.code, 1, "{new}: {}", checked.out);
        let help: Vec<&str> = checked.out.lines().filter(|l| l.starts_with("  help: ")).collect();
        assert!(help.iter().any(|l| l.contains(suggestion)), "{new}: {}", checked.out);
    }
}

#[test]
fn unknown_workflows_and_parameters_are_named() {
    let dir = project("settings");
    let wrong = [["--workflow", "wram"], ["--set", "taget=50 degC"], ["--set", "target=50 g"], ["--set", "target=hot"]];
    for [flag, value] in wrong {
        let ran = matterixc_in(&dir, &["run", "warm.mtx", flag, value]);
        assert_ne!(ran.code, 0, "{value}");
        assert_eq!(ran.out, "", "{value}");
        assert!(ran.err.contains("error"), "{value}: {}", ran.err);
    }
}

#[test]
fn a_module_next_to_the_file_is_found_from_any_folder() {
    let dir = project("neighbour");
    let text = fs::read_to_string(dir.join("warm.mtx")).expect("the project is there");
    let (head, tail) = text.split_once("workflow").expect("it has a workflow");
    fs::create_dir(dir.join("lab")).expect("a folder can be created");
    write(&dir, "lab/benches.mtx", head);
    write(&dir, "lab/warm.mtx", format!("mtx 1\nuse benches::bench\n\nworkflow{tail}"));
    let ran = matterixc_in(&dir, &["run", "lab/warm.mtx", "--format", "json"]);
    assert_eq!(ran.code, 0, "{}{}", ran.out, ran.err);
}

#[test]
fn a_dry_run_walks_through_the_steps() {
    let ran = matterixc_in(&project("dry"), &["run", "warm.mtx", "--dry"]);
    assert_eq!(ran.code, 0, "{}{}", ran.out, ran.err);
    assert!(ran.err.contains("heat hotplate"), "{}", ran.err);
}

#[test]
fn every_example_is_styled_and_without_findings() {
    for file in protocols("examples") {
        let checked = matterixc(&["check", &file]);
        assert_eq!(checked.code, 0, "{}", checked.out);
        assert_eq!(matterixc(&["fmt", "--check", &file]).code, 0, "{file} is not formatted");
    }
}

#[test]
fn a_file_that_is_not_styled_is_rewritten_once() {
    let dir = project("unstyled");
    altered(&dir, "warm.mtx", "    heat hotplate", "  heat   hotplate");
    let named = matterixc_in(&dir, &["fmt", "--check", "warm.mtx"]);
    assert_eq!((named.code, named.out.as_str()), (1, "warm.mtx: not formatted\n"));
    assert_eq!(matterixc_in(&dir, &["fmt", "warm.mtx"]).code, 0);
    assert_eq!(matterixc_in(&dir, &["fmt", "--check", "warm.mtx"]).code, 0);
    assert_eq!(names(&dir), [".gitignore", "README.md", "warm.mtx"]);
}

#[test]
fn a_file_that_does_not_parse_is_not_rewritten() {
    let dir = folder("fmt_broken");
    write(&dir, "a.mtx", "mtx 1\nlab {\n");
    let ended = matterixc_in(&dir, &["fmt", "a.mtx"]);
    assert_eq!((ended.code, ended.out.as_str()), (1, ""));
    assert!(ended.err.contains("error[syntax]"), "{}", ended.err);
    assert_eq!(fs::read_to_string(dir.join("a.mtx")).expect("it is there"), "mtx 1\nlab {\n");
}

#[cfg(unix)]
mod unix {
    use std::os::unix::fs::{PermissionsExt, symlink};
    use std::process::{Command, Stdio};
    use std::time::Duration;

    use super::*;
    use crate::harness::command;

    #[test]
    fn rewriting_keeps_permissions_and_links() {
        let dir = project("permissions");
        altered(&dir, "warm.mtx", "    heat hotplate", "  heat hotplate");
        fs::set_permissions(dir.join("warm.mtx"), fs::Permissions::from_mode(0o640)).expect("the owner may");
        symlink("warm.mtx", dir.join("link.mtx")).expect("a link can be made");
        assert_eq!(matterixc_in(&dir, &["fmt", "link.mtx"]).code, 0);
        let file = fs::symlink_metadata(dir.join("warm.mtx")).expect("it is there");
        assert_eq!(file.permissions().mode() & 0o777, 0o640);
        assert!(fs::symlink_metadata(dir.join("link.mtx")).expect("it is there").is_symlink());
        assert_eq!(matterixc_in(&dir, &["fmt", "--check", "warm.mtx"]).code, 0);
    }

    /// A disk that is full stands in for one; Linux has it as a device.
    #[cfg(target_os = "linux")]
    #[test]
    fn results_that_cannot_be_written_are_no_success() {
        let full = fs::OpenOptions::new().write(true).open("/dev/full").expect("Linux has it");
        let ended = command().arg("version").stdout(full).output().expect("the command starts");
        assert_eq!(ended.status.code(), Some(2));
        let said = String::from_utf8_lossy(&ended.stderr);
        assert!(said.contains("cannot write to standard output: no space left on device"), "{said}");
    }

    #[test]
    fn a_pipe_is_not_replaced_by_a_file() {
        let dir = project("pipe");
        let made = Command::new("mkfifo").arg(dir.join("out")).status().expect("there is `mkfifo`");
        assert!(made.success());
        let ended = matterixc_in(&dir, &["plan", "warm.mtx", "--svg", "out"]);
        assert_eq!(ended.code, 2, "{}", ended.err);
        assert!(ended.err.contains("it is not a regular file"), "{}", ended.err);
        let kind = fs::symlink_metadata(dir.join("out")).expect("it is there").file_type();
        assert!(!kind.is_file());
    }

    #[test]
    fn a_read_only_file_is_not_rewritten() {
        let dir = project("read_only");
        altered(&dir, "warm.mtx", "    heat hotplate", "  heat hotplate");
        fs::set_permissions(dir.join("warm.mtx"), fs::Permissions::from_mode(0o440)).expect("the owner may");
        let ended = matterixc_in(&dir, &["fmt", "warm.mtx"]);
        assert_eq!((ended.code, ended.err.as_str()), (2, "error: cannot write `warm.mtx`: it is read-only\n"));
    }

    #[test]
    fn an_interrupted_run_still_does_what_finally_says() {
        let dir = project("interrupted");
        altered(&dir, "long.mtx", "    wait 10 min\n", "    repeat 1000000000 times {\n        wait 1 s\n    }\n");
        let mut run = command();
        run.args(["run", "long.mtx"]).current_dir(&dir).stdout(Stdio::piped()).stderr(Stdio::piped());
        let child = run.spawn().expect("the command starts");
        let interrupt = || Command::new("kill").args(["-INT", &child.id().to_string()]).status();
        std::thread::sleep(Duration::from_secs(3));
        assert!(interrupt().is_ok_and(|s| s.success()));
        let output = child.wait_with_output().expect("the command ends");
        let err = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{}", err.lines().rev().take(20).collect::<Vec<_>>().join("\n"));
        let (_, after) = err.rsplit_once("stopping: ").expect("the request is acknowledged");
        assert!(after.contains("stop heating hotplate"), "{after}");
    }
}
