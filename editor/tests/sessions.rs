//! A session makes no difference: what a check finds that knows of earlier ones is what a first one finds.

#![allow(clippy::unwrap_used)]

use std::fs;
use std::path::{Path, PathBuf};

use matterix_editor::Analysis;
use matterix_ir::FileId;
use matterix_lang::{Loader, Session};

/// Modules and files beside an example.
struct Beside(PathBuf);

impl Loader for Beside {
    fn load(&self, _: FileId, module: &str) -> Option<(String, String)> {
        let path = self.0.join(module.replace("::", "/")).with_extension("mtx");
        Some((path.display().to_string(), fs::read_to_string(path).ok()?))
    }

    fn bytes(&self, _: FileId, path: &str) -> Result<Vec<u8>, String> {
        fs::read(self.0.join(path)).map_err(|why| why.to_string())
    }

    fn file(&self, _: FileId, path: &str) -> Result<String, String> {
        fs::read_to_string(self.0.join(path)).map_err(|why| why.to_string())
    }
}

fn same(name: &str, text: &str, beside: &Beside, session: &mut Session) {
    let again = Analysis::of(name, text, beside, session);
    let anew = Analysis::of(name, text, beside, &mut Session::default());
    assert_eq!(again.findings, anew.findings, "{name}:\n{text}");
    assert_eq!(again.points, anew.points, "{name}:\n{text}");
    let trees = |a: &Analysis| a.modules.iter().map(|m| m.tree.clone()).collect::<Vec<_>>();
    assert_eq!(trees(&again), trees(&anew), "{name}:\n{text}");
}

/// Places to type at, `count` of them spread over a text.
fn places(text: &str, count: usize) -> impl Iterator<Item = usize> + '_ {
    let step = (text.len() / count).max(1);
    (0..count).map(move |i| i * step + (i * 7) % step).filter(|at| text.is_char_boundary(*at))
}

#[test]
fn what_is_typed_is_judged_as_if_it_had_always_stood_there() {
    let examples = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples");
    for name in ["sn1", "study_fit", "dilution"] {
        let path = examples.join(name).with_extension("mtx");
        let text = fs::read_to_string(&path).unwrap();
        let beside = Beside(examples.clone());
        let mut session = Session::default();
        same(name, &text, &beside, &mut session);
        for at in places(&text, 3) {
            for typed in ["\n", "x", "{", ""] {
                let (before, after) = text.split_at(at);
                same(name, &format!("{before}{typed}{after}"), &beside, &mut session);
            }
        }
    }
}

const TWO: &str = "mtx 1\n\nuse std::heating\n\nlab bench {\n    ambient: 25 degC\n    plate = IkaRetControl\n}\n\n\
    // first\nworkflow warm in bench {\n    heat plate to 40 degC\n    stop heating plate\n}\n\n\
    workflow hot in bench {\n    heat plate to 900 degC\n    stop heating plate\n}\n\n\
    test warmth {\n    run warm\n    expect not plate.active\n}\n";

#[test]
fn verdicts_move_with_their_text_and_fall_with_what_they_stand_on() {
    let beside = Beside(PathBuf::from("/nowhere"));
    let mut session = Session::default();
    for (from, to) in [
        ("// first", "// first and longer °C 🧪"),
        ("40 degC", "41 degC"),
        ("heat plate to 40 degC\n", "heat plate to \n"),
        ("workflow warm", "workflo warm"),
        ("workflow warm", "workflow worm"),
        ("plate = IkaRetControl", "plate = IkaRetControl\n    other = IkaRetControl"),
        ("ambient: 25", "ambient: 26"),
        ("workflow hot in bench {\n    heat plate to 900 degC\n    stop heating plate\n}\n\n", ""),
        ("stop heating plate\n}\n\nworkflow", "stop heating plate\n\nworkflow"),
        ("mtx 1\n", "mtx 1\n\n\n"),
        ("mtx 1\n", ""),
        ("run warm", "run hot"),
        ("}\n\ntest", "}\n\nworkflow last in bench {\n    wait 1 s\n}\n\ntest"),
    ] {
        same("two", TWO, &beside, &mut session);
        let changed = TWO.replacen(from, to, 1);
        assert_ne!(changed, TWO, "{from}");
        same("two", &changed, &beside, &mut session);
    }
}
