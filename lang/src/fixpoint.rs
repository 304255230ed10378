//! A task in its lab, written out: first as a draft to learn what is moved where, then for good, with a state for every species that
//! can get into a mixture.

use std::sync::atomic::{AtomicBool, Ordering};

use matterix_ir::Sources;
use matterix_ir::model::Event;
use matterix_ir::plan::Plan;
use matterix_ir::script::Wiring;

use crate::declare::Tables;
use crate::elaborate::events::Happenings;
use crate::eval::lab::Elaborator;
use crate::eval::lab::reach::Reach;
use crate::lower::{Planner, Wires};
use crate::parallel;
use crate::task::Task;

/// So often a task is written out for just what the time before moved. A text with mistakes may go on for ever.
const TURNS: usize = 4;

/// What a task is written out for.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Purpose {
    /// The plan is to be run: parameters without a default must have been given.
    pub(crate) to_run: bool,
    /// What is asked of drivers.
    pub(crate) wires: Wires,
    /// The transport of which drivers say what goes over it, where that is asked for.
    pub(crate) transport: Option<&'static str>,
    /// Whether what names and expressions mean is noted.
    pub(crate) meanings: bool,
}

/// A task that is written out: what its plan moves where is what its lab was made for.
pub(crate) struct Settled<'a> {
    pub(crate) lab: Elaborator<'a>,
    pub(crate) plan: Plan,
    pub(crate) wiring: Option<Wiring>,
    pub(crate) events: Vec<Event>,
    pub(crate) reach: Reach,
}

/// Writes a task out. Where it is `foreseen` what can get where, the draft is made beside and tells whether that is so: what
/// comes of it is what comes of it without. A task that supposes another value of a parameter is given what the default led to, and needs no
/// draft. Nothing where `stop` says that it is of no use any more.
pub(crate) fn settled<'a>(
    tables: &'a Tables<'a>,
    sources: &Sources,
    task: &Task<'a>,
    purpose: Purpose,
    foreseen: Option<&Reach>,
    stop: &dyn Fn() -> bool,
) -> Option<Settled<'a>> {
    let draft =
        || written(tables, sources, task, purpose, None, &|| false).map(|draft| draft.reach).unwrap_or_default();
    let mut reach = match foreseen {
        None => draft(),
        // Another value of a parameter moves the same as a rule; where it does not, the turns below tell.
        Some(usual) if task.supposed.is_some() && usual.is_moved() => usual.clone(),
        Some(foreseen) => {
            let mistaken = AtomicBool::new(false);
            let judge = || {
                let drafted = draft();
                mistaken.store(drafted != *foreseen, Ordering::Relaxed);
                drafted
            };
            let of_no_use = || mistaken.load(Ordering::Relaxed);
            let write = || written(tables, sources, task, purpose, Some(foreseen), &of_no_use);
            match parallel::join(judge, write) {
                (drafted, Some(whole)) if drafted == *foreseen => match whole.reach == drafted {
                    true => return Some(whole),
                    false => whole.reach,
                },
                (drafted, _) => drafted,
            }
        }
    };
    for turn in 0.. {
        if stop() {
            break;
        }
        let whole = written(tables, sources, task, purpose, Some(&reach), &|| false)?;
        if whole.reach == reach || turn >= TURNS && whole.reach.is_within(&reach) {
            return Some(whole);
        }
        match turn < TURNS {
            true => reach = whole.reach,
            // What moves less where more can be moved goes to and fro: with all of it, it comes to rest.
            false => reach.extend(whole.reach),
        }
    }
    None
}

/// A task written out for what can get where; as a draft where that is not known. Nothing where it is of no use any more.
fn written<'a>(
    tables: &'a Tables<'a>,
    sources: &Sources,
    task: &Task<'a>,
    purpose: Purpose,
    reach: Option<&Reach>,
    of_no_use: &dyn Fn() -> bool,
) -> Option<Settled<'a>> {
    let draft = reach.is_none();
    let mut lab = Elaborator::new(tables, reach.cloned().unwrap_or_default());
    lab.meanings = (purpose.meanings && !draft).then(Box::default);
    lab.draft = draft;
    lab.lab(task.lab);
    let mut planner = Planner::new(&mut lab, sources);
    planner.to_run = purpose.to_run;
    planner.draft = draft;
    planner.wires = purpose.wires;
    planner.of_no_use = of_no_use;
    let wiring = |transport: &str| Wiring { transport: transport.to_string(), ..Wiring::default() };
    planner.wiring = purpose.transport.map(wiring);
    let (mut plan, wiring) = planner.task(task);
    if of_no_use() {
        return None;
    }
    if !draft {
        lab.initialise();
    }
    lab.targets.close();
    let Happenings { mut events, limits } = lab.events();
    lab.targets.close();
    lab.processes();
    events.extend(lab.stream_events());
    lab.targets.close();
    plan.limits.extend(limits);
    let reach = Reach::compute(&lab);
    Some(Settled { lab, plan, wiring, events, reach })
}
