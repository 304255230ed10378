//! Comparisons that no single part decides, or that only the caller cares about.

use matterix_ir::NodeId;

use super::clock::Clock;
use super::course::Slab;
use super::mode::Group;
use super::part::Part;
use super::switch::{Crossing, Switches, Unseen};

/// How often comparisons are looked at that follow the time by more than a shift, s.
const LOOK: f64 = 1.0;

/// Comparisons that rest on some parts, looked for as far as these have been followed.
#[derive(Clone)]
pub(super) struct Lookout {
    switches: Switches,
    /// The root of the law that asks for them.
    pub(super) root: u32,
    /// The comparisons.
    pub(super) nodes: Vec<NodeId>,
    /// The parts, by their index, ascending.
    pub(super) parts: Vec<u32>,
    /// By state that is rested on: its part and its place there.
    places: Vec<(u32, u32)>,
    values: Vec<f64>,
    /// How far they have been looked for, s.
    until: f64,
    /// What was found, and on which clock.
    pub(super) found: Option<(Crossing, Clock)>,
}

impl Lookout {
    /// Looks out for `group` among `parts` from `time`, s, on.
    pub(super) fn new(
        root: u32,
        group: Group,
        switches: Switches,
        parts: &Slab<Part>,
        part_of: &[u32],
        time: f64,
    ) -> Self {
        let place = |&state: &u32| {
            let id = part_of[state as usize];
            (id, parts.get(id).map_or(0, |part| part.place(state)))
        };
        let places = group.states.iter().map(place).collect();
        let values = vec![0.0; group.states.len()];
        let Group { parts, nodes, .. } = group;
        Lookout { switches, root, nodes, parts, places, values, until: time, found: None }
    }

    /// When it has to be asked again, or has found something, s.
    pub(super) fn due(&self) -> f64 {
        self.until.min(self.switches.stop)
    }

    /// Whether a comparison of the time itself changes at `time`, s.
    pub(super) fn stops(&self, time: f64) -> bool {
        self.switches.stop <= time
    }

    /// Looks for the first change from `now`, s, on, as far as all parts are known, and where there is none a little further.
    pub(super) fn look(&mut self, parts: &Slab<Part>, now: f64) -> Result<(), Unseen> {
        self.found = None;
        if self.switches.is_empty() {
            self.until = f64::INFINITY;
            return Ok(());
        }
        let (clock, from, end) = match self.parts[..] {
            [] => (Clock::LAB, now, now + LOOK),
            [part] => {
                let Some(part) = parts.get(part) else { return Ok(()) };
                let dense = part.dense();
                let at = dense.clock.local(now).max(part.at()).min(dense.end);
                (dense.clock, at, dense.end)
            }
            _ => {
                let denses = self.parts.iter().filter_map(|p| parts.get(*p)).map(Part::dense);
                let end = denses.clone().map(|d| d.clock.lab(d.end)).fold(f64::INFINITY, f64::min);
                (Clock::LAB, now, end)
            }
        };
        let places = &self.places;
        let mut path = |time: f64, out: &mut [f64]| {
            for (out, (part, place)) in out.iter_mut().zip(places) {
                let Some(dense) = parts.get(*part).map(Part::dense) else { continue };
                let local = if dense.clock == clock { time } else { dense.clock.local(time) };
                dense.some(local.clamp(dense.start, dense.end), &[*place], std::slice::from_mut(out));
            }
        };
        let found = self.switches.first_crossing(clock, (from, end), &mut self.values, &mut path)?;
        self.found = found.map(|crossing| (crossing, clock));
        self.until = clock.lab(found.map_or(end, |crossing| crossing.time));
        Ok(())
    }
}
