//! What is known after each statement, kept where it is asked for.

use std::collections::{BTreeMap, BTreeSet};

use matterix_ir::plan::{PlanStep, Step, StepId};
use matterix_ir::{NodeId, Span};

use super::Interpreter;
use super::state::AbstractState;
use super::value::{AbstractValue, Imprecision};

/// What is known of the nodes that were asked for.
pub struct Seen {
    /// The statement; empty for the start of the run.
    pub span: Span,
    /// As shown.
    pub label: String,
    /// How often it is done on the ways followed.
    pub times: u32,
    /// Whether a statement that stands in it was followed.
    pub block: bool,
    /// What is known after it; none where no way goes on behind it.
    pub after: Option<After>,
}

/// What is known after a statement.
pub struct After {
    /// Seconds since the run began.
    pub time: AbstractValue,
    /// By index in the nodes asked for, with whether the statement changes it.
    pub values: Vec<(AbstractValue, bool)>,
    /// Kept values that the statement sets, by index.
    pub locals: Vec<(u32, AbstractValue)>,
}

/// What is noted while a plan is followed.
#[derive(Default)]
pub struct Notes {
    /// What is asked for at every statement.
    asked: Vec<NodeId>,
    /// What is asked for that depends on a state, by index.
    asked_of: BTreeMap<u32, Vec<u32>>,
    start: Option<(AbstractValue, Vec<AbstractValue>)>,
    pub(super) by_span: BTreeMap<Span, Note>,
    /// The statements followed now.
    open: Vec<Span>,
    /// While this is not 0 the same steps are followed once more.
    pub(super) again: usize,
    /// States that something else may change meanwhile, with those that follow them: by branch and running job.
    pub(super) busy: Vec<(Option<String>, BTreeSet<u32>)>,
    /// What moves otherwise than followed for good, since a job ran beside.
    pub(super) lost: BTreeSet<u32>,
    /// Whether times are only as early as followed, since something waits for its turn.
    late: bool,
    /// Whether a job was begun: from then on time is not followed.
    pub(super) untimed: bool,
}

/// A statement.
pub(super) struct Note {
    label: String,
    pub(super) times: u32,
    block: bool,
    /// What was known after it the last time.
    pub(super) last: Option<AbstractState>,
    /// What is asked for, each time it was done, with whether it changes that.
    values: Vec<(AbstractValue, bool)>,
    /// The time after it, each time.
    time: AbstractValue,
    /// The kept values it sets, each time.
    pub(super) locals: BTreeMap<u32, AbstractValue>,
}

/// A statement that was begun.
pub struct Begun {
    before: AbstractState,
    /// It is the statement itself, not a part of it that stands at the same place.
    whole: bool,
}

impl Interpreter<'_, '_> {
    /// Takes notes of these nodes from now on.
    pub fn take_notes(&mut self, asked: &[NodeId]) {
        let mut asked_of: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
        for (i, node) in asked.iter().enumerate() {
            for state in &self.parts(*node).states {
                asked_of.entry(*state).or_default().push(i as u32);
            }
        }
        let any = |is: fn(&Step) -> bool| self.plan.steps.iter().any(|s| is(&s.step));
        let beside = any(|s| matches!(s, Step::Parallel(_) | Step::Start { .. }));
        let late = beside && any(|s| matches!(s, Step::Claim { .. }));
        self.notes = Some(Notes { asked: asked.to_vec(), asked_of, late, ..Notes::default() });
    }

    /// Notes what is known when the first statement begins.
    pub fn note_start(&mut self, facts: &AbstractState) {
        let Some(asked) = self.notes.as_ref().map(|n| n.asked.clone()) else { return };
        let values = asked.iter().map(|n| self.eval(*n, facts)).collect();
        if let Some(notes) = &mut self.notes {
            notes.start = Some((facts.time.clone(), values));
        }
    }

    /// Begins a statement, where notes are taken.
    pub fn begin(&mut self, id: StepId, node: &PlanStep, facts: &AbstractState) -> Option<Begun> {
        self.notes.as_ref()?;
        let braces = matches!(node.step, Step::Sequence(_)) && self.sources.slice(node.span).starts_with('{');
        if id == self.plan.root || braces || node.span.is_empty() || self.in_library(node.span) {
            return None;
        }
        let notes = self.notes.as_mut()?;
        let whole = !notes.open.contains(&node.span);
        let inside = |around: &&Span| {
            around.file == node.span.file && around.start <= node.span.start && node.span.end <= around.end
        };
        if whole && let Some(note) = notes.open.last().filter(inside).and_then(|a| notes.by_span.get_mut(a)) {
            note.block = true;
        }
        notes.open.push(node.span);
        notes.by_span.entry(node.span).or_insert_with(|| Note {
            label: node.label.clone(),
            times: 0,
            block: false,
            last: None,
            values: Vec::new(),
            time: AbstractValue::top(),
            locals: BTreeMap::new(),
        });
        Some(Begun { before: bare(facts), whole })
    }

