//! A plan as a scheduling problem: moments, differences between them, and blocks that must take turns.

use matterix_ir::plan::StepId;
use matterix_ir::scene::InstanceId;
use matterix_timing::network::{BEGIN, WHOLE};
use matterix_timing::{Edge, Network, Point, Reason, Why};

/// A moment: so long, s, after a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Moment {
    pub point: Point,
    pub offset: f64,
}

impl Moment {
    /// The beginning of the run.
    pub const BEGIN: Moment = Moment { point: BEGIN, offset: 0.0 };

    /// A point itself.
    pub fn of(point: Point) -> Self {
        Moment { point, offset: 0.0 }
    }

    /// So long, s, after this.
    pub fn later(self, by: f64) -> Self {
        Moment { offset: self.offset + by, ..self }
    }

    /// When it is, s, where `times` are those of the points.
    pub fn time(self, times: &[f64]) -> f64 {
        times.get(self.point.0 as usize).copied().unwrap_or(0.0) + self.offset
    }
}

/// A block that has instances to itself: one occurrence of a `claim`.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Task {
    pub step: StepId,
    /// Which time the step is reached, from 0.
    pub occurrence: u32,
    pub instances: Vec<InstanceId>,
    pub label: String,
    /// Index into [`Problem::lines`].
    pub line: usize,
    /// When it asks.
    pub asks: Moment,
    /// When it is granted.
    pub start: Point,
    pub end: Moment,
    /// Tasks around it.
    pub around: Vec<usize>,
}

/// A use of instances outside of claims, for pictures.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Work {
    pub step: StepId,
    pub instances: Vec<InstanceId>,
    pub label: String,
    pub line: usize,
    pub start: Moment,
    pub end: Moment,
}

/// What is to be scheduled.
#[derive(Clone, Debug, Default)]
pub(super) struct Problem {
    /// Least differences ([`Why::Order`]) and windows.
    pub network: Network,
    /// Points that are the latest of some moments.
    pub joins: Vec<(Point, Vec<Moment>)>,
    pub tasks: Vec<Task>,
    pub work: Vec<Work>,
    /// Names of the lines of steps: the workflow, branches, jobs.
    pub lines: Vec<String>,
    /// The end of the whole.
    pub end: Option<Moment>,
}

impl Problem {
    /// `later` comes at least `by` s after `earlier`.
    pub fn least(&mut self, earlier: Moment, later: Moment, by: f64, step: StepId) {
        let weight = by + earlier.offset - later.offset;
        self.network.least(earlier.point, later.point, weight, WHOLE, Reason { step, why: Why::Order });
    }

    /// `later` comes at most `by` s after `earlier`.
    pub fn window(&mut self, earlier: Moment, later: Moment, by: f64, step: StepId) {
        let weight = by + earlier.offset - later.offset;
        self.network.most(earlier.point, later.point, weight, WHOLE, Reason { step, why: Why::Window(by) });
    }

    /// The point at which all moments have come.
    pub fn join(&mut self, moments: &[Moment], step: StepId) -> Moment {
        let mut latest: Vec<Moment> = Vec::new();
        for moment in moments {
            match latest.iter_mut().find(|m| m.point == moment.point) {
                Some(known) => known.offset = known.offset.max(moment.offset),
                None => latest.push(*moment),
            }
        }
        // Nothing is before the beginning.
        if latest.len() > 1 {
            latest.retain(|m| m.point != BEGIN || m.offset > 0.0);
        }
        match latest.as_slice() {
            [] => Moment::BEGIN,
            [one] => *one,
            many => {
                let point = self.network.point();
                many.iter().for_each(|m| self.least(*m, Moment::of(point), 0.0, step));
                self.joins.push((point, many.to_vec()));
                Moment::of(point)
            }
        }
    }

    /// Times with further differences, as early as possible; with or without the windows.
    pub fn earliest(&self, further: &[Edge], windows: bool) -> Option<Vec<f64>> {
        let mut network = self.network.clone();
        if !windows {
            network.edges.retain(|e| e.reason.why == Why::Order);
        }
        network.edges.extend_from_slice(further);
        network.least_from(BEGIN, &[WHOLE]).ok()
    }

    /// Whether times keep every window.
    pub fn keeps_windows(&self, times: &[f64]) -> bool {
        let at = |p: Point| times.get(p.0 as usize).copied().unwrap_or(0.0);
        self.network.edges.iter().all(|e| at(e.to) - at(e.from) >= e.weight - 10.0 * matterix_timing::ROUNDING)
    }

    /// The earliest times with an order of the tasks that keep every window: without pauses if that will do, else with
    /// blocks that are held back.
    pub fn settled(&self, order: &[(usize, usize)]) -> Option<Vec<f64>> {
        let edges: Vec<Edge> = order.iter().map(|&(a, b)| self.before(a, b)).collect();
        let early = self.earliest(&edges, false)?;
        if self.keeps_windows(&early) {
            return Some(early);
        }
        // Only blocks can be held back: what joins goes on at once.
        let held = self.earliest(&edges, true)?;
        let latest = |moments: &[Moment]| moments.iter().map(|m| m.time(&held)).fold(0.0, f64::max);
        let at_once = |(point, moments): &(Point, Vec<Moment>)| {
            Moment::of(*point).time(&held) <= latest(moments) + 10.0 * matterix_timing::ROUNDING
        };
        self.joins.iter().all(at_once).then_some(held)
    }

    /// Pairs of tasks that need the same instance and are not inside one another.
    pub fn rivals(&self) -> Vec<(usize, usize)> {
        let mut pairs = Vec::new();
        for (i, a) in self.tasks.iter().enumerate() {
            for (k, b) in self.tasks.iter().enumerate().skip(i + 1) {
                let nested = a.around.contains(&k) || b.around.contains(&i);
                if !nested && a.instances.iter().any(|x| b.instances.contains(x)) {
                    pairs.push((i, k));
                }
            }
        }
        pairs
    }

    /// That one task ends before another begins.
    pub fn before(&self, first: usize, second: usize) -> Edge {
        let (first, second) = (&self.tasks[first], &self.tasks[second]);
        Edge {
            from: first.end.point,
            to: second.start,
            weight: first.end.offset,
            scope: WHOLE,
            reason: Reason { step: second.step, why: Why::Order },
        }
    }
}
