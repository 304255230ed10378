//! Lines and the blends between them, each with a coordinate along it.

/// A corner's blend turns its direction by a share that rises as the integral of a trapezium: this part of its
/// length each for getting it to turn and for getting it straight again.
const RAMP: f64 = 1.0 / 3.0;

/// Turning at its fastest, relative to turning evenly.
pub(crate) const PEAK: f64 = 1.0 / (1.0 - RAMP);

/// How fast turning begins and ends, relative to the square of the length.
pub(crate) const SLOPE: f64 = PEAK / RAMP;

/// A piece of a path.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Curve {
    /// Begins here and goes this way (of length 1).
    Line(Vec<f64>, Vec<f64>),
    /// Begins here, going one way, and ends after this length, going another way.
    Blend(Vec<f64>, [Vec<f64>; 2], f64),
}

/// How far turning has come at a share of a blend: the integral of the turn, the turn, and its derivatives.
fn turn(u: f64) -> [f64; 4] {
    if u > 0.5 {
        let [sum, share, rate, slope] = turn(1.0 - u);
        // The turn is symmetric about the middle: share(u) = 1 - share(1 - u).
        return [0.5 - (1.0 - u) + sum, 1.0 - share, rate, -slope];
    }
    if u < RAMP {
        return [SLOPE * u * u * u / 6.0, 0.5 * SLOPE * u * u, SLOPE * u, SLOPE];
    }
    let v = u - RAMP;
    let (sum, share) = (SLOPE * RAMP * RAMP * RAMP / 6.0, 0.5 * SLOPE * RAMP * RAMP);
    [sum + share * v + 0.5 * PEAK * v * v, share + PEAK * v, PEAK, 0.0]
}

impl Curve {
    /// One coordinate of the curve, and its first three derivatives by the length along it.
    pub fn at(&self, s: f64, coordinate: usize) -> [f64; 4] {
        match self {
            Self::Line(from, way) => [from[coordinate] + s * way[coordinate], way[coordinate], 0.0, 0.0],
            Self::Blend(from, [way, next], length) => {
                let bend = next[coordinate] - way[coordinate];
                let [sum, share, rate, slope] = turn(s / length);
                [
                    from[coordinate] + s * way[coordinate] + bend * length * sum,
                    way[coordinate] + bend * share,
                    bend * rate / length,
                    bend * slope / (length * length),
                ]
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turn_is_whole_and_smooth() {
        assert_eq!(turn(0.0), [0.0, 0.0, 0.0, SLOPE]);
        let [sum, share, rate, _] = turn(1.0);
        assert!((sum - 0.5).abs() < 1e-15 && (share - 1.0).abs() < 1e-15 && rate.abs() < 1e-15);
        let h = 1e-5;
        for i in 1..1000 {
            let u = f64::from(i) / 1000.0 - 0.0003;
            let (a, b, c) = (turn(u - h), turn(u), turn(u + h));
            for k in 0..3 {
                assert!(((c[k] - a[k]) / (2.0 * h) - b[k + 1]).abs() < 1e-3, "{u} {k}");
            }
        }
    }
}
