//! Tells a release build the commit that it is built from, where that is known: by `MATTERIX_COMMIT`, or from the checkout. Other builds
//! are not made anew for each commit.

use std::path::{Path, PathBuf};

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rerun-if-env-changed=MATTERIX_COMMIT");
    if std::env::var("PROFILE").as_deref() != Ok("release") {
        return;
    }
    let given = std::env::var("MATTERIX_COMMIT").ok().filter(|commit| !commit.is_empty());
    if let Some(commit) = given.or_else(checked_out) {
        println!("cargo:rustc-env=MATTERIX_COMMIT={}", commit.get(..12).unwrap_or(&commit));
    }
}

/// The commit of the checkout that this stands in.
fn checked_out() -> Option<String> {
    let root = PathBuf::from(std::env::var_os("CARGO_MANIFEST_DIR")?);
    let git = root.join(".git");
    // A worktree has a file there, which says where its part of the repository is.
    let git = match std::fs::read_to_string(&git) {
        Ok(text) => root.join(text.strip_prefix("gitdir:")?.trim()),
        Err(_) => git,
    };
    let common = std::fs::read_to_string(git.join("commondir")).map_or(git.clone(), |to| git.join(to.trim()));
    let head = watched(&git.join("HEAD"))?;
    let Some(name) = head.strip_prefix("ref:").map(str::trim) else { return Some(head.trim().to_owned()) };
    let packed = || {
        let all = watched(&common.join("packed-refs"))?;
        let line = all.lines().find(|line| line.ends_with(name))?;
        Some(line.split_whitespace().next()?.to_owned())
    };
    watched(&common.join(name)).map(|commit| commit.trim().to_owned()).or_else(packed)
}

/// The text of a file; when it changes, this is looked up again.
fn watched(file: &Path) -> Option<String> {
    let text = std::fs::read_to_string(file).ok()?;
    println!("cargo:rerun-if-changed={}", file.display());
    Some(text)
}
