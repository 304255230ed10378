//! What is known at every point of the plan, found by following it before anything moves.
//!
//! Numbers are followed exactly, as one of a few, or within bounds, over every way through the plan (abstract
//! interpretation); where ways meet, what is known is what holds on all of them. The way followed is the one on which
//! devices do what they are told: failures that only a device can report (`fails`) are looked at beside it, those the
//! plan itself raises are on it. A need that fails on every way is an error, one that fails on some a warning; what only a
//! run can tell is left to the run.
//!
//! - `value`, `state`, `nodes`, `eval`, `dual`: abstract values, what is known at one point, and the values of nodes there.
//! - `walk`, `actions`, `demands`, `turns`, `handled`, `failing`, `reported`, `lasting`, `words`: the steps of a plan, construct by construct.
//! - `evolve`, `bracket`, `together`, `totals`: the passing of time, as a box that the laws never leave.
//! - `even`, `course`, `timers`, `held`: what moves evenly, and what the clock brings about, at their moments.
//! - `fluxes`, `bonds`, `polytope`: reactions and streams by their extents.
//! - `jobs`, `meantime`, `in_time`, `raced`, `clashing`, `interference`, `beside`, `stopped`: branches and jobs side by side.
//! - `cases`, `apart`, `trace_partitioning`, `otherwise`: where ways meet, and ways followed one by one.
//! - `swallowed`: failures that handlers for all failures take for certain.
//! - `history`, `report`, `program_points`, `reached`, `left`: findings with their stories, and what else is told.

mod actions;
mod apart;
mod beside;
mod bonds;
mod bracket;
mod cases;
mod clashing;
mod course;
mod demands;
mod dual;
mod eval;
mod even;
mod evolve;
mod failing;
mod fluxes;
mod groups;
mod handled;
mod held;
mod held_back;
mod history;
mod in_time;
mod interference;
mod jobs;
mod lasting;
mod left;
mod meantime;
mod nodes;
mod otherwise;
mod polytope;
mod program_points;
mod raced;
mod reached;
mod renewed;
mod report;
mod reported;
mod state;
mod stopped;
mod swallowed;
mod timers;
mod together;
mod totals;
mod trace_partitioning;
mod turns;
mod value;
mod walk;
mod words;

use std::cell::OnceCell;
use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;

use matterix_ir::model::{Derivative, Event};
use matterix_ir::plan::{Condition, Plan, Step, StepId};
use matterix_ir::scene::InstanceId;
use matterix_ir::{Code, Diagnostic, NodeId, Sources, Span, codes};
use rustc_hash::FxHashMap;

pub use self::evolve::Window;
pub use self::program_points::{After, Seen};
use self::state::AbstractState;
pub use self::value::AbstractValue;
use super::Subject;
use crate::declare::ReactionId;
use crate::elaborate::hazards::Hazard;
use crate::elaborate::mixtures::Passages;
use crate::eval::lab::{Elaborator, ExtensiveKey};

/// Steps followed before the rest of a plan is left to the run.
const MOST_STEPS: usize = 400_000;

/// What a failure is called, and what is known when it is raised.
type Raised = (String, AbstractState);

/// A statement of the user's that is followed now.
#[derive(Clone)]
struct Site {
    span: Span,
    label: String,
    /// Whether it calls a skill or command.
    calls: bool,
}

