//! Robots made ready to be checked for collisions, kept from motion to motion: balls are gathered once for all motions with the same
//! things in hand.

use std::collections::{BTreeMap, VecDeque};
use std::sync::{Arc, Mutex, PoisonError};

use matterix_ir::scene::InstanceId;
use matterix_motion::pose::Pose;
use matterix_motion::spheres::{Figure, Held};

use super::refused::Refused;
use super::stage::Actor;

/// So many of a robot are kept: those with a tool, without one, for the arm and for what drives it.
const KEPT: usize = 8;

/// All that a figure comes of, but for the robot itself.
#[derive(Debug, PartialEq)]
struct Key {
    base: Pose,
    moved: Vec<usize>,
    /// How the other joints stand, rad or m; 0 for those that move.
    still: Vec<f64>,
    held: Vec<Held>,
}

/// Figures of a robot, those asked for last first.
type Kept = VecDeque<(Key, Arc<Figure>)>;

/// Figures by robot. Copies share them: what one has made all others find.
#[derive(Clone, Debug, Default)]
pub(super) struct Figures(Arc<Mutex<BTreeMap<InstanceId, Kept>>>);

impl Figures {
    /// A robot at `base` of which some joints are planned for, with what it holds.
    pub(super) fn of(
        &self,
        (robot, actor): (InstanceId, &Actor),
        base: Pose,
        moved: &[usize],
        held: Vec<Held>,
    ) -> Result<Arc<Figure>, Refused> {
        let mut still = actor.joints.clone();
        for &joint in moved {
            if let Some(still) = still.get_mut(joint) {
                *still = 0.0;
            }
        }
        let key = Key { base, moved: moved.to_vec(), still, held };
        let kept = |kept: &Kept| kept.iter().position(|(k, _)| *k == key);
        let mut all = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let of_robot = all.entry(robot).or_default();
        if let Some(found) = kept(of_robot).and_then(|at| of_robot.remove(at)) {
            let figure = found.1.clone();
            of_robot.push_front(found);
            return Ok(figure);
        }
        drop(all);
        // Others go on meanwhile: two that make the same one make it alike.
        let figure = Figure::new(actor.to_plan(), &key.base, moved, &key.still, &key.held);
        let figure = Arc::new(figure.map_err(|_| Refused::NoRobot)?);
        let mut all = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let of_robot = all.entry(robot).or_default();
        of_robot.push_front((key, figure.clone()));
        of_robot.truncate(KEPT);
        Ok(figure)
    }
}
