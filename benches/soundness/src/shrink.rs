//! Makes a plan about which there is a disagreement as small as it gets.

use crate::plan::{Block, Kind, Plan};

/// Trials, at most.
const TRIALS: usize = 400;

/// Takes statements out, and blocks apart, as long as `still` says that the disagreement is there.
pub fn shrink(plan: &Plan, still: &mut dyn FnMut(&Plan) -> bool) -> Plan {
    let mut best = plan.clone();
    let mut trials = 0;
    let mut at = 0;
    while trials < TRIALS {
        let Some(smaller) = candidate(&best, at) else { break };
        trials += 1;
        match still(&smaller) {
            // What stands there now is tried next.
            true => best = smaller,
            false => at += 1,
        }
    }
    best
}

/// The plan with the change of this number; none behind the last.
fn candidate(plan: &Plan, number: usize) -> Option<Plan> {
    let mut changed = plan.clone();
    let mut left = number;
    let done = change(&mut changed.body, &mut left) || change(&mut changed.finally, &mut left);
    if done {
        return Some(changed);
    }
    // Things nothing names any more.
    let lab = &mut changed.lab;
    match left {
        0 if !lab.ovens.is_empty() && !names(plan, "o") => lab.ovens.clear(),
        1 if lab.tokens > 0 => lab.tokens = 0,
        2 if lab.dials > 0 => lab.dials -= 1,
        3 if lab.cups.len() > 1 && !names_cup(plan, lab.cups.len() - 1) => drop(lab.cups.pop()),
        4..=9 => {
            let cup = lab.cups.get_mut(left - 4)?;
            cup.holds = None;
        }
        0..=3 => {}
        _ => return None,
    }
    Some(changed)
}

/// Whether a statement uses a device with a lid.
fn names(plan: &Plan, kind: &str) -> bool {
    let text = crate::print::print(std::slice::from_ref(plan)).text;
    let workflow = text.split("workflow flow0").nth(1).unwrap_or_default();
    (0..9).any(|i| workflow.contains(&format!("{kind}{i}")))
}

/// Whether the workflow uses a vessel.
fn names_cup(plan: &Plan, cup: usize) -> bool {
    let text = crate::print::print(std::slice::from_ref(plan)).text;
    let workflow = text.split("workflow flow0").nth(1).unwrap_or_default();
    workflow.contains(&format!("c{cup}")) || workflow.contains(&format!("[{}]", crate::print::well(cup)))
}

/// Makes the change with this number in a block, or counts down by how many it has.
fn change(block: &mut Block, left: &mut usize) -> bool {
    let mut i = 0;
    while i < block.len() {
        if take(left) {
            block.remove(i);
            return true;
        }
        let inner: Vec<Block> = block[i].kind.blocks().into_iter().cloned().collect();
        for part in inner {
            if take(left) {
                block.splice(i..=i, part);
                return true;
            }
        }
        if simpler(&mut block[i].kind, left) {
            return true;
        }
        for part in block[i].kind.blocks_mut() {
            if change(part, left) {
                return true;
            }
        }
        i += 1;
    }
    false
}

fn simpler(kind: &mut Kind, left: &mut usize) -> bool {
    match kind {
        Kind::Repeat(n, _) | Kind::While(_, n, _) if *n > 1 && take(left) => *n -= 1,
        Kind::Claim(things, _) if things.len() > 1 && take(left) => drop(things.pop()),
        Kind::Until(_, _, handler @ Some(_)) if take(left) => *handler = None,
        Kind::Parallel(branches) if branches.len() > 2 && take(left) => drop(branches.pop()),
        _ => return false,
    }
    true
}

fn take(left: &mut usize) -> bool {
    match left.checked_sub(1) {
        None => true,
        Some(less) => {
            *left = less;
            false
        }
    }
}
