//! Where a robot's tip is to go for a goal.

use std::f64::consts::{FRAC_PI_4, PI};

use matterix_ir::pose::Pose;
use matterix_ir::scene::{InstanceId, Stand};

use super::carried::Carried;
use super::stage::Stage;

/// Poses of a robot's tip in the lab, any of which will do for bringing what it holds, or else its empty gripper, to a
/// frame; none where the frame is unknown.
///
/// What is held comes with its origin to the frame. An empty gripper comes with its z axis against the frame's, its
/// fingers closing along the frame's y axis or against it. What is round may be turned about its own axis.
pub fn targets(stage: &Stage<'_>, robot: InstanceId, goal: InstanceId, frame: &str) -> Vec<Pose> {
    let at = carried_to(stage, robot, goal, frame).and_then(|held| spots(stage, held, goal).into_iter().next());
    targets_at(stage, robot, goal, frame, at.unwrap_or_default())
}

/// What a robot brings to a frame in its hand; nothing where it comes with an empty gripper, or for what it holds.
pub fn carried_to(stage: &Stage<'_>, robot: InstanceId, goal: InstanceId, frame: &str) -> Option<InstanceId> {
    stage.held(robot).filter(|held| *held != goal || stage.is_stand(goal, frame))
}

/// As [`targets`], for one spot beside the frame.
pub fn targets_at(stage: &Stage<'_>, robot: InstanceId, goal: InstanceId, frame: &str, spot: Pose) -> Vec<Pose> {
    let Some(to) = stage.frame(goal, frame) else { return Vec::new() };
    let held = carried_to(stage, robot, goal, frame);
    match held.map(|held| (held, stage.carried[held.0 as usize])) {
        Some((held, Carried::Held(_, inner))) => {
            let back = inner.inverse();
            let to = to.then(spot);
            turns(stage, held, 1).into_iter().map(|turn| to.then(turn).then(back)).collect()
        }
        _ => {
            let over = Pose::turned([0.0; 3], [PI, 0.0, 0.0]);
            if !stage.is_stand(goal, frame) && !is_upright(stage, goal, &to) {
                let own = stage.pose(goal);
                let from = own.inverse().then(to);
                return turns(stage, goal, 1)
                    .into_iter()
                    .flat_map(|about| [0.0, PI].map(|roll| (about, Pose::turned([0.0; 3], [0.0, 0.0, roll]))))
                    .map(|(about, roll)| own.then(about).then(from).then(roll).then(over))
                    .collect();
            }
            turns(stage, goal, 2).into_iter().map(|turn| to.then(turn).then(over)).collect()
        }
    }
}

/// Whether a frame's z axis is that of its thing, so that turns about either are the same.
fn is_upright(stage: &Stage<'_>, id: InstanceId, frame: &Pose) -> bool {
    let axis = stage.pose(id).inverse().then(*frame);
    let [x, y, _] = axis.position;
    let tip = Pose { position: [0.0; 3], ..axis }.point([0.0, 0.0, 1.0]);
    x.hypot(y) < 1e-6 && tip[2].abs() > 1.0 - 1e-9
}

/// Distance of the places on a surface that are looked at, m.
const RASTER: f64 = 0.02;
/// How far from the frame `place` they are looked for, in steps of it: more than an arm reaches.
const FARTHEST: i32 = 100;
/// How many places on a surface are tried, and how far apart they are at least, m.
const SPOTS: (usize, f64) = (40, 0.08);

