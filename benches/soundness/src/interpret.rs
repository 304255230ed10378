//! One execution of a plan, by the rules of docs/language.md: threads for branches and jobs, failures that look for their
//! handlers, claims, and a clock that goes from event to event. What the text leaves open is asked of an [`Oracle`].

use std::collections::BTreeMap;

use crate::plan::{Action, Block, Condition, Handler, Id, Kind, Plan, Remedy, Stmt, Thing};
use crate::world::{Refusal, World};

/// Steps of all threads together, at most.
const STEPS: usize = 20_000;

/// Longest run, s.
const HORIZON: f64 = 30.0 * 86_400.0;

/// Decides what the text leaves open.
pub trait Oracle {
    /// One of `n` ways, from 0.
    fn choose(&mut self, n: usize) -> usize;
}

/// A failure on its way outwards.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Failure {
    /// Its name; empty for a fault, which no handler takes.
    pub name: &'static str,
    /// The statement that failed.
    pub stmt: Id,
    /// The plan raises it itself, by `fail`, a timeout or the bound of a loop.
    pub meant: bool,
}

/// What went wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Violation {
    /// The code of the finding that should tell of it.
    pub code: &'static str,
    /// Where.
    pub stmt: Id,
}

/// How an execution ended.
#[derive(Clone, Debug, PartialEq)]
pub enum End {
    /// Well.
    Passed,
    /// With a failure that nothing took, or a fault.
    Failed(Failure),
    /// Nothing could go on.
    Deadlock,
    /// It was given up.
    Unfinished,
}

/// What happened to a statement.
#[derive(Clone, Debug)]
pub enum Step {
    /// It began.
    Began(Id),
    /// It ended well: how the lab stood then.
    Done(Id, Box<World>),
    /// It failed with this code.
    Failed(Id, &'static str),
    /// It presumed what was not so.
    Presumed(Id),
    /// A turn of it begins.
    Turn(Id),
}

/// One execution.
#[derive(Clone, Debug)]
pub struct Execution {
    /// How it ended.
    pub end: End,
    /// What went wrong and had no handler.
    pub violations: Vec<Violation>,
    /// Waits that timed out and blocks that came too late, where no handler took that: wrong if it is so in every execution.
    pub vain: Vec<Violation>,
    /// What happened, in order.
    pub steps: Vec<Step>,
    /// How the lab stands at the end.
    pub world: World,
    /// Whether the text says what happens: no two threads came to one thing at the same moment, nothing was decided by rounding.
    pub certain: bool,
    /// Whether no other order of what happens at one moment leads elsewhere: none was stopped that was about to do something.
    pub alone: bool,
}

/// A block that a thread is in.
#[derive(Debug)]
enum Frame<'p> {
    Block {
        stmts: &'p [Stmt],
        next: usize,
    },
    Repeat {
        stmt: Id,
        body: &'p Block,
        left: u32,
    },
    While {
        stmt: Id,
        condition: Condition,
        body: &'p Block,
        left: u32,
    },
    Parallel {
        stmt: Id,
        children: Vec<usize>,
    },
    Guard {
        stmt: Id,
        body: &'p Block,
        handlers: &'p [Handler],
        tries: Vec<u32>,
        handling: bool,
        jobs: Vec<usize>,
    },
    Try {
        stmt: Id,
        other: &'p Block,
        second: bool,
        jobs: Vec<usize>,
    },
    Claim {
        stmt: Id,
        things: &'p [Thing],
        jobs: Vec<usize>,
    },
    Double {
        stmt: Id,
        volume: u32,
        from: usize,
        to: usize,
        part: usize,
    },
    After {
        stmt: Id,
    },
    Named {
        stmt: Id,
        name: usize,
    },
    /// Only where it has a handler it waits for the jobs begun in it.
    Window {
        stmt: Id,
        handler: Option<&'p Block>,
        owns: bool,
        jobs: Vec<usize>,
    },
    Keep {
        stmt: Id,
        condition: Condition,
        handler: Option<&'p Block>,
        handling: bool,
        jobs: Vec<usize>,
    },
    Root {
        jobs: Vec<usize>,
        finally: bool,
        failed: Option<Failure>,
    },
}

/// What a thread does.
#[derive(Clone, Copy, Debug)]
enum State<'p> {
    Ready,
    Waits { until: f64, stmt: Id },
    Acts { until: f64, action: Action, stmt: Id, whole: bool },
    Until { condition: Condition, deadline: f64, stmt: Id, handler: Option<&'p Block>, passes: usize },
    Holds { condition: Condition, since: Option<f64>, span: f64, deadline: f64, stmt: Id, handler: Option<&'p Block> },
    Claims { things: &'p [Thing], stmt: Id, body: &'p Block, order: usize },
    Joins,
    Awaits { job: usize, stmt: Id },
    Unwinds { failure: Option<Failure> },
    Ended,
}

struct Thread<'p> {
    parent: Option<usize>,
    frames: Vec<Frame<'p>>,
    state: State<'p>,
    stopped: bool,
    failed: Option<Failure>,
    /// The block that keeps something which does not hold any more.
    breaks: Option<Id>,
    /// What the threads around it had claimed when it began.
    inherits: Vec<Thing>,
    /// By thread: how many of its touches come before what this one does now.
    knows: BTreeMap<usize, usize>,
    touches: usize,
}

/// Something was read or changed.
struct Touch {
    time: f64,
    thread: usize,
    number: usize,
    thing: Thing,
    write: bool,
}