/// Working state of one pass over a plan.
struct Interpreter<'l, 'a> {
    lab: &'l Elaborator<'a>,
    sources: &'l Sources,
    plan: &'l Plan,
    events: &'l [Event],
    derivatives: &'l [Derivative],
    /// Extensive states by mixture index.
    mixtures: Vec<Vec<(ExtensiveKey, u32)>>,
    /// The pairs of states that transfers between two of them change.
    passages: Passages,
    params: Vec<AbstractValue>,
    /// What is known of nodes by themselves.
    nodes: nodes::Nodes,
    /// Room for exact values.
    numbers: Vec<f64>,
    /// Room for numbers with their rates.
    duals: Vec<dual::Dual>,
    /// Values of the operations that were evaluated.
    values: eval::Values,
    /// Sums of states that may hang together, as far as they were evaluated: how they hung together then. It is kept, so that no other one
    /// is taken for it.
    sums: FxHashMap<NodeId, Option<Rc<bonds::Bonds>>>,
    /// Derivatives that depend on a state.
    rates_of: BTreeMap<u32, Vec<u32>>,
    /// The derivative of each state that a law moves.
    led: FxHashMap<u32, u32>,
    /// Events that depend on a state.
    events_of: BTreeMap<u32, Vec<u32>>,
    /// By state, those by which laws and events change it; made when it is first asked for.
    led_by: OnceCell<FxHashMap<u32, Vec<u32>>>,
    /// What the whole plan changes, and what laws and events change by that; the same.
    by_plan: OnceCell<BTreeSet<u32>>,
    /// Limits that depend on a state, by index.
    limits_of: BTreeMap<u32, Vec<u32>>,
    /// Conditions that steps presume to have held, by the states they depend on.
    presumed_of: BTreeMap<u32, Vec<NodeId>>,
    /// Events that depend on time.
    timed: Vec<u32>,
    /// Those that are followed at their moments now: what bounds the passing of time leaves them out.
    at_moments: Vec<u32>,
    /// Rates asked for to bound what moves.
    rates_asked: usize,
    /// Whether it was said that so many states move that they are not bounded any more.
    unbounded_said: bool,
    /// Derivatives that depend on the time itself.
    clocked: Vec<u32>,
    /// While time passes: from when to when. An event comes about somewhere in it.
    meanwhile: Option<AbstractValue>,
    /// While time passes: states that rates ask for and concurrent steps may set.
    veiled: Vec<u32>,
    /// A law has broken a limit while time passed, and a handler takes that: the step goes no further.
    stopped: bool,
    /// A handler has taken the failure of a limit, which may still be passed behind it.
    limit_taken: bool,
    /// States that are amounts of species.
    amounts: BTreeSet<u32>,
    /// What is known of the conditions of reactions.
    windows: BTreeMap<ReactionId, Window>,
    /// Conditions of the workflow's own branches that constants decide: how they come out, and whether there is an `else`.
    branches: BTreeMap<Span, (String, BTreeSet<bool>, bool)>,
    findings: Vec<report::Finding>,
    /// How what other orders break comes out in the order of time.
    judged: in_time::Judged,
    /// Hazards that are looked for in the order of time.
    dangers: in_time::Dangers<'l>,
    /// In the order of time: states that nothing asks for, which are not followed.
    unheeded: BTreeSet<u32>,
    /// Failures raised inside each open body with handlers, innermost last.
    guards: Vec<Vec<Raised>>,
    /// Failures that devices may report inside each open body with handlers, innermost last.
    reported: Vec<Vec<Raised>>,
    /// Where handlers that are followed begin their body again: how often, and what is known there; innermost last.
    again: Vec<Vec<(AbstractValue, AbstractState)>>,
    /// What takes failures around, innermost last.
    caught: Vec<swallowed::Net>,
    /// Failures for certain that handlers for all failures took.
    swallowed: Vec<swallowed::Swallowed>,
    /// Statements below such handlers that came to their end.
    succeeded: BTreeSet<Span>,
    /// Handlers and alternatives behind which the run goes on.
    rescued: BTreeSet<StepId>,
    /// The user's statements around, innermost last.
    sites: Vec<Site>,
    /// Rows of tables that the turns around are for, innermost last.
    rows: Vec<Span>,
    /// Findings are not reported while this is not 0.
    quiet: usize,
    /// While this is not 0 it is open whether the plan gets here: what fails for certain fails on some ways.
    doubt: usize,
    /// Choices and handlers around of which a run may take another way.
    open: usize,
    /// The most of them around a `start`.
    open_at_start: usize,
    /// While this is not 0 the steps clean up, as those of handlers and `finally` do.
    cleaning: usize,
    /// States that other branches change at the same time.
    shared: Vec<BTreeSet<u32>>,
    /// Of these, those that others change while the branch or job that is followed goes on.
    meets: Vec<BTreeSet<u32>>,
    /// How long operations last of which that follows from states, s, by step; joined over all times they are done.
    lasting: BTreeMap<StepId, (f64, f64)>,
    /// What goes on beside the branches and jobs that are followed, innermost last.
    rivals: Vec<Vec<interference::Rival>>,
    /// States that both what is followed and what goes on beside it set, innermost last.
    contested: Vec<BTreeSet<u32>>,
    /// Things that what is followed has to itself, innermost last.
    claimed: Vec<InstanceId>,
    /// Conditions that `keep` asks for all the time.
    kept: Vec<&'l Condition>,
    /// Conditions that commands and skills around ask for while they go on.
    during: Vec<&'l Condition>,
    /// Of both, in the order in which they were begun, with the bodies with handlers that were open then.
    unbroken: Vec<(&'l Condition, usize)>,
    /// Jobs that go on.
    jobs: jobs::Jobs,
    /// Steps of jobs are followed when these are waited for, not when they are started.
    late: bool,
    /// Steps of jobs that were not followed yet have been waited for: no run goes on as this flow does.
    needs_jobs: bool,
    /// Loops of which a turn is followed.
    turning: usize,
    /// Ways that have met.
    ways: trace_partitioning::Ways,
    /// Meetings of ways that differ in what should hold at the end.
    forks: left::Forks,
    /// What should be in order at the end by the states it depends on, where that was asked for.
    ends_of: Option<Rc<BTreeMap<u32, Vec<usize>>>>,
    /// What branches and jobs change that are followed, the outermost first.
    courses: Vec<stopped::Course>,
    /// What is done however the blocks around end, the outermost first.
    finally: Vec<StepId>,
    /// How often bounds of what moves are brought closer.
    refinements: usize,
    /// Blocks around that wait for the jobs begun in them.
    blocks: usize,
    /// Whether the plan starts jobs that a written failure may stop.
    stops_jobs: bool,
    /// Jobs whose steps are followed, each within the one before.
    in_jobs: usize,
    /// Whether the plan was followed to its end, and that looked at.
    ended: bool,
    /// By step: whether it was followed.
    reached: Vec<bool>,
    steps: usize,
    /// What is known after each statement, where it is asked for.
    notes: Option<program_points::Notes>,
}

/// What following the plan brings.
pub struct Followed {
    /// What would go wrong.
    pub found: Vec<Diagnostic>,
    /// What is known of the conditions of reactions.
    pub windows: BTreeMap<ReactionId, Window>,
    /// What is known of the nodes asked for: at the start, and after each statement.
    pub seen: Vec<Seen>,
    /// How long operations last of which that follows from states, s, by step.
    pub lasting: BTreeMap<StepId, (f64, f64)>,
    /// Steps that no run comes to.
    pub never: BTreeSet<StepId>,
}

/// Follows the plan and reports what would go wrong; what is known of the nodes in `asked` is kept at every statement. `hazards` are
/// those that steps side by side may bring about.
pub fn check(subject: Subject<'_, '_>, hazards: &[Hazard], asked: Option<&[NodeId]>) -> Followed {
    let begin = || Interpreter::new(subject);
    let noting = || {
        let mut flow = begin();
        if let Some(asked) = asked {
            flow.take_notes(asked);
        }
        flow
    };
    let mut flow = jobs::follow(noting);
    in_time::add_findings(&mut flow, hazards, &begin);
    let seen = flow.seen();
    let windows = std::mem::take(&mut flow.windows);
    let lasting = flow.durations();
    let never = flow.never_reached();
    let others = otherwise::other_values(&mut flow);
    let mut found = flow.diagnostics();
    for other in others {
        let supposing = || {
            let mut flow = begin();
            flow.params[other.param as usize] = AbstractValue::point(other.value);
            flow
        };
        let new = otherwise::said_of(subject.lab, &other, jobs::follow(supposing).diagnostics());
        let is_new = |d: &Diagnostic| !found.iter().any(|f| f.code == d.code && f.span() == d.span());
        let new: Vec<Diagnostic> = new.into_iter().filter(is_new).collect();
        found.extend(new);
    }
    Followed { found, windows, seen, lasting, never }
}

/// Whether branches and jobs use things one after the other.
pub enum Turns {
    /// All of them go on at times that are known, and no two use one thing at the same time.
    Taken,
    /// The statements at these places always do.
    Clash([Span; 2]),
    /// Only a run can tell.
    Unknown,
}

/// Follows branches and jobs in the order of time to tell whether two of them use one thing at the same time.
pub fn turns(subject: Subject<'_, '_>) -> Turns {
    let follow = |backward| Interpreter::new(subject).follow_in_time(backward);
    match follow(false) {
        Turns::Taken if matches!(follow(true), Turns::Taken) => Turns::Taken,
        Turns::Clash([a, b]) => match follow(true) {
            Turns::Clash(met) if met.contains(&a) && met.contains(&b) => Turns::Clash(met),
            _ => Turns::Unknown,
        },
        _ => Turns::Unknown,
    }
}

/// States that are amounts of species, and never below 0.
fn amounts(lab: &Elaborator<'_>) -> BTreeSet<u32> {
    let overdrawn = lab.overdrawn();
    let matter = lab.extensive.iter().filter_map(|(key, state)| Some((key.matter()?, *state)));
    matter.filter(|(s, _)| !overdrawn.contains(s)).map(|(_, state)| state).collect()
}

impl<'l, 'a> Interpreter<'l, 'a> {
    fn new(subject: Subject<'l, 'a>) -> Self {
        let Subject { lab, sources, plan, derivatives, events } = subject;
        let mut flow = Interpreter {
            lab,
            sources,
            plan,
            events,
            derivatives,
            mixtures: lab.extensive_by_mixture(),
            passages: Passages::default(),
            params: lab.params.iter().map(|p| AbstractValue::point(p.value)).collect(),
            nodes: nodes::Nodes::new(lab.graph.ops().len()),
            numbers: Vec::new(),
            duals: Vec::new(),
            values: eval::Values::new(lab.graph.ops().len()),
            sums: FxHashMap::default(),
            rates_of: BTreeMap::new(),
            led: derivatives.iter().zip(0..).map(|(d, i)| (d.state, i)).collect(),
            events_of: BTreeMap::new(),
            led_by: OnceCell::new(),
            by_plan: OnceCell::new(),
            limits_of: BTreeMap::new(),
            presumed_of: BTreeMap::new(),
            timed: Vec::new(),
            at_moments: Vec::new(),
            rates_asked: 0,
            unbounded_said: false,
            clocked: Vec::new(),
            meanwhile: None,
            veiled: Vec::new(),
            stopped: false,
            limit_taken: false,
            amounts: amounts(lab),
            windows: BTreeMap::new(),
            branches: BTreeMap::new(),
            findings: Vec::new(),
            judged: in_time::Judged::default(),
            dangers: in_time::Dangers::default(),
            unheeded: BTreeSet::new(),
            guards: Vec::new(),
            reported: Vec::new(),
            again: Vec::new(),
            caught: Vec::new(),
            swallowed: Vec::new(),
            succeeded: BTreeSet::new(),
            rescued: BTreeSet::new(),
            sites: Vec::new(),
            rows: Vec::new(),
            quiet: 0,
            doubt: 0,
            open: 0,
            open_at_start: 0,
            cleaning: 0,
            shared: Vec::new(),
            meets: Vec::new(),
            lasting: BTreeMap::new(),
            rivals: Vec::new(),
            contested: Vec::new(),
            claimed: Vec::new(),
            kept: Vec::new(),
            during: Vec::new(),
            unbroken: Vec::new(),
            jobs: jobs::Jobs::new(),
            late: false,
            needs_jobs: false,
            turning: 0,
            ways: trace_partitioning::Ways::default(),
            forks: left::Forks::default(),
            ends_of: None,
            courses: Vec::new(),
            finally: Vec::new(),
            refinements: 0,
            blocks: 0,
            stops_jobs: false,
            in_jobs: 0,
            ended: false,
            reached: vec![false; plan.steps.len()],
            steps: 0,
            notes: None,
        };
        for (i, d) in derivatives.iter().enumerate() {
            if lab.graph.leaves(d.rate).meets(matterix_ir::Leaves::TIME) {
                flow.clocked.push(i as u32);
            }
            for state in flow.parts(d.rate).states.clone() {
                flow.rates_of.entry(state).or_default().push(i as u32);
            }
        }
        for (i, e) in events.iter().enumerate() {
            for state in flow.parts(e.when).states.clone() {
                flow.events_of.entry(state).or_default().push(i as u32);
            }
            if flow.parts(e.when).timed {
                flow.timed.push(i as u32);
            }
        }
        for (i, limit) in plan.limits.iter().enumerate() {
            for state in flow.parts(limit.condition.node).states.clone() {
                flow.limits_of.entry(state).or_default().push(i as u32);
            }
        }
        for node in presumed(plan) {
            for state in flow.parts(node).states.clone() {
                flow.presumed_of.entry(state).or_default().push(node);
            }
        }
        flow
    }

