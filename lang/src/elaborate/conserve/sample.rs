//! Points at which laws are tried out: the start of the run, and others near it.

use std::collections::BTreeMap;

use matterix_ir::model::{Action, Domain, Kept};
use matterix_ir::{NodeId, Op};

use crate::eval::lab::Elaborator;

/// How many points a law is tried at.
pub const POINTS: u64 = 12;

/// Times are drawn below this, s.
const LONGEST: f64 = 3600.0;

/// What is not there at the start is tried at up to so many times its scale or, without one, the unit that it is shown in.
const SPREAD: f64 = 1e4;

/// A state of the lab.
pub struct Point<'l, 'a> {
    lab: &'l Elaborator<'a>,
    number: u64,
    /// What actions have written.
    written: BTreeMap<u32, f64>,
}

impl<'l, 'a> Point<'l, 'a> {
    /// The first is the start of the run.
    pub fn new(lab: &'l Elaborator<'a>, number: u64) -> Self {
        Point { lab, number, written: BTreeMap::new() }
    }

    /// A value there; not a number where it depends on what only the run knows.
    pub fn value(&self, node: NodeId) -> f64 {
        self.lab.graph.eval_on(node, |leaf| match leaf {
            Op::Const(v) => v,
            Op::Time if self.number == 0 => 0.0,
            Op::Time => LONGEST * self.draw(u64::MAX),
            Op::State(state) => self.state(state),
            Op::Param(i) => self.lab.params[i as usize].value,
            Op::Reading(i) => self.value(self.lab.readings[i as usize].value),
            _ => f64::NAN,
        })
    }

    /// The value of a state.
    pub fn state(&self, state: u32) -> f64 {
        if let Some(value) = self.written.get(&state) {
            return *value;
        }
        let of = &self.lab.states[state as usize];
        let begins = self.lab.glance(of.initial).unwrap_or(f64::NAN);
        if self.number == 0 {
            return begins;
        }
        let drawn = self.draw(u64::from(state));
        match &of.domain {
            Domain::Instance => begins,
            Domain::Bool => f64::from(u8::from(drawn < 0.5)),
            Domain::Enum(words) => (drawn * words.len() as f64).floor(),
            Domain::Quantity(_) if begins != 0.0 => begins * (0.5 + drawn),
            Domain::Quantity(unit) => of.scale.unwrap_or(unit.factor) * SPREAD * drawn,
        }
    }

    /// Performs actions in their order; false where one of them cannot be known.
    pub fn perform(&mut self, actions: &[Action]) -> bool {
        for action in actions {
            match action {
                Action::Assign { state, value, .. } => {
                    let value = self.value(*value);
                    self.written.insert(*state, value);
                }
                Action::Move { fraction, but, from, to, .. } => {
                    let share = self.value(*fraction);
                    self.transfer(share, but, *from, *to);
                }
            }
        }
        self.written.values().all(|v| v.is_finite())
    }

    fn transfer(&mut self, share: f64, but: &[Kept], from: u32, to: u32) {
        let lab = self.lab;
        let ends = lab.mixtures.get(from as usize).zip(lab.mixtures.get(to as usize));
        let Some((from, to)) = ends.filter(|(a, b)| a != b) else { return };
        let stays: Vec<f64> =
            but.iter().map(|k| k.stays.of(self.state(k.state), self.value(k.stays.source()))).collect();
        for (key, source) in lab.extensive.iter().filter(|(k, _)| k.instance == *from) {
            let stays = but.iter().position(|k| k.state == *source).map_or(0.0, |i| stays[i]);
            let moved = share * (self.state(*source) - stays);
            self.written.insert(*source, self.state(*source) - moved);
            let there = crate::eval::lab::ExtensiveKey { instance: *to, ..key.clone() };
            if let Some(target) = lab.extensive.get(&there) {
                self.written.insert(*target, self.state(*target) + moved);
            }
        }
    }

    /// What actions have written, by state.
    pub fn written(&self) -> &BTreeMap<u32, f64> {
        &self.written
    }

    /// A number from 0 to 1 that follows from the point and what it is for (SplitMix64).
    fn draw(&self, what: u64) -> f64 {
        let mut z = (self.number << 32 ^ what).wrapping_add(0x9e37_79b9_7f4a_7c15);
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }
}
