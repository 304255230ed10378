//! Looks at the motions of a plan before anything moves: what is out of reach, what collides, what cannot be gripped.

pub(super) mod beside;
mod course;
mod diagnostics;
mod look;
mod memory;
mod more;
mod offer;
pub mod seal;
mod starts;
pub(super) mod values;
mod verdicts;
mod walk;

use matterix_ir::model::Domain;
use matterix_ir::pose::Pose;
use matterix_ir::scene::{InstanceId, Scene};
use matterix_ir::{Diagnostic, Program};

use super::overlap::{self, overlaps};
use super::stage::Stage;
use super::together::together;
pub use seal::{Nowhere, Store};

/// What would go wrong with the motions of a program, or stands in one place before anything moves. What was found before
/// is taken from `store`, what is new goes there.
pub fn preflight(program: &Program, store: &dyn Store) -> Vec<Diagnostic> {
    if program.scene.instances.iter().all(|i| i.articulation.is_none()) {
        return overlaps(program);
    }
    verdicts::of(program, store, || look(program, store))
}

fn look(program: &Program, store: &dyn Store) -> Vec<Diagnostic> {
    let Ok(stage) = Stage::new(program) else { return Vec::new() };
    // Of what is in something before it moves no way leads anywhere.
    let standing = overlap::found(stage.clone());
    if !standing.is_empty() {
        return standing;
    }
    if stage.actors.is_empty() {
        return Vec::new();
    }
    let (mut found, told) = walk::follow(program, stage.clone(), memory::Memory::of(&program.scene, store));
    found.extend(together(program, stage, told));
    found
}

/// The instance of which a state says what it stands on.
pub fn supported(scene: &Scene, state: &str, domain: &Domain) -> Option<InstanceId> {
    let owner = state.strip_suffix(".support").filter(|_| *domain == Domain::Instance)?;
    scene.find(owner)
}

impl Stage<'_> {
    /// Something else carries a thing from now on, as a state of the model says. Where that is not so already, the thing
    /// comes to its new place at once.
    pub fn follow(&mut self, id: InstanceId, by: Option<InstanceId>) {
        let carrier = by.map(|by| self.hand_of(by).unwrap_or(by));
        if self.below(id) == carrier || self.below(id) == by {
            return;
        }
        match by.filter(|by| self.hand_of(*by).is_none()) {
            Some(on) => self.put(id, on, Pose::IDENTITY),
            None => self.carry(id, by),
        }
    }
}
