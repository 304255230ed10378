//! What data say of parameters: standard errors from the response at the best place, and directions in which the fit
//! does not change.

use nalgebra_lm::DMatrix;
use statrs::distribution::{ContinuousCDF, Normal, StudentsT};

/// The part of a parameter in a direction from which on it is named with it.
const PART: f64 = 0.1;

/// Standard errors and correlations, by places in the ranges.
#[derive(Clone, Debug, PartialEq)]
pub struct Spread {
    /// By parameter; none where the data do not determine it.
    pub errors: Vec<Option<f64>>,
    /// How many standard errors the interval of 95 % reaches to each side.
    pub reach: f64,
    /// By two parameters; none where one is not determined.
    pub correlation: Vec<Vec<Option<f64>>>,
    /// Groups of parameters of which the data determine one combination less than there are parameters.
    pub undetermined: Vec<Vec<usize>>,
}

impl Spread {
    /// From the change of residuals (in standard deviations) with places. `scatter` is the factor by which the residuals
    /// scatter more than that; `freedom` are the degrees of freedom it was learnt with, none where it is known.
    ///
    /// A direction is not determined where its interval of 95 % is as wide as the ranges themselves: the data then say
    /// less of it than the ranges did.
    pub fn new(jacobian: &DMatrix<f64>, scatter: f64, freedom: Option<usize>) -> Self {
        let count = jacobian.ncols();
        let reach = match freedom {
            Some(n) => StudentsT::new(0.0, 1.0, n.max(1) as f64).map_or(f64::NAN, |t| t.inverse_cdf(0.975)),
            None => Normal::standard().inverse_cdf(0.975),
        };
        let svd = jacobian.clone().svd(false, true);
        let mut covariance = DMatrix::<f64>::zeros(count, count);
        let mut undetermined: Vec<Vec<usize>> = Vec::new();
        let mut lost = vec![false; count];
        let directions = svd.v_t.unwrap_or_else(|| DMatrix::identity(count, count));
        for (i, strength) in svd.singular_values.iter().enumerate() {
            let direction = directions.row(i).transpose();
            if *strength <= 2.0 * reach * scatter || !strength.is_finite() {
                let largest = direction.iter().fold(0.0f64, |m, v| m.max(v.abs()));
                let group: Vec<usize> = (0..count).filter(|j| direction[*j].abs() >= PART * largest).collect();
                group.iter().for_each(|j| lost[*j] = true);
                undetermined.push(group);
                continue;
            }
            covariance += &direction * direction.transpose() * (scatter / strength).powi(2);
        }
        // Fewer residuals than parameters leave directions that have no strength at all.
        for _ in svd.singular_values.len()..count {
            lost.iter_mut().for_each(|l| *l = true);
            undetermined.push((0..count).collect());
        }
        let errors: Vec<Option<f64>> =
            (0..count).map(|j| (!lost[j]).then(|| covariance[(j, j)].max(0.0).sqrt())).collect();
        let correlation = (0..count).map(|j| {
            (0..count)
                .map(|k| match (errors[j], errors[k]) {
                    (Some(_), Some(_)) if j == k => Some(1.0),
                    (Some(a), Some(b)) if a > 0.0 && b > 0.0 => Some((covariance[(j, k)] / (a * b)).clamp(-1.0, 1.0)),
                    _ => None,
                })
                .collect()
        });
        let correlation = correlation.collect();
        undetermined.sort();
        Spread { errors, reach, correlation, undetermined }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_has_the_errors_of_the_textbook() {
        // y = a + b x at 0, 1, 2, 3 with deviation 0.01: var b = s^2 / sum (x - 1.5)^2 = s^2 / 5.
        let jacobian = DMatrix::from_fn(4, 2, |i, j| if j == 0 { 100.0 } else { 100.0 * i as f64 });
        let spread = Spread::new(&jacobian, 1.0, None);
        let b = spread.errors[1].expect("the slope is determined");
        assert!((b - 0.01 / 5f64.sqrt()).abs() < 1e-12);
        // Correlation of intercept and slope: -mean x / sqrt(mean x^2).
        let r = spread.correlation[0][1].expect("both are determined");
        assert!((r + 1.5 / 3.5f64.sqrt()).abs() < 1e-12, "{r}");
        assert!(spread.undetermined.is_empty());
    }

    #[test]
    fn a_sum_alone_determines_neither_of_its_terms() {
        let jacobian = DMatrix::from_fn(5, 3, |i, j| if j < 2 { 50.0 } else { 10.0 * (1.0 + i as f64) });
        let spread = Spread::new(&jacobian, 1.0, None);
        assert_eq!(spread.undetermined, [vec![0, 1]]);
        assert_eq!((spread.errors[0], spread.errors[1]), (None, None));
        assert!(spread.errors[2].is_some());
    }
}
