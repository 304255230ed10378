//! What carries each thing of a lab.

use std::collections::BTreeSet;
use std::hash::Hasher;
use std::ops::Deref;
use std::sync::Arc;

use matterix_ir::pose::Pose;
use matterix_ir::scene::{InstanceId, Scene, Stand};
use serde::{Deserialize, Serialize};

/// What carries a thing and where.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Carried {
    /// It stands somewhere.
    Stands(Stand),
    /// In the hand of a robot, relative to its tip.
    Held(InstanceId, Pose),
}

/// What carries every instance, by instance. Few of them ever move, so those that have are noted.
#[derive(Clone, Debug)]
pub struct Carrying {
    /// Shared by moments at which all is carried alike.
    now: Arc<Vec<Carried>>,
    /// When the run begins.
    first: Arc<[Carried]>,
    /// Those that are carried otherwise than at first.
    moved: BTreeSet<InstanceId>,
}

impl Carrying {
    /// When the run begins.
    pub fn at_first(scene: &Scene) -> Self {
        let now: Vec<Carried> = scene.stands().into_iter().map(Carried::Stands).collect();
        Carrying { first: now.as_slice().into(), now: Arc::new(now), moved: BTreeSet::new() }
    }

    /// Something else carries an instance from now on; nothing where there is no such instance.
    pub fn set(&mut self, id: InstanceId, carried: Carried) -> Option<()> {
        if *self.now.get(id.0 as usize)? != carried {
            *Arc::make_mut(&mut self.now).get_mut(id.0 as usize)? = carried;
        }
        match self.is_moved(id) {
            true => self.moved.insert(id),
            false => self.moved.remove(&id),
        };
        Some(())
    }

    /// Where an instance stood when the run began.
    pub fn stood_at_first(&self, id: InstanceId) -> Option<Stand> {
        match self.first.get(id.0 as usize)? {
            Carried::Stands(stand) => Some(*stand),
            Carried::Held(..) => None,
        }
    }

    /// Whether an instance is carried otherwise than at first.
    pub fn is_moved(&self, id: InstanceId) -> bool {
        self.now.get(id.0 as usize) != self.first.get(id.0 as usize)
    }

    /// Those that are carried otherwise than at an earlier moment, with what carries them now.
    pub fn since(&self, before: &Carrying) -> Vec<(InstanceId, Carried)> {
        let of = |carrying: &Carrying, id: &InstanceId| carrying.get(id.0 as usize).copied();
        let moved = self.moved.union(&before.moved);
        moved.filter(|id| of(self, id) != of(before, id)).filter_map(|id| Some((*id, of(self, id)?))).collect()
    }

    /// Feeds what tells it from others of the same lab to a hash; with `coarse`, figures that differ by less than that (m)
    /// mostly count as the same.
    pub fn digest(&self, coarse: Option<f64>, hash: &mut impl Hasher) {
        for id in &self.moved {
            match (self.get(id.0 as usize), self.first.get(id.0 as usize)) {
                (Some(Carried::Stands(now)), Some(Carried::Stands(first))) if is_alike(now, first, coarse) => {}
                (Some(Carried::Stands(now)), _) => {
                    hash.write_u64(u64::from(id.0) | 6 << 32);
                    write_stand(hash, now, coarse);
                }
                (Some(Carried::Held(by, at)), _) => {
                    hash.write_u64(u64::from(id.0) | 1 << 32);
                    hash.write_u32(by.0);
                    write_pose(hash, at, coarse);
                }
                (None, _) => {}
            }
        }
    }
}

impl Deref for Carrying {
    type Target = [Carried];

    fn deref(&self) -> &[Carried] {
        &self.now
    }
}

/// Whether two stands are written alike.
fn is_alike(a: &Stand, b: &Stand, coarse: Option<f64>) -> bool {
    let numbers = |stand: &Stand| {
        let (Stand::Lab(pose) | Stand::On(_, pose) | Stand::PartOf(_, pose)) = *stand;
        pose.position.into_iter().chain(pose.rotation).map(move |v| rounded(v, coarse))
    };
    a.below() == b.below() && numbers(a).eq(numbers(b))
}

fn rounded(v: f64, coarse: Option<f64>) -> f64 {
    // Adding zero makes one number of the two zeros.
    coarse.map_or(v, |step| (v / step).round() + 0.0)
}

/// Feeds a number to a hash, as [`Carrying::digest`] does.
pub fn write_number(hash: &mut impl Hasher, v: f64, coarse: Option<f64>) {
    hash.write_u64(rounded(v, coarse).to_bits());
}

fn write_pose(hash: &mut impl Hasher, pose: &Pose, coarse: Option<f64>) {
    pose.position.iter().chain(&pose.rotation).for_each(|v| write_number(hash, *v, coarse));
}

/// Feeds a stand to a hash, as [`Carrying::digest`] does.
pub fn write_stand(hash: &mut impl Hasher, stand: &Stand, coarse: Option<f64>) {
    hash.write_u64(stand.below().map_or(u64::MAX, |id| u64::from(id.0)));
    let (Stand::Lab(pose) | Stand::On(_, pose) | Stand::PartOf(_, pose)) = stand;
    write_pose(hash, pose, coarse);
}
