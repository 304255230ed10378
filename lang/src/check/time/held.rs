//! R1: what a `claim` holds while a step outside of any `claim` uses it. Such a step fails from the moment the block has what it claims
//! until its end; one that began before makes the block wait instead.

use std::collections::{BTreeMap, BTreeSet};

use matterix_ir::plan::{Step, StepId};
use matterix_ir::scene::InstanceId;
use matterix_ir::{Diagnostic, Severity, codes};
use matterix_timing::usage::{self, Use};
use matterix_timing::{ROUNDING, Visit};

use super::twice::independent;
use super::{Times, expected, show};

/// Blocks that claim, each with each of its instances.
pub(super) fn holds(times: &Times<'_>) -> Vec<Use> {
    let steps = (0..times.plan.steps.len() as u32).map(StepId);
    let blocks = steps.filter_map(|step| match &times.plan.get(step).step {
        Step::Claim { claims, .. } if times.timing.visit(step).is_some_and(|v| !v.aside) => Some((step, claims)),
        _ => None,
    });
    blocks.flat_map(|(step, claims)| claims.iter().map(move |&instance| Use { instance, step })).collect()
}

/// Whether a use is a block that claims.
pub(super) fn is_hold(times: &Times<'_>, used: &Use) -> bool {
    matches!(times.plan.get(used.step).step, Step::Claim { .. })
}

/// Pairs of blocks that are compared at most in one round; beyond, all wait that claim what others claim.
const MOST_PAIRS: usize = 20_000;

/// Blocks that may have to wait for a step which uses what they claim without a `claim` of its own, or for another block.
pub(super) fn waiting(times: &Times<'_>) -> BTreeSet<StepId> {
    let holds = holds(times);
    let mut out = if holds.is_empty() { BTreeSet::new() } else { delayed_by_uses(times, &holds) };
    let mut left = MOST_PAIRS;
    for blocks in shared(times).values() {
        for (i, &a) in blocks.iter().enumerate() {
            for &b in &blocks[..i] {
                if left == 0 {
                    return contended(times);
                }
                left -= 1;
                let known = out.contains(&a) && out.contains(&b);
                if !known && times.beside(a, b) && !times.before(a, b) && !times.before(b, a) {
                    out.extend([a, b]);
                }
            }
        }
    }
    out
}

/// Blocks that claim what another one claims.
pub(super) fn contended(times: &Times<'_>) -> BTreeSet<StepId> {
    shared(times).into_values().flatten().collect()
}

/// Blocks by what they claim, where several claim it and not all of them are in one line of steps.
fn shared(times: &Times<'_>) -> BTreeMap<InstanceId, Vec<StepId>> {
    let mut blocks: BTreeMap<InstanceId, Vec<StepId>> = BTreeMap::new();
    for step in (0..times.plan.steps.len() as u32).map(StepId) {
        if let (Step::Claim { claims, .. }, Some(_)) = (&times.plan.get(step).step, times.timing.visit(step)) {
            claims.iter().for_each(|instance| blocks.entry(*instance).or_default().push(step));
        }
    }
    let line = |step: &StepId| times.timing.visit(*step).map(|v| v.thread);
    blocks.retain(|_, all| all.iter().any(|step| line(step) != line(&all[0])));
    blocks
}

/// Blocks that may have to wait for a step without a `claim` of its own.
fn delayed_by_uses(times: &Times<'_>, holds: &[Use]) -> BTreeSet<StepId> {
    let mut uses: BTreeMap<InstanceId, Vec<Use>> = BTreeMap::new();
    for used in usage::uses(times.plan, &times.timing, &BTreeSet::new()) {
        uses.entry(used.instance).or_default().push(used);
    }
    let waits = |hold: &&Use| uses.get(&hold.instance).into_iter().flatten().any(|used| may_delay(times, hold, used));
    holds.iter().filter(waits).map(|hold| hold.step).collect()
}

fn may_delay(times: &Times<'_>, hold: &Use, used: &Use) -> bool {
    if claims(times, used) || !times.beside(hold.step, used.step) {
        return false;
    }
    let (Some(block), Some(step)) = (times.timing.visit(hold.step), times.timing.visit(used.step)) else {
        return false;
    };
    let begins_later = begins_after(times, block, step) || (step.start == block.start && step.order > block.order);
    // What is known of a block in a loop is known of its last turn.
    let in_turns = times.all_turns(hold.step, used.step) != hold.step;
    (in_turns || !begins_later) && !times.before(used.step, hold.step)
}

