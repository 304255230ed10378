//! `matterixc mcp`.

use crate::Exit;
use crate::args::McpArgs;
use crate::mcp;

/// Serves one client until it closes its end.
pub fn mcp(args: &McpArgs) -> Exit {
    super::or_complain(mcp::serve(&args.root).map(|()| Exit::Fine))
}
