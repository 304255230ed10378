//! A text without findings, and one slip after the other made in it.

use crate::harness::{folder, matterixc_in, write};

/// A slip: its name, the text it changes, the text that stands there then, and what is to be found.
pub type Slip = (&'static str, &'static str, &'static str, &'static str);

/// Codes and headlines of `check` on a text, which begins after the version of the language.
pub fn findings(name: &str, text: &str) -> Vec<String> {
    let dir = folder(&format!("slips_{name}"));
    write(&dir, "bench.mtx", format!("mtx 1\n{text}"));
    let lines = matterixc_in(&dir, &["check", "bench.mtx", "--format", "json"]).out_lines();
    let text = |v: &serde_json::Value| v.as_str().unwrap_or_default().to_string();
    lines.iter().map(|l| format!("{}: {}", text(&l["code"]), text(&l["headline"]))).collect()
}

/// Makes each slip by itself; `fits` says whether its findings are those that were wanted.
#[track_caller]
pub fn each(name: &str, text: &str, slips: &[Slip], fits: impl Fn(&[String], &str) -> bool) {
    for (slip, from, to, wanted) in slips {
        let found = findings(&format!("{name}_{slip}"), &text.replacen(from, to, 1));
        assert!(fits(&found, wanted), "{name} {slip}: wanted `{wanted}`, found {found:#?}");
    }
}

/// The first finding is this one; nothing is found where nothing is wanted.
pub fn first(found: &[String], wanted: &str) -> bool {
    found.first().map_or("", String::as_str) == wanted
}

/// There are findings, and all are this one.
pub fn all(found: &[String], wanted: &str) -> bool {
    !found.is_empty() && found.iter().all(|f| f == wanted)
}
