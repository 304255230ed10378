//! The solution between two times, as a polynomial.

use super::clock::Clock;

/// Degree of the polynomial: that of the integrator's highest order.
const DEGREE: usize = 5;

/// Where the polynomial is sampled, as fractions of the interval: Chebyshev points with both ends, `(1 - cos(k pi / 5)) / 2`.
pub(super) const POINTS: [f64; DEGREE + 1] =
    [0.0, 0.095_491_502_812_526_27, 0.345_491_502_812_526_3, 0.654_508_497_187_473_7, 0.904_508_497_187_473_7, 1.0];

/// What has died out is off by this share of its largest value.
const ROUNDED: f64 = 8.0 * f64::EPSILON;

/// Barycentric weights of [`POINTS`].
const WEIGHTS: [f64; DEGREE + 1] = [0.5, -1.0, 1.0, -1.0, 1.0, -0.5];

/// The moving states from `start` to `end`, s on `clock`.
#[derive(Clone, Debug)]
pub(super) struct Dense {
    pub(super) clock: Clock,
    pub(super) start: f64,
    pub(super) end: f64,
    values: [Vec<f64>; DEGREE + 1],
    /// By moving state, how far below nothing it may come by rounding alone.
    least: Vec<f64>,
}

impl Dense {
    /// An empty interval at the lab time `time`, s.
    pub(super) fn still(time: f64, states: &[f64]) -> Self {
        let values = std::array::from_fn(|_| states.to_vec());
        let least = states.iter().map(|value| ROUNDED * value.abs()).collect();
        Dense { clock: Clock::from(time), start: 0.0, end: 0.0, values, least }
    }

    /// Notes how large the moving states have been: what has died out is known to a share of that, and would be of either sign.
    fn measure(&mut self) {
        let ends = self.least.iter_mut().zip(&self.values[DEGREE]);
        ends.for_each(|(least, value)| *least = least.max(ROUNDED * value.abs()));
    }

    /// A value of a state, by its place: nothing where only rounding puts it below.
    fn told(&self, place: usize, value: f64) -> f64 {
        if value < 0.0 && value > -self.least[place] { 0.0 } else { value }
    }

    /// Counts time from the end on; what was before is forgotten.
    pub(super) fn restart(&mut self) {
        self.clock.restart(self.end);
        self.values.swap(0, DEGREE);
        for k in 1..=DEGREE {
            let (first, rest) = self.values.split_at_mut(k);
            rest[0].copy_from_slice(&first[0]);
        }
        (self.start, self.end) = (0.0, 0.0);
    }

    /// Moves on to the interval from the old end to `end`, filling in the states there by `sample`. The old end stays a
    /// point of the new polynomial, so that the solution is continuous.
    pub(super) fn extend<E>(
        &mut self,
        end: f64,
        mut sample: impl FnMut(f64, &mut [f64]) -> Result<(), E>,
    ) -> Result<(), E> {
        self.values.swap(0, DEGREE);
        (self.start, self.end) = (self.end, end);
        for k in 1..=DEGREE {
            sample(self.time(k), &mut self.values[k])?;
        }
        self.measure();
        Ok(())
    }

    /// Moves on by `length`, s, through the states that are given at the inner points and at the end.
    pub(super) fn follow(&mut self, length: f64, states: &[Vec<f64>]) {
        self.values.swap(0, DEGREE);
        (self.start, self.end) = (self.end, self.end + length);
        self.values[1..].iter_mut().zip(states).for_each(|(value, state)| value.copy_from_slice(state));
        self.measure();
    }

    /// The moving states at the end.
    pub(super) fn last(&self) -> &[f64] {
        &self.values[DEGREE]
    }

    fn time(&self, k: usize) -> f64 {
        if k == DEGREE { self.end } else { self.start + POINTS[k] * (self.end - self.start) }
    }

    /// The inner sampling times, in order.
    pub(super) fn times(&self) -> impl Iterator<Item = f64> + '_ {
        (1..DEGREE).map(|k| self.time(k))
    }

    /// How far the curve of a state, by its place, lies from the straight line between its ends at most, and its least and greatest value; as
    /// its points show it.
    pub(super) fn bulge(&self, place: usize) -> (f64, f64, f64) {
        let at = |k: usize| self.values[k][place];
        let line = |k: usize| at(0) + POINTS[k] * (at(DEGREE) - at(0));
        (0..=DEGREE).fold((0.0, f64::INFINITY, f64::NEG_INFINITY), |(bulge, least, most): (f64, f64, f64), k| {
            (bulge.max((at(k) - line(k)).abs()), least.min(at(k)), most.max(at(k)))
        })
    }

    /// The moving states at the local `time`, s, within the interval.
    pub(super) fn at(&self, time: f64, out: &mut [f64]) {
        match self.shares(time) {
            Shares::At(k) => out.iter_mut().enumerate().for_each(|(i, out)| *out = self.told(i, self.values[k][i])),
            Shares::Of(shares) => out.iter_mut().enumerate().for_each(|(i, out)| *out = self.mixed(&shares, i)),
        }
    }

    /// Some of the moving states, by their places, at the local `time`, s.
    pub(super) fn some(&self, time: f64, places: &[u32], out: &mut [f64]) {
        let shares = self.shares(time);
        for (out, place) in out.iter_mut().zip(places) {
            *out = match &shares {
                Shares::At(k) => self.told(*place as usize, self.values[*k][*place as usize]),
                Shares::Of(shares) => self.mixed(shares, *place as usize),
            };
        }
    }

    fn mixed(&self, shares: &[f64; DEGREE + 1], place: usize) -> f64 {
        self.told(place, (0..=DEGREE).map(|k| shares[k] * self.values[k][place]).sum())
    }

    fn shares(&self, time: f64) -> Shares {
        if let Some(k) = (0..=DEGREE).rev().find(|&k| self.time(k) == time) {
            return Shares::At(k);
        }
        Shares::Of(shares((time - self.start) / (self.end - self.start)))
    }
}

/// How much of each sampled value there is in the one at a place of the interval, as a share of it.
pub(super) fn shares(place: f64) -> [f64; DEGREE + 1] {
    if let Some(k) = POINTS.iter().position(|point| *point == place) {
        return std::array::from_fn(|i| f64::from(u8::from(i == k)));
    }
    let mut shares = [0.0; DEGREE + 1];
    let mut sum = 0.0;
    for k in 0..=DEGREE {
        shares[k] = WEIGHTS[k] / (place - POINTS[k]);
        sum += shares[k];
    }
    shares.map(|share| share / sum)
}

/// What the value at some time is made of.
enum Shares {
    /// It is one of those sampled.
    At(usize),
    /// So much of each.
    Of([f64; DEGREE + 1]),
}
