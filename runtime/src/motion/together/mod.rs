//! R3: two robots in one place at the same time, found before anything moves.
//!
//! What runs beside each other in `parallel` or as a job is planned line by line, each as if the robots of the others were
//! not there. Where what two robots sweep then overlaps, and neither the order of the steps, their least and greatest
//! times nor claims of one thing keep them apart, they may meet: a warning, as in a run one of them waits or goes
//! round. They must meet, an error, where no order of their motions leads both to their ends: lines are followed motion
//! by motion like the two sides of a grid, and it is tried besides whether one line can be done after the other.

mod grid;
mod leg;
mod pair;
mod walk;

use matterix_ir::scene::InstanceId;
use matterix_ir::{Diagnostic, Program};

use super::stage::Stage;

/// Robots of a program that may meet, or must, but for pairs that have been told of; `stage` is its lab when the run begins.
pub fn together<'p>(program: &'p Program, stage: Stage<'p>, told: Vec<[InstanceId; 2]>) -> Vec<Diagnostic> {
    if stage.actors.len() > 1 { walk::follow(program, stage, told) } else { Vec::new() }
}
