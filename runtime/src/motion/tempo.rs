//! How fast robots are meant to go, where that is slower than their joints can: a share of that, or a greatest speed of their tips.

use std::collections::BTreeMap;

use matterix_ir::NodeId;
use matterix_ir::model::Pace;
use matterix_ir::plan::Motion;
use matterix_ir::scene::InstanceId;

use super::performed::Performed;
use super::stage::Stage;

/// How fast a robot is meant to go.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tempo {
    /// How many times as long its motions take, at least 1.
    pub slowness: f64,
    /// The greatest speed of its tip, m/s.
    pub tip_speed: f64,
}

/// How fast robots are meant to go, with the values of expressions as far as they are known.
pub fn tempi(paces: &[Pace], value: impl Fn(NodeId) -> Option<f64>) -> BTreeMap<InstanceId, Tempo> {
    let tempo = |pace: &Pace| {
        let known = |node: Option<NodeId>, usual| node.and_then(&value).unwrap_or(usual);
        let tempo = Tempo { slowness: known(pace.slowness, 1.0), tip_speed: known(pace.tip_speed, f64::INFINITY) };
        (pace.robot, tempo)
    };
    paces.iter().map(tempo).collect()
}

impl Stage<'_> {
    /// How fast robots are meant to go from now on.
    pub fn keep_time(&mut self, tempi: BTreeMap<InstanceId, Tempo>) {
        self.tempi = tempi;
    }

    /// A motion as slow as its robot is meant to go; hands open and close as fast as ever.
    pub(super) fn in_time(&self, motion: &Motion, performed: Performed) -> Performed {
        match motion {
            // What is tilted is as slow by now, and as slow beyond that as it pours.
            Motion::Grip { .. } | Motion::Free { .. } | Motion::Fingers { .. } | Motion::Tilted { .. } => performed,
            _ => self.slowed(performed),
        }
    }

    /// A motion as slow as its robot is meant to go.
    pub(super) fn slowed(&self, performed: Performed) -> Performed {
        let Some(tempo) = self.tempi.get(&performed.robot) else { return performed };
        let by_tip = if tempo.tip_speed.is_finite() { self.tip_speed(&performed) / tempo.tip_speed } else { 1.0 };
        performed.paced((tempo.slowness.max(by_tip), 0.0))
    }

    /// The greatest speed of a robot's tip on a motion, m/s.
    fn tip_speed(&self, performed: &Performed) -> f64 {
        let (apart, tips) = self.along(performed, |stage| stage.tip(performed.robot).position);
        let way = |pair: &[[f64; 3]]| pair[0].iter().zip(pair[1]).map(|(a, b)| (b - a) * (b - a)).sum::<f64>().sqrt();
        let most = tips.windows(2).map(way).fold(0.0, f64::max);
        if apart > 0.0 { most / apart } else { 0.0 }
    }
}
