//! A performance as commands of the run engine.

use std::collections::{BTreeMap, BTreeSet};

use matterix_ir::plan::Step;
use matterix_ir::scene::InstanceId;
use matterix_ir::script::Wired;
use matterix_ir::{Diagnostic, Span};
use serde_json::{Map, Value, json};

use super::WHAT;
use super::deck::Deck;
use super::form::{BIN_ID, loads_bin};
use super::writer::{MOVES, Writer};
use crate::Subject;
use crate::finding::not_expressible;
use crate::performance::{Act, Deed, Performance, Said, number};
use crate::place;

/// A command with its parameters as the command schema has them.
#[derive(Debug)]
pub(super) struct Command {
    /// Its `commandType`.
    pub(super) name: &'static str,
    /// Its parameters.
    pub(super) params: Map<String, Value>,
    /// Where the user's text says it.
    pub(super) at: Span,
}

impl Command {
    /// A parameter that is a text; empty where there is none.
    pub(super) fn text(&self, name: &str) -> &str {
        self.params.get(name).and_then(Value::as_str).unwrap_or("")
    }
}

/// A protocol before it is written in either form.
#[derive(Debug)]
pub(super) struct Protocol<'p> {
    pub(super) subject: Subject<'p>,
    /// What the driver of the robot says.
    pub(super) robot: &'p Wired,
    /// Liquids by identifier, with their names.
    pub(super) liquids: Vec<(String, String)>,
    /// Labware definitions that Opentrons does not know by itself, by `NAMESPACE/NAME/VERSION`.
    pub(super) definitions: Vec<(String, Value)>,
    /// Those of the labware used that it may know, in the version meant.
    pub(super) library: Vec<(String, Value)>,
    /// Those of the labware used whose role is to bear other labware, which Python loads by a call of its own.
    pub(super) adapters: BTreeSet<String>,
    /// What is loaded.
    pub(super) loads: Vec<Command>,
    /// What is done.
    pub(super) commands: Vec<Command>,
}

impl<'p> Protocol<'p> {
    /// Identifiers of the bins that are loaded.
    pub(super) fn bins(&self) -> BTreeSet<String> {
        let loads = self.loads.iter().filter(|c| loads_bin(c.name));
        loads.map(|c| c.text(BIN_ID).to_owned()).collect()
    }

    /// The protocol of what was done; what has no counterpart goes into `found`.
    pub(super) fn of(
        subject: Subject<'p>,
        performance: &Performance<'_>,
        robot: &'p Wired,
        found: &mut Vec<Diagnostic>,
    ) -> Self {
        let origins = place::origins(&subject.program.plan, subject.sources);
        let mut writer = Writer {
            deck: Deck::new(&subject.program.scene, robot.device),
            moved: moved(subject, performance, &origins),
            later: BTreeMap::new(),
            off: BTreeSet::new(),
            heads: BTreeMap::new(),
            origins,
            protocol: Protocol {
                subject,
                robot,
                liquids: Vec::new(),
                definitions: Vec::new(),
                library: Vec::new(),
                adapters: BTreeSet::new(),
                loads: Vec::new(),
                commands: Vec::new(),
            },
            found,
        };
        for (wired, opened) in subject.wiring.devices.iter().zip(&performance.opened) {
            opened.iter().for_each(|said| writer.open(wired, said));
        }
        writer.gather_liquids();
        for act in &performance.acts {
            let at = writer.origins.get(act.step.0 as usize).copied().unwrap_or_default();
            match &act.deed {
                Deed::Operation(said) => {
                    writer.operation(act.step.0, said.as_deref(), at);
                    writer.join_pause();
                }
                Deed::Wait(seconds) => writer.push("waitForDuration", json!({ "seconds": number(*seconds) }), at),
                Deed::Note(text) => writer.push("comment", json!({ "message": text }), at),
                Deed::Ask(text) => writer.push("waitForResume", json!({ "message": text }), at),
                Deed::WaitUntil | Deed::Awaited { .. } => {}
            }
        }
        writer.protocol
    }
}

/// Labware that is put in another place on the way, and whether a person is asked for its first move.
fn moved(subject: Subject<'_>, performance: &Performance<'_>, origins: &[Span]) -> BTreeMap<InstanceId, bool> {
    let moves = |said: &Said| said.text.starts_with(MOVES);
    let origin = |act: &Act| origins.get(act.step.0 as usize).copied();
    let mut out = BTreeMap::new();
    let mut asked = None;
    for act in &performance.acts {
        if let Deed::Operation(Some(said)) = &act.deed
            && said.iter().any(moves)
            && let Step::Operation(operation) = &subject.program.plan.get(act.step).step
            && let Some(device) = operation.device
        {
            out.entry(device).or_insert(asked == origin(act));
        }
        asked = matches!(act.deed, Deed::Ask(_)).then(|| origin(act)).flatten();
    }
    out
}

/// The robot whose devices are used, of those that have a driver.
pub(super) fn robot<'p>(subject: Subject<'p>, performance: &Performance<'_>) -> Result<&'p Wired, Diagnostic> {
    let Subject { program, wiring, sources } = subject;
    let robots: Vec<&Wired> = wiring.devices.iter().filter(|w| w.setting("robot").is_some()).collect();
    let root = program.plan.get(program.plan.root).span;
    let Some(first) = robots.first() else {
        let label = format!("`{}` has no robot with a driver over `{}`", program.scene.lab, super::WIRE);
        return Err(not_expressible(root, format!("{WHAT} needs an Opentrons robot"), label));
    };
    let origins = place::origins(&program.plan, sources);
    let mut used: Option<&Wired> = None;
    for act in performance.acts.iter().filter(|a| matches!(a.deed, Deed::Operation(Some(_)))) {
        let Step::Operation(operation) = &program.plan.get(act.step).step else { continue };
        let Some(own) = operation.device.and_then(|d| robots.iter().find(|r| belongs(subject, d, r.device))) else {
            continue;
        };
        match used {
            Some(other) if other.device != own.device => {
                let at = origins.get(act.step.0 as usize).copied().unwrap_or_default();
                let names = [other, own].map(|w| program.scene.get(w.device).name.as_str());
                let headline =
                    format!("{WHAT} is for one robot, but this workflow uses `{}` and `{}`", names[0], names[1]);
                let d = not_expressible(at, headline, format!("done by `{}`", names[1]));
                return Err(d.help("write one workflow for each"));
            }
            _ => used = Some(own),
        }
    }
    Ok(used.unwrap_or(first))
}

/// Whether a device is part of another.
pub(super) fn belongs(subject: Subject<'_>, device: InstanceId, whole: InstanceId) -> bool {
    let mut next = Some(device);
    while let Some(id) = next {
        if id == whole {
            return true;
        }
        next = subject.program.scene.get(id).owner;
    }
    false
}
