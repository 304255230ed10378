//! Whether a record is whole, and comes to the same when it is gone through again on the twin.

use std::cell::Cell;
use std::path::Path;
use std::rc::Rc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use matterix_hardware::deploy::{
    Control, Course, Ending, Entry, Exposed, Journal, Kept, Mode, Past, REFUSED, carry_out, digest, read, sha256,
};
use matterix_hardware::place::Place;
use matterix_hardware::port::Port;
use matterix_hardware::world::World;
use matterix_hardware::{binding, calibration};
use matterix_ir::Diagnostic;
use matterix_ir::wire::Driver;

use super::folder::{Manifest, gather};
use super::report::Report;
use super::{BINDINGS, JOURNAL, MANIFEST, PROGRAM, REPORT};
use crate::files;
use crate::pipeline::{self, Calibration, Gauged, Input, Options, Wires};

/// What was found of a record.
#[derive(Debug, Default, serde::Serialize)]
pub struct Checked {
    /// What holds, a line each.
    pub holds: Vec<String>,
    /// What does not.
    pub wrong: Vec<String>,
    /// The digest of the manifest, to sign.
    pub digest: String,
}

/// Checks the record in a folder; an error where it cannot be read at all.
pub fn verify(dir: &Path) -> Result<Checked, String> {
    let text = files::read(&dir.join(MANIFEST))?;
    let manifest: Manifest = serde_json::from_slice(&text)
        .map_err(|e| format!("`{}` is not a record: {e}", dir.join(MANIFEST).display()))?;
    let mut checked = Checked { digest: sha256(&text), ..Checked::default() };
    whole(dir, &manifest, &mut checked)?;
    let journal = files::read_recording(&dir.join(JOURNAL))?;
    match read(&journal[..]) {
        Err(why) => checked.wrong.push(format!("the journal {why}")),
        Ok(past) => {
            checked.holds.push(format!("the journal is an unbroken chain of {} lines", past.entries.len()));
            replayed(dir, &manifest, &past, &mut checked)?;
        }
    }
    Ok(checked)
}

/// Whether each file is as it was sealed, and none is there besides.
fn whole(dir: &Path, manifest: &Manifest, checked: &mut Checked) -> Result<(), String> {
    let before = checked.wrong.len();
    for sealed in &manifest.files {
        match files::read_recording(&dir.join(&sealed.path)) {
            Err(why) => checked.wrong.push(why),
            Ok(bytes) if bytes.len() as u64 != sealed.bytes || sha256(&bytes) != sealed.sha256 => {
                checked.wrong.push(format!("`{}` has changed since it was sealed", sealed.path));
            }
            Ok(_) => {}
        }
    }
    let mut there = Vec::new();
    gather(dir, dir, &mut there)?;
    for path in there.iter().map(|p| p.display().to_string()).filter(|p| p != MANIFEST) {
        if !manifest.files.iter().any(|sealed| sealed.path == path) {
            checked.wrong.push(format!("`{path}` is not part of the record"));
        }
    }
    if checked.wrong.len() == before {
        checked.holds.push(format!("{} files are unchanged since they were sealed", manifest.files.len()));
    }
    Ok(())
}

