//! The part of a labware definition that a lab needs, whatever format it came in.

use std::collections::BTreeMap;

use matterix_ir::{filling, scene};

use super::profile::Profile;
use crate::eval::lab::grids::Place;

/// Labware: lengths in mm, volumes in µL.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Definition {
    /// The capability that an asset has which names none itself.
    pub(super) capability: &'static str,
    /// Its own name for people; empty where it gives none.
    pub(super) title: String,
    /// Outer size left to right, front to back, bottom to top; none where it has no body.
    pub(super) size: Option<[f64; 3]>,
    /// How far the middle of its body is from the middle of the place that it stands in, to the right and to the back: what is larger
    /// than a place covers those beside it as well.
    pub(super) aside: [f64; 2],
    /// Its name space, name and version; none where it does not give them.
    pub(super) uri: Option<String>,
    /// Whether its places are tips.
    pub(super) has_tips: bool,
    /// Its places by name.
    pub(super) wells: BTreeMap<String, Well>,
}

/// How the inside of wells is known.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Shape {
    /// It is taken to be straight, as wide as its opening.
    #[default]
    Straight,
    /// By the form of its bottom and its volume: an estimate.
    Bottom,
    /// By sections.
    Sections,
}

/// A well, a tube or a tip.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Well {
    /// The middle of its bottom, seen from the middle of the place that the labware stands in.
    pub(super) at: [f64; 3],
    /// From top to bottom.
    pub(super) depth: f64,
    /// The volume it holds.
    pub(super) volume: f64,
    /// Its opening; none where it is not known.
    pub(super) opening: Option<Opening>,
    /// Its inside, if that is known.
    pub(super) inside: Option<Profile>,
    /// How that is known.
    pub(super) shape: Shape,
    /// How far the end of a tip is below the nozzle that has it.
    pub(super) reach: Option<f64>,
}

impl Well {
    /// Radius and height along its inside, mm: straight where only its opening is known.
    pub(super) fn inner_wall(&self) -> Option<Vec<[f64; 2]>> {
        match (&self.inside, self.opening) {
            (Some(inside), _) => Some(inside.points().to_vec()),
            (None, Some(Opening::Round(diameter))) => filling::inside(&scene::Shape::Cylinder([diameter, self.depth])),
            (None, Some(Opening::Square([x, y]))) => filling::inside(&scene::Shape::Box([x, y, self.depth])),
            (None, None) => None,
        }
    }
}

/// The shape of an opening.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Opening {
    /// Its diameter.
    Round(f64),
    /// Left to right and front to back.
    Square([f64; 2]),
}

impl Opening {
    /// From left to right and from front to back.
    pub(super) fn sizes(self) -> [f64; 2] {
        match self {
            Opening::Round(across) => [across; 2],
            Opening::Square(sizes) => sizes,
        }
    }
}

impl Well {
    /// Whether it is the same as another one but for its place.
    pub(super) fn is_like(&self, other: &Well) -> bool {
        Well { at: other.at, ..self.clone() } == *other
    }
}

impl Definition {
    /// The same if its sizes can be those of a thing, or in words why not.
    pub(super) fn checked(self) -> Result<Definition, String> {
        if self.size.is_some_and(|size| size.iter().any(|s| !above_nothing(*s))) {
            return Err("its outer dimensions must be above 0".into());
        }
        for (name, well) in &self.wells {
            if Place::parse(name).is_none() {
                return Err(format!("`{name}` is not the name of a well such as `A1`"));
            }
            let open = well.opening.is_none_or(|opening| opening.sizes().iter().all(|s| above_nothing(*s)));
            let known = well.at.iter().chain(&well.reach).all(|v| v.is_finite());
            if !(open && known && well.depth >= 0.0 && well.depth.is_finite() && above_nothing(well.volume)) {
                return Err(format!("the size of `{name}` must be above 0"));
            }
        }
        Ok(self)
    }
}

fn above_nothing(value: f64) -> bool {
    value > 0.0 && value.is_finite()
}
