//! Follows a plan along all ways through it: branches both ways unless what is known decides, loops until nothing new
//! comes of them, handlers from where a failure may be raised.

use std::collections::BTreeSet;

use matterix_ir::plan::{Caught, Condition, Operation, Step, StepId};
use matterix_ir::scene::{InstanceId, Stand};
use matterix_ir::{Diagnostic, NodeId, Program, Severity, Span, codes};

use super::beside::{Job, Moved};
use super::course::{Cause, Course, Refusal};
use super::diagnostics;
use super::look::{Looker, on_step};
use super::memory::Memory;
use super::offer::{self, Missed};
use super::starts::Starts;
use super::values::Values;
use crate::motion::carried::Carried;
use crate::motion::refused::Refused;
use crate::motion::stage::Stage;

/// How many courses are followed at a time.
const COURSES: usize = 6;
/// How many other places for a goal out of reach are tried.
const TRIES: usize = 6;
/// How many turns of a loop are followed.
const TURNS: u32 = 4;

/// What would go wrong with the motions of a program in a lab, and which robots are in each other before they move.
pub fn follow<'p>(
    program: &'p Program,
    stage: Stage<'p>,
    memory: Memory<'_>,
) -> (Vec<Diagnostic>, Vec<[InstanceId; 2]>) {
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
        starts: Starts::default(),
        causes: Vec::new(),
        trying: false,
        unsure: 0,
    };
    walk.step(
        program.plan.root,
        vec![Course { stage, values, choices: Vec::new(), assumed: BTreeSet::new(), lost: None }],
    );
    let Walk { looker, found, starts, .. } = walk;
    looker.keep();
    (found.into_iter().map(|f| f.finding).collect(), starts.told())
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
    /// What robots are in where lines that run beside each other begin.
    starts: Starts,
    /// What has been said to be wrong for certain.
    causes: Vec<Cause>,
    /// Whether a statement is followed to see if it could be done with something elsewhere.
    trying: bool,
    /// How many steps around may be left out without a condition of the plan's own.
    unsure: usize,
}

type Courses<'p> = Vec<Course<'p>>;

