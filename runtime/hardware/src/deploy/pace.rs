//! How time passes: the twin goes on in steps that depend on nothing but lab time, so that who goes through a journal again comes to
//! the same states to the last bit. What people say is heeded between two steps.

use std::time::Duration;

use matterix_runtime::backend::Backend;
use matterix_runtime::exec::Listener;
use matterix_runtime::fault::Fault;
use matterix_runtime::process::{Advance, Watch};

use super::hardware::{Hardware, Mode};
use super::journal::{Entry, Gate};

/// Longest step of the twin, s by the clock.
const STEP: f64 = 0.05;

/// The lab may be so much behind the clock before it goes on at once, s by the clock.
const LAG: f64 = 0.25;

/// How often the journal says what the clock shows, s by the clock.
const DATED: f64 = 60.0;

/// Longest time in which nobody looks at the clock, or at what people say.
const NAP: Duration = Duration::from_millis(10);

/// Shortest of these: what is left may be less than a clock can show.
const LEAST: Duration = Duration::from_micros(1);

impl Hardware<'_, '_> {
    pub(super) fn pass(&mut self, until: f64, watches: &[Watch], out: &mut dyn Listener) -> Result<Advance, Fault> {
        if !self.broken_meanwhile.is_empty() {
            return Ok(Advance::Broken(std::mem::take(&mut self.broken_meanwhile)));
        }
        loop {
            let is_live = self.join(until, out)?;
            if is_live && let Some(fault) = self.unwritten() {
                return Err(fault);
            }
            if is_live {
                self.notice_hold_up();
            }
            // Before people are heeded, so that it stands at the same place where their words are gone through again all at once.
            self.beat(false, out)?;
            if self.heeded(is_live) {
                return Ok(Advance::Watch(Vec::new()));
            }
            if !is_live {
                self.looked_before()?;
            }
            let now = self.twin.now();
            let target = match self.leap(is_live, until) {
                Some(to) => to,
                None => until.min(self.next_beat()).min(self.next_step(now)).max(now),
            };
            if is_live {
                self.hold()?;
            }
            if is_live && !self.is_dry() && target > self.clock() {
                self.look_between()?;
                self.take_in();
                let left = Duration::try_from_secs_f64((target - self.clock()) / self.settings.speed);
                self.settings.world.sleep(left.unwrap_or(NAP).clamp(LEAST, NAP));
                continue;
            }
            let advance = self.twin.advance(target, watches, out)?;
            self.beat(true, out)?;
            match is_live {
                true => self.date(),
                false => self.has_kept_pace()?,
            }
            match advance {
                Advance::Reached if self.twin.now() < until => {}
                ended => return Ok(ended),
            }
        }
    }

    /// Goes on with devices where what an earlier process wrote is over, and its lab has come to where the clock is by now;
    /// whether devices are there.
    fn join(&mut self, until: f64, out: &mut dyn Listener) -> Result<bool, Fault> {
        match self.front() {
            Some(Entry::Resumed { t, .. }) => {
                if until > t {
                    // Only this one: before the next of them went on, time passed.
                    self.next_process(t);
                    return self.join(until, out);
                }
                Ok(false)
            }
            Some(_) => Ok(false),
            // What came about at the very end did so in a step that was to lead further.
            None if self.settings.mode == Mode::Replay && self.twin.now() <= self.ends_at => Ok(false),
            None if self.resuming && until <= self.catches_up_to() => Ok(false),
            None => {
                self.go_live(out)?;
                Ok(true)
            }
        }
    }

    /// Nothing that an earlier process wrote lies behind: a step may come to its end at the moment at which it began, as what was
    /// waited for had come about by then, but leads no further.
    fn has_kept_pace(&mut self) -> Result<(), Fault> {
        let Some(next) = self.front() else { return Ok(()) };
        let is_said_between = matches!(
            next,
            Entry::Answered { .. }
                | Entry::Gate { .. }
                | Entry::Stop { .. }
                | Entry::Leap { .. }
                | Entry::Resumed { .. }
        );
        let is_behind = next.time() < self.twin.now() && !is_said_between;
        if is_behind { Err(self.mismatch("time passes", &next)) } else { Ok(()) }
    }

