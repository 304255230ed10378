//! A part that a hand leads: it must not run into what stands around, nor the arm into the thing it is a part of.

use matterix_ir::scene::InstanceId;
use matterix_motion::placement;
use matterix_solids::{Body, Isometry, isometry};

use super::fixture::{Led, following};
use super::performed::Part;
use super::refused::{Meeting, Refused};
use super::stage::Stage;
use super::swing::Near;

/// Steps in which a part is led: for every rad or m, and at least.
const STEPS: (f64, f64) = (50.0, 10.0);
/// How far true shapes may reach into each other, m: dimensions are nominal.
const NOMINAL: f64 = 2e-3;

/// How deep each link of a robot is in each body of a thing, m, and where.
type Depths = Vec<(usize, usize, f64, [f64; 3])>;

impl Stage<'_> {
    /// What a part of a thing runs into while a hand leads it from where it is to `to`, rad or m; or what of the robot runs
    /// into the thing.
    pub(super) fn lead_meets(&self, robot: InstanceId, led: &Led, to: f64, part: &Part) -> Option<Refused> {
        let item = led.item;
        let before = self.fixtures.get(&item)?.joints.clone();
        let mut stage = self.clone();
        // What a link carries has moved where the link has.
        let mut after = self.clone();
        after.set_joint(item, led.variable, to);
        let movers = after.movers_of(item, &before);
        let around = self.near_to(item, Some(robot));
        let near: Vec<&Near<'_>> = around.iter().filter(|n| !n.rides(&movers)).collect();
        let own = Body::of_links(&following(self.scene, item)?.robot);
        let count = ((to - led.from).abs() * STEPS.0).ceil().clamp(STEPS.1, 1e4) as u32;
        let mut first = None;
        for step in 0..=count {
            let time = part.trajectory.duration() * f64::from(step) / f64::from(count);
            let at = part.trajectory.at(time).position;
            stage.actors.get_mut(&robot)?.set_some(&part.joints, &at);
            stage.dragged(led, robot);
            let (touches, depths) = (stage.touches(item, &movers, &near), stage.in_thing(robot, item, &own));
            let Some((outside, inside)) = &first else {
                first = Some((touches, depths));
                continue;
            };
            if let Some(meeting) = self.met(outside, touches, &movers, &near) {
                return Some(Refused::Swings(item, meeting));
            }
            if let Some(meeting) = self.reached_into(robot, item, inside, depths) {
                return Some(Refused::Collides(meeting));
            }
        }
        None
    }

    /// How deep links of a robot but for its fingers are in a thing.
    fn in_thing(&self, robot: InstanceId, item: InstanceId, own: &[Option<Body>]) -> Depths {
        let (Some(actor), Some(fixture)) = (self.actors.get(&robot), self.fixtures.get(&item)) else {
            return Vec::new();
        };
        let (foot, base) = (self.pose(robot), self.pose(item));
        let mut bodies: Vec<(Isometry, &Body)> = fixture
            .links()
            .iter()
            .zip(own)
            .filter_map(|(l, b)| Some((isometry(&base.then(*l)), b.as_ref()?)))
            .collect();
        let whole = self.bodies().get(item.0 as usize).and_then(Option::as_ref);
        bodies.extend(whole.map(|body| (isometry(&base), body)));
        let mut out = Vec::new();
        for (link, (pose, mine)) in actor.tree.poses(&actor.joints).iter().zip(actor.bodies()).enumerate() {
            let Some(mine) = mine.as_ref().filter(|_| !actor.is_finger(link as u32)) else { continue };
            let at = isometry(&foot.then(placement(pose)));
            for (index, (other_at, other)) in bodies.iter().enumerate() {
                if let Some(touch) = mine.touch(&at, other, other_at, 0.0) {
                    out.push((link, index, -touch.distance, touch.point));
                }
            }
        }
        out
    }

    /// The deepest that a robot has come into a thing, beyond where it was when it began.
    fn reached_into(&self, robot: InstanceId, item: InstanceId, first: &Depths, now: Depths) -> Option<Meeting> {
        let known = |l: usize, i: usize| first.iter().find(|f| (f.0, f.1) == (l, i)).map_or(0.0, |f| f.2.max(0.0));
        let met = now.into_iter().filter(|(l, i, depth, _)| *depth > NOMINAL + known(*l, *i));
        let (link, _, depth, at) = met.max_by(|a, b| a.2.total_cmp(&b.2))?;
        let links = &self.actors.get(&robot)?.assembly.robot.links;
        Some(Meeting {
            mine: links.get(link).map(|l| l.name.clone()).unwrap_or_default(),
            other: self.scene.get(item).name.clone(),
            part: None,
            with: Some(item),
            at,
            depth,
            before: false,
            end: false,
        })
    }
}
