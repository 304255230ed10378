//! Where instances stand: rigid transforms and the tree of supports.

use matterix_ir::scene::{Instance, InstanceId, Pose, Scene};

/// What a thing stands on and where on it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Stand {
    /// In the lab.
    Lab(Pose),
    /// On the surface of an instance: its frame `place`, else the middle of its top.
    On(InstanceId, Pose),
    /// In the frame of the instance it is a part of.
    PartOf(InstanceId, Pose),
}

/// Where every instance stands when the run begins.
pub(super) fn initial(scene: &Scene) -> Vec<Stand> {
    let stand = |i: &Instance| match (i.owner, i.support) {
        (Some(owner), _) => Stand::PartOf(owner, i.pose),
        (None, Some(support)) => Stand::On(support, i.pose),
        (None, None) => Stand::Lab(i.pose),
    };
    scene.instances.iter().map(stand).collect()
}

/// Every instance in the frame of the lab. Where supports form a ring, the ring is cut.
pub(super) fn in_lab(scene: &Scene, stands: &[Stand]) -> Vec<Pose> {
    (0..scene.instances.len()).map(|i| resolve(scene, stands, i)).collect()
}

fn resolve(scene: &Scene, stands: &[Stand], index: usize) -> Pose {
    let mut at = Pose::IDENTITY;
    let mut next = index;
    for _ in 0..=stands.len() {
        let (below, inner) = match stands.get(next) {
            Some(Stand::Lab(inner)) => return inner.then(at),
            Some(Stand::On(below, inner)) => (below, surface(scene, *below).then(*inner)),
            Some(Stand::PartOf(owner, inner)) => (owner, *inner),
            None => return at,
        };
        at = inner.then(at);
        next = below.0 as usize;
    }
    at
}

fn surface(scene: &Scene, id: InstanceId) -> Pose {
    let Some(instance) = scene.instances.get(id.0 as usize) else { return Pose::IDENTITY };
    let place = instance.frames.iter().find(|f| f.name == "place").map(|f| f.pose);
    place.or_else(|| instance.shape.as_ref().map(|s| Pose::up(s.size()[2]))).unwrap_or(Pose::IDENTITY)
}
