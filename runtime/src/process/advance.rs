//! The loop over what happens, in the order of time.
//!
//! Every part has come as far as its own last step; who asks for a state in between reads it from the solution. So a step of one part
//! costs nothing elsewhere.

use std::collections::BTreeSet;

use matterix_ir::NodeId;
use matterix_ir::model::Drained;

use super::course::Who;
use super::index::Root;
use super::lookout::Lookout;
use super::part::Ending;
use super::switch::Crossing;
use super::{Advance, Engine, Observer, Watch};
use crate::fault::Fault;

/// Comparisons that change within this share of the time change together: they are located to a few units of rounding only.
const TOGETHER: f64 = 16.0 * f64::EPSILON;

/// What changes within this share of the time after the end of a stretch changes at its end: it was to be met there exactly, and states are
/// off by their last digits as well.
const AT_END: f64 = 64.0 * f64::EPSILON;

/// How a stretch without a discontinuity was left.
enum Left {
    /// At the time asked for, or where the observer or somebody else stops.
    Target,
    /// Where these are due, of which each finds a discontinuity.
    Jump(Vec<Who>),
}

impl Engine<'_> {
    /// Goes on to `until` (s, finite), or to the first instant at which a limit breaks or one of `watches` holds. Events that
    /// become true on the way fire. Fails where the solution cannot be followed.
    pub fn advance(&mut self, until: f64, watches: &[Watch], observer: &mut dyn Observer) -> Result<Advance, Fault> {
        self.watch(watches);
        loop {
            let broken = self.newly_broken();
            if !broken.is_empty() {
                self.check_suspects()?;
                return Ok(Advance::Broken(broken));
            }
            let held: Vec<usize> = (0..watches.len()).filter(|&i| self.ends(watches[i])).collect();
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
            self.release(observer)?;
            self.prepare(observer)?;
            if !self.due.events.is_empty() {
                self.settle(None, observer)?;
                continue;
            }
            if let Left::Jump(due) = self.follow(until, observer)? {
                self.jump(&due, until, observer)?;
            }
            if observer.stops() {
                self.check_suspects()?;
                return Ok(Advance::Watch(Vec::new()));
            }
        }
    }

    /// Whether the caller has to look at what it waits for: it has come about, or cannot be told any more.
    fn ends(&self, watch: Watch) -> bool {
        self.truth(watch.node) == watch.value || self.is_undecided(watch.node)
    }

    /// Looks out for these conditions from now on, and for no others that the caller asked for.
    fn watch(&mut self, watches: &[Watch]) {
        let graph = &self.model.graph;
        let watching: BTreeSet<u32> =
            watches.iter().map(|watch| self.index.ask(graph, Root::Watch, watch.node)).collect();
        let law = &mut self.due.law;
        law.roots.extend(watching.difference(&self.watching));
        law.sights.extend(self.watching.symmetric_difference(&watching));
        self.watching = watching;
    }

    /// Goes through the steps of all parts in the order of time, up to the next discontinuity.
    fn follow(&mut self, until: f64, observer: &mut dyn Observer) -> Result<Left, Fault> {
        while let Some((time, mut who)) = self.course.queue.first() {
            if time >= until {
                // What changes at the end changes before whoever waits for it goes on: once all steps that end there are taken, as another
                // one may begin with it.
                match self.course.queue.until(until).find(|who| !self.jumps(*who, until)) {
                    Some(step) => who = step,
                    None => {
                        let jumps = self.jumps_at_end(until);
                        if !jumps.is_empty() {
                            return Ok(Left::Jump(jumps));
                        }
                        break;
                    }
                }
            } else if self.jumps(who, time) {
                return Ok(Left::Jump(self.jumps_until(time + TOGETHER * time)));
            }
            match who {
                Who::Part(id) if self.is_within(id) => self.show_within(id, observer)?,
                Who::Part(id) => {
                    self.step(id, observer)?;
                    if self.is_cancelled() || observer.stops() {
                        return Ok(Left::Target);
                    }
                }
                Who::Lookout(id) | Who::Sooner(id) => {
                    self.arrive(time);
                    self.look_out(id)?;
                }
            }
        }
        self.arrive(until);
        Ok(Left::Target)
    }

    /// The discontinuities that are found up to `time`, s.
    fn jumps_until(&self, time: f64) -> Vec<Who> {
        self.course.queue.until(time).filter(|who| self.jumps(*who, time)).collect()
    }

    /// The discontinuities at `until`, s: those found up to then, and what is found a little later by rounding alone.
    fn jumps_at_end(&self, until: f64) -> Vec<Who> {
        let due = self.course.queue.until(until + AT_END * until);
        due.filter(|who| self.jumps(*who, until) && self.meets_at(*who, until)).collect()
    }

    /// Whether what is found is there at `until`, s, but for rounding.
    fn meets_at(&self, who: Who, until: f64) -> bool {
        match who {
            Who::Part(id) => self.course.parts.get(id).is_some_and(|part| {
                let meets = matches!(part.ending(), Some(Ending::Crossed(crossing)) if crossing.meets);
                part.until() <= until || meets
            }),
            Who::Lookout(id) | Who::Sooner(id) => self.course.lookouts.get(id).is_some_and(|lookout| {
                lookout.due() <= until || lookout.found.is_some_and(|(crossing, _)| crossing.meets)
            }),
        }
    }

    /// Whether what is due is a discontinuity.
    fn jumps(&self, who: Who, time: f64) -> bool {
        match who {
            Who::Part(id) => {
                let ending = self.course.parts.get(id).and_then(|part| part.ending());
                !self.is_within(id) && matches!(ending, Some(Ending::Crossed(_)))
            }
            Who::Lookout(id) | Who::Sooner(id) => {
                let lookout = self.course.lookouts.get(id);
                lookout.is_some_and(|lookout| lookout.found.is_some() || lookout.stops(time))
            }
        }
    }

    /// A part has come to the end of a step, or of what can be followed.
    fn step(&mut self, id: u32, observer: &mut dyn Observer) -> Result<(), Fault> {
        let Some(part) = self.course.parts.get_mut(id) else { return Ok(()) };
        let (until, limit, ending) = (part.until(), part.limit(), part.ending());
        part.reach(limit, &mut self.states);
        self.arrive(until);
        self.arrived(id)?;
        self.show(observer);
        match ending {
            Some(Ending::Unseen(node)) => return Err(self.restless(Some(node))),
            Some(Ending::Drained(_, which)) => {
                let drained: &Drained = &self.model.temperatures.drained[which];
                return Err(self.overdrawn(drained, "has run out"));
            }
            Some(Ending::Crossed(_)) | None => {}
        }
        let stepped = self.course.enqueue_part(id);
        stepped.map_err(|stuck| self.stuck(stuck, id))?;
        for lookout in self.course.lookouts_on(id) {
            let is_due = |of: &Lookout| of.found.is_none() && (of.parts.len() == 1 || of.due() <= self.time);
            if self.course.lookouts.get(lookout).is_some_and(is_due) {
                self.look_out(lookout)?;
            }
        }
        Ok(())
    }

    /// Whether the curves of a part are shown before its step ends.
    fn is_within(&self, id: u32) -> bool {
        self.course.parts.get(id).is_some_and(|part| part.next_show().is_some())
    }

    /// Shows the curves of a part within its step to who wants them; nothing else comes of it.
    fn show_within(&mut self, id: u32, observer: &mut dyn Observer) -> Result<(), Fault> {
        let Some(part) = self.course.parts.get_mut(id) else { return Ok(()) };
        let Some(time) = part.next_show() else { return Ok(()) };
        let lab = part.due();
        part.reach(time, &mut self.states);
        self.arrive(lab);
        self.followed(id)?;
        let Some(part) = self.course.parts.get(id) else { return Ok(()) };
        observer.curve(self.time, self, part.moving());
        self.course.shown(id);
        Ok(())
    }

    /// A part has been followed to where it is to be shown.
    fn arrived(&mut self, id: u32) -> Result<(), Fault> {
        self.unshown.extend(self.course.parts.get(id).into_iter().flat_map(|part| part.moving()));
        self.followed(id)
    }

    /// A part has been followed: its states are others, and have to be finite.
    fn followed(&mut self, id: u32) -> Result<(), Fault> {
        let Some(part) = self.course.parts.get(id) else { return Ok(()) };
        let memo = self.memo.get_mut();
        for &state in part.moving() {
            memo.change_all(&self.index.users, self.index.leaves(state));
        }
        self.check_states(part.moving())
    }

    /// Comparisons change at one instant, at `until`, s, at the latest: what rests on them is due.
    fn jump(&mut self, due: &[Who], until: f64, observer: &mut dyn Observer) -> Result<(), Fault> {
        let (mut found, mut concerned): (Vec<Crossing>, Vec<u32>) = (Vec::new(), Vec::new());
        let mut time = self.time;
        for who in due {
            match *who {
                Who::Part(id) => {
                    let Some(part) = self.course.parts.get(id) else { continue };
                    let Some(Ending::Crossed(crossing)) = part.ending() else { continue };
                    time = time.max(part.until());
                    self.reach_crossing(id, crossing, until)?;
                    found.push(crossing);
                    concerned.push(id);
                }
                Who::Lookout(id) | Who::Sooner(id) => {
                    let Some(lookout) = self.course.lookouts.get(id) else { continue };
                    self.due.law.sights.insert(lookout.root);
                    time = time.max(lookout.due());
                    concerned.extend(&lookout.parts);
                    self.suspects.extend(&lookout.nodes);
                    let Some((crossing, _)) = lookout.found else { continue };
                    found.push(crossing);
                    if let [part] = lookout.parts[..] {
                        self.reach_crossing(part, crossing, until)?;
                    }
                }
            }
        }
        self.arrive(time.min(until));
        concerned.sort_unstable();
        concerned.dedup();
        for &part in &concerned {
            self.reach_now(part);
            self.arrived(part)?;
            self.suspects.extend(self.course.own_of(part));
            for id in self.course.lookouts_on(part) {
                self.suspects.extend(self.course.lookouts.get(id).into_iter().flat_map(|lookout| &lookout.nodes));
            }
            self.due.law.parts.insert(part);
        }
        self.cross(&found)?;
        self.show(observer);
        self.settle(None, observer)
    }

    /// Follows a part to where a comparison changes that it decides; not beyond `until`, s, where it has changed there already.
    fn reach_crossing(&mut self, id: u32, crossing: Crossing, until: f64) -> Result<(), Fault> {
        let Some(part) = self.course.parts.get_mut(id) else { return Ok(()) };
        if part.dense().clock.lab(crossing.time) > until {
            part.reach_lab(until, &mut self.states);
            self.arrive(until);
            self.followed(id)?;
            let before = self.facts.of(&self.model.graph).now(crossing.node);
            if self.eval(crossing.node) != before {
                return Ok(());
            }
        }
        if let Some(part) = self.course.parts.get_mut(id) {
            part.reach(crossing.time, &mut self.states);
        }
        Ok(())
    }

    /// These comparisons have changed, and with them perhaps others that rest on the same.
    fn cross(&mut self, found: &[Crossing]) -> Result<(), Fault> {
        for crossing in found.iter().filter(|crossing| crossing.touch) {
            self.touches.push(crossing.node);
            self.memo.get_mut().pin(&self.index.users, crossing.node, 1.0);
        }
        let suspects = std::mem::take(&mut self.suspects);
        let known = self.facts.of(&self.model.graph);
        let changed = |node: &NodeId| self.eval(*node) != known.now(*node);
        let changed: Vec<NodeId> = suspects.into_iter().filter(changed).collect();
        self.due.seeds.extend(changed);
        self.due.seeds.extend(found.iter().map(|crossing| crossing.node));
        found.iter().try_for_each(|crossing| self.count_crossing(crossing.node))
    }

    fn arrive(&mut self, time: f64) {
        if time > self.time {
            self.time = time;
            self.memo.get_mut().pass(&self.index.users);
        }
    }
}
