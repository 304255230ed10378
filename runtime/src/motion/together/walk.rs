//! Follows a plan to where lines run beside each other, and each of those lines alone.

use std::collections::BTreeSet;

use matterix_ir::model::Action;
use matterix_ir::plan::{Motion, Operation, Step, StepId};
use matterix_ir::scene::InstanceId;
use matterix_ir::{Diagnostic, Program, Span};

use super::grid::{Line, deadlock};
use super::leg::Leg;
use super::pair::{Times, finding, may_meet};
use crate::motion::preflight::beside::Job;
use crate::motion::preflight::supported;
use crate::motion::preflight::values::Values;
use crate::motion::stage::Stage;
use crate::motion::tempo::tempi;

/// How many motions are followed before a plan counts as too long to be looked at whole.
const MOST: usize = 2000;
/// How many turns of a loop are followed.
const TURNS: u32 = 2;

/// Robots that may meet, or must, in a plan, but for pairs that have been told of.
pub fn follow<'p>(program: &'p Program, stage: Stage<'p>, told: Vec<[InstanceId; 2]>) -> Vec<Diagnostic> {
    let is_beside = |s: &Step| matches!(s, Step::Parallel(_) | Step::Start { .. });
    if !program.plan.steps.iter().any(|s| is_beside(&s.step)) {
        return Vec::new();
    }
    let (times, values) = (Times::of(program), Values::at_start(program));
    let mut walk = Walk {
        program,
        times: &times,
        stage,
        values,
        sites: Vec::new(),
        claims: Vec::new(),
        line: None,
        blocked: false,
        left: MOST,
        found: Vec::new(),
        told,
    };
    walk.step(program.plan.root);
    walk.found
}

#[derive(Clone)]
struct Walk<'p, 't> {
    program: &'p Program,
    times: &'t Times,
    stage: Stage<'p>,
    values: Values,
    /// The statements of the user's own around what is followed, innermost last.
    sites: Vec<Span>,
    /// What is claimed around it.
    claims: Vec<InstanceId>,
    /// What the line that is followed alone carries out; nothing where all of the plan is followed.
    line: Option<Line>,
    /// A motion could not be carried out because another robot is in its way.
    blocked: bool,
    left: usize,
    found: Vec<Diagnostic>,
    /// Robots that are in each other before they move.
    told: Vec<[InstanceId; 2]>,
}

