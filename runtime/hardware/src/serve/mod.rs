//! A lab as a server: its devices are features, what they can be told are commands, what they show are properties.

mod desk;
mod features;
mod paced;
mod values;

use matterix_ir::Program;
use matterix_ir::plan::{Condition, PlanStep, Step, StepId};

pub use desk::{Attendant, Desk};
pub use features::{Catalogue, catalogue};
pub use paced::Paced;

/// Makes the plan of a lab wait for the next command of it, without end.
pub fn wait_for_ever(program: &mut Program) {
    let node = program.model.graph.number(0.0);
    let span = program.scene.instances.first().map(|first| first.span).unwrap_or_default();
    let text = "the end".to_owned();
    let condition =
        Condition { node, text, span, compared: Vec::new(), terms: Vec::new(), refusal: None, each: Vec::new() };
    let step = Step::WaitUntil { condition, timeout: None };
    program.plan.root = StepId(program.plan.steps.len() as u32);
    program.plan.steps.push(PlanStep { label: "wait for the next command".to_owned(), span, step });
}
