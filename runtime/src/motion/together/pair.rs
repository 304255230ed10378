//! Two lines that run beside each other: whether their robots may meet, and what is said of it.

use std::cell::RefCell;
use std::collections::BTreeMap;

use matterix_ir::plan::StepId;
use matterix_ir::{Diagnostic, Program, Severity, Span, codes};
use matterix_motion::meet::Gap;
use matterix_timing::walk::Durations;
use matterix_timing::{Known, Point, ROUNDING, Timing};

use super::grid::Line;
use super::leg::Leg;

/// Overlaps less deep than this do not count: the balls of robots are larger than they are, m.
const DEEP: f64 = 2e-3;

/// When steps can be done.
pub struct Times {
    timing: Timing,
    least: RefCell<BTreeMap<Point, Vec<f64>>>,
}

impl Times {
    /// The times of a plan.
    pub fn of(program: &Program) -> Self {
        let model = &program.model;
        let params = model.params.iter().map(|p| p.value).collect();
        let (states, rates, events) = (&model.states, &model.derivatives, &model.events);
        let known = Known::new(&model.graph, params, states, rates, events, &program.plan);
        let timing = Timing::of(&program.plan, &known, Durations::Bounds);
        Times { timing, least: RefCell::default() }
    }

    /// Whether one step is over before the other begins, whatever the times of both are within their bounds.
    fn apart(&self, a: StepId, b: StepId) -> bool {
        let (Some(a), Some(b)) = (self.timing.visit(a), self.timing.visit(b)) else { return false };
        let after = |first: Point, second: Point| {
            let mut known = self.least.borrow_mut();
            let network = &self.timing.network;
            let least = known
                .entry(first)
                .or_insert_with(|| network.least_from(first, &[a.scope, b.scope]).unwrap_or_default());
            least.get(second.0 as usize).is_some_and(|t| t.is_finite() && *t >= -ROUNDING)
        };
        after(a.end, b.start) || after(b.end, a.start)
    }
}

/// The first motions of two lines that may be in one place at one time, and where.
pub fn may_meet<'l>(a: &'l Line, b: &'l Line, times: &Times) -> Option<(&'l Leg, &'l Leg, Gap)> {
    let pairs = a.legs.iter().flat_map(|one| b.legs.iter().map(move |other| (one, other)));
    let free = |one: &Leg, other: &Leg| !one.claims.iter().any(|c| other.claims.contains(c));
    pairs.into_iter().filter(|(one, other)| one.robot != other.robot && free(one, other)).find_map(|(one, other)| {
        let gap = one.crosses(other, DEEP)?;
        (!times.apart(one.step, other.step)).then_some((one, other, gap))
    })
}

/// What is said of two robots that may meet, or must.
pub fn finding(program: &Program, (a, b, gap): (&Leg, &Leg, Gap), must: bool) -> Diagnostic {
    let name = |leg: &Leg| &program.scene.get(leg.robot).name;
    let ((first, mine), (second, theirs)) = match a.site <= b.site {
        true => ((a, gap.links[0]), (b, gap.links[1])),
        false => ((b, gap.links[1]), (a, gap.links[0])),
    };
    let place = [gap.point.x, gap.point.y, gap.point.z].map(|v| v * 1e3);
    let place = format!("({:.0}, {:.0}, {:.0}) mm", place[0], place[1], place[2]);
    let part = |leg: &Leg, link: u32| format!("`{}` of `{}`", leg.name(link), name(leg));
    let label = |leg: &Leg| &program.plan.get(leg.step).label;
    let headline = match must {
        true => format!("`{}` and `{}` block each other in any order", name(first), name(second)),
        false => format!("`{}` and `{}` may meet at {place}", name(first), name(second)),
    };
    let here = format!("{} reaches {place} during `{}`", part(second, theirs), label(second));
    let there = format!("{} reaches the same place during `{}`", part(first, mine), label(first));
    let mut found = Diagnostic::error(codes::ROBOTS_MEET, second.site, headline, here);
    if first.site != second.site {
        found = found.because(first.site, there);
    }
    if must {
        return found.help("put them into one `sequence`, and move the first one away before the second one comes");
    }
    found.severity = Severity::Warning;
    let own = |span: Span| program.files.get(span.file.0 as usize).is_some_and(|f| !f.starts_with("std::"));
    let help = "during a run one waits for the other: `claim` one thing around both to let them take turns, or put them into one `sequence`";
    if own(first.site) { found.help(help) } else { found }
}
