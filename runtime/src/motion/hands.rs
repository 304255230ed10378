//! From hand to hand: a thing that two robots hold for a moment.

use matterix_ir::scene::InstanceId;

use super::stage::Stage;

impl Stage<'_> {
    /// A robot closes its gripper on a thing: it is in its hand then, or in both hands if another one holds it.
    pub(super) fn grip(&mut self, item: InstanceId, robot: InstanceId) {
        match self.holder(item).filter(|other| *other != robot) {
            Some(_) => {
                self.shared.insert(item, robot);
            }
            None => self.carry(item, Some(robot)),
        }
    }

    /// A robot lets go what another one grips as well; whether that one does.
    pub(super) fn pass(&mut self, item: InstanceId, giver: InstanceId, taker: InstanceId) -> bool {
        if self.shared.get(&item) != Some(&taker) {
            return false;
        }
        self.shared.remove(&item);
        self.carry(item, Some(taker));
        self.freed(giver, item);
        true
    }

    /// A thing that a robot holds together with another one, and that one: neither can move.
    pub(super) fn bound(&self, robot: InstanceId) -> Option<(InstanceId, InstanceId)> {
        self.shared.iter().find_map(|(item, second)| {
            let first = self.holder(*item)?;
            match robot {
                r if r == first => Some((*item, *second)),
                r if r == *second => Some((*item, first)),
                _ => None,
            }
        })
    }
}
