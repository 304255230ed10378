//! One file per subcommand.

mod bill;
mod check;
mod deploy;
#[cfg(feature = "sila")]
mod discover;
mod doc;
mod emit;
mod emulate;
mod explain;
mod fit;
mod fmt;
mod import;
mod labware;
mod lsp;
mod mcp;
mod named;
mod new;
mod plan;
mod play;
mod run;
#[cfg(feature = "sila")]
mod serve;
mod shell;
mod study;
mod substance;
mod test;
mod verify;
mod view;
mod watch;

pub use bill::bill;
pub use check::check;
pub use deploy::deploy;
#[cfg(feature = "sila")]
pub use discover::discover;
pub use doc::doc;
pub use emit::emit;
pub use emulate::emulate;
pub use explain::{explain, explanation};
pub use fit::fit;
pub use fmt::fmt;
pub use import::import;
pub use labware::labware;
pub use lsp::lsp;
pub use mcp::mcp;
pub use new::new;
pub use plan::plan;
pub use run::run;
#[cfg(feature = "sila")]
pub use serve::serve;
pub use shell::{completions, man};
pub use study::study;
pub use substance::substance;
pub use test::test;
pub use verify::verify;
pub use view::view;

use crate::Exit;
use crate::terminal::{Stream, print, print_error};

/// Prints the versions of the command, the language and the compiled program, and the commit of a release build.
pub fn version() -> Exit {
    let version = env!("CARGO_PKG_VERSION");
    let commit = option_env!("MATTERIX_COMMIT").map(|commit| format!(", commit {commit}")).unwrap_or_default();
    let program = matterix_ir::program::PROGRAM_VERSION;
    print(Stream::Out, &format!("matterixc {version} (mtx 1, program {program}{commit})\n"));
    Exit::Fine
}

/// How a command ended; what is wrong with usage or files is said on standard error.
fn or_complain(ended: Result<Exit, String>) -> Exit {
    ended.unwrap_or_else(|message| {
        print_error(&message);
        Exit::Usage
    })
}
