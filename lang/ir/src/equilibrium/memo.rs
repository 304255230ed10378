//! The last solutions of this thread: the numbers of one mixture are asked for one after the other.

use std::cell::RefCell;
use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;

use super::basis::Basis;
use super::slopes::Slopes;
use super::solve::{self, Solution};
use super::{Interaction, System, Written};

/// Solutions are kept in so many groups, by a hash of the system and the arguments. What is kept changes no result.
const GROUPS: usize = 64;

/// So many are kept in each, those asked for last: an integrator asks for a few again and again, of which two may share a group.
const KEPT: usize = 4;

/// So many bases are kept.
const BASES_KEPT: usize = 1024;

/// A system, the solids that are there, and what they replace.
type Held = (u64, Vec<usize>, Vec<usize>);

struct Entry {
    system: u64,
    args: Vec<f64>,
    solution: Option<Solution>,
    slopes: Slopes,
}

thread_local! {
    static BASES: RefCell<BTreeMap<Held, Option<Arc<Basis>>>> = const { RefCell::new(BTreeMap::new()) };
    static LAST: RefCell<Vec<VecDeque<Entry>>> = const { RefCell::new(Vec::new()) };
}

/// Numbers mixed into one.
pub(super) fn mixed(seed: u64, words: impl Iterator<Item = u64>) -> u64 {
    words.fold(seed, |hash, word| {
        let product = u128::from(hash.rotate_left(5) ^ word) * 0x9e37_79b9_7f4a_7c15;
        (product >> 64) as u64 ^ product as u64
    })
}

/// What tells one system from others.
pub(super) fn fingerprint(written: &Written) -> u64 {
    let text = |text: &str| mixed(7, text.bytes().map(u64::from));
    let members = written.members.iter().flat_map(|m| [text(&m.name), m.phase as u64, m.charge.to_bits()]);
    let equations = written
        .equations
        .iter()
        .flat_map(|e| [text(&e.name)].into_iter().chain(e.coefficients.iter().map(|c| c.to_bits())));
    let interactions = written.interactions.iter().flat_map(|all| {
        let of = |i: &Interaction| {
            i.members.iter().map(|m| *m as u64).chain(i.reach.iter().map(|r| r.to_bits())).collect::<Vec<u64>>()
        };
        [all.spread.to_bits()].into_iter().chain(all.each.iter().flat_map(of))
    });
    mixed(written.solvent_mass.to_bits(), members.chain(equations).chain(interactions))
}

/// The basis of a system where some solids are there; none where these can become each other.
pub(super) fn basis(system: &System, held: &[usize], replaced: &[usize]) -> Option<Arc<Basis>> {
    if held.is_empty() {
        return Some(system.basis.clone());
    }
    BASES.with_borrow_mut(|bases| {
        if bases.len() > BASES_KEPT {
            bases.clear();
        }
        let make = || {
            let mut pairs = held.iter().zip(replaced);
            let basis = pairs.try_fold(Basis::clone(&system.basis), |basis, (solid, by)| basis.with(*solid, *by));
            basis.filter(|basis| basis.held.len() == held.len()).map(Arc::new)
        };
        bases.entry((system.fingerprint, held.to_vec(), replaced.to_vec())).or_insert_with(make).clone()
    })
}

fn entry<R>(system: &System, args: &[f64], work: impl FnOnce(&mut Entry) -> R) -> R {
    let group = mixed(system.fingerprint, args.iter().map(|a| a.to_bits())) as usize % GROUPS;
    LAST.with_borrow_mut(|groups| {
        groups.resize_with(GROUPS, VecDeque::new);
        let group = &mut groups[group];
        let is_same = |(a, b): (&f64, &f64)| a.to_bits() == b.to_bits();
        let agrees = |known: &Entry| known.args.len() == args.len() && known.args.iter().zip(args).all(is_same);
        let place = group.iter().position(|known| known.system == system.fingerprint && agrees(known));
        let known = place.and_then(|place| group.remove(place)).unwrap_or_else(|| Entry {
            system: system.fingerprint,
            args: args.to_vec(),
            solution: solve::solve(system, args),
            slopes: Slopes::default(),
        });
        group.push_front(known);
        group.truncate(KEPT);
        work(&mut group[0])
    })
}

/// Does something with the solution for these arguments.
pub(super) fn with<R>(system: &System, args: &[f64], work: impl FnOnce(Option<&Solution>) -> R) -> R {
    entry(system, args, |known| work(known.solution.as_ref()))
}

/// The same with its slopes.
pub(super) fn with_slopes<R>(
    system: &System,
    args: &[f64],
    work: impl FnOnce(Option<(&Solution, &mut Slopes)>) -> R,
) -> R {
    entry(system, args, |known| work(known.solution.as_ref().map(|solution| (solution, &mut known.slopes))))
}
