//! One number over time, in as few points as say how it went.

/// What a recording leaves out of a curve where it is not told otherwise: see [`Series`].
pub const ERROR: f64 = 2e-3;

/// So much of the error is used up by leaving samples out; the rest is for the curve between two of them.
const THINNED: f64 = 0.9;

/// Of an error, what counts for the magnitude of a number: one that only rounds up and down spans nothing.
const OF_MAGNITUDE: f64 = 1e-6;

/// A time, s, and what a number is then.
type Point = (f64, f64);

/// A number over time: points in order of time with straight lines between them, two of one time where it jumps. A sample is
/// left out where it lies on the line, or no further from it than a fraction (the error) of what the number has spanned by then.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    error: f64,
    kept: Vec<(f64, f64)>,
    /// The last sample, where it is not kept yet.
    pending: Option<(f64, f64)>,
    /// The slopes of the lines from the last kept point that pass all samples since.
    slopes: (f64, f64),
    /// Whether all of those are equal to it.
    is_level: bool,
    /// The least and the greatest value.
    span: (f64, f64),
}

/// All slopes.
const ANY: (f64, f64) = (f64::NEG_INFINITY, f64::INFINITY);

impl Series {
    /// Without samples yet. Nothing but what lies on a line is left out with the error 0, all but the first and the last sample where it
    /// is infinite.
    pub fn new(error: f64) -> Self {
        let span = (f64::INFINITY, f64::NEG_INFINITY);
        Series { error, kept: Vec::new(), pending: None, slopes: ANY, is_level: true, span }
    }

    /// Takes a sample, no earlier than the last one.
    pub fn push(&mut self, time: f64, value: f64) {
        if value.is_finite() {
            self.span = (self.span.0.min(value), self.span.1.max(value));
        }
        let Some(&from) = self.kept.last() else { return self.keep((time, value)) };
        if self.error == f64::INFINITY {
            self.pending = Some((time, value));
            return;
        }
        let last = self.pending.unwrap_or(from);
        let is_gap = value.is_finite() != last.1.is_finite();
        if time > last.0 && !is_gap {
            return self.follow(from, (time, value));
        }
        // Before and after what happens at an instant, both are kept: the line may go on another way.
        if !same(value, last.1) {
            self.keep_pending();
            self.keep((time, value));
        } else if !self.is_level {
            self.keep_pending();
        }
    }

    /// Takes a sample that no jump parts from the last one.
    fn follow(&mut self, mut from: (f64, f64), sample: (f64, f64)) {
        if let Some(pending) = self.pending.filter(|_| !self.fits(from, sample)) {
            self.keep(pending);
            from = pending;
        }
        self.pending = Some(sample);
        self.is_level &= same(sample.1, from.1);
        let (time, within) = (sample.0 - from.0, self.tolerance(sample.1));
        self.slopes.0 = self.slopes.0.max((sample.1 - within - from.1) / time);
        self.slopes.1 = self.slopes.1.min((sample.1 + within - from.1) / time);
    }

    /// All points, in order of time.
    pub fn points(&self) -> impl Iterator<Item = (f64, f64)> + Clone + '_ {
        self.kept.iter().copied().chain(self.pending)
    }

    /// Only the values of the points.
    pub fn values(&self) -> impl Iterator<Item = f64> + Clone + '_ {
        self.points().map(|p| p.1)
    }

    /// The first point.
    pub fn first(&self) -> Option<(f64, f64)> {
        self.kept.first().copied()
    }

    /// The last point.
    pub fn last(&self) -> Option<(f64, f64)> {
        self.pending.or(self.kept.last().copied())
    }

    /// The value at a time, after what jumps then; that of the first or last point before or after all. Not a number without points.
    pub fn at(&self, time: f64) -> f64 {
        match self.around(time) {
            (Some(a), Some(b)) if time > a.0 => a.1 + (b.1 - a.1) * ((time - a.0) / (b.0 - a.0)),
            (Some(a), _) => a.1,
            (None, Some(b)) => b.1,
            (None, None) => f64::NAN,
        }
    }

    /// The value of the last point until a time, as of a number that goes from value to value.
    pub fn held(&self, time: f64) -> f64 {
        match self.around(time) {
            (Some(point), _) | (None, Some(point)) => point.1,
            (None, None) => f64::NAN,
        }
    }

    /// The last point until a time, and the first one after it.
    fn around(&self, time: f64) -> (Option<Point>, Option<Point>) {
        let pending = self.pending;
        if let Some(last) = pending.filter(|p| p.0 <= time) {
            return (Some(last), None);
        }
        let next = self.kept.partition_point(|p| p.0 <= time);
        let before = next.checked_sub(1).and_then(|i| self.kept.get(i)).copied();
        (before, self.kept.get(next).copied().or(pending))
    }

    fn keep(&mut self, point: (f64, f64)) {
        self.kept.push(point);
        (self.pending, self.slopes, self.is_level) = (None, ANY, true);
    }

    fn keep_pending(&mut self) {
        if let Some(point) = self.pending {
            self.keep(point);
        }
    }

    /// Whether the line to a sample passes all those since the last kept point.
    fn fits(&self, from: (f64, f64), to: (f64, f64)) -> bool {
        let is_gap = !from.1.is_finite() && !to.1.is_finite();
        is_gap || (self.slopes.0..=self.slopes.1).contains(&((to.1 - from.1) / (to.0 - from.0)))
    }

    fn tolerance(&self, value: f64) -> f64 {
        if self.error == 0.0 {
            return 0.0;
        }
        THINNED * self.error * (self.span.1 - self.span.0).max(OF_MAGNITUDE * value.abs()).max(0.0)
    }
}

