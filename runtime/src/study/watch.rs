//! What is seen of one run of a study.

use matterix_ir::study::{Keep, Study};

use crate::exec::Listener;
use crate::process::{Engine, Observer};
use crate::touched::{Below, Touched};

/// A quantity over time, so far.
#[derive(Clone, Copy, Debug)]
struct Course {
    kept: f64,
    /// The last time, s, and the value then.
    last: Option<(f64, f64)>,
    since: f64,
}

/// Follows a run and takes its reports at its end.
pub(super) struct Watcher<'s> {
    study: &'s Study,
    /// How many values the plan keeps.
    locals: usize,
    courses: Vec<Course>,
    /// The quantities by what they rest on, once there is a model.
    values: Option<Touched>,
    /// In the order of the study, SI.
    pub(super) reports: Vec<Option<f64>>,
}

impl<'s> Watcher<'s> {
    /// A run that has not begun.
    pub(super) fn new(study: &'s Study, locals: usize) -> Self {
        let courses = study.over_time.iter().map(|o| Course {
            kept: match o.keep {
                Keep::Largest => f64::NEG_INFINITY,
                Keep::Smallest => f64::INFINITY,
                Keep::Mean => 0.0,
            },
            last: None,
            since: 0.0,
        });
        Watcher { study, locals, courses: courses.collect(), values: None, reports: vec![None; study.reports.len()] }
    }

    fn follow(&mut self, time: f64, engine: &Engine<'_>, touched: &[u32]) {
        for &index in touched {
            let (over, course) = (&self.study.over_time[index as usize], &mut self.courses[index as usize]);
            let value = engine.eval(over.value);
            match over.keep {
                Keep::Largest => course.kept = course.kept.max(value),
                Keep::Smallest => course.kept = course.kept.min(value),
                // The rule of trapezia over the solver's own steps: it goes on as it did while it is not shown.
                Keep::Mean => match course.last {
                    Some((before, was)) => course.kept += 0.5 * (value + was) * (time - before),
                    None => course.since = time,
                },
            }
            course.last = Some((time, value));
        }
    }
}

impl Observer for Watcher<'_> {
    fn sample(&mut self, time: f64, engine: &Engine<'_>, changed: &[u32]) {
        let is_first = self.values.is_none();
        let values = self.values.get_or_insert_with(|| {
            let (study, model) = (self.study, engine.model());
            Touched::new(model.states.len(), study.over_time.iter().map(|o| Below::new(model, &[o.value])))
        });
        let touched = if is_first { values.all() } else { values.by(changed) };
        self.follow(time, engine, &touched);
    }

    fn event(&mut self, _: f64, _: usize) {}

    fn process(&mut self, _: f64, _: usize, _: bool) {}
}

impl Listener for Watcher<'_> {
    fn ended(&mut self, engine: &Engine<'_>) {
        let time = engine.time();
        let all: Vec<u32> = (0..self.courses.len() as u32).collect();
        self.follow(time, engine, &all);
        let mut locals = engine.locals().to_vec();
        locals.resize(self.locals.max(locals.len()), f64::NAN);
        for (over, course) in self.study.over_time.iter().zip(&self.courses) {
            let passed = time - course.since;
            let kept = match (over.keep, course.last) {
                (Keep::Mean, Some((_, value))) if passed <= 0.0 => value,
                (Keep::Mean, _) => course.kept / passed,
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