struct Machine<'p, 'o> {
    plan: &'p Plan,
    oracle: &'o mut dyn Oracle,
    threads: Vec<Thread<'p>>,
    jobs: BTreeMap<usize, usize>,
    holders: BTreeMap<Thing, usize>,
    released: BTreeMap<Thing, BTreeMap<usize, usize>>,
    touches: Vec<Touch>,
    queue: usize,
    now: f64,
    world: World,
    dangers: Vec<bool>,
    /// By vessel: whether its wall was found to be attacked.
    walls: Vec<bool>,
    out: Vec<Step>,
    violations: Vec<Violation>,
    vain: Vec<Violation>,
    certain: bool,
    alone: bool,
    last_on: BTreeMap<Thing, Id>,
    /// When steps with a name ended, s, and how many moves an arm had made by then.
    ended: BTreeMap<usize, (f64, usize)>,
    /// Moves of an arm, whose times are a matter of its skills.
    moves: usize,
}

/// Follows a plan once.
pub fn execute(plan: &Plan, oracle: &mut dyn Oracle) -> Execution {
    let world = World::new(plan);
    let mut machine = Machine {
        plan,
        oracle,
        threads: Vec::new(),
        jobs: BTreeMap::new(),
        holders: BTreeMap::new(),
        released: BTreeMap::new(),
        touches: Vec::new(),
        queue: 0,
        now: 0.0,
        dangers: vec![false; world.cups.len()],
        walls: vec![false; world.cups.len()],
        world,
        out: Vec::new(),
        violations: Vec::new(),
        vain: Vec::new(),
        certain: true,
        alone: true,
        last_on: BTreeMap::new(),
        ended: BTreeMap::new(),
        moves: 0,
    };
    let root = Frame::Root { jobs: Vec::new(), finally: false, failed: None };
    machine.spawn(None, vec![root, Frame::Block { stmts: &plan.body, next: 0 }]);
    if let Some(code) = plan.declared.and_then(|declared| declared.wrong()) {
        let stmt = plan.body.first().map_or(0, |stmt| stmt.id);
        machine.violations.push(Violation { code, stmt });
    }
    let end = machine.run();
    machine.leave(&end);
    Execution {
        end,
        violations: machine.violations,
        vain: machine.vain,
        steps: machine.out,
        world: machine.world,
        certain: machine.certain,
        alone: machine.alone,
    }
}

