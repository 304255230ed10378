//! Whether configurations, and straight ways between them, are free of collisions.

use super::frames::{Frame, place};
use super::{Contact, Figure, Group, Referee};
use crate::lanes::{Kernel, Lanes, Row, WIDTH, dispatch, sin_cos};
use crate::vector::{Axes, Placed, Vector};
use crate::world::{Obstacle, World};
use nalgebra::Point3;

/// How many blocks of eight configurations among balls take as long as one among true shapes.
pub const ASKED: u64 = 50;

/// A robot in a world.
///
/// Coordinates are 32-bit here: about a micrometre at the reach of an arm.
#[derive(Clone, Debug)]
pub struct Checker<'a> {
    figure: &'a Figure,
    world: &'a World,
    /// What each group can reach.
    near: Vec<Vec<Obstacle>>,
    /// Whether something that does not move is already in something.
    stuck: bool,
    resolution: f32,
    scratch: Scratch,
    checks: u64,
    asked: u64,
    other: u64,
    referee: Option<&'a dyn Referee>,
    /// Whether the referee is asked.
    asks: bool,
}

#[derive(Clone, Debug, Default)]
struct Scratch {
    motion: Vec<[Row; 2]>,
    steps: Vec<[f32; 2]>,
    placed: Vec<Placed>,
    middles: Vec<[Row; 3]>,
    hits: Vec<u32>,
    inner: Vec<u32>,
}

impl<'a> Checker<'a> {
    /// Prepares a world for a robot; ways are checked at `resolution` configurations for every unit of length (rad,
    /// or m, over all variables together).
    pub fn new(figure: &'a Figure, world: &'a World, resolution: f64) -> Self {
        let mut near = Vec::with_capacity(figure.groups.len());
        for group in &figure.groups {
            near.push(match figure.anchor(group) {
                Some(anchor) => {
                    let anchor = Point3::from(anchor);
                    let in_reach = |b: &&crate::world::Body| b.is_within(group.reach + 1e-6, &anchor);
                    let mut near: Vec<Obstacle> = world.bodies.iter().filter(in_reach).map(Obstacle::new).collect();
                    // Alike next to alike, so that branches are foreseen.
                    near.sort_by_key(Obstacle::kind);
                    near
                }
                None => {
                    let beneath = |(index, _): &(usize, &crate::world::Body)| !world.beneath.contains(index);
                    world.bodies.iter().enumerate().filter(beneath).map(|(_, body)| Obstacle::new(body)).collect()
                }
            });
        }
        let rows = figure.frames.len();
        let scratch = Scratch {
            motion: vec![Default::default(); rows],
            steps: vec![Default::default(); rows.next_multiple_of(WIDTH)],
            placed: vec![Default::default(); rows],
            middles: vec![Default::default(); figure.groups.len()],
            hits: Vec::new(),
            inner: Vec::new(),
        };
        let mut checker = Self {
            figure,
            world,
            near,
            stuck: false,
            resolution: resolution as f32,
            scratch,
            checks: 0,
            asked: 0,
            other: 0,
            referee: None,
            asks: false,
        };
        checker.stuck = dispatch(Stuck(&mut checker));
        checker
    }

    /// The same with a referee, who decides where balls collide once [`Checker::ask`] has been called.
    pub fn overruled_by(self, referee: &'a dyn Referee) -> Self {
        Self { referee: Some(referee), ..self }
    }

    /// Whether the referee is asked from now on where balls collide; false where there is none.
    pub fn ask(&mut self, asks: bool) -> bool {
        self.asks = asks && self.referee.is_some();
        self.asks
    }

