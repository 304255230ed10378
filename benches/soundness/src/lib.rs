//! Random labs and plans, judged by the checker, the twin and an interpreter that was written from `docs/language.md` and the texts
//! of the library alone. [docs/soundness.md](../../../docs/soundness.md) says what is compared.

pub mod explore;
pub mod generate;
pub mod interpret;
pub mod judge;
pub mod plan;
pub mod print;
pub mod random;
pub mod report;
pub mod shrink;
pub mod survey;
pub mod world;