    /// Exchanges with another flow of the same plan what is known of nodes and derivatives by themselves, so that it is found once.
    fn swap_known(&mut self, other: &mut Self) {
        std::mem::swap(&mut self.nodes, &mut other.nodes);
    }

    /// Follows the plan from its start.
    fn follow(&mut self) {
        let mut facts = self.start();
        self.fire((0..self.events.len() as u32).collect(), &mut facts);
        self.limits((0..self.plan.limits.len() as u32).collect(), &mut facts);
        let begun = facts.clone();
        self.note_start(&begun);
        // What a mistake cut short is not finished for another reason.
        self.guards.push(Vec::new());
        self.stops_jobs = self.may_stop_jobs();
        if self.stops_jobs {
            self.begin_course();
        }
        let ended = self.walk(self.plan.root, facts).and_then(|facts| self.await_all(facts));
        let raised = self.guards.pop().unwrap_or_default();
        if !self.findings.iter().any(report::Finding::is_error) {
            self.ended = ended.is_some();
            if let Some(ended) = ended {
                self.ends(&begun, &ended);
            }
            self.ends_failed(&begun, &raised);
        }
        self.dead_branches();
        self.tell_swallowed();
    }

    /// What is known when the run begins.
    fn start(&mut self) -> AbstractState {
        let nothing = |count: usize| vec![AbstractValue::top(); count];
        let states = nothing(self.lab.states.len()).into_iter().collect();
        let mut facts = AbstractState::new(states, nothing(self.plan.locals.len()), AbstractValue::Point(0.0));
        facts.unsettled = (0..self.derivatives.len() as u32).collect();
        facts.fired = vec![Some(false); self.events.len()];
        let states = &self.lab.states;
        facts.states = (0..states.len()).map(|i| self.eval(states[i].initial, &facts)).collect();
        for node in presumed(self.plan) {
            if self.eval(node, &facts).truth() != Some(false) {
                facts.held.insert(node);
            }
        }
        facts
    }

