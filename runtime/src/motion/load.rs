//! What goes along with what a robot holds: what stands on it, and what carriers such as the channels of a pipette took.

use matterix_ir::scene::{InstanceId, Stand, frame};

use super::carried::Carried;
use super::stage::Stage;

impl Stage<'_> {
    /// What a robot holds, then all that goes along with it and has a place of its own: no part of a shape.
    pub(super) fn in_hand(&self, robot: InstanceId) -> Vec<InstanceId> {
        let Some(held) = self.held(robot) else { return Vec::new() };
        let all = (0..self.scene.instances.len() as u32).map(InstanceId);
        let along = all.filter(|id| {
            *id != held && self.held_by(*id) == Some(robot) && !self.is_unknown(*id) && !self.is_built_in(*id)
        });
        std::iter::once(held).chain(along).filter(|id| *id == held || self.has_body(*id)).collect()
    }

    /// Whether a thing is where it belongs in the shape of what it is a part of.
    fn is_built_in(&self, id: InstanceId) -> bool {
        self.stand_of(id) == self.scene.get(id).owner && self.is_inside_a_shape(id)
    }

    fn has_body(&self, id: InstanceId) -> bool {
        let instance = self.scene.get(id);
        instance.hull().chain(instance.more()).next().is_some()
    }

    /// A state of the model names what its carrier has, or nothing. In a hand that goes along: the frame `mount` of what it has
    /// comes to its origin. What it no longer has counts as back where it was. Gantries know of it by how far it hangs down.
    pub fn follow_load(&mut self, state: u32, value: f64) {
        let scene = self.scene;
        for carrier in scene.carriers.iter().filter(|carrier| carrier.state == state) {
            let load = (value >= 0.0).then_some(InstanceId(value as u32));
            let has = |c: &Carried| matches!(c, Carried::Stands(Stand::PartOf(by, _)) if *by == carrier.by);
            let own = |id: InstanceId| scene.get(id).owner == Some(carrier.by);
            let had = (0u32..).zip(self.carried.iter()).find(|(id, c)| has(c) && !own(InstanceId(*id)));
            if let Some(had) = had.map(|(id, _)| InstanceId(id)).filter(|had| Some(*had) != load) {
                self.unload(had);
            }
            if let Some(load) = load.filter(|_| self.held_by(carrier.by).is_some()) {
                self.load(load, carrier.by);
            }
        }
    }

    fn load(&mut self, id: InstanceId, by: InstanceId) {
        let Some(instance) = self.scene.instances.get(id.0 as usize) else { return };
        let mount = instance.frames.iter().find(|f| f.name == frame::MOUNT).map(|f| f.pose).unwrap_or_default();
        if let Some(Carried::Stands(stood)) = self.carried.get(id.0 as usize).copied()
            && stood.below() != Some(by)
        {
            self.carried.set(id, Carried::Stands(Stand::PartOf(by, mount.inverse())));
            self.before.insert(id, stood);
            self.changes += 1;
        }
    }

    fn unload(&mut self, id: InstanceId) {
        if let Some(stood) = self.before.remove(&id)
            && self.carried.set(id, Carried::Stands(stood)).is_some()
        {
            self.changes += 1;
        }
    }
}
