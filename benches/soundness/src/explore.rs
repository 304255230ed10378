//! All executions of a plan, as far as a budget goes.

use std::collections::{BTreeMap, BTreeSet};

use crate::interpret::{End, Execution, Oracle, Step, Violation, execute};
use crate::plan::{Id, Kind, Plan, Remedy, Stmt};
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
    /// The executions that are certain and in which it ended well.
    pub beside: BTreeSet<Beside>,
    /// What became of it by the turns of the loops around it.
    turns: BTreeMap<Vec<usize>, BTreeSet<Turn>>,
    /// It presumed what was not so, so often.
    pub presumed: usize,
    /// How the lab stood behind it in executions that are certain.
    pub after: Vec<World>,
}

/// An execution in which a statement ended well.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Beside {
    /// With these codes the statement also failed there.
    pub codes: Vec<&'static str>,
    /// Nothing went wrong there, to the end.
    pub well: bool,
    /// All loops around the statement came to their ends, so that no turn is missing in which it might have failed.
    pub whole: bool,
}

/// What became of a statement in a turn of one execution: whether it ended well, and with which codes it failed.
type Turn = (bool, Vec<&'static str>);

/// What all executions have come to.
#[derive(Clone, Debug, Default)]
pub struct Summary {
    /// So many were followed.
    pub executions: usize,
    /// Whether these are all.
    pub complete: bool,
    /// Whether all of them are certain.
    pub certain: bool,
    /// Whether these are all as far as the order of what happens at one moment goes.
    pub alone: bool,
    /// By statement.
    pub fates: BTreeMap<Id, Fate>,
    /// What went wrong in executions that are certain.
    pub violations: BTreeSet<Violation>,
    /// Whether one that is certain ended well and without a violation.
    pub clean: bool,
    /// Whether one that is certain ended as the plan means it to, and without a violation.
    pub well: bool,
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
    let mut summary = Summary { certain: true, alone: true, ..Summary::default() };
    let loops = loops(plan);
    let mut prefix = Vec::new();
    let mut random = Random::new(seed ^ 0x5eed);
    while summary.executions < budget {
        let lot = summary.executions >= budget / 2;
        let random = lot.then(|| Random::new(random.draw()));
        let mut ways = Ways { prefix: prefix.clone(), taken: Vec::new(), random };
        summary.take(execute(plan, &mut ways), &loops);
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
    /// The executions in which it ended well and never failed with this code.
    pub fn clean_of(&self, code: &str) -> impl Iterator<Item = &Beside> {
        self.beside.iter().filter(move |b| !b.codes.iter().any(|c| same(c, code)))
    }

    /// Whether it fails with this code in some turn of the loops around it whenever it comes to that.
    pub fn always_in_a_turn(&self, code: &str) -> bool {
        let fails = |(_, codes): &Turn| codes.iter().any(|c| same(c, code));
        self.turns.values().any(|seen| seen.iter().any(fails) && !seen.iter().any(|turn| turn.0 && !fails(turn)))
    }
}

/// Whether two codes tell of one fault: a source that holds too little, with or without a need that asks for it, and a wait that comes
/// to nothing.
pub fn same(seen: &str, told: &str) -> bool {
    let alike = [["volume-underflow", "transfer-fraction"], ["timeout", "waits-for-ever"]];
    seen == told || alike.iter().any(|two| two.contains(&seen) && two.contains(&told))
}

/// By statement: the loops around it, which do what is in them more than once.
fn loops(plan: &Plan) -> BTreeMap<Id, Vec<Id>> {
    let mut around = BTreeMap::new();
    for block in [&plan.body, &plan.finally] {
        note_loops(block, &mut Vec::new(), &mut around);
    }
    around
}

fn note_loops(block: &[Stmt], within: &mut Vec<Id>, around: &mut BTreeMap<Id, Vec<Id>>) {
    for stmt in block {
        around.insert(stmt.id, within.clone());
        let again = match &stmt.kind {
            Kind::Repeat(..) | Kind::While(..) => true,
            Kind::Guard(_, handlers) => handlers.iter().any(|h| matches!(h.what, Remedy::Retry(_))),
            _ => false,
        };
        if again {
            within.push(stmt.id);
        }
        for inner in stmt.kind.blocks() {
            note_loops(inner, within, around);
        }
        if again {
            within.pop();
        }
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

    fn take(&mut self, execution: Execution, loops: &BTreeMap<Id, Vec<Id>>) {
        self.executions += 1;
        self.certain &= execution.certain && execution.end != End::Unfinished;
        self.alone &= execution.alone;
        let certain = execution.certain;
        let mut failed: BTreeMap<Id, Vec<&'static str>> = BTreeMap::new();
        let mut done = BTreeSet::new();
        let mut open: BTreeMap<Id, usize> = BTreeMap::new();
        let mut turns: BTreeMap<Id, usize> = BTreeMap::new();
        let mut seen: BTreeMap<(Id, Vec<usize>), Turn> = BTreeMap::new();
        let turn = |id: &Id, turns: &BTreeMap<Id, usize>| {
            let around = loops.get(id).into_iter().flatten();
            around.map(|l| turns.get(l).copied().unwrap_or_default()).collect::<Vec<usize>>()
        };
        for step in &execution.steps {
            match step {
                Step::Turn(id) => *turns.entry(*id).or_default() += 1,
                Step::Done(id, _) if certain => {
                    seen.entry((*id, turn(id, &turns))).or_default().0 = true;
                }
                Step::Failed(id, code) => {
                    seen.entry((*id, turn(id, &turns))).or_default().1.push(*code);
                }
                Step::Began(id) => drop(turns.remove(id)),
                _ => {}
            }
            match step {
                Step::Began(id) => *open.entry(*id).or_default() += 1,
                Step::Done(id, _) => {
                    if let Some(open) = open.get_mut(id) {
                        *open = open.saturating_sub(1);
                    }
                }
                _ => {}
            }
            match step {
                Step::Failed(id, code) => failed.entry(*id).or_default().push(code),
                Step::Done(id, _) if certain => drop(done.insert(*id)),
                _ => {}
            }
        }
        for ((id, turn), what) in seen {
            self.fates.entry(id).or_default().turns.entry(turn).or_default().insert(what);
        }
        let ended = match &execution.end {
            End::Passed => true,
            // A wait that times out is no end that anyone wants.
            End::Failed(failure) => failure.meant && !["timeout", "late", "max"].contains(&failure.name),
            End::Deadlock | End::Unfinished => false,
        };
        let well = ended && execution.violations.is_empty();
        self.well |= certain && well;
        for id in done {
            let whole = loops.get(&id).is_none_or(|loops| loops.iter().all(|l| open.get(l).is_none_or(|n| *n == 0)));
            let codes = failed.remove(&id).unwrap_or_default();
            let beside = Beside { codes, well, whole };
            self.fates.entry(id).or_default().beside.insert(beside);
        }
        for step in execution.steps {
            let (Step::Began(id) | Step::Done(id, _) | Step::Failed(id, _) | Step::Presumed(id) | Step::Turn(id)) =
                step;
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
                Step::Turn(_) => {}
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
