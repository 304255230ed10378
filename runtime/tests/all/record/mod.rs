//! What a run leaves behind.

mod contents;
mod docs;
mod fixture;
mod mcap;
mod parquet;
mod plot;
mod report;
