//! What collides with what, where and how deeply: exact for the balls, in 64-bit floats.

use nalgebra::Point3;

use super::Figure;
use crate::world::World;

/// What a link runs into.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Other {
    /// Index of a body of the world.
    Body(usize),
    /// Index of a link, or of a held thing after the links.
    Link(u32),
}

/// A link in something.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// Index of the link, or of a held thing after the links.
    pub link: u32,
    /// What it is in.
    pub other: Other,
    /// In the world: on the other's surface, metres.
    pub point: Point3<f64>,
    /// How far the two reach into each other; metres.
    pub depth: f64,
}

impl Figure {
    /// The deepest contact of every link with everything it must not touch, deepest first.
    pub fn contacts(&self, world: &World, q: &[f64]) -> Vec<Contact> {
        let placed = self.balls_at(q);
        let mut found: Vec<Contact> = Vec::new();
        let mut note = |contact: Contact| {
            if contact.depth <= 0.0 {
                return;
            }
            match found.iter_mut().find(|c| c.link == contact.link && c.other == contact.other) {
                Some(known) if known.depth >= contact.depth => {}
                Some(known) => *known = contact,
                None => found.push(contact),
            }
        };
        for &(link, center, radius) in &placed {
            let still = self.is_still(link);
            for (index, body) in world.bodies.iter().enumerate() {
                if still && world.beneath.contains(&index) || !body.is_within(radius, &center) {
                    continue;
                }
                let nearest = body.nearest(&center);
                let depth = radius - nearest.distance;
                note(Contact { link, other: Other::Body(index), point: nearest.point, depth });
            }
        }
        for &[a, b] in &self.apart {
            for &(_, p, r) in placed.iter().filter(|(l, ..)| *l == a) {
                for &(_, q, s) in placed.iter().filter(|(l, ..)| *l == b) {
                    let apart = (p - q).norm();
                    let point = if apart > 0.0 { q + (p - q) * (s / apart) } else { q };
                    note(Contact { link: a, other: Other::Link(b), point, depth: r + s - apart });
                }
            }
        }
        found.sort_by(|a, b| b.depth.total_cmp(&a.depth));
        found
    }
}
