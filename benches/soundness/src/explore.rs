//! All executions of a plan, as far as a budget goes.

use std::collections::{BTreeMap, BTreeSet};

use crate::interpret::{End, Execution, Oracle, Step, Violation, execute};
use crate::plan::{Id, Plan};
use crate::random::Random;
use crate::world::World;

/// What became of a statement in all executions.
#[derive(Clone, Debug, Default)]
pub struct Fate {
    /// It began so often.
    pub began: usize,
    /// It ended well in an execution that is certain, so often.
    pub done: usize,
    /// It failed with these codes, so often.
    pub failed: BTreeMap<&'static str, usize>,
    /// Of the executions that are certain and in which it ended well: with which codes it also failed there, and whether nothing
    /// went wrong there.
    pub beside: BTreeSet<(Vec<&'static str>, bool)>,
    /// It presumed what was not so, so often.
    pub presumed: usize,
    /// How the lab stood behind it in executions that are certain.
    pub after: Vec<World>,
}

/// What all executions have come to.
#[derive(Clone, Debug, Default)]
pub struct Summary {
    /// So many were followed.
    pub executions: usize,
    /// Whether these are all.
    pub complete: bool,
    /// Whether all of them are certain.
    pub certain: bool,
    /// By statement.
    pub fates: BTreeMap<Id, Fate>,
    /// What went wrong in executions that are certain.
    pub violations: BTreeSet<Violation>,
    /// Whether one that is certain ended well and without a violation.
    pub clean: bool,
    /// How the lab stands at the ends of those that passed.
    pub ends: Vec<World>,
    /// Whether one that is certain did not pass.
    pub fails: bool,
    /// How often a wait timed out in vain, or a block came too late.
    vain: BTreeMap<Violation, usize>,
}

/// Worlds kept behind a statement, at most: enough to try an enclosure with.
const KEPT: usize = 64;

/// Takes ways in turn, then by lot.
struct Ways {
    prefix: Vec<usize>,
    taken: Vec<(usize, usize)>,
    random: Option<Random>,
}

impl Oracle for Ways {
    fn choose(&mut self, n: usize) -> usize {
        let at = self.taken.len();
        let way = match (&mut self.random, self.prefix.get(at)) {
            (Some(random), _) => random.below(n),
            (None, way) => way.copied().unwrap_or(0),
        };
        self.taken.push((way, n));
        way
    }
}

/// Follows a plan in all the ways the text leaves open: up to half of the budget one after the other, the rest by lot.
pub fn explore(plan: &Plan, budget: usize, seed: u64) -> Summary {
    let mut summary = Summary { certain: true, ..Summary::default() };
    let mut prefix = Vec::new();
    let mut random = Random::new(seed ^ 0x5eed);
    while summary.executions < budget {
        let lot = summary.executions >= budget / 2;
        let random = lot.then(|| Random::new(random.draw()));
        let mut ways = Ways { prefix: prefix.clone(), taken: Vec::new(), random };
        summary.take(execute(plan, &mut ways));
        if lot {
            continue;
        }
        let mut taken = ways.taken;
        while taken.last().is_some_and(|(way, n)| way + 1 >= *n) {
            taken.pop();
        }
        let Some(last) = taken.last_mut() else {
            summary.complete = true;
            break;
        };
        last.0 += 1;
        prefix = taken.iter().map(|t| t.0).collect();
    }
    summary.always_vain();
    summary
}

impl Fate {
    /// Whether it ended well in an execution without having failed with this code; where it has to be so, in one in which nothing
    /// went wrong.
    pub fn clean_of(&self, code: &str, all_well: bool) -> bool {
        self.beside.iter().any(|(codes, well)| !codes.contains(&code) && (*well || !all_well))
    }
}

impl Summary {
    /// A wait that times out whenever it is come to is wrong, as is a block that always comes too late.
    fn always_vain(&mut self) {
        if !self.complete || !self.certain {
            return;
        }
        let always = |(violation, times): &(&Violation, &usize)| {
            self.fates.get(&violation.stmt).is_some_and(|fate| fate.began == **times)
        };
        let wrong: Vec<Violation> = self.vain.iter().filter(always).map(|(violation, _)| *violation).collect();
        self.violations.extend(wrong);
    }

    fn take(&mut self, execution: Execution) {
        self.executions += 1;
        self.certain &= execution.certain && execution.end != End::Unfinished;
        let certain = execution.certain;
        let mut failed: BTreeMap<Id, Vec<&'static str>> = BTreeMap::new();
        let mut done = BTreeSet::new();
        for step in &execution.steps {
            match step {
                Step::Failed(id, code) => failed.entry(*id).or_default().push(code),
                Step::Done(id, _) if certain => drop(done.insert(*id)),
                _ => {}
            }
        }
        for id in done {
            let beside = (failed.remove(&id).unwrap_or_default(), execution.violations.is_empty());
            self.fates.entry(id).or_default().beside.insert(beside);
        }
        for step in execution.steps {
            let (Step::Began(id) | Step::Done(id, _) | Step::Failed(id, _) | Step::Presumed(id)) = step;
            let fate = self.fates.entry(id).or_default();
            match step {
                Step::Began(_) => fate.began += 1,
                Step::Done(_, world) if certain => {
                    fate.done += 1;
                    if fate.after.len() < KEPT {
                        fate.after.push(*world);
                    }
                }
                Step::Done(..) => {}
                Step::Failed(_, code) => *fate.failed.entry(code).or_default() += 1,
                Step::Presumed(_) => fate.presumed += 1,
            }
        }
        if !certain {
            return;
        }
        self.clean |= execution.end == End::Passed && execution.violations.is_empty();
        self.fails |= execution.end != End::Passed;
        self.violations.extend(execution.violations);
        for vain in execution.vain {
            *self.vain.entry(vain).or_default() += 1;
        }
        if execution.end == End::Passed && self.ends.len() < KEPT {
            self.ends.push(execution.world);
        }
    }
}