impl<'p> Machine<'p, '_> {
    fn run(&mut self) -> End {
        let mut steps = 0;
        loop {
            let mut moved = false;
            for t in 0..self.threads.len() {
                while self.advance(t) {
                    moved = true;
                    steps += 1;
                    if steps > STEPS {
                        return End::Unfinished;
                    }
                }
            }
            if matches!(self.threads[0].state, State::Ended) {
                return match self.threads[0].failed {
                    None => End::Passed,
                    Some(failure) => End::Failed(failure),
                };
            }
            if !moved && !self.tick() {
                return match self.now < HORIZON {
                    true => End::Deadlock,
                    false => End::Unfinished,
                };
            }
        }
    }

    /// Lets time pass up to the next event; false where there is none.
    fn tick(&mut self) -> bool {
        let mut next = f64::INFINITY;
        let mut dial = None;
        for (t, thread) in self.threads.iter().enumerate() {
            match thread.state {
                State::Waits { until, .. } | State::Acts { until, .. } => next = next.min(until),
                State::Holds { since, span, deadline, .. } => {
                    next = next.min(deadline).min(since.map_or(f64::INFINITY, |since| since + span));
                }
                State::Until { deadline, condition, passes, .. } => {
                    next = next.min(deadline);
                    if matches!(condition, Condition::Dial(_)) && passes == 0 {
                        dial = dial.or(Some(t));
                    }
                }
                _ => {}
            }
        }
        if !next.is_finite() || next > HORIZON {
            return false;
        }
        if let Some(t) = dial {
            // It comes true at some moment before the next event.
            let moment = self.now + (next - self.now) * 0.437;
            self.pass(moment);
            self.release(t);
            return true;
        }
        for thread in &mut self.threads {
            if let State::Until { passes, .. } = &mut thread.state {
                *passes = passes.saturating_sub(1);
            }
        }
        self.pass(next);
        true
    }

    /// Lets time pass, up to a moment or until something that is waited for comes true by itself.
    fn pass(&mut self, moment: f64) {
        let warm: Vec<Condition> = self
            .threads
            .iter()
            .filter_map(|t| match t.state {
                State::Until { condition: c @ (Condition::Warm(..) | Condition::Made(..)), .. } => Some(c),
                _ => None,
            })
            .collect();
        let over: Vec<bool> = self.world.cups.iter().map(|c| c.is_over()).collect();
        let passed = self.world.pass(moment - self.now, &warm);
        self.now = if passed + self.now + 1e-12 < moment { self.now + passed } else { moment };
        if self.world.cups.iter().zip(over).any(|(c, over)| c.is_over() && !over) {
            self.run_over();
        }
    }

    /// A law has made a vessel run over: the step in hand fails. `check` leaves that to the run, so it is no violation.
    fn run_over(&mut self) {
        let in_hand = |(t, thread): (usize, &Thread<'_>)| match thread.state {
            State::Waits { stmt, .. }
            | State::Acts { stmt, .. }
            | State::Until { stmt, .. }
            | State::Holds { stmt, .. } => Some((t, stmt)),
            _ => None,
        };
        let steps: Vec<(usize, Id)> = self.threads.iter().enumerate().filter_map(in_hand).collect();
        // Of several the one counts that has set the law going: a matter of what was done before.
        self.certain &= steps.len() == 1;
        let Some(&(t, stmt)) = steps.first() else { return };
        let around = self.threads[t].frames.iter().rev().find_map(|f| match f {
            Frame::Double { stmt, .. } => Some(*stmt),
            _ => None,
        });
        let stmt = if stmt == Id::MAX { around.unwrap_or(stmt) } else { stmt };
        let failure = Failure { name: "volume_overflow", stmt, meant: true };
        self.fail(t, failure);
    }

    /// The condition that a thread waits for has come true.
    fn release(&mut self, t: usize) {
        if let State::Until { stmt, .. } = self.threads[t].state {
            self.done(stmt);
            self.threads[t].state = State::Ready;
        }
    }

    fn spawn(&mut self, parent: Option<usize>, frames: Vec<Frame<'p>>) -> usize {
        let mut knows = BTreeMap::new();
        let mut inherits = Vec::new();
        if let Some(p) = parent {
            let claimed = self.threads[p].frames.iter().filter_map(|f| match f {
                Frame::Claim { things, .. } => Some(things.iter().copied()),
                _ => None,
            });
            inherits.extend(claimed.flatten());
            inherits.extend(&self.threads[p].inherits);
            knows.clone_from(&self.threads[p].knows);
            knows.insert(p, self.threads[p].touches);
        }
        let state = State::Ready;
        self.threads.push(Thread {
            parent,
            frames,
            state,
            stopped: false,
            failed: None,
            breaks: None,
            inherits,
            knows,
            touches: 0,
        });
        self.threads.len() - 1
    }

    /// What a thread did comes before what another one does from now on.
    fn learn(&mut self, t: usize, from: usize) {
        let mut knows = self.threads[from].knows.clone();
        knows.insert(from, self.threads[from].touches);
        self.know(t, &knows);
    }

    fn know(&mut self, t: usize, knows: &BTreeMap<usize, usize>) {
        for (thread, number) in knows {
            let known = self.threads[t].knows.entry(*thread).or_default();
            *known = (*known).max(*number);
        }
    }

    /// Notes that a thread reads or changes a thing; where another one does at the same moment, the text does not say in which
    /// order.
    fn touch(&mut self, t: usize, thing: Thing, write: bool) {
        let now = self.now;
        self.touches.retain(|touch| touch.time == now);
        let thread = &self.threads[t];
        let unordered = |touch: &&Touch| {
            touch.thing == thing
                && touch.thread != t
                && (touch.write || write)
                && thread.knows.get(&touch.thread).is_none_or(|known| *known < touch.number)
        };
        if self.touches.iter().any(|touch| unordered(&touch)) {
            self.certain = false;
        }
        self.threads[t].touches += 1;
        let number = self.threads[t].touches;
        self.touches.push(Touch { time: now, thread: t, number, thing, write });
    }

    fn done(&mut self, stmt: Id) {
        self.look_at_keeps();
        self.out.push(Step::Done(stmt, Box::new(self.world.clone())));
    }

    /// One step of a thread; false where it cannot go on now.
    fn advance(&mut self, t: usize) -> bool {
        if self.threads[t].stopped
            && !matches!(self.threads[t].state, State::Acts { .. } | State::Unwinds { .. } | State::Ended)
        {
            self.threads[t].state = State::Unwinds { failure: None };
            return true;
        }
        if self.threads[t].breaks.is_some()
            && !matches!(self.threads[t].state, State::Acts { .. } | State::Unwinds { .. } | State::Ended)
        {
            self.threads[t].state = State::Unwinds { failure: None };
            return true;
        }
        match self.threads[t].state {
            State::Ended => false,
            State::Ready => {
                self.control(t);
                true
            }
            State::Waits { until, stmt } => {
                let over = self.now >= until;
                if over {
                    self.done(stmt);
                    self.threads[t].state = State::Ready;
                }
                over
            }
            State::Acts { until, action, stmt, whole } => {
                let over = self.now >= until;
                if over {
                    self.end_action(t, &action, stmt, whole);
                }
                over
            }
            State::Until { condition, deadline, stmt, handler, .. } => {
                self.waited(t, &condition, deadline, stmt, handler)
            }
            State::Holds { condition, since, span, deadline, stmt, handler } => {
                let since = self.held(t, &condition, since);
                self.threads[t].state = State::Holds { condition, since, span, deadline, stmt, handler };
                match since.is_some_and(|since| self.now >= since + span) {
                    true => {
                        self.done(stmt);
                        self.threads[t].state = State::Ready;
                        true
                    }
                    false => self.now >= deadline && self.timed_out(t, stmt, handler),
                }
            }
            State::Claims { things, stmt, body, order } => self.claim(t, things, stmt, body, order),
            State::Joins => self.join(t),
            State::Awaits { job, stmt } => self.awaited(t, job, stmt),
            State::Unwinds { failure } => self.unwind(t, failure),
        }
    }

    /// Takes the next statement of the innermost block, or leaves that.
    fn control(&mut self, t: usize) {
        let Some(frame) = self.threads[t].frames.last_mut() else {
            self.threads[t].state = State::Ended;
            return;
        };
        match frame {
            Frame::Block { stmts, next } => match stmts.get(*next) {
                Some(stmt) => {
                    *next += 1;
                    self.begin(t, stmt);
                }
                None => drop(self.threads[t].frames.pop()),
            },
            Frame::Repeat { stmt, body, left } => match *left {
                0 => {
                    let stmt = *stmt;
                    self.threads[t].frames.pop();
                    self.done(stmt);
                }
                _ => {
                    *left -= 1;
                    let (stmt, body) = (*stmt, *body);
                    self.out.push(Step::Turn(stmt));
                    self.push(t, body);
                }
            },
            Frame::While { stmt, condition, .. } => {
                let (stmt, condition) = (*stmt, *condition);
                let go_on = self.look(t, &condition);
                let Some(Frame::While { body, left, .. }) = self.threads[t].frames.last_mut() else { return };
                match (go_on, *left) {
                    (false, _) => {
                        self.threads[t].frames.pop();
                        self.done(stmt);
                    }
                    (true, 0) => {
                        self.threads[t].frames.pop();
                        self.fail(t, Failure { name: "max", stmt, meant: true });
                    }
                    (true, _) => {
                        *left -= 1;
                        let body = *body;
                        self.out.push(Step::Turn(stmt));
                        self.push(t, body);
                    }
                }
            }
            Frame::Double { stmt, volume, from, to, part } => {
                let (stmt, action, at) = (*stmt, Action::Drip(*volume, *from, *to), *part);
                *part += 1;
                match at {
                    0 | 2 => self.act(t, action, stmt, false),
                    1 => self.threads[t].state = State::Waits { until: self.now + 0.47, stmt: Id::MAX },
                    _ => {
                        self.threads[t].frames.pop();
                        self.done(stmt);
                    }
                }
            }
            Frame::After { stmt } => {
                let stmt = *stmt;
                self.threads[t].frames.pop();
                self.done(stmt);
            }
            Frame::Named { stmt, name } => {
                let (stmt, name) = (*stmt, *name);
                self.threads[t].frames.pop();
                self.ended.insert(name, (self.now, self.moves));
                self.done(stmt);
            }
            Frame::Parallel { .. } => self.threads[t].state = State::Joins,
            Frame::Guard { jobs, .. }
            | Frame::Window { jobs, .. }
            | Frame::Keep { jobs, .. }
            | Frame::Try { jobs, .. }
            | Frame::Claim { jobs, .. }
            | Frame::Root { jobs, .. } => {
                let jobs = jobs.clone();
                self.close(t, &jobs);
            }
        }
    }

    /// The block of a frame that owns jobs is over: they end before it goes on.
    fn close(&mut self, t: usize, jobs: &[usize]) {
        if jobs.iter().any(|j| !matches!(self.threads[*j].state, State::Ended)) {
            self.threads[t].state = State::Joins;
            return;
        }
        for job in jobs {
            self.learn(t, *job);
        }
        if let Some(failure) = jobs.iter().find_map(|j| self.threads[*j].failed.take()) {
            // The failure of a job that nobody awaits is the block's; when it comes is not said.
            self.certain = false;
            self.threads[t].state = State::Unwinds { failure: Some(failure) };
            return;
        }
        match self.threads[t].frames.last_mut() {
            Some(Frame::Root { finally, jobs, .. }) if !*finally => {
                *finally = true;
                jobs.clear();
                let body = &self.plan.finally;
                self.push(t, body);
            }
            Some(Frame::Root { failed, .. }) => {
                let failed = *failed;
                let thread = &mut self.threads[t];
                thread.failed = failed;
                thread.state = State::Ended;
            }
            _ => {
                let frame = self.threads[t].frames.pop();
                self.leave_frame(t, frame);
            }
        }
    }

    /// A block has ended well.
    fn leave_frame(&mut self, t: usize, frame: Option<Frame<'p>>) {
        match frame {
            Some(Frame::Claim { stmt, things, .. }) => {
                self.let_go(t, things);
                self.done(stmt);
            }
            Some(
                Frame::Guard { stmt, .. }
                | Frame::Try { stmt, .. }
                | Frame::Window { stmt, .. }
                | Frame::Keep { stmt, .. },
            ) => self.done(stmt),
            _ => {}
        }
    }

    fn let_go(&mut self, t: usize, things: &[Thing]) {
        let mut knows = self.threads[t].knows.clone();
        knows.insert(t, self.threads[t].touches);
        for thing in things {
            if self.holders.get(thing) == Some(&t) && !self.still_holds(t, *thing) {
                self.holders.remove(thing);
                self.released.insert(*thing, knows.clone());
            }
        }
    }

    fn still_holds(&self, t: usize, thing: Thing) -> bool {
        let holds = |f: &Frame<'_>| matches!(f, Frame::Claim { things, .. } if things.contains(&thing));
        self.threads[t].frames.iter().any(holds)
    }

    fn push(&mut self, t: usize, stmts: &'p [Stmt]) {
        self.threads[t].frames.push(Frame::Block { stmts, next: 0 });
        self.threads[t].state = State::Ready;
    }

    /// Looks at a condition.
    fn look(&mut self, t: usize, condition: &Condition) -> bool {
        match *condition {
            Condition::Fuller(c, _) | Condition::Warm(c, _) => self.touch(t, Thing::Cup(c), false),
            Condition::Made(c, _) => self.touch(t, Thing::Cup(c), false),
            Condition::On(o) => self.touch(t, Thing::Oven(o), false),
            Condition::Heavy(_) => self.touch(t, Thing::Place(0), false),
            Condition::Dial(_) => {}
        }
        if self.world.close(condition) {
            self.certain = false;
        }
        match self.world.holds(condition) {
            Some(holds) => holds,
            None => self.oracle.choose(2) == 0,
        }
    }

    /// A statement begins.
    fn begin(&mut self, t: usize, stmt: &'p Stmt) {
        let id = stmt.id;
        self.out.push(Step::Began(id));
        match &stmt.kind {
            Kind::Do(Action::Double(volume, from, to)) => {
                self.threads[t].frames.push(Frame::Double { stmt: id, volume: *volume, from: *from, to: *to, part: 0 });
            }
            Kind::Do(action) => self.act(t, *action, id, true),
            Kind::Wait(ms) => {
                self.threads[t].state = State::Waits { until: self.now + f64::from(*ms) / 1000.0, stmt: id };
            }
            Kind::Until(condition, ms, handler) => {
                let passes = match condition {
                    Condition::Dial(_) => match self.oracle.choose(4) {
                        3 => usize::MAX,
                        n => n,
                    },
                    _ => 0,
                };
                let deadline = self.now + f64::from(*ms) / 1000.0;
                let handler = handler.as_ref();
                self.threads[t].state = State::Until { condition: *condition, deadline, stmt: id, handler, passes };
            }
            Kind::If(condition, yes, no) => {
                let taken = if self.look(t, condition) { yes } else { no };
                self.threads[t].frames.push(Frame::After { stmt: id });
                self.push(t, taken);
            }
            Kind::Repeat(n, body) => self.threads[t].frames.push(Frame::Repeat { stmt: id, body, left: *n }),
            Kind::While(condition, max, body) => {
                let frame = Frame::While { stmt: id, condition: *condition, body, left: *max };
                self.threads[t].frames.push(frame);
            }
            Kind::Parallel(branches) => {
                let children = branches.iter().map(|b| self.spawn(Some(t), vec![Frame::Block { stmts: b, next: 0 }]));
                let children = children.collect();
                self.threads[t].frames.push(Frame::Parallel { stmt: id, children });
                self.threads[t].state = State::Joins;
            }
            Kind::Start(job, _)
                if self.jobs.get(job).is_some_and(|t| !matches!(self.threads[*t].state, State::Ended)) =>
            {
                let failure = Failure { name: "job", stmt: id, meant: false };
                self.fail_with(t, failure, "job-still-running");
            }
            Kind::Start(job, body) => {
                let thread = self.spawn(Some(t), vec![Frame::Block { stmts: body, next: 0 }]);
                self.own(t, thread);
                self.jobs.insert(*job, thread);
                self.done(id);
            }
            Kind::Await(job) => match self.jobs.get(job) {
                Some(thread) => self.threads[t].state = State::Awaits { job: *thread, stmt: id },
                None => self.fail(t, Failure { name: "job", stmt: id, meant: false }),
            },
            Kind::Guard(body, handlers) => {
                let tries = vec![0; handlers.len()];
                let (handling, jobs) = (false, Vec::new());
                self.threads[t].frames.push(Frame::Guard { stmt: id, body, handlers, tries, handling, jobs });
                self.push(t, body);
            }
            Kind::Try(body, other) => {
                self.threads[t].frames.push(Frame::Try { stmt: id, other, second: false, jobs: Vec::new() });
                self.push(t, body);
            }
            Kind::Fail(name) => self.fail(t, Failure { name, stmt: id, meant: true }),
            Kind::Step(name, body) => {
                self.threads[t].frames.push(Frame::Named { stmt: id, name: *name });
                self.push(t, body);
            }
            Kind::Within(name, ms, body, handler) => {
                let ended = self.ended.get(name).copied();
                let limit = ended.map_or(f64::INFINITY, |(end, _)| end + f64::from(*ms) / 1000.0);
                // How long an arm has moved since then is not known.
                let timed = ended.is_some_and(|(_, moves)| moves == self.moves);
                self.certain &= timed && (self.now - limit).abs() > 1e-6;
                let late = self.now > limit;
                let handler = handler.as_ref();
                self.threads[t].frames.push(Frame::Window {
                    stmt: id,
                    handler,
                    owns: handler.is_some(),
                    jobs: Vec::new(),
                });
                match late {
                    true => self.fail(t, Failure { name: "late", stmt: id, meant: true }),
                    false => self.push(t, body),
                }
            }
            Kind::Keep(condition, body, handler) => {
                let (condition, handler) = (*condition, handler.as_ref());
                let frame = Frame::Keep { stmt: id, condition, handler, handling: false, jobs: Vec::new() };
                self.threads[t].frames.push(frame);
                self.push(t, body);
                if !self.look(t, &condition) {
                    self.break_keep(t, id);
                }
            }
            Kind::Hold(condition, span, ms, handler) => {
                let [span, limit] = [*span, *ms].map(|ms| f64::from(ms) / 1000.0);
                let (deadline, handler) = (self.now + limit, handler.as_ref());
                let condition = *condition;
                self.threads[t].state = State::Holds { condition, since: None, span, deadline, stmt: id, handler };
            }
            Kind::Ill(_) => {
                self.out.push(Step::Failed(id, "unit-mismatch"));
                self.violations.push(Violation { code: "unit-mismatch", stmt: id });
            }
            Kind::Claim(things, body) => {
                self.queue += 1;
                self.threads[t].state = State::Claims { things, stmt: id, body, order: self.queue };
            }
        }
    }

    /// Since when a condition that has to hold for a while has held.
    fn held(&mut self, t: usize, condition: &Condition, since: Option<f64>) -> Option<f64> {
        match (self.world.holds(condition) == Some(true), since) {
            (true, Some(since)) => Some(since),
            (holds, _) => {
                self.look(t, condition);
                holds.then_some(self.now)
            }
        }
    }

    /// A wait has timed out.
    fn timed_out(&mut self, t: usize, stmt: Id, handler: Option<&'p Block>) -> bool {
        match handler {
            Some(block) => {
                self.out.push(Step::Failed(stmt, "timeout"));
                self.threads[t].frames.push(Frame::After { stmt });
                self.push(t, block);
            }
            None => self.fail(t, Failure { name: "timeout", stmt, meant: true }),
        }
        true
    }

    /// What blocks keep is looked at after each change.
    fn look_at_keeps(&mut self) {
        for t in 0..self.threads.len() {
            if self.threads[t].breaks.is_some() || matches!(self.threads[t].state, State::Ended | State::Unwinds { .. })
            {
                continue;
            }
            let broken = self.threads[t].frames.iter().find_map(|frame| match frame {
                Frame::Keep { stmt, condition, handling: false, .. } => {
                    (self.world.holds(condition) == Some(false)).then_some(*stmt)
                }
                _ => None,
            });
            if let Some(stmt) = broken {
                self.break_keep(t, stmt);
            }
        }
    }

    /// A block that keeps something is left. Whether a step that goes on beside it comes to its end is not said.
    fn break_keep(&mut self, t: usize, stmt: Id) {
        let alive = self.threads.iter().filter(|x| !matches!(x.state, State::Ended | State::Joins)).count();
        self.certain &= alive < 2;
        self.threads[t].breaks = Some(stmt);
        let failure = Failure { name: "broken", stmt, meant: false };
        let taken = self.threads[t].frames.iter().any(|frame| match frame {
            Frame::Keep { stmt: s, handler: Some(_), .. } => *s == stmt,
            _ => false,
        });
        self.out.push(Step::Failed(stmt, code(failure.name)));
        if !taken && !self.thought_of_around(t, stmt, failure.name) {
            self.violations.push(Violation { code: code(failure.name), stmt });
        }
    }

    /// Whether a handler around a block takes a failure of it.
    fn thought_of_around(&self, t: usize, stmt: Id, name: &str) -> bool {
        let thread = &self.threads[t];
        let at = thread.frames.iter().position(|f| matches!(f, Frame::Keep { stmt: s, .. } if *s == stmt));
        let around = &thread.frames[..at.unwrap_or(0)];
        around.iter().any(|frame| takes(frame, name)) || thread.parent.is_some_and(|p| self.thought_of(p, name))
    }

    /// A job belongs to the innermost block that handles failures or holds something.
    fn own(&mut self, t: usize, job: usize) {
        let mut at = Some(t);
        while let Some(thread) = at {
            for frame in self.threads[thread].frames.iter_mut().rev() {
                if let Frame::Guard { jobs, .. }
                | Frame::Window { owns: true, jobs, .. }
                | Frame::Keep { jobs, .. }
                | Frame::Try { jobs, .. }
                | Frame::Claim { jobs, .. }
                | Frame::Root { jobs, .. } = frame
                {
                    jobs.push(job);
                    return;
                }
            }
            at = self.threads[thread].parent;
        }
    }

    /// An action begins.
    fn act(&mut self, t: usize, action: Action, stmt: Id, whole: bool) {
        for thing in action.uses() {
            self.touch(t, thing, true);
            if self.holders.get(&thing).is_some_and(|h| !self.may_use(t, thing, *h)) {
                // What becomes of a use of what another one has claimed is not said.
                self.certain = false;
            }
            let busy = self.threads.iter().enumerate().any(|(o, other)| {
                o != t && matches!(other.state, State::Acts { action, .. } if action.uses().contains(&thing))
            });
            if busy {
                self.fail(t, Failure { name: "claimed", stmt, meant: false });
                return;
            }
        }
        // Which steps fail while a limit is passed is not said step by step.
        if self.world.hangs_on_rounding(&action) || self.world.is_overloaded() {
            self.certain = false;
        }
        if self.world.presumes_wrongly(&action) {
            self.out.push(Step::Presumed(stmt));
        }
        let begun = self.world.needs(&action);
        let begun = if World::at_end(&action) { begun } else { begun.and_then(|()| self.world.effect(&action)) };
        self.note_on(&action, stmt);
        match begun {
            Err(refusal) => self.refuse(t, refusal, stmt),
            Ok(()) => {
                let until = self.now + World::duration(&action);
                self.look_for_danger(stmt);
                self.threads[t].state = State::Acts { until, action, stmt, whole };
            }
        }
    }

    /// Whether a thing that is claimed is claimed for this thread: by itself, or by one around when this one began inside of its block.
    fn may_use(&self, t: usize, thing: Thing, holder: usize) -> bool {
        t == holder || self.within(t, holder) && self.threads[t].inherits.contains(&thing)
    }

    /// Whether a thread is another one, or one of its branches or jobs.
    fn within(&self, t: usize, holder: usize) -> bool {
        t == holder || self.threads[t].parent.is_some_and(|p| self.within(p, holder))
    }

    fn note_on(&mut self, action: &Action, stmt: Id) {
        match *action {
            Action::Fire(o) => drop(self.last_on.insert(Thing::Oven(o), stmt)),
            Action::Heat(p, _) => drop(self.last_on.insert(Thing::Plate(p), stmt)),
            Action::TakeTip => drop(self.last_on.insert(Thing::Pipette, stmt)),
            Action::Pick(_) => drop(self.last_on.insert(Thing::Arm, stmt)),
            _ => {}
        }
        self.moves += usize::from(action.uses().contains(&Thing::Arm));
    }

    fn end_action(&mut self, t: usize, action: &Action, stmt: Id, whole: bool) {
        for thing in action.uses() {
            self.touch(t, thing, true);
        }
        self.threads[t].state = State::Ready;
        let ended = if World::at_end(action) { self.world.effect(action) } else { Ok(()) };
        self.look_for_danger(stmt);
        match ended {
            Err(refusal) => self.refuse(t, refusal, stmt),
            Ok(()) if whole => self.done(stmt),
            Ok(()) => {}
        }
    }

    fn look_for_danger(&mut self, stmt: Id) {
        self.look_at_keeps();
        for cup in 0..self.world.cups.len() {
            if self.world.is_attacked(cup) && !std::mem::replace(&mut self.walls[cup], true) {
                self.out.push(Step::Failed(stmt, "material-attacked"));
                self.violations.push(Violation { code: "material-attacked", stmt });
            }
            if self.world.is_dangerous(cup) && !std::mem::replace(&mut self.dangers[cup], true) {
                self.out.push(Step::Failed(stmt, "incompatible-mix"));
                self.violations.push(Violation { code: "incompatible-mix", stmt });
            }
        }
    }

    fn refuse(&mut self, t: usize, refusal: Refusal, stmt: Id) {
        let name = match refusal {
            Refusal::Failure(name) => name,
            Refusal::Fault => "",
        };
        self.fail(t, Failure { name, stmt, meant: false });
    }

    /// A failure begins its way outwards. One that somebody has thought of is no violation.
    fn fail(&mut self, t: usize, failure: Failure) {
        self.fail_with(t, failure, code(failure.name));
    }

    /// The same, where one name stands for several findings.
    fn fail_with(&mut self, t: usize, failure: Failure, code: &'static str) {
        self.out.push(Step::Failed(failure.stmt, code));
        if !self.thought_of(t, failure.name) {
            let violation = Violation { code, stmt: failure.stmt };
            match failure.meant {
                false => self.violations.push(violation),
                true if ["timeout", "late"].contains(&failure.name) => self.vain.push(violation),
                true => {}
            }
        }
        self.threads[t].state = State::Unwinds { failure: Some(failure) };
    }

    /// Whether a block around has a handler for it, or another block to try.
    fn thought_of(&self, t: usize, name: &str) -> bool {
        let thread = &self.threads[t];
        let taken = thread.frames.iter().any(|frame| takes(frame, name));
        !name.is_empty() && (taken || thread.parent.is_some_and(|p| self.thought_of(p, name)))
    }

    /// A wait for a condition.
    fn waited(&mut self, t: usize, c: &Condition, deadline: f64, stmt: Id, handler: Option<&'p Block>) -> bool {
        if self.world.holds(c) == Some(true) {
            self.look(t, c);
            self.learn_all(t, c);
            self.release(t);
            return true;
        }
        if self.now < deadline {
            return false;
        }
        self.look(t, c);
        self.timed_out(t, stmt, handler)
    }

    /// What made a condition true comes before what follows the wait for it.
    fn learn_all(&mut self, t: usize, c: &Condition) {
        let thing = match *c {
            Condition::Fuller(c, _) | Condition::Warm(c, _) | Condition::Made(c, _) => Thing::Cup(c),
            Condition::On(o) => Thing::Oven(o),
            Condition::Heavy(_) => Thing::Place(0),
            Condition::Dial(_) => return,
        };
        let writers: Vec<usize> =
            self.touches.iter().filter(|x| x.thing == thing && x.write).map(|x| x.thread).collect();
        for writer in writers.into_iter().filter(|w| *w != t) {
            self.learn(t, writer);
        }
    }

    fn claim(&mut self, t: usize, things: &'p [Thing], stmt: Id, body: &'p Block, order: usize) -> bool {
        let free = |thing: &Thing| {
            let held = self.holders.get(thing).is_some_and(|h| !self.may_use(t, *thing, *h));
            let used = self.threads.iter().enumerate().any(|(o, other)| {
                o != t && matches!(other.state, State::Acts { action, .. } if action.uses().contains(thing))
            });
            !held && !used
        };
        if !things.iter().all(free) {
            return false;
        }
        let earlier = self.threads.iter().any(|other| match other.state {
            State::Claims { things: others, order: o, .. } => o < order && others.iter().any(|x| things.contains(x)),
            _ => false,
        });
        // First come, first served; whether one that wants less may go before is not said.
        if earlier {
            self.certain = false;
        }
        for thing in things {
            if let Some(knows) = self.released.get(thing).cloned() {
                self.know(t, &knows);
            }
            self.touch(t, *thing, true);
            self.holders.entry(*thing).or_insert(t);
        }
        self.threads[t].frames.push(Frame::Claim { stmt, things, jobs: Vec::new() });
        self.push(t, body);
        true
    }

    /// Waits for branches, or for the jobs of a block.
    fn join(&mut self, t: usize) -> bool {
        let (stmt, waited) = match self.threads[t].frames.last() {
            Some(Frame::Parallel { stmt, children }) => (Some(*stmt), children.clone()),
            Some(
                Frame::Guard { jobs, .. }
                | Frame::Window { jobs, .. }
                | Frame::Keep { jobs, .. }
                | Frame::Try { jobs, .. }
                | Frame::Claim { jobs, .. }
                | Frame::Root { jobs, .. },
            ) => (None, jobs.clone()),
            _ => (None, Vec::new()),
        };
        let failed = waited.iter().find(|c| self.threads[**c].failed.is_some()).copied();
        if stmt.is_some() && failed.is_some() {
            for child in &waited {
                self.stop(*child);
            }
        }
        if waited.iter().any(|c| !matches!(self.threads[*c].state, State::Ended)) {
            return false;
        }
        for child in &waited {
            self.learn(t, *child);
        }
        self.threads[t].state = State::Ready;
        if let Some(stmt) = stmt {
            let failures: Vec<Failure> = waited.iter().filter_map(|c| self.threads[*c].failed.take()).collect();
            // Which of several counts is not said.
            self.certain &= failures.len() < 2;
            self.threads[t].frames.pop();
            match failures.first() {
                Some(failure) => self.threads[t].state = State::Unwinds { failure: Some(*failure) },
                None => self.done(stmt),
            }
        }
        true
    }

    fn awaited(&mut self, t: usize, job: usize, stmt: Id) -> bool {
        if !matches!(self.threads[job].state, State::Ended) {
            return false;
        }
        self.learn(t, job);
        match self.threads[job].failed.take() {
            Some(failure) => self.threads[t].state = State::Unwinds { failure: Some(failure) },
            None => {
                self.done(stmt);
                self.threads[t].state = State::Ready;
            }
        }
        true
    }

    fn stop(&mut self, t: usize) {
        if !matches!(self.threads[t].state, State::Ended) {
            // What it could do at this moment it may have done before: another execution does so.
            self.alone &= self.threads[t].stopped || !self.is_about_to_act(t);
            self.threads[t].stopped = true;
        }
    }

    /// Whether a thread goes on at this moment with something other than a wait, or has just begun that.
    fn is_about_to_act(&self, t: usize) -> bool {
        let ready = match self.threads[t].state {
            State::Ready => true,
            State::Waits { until, .. } => until <= self.now,
            State::Acts { until, ref action, .. } => return until - World::duration(action) >= self.now,
            _ => false,
        };
        let next = match self.threads[t].frames.as_slice() {
            [] => return false,
            [.., Frame::Block { stmts, next }] => stmts.get(*next).map(|stmt| &stmt.kind),
            _ => return ready,
        };
        ready && !matches!(next, Some(Kind::Wait(_) | Kind::Until(..) | Kind::Hold(..)))
    }

    /// Leaves the innermost block with a failure, or because the thread is stopped.
    fn unwind(&mut self, t: usize, failure: Option<Failure>) -> bool {
        let inside = match self.threads[t].frames.last() {
            None => {
                let thread = &mut self.threads[t];
                thread.failed = failure;
                thread.state = State::Ended;
                return true;
            }
            Some(Frame::Parallel { children: inside, .. }) => inside.clone(),
            Some(
                Frame::Guard { jobs, .. }
                | Frame::Window { jobs, .. }
                | Frame::Keep { jobs, .. }
                | Frame::Try { jobs, .. }
                | Frame::Claim { jobs, .. }
                | Frame::Root { jobs, .. },
            ) => jobs.clone(),
            _ => Vec::new(),
        };
        let mut waits = false;
        for child in &inside {
            self.stop(*child);
            waits |= !matches!(self.threads[*child].state, State::Ended);
        }
        if waits {
            return false;
        }
        for child in &inside {
            self.learn(t, *child);
            // Of those that were being stopped a failure decides nothing.
            self.threads[*child].failed = None;
        }
        self.leave_failed(t, failure);
        true
    }

    /// The innermost block has failed: handlers and other blocks have their turn.
    fn leave_failed(&mut self, t: usize, failure: Option<Failure>) {
        let named = failure.filter(|f| !f.name.is_empty()).map(|f| f.name);
        let breaks = self.threads[t].breaks;
        match self.threads[t].frames.last_mut() {
            // Its handler takes what comes too late within it as well.
            Some(Frame::Window { handler, jobs, .. }) if handler.is_some() && named == Some("late") => {
                jobs.clear();
                if let Some(block) = handler.take() {
                    self.push(t, block);
                }
            }
            Some(Frame::Keep { stmt, handler, handling, jobs, .. }) if breaks == Some(*stmt) => {
                jobs.clear();
                let stmt = *stmt;
                let handler = handler.filter(|_| !std::mem::replace(handling, true));
                self.threads[t].breaks = None;
                match handler {
                    Some(block) => self.push(t, block),
                    None => {
                        self.threads[t].frames.pop();
                        let failure = Failure { name: "broken", stmt, meant: false };
                        self.threads[t].state = State::Unwinds { failure: Some(failure) };
                    }
                }
            }
            Some(Frame::Guard { stmt, body, handlers, tries, handling, jobs }) if !*handling && named.is_some() => {
                jobs.clear();
                let fits = |h: &&Handler| Some(h.on) == named || h.on == "failure";
                let Some(which) = handlers.iter().position(|h| fits(&h)) else {
                    self.threads[t].frames.pop();
                    return;
                };
                match &handlers[which].what {
                    Remedy::Retry(n) if tries[which] < *n => {
                        tries[which] += 1;
                        let (stmt, body) = (*stmt, *body);
                        self.out.push(Step::Turn(stmt));
                        self.push(t, body);
                    }
                    Remedy::Retry(_) => drop(self.threads[t].frames.pop()),
                    Remedy::Block(block) => {
                        *handling = true;
                        self.push(t, block);
                    }
                }
            }
            Some(Frame::Try { other, second, jobs, .. }) if !*second && named.is_some() => {
                jobs.clear();
                *second = true;
                let other = *other;
                self.push(t, other);
            }
            Some(Frame::Root { finally, failed, jobs }) => {
                jobs.clear();
                let first = !std::mem::replace(finally, true);
                *failed = (*failed).or(failure);
                match first {
                    true => {
                        let body = &self.plan.finally;
                        self.push(t, body);
                    }
                    // What fails in `finally` ends it.
                    false => self.threads[t].state = State::Ready,
                }
            }
            Some(Frame::Claim { things, .. }) => {
                let things = *things;
                self.threads[t].frames.pop();
                self.let_go(t, things);
            }
            _ => drop(self.threads[t].frames.pop()),
        }
    }

    /// What the lab is left as counts where the plan itself has led there.
    fn leave(&mut self, end: &End) {
        match end {
            End::Deadlock => {
                let waits = self.threads.iter().find_map(|t| match t.state {
                    State::Claims { stmt, .. } | State::Awaits { stmt, .. } => Some(stmt),
                    _ => None,
                });
                self.violations.push(Violation { code: "deadlock", stmt: waits.unwrap_or_default() });
            }
            End::Failed(failure) if !failure.meant => {}
            End::Unfinished => {}
            End::Passed | End::Failed(_) => {
                let ovens = self.world.ovens.iter().enumerate().filter(|(_, o)| o.burning).map(|(i, _)| Thing::Oven(i));
                let plates = self.world.plates.iter().enumerate().filter(|(_, p)| p.hot).map(|(i, _)| Thing::Plate(i));
                let tip = self.world.tip.iter().map(|_| Thing::Pipette);
                let arm = self.world.holding.iter().map(|_| Thing::Arm);
                let left: Vec<Thing> = ovens.chain(plates).chain(tip).chain(arm).collect();
                for thing in left {
                    let stmt = self.last_on.get(&thing).copied().unwrap_or_default();
                    self.violations.push(Violation { code: "unfinished", stmt });
                }
            }
        }
    }
}

