//! The motions of one arm of Universal Robots as a URScript program.
//!
//! Joint positions are followed with `servoj` at the times of the performance, after a `movej` to where the arm stood when it
//! began. What the arm does not do itself, such as closing its gripper or heating a plate, is a function that asks a person;
//! who has a driver for it replaces its body.

use std::collections::BTreeSet;
use std::fmt::Write;

use matterix_ir::Span;
use matterix_ir::plan::{Motion, Step};
use matterix_ir::scene::InstanceId;

use super::{Travel, travels};
use crate::course::{self, Means};
use crate::finding::{not_expressible, settle};
use crate::performance::{Act, Deed, Performance, number};
use crate::{Subject, Written, place};

/// The wire of the drivers that say which arms understand URScript.
pub const WIRE: &str = "urscript";

/// What the target is called in findings.
const WHAT: &str = "a URScript program";

/// How far ahead `servoj` smooths, s, and how stiffly it follows: the defaults of the URScript manual.
const LOOK_AHEAD: f64 = 0.1;
const GAIN: u32 = 300;

/// Shortest time of a `servoj`, s: a cycle of the controller of the e-Series.
const CYCLE: f64 = 0.002;

/// How long the last position is held, s: what smoothing lags behind, twice.
const SETTLE: f64 = 2.0 * LOOK_AHEAD;

/// Joints of an arm that understands URScript.
const JOINTS: usize = 6;

/// The program of the one arm that moves.
pub fn script(subject: Subject<'_>, performance: &Performance<'_>) -> Written {
    let Subject { program, wiring, sources } = subject;
    let mut found = course::open(program, wiring, sources, &performance.acts, Means::default(), WHAT);
    let root = program.plan.get(program.plan.root).span;
    let travels = match travels(program, &performance.motions) {
        Ok(travels) => travels,
        Err(why) => {
            found.push(not_expressible(root, why, "this workflow"));
            return Err(found);
        }
    };
    let origins = place::origins(&program.plan, sources);
    let at = |travel: &Travel| origins.get(travel.step.0 as usize).copied().unwrap_or_default();
    let Some(first) = travels.iter().find(|t| t.owner == t.robot) else {
        found.push(not_expressible(root, "no arm moves in this workflow", "nothing to write"));
        return Err(found);
    };
    let arm = travels.iter().find(|t| wiring.of(t.owner).is_some()).map_or(first.robot, |t| t.robot);
    let name = |id: InstanceId| program.scene.get(id).name.as_str();
    let mut others = BTreeSet::from([arm]);
    for travel in travels.iter().filter(|t| t.owner == t.robot) {
        if others.insert(travel.robot) {
            let headline =
                format!("{WHAT} is for one arm, but this workflow moves `{}` and `{}`", name(arm), name(travel.robot));
            found.push(not_expressible(at(travel), headline, format!("moves `{}`", name(travel.robot))));
        }
    }
    let own = travels.iter().find(|t| t.owner == arm).unwrap_or(first);
    if wiring.of(arm).is_none() || own.joints.len() != JOINTS {
        let headline = format!("`{}` does not understand URScript", name(arm));
        let help = format!("`{}` has no driver over `{WIRE}`", program.scene.get(arm).kind);
        found.push(not_expressible(at(own), headline, format!("moves `{}`", name(arm))).help(help));
    }
    let warnings = settle(found)?;
    let mut script =
        Script { subject, origins, arm, functions: Vec::new(), body: String::new(), known: BTreeSet::new() };
    script.body(performance, &travels);
    Ok((script.file().into_bytes(), warnings))
}

/// A text of URScript, which has no escapes.
fn quoted(text: &str) -> String {
    let plain: String = text.chars().map(|c| if c == '"' || c.is_control() { '\'' } else { c }).collect();
    format!("\"{plain}\"")
}

/// Letters, digits and `_`, as names have them.
fn word(text: &str) -> String {
    let plain: String = text.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
    let parts: Vec<&str> = plain.split('_').filter(|p| !p.is_empty()).collect();
    format!("do_{}", parts.join("_").to_ascii_lowercase())
}

struct Script<'p> {
    subject: Subject<'p>,
    origins: Vec<Span>,
    arm: InstanceId,
    /// Name and text of each function, in the order of their first use.
    functions: Vec<(String, String)>,
    body: String,
    known: BTreeSet<String>,
}

