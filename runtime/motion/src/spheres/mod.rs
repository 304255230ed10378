//! A robot as balls on moving frames, laid out so that eight configurations are checked at once.
//!
//! Balls are gathered by link and links by moving frame, each gathering inside a ball of its own: what the outer
//! ball does not reach, the inner ones need not be asked about.

mod check;
mod contact;
mod cover;
mod frames;
mod placed;
mod referee;

pub use check::{ASKED, Checker};
pub use contact::{Contact, Other};
pub use placed::Placed;
pub use referee::Referee;

use std::f64::consts::PI;
use std::ops::Range;
use std::sync::OnceLock;

use matterix_ir::robot::{Ball, Robot};
use nalgebra::{Point3, Vector3};

use crate::chain::Tree;
use crate::halton::Samples;
use crate::pose::Pose;
use crate::variables::{Malformed, Variable};
use cover::{Round, cover};
use frames::{Frame, Seat};

/// The balls of one link, or of something held.
#[derive(Clone, Debug)]
struct Part {
    link: u32,
    cover: [f32; 4],
    balls: Range<usize>,
}

/// The parts on one frame.
#[derive(Clone, Debug)]
struct Group {
    /// `None` for what stands still.
    frame: Option<usize>,
    cover: [f32; 4],
    parts: Range<usize>,
    /// How far it can be from its frame's anchor; metres.
    reach: f64,
}

/// Two groups of which some parts must not meet.
#[derive(Clone, Debug)]
struct Pair {
    groups: [usize; 2],
    /// Parts of the first one, each with those of the second one.
    parts: Vec<(usize, Vec<usize>)>,
}

/// Something a link holds.
#[derive(Clone, Debug, PartialEq)]
pub struct Held {
    /// What it is called when it runs into something.
    pub name: String,
    /// Index of the link that holds it.
    pub link: u32,
    /// Its balls in that link's frame: middle and radius, metres.
    pub balls: Vec<([f64; 3], f64)>,
    /// Links it may touch besides the one that holds it.
    pub touching: Vec<u32>,
}

/// A robot ready to be checked for collisions.
#[derive(Clone, Debug)]
pub struct Figure {
    tree: Tree,
    base: Pose,
    moved: Vec<usize>,
    rest: Vec<f64>,
    names: Vec<String>,
    holders: Vec<u32>,
    rounds: Vec<(u32, Round)>,
    apart: Vec<[u32; 2]>,
    limits: Vec<[f64; 2]>,
    /// Drawn when they are first asked for: what goes straight asks for none.
    samples: OnceLock<Samples>,
    frames: Vec<Frame>,
    groups: Vec<Group>,
    parts: Vec<Part>,
    balls: Vec<[f32; 4]>,
    pairs: Vec<Pair>,
    /// By link, then by held thing: whether nothing that is planned for moves it.
    still: Vec<bool>,
}

impl Figure {
    /// A robot at `base`, of which the `moved` variables of its [`Tree`] are planned for and the others stay as in
    /// `rest` (all variables, rad or m), with what it holds.
    ///
    /// # Panics
    /// If `rest` is shorter than the tree's variables or `moved` names one that does not exist.
    pub fn new(robot: &Robot, base: &Pose, moved: &[usize], rest: &[f64], held: &[Held]) -> Result<Self, Malformed> {
        let tree = Tree::new(robot)?;
        let (frames, mut seats) = frames::compile(&tree, base, moved, rest);
        let mut names: Vec<String> = robot.links.iter().map(|l| l.name.clone()).collect();
        let mut balls = robot.balls.clone();
        let mut allowed = robot.touching.clone();
        for thing in held {
            let index = names.len() as u32;
            let seat = seats.get(thing.link as usize).ok_or(Malformed::NoLink(thing.link))?.clone();
            seats.push(seat);
            names.push(thing.name.clone());
            balls.extend(thing.balls.iter().map(|&(center, radius)| Ball { link: index, center, radius }));
            allowed.extend(thing.touching.iter().chain([&thing.link]).map(|&l| [l, index]));
        }
        if let Some(stray) = balls.iter().find(|b| b.link as usize >= seats.len()) {
            return Err(Malformed::NoLink(stray.link));
        }
        let limits: Vec<[f64; 2]> =
            moved.iter().map(|&m| tree.variables()[m].limits).map(|l| [l.lower, l.upper]).collect();
        let rounds = balls.iter().map(|b| (b.link, Round { center: b.center.into(), radius: b.radius })).collect();
        let mut figure = Self {
            tree,
            base: *base,
            moved: moved.to_vec(),
            rest: rest.to_vec(),
            names,
            holders: held.iter().map(|h| h.link).collect(),
            rounds,
            apart: Vec::new(),
            samples: OnceLock::new(),
            limits,
            frames,
            still: seats.iter().map(|seat| seat.frame.is_none()).collect(),
            groups: Vec::new(),
            parts: Vec::new(),
            balls: Vec::new(),
            pairs: Vec::new(),
        };
        figure.gather(&seats);
        figure.pair(&seats, &allowed);
        Ok(figure)
    }