impl<'p> Walk<'p, '_> {
    fn step(&mut self, id: StepId) {
        let at = self.program.plan.get(id);
        let own = self.program.files.get(at.span.file.0 as usize).is_some_and(|f| !f.starts_with("std::"));
        self.sites.extend(own.then_some(at.span));
        self.inside(id);
        self.sites.truncate(self.sites.len() - usize::from(own));
    }

    fn inside(&mut self, id: StepId) {
        let program = self.program;
        match &program.plan.get(id).step {
            Step::Operation(operation) => self.operation(id, operation),
            Step::Sequence(list) => self.sequence(list),
            Step::Parallel(list) => self.beside(&list.iter().map(|id| vec![*id]).collect::<Vec<_>>()),
            Step::If { condition, then, otherwise } => match self.values.value(&program.model, condition.node) {
                Some(0.0) => otherwise.iter().for_each(|id| self.step(*id)),
                Some(_) => self.step(*then),
                None => self.either(*then, *otherwise),
            },
            Step::Try(all) => all.iter().take(1).for_each(|id| self.step(*id)),
            Step::Guarded { body, finally, .. } => {
                self.step(*body);
                finally.iter().for_each(|id| self.step(*id));
            }
            Step::Repeat { times, body } => {
                let times = self.values.value(&program.model, *times);
                self.perhaps(times.is_none());
                let turns = times.map_or(TURNS, |n| n.clamp(0.0, f64::from(TURNS)) as u32);
                (0..turns).for_each(|_| self.step(*body));
            }
            Step::RepeatWhile { condition, body, .. } => {
                self.perhaps(true);
                for _ in 0..TURNS {
                    if self.values.value(&program.model, condition.node) != Some(0.0) {
                        self.step(*body);
                    }
                }
            }
            Step::Claim { claims, body } => {
                let before = self.claims.len();
                self.claims.extend(claims);
                self.step(*body);
                self.claims.truncate(before);
            }
            other => other.children().into_iter().for_each(|child| self.step(child)),
        }
    }

    /// What follows may be left out in some runs.
    fn perhaps(&mut self, unsure: bool) {
        if let Some(line) = self.line.as_mut().filter(|_| unsure) {
            line.strict = false;
        }
    }

    /// Both ways, of which the first is gone on with.
    fn either(&mut self, then: StepId, otherwise: Option<StepId>) {
        self.perhaps(true);
        let before = (self.stage.clone(), self.values.clone());
        self.step(then);
        if let Some(otherwise) = otherwise {
            let after = (self.stage.clone(), self.values.clone());
            (self.stage, self.values) = before;
            self.step(otherwise);
            (self.stage, self.values) = after;
        }
    }

    fn operation(&mut self, id: StepId, operation: &Operation) {
        // As in a run, what a motion depends on is what was before its operation began.
        if let Some(motion) = operation.motion.as_ref().filter(|_| self.left > 0) {
            self.left -= 1;
            self.motion(id, motion, operation);
        }
        self.act(&operation.at_start);
        self.act(&operation.at_end);
        self.stage.let_go(operation.motion.as_ref());
        let (values, model) = (&self.values, &self.program.model);
        self.stage.follow_joints(|node| values.value(model, node));
    }

    fn motion(&mut self, id: StepId, motion: &Motion, operation: &Operation) {
        let model = &self.program.model;
        // What only a run can tell is left to the run.
        let Some(motion) = &motion.chosen(|node| self.values.value(model, node)) else { return self.perhaps(true) };
        let values = self.values.of_motion(model, &self.stage, motion, operation);
        let Some(values) = values else { return self.perhaps(true) };
        let straight = matches!(motion, Motion::By { straight: true, .. } | Motion::To { straight: true, .. });
        self.stage.keep_time(tempi(&model.paces, |node| self.values.value(model, node)));
        let before = self.stage.clone();
        match self.stage.perform(motion, &values) {
            Ok(Some(performed)) => {
                let site = self.sites.last().copied().unwrap_or_default();
                let claims = self.claims.clone();
                if let Some(line) = &mut self.line {
                    line.legs.extend(Leg::of(&self.stage, &performed, (id, site), straight, claims));
                }
            }
            Ok(None) => {}
            Err(refused) => {
                self.blocked |= self.stage.is_by_a_robot(&refused);
                self.stage = before;
                // What cannot be done is another finding; what would come after it is not known.
                self.perhaps(true);
            }
        }
    }

    /// The states change, and things stand where they say.
    fn act(&mut self, actions: &[Action]) {
        for action in actions {
            let Action::Assign { state, value, .. } = action else { continue };
            let value = self.values.assign(&self.program.model, *state, *value);
            value.into_iter().for_each(|value| self.stage.follow_load(*state, value));
            let Some(state) = self.program.model.states.get(*state as usize) else { continue };
            if let (Some(value), Some(id)) = (value, supported(&self.program.scene, &state.name, &state.domain)) {
                self.stage.follow(id, (value >= 0.0).then_some(InstanceId(value as u32)));
            }
        }
    }

    /// One after the other; a job runs beside what follows it, until it is awaited.
    fn sequence(&mut self, list: &[StepId]) {
        let Some(job) = Job::first(&self.program.plan, list) else {
            return list.iter().for_each(|id| self.step(*id));
        };
        job.before.iter().for_each(|id| self.step(*id));
        self.beside(&[vec![job.body], job.meanwhile.to_vec()]);
        self.sequence(job.later);
    }

    /// Lines that run beside each other: what is said of their robots, and then all of them, one after the other.
    fn beside(&mut self, lines: &[Vec<StepId>]) {
        let robots: Vec<BTreeSet<InstanceId>> = lines.iter().map(|line| self.robots(line)).collect();
        let moving: Vec<usize> = (0..lines.len()).filter(|i| !robots[*i].is_empty()).collect();
        match &mut self.line {
            Some(line) if moving.len() > 1 => line.strict = false,
            None if moving.len() > 1 => self.look(lines, &robots, &moving),
            _ => {}
        }
        lines.iter().for_each(|line| self.sequence(line));
    }

    fn look(&mut self, lines: &[Vec<StepId>], robots: &[BTreeSet<InstanceId>], moving: &[usize]) {
        let alone: Vec<Line> = moving.iter().map(|i| self.alone(*i, lines, robots)).collect();
        for (k, (i, a)) in moving.iter().zip(&alone).enumerate() {
            for (j, b) in moving.iter().zip(&alone).skip(k + 1) {
                // One robot in two lines is said elsewhere.
                let told = |[x, y]: &[InstanceId; 2]| {
                    let has = |r: &InstanceId| robots[*i].contains(r) || robots[*j].contains(r);
                    has(x) && has(y)
                };
                if !robots[*i].is_disjoint(&robots[*j]) || self.told.iter().any(told) {
                    continue;
                }
                let must = deadlock(a, b).filter(|_| {
                    self.is_blocked(&[&lines[*i], &lines[*j]]) && self.is_blocked(&[&lines[*j], &lines[*i]])
                });
                let found = match must {
                    Some(met) => Some(finding(self.program, met, true)),
                    None => may_meet(a, b, self.times).map(|met| finding(self.program, met, false)),
                };
                self.found.extend(found);
            }
        }
    }

    /// The motions of one line as if the robots of the others were not there.
    fn alone(&self, which: usize, lines: &[Vec<StepId>], robots: &[BTreeSet<InstanceId>]) -> Line {
        let mut walk = self.clone();
        let others = robots.iter().enumerate().filter(|(i, _)| *i != which).flat_map(|(_, all)| all);
        walk.stage.unknown.postures.extend(others.filter(|r| !robots[which].contains(r)));
        walk.line = Some(Line { legs: Vec::new(), strict: true });
        walk.sequence(&lines[which]);
        walk.line.unwrap_or_default()
    }

    /// Whether a robot is in the way when these lines are done one after the other.
    fn is_blocked(&self, lines: &[&Vec<StepId>]) -> bool {
        let mut walk = self.clone();
        walk.line = Some(Line::default());
        walk.blocked = false;
        lines.iter().for_each(|line| walk.sequence(line));
        walk.blocked
    }

    /// The robots that steps move.
    fn robots(&self, steps: &[StepId]) -> BTreeSet<InstanceId> {
        let mut out = BTreeSet::new();
        let mut open = steps.to_vec();
        while let Some(id) = open.pop() {
            let step = &self.program.plan.get(id).step;
            open.extend(step.children());
            let Step::Operation(operation) = step else { continue };
            let travels =
                |m: &&Motion| !matches!(m, Motion::Grip { .. } | Motion::Free { .. } | Motion::Fingers { .. });
            out.extend(operation.motion.iter().find(travels).and_then(|m| self.stage.actor_of(m.mover())));
        }
        out
    }
}
