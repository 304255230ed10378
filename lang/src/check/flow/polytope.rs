//! Bounds of the extents of reactions: how far each can go until a reactant has run out.
//!
//! Amounts are what they were at first plus stoichiometric coefficients times extents, and none is below nothing. That is a
//! polytope of extents. Intervals are propagated through its faces, and where several extents meet, the simplex method finds
//! its corners (Dantzig's tableau with Bland's rule, which never cycles).

/// Times that bounds are propagated through all faces.
const SWEEPS: usize = 12;

/// More extents, or more amounts, that hang together are bounded by propagation alone.
const MOST_EXTENTS: usize = 12;
/// See [`MOST_EXTENTS`].
const MOST_AMOUNTS: usize = 48;

/// Pivots before a bound is given up.
const MOST_PIVOTS: usize = 200;

/// Numbers of a tableau below this are zero.
const ZERO: f64 = 1e-12;

/// By this share bounds are moved outwards, for what rounding may have taken.
const OUTWARDS: f64 = 1e-9;

/// An amount: the most it can have been before anything went on, and its coefficient in each extent.
pub struct Face {
    /// The amount without any extent.
    pub most: f64,
    /// Coefficients by extent.
    pub terms: Vec<(usize, f64)>,
}

/// Bounds of a sum of extents.
pub fn range_of(terms: impl Iterator<Item = (usize, f64)>, ranges: &[(f64, f64)]) -> (f64, f64) {
    terms.fold((0.0, 0.0), |(low, high), (extent, c)| {
        let (a, b) = scaled(c, ranges[extent]);
        (low + a, high + b)
    })
}

/// A range times a number; nothing times without bound is nothing.
pub fn scaled(c: f64, (low, high): (f64, f64)) -> (f64, f64) {
    let times = |v: f64| if c == 0.0 || v == 0.0 { 0.0 } else { c * v };
    if c < 0.0 { (times(high), times(low)) } else { (times(low), times(high)) }
}

/// Brings the ranges of extents in as far as no amount falls below nothing.
pub fn tighten(faces: &[Face], ranges: &mut [(f64, f64)]) {
    for _ in 0..SWEEPS {
        let mut rests = true;
        for face in faces {
            for (extent, c) in &face.terms {
                let others = face.terms.iter().copied().filter(|(other, _)| other != extent);
                let (_, rest) = range_of(others, ranges);
                let bound = outwards(((face.most + rest) / c.abs()).max(0.0), face.most / c);
                let range = &mut ranges[*extent];
                let new = if *c < 0.0 { (range.0, range.1.min(bound)) } else { (range.0.max(-bound), range.1) };
                let moved = (new.0 - range.0).abs() + (new.1 - range.1).abs();
                rests &= new == *range || moved <= OUTWARDS * (new.1 - new.0).abs();
                *range = new;
            }
        }
        if rests {
            return;
        }
    }
}

/// Whether so many extents and amounts are bounded by propagation alone.
pub fn is_large(extents: usize, amounts: usize) -> bool {
    extents > MOST_EXTENTS || amounts > MOST_AMOUNTS
}

/// The largest value of a sum of extents, where several amounts bound them together.
pub fn most(goal: &[(usize, f64)], faces: &[Face], ranges: &[(f64, f64)]) -> f64 {
    if is_large(ranges.len(), faces.len()) {
        return f64::INFINITY;
    }
    // An extent that goes both ways is the difference of two that do not.
    let halves = |(i, (low, high)): (usize, &(f64, f64))| {
        [(high > &0.0).then_some((i, 1.0, *high)), (low < &0.0).then_some((i, -1.0, -low))]
    };
    let columns: Vec<(usize, f64, f64)> = ranges.iter().enumerate().flat_map(halves).flatten().collect();
    let coefficient = |terms: &[(usize, f64)], (extent, sign, _): &(usize, f64, f64)| {
        terms.iter().filter(|(e, _)| e == extent).map(|(_, c)| c * sign).sum::<f64>()
    };
    let mut rows: Vec<Vec<f64>> = Vec::new();
    for face in faces {
        let row = columns.iter().map(|column| -coefficient(&face.terms, column));
        rows.push(row.chain([face.most.max(0.0)]).collect());
    }
    for (i, column) in columns.iter().enumerate().filter(|(_, column)| column.2.is_finite()) {
        rows.push((0..columns.len()).map(|j| f64::from(u8::from(i == j))).chain([column.2]).collect());
    }
    let goal: Vec<f64> = columns.iter().map(|column| coefficient(goal, column)).collect();
    let largest = rows.iter().filter_map(|row| row.last()).fold(0.0, |a: f64, b| a.max(*b));
    outwards(simplex(rows, goal), ZERO * largest)
}

/// A bound from above, moved up by what rounding may have taken from it and from the numbers it was made of.
fn outwards(bound: f64, of: f64) -> f64 {
    bound + OUTWARDS * bound.abs() + ZERO * of.abs()
}

