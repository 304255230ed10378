//! Things that are in one another where a lab puts them: two vessels in one place, labware in the slot beside its own.
//!
//! True shapes decide: what stands in the hollow of something is not in it. What carries a thing, and what it is a part of,
//! are left out: how things fit there is no matter of places.

mod room;
mod solid;

use std::cmp::Ordering;

use matterix_ir::scene::{Instance, InstanceId, frame};
use matterix_ir::{Diagnostic, Program, Span, codes};

use super::stage::Stage;
use solid::{Solids, Touch};

/// What a lab puts into one another. Where joints stand differently later is no matter of this.
pub fn overlaps(program: &Program) -> Vec<Diagnostic> {
    let scene = &program.scene;
    // Two must have places for one to be in the other.
    if scene.instances.iter().filter(|i| i.owner.is_none() && i.placed).nth(1).is_none() {
        return Vec::new();
    }
    match Stage::new(program) {
        Ok(stage) => found(stage),
        // What cannot be moved is said elsewhere.
        Err(_) => Vec::new(),
    }
}

/// What is in one another where things stand when a run begins, those left out whose places the text leaves open.
pub fn found(mut stage: Stage<'_>) -> Vec<Diagnostic> {
    let ids = (0..stage.scene.instances.len() as u32).map(InstanceId);
    stage.unknown.places = ids.filter(|id| !stage.scene.get(*id).placed).collect();
    let stage = &stage;
    let solids = Solids::of(stage);
    let mut met: Vec<(InstanceId, InstanceId, Touch)> = Vec::new();
    for [a, b] in solids.pairs() {
        if may_meet(stage, a, b)
            && let Some(touch) = solids.meet(a, b)
        {
            met.push((a, b, touch));
        }
    }
    let all: Vec<[InstanceId; 2]> = met.iter().map(|(a, b, _)| [*a, *b]).collect();
    // What stands on something goes where that goes.
    let carried = |id: InstanceId, by: InstanceId| id == by || stage.carriers(id).contains(&by);
    met.retain(|(a, b, _)| {
        let follows = |[c, d]: &[InstanceId; 2]| {
            [*c, *d] != [*a, *b] && (carried(*a, *c) && carried(*b, *d) || carried(*a, *d) && carried(*b, *c))
        };
        !all.iter().any(follows)
    });
    met.into_iter().map(|(a, b, touch)| told(stage, &solids, a, b, &touch)).collect()
}

/// Whether two things have places of their own, told by the lab, so that they must not be in each other.
fn may_meet(stage: &Stage<'_>, a: InstanceId, b: InstanceId) -> bool {
    let carries = |below: InstanceId, id: InstanceId| stage.carriers(id).iter().any(|c| stage.whole(*c) == below);
    if carries(a, b) || carries(b, a) {
        return false;
    }
    // What stands somewhere on something is beside all that has a place there.
    let pair = [a, b].map(|id| stage.scene.get(id));
    let side_by_side = stage.below(a) == stage.below(b);
    if side_by_side && pair.iter().any(|i| i.at.is_none()) {
        return false;
    }
    // Tables and the like that stand in the lab itself may be drawn larger than they are: what they bear has places of its own.
    let moves = |i: &Instance| i.articulation.is_some() || i.frames.iter().any(|f| f.name == frame::GRASP);
    !(side_by_side && stage.below(a).is_none() && !pair.iter().any(|i| moves(i)))
}

/// The finding, at the line of the thing that is declared later.
fn told(stage: &Stage<'_>, solids: &Solids<'_, '_>, a: InstanceId, b: InstanceId, touch: &Touch) -> Diagnostic {
    let place = |id: InstanceId| stage.scene.get(id).span;
    let later = |x: Span, y: Span| (x.file.0, x.start).cmp(&(y.file.0, y.start));
    let (thing, other) = match later(place(a), place(b)) {
        Ordering::Greater => (a, b),
        _ => (b, a),
    };
    let [own, theirs] = [thing, other].map(|id| stage.scene.get(id));
    let [x, y, z] = touch.at.map(|m| m * 1e3 + 0.0);
    let depth = (touch.depth * 1e3).max(1.0);
    let headline = format!("`{}` and `{}` overlap", own.name, theirs.name);
    let label = format!("it is {depth:.0} mm inside `{}` at ({x:.0}, {y:.0}, {z:.0}) mm", theirs.name);
    let mut d = Diagnostic::error(codes::OVERLAP, own.at.unwrap_or(own.span), headline, label);
    if theirs.span != own.span {
        d = d.because(theirs.span, format!("`{}` is placed here", theirs.name));
    }
    match room::offer(stage, solids, thing) {
        Some(help) => d.help(help),
        None => d,
    }
}