    /// How many variables are planned for.
    pub fn freedom(&self) -> usize {
        self.moved.len()
    }

    /// Lower and upper limits of what is planned for; rad or m.
    pub fn limits(&self) -> &[[f64; 2]] {
        &self.limits
    }

    /// Pairs of links that must not meet; held things have the indices after the links'.
    pub fn apart(&self) -> &[[u32; 2]] {
        &self.apart
    }

    /// Configurations spread over the limits.
    pub(crate) fn samples(&self) -> &Samples {
        // Of joints without end any one turn has all there is.
        const TURN: [f64; 2] = [-PI, PI];
        self.samples.get_or_init(|| {
            let bounded = |m: &usize| self.tree.variables().get(*m).is_some_and(Variable::is_bounded);
            let limits = self.moved.iter().zip(&self.limits).map(|(m, limits)| if bounded(m) { *limits } else { TURN });
            Samples::new(&limits.collect::<Vec<_>>())
        })
    }

    /// The name of a link, or of a held thing by the index that follows the links'.
    pub fn name(&self, link: u32) -> &str {
        self.names.get(link as usize).map_or("", String::as_str)
    }

    /// Whether nothing that is planned for moves a link, or a held thing by the index that follows the links'.
    pub fn is_still(&self, link: u32) -> bool {
        self.still.get(link as usize).copied().unwrap_or(false)
    }

    /// The link itself, or the one that holds the thing with this index.
    fn holder(&self, link: u32) -> u32 {
        let links = self.names.len() - self.holders.len();
        (link as usize).checked_sub(links).and_then(|h| self.holders.get(h)).copied().unwrap_or(link)
    }

    /// Puts balls into parts and parts into groups, the outermost frames first, what stands still last.
    fn gather(&mut self, seats: &[Seat]) {
        let mut order: Vec<Option<usize>> = (0..self.frames.len()).rev().map(Some).collect();
        order.push(None);
        for frame in order {
            let from = self.parts.len();
            let mut all = Vec::new();
            for (link, seat) in seats.iter().enumerate().filter(|(_, s)| s.frame == frame) {
                let placed = |r: &Round| Round { center: (seat.pose * Point3::from(r.center)).coords, ..*r };
                let here: Vec<Round> =
                    self.rounds.iter().filter(|(l, _)| *l as usize == link).map(|(_, r)| placed(r)).collect();
                if here.is_empty() {
                    continue;
                }
                let start = self.balls.len();
                self.balls.extend(here.iter().map(Round::single));
                let around = cover(&here).single();
                self.parts.push(Part { link: link as u32, cover: around, balls: start..self.balls.len() });
                all.extend(here);
            }
            if !all.is_empty() {
                let around = cover(&all);
                let reach = frame.map_or(0.0, |f| self.frames[f].reach) + around.center.norm() + around.radius;
                self.groups.push(Group { frame, cover: around.single(), parts: from..self.parts.len(), reach });
            }
        }
    }

    /// Lists what must not meet: parts on different frames whose links may not touch.
    fn pair(&mut self, seats: &[Seat], allowed: &[[u32; 2]]) {
        for a in 0..self.groups.len() {
            for b in a + 1..self.groups.len() {
                let mut parts = Vec::new();
                for i in self.groups[a].parts.clone() {
                    let mut others = Vec::new();
                    for j in self.groups[b].parts.clone() {
                        let (l, m) = (self.parts[i].link, self.parts[j].link);
                        if !allowed.contains(&[l, m]) && !allowed.contains(&[m, l]) {
                            others.push(j);
                            self.apart.push([l, m]);
                        }
                    }
                    if !others.is_empty() {
                        parts.push((i, others));
                    }
                }
                if !parts.is_empty() {
                    self.pairs.push(Pair { groups: [a, b], parts });
                }
            }
        }
        debug_assert!(self.apart.iter().all(|[a, b]| seats[*a as usize].frame != seats[*b as usize].frame));
    }

    /// The whole robot's variables with these for what is planned.
    pub fn whole(&self, q: &[f64]) -> Vec<f64> {
        let mut whole = self.rest.clone();
        for (&variable, &value) in self.moved.iter().zip(q) {
            whole[variable] = value;
        }
        whole
    }

    /// Where links are in the world, in the order of the robot's links.
    pub fn poses(&self, q: &[f64]) -> Vec<Pose> {
        self.tree.poses(&self.whole(q)).iter().map(|p| self.base * p).collect()
    }

    /// Where the anchor of a group's frame is.
    fn anchor(&self, group: &Group) -> Option<Vector3<f64>> {
        group.frame.map(|f| self.frames[f].anchor)
    }
}