/// The largest value of a goal where rows of coefficients are at most their last element, which is never negative.
fn simplex(mut rows: Vec<Vec<f64>>, mut goal: Vec<f64>) -> f64 {
    let (count, slack) = (rows.len(), goal.len());
    for (i, row) in rows.iter_mut().enumerate() {
        let last = row.pop().unwrap_or(0.0);
        row.extend((0..count).map(|j| f64::from(u8::from(i == j))));
        row.push(last);
    }
    goal.extend(vec![0.0; count + 1]);
    let width = slack + count;
    let mut basis: Vec<usize> = (slack..width).collect();
    for _ in 0..MOST_PIVOTS {
        let Some(enters) = (0..width).find(|j| goal[*j] > ZERO) else { return -goal[width] };
        let ratios = (0..count).filter(|i| rows[*i][enters] > ZERO).map(|i| (rows[i][width] / rows[i][enters], i));
        let leaves = ratios.min_by(|(a, i), (b, j)| a.total_cmp(b).then(basis[*i].cmp(&basis[*j])));
        let Some((_, leaves)) = leaves else { return f64::INFINITY };
        let pivot = rows[leaves][enters];
        rows[leaves].iter_mut().for_each(|v| *v /= pivot);
        let row = rows[leaves].clone();
        let clear = |other: &mut Vec<f64>| {
            let factor = other[enters];
            if factor != 0.0 {
                other.iter_mut().zip(&row).for_each(|(v, r)| *v -= factor * r);
            }
        };
        rows.iter_mut().enumerate().filter(|(i, _)| *i != leaves).for_each(|(_, other)| clear(other));
        clear(&mut goal);
        basis[leaves] = enters;
    }
    f64::INFINITY
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn face(most: f64, terms: &[(usize, f64)]) -> Face {
        Face { most, terms: terms.to_vec() }
    }

    fn close(a: f64, b: f64) -> bool {
        (a - b).abs() <= 1e-8 * b.abs().max(1.0)
    }

    #[test]
    fn the_limiting_reagent_bounds_a_reaction() {
        // 2 A + B -> C with 3 of A and 4 of B.
        let faces = [face(3.0, &[(0, -2.0)]), face(4.0, &[(0, -1.0)]), face(0.0, &[(0, 1.0)])];
        let mut ranges = [(0.0, f64::INFINITY)];
        tighten(&faces, &mut ranges);
        assert!(ranges[0].0 == 0.0 && close(ranges[0].1, 1.5), "{ranges:?}");
    }

    #[test]
    fn a_circle_of_reactions_is_bounded_by_what_goes_round() {
        // A -> B -> C -> A: no extent has a bound, each amount has.
        let faces =
            [face(1.0, &[(0, -1.0), (2, 1.0)]), face(0.5, &[(0, 1.0), (1, -1.0)]), face(0.0, &[(1, 1.0), (2, -1.0)])];
        let mut ranges = [(0.0, f64::INFINITY); 3];
        tighten(&faces, &mut ranges);
        assert_eq!(ranges[0].1, f64::INFINITY);
        assert!(close(most(&[(1, 1.0), (2, -1.0)], &faces, &ranges), 1.5));
        assert!(close(most(&[(0, -1.0), (2, 1.0)], &faces, &ranges), 0.5));
        assert_eq!(most(&[(0, 1.0)], &faces, &ranges), f64::INFINITY);
    }

    proptest! {
        /// Reactions done one after another as far as the reactants last end within the bounds.
        #[test]
        fn what_reacts_stays_within_bounds(
            amounts in proptest::collection::vec(0.0..2.0_f64, 5),
            coefficients in proptest::collection::vec(-2..3_i32, 15),
            steps in proptest::collection::vec((0..3_usize, 0.0..1.0_f64), 0..12),
        ) {
            let c = |i: usize, j: usize| f64::from(coefficients[3 * i + j]);
            let faces: Vec<Face> = (0..5)
                .map(|i| face(amounts[i], &(0..3).map(|j| (j, c(i, j))).filter(|t| t.1 != 0.0).collect::<Vec<_>>()))
                .collect();
            let mut extents = [0.0; 3];
            for (j, share) in steps {
                let now = |i: usize| amounts[i] + (0..3).map(|k| c(i, k) * extents[k]).sum::<f64>();
                let limit = (0..5).filter(|i| c(*i, j) < 0.0).map(|i| now(i) / -c(i, j)).fold(1.0, f64::min);
                extents[j] += share * limit.max(0.0);
            }
            let mut ranges = [(0.0, f64::INFINITY); 3];
            tighten(&faces, &mut ranges);
            for j in 0..3 {
                prop_assert!(extents[j] <= ranges[j].1 + 1e-9, "{extents:?} {ranges:?}");
            }
            for (i, face) in faces.iter().enumerate() {
                let moved: f64 = (0..3).map(|k| c(i, k) * extents[k]).sum();
                prop_assert!(moved <= most(&face.terms, &faces, &ranges) + 1e-9);
            }
        }
    }
}
