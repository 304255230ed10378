//! Marks joined into intervals, and the plan as a tree with paths.

use matterix_ir::plan::{Plan, Step, StepId};

use super::recording::Recording;
use super::run::Run;
use super::series::Series;
use crate::exec::StepState;

/// One execution of a node.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct StepRun {
    /// The node.
    pub(super) step: StepId,
    /// s; absent if it never began.
    pub(super) start: Option<f64>,
    /// s; absent if it never ended.
    pub(super) end: Option<f64>,
    /// Its last state.
    pub(super) state: StepState,
}

/// Every execution of every node in order of start, then the nodes that never began in order of the plan.
pub(super) fn step_runs(run: &Run<'_>) -> Vec<StepRun> {
    let count = run.program.plan.steps.len();
    let mut open: Vec<Option<usize>> = vec![None; count];
    let mut seen = vec![false; count];
    let mut rows: Vec<StepRun> = Vec::new();
    for mark in &run.recording.steps {
        let i = mark.step.0 as usize;
        if i >= count || mark.state == StepState::Pending {
            continue;
        }
        seen[i] = true;
        match (mark.state, open[i]) {
            (StepState::Running, None) => {
                open[i] = Some(rows.len());
                rows.push(StepRun { step: mark.step, start: Some(mark.time), end: None, state: mark.state });
            }
            (StepState::Running, Some(_)) => {}
            (state, Some(row)) => {
                rows[row].end = Some(mark.time);
                rows[row].state = state;
                open[i] = None;
            }
            (state, None) => rows.push(StepRun { step: mark.step, start: None, end: Some(mark.time), state }),
        }
    }
    let missing = (0..count).filter(|&i| !seen[i]);
    let never = missing.map(|i| StepRun { step: StepId(i as u32), start: None, end: None, state: StepState::Pending });
    rows.extend(never);
    rows
}

/// When each process ran, s. One without a guard and without marks ran all the time.
pub(super) fn process_intervals(run: &Run<'_>) -> Vec<Vec<(f64, f64)>> {
    let processes = &run.program.model.processes;
    let mut intervals = vec![Vec::new(); processes.len()];
    let mut since: Vec<Option<f64>> = vec![None; processes.len()];
    for mark in &run.recording.processes {
        let Some(began) = since.get_mut(mark.process) else { continue };
        match (mark.running, *began) {
            (true, None) => *began = Some(mark.time),
            (false, Some(start)) => {
                intervals[mark.process].push((start, mark.time));
                *began = None;
            }
            _ => {}
        }
    }
    let end = run.recording.end;
    for (i, process) in processes.iter().enumerate() {
        if let Some(start) = since[i] {
            intervals[i].push((start, end));
        } else if process.guard.is_none() && intervals[i].is_empty() {
            intervals[i].push((0.0, end));
        }
    }
    intervals
}

/// When a truth value was true, s. It changes at its points.
pub(super) fn true_intervals(recording: &Recording, truth: &Series) -> Vec<(f64, f64)> {
    let mut intervals = Vec::new();
    let mut since = None;
    for (time, value) in truth.points() {
        match (value != 0.0, since) {
            (true, None) => since = Some(time),
            (false, Some(start)) => {
                intervals.push((start, time));
                since = None;
            }
            _ => {}
        }
    }
    intervals.extend(since.map(|start| (start, recording.end)));
    intervals
}

/// Whether a node only orders others, so that a reader of a time line does not miss it.
pub(super) fn is_structure(step: &Step) -> bool {
    matches!(
        step,
        Step::Sequence(_)
            | Step::Guarded { .. }
            | Step::During { .. }
            | Step::Let { .. }
            | Step::Record { .. }
            | Step::Note(_)
    )
}

/// Labels from the top of the tree to each node, joined by ` > `, and how many there are above it; nodes that only order
/// others are left out.
pub(super) fn paths(plan: &Plan) -> Vec<(String, usize)> {
    let mut paths: Vec<Option<(String, usize)>> = vec![None; plan.steps.len()];
    let mut stack = vec![(plan.root, plan.workflow.clone(), 0)];
    while let Some((id, above, depth)) = stack.pop() {
        let i = id.0 as usize;
        let Some(node) = plan.steps.get(i) else { continue };
        if paths[i].is_some() {
            continue;
        }
        let hidden = id == plan.root || matches!(node.step, Step::Sequence(_) | Step::Guarded { .. });
        let (path, inside) = if hidden { (above, depth) } else { (format!("{above} > {}", node.label), depth + 1) };
        stack.extend(node.step.children().into_iter().map(|child| (child, path.clone(), inside)));
        paths[i] = Some((path, depth));
    }
    let name = |(path, node): (Option<(String, usize)>, &matterix_ir::plan::PlanStep)| {
        path.unwrap_or_else(|| (node.label.clone(), 0))
    };
    paths.into_iter().zip(&plan.steps).map(name).collect()
}
