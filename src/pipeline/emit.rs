//! A workflow as a file that another program runs: performed once on the digital twin and written down.

use std::sync::atomic::AtomicBool;

use clap::ValueEnum;
use matterix_emit::robots::{ros, urscript};
use matterix_emit::{Performance, Subject, opentrons, steps};
use matterix_ir::script::Wiring;
use matterix_ir::{Diagnostic, Program, Severity, Sources, codes};
use matterix_runtime::exec::{Limits, RunStatus};
use matterix_runtime::run::{Fidelity, RunOptions};

/// A kind of file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Target {
    /// A protocol of Opentrons in JSON, schema 8.
    OpentronsJson,
    /// A protocol of Opentrons in Python.
    OpentronsPython,
    /// A program for PyLabRobot.
    Pylabrobot,
    /// Numbered steps to read.
    Commands,
    /// The same, one JSON object per line.
    CommandsJson,
    /// The motions of an arm of Universal Robots.
    Urscript,
    /// Motions of robots as messages of ROS 2 in MCAP.
    JointTrajectory,
    /// The same as JSON.
    JointTrajectoryJson,
}

impl Target {
    /// The wire whose drivers say what devices are told.
    pub fn wire(self) -> &'static str {
        match self {
            Target::OpentronsJson | Target::OpentronsPython | Target::Pylabrobot => opentrons::WIRE,
            Target::Urscript => urscript::WIRE,
            _ => "",
        }
    }

    fn fidelity(self) -> Fidelity {
        match self {
            Target::Urscript | Target::JointTrajectory | Target::JointTrajectoryJson => Fidelity::Motion,
            _ => Fidelity::Process,
        }
    }
}

/// A file for another program.
pub struct Emitted {
    /// Its bytes.
    pub bytes: Vec<u8>,
    /// States at the end of what was performed, by index, SI.
    pub states: Vec<Option<f64>>,
}

/// The file, none where something keeps it from being written, and what was found.
pub fn emit(
    program: &Program,
    wiring: &Wiring,
    sources: &Sources,
    target: Target,
    seed: u64,
    cancel: &AtomicBool,
) -> (Option<Emitted>, Vec<Diagnostic>) {
    let limits = Limits { cancel: Some(cancel), ..Limits::default() };
    let options = RunOptions { seed, fidelity: target.fidelity(), limits, ..RunOptions::default() };
    let subject = Subject { program, wiring, sources };
    let mut performance = Performance::new(subject);
    let outcome = matterix_runtime::run::run(program, &options, &mut performance);
    let mut found = super::run::findings(&outcome, sources);
    // What is left on at the end is `check`'s to warn of: a protocol may leave a block cold for whoever comes.
    found.iter_mut().filter(|d| d.code == codes::UNFINISHED).for_each(|d| d.severity = Severity::Warning);
    // What was performed until then is no protocol.
    if outcome.status == RunStatus::Cancelled || found.iter().any(Diagnostic::is_error) {
        return (None, found);
    }
    let written = match target {
        Target::OpentronsJson => opentrons::json(subject, &performance),
        Target::OpentronsPython => opentrons::python(subject, &performance),
        Target::Pylabrobot => opentrons::pylabrobot(subject, &performance),
        Target::Commands => steps::text(subject, &performance),
        Target::CommandsJson => steps::json(subject, &performance),
        Target::Urscript => urscript::script(subject, &performance),
        Target::JointTrajectory => ros::mcap(subject, &performance),
        Target::JointTrajectoryJson => ros::json(subject, &performance),
    };
    match written {
        Ok((bytes, warnings)) => {
            found.extend(warnings);
            (Some(Emitted { bytes, states: outcome.states }), found)
        }
        Err(errors) => {
            found.extend(errors);
            (None, found)
        }
    }
}
