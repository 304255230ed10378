//! Follows a plan along all ways through it: branches both ways unless what is known decides, loops until nothing new
//! comes of them, handlers from where a failure may be raised.

use std::collections::BTreeSet;

use matterix_ir::plan::{Caught, Condition, Operation, Step, StepId};
use matterix_ir::scene::{InstanceId, Stand};
use matterix_ir::{Diagnostic, NodeId, Program, Severity, Span};

use super::beside::{Job, Moved};
use super::course::{Course, Refusal};
use super::look::{Looker, on_step};
use super::memory::Memory;
use super::told;
use super::values::Values;
use crate::motion::stage::{Carried, Stage};

/// How many courses are followed at a time.
const COURSES: usize = 6;
/// How many turns of a loop are followed.
const TURNS: u32 = 4;

/// What would go wrong with the motions of a program in a lab.
pub fn follow<'p>(program: &'p Program, stage: Stage<'p>, memory: Memory<'_>) -> Vec<Diagnostic> {
    let mut stage = stage;
    let ids = (0..program.scene.instances.len() as u32).map(InstanceId);
    stage.unknown.places = ids.filter(|id| !program.scene.get(*id).placed).collect();
    let values = Values::at_start(program);
    let looker = Looker::new(program, &stage, memory);
    let mut walk = Walk {
        program,
        looker,
        found: Vec::new(),
        sites: Vec::new(),
        raised: Vec::new(),
        beside: Moved::default(),
        unsure: 0,
    };
    walk.step(program.plan.root, vec![Course { stage, values, choices: Vec::new(), lost: None }]);
    let Walk { looker, found, .. } = walk;
    looker.keep();
    found.into_iter().map(|f| f.finding).collect()
}

/// What was found at a statement reached by a call.
struct Found {
    site: Span,
    call: Option<Span>,
    finding: Diagnostic,
}

/// Courses on which a failure may be raised inside a step with handlers.
struct Raised<'p> {
    /// Failures its handlers take; every one where there is none named.
    caught: Vec<Caught>,
    courses: Vec<(String, Course<'p>)>,
}

struct Walk<'p, 's> {
    program: &'p Program,
    looker: Looker<'p, 's>,
    found: Vec<Found>,
    /// The statements of the user's files that are being followed, the innermost last.
    sites: Vec<Span>,
    /// One for each step with handlers that is being followed, the innermost last.
    raised: Vec<Raised<'p>>,
    /// What moves at the same time.
    beside: Moved,
    /// How many steps around may be left out without a condition of the plan's own.
    unsure: usize,
}

type Courses<'p> = Vec<Course<'p>>;

