//! Links and joints of things, as their lines or a file describe them.

use matterix_ir::robot::Robot;
use matterix_ir::scene::InstanceId;

use super::Elaborator;
use crate::ast::{AssetLine, Jointed, Name};

impl<'a> Elaborator<'a> {
    /// The joints that an asset's lines name, with the module of each.
    pub fn jointed(&self, id: InstanceId) -> Vec<(usize, &'a Jointed)> {
        let joint = |(module, line): (usize, &'a AssetLine)| match line {
            AssetLine::Joint(joint) => Some((module, &**joint)),
            _ => None,
        };
        self.lines(id).into_iter().filter_map(joint).collect()
    }

    /// The description of an asset's links that a file gives.
    pub fn described(&self, id: InstanceId) -> Option<&'a Robot> {
        self.lines(id).into_iter().find_map(|(_, line)| match line {
            AssetLine::Robot(robot, _) => Some(&**robot),
            _ => None,
        })
    }

    /// Names of an asset's links by index; the first one is the asset itself.
    pub fn links(&self, id: InstanceId) -> Vec<&'a str> {
        if let Some(robot) = self.described(id) {
            return robot.links.iter().map(|l| l.name.as_str()).collect();
        }
        let own = self.jointed(id).into_iter().filter(|(_, j)| j.way.is_some()).map(|(_, j)| j.name.text.as_str());
        std::iter::once("").chain(own).collect()
    }

    /// The moving link that a place is given in, by index.
    pub fn link_of(&self, id: InstanceId, from: &Name) -> Option<u32> {
        let found = self.links(id).iter().position(|name| *name == from.text)?;
        (found > 0).then_some(found as u32)
    }
}
