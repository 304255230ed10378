//! Ways on which what is held does not tilt: trees that grow in short steps, each set upright again where it would
//! tilt too far (after CBiRRT: Berenson and others, 2009).

use nalgebra::{Rotation3, UnitVector3, Vector3};

use super::judge::Judge;
use super::nearest::{Cloud, Visit};
use super::path::{Way, gap};
use super::{End, Failure, Route, Settings, rounded, simplify, within};
use crate::inverse::{Facing, Request, Solver};
use crate::pose::Pose;
use crate::spheres::Checker;

/// What is not to tilt.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Upright {
    /// The axis of the tip, in its frame, that is to point up.
    pub axis: UnitVector3<f64>,
    /// Up, in the frame of the chain's base.
    pub up: UnitVector3<f64>,
    /// By how much it may tilt; rad.
    pub tilt: f64,
}

impl Upright {
    /// Keeps the z axis of what is held (relative to the tip) along the z axis of the world (relative to the base).
    pub fn of(held: &Pose, world: &Pose, tilt: f64) -> Self {
        Self { axis: held.rotation * Vector3::z_axis(), up: world.rotation * Vector3::z_axis(), tilt }
    }

    /// The angle between the tip's axis and up; rad.
    pub fn tilt_of(&self, tip: &Pose) -> f64 {
        (tip.rotation * self.axis.into_inner()).angle(&self.up)
    }

    /// The tip where it is, turned back until it tilts by no more than this share of what it may.
    fn righted(&self, tip: &Pose, share: f64) -> Pose {
        let here = tip.rotation * self.axis.into_inner();
        let excess = here.angle(&self.up) - share * self.tilt;
        let about = here.cross(&self.up);
        // Upside down any axis at right angles will do.
        let helper = if here.x.abs() < 0.6 { Vector3::x() } else { Vector3::y() };
        // Upside down any axis at right angles will do.
        let about =
            UnitVector3::try_new(about, 1e-9).unwrap_or_else(|| UnitVector3::new_normalize(here.cross(&helper)));
        Pose::from_parts(tip.translation, Rotation3::from_axis_angle(&about, excess.max(0.0)) * tip.rotation)
    }
}

/// A checker that also refuses what tilts.
pub struct Level<'c, 'a> {
    /// Says what collides.
    pub checker: &'c mut Checker<'a>,
    /// Says where the tip is; its chain's variables are those the checker plans for.
    pub solver: &'c mut Solver,
    /// What is not to tilt.
    pub upright: Upright,
}

impl Level<'_, '_> {
    fn is_level(&self, q: &[f32]) -> bool {
        let q: Vec<f64> = q.iter().map(|&x| f64::from(x)).collect();
        self.upright.tilt_of(&self.solver.chain().tip(&q)) <= self.upright.tilt
    }

    /// The nearest allowed configuration with the tip in about the same place.
    fn right(&mut self, q: &mut [f32]) -> bool {
        if self.is_level(q) {
            return true;
        }
        let start: Vec<f64> = q.iter().map(|&x| f64::from(x)).collect();
        let target = self.upright.righted(&self.solver.chain().tip(&start), 0.5);
        let request = Request {
            facing: Facing::Along(self.upright.axis),
            linear: 1e-3,
            angular: 0.2 * self.upright.tilt,
            attempts: 1,
            ..Request::new(target, &start)
        };
        self.checker.spend(RIGHTING);
        let Ok(solution) = self.solver.search(&request) else { return false };
        for (x, s) in q.iter_mut().zip(&solution.q) {
            *x = *s as f32;
        }
        true
    }
}

impl Judge for Level<'_, '_> {
    fn resolution(&self) -> f64 {
        self.checker.resolution()
    }

    fn allows(&mut self, points: &[f32]) -> bool {
        let dims = self.checker.figure().freedom();
        points.chunks_exact(dims).all(|q| self.is_level(q)) && self.checker.are_free(points)
    }

    fn allows_way(&mut self, from: &[f32], vector: &[f32], length: f32) -> bool {
        let steps = (f64::from(length) * self.resolution()).ceil().max(1.0) as usize;
        let mut q = vec![0.0; from.len()];
        for step in 1..=steps {
            let share = step as f32 / steps as f32;
            for (x, (f, v)) in q.iter_mut().zip(from.iter().zip(vector)) {
                *x = f + v * share;
            }
            if !self.is_level(&q) {
                return false;
            }
        }
        self.checker.is_clear(from, vector, length)
    }
}

