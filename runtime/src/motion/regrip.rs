//! Taking a handle anew: where the arm cannot lead a part all the way as it stands, it lets go, comes back in another posture or
//! turned about, and leads it from there.

use matterix_ir::pose::Pose;
use matterix_ir::scene::InstanceId;

use super::fixture::Handle;
use super::goal::targets;
use super::lead_in::Lead;
use super::performed::{Part, Performed};
use super::postures::postures;
use super::refused::Refused;
use super::stage::Stage;

/// How far a hand draws back from a handle that it takes anew, m.
const BACK: f64 = 0.10;
/// How many postures are tried that lead the part all the way, and what share of what may still be looked at goes into each.
const TRIED: usize = 4;
const SHARE: u64 = 4;

impl Stage<'_> {
    /// Leads a part by its handle to where its joint stands at `to`, rad or m, in another posture; none where there is none.
    pub(super) fn lead_anew(
        &mut self,
        robot: InstanceId,
        (item, frame): (InstanceId, &str),
        handle: &Handle,
        to: f64,
    ) -> Option<Performed> {
        let arm = self.arm(robot);
        let (before, tip) = (self.clone(), self.tip(robot));
        let back = |tip: &Pose| Pose { position: tip.point([0.0, 0.0, -BACK]), ..*tip };
        let away = self.line(robot, &[back(&tip)], &[item]).ok()?;
        let drawn = self.clone();
        let mut tried = 0;
        for q in postures(&before, robot, &targets(&before, robot, item, frame)) {
            if tried == TRIED || self.is_weary() {
                break;
            }
            let mut there = before.clone();
            there.settle(robot, &arm, &q);
            let Ok(led) = there.lead_from(robot, item, handle, to) else { continue };
            let lead = Lead { from: q.clone(), to: back(&before.with_arm(robot, &arm, &q).tip(robot)), back: true };
            let Some((onto, points)) = self.led(robot, &lead, &[item]) else { continue };
            tried += 1;
            let Some(first) = points.first() else { continue };
            let way = self.within_share(SHARE, |stage| stage.way(robot, &arm, first, None));
            if let Ok(over) = way {
                self.back_to(&there);
                return Some(led.after([away, over, onto]));
            }
            self.back_to(&drawn);
        }
        self.back_to(&before);
        None
    }

    /// The same with an arm elsewhere.
    fn with_arm(&self, robot: InstanceId, arm: &[usize], q: &[f64]) -> Self {
        let mut out = self.clone();
        out.settle(robot, arm, q);
        out
    }
}

impl Performed {
    /// The same after some parts in which nothing is taken along.
    fn after(self, first: [Part; 3]) -> Self {
        let since: f64 = first.iter().map(|part| part.wait + part.trajectory.duration()).sum();
        let led = self.led.map(|led| led.later(since));
        Performed { parts: first.into_iter().chain(self.parts).collect(), led, ..self }
    }
}

/// Whether another posture may help.
pub(super) fn may_help(refused: &Refused) -> bool {
    matches!(refused, Refused::OutOfReach(..) | Refused::NoWay | Refused::Collides(_))
}
