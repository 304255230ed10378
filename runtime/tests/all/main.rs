//! Tests of the runtime.

mod analytic;
mod analytic_sn1;
mod engine_events;
mod engine_fast;
mod engine_faults;
mod engine_model;
mod engine_parts;
mod engine_segments;
mod engine_sizes;
mod engine_unseen;
mod exec_asked;
mod exec_build;
mod exec_claims;
mod exec_dry;
mod exec_failure;
mod exec_flow;
mod exec_random;
mod exec_readings;
mod exec_stop;
mod fit;
mod ledger;

mod record;
mod stiff;
