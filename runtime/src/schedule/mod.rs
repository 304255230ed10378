//! Schedules: in which order the blocks of a plan that claim instances take turns, so that the whole ends early.
//!
//! The steps of one line stay in their order; branches of `parallel` and jobs run beside each other; of the blocks that
//! claim the same instance one comes first. A list schedule by priority rules gives a start, the exact search shortens
//! it until it is proven to be the shortest, or time is up.

mod gantt;
mod list;
mod problem;
mod solve;
mod trial;
mod unroll;

use std::sync::atomic::AtomicBool;

use matterix_ir::model::Model;
use matterix_ir::plan::StepId;
use matterix_ir::scene::InstanceId;
use matterix_ir::{Diagnostic, Program, codes};
use matterix_timing::{Known, ROUNDING};
use serde::{Deserialize, Serialize};

pub use gantt::{chart, picture};

use crate::exec::{Turn, diagnostic};
use crate::run::RunOptions;
use list::Ordered;
use problem::{Moment, Problem};
use solve::Effort;
use unroll::Open;

/// Version of the form of a schedule as JSON.
pub const SCHEMA: u32 = 1;

/// Pairs of blocks that want the same instance; with more, the list schedule has to do.
const MOST_RIVALS: usize = 20_000;

/// How a schedule is made.
#[derive(Clone, Debug)]
pub struct Options<'c> {
    /// The search ends when one of these is set.
    pub stop: &'c [&'c AtomicBool],
    /// The search ends after so many decisions.
    pub decisions: Option<u64>,
    /// Seed of the search.
    pub seed: u64,
    /// How a trial run is done, where only the model can tell how long something takes.
    pub trial: RunOptions<'c>,
}

/// A block that has instances to itself, in its time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Block {
    /// What is done in it.
    pub label: String,
    /// The `claim`, by its index in the plan.
    pub step: StepId,
    /// Which time that step is reached, from 0.
    pub occurrence: u32,
    /// The line of steps it is in, by index in [`Schedule::lines`].
    pub line: usize,
    /// What it has to itself.
    pub instances: Vec<String>,
    /// When it begins, s.
    pub start: f64,
    /// When it ends, s.
    pub end: f64,
    /// Whether it waits for its time though what it claims is free: only so are the windows kept.
    pub held: bool,
}

/// An action that uses instances outside of any claim.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Action {
    /// The call.
    pub label: String,
    /// By its index in the plan.
    pub step: StepId,
    /// The line of steps it is in, by index in [`Schedule::lines`].
    pub line: usize,
    /// What it uses.
    pub instances: Vec<String>,
    /// When it begins, s.
    pub start: f64,
    /// When it ends, s.
    pub end: f64,
}

/// When everything is to happen.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Schedule {
    /// Version of this form.
    pub schema: u32,
    /// The workflow.
    pub workflow: String,
    /// Its parameters, as shown.
    pub arguments: Vec<(String, String)>,
    /// From the beginning to the end, s.
    pub makespan: f64,
    /// No schedule is shorter than this, s.
    pub bound: f64,
    /// Whether the makespan is proven to be the shortest.
    pub optimal: bool,
    /// Makespan of the list schedule, s; absent where none keeps the windows.
    pub list: Option<f64>,
    /// Whether durations were measured in a trial run.
    pub trial: bool,
    /// Names of the lines of steps: the workflow itself, branches, jobs.
    pub lines: Vec<String>,
    /// Blocks that claim, in the order in which they begin.
    pub blocks: Vec<Block>,
    /// Other uses of instances, in the order in which they begin.
    pub actions: Vec<Action>,
}

