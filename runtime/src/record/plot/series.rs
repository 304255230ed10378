//! A quantity over time, thinned for drawing.

/// Points kept of each series at most, about two a px.
const MOST: usize = 2000;

/// A line of a panel.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Series {
    /// In the legend.
    pub(super) name: String,
    /// Time in s and value in the panel's unit.
    pub(super) points: Vec<(f64, f64)>,
    /// Whether it jumps from value to value, as a set point does.
    pub(super) stepped: bool,
}

impl Series {
    /// The smallest and the largest value.
    pub(super) fn range(&self) -> Option<(f64, f64)> {
        let values = self.points.iter().map(|p| p.1);
        values.fold(None, |range: Option<(f64, f64)>, v| {
            Some(range.map_or((v, v), |(low, high)| (low.min(v), high.max(v))))
        })
    }

    /// Whether it changes by more than a millionth of its magnitude.
    pub(super) fn changes(&self) -> bool {
        self.range().is_some_and(|(low, high)| high - low > 1e-6 * low.abs().max(high.abs()))
    }

    /// Fewer points with the same look: of each stretch the first, the smallest, the largest and the last.
    pub(super) fn thinned(mut self) -> Self {
        self.points.retain(|p| p.0.is_finite() && p.1.is_finite());
        if self.points.len() <= MOST {
            return self;
        }
        let size = self.points.len().div_ceil(MOST / 4);
        self.points = self.points.chunks(size).flat_map(extremes).collect();
        self
    }

    /// The corners of its line: a stepped one holds each value until the next.
    pub(super) fn corners(&self) -> Vec<(f64, f64)> {
        if !self.stepped {
            return self.points.clone();
        }
        let mut corners: Vec<(f64, f64)> = Vec::new();
        for &(time, value) in &self.points {
            if let Some(&(_, before)) = corners.last() {
                if before == value {
                    continue;
                }
                corners.push((time, before));
            }
            corners.push((time, value));
        }
        corners.extend(self.points.last());
        corners
    }
}

fn extremes(stretch: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let by_value = |a: &(usize, &(f64, f64)), b: &(usize, &(f64, f64))| a.1.1.total_cmp(&b.1.1);
    let at = |found: Option<(usize, &(f64, f64))>| found.map_or(0, |(i, _)| i);
    let smallest = at(stretch.iter().enumerate().min_by(by_value));
    let largest = at(stretch.iter().enumerate().max_by(by_value));
    let mut kept = vec![0, smallest, largest, stretch.len().saturating_sub(1)];
    kept.sort_unstable();
    kept.dedup();
    kept.into_iter().filter_map(|i| stretch.get(i).copied()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn series(values: impl Iterator<Item = f64>) -> Series {
        let points = values.enumerate().map(|(i, v)| (i as f64, v)).collect();
        Series { name: String::new(), points, stepped: false }
    }

    #[test]
    fn thinning_keeps_a_single_spike_and_both_ends() {
        let thin = series((0..100_000).map(|i| if i == 77_777 { 9.0 } else { f64::from(i) * 1e-6 })).thinned();
        assert!(thin.points.len() <= MOST, "{}", thin.points.len());
        assert_eq!(thin.range(), Some((0.0, 9.0)));
        assert_eq!(thin.points.first().map(|p| p.0), Some(0.0));
        assert_eq!(thin.points.last().map(|p| p.0), Some(99_999.0));
        assert!(thin.points.is_sorted_by_key(|p| p.0));
    }

    #[test]
    fn noise_of_rounding_is_no_change() {
        assert!(!series([148.0, 148.0 + 1e-12].into_iter()).changes());
        assert!(series([0.0, 1e-9].into_iter()).changes());
    }

    #[test]
    fn a_stepped_line_has_no_slope() {
        let stepped = Series { stepped: true, ..series([1.0, 1.0, 3.0].into_iter()) };
        assert_eq!(stepped.corners(), [(0.0, 1.0), (2.0, 1.0), (2.0, 3.0), (2.0, 3.0)]);
    }
}
