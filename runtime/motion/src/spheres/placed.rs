//! Where the balls of a robot are, in 64-bit floats.

use nalgebra::Point3;

use super::Figure;

/// A link, or something held, as balls somewhere.
#[derive(Clone, Debug, PartialEq)]
pub struct Placed {
    /// Index of the link, or of a held thing after the links.
    pub link: u32,
    /// A ball around all of them: middle and radius, metres.
    pub cover: (Point3<f64>, f64),
    /// Middles and radii in the world, metres.
    pub balls: Vec<(Point3<f64>, f64)>,
}

impl Figure {
    /// All balls in the world, each with its link, or the index of a held thing after the links.
    pub(super) fn balls_at(&self, q: &[f64]) -> Vec<(u32, Point3<f64>, f64)> {
        let poses = self.poses(q);
        let place = |link: &u32, round: &super::Round| {
            let pose = poses.get(self.holder(*link) as usize)?;
            Some((*link, pose * Point3::from(round.center), round.radius))
        };
        self.rounds.iter().filter_map(|(link, round)| place(link, round)).collect()
    }

    /// The robot and what it holds in the world, link by link.
    pub fn placed(&self, q: &[f64]) -> Vec<Placed> {
        let mut all: Vec<Placed> = Vec::new();
        for (link, center, radius) in self.balls_at(q) {
            match all.iter_mut().find(|p| p.link == link) {
                Some(known) => known.balls.push((center, radius)),
                None => all.push(Placed { link, cover: (center, radius), balls: vec![(center, radius)] }),
            }
        }
        for one in &mut all {
            let count = one.balls.len().max(1) as f64;
            let middle = Point3::from(one.balls.iter().map(|(c, _)| c.coords).sum::<nalgebra::Vector3<f64>>() / count);
            let reach = one.balls.iter().map(|(c, r)| (c - middle).norm() + r).fold(0.0, f64::max);
            one.cover = (middle, reach);
        }
        all
    }

    /// How many links there are; what is held is numbered after them.
    pub fn links(&self) -> usize {
        self.names.len() - self.holders.len()
    }
}
