//! The loop over segments.

use std::collections::BTreeMap;

use matterix_ir::NodeId;
use matterix_ir::model::Drained;

use super::integrator::{Integrator, STEP_SHARE};
use super::lookout::Lookout;
use super::mode::{Piece, watched};
use super::part::{Ending, Part};
use super::switch::{Crossing, Unseen};
use super::tolerance::Tolerance;
use super::{Advance, Engine, Observer, Watch};
use crate::fault::Fault;

/// What moves within a segment, and what may end that.
#[derive(Default)]
pub(super) struct Course {
    parts: Vec<Part>,
    /// By state, the part that moves it.
    part_of: Vec<u32>,
    /// Comparisons of the model that no single part decides.
    across: Vec<Lookout>,
}

impl Course {
    /// A state was set from outside: what is known of the solution of its part is wrong. What its states were worth is kept in
    /// `sizes`.
    pub(super) fn wrote(&mut self, state: u32, sizes: &mut [f64]) {
        let part = self.part_of.get(state as usize).and_then(|part| self.parts.get_mut(*part as usize));
        if let Some(part) = part.filter(|part| !part.is_broken) {
            part.leave(sizes);
            part.is_broken = true;
        }
    }
}

/// How a segment was left.
enum Left {
    /// At the time asked for, or where the observer or somebody else stops.
    Target,
    /// Where a comparison of the time itself changes.
    Stop,
    /// Where a comparison changed.
    Crossed(Crossing),
}

/// Who ends a stretch in which nothing else happens.
#[derive(Clone, Copy)]
enum Next {
    Target,
    Part(usize),
    Lookout(usize),
}

