//! Mass and its distribution: of bodies of one density from their shapes, and what of given ones cannot be.

use std::collections::BTreeSet;
use std::f64::consts::PI;

use crate::mesh::Mesh;
use crate::pose::Pose;
use crate::robot::Inertial;
use crate::scene::Shape;

/// Rounding that is allowed where a moment is compared with what it cannot be, as a share of the sum of all.
const ROUNDING: f64 = 1e-6;

/// Volume and its first and second moments, m3 to m5.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Moments {
    volume: f64,
    first: [f64; 3],
    second: [[f64; 3]; 3],
}

impl Moments {
    /// A volume about its own middle, its second moments along the axes, brought to a point.
    fn about(volume: f64, second: [f64; 3], middle: [f64; 3]) -> Self {
        let own = |i: usize, j: usize| if i == j { second[i] } else { 0.0 };
        Moments {
            volume,
            first: middle.map(|m| volume * m),
            second: square(|i, j| own(i, j) + volume * middle[i] * middle[j]),
        }
    }

    fn plus(self, other: Moments, sign: f64) -> Self {
        Moments {
            volume: self.volume + sign * other.volume,
            first: [0, 1, 2].map(|k| self.first[k] + sign * other.first[k]),
            second: square(|i, j| self.second[i][j] + sign * other.second[i][j]),
        }
    }

    /// The same volume where its frame stands like this.
    fn moved(self, at: Pose) -> Self {
        let axes = rotation(at);
        let turned: [f64; 3] = [0, 1, 2].map(|i| (0..3).map(|k| axes[i][k] * self.first[k]).sum());
        let spread = |i: usize, j: usize| -> f64 {
            let products = (0..3).flat_map(|k| (0..3).map(move |l| (k, l)));
            products.map(|(k, l)| axes[i][k] * self.second[k][l] * axes[j][l]).sum()
        };
        let p = at.position;
        Moments {
            volume: self.volume,
            first: [0, 1, 2].map(|k| turned[k] + self.volume * p[k]),
            second: square(|i, j| spread(i, j) + p[i] * turned[j] + turned[i] * p[j] + self.volume * p[i] * p[j]),
        }
    }

    /// Of a shape, its origin at the middle of its base; none of a mesh that is not closed.
    fn of(shape: &Shape) -> Option<Self> {
        Some(match shape {
            Shape::Box(size) => {
                let volume = size.iter().product::<f64>();
                Moments::about(volume, size.map(|s| volume * s * s / 12.0), [0.0, 0.0, size[2] / 2.0])
            }
            Shape::Cylinder([d, h]) => {
                let (across, volume) = (d * d / 4.0, PI * d * d / 4.0 * h);
                let second = [volume * across / 4.0, volume * across / 4.0, volume * h * h / 12.0];
                Moments::about(volume, second, [0.0, 0.0, h / 2.0])
            }
            Shape::Sphere(d) => {
                let volume = PI * d * d * d / 6.0;
                Moments::about(volume, [volume * d * d / 20.0; 3], [0.0, 0.0, d / 2.0])
            }
            Shape::Turned { outside, inside } => turned(outside).plus(turned(inside), -1.0),
            Shape::Mesh(mesh) => meshed(mesh)?,
        })
    }
}

/// What is within an outline of radii and heights, turned about the axis.
fn turned(outline: &[[f64; 2]]) -> Moments {
    // Gauss' points and weights for three points: exact, as no power of the height is above the fifth.
    let (far, side, middle) = (0.6f64.sqrt() / 2.0, 5.0 / 18.0, 8.0 / 18.0);
    let mut out = Moments::default();
    for step in outline.windows(2) {
        let ([r0, z0], [r1, z1]) = (step[0], step[1]);
        for (share, weight) in [(0.5 - far, side), (0.5, middle), (0.5 + far, side)] {
            let (r, z) = (r0 + (r1 - r0) * share, z0 + (z1 - z0) * share);
            let slice = PI * r * r * weight * (z1 - z0);
            out = out.plus(Moments::about(slice, [slice * r * r / 4.0, slice * r * r / 4.0, 0.0], [0.0, 0.0, z]), 1.0);
        }
    }
    out
}

