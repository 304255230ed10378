//! What a hand does to a thing that is not where it is taken to be.
//!
//! Fingers centre what they close on. Of what another hand holds they do so as far as its friction gives; a gripper without fingers that move
//! holds a thing where it meets it.

use matterix_ir::extent::Body;
use matterix_ir::pose::Pose;
use matterix_ir::scene::{Frame, InstanceId, Shape};
use matterix_motion::pose::{distance, pose};
use matterix_solids::{Body as Solid, isometry};

use super::{DEEPER, Stray, apart, clearance, is_elsewhere, mm, not_modelled};
use crate::motion::fingers::Fingers;
use crate::motion::stage::{Actor, Stage};

/// By how much two hands that hold one thing give, and it turns in them, before that counts: m and rad.
const GIVES: (f64, f64) = (1e-4, 1e-3);
/// Points around the end of a tool that are looked at.
const AROUND: u32 = 16;
/// A ball that stands for a point, m.
const POINT: f64 = 1e-4;

/// A grip as it is meant and as it is.
struct Grip<'s, 'p> {
    real: &'s Stage<'p>,
    item: InstanceId,
    /// The robot, and as the plan calls it.
    robot: InstanceId,
    by: InstanceId,
    /// Where it is and where it is taken to be, in the lab.
    pose: Pose,
    thought: Pose,
    tip: Pose,
    /// What it is held by, in its own frame.
    held_at: Pose,
}

