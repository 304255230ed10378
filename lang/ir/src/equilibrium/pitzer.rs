//! Activity coefficients by what each pair and each three of what is dissolved do to each other (Pitzer, J. Phys. Chem. 77 (1973) 268;
//! Harvie, Moller and Weare, Geochim. Cosmochim. Acta 48 (1984) 723).
//!
//! All follows from one function, the excess Gibbs energy per R T and kg of solvent, of molalities m, ionic strength I and
//! `Z = sum of m |z|`:
//!
//! ```text
//! g = -4 A I / b ln(1 + b sqrt I)
//!   + sum over pairs of opposite charge  m m (2 B(I) + Z C)     B = b0 + b1 h(a1 sqrt I) + b2 h(a2 sqrt I)
//!   + sum over pairs of like charge      2 m m (theta + E(I))
//!   + sum over pairs with a neutral one  2 m m lambda
//!   + sum over threes                    m m m psi
//! ```
//!
//! with `C = C0 / (2 sqrt |z z|)`, `h(x) = 2 (1 - (1 + x) exp(-x)) / x^2`, and E what electrostatics adds between different charges
//! (`mixing`). Then `ln gamma_i = dg/dm_i + z_i^2 / 2 dg/dI`, and the logarithm of the activity of the solvent is that of a dilute solution
//! with `W = sum of m_i dg/dm_i + I dg/dI - g` added to the molality of all. Each molality is an unknown of its own, so that everything
//! here is explicit; the ionic strength is that of these molalities, for the law makes no sense with another one.

use serde::{Deserialize, Serialize};

use super::linear::Matrix;
use super::solve::LN_10;
use super::{Phase, Written, mixing};
use crate::math;

/// An ionic strength below this, mol/kg, changes nothing.
const LEAST: f64 = 1e-16;

/// What two or three dissolved members do to each other.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Interaction {
    /// Two or three members.
    pub members: Vec<usize>,
    /// How fast the two numbers that follow the ionic strength fade with its root, (kg/mol)^0.5; of a pair of opposite charges.
    pub reach: [f64; 2],
}

/// The law of Pitzer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Interactions {
    /// `b` of the term of Debye and Hueckel, (kg/mol)^0.5.
    pub spread: f64,
    /// Who acts on whom.
    pub each: Vec<Interaction>,
}

/// What a pair or three are to each other.
#[derive(Clone, Copy, Debug)]
enum Kind {
    /// Of opposite charges; C is `C0` times the last number.
    Opposite {
        of: [usize; 2],
        reach: [f64; 2],
        factor: f64,
    },
    /// Of like charges, or one without any; one with itself counts once, not twice.
    Pair {
        of: [usize; 2],
        twice: f64,
    },
    Three([usize; 3]),
}

impl Kind {
    /// How many numbers it has: b0, b1, b2 and C0, or a single one.
    fn numbers(self) -> usize {
        if matches!(self, Kind::Opposite { .. }) { 4 } else { 1 }
    }
}

/// The law of Pitzer for the members of a system.
#[derive(Clone, Debug)]
pub(super) struct Virial {
    spread: f64,
    /// Members whose molalities are unknowns: all ions, and what else acts on something.
    pub(super) placed: Vec<usize>,
    /// By member: its number among these.
    place_of: Vec<Option<usize>>,
    charges: Vec<f64>,
    kinds: Vec<Kind>,
    /// By kind: its first number.
    first: Vec<usize>,
    /// How many numbers there are.
    count: usize,
    /// Charges that occur, and by placed member which it has.
    classes: Vec<f64>,
    class_of: Vec<usize>,
}

/// What molalities make of activity coefficients, by placed member.
#[derive(Clone, Debug, Default)]
pub(super) struct Effects {
    pub(super) ln: Vec<f64>,
    /// By the molality of each.
    pub(super) by: Matrix,
    /// What is added to the molality of all in the activity of the solvent, mol/kg.
    pub(super) osmotic: f64,
    pub(super) osmotic_by: Vec<f64>,
    /// How the derivatives of g by molalities grow with ionic strength.
    by_strength: Vec<f64>,
}