/// What is within triangles, as tetrahedra from the origin; none where an edge has triangles on one side only.
fn meshed(mesh: &Mesh) -> Option<Moments> {
    let corner = |i: u32| mesh.points.get(i as usize).map(|p| p.map(|v| (v + 0.0).to_bits()));
    let mut open: BTreeSet<_> = BTreeSet::new();
    for [a, b, c] in &mesh.triangles {
        for (from, to) in [(a, b), (b, c), (c, a)] {
            let (from, to) = (corner(*from)?, corner(*to)?);
            if !open.remove(&(to, from)) && !open.insert((from, to)) {
                return None;
            }
        }
    }
    let mut out = Moments::default();
    for triangle in mesh.triangles.iter().filter(|_| open.is_empty()) {
        let [a, b, c] = triangle.map(|i| mesh.points[i as usize]);
        let sixfold = a[0] * (b[1] * c[2] - b[2] * c[1])
            + a[1] * (b[2] * c[0] - b[0] * c[2])
            + a[2] * (b[0] * c[1] - b[1] * c[0]);
        let sum = [0, 1, 2].map(|k| a[k] + b[k] + c[k]);
        let products = |i: usize, j: usize| [a, b, c, sum].iter().map(|p| p[i] * p[j]).sum::<f64>();
        let one = Moments {
            volume: sixfold / 6.0,
            first: sum.map(|s| sixfold / 24.0 * s),
            second: square(|i, j| sixfold / 120.0 * products(i, j)),
        };
        out = out.plus(one, 1.0);
    }
    // Triangles may be turned inside out.
    let out = if out.volume < 0.0 { Moments::default().plus(out, -1.0) } else { out };
    (out.volume > 0.0).then_some(out)
}

/// Mass and inertia of a body of one density in these shapes; where they overlap they count twice. None where a shape has no
/// volume that is known.
pub fn of_shapes<'s>(mass: f64, shapes: impl IntoIterator<Item = (&'s Shape, Pose)>) -> Option<Inertial> {
    let mut all = Moments::default();
    for (shape, at) in shapes {
        all = all.plus(Moments::of(shape)?.moved(at), 1.0);
    }
    if all.volume <= 0.0 || !all.volume.is_finite() {
        return None;
    }
    let centre = all.first.map(|f| f / all.volume);
    let density = mass / all.volume;
    let own = square(|i, j| density * (all.second[i][j] - all.volume * centre[i] * centre[j]));
    let sum = own[0][0] + own[1][1] + own[2][2];
    let inertia = [sum - own[0][0], -own[0][1], -own[0][2], sum - own[1][1], -own[1][2], sum - own[2][2]];
    Some(Inertial { mass, placement: Pose::at(centre), inertia })
}

/// What keeps moments (xx, xy, xz, yy, yz, zz) from being those of any body, in words; none where nothing does.
///
/// A body's second moments, half the sum of all three less the tensor, are those of matter and so nowhere below zero: from
/// that follows that the tensor is positive and that no principal moment is above the sum of the others.
pub fn impossible([xx, xy, xz, yy, yz, zz]: [f64; 6]) -> Option<&'static str> {
    let sum = xx + yy + zz;
    if [xx, yy, zz].iter().any(|m| *m <= 0.0) || !sum.is_finite() {
        return Some("a moment of inertia must be above zero");
    }
    let is_semidefinite = |m: [f64; 6], slack: f64| {
        let [a, b, c, d, e, f] = m;
        let minors = [a * d - b * b, a * f - c * c, d * f - e * e];
        let whole = a * (d * f - e * e) - b * (b * f - c * e) + c * (b * e - c * d);
        [a, d, f].iter().all(|v| *v >= -slack * sum)
            && minors.iter().all(|v| *v >= -slack * sum * sum)
            && whole >= -slack * sum * sum * sum
    };
    if !is_semidefinite([xx, xy, xz, yy, yz, zz], 0.0) {
        return Some("its products are too large for its moments: it is not positive definite");
    }
    let half = sum / 2.0;
    if !is_semidefinite([half - xx, -xy, -xz, half - yy, -yz, half - zz], ROUNDING) {
        return Some("a principal moment cannot be above the sum of the two others");
    }
    None
}

fn rotation(at: Pose) -> [[f64; 3]; 3] {
    let turn = Pose { position: [0.0; 3], ..at };
    let columns = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|axis| turn.point(axis));
    square(|i, j| columns[j][i])
}

