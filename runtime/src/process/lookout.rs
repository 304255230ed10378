//! Comparisons that no single part decides, or that only the caller cares about.

use super::clock::Clock;
use super::mode::Group;
use super::part::Part;
use super::switch::{Crossing, Switches, Unseen};

/// How often comparisons are looked at that follow the time by more than a shift, s.
const LOOK: f64 = 1.0;

/// Comparisons that rest on some parts, looked for as far as these have been followed.
pub(super) struct Lookout {
    switches: Switches,
    /// The parts, by their index, ascending.
    pub(super) parts: Vec<u32>,
    /// By state that is rested on: its part and its place there.
    places: Vec<(u32, u32)>,
    values: Vec<f64>,
    /// How far they have been looked for, s.
    pub(super) until: f64,
    /// What was found, and on which clock.
    pub(super) found: Option<(Crossing, Clock)>,
}

impl Lookout {
    /// Looks out for `group` among `parts` from `time`, s, on.
    pub(super) fn new(group: Group, parts: &[Part], piece_of: &[u32], time: f64) -> Self {
        let place = |&state: &u32| {
            let part = piece_of[state as usize];
            (part, parts[part as usize].moving().partition_point(|m| *m < state) as u32)
        };
        let places = group.states.iter().map(place).collect();
        let values = vec![0.0; group.states.len()];
        Lookout { switches: group.switches, parts: group.pieces, places, values, until: time, found: None }
    }

    /// When a comparison of the time itself changes, s.
    pub(super) fn stop(&self) -> f64 {
        self.switches.stop
    }

    /// Whether it has to be looked at as time passes, whatever moves.
    pub(super) fn is_timed(&self) -> bool {
        self.parts.is_empty() && !self.switches.is_empty()
    }

    /// Looks for the first change from `now`, s, on, as far as all parts are known, and where there is none a little further.
    pub(super) fn look(&mut self, parts: &[Part], now: f64) -> Result<(), Unseen> {
        if self.switches.is_empty() {
            self.until = f64::INFINITY;
            return Ok(());
        }
        let (clock, from, times) = match self.parts[..] {
            [] => (Clock::LAB, now, vec![now + LOOK]),
            [part] => {
                let (dense, at) = (parts[part as usize].dense(), parts[part as usize].at());
                let inner = dense.times().filter(|&t| t > at && t < dense.end);
                (dense.clock, at, inner.chain([dense.end]).collect())
            }
            _ => {
                let denses = self.parts.iter().map(|p| parts[*p as usize].dense());
                let end = denses.clone().map(|d| d.clock.lab(d.end)).fold(f64::INFINITY, f64::min);
                let times = denses.flat_map(|d| d.times().map(|t| d.clock.lab(t)));
                let mut times: Vec<f64> = times.filter(|&t| t > now && t < end).chain([end]).collect();
                times.sort_by(f64::total_cmp);
                (Clock::LAB, now, times)
            }
        };
        let places = &self.places;
        let mut path = |time: f64, out: &mut [f64]| {
            for (out, (part, place)) in out.iter_mut().zip(places) {
                let dense = parts[*part as usize].dense();
                let local = if dense.clock == clock { time } else { dense.clock.local(time) };
                dense.some(local.clamp(dense.start, dense.end), &[*place], std::slice::from_mut(out));
            }
        };
        let end = times.last().copied().unwrap_or(from);
        let found = self.switches.first_crossing(clock, from, times.into_iter(), &mut self.values, &mut path)?;
        self.found = found.map(|crossing| (crossing, clock));
        self.until = clock.lab(found.map_or(end, |crossing| crossing.time));
        Ok(())
    }
}
