//! Where a thing comes to lie that is let go in the air.

use std::collections::BTreeSet;

use matterix_ir::pose::Pose;
use matterix_ir::scene::InstanceId;
use matterix_solids::{Body, Isometry, isometry};

use super::stage::Stage;

/// Longest and shortest step on the way down, and the last one before it lies still, m.
const STEPS: [f64; 3] = [0.05, 2e-3, 2e-4];
/// How far things reach into each other that stand on each other, m.
const TOUCH: f64 = 5e-4;
/// More steps than any fall takes.
const MOST: usize = 10_000;

impl Stage<'_> {
    /// Where a thing is when it has fallen straight down to what is below it, or to the floor; `without` are no obstacles, and
    /// neither is what is in a hand.
    pub fn fallen(&self, id: InstanceId, without: &BTreeSet<InstanceId>) -> Pose {
        let mut at = self.pose(id);
        let Some(own) = self.bodies().get(id.0 as usize).and_then(Option::as_ref) else { return at };
        let around: Vec<(Isometry, &Body)> = (0..self.scene.instances.len() as u32)
            .map(InstanceId)
            .filter(|other| *other != id && !without.contains(other) && self.held_by(*other).is_none())
            .filter_map(|other| Some((isometry(&self.pose(other)), self.bodies().get(other.0 as usize)?.as_ref()?)))
            .collect();
        let room = |at: &Pose| {
            let here = isometry(at);
            let near = around.iter().filter_map(|(there, body)| own.touch(&here, body, there, STEPS[0]));
            near.map(|touch| touch.distance).fold(STEPS[0], f64::min)
        };
        let [_, shortest, last] = STEPS;
        let mut step = room(&at).max(shortest);
        for _ in 0..MOST {
            let mut below = at;
            below.position[2] = (at.position[2] - step).max(0.0);
            let free = room(&below);
            if free > -TOUCH {
                at = below;
                step = free.max(shortest);
                if at.position[2] <= 0.0 {
                    break;
                }
            } else if step > last {
                step /= 2.0;
            } else {
                break;
            }
        }
        at
    }
}