/// How they move along a direction of the numbers and of A, all else the same.
#[derive(Clone, Debug, Default)]
pub(super) struct Turn {
    pub(super) ln: Vec<f64>,
    pub(super) osmotic: f64,
}

/// Where a mixture is: A of log10, molalities of placed members, and their ionic strength.
#[derive(Clone, Copy)]
pub(super) struct At<'a> {
    a: f64,
    strength: f64,
    molalities: &'a [f64],
}

impl At<'_> {
    /// That of the osmotic coefficient.
    fn slope(&self) -> f64 {
        self.a * LN_10 / 3.0
    }
}

impl Virial {
    pub(super) fn of(written: &Written) -> Option<Virial> {
        let Interactions { spread, each } = written.interactions.as_ref()?;
        let is_solute = |i: usize| written.members[i].phase == Phase::Solute;
        let acts = |i: usize| written.members[i].charge != 0.0 || each.iter().any(|e| e.members.contains(&i));
        let placed: Vec<usize> = (0..written.members.len()).filter(|i| is_solute(*i) && acts(*i)).collect();
        let charges: Vec<f64> = placed.iter().map(|i| written.members[*i].charge).collect();
        let place = |i: &usize| placed.iter().position(|p| p == i);
        let (mut kinds, mut first, mut count) = (Vec::new(), Vec::new(), 0);
        for interaction in each {
            let of: Vec<usize> = interaction.members.iter().map(place).collect::<Option<_>>()?;
            let kind = match *of.as_slice() {
                [a, b] if charges[a] * charges[b] < 0.0 => Kind::Opposite {
                    of: [a, b],
                    reach: interaction.reach,
                    factor: 0.5 / (charges[a] * charges[b]).abs().sqrt(),
                },
                [a, b] => Kind::Pair { of: [a, b], twice: if a == b { 1.0 } else { 2.0 } },
                [a, b, c] => Kind::Three([a, b, c]),
                _ => return None,
            };
            first.push(count);
            count += kind.numbers();
            kinds.push(kind);
        }
        let mut classes: Vec<f64> = charges.iter().copied().filter(|z| *z != 0.0).collect();
        classes.sort_by(f64::total_cmp);
        classes.dedup();
        // What has no charge is of none.
        let class_of = charges.iter().map(|z| classes.iter().position(|c| c == z).unwrap_or(usize::MAX)).collect();
        let place_of = (0..written.members.len()).map(|i| place(&i)).collect();
        Some(Virial { spread: *spread, placed, place_of, charges, kinds, first, count, classes, class_of })
    }

    /// How many numbers it takes.
    pub(super) fn count(&self) -> usize {
        self.count
    }

    /// Where a member stands among those that are placed.
    pub(super) fn place(&self, member: usize) -> Option<usize> {
        self.place_of[member]
    }

