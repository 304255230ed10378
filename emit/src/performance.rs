//! One run on the digital twin, as a list of what was done and what devices were told.

use matterix_ir::plan::{Argument, Step, StepId};
use matterix_ir::quantity::show_number;
use matterix_ir::scene::InstanceId;
use matterix_ir::script::Message;
use matterix_ir::{NodeId, Program, Text, TextPart};
use matterix_runtime::exec::Listener;
use matterix_runtime::motion::Moment;
use matterix_runtime::process::{Engine, Observer};

use crate::Subject;

/// Digits that are certain after a value has been in SI units.
const DIGITS: usize = 12;

/// Something that was done.
#[derive(Clone, Debug, PartialEq)]
pub struct Act {
    /// When it began, s.
    pub time: f64,
    /// The node of the plan.
    pub step: StepId,
    /// What it is.
    pub deed: Deed,
    /// In words, with its values.
    pub words: String,
    /// Quantities and words among the arguments of an operation, in their order, SI.
    pub values: Vec<Option<f64>>,
}

/// A motion of a robot, as it was performed.
#[derive(Clone, Debug, PartialEq)]
pub struct Motion {
    /// The node of the plan.
    pub step: StepId,
    /// In order of time.
    pub moments: Vec<Moment>,
}

/// What was done.
#[derive(Clone, Debug, PartialEq)]
pub enum Deed {
    /// A command or primitive skill, and what its device was told; nothing where its driver has no line for it.
    Operation(Option<Vec<Said>>),
    /// A wait of so many seconds.
    Wait(f64),
    /// A wait for a condition.
    WaitUntil,
    /// The end of a device's own wait instead of one for a condition.
    Awaited {
        /// Whether the condition holds now.
        holds: bool,
    },
    /// A remark.
    Note(String),
    /// A question to a person.
    Ask(String),
}

/// A message with its values filled in.
#[derive(Clone, Debug, PartialEq)]
pub struct Said {
    /// Its text.
    pub text: String,
    /// Where its driver says it.
    pub span: matterix_ir::Span,
}

/// What was heard of a run.
pub struct Performance<'p> {
    subject: Subject<'p>,
    /// In the order of their beginning.
    pub acts: Vec<Act>,
    /// By device of the wiring: what it was told before anything else.
    pub opened: Vec<Vec<Said>>,
    /// In the order in which they began.
    pub motions: Vec<Motion>,
}

impl<'p> Performance<'p> {
    /// Before the run.
    pub fn new(subject: Subject<'p>) -> Self {
        Performance { subject, acts: Vec::new(), opened: Vec::new(), motions: Vec::new() }
    }

    fn plan_step(&self, step: StepId) -> &'p Step {
        &self.subject.program.plan.get(step).step
    }

    fn opens(&self) -> impl Iterator<Item = &'p Message> {
        self.subject.wiring.devices.iter().flat_map(|d| &d.opens)
    }
}

/// The condition, quantities, truths, words and instances of a message.
pub(crate) fn nodes_of(message: &Message) -> impl Iterator<Item = NodeId> {
    message.condition.into_iter().chain(nodes(&message.text))
}

fn nodes(text: &Text) -> impl Iterator<Item = NodeId> {
    text.parts.iter().filter_map(|part| match part {
        TextPart::Quantity { value, .. } => Some(*value),
        TextPart::Bool(node) | TextPart::Instance(node) | TextPart::Word(node, _) => Some(*node),
        TextPart::Plain(_) => None,
    })
}

/// A number with the digits that it has.
pub(crate) fn number(value: f64) -> f64 {
    format!("{value:.DIGITS$e}").parse().unwrap_or(value)
}

/// A message with the next of these values.
fn fill(program: &Program, message: &Message, values: &mut impl Iterator<Item = Option<f64>>) -> Said {
    let mut text = String::new();
    for part in &message.text.parts {
        if let TextPart::Plain(plain) = part {
            text.push_str(plain);
            continue;
        }
        let Some(value) = values.next().flatten() else {
            text.push('?');
            continue;
        };
        match part {
            TextPart::Quantity { unit, digits: Some(digits), .. } => {
                text.push_str(&format!("{:.*}", usize::from(*digits), unit.of_si(value)));
            }
            TextPart::Quantity { unit, .. } => text.push_str(&number(unit.of_si(value)).to_string()),
            TextPart::Bool(_) => text.push_str(if value == 0.0 { "false" } else { "true" }),
            TextPart::Word(_, words) => text.push_str(words.get(value as usize).map_or("?", String::as_str)),
            _ => {
                let known = Some(value).filter(|v| *v >= 0.0).and_then(|v| program.scene.instances.get(v as usize));
                text.push_str(known.map_or("nothing", |i| &i.name));
            }
        }
    }
    Said { text, span: message.span }
}

