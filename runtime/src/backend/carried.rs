//! What robots carry while time passes: how it may be moved, told whenever that changes, and what runs over as it is filled.

use std::collections::{BTreeMap, BTreeSet};

use matterix_ir::NodeId;
use matterix_ir::model::Load;
use matterix_ir::scene::InstanceId;

use crate::exec::Listener;
use crate::motion::{Burden, Stage};
use crate::process::{Engine, Observer};

/// While a vessel is carried, it is looked at so often, s: what fills it may do so evenly, in one long step.
const APART: f64 = 0.1;
/// The share by which a volume or what a grip bears changes before it is told again.
const NEAR: f64 = 1e-3;

/// The next time after one at which is looked, s: the same whatever else time stops for.
pub(super) fn edge_after(time: f64) -> f64 {
    let mut edge = ((time / APART).floor() + 1.0) * APART;
    while edge <= time {
        edge += APART;
    }
    edge
}

/// How what robots carry may be moved.
pub(super) fn carried<'m>(loads: &'m [Load], stage: &Stage<'_>) -> Vec<&'m Load> {
    loads.iter().filter(|load| stage.held_by(load.instance).is_some()).collect()
}

/// What has been told of what robots carry.
#[derive(Clone, Debug, Default)]
pub(super) struct Told {
    burdens: BTreeMap<InstanceId, Burden>,
    /// What runs over, and has been said to.
    over: BTreeSet<InstanceId>,
}

impl Told {
    /// Nothing more is said of what runs over of a vessel until it has been set upright.
    pub(super) fn hush(&mut self, vessel: InstanceId) {
        self.over.insert(vessel);
    }
}

/// A vessel in hand that runs over, and by how much, m3.
pub(super) type Overflow = (InstanceId, f64);

/// Looks at what robots carry, at all that another observer is shown.
pub(super) struct Attendant<'a, 'm> {
    pub(super) out: &'a mut dyn Listener,
    pub(super) stage: &'a Stage<'m>,
    /// How what is carried may be moved.
    pub(super) loads: Vec<&'m Load>,
    /// What pours, or is being set upright where it has poured: that may run out.
    pub(super) pouring: BTreeSet<InstanceId>,
    pub(super) told: &'a mut Told,
    pub(super) found: Option<Overflow>,
}

impl Attendant<'_, '_> {
    /// Tells what has changed, and notes the first that runs over.
    pub(super) fn look(&mut self, time: f64, engine: &Engine<'_>) {
        for load in &self.loads {
            let id = load.instance;
            let burden = Burden::of(load, |node: Option<NodeId>| node.map(|node| engine.eval(node)));
            let known = self.told.burdens.get(&id).copied().unwrap_or_default();
            if !known.is_near(&burden, NEAR) {
                self.told.burdens.insert(id, burden);
                self.out.burdened(time, id, burden);
            }
            let over = match burden.loose {
                Some(volume) if !self.pouring.contains(&id) => self.stage.runs_over(id, volume, time),
                _ => 0.0,
            };
            if over <= 0.0 {
                self.told.over.remove(&id);
            } else if self.told.over.insert(id) {
                self.found.get_or_insert((id, over));
            }
        }
    }
}

impl Observer for Attendant<'_, '_> {
    fn sample(&mut self, time: f64, engine: &Engine<'_>, changed: &[u32]) {
        self.out.sample(time, engine, changed);
        self.look(time, engine);
    }

    fn curve(&mut self, time: f64, engine: &Engine<'_>, changed: &[u32]) {
        self.out.curve(time, engine, changed);
    }

    fn leaves(&mut self, time: f64, engine: &Engine<'_>, states: &[u32]) {
        self.out.leaves(time, engine, states);
    }

    fn begun(&mut self, time: f64, engine: &Engine<'_>) {
        self.out.begun(time, engine);
    }

    fn event(&mut self, time: f64, event: usize) {
        self.out.event(time, event);
    }

    fn process(&mut self, time: f64, process: usize, running: bool) {
        self.out.process(time, process, running);
    }

    fn moved(&mut self, time: f64, from: u32, to: u32, fraction: f64) {
        self.out.moved(time, from, to, fraction);
    }

    fn stops(&self) -> bool {
        self.found.is_some() || self.out.stops()
    }
}