/// Makes the schedule of a program, or says why there is none.
pub fn schedule(program: &Program, options: &Options<'_>) -> Result<Schedule, Box<Diagnostic>> {
    let (problem, trial) = pose(program, options)?;
    let rivals = rivals(&problem);
    let first = list::best(&problem, &rivals);
    let bound = solve::lower_bound(&problem).ok_or_else(|| unmeetable(program, true))?;
    let limit = first.as_ref().map_or_else(|| longest(&problem), |f| f.makespan);
    let list = first.as_ref().map(|f| f.makespan);
    let mut best = first;
    let mut optimal = best.as_ref().is_some_and(|b| b.makespan <= bound + ROUNDING);
    let mut bound = bound;
    let mut proven = false;
    if !optimal && rivals.len() <= MOST_RIVALS {
        let effort = Effort { stop: options.stop, decisions: options.decisions, seed: options.seed };
        if let Some(found) = solve::search(&problem, &rivals, bound, limit, effort) {
            best = found.times.and_then(|times| settle(&problem, &rivals, times)).or(best);
            proven = found.proven;
        }
    }
    optimal |= proven;
    let Some(best) = best else { return Err(unmeetable(program, proven)) };
    let best = list::tidied(&problem, &rivals, &best).unwrap_or(best);
    if optimal {
        bound = best.makespan;
    }
    Ok(describe(program, &problem, &best, Facts { bound, optimal, list, trial }))
}

/// The plan as a problem, and whether a trial run was needed.
fn pose(program: &Program, options: &Options<'_>) -> Result<(Problem, bool), Box<Diagnostic>> {
    let Model { graph, params, states, derivatives, events, .. } = &program.model;
    let params = params.iter().map(|p| p.value).collect();
    let known = Known::new(graph, params, states, derivatives, events, &program.plan);
    let plan = &program.plan;
    let open = match unroll::unroll(plan, &known, None) {
        Ok(problem) => return Ok((problem, false)),
        Err(open) => open,
    };
    if let Open::Unknown(_) = open {
        let trace = trial::trial(program, &options.trial).map_err(|failure| {
            let mut d = match failure {
                Some(failure) => diagnostic(&failure),
                None => {
                    Diagnostic::error(codes::RUN_FAILED, plan.get(plan.root).span, "the trial run was stopped", "here")
                }
            };
            d.help.push("a schedule needs durations from a trial run, which failed here".to_owned());
            Box::new(d)
        })?;
        return match unroll::unroll(plan, &known, Some(&trace)) {
            Ok(problem) => Ok((problem, true)),
            Err(open) => Err(unknown(program, &open)),
        };
    }
    Err(unknown(program, &open))
}

fn unknown(program: &Program, open: &Open) -> Box<Diagnostic> {
    let plan = &program.plan;
    Box::new(match open {
        Open::Unknown(step) => {
            let node = plan.get(*step);
            let headline = format!("the duration of `{}` is unknown before a run", node.label);
            Diagnostic::error(codes::UNSCHEDULABLE, node.span, headline, "unknown duration")
                .help("write its duration with constants, parameters or times of named steps")
        }
        Open::TooLong => {
            let node = plan.get(plan.root);
            let headline = "the workflow has too many steps to be scheduled";
            Diagnostic::error(codes::UNSCHEDULABLE, node.span, headline, "loops are expanded")
        }
    })
}

fn unmeetable(program: &Program, proven: bool) -> Box<Diagnostic> {
    let plan = &program.plan;
    let name = &plan.workflow;
    let (headline, help) = if proven {
        (
            format!("no schedule of `{name}` keeps all of its time windows"),
            "allow more time in a `within` or `timeout`, or claim fewer things for a shorter time",
        )
    } else {
        (
            format!("the search found no schedule of `{name}` in its time limit"),
            "give the search a longer `--time-limit`, or allow more time in a `within`",
        )
    };
    let span = plan.get(plan.root).span;
    Box::new(Diagnostic::error(codes::UNSCHEDULABLE, span, headline, "with these claims and windows").help(help))
}

/// Pairs that the order of the steps does not decide.
fn rivals(problem: &Problem) -> Vec<(usize, usize)> {
    let mut order = problem.network.clone();
    order.edges.retain(|e| e.reason.why == matterix_timing::Why::Order);
    let reached: Vec<Vec<f64>> = problem
        .tasks
        .iter()
        .map(|t| order.least_from(t.end.point, &[matterix_timing::network::WHOLE]).unwrap_or_default())
        .collect();
    let follows = |a: usize, b: usize| {
        let least = reached[a].get(problem.tasks[b].start.0 as usize).copied().unwrap_or(f64::NEG_INFINITY);
        least >= problem.tasks[a].end.offset - ROUNDING
    };
    problem.rivals().into_iter().filter(|&(a, b)| !follows(a, b) && !follows(b, a)).collect()
}

