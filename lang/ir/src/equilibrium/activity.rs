//! Activity coefficients of what is dissolved, by ionic strength and temperature.

use super::Layout;
use super::solve::{LN_10, STANDARD};

/// What all coefficients of a mixture follow: `A = a0 + a1 t + a2 t^2` and `B = b0 + b1 t` with `t = T - 298.15 K`. Above an ionic
/// strength of `most`, in mol/kg, coefficients are those at `most`. Each mol/kg of what is dissolved lowers the logarithm of the activity
/// of the solvent by `lowering`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Activities {
    a: [f64; 3],
    b: [f64; 2],
    most: f64,
    pub(super) lowering: f64,
}

/// What is of one member: `log10 gamma = -A z^2 (sqrt(I) / (1 + (plain + B size) sqrt(I)) - common I) + own I`.
///
/// The laws of Debye and Hueckel, Guentelberg and Davies, that of Truesdell and Jones, and a salting out are all of this form.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coefficients {
    plain: f64,
    size: f64,
    common: f64,
    own: f64,
}

/// The natural logarithm of an activity coefficient, and its slopes by ionic strength and by temperature.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Coefficient {
    pub(super) ln: f64,
    pub(super) by_strength: f64,
    pub(super) by_warmth: f64,
}

impl Activities {
    pub(super) fn of(args: &[f64]) -> Activities {
        Activities { a: [args[0], args[1], args[2]], b: [args[3], args[4]], most: args[5], lowering: args[6] }
    }

    /// A and B, and how they grow with temperature.
    fn at(&self, temperature: f64) -> ([f64; 2], [f64; 2]) {
        let t = temperature - STANDARD;
        let [a0, a1, a2] = self.a;
        let [b0, b1] = self.b;
        ([a0 + t * (a1 + t * a2), b0 + t * b1], [a1 + 2.0 * t * a2, b1])
    }
}

/// What the coefficient of an ion is made of, at an ionic strength and a temperature.
struct Parts {
    /// Ionic strength that counts.
    strength: f64,
    a: f64,
    b: f64,
    /// How A and B grow with temperature.
    rises: [f64; 2],
    /// The denominator, `1 + (plain + B size) sqrt(I)`.
    over: f64,
    /// `sqrt(I) / over - common I`.
    shape: f64,
}

impl Coefficients {
    fn parts(&self, all: &Activities, (strength, temperature): (f64, f64)) -> Parts {
        let strength = strength.clamp(0.0, all.most);
        let ([a, b], rises) = all.at(temperature);
        let over = 1.0 + (self.plain + b * self.size) * strength.sqrt();
        Parts { strength, a, b, rises, over, shape: strength.sqrt() / over - self.common * strength }
    }

    pub(super) fn of(args: &[f64], layout: Layout, member: usize) -> Coefficients {
        let at = layout.coefficients(member);
        Coefficients { plain: args[at], size: args[at + 1], common: args[at + 2], own: args[at + 3] }
    }

    pub(super) fn coefficient(&self, all: &Activities, charge: f64, around: (f64, f64)) -> Coefficient {
        let moves = around.0 < all.most;
        let Parts { strength, a, rises: [a_rise, b_rise], over, shape, .. } = self.parts(all, around);
        let root = strength.sqrt();
        let by_root = if root == 0.0 { 0.0 } else { 0.5 / (root * over * over) };
        let square = charge * charge;
        let by_strength = -a * square * (by_root - self.common) + self.own;
        let by_size = strength / (over * over);
        Coefficient {
            ln: LN_10 * (-a * square * shape + self.own * strength),
            by_strength: if moves && strength > 0.0 { LN_10 * by_strength } else { 0.0 },
            by_warmth: LN_10 * square * (a * by_size * b_rise * self.size - a_rise * shape),
        }
    }

    /// How the logarithm grows with one of the numbers of [`Activities`].
    pub(super) fn by_common(&self, all: &Activities, charge: f64, around: (f64, f64), which: usize) -> f64 {
        let Parts { strength, a, over, shape, .. } = self.parts(all, around);
        let (by_a, by_b) = (-shape, a * self.size * strength / (over * over));
        let t = around.1 - STANDARD;
        LN_10 * charge * charge * [by_a, by_a * t, by_a * t * t, by_b, by_b * t, 0.0, 0.0][which]
    }

    /// How the logarithm grows with one of its own numbers.
    pub(super) fn by_own(&self, all: &Activities, charge: f64, around: (f64, f64), which: usize) -> f64 {
        let Parts { strength, a, b, over, .. } = self.parts(all, around);
        let by_plain = a * strength / (over * over);
        let square = charge * charge;
        LN_10 * [square * by_plain, square * by_plain * b, square * a * strength, strength][which]
    }
}
