//! Bodies against each other along every motion, in steps of two millimetres.

use std::collections::{BTreeMap, BTreeSet};

use matterix_solids::{Body, Isometry, Touch};

use crate::kinematics;
use crate::trajectory::{Grip, Robot, Trajectory};
use crate::verdict::{Looked, Wrong};
use crate::{GRIP, NOMINAL, STEP};

/// Nothing farther below a thing than this carries it, m.
const BELOW: f64 = 5e-3;

/// Follows all motions of a robot.
pub(crate) fn judge(film: &Trajectory, index: usize, looked: &mut Looked, wrong: &mut Vec<Wrong>) {
    let robot = &film.robots[index];
    let mut sweep = Sweep::new(film, index);
    if let Some(first) = robot.samples.first() {
        sweep.look(first.time);
    }
    for pair in robot.samples.windows(2) {
        let (from, to) = (pair[0].time, pair[1].time);
        if pair[0].position == pair[1].position && pair[0].links.first() == pair[1].links.first() {
            continue;
        }
        let steps = (robot.farthest(&pair[0].links, &pair[1].links) / STEP).ceil().clamp(1.0, MOST) as u32;
        for step in 1..=steps {
            // The last moment of an interval is looked at with what was held in it.
            let time = from + (to - from) * (f64::from(step) / f64::from(steps));
            sweep.look(if step == steps { to - (to - from) * 1e-9 } else { time });
        }
    }
    looked.configurations = sweep.configurations;
    wrong.extend(sweep.met.into_values());
    for grip in robot.grips.iter().filter(|g| !g.items.is_empty()) {
        gripped(film, grip, looked, wrong);
    }
    for pair in robot.grips.windows(2) {
        if pair[1].items.is_empty() {
            put_down(film, index, &pair[0].items, pair[1].time, wrong);
        }
    }
}

/// Steps between two samples at most.
const MOST: f64 = 4096.0;

struct Sweep<'f> {
    film: &'f Trajectory,
    index: usize,
    /// Pairs of links that can meet.
    apart: Vec<(usize, usize)>,
    /// By link: whether it moves at all.
    moves: Vec<bool>,
    /// By link: whether it is a finger.
    fingers: Vec<bool>,
    /// By robot, then by link.
    names: Vec<Vec<String>>,
    configurations: usize,
    met: BTreeMap<(String, String), Wrong>,
}

impl<'f> Sweep<'f> {
    fn new(film: &'f Trajectory, index: usize) -> Self {
        let robot = &film.robots[index];
        let description = &robot.machine.robot;
        let by = kinematics::moved_by(description);
        let touching: BTreeSet<[u32; 2]> = description.touching.iter().map(|[a, b]| [*a.min(b), *a.max(b)]).collect();
        let links = description.links.len();
        let apart = (0..links)
            .flat_map(|a| (a + 1..links).map(move |b| (a, b)))
            .filter(|&(a, b)| by[a] != by[b] && !touching.contains(&[a as u32, b as u32]))
            .filter(|&(a, b)| !kinematics::are_joined(description, &by, a, b))
            .collect();
        let tools = robot.machine.tools as usize;
        // A finger is moved by a joint of a tool that does not move the tip.
        let wrist = kinematics::above(description, robot.machine.tip);
        let of_tool =
            |joint: &u32| description.joints[*joint as usize].child as usize >= tools && !wrist.contains(joint);
        let fingers = by.iter().enumerate().map(|(l, j)| l >= tools && j.as_ref().is_some_and(of_tool)).collect();
        let stands = robot.samples.windows(2).all(|p| p[0].links.first() == p[1].links.first());
        let moves = by.iter().map(|j| j.is_some() || !stands).collect();
        let named = |robot: &Robot| {
            robot.machine.robot.links.iter().map(|link| format!("{}.{}", robot.name, link.name)).collect()
        };
        let names = film.robots.iter().map(named).collect();
        Sweep { film, index, apart, moves, fingers, names, configurations: 0, met: BTreeMap::new() }
    }

    fn look(&mut self, time: f64) {
        self.configurations += 1;
        let (film, robot) = (self.film, &self.film.robots[self.index]);
        let names = std::mem::take(&mut self.names);
        let own = &names[self.index];
        let links = robot.links(time);
        let link = |l: usize| Some((robot.bodies.get(l)?.as_ref()?, *links.get(l)?));
        for pair in 0..self.apart.len() {
            let (a, b) = self.apart[pair];
            if let (Some((mine, at)), Some((other, other_at))) = (link(a), link(b)) {
                self.compare(time, (&own[a], mine, at), (&own[b], other, other_at));
            }
        }
        let tip = links.get(robot.machine.tip as usize).copied();
        let carried: Vec<(usize, Isometry)> =
            robot.held(time).iter().filter_map(|(item, inner)| Some((*item, tip? * *inner))).collect();
        let others = self.others(time, &carried, &names);
        let near = robot.near_grips(time);
        for other in others.iter().filter(|o| !o.thing.is_some_and(|thing| robot.took(thing, time))) {
            for (l, name) in own.iter().enumerate() {
                let gripped = |g: &Grip| g.items.iter().any(|(item, _)| Some(*item) == other.thing);
                if !self.moves[l] || self.fingers[l] && near.iter().any(gripped) {
                    continue;
                }
                if let Some((mine, at)) = link(l) {
                    self.compare(time, (name, mine, at), (other.name, other.body, other.at));
                }
            }
            for (item, at) in &carried {
                let thing = &film.things[*item];
                if let Some(mine) = thing.body.as_ref() {
                    self.compare(time, (&thing.name, mine, *at), (other.name, other.body, other.at));
                }
            }
        }
        for (item, item_at) in &carried {
            let thing = &film.things[*item];
            let Some(body) = thing.body.as_ref() else { continue };
            for (l, name) in own.iter().enumerate() {
                if let (Some((mine, at)), false) = (link(l), self.fingers[l]) {
                    self.compare(time, (name, mine, at), (&thing.name, body, *item_at));
                }
            }
        }
        self.names = names;
    }