    /// Notes how a branch of the workflow itself comes out where constants decide it.
    fn note_branch(&mut self, condition: &Condition, otherwise: bool) {
        let in_skill = self.sites.iter().any(|s| s.calls);
        let constant = self.lab.graph.constant(condition.node);
        let by_parameters = self.lab.by_parameters.contains(&condition.span);
        if let Some(v) = constant.filter(|_| !in_skill && !by_parameters && !self.in_library(condition.span)) {
            let entry = self.branches.entry(condition.span);
            let (_, seen, _) = entry.or_insert_with(|| (condition.text.clone(), BTreeSet::new(), otherwise));
            seen.insert(v != 0.0);
        }
    }

    /// Whether a span stands in the library.
    fn in_library(&self, span: Span) -> bool {
        self.sources.get(span.file).is_some_and(|f| f.name.contains("::"))
    }

    /// The user's statement that is followed now.
    fn site(&self) -> Span {
        self.sites.last().map(|s| s.span).unwrap_or_default()
    }

    /// Whether a condition may depend on what other branches do meanwhile.
    fn is_shared(&mut self, node: NodeId) -> bool {
        if self.shared.is_empty() && self.jobs.is_empty() {
            return false;
        }
        let states = self.parts(node).states.clone();
        self.shared.iter().chain(self.of_jobs()).any(|set| states.iter().any(|s| set.contains(s)))
    }
}

/// What steps presume to have held at some moment.
fn presumed(plan: &Plan) -> BTreeSet<NodeId> {
    let operations = plan.steps.iter().filter_map(|s| match &s.step {
        Step::Operation(o) => Some(o),
        _ => None,
    });
    operations.flat_map(|o| &o.presumes).filter(|p| p.ever).map(|p| p.condition.node).collect()
}

/// Whether a finding of this kind is an error even where it happens on some ways only: what is gone stays gone.
pub fn forbidden_on_any_way(code: Code) -> bool {
    [codes::TIP_USED, codes::USED_AFTER_DISPOSAL, codes::DISPOSED_TWICE].contains(&code)
}

/// Whether a finding of this kind is a warning even where it happens on every way: what is done twice does no harm.
fn only_advice(code: Code) -> bool {
    code.family == "T3"
}

#[cfg(test)]
mod tests {
    use crate::check::tests::found;