/// Goes through the journal again on the twin, with the program of the record.
fn replayed(dir: &Path, manifest: &Manifest, past: &Past, checked: &mut Checked) -> Result<(), String> {
    let about = &manifest.about;
    let this = env!("CARGO_PKG_VERSION");
    if about.tool != this {
        let text = format!("it was recorded by version {}, which {this} cannot replay", about.tool);
        checked.wrong.push(text);
        return Ok(());
    }
    let (Some(Entry::Begin { digest: before, seed, speed, .. }), Some(end)) =
        (past.entries.first(), past.entries.last())
    else {
        checked.wrong.push("the journal contains no deployment".to_owned());
        return Ok(());
    };
    let Entry::End { status, states, .. } = end else {
        checked.wrong.push("the journal has no end".to_owned());
        return Ok(());
    };
    let main = dir.join(PROGRAM).join(&about.main);
    let bindings = String::from_utf8(files::read(&dir.join(BINDINGS))?).map_err(|_| "the bindings are not text")?;
    let gauged = |c: calibration::Calibrated| Gauged { thing: c.thing, field: c.field, value: c.value };
    let given = calibration::read(&bindings).into_iter().map(gauged).collect();
    let measured = Calibration { name: BINDINGS.to_owned(), text: bindings.clone(), given };
    let (workflow, set, lab) = (about.workflow.clone(), about.set.clone(), about.lab.clone());
    let options = Options { workflow, set, lab, wires: Wires::Called, measured };
    let (mut sources, program, found) = pipeline::compile(&Input::file(&main, files::read(&main)?), &options);
    let is_wrong = found.iter().any(Diagnostic::is_error);
    let Some(program) = program.filter(|_| !is_wrong) else {
        checked.wrong.push("the program of the record does not compile".to_owned());
        return Ok(());
    };
    let file = sources.add(BINDINGS, bindings.clone());
    let (bindings, _) = binding::read(&program, file, &bindings);
    if digest(&program, &binding::canonical(&program, &bindings))? != *before {
        checked.wrong.push("the program of the record is not the one of the journal".to_owned());
        return Ok(());
    }
    checked.holds.push("the program of the record is the one of the journal".to_owned());
    let control: &'static Control = Box::leak(Box::new(Control::new(&CANCEL, |_| {})));
    let exposed = Exposed::new();
    let course = Course {
        bindings,
        mode: Mode::Replay,
        speed: *speed,
        seed: *seed,
        trace: Box::new(|_, _, _, _| {}),
        journal: Kept::Left(Journal::none(), past.entries.clone()),
        control,
        who: "",
        world: Rc::new(Nowhere::default()),
        exposed: &exposed,
    };
    let ending = carry_out(&program, &sources, course, &mut ())?;
    compared(dir, manifest, past, (status, states), &ending, checked)
}

/// Whether the replay came to what the journal and the report say.
fn compared(
    dir: &Path,
    manifest: &Manifest,
    past: &Past,
    (status, states): (&str, &str),
    ending: &Ending,
    checked: &mut Checked,
) -> Result<(), String> {
    if ending.execution.is_none() && ending.states.is_empty() {
        checked.wrong.push(match ending.diagnostics.first() {
            Some(d) => format!("the replay does not start: {}", d.headline),
            None => "the replay does not start".to_owned(),
        });
        return Ok(());
    }
    if status == REFUSED {
        checked.holds.push("the deployment could not continue: the part before that is not replayed".to_owned());
        return Ok(());
    }
    if ending.status != status {
        let why = ending.diagnostics.first().map_or(String::new(), |d| format!(": {}", d.headline));
        checked.wrong.push(format!("the replay ends as `{}`, not `{status}`{why}", ending.status));
    }
    match ending.states == states {
        true => checked.holds.push("the replay reaches the same states to the last bit".to_owned()),
        false => checked.wrong.push("the replay reaches other states".to_owned()),
    }
    let report = Report::of(manifest.about.clone(), &past.entries, ending).json()?;
    match files::read(&dir.join(REPORT))? == report.as_bytes() {
        true => checked.holds.push("the report agrees with the journal".to_owned()),
        false => checked.wrong.push("the report contradicts the journal".to_owned()),
    }
    Ok(())
}

/// Set where the journal says that a person stopped it.
static CANCEL: AtomicBool = AtomicBool::new(false);

/// A world with nobody in it.
#[derive(Default)]
struct Nowhere(Cell<Duration>);

impl World for Nowhere {
    fn elapsed(&self) -> Duration {
        self.0.get()
    }

    fn wall(&self) -> f64 {
        0.0
    }

    fn sleep(&self, time: Duration) {
        self.0.set(self.0.get() + time);
    }

    fn open(&self, _: &Place, _: &Driver) -> std::io::Result<Box<dyn Port>> {
        Err(std::io::Error::from(std::io::ErrorKind::NotFound))
    }
}