impl<'p> Walk<'p, '_> {
    /// Says once that what a plan may be looked at is used up before this step.
    fn ends_here(&mut self, id: StepId) {
        if self.found.iter().any(|f| f.finding.code == codes::NOT_ANALYSED) {
            return;
        }
        let span = self.program.plan.get(id).span;
        let site = if self.is_own(span) { span } else { self.sites.last().copied().unwrap_or(span) };
        let headline = "`check` followed the motions of this workflow only up to here: there are too many";
        let label = "later motions are not checked for reach and collisions";
        let finding = Diagnostic::warning(codes::NOT_ANALYSED, site, headline, label)
            .help("split the workflow: each part is then checked in full");
        self.found.push(Found { site, call: None, finding });
    }

    fn step(&mut self, id: StepId, courses: Courses<'p>) -> Courses<'p> {
        if courses.is_empty() {
            return courses;
        }
        if self.looker.is_done() {
            self.ends_here(id);
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
            let start = course.clone();
            let mut ends = self.inside(id, vec![course]);
            let all_lost = !ends.is_empty() && ends.iter().all(|c| c.lost.is_some());
            let mut first = None;
            for end in &mut ends {
                let Some(lost) = end.lost.take() else { continue };
                recover(end, &start.stage);
                let handled = self.raise(lost.failure, end);
                // What never came to where it counts as being is judged there no more.
                let follows = lost.cause.things.iter().any(|thing| start.assumed.contains(thing));
                if !follows {
                    first.get_or_insert((lost, handled, end.choices.clone()));
                }
            }
            if let Some((mut lost, handled, choices)) = first {
                if refused.is_empty()
                    && let Some(place) = lost.missed.as_ref().and_then(|missed| self.offer(id, &start, missed))
                {
                    lost.finding = lost.finding.help(place);
                }
                // The rest of what is guarded is not reached.
                if handled && all_lost {
                    ends.clear();
                }
                refused.push((lost, all_lost && !handled, choices));
            }
            after.extend(ends);
        }
        let must = refused.len() == count && refused.iter().all(|r| r.1) && self.unsure == 0;
        if let Some((lost, _, choices)) = refused.into_iter().next()
            && !(lost.cause.key.is_some() && self.causes.contains(&lost.cause))
        {
            self.causes.extend(must.then(|| lost.cause.clone()));
            self.tell(lost.finding, must, if must { Vec::new() } else { choices });
        }
        merge(after)
    }

    /// Where something would have to stand for a statement to be done from here, in words; the nearest such place. Where
    /// something else is in the way of that as well, at least so that the thing itself is reached.
    fn offer(&mut self, id: StepId, start: &Course<'p>, missed: &Missed) -> Option<String> {
        if self.trying || !self.beside.is_empty() {
            return None;
        }
        self.trying = true;
        let raised = std::mem::take(&mut self.raised);
        let mut places = offer::places(&start.stage, &self.program.plan, id, missed);
        let (mut whole, mut partly) = (None, None);
        for _ in 0..TRIES {
            if places.is_empty() || whole.is_some() {
                break;
            }
            let place = places.remove(0);
            // What fails here fails close to it as well.
            places.retain(|other| other.is_apart(&place));
            let mut course = start.clone();
            course.stage.hasty = true;
            course.stage.carried.set(place.thing, place.stand);
            let ends = self.inside(id, vec![course]);
            let fails =
                |lost: &Option<Box<Refusal>>| lost.as_ref().is_some_and(|l| l.cause.things.contains(&place.thing));
            if !ends.is_empty() && ends.iter().all(|end| end.lost.is_none()) {
                whole = Some(place.words);
            } else if partly.is_none()
                && place.thing == start.stage.whole(missed.goal)
                && ends.iter().all(|end| !fails(&end.lost))
            {
                partly = Some(place.words);
            }
        }
        self.raised = raised;
        self.trying = false;
        whole.or(partly)
    }

    /// Each statement is reported once for each call that leads to it: an error where no course gets past it.
    fn tell(&mut self, mut finding: Diagnostic, must: bool, choices: Vec<(Span, bool)>) {
        if self.trying {
            return;
        }
        let site = self.sites.last().copied().unwrap_or_default();
        let around = |outer: &&Span| outer.file != site.file || outer.start > site.start || outer.end < site.end;
        let call = self.sites.iter().rev().find(around).copied();
        if let Some(call) = call {
            finding = finding.because(call, "called here");
        }
        if !must {
            finding.severity = Severity::Warning;
            for (at, held) in choices {
                finding = finding.because(at, if held { "if this is true" } else { "if this is false" });
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
        let over = course.runs_over(&self.program.model).map(|(vessel, _)| vessel);
        // As in a run, what a motion depends on is what was before its operation began.
        if operation.motion.is_some() && course.lost.is_none() {
            let site = self.sites.last().copied().unwrap_or(span);
            let beside = std::mem::take(&mut self.beside);
            match self.overlap(&course, operation) {
                Some(why) => self.looker.cannot(&mut course, operation, &why, site),
                None => self.looker.motion(&mut course, operation, site, &beside),
            }
            self.beside = beside;
            if let Some(lost) = &mut course.lost {
                lost.finding = on_step(lost.finding.clone(), span);
            }
        }
        course.act(self.program, &operation.at_start);
        course.act(self.program, &operation.at_end);
        course.stage.let_go(operation.motion.as_ref());
        if course.lost.is_none()
            && let Some((vessel, by)) =
                course.runs_over(&self.program.model).filter(|(vessel, _)| over != Some(*vessel))
        {
            let site = self.sites.last().copied().unwrap_or(span);
            let finding = on_step(diagnostics::over(&course.stage, vessel, by, site), span);
            course.lost =
                Some(Box::new(Refusal { failure: "spilled", finding, cause: Cause::default(), missed: None }));
        }
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
            let finding = on_step(diagnostics::swing(&course.stage, id, &meeting, site), span);
            course.lost =
                Some(Box::new(Refusal { failure: "collision", finding, cause: Cause::default(), missed: None }));
            // Where it has been pushed to nobody knows.
            if let Some(robot) = meeting.with.filter(|with| course.stage.actors.contains_key(with)) {
                course.drifts(robot);
            }
        }
        course
    }

    /// What the robot of an operation was in when the lines began that run beside each other.
    fn overlap(&mut self, course: &Course<'p>, operation: &Operation) -> Option<Refused> {
        let motion = operation.motion.as_ref()?;
        self.starts.take(motion, course.stage.actor_of(motion.mover())?)
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
        if let Some(course) = courses.first() {
            self.starts.look(&course.stage, own, others);
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
            let ends = self.step(body, now);
            let news: Vec<bool> = ends.iter().map(|c| seen.insert(c.digest())).collect();
            now = match times {
                Some(_) => ends,
                None => {
                    after.extend(ends.iter().cloned());
                    ends.into_iter().zip(&news).filter_map(|(course, new)| new.then_some(course)).collect()
                }
            };
            if !news.contains(&true) {
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
        let id = InstanceId(index as u32);
        if before.below(id) != Some(*below) {
            course.assumed.insert(id);
        }
        course.follow(id, Some(*below));
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
