//! What each mixture holds while the plan is followed: every species that got there, how concentrated, and on which way.

use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;

use matterix_ir::Span;
use matterix_ir::model::{Action, Kept, Stays};
use matterix_ir::pages::Pages;
use matterix_ir::scene::InstanceId;

use super::evaluator::NodeEvaluator;
use crate::declare::SpeciesId;
use crate::declare::compatibility::Presence;

/// A way that a species took into a mixture.
#[derive(Clone, Debug, PartialEq)]
pub struct Came {
    /// The holding line, or the step of a transfer.
    pub span: Span,
    /// The mixture it got into there.
    pub into: InstanceId,
}

/// A species in a mixture.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// mol per kg of mixture as it is now (kg per kg where counted by mass), not more than this; absent if not known.
    pub content: Option<f64>,
    /// There whatever way the plan takes.
    pub certain: bool,
    /// What is left on the walls of something emptied.
    pub residue: bool,
    /// The places in the text that brought it, first to last.
    pub came: Vec<Came>,
}

/// What a mixture holds; shared between points of the plan as long as it stays the same.
pub type Contents = Rc<BTreeMap<SpeciesId, Entry>>;

/// What two mixtures held before a transfer.
pub struct Before {
    /// Where it comes from.
    pub source: Contents,
    /// Where it goes.
    pub target: Contents,
}

/// A transfer of less is what rounding leaves, kg.
const SPECK: f64 = 1e-10;

/// The longest history that is kept of one species in one mixture.
const HISTORY: usize = 4;

/// The state of the lab at one point of the plan, without the work of time: nothing warms up or reacts.
#[derive(Clone, Debug)]
pub struct MixtureState {
    /// By instance; nothing where it is no mixture.
    pub mixtures: Pages<Contents>,
    /// By state index; not a number where it is not known.
    pub states: Pages<f64>,
    /// By the index of kept values; not a number where it is not known.
    pub locals: Vec<f64>,
    /// The share of its source that the transfer takes which is looked at; not a number beside transfers.
    pub share: f64,
    /// The step that last assigned a state, by its index.
    set: Pages<Option<Span>>,
    /// States changed since they were last asked for.
    changed: BTreeSet<u32>,
    /// Pairs that have met on every way to this point, by the mixture.
    pub met: BTreeSet<(InstanceId, SpeciesId, SpeciesId)>,
}

impl MixtureState {
    /// Where the plan begins: what everything holds.
    pub fn initial(eyes: &NodeEvaluator<'_, '_>, locals: usize) -> MixtureState {
        let lab = eyes.lab;
        let mut world = MixtureState {
            mixtures: vec![Contents::default(); lab.instances.len()].into_iter().collect(),
            states: lab.states.iter().map(|_| f64::NAN).collect(),
            locals: vec![f64::NAN; locals],
            share: f64::NAN,
            set: lab.states.iter().map(|_| None).collect(),
            changed: (0..lab.states.len() as u32).collect(),
            met: BTreeSet::new(),
        };
        // Initial values depend on parameters only.
        for (i, state) in lab.states.iter().enumerate() {
            world.states[i] = eyes.value(state.initial, &world);
        }
        for &m in &lab.mixtures {
            let instance = &lab.instances[m.0 as usize];
            let mut entries = BTreeMap::new();
            for (s, amount) in &instance.contents {
                let amount = eyes.value(*amount, &world);
                if amount == 0.0 {
                    continue;
                }
                let owner = instance.owner.map_or("", |o| lab.instances[o.0 as usize].name.as_str());
                let at = |name: &str| lab.held_at.get(&(name.to_string(), *s)).copied();
                let span = at(&instance.name).or_else(|| at(owner)).unwrap_or(instance.span);
                let came = vec![Came { span, into: m }];
                entries.insert(*s, Entry { content: None, certain: true, residue: false, came });
            }
            world.mixtures[m.0 as usize] = Rc::new(entries);
        }
        for &m in &lab.mixtures {
            world.weigh(eyes, m);
        }
        world
    }

    /// What two mixtures hold now.
    pub fn before(&self, from: InstanceId, to: InstanceId) -> Before {
        Before { source: self.held(from).clone(), target: self.held(to).clone() }
    }