impl<'p> Walk<'p, '_> {
    fn step(&mut self, id: StepId, courses: Courses<'p>) -> Courses<'p> {
        if courses.is_empty() || self.looker.is_done() {
            return courses;
        }
        let at = self.program.plan.get(id);
        if !self.is_own(at.span) {
            return self.inside(id, courses);
        }
        self.sites.push(at.span);
        let children = at.step.children();
        let after = match children.iter().any(|c| self.is_own(self.program.plan.get(*c).span)) {
            true => self.inside(id, courses),
            false => self.statement(id, courses),
        };
        self.sites.pop();
        after
    }

    /// The innermost statement of the user's own text: where a mistake is said.
    fn statement(&mut self, id: StepId, courses: Courses<'p>) -> Courses<'p> {
        let (count, mut refused) = (courses.len(), Vec::new());
        let mut after = Vec::new();
        for course in courses {
            let before = course.stage.clone();
            let mut ends = self.inside(id, vec![course]);
            let all_lost = !ends.is_empty() && ends.iter().all(|c| c.lost.is_some());
            let mut first = None;
            for end in &mut ends {
                let Some(lost) = end.lost.take() else { continue };
                recover(end, &before);
                let handled = self.raise(lost.failure, end);
                first.get_or_insert((lost, handled, end.choices.clone()));
            }
            if let Some((lost, handled, choices)) = first {
                // The rest of what is guarded is not reached.
                if handled && all_lost {
                    ends.clear();
                }
                refused.push((lost, all_lost && !handled, choices));
            }
            after.extend(ends);
        }
        let must = refused.len() == count && refused.iter().all(|r| r.1) && self.unsure == 0;
        if let Some((lost, _, choices)) = refused.into_iter().next() {
            self.tell(lost.finding, must, if must { Vec::new() } else { choices });
        }
        merge(after)
    }

    /// Each statement is reported once for each call that leads to it: an error where no course gets past it.
    fn tell(&mut self, mut finding: Diagnostic, must: bool, choices: Vec<(Span, bool)>) {
        let site = self.sites.last().copied().unwrap_or_default();
        let around = |outer: &&Span| outer.file != site.file || outer.start > site.start || outer.end < site.end;
        let call = self.sites.iter().rev().find(around).copied();
        if let Some(call) = call {
            finding = finding.because(call, "called here");
        }
        if !must {
            finding.severity = Severity::Warning;
            for (at, held) in choices {
                finding = finding.because(at, if held { "where this holds" } else { "where this does not hold" });
            }
        }
        match self.found.iter_mut().find(|f| f.site == site && f.call == call) {
            Some(known) if known.finding.severity == Severity::Warning && must => known.finding = finding,
            Some(_) => {}
            None => self.found.push(Found { site, call, finding }),
        }
    }

    /// Whether a place is in the user's own files.
    fn is_own(&self, span: Span) -> bool {
        self.program.files.get(span.file.0 as usize).is_some_and(|name| !name.starts_with("std::"))
    }

    /// A failure may be raised on a course; says whether a handler takes it.
    fn raise(&mut self, failure: &str, course: &Course<'p>) -> bool {
        let takes = |r: &&mut Raised<'p>| {
            r.caught.iter().any(|c| match c {
                Caught::Named(name) => name == failure,
                Caught::Any => true,
            })
        };
        let Some(raised) = self.raised.iter_mut().rev().find(takes) else { return false };
        // In the midst of an operation nothing is where it was to be.
        let mut course = course.clone();
        let robots: Vec<InstanceId> = course.stage.actors.keys().copied().collect();
        robots.into_iter().for_each(|robot| course.drifts(robot));
        raised.courses.push((failure.to_string(), course));
        true
    }

    fn inside(&mut self, id: StepId, courses: Courses<'p>) -> Courses<'p> {
        let program = self.program;
        let at = program.plan.get(id);
        match &at.step {
            Step::Operation(operation) => {
                courses.into_iter().map(|course| self.operation(course, operation, at.span)).collect()
            }
            Step::Sequence(list) => self.sequence(list, courses),
            Step::Parallel(list) => self.parallel(list, courses),
            Step::If { condition, then, otherwise } => self.branch(condition, *then, *otherwise, courses),
            Step::Try(all) => self.alternatives(all, courses),
            Step::Guarded { body, handlers, finally } => self.guarded(*body, handlers, *finally, courses),
            Step::Repeat { times, body } => self.turns(*body, *times, courses),
            Step::RepeatWhile { condition, body, .. } => self.turns_while(condition, *body, courses),
            Step::Fail { name, .. } => {
                courses.iter().for_each(|course| {
                    self.raise(name, course);
                });
                Vec::new()
            }
            // What is tried again has been looked at.
            Step::Retry { .. } => Vec::new(),
            Step::WaitUntil { timeout: Some(_), .. } | Step::Hold { timeout: Some(_), .. } => {
                courses.iter().for_each(|course| {
                    self.raise("timeout", course);
                });
                courses
            }
            other => other.children().into_iter().fold(courses, |courses, child| self.step(child, courses)),
        }
    }

    fn operation(&mut self, mut course: Course<'p>, operation: &Operation, span: Span) -> Course<'p> {
        if course.lost.is_none() {
            for failure in &operation.fails {
                self.raise(failure, &course);
            }
        }
        // As in a run, what a motion depends on is what was before its operation began.
        if operation.motion.is_some() && course.lost.is_none() {
            let site = self.sites.last().copied().unwrap_or(span);
            let beside = std::mem::take(&mut self.beside);
            self.looker.motion(&mut course, operation, site, &beside);
            self.beside = beside;
            if let Some(lost) = &mut course.lost {
                lost.finding = on_step(lost.finding.clone(), span);
            }
        }
        course.act(self.program, &operation.at_start);
        course.act(self.program, &operation.at_end);
        course.stage.let_go(operation.motion.as_ref());
        let moved = course.follow_joints(&self.program.model);
        // Of what moves at the same time it is not known when.
        let stays = |stage: &Stage<'_>, with: Option<InstanceId>| {
            with.is_none_or(|with| !stage.actors.contains_key(&with) && !stage.fixtures.contains_key(&with))
        };
        if course.lost.is_none()
            && let Some((id, meeting)) = course.stage.swing_meets(&moved)
            && (self.beside.is_empty() || stays(&course.stage, meeting.with))
        {
            let site = self.sites.last().copied().unwrap_or(span);
            let finding = on_step(told::swing(&course.stage, id, &meeting, site), span);
            course.lost = Some(Box::new(Refusal { failure: "collision", finding }));
            // Where it has been pushed to nobody knows.
            if let Some(robot) = meeting.with.filter(|with| course.stage.actors.contains_key(with)) {
                course.drifts(robot);
            }
        }
        course
    }

    /// One after the other; a job runs beside what follows it, until it is awaited.
    fn sequence(&mut self, list: &[StepId], mut courses: Courses<'p>) -> Courses<'p> {
        let plan = &self.program.plan;
        let Some(Job { before, start, meanwhile, later, .. }) = Job::first(plan, list) else {
            return list.iter().fold(courses, |courses, id| self.step(*id, courses));
        };
        courses = before.iter().fold(courses, |courses, id| self.step(*id, courses));
        let Some(stage) = courses.first().map(|c| &c.stage) else { return courses };
        let moved = |ids: &[StepId]| {
            ids.iter().map(|id| Moved::by(plan, *id, stage)).fold(Moved::default(), |all, one| all.and(&one))
        };
        let (job, others) = (moved(std::slice::from_ref(start)), moved(meanwhile));
        courses = self.at_once(&job, &others, courses, |walk, courses| walk.step(*start, courses));
        courses = self.at_once(&others, &job, courses, |walk, courses| walk.sequence(meanwhile, courses));
        self.sequence(later, courses)
    }

    fn parallel(&mut self, list: &[StepId], mut courses: Courses<'p>) -> Courses<'p> {
        let Some(first) = courses.first() else { return courses };
        let moved: Vec<Moved> = list.iter().map(|id| Moved::by(&self.program.plan, *id, &first.stage)).collect();
        for (index, id) in list.iter().enumerate() {
            let others = moved.iter().enumerate().filter(|(i, _)| *i != index).map(|(_, m)| m);
            let others = others.fold(Moved::default(), |all, one| all.and(one));
            courses = self.at_once(&moved[index], &others, courses, |walk, courses| walk.step(*id, courses));
        }
        courses
    }

    /// Follows what moves `own` while `others` move as well.
    fn at_once(
        &mut self,
        own: &Moved,
        others: &Moved,
        mut courses: Courses<'p>,
        follow: impl FnOnce(&mut Self, Courses<'p>) -> Courses<'p>,
    ) -> Courses<'p> {
        if own.is_empty() || others.is_empty() {
            return follow(self, courses);
        }
        let blurred = courses.iter_mut().map(|course| others.blur(course)).reduce(Moved::common).unwrap_or_default();
        let before = self.beside.clone();
        self.beside = std::mem::take(&mut self.beside).and(others);
        let mut after = follow(self, courses);
        self.beside = before;
        after.iter_mut().for_each(|course| blurred.clear(own, course));
        after
    }

    fn branch(
        &mut self,
        condition: &Condition,
        then: StepId,
        otherwise: Option<StepId>,
        courses: Courses<'p>,
    ) -> Courses<'p> {
        let (mut holds, mut fails) = (Vec::new(), Vec::new());
        for course in courses {
            match course.values.value(&self.program.model, condition.node) {
                Some(0.0) => fails.push(course),
                Some(_) => holds.push(course),
                None => {
                    let chosen = |mut course: Course<'p>, held| {
                        if self.is_own(condition.span) {
                            course.choices.push((condition.span, held));
                        }
                        course
                    };
                    fails.push(chosen(course.clone(), false));
                    holds.push(chosen(course, true));
                }
            }
        }
        let mut after = self.step(then, holds);
        after.extend(match otherwise {
            Some(otherwise) => self.step(otherwise, fails),
            None => fails,
        });
        merge(after)
    }

    /// Alternatives: the next from where the one before may fail, or else from before it.
    fn alternatives(&mut self, all: &[StepId], courses: Courses<'p>) -> Courses<'p> {
        let (mut after, mut entries) = (Vec::new(), courses);
        for (index, id) in all.iter().enumerate() {
            if index + 1 == all.len() {
                after.extend(self.step(*id, entries));
                break;
            }
            self.raised.push(Raised { caught: vec![Caught::Any], courses: Vec::new() });
            after.extend(self.step(*id, entries.clone()));
            let raised = self.raised.pop().map(|r| r.courses).unwrap_or_default();
            if !raised.is_empty() {
                entries = merge(raised.into_iter().map(|(_, course)| course).collect());
            }
        }
        merge(after)
    }

    fn guarded(
        &mut self,
        body: StepId,
        handlers: &[(Caught, StepId)],
        finally: Option<StepId>,
        courses: Courses<'p>,
    ) -> Courses<'p> {
        let caught = handlers.iter().map(|(caught, _)| caught.clone()).collect();
        self.raised.push(Raised { caught, courses: Vec::new() });
        let mut after = self.step(body, courses.clone());
        let mut raised = self.raised.pop().map(|r| r.courses).unwrap_or_default();
        for (caught, handler) in handlers {
            let (own, others): (Vec<_>, Vec<_>) = raised.into_iter().partition(|(failure, _)| match caught {
                Caught::Named(name) => name == failure,
                Caught::Any => true,
            });
            raised = others;
            let entries = merge(own.into_iter().map(|(_, course)| course).collect());
            // What can fail at any moment is looked at from the beginning.
            let anywhere = entries.is_empty();
            self.unsure += usize::from(anywhere);
            after.extend(self.step(*handler, if anywhere { courses.clone() } else { entries }));
            self.unsure -= usize::from(anywhere);
        }
        let after = merge(after);
        match finally {
            Some(finally) if after.is_empty() => {
                self.step(finally, courses);
                after
            }
            Some(finally) => self.step(finally, after),
            None => after,
        }
    }

    /// A number of turns, as far as new courses come of them.
    fn turns(&mut self, body: StepId, times: NodeId, courses: Courses<'p>) -> Courses<'p> {
        let known = |course: &Course<'p>| course.values.value(&self.program.model, times);
        let times = courses.first().and_then(known);
        let mut seen: BTreeSet<u128> = courses.iter().map(Course::digest).collect();
        let mut now = courses;
        let mut after = if times.is_none() { now.clone() } else { Vec::new() };
        for turn in 0..TURNS {
            if times.is_some_and(|times| f64::from(turn) >= times) {
                break;
            }
            let ends = self.step(body, now.clone());
            let new: Courses<'p> = ends.iter().filter(|c| seen.insert(c.digest())).cloned().collect();
            match times {
                Some(_) => now = ends,
                None => {
                    after.extend(ends);
                    now.clone_from(&new);
                }
            }
            if new.is_empty() {
                break;
            }
        }
        if times.is_some() { now } else { merge(after) }
    }

    fn turns_while(&mut self, condition: &Condition, body: StepId, courses: Courses<'p>) -> Courses<'p> {
        let mut seen: BTreeSet<u128> = courses.iter().map(Course::digest).collect();
        let (mut now, mut after) = (courses, Vec::new());
        for turn in 0..TURNS {
            let mut inside = Vec::new();
            for course in now {
                match course.values.value(&self.program.model, condition.node) {
                    Some(0.0) => after.push(course),
                    Some(_) => inside.push(course),
                    None => {
                        after.push(course.clone());
                        inside.push(course);
                    }
                }
            }
            self.unsure += usize::from(turn > 0);
            let ends = self.step(body, inside);
            self.unsure -= usize::from(turn > 0);
            now = ends.into_iter().filter(|c| seen.insert(c.digest())).collect();
            if now.is_empty() {
                break;
            }
        }
        after.extend(now);
        merge(after)
    }
}

/// After a statement that cannot be done, robots count as where they were, and things stand where their states say.
fn recover<'p>(course: &mut Course<'p>, before: &Stage<'p>) {
    let after = std::mem::replace(&mut course.stage, before.clone());
    course.stage.unknown.places.extend(&after.unknown.places);
    // Parts stand where the states say as well: they do not move there once more.
    course.stage.fixtures.clone_from(&after.fixtures);
    for (index, carried) in after.carried.iter().enumerate() {
        let (Carried::Stands(Stand::On(below, _)) | Carried::Held(below, _)) = carried else { continue };
        course.follow(InstanceId(index as u32), Some(*below));
    }
    let moved = after.actors.iter().filter(|(id, a)| {
        after.unknown.postures.contains(id) || before.actors.get(id).is_none_or(|b| a.joints != b.joints)
    });
    moved.for_each(|(id, _)| course.drifts(*id));
}

/// Each course once, so many at most, the first of them.
fn merge(courses: Courses<'_>) -> Courses<'_> {
    if courses.len() < 2 {
        return courses;
    }
    let mut seen = BTreeSet::new();
    let mut out = Vec::new();
    for course in courses {
        if out.len() < COURSES && seen.insert(course.digest()) {
            out.push(course);
        }
    }
    out
}
