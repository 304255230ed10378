//! Branches and jobs side by side, in the order of time, as far as the text writes their times.
//!
//! Branches are followed one after the other elsewhere, which says nothing of a step that another branch disturbs while it goes on. Here
//! each line of steps goes on until it waits, and then the line whose time comes next: a need, a `keep` or a `hold` meets what the others
//! have done by then. A line whose time only a run can tell is left; from then on what it may change is unknown, and what goes wrong
//! elsewhere is a warning. Where two lines do something at one moment, both orders are followed, and what one of them brings is left to
//! the run.

mod dangers;
mod judged;
mod passing;
mod unheeded;
mod windows;

use std::collections::{BTreeMap, BTreeSet};

use matterix_ir::plan::{Caught, Condition, Operation, Step, StepId};
use matterix_ir::quantity::show_duration;
use matterix_ir::scene::InstanceId;
use matterix_ir::{Diagnostic, Severity, Span, codes};

pub(super) use self::dangers::Dangers;
pub(super) use self::judged::Judged;
use super::actions::Asked;
use super::report::Finding;
use super::state::AbstractState;
use super::swallowed::Net;
use super::value::AbstractValue;
use super::{Interpreter, MOST_STEPS, Site, Turns};
use crate::elaborate::hazards::Hazard;

/// Moments closer than this share of the time, or of 1 s, are one.
const ROUNDING: f64 = 1e-9;

/// Steps followed before the rest is left to the run.
const MOST: usize = MOST_STEPS / 10;