    /// Ends a statement.
    pub fn end(&mut self, node: &PlanStep, begun: Begun, after: Option<&AbstractState>) {
        let Some(notes) = &mut self.notes else { return };
        notes.open.pop();
        let Some(note) = notes.by_span.get_mut(&node.span).filter(|_| begun.whole) else { return };
        note.times += u32::from(notes.again == 0);
        let (mut before, Some(mut after)) = (begun.before, after.map(bare)) else { return };
        for state in notes.busy.iter().flat_map(|(_, states)| states).chain(&notes.lost) {
            before.states[*state as usize] = AbstractValue::top();
            after.states[*state as usize] = AbstractValue::top();
        }
        if notes.untimed {
            after.time = AbstractValue::top();
        } else if notes.late {
            after.time = at_least(&after.time);
        }
        self.known_after(node.span, Some(&before), after);
    }

    /// Takes in what is known after a statement, beside what is known of the other times it is done.
    pub(super) fn known_after(&mut self, span: Span, before: Option<&AbstractState>, after: AbstractState) {
        let Some(mut notes) = self.notes.take() else { return };
        if let Some(note) = notes.by_span.get_mut(&span) {
            let behind = |states: Vec<u32>| -> BTreeSet<u32> {
                states.iter().filter_map(|s| notes.asked_of.get(s)).flatten().copied().collect()
            };
            let changed = before.map(|b| behind(differing(b.states.iter(), after.states.iter()))).unwrap_or_default();
            let new: BTreeSet<u32> = match &note.last {
                Some(last) => behind(differing(last.states.iter(), after.states.iter())),
                None => (0..notes.asked.len() as u32).collect(),
            };
            let first = note.values.is_empty();
            if first {
                note.values = vec![(AbstractValue::top(), false); notes.asked.len()];
            }
            for i in new.union(&changed) {
                let node = notes.asked[*i as usize];
                let is = self.eval(node, &after);
                let (value, ever) = &mut note.values[*i as usize];
                *ever |= changed.contains(i) && before.is_some_and(|b| self.eval(node, b) != is);
                *value = if first { is } else { value.join(&is, Imprecision::Unknown) };
            }
            note.time = if first { after.time.clone() } else { note.time.join(&after.time, Imprecision::Unknown) };
            let set = before.map(|b| differing(b.locals.iter(), after.locals.iter())).unwrap_or_default();
            for i in set {
                let is = &after.locals[i as usize];
                let known = note.locals.entry(i).or_insert_with(|| is.clone());
                *known = known.join(is, Imprecision::Unknown);
            }
            note.last = Some(after);
        }
        self.notes = Some(notes);
    }

    /// What was noted: at the start, then by statement in the order of the text.
    pub fn seen(&mut self) -> Vec<Seen> {
        let Some(notes) = self.notes.take() else { return Vec::new() };
        let mut out = Vec::new();
        if let Some((time, values)) = notes.start {
            let values = values.into_iter().map(|v| (v, false)).collect();
            let after = Some(After { time, values, locals: Vec::new() });
            out.push(Seen { span: Span::default(), label: String::new(), times: 1, block: false, after });
        }
        for (span, note) in notes.by_span {
            let Note { label, times, block, last, values, time, locals } = note;
            let after = last.map(|_| After { time, values, locals: locals.into_iter().collect() });
            out.push(Seen { span, label, times, block, after });
        }
        out
    }
}

/// Where values differ, by index.
fn differing<'k>(a: impl Iterator<Item = &'k AbstractValue>, b: impl Iterator<Item = &'k AbstractValue>) -> Vec<u32> {
    a.zip(b).enumerate().filter(|(_, (x, y))| x != y).map(|(i, _)| i as u32).collect()
}

/// A time or any later one.
pub(super) fn at_least(time: &AbstractValue) -> AbstractValue {
    AbstractValue::Range(time.bounds().0, f64::INFINITY, Imprecision::Unknown)
}

/// The values alone.
fn bare(facts: &AbstractState) -> AbstractState {
    let mut bare = AbstractState::new(facts.states.clone(), facts.locals.clone(), facts.time.clone());
    bare.bonds.clone_from(&facts.bonds);
    if let Some(blurred) = &facts.blurred {
        bare.forget(&blurred.iter().copied().collect::<Vec<_>>());
    }
    bare
}