    fn referee(&self) -> Option<&'a dyn Referee> {
        self.referee.filter(|_| self.asks)
    }

    /// What collides in a configuration, deepest first: as the referee has it, if it is asked.
    pub fn contacts(&self, q: &[f64]) -> Vec<Contact> {
        match self.referee() {
            Some(referee) => referee.contacts(q),
            None => self.figure.contacts(self.world, q),
        }
    }

    /// The robot.
    pub fn figure(&self) -> &'a Figure {
        self.figure
    }

    /// The world.
    pub fn world(&self) -> &'a World {
        self.world
    }

    /// How many blocks of eight configurations have been checked so far.
    pub fn checks(&self) -> u64 {
        self.checks
    }

    /// How much has been looked at so far, in blocks of eight configurations among balls.
    pub fn effort(&self) -> u64 {
        self.checks + ASKED * self.asked + self.other
    }

    /// Something else was looked at that takes as long as so many blocks.
    pub fn spend(&mut self, blocks: u64) {
        self.other += blocks;
    }

    /// Configurations checked for every unit of length.
    pub fn resolution(&self) -> f64 {
        f64::from(self.resolution)
    }

    /// Whether the robot is free in all of these configurations, which follow one another.
    pub fn are_free(&mut self, points: &[f32]) -> bool {
        let free = !self.stuck && dispatch(Batch { checker: self, points });
        let asked = &mut self.asked;
        free || self.referee.filter(|_| self.asks).is_some_and(|referee| {
            points.chunks_exact(self.figure.limits().len().max(1)).all(|q| {
                *asked += 1;
                referee.is_free(&wide(q))
            })
        })
    }

    /// Whether the robot is free in this configuration.
    pub fn is_free(&mut self, q: &[f32]) -> bool {
        self.are_free(q)
    }

    /// Whether the robot is free all along `from + t * vector`, `t` above 0 and up to 1; `length` is the vector's.
    pub fn is_clear(&mut self, from: &[f32], vector: &[f32], length: f32) -> bool {
        let blocks = (length * self.resolution / WIDTH as f32).ceil().max(1.0) as usize;
        let clear = !self.stuck && dispatch(Sweep { checker: self, from, vector, blocks });
        clear || self.referee().is_some_and(|referee| is_clear_to(referee, from, vector, length, &mut self.asked))
    }
}

fn wide(q: &[f32]) -> Vec<f64> {
    q.iter().map(|&x| f64::from(x)).collect()
}

/// Whether a referee finds nothing along `from + t * vector`; the middle is looked at first, where a way is blocked as a rule.
fn is_clear_to(referee: &dyn Referee, from: &[f32], vector: &[f32], length: f32, asked: &mut u64) -> bool {
    let steps = (f64::from(length) * referee.resolution()).ceil().max(1.0) as u32;
    let mut free = |step: u32| {
        *asked += 1;
        let share = f64::from(step) / f64::from(steps);
        let q: Vec<f64> = from.iter().zip(vector).map(|(a, v)| f64::from(*a) + share * f64::from(*v)).collect();
        referee.is_free(&q)
    };
    free(steps.div_ceil(2)) && (1..=steps).all(free)
}

struct Stuck<'c, 'a>(&'c mut Checker<'a>);

impl Kernel for Stuck<'_, '_> {
    type Output = bool;
    #[inline(always)]
    fn run<L: Lanes>(self) -> bool {
        let checker = self.0;
        let Some(index) = checker.figure.groups.iter().position(|g| g.frame.is_none()) else { return false };
        let group = &checker.figure.groups[index];
        Vector::<L>::splat(first(&group.cover)).store(&mut checker.scratch.middles[index]);
        let own = |part: &super::Part| checker.figure.balls[part.balls.clone()].iter();
        let inside = |b: &[f32; 4]| checker.near[index].iter().any(|o| o.meets(Vector::<L>::splat(first(b)), b[3]));
        checker.figure.parts[group.parts.clone()].iter().flat_map(own).any(inside)
    }
}

/// The middle of a ball.
#[inline(always)]
fn first(ball: &[f32; 4]) -> [f32; 3] {
    [ball[0], ball[1], ball[2]]
}

/// A straight way, eight configurations at a time: first eight spread over all of it, then those between.
struct Sweep<'c, 'a, 'q> {
    checker: &'c mut Checker<'a>,
    from: &'q [f32],
    vector: &'q [f32],
    blocks: usize,
}

