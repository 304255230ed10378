//! What is seen of one run of a study.

use matterix_ir::study::{Keep, Study};
use matterix_ir::values::{Bounds, Formula, Formulas, Numbers};

use super::stretch::Stretch;
use crate::exec::Listener;
use crate::process::{Engine, Observer};
use crate::touched::{Below, Touched};

/// A quantity over time, so far.
struct Course {
    formula: Formula,
    kept: f64,
    /// How far it has been followed, s.
    until: f64,
}

/// Follows a run and takes its reports at its end.
pub(super) struct Watcher<'s> {
    study: &'s Study,
    /// How many values the plan keeps.
    locals: usize,
    /// Once there is a model.
    seen: Option<Seen>,
    /// In the order of the study, SI.
    pub(super) reports: Vec<Option<f64>>,
}

/// The quantities over time.
struct Seen {
    since: f64,
    courses: Vec<Course>,
    /// By what they rest on.
    values: Touched,
}

impl Seen {
    fn begin(study: &Study, engine: &Engine<'_>) -> Seen {
        let (model, mut formulas) = (engine.model(), Formulas::default());
        let courses = study.over_time.iter().map(|over| {
            let now = engine.eval(over.value);
            let kept = if over.keep == Keep::Mean { 0.0 } else { now };
            Course { formula: formulas.of(&model.graph, over.value).clone(), kept, until: engine.time() }
        });
        let courses = courses.collect();
        let below = study.over_time.iter().map(|over| Below::new(model, &[over.value]));
        Seen { since: engine.time(), courses, values: Touched::new(model.states.len(), below) }
    }

    /// Goes on to now; all of it is smooth since these quantities were looked at last, but perhaps for a jump at this instant.
    fn follow(&mut self, study: &Study, engine: &Engine<'_>, touched: &[u32]) {
        let time = engine.time();
        for &index in touched {
            let (over, course) = (&study.over_time[index as usize], &mut self.courses[index as usize]);
            let piece = (course.until, time);
            if piece.0 < piece.1 {
                course.pass(over.keep, engine, piece);
            }
            let now = engine.eval(over.value);
            course.kept = match over.keep {
                Keep::Mean => course.kept,
                _ if course.kept.is_nan() || now.is_nan() => f64::NAN,
                Keep::Largest => course.kept.max(now),
                Keep::Smallest => course.kept.min(now),
            };
        }
    }
}

impl Course {
    fn pass(&mut self, keep: Keep, engine: &Engine<'_>, piece: (f64, f64)) {
        // What is the greatest of the opposite is the least.
        let sign = if keep == Keep::Smallest { -1.0 } else { 1.0 };
        let (formula, mut room, mut space) = (&self.formula, Vec::new(), Vec::new());
        let mut value = |time| {
            let then = Numbers(|op| Some(engine.leaf_at(op, time)));
            sign * formula.value(&then, &mut room).unwrap_or(f64::NAN)
        };
        let mut bounds = |piece| {
            let then = Bounds(|op| engine.leaf_over(op, piece));
            let (low, high) = formula.value(&then, &mut space).unwrap_or(matterix_ir::interval::ALL);
            if sign < 0.0 { (-high, -low) } else { (low, high) }
        };
        let mut stretch = Stretch { value: &mut value, bounds: &mut bounds };
        self.until = piece.1;
        match keep {
            Keep::Mean => self.kept += stretch.integral(piece),
            _ if self.kept.is_nan() => {}
            _ => self.kept = sign * stretch.greatest(piece, sign * self.kept),
        }
    }
}

impl<'s> Watcher<'s> {
    /// A run that has not begun.
    pub(super) fn new(study: &'s Study, locals: usize) -> Self {
        Watcher { study, locals, seen: None, reports: vec![None; study.reports.len()] }
    }
}

impl Observer for Watcher<'_> {
    fn sample(&mut self, _: f64, engine: &Engine<'_>, changed: &[u32]) {
        let study = self.study;
        let Some(seen) = &mut self.seen else { return };
        let touched = seen.values.by(changed);
        seen.follow(study, engine, &touched);
    }

    fn begun(&mut self, _: f64, engine: &Engine<'_>) {
        self.seen = Some(Seen::begin(self.study, engine));
    }

    fn leaves(&mut self, time: f64, engine: &Engine<'_>, states: &[u32]) {
        self.sample(time, engine, states);
    }

    fn event(&mut self, _: f64, _: usize) {}

    fn process(&mut self, _: f64, _: usize, _: bool) {}
}

impl Listener for Watcher<'_> {
    fn ended(&mut self, engine: &Engine<'_>) {
        let study = self.study;
        let seen = self.seen.get_or_insert_with(|| Seen::begin(study, engine));
        let all = seen.values.all();
        seen.follow(study, engine, &all);
        let passed = engine.time() - seen.since;
        let mut locals = engine.locals().to_vec();
        locals.resize(self.locals.max(locals.len()), f64::NAN);
        for (over, course) in study.over_time.iter().zip(&seen.courses) {
            let kept = match over.keep {
                Keep::Mean if passed <= 0.0 => engine.eval(over.value),
                Keep::Mean => course.kept / passed,
                _ => course.kept,
            };
            if let Some(slot) = locals.get_mut(over.local as usize) {
                *slot = kept;
            }
        }
        let values = self.study.reports.iter().map(|r| engine.eval_kept(r.value, &locals));
        self.reports = values.map(|v| Some(v).filter(|v| v.is_finite())).collect();
    }
}
