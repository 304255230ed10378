//! A program on devices: bindings, what is shown meanwhile, and what was found.

use std::rc::Rc;

use matterix_hardware::binding;
use matterix_hardware::codec::shown;
use matterix_hardware::deploy::{Control, Course, Ending, Exposed, Kept, Mode, carry_out};
use matterix_hardware::world::World;
use matterix_ir::{Diagnostic, FileId, Program, Sources};
use matterix_runtime::exec::{Listener, Tee};
use matterix_runtime::process::{Engine, Observer};

use crate::terminal::{Stream, print};

/// What a deployment is given beside a program.
pub struct Plan<'p> {
    /// The text of the bindings and the file they are in.
    pub bindings: (FileId, &'p str),
    /// What is done with devices.
    pub mode: Mode,
    /// Seconds of lab time per second.
    pub speed: f64,
    /// Where the noise of the twin starts.
    pub seed: u64,
    /// Shows all bytes.
    pub trace: bool,
    /// The journal.
    pub journal: Kept,
    /// What people say meanwhile.
    pub control: &'p Control,
    /// Who carries it out.
    pub who: &'p str,
    /// Clocks and ports.
    pub world: Rc<dyn World>,
    /// Kept up to date with what is told to devices.
    pub exposed: &'p Exposed,
    /// Hears what the executor does.
    pub beside: &'p mut dyn Listener,
}

/// Carries a program out; what was wrong with the bindings, or how it ended.
pub fn deploy(program: &Program, sources: &Sources, plan: Plan<'_>) -> Result<Result<Ending, Vec<Diagnostic>>, String> {
    let Plan { mode, speed, seed, trace, journal, control, who, world, exposed, beside, .. } = plan;
    let (bindings, found) = binding::read(program, plan.bindings.0, plan.bindings.1);
    if found.iter().any(Diagnostic::is_error) {
        return Ok(Err(found));
    }
    let trace = Box::new(traced(trace || mode == Mode::Dry));
    let course = Course { bindings, mode, speed, seed, trace, journal, control, who, world, exposed };
    let ending = carry_out(program, sources, course, &mut Tee(&mut Told, beside))?;
    let led = |d: Diagnostic| super::run::led_by_the_user(d, sources);
    let diagnostics = ending.diagnostics.into_iter().map(led).collect();
    Ok(Ok(Ending { diagnostics, ..ending }))
}

/// Shows what goes over lines, where that is wanted.
pub(super) fn traced(shows: bool) -> impl Fn(f64, &str, bool, &[u8]) {
    move |time, device, out, bytes| {
        if shows {
            let way = if out { "<-" } else { "->" };
            print(Stream::Out, &format!("{time:10.3} s  {device} {way} {}\n", shown(bytes)));
        }
    }
}

/// Says what is noted.
struct Told;

impl Observer for Told {
    fn sample(&mut self, _: f64, _: &Engine<'_>, _: &[u32]) {}
    fn event(&mut self, _: f64, _: usize) {}
    fn process(&mut self, _: f64, _: usize, _: bool) {}
}

impl Listener for Told {
    fn note(&mut self, time: f64, _: matterix_ir::plan::StepId, text: &str) {
        print(Stream::Err, &format!("{time:10.3} s  {text}\n"));
    }
}
