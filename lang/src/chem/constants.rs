//! The fields by which an equilibrium gives its constant.

/// The fields of which each gives the constant of an equilibrium.
pub const CONSTANTS: &[&str] =
    &["constant", "log_constant", "pka", "ksp", "pksp", PARTITION, LOG_PARTITION, POTENTIAL, ANALYTIC];

/// The field that gives the ratio of a concentration in another liquid to that in water.
pub const PARTITION: &str = "partition";

/// The field that gives log10 of that.
pub const LOG_PARTITION: &str = "log_p";

/// The field that gives the standard potential of a half-cell.
pub const POTENTIAL: &str = "potential";

/// The field that gives the heat where the constant does not: one that was fitted to amounts, and moves with more than the temperature.
pub const HEAT: &str = "heat";

/// The field that gives the constant at every temperature.
pub const ANALYTIC: &str = "analytic";
