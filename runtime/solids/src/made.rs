//! What bodies are made of; tips and vials come by the dozen.

use std::borrow::Cow;

use matterix_ir::scene::{Shape, Solid};

use crate::body::Body;

/// What a body is made of.
#[derive(Clone, Debug, PartialEq)]
pub struct Made<'s> {
    /// Its main shape, if that is something to run into.
    pub main: Option<&'s Shape>,
    /// More of it.
    pub more: &'s [Solid],
    /// What its parts take out of its main shape.
    pub rooms: Cow<'s, [Solid]>,
    /// What stands for all of that, where there is anything here.
    pub collision: &'s [Solid],
}

impl Made<'_> {
    fn body(&self) -> Option<Body> {
        match self.collision {
            [] => Body::with_rooms(self.main, self.more, &self.rooms),
            pieces => Body::of_shapes(pieces.iter().map(|solid| (&solid.shape, solid.pose))),
        }
    }
}

/// Bodies, made once of the same.
#[derive(Debug, Default)]
pub struct Bodies<'s> {
    known: Vec<(Made<'s>, Option<Body>)>,
}

impl<'s> Bodies<'s> {
    /// The body made of this; none where it is made of nothing.
    pub fn body(&mut self, made: Made<'s>) -> Option<Body> {
        if let Some((_, same)) = self.known.iter().find(|(other, _)| *other == made) {
            return same.clone();
        }
        let body = made.body();
        self.known.push((made, body.clone()));
        body
    }
}