/// Where a thing is once a hand has closed on it.
pub(super) fn gripped(
    [believed, real]: [&Stage<'_>; 2],
    item: InstanceId,
    frame: &str,
    by: InstanceId,
) -> Result<Pose, Stray> {
    let (pose, thought) = (real.pose(item), believed.pose(item));
    if !is_elsewhere(&pose, &thought) {
        return Ok(pose);
    }
    let robot = real.actor_of(by).unwrap_or(by);
    let held_at = real.scene.get(item).frames.iter().find(|f| f.name == frame).map_or(Pose::IDENTITY, |f| f.pose);
    let grip = Grip { real, item, robot, by, pose, thought, tip: real.tip(robot), held_at };
    let actor = real.actors.get(&robot);
    match actor.and_then(|actor| Some((actor, actor.fingers.as_ref()?))) {
        Some((actor, fingers)) => grip.by_fingers(actor, fingers),
        None => grip.as_it_is(actor),
    }
}

impl Grip<'_, '_> {
    fn name(&self, id: InstanceId) -> &str {
        &self.real.scene.get(id).name
    }

    /// How a place of the thing is seen from the tip where the thing is so, m.
    fn seen(&self, pose: &Pose) -> [f64; 3] {
        self.tip.inverse().point(pose.point(self.held_at.position))
    }

    /// How far off what it is held by is, as the tip sees it, m.
    fn off(&self) -> [f64; 3] {
        let (now, expected) = (self.seen(&self.pose), self.seen(&self.thought));
        [0, 1, 2].map(|k| now[k] - expected[k])
    }

    fn far(&self) -> String {
        mm(apart(self.seen(&self.pose), self.seen(&self.thought)))
    }

    fn missed<T>(&self, text: String) -> Result<T, Stray> {
        Err(Stray { at: 0.0, failure: "missed", text })
    }

    /// How wide it is the way the fingers close, turned as it is, m.
    fn width(&self) -> Option<f64> {
        let across = Pose { position: self.held_at.position, ..self.pose.inverse().then(self.tip) };
        let frames = [Frame { name: String::new(), pose: across, stand: false, link: None }];
        let body = Body { frames: &frames, ..self.real.scene.get(self.item).body() };
        body.across("").or_else(|| {
            let [ahead, behind] = self.solid()?.ways_across(&across)?;
            // Fingers are meant to meet around the place by which it is held.
            Some(2.0 * ahead.max(behind))
        })
    }

    fn solid(&self) -> Option<&Solid> {
        self.real.bodies().get(self.item.0 as usize)?.as_ref()
    }

    fn by_fingers(&self, actor: &Actor, fingers: &Fingers) -> Result<Pose, Stray> {
        let (off, now) = (self.off(), self.seen(&self.pose));
        let (name, hand) = (self.name(self.item), self.name(self.by));
        let Some(width) = self.width() else {
            return Err(not_modelled(format!(
                "`{hand}` grips `{name}` {} from its assumed place, where its width is unknown",
                self.far()
            )));
        };
        let Some(ways) = fingers.ways(&actor.tree, &actor.joints, [off[0], 0.0, off[2]]) else {
            return self.missed(format!(
                "the fingers of `{hand}` close beside `{name}`, which is {} from its assumed place",
                self.far()
            ));
        };
        // A finger stands in the way of its edge on that side.
        let side = if off[1] < 0.0 { ways[1] + now[1] } else { ways[0] - now[1] };
        if side < width / 2.0 {
            let room = (ways[0] + ways[1] - width) / 2.0;
            return self.missed(format!(
                "a finger of `{hand}` hits `{name}`, which is {} off across the fingers: open fingers leave {} on either side",
                mm(off[1].abs()),
                mm(room.max(0.0))
            ));
        }
        if let Some(hole) = self.real.stand_of(self.item)
            && let Some(room) = clearance(self.real, self.item, hole)
            && room < off[1].abs()
        {
            return self.missed(format!(
                "the fingers of `{hand}` push `{name}` {} aside in `{}`, where it has {} of play",
                mm(off[1].abs()),
                self.name(hole),
                mm(room)
            ));
        }
        let centred = self.centred(off[1]);
        match self.real.holder(self.item).filter(|other| *other != self.robot) {
            Some(giver) => self.yields(giver, off[1], centred),
            None => Ok(centred),
        }
    }

    /// Where it is in the middle of the fingers that are so far from it now, m.
    fn centred(&self, off: f64) -> Pose {
        let round = self.real.scene.get(self.item).shape.as_ref().is_some_and(Shape::is_round);
        // Flat sides lie against the fingers then; about what they hold it by, it turns.
        let about = self.pose.point(self.held_at.position);
        let turned = if round { self.pose } else { Pose { position: self.pose.position, ..self.thought } };
        let moved = turned.point(self.held_at.position);
        let aside = self.aside(off);
        let position = [0, 1, 2].map(|k| turned.position[k] + about[k] - moved[k] + aside[k]);
        Pose { position, ..turned }
    }

    /// The way by which fingers bring it back that is so far off, in the lab, m.
    fn aside(&self, off: f64) -> [f64; 3] {
        let (origin, aside) = (self.tip.position, self.tip.point([0.0, -off, 0.0]));
        [0, 1, 2].map(|k| aside[k] - origin[k])
    }

    /// Where it is once the fingers of two hands press on it. Hands stand where they are, so it can only slide along the fingers of the hand
    /// that has it, until both fingers of this one touch it: as far as one of them, pressing alone, overcomes friction.
    fn yields(&self, giver: InstanceId, off: f64, centred: Pose) -> Result<Pose, Stray> {
        let (name, hand, other) = (self.name(self.item), self.name(self.by), self.name(giver));
        let (_, turned) = distance(&pose(&self.pose), &pose(&centred));
        if turned > GIVES.1 {
            return Err(not_modelled(format!(
                "the fingers of `{hand}` turn `{name}` in those of `{other}`, by {:.1} deg",
                turned.to_degrees()
            )));
        }
        if off.abs() <= GIVES.0 {
            return Ok(centred);
        }
        let theirs = axis(&self.real.tip(giver), 1);
        let mine = axis(&self.tip, 1);
        let against = dot(mine, theirs);
        let along = [0, 1, 2].map(|k| mine[k] - against * theirs[k]);
        let share = dot(along, along).sqrt();
        let [(own, press), (tool, hold)] = [self.robot, giver].map(|robot| self.tool(robot));
        let rubs = [own, tool].map(|tool| self.sliding(tool));
        let (Some(press), Some(hold), [Some(own), Some(theirs)]) = (press, hold, rubs) else {
            return Err(not_modelled(format!(
                "one finger of `{hand}` presses on `{name}`, which `{other}` holds {} off across them; some of their forces and frictions are unknown",
                mm(off.abs())
            )));
        };
        // What presses across the fingers of the other hand adds to their friction, and what slides past the own finger rubs on that.
        let moves = press * (share - (own + theirs) * against.abs());
        let bears = 2.0 * theirs * hold;
        if moves <= bears {
            return self.missed(format!(
                "only one finger of `{hand}` presses on `{name}`, which is {} off across them: of its {press:.0} N {:.0} N push it along the fingers of `{other}`, whose friction holds {bears:.0} N",
                mm(off.abs()),
                moves.max(0.0)
            ));
        }
        let by = -off / (share * share);
        let position = [0, 1, 2].map(|k| self.pose.position[k] + by * along[k]);
        Ok(Pose { position, ..centred })
    }

    /// The part of a robot that grips, and what each of its fingers presses with, N.
    fn tool(&self, robot: InstanceId) -> (InstanceId, Option<f64>) {
        let owners = self.real.actors.get(&robot).map_or(&[][..], |actor| &actor.assembly.owners);
        let with = owners.iter().find_map(|id| Some((*id, self.real.scene.get(*id).force?)));
        with.map_or((robot, None), |(id, force)| (id, Some(force)))
    }

    /// The friction between what it is held by and it, where that is known.
    fn sliding(&self, tool: InstanceId) -> Option<f64> {
        let scene = self.real.scene;
        let given = scene.frictions.iter().find(|f| f.between == [tool, self.item] || f.between == [self.item, tool]);
        given.map(|f| f.coefficient).or_else(|| Some(scene.get(tool).friction?.min(scene.get(self.item).friction?)))
    }

    /// A gripper without fingers that move holds it where it meets it: by its whole face, or not at all.
    fn as_it_is(&self, actor: Option<&Actor>) -> Result<Pose, Stray> {
        let (name, hand) = (self.name(self.item), self.name(self.by));
        let unknown =
            |what: &str| not_modelled(format!("`{hand}` grips `{name}` {} from its assumed place, {what}", self.far()));
        if self.real.holder(self.item).is_some_and(|other| other != self.robot) {
            return Err(unknown("while another robot holds it"));
        }
        let Some(radius) = actor.and_then(|actor| self.face(actor)) else {
            return Err(unknown("and its fingers and the shape of its face are unknown"));
        };
        let Some(body) = self.solid() else { return Err(unknown("and its shape is unknown")) };
        let rim = (0..AROUND).map(|k| {
            let angle = f64::from(k) * std::f64::consts::TAU / f64::from(AROUND);
            [radius * angle.cos(), radius * angle.sin(), 0.0]
        });
        let meant = self.gap(body, &self.thought, [0.0; 3]);
        let Some(meant) = meant.filter(|gap| *gap <= DEEPER) else {
            return Err(unknown("and its face does not touch it there"));
        };
        let beyond = |at: [f64; 3]| self.gap(body, &self.pose, at).is_none_or(|gap| gap > meant + DEEPER);
        if beyond([0.0; 3]) {
            return self.missed(format!(
                "the face of `{hand}` does not touch `{name}`, which is {} from its assumed place",
                self.far()
            ));
        }
        if rim.into_iter().any(beyond) {
            return self.missed(format!(
                "the face of `{hand}`, {} wide, is partly beside `{name}`, which is {} from its assumed place",
                mm(2.0 * radius),
                self.far()
            ));
        }
        Ok(self.pose)
    }

    /// How far from the axis of its tip a tool reaches, m: what it holds with is no wider.
    fn face(&self, actor: &Actor) -> Option<f64> {
        let links = actor.tree.poses(&actor.joints);
        let tip = matterix_motion::placement(links.get(actor.assembly.tip as usize)?).inverse();
        let tool = actor.assembly.owners.get(actor.assembly.tip as usize).filter(|owner| **owner != self.robot)?;
        let own = actor.assembly.owners.iter().zip(&links).zip(actor.bodies()).filter(|((owner, _), _)| *owner == tool);
        let boxes = own.filter_map(|((_, link), body)| {
            Some(body.as_ref()?.bounds(&isometry(&tip.then(matterix_motion::placement(link)))))
        });
        let far = |[least, most]: [[f64; 3]; 2]| [0, 1].map(|k| least[k].abs().max(most[k].abs()));
        boxes.map(far).map(|[x, y]| x.max(y)).max_by(f64::total_cmp)
    }

    /// How far a point of the tip is from the thing where that is so, m; none where it is far away.
    fn gap(&self, body: &Solid, thing: &Pose, at: [f64; 3]) -> Option<f64> {
        let ball = Shape::Sphere(2.0 * POINT);
        let point = Solid::of_shapes([(&ball, Pose::up(-POINT))])?;
        let at = Pose::at(self.tip.point(at));
        let found = body.touch(&isometry(thing), &point, &isometry(&at), 10.0 * DEEPER)?;
        Some((found.distance + POINT).max(0.0))
    }
}

/// One of the axes of a pose, in the lab.
fn axis(pose: &Pose, k: usize) -> [f64; 3] {
    let mut unit = [0.0; 3];
    unit[k] = 1.0;
    let ahead = pose.point(unit);
    [0, 1, 2].map(|k| ahead[k] - pose.position[k])
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