/// Whether a block takes a failure of what is in it.
fn takes(frame: &Frame<'_>, name: &str) -> bool {
    match frame {
        Frame::Guard { handlers, tries, handling: false, .. } => {
            // Another go is no answer where there is none left.
            let first = handlers.iter().position(|h| h.on == name || h.on == "failure");
            first.is_some_and(|i| !matches!(handlers[i].what, Remedy::Retry(n) if tries[i] >= n))
        }
        Frame::Try { second: false, .. } => true,
        Frame::Window { handler: Some(_), .. } => name == "late",
        _ => false,
    }
}

/// The code of the finding that tells of a failure.
fn code(name: &'static str) -> &'static str {
    match name {
        "volume_underflow" => "volume-underflow",
        "" => "transfer-fraction",
        "volume_overflow" => "volume-overflow",
        "capped" => "capped",
        "lid_open" => "lid-open",
        "still_moving" => "still-moving",
        "tip_on_tip" => "tip-on-tip",
        "out_of_tips" => "out-of-tips",
        "no_tip" => "no-tip",
        "below_minimum" => "below-minimum",
        "tip_overflow" => "tip-overflow",
        "never_filled" => "never-filled",
        "contamination" => "contamination",
        "claimed" => "claimed-twice",
        "late" => "window-unmeetable",
        "job" => "job-not-begun",
        "broken" => "expectation-failed",
        "hand_full" => "hand-full",
        "not_in_hand" => "not-in-hand",
        "not_piped" => "not-piped",
        "out_of_range" => "out-of-range",
        other => other,
    }
}
