//! Deployments in a simulated room: executor, lines, clock and disk in one process, with faults by lot. Each trial replays by its seed.

pub mod disk;
pub mod labs;
pub mod room;
pub mod trial;
