//! What moves, what is looked out for, and what comes next.

use std::collections::{BTreeMap, BTreeSet};

use matterix_ir::NodeId;
use rayon::iter::{IntoParallelRefMutIterator, ParallelIterator};

use super::lookout::Lookout;
use super::mode::NOWHERE;
use super::part::Part;

/// Steps of fewer parts are not worth other threads.
const MANY: usize = 8;

/// Things that keep their number as long as they are there.
#[derive(Clone)]
pub(super) struct Slab<T> {
    items: Vec<Option<T>>,
    free: BTreeSet<u32>,
}

impl<T> Default for Slab<T> {
    fn default() -> Self {
        Slab { items: Vec::new(), free: BTreeSet::new() }
    }
}

impl<T> Slab<T> {
    /// Gives the least number that is free.
    pub(super) fn insert(&mut self, item: T) -> u32 {
        match self.free.pop_first() {
            Some(id) => {
                self.items[id as usize] = Some(item);
                id
            }
            None => {
                self.items.push(Some(item));
                self.items.len() as u32 - 1
            }
        }
    }

    pub(super) fn remove(&mut self, id: u32) -> Option<T> {
        let item = self.items.get_mut(id as usize)?.take();
        if item.is_some() {
            self.free.insert(id);
        }
        item
    }

    pub(super) fn get(&self, id: u32) -> Option<&T> {
        self.items.get(id as usize)?.as_ref()
    }

    pub(super) fn get_mut(&mut self, id: u32) -> Option<&mut T> {
        self.items.get_mut(id as usize)?.as_mut()
    }

    /// Takes some out for as long as `work` has them.
    fn lend(&mut self, ids: &[u32], work: impl FnOnce(&mut [T])) {
        let at = |id: &u32| *id as usize;
        let mut lent: Vec<T> = ids.iter().filter_map(|id| self.items[at(id)].take()).collect();
        work(&mut lent);
        ids.iter().zip(lent).for_each(|(id, item)| self.items[at(id)] = Some(item));
    }

    /// The numbers that are taken, ascending.
    pub(super) fn ids(&self) -> Vec<u32> {
        (0..self.items.len() as u32).filter(|id| self.get(*id).is_some()).collect()
    }
}

/// Who ends a stretch in which nothing else happens. At one lab time the order is that of the variants.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Who {
    /// A lookout that finds something sooner than its only part ends, on the clock of that part: lab time may be too coarse to
    /// tell the two apart.
    Sooner(u32),
    Part(u32),
    Lookout(u32),
}

/// Things in the order of time.
#[derive(Clone, Default)]
pub(super) struct Queue {
    /// By the bits of the lab time, s, which stand in the order of times from 0 on.
    order: BTreeSet<(u64, Who)>,
    of: BTreeMap<Who, u64>,
}

impl Queue {
    /// `who` is due at `time`, s, and at no other; never, if that is infinite.
    pub(super) fn set(&mut self, who: Who, time: f64) {
        self.drop(who);
        if time < f64::INFINITY {
            let bits = time.max(0.0).to_bits();
            self.order.insert((bits, who));
            self.of.insert(who, bits);
        }
    }

    /// `who` is not due any more.
    pub(super) fn drop(&mut self, who: Who) {
        if let Some(bits) = self.of.remove(&who) {
            self.order.remove(&(bits, who));
        }
    }

    /// What is due first, and when, s.
    pub(super) fn first(&self) -> Option<(f64, Who)> {
        self.order.first().map(|(bits, who)| (f64::from_bits(*bits), *who))
    }

    /// All that is due until `time`, s, in order.
    pub(super) fn until(&self, time: f64) -> impl Iterator<Item = Who> {
        self.order.iter().take_while(move |(bits, _)| *bits <= time.to_bits()).map(|(_, who)| *who)
    }
}

/// What a root of the law looks out for.
#[derive(Clone, Default)]
pub(super) struct Sights {
    /// Comparisons that a single part decides, with the part.
    pub(super) own: Vec<(u32, NodeId)>,
    /// Lookouts for all others.
    pub(super) lookouts: Vec<u32>,
    /// The parts of both.
    pub(super) parts: BTreeSet<u32>,
}

/// What moves.
#[derive(Clone, Default)]
pub(super) struct Course {
    pub(super) parts: Slab<Part>,
    /// By state, the part that moves it, or [`NOWHERE`].
    pub(super) part_of: Vec<u32>,
    pub(super) lookouts: Slab<Lookout>,
    pub(super) queue: Queue,
    /// By root of the law.
    pub(super) sights: Vec<Sights>,
    /// By part, the roots that look out for something that rests on it.
    pub(super) noticing: Vec<BTreeSet<u32>>,
    /// Parts of which no step beyond the present one was taken when they were last looked at.
    short: BTreeSet<u32>,
    /// Whether the curves of steps are shown.
    curves: bool,
    /// Whether steps of many parts are taken on several threads.
    is_shared: bool,
}

