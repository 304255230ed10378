//! What ions of one sign and different charges do to each other by electrostatics alone (Pitzer, J. Solution Chem. 4 (1975) 249).
//!
//! The integral `J(x) = x/4 - 1 + 1/x * int_0^inf (1 - exp(-x/y * exp(-y))) y^2 dy` has no closed form. Its Chebyshev series were computed
//! from it with 30 digits, of J in `2 x^0.2 - 1` below 1 and of `J - x/4 + 1` in `4 x^-0.1 - 3` above; they are within 2e-15 of it.

use crate::math;

/// Up to here the series above 1 goes; beyond, J is all but linear, and no solution gets there.
const LARGEST: f64 = 1024.0;

const BELOW: [f64; 24] = [
    0.048_200_889_334_158_68,
    0.042_462_584_746_872_91,
    0.028_814_672_543_490_876,
    0.014_673_156_559_062_775,
    0.005_271_073_136_399_703,
    0.001_125_155_849_605_628,
    3.658_360_181_421_156e-5,
    -4.503_697_519_643_372_5e-5,
    -4.537_895_714_506_738e-6,
    2.937_706_971_612_232e-6,
    3.965_664_653_953_074_6e-7,
    -2.020_996_239_170_974e-7,
    -2.526_776_112_915_517e-8,
    1.352_260_274_249_24e-8,
    1.229_409_443_511_743e-9,
    -8.219_702_034_258_781e-10,
    -5.085_006_103_309_197e-11,
    4.633_891_096_884_713_5e-11,
    1.934_776_834_978_942e-12,
    -2.555_538_277_726_722e-12,
    -3.728_361_822_586_482e-14,
    1.291_104_833_689_576e-13,
    1.818_627_739_092_537e-16,
    -6.681_910_969_746_269e-15,
];

const ABOVE: [f64; 24] = [
    0.938_217_323_288_572_5,
    0.424_346_475_322_474_5,
    -0.002_168_661_990_922_726_4,
    -0.027_868_904_631_685_366,
    0.001_452_134_938_755_049_4,
    0.001_821_952_701_068_53,
    -0.000_171_525_967_958_552_25,
    -9.857_791_177_816_258e-5,
    1.166_226_214_075_605_8e-5,
    4.732_904_601_340_609e-6,
    -5.350_345_571_432_003e-7,
    -2.228_134_348_269_843e-7,
    1.536_140_518_775_356_2e-8,
    1.074_191_464_770_972_7e-8,
    7.430_102_238_033_504e-11,
    -5.083_431_406_561_155e-10,
    -5.358_825_406_078_415e-11,
    2.142_579_428_145_973e-11,
    5.376_620_342_689_28e-12,
    -6.357_029_521_800_579e-13,
    -3.997_296_703_753_982e-13,
    -7.085_191_217_090_45e-15,
    2.495_618_388_760_459e-14,
    3.399_992_422_382_863e-15,
];

/// J and its first two derivatives, for an argument of 0 or more.
pub(super) fn integral(x: f64) -> [f64; 3] {
    if x <= 0.0 {
        return [0.0; 3];
    }
    if x < 1.0 {
        let root = math::pow(x, 0.2);
        let (by_x, bend) = (0.4 * root / x, -0.32 * root / (x * x));
        let [value, slope, second] = series(&BELOW, 2.0 * root - 1.0);
        return [value, slope * by_x, second * by_x * by_x + slope * bend];
    }
    let beyond = (x - LARGEST).max(0.0);
    let x = x.min(LARGEST);
    let root = math::pow(x, -0.1);
    let (by_x, bend) = (-0.4 * root / x, 0.44 * root / (x * x));
    let [rest, slope, second] = series(&ABOVE, 4.0 * root - 3.0);
    let by = slope * by_x + 0.25;
    [rest + 0.25 * x - 1.0 + by * beyond, by, if beyond > 0.0 { 0.0 } else { second * by_x * by_x + slope * bend }]
}

/// A Chebyshev series and its first two derivatives, by Clenshaw's recurrence.
fn series(of: &[f64], u: f64) -> [f64; 3] {
    let (mut b, mut d, mut e) = ([0.0; 2], [0.0; 2], [0.0; 2]);
    for c in of[1..].iter().rev() {
        e = [4.0 * d[0] + 2.0 * u * e[0] - e[1], e[0]];
        d = [2.0 * b[0] + 2.0 * u * d[0] - d[1], d[0]];
        b = [c + 2.0 * u * b[0] - b[1], b[0]];
    }
    [0.5 * of[0] + u * b[0] - b[1], b[0] + u * d[0] - d[1], 2.0 * d[0] + u * e[0] - e[1]]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The integral itself, by the trapezoidal rule in the logarithm of y.
    fn by_quadrature(x: f64) -> f64 {
        let (from, to, steps) = (-40.0_f64, 5.5_f64, 20_000);
        let width = (to - from) / f64::from(steps);
        let at = |k: u32| {
            let y = (from + width * f64::from(k)).exp();
            -(-x / y * (-y).exp()).exp_m1() * y * y * y
        };
        0.25 * x - 1.0 + width * (0..=steps).map(at).sum::<f64>() / x
    }

    #[test]
    fn the_series_are_those_of_the_integral() {
        for x in [1e-3, 0.01, 0.2, 0.999, 1.0, 1.3, 5.0, 40.0, 300.0] {
            let (found, expected) = (integral(x)[0], by_quadrature(x));
            assert!((found - expected).abs() < 1e-11 * (1.0 + expected), "{x}: {found}, {expected}");
        }
    }

    #[test]
    fn slopes_are_those_of_differences() {
        for x in [1e-3, 0.2, 0.9, 1.3, 5.0, 40.0, 300.0] {
            let step = 1e-4 * x;
            let (low, high) = (integral(x - step), integral(x + step));
            for order in 0..2 {
                let expected = (high[order] - low[order]) / (2.0 * step);
                let found = integral(x)[order + 1];
                assert!((found - expected).abs() < 1e-6 * expected.abs() + 1e-12, "{x}: {found}, {expected}");
            }
        }
    }
}