/// A text with the next of these values, for people.
fn tell(program: &Program, text: &Text, values: &mut impl Iterator<Item = Option<f64>>) -> String {
    let instance = |v: f64| {
        let known = Some(v).filter(|v| *v >= 0.0).and_then(|v| program.scene.instances.get(v as usize));
        known.map_or("nothing", |i| &i.name).to_owned()
    };
    let told: Result<String, std::convert::Infallible> = text.show(|_| Ok(values.next().flatten()), instance);
    told.unwrap_or_default()
}

impl Observer for Performance<'_> {
    fn sample(&mut self, _: f64, _: &Engine<'_>, _: &[u32]) {}
    fn event(&mut self, _: f64, _: usize) {}
    fn process(&mut self, _: f64, _: usize, _: bool) {}
}

impl Listener for Performance<'_> {
    fn wanted(&self, step: StepId) -> Vec<NodeId> {
        let mut wanted = Vec::new();
        if step == self.subject.program.plan.root && self.opened.is_empty() {
            wanted.extend(self.opens().flat_map(nodes_of));
        }
        match self.plan_step(step) {
            Step::Operation(operation) => {
                wanted.extend(self.subject.wiring.steps.get(&step).into_iter().flatten().flat_map(nodes_of));
                wanted.extend(self.subject.wiring.calls.get(&step).into_iter().flat_map(nodes));
                wanted.extend(operation.arguments.iter().filter_map(|(_, argument)| match argument {
                    Argument::Quantity(node, _) | Argument::Word(node, _) => Some(*node),
                    _ => None,
                }));
            }
            Step::Wait { duration } => {
                wanted.push(self.subject.wiring.awaited.get(&step).map_or(*duration, |condition| condition.node));
            }
            _ => {}
        }
        wanted
    }

    fn begins(&mut self, time: f64, step: StepId, values: &[Option<f64>]) {
        let program = self.subject.program;
        let mut values = values.iter().copied();
        if step == program.plan.root && self.opened.is_empty() {
            for device in &self.subject.wiring.devices {
                let said = device.opens.iter().filter_map(|m| {
                    let holds = m.condition.is_none_or(|_| values.next().flatten().is_some_and(|v| v != 0.0));
                    let said = fill(program, m, &mut values);
                    holds.then_some(said)
                });
                self.opened.push(said.collect());
            }
        }
        let mut words = program.plan.get(step).label.clone();
        let deed = match self.plan_step(step) {
            Step::Operation(_) => {
                let messages = self.subject.wiring.steps.get(&step);
                let said = messages.map(|all| all.iter().map(|m| fill(program, m, &mut values)).collect());
                if let Some(call) = self.subject.wiring.calls.get(&step) {
                    words = tell(program, call, &mut values);
                }
                Deed::Operation(said)
            }
            Step::Wait { .. } if self.subject.wiring.awaited.contains_key(&step) => {
                Deed::Awaited { holds: values.next().flatten().is_some_and(|v| v != 0.0) }
            }
            Step::Wait { .. } => {
                let seconds = values.next().flatten().unwrap_or(0.0);
                words = format!("wait {} s", show_number(seconds));
                Deed::Wait(seconds)
            }
            Step::WaitUntil { .. } | Step::Hold { .. } => Deed::WaitUntil,
            _ => return,
        };
        self.acts.push(Act { time, step, deed, words, values: values.collect() });
    }

    fn note(&mut self, time: f64, step: StepId, text: &str) {
        self.acts.push(Act {
            time,
            step,
            deed: Deed::Note(text.to_owned()),
            words: format!("note: {text}"),
            values: Vec::new(),
        });
    }

    fn ask(&mut self, time: f64, step: StepId, text: &str) {
        self.acts.push(Act {
            time,
            step,
            deed: Deed::Ask(text.to_owned()),
            words: format!("ask: {text}"),
            values: Vec::new(),
        });
    }

    fn travels(&mut self, moments: &[Moment]) {
        // What begins to move does so as the last operation begins, or one of the same robot that had to wait.
        let moves = |robot: InstanceId, act: &&Act| match self.plan_step(act.step) {
            Step::Operation(operation) => operation.motion.as_ref().is_some_and(|m| m.mover() == robot),
            _ => false,
        };
        let Some(robot) = moments.first().map(|m| m.robot) else { return };
        let Some(act) = self.acts.iter().rev().find(|act| moves(robot, act)) else { return };
        self.motions.push(Motion { step: act.step, moments: moments.to_vec() });
    }
}