    /// That nothing more can be written down, once: what ends then is not held up by it.
    fn unwritten(&mut self) -> Option<Fault> {
        let why = self.journal.broken.clone().filter(|_| !std::mem::replace(&mut self.is_unwritten, true))?;
        Some(self.unkept(format!("the journal cannot be written: {why}")))
    }

    /// Notes that this process was held up, where it was.
    pub(super) fn notice_hold_up(&mut self) {
        if !self.is_live() {
            // What an earlier process noted of itself counts too.
            self.front();
            return;
        }
        let seconds = self.settings.world.held_up().as_secs_f64();
        if seconds > 0.0 {
            let t = self.twin.now();
            self.journal.note(&Entry::HeldUp { t, seconds });
            self.held_up.push((t, seconds));
        }
    }

    /// Heeds what people say at this moment, or said to the earlier process; whether that lets something go on or end.
    fn heeded(&mut self, is_live: bool) -> bool {
        if is_live { self.heed() } else { self.heeded_before() }
    }

    fn heed(&mut self) -> bool {
        let (t, wall) = (self.twin.now(), self.wall());
        if self.settings.control.is_stopped() && !self.cancelled {
            let who = self.settings.control.stopped_by().unwrap_or_else(|| "a signal".to_owned());
            self.journal.note(&Entry::Stop { t, who, wall });
            self.stop();
            return true;
        }
        if let Some((to, who)) = self.settings.control.next_gate() {
            // Pausing twice, or going on twice, is one event; each step is its own.
            if to == self.gate && to != Gate::Step {
                return false;
            }
            self.journal.note(&Entry::Gate { t, to, who, wall });
            return self.set_gate(to);
        }
        let answers = self.settings.control.answers();
        std::mem::replace(&mut self.answers, answers) < answers
    }

    fn heeded_before(&mut self) -> bool {
        loop {
            match self.front() {
                Some(entry) if entry.time() > self.twin.now() => return false,
                // Who asked for it takes it at this moment, or it is none that was asked for.
                Some(Entry::Answered { .. }) => {
                    let left = self.replay.len();
                    return std::mem::replace(&mut self.answers, left) != left;
                }
                Some(Entry::Stop { who, .. }) => {
                    self.replay.pop_front();
                    self.settings.control.stop(&who);
                    self.stop();
                    return true;
                }
                Some(Entry::Gate { to, .. }) => {
                    self.replay.pop_front();
                    if self.set_gate(to) {
                        return true;
                    }
                }
                _ => return false,
            }
        }
    }

    /// Notes that a person stopped it where it was ending already, or that they did.
    pub(super) fn stop_late(&mut self) {
        self.heeded_before();
        if self.settings.mode != Mode::Replay && self.settings.control.is_stopped() && !self.cancelled {
            self.heed();
        }
    }

    fn stop(&mut self) {
        self.cancelled = true;
        self.settings.ended.store(true, std::sync::atomic::Ordering::SeqCst);
    }

    /// Whether what was held back may begin now.
    fn set_gate(&mut self, to: Gate) -> bool {
        self.gate = to;
        to != Gate::Pause
    }

    /// Where the lab goes on at once, because it is behind the clock, or because it was.
    fn leap(&mut self, is_live: bool, until: f64) -> Option<f64> {
        let now = self.twin.now();
        if !is_live {
            let Some(Entry::Leap { t, to }) = self.front() else { return None };
            if t > now {
                return None;
            }
            self.replay.pop_front();
            return Some(to);
        }
        let clock = if self.is_dry() { now } else { self.clock() };
        if clock - now <= LAG * self.settings.speed {
            return None;
        }
        let to = until.min(clock).min(self.next_beat()).max(now);
        self.journal.note(&Entry::Leap { t: now, to });
        Some(to)
    }

    /// The end of the step of the twin that `now` is in, s.
    fn next_step(&self, now: f64) -> f64 {
        if self.is_dry() {
            return f64::INFINITY;
        }
        matterix_runtime::backend::next_report(&[STEP * self.settings.speed], now)
    }

    /// Notes from time to time what the clock shows.
    fn date(&mut self) {
        let wall = self.wall();
        if wall - self.dated >= DATED {
            self.dated = wall;
            self.journal.note(&Entry::Clock { t: self.twin.now(), wall });
        }
    }
}
