//! After a discontinuity: what of the law it concerns is looked at anew, and what moves is taken apart there. All else goes on.

use std::collections::{BTreeMap, BTreeSet};

use matterix_ir::NodeId;

use super::analysis::{Analysis, Facts};
use super::course::Who;
use super::index::Root;
use super::integrator::{Integrator, STEP_SHARE};
use super::lookout::Lookout;
use super::mode::{Group, NOWHERE, PartsBelow, Piece, Together, Walk, groups, rested_on};
use super::part::Part;
use super::switch::{Switches, Unseen};
use super::tolerance::Tolerance;
use super::{Engine, Observer};
use crate::fault::Fault;

/// What has changed since the law was last looked at.
#[derive(Clone, Debug, Default)]
pub(super) struct Due {
    /// Leaves and comparisons that have changed.
    pub(super) seeds: Vec<NodeId>,
    /// Conditions of events that may have become true.
    pub(super) events: BTreeSet<u32>,
    /// Processes that may have begun or ceased to run.
    pub(super) processes: BTreeSet<u32>,
    pub(super) law: Concerned,
}

/// What of the law has to be looked at anew.
#[derive(Clone, Debug, Default)]
pub(super) struct Concerned {
    /// Roots that rest on what has changed.
    pub(super) roots: BTreeSet<u32>,
    /// Roots whose comparisons have to be looked out for anew.
    pub(super) sights: BTreeSet<u32>,
    /// Parts whose comparisons have to be looked out for anew.
    pub(super) parts: BTreeSet<u32>,
    /// Parts whose states were set from outside.
    pub(super) broken: BTreeSet<u32>,
}

impl Concerned {
    fn is_nothing(&self) -> bool {
        let Concerned { roots, sights, parts, broken } = self;
        roots.is_empty() && sights.is_empty() && parts.is_empty() && broken.is_empty()
    }
}

/// What has been looked at.
#[derive(Default)]
struct Region {
    roots: BTreeSet<u32>,
    /// States that have begun to move or come to rest.
    turned: BTreeSet<u32>,
}