impl Engine<'_> {
    /// Goes on to `until` (s, finite), or to the first instant at which a limit breaks or one of `watches` holds. Events that
    /// become true on the way fire. Fails where the solution cannot be followed.
    pub fn advance(&mut self, until: f64, watches: &[Watch], observer: &mut dyn Observer) -> Result<Advance, Fault> {
        let nodes: Vec<NodeId> = watches.iter().map(|w| w.node).collect();
        loop {
            let broken = self.newly_broken();
            if !broken.is_empty() {
                self.check_suspects()?;
                return Ok(Advance::Broken(broken));
            }
            let held: Vec<usize> =
                (0..watches.len()).filter(|&i| self.truth(watches[i].node) == watches[i].value).collect();
            if !held.is_empty() {
                self.check_suspects()?;
                return Ok(Advance::Watch(held));
            }
            if !(self.time < until && until.is_finite()) {
                self.check_suspects()?;
                return Ok(Advance::Reached);
            }
            if self.is_cancelled() {
                self.cancel = None;
                return Ok(Advance::Watch(Vec::new()));
            }
            self.release(observer);
            self.prepare()?;
            self.segment(until, &nodes, observer)?;
            if observer.stops() {
                self.check_suspects()?;
                return Ok(Advance::Watch(Vec::new()));
            }
        }
    }

    /// Looks at the law anew, if there was a discontinuity. Parts whose law is still the same go on.
    fn prepare(&mut self) -> Result<(), Fault> {
        if self.is_prepared {
            return Ok(());
        }
        let mode = self.law.mode(self.model, self.env());
        self.watch_limits(&mode.piece_of);
        let before = std::mem::take(&mut self.course).parts;
        let mut before: BTreeMap<u32, Part> =
            before.into_iter().filter_map(|part| Some((*part.moving().first()?, part))).collect();
        let mut kept: Vec<Option<Part>> = Vec::new();
        for piece in &mode.pieces {
            let part = piece.moving.first().and_then(|first| before.remove(first));
            kept.push(part.and_then(|part| {
                let goes_on = part.goes_on(piece);
                if !goes_on {
                    part.leave(&mut self.sizes);
                }
                goes_on.then_some(part)
            }));
        }
        before.values().for_each(|part| part.leave(&mut self.sizes));
        let mut parts = Vec::with_capacity(kept.len());
        for (piece, kept) in mode.pieces.into_iter().zip(kept) {
            parts.push(match kept {
                Some(mut part) => {
                    part.look_out_for(piece.own);
                    part
                }
                None => self.begin(piece)?,
            });
        }
        let across = mode.across.into_iter().map(|group| Lookout::new(group, &parts, &mode.piece_of, self.time));
        let across = across.collect();
        self.course = Course { parts, part_of: mode.piece_of, across };
        self.is_prepared = true;
        Ok(())
    }

    /// Begins to integrate a piece.
    fn begin(&mut self, piece: Piece) -> Result<Part, Fault> {
        let Piece { moving, rates, own } = piece;
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
        Ok(Part::new(Integrator::new(rates, moving, self.time, &values, tolerance), own, scarce))
    }

    /// Follows one segment to its end or to `until`, and does what is due there.
    fn segment(&mut self, until: f64, nodes: &[NodeId], observer: &mut dyn Observer) -> Result<(), Fault> {
        let mut course = std::mem::take(&mut self.course);
        let left = self.follow(&mut course, until, nodes, observer);
        self.course = course;
        match left? {
            Left::Crossed(crossing) => {
                if crossing.touch {
                    self.touches.push(crossing.node);
                    self.forget();
                }
                self.limits.crossed();
                self.count_crossing(crossing.node)?;
                self.show(observer);
                self.settle(None, observer)
            }
            Left::Stop => {
                self.limits.crossed();
                self.settle(None, observer)
            }
            Left::Target => Ok(()),
        }
    }

    /// Goes through the steps of all parts in the order of time.
    fn follow(
        &mut self,
        course: &mut Course,
        until: f64,
        nodes: &[NodeId],
        observer: &mut dyn Observer,
    ) -> Result<Left, Fault> {
        let Course { parts, part_of, across } = course;
        let watching = watched(self.model, nodes, part_of, self.env()).into_iter();
        let mut watching: Vec<Lookout> = watching.map(|group| Lookout::new(group, parts, part_of, self.time)).collect();
        let mut lookouts: Vec<&mut Lookout> = across.iter_mut().chain(&mut watching).collect();
        let stop = lookouts.iter().map(|l| l.stop()).fold(f64::INFINITY, f64::min);
        let target = until.min(stop);
        let mut values = Vec::new();
        let mut is_fresh = true;
        loop {
            let mut stepped = vec![is_fresh; parts.len()];
            for (i, part) in parts.iter_mut().enumerate() {
                let step = part.step();
                stepped[i] |= step.map_err(|stuck| self.stuck(stuck, part.moving()))?;
            }
            for lookout in &mut lookouts {
                let is_known = lookout.found.is_some();
                let is_due = match lookout.parts[..] {
                    [] => !is_known && lookout.until <= self.time,
                    ref parts => parts.iter().any(|part| stepped[*part as usize]),
                };
                if is_due || is_fresh {
                    lookout.look(parts, self.time).map_err(|Unseen(node)| self.restless(Some(node)))?;
                }
            }
            is_fresh = false;
            let mut next = (target, Next::Target);
            for (i, part) in parts.iter().enumerate() {
                if part.until() < next.0 {
                    next = (part.until(), Next::Part(i));
                }
            }
            for (i, lookout) in lookouts.iter().enumerate() {
                // Lab time may be too coarse to tell two ends of one part apart; its own clock is not.
                let is_sooner = match (next.1, lookout.found, &lookout.parts[..]) {
                    (Next::Part(p), Some((crossing, _)), [of]) if *of as usize == p => crossing.time < parts[p].limit(),
                    (_, Some(_), _) => lookout.until < next.0,
                    _ => lookout.is_timed() && lookout.until < next.0,
                };
                if is_sooner {
                    next = (lookout.until, Next::Lookout(i));
                }
            }
            let (time, next) = (next.0.max(self.time), next.1);
            let found = match next {
                Next::Lookout(i) => {
                    lookouts[i].found.map(|(crossing, clock)| (crossing, lookouts[i].parts.clone(), clock))
                }
                _ => None,
            };
            for (i, part) in parts.iter_mut().enumerate() {
                match (next, &found) {
                    (Next::Part(p), _) if p == i => part.reach(part.limit(), &mut self.states, &mut values),
                    (_, Some((crossing, of, _))) if of[..] == [i as u32] => {
                        part.reach(crossing.time, &mut self.states, &mut values);
                    }
                    _ => part.reach_lab(time, &mut self.states, &mut values),
                }
            }
            self.arrive(time);
            for part in parts.iter() {
                self.check_states(Some(part.moving()))?;
            }
            match next {
                Next::Target => return Ok(if time == stop { Left::Stop } else { Left::Target }),
                Next::Lookout(_) => {
                    if let Some((crossing, ..)) = found {
                        return Ok(Left::Crossed(crossing));
                    }
                }
                Next::Part(i) => match parts[i].ending() {
                    Some(Ending::Crossed(crossing)) => return Ok(Left::Crossed(crossing)),
                    Some(Ending::Unseen(node)) => return Err(self.restless(Some(node))),
                    Some(Ending::Drained(_, which)) => {
                        self.show(observer);
                        let drained: &Drained = &self.model.temperatures.drained[which];
                        return Err(self.overdrawn(drained, "is used up"));
                    }
                    None => self.show(observer),
                },
            }
            if self.is_cancelled() || observer.stops() {
                return Ok(Left::Target);
            }
        }
    }

    fn arrive(&mut self, time: f64) {
        self.time = time;
        self.sampled = false;
        self.forget();
    }
}