    /// What is in a mixture, as the screen asks for it.
    pub fn present(&self, m: InstanceId) -> impl Iterator<Item = (Presence, &Entry)> {
        self.held(m).iter().map(|(s, e)| ((*s, e.content), e))
    }

    /// What is in a mixture.
    pub fn held(&self, m: InstanceId) -> &Contents {
        &self.mixtures[m.0 as usize]
    }

    /// Brings the contents of a mixture up to date with the amounts, where these are known.
    fn weigh(&mut self, eyes: &NodeEvaluator<'_, '_>, m: InstanceId) {
        let mass = eyes.mass(m, self);
        if mass.is_nan() || mass <= 0.0 {
            return;
        }
        let entries = Rc::make_mut(&mut self.mixtures[m.0 as usize]);
        for (s, state) in eyes.amounts.get(&m).map_or(&[][..], Vec::as_slice) {
            if let Some(entry) = entries.get_mut(s) {
                let content = self.states[*state as usize] / mass;
                // Made on the way: known as a bound, not as an amount.
                if content > 0.0 || entry.residue {
                    entry.content = Some(content);
                }
            }
        }
    }

    /// Takes over values of states that are known again, with what they are amounts of in these mixtures.
    pub fn settle_at(
        &mut self,
        eyes: &NodeEvaluator<'_, '_>,
        values: &[(u32, f64)],
        mixtures: impl Iterator<Item = InstanceId>,
    ) {
        for (state, value) in values {
            self.states[*state as usize] = *value;
            self.changed.insert(*state);
        }
        mixtures.for_each(|m| self.weigh(eyes, m));
    }

    /// The states changed since this was last asked.
    pub fn take_changed(&mut self) -> BTreeSet<u32> {
        std::mem::take(&mut self.changed)
    }

    /// The step that last assigned a state.
    pub fn set_at(&self, state: u32) -> Option<Span> {
        self.set[state as usize]
    }

    /// Keeps a value.
    pub fn keep(&mut self, local: u32, value: f64) {
        if let Some(slot) = self.locals.get_mut(local as usize) {
            *slot = value;
        }
    }

    /// An action of an operation: assignments change states, transfers take a share of everything.
    pub fn act(&mut self, eyes: &NodeEvaluator<'_, '_>, action: &Action, step: Span) {
        match action {
            Action::Assign { state, value, .. } => {
                let value = eyes.value(*value, self);
                // Lineage that ends says that the walls were rinsed.
                if value == 0.0
                    && self.states[*state as usize] == 1.0
                    && let Some(m) = eyes.lineage.get(state)
                    && self.held(*m).values().any(|e| e.residue)
                {
                    Rc::make_mut(&mut self.mixtures[m.0 as usize]).retain(|_, e| !e.residue);
                }
                self.states[*state as usize] = value;
                self.set[*state as usize] = Some(step);
                self.changed.insert(*state);
            }
            Action::Move { fraction, but, from, to, .. } => {
                let share = eyes.value(*fraction, self);
                let mixtures = &eyes.lab.mixtures;
                let (Some(&from), Some(&to)) = (mixtures.get(*from as usize), mixtures.get(*to as usize)) else {
                    return;
                };
                if share == 0.0 || from == to {
                    return;
                }
                self.transfer(eyes, (share, but), from, to, step, true);
            }
        }
    }