impl Kernel for Sweep<'_, '_, '_> {
    type Output = bool;
    #[inline(always)]
    fn run<L: Lanes>(self) -> bool {
        let Self { checker, from, vector, blocks } = self;
        let Checker { figure, near, scratch, checks, .. } = checker;
        let parts = L::load(&Row([0.125, 0.25, 0.375, 0.5, 0.625, 0.75, 0.875, 1.0]));
        let back = -1.0 / (WIDTH * blocks) as f32;
        for (index, frame) in figure.frames.iter().enumerate() {
            let by = frame.motion.multiplier as f32 * vector[frame.motion.variable];
            let at = frame.position(from[frame.motion.variable]);
            frame.put(parts.mul_add(L::splat(by), L::splat(at)), &mut scratch.motion[index]);
            scratch.steps[index] = [by * back, 0.0];
        }
        for block in 0..blocks {
            if block == 1 {
                steps_back::<L>(&mut scratch.steps);
            }
            if block > 0 {
                for (frame, (motion, step)) in figure.frames.iter().zip(scratch.motion.iter_mut().zip(&scratch.steps)) {
                    let [first, second] = motion;
                    let (s, c) = (L::load(first), L::load(second));
                    if frame.motion.slides {
                        let by = frame.motion.multiplier as f32 * vector[frame.motion.variable] * back;
                        (s + L::splat(by)).store(first);
                    } else {
                        let (ds, dc) = (L::splat(step[0]), L::splat(step[1]));
                        s.mul_add(dc, c * ds).store(first);
                        c.mul_add(dc, -(s * ds)).store(second);
                    }
                }
            }
            *checks += 1;
            if collides::<L>(figure, near, scratch) {
                return false;
            }
        }
        true
    }
}

/// Turns small angles into their sines and cosines.
#[inline(always)]
fn steps_back<L: Lanes>(steps: &mut [[f32; 2]]) {
    for chunk in steps.chunks_exact_mut(WIDTH) {
        let mut angles = Row::default();
        for (angle, step) in angles.0.iter_mut().zip(chunk.iter()) {
            *angle = step[0];
        }
        let (s, c) = sin_cos(L::load(&angles));
        let (mut sines, mut cosines) = (Row::default(), Row::default());
        s.store(&mut sines);
        c.store(&mut cosines);
        for (i, step) in chunk.iter_mut().enumerate() {
            *step = [sines.0[i], cosines.0[i]];
        }
    }
}

/// Any configurations, one after another; the last one fills what is left of its eight.
struct Batch<'c, 'a, 'q> {
    checker: &'c mut Checker<'a>,
    points: &'q [f32],
}

impl Kernel for Batch<'_, '_, '_> {
    type Output = bool;
    #[inline(always)]
    fn run<L: Lanes>(self) -> bool {
        let Self { checker, points } = self;
        let Checker { figure, near, scratch, checks, .. } = checker;
        let dims = figure.freedom();
        let count = points.len() / dims.max(1);
        let mut from = 0;
        while from < count {
            for (index, frame) in figure.frames.iter().enumerate() {
                let mut row = Row::default();
                for (lane, value) in row.0.iter_mut().enumerate() {
                    let point = (from + lane).min(count - 1);
                    *value = frame.position(points[point * dims + frame.motion.variable]);
                }
                frame.put(L::load(&row), &mut scratch.motion[index]);
            }
            *checks += 1;
            if collides::<L>(figure, near, scratch) {
                return false;
            }
            from += WIDTH;
        }
        true
    }
}

impl Frame {
    /// The position of its joint.
    #[inline(always)]
    fn position(&self, variable: f32) -> f32 {
        self.motion.multiplier as f32 * variable + self.motion.offset as f32
    }

    /// Writes down what placing it takes, in eight positions.
    #[inline(always)]
    fn put<L: Lanes>(&self, at: L, motion: &mut [Row; 2]) {
        let [first, second] = motion;
        if self.motion.slides {
            at.store(first);
        } else {
            let (s, c) = sin_cos(at);
            s.store(first);
            c.store(second);
        }
    }
}

/// Whether anything collides in any of the eight configurations whose joint motions are written down.
#[inline(always)]
fn collides<L: Lanes>(figure: &Figure, near: &[Vec<Obstacle>], scratch: &mut Scratch) -> bool {
    place::<L>(&figure.frames, &scratch.motion, &mut scratch.placed);
    in_world::<L>(figure, near, scratch) || in_itself::<L>(figure, scratch)
}

