//! How robots move: kinematics, collision checking, planning and time parametrisation.
//!
//! Everything is in SI units and 64-bit floats; a configuration is the positions of a chain's moving joints in
//! their order from the base.
