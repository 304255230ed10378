//! A page that shows a lab and plays a recording in three dimensions.
//!
//! [`document`] says what the page shows, as data; [`from_program`] makes one of a compiled lab, [`from_recording`] of the
//! `recording.mcap` that a run leaves behind, [`robot`] adds the links of a robot and their ways. [`page`] makes one
//! self-contained file of a document and [`serve`] hands it to a browser on the same machine. The page itself is written
//! in `page/` and kept, bundled, in `assets/`.

pub mod document;
pub mod from_program;
pub mod from_recording;
pub mod page;
pub mod robot;
pub mod serve;

mod bench;
mod placement;
mod thin;
mod units;

pub use document::Document;
