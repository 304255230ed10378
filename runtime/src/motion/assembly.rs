//! A robot with the tools mounted on it, as one description.

use matterix_ir::robot::Robot;
use matterix_ir::scene::{Articulation, InstanceId, Scene, frame};

/// A robot with its tools.
#[derive(Clone, Debug, PartialEq)]
pub struct Assembly {
    /// Links and joints of all of it; the robot's own come first.
    pub robot: Robot,
    /// The link that is brought to a goal.
    pub tip: u32,
    /// The link that carries the tools: the robot's own tip.
    pub flange: u32,
    /// The link from which its arm reaches; what is before it drives that about.
    pub base: u32,
    /// Links from this one on are of tools.
    pub tools: u32,
    /// Positions of the moving joints when the run begins, rad or m.
    pub home: Vec<f64>,
    /// Which instance each link belongs to.
    pub owners: Vec<InstanceId>,
}

/// The robot an instance is, with the articulated parts it has, each on the tip of the one before.
pub fn assemble(scene: &Scene, id: InstanceId) -> Option<Assembly> {
    let own = scene.instances.get(id.0 as usize)?.articulation.as_deref()?;
    let mut whole = Assembly {
        robot: own.robot.clone(),
        tip: own.tip,
        flange: own.tip,
        base: own.base,
        tools: own.robot.links.len() as u32,
        home: own.home.clone(),
        owners: vec![id; own.robot.links.len()],
    };
    for part in parts(scene, id) {
        let tool = scene.get(part).articulation.as_deref().filter(|a| a.follows.is_empty());
        if let Some(articulation) = tool {
            whole.mount(scene, part, articulation);
        }
    }
    Some(whole)
}

/// What is part of an instance, parts of parts included, in the order of the scene.
fn parts(scene: &Scene, id: InstanceId) -> Vec<InstanceId> {
    let mut inside = vec![id];
    for (index, instance) in scene.instances.iter().enumerate() {
        if instance.owner.is_some_and(|owner| inside.contains(&owner)) {
            inside.push(InstanceId(index as u32));
        }
    }
    inside.split_off(1)
}

impl Assembly {
    fn mount(&mut self, scene: &Scene, part: InstanceId, tool: &Articulation) {
        let instance = scene.get(part);
        let mount = instance.frames.iter().find(|f| f.name == frame::MOUNT).map(|f| f.pose).unwrap_or_default();
        let first = self.robot.links.len() as u32;
        let whole = self.owners.first().map_or("", |robot| scene.get(*robot).name.as_str());
        let name = instance.name.strip_prefix(whole).unwrap_or(&instance.name).trim_start_matches('.');
        self.robot.attach(self.tip, &tool.robot, mount.inverse(), &format!("{name}."));
        // A tool's links meet each other as they work.
        let all = first..self.robot.links.len() as u32;
        self.robot.touching.extend(all.clone().flat_map(|a| (a + 1..all.end).map(move |b| [a, b])));
        self.tip = first + tool.tip;
        self.home.extend(&tool.home);
        self.owners.extend(std::iter::repeat_n(part, tool.robot.links.len()));
    }
}