    /// A counter that is set, with a need and a limit.
    const BENCH: &str = r#"
capability Counter {
    state count: Ratio = 2
    keeps count <= 10 else too_much "count less"
    command add(v: Ratio)
        needs count < 9
        takes v * 1 s
        effect count = count + v
    process falls while count > 100 { count' -= 1 1/s }
}
asset C: Counter {}
lab bench {
    ambient: 25 degC
    c = C
}
"#;

    fn followed(steps: &str) -> Vec<String> {
        let text = format!("{BENCH}workflow w(more: Bool) in bench {{\n{steps}\n}}\n");
        found(&text, |bench| super::check(bench.subject(), &[], None).found)
    }

    #[test]
    fn what_is_right_has_no_findings() {
        assert_eq!(followed("add 5 by c\nexpect c.count == 7 and elapsed == 5 s"), [""; 0]);
    }

    #[test]
    fn needs_limits_waits_and_expectations_are_judged_by_what_is_known() {
        let found = "need-unmet: `add 1 by c` needs `count < 9`, which is false here";
        assert_eq!(followed("add 7 by c\nadd 1 by c"), [found]);
        assert_eq!(followed("add 9 by c"), ["need-unmet: `add 9 by c` fails: too much"]);
        assert_eq!(
            followed("wait until c.count >= 5 timeout 1 min"),
            ["waits-for-ever: `c.count >= 5` never becomes true: nothing changes it"]
        );
        assert_eq!(followed("add 1 by c\nexpect c.count == 4"), ["expectation-failed: `c.count == 4` is false"]);
    }

    #[test]
    fn on_some_ways_is_a_warning_and_loops_are_followed() {
        let found =
            "need-unmet: `add 1 by c` needs `count < 9`, which is false here, on some paths through the workflow";
        assert_eq!(followed("if more { add 7 by c }\nadd 1 by c"), [found]);
        assert_eq!(followed("repeat 4 times { add 2 by c }"), [""; 0]);
        assert_eq!(
            followed("repeat 5 times { add 2 by c }"),
            ["need-unmet: `add 2 by c` needs `count < 9`, which is false here"]
        );
    }

    #[test]
    fn branches_are_followed_beside_each_other() {
        assert_eq!(
            followed("parallel { sequence { add 3 by c } sequence { wait 1 s } }\nexpect c.count == 6"),
            ["expectation-failed: `c.count == 6` is false"]
        );
    }
}