impl Course {
    /// Of so many states, none of which moves.
    pub(super) fn new(states: usize, is_shared: bool, curves: bool) -> Self {
        Course { part_of: vec![NOWHERE; states], is_shared, curves, ..Course::default() }
    }

    /// Takes a part in.
    pub(super) fn add(&mut self, part: Part) -> u32 {
        let id = self.parts.insert(part);
        self.short.insert(id);
        id
    }

    /// The part that moves a state, if its solution stands.
    pub(super) fn mover(&self, state: u32) -> Option<&Part> {
        self.parts.get(*self.part_of.get(state as usize)?).filter(|part| !part.is_broken)
    }

    /// The part whose present step a state has followed, even if it was set from outside since.
    pub(super) fn followed(&self, state: u32) -> Option<&Part> {
        self.parts.get(*self.part_of.get(state as usize)?)
    }

    /// The roots that look out for something that rests on a part.
    pub(super) fn noticing(&mut self, part: u32) -> &mut BTreeSet<u32> {
        let at = part as usize;
        if self.noticing.len() <= at {
            self.noticing.resize_with(at + 1, BTreeSet::new);
        }
        &mut self.noticing[at]
    }

    /// What a root looks out for.
    pub(super) fn sights(&mut self, root: u32) -> &mut Sights {
        let at = root as usize;
        if self.sights.len() <= at {
            self.sights.resize_with(at + 1, Sights::default);
        }
        &mut self.sights[at]
    }

    /// The comparisons that a part alone decides, in order.
    pub(super) fn own_of(&mut self, part: u32) -> Vec<NodeId> {
        let roots = std::mem::take(self.noticing(part));
        let own = roots.iter().flat_map(|root| &self.sights[*root as usize].own);
        let mut own: Vec<NodeId> = own.filter(|(of, _)| *of == part).map(|(_, node)| *node).collect();
        *self.noticing(part) = roots;
        own.sort_unstable();
        own.dedup();
        own
    }

    /// The lookouts that rest on a part.
    pub(super) fn lookouts_on(&mut self, part: u32) -> Vec<u32> {
        let roots = std::mem::take(self.noticing(part));
        let all = roots.iter().flat_map(|root| self.sights[*root as usize].lookouts.iter().copied());
        let on = |id: &u32| self.lookouts.get(*id).is_some_and(|l| l.parts.contains(&part));
        let found = all.filter(on).collect();
        *self.noticing(part) = roots;
        found
    }

    /// A part goes on to its next step if it has come to the end of one, and is due where that ends.
    pub(super) fn enqueue_part(&mut self, id: u32) -> Result<(), super::integrator::Stuck> {
        self.run_short(id);
        let Some(part) = self.parts.get_mut(id) else { return Ok(()) };
        if part.step()? && self.curves {
            part.show_within();
        }
        if part.is_short() {
            self.short.insert(id);
        }
        let due = part.due();
        self.queue.set(Who::Part(id), due);
        for lookout in self.lookouts_on(id) {
            self.enqueue_lookout(lookout);
        }
        Ok(())
    }

    /// The curves of a part were shown within its step.
    pub(super) fn shown(&mut self, id: u32) {
        if let Some(part) = self.parts.get(id) {
            self.queue.set(Who::Part(id), part.due());
        }
    }

    /// Where a part has no more steps, many others may be about to have none: all of them take theirs at once. A step is the same
    /// whenever it is taken.
    fn run_short(&mut self, id: u32) {
        if !self.is_shared || self.short.len() < MANY || !self.parts.get(id).is_some_and(Part::is_short) {
            return;
        }
        let parts = &self.parts;
        self.short.retain(|other| parts.get(*other).is_some_and(Part::is_short));
        if self.short.len() < MANY {
            return;
        }
        let ids: Vec<u32> = std::mem::take(&mut self.short).into_iter().collect();
        self.parts.lend(&ids, |parts| parts.par_iter_mut().for_each(Part::run));
    }

    /// A lookout is due as far as it has looked.
    pub(super) fn enqueue_lookout(&mut self, id: u32) {
        let Some(lookout) = self.lookouts.get(id) else { return };
        let sooner = match (lookout.found, &lookout.parts[..]) {
            (Some((crossing, _)), [part]) => self.parts.get(*part).is_some_and(|part| crossing.time < part.limit()),
            _ => false,
        };
        let (who, other) =
            if sooner { (Who::Sooner(id), Who::Lookout(id)) } else { (Who::Lookout(id), Who::Sooner(id)) };
        let due = lookout.due();
        self.queue.drop(other);
        self.queue.set(who, due);
    }

    /// Takes a lookout out.
    pub(super) fn drop_lookout(&mut self, id: u32) {
        self.queue.drop(Who::Sooner(id));
        self.queue.drop(Who::Lookout(id));
        self.lookouts.remove(id);
    }
}
