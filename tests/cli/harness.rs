//! Runs the command in a folder of its own.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

/// What a command left behind.
pub struct Ended {
    /// Exit status.
    pub code: i32,
    /// Standard output.
    pub out: String,
    /// Standard error.
    pub err: String,
}

impl Ended {
    /// The objects on the lines of standard output.
    pub fn out_lines(&self) -> Vec<serde_json::Value> {
        self.out.lines().map(|l| serde_json::from_str(l).unwrap_or_else(|e| panic!("{e}: {l}"))).collect()
    }

    /// The objects on the lines of standard error.
    pub fn err_lines(&self) -> Vec<serde_json::Value> {
        self.err.lines().map(|l| serde_json::from_str(l).unwrap_or_else(|e| panic!("{e}: {l}"))).collect()
    }
}

/// A text without its line breaks: findings are wrapped.
pub fn flat(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// The command with nothing in its environment that changes its output.
pub fn command() -> Command {
    in_its_environment(env!("CARGO_BIN_EXE_matterixc"))
}

/// Another command in the same environment.
pub fn in_its_environment(program: &str) -> Command {
    let mut command = Command::new(program);
    command.env_remove("NO_COLOR").stdin(Stdio::null());
    // What was planned by an earlier test is the same for a later one.
    command.env("XDG_CACHE_HOME", Path::new(env!("CARGO_TARGET_TMPDIR")).join("cache"));
    // What is kept beside journals.
    command.env("XDG_STATE_HOME", Path::new(env!("CARGO_TARGET_TMPDIR")).join("state"));
    command
}

/// Runs the command with these arguments.
pub fn matterixc(args: &[&str]) -> Ended {
    ended(command().args(args).output().expect("the command starts"))
}

/// Runs the command with these arguments in a folder.
pub fn matterixc_in(dir: &Path, args: &[&str]) -> Ended {
    ended(command().args(args).current_dir(dir).output().expect("the command starts"))
}

/// Runs the command with these arguments and this standard input.
pub fn matterixc_with(args: &[&str], input: &[u8]) -> Ended {
    let mut child = command().args(args).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn();
    let child = child.as_mut().expect("the command starts");
    let mut stdin = child.stdin.take().expect("standard input is piped");
    stdin.write_all(input).expect("the command reads");
    drop(stdin);
    let mut out = String::new();
    let mut err = String::new();
    std::io::Read::read_to_string(&mut child.stdout.take().expect("piped"), &mut out).expect("text");
    std::io::Read::read_to_string(&mut child.stderr.take().expect("piped"), &mut err).expect("text");
    let code = child.wait().expect("the command ends").code().unwrap_or(-1);
    Ended { code, out, err }
}

/// An empty folder for one test.
pub fn folder(name: &str) -> PathBuf {
    let dir = Path::new(env!("CARGO_TARGET_TMPDIR")).join("cli").join(name);
    if dir.exists() {
        fs::remove_dir_all(&dir).expect("the folder of an earlier run can be removed");
    }
    fs::create_dir_all(&dir).expect("a folder can be created");
    dir
}

/// A file in a folder, and its path as text.
pub fn write(dir: &Path, name: &str, text: impl AsRef<[u8]>) -> String {
    let path = dir.join(name);
    fs::write(&path, text).expect("a file can be written");
    path.to_str().expect("the path is text").to_string()
}

/// Names in a folder, sorted.
pub fn names(dir: &Path) -> Vec<String> {
    let entries = fs::read_dir(dir).expect("the folder can be read");
    let mut names: Vec<String> = entries.flatten().map(|e| e.file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

/// Top of the repository.
pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn ended(output: Output) -> Ended {
    Ended {
        code: output.status.code().unwrap_or(-1),
        out: String::from_utf8(output.stdout).expect("standard output is text"),
        err: String::from_utf8(output.stderr).expect("standard error is text"),
    }
}

/// Runs a workflow of a file in `tests/cases`; its status and what it wrote.
pub fn run_case(case: &str, workflow: &str, more: &[&str]) -> (i32, String) {
    let file = root().join("tests/cases").join(case);
    let ran = matterixc(&[&["run", file.to_str().expect("text"), "--workflow", workflow], more].concat());
    (ran.code, format!("{}{}", ran.out, ran.err))
}

/// Every one of these workflows passes, with nothing found in it.
pub fn pass_cases(case: &str, workflows: &[&str]) {
    for workflow in workflows {
        let (code, text) = run_case(case, workflow, &[]);
        assert_eq!(code, 0, "{case} {workflow}: {text}");
        for word in ["error[", "warning["] {
            assert!(!text.contains(word), "{case} {workflow}: {text}");
        }
    }
}