/// How far from the frame `place` of a surface a thing finds room, the nearest spot first: right there, unless something
/// stands there. Nothing but that where there is no room, or where the surface is no larger than a place for one thing.
pub fn spots(stage: &Stage<'_>, item: InstanceId, surface: InstanceId) -> Vec<Pose> {
    let scene = stage.scene;
    let (Some(top), Some(own)) = (&scene.get(surface).shape, &scene.get(item).shape) else {
        return vec![Pose::IDENTITY];
    };
    let place = scene.surface(surface).position;
    let others: Vec<Extent> = stage
        .carried
        .iter()
        .enumerate()
        .filter_map(|(index, carried)| match carried {
            Carried::Stands(Stand::On(on, at)) if *on == surface && index != item.0 as usize => {
                let id = InstanceId(index as u32);
                footprint(stage, id, at).filter(|_| !stage.unknown.places.contains(&id))
            }
            _ => None,
        })
        .collect();
    let (own, top) = (own.size(), top.size());
    let free = |x: f64, y: f64| {
        let apart = |[low, high]: &Extent| {
            let beside = |k: usize, p: f64| {
                let room = own[k] / 2.0 + RASTER;
                p + room <= low[k] || p - room >= high[k]
            };
            beside(0, x) || beside(1, y)
        };
        others.iter().all(apart)
    };
    let inside = |x: f64, y: f64| {
        (place[0] + x).abs() + own[0] / 2.0 <= top[0] / 2.0 && (place[1] + y).abs() + own[1] / 2.0 <= top[1] / 2.0
    };
    if free(0.0, 0.0) {
        return vec![Pose::IDENTITY];
    }
    let most = ((top[0].max(top[1]) / RASTER) as i32).min(FARTHEST);
    let mut places: Vec<(f64, f64)> = (-most..=most)
        .flat_map(|i| (-most..=most).map(move |j| (f64::from(i) * RASTER, f64::from(j) * RASTER)))
        .filter(|(x, y)| inside(*x, *y))
        .collect();
    places.sort_by(|a, b| (a.0.hypot(a.1)).total_cmp(&(b.0.hypot(b.1))));
    let mut chosen: Vec<(f64, f64)> = Vec::new();
    for (x, y) in places.into_iter().filter(|(x, y)| free(*x, *y)) {
        if chosen.len() == SPOTS.0 {
            break;
        }
        if chosen.iter().all(|c| (c.0 - x).hypot(c.1 - y) >= SPOTS.1) {
            chosen.push((x, y));
        }
    }
    match chosen.is_empty() {
        true => vec![Pose::IDENTITY],
        false => chosen.into_iter().map(|(x, y)| Pose::at([x, y, 0.0])).collect(),
    }
}

/// The least and the greatest corner of what something takes of a surface, m.
type Extent = [[f64; 2]; 2];

/// What a thing takes of the surface it stands on: all of its body, or the foot of a robot.
fn footprint(stage: &Stage<'_>, id: InstanceId, at: &Pose) -> Option<Extent> {
    let instance = stage.scene.get(id);
    let main = instance.shape.iter().map(|shape| (shape, *at));
    let more = instance.solids.iter().map(|solid| (&solid.shape, at.then(solid.pose)));
    let mut points: Vec<[f64; 2]> = Vec::new();
    for (shape, at) in main.chain(more) {
        let [x, y, z] = shape.size();
        for corner in 0..8u8 {
            let side = |bit: u8, half: f64| if corner & bit == 0 { -half } else { half };
            let [x, y, _] = at.point([side(1, x / 2.0), side(2, y / 2.0), if corner & 4 == 0 { 0.0 } else { z }]);
            points.push([x, y]);
        }
    }
    if let Some(actor) = stage.actors.get(&id) {
        let robot = &actor.assembly.robot;
        let foot = robot.balls.iter().filter(|b| robot.fixed_to(0).contains(&b.link));
        let reach = foot.map(|b| b.center[0].hypot(b.center[1]) + b.radius).fold(0.0, f64::max);
        points.extend([-reach, reach].map(|by| [at.position[0] + by, at.position[1] + by]));
    }
    let least = |k: usize| points.iter().map(|p| p[k]).reduce(f64::min);
    let most = |k: usize| points.iter().map(|p| p[k]).reduce(f64::max);
    Some([[least(0)?, least(1)?], [most(0)?, most(1)?]])
}

/// Turns about a thing's own axis that change nothing: of a round one eight, of another one so many.
fn turns(stage: &Stage<'_>, id: InstanceId, others: u32) -> Vec<Pose> {
    let round = stage.scene.get(id).shape.as_ref().is_some_and(|s| s.is_round());
    let (count, step) = if round { (8, FRAC_PI_4) } else { (others, PI) };
    (0..count).map(|k| Pose::turned([0.0; 3], [0.0, 0.0, f64::from(k) * step])).collect()
}
