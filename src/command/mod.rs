//! One file per subcommand.

mod bill;
mod check;
mod doc;
mod explain;
mod fmt;
mod new;
mod plan;
mod run;
mod test;

pub use bill::bill;
pub use check::check;
pub use doc::doc;
pub use explain::explain;
pub use fmt::fmt;
pub use new::new;
pub use plan::plan;
pub use run::run;
pub use test::test;

use crate::Exit;
use crate::terminal::{Stream, print};

/// Prints the versions of the command, the language and the compiled program.
pub fn version() -> Exit {
    let version = env!("CARGO_PKG_VERSION");
    print(Stream::Out, &format!("matterixc {version} (mtx 1, program {})\n", matterix_ir::program::PROGRAM_VERSION));
    Exit::Fine
}
