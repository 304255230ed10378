//! Things seen from above: how far up they reach, and whether two of them share a place.

use matterix_ir::math::{cos, sin};
use matterix_ir::pose::Pose;
use matterix_ir::scene::Shape;

/// What two outlines may share without meeting, m: shapes are nominal.
const SLACK: f64 = 1e-4;

/// An upright prism around a piece of a thing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outline {
    /// Its middle, m.
    middle: [f64; 2],
    /// Its own x axis.
    axis: [f64; 2],
    /// Half its extent along its own axes, m; the radius where it is round.
    half: [f64; 2],
    round: bool,
    /// Its foot and its top, m.
    pub height: [f64; 2],
}

impl Outline {
    /// A shape as it stands; one that leans, by the box around it.
    pub fn of(shape: &Shape, at: &Pose) -> Self {
        let [x, y, z] = shape.size();
        let corners: Vec<[f64; 3]> = (0..8u8)
            .map(|k| {
                let side = |bit: u8, half: f64| if k & bit == 0 { -half } else { half };
                at.point([side(1, x / 2.0), side(2, y / 2.0), if k & 4 == 0 { 0.0 } else { z }])
            })
            .collect();
        let reach = |k: usize| {
            let all = corners.iter().map(|c| c[k]);
            [all.clone().fold(f64::INFINITY, f64::min), all.fold(f64::NEG_INFINITY, f64::max)]
        };
        let height = reach(2);
        let up = at.point([0.0, 0.0, 1.0])[2] - at.position[2];
        if up.abs() < 1.0 - 1e-9 {
            let (x, y) = (reach(0), reach(1));
            let middle = [(x[0] + x[1]) / 2.0, (y[0] + y[1]) / 2.0];
            let half = [(x[1] - x[0]) / 2.0, (y[1] - y[0]) / 2.0];
            return Outline { middle, axis: [1.0, 0.0], half, round: false, height };
        }
        let ahead = at.point([1.0, 0.0, 0.0]);
        let axis = [ahead[0] - at.position[0], ahead[1] - at.position[1]];
        let middle = [at.position[0], at.position[1]];
        Outline { middle, axis, half: [x / 2.0, y / 2.0], round: shape.is_round(), height }
    }

    /// A ball.
    pub fn ball(middle: [f64; 3], radius: f64) -> Self {
        Outline {
            middle: [middle[0], middle[1]],
            axis: [1.0, 0.0],
            half: [radius; 2],
            round: true,
            height: [middle[2] - radius, middle[2] + radius],
        }
    }

    /// Shifted and turned about a point, m and rad.
    pub fn moved(&self, about: [f64; 2], shift: [f64; 2], turn: f64) -> Self {
        let (s, c) = (sin(turn), cos(turn));
        let turned = |[x, y]: [f64; 2]| [c * x - s * y, s * x + c * y];
        let arm = turned([self.middle[0] - about[0], self.middle[1] - about[1]]);
        let middle = [about[0] + arm[0] + shift[0], about[1] + arm[1] + shift[1]];
        Outline { middle, axis: turned(self.axis), ..*self }
    }

    /// Whether two share a place.
    pub fn meets(&self, other: &Outline) -> bool {
        let over = |a: &Outline, b: &Outline| a.height[0] + SLACK < b.height[1];
        over(self, other) && over(other, self) && self.apart(other) < -SLACK
    }

    /// Whether one point is in it.
    pub fn holds(&self, point: [f64; 2]) -> bool {
        let [x, y] = self.seen(point);
        if self.round { x.hypot(y) <= self.half[0] + SLACK } else { self.within(x, y) }
    }

    /// Whether all of another is in it, seen from above.
    pub fn covers(&self, other: &Outline) -> bool {
        if other.round && self.round {
            let [x, y] = self.seen(other.middle);
            return x.hypot(y) + other.half[0] <= self.half[0] + SLACK;
        }
        if other.round {
            let [x, y] = self.seen(other.middle);
            return self.within(x.abs() + other.half[0], y.abs() + other.half[0]);
        }
        other.corners().into_iter().all(|corner| self.holds(corner))
    }

    fn within(&self, x: f64, y: f64) -> bool {
        x.abs() <= self.half[0] + SLACK && y.abs() <= self.half[1] + SLACK
    }

