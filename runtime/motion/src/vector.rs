//! Vectors in eight configurations at once.

use std::ops::Sub;

use crate::lanes::{Lanes, Row};

/// Three coordinates.
#[derive(Clone, Copy)]
pub(crate) struct Vector<L> {
    pub x: L,
    pub y: L,
    pub z: L,
}

impl<L: Lanes> Vector<L> {
    /// The same vector in all lanes.
    #[inline(always)]
    pub fn splat(v: [f32; 3]) -> Self {
        Self { x: L::splat(v[0]), y: L::splat(v[1]), z: L::splat(v[2]) }
    }

    /// From memory.
    #[inline(always)]
    pub fn load(rows: &[Row; 3]) -> Self {
        Self { x: L::load(&rows[0]), y: L::load(&rows[1]), z: L::load(&rows[2]) }
    }

    /// To memory.
    #[inline(always)]
    pub fn store(self, rows: &mut [Row; 3]) {
        self.x.store(&mut rows[0]);
        self.y.store(&mut rows[1]);
        self.z.store(&mut rows[2]);
    }

    /// `self * s + b`.
    #[inline(always)]
    pub fn scaled_plus(self, s: L, b: Self) -> Self {
        Self { x: self.x.mul_add(s, b.x), y: self.y.mul_add(s, b.y), z: self.z.mul_add(s, b.z) }
    }

    /// `self * s`.
    #[inline(always)]
    pub fn scaled(self, s: L) -> Self {
        Self { x: self.x * s, y: self.y * s, z: self.z * s }
    }

    /// The other way round.
    #[inline(always)]
    pub fn opposite(self) -> Self {
        Self { x: -self.x, y: -self.y, z: -self.z }
    }

    /// The component along a vector.
    #[inline(always)]
    pub fn dot(self, v: [f32; 3]) -> L {
        self.x.mul_add(L::splat(v[0]), self.y.mul_add(L::splat(v[1]), self.z * L::splat(v[2])))
    }

    /// The squared length.
    #[inline(always)]
    pub fn square(self) -> L {
        self.x.mul_add(self.x, self.y.mul_add(self.y, self.z * self.z))
    }
}

impl<L: Lanes> Sub for Vector<L> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self { x: self.x - other.x, y: self.y - other.y, z: self.z - other.z }
    }
}

/// A frame: its axes and its origin.
#[derive(Clone, Copy)]
pub(crate) struct Axes<L> {
    pub x: Vector<L>,
    pub y: Vector<L>,
    pub z: Vector<L>,
    pub at: Vector<L>,
}

/// A frame in memory.
pub(crate) type Placed = [[Row; 3]; 4];

impl<L: Lanes> Axes<L> {
    /// From memory.
    #[inline(always)]
    pub fn load(p: &Placed) -> Self {
        Self { x: Vector::load(&p[0]), y: Vector::load(&p[1]), z: Vector::load(&p[2]), at: Vector::load(&p[3]) }
    }

    /// A vector given in these axes.
    #[inline(always)]
    pub fn vector(&self, v: [f32; 3]) -> Vector<L> {
        let last = self.z.scaled(L::splat(v[2]));
        self.x.scaled_plus(L::splat(v[0]), self.y.scaled_plus(L::splat(v[1]), last))
    }

    /// A point given in this frame.
    #[inline(always)]
    pub fn point(&self, c: [f32; 3]) -> Vector<L> {
        let last = self.z.scaled_plus(L::splat(c[2]), self.at);
        self.x.scaled_plus(L::splat(c[0]), self.y.scaled_plus(L::splat(c[1]), last))
    }
}
