//! What has gone wrong, in words: what touched what, with which force, and what friction would have had to bear.

use matterix_contact::{GRAVITY, Id, Touch};
use matterix_ir::scene::InstanceId;

use super::Matter;

impl Matter<'_> {
    fn called(&self, id: InstanceId) -> &str {
        &self.scene.get(id).name
    }

    /// A body in words: a thing, a link of a robot, the floor.
    pub(super) fn body(&self, id: Id) -> String {
        match self.names.get(id.0 as usize) {
            Some((Some(instance), Some(link))) => format!("`{link}` of `{}`", self.called(*instance)),
            Some((Some(instance), None)) => format!("`{}`", self.called(*instance)),
            _ => "the floor".to_string(),
        }
    }

    /// What a grip bears of a thing and what it has to, in words.
    fn bearing(&self, robot: InstanceId, item: InstanceId) -> String {
        let (Some(machine), Some(loose)) = (self.machines.get(&robot), self.loose.get(&item)) else {
            return String::new();
        };
        let Some(hand) = machine.hand.as_ref() else { return String::new() };
        let touches = self.world.touches(loose.body);
        let fingers = touches.iter().filter(|touch| hand.fingers.contains(&touch.by));
        let friction = fingers.clone().map(|touch| touch.friction).fold(f64::INFINITY, f64::min);
        let weight = self.laden(item) * GRAVITY;
        if !friction.is_finite() {
            return format!("it weighs {weight:.1} N, and no finger touches it now");
        }
        let bears = 2.0 * friction * hand.force;
        format!(
            "each finger presses with {:.1} N and holds {bears:.1} N at a friction of {friction:.2}, but it weighs {weight:.1} N",
            hand.force
        )
    }

    /// The mass of a thing with what stands on it, kg.
    pub(super) fn laden(&self, item: InstanceId) -> f64 {
        let own = self.loose.get(&item).map_or(0.0, |loose| loose.now.mass);
        let upon = self.loose.iter().filter(|(id, loose)| **id != item && loose.base == Some(item));
        own + upon.map(|(_, loose)| loose.now.mass).sum::<f64>()
    }

    pub(super) fn slipped(&self, robot: InstanceId, item: InstanceId, (far, turned): (f64, f64)) -> String {
        let (name, hand) = (self.called(item), self.called(robot));
        let how = moved(far, turned);
        format!("`{name}` slips {how} in the fingers of `{hand}`: {}", self.bearing(robot, item))
    }

    pub(super) fn dropped(&self, robot: InstanceId, item: InstanceId) -> String {
        let (name, hand) = (self.called(item), self.called(robot));
        format!("`{hand}` drops `{name}`: {}", self.bearing(robot, item))
    }

    pub(super) fn jammed(&self, robot: InstanceId, item: InstanceId, (far, turned): (f64, f64), by: &Touch) -> String {
        let (name, hand, what) = (self.called(item), self.called(robot), self.body(by.by));
        let [x, y, z] = by.point.map(|m| m * 1e3);
        format!(
            "`{name}` is stopped by {what} at ({x:.0}, {y:.0}, {z:.0}) mm, which presses on it with {:.1} N, and moves {} in the fingers of `{hand}`",
            by.pressed(),
            moved(far, turned)
        )
    }

    pub(super) fn missed(&self, robot: InstanceId, item: InstanceId, pinch: [f64; 2]) -> String {
        let (name, hand) = (self.called(item), self.called(robot));
        let Some(machine) = self.machines.get(&robot).and_then(|m| m.hand.as_ref()) else { return String::new() };
        let between: Vec<String> = machine
            .fingers
            .iter()
            .flat_map(|finger| self.world.touches(*finger))
            .filter(|touch| touch.pressed() > 0.05 * machine.force)
            .map(|touch| self.body(touch.by))
            .collect();
        let [one, other] = pinch.map(|force| force.max(0.0) + 0.0);
        let mut text = format!(
            "the fingers of `{hand}` press on `{name}` with {one:.1} N and {other:.1} N of {:.1} N each",
            machine.force
        );
        let others: Vec<&String> = between.iter().filter(|what| **what != format!("`{name}`")).collect();
        if let Some(what) = others.first() {
            text.push_str(&format!(", and on {what}"));
        }
        text
    }

    pub(super) fn disturbance(&self, id: InstanceId, far: f64, lean: f64, touches: &[Touch]) -> String {
        let name = self.called(id);
        let how = moved(far, lean);
        let hardest = touches.iter().filter(|touch| self.robot_of(touch.by).is_some() || self.is_held(touch.by));
        match hardest.max_by(|a, b| a.pressed().total_cmp(&b.pressed())) {
            Some(touch) => {
                format!("{} pushes `{name}` {how}, with {:.1} N", self.body(touch.by), touch.pressed())
            }
            None => format!("`{name}` moves {how} from its place, and no robot touches it"),
        }
    }

    fn is_held(&self, body: Id) -> bool {
        let held = |id: &InstanceId| self.loose.get(id).is_some_and(|loose| loose.body == body);
        self.machines.values().any(|machine| machine.held.is_some_and(|hold| held(&hold.item)))
    }

    pub(super) fn fell(&self, robot: InstanceId, item: InstanceId, (far, lean): (f64, f64), toppled: bool) -> String {
        let (name, hand) = (self.called(item), self.called(robot));
        let on = self.loose.get(&item).and_then(|loose| self.bearer(loose.body));
        let on = on.map_or("nothing".to_string(), |on| format!("`{}`", self.called(on)));
        match toppled {
            true => format!("`{name}` leans by {:.0} deg on {on} after `{hand}` has released it", lean.to_degrees()),
            false => format!(
                "`{name}` comes to rest on {on}, {:.1} mm from the place where `{hand}` should put it",
                far * 1e3
            ),
        }
    }

    /// Where what fell has come to lie, in words.
    pub(super) fn aftermath(&self) -> String {
        let lost = self.loose.iter().filter_map(|(id, loose)| {
            let held = self.machines.values().any(|m| m.held.is_some_and(|held| held.item == *id));
            let now = self.world.pose(loose.body);
            let rests = self.base(loose.base).then(loose.rests);
            let far = (0..3).map(|k| (now.position[k] - rests.position[k]).powi(2)).sum::<f64>().sqrt();
            let fell = held && self.bearer(loose.body).is_some_and(|on| !self.machines.contains_key(&on));
            (fell && far > 1e-3).then_some((*id, now, self.bearer(loose.body)))
        });
        lost.map(|(id, now, on)| {
            let [x, y, z] = now.position.map(|m| m * 1e3);
            let on = on.map_or("the floor".to_string(), |on| format!("`{}`", self.called(on)));
            format!("; `{}` then lies at ({x:.0}, {y:.0}, {z:.0}) mm on {on}", self.called(id))
        })
        .collect()
    }
}

fn moved(far: f64, turned: f64) -> String {
    format!("{:.1} mm and {:.0} deg", far * 1e3, turned.to_degrees())
}