    /// A point along its own axes.
    fn seen(&self, point: [f64; 2]) -> [f64; 2] {
        let [x, y] = [point[0] - self.middle[0], point[1] - self.middle[1]];
        let [c, s] = self.axis;
        [c * x + s * y, c * y - s * x]
    }

    fn corners(&self) -> [[f64; 2]; 4] {
        let [c, s] = self.axis;
        [[1.0, 1.0], [1.0, -1.0], [-1.0, -1.0], [-1.0, 1.0]].map(|[i, j]| {
            let (x, y) = (i * self.half[0], j * self.half[1]);
            [self.middle[0] + c * x - s * y, self.middle[1] + s * x + c * y]
        })
    }

    /// How far two are apart along the line that parts them best, m; below 0 where none does.
    pub fn apart(&self, other: &Outline) -> f64 {
        match (self.round, other.round) {
            (true, true) => {
                let [x, y] = [other.middle[0] - self.middle[0], other.middle[1] - self.middle[1]];
                x.hypot(y) - self.half[0] - other.half[0]
            }
            (true, false) => other.apart(self),
            (false, true) => {
                let [x, y] = self.seen(other.middle);
                let out = [x.abs() - self.half[0], y.abs() - self.half[1]];
                let outside = out[0].max(0.0).hypot(out[1].max(0.0));
                outside + out[0].max(out[1]).min(0.0) - other.half[0]
            }
            (false, false) => self.gap(other).max(other.gap(self)),
        }
    }

    /// How far the corners of another rectangle stay out of this one, along its axes.
    fn gap(&self, other: &Outline) -> f64 {
        let seen = other.corners().map(|corner| self.seen(corner));
        let along = |k: usize| {
            let least = seen.iter().map(|p| p[k]).fold(f64::INFINITY, f64::min);
            let most = seen.iter().map(|p| p[k]).fold(f64::NEG_INFINITY, f64::max);
            (least - self.half[k]).max(-self.half[k] - most)
        };
        along(0).max(along(1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn boxed(x: f64, y: f64, yaw: f64) -> Outline {
        Outline::of(&Shape::Box([0.2, 0.1, 0.1]), &Pose::turned([x, y, 0.0], [0.0, 0.0, yaw]))
    }

    fn round(x: f64, y: f64) -> Outline {
        Outline::of(&Shape::Cylinder([0.1, 0.1]), &Pose::at([x, y, 0.0]))
    }

    #[test]
    fn outlines_meet_where_their_shapes_do() {
        assert!(boxed(0.0, 0.0, 0.0).meets(&boxed(0.19, 0.0, 0.0)));
        assert!(!boxed(0.0, 0.0, 0.0).meets(&boxed(0.2, 0.0, 0.0)));
        // Turned by 45 degrees, its corner reaches 0.106 m.
        assert!(boxed(0.0, 0.0, 0.0).meets(&boxed(0.0, 0.15, std::f64::consts::FRAC_PI_4)));
        assert!(!boxed(0.0, 0.0, 0.0).meets(&boxed(0.0, 0.16, std::f64::consts::FRAC_PI_4)));
        assert!(round(0.0, 0.0).meets(&round(0.09, 0.0)) && !round(0.0, 0.0).meets(&round(0.08, 0.07)));
        assert!(boxed(0.0, 0.0, 0.0).meets(&round(0.13, 0.08)) && !boxed(0.0, 0.0, 0.0).meets(&round(0.14, 0.09)));
    }

    #[test]
    fn what_is_above_does_not_meet_what_is_below() {
        let above = Outline::of(&Shape::Cylinder([0.1, 0.1]), &Pose::at([0.0, 0.0, 0.1]));
        assert!(!round(0.0, 0.0).meets(&above));
    }

    #[test]
    fn an_outline_covers_what_stands_on_it() {
        let table = Outline::of(&Shape::Box([1.0, 0.5, 0.1]), &Pose::IDENTITY);
        assert!(table.covers(&boxed(0.4, 0.0, 0.0)) && !table.covers(&boxed(0.41, 0.0, 0.0)));
        assert!(table.covers(&round(0.45, 0.2)) && !table.covers(&round(0.45, 0.21)));
        let turned = boxed(0.0, 0.0, 0.0).moved([0.0, 0.0], [0.44, 0.0], std::f64::consts::FRAC_PI_2);
        assert!(table.covers(&turned));
    }
}
