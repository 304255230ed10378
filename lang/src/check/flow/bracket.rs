//! Where a rate of change stops to lead outwards.

/// A place, and how fast what is there goes outwards.
type Point = (f64, f64);

/// The place at or next to which `rate` turns from positive to not positive on the way from `near` to `far`, where it is not: no more
/// than `share` of the way too far. Rates are straight lines there for the most part, with bends where signs change: their zero is
/// guessed from two points of one side and enclosed; where that does not help, the middle is taken.
pub fn last_outwards(near: f64, far: f64, share: f64, mut rate: impl FnMut(f64) -> f64) -> f64 {
    let mut inner = (near, rate(near));
    if inner.1 <= 0.0 {
        return near;
    }
    let mut outer = (far, rate(far));
    let nudge = 0.5 * share * (far - near);
    let mut line = [inner, outer];
    let mut first = true;
    let mut width = (far - near).abs();
    while width > 2.0 * nudge.abs() {
        let guess = zero(line);
        let tries = match (first, line[1].1 > 0.0) {
            (true, _) => [guess, f64::NAN, f64::NAN],
            (_, true) => [guess + nudge, guess - nudge, f64::NAN],
            (_, false) => [guess - nudge, guess + nudge, f64::NAN],
        };
        for at in tries {
            // The middle is the last resort.
            let at = match at {
                at if at.is_nan() && (first || (outer.0 - inner.0).abs() <= 0.5 * width) => continue,
                at if at.is_nan() => 0.5 * (inner.0 + outer.0),
                at if (at - inner.0) * (at - outer.0) >= 0.0 => continue,
                at => at,
            };
            let point = (at, rate(at));
            let side = if point.1 > 0.0 { &mut inner } else { &mut outer };
            line = [std::mem::replace(side, point), point];
        }
        let left = (outer.0 - inner.0).abs();
        if !first && left > 0.75 * width {
            // No number lies between, or nothing there is one.
            return outer.0;
        }
        (first, width) = (false, left);
    }
    outer.0
}

/// Where the line through two points meets zero; not a number if it does not.
fn zero([a, b]: [Point; 2]) -> f64 {
    let at = b.0 - b.1 * (b.0 - a.0) / (b.1 - a.1);
    if at.is_finite() { at } else { f64::NAN }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SHARE: f64 = 1.0 / 16_777_216.0;

    /// The place that is found, and how many rates were asked for.
    fn found(near: f64, far: f64, rate: impl Fn(f64) -> f64) -> (f64, usize) {
        let mut asked = 0;
        let at = last_outwards(near, far, SHARE, |x| {
            asked += 1;
            rate(x)
        });
        (at, asked)
    }

    #[test]
    fn a_line_takes_five_rates() {
        for (near, far, zero) in [(0.0, 10.0, 3.7), (5.0, -40.0, -1.0), (-1e9, 1e9, 12.5)] {
            let out = if far > near { 1.0 } else { -1.0 };
            let (at, asked) = found(near, far, |x| out * (zero - x));
            assert!(((at - zero) / (far - near)).abs() <= SHARE && asked <= 5, "{at} after {asked}");
            assert!(out * (zero - at) <= 0.0);
        }
    }

    #[test]
    fn a_bend_at_the_zero_takes_few_more() {
        let (at, asked) = found(0.0, 100.0, |x| if x < 30.0 { 5.0 * (30.0 - x) } else { 0.01 * (30.0 - x) });
        assert!((at - 30.0).abs() <= 100.0 * SHARE && asked <= 8, "{at} after {asked}");
    }

    #[test]
    fn curves_steps_and_what_is_no_number_end() {
        let (at, asked) = found(0.0, 3.0, |x| 2.0 - x.powi(3));
        assert!((at - 2f64.cbrt()).abs() <= 3.0 * SHARE && asked <= 60, "{at} after {asked}");
        let (at, asked) = found(0.0, 3.0, |x| if x < 1.0 { f64::INFINITY } else { -1e-300 });
        assert!((at - 1.0).abs() <= 3.0 * SHARE && asked <= 80, "{at} after {asked}");
        assert_eq!(found(2.0, 3.0, |_| 0.0), (2.0, 1));
        let (at, asked) = found(2.0, 3.0, |x| if x == 2.0 { 1.0 } else { f64::NAN });
        assert!((2.0..=3.0).contains(&at) && asked <= 80, "{at} after {asked}");
    }

    #[test]
    fn nothing_between_two_numbers_ends() {
        let near = 1.0f64;
        let (at, asked) = found(near, near.next_up(), |x| near - x + 1e-17);
        assert!(at == near.next_up() && asked <= 5, "{at} after {asked}");
    }
}