impl Engine<'_> {
    /// Finds what rests on what has changed.
    pub(super) fn digest(&mut self) {
        let seeds = std::mem::take(&mut self.due.seeds);
        if seeds.is_empty() {
            return;
        }
        let roots = self.concern(&seeds);
        self.due.law.roots.extend(roots);
    }

    /// The roots above operations that have changed; what may happen by that is due.
    fn concern(&mut self, nodes: &[NodeId]) -> BTreeSet<u32> {
        let (due, limits, mut roots) = (&mut self.due, &mut self.limits.due, BTreeSet::new());
        self.index.above(nodes, &mut |_| {}, &mut |root, kind| {
            roots.insert(root);
            match kind {
                Root::Event(i) => due.events.extend([i]),
                Root::Guard(i) => due.processes.extend([i]),
                Root::Limit(i) => limits.extend([i]),
                Root::Rate(_) | Root::Attended | Root::Watch => {}
            }
        });
        roots
    }

    /// Looks at the law anew where a discontinuity concerns it. Parts whose law is still the same go on.
    pub(super) fn prepare(&mut self, observer: &mut dyn Observer) -> Result<(), Fault> {
        self.digest();
        if self.due.law.is_nothing() {
            return Ok(());
        }
        let mut concerned = std::mem::take(&mut self.due.law);
        let mut facts = std::mem::take(&mut self.facts);
        let region = self.look(&mut facts, &concerned.roots);
        let decided = region.roots.iter().try_for_each(|root| self.decided_at(*root));
        let done = decided.and_then(|()| self.rebuild(&facts, &mut concerned, &region, observer));
        self.facts = facts;
        done?;
        self.show(observer);
        Ok(())
    }

    /// Looks at these roots, at those that what is found there concerns, and at what begins to move or comes to rest by that.
    fn look(&mut self, facts: &mut Facts, roots: &BTreeSet<u32>) -> Region {
        facts.begin();
        let graph = &self.model.graph;
        let mut region = Region::default();
        let mut todo: BTreeSet<u32> = roots.clone();
        // States whose rates were looked at since they were last found to move or to rest.
        let mut doubted: BTreeSet<u32> = BTreeSet::new();
        loop {
            while !todo.is_empty() {
                let nodes = todo.iter().map(|root| self.index.root(*root).1);
                let flipped = facts.look(graph, nodes, |op| self.leaf(op), &self.moving);
                doubted.extend(todo.iter().filter_map(|root| match self.index.root(*root).0 {
                    Root::Rate(state) => Some(state),
                    _ => None,
                }));
                region.roots.append(&mut todo);
                todo = self.concern(&flipped);
                todo.retain(|root| !region.roots.contains(root));
            }
            let turned = self.turned(facts, &mut doubted);
            if turned.is_empty() {
                return region;
            }
            let mut leaves = Vec::new();
            for state in turned {
                self.moving[state as usize] ^= true;
                leaves.extend(self.index.leaves(state));
                region.turned.insert(state);
            }
            self.index.above(&leaves, &mut |node| facts.outdate(node), &mut |root, _| todo.extend([root]));
        }
    }

    /// The states that begin to move; where there are none any more, those that come to rest.
    fn turned(&self, facts: &Facts, doubted: &mut BTreeSet<u32>) -> Vec<u32> {
        let known = facts.of(&self.model.graph);
        let rate = |state: u32| self.index.rate_of(state).map(|root| self.index.root(root).1);
        let rests = |state: &u32| rate(*state).is_none_or(|rate| known.is_zero(rate));
        let begun: Vec<u32> = doubted.iter().copied().filter(|s| !self.moving[*s as usize] && !rests(s)).collect();
        if !begun.is_empty() {
            return begun;
        }
        let all = std::mem::take(doubted).into_iter();
        all.filter(|s| self.moving[*s as usize] && rests(s)).collect()
    }

    /// Takes what moves apart anew where its law is another one, and looks out for what may end it.
    fn rebuild(
        &mut self,
        facts: &Facts,
        concerned: &mut Concerned,
        region: &Region,
        observer: &mut dyn Observer,
    ) -> Result<(), Fault> {
        let known = facts.of(&self.model.graph);
        let pieces = self.pieces(facts, known, concerned, region);
        for part in concerned.broken.union(&concerned.parts) {
            let moving = self.course.parts.get(*part).map_or(&[][..], Part::moving);
            observer.leaves(self.time, self, moving);
        }
        for piece in self.retire(pieces, concerned) {
            let part = self.begin(piece)?;
            self.settle_in(part, concerned);
        }
        let altered = |root: &u32| facts.is_altered(self.index.root(*root).1);
        concerned.sights.extend(region.roots.iter().copied().filter(altered));
        let (mut lookouts, mut below) = (Vec::new(), PartsBelow::default());
        for root in std::mem::take(&mut concerned.sights) {
            lookouts.extend(self.sight((known, &mut below), root, concerned));
        }
        for &part in &concerned.parts {
            self.sight_of(known, part);
        }
        for &part in &concerned.parts {
            let stepped = self.course.enqueue_part(part);
            stepped.map_err(|stuck| self.stuck(stuck, part))?;
        }
        for id in lookouts {
            self.look_out(id)?;
        }
        Ok(())
    }

    /// What moves together now, of all that is concerned.
    fn pieces(&self, facts: &Facts, known: Analysis<'_>, concerned: &mut Concerned, region: &Region) -> Vec<Piece> {
        let part_of = &self.course.part_of;
        let rate = |state: u32| self.index.rate_of(state).map(|root| self.index.root(root).1);
        let mut together = Together::default();
        let mut todo: Vec<u32> = Vec::new();
        let mut affected = concerned.broken.clone();
        for root in &region.roots {
            if let (Root::Rate(state), node) = self.index.root(*root)
                && facts.is_altered(node)
                && self.moving[state as usize]
            {
                todo.push(state);
            }
        }
        affected.extend(todo.iter().chain(&region.turned).map(|s| part_of[*s as usize]).filter(|p| *p != NOWHERE));
        for part in &affected {
            todo.extend(self.course.parts.get(*part).into_iter().flat_map(|part| part.moving()));
        }
        todo.retain(|state| self.moving[*state as usize] && together.add(*state));
        let mut walk = Walk::default();
        while let Some(state) = todo.pop() {
            for other in rate(state).map(|rate| walk.from(known, rate)).unwrap_or_default() {
                if together.add(other) {
                    todo.push(other);
                    let part = part_of[other as usize];
                    if part != NOWHERE && affected.insert(part) {
                        let moving = self.course.parts.get(part).into_iter().flat_map(|part| part.moving());
                        todo.extend(moving.filter(|s| self.moving[**s as usize] && together.add(**s)));
                    }
                }
                together.join(state, other);
            }
        }
        concerned.broken = affected;
        let piece = |moving: Vec<u32>| {
            let rates: Vec<NodeId> = moving.iter().filter_map(|s| rate(*s)).collect();
            let rates = known.rates(&rates, &moving);
            Piece { moving, rates }
        };
        together.into_lists().into_iter().map(piece).collect()
    }

    /// Gives up the parts that do not go on; the pieces that have to be begun.
    fn retire(&mut self, pieces: Vec<Piece>, concerned: &mut Concerned) -> Vec<Piece> {
        let mut before: BTreeMap<u32, u32> = BTreeMap::new();
        for &id in &concerned.broken {
            before.extend(self.course.parts.get(id).and_then(|part| Some((*part.moving().first()?, id))));
        }
        let mut begun = Vec::new();
        for piece in pieces {
            let goes_on = |id: &u32| self.course.parts.get(*id).is_some_and(|part| part.goes_on(&piece));
            match piece.moving.first().and_then(|first| before.get(first).copied()).filter(goes_on) {
                Some(id) => {
                    before.remove(&piece.moving[0]);
                    concerned.parts.insert(id);
                }
                None => begun.push(piece),
            }
        }
        for id in before.into_values() {
            self.reach_now(id);
            let Some(part) = self.course.parts.remove(id) else { continue };
            self.course.queue.drop(Who::Part(id));
            part.leave(&mut self.sizes);
            part.moving().iter().for_each(|state| self.course.part_of[*state as usize] = NOWHERE);
            concerned.parts.remove(&id);
            for root in std::mem::take(self.course.noticing(id)) {
                concerned.sights.insert(root);
            }
        }
        begun
    }

    /// Begins to integrate a piece.
    fn begin(&mut self, piece: Piece) -> Result<Part, Fault> {
        let Piece { moving, rates } = piece;
        let values: Vec<f64> = moving.iter().map(|&s| self.states[s as usize]).collect();
        let mut registers = rates.registers();
        rates.run(self.time, &values, &mut registers);
        let broken = (0..values.len()).find(|&i| !registers[rates.outputs[i] as usize].is_finite());
        if let Some(i) = broken {
            return Err(self.no_rate(moving[i]));
        }
        let scale = |s: &u32| self.model.states[*s as usize].scale.filter(|s| s.is_normal()).map(f64::abs);
        let scales = moving.iter().map(scale).collect();
        let sizes: Vec<f64> = moving.iter().map(|s| self.sizes[*s as usize]).collect();
        let rtol = STEP_SHARE * self.options.rtol;
        let tolerance = Tolerance::new(rtol, scales, &sizes, &rates, self.time, &values);
        for (state, size) in moving.iter().zip(tolerance.sizes()) {
            self.sizes[*state as usize] = *size;
        }
        let scarce = self.scarce(&moving);
        Ok(Part::new(Integrator::new(rates, moving, self.time, &values, tolerance), scarce))
    }

    /// Gives a part its place.
    fn settle_in(&mut self, part: Part, concerned: &mut Concerned) {
        let moving = part.moving().to_vec();
        let id = self.course.add(part);
        let memo = self.memo.get_mut();
        for &state in &moving {
            self.course.part_of[state as usize] = id;
            memo.change_all(&self.index.users, self.index.leaves(state));
        }
        self.unshown.extend(moving);
        concerned.parts.insert(id);
    }

    /// Finds what a root looks out for. What a single part decides is left to that part, unless only the caller asks for it; for the
    /// rest there are lookouts, which are returned.
    fn sight(
        &mut self,
        (known, below): (Analysis<'_>, &mut PartsBelow),
        root: u32,
        concerned: &mut Concerned,
    ) -> Vec<u32> {
        let before = std::mem::take(self.course.sights(root));
        for part in before.parts {
            self.course.noticing(part).remove(&root);
            if self.course.parts.get(part).is_some() {
                concerned.parts.insert(part);
            }
        }
        before.lookouts.into_iter().for_each(|id| self.course.drop_lookout(id));
        let (kind, node) = self.index.root(root);
        if kind == Root::Watch && !self.watching.contains(&root) {
            return Vec::new();
        }
        if let (Root::Limit(i), true) = (kind, known.feels(node)) {
            self.limits.due.insert(i);
        }
        let found = groups(known, &known.switches([node]), &self.course.part_of, below);
        let mut sights = super::course::Sights::default();
        for (parts, nodes) in found {
            for &part in &parts {
                sights.parts.insert(part);
                self.course.noticing(part).insert(root);
            }
            match parts[..] {
                [part] if kind != Root::Watch => {
                    sights.own.extend(nodes.iter().map(|node| (part, *node)));
                    concerned.parts.insert(part);
                }
                _ => {
                    let group = Group { parts, states: rested_on(known, &nodes), nodes };
                    sights.lookouts.push(self.lookout(known, root, group));
                }
            }
        }
        let lookouts = sights.lookouts.clone();
        *self.course.sights(root) = sights;
        lookouts
    }

    fn lookout(&mut self, known: Analysis<'_>, root: u32, group: Group) -> u32 {
        let now = |node| self.eval(node);
        let switches = Switches::new(known, &group.nodes, &group.states, self.time, &now);
        let lookout = Lookout::new(root, group, switches, &self.course.parts, &self.course.part_of, self.time);
        self.course.lookouts.insert(lookout)
    }

    /// A part looks out for what it alone decides.
    fn sight_of(&mut self, known: Analysis<'_>, part: u32) {
        let nodes = self.course.own_of(part);
        let states = rested_on(known, &nodes);
        self.reach_now(part);
        let switches = Switches::new(known, &nodes, &states, self.time, &|node| self.eval(node));
        if let Some(part) = self.course.parts.get_mut(part) {
            part.look_out_for(switches, &states);
        }
    }

    /// A lookout looks on from now.
    pub(super) fn look_out(&mut self, id: u32) -> Result<(), Fault> {
        let Some(lookout) = self.course.lookouts.get_mut(id) else { return Ok(()) };
        let looked = lookout.look(&self.course.parts, self.time);
        looked.map_err(|Unseen(node)| self.restless(Some(node)))?;
        self.course.enqueue_lookout(id);
        Ok(())
    }

    /// A part is followed to the present time.
    pub(super) fn reach_now(&mut self, id: u32) {
        let Some(part) = self.course.parts.get_mut(id).filter(|part| !part.is_broken) else { return };
        part.reach_lab(self.time, &mut self.states);
        self.unshown.extend(part.moving());
    }
}
