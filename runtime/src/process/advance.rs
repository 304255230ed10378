//! The loop over segments.

use matterix_ir::{NodeId, codes};

use super::clock::Clock;
use super::dense::Dense;
use super::integrator::{Integrator, Next, STEP_SHARE, Stuck};
use super::mode::watched;
use super::switch::{Crossing, Switches, Unseen};
use super::tolerance::Tolerance;
use super::{Advance, Engine, Observer, Watch};
use crate::fault::Fault;

/// How often comparisons are looked at that follow time by more than a shift while no state moves, s.
const LOOK: f64 = 1.0;

/// How a stretch of a segment ended.
enum Stretch {
    /// At the end of what is known of the solution.
    On,
    /// At the time asked for, or where the observer stops.
    Target,
    /// Where a comparison changed.
    Crossed(Crossing),
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

    /// Looks at the law anew, if there was a discontinuity. The integration goes on if it is still the same.
    fn prepare(&mut self) -> Result<(), Fault> {
        if self.mode.is_some() {
            return Ok(());
        }
        let mut mode = self.law.mode(self.model, self.env());
        self.watch_limits(&mut mode);
        let goes_on = self.integrator.as_ref().is_some_and(|i| i.moving == mode.moving && *i.rates() == mode.rates);
        if !goes_on {
            self.leave_integration();
        }
        if self.integrator.is_none() && !mode.moving.is_empty() {
            let values = self.values(&mode.moving);
            let mut registers = mode.rates.registers();
            mode.rates.run(self.time, &values, &mut registers);
            let broken = (0..values.len()).find(|&i| !registers[mode.rates.outputs[i] as usize].is_finite());
            if let Some(i) = broken {
                return Err(self.no_rate(mode.moving[i]));
            }
            let (rates, moving) = (mode.rates.clone(), mode.moving.clone());
            let scale = |s: &u32| self.model.states[*s as usize].scale.filter(|s| s.is_normal()).map(f64::abs);
            let scales = moving.iter().map(scale).collect();
            let sizes: Vec<f64> = moving.iter().map(|s| self.sizes[*s as usize]).collect();
            let rtol = STEP_SHARE * self.options.rtol;
            let tolerance = Tolerance::new(rtol, scales, &sizes, &rates, self.time, &values);
            for (state, size) in moving.iter().zip(tolerance.sizes()) {
                self.sizes[*state as usize] = *size;
            }
            self.integrator = Some(Integrator::new(rates, moving, self.time, &values, tolerance));
        }
        self.mode = Some(mode);
        Ok(())
    }

    fn values(&self, moving: &[u32]) -> Vec<f64> {
        moving.iter().map(|&s| self.states[s as usize]).collect()
    }

    /// Follows one segment to its end or to `until`, and does what is due there.
    fn segment(&mut self, until: f64, nodes: &[NodeId], observer: &mut dyn Observer) -> Result<(), Fault> {
        let Some(mut mode) = self.mode.take() else { return Ok(()) };
        let mut watching = watched(self.model, nodes, &mode.moving, self.env());
        let stop = mode.switches.stop.min(watching.stop).min(mode.limits.stop);
        let switches = [&mut mode.switches, &mut watching, &mut mode.limits];
        let mut guide = Guide { switches, target: until.min(stop) };
        let end = match self.integrator.take() {
            None => self.rest(&mut guide)?,
            Some(mut integrator) => {
                let end = self.follow(&mut integrator, &mut guide, observer);
                self.integrator = Some(integrator);
                end?
            }
        };
        self.mode = Some(mode);
        match end {
            Stretch::Crossed(crossing) => {
                if crossing.touch {
                    self.touches.push(crossing.node);
                    self.forget();
                }
                self.limits.crossed();
                self.count_crossing(crossing.node)?;
                self.show(observer);
                self.settle(None, observer)
            }
            _ if self.time == stop => {
                self.limits.crossed();
                self.settle(None, observer)
            }
            _ => Ok(()),
        }
    }