/// How many blocks of configurations take as long as setting one upright.
const RIGHTING: u64 = 20;
/// Longest step of a tree; rad.
const STEP: f32 = 0.15;

struct Grown {
    cloud: Cloud,
    parents: Vec<usize>,
}

impl Grown {
    fn trace(&self, mut at: usize, dims: usize) -> Way {
        let mut way = Way::new(dims);
        loop {
            way.push(self.cloud.point(at));
            if self.parents[at] == at {
                return way;
            }
            at = self.parents[at];
        }
    }

    /// Steps towards a configuration as far as they are allowed and come nearer; the last node.
    fn grow(&mut self, to: &[f32], level: &mut Level, visits: &mut Vec<Visit>) -> usize {
        let (mut tip, mut left) = self.cloud.nearest(to, visits);
        let mut here = self.cloud.point(tip).to_vec();
        let mut vector = vec![0.0; to.len()];
        while left > 0.0 {
            let length = gap(&here, to, &mut vector);
            let share = (STEP / length).min(1.0);
            let mut next: Vec<f32> = here.iter().zip(&vector).map(|(h, v)| h + v * share).collect();
            if share == 1.0 {
                next.copy_from_slice(to);
            }
            if !level.right(&mut next) {
                return tip;
            }
            let step = gap(&here, &next, &mut vector);
            if step > 2.0 * STEP || step == 0.0 || !level.allows_way(&here, &vector, step) {
                return tip;
            }
            let nearer = gap(&next, to, &mut vector);
            if nearer > left - 0.05 * STEP && nearer > 0.0 {
                return tip;
            }
            left = nearer;
            self.cloud.push(&next);
            self.parents.push(tip);
            tip = self.parents.len() - 1;
            here = next;
        }
        tip
    }
}

/// A short way from one configuration to another on which nothing collides and the tip's axis stays upright.
///
/// Where there is none among balls and the checker has a referee, one is searched among true shapes.
pub fn plan_upright(level: &mut Level, start: &[f64], goal: &[f64], settings: &Settings) -> Result<Route, Failure> {
    level.checker.ask(false);
    let before = level.checker.effort();
    match search(level, start, goal, &settings.first()) {
        Err(Failure::Collision(..) | Failure::Unreached(_)) if level.checker.ask(true) => {
            let spent = level.checker.effort() - before;
            search(level, start, goal, &settings.asking(spent))
        }
        found => found,
    }
}

fn search(level: &mut Level, start: &[f64], goal: &[f64], settings: &Settings) -> Result<Route, Failure> {
    let ends = [(start, End::Start), (goal, End::Goal)];
    let mut single = Vec::with_capacity(2);
    for (q, which) in ends {
        let q32 = within(level.checker, q, which)?;
        if !level.checker.is_free(&q32) {
            return Err(Failure::Collision(which, level.checker.contacts(q)));
        }
        let tilt = level.upright.tilt_of(&level.solver.chain().tip(q));
        if !level.is_level(&q32) {
            return Err(Failure::Tilt(which, tilt));
        }
        single.push(q32);
    }
    let dims = start.len();
    let mut trees = [0, 1].map(|i| {
        let mut cloud = Cloud::new(dims);
        cloud.push(&single[i]);
        Grown { cloud, parents: vec![0] }
    });
    let mut halton = level.checker.figure().samples().draw();
    let mut visits = Vec::new();
    let mut sample = single[1].clone();
    let last = level.checker.effort().saturating_add(settings.effort);
    for iteration in 0..settings.iterations {
        if level.checker.effort() >= last {
            return Err(Failure::Unreached(iteration));
        }
        let grows = iteration % 2;
        let [a, b] = &mut trees;
        let (tree, aim) = if grows == 0 { (a, b) } else { (b, a) };
        let tip = tree.grow(&sample, level, &mut visits);
        let met = tree.cloud.point(tip).to_vec();
        let other = aim.grow(&met, level, &mut visits);
        if aim.cloud.point(other) == met {
            let mut way = tree.trace(tip, dims);
            way.reverse();
            way.replace_last(&aim.trace(other, dims));
            if grows == 1 {
                way.reverse();
            }
            let way = simplify::simplify(level, way, settings.rounds);
            return Ok(rounded(&way, start, goal, iteration));
        }
        halton.next_into(&mut sample);
    }
    Err(Failure::Unreached(settings.iterations))
}