    /// Takes a share, which may be not a number, from one mixture into another.
    pub fn transfer(
        &mut self,
        eyes: &NodeEvaluator<'_, '_>,
        (share, but): (f64, &[Kept]),
        from: InstanceId,
        to: InstanceId,
        step: Span,
        certain: bool,
    ) {
        let moved = share * eyes.mass(from, self);
        let known = share > 0.0 && share <= 1.0 + 1e-9;
        let share = if known { share.min(1.0) } else { f64::NAN };
        let kept: Vec<(Kept, f64)> = but.iter().map(|k| (*k, eyes.value(k.stays.source(), self))).collect();
        for (a, b) in eyes.passage(from, to).iter() {
            let there = self.states[*a as usize];
            if there == 0.0 {
                continue;
            }
            let stays = kept.iter().find(|(k, _)| k.state == *a).map_or(0.0, |(k, value)| k.stays.of(there, *value));
            let moves = share * (there - stays);
            if let Some(b) = b {
                self.states[*b as usize] += moves;
            }
            self.states[*a as usize] = there - moves;
            self.changed.insert(*a);
            self.changed.extend(b);
        }
        // Of these species some stays whatever is taken, and of those with a share of 1 all does.
        let staying: BTreeMap<SpeciesId, f64> = eyes
            .amounts(from)
            .iter()
            .filter_map(|(s, state)| {
                let (kept, value) = kept.iter().find(|(k, _)| k.state == *state)?;
                matches!(kept.stays, Stays::Share(_)).then_some((*s, *value)).filter(|(_, value)| *value != 0.0)
            })
            .collect();
        if moved < SPECK {
            return;
        }
        let source = self.held(from).clone();
        let emptied = share >= 1.0 - 1e-9;
        if emptied {
            let left = Rc::make_mut(&mut self.mixtures[from.0 as usize]);
            left.iter_mut().filter(|(s, _)| !staying.contains_key(s)).for_each(|(_, e)| e.residue = true);
        }
        let target = Rc::make_mut(&mut self.mixtures[to.0 as usize]);
        for (s, entry) in source.iter() {
            // What stuck to the walls of the source is not worth a history of its own.
            if entry.residue || staying.get(s).is_some_and(|stays| *stays >= 1.0) {
                continue;
            }
            let mut came = entry.came.clone();
            if came.len() < HISTORY && came.last().is_none_or(|c| c.span != step || c.into != to) {
                came.push(Came { span: step, into: to });
            }
            let arrived = Entry { came, certain: entry.certain && certain, residue: false, content: entry.content };
            match target.get_mut(s) {
                None => {
                    target.insert(*s, arrived);
                }
                Some(there) => {
                    there.content = greater(there.content, arrived.content);
                    there.certain |= arrived.certain;
                    if there.residue {
                        there.came = arrived.came;
                        there.residue = false;
                    }
                }
            }
        }
        self.weigh(eyes, to);
    }

    /// What may be there after either of two ways.
    pub fn join(mut self, other: MixtureState) -> MixtureState {
        self.states.merge(&other.states, |value, o| {
            if *value != *o {
                *value = f64::NAN;
            }
        });
        for (value, o) in self.locals.iter_mut().zip(&other.locals) {
            if *value != *o {
                *value = f64::NAN;
            }
        }
        self.changed.extend(other.changed);
        self.met.retain(|pair| other.met.contains(pair));
        self.set.merge(&other.set, |set, o| *set = o.or(*set));
        self.mixtures.merge(&other.mixtures, |mine, entries| {
            if Rc::ptr_eq(mine, entries) {
                return;
            }
            let mine = Rc::make_mut(mine);
            for (s, entry) in mine.iter_mut() {
                entry.certain &= entries.get(s).is_some_and(|e| e.certain);
            }
            for (s, entry) in entries.iter() {
                match mine.get_mut(s) {
                    Some(there) => {
                        there.content = greater(there.content, entry.content);
                        there.residue &= entry.residue;
                    }
                    None => {
                        mine.insert(*s, Entry { certain: false, ..entry.clone() });
                    }
                }
            }
        });
        self
    }
}

impl MixtureState {
    /// Whether another one holds the same species everywhere, knows the same values, and has met the same pairs.
    pub fn is_like(&self, other: &MixtureState) -> bool {
        let same = |a: f64, b: f64| a == b || (a.is_nan() && b.is_nan());
        let held = |(a, b): (&Contents, &Contents)| {
            Rc::ptr_eq(a, b)
                || (a.len() == b.len()
                    && a.iter()
                        .zip(b.iter())
                        .all(|((s, x), (t, y))| s == t && x.residue == y.residue && x.certain == y.certain))
        };
        self.met == other.met
            && self.states.iter().zip(other.states.iter()).all(|(a, b)| same(*a, *b))
            && self.locals.iter().zip(&other.locals).all(|(a, b)| same(*a, *b))
            && self.mixtures.iter().zip(other.mixtures.iter()).all(held)
    }
}

/// The greater bound; none if one of them is not known.
fn greater(a: Option<f64>, b: Option<f64>) -> Option<f64> {
    a.zip(b).map(|(a, b)| a.max(b))
}