    /// No state moves: time jumps, unless comparisons must be looked at on the way.
    fn rest(&mut self, guide: &mut Guide<'_>) -> Result<Stretch, Fault> {
        let looks = guide.switches.iter().any(|s| s.follows_time);
        while self.time < guide.target && !self.is_cancelled() {
            let end = if looks { guide.target.min(self.time + LOOK) } else { guide.target };
            let crossing = guide.crossing(Clock::LAB, self.time, &[end], &mut [], &mut |_, _| {});
            if let Some(crossing) = crossing.map_err(|unseen| self.unseen(unseen))? {
                self.arrive(crossing.time);
                return Ok(Stretch::Crossed(crossing));
            }
            self.arrive(end);
        }
        Ok(Stretch::Target)
    }

    /// Follows the integration, first through what is known already.
    fn follow(
        &mut self,
        integrator: &mut Integrator,
        guide: &mut Guide<'_>,
        observer: &mut dyn Observer,
    ) -> Result<Stretch, Fault> {
        let moving = integrator.moving.clone();
        let mut end = Ok(Stretch::On);
        if integrator.dense.reached < integrator.dense.end {
            end = self.stretch(&mut integrator.dense, &moving, guide, observer);
        }
        if let Ok(Stretch::On) = end {
            let driven = integrator.drive(&mut |dense| {
                end = self.stretch(dense, &moving, guide, observer);
                match end {
                    Ok(Stretch::On) if self.is_cancelled() => Next::Pause,
                    Ok(Stretch::On) => Next::Step,
                    Ok(Stretch::Target) => Next::Pause,
                    _ => Next::Stop,
                }
            });
            match driven {
                Ok(()) => {}
                Err(Stuck::Short) => return Err(self.stuck(&moving)),
                Err(Stuck::Busy) => return Err(self.restless(None)),
            }
        }
        end
    }

    /// Goes through what `dense` knows beyond the present time.
    fn stretch(
        &mut self,
        dense: &mut Dense,
        moving: &[u32],
        guide: &mut Guide<'_>,
        observer: &mut dyn Observer,
    ) -> Result<Stretch, Fault> {
        let (clock, from) = (dense.clock, dense.reached);
        let target = clock.local(guide.target).max(from);
        let end = dense.end.min(target);
        let mut times: Vec<f64> = dense.times().filter(|&t| t > from && t < end).collect();
        times.push(end);
        let mut values = vec![0.0; moving.len()];
        let crossing = guide.crossing(clock, from, &times, &mut values, &mut |time, out| dense.at(time, out));
        let crossing = crossing.map_err(|unseen| self.unseen(unseen))?;
        let mut reached = crossing.map_or(end, |c| c.time);
        times.retain(|&t| t < reached);
        times.push(reached);
        let drained = self.first_drained(dense, moving, from, &times);
        let drained = drained.map(|(time, drained)| (time, drained.clone()));
        reached = drained.as_ref().map_or(reached, |(time, _)| *time);
        dense.at(reached, &mut values);
        dense.reached = reached;
        for (&state, &value) in moving.iter().zip(&values) {
            self.states[state as usize] = value;
        }
        let on_target = crossing.is_none() && reached == target;
        self.arrive(if on_target { guide.target } else { clock.lab(reached).clamp(self.time, guide.target) });
        self.check_states(Some(moving))?;
        if let Some((_, drained)) = &drained {
            self.show(observer);
            return Err(self.overdrawn(drained, "is used up"));
        }
        if reached == dense.end {
            self.show(observer);
        }
        Ok(match crossing {
            Some(crossing) => Stretch::Crossed(crossing),
            None if on_target || observer.stops() => Stretch::Target,
            None => Stretch::On,
        })
    }

    fn arrive(&mut self, time: f64) {
        self.time = time;
        self.sampled = false;
        self.forget();
    }

    /// The fault of a state whose rate is not finite.
    fn no_rate(&self, state: u32) -> Fault {
        let declared = &self.model.states[state as usize];
        let rate = self.model.derivatives.iter().find(|d| d.state == state).map(|d| d.rate);
        let cause = rate.map_or("", |r| self.cause(r));
        let message = format!("the rate of `{}` has no finite value{cause}", declared.name);
        let fault = Fault::new(codes::NOT_A_NUMBER, self.time, message).at(declared.span);
        match self.running_now() {
            Some(line) => fault.help(line),
            None => fault,
        }
    }

