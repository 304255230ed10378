//! `matterixc lsp`.

use super::or_complain;
use crate::Exit;
use crate::args::LspArgs;
use crate::lsp;

/// Answers an editor until it says good-bye.
pub fn lsp(_: &LspArgs) -> Exit {
    or_complain(lsp::serve())
}