impl Script<'_> {
    fn line(&mut self, text: &str) {
        let _ = writeln!(self.body, "  {text}");
    }

    fn body(&mut self, performance: &Performance<'_>, travels: &[Travel]) {
        let own: Vec<&Travel> = travels.iter().filter(|t| t.owner == self.arm).collect();
        if let Some(start) = own.first().and_then(|t| t.points.first()) {
            self.line("# to the position of the arm at the start of the workflow");
            let positions = list(&start.positions);
            self.line(&format!("movej({positions}, a=1.0, v=0.5)"));
        }
        let mut said: Option<Span> = None;
        let mut next = 0;
        for act in &performance.acts {
            let at = self.origins.get(act.step.0 as usize).copied().unwrap_or_default();
            if said != Some(at) {
                said = Some(at);
                let (file, line, text) = place::line(self.subject.sources, at);
                self.line(&format!("# {file}:{line}: {text}"));
            }
            match &act.deed {
                Deed::Wait(seconds) => self.line(&format!("sleep({})", number(*seconds))),
                Deed::Note(text) => self.line(&format!("textmsg({})", quoted(text))),
                Deed::Ask(text) => self.line(&format!("popup({}, title=\"matterixc\", blocking=True)", quoted(text))),
                Deed::WaitUntil | Deed::Awaited { .. } => {}
                Deed::Operation(_) => {
                    let begins = |t: &&&Travel| t.step == act.step && t.begins >= act.time;
                    match own.get(next).filter(begins) {
                        Some(travel) => {
                            self.follow(travel);
                            next += 1;
                        }
                        None => self.ask_for(act),
                    }
                }
            }
        }
    }

    /// A motion, point by point.
    fn follow(&mut self, travel: &Travel) {
        for pair in travel.points.windows(2) {
            let time = (pair[1].time - pair[0].time).max(CYCLE);
            let (positions, time) = (list(&pair[1].positions), decimal(time));
            self.line(&format!("servoj({positions}, t={time}, lookahead_time={LOOK_AHEAD}, gain={GAIN})"));
        }
        if let Some(last) = travel.points.last() {
            let positions = list(&last.positions);
            self.line(&format!("servoj({positions}, t={SETTLE}, lookahead_time={LOOK_AHEAD}, gain={GAIN})"));
        }
        self.line("stopj(2.0)");
    }

    /// What the arm does not do itself.
    fn ask_for(&mut self, act: &Act) {
        let step = self.subject.program.plan.get(act.step);
        let Step::Operation(operation) = &step.step else { return };
        // To where it is already, it need not go.
        let stands = matches!(
            operation.motion,
            Some(
                Motion::To { .. }
                    | Motion::By { .. }
                    | Motion::Upright { .. }
                    | Motion::Tilted { .. }
                    | Motion::Joints { .. }
                    | Motion::Home { .. }
            )
        );
        if stands {
            return;
        }
        let (name, label) = (word(&act.words), act.words.clone());
        if self.known.insert(name.clone()) {
            let text = format!("  popup({}, title=\"matterixc\", blocking=True)\n", quoted(&label));
            self.functions.push((name.clone(), text));
        }
        self.line(&format!("{name}()"));
    }

    fn file(&self) -> String {
        let program = self.subject.program;
        let mut out = String::new();
        let arm = program.scene.get(self.arm);
        let _ = writeln!(out, "# workflow {}, arm {} ({})", program.plan.workflow, arm.name, arm.kind);
        let _ = writeln!(out, "def {}():", word(&program.plan.workflow).replacen("do_", "workflow_", 1));
        if !self.functions.is_empty() {
            out.push_str("  # steps of other devices: replace the bodies by calls of your devices\n");
        }
        for (name, text) in &self.functions {
            let _ = write!(out, "  def {name}():\n  {text}  end\n");
        }
        let _ = writeln!(out, "{}end", self.body);
        out
    }
}

/// Six decimals: less than a step of the encoders.
fn decimal(value: f64) -> String {
    let text = format!("{value:.6}");
    if text.trim_start_matches('-').bytes().all(|b| b == b'0' || b == b'.') { "0.0".to_owned() } else { text }
}

fn list(values: &[f64]) -> String {
    let values: Vec<String> = values.iter().map(|v| decimal(*v)).collect();
    format!("[{}]", values.join(", "))
}
