//! Units by their symbols, as far as a picture needs them.

/// Cubic metres of one unit of this symbol; `None` if it is no unit of volume.
pub(crate) fn volume(symbol: &str) -> Option<f64> {
    match symbol {
        "m^3" => Some(1.0),
        "L" => Some(1e-3),
        "mL" | "cm^3" => Some(1e-6),
        "uL" | "mm^3" => Some(1e-9),
        "nL" => Some(1e-12),
        _ => None,
    }
}