    /// All bodies that are not of this robot and not carried by it.
    fn others<'n>(&self, time: f64, carried: &[(usize, Isometry)], names: &'n [Vec<String>]) -> Vec<Other<'n>>
    where
        'f: 'n,
    {
        let film = self.film;
        let mut taken: BTreeSet<usize> = carried.iter().map(|(item, _)| *item).collect();
        let mut out = Vec::new();
        for (which, robot) in film.robots.iter().enumerate().filter(|(i, _)| *i != self.index) {
            let links = robot.links(time);
            let tip = links.get(robot.machine.tip as usize);
            for (item, inner) in robot.held(time) {
                if let (Some(tip), Some(body), true) = (tip, film.things[*item].body.as_ref(), taken.insert(*item)) {
                    let name = film.things[*item].name.as_str();
                    out.push(Other { name, thing: Some(*item), body, at: *tip * *inner });
                }
            }
            for (l, at) in links.into_iter().enumerate() {
                let Some(body) = robot.bodies[l].as_ref() else { continue };
                out.push(Other { name: &names[which][l], thing: None, body, at });
            }
        }
        let own = &film.robots[self.index].name;
        for (index, thing) in film.things.iter().enumerate() {
            if taken.contains(&index) || thing.whole == *own {
                continue;
            }
            if let (Some(body), Some(at)) = (thing.body.as_ref(), thing.at(time)) {
                out.push(Other { name: &thing.name, thing: Some(index), body, at });
            }
        }
        out
    }

    fn compare(&mut self, time: f64, mine: Side<'_>, other: Side<'_>) {
        let Some(Touch { distance, point }) = mine.1.touch(&mine.2, other.1, &other.2, 0.0) else { return };
        let depth = -distance;
        if depth <= NOMINAL {
            return;
        }
        let (one, two) = (mine.0.to_owned(), other.0.to_owned());
        let key = if one < two { (one.clone(), two.clone()) } else { (two.clone(), one.clone()) };
        let new = Wrong::Meets { mine: one, other: two, depth, at: point, time };
        let deeper = match self.met.get(&key) {
            Some(Wrong::Meets { depth: known, .. }) => depth > *known,
            _ => true,
        };
        if deeper {
            self.met.insert(key, new);
        }
    }
}

/// A name, a body and where it is.
type Side<'a> = (&'a str, &'a Body, Isometry);

/// What a robot could run into.
struct Other<'f> {
    name: &'f str,
    thing: Option<usize>,
    body: &'f Body,
    at: Isometry,
}

impl Robot {
    /// How far any point of the robot moves at most, from link to link.
    fn farthest(&self, from: &[Isometry], to: &[Isometry]) -> f64 {
        let far = |(link, (a, b)): (usize, (&Isometry, &Isometry))| {
            let turned = 2.0 * (a.rotation.inverse() * b.rotation).xyz().length();
            let reach = self.bodies.get(link).and_then(|b| b.as_ref()).map_or(0.0, Body::reach);
            a.translation.distance(b.translation) + turned * reach
        };
        from.iter().zip(to).enumerate().map(far).fold(0.0, f64::max)
    }
}

/// The tip must be at a frame of what it grips.
fn gripped(film: &Trajectory, grip: &Grip, looked: &mut Looked, wrong: &mut Vec<Wrong>) {
    let Some((item, inner)) = grip.items.first() else { return };
    looked.grips += 1;
    let thing = &film.things[*item];
    let far = |point: &Isometry| (*inner * *point).translation.length();
    let by = thing.points.iter().map(far).fold(f64::INFINITY, f64::min);
    looked.off = looked.off.max(by);
    if by > GRIP {
        wrong.push(Wrong::Off { item: thing.name.clone(), by, time: grip.time });
    }
}

/// Something must be below what was let go, or another robot must hold it.
fn put_down(film: &Trajectory, by: usize, along: &[(usize, Isometry)], time: f64, wrong: &mut Vec<Wrong>) {
    let Some(&(item, _)) = along.first() else { return };
    let mut others = film.robots.iter().enumerate().filter(|(i, _)| *i != by);
    if others.any(|(_, robot)| robot.held(time).first().is_some_and(|(held, _)| *held == item)) {
        return;
    }
    let thing = &film.things[item];
    let (Some(body), Some(at)) = (thing.body.as_ref(), thing.at(time)) else { return };
    let below =
        film.things.iter().enumerate().filter(|(i, t)| along.iter().all(|(a, _)| a != i) && t.whole != thing.whole);
    let carries = |(_, other): (usize, &crate::trajectory::Thing)| {
        let (Some(theirs), Some(theirs_at)) = (other.body.as_ref(), other.at(time)) else { return false };
        body.touch(&at, theirs, &theirs_at, BELOW).is_some()
    };
    if !below.into_iter().any(carries) {
        wrong.push(Wrong::Dropped { item: thing.name.clone(), time });
    }
}