    /// The first operation below `root` that turns finite numbers into something else, in words.
    fn cause(&self, root: NodeId) -> &'static str {
        use matterix_ir::{BinaryOp, Op, UnaryOp};
        let graph = &self.model.graph;
        let first = graph.schedule([root]).into_iter().find(|&n| !self.eval(n).is_finite());
        match first.map(|n| graph.op(n)) {
            Some(Op::Binary(BinaryOp::Div, _, b)) if self.eval(b) == 0.0 => ": a division by zero",
            Some(Op::Unary(UnaryOp::Ln, _)) => ": the logarithm of a number that is not positive",
            Some(Op::Unary(UnaryOp::Sqrt, _)) => ": the square root of a negative number",
            Some(Op::Binary(BinaryOp::Pow, a, _)) if self.eval(a) < 0.0 => ": a power of a negative number",
            Some(Op::Local(_) | Op::Reading(_)) => ": it depends on a value that is not set yet",
            Some(_) => ": a number too large",
            None => "",
        }
    }

    /// The fault of a condition that may change more often than can be looked at.
    fn unseen(&self, Unseen(node): Unseen) -> Fault {
        self.restless(Some(node))
    }

    /// The fault of a law or condition that follows the clock too fast.
    fn restless(&self, node: Option<NodeId>) -> Fault {
        let place = node.and_then(|node| self.user_of(node));
        let name = place.map_or("a law".to_owned(), |(name, _)| format!("`{name}`"));
        let message = format!("{name} changes with the time more often than a run can follow");
        let fault = Fault::new(codes::INTEGRATION_FAILED, self.time, message)
            .help("give it a longer period, or write its mean over the time");
        match place {
            Some((_, span)) => fault.at(span),
            None => fault,
        }
    }

    fn running_now(&self) -> Option<String> {
        let processes = self.model.processes.iter().zip(&self.running).filter(|(_, running)| **running);
        let names: Vec<String> = processes.map(|(p, _)| format!("`{}`", p.name)).take(5).collect();
        (!names.is_empty()).then(|| format!("running now: {}", names.join(", ")))
    }

    /// The fault of an integration that finds no step: named after the state that changes fastest.
    fn stuck(&self, moving: &[u32]) -> Fault {
        if let Some(fault) = self.run_dry() {
            return fault;
        }
        let rates = self.model.derivatives.iter().filter(|d| moving.contains(&d.state));
        let pace = |d: &matterix_ir::model::Derivative| {
            let (state, value) = (&self.model.states[d.state as usize], self.states[d.state as usize]);
            self.eval(d.rate).abs() / (value.abs() + state.scale.unwrap_or(self.sizes[d.state as usize]).abs())
        };
        let Some(fastest) = rates.max_by(|a, b| pace(a).total_cmp(&pace(b))) else {
            return Fault::new(codes::INTEGRATION_FAILED, self.time, "no step is short enough");
        };
        if !self.eval(fastest.rate).is_finite() {
            return self.no_rate(fastest.state);
        }
        let state = &self.model.states[fastest.state as usize];
        let message = format!("`{}` changes faster than any step can follow", state.name);
        let fault = Fault::new(codes::INTEGRATION_FAILED, self.time, message).at(state.span);
        match self.running_now() {
            Some(line) => fault.help(line),
            None => fault,
        }
    }
}

/// What to look out for in a segment, and how far to go.
struct Guide<'s> {
    /// Of the model, of the caller, of the limits.
    switches: [&'s mut Switches; 3],
    target: f64,
}

impl Guide<'_> {
    /// The earliest change between `from` and the last of `times`, s on `clock`.
    fn crossing(
        &mut self,
        clock: Clock,
        from: f64,
        times: &[f64],
        moving: &mut [f64],
        path: &mut dyn FnMut(f64, &mut [f64]),
    ) -> Result<Option<Crossing>, Unseen> {
        let mut first: Option<Crossing> = None;
        for switches in &mut self.switches {
            let found = switches.first_crossing(clock, from, times.iter().copied(), moving, path)?;
            first = match (first, found) {
                (Some(a), Some(b)) => Some(if b.time < a.time { b } else { a }),
                (a, b) => a.or(b),
            };
        }
        Ok(first)
    }
}
