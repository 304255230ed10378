//! A session makes no difference: what a check finds that knows of earlier ones is what a first one finds.

#![allow(clippy::unwrap_used)]

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicUsize;
use std::sync::atomic::Ordering::Relaxed;

use matterix_editor::Analysis;
use matterix_ir::{Diagnostic, FileId, Sources};
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

fn same(name: &str, text: &str, beside: &dyn Loader, session: &mut Session) {
    let again = Analysis::of(name, text, beside, session);
    let anew = Analysis::of(name, text, beside, &mut Session::default());
    assert_eq!(again.findings, anew.findings, "{name}:\n{text}");
    assert_eq!(again.points, anew.points, "{name}:\n{text}");
    let trees = |a: &Analysis| a.modules.iter().map(|m| m.tree.clone()).collect::<Vec<_>>();
    assert_eq!(trees(&again), trees(&anew), "{name}:\n{text}");
    let (again, anew) = (again.meanings, anew.meanings);
    assert_eq!(again.around.scopes, anew.around.scopes, "{name}:\n{text}");
    let (again, anew) = (again.joined(), anew.joined());
    assert_eq!(again.names, anew.names, "{name}:\n{text}");
    assert_eq!(again.values, anew.values, "{name}:\n{text}");
    assert_eq!(again.things, anew.things, "{name}:\n{text}");
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

/// A package of two labs with all that workflows can name, and its other file.
const MANY: [&str; 2] = [include_str!("packages/many/main.mtx"), include_str!("packages/many/part.mtx")];

/// Texts beside a file, and files that they name.
struct Texts(RefCell<BTreeMap<String, String>>);

impl Loader for Texts {
    fn load(&self, _: FileId, module: &str) -> Option<(String, String)> {
        Some((format!("{module}.mtx"), self.0.borrow().get(module)?.clone()))
    }

    fn bytes(&self, from: FileId, path: &str) -> Result<Vec<u8>, String> {
        self.file(from, path).map(String::into_bytes)
    }

    fn file(&self, _: FileId, path: &str) -> Result<String, String> {
        self.0.borrow().get(path).cloned().ok_or_else(|| "no such file".to_string())
    }
}

/// What is typed over what, in the first file and in the second: of everything that is declared something else, nothing, or another name.
const EDITS: [(usize, &str, &str); 57] = [
    (0, "warm = 40", "warm = 41"),
    (0, "warm = 40 degC", "warm = "),
    (0, "const warm = 40 degC\n", ""),
    (0, "const warm", "const heat"),
    (0, "hot = 60", "hot = 500"),
    (0, "pause = 10 s", "pause = 10 g"),
    (0, "const pause = 10 s\n", "const pause = 10 s\nconst paus = 4 s\n"),
    (0, "const hot = 60 degC\nconst pause = 10 s\n", "const pause = 10 s\nconst hot = 60 degC\n"),
    (0, "const idle_time = 2 min", "// const idle_time = 2 min"),
    (0, "t + pause", "t + pause + pause"),
    (0, "= t + pause", "= t + nothing_like_it"),
    (0, "> 50 g", "> 60 g"),
    (0, "gain: 20 W/K", "gain: 25 W/K"),
    (0, "120 degC", "50 degC"),
    (0, "Heater, Surface {", "Heater, Stirrer, Surface {\n    speeds: 50 rpm .. 1500 rpm"),
    (0, "species dye { formula: \"C16H18N3S+\" }", "species dye { formula: \"C16H18N3S\" }"),
    (0, "0.9 %w/w", "1.9 %w/w"),
    (0, "wait longer(5 s)", "wait longer(6 s)"),
    (0, "wait longer(5 s)", "fail overheated"),
    (0, "heat h to t", "heat h to t\n    heat h to"),
    (0, "skill warm up(h", "skill warm it(h"),
    (0, "ambient: 25", "ambient: 26"),
    (0, "ambient: 25 degC", "ambient:"),
    (0, "plate = IkaRetControl", "plate = IkaRetControl  // warms"),
    (0, "plate = IkaRetControl", "plate = IkaRctBasic"),
    (0, "spare = Beaker250mL", "other = Beaker250mL"),
    (0, "100 g of water", "400 g of water"),
    (0, "of brine", "of brin"),
    (0, "ambient: 22 degC\n    weak", "ambient: 22 degC\n    strong = IkaRetControl\n    weak"),
    (0, "weak = WeakPlate", "weak = IkaRetControl"),
    (0, "lab corner", "lab korner"),
    (0, "lab bench {", "lab third {\n    ambient: 20 degC\n    plate = IkaRetControl\n}\n\nlab bench {"),
    (0, "heat plate to warm\n", "heat plate to warm\n    pause\n"),
    (0, "wait 1 min", "wait 1 min // °C 🧪"),
    (0, "workflow slow", "workflow fast"),
    (0, "workflow slow in corner {", "workflow slow in corner"),
    (0, "workflow gentle in bench", "workflow gentle in corner"),
    (0, "900 degC", "90 degC"),
    (0, "wait paus\n", "wait pause\n"),
    (0, "wait paus\n", "wait pausing\n"),
    (0, "run gentle", "run slow"),
    (0, "45 degC .. 55 degC", "45 degC .. 56 degC"),
    (0, "study range of strong", "study range of stron"),
    (0, "workflow wrong in corner {\n    heat weak to 900 degC\n    wait paus\n    stop heating weak\n}\n", ""),
    (0, "workflow wrong", "workflow more in bench {\n    wait 1 s\n}\n\nworkflow wrong"),
    (0, "use part\n", ""),
    (0, "use part\n", "use part\nuse std::glassware::Vial20mL\n"),
    (0, "mtx 1\n", "mtx 1\n\n\n"),
    (0, "//! A package.\n", "//! A package.\nallow unused\n"),
    (0, "workflow gentle", "/// Gently.\nworkflow gentle"),
    (1, "rest = 5 s", "rest = 6 s"),
    (1, "t + t", "t + t + t"),
    (1, "t + t", "t + u"),
    (1, "wait 1 s", "wait 2 s"),
    (1, "wait twice(rest)", "wait twice(rest)\n    wait 1 s"),
    (1, "skill calm(", "skill calms("),
    (1, "const rest = 5 s\n", "const rest = 5 s\nconst warm = 50 degC\n"),
];

#[test]
fn whatever_is_edited_is_judged_as_if_it_had_always_stood_there() {
    // Which edits are there: each step makes or takes back one of them.
    let mut there = [false; EDITS.len()];
    let steps = std::env::var("MATTERIX_EDITS").ok().and_then(|n| n.parse().ok()).unwrap_or(60);
    let mut session = Session::default();
    let mut random: u64 = 0x5eed;
    for _ in 0..steps {
        // Knuth's linear congruential generator.
        random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let pick = (random >> 33) as usize;
        there[pick % EDITS.len()] ^= true;
        // Few at a time, so that most of the package is whole.
        if there.iter().filter(|there| **there).count() > 3 {
            there = [false; EDITS.len()];
        }
        let mut texts = MANY.map(str::to_string);
        for ((file, from, to), _) in EDITS.iter().zip(there).filter(|(_, there)| *there) {
            texts[*file] = texts[*file].replacen(from, to, 1);
        }
        let [main, part] = texts;
        let beside = Texts(RefCell::new(BTreeMap::from([("part".to_string(), part)])));
        same("main", &main, &beside, &mut session);
    }
}

#[test]
fn what_was_broken_off_is_judged_later() {
    let beside = Texts(RefCell::new(BTreeMap::from([("part".to_string(), MANY[1].to_string())])));
    let mut session = Session::default();
    for (asked, (_, from, to)) in EDITS.iter().filter(|(file, _, _)| *file == 0).take(12).enumerate() {
        let text = MANY[0].replacen(from, to, 1);
        // Whether to go on is asked again and again: at a later time each round.
        let left = AtomicUsize::new(asked * 2);
        let stop = || left.fetch_update(Relaxed, Relaxed, |left| left.checked_sub(1)).is_err();
        let seen = Analysis::unless("main", &text, &beside, &mut session, &stop);
        assert!(asked > 0 || seen.is_none(), "it is asked before the first is judged");
        same("main", MANY[0], &beside, &mut session);
    }
}

const PLATED: &str = "mtx 1\nuse std::opentrons\nasset Plate from labware \"plate.json\"\n\
    lab deck {\n    ambient: 22 degC\n    plate = Plate at (0, 0, 0) m holding { A1: 10 g of water }\n}\n\
    workflow w in deck {\n    expect plate[A1].max_volume > 12 mL\n}\n";

#[test]
fn verdicts_fall_with_the_files_that_a_text_names() {
    let json = matterix_lang::labware::library::find("nest_12_reservoir_15ml/1").expect("it").text().expect("its text");
    let texts = BTreeMap::from([("plate.json".to_string(), json.clone())]);
    let beside = Texts(RefCell::new(texts));
    let mut session = Session::default();
    let before = Analysis::of("plated", PLATED, &beside, &mut session).findings;
    let smaller = json.replace("\"totalLiquidVolume\":15000", "\"totalLiquidVolume\":11000");
    assert_ne!(smaller, json);
    beside.0.borrow_mut().insert("plate.json".to_string(), smaller);
    same("plated", PLATED, &beside, &mut session);
    let after = Analysis::of("plated", PLATED, &beside, &mut session).findings;
    assert_ne!(before, after);
}

#[test]
fn motions_are_looked_at_again_where_something_changed() {
    let beside = Texts(RefCell::new(BTreeMap::from([("part".to_string(), MANY[1].to_string())])));
    let mut session = Session::default();
    let mut looked = |text: &str| {
        let seen = AtomicUsize::new(0);
        let motions = |program: &matterix_ir::Program| {
            seen.fetch_add(1, Relaxed);
            let span = program.plan.get(program.plan.root).span;
            vec![Diagnostic::advice(matterix_ir::codes::UNUSED, span, program.plan.workflow.clone(), "seen")]
        };
        let check = |session: &mut Session| {
            let mut sources = Sources::default();
            let file = sources.add("main", text);
            matterix_lang::check_and(&mut sources, file, &beside, &motions, session)
        };
        let again = check(&mut session);
        let count = seen.swap(0, Relaxed);
        assert_eq!(again, check(&mut Session::default()), "{text}");
        count
    };
    let whole = MANY[0].replacen("wait paus\n", "wait pause\n", 1);
    // Three and a test are done where things stand.
    assert_eq!(looked(&whole), 4);
    assert_eq!(looked(&whole), 0);
    assert_eq!(looked(&whole.replacen("wait 1 min", "wait 2 min", 1)), 1);
    assert_eq!(looked(&whole), 1);
    assert_eq!(looked(&whole.replacen("idle_time = 2", "idle_time = 3", 1)), 0);
    assert_eq!(looked(&whole.replacen("pause = 10", "pause = 11", 1)), 4);
}

#[test]
fn every_edit_changes_something() {
    for (file, from, to) in EDITS {
        assert_ne!(MANY[file].replacen(from, to, 1), MANY[file], "{from}");
    }
}
