//! What the compiler and the runtime agree on.
//!
//! `matterix-lang` turns text into a [`Program`]; `matterix-runtime` executes one. Neither sees the other: everything
//! they share is declared here, as data.
//!
//! - [`span`], [`diagnostic`], [`codes`]: where something stands in the text and what is wrong with it.
//! - [`quantity`]: dimensions and units as they are shown to people. All numbers in a program are SI.
//! - [`graph`]: the one expression form, in SSA, with its reference evaluator and its printer.
//! - [`undefined`]: expressions that have no value.
//! - [`equilibrium`]: amounts that follow from conserved totals and constants.
//! - [`interval`]: operations on all numbers between two.
//! - [`scene`], [`model`], [`plan`]: what there is, how it evolves, what is done with it.
//! - [`study`]: many runs of one workflow, and what is estimated from data.
//! - [`wire`]: how devices are spoken to.
//! - [`framing`], [`form`]: what stands around messages on a line, and how numbers are written there.
//! - [`script`]: what stands for a workflow in files that other programs run.
//! - [`bodies`]: what a recording says of shapes and joints.
//! - [`points`]: what is known of all that at every statement, before the run.
//! - [`listing`]: names in a row, for all who write for people.

pub mod bodies;
pub mod codes;
pub mod diagnostic;
pub mod equilibrium;
pub mod extent;
pub mod filling;
pub mod footing;
pub mod form;
pub mod framing;
pub mod graph;
pub mod hidden;
pub mod inertia;
pub mod interval;
pub mod inventory;
pub mod listing;
pub mod math;
pub mod mesh;
pub mod message;
pub mod modbus;
pub mod model;
pub mod offer;
pub mod outline;
pub mod pages;
pub mod plan;
pub mod points;
pub mod pose;
pub mod program;
pub mod quantity;
pub mod robot;
pub mod scene;
pub mod script;
pub mod span;
pub mod study;
pub mod text;
pub mod tilting;
pub mod undefined;
pub mod values;
pub mod wire;

pub use codes::Code;
pub use diagnostic::{Diagnostic, Edit, Fix, Label, Missing, Severity};
pub use graph::{BinaryOp, Env, Graph, Leaves, NodeId, Op, UnaryOp};
pub use program::Program;
pub use quantity::Unit;
pub use span::{FileId, Sources, Span};
pub use text::{Said, Text, TextPart};