/// A time within which everything can be done one after the other, s.
fn longest(problem: &Problem) -> f64 {
    problem.network.edges.iter().map(|e| e.weight.abs()).sum::<f64>()
        + problem.tasks.iter().map(|t| t.end.offset.abs()).sum::<f64>()
        + problem.end.map_or(0.0, |e| e.offset)
        + 1.0
}

/// The order of a solution, with everything as early as that order lets it be; the solution itself where windows ask
/// for pauses.
fn settle(problem: &Problem, rivals: &[(usize, usize)], times: Vec<f64>) -> Option<Ordered> {
    let order = list::in_order(problem, rivals, &times);
    let times = problem.settled(&order).unwrap_or(times);
    let makespan = problem.end?.time(&times);
    Some(Ordered { times, makespan })
}

struct Facts {
    bound: f64,
    optimal: bool,
    list: Option<f64>,
    trial: bool,
}

fn describe(program: &Program, problem: &Problem, best: &Ordered, facts: Facts) -> Schedule {
    let name = |i: &InstanceId| program.scene.instances.get(i.0 as usize).map_or_else(String::new, |i| i.name.clone());
    let at = |m: Moment| m.time(&best.times).max(0.0);
    let mut blocks: Vec<Block> = problem
        .tasks
        .iter()
        .map(|t| Block {
            label: t.label.clone(),
            step: t.step,
            occurrence: t.occurrence,
            line: t.line,
            instances: t.instances.iter().map(name).collect(),
            start: at(Moment::of(t.start)),
            end: at(t.end),
            held: false,
        })
        .collect();
    let free: Vec<f64> = problem
        .tasks
        .iter()
        .enumerate()
        .map(|(i, t)| {
            let (start, shares) =
                (blocks[i].start, |o: &&problem::Task| o.instances.iter().any(|x| t.instances.contains(x)));
            let ends = problem.tasks.iter().filter(shares).map(|o| at(o.end)).filter(|e| *e <= start + ROUNDING);
            ends.fold(at(t.asks), f64::max)
        })
        .collect();
    for (block, free) in blocks.iter_mut().zip(free) {
        block.held = block.start > free + 1e3 * ROUNDING;
    }
    blocks.sort_by(|a, b| a.start.total_cmp(&b.start).then(a.end.total_cmp(&b.end)).then(a.step.cmp(&b.step)));
    let mut actions: Vec<Action> = problem
        .work
        .iter()
        .map(|w| Action {
            label: w.label.clone(),
            step: w.step,
            line: w.line,
            instances: w.instances.iter().map(name).collect(),
            start: at(w.start),
            end: at(w.end),
        })
        .collect();
    actions.sort_by(|a, b| a.start.total_cmp(&b.start).then(a.step.cmp(&b.step)));
    Schedule {
        schema: SCHEMA,
        workflow: program.plan.workflow.clone(),
        arguments: program.plan.arguments.clone(),
        makespan: best.makespan,
        bound: facts.bound.min(best.makespan),
        optimal: facts.optimal,
        list: facts.list,
        trial: facts.trial,
        lines: problem.lines.clone(),
        blocks,
        actions,
    }
}

impl Schedule {
    /// The turns of a run that follows this schedule.
    pub fn turns(&self, program: &Program) -> Result<Vec<Turn>, String> {
        let id = |name: &String| {
            let found = program.scene.instances.iter().position(|i| i.name == *name);
            found
                .map(|i| InstanceId(i as u32))
                .ok_or_else(|| format!("the schedule contains `{name}`, but the lab does not"))
        };
        let claims = |step: StepId| {
            let node = program.plan.steps.get(step.0 as usize).map(|s| &s.step);
            matches!(node, Some(matterix_ir::plan::Step::Claim { .. }))
        };
        if self.schema != SCHEMA {
            return Err(format!("the schedule has schema {}, but this program reads {SCHEMA}", self.schema));
        }
        let same = self.workflow == program.plan.workflow && self.arguments == program.plan.arguments;
        if !same || !self.blocks.iter().all(|b| claims(b.step)) {
            return Err("the schedule belongs to another workflow, or to other parameters".to_owned());
        }
        self.blocks
            .iter()
            .map(|block| {
                let instances = block.instances.iter().map(id).collect::<Result<Vec<_>, _>>()?;
                let not_before = block.held.then_some(block.start);
                Ok(Turn { step: block.step, occurrence: block.occurrence, instances, not_before })
            })
            .collect()
    }
}
