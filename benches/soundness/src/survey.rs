//! Many plans at once.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};

use matterix_lang::Session;

use crate::generate::generate;
use crate::judge::{Disagreement, Verdict, judge};
use crate::plan::{Plan, Theme};
use crate::shrink::shrink;

/// Plans that go into one file: the library is then read once for all of them.
const TOGETHER: u64 = 16;

/// Executions of a plan that are followed.
const BUDGET: usize = 160;

/// Bytes of a thread's stack; only what is used of it is ever taken.
const STACK: usize = 512 << 20;

/// A plan and all that is said of it.
#[derive(Clone, Debug)]
pub struct Judged {
    /// What it was drawn from.
    pub seed: u64,
    /// The plan.
    pub plan: Plan,
    /// What is said of it.
    pub verdict: Verdict,
}

/// Draws and judges the plans of so many seeds on so many threads; `each` gets them as they come, in no particular order. `Err` names the first seed of
/// plans with which something broke down.
pub fn survey(from: u64, plans: u64, threads: usize, each: &(dyn Fn(Judged) + Sync)) -> Result<(), String> {
    let next = AtomicU64::new(0);
    let broken = Mutex::new(Vec::new());
    std::thread::scope(|scope| {
        for _ in 0..threads.max(1) {
            let work = || {
                let mut session = Session::default();
                loop {
                    let first = next.fetch_add(TOGETHER, Ordering::Relaxed);
                    if first >= plans {
                        break;
                    }
                    let seeds = from + first..from + (first + TOGETHER).min(plans);
                    let whole = std::panic::AssertUnwindSafe(|| file(seeds, &mut session, each));
                    if std::panic::catch_unwind(whole).is_err() {
                        broken.lock().unwrap_or_else(PoisonError::into_inner).push(from + first);
                        session = Session::default();
                    }
                }
            };
            if let Err(why) = std::thread::Builder::new().stack_size(STACK).spawn_scoped(scope, work) {
                return Err(why.to_string());
            }
        }
        Ok(())
    })?;
    let mut broken = broken.into_inner().unwrap_or_else(PoisonError::into_inner);
    broken.sort_unstable();
    match broken.is_empty() {
        true => Ok(()),
        false => Err(format!("the program panics at plans from the seeds {broken:?}")),
    }
}

/// Judges the plans of some seeds: those with a reaction in one file, those that declare more in one each, the others in another one.
fn file(seeds: std::ops::Range<u64>, session: &mut Session, each: &(dyn Fn(Judged) + Sync)) {
    let drawn: Vec<(u64, Plan)> = seeds.map(|seed| (seed, generate(seed))).collect();
    // What is declared holds for a whole file.
    let (apart, drawn): (Vec<_>, Vec<_>) = drawn.into_iter().partition(|(_, p)| p.declared.is_some());
    let (reacting, others): (Vec<_>, Vec<_>) = drawn.into_iter().partition(|(_, p)| p.theme == Theme::Reaction);
    for part in apart.into_iter().map(|one| vec![one]).chain([reacting, others]) {
        let Some(first) = part.first().map(|p| p.0) else { continue };
        let plans: Vec<Plan> = part.iter().map(|p| p.1.clone()).collect();
        let verdicts = judge(&plans, first, BUDGET, session);
        for ((seed, plan), verdict) in part.into_iter().zip(verdicts) {
            each(Judged { seed, plan, verdict });
        }
    }
}

/// The smallest plan found with a disagreement of the same sort and code, and all that is said of it.
pub fn smallest(plan: &Plan, about: &Disagreement) -> (Plan, Verdict) {
    let mut session = Session::default();
    let mut look = |p: &Plan| judge(std::slice::from_ref(p), 0, BUDGET, &mut session).remove(0);
    let small = shrink(plan, &mut |p: &Plan| {
        look(p).disagreements.iter().any(|d| d.sort == about.sort && d.code == about.code)
    });
    let verdict = look(&small);
    (small, verdict)
}
