//! The one place transcendental functions come from, so that a trace does not depend on the system's C library.

/// `e^x`.
pub fn exp(x: f64) -> f64 {
    libm::exp(x)
}

/// Natural logarithm.
pub fn ln(x: f64) -> f64 {
    libm::log(x)
}

/// `x^y`. Small whole exponents are multiplied out, so that `x^2` equals `x*x` to the last bit.
pub fn pow(x: f64, y: f64) -> f64 {
    if y == 1.0 {
        x
    } else if y == 2.0 {
        x * x
    } else if y == 3.0 {
        x * x * x
    } else if y == 0.0 {
        1.0
    } else if y == -1.0 {
        1.0 / x
    } else {
        libm::pow(x, y)
    }
}

/// Sine of an angle in radians.
pub fn sin(x: f64) -> f64 {
    libm::sin(x)
}

/// Cosine of an angle in radians.
pub fn cos(x: f64) -> f64 {
    libm::cos(x)
}

/// Arc tangent, radians.
pub fn atan(x: f64) -> f64 {
    libm::atan(x)
}

/// Sine and cosine of an angle in radians.
pub fn sin_cos(x: f64) -> (f64, f64) {
    libm::sincos(x)
}

/// Angle in radians of the point (x, y), from the first axis.
pub fn atan2(y: f64, x: f64) -> f64 {
    libm::atan2(y, x)
}

/// Angle in radians between 0 and pi with this cosine; `x` between -1 and 1.
pub fn acos(x: f64) -> f64 {
    libm::acos(x)
}