/// What is done next in a line, innermost last.
enum Frame<'p> {
    /// These steps.
    Steps(std::slice::Iter<'p, StepId>),
    /// This step.
    One(StepId),
    /// So many turns.
    Turns(StepId, f64),
    /// Turns while a condition holds, so many at most.
    While(&'p Condition, StepId, f64),
    /// An operation ends.
    End(&'p Operation, &'p str),
    /// A value is kept: the time.
    Keep(u32),
    /// A statement of the user's ends.
    Site,
    /// A block ends: it waits for the jobs begun in it. How many conditions it has kept, whether it took failures, and what it has
    /// claimed, with the statement that did.
    Block { jobs: Vec<usize>, kept: usize, caught: bool, claims: Option<(Span, &'p [InstanceId])> },
}

/// What a line waits for.
enum State<'p> {
    /// Nothing.
    Ready,
    /// A time, s.
    Until(f64),
    /// A condition.
    Wait(Wait<'p>),
    /// The ends of lines.
    Lines(Vec<usize>),
    /// What it claims, asked for in this order.
    Claim(&'p [InstanceId], StepId, usize),
    /// It has ended.
    Done,
    /// Only a run can tell when it goes on.
    Left,
}

/// A `wait until` or `hold`.
struct Wait<'p> {
    condition: &'p Condition,
    /// How long it must hold, s.
    lasts: f64,
    /// Since when it holds, s.
    since: Option<f64>,
    /// When it times out, s.
    deadline: f64,
    /// The step of another line that made it false again.
    stopped: Option<Span>,
}

/// A branch, a job or the plan itself.
struct Line<'p> {
    root: StepId,
    outer: Option<usize>,
    state: State<'p>,
    frames: Vec<Frame<'p>>,
    sites: Vec<Site>,
    caught: Vec<Net>,
    kept: Vec<&'p Condition>,
    /// The uses of this moment that it comes behind, and its own, by index.
    behind: BTreeSet<usize>,
    /// When it asked for what it claimed last, and how long it waited for that, s.
    claim: (f64, f64),
}

impl Line<'_> {
    /// Whether an operation of it uses an instance now.
    fn uses(&self, instance: InstanceId) -> bool {
        self.frames.iter().any(|f| matches!(f, Frame::End(o, _) if o.claims.contains(&instance)))
    }

    /// The statement that has claimed an instance.
    fn claims_at(&self, instance: InstanceId) -> Option<Span> {
        self.frames.iter().rev().find_map(|f| match f {
            Frame::Block { claims: Some((span, claims)), .. } if claims.contains(&instance) => Some(*span),
            _ => None,
        })
    }
}

/// All lines.
struct Lines<'p> {
    all: Vec<Line<'p>>,
    /// The latest job of each name.
    jobs: BTreeMap<&'p str, usize>,
    facts: AbstractState,
    /// A job goes on before what follows its `start`.
    job_first: bool,
    /// The line in hand lets another one go on.
    yields: bool,
    /// What lines that were left may change.
    lost: BTreeSet<u32>,
    /// Whether some time is not exact.
    loose: bool,
    /// Whether that is for more than the order of claims.
    left: bool,
    held: Vec<(InstanceId, usize)>,
    /// Where a step fails that uses what another one uses or has claimed, and where that is.
    clash: Option<[Span; 2]>,
    asked: usize,
    /// Who uses what at this moment.
    uses: Vec<(InstanceId, &'p Operation)>,
    /// Whether two use one thing at one moment in no order.
    met: bool,
    /// Moments in a row at which no line went on.
    idle: usize,
    /// The run is over, or cannot be followed any further.
    over: bool,
}

impl<'p> Lines<'p> {
    fn now(&self) -> f64 {
        self.facts.time.exact().unwrap_or(f64::NAN)
    }

    fn within(&self, line: usize, outer: usize) -> bool {
        std::iter::successors(Some(line), |l| self.all[*l].outer).any(|l| l == outer)
    }

    /// An operation of a line begins to use things.
    fn note_uses(&mut self, at: usize, operation: &'p Operation) {
        for instance in &operation.claims {
            let own = self.held.iter().any(|(i, holder)| i == instance && *holder == at);
            let line = &mut self.all[at];
            let meets = |(index, (used, other)): (usize, &(InstanceId, &Operation))| {
                used == instance && !line.behind.contains(&index) && !operation.is_independent_of(other)
            };
            self.met |= !own && self.uses.iter().enumerate().any(meets);
            line.behind.insert(self.uses.len());
            self.uses.push((*instance, operation));
        }
    }

    fn is_free(&self, line: usize, instance: InstanceId) -> bool {
        !self.is_claimed(line, instance) && !self.all.iter().any(|l| l.uses(instance))
    }

    /// Whether a line beside this one has claimed an instance.
    fn is_claimed(&self, line: usize, instance: InstanceId) -> bool {
        self.held.iter().any(|(i, holder)| *i == instance && !self.within(line, *holder))
    }

    /// Whether a line beside this one begins to use an instance at this moment.
    fn is_used_now(&self, line: usize, instance: InstanceId) -> bool {
        let behind = &self.all[line].behind;
        self.uses.iter().enumerate().any(|(index, (used, _))| *used == instance && !behind.contains(&index))
    }

    /// The statement of another line that has claimed an instance, or else uses it.
    fn user(&self, line: usize, instance: InstanceId) -> Option<Span> {
        let holds = self.held.iter().find(|(i, holder)| *i == instance && !self.within(line, *holder));
        match holds {
            Some((_, holder)) => self.all[*holder].claims_at(instance),
            None => self.all.iter().find(|l| l.uses(instance)).and_then(|l| l.sites.last().map(|site| site.span)),
        }
    }
}

fn same(a: f64, b: f64) -> bool {
    (a - b).abs() <= ROUNDING * b.abs().max(1.0)
}

impl<'l> Interpreter<'l, '_> {
    /// Steps, each with those that go on beside it.
    pub(super) fn side_by_side(&self) -> Vec<(StepId, Vec<StepId>)> {
        let plan = self.plan;
        let mut pairs: Vec<(StepId, Vec<StepId>)> = Vec::new();
        for step in &plan.steps {
            match &step.step {
                Step::Parallel(branches) => pairs.extend(branches.iter().map(|own| {
                    (*own, branches.iter().filter(|other| *other != own).copied().collect::<Vec<StepId>>())
                })),
                Step::Start { body, .. } => {
                    let rest = self.after_start(*body);
                    rest.iter().for_each(|step| pairs.push((*step, vec![*body])));
                    pairs.push((*body, rest));
                }
                _ => {}
            }
        }
        pairs
    }

    /// Whether some of these steps may disturb those beside them.
    fn may_disturb(&mut self, pairs: &[(StepId, Vec<StepId>)]) -> bool {
        // What moves in a way that only a run knows is left to it.
        let even: BTreeSet<u32> = self.tracks().list.iter().map(|track| track.state).collect();
        let uneven: BTreeSet<u32> = self.derivatives.iter().map(|d| d.state).filter(|s| !even.contains(s)).collect();
        let mut known: BTreeMap<StepId, BTreeSet<u32>> = BTreeMap::new();
        let in_all = self.asks_of(self.plan.root);
        pairs.iter().any(|(own, others)| {
            // What flows however others go on.
            if !even.is_disjoint(known.entry(*own).or_insert_with(|| self.asks_of(*own))) {
                return true;
            }
            let written = self.writes(*own);
            if written.is_empty() {
                return false;
            }
            // Which of two is the last to set something decides what is asked behind both.
            let mut both: BTreeSet<u32> = others.iter().flat_map(|other| self.writes(*other)).collect();
            both.retain(|state| written.contains(state) && !self.amounts.contains(state));
            if !both.is_empty() && !self.behind(&both).is_disjoint(&in_all) {
                return true;
            }
            let mut changed = self.behind(&written);
            changed.retain(|state| written.contains(state) || !uneven.contains(state));
            others.iter().any(|other| {
                let asked = known.entry(*other).or_insert_with(|| self.asks_of(*other));
                !asked.is_disjoint(&changed)
            })
        })
    }

    /// The states that steps ask something of.
    fn asks_of(&mut self, step: StepId) -> BTreeSet<u32> {
        let plan = self.plan;
        let mut out = BTreeSet::new();
        let below = self.below(step);
        for condition in self.asked_before_fails(below.iter().copied()) {
            out.extend(self.parts(condition.node).states.iter().copied());
        }
        for id in below {
            let asked: Vec<&Condition> = match &plan.get(id).step {
                Step::Operation(o) => {
                    let limits = o.limits.iter().map(|i| &plan.limits[*i as usize].condition);
                    o.needs.iter().map(|need| &**need).chain(limits).collect()
                }
                Step::Skill { needs, .. } => needs.iter().map(|need| &**need).collect(),
                Step::Keep { condition, .. } | Step::Hold { condition, .. } | Step::WaitUntil { condition, .. } => {
                    vec![condition]
                }
                Step::During { invariants, .. } => invariants.iter().collect(),
                Step::Expect(conditions) => conditions.iter().collect(),
                Step::Let { value, .. } if !self.in_library(plan.get(id).span) => {
                    out.extend(self.parts(*value).states.iter().copied());
                    Vec::new()
                }
                _ => Vec::new(),
            };
            for condition in asked {
                out.extend(self.parts(condition.node).states.iter().copied());
            }
        }
        out
    }

    /// Follows all lines in the order of time, at one moment the last one first if `backward`; how they use things.
    pub(super) fn follow_in_time(&mut self, backward: bool) -> Turns {
        self.quiet += 1;
        let mut facts = self.start();
        self.fire((0..self.events.len() as u32).collect(), &mut facts);
        self.limits((0..self.plan.limits.len() as u32).collect(), &mut facts);
        self.quiet -= 1;
        self.guards.push(Vec::new());
        let mut lines = Lines {
            all: Vec::new(),
            jobs: BTreeMap::new(),
            facts,
            job_first: backward,
            yields: false,
            lost: BTreeSet::new(),
            loose: false,
            left: false,
            held: Vec::new(),
            clash: None,
            asked: 0,
            uses: Vec::new(),
            met: false,
            idle: 0,
            over: false,
        };
        self.judge_dangers(&mut lines);
        self.begin_line(&mut lines, self.plan.root, None);
        while !lines.over {
            let ready = |line: &Line<'_>| matches!(line.state, State::Ready);
            let next = match backward {
                true => lines.all.iter().rposition(ready),
                false => lines.all.iter().position(ready),
            };
            match next.or_else(|| grant(&mut lines)) {
                Some(line) => self.go_on_with(&mut lines, line),
                None => self.until_next(&mut lines),
            }
        }
        let ended = lines.all.iter().all(|line| matches!(line.state, State::Done));
        match lines.clash {
            Some(places) => Turns::Clash(places),
            None if ended && !lines.loose && !lines.met && self.findings.is_empty() && self.steps <= MOST => {
                Turns::Taken
            }
            None => Turns::Unknown,
        }
    }

    fn begin_line(&mut self, lines: &mut Lines<'l>, root: StepId, outer: Option<usize>) -> usize {
        let behind = outer.map(|outer| lines.all[outer].behind.clone()).unwrap_or_default();
        // What a branch or job begins may outlast it.
        let block = Frame::Block { jobs: Vec::new(), kept: 0, caught: false, claims: None };
        let frames = outer.is_none().then_some(block).into_iter().chain([Frame::One(root)]).collect();
        let (sites, caught) = (self.sites.clone(), self.caught.clone());
        lines.all.push(Line {
            root,
            outer,
            state: State::Ready,
            frames,
            sites,
            caught,
            kept: Vec::new(),
            behind,
            claim: (0.0, 0.0),
        });
        lines.all.len() - 1
    }

    /// A line goes on until it waits.
    fn go_on_with(&mut self, lines: &mut Lines<'l>, at: usize) {
        std::mem::swap(&mut self.sites, &mut lines.all[at].sites);
        std::mem::swap(&mut self.caught, &mut lines.all[at].caught);
        self.doubt = usize::from(lines.loose);
        lines.idle = 0;
        lines.yields = false;
        while !lines.over && !lines.yields && matches!(lines.all[at].state, State::Ready) {
            let found = self.findings.len();
            match lines.all[at].frames.pop() {
                Some(frame) => self.next_of(lines, at, frame),
                None => lines.all[at].state = State::Done,
            }
            // What goes wrong for certain ends the run, or its handlers go on.
            lines.over |= self.findings.len() > found || self.steps > MOST;
        }
        std::mem::swap(&mut self.sites, &mut lines.all[at].sites);
        std::mem::swap(&mut self.caught, &mut lines.all[at].caught);
        if matches!(lines.all[at].state, State::Done) {
            wake(lines);
        }
    }

    fn next_of(&mut self, lines: &mut Lines<'l>, at: usize, frame: Frame<'l>) {
        match frame {
            Frame::Steps(mut steps) => {
                if let Some(step) = steps.next() {
                    lines.all[at].frames.push(Frame::Steps(steps));
                    self.enter(lines, at, *step);
                }
            }
            Frame::One(step) => self.enter(lines, at, step),
            Frame::Turns(body, left) if left >= 1.0 => {
                lines.all[at].frames.extend([Frame::Turns(body, left - 1.0), Frame::One(body)]);
            }
            Frame::Turns(..) => {}
            Frame::While(condition, body, left) => match self.eval(condition.node, &lines.facts).truth() {
                Some(false) => {}
                Some(true) if left >= 1.0 => {
                    lines.all[at].frames.extend([Frame::While(condition, body, left - 1.0), Frame::One(body)]);
                }
                Some(true) => lines.over = true,
                None => self.leave_line(lines, at),
            },
            Frame::End(operation, label) => self.does(lines, at, &operation.at_end, label),
            Frame::Keep(local) => {
                let now = lines.facts.time.clone();
                lines.facts.keep(local, now);
            }
            Frame::Site => _ = self.sites.pop(),
            Frame::Block { jobs, kept, caught, claims } => {
                let waits: Vec<usize> =
                    jobs.into_iter().filter(|job| !matches!(lines.all[*job].state, State::Done)).collect();
                if !waits.is_empty() {
                    lines.all[at].frames.push(Frame::Block { jobs: waits.clone(), kept, caught, claims });
                    lines.all[at].state = State::Lines(waits);
                    return;
                }
                let left = lines.all[at].kept.len().saturating_sub(kept);
                lines.all[at].kept.truncate(left);
                if caught {
                    self.caught.pop();
                }
                if let Some((_, claims)) = claims {
                    lines.held.retain(|(instance, holder)| *holder != at || !claims.contains(instance));
                }
            }
        }
    }

    fn enter(&mut self, lines: &mut Lines<'l>, at: usize, id: StepId) {
        self.steps += 1;
        let plan = self.plan;
        let node = plan.get(id);
        let blocks = matches!(node.step, Step::Sequence(_) | Step::Guarded { .. } | Step::Parallel(_) | Step::Try(_));
        if !blocks && !node.span.is_empty() && !self.in_library(node.span) {
            let calls = matches!(node.step, Step::Operation(_) | Step::Skill { .. });
            self.sites.push(Site { span: node.span, label: node.label.clone(), calls });
            lines.all[at].frames.push(Frame::Site);
        }
        let block = |kept, caught| Frame::Block { jobs: Vec::new(), kept, caught, claims: None };
        match &node.step {
            Step::Sequence(steps) => lines.all[at].frames.push(Frame::Steps(steps.iter())),
            Step::Parallel(branches) => {
                let begun: Vec<usize> = branches.iter().map(|b| self.begin_line(lines, *b, Some(at))).collect();
                lines.all[at].state = State::Lines(begun);
            }
            Step::Start { job, body } => {
                let line = self.begin_line(lines, *body, Some(at));
                lines.jobs.insert(job, line);
                lines.yields = lines.job_first;
                let mut outer = Some(at);
                while let Some(here) = outer {
                    let blocks = lines.all[here].frames.iter_mut().rev();
                    let block = blocks.filter_map(|f| match f {
                        Frame::Block { jobs, .. } => Some(jobs),
                        _ => None,
                    });
                    if let Some(jobs) = block.into_iter().next() {
                        jobs.push(line);
                        break;
                    }
                    outer = lines.all[here].outer;
                }
            }
            Step::Await { job } => match lines.jobs.get(job.as_str()) {
                Some(line) => lines.all[at].state = State::Lines(vec![*line]),
                None => lines.over = true,
            },
            Step::Operation(operation) => self.begin_operation(lines, at, operation, &node.label),
            Step::Guarded { body, handlers, finally } => {
                let name = |(caught, _): &(Caught, StepId)| match caught {
                    Caught::Named(name) => Some(name.clone()),
                    Caught::Any => None,
                };
                let library = self.in_library(node.span);
                self.caught.push(Net::of(if library { Vec::new() } else { handlers.iter().map(name).collect() }));
                let frames = &mut lines.all[at].frames;
                frames.extend(finally.map(Frame::One));
                frames.extend([block(0, true), Frame::One(*body)]);
            }
            Step::Try(alternatives) => {
                self.caught.push(Net::of(if alternatives.len() > 1 { vec![None] } else { Vec::new() }));
                lines.all[at].frames.push(block(0, true));
                lines.all[at].frames.extend(alternatives.first().map(|first| Frame::One(*first)));
            }
            Step::Skill { needs, body, .. } => {
                if self.needs(&node.label, needs, &mut lines.facts) == Asked::Met {
                    lines.all[at].frames.extend([block(0, false), Frame::One(*body)]);
                } else {
                    lines.over = true;
                }
            }
            Step::Named { start, end, body, .. } => {
                let now = lines.facts.time.clone();
                lines.facts.keep(*start, now);
                lines.all[at].frames.extend([Frame::Keep(*end), Frame::One(*body)]);
            }
            Step::Let { local, value } => {
                let known = self.eval(*value, &lines.facts);
                lines.facts.keep(*local, known);
            }
            Step::Wait { duration } => {
                let known = self.eval(*duration, &lines.facts);
                self.waits(lines, at, &known);
            }
            Step::WaitUntil { condition, timeout } => {
                let deadline = self.deadline(lines, *timeout);
                self.waits_until(lines, at, condition, Some(0.0), deadline);
            }
            Step::Hold { condition, duration, timeout } => {
                let lasts = self.eval(*duration, &lines.facts).exact();
                let deadline = self.deadline(lines, *timeout);
                self.waits_until(lines, at, condition, lasts, deadline);
            }
            Step::Keep { condition, body } => {
                let holds = self.eval(condition.node, &lines.facts).truth();
                // The body does not begin.
                if holds == Some(false) {
                    lines.over = true;
                    return;
                }
                let holds = holds == Some(true);
                lines.all[at].kept.extend(holds.then_some(condition));
                lines.all[at].frames.extend([block(usize::from(holds), false), Frame::One(*body)]);
            }
            Step::During { invariants, body } => {
                let holds = |c: &&Condition| self.eval(c.node, &lines.facts).truth() == Some(true);
                let kept: Vec<&Condition> = invariants.iter().filter(holds).collect();
                lines.all[at].frames.extend([block(kept.len(), false), Frame::One(*body)]);
                lines.all[at].kept.extend(kept);
            }
            Step::Within { limit, since, body } => {
                lines.all[at].frames.push(Frame::One(*body));
                if lines.all[at].claim.1 > 0.0 {
                    self.judge_window(lines, at, (id, *limit, *since));
                }
            }
            Step::If { condition, then, otherwise } => match self.eval(condition.node, &lines.facts).truth() {
                Some(true) => lines.all[at].frames.push(Frame::One(*then)),
                Some(false) => lines.all[at].frames.extend(otherwise.map(Frame::One)),
                None => self.leave_line(lines, at),
            },
            Step::Repeat { times, body } => match self.eval(*times, &lines.facts).exact() {
                Some(times) => lines.all[at].frames.push(Frame::Turns(*body, times)),
                None => self.leave_line(lines, at),
            },
            Step::RepeatWhile { condition, max, body } => match self.eval(*max, &lines.facts).exact() {
                Some(max) => lines.all[at].frames.push(Frame::While(condition, *body, max)),
                None => self.leave_line(lines, at),
            },
            Step::Claim { claims, body } => {
                lines.asked += 1;
                lines.all[at].claim = (lines.now(), 0.0);
                lines.all[at].state = State::Claim(claims, *body, lines.asked);
            }
            Step::Fail { name, .. } => {
                lines.over = true;
                if !lines.loose
                    && !takes(&self.caught, name)
                    && let Some(condition) = self.asked_before(id)
                {
                    self.fails_for_certain(id, name, condition, &lines.facts);
                }
            }
            Step::Retry { .. } => lines.over = true,
            Step::Expect(conditions) => {
                for condition in conditions {
                    if self.eval(condition.node, &lines.facts).truth() == Some(false) {
                        self.unexpected(condition, &lines.facts);
                    }
                }
            }
            Step::Record { .. } | Step::Note(_) | Step::Ask(_) => {}
        }
    }

    fn begin_operation(&mut self, lines: &mut Lines<'l>, at: usize, operation: &'l Operation, label: &'l str) {
        // Two at once fail by themselves, which is another finding.
        let taken = operation.claims.iter().copied().find(|i| !lines.is_free(at, *i));
        if let Some(place) = taken.and_then(|instance| lines.user(at, instance)) {
            lines.clash = Some([self.site(), place]).filter(|_| !lines.loose && !takes(&self.caught, "claimed"));
        }
        if taken.is_some() || self.needs(label, &operation.needs, &mut lines.facts) != Asked::Met {
            lines.over = true;
            return;
        }
        lines.note_uses(at, operation);
        self.does(lines, at, &operation.at_start, label);
        match (&operation.takes, &operation.until) {
            (_, Some(until)) => {
                lines.all[at].frames.push(Frame::End(operation, label));
                self.waits_until(lines, at, until, Some(0.0), Some(f64::INFINITY));
            }
            (Some(takes), None) => {
                let known = self.eval(takes.nominal, &lines.facts);
                lines.loose |= takes.bounds.is_some();
                lines.left |= takes.bounds.is_some();
                lines.all[at].frames.push(Frame::End(operation, label));
                self.waits(lines, at, &known);
            }
            (None, None) => self.does(lines, at, &operation.at_end, label),
        }
    }

    /// A line does something, which the others meet at once.
    fn does(&mut self, lines: &mut Lines<'l>, at: usize, actions: &[matterix_ir::model::Action], label: &str) {
        if actions.is_empty() || lines.over {
            return;
        }
        let others = || (0..lines.all.len()).filter(|other| *other != at);
        let kept: Vec<(usize, &Condition)> =
            others().flat_map(|other| lines.all[other].kept.iter().map(move |condition| (other, *condition))).collect();
        let kept: Vec<(usize, &Condition)> =
            kept.into_iter().filter(|(_, c)| self.eval(c.node, &lines.facts).truth() == Some(true)).collect();
        lines.over |= self.perform(actions, &mut lines.facts) == Asked::Handled;
        self.judge_dangers(lines);
        let (span, now) = (self.site(), lines.now());
        for other in (0..lines.all.len()).filter(|other| *other != at) {
            for condition in kept.iter().filter(|(line, _)| *line == other).map(|(_, condition)| *condition) {
                if !lines.over && self.eval(condition.node, &lines.facts).truth() == Some(false) {
                    lines.over = true;
                    if !takes(&lines.all[other].caught, "broken") {
                        self.breaks(condition, span, label);
                    }
                }
            }
            let own = lines.all[at].behind.clone();
            let State::Wait(wait) = &mut lines.all[other].state else { continue };
            match self.eval(wait.condition.node, &lines.facts).truth() {
                Some(true) => {
                    wait.since.get_or_insert(now);
                    lines.all[other].behind.extend(own);
                }
                Some(false) if wait.since.take().is_some() => wait.stopped = Some(span),
                Some(false) => {}
                None => self.leave_line(lines, other),
            }
        }
    }

    /// A line waits for some time.
    fn waits(&mut self, lines: &mut Lines<'l>, at: usize, time: &AbstractValue) {
        match time.exact() {
            Some(time) if time > 0.0 => lines.all[at].state = State::Until(lines.now() + time),
            Some(_) => {}
            None => self.leave_line(lines, at),
        }
    }

    fn deadline(&mut self, lines: &Lines<'l>, timeout: Option<matterix_ir::NodeId>) -> Option<f64> {
        match timeout {
            Some(node) => self.eval(node, &lines.facts).exact().map(|longest| lines.now() + longest),
            None => Some(f64::INFINITY),
        }
    }

    fn waits_until(
        &mut self,
        lines: &mut Lines<'l>,
        at: usize,
        condition: &'l Condition,
        lasts: Option<f64>,
        deadline: Option<f64>,
    ) {
        let (Some(lasts), Some(deadline)) = (lasts, deadline) else { return self.leave_line(lines, at) };
        let since = match self.eval(condition.node, &lines.facts).truth() {
            Some(true) => Some(lines.now()),
            Some(false) => None,
            None => return self.leave_line(lines, at),
        };
        if since.is_none() || lasts > 0.0 {
            lines.all[at].state = State::Wait(Wait { condition, lasts, since, deadline, stopped: None });
        }
    }

    /// Only a run can tell how a line goes on.
    fn leave_line(&mut self, lines: &mut Lines<'l>, at: usize) {
        let written = self.sets_going(self.writes(lines.all[at].root));
        lines.lost.extend(written);
        lines.loose = true;
        lines.left = true;
        lines.all[at].state = State::Left;
        lines.all[at].kept.clear();
        self.doubt = 1;
        self.forget_lost(lines);
    }

    fn forget_lost(&mut self, lines: &mut Lines<'l>) {
        if !lines.lost.is_empty() {
            let lost: Vec<u32> = lines.lost.iter().copied().collect();
            self.forget(&lost, &mut lines.facts);
        }
    }

    /// What a line waits for does not come in time.
    fn timed_out(&mut self, lines: &mut Lines<'l>, at: usize) {
        lines.over = true;
        let line = &lines.all[at];
        let State::Wait(wait) = &line.state else { return };
        if takes(&line.caught, "timeout") {
            return;
        }
        let place = line.sites.last().map(|s| s.span).unwrap_or_default();
        let text = &wait.condition.text;
        let lasting = match wait.lasts > 0.0 {
            true => format!(" for {}", show_duration(wait.lasts)),
            false => String::new(),
        };
        let d = match wait.stopped {
            Some(span) => {
                let label = self.label_at(span);
                let headline = format!("`{label}` prevents `{text}`, which another branch or job waits for");
                Diagnostic::error(codes::STOPPED_MEANWHILE, span, headline, format!("before it has been true{lasting}"))
                    .because(place, format!("another branch or job waits here for `{text}`"))
                    .help("let it wait for the other branch or job, or put both into one `sequence`")
            }
            None => {
                let headline = format!("`{text}` does not become true{lasting} before the timeout");
                Diagnostic::error(codes::NOT_REACHED, place, headline, "this step waits for it")
                    .help("allow a longer timeout, or let the other branch or job act earlier")
            }
        };
        self.tell_in_time(d, wait.condition.span, lines.loose);
    }

    /// A line breaks what another one keeps.
    fn breaks(&mut self, condition: &Condition, span: Span, label: &str) {
        let label = match self.label_at(span) {
            own if own.is_empty() => label.to_owned(),
            own => own,
        };
        let headline =
            format!("`{label}` makes `{}` false, which another branch or job must keep true", condition.text);
        let d = Diagnostic::error(codes::STOPPED_MEANWHILE, span, headline, "while it must stay true")
            .because(condition.span, "must stay true from here on".to_owned())
            .help("let it wait for the other branch or job, or put both into one `sequence`");
        self.tell_in_time(d, condition.span, self.doubt > 0);
    }

    fn tell_in_time(&mut self, mut d: Diagnostic, about: Span, loose: bool) {
        if loose {
            d.severity = Severity::Warning;
        }
        self.found(d, about);
    }
}