    /// Where a mixture is, by A and molalities.
    pub(super) fn at<'m>(&self, a: f64, molalities: &'m [f64]) -> At<'m> {
        let strength: f64 = molalities.iter().zip(&self.charges).map(|(m, z)| 0.5 * m * z * z).sum();
        At { a, strength: strength.max(LEAST), molalities }
    }

    /// Coefficients and how they move with molalities.
    pub(super) fn effects(&self, at: At<'_>, numbers: &[f64], to: &mut Effects) {
        let (count, m) = (self.placed.len(), at.molalities);
        to.clear(count);
        let (value, mut by_i, mut by_i2) = self.debye_hueckel(at.slope(), at.strength);
        let mut g = value;
        let all_charges: f64 = m.iter().zip(&self.charges).map(|(m, z)| m * z.abs()).sum();
        // The sum of m m C, and how it grows with each molality.
        let mut crowd = 0.0;
        let mut crowd_by = vec![0.0; count];
        for (kind, first) in self.kinds.iter().zip(&self.first) {
            match *kind {
                Kind::Opposite { of: [a, b], reach, factor } => {
                    let l = fading(&numbers[*first..], reach, at.strength);
                    let c = numbers[first + 3] * factor;
                    let both = m[a] * m[b];
                    g += 2.0 * both * l[0];
                    to.pair([a, b], m, [2.0 * l[0], 2.0 * l[1]]);
                    by_i += 2.0 * both * l[1];
                    by_i2 += 2.0 * both * l[2];
                    crowd += both * c;
                    crowd_by[a] += m[b] * c;
                    crowd_by[b] += m[a] * c;
                    *to.by.at(a, b) += all_charges * c;
                    *to.by.at(b, a) += all_charges * c;
                }
                Kind::Pair { of: [a, b], twice } => {
                    let l = twice * numbers[*first];
                    g += m[a] * m[b] * l;
                    to.pair([a, b], m, [l, 0.0]);
                }
                Kind::Three([a, b, c]) => {
                    let l = numbers[*first];
                    g += m[a] * m[b] * m[c] * l;
                    for [i, j, k] in [[a, b, c], [b, c, a], [c, a, b]] {
                        to.ln[i] += m[j] * m[k] * l;
                        *to.by.at(i, j) += m[k] * l;
                        *to.by.at(j, i) += m[k] * l;
                    }
                }
            }
        }
        for i in 0..count {
            let z = self.charges[i].abs();
            to.ln[i] += all_charges * crowd_by[i] + z * crowd;
            for j in 0..count {
                *to.by.at(i, j) += z * crowd_by[j] + self.charges[j].abs() * crowd_by[i];
            }
        }
        g += all_charges * crowd;
        for (p, q, [e, slope, bend]) in self.unlike(at) {
            let [of_p, of_q] = [p, q].map(|class| self.held(class, m));
            g += 2.0 * of_p * of_q * e;
            by_i += 2.0 * of_p * of_q * slope;
            by_i2 += 2.0 * of_p * of_q * bend;
            for i in 0..count {
                let (other, held) = match self.class_of[i] {
                    class if class == p => (q, of_q),
                    class if class == q => (p, of_p),
                    _ => continue,
                };
                to.ln[i] += 2.0 * held * e;
                to.by_strength[i] += 2.0 * held * slope;
                (0..count).filter(|j| self.class_of[*j] == other).for_each(|j| *to.by.at(i, j) += 2.0 * e);
            }
        }
        // Up to here all of it is of g by molalities alone.
        let along: f64 = m.iter().zip(&to.ln).map(|(m, of)| m * of).sum();
        to.osmotic = along + at.strength * by_i - g;
        let half = |i: usize| 0.5 * self.charges[i] * self.charges[i];
        let osmotic_by_i = m.iter().zip(&to.by_strength).map(|(m, of)| m * of).sum::<f64>() + at.strength * by_i2;
        to.osmotic_by.clear();
        for j in 0..count {
            let along: f64 = (0..count).map(|i| m[i] * *to.by.at(i, j)).sum();
            to.osmotic_by.push(along + at.strength * to.by_strength[j] + half(j) * osmotic_by_i);
        }
        for i in 0..count {
            to.ln[i] += half(i) * by_i;
            for j in 0..count {
                *to.by.at(i, j) += half(i) * to.by_strength[j] + half(j) * (to.by_strength[i] + half(i) * by_i2);
            }
        }
    }

    /// How the coefficients turn as numbers move so, and A by so much.
    pub(super) fn turn(&self, at: At<'_>, numbers: &[f64], a: f64) -> Turn {
        let (count, m) = (self.placed.len(), at.molalities);
        let mut ln = vec![0.0; count];
        let (mut g, mut by_i) = (0.0, 0.0);
        let all_charges: f64 = m.iter().zip(&self.charges).map(|(m, z)| m * z.abs()).sum();
        for (kind, first) in self.kinds.iter().zip(&self.first) {
            match *kind {
                Kind::Opposite { of: [a, b], reach, factor }
                    if numbers[*first..first + 4].iter().any(|n| *n != 0.0) =>
                {
                    let l = fading(&numbers[*first..], reach, at.strength);
                    let c = numbers[first + 3] * factor;
                    let (both, pair) = (m[a] * m[b], 2.0 * l[0] + all_charges * c);
                    g += both * pair;
                    by_i += 2.0 * both * l[1];
                    ln[a] += m[b] * pair;
                    ln[b] += m[a] * pair;
                    ln.iter_mut().zip(&self.charges).for_each(|(ln, z)| *ln += z.abs() * both * c);
                }
                Kind::Opposite { .. } => {}
                Kind::Pair { of: [a, b], twice } => {
                    let l = twice * numbers[*first];
                    g += m[a] * m[b] * l;
                    ln[a] += m[b] * l;
                    ln[b] += m[a] * l;
                }
                Kind::Three([a, b, c]) => {
                    let l = numbers[*first];
                    g += m[a] * m[b] * m[c] * l;
                    for [i, j, k] in [[a, b, c], [b, c, a], [c, a, b]] {
                        ln[i] += m[j] * m[k] * l;
                    }
                }
            }
        }
        if a != 0.0 {
            let (value, slope, _) = self.debye_hueckel(a * LN_10 / 3.0, at.strength);
            g += value;
            by_i += slope;
            for (p, q, [e, slope]) in self.unlike_by_a(at, a) {
                let [of_p, of_q] = [p, q].map(|class| self.held(class, m));
                g += 2.0 * of_p * of_q * e;
                by_i += 2.0 * of_p * of_q * slope;
                for (ln, class) in ln.iter_mut().zip(&self.class_of) {
                    *ln += 2.0
                        * e
                        * if *class == p {
                            of_q
                        } else if *class == q {
                            of_p
                        } else {
                            0.0
                        };
                }
            }
        }
        let along: f64 = m.iter().zip(&ln).map(|(m, of)| m * of).sum();
        ln.iter_mut().zip(&self.charges).for_each(|(ln, z)| *ln += 0.5 * z * z * by_i);
        Turn { ln, osmotic: along + at.strength * by_i - g }
    }

    /// The turn by one of its numbers.
    pub(super) fn turn_by(&self, at: At<'_>, number: usize, by: f64) -> Turn {
        let mut numbers = vec![0.0; self.count()];
        numbers[number] = by;
        self.turn(at, &numbers, 0.0)
    }

    /// The term of Debye and Hueckel, and its first two derivatives by ionic strength.
    fn debye_hueckel(&self, slope: f64, strength: f64) -> (f64, f64, f64) {
        let (b, root) = (self.spread, strength.sqrt());
        let (under, ln) = (1.0 + b * root, math::ln(1.0 + b * root));
        let value = -4.0 * slope * strength / b * ln;
        let by = -2.0 * slope * (root / under + 2.0 / b * ln);
        (value, by, -slope / root * (1.0 / (under * under) + 2.0 / under))
    }

    /// The molality of all with one of the charges.
    fn held(&self, class: usize, m: &[f64]) -> f64 {
        m.iter().zip(&self.class_of).filter(|(_, of)| **of == class).map(|(m, _)| m).sum()
    }

    /// Different charges of one sign, as classes.
    fn different(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        let all = 0..self.classes.len();
        let pairs = all.clone().flat_map(move |p| (p + 1..all.end).map(move |q| (p, q)));
        pairs.filter(|(p, q)| self.classes[*p] * self.classes[*q] > 0.0)
    }

    /// What electrostatics adds between different charges of one sign, and its first two derivatives by ionic strength.
    fn unlike(&self, at: At<'_>) -> impl Iterator<Item = (usize, usize, [f64; 3])> + '_ {
        let (slope, strength) = (at.slope(), at.strength);
        self.different().map(move |(p, q)| {
            let (product, [sum, by, bend]) = self.integrals(p, q, slope, strength);
            let (a, b) = (product / (4.0 * strength), 1.0 / strength);
            let first = 0.5 * by * b;
            let second = 0.25 * (bend - by) * b * b;
            (p, q, [a * sum, a * (first - sum * b), a * (second - 2.0 * first * b + 2.0 * sum * b * b)])
        })
    }

    /// The same by A: itself, and its derivative by ionic strength.
    fn unlike_by_a(&self, at: At<'_>, by_a: f64) -> impl Iterator<Item = (usize, usize, [f64; 2])> + '_ {
        let (slope, strength, share) = (at.slope(), at.strength, by_a / at.a);
        self.different().map(move |(p, q)| {
            let (product, [_, by, bend]) = self.integrals(p, q, slope, strength);
            let a = share * product / (4.0 * strength);
            (p, q, [a * by, a * (0.5 * (bend + by) - by) / strength])
        })
    }

    /// The product of two charges, and of `J(x_pq) - J(x_pp) / 2 - J(x_qq) / 2` itself, x times its derivative and x^2 times the second
    /// one: `x = 6 z z A sqrt I`.
    fn integrals(&self, p: usize, q: usize, slope: f64, strength: f64) -> (f64, [f64; 3]) {
        let (p, q) = (self.classes[p], self.classes[q]);
        let mut sums = [0.0; 3];
        for (product, share) in [(p * q, 1.0), (p * p, -0.5), (q * q, -0.5)] {
            let x = 6.0 * product * slope * strength.sqrt();
            let [value, by, bend] = mixing::integral(x);
            sums[0] += share * value;
            sums[1] += share * by * x;
            sums[2] += share * bend * x * x;
        }
        (p * q, sums)
    }
}

impl Effects {
    fn clear(&mut self, count: usize) {
        for of in [&mut self.ln, &mut self.by_strength] {
            of.clear();
            of.resize(count, 0.0);
        }
        self.by.clear(count);
    }

    /// A pair by its factor of m m, and that by ionic strength.
    fn pair(&mut self, [a, b]: [usize; 2], m: &[f64], [l, by]: [f64; 2]) {
        self.ln[a] += m[b] * l;
        self.ln[b] += m[a] * l;
        self.by_strength[a] += m[b] * by;
        self.by_strength[b] += m[a] * by;
        *self.by.at(a, b) += l;
        *self.by.at(b, a) += l;
    }
}

/// `b0 + b1 h(a1 sqrt I) + b2 h(a2 sqrt I)` and its first two derivatives by ionic strength.
fn fading(numbers: &[f64], reach: [f64; 2], strength: f64) -> [f64; 3] {
    let mut sum = [numbers[0], 0.0, 0.0];
    for (number, reach) in numbers[1..].iter().zip(reach).filter(|(n, _)| **n != 0.0) {
        let [value, by, bend] = fade(reach * strength.sqrt());
        sum[0] += number * value;
        sum[1] += number * by / strength;
        sum[2] += number * bend / (strength * strength);
    }
    sum
}

/// `h(x) = 2 (1 - (1 + x) exp(-x)) / x^2`, I times its derivative by I and I^2 times the second one, where x grows with the root of I.
fn fade(x: f64) -> [f64; 3] {
    if x < 0.5 {
        // Their power series: what cancels in closed form is left out.
        let (mut sums, mut term) = ([1.0, 0.0, 0.0], 1.0);
        for k in 1..20 {
            let k = f64::from(k);
            term *= -x / k;
            sums[0] += term * 2.0 / (k + 2.0);
            sums[1] += term * k / (k + 2.0);
            sums[2] += term * k * (k - 2.0) / (2.0 * (k + 2.0));
        }
        return sums;
    }
    let e = math::exp(-x);
    let value = 2.0 * (1.0 - (1.0 + x) * e) / (x * x);
    [value, e - value, -0.5 * x * e - 2.0 * (e - value)]
}
