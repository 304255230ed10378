//! Fewer samples for the same picture: those on the straight line between their neighbours are left out.

/// The samples to keep of `columns` over `times`, in order: every other one lies, in every column, within the column's
/// tolerance of the straight line between the kept ones around it. Jumps (two samples of one time) and ends of gaps
/// (what is not a number) are kept. A column that is shorter than the times is taken as a gap from there on.
pub(crate) fn keep(times: &[f64], columns: &[&[f64]], tolerance: &[f64]) -> Vec<usize> {
    let at = |c: usize, i: usize| columns[c].get(i).copied().unwrap_or(f64::NAN);
    let mut kept = Vec::new();
    // Of each column, the slopes that a line from the last kept sample may have to pass all left out since.
    let mut slopes = vec![(f64::NEG_INFINITY, f64::INFINITY); columns.len()];
    for i in 0..times.len() {
        let Some(&from) = kept.last() else {
            kept.push(i);
            continue;
        };
        let from: usize = from;
        let span = times[i] - times[from];
        let fits = |c: usize, slopes: &[(f64, f64)]| {
            let (a, b) = (at(c, from), at(c, i));
            if a.is_nan() || b.is_nan() {
                return a.is_nan() && b.is_nan();
            }
            let slope = (b - a) / span;
            span > 0.0 && (slopes[c].0..=slopes[c].1).contains(&slope)
        };
        let jumps = times[i] == times[i - 1];
        if jumps || (i > from + 1 && !(0..columns.len()).all(|c| fits(c, &slopes))) {
            // The line to this sample misses one before it, or jumps: the one before is needed.
            if from != i - 1 {
                kept.push(i - 1);
            }
            if jumps {
                kept.push(i);
            }
            slopes.fill((f64::NEG_INFINITY, f64::INFINITY));
        }
        let Some(&from) = kept.last() else { continue };
        if from == i {
            continue;
        }
        let span = times[i] - times[from];
        for (c, (low, high)) in slopes.iter_mut().enumerate() {
            let (a, b) = (at(c, from), at(c, i));
            if a.is_nan() != b.is_nan() {
                (*low, *high) = (f64::INFINITY, f64::NEG_INFINITY);
            } else if !a.is_nan() {
                *low = low.max((b - tolerance[c] - a) / span);
                *high = high.min((b + tolerance[c] - a) / span);
            }
        }
    }
    if let (Some(&last), false) = (kept.last(), times.is_empty())
        && last + 1 != times.len()
    {
        kept.push(times.len() - 1);
    }
    kept
}

/// A fraction of how far a column reaches, of its magnitude where that is all there is.
pub(crate) fn tolerance(values: &[f64], fraction: f64) -> f64 {
    let finite = || values.iter().copied().filter(|v| v.is_finite());
    let low = finite().fold(f64::INFINITY, f64::min);
    let high = finite().fold(f64::NEG_INFINITY, f64::max);
    if low < high { (high - low) * fraction } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The value at `time` on the straight lines between the kept samples.
    fn line(times: &[f64], values: &[f64], kept: &[usize], time: f64) -> f64 {
        let pair = kept.windows(2).find(|w| times[w[0]] <= time && time <= times[w[1]] && times[w[0]] < times[w[1]]);
        let [a, b] = pair.map_or([kept[0], kept[0]], |w| [w[0], w[1]]);
        if a == b {
            return values[a];
        }
        values[a] + (values[b] - values[a]) * (time - times[a]) / (times[b] - times[a])
    }

    #[test]
    fn what_is_left_out_lies_on_the_line() {
        let times: Vec<f64> = (0..2000).map(|i| f64::from(i) * 0.01).collect();
        let values: Vec<f64> = times.iter().map(|t| t.sin() + 0.2 * (7.0 * t).cos()).collect();
        let kept = keep(&times, &[&values], &[1e-3]);
        assert!(kept.len() < 700, "{}", kept.len());
        for (t, v) in times.iter().zip(&values) {
            assert!((line(&times, &values, &kept, *t) - v).abs() < 1.0001e-3);
        }
    }

    #[test]
    fn jumps_and_ends_remain() {
        let times = [0.0, 1.0, 2.0, 2.0, 3.0, 4.0];
        let values = [0.0, 0.0, 0.0, 5.0, 5.0, 5.0];
        assert_eq!(keep(&times, &[&values], &[1e-6]), [0, 2, 3, 5]);
    }

    #[test]
    fn gaps_are_kept() {
        let nan = f64::NAN;
        let kept = keep(&[0.0, 1.0, 2.0, 3.0, 4.0], &[&[1.0, 1.0, nan, nan, 1.0]], &[1e-6]);
        assert_eq!(kept, [0, 1, 2, 3, 4]);
    }

    #[test]
    fn nothing_of_nothing() {
        assert!(keep(&[], &[&[]], &[0.0]).is_empty());
        assert_eq!(keep(&[1.0], &[&[2.0]], &[0.0]), [0]);
    }
}