/// Whether a step stands in a block that claims what it uses, or that holds it.
fn claims(times: &Times<'_>, used: &Use) -> bool {
    times.timing.around(used.step).any(|s| match &times.plan.get(s).step {
        Step::Claim { claims, .. } => claims.contains(&used.instance),
        _ => false,
    })
}

/// Whether a step begins after a block has what it claims, in every run.
fn begins_after(times: &Times<'_>, block: &Visit, step: &Visit) -> bool {
    times.least(block.start, step.start, &[block.scope, step.scope]).is_some_and(|t| t > ROUNDING)
}

/// Whether a step uses what a block holds: certainly, perhaps, or (none) never.
pub(super) fn clash(times: &Times<'_>, hold: &Use, used: &Use) -> Option<bool> {
    if !times.beside(hold.step, used.step)
        || times.timing.around(used.step).any(|s| s == hold.step)
        || expected(times.plan, &times.timing, used.step, "claimed")
        || times.before(hold.step, used.step)
        || times.before(used.step, hold.step)
        || independent(times, hold.step, used.step)
    {
        return None;
    }
    let (block, step) = (times.timing.visit(hold.step)?, times.timing.visit(used.step)?);
    let begun = granted(times, hold.step)?;
    let scopes = [block.scope, step.scope];
    let after = |a, b| times.least(a, b, &scopes).is_some_and(|t| t > ROUNDING);
    let together = step.start == begun.start;
    // What begins before the block makes it wait, and what is over before its first turn never meets it.
    let turns = times.all_turns(used.step, hold.step) != used.step;
    let loops = times.all_turns(hold.step, used.step);
    if loops == hold.step {
        let sooner = after(step.start, block.start) || (step.start == block.start && step.order < block.order);
        if !turns && sooner {
            return None;
        }
    } else if sooner_than_turns(times, loops, block, step, turns) {
        return None;
    }
    // Of what is over at once, the moment counts.
    let moment = together && block.end == step.start;
    let within = moment || ((together || after(begun.start, step.start)) && after(step.start, block.end));
    Some(within && times.must_fail(used.step, "claimed") && times.must_fail(hold.step, "claimed"))
}

/// Whether a step begins before a block does so in the first turn of the loops around it, of which `loops` is the outermost; where the
/// step has turns of its own, whether it is over by then.
fn sooner_than_turns(times: &Times<'_>, loops: StepId, block: &Visit, step: &Visit, turns: bool) -> bool {
    let Some((first, turn)) = loop_and_turn(times, loops) else { return false };
    let scopes = [block.scope, step.scope];
    let into_turn = times.least(turn.start, block.start, &scopes).unwrap_or(0.0).max(0.0);
    let from = if turns { step.end } else { step.start };
    let before_loop = times.least(from, first.start, &scopes);
    before_loop.is_some_and(|t| t + into_turn > ROUNDING || (turns && t + into_turn > -ROUNDING))
}

/// A loop, and the body of its last turn.
fn loop_and_turn<'t>(times: &'t Times<'_>, loops: StepId) -> Option<(&'t Visit, &'t Visit)> {
    let (Step::Repeat { body, .. } | Step::RepeatWhile { body, .. }) = &times.plan.get(loops).step else { return None };
    Some((times.timing.visit(loops)?, times.timing.visit(*body)?))
}

/// The body of a block that claims: it begins when the block has what it claims.
fn granted<'t>(times: &'t Times<'_>, step: StepId) -> Option<&'t Visit> {
    match &times.plan.get(step).step {
        Step::Claim { body, .. } => times.timing.visit(*body),
        _ => None,
    }
}

/// The finding that a step uses what a block holds.
pub(super) fn finding(times: &Times<'_>, hold: &Use, used: &Use, sure: bool, name: &str) -> Diagnostic {
    let own = |u: &Use| times.plan.get(show::own(times.plan, &times.timing, u.step));
    let (block, step) = (own(hold), own(used));
    let may = if sure { "uses" } else { "may use" };
    let headline = format!("`{}` {may} `{name}` while another branch or job holds a claim on it", step.label);
    let mut d = Diagnostic::error(codes::CLAIMED_TWICE, step.span, headline, format!("uses `{name}`"))
        .because(block.span, format!("claims `{name}` until the end of this block"));
    if !sure {
        d.severity = Severity::Warning;
    }
    d.help(format!("put it into `claim {name} {{ }}` too, so that they take turns, or put both into one `sequence`"))
}