fn same(a: f64, b: f64) -> bool {
    a.to_bits() == b.to_bits()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn series(error: f64, samples: &[(f64, f64)]) -> Series {
        let mut series = Series::new(error);
        samples.iter().for_each(|(time, value)| series.push(*time, *value));
        series
    }

    fn points(error: f64, samples: &[(f64, f64)]) -> Vec<(f64, f64)> {
        series(error, samples).points().collect()
    }

    #[test]
    fn what_rests_is_two_points_and_closed_where_it_moves() {
        assert_eq!(points(0.0, &[(0.0, 2.0), (1.0, 2.0), (5.0, 2.0)]), [(0.0, 2.0), (5.0, 2.0)]);
        let moves = points(0.0, &[(0.0, 2.0), (1.0, 2.0), (5.0, 2.0), (6.0, 3.0)]);
        assert_eq!(moves, [(0.0, 2.0), (5.0, 2.0), (6.0, 3.0)]);
    }

    #[test]
    fn a_jump_is_two_points_of_one_time() {
        let jump = series(ERROR, &[(0.0, 2.0), (1.0, 2.0), (1.0, 3.0), (2.0, 3.0)]);
        assert_eq!(jump.points().collect::<Vec<_>>(), [(0.0, 2.0), (1.0, 2.0), (1.0, 3.0), (2.0, 3.0)]);
        assert_eq!([jump.at(0.5), jump.at(1.0), jump.at(9.0), jump.held(0.5)], [2.0, 3.0, 3.0, 2.0]);
    }

    #[test]
    fn an_instant_is_kept_where_something_moves() {
        let ramp = [(0.0, 0.0), (1.0, 1.0), (1.0, 1.0), (2.0, 2.0)];
        assert_eq!(points(0.0, &ramp), [(0.0, 0.0), (1.0, 1.0), (2.0, 2.0)]);
        assert_eq!(points(0.0, &[(0.0, 7.0), (1.0, 7.0), (1.0, 7.0), (2.0, 7.0)]), [(0.0, 7.0), (2.0, 7.0)]);
    }

    #[test]
    fn a_gap_stays_a_gap() {
        let nan = f64::NAN;
        let gap = series(ERROR, &[(0.0, 1.0), (1.0, 1.0), (2.0, nan), (3.0, nan), (4.0, 1.0)]);
        assert_eq!(gap.points().map(|p| p.0).collect::<Vec<_>>(), [0.0, 1.0, 2.0, 3.0, 4.0]);
        assert!(gap.at(2.5).is_nan() && gap.at(0.5) == 1.0);
    }

    #[test]
    fn only_both_ends_are_kept_of_what_nobody_reads() {
        let ends = points(f64::INFINITY, &[(0.0, 1.0), (1.0, 8.0), (1.0, 3.0), (2.0, 5.0)]);
        assert_eq!(ends, [(0.0, 1.0), (2.0, 5.0)]);
    }

    #[test]
    fn a_long_curve_takes_few_points() {
        let samples: Vec<(f64, f64)> =
            (0..20_000).map(|i| f64::from(i) * 0.01).map(|t| (t, (-t / 20.0).exp())).collect();
        assert!(points(ERROR, &samples).len() < 120);
    }

    /// Samples as an engine shows them: stretches of rest, of slopes and of curves, with jumps and instants in between.
    fn course() -> impl Strategy<Value = Vec<(f64, f64)>> {
        let piece = (0..4_u8, 1..12_u8, -3.0..3.0_f64, 0.01..2.0_f64);
        prop::collection::vec(piece, 1..30).prop_map(|pieces| {
            let mut samples = vec![(0.0, 1.0)];
            for (kind, count, by, step) in pieces {
                let (start, value) = *samples.last().expect("one is there");
                match kind {
                    0 => samples.push((start, value + by)),
                    1 => samples.push((start, value)),
                    kind => samples.extend((1..=count).map(|i| {
                        let passed = f64::from(i) * step;
                        let moved = if kind == 2 { 0.0 } else { by * (1.0 - (-passed).exp()) };
                        (start + passed, value + moved)
                    })),
                }
            }
            samples
        })
    }

    /// The value of a sample as it is read back: before a jump that of the point before it.
    fn read(series: &Series, samples: &[(f64, f64)], i: usize) -> f64 {
        let (time, value) = samples[i];
        let is_before = samples.get(i + 1).is_some_and(|next| next.0 == time);
        let is_kept = series.points().any(|p| p.0 == time && same(p.1, value));
        if is_before && is_kept { value } else { series.at(time) }
    }

    proptest! {
        #[test]
        fn what_is_read_back_is_what_was_sampled(samples in course(), error in prop::sample::select(vec![0.0, 1e-3, ERROR])) {
            let series = series(error, &samples);
            let low = samples.iter().map(|s| s.1).fold(f64::INFINITY, f64::min);
            let high = samples.iter().map(|s| s.1).fold(f64::NEG_INFINITY, f64::max);
            let within = error * (high - low) * 1.0001 + 1e-9;
            for i in 0..samples.len() {
                prop_assert!((read(&series, &samples, i) - samples[i].1).abs() <= within, "{:?}", samples[i]);
            }
            prop_assert!(series.points().count() <= samples.len());
        }
    }
}