/// The middle of a ball given in a group's frame.
#[inline(always)]
fn middle<L: Lanes>(group: &Group, placed: &[Placed], ball: &[f32; 4]) -> Vector<L> {
    match group.frame {
        Some(frame) => Axes::load(&placed[frame]).point(first(ball)),
        None => Vector::splat(first(ball)),
    }
}

#[inline(always)]
fn in_world<L: Lanes>(figure: &Figure, near: &[Vec<Obstacle>], scratch: &mut Scratch) -> bool {
    for (index, (group, obstacles)) in figure.groups.iter().zip(near).enumerate() {
        let Some(frame) = group.frame else { continue };
        let center = Axes::<L>::load(&scratch.placed[frame]).point(first(&group.cover));
        center.store(&mut scratch.middles[index]);
        scratch.hits.clear();
        for (o, obstacle) in obstacles.iter().enumerate() {
            if obstacle.meets(center, group.cover[3]) {
                scratch.hits.push(o as u32);
            }
        }
        if !scratch.hits.is_empty() && closer::<L>(figure, group, obstacles, scratch) {
            return true;
        }
    }
    false
}

/// Whether any ball of a group meets one of the obstacles its cover meets.
#[inline(always)]
fn closer<L: Lanes>(figure: &Figure, group: &Group, obstacles: &[Obstacle], scratch: &mut Scratch) -> bool {
    let Scratch { placed, hits, inner, .. } = scratch;
    for part in &figure.parts[group.parts.clone()] {
        let list = if group.parts.len() > 1 && part.balls.len() > 1 {
            let center = middle::<L>(group, placed, &part.cover);
            inner.clear();
            for &o in hits.iter() {
                if obstacles[o as usize].meets(center, part.cover[3]) {
                    inner.push(o);
                }
            }
            &*inner
        } else {
            &*hits
        };
        if list.is_empty() {
            continue;
        }
        for ball in &figure.balls[part.balls.clone()] {
            let center = middle::<L>(group, placed, ball);
            for &o in list {
                if obstacles[o as usize].meets(center, ball[3]) {
                    return true;
                }
            }
        }
    }
    false
}

#[inline(always)]
fn meet<L: Lanes>(a: Vector<L>, b: Vector<L>, reach: f32) -> bool {
    (a - b).square().below(L::splat(reach * reach)) != 0
}

#[inline(always)]
fn in_itself<L: Lanes>(figure: &Figure, scratch: &Scratch) -> bool {
    let Scratch { placed, middles, .. } = scratch;
    for pair in &figure.pairs {
        let [a, b] = pair.groups;
        let (one, two) = (&figure.groups[a], &figure.groups[b]);
        let (near, far) = (Vector::<L>::load(&middles[a]), Vector::<L>::load(&middles[b]));
        if !meet(near, far, one.cover[3] + two.cover[3]) {
            continue;
        }
        for (i, others) in &pair.parts {
            let mine = &figure.parts[*i];
            let p = if one.parts.len() > 1 { middle::<L>(one, placed, &mine.cover) } else { near };
            if one.parts.len() > 1 && !meet(p, far, mine.cover[3] + two.cover[3]) {
                continue;
            }
            for &j in others {
                let theirs = &figure.parts[j];
                let q = if two.parts.len() > 1 { middle::<L>(two, placed, &theirs.cover) } else { far };
                if two.parts.len() > 1 && !meet(p, q, mine.cover[3] + theirs.cover[3]) {
                    continue;
                }
                for ball in &figure.balls[mine.balls.clone()] {
                    let p = middle::<L>(one, placed, ball);
                    if !meet(p, q, ball[3] + theirs.cover[3]) {
                        continue;
                    }
                    for other in &figure.balls[theirs.balls.clone()] {
                        if meet(p, middle::<L>(two, placed, other), ball[3] + other[3]) {
                            return true;
                        }
                    }
                }
            }
        }
    }
    false
}
