//! Samples that fill a box evenly and in the same order every time: Halton's sequence.

const BASES: [u32; 16] = [3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37, 41, 43, 47, 53, 59];

/// How many samples are drawn before bases are passed on to the next dimension.
const TURN: usize = 1_000_000;

/// Halton's sequence in a box, each dimension with a base of its own.
#[derive(Clone, Debug)]
pub(crate) struct Halton {
    digits: Vec<Digits>,
    drawn: usize,
}

/// The sequence in one dimension: a fraction whose denominator is a power of its base.
#[derive(Clone, Copy, Debug)]
struct Digits {
    lower: f32,
    span: f32,
    base: u32,
    numerator: u32,
    /// At most the turn times the base.
    denominator: u32,
    /// The denominator's share by the base.
    tenth: u32,
    /// The span's share by the denominator.
    scale: f32,
}

impl Digits {
    fn reset(&mut self) {
        (self.numerator, self.denominator, self.tenth, self.scale) = (0, 1, 0, self.span);
    }

    #[inline]
    fn next(&mut self) -> f32 {
        let left = self.denominator - self.numerator;
        if left == 1 {
            self.tenth = self.denominator;
            self.denominator *= self.base;
            self.scale = self.span / self.denominator as f32;
            self.numerator = 1;
        } else {
            let mut y = self.tenth;
            while left <= y {
                y /= self.base;
            }
            self.numerator = (self.base + 1) * y - left;
        }
        self.numerator as f32 * self.scale + self.lower
    }
}

impl Halton {
    /// Samples between these limits; beyond sixteen dimensions bases are the odd numbers that follow.
    pub fn new(limits: &[[f64; 2]]) -> Self {
        let base = |i: usize| BASES.get(i).copied().unwrap_or(61 + 2 * (i.saturating_sub(BASES.len())) as u32);
        let digits = limits.iter().enumerate().map(|(i, l)| {
            let (lower, span) = (l[0] as f32, (l[1] - l[0]) as f32);
            Digits { lower, span, base: base(i), numerator: 0, denominator: 1, tenth: 0, scale: span }
        });
        Self { digits: digits.collect(), drawn: 0 }
    }

    /// The next sample.
    pub fn next_into(&mut self, sample: &mut [f32]) {
        self.drawn += 1;
        if self.drawn > TURN {
            self.drawn = 0;
            let first = self.digits.first().map_or(BASES[0], |d| d.base);
            for i in 0..self.digits.len() {
                self.digits[i].base = self.digits.get(i + 1).map_or(first, |d| d.base);
                self.digits[i].reset();
            }
        }
        for (value, digits) in sample.iter_mut().zip(&mut self.digits) {
            *value = digits.next();
        }
    }
}

/// How many samples are drawn once and for all.
const TABLE: usize = 4096;

/// A sequence whose first samples are kept.
#[derive(Clone, Debug)]
pub(crate) struct Samples {
    table: Vec<f32>,
    rest: Halton,
}

impl Samples {
    /// Samples between these limits.
    pub fn new(limits: &[[f64; 2]]) -> Self {
        let mut rest = Halton::new(limits);
        let mut table = vec![0.0; TABLE * limits.len()];
        for sample in table.chunks_exact_mut(limits.len().max(1)) {
            rest.next_into(sample);
        }
        Self { table, rest }
    }

    /// The sequence from its beginning.
    pub fn draw(&self) -> Draw<'_> {
        Draw { kept: &self.table, rest: self.rest.clone() }
    }
}

/// A sequence being drawn.
#[derive(Clone, Debug)]
pub(crate) struct Draw<'a> {
    kept: &'a [f32],
    rest: Halton,
}

impl Draw<'_> {
    /// The next sample.
    #[inline]
    pub fn next_into(&mut self, sample: &mut [f32]) {
        match self.kept.split_at_checked(sample.len()) {
            Some((first, kept)) => {
                sample.copy_from_slice(first);
                self.kept = kept;
            }
            None => self.rest.next_into(sample),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn starts_as_defined() {
        let mut halton = Halton::new(&[[0.0, 1.0], [0.0, 10.0]]);
        let mut drawn = Vec::new();
        let mut sample = [0.0; 2];
        for _ in 0..4 {
            halton.next_into(&mut sample);
            drawn.push(sample);
        }
        let expected = [[1.0 / 3.0, 2.0], [2.0 / 3.0, 4.0], [1.0 / 9.0, 6.0], [4.0 / 9.0, 8.0]];
        for (a, b) in drawn.iter().flatten().zip(expected.iter().flatten()) {
            assert!((a - b).abs() < 1e-6, "{drawn:?}");
        }
    }

    #[test]
    fn what_is_kept_is_what_would_be_drawn() {
        let limits = [[-1.0, 2.0]; 6];
        let (samples, mut plain) = (Samples::new(&limits), Halton::new(&limits));
        let (mut draw, mut a, mut b) = (samples.draw(), [0.0; 6], [0.0; 6]);
        for _ in 0..TABLE + 100 {
            draw.next_into(&mut a);
            plain.next_into(&mut b);
            assert_eq!(a, b);
        }
    }
}
