//! Findings on some ways, way by way. Where ways meet, only what holds on all of them is known, and what hangs together is not told
//! apart any more: which tip was taken, and which is the next. So the plan is followed again for each of the ways that meet
//! shortly before such a finding; one that comes up on none of them is none.

use std::collections::BTreeSet;

use matterix_ir::Span;
use matterix_ir::plan::StepId;

use super::Interpreter;
use super::apart::{Meeting, Open};
use super::state::AbstractState;
use super::value::Imprecision;

/// So many meetings before a finding are looked at.
const NEAR: usize = 6;

/// So many meetings are looked at in all, the latest first.
const MOST_MEETINGS: usize = 16;

/// So many ways that meet are told apart.
pub(super) const MOST_WAYS: usize = 16;

/// So many steps are followed again in all.
const MOST_STEPS: usize = 400_000;

/// So often what was cleared away lets others come up that are looked at in turn.
const ROUNDS: usize = 12;

/// The statement that a finding is at, and what it is about.
pub(super) type Place = (Span, Span);

/// Ways that have met, and which of them is followed alone.
#[derive(Clone, Debug, Default)]
pub(super) struct Ways {
    /// What met, meeting by meeting.
    pub(super) met: Vec<Meeting>,
    /// What is open behind meetings.
    pub(super) open: Vec<Open>,
    /// A meeting, and the one of its ways that is followed.
    chosen: Option<(usize, usize)>,
    /// Findings that come up on none of the ways.
    cleared: BTreeSet<Place>,
}

impl Ways {
    /// The same for a plan that is followed again: what was cleared stays so.
    pub(super) fn again(self) -> Ways {
        Ways { cleared: self.cleared, ..Ways::default() }
    }

    /// Follows one way of a meeting alone, and finds nothing that `other` has cleared.
    pub(super) fn follow_alone(&mut self, other: &Ways, meeting: usize, way: usize) {
        self.cleared.clone_from(&other.cleared);
        self.chosen = Some((meeting, way));
    }

    /// Whether one way of a meeting is followed alone.
    pub(super) fn is_alone(&self) -> bool {
        self.chosen.is_some()
    }

    /// How many meetings there were by now.
    pub(super) fn meetings(&self) -> usize {
        self.met.len()
    }
}

/// Follows a plan until what is found is found on some way that leads there; `begin` gives one that was not followed yet.
pub(super) fn follow<'l, 'a>(begin: impl Fn() -> Interpreter<'l, 'a>) -> Interpreter<'l, 'a> {
    let mut flow = begin();
    flow.follow();
    let mut left = MOST_STEPS;
    for _ in 0..ROUNDS {
        let vain = in_vain(&flow, &begin, &mut left);
        if vain.is_empty() {
            break;
        }
        let mut again = begin();
        again.ways.cleared = flow.ways.cleared.union(&vain).copied().collect();
        again.follow();
        flow = again;
    }
    flow
}

/// The findings on some ways that come up on none of them, as far as the steps that are left lead.
fn in_vain<'l, 'a>(
    flow: &Interpreter<'l, 'a>,
    begin: &impl Fn() -> Interpreter<'l, 'a>,
    left: &mut usize,
) -> BTreeSet<Place> {
    let mut open: Vec<(Place, usize)> = flow.findings.iter().filter_map(|f| f.open_at()).collect();
    let mut out = BTreeSet::new();
    let before = |meetings: usize| meetings.saturating_sub(NEAR)..meetings;
    let meetings: BTreeSet<usize> = open.iter().flat_map(|(_, meetings)| before(*meetings)).collect();
    for number in meetings.into_iter().rev().take(MOST_MEETINGS) {
        let ways = flow.ways.met[number].ways();
        if open.iter().all(|(_, meetings)| *meetings <= number) || *left < ways * flow.steps {
            continue;
        }
        *left -= ways * flow.steps;
        let mut sites: BTreeSet<Span> = BTreeSet::new();
        for way in 0..ways {
            let mut one = begin();
            one.notes = None;
            one.ways.follow_alone(&flow.ways, number, way);
            one.follow();
            sites.extend(one.findings.iter().map(|f| f.place().0));
        }
        // What is found first at a statement may stand before the rest.
        let (made, vain): (Vec<_>, Vec<_>) =
            open.into_iter().partition(|((site, _), meetings)| *meetings <= number || sites.contains(site));
        out.extend(vain.into_iter().map(|(place, _)| place));
        open = made;
    }
    out
}

impl Interpreter<'_, '_> {
    /// Whether a finding on some ways at the statement that is followed now comes up on none of them.
    pub(super) fn is_cleared(&self, about: Span) -> bool {
        self.ways.cleared.contains(&(self.site(), about))
    }

    /// What is known after one of several ways from `base`.
    pub(super) fn meet(
        &mut self,
        id: StepId,
        base: &AbstractState,
        ways: impl IntoIterator<Item = AbstractState>,
    ) -> Option<AbstractState> {
        let mut ways: Vec<AbstractState> = ways.into_iter().collect();
        let differ = ways.windows(2).any(|two| two[0].states != two[1].states);
        if differ && let Some(way) = self.fork(id, &ways) {
            return Some(ways.swap_remove(way));
        }
        // In a loop a meeting is many: the ways of one turn are not those of the next.
        if differ && self.turning == 0 {
            let number = self.ways.met.len();
            self.ways.met.push(Meeting::of(&ways));
            if let Some((_, way)) = self.ways.chosen.filter(|(chosen, way)| *chosen == number && *way < ways.len()) {
                return Some(ways.swap_remove(way));
            }
        }
        let span = self.plan.get(id).span;
        let span = if self.in_library(span) { self.site() } else { span };
        ways.into_iter().reduce(|a, b| base.join(a, &b, span, Imprecision::Paths))
    }
}