fn square(of: impl Fn(usize, usize) -> f64) -> [[f64; 3]; 3] {
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| of(i, j)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;

    fn near(a: &[f64], b: &[f64]) -> bool {
        a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-12)
    }

    /// A box of 40 x 20 x 10 mm as triangles.
    fn block() -> Mesh {
        let corner = |i: u32| [0.04 * f64::from(i & 1), 0.02 * f64::from(i >> 1 & 1), 0.01 * f64::from(i >> 2)];
        let sides = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let halves = sides.iter().flat_map(|s| [[s[0], s[1], s[2]], [s[0], s[2], s[3]]]);
        Mesh { name: "block".into(), points: (0..8).map(corner).collect(), triangles: halves.collect() }.grounded()
    }

    #[test]
    fn closed_forms_hold() {
        let of = |shape: &Shape| of_shapes(2.0, [(shape, Pose::IDENTITY)]).expect("a volume");
        let box_ = of(&Shape::Box([0.04, 0.02, 0.01]));
        let wanted = [5e-4 / 6.0, 0.0, 0.0, 1.7e-3 / 6.0, 0.0, 2e-3 / 6.0];
        assert!(near(&box_.inertia, &wanted) && near(&box_.placement.position, &[0.0, 0.0, 0.005]), "{box_:?}");
        let same = of(&Shape::Mesh(Arc::new(block())));
        assert!(near(&same.inertia, &box_.inertia) && near(&same.placement.position, &box_.placement.position));
        let (r, h) = (0.03, 0.1);
        let round = of(&Shape::Cylinder([2.0 * r, h]));
        assert!(near(&[round.inertia[5], round.inertia[0]], &[r * r, (3.0 * r * r + h * h) / 6.0]));
        let lathe = Shape::Turned { outside: vec![[0.0, 0.0], [r, 0.0], [r, h]], inside: vec![] };
        assert!(near(&of(&lathe).inertia, &round.inertia));
        // A thin shell is a tube: m r2 about its axis.
        let tube = Shape::Turned { outside: vec![[r, 0.0], [r, h]], inside: vec![[r - 1e-6, 0.0], [r - 1e-6, h]] };
        assert!((of(&tube).inertia[5] - 2.0 * r * r).abs() < 1e-6);
        let ball = of(&Shape::Sphere(0.02));
        assert!(near(&ball.inertia, &[8e-5, 0.0, 0.0, 8e-5, 0.0, 8e-5]));
    }

    #[test]
    fn turned_and_put_together_it_is_the_same_body() {
        let whole = of_shapes(1.0, [(&Shape::Box([0.04, 0.02, 0.01]), Pose::IDENTITY)]).expect("a volume");
        let half = Shape::Box([0.02, 0.02, 0.01]);
        let at = |x: f64| Pose::at([x, 0.0, 0.0]);
        let halves = of_shapes(1.0, [(&half, at(-0.01)), (&half, at(0.01))]).expect("a volume");
        assert!(near(&whole.inertia, &halves.inertia));
        let turn = Pose::turned([0.3, 0.0, 0.0], [0.0, 0.0, 0.5]);
        let [xx, xy, _, yy, ..] = of_shapes(1.0, [(&Shape::Box([0.04, 0.02, 0.01]), turn)]).expect("a volume").inertia;
        let (s, c) = (0.5f64.sin(), 0.5f64.cos());
        let [a, b] = [whole.inertia[0], whole.inertia[3]];
        assert!(near(&[xx, yy, xy], &[c * c * a + s * s * b, s * s * a + c * c * b, s * c * (a - b)]));
        let open = Mesh { triangles: block().triangles[1..].to_vec(), ..block() };
        assert_eq!(of_shapes(1.0, [(&Shape::Mesh(Arc::new(open)), Pose::IDENTITY)]), None);
    }

    #[test]
    fn what_no_body_has_is_said() {
        for (moments, said) in [
            ([1.0, 0.0, 0.0, 1.0, 0.0, 2.0], ""),
            ([1.0, 0.0, 0.0, 1.0, 0.0, 2.1], "sum"),
            ([1.0, 0.0, 0.0, 0.0, 0.0, 1.0], "above zero"),
            ([1.0, 1.5, 0.0, 1.0, 0.0, 1.0], "positive definite"),
            ([1.0, 0.6, 0.0, 1.0, 0.0, 1.0], "sum"),
        ] {
            let found = impossible(moments).unwrap_or_default();
            assert!(if said.is_empty() { found.is_empty() } else { found.contains(said) }, "{moments:?}: {found}");
        }
    }
}