/// Whether handlers take a failure.
fn takes(caught: &[Net], name: &str) -> bool {
    caught.iter().any(|net| net.takes(name))
}

/// Lines go on that waited for lines which have ended.
fn wake(lines: &mut Lines<'_>) {
    let done: Vec<bool> = lines.all.iter().map(|line| matches!(line.state, State::Done)).collect();
    for at in 0..lines.all.len() {
        let State::Lines(others) = &lines.all[at].state else { continue };
        if others.iter().all(|other| done[*other]) {
            let behind: Vec<usize> = others.iter().flat_map(|other| &lines.all[*other].behind).copied().collect();
            lines.all[at].behind.extend(behind);
            lines.all[at].state = State::Ready;
        }
    }
}

/// The first block that asked for what is free now has it, and goes on.
fn grant<'p>(lines: &mut Lines<'p>) -> Option<usize> {
    wake(lines);
    if let Some(ready) = lines.all.iter().position(|line| matches!(line.state, State::Ready)) {
        return Some(ready);
    }
    let mut asking: Vec<(usize, usize, &'p [InstanceId], StepId)> = Vec::new();
    for (at, line) in lines.all.iter().enumerate() {
        if let State::Claim(claims, step, asked) = line.state {
            asking.push((asked, at, claims, step));
        }
    }
    asking.sort_unstable_by_key(|(asked, ..)| *asked);
    let free =
        |(_, at, claims, _): &&(usize, usize, &'p [InstanceId], StepId)| claims.iter().all(|i| lines.is_free(*at, *i));
    let granted = asking.iter().find(free).copied();
    // Who has it first is a matter of the schedule, or of the order of two at one moment.
    lines.loose |= asking.iter().any(|(asked, at, claims, _)| {
        let waits = granted.is_none_or(|(first, ..)| first != *asked);
        let others =
            || asking.iter().filter(|(other, ..)| waits && other != asked).flat_map(|(_, _, claims, _)| *claims);
        claims
            .iter()
            .any(|i| lines.is_claimed(*at, *i) || lines.is_used_now(*at, *i) || others().any(|other| other == i))
    });
    let (_, at, claims, step) = granted?;
    let place = lines.all[at].sites.last().map(|site| site.span).unwrap_or_default();
    lines.held.extend(claims.iter().map(|i| (*i, at)));
    lines.all[at].claim.1 = lines.now() - lines.all[at].claim.0;
    lines.all[at].state = State::Ready;
    lines.all[at].frames.extend([
        Frame::Block { jobs: Vec::new(), kept: 0, caught: false, claims: Some((place, claims)) },
        Frame::One(step),
    ]);
    Some(at)
}

/// Adds what goes wrong where branches and jobs are followed in the order of time, whichever of two comes first at one moment, and drops
/// what is then known not to; `begin` gives a flow that was not followed yet.
pub(super) fn add_findings<'l, 'a>(
    flow: &mut Interpreter<'l, 'a>,
    hazards: &'l [Hazard],
    begin: &impl Fn() -> Interpreter<'l, 'a>,
) {
    let pairs = flow.side_by_side();
    if pairs.is_empty() {
        return;
    }
    let dangers = flow.dangers_between(&pairs, hazards);
    if dangers.is_empty() && !flow.may_disturb(&pairs) && !flow.has_windows_behind_claims(&pairs) {
        return;
    }
    let errors = flow.findings.iter().any(|f| f.is_error() && !f.is_of_one_order());
    let uncertain = errors || flow.findings.iter().any(|f| f.is_of_one_order() || f.is_by_failure());
    let follow = |flow: &mut Interpreter<'l, 'a>, backward| {
        let mut follower = begin();
        follower.swap_known(flow);
        follower.judged = Judged::of(&flow.findings);
        follower.dangers.looked_for.clone_from(&dangers);
        follower.unheeded = follower.unheeded(&dangers);
        let turns = follower.follow_in_time(backward);
        follower.swap_known(flow);
        (follower, matches!(turns, Turns::Taken))
    };
    let (first, sound) = follow(flow, false);
    if first.findings.is_empty() && !(uncertain && sound) {
        return;
    }
    let (second, as_sound) = follow(flow, true);
    if sound && as_sound {
        let holds = |f: &Finding| first.judged.holds(f.place()) && second.judged.holds(f.place());
        // Where every wait has come to its end in time, none of them ends the workflow.
        flow.findings.retain(|f| !(f.is_of_one_order() || f.is_by_failure() || f.is_error() && holds(f)));
        return;
    }
    // What is wrong in any order needs no other one.
    if errors {
        return;
    }
    if let Some(finding) = windows::late_in_either(&first.findings, &second.findings) {
        flow.findings.push(finding);
        return;
    }
    // The order of time decides between what comes up in one order only and what comes up in the other.
    if first.findings.iter().any(|f| f.is_error() && second.findings.iter().any(|o| o.is_like(f))) {
        flow.findings.retain(|f| !f.is_of_one_order());
    }
    let is_new = |f: &Finding| !flow.findings.iter().any(|old| old.place() == f.place());
    let new: Vec<Finding> =
        first.findings.into_iter().filter(|f| second.findings.iter().any(|o| o.is_like(f)) && is_new(f)).collect();
    // Another order of claims may be a schedule.
    flow.findings.extend(new.into_iter().map(windows::softened));
}
