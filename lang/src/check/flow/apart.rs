//! What is open where ways have met, and fails for certain on one of them. Where only bounds are known on some of the ways, values are not
//! told apart behind the meeting; so the plan is followed again for single ways, and what goes wrong there is found on some ways.

use std::collections::BTreeSet;

use matterix_ir::NodeId;

use super::Interpreter;
use super::report::Finding;
use super::state::AbstractState;
use super::trace_partitioning::Place;

/// So many meetings before what is open are looked at.
const NEAR: usize = 4;

/// So many meetings are looked at in all, the latest first.
const MOST_MEETINGS: usize = 8;

/// So many steps are followed again in all.
const MOST_STEPS: usize = 20_000;

/// Something that may fail, and only bounds tell.
#[derive(Clone, Debug)]
pub(super) struct Open {
    place: Place,
    /// How many ways had met before it.
    meetings: usize,
    /// The states that it hangs on.
    states: BTreeSet<u32>,
}

/// What parts the ways of a meeting.
#[derive(Clone, Debug, Default)]
pub(super) struct Meeting {
    /// The states that differ.
    differ: BTreeSet<u32>,
    /// By way: whether the text writes it.
    written: Vec<bool>,
}

impl Meeting {
    pub(super) fn of(ways: &[AbstractState]) -> Self {
        let mut differ = BTreeSet::new();
        for two in ways.windows(2) {
            let pairs = two[0].states.iter().zip(two[1].states.iter()).enumerate();
            differ.extend(pairs.filter(|(_, (a, b))| a != b).map(|(state, _)| state as u32));
        }
        Meeting { differ, written: ways.iter().map(|way| !way.unsure).collect() }
    }

    /// How many ways met.
    pub(super) fn ways(&self) -> usize {
        self.written.len()
    }
}

/// Adds what goes wrong on single ways and was left open where they had met; `begin` gives a flow that was not followed yet.
pub(super) fn add_findings<'l, 'a>(flow: &mut Interpreter<'l, 'a>, begin: &impl Fn() -> Interpreter<'l, 'a>) {
    let open = std::mem::take(&mut flow.ways.open);
    if open.is_empty() || flow.findings.iter().any(Finding::is_error) {
        return;
    }
    let told = |o: &&Open, number: usize| {
        let meeting = &flow.ways.met[number];
        (o.meetings.saturating_sub(NEAR)..o.meetings).contains(&number) && !meeting.differ.is_disjoint(&o.states)
    };
    let numbers: Vec<usize> =
        (0..flow.ways.met.len()).rev().filter(|n| open.iter().any(|o| told(&o, *n))).take(MOST_MEETINGS).collect();
    let places: BTreeSet<Place> = open.iter().map(|o| o.place).collect();
    let mut left = MOST_STEPS;
    for number in numbers {
        let meeting = flow.ways.met[number].clone();
        for way in (0..meeting.ways()).filter(|way| meeting.written[*way]) {
            if left < flow.steps {
                return;
            }
            left -= flow.steps;
            let mut one = begin();
            one.notes = None;
            one.ways.follow_alone(&flow.ways, number, way);
            one.swap_known(flow);
            one.follow();
            one.swap_known(flow);
            let new = one.findings.into_iter().filter(|f| f.is_error() && places.contains(&f.place()));
            for finding in new {
                if !flow.findings.iter().any(|f| f.is_like(&finding)) {
                    flow.findings.push(finding.on_some_ways());
                }
            }
        }
    }
}

impl Interpreter<'_, '_> {
    /// Notes that a condition may fail at the statement that is followed now, as far as bounds tell.
    pub(super) fn leaves_open(&mut self, node: NodeId, place: Place) {
        if self.quiet > 0
            || self.doubt > 0
            || self.ways.is_alone()
            || self.ways.meetings() == 0
            || !self.jobs.is_empty()
        {
            return;
        }
        let states = self.parts(node).states.iter().copied().collect();
        let meetings = self.ways.meetings();
        if !self.ways.open.iter().any(|o| o.place == place) {
            self.ways.open.push(Open { place, meetings, states });
        }
    }
}
