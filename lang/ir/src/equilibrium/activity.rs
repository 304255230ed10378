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

    /// What all coefficients share at an ionic strength, in mol/kg, and a temperature in K.
    pub(super) fn around(&self, strength: f64, temperature: f64) -> Around {
        let ([a, b], rises) = self.at(temperature);
        let (moves, strength) = (strength < self.most, strength.clamp(0.0, self.most));
        Around { moves: moves && strength > 0.0, strength, root: strength.sqrt(), a, b, rises }
    }

    /// A and B, and how they grow with temperature.
    fn at(&self, temperature: f64) -> ([f64; 2], [f64; 2]) {
        let t = temperature - STANDARD;
        let [a0, a1, a2] = self.a;
        let [b0, b1] = self.b;
        ([a0 + t * (a1 + t * a2), b0 + t * b1], [a1 + 2.0 * t * a2, b1])
    }
}

/// What all coefficients share.
#[derive(Clone, Copy)]
pub(super) struct Around {
    /// Whether coefficients move with the ionic strength.
    moves: bool,
    /// Ionic strength that counts, and its root.
    strength: f64,
    root: f64,
    pub(super) a: f64,
    b: f64,
    /// How A and B grow with temperature.
    pub(super) rises: [f64; 2],
}

impl Coefficients {
    pub(super) fn of(args: &[f64], layout: Layout, member: usize) -> Coefficients {
        let at = layout.coefficients(member);
        Coefficients { plain: args[at], size: args[at + 1], common: args[at + 2], own: args[at + 3] }
    }

    /// 1 over the denominator, `1 + (plain + B size) sqrt(I)`; and `sqrt(I) / denominator - common I`.
    fn shape(&self, around: &Around) -> (f64, f64) {
        let under = 1.0 / (1.0 + (self.plain + around.b * self.size) * around.root);
        (under, around.root * under - self.common * around.strength)
    }

    pub(super) fn coefficient(&self, around: &Around, charge: f64) -> Coefficient {
        let Around { strength, root, a, rises: [a_rise, b_rise], .. } = *around;
        let (under, shape) = self.shape(around);
        let square = charge * charge;
        let mut by_strength = 0.0;
        if around.moves {
            let by_root = 0.5 * under * under / root;
            by_strength = LN_10 * (-a * square * (by_root - self.common) + self.own);
        }
        let by_size = strength * under * under;
        Coefficient {
            ln: LN_10 * (-a * square * shape + self.own * strength),
            by_strength,
            by_warmth: LN_10 * square * (a * by_size * b_rise * self.size - a_rise * shape),
        }
    }

    /// How the logarithm grows with one of the numbers of [`Activities`].
    pub(super) fn by_common(&self, around: &Around, charge: f64, t: f64, which: usize) -> f64 {
        let (under, shape) = self.shape(around);
        let (by_a, by_b) = (-shape, around.a * self.size * around.strength * under * under);
        LN_10 * charge * charge * [by_a, by_a * t, by_a * t * t, by_b, by_b * t, 0.0, 0.0][which]
    }

    /// How the logarithm grows with one of its own numbers.
    pub(super) fn by_own(&self, around: &Around, charge: f64, which: usize) -> f64 {
        let (under, _) = self.shape(around);
        let by_plain = around.a * around.strength * under * under;
        let square = charge * charge;
        LN_10
            * [square * by_plain, square * by_plain * around.b, square * around.a * around.strength, around.strength]
                [which]
    }
}
