//! `matterixc discover`.

use std::time::Duration;

use matterix_ir::hidden::visible;
use matterix_sila_wire::discovery::{Found, look};

use crate::Exit;
use crate::args::DiscoverArgs;
use crate::terminal::{Stream, print};

/// Lists the servers of SiLA 2 that answer on the network.
pub fn discover(args: &DiscoverArgs) -> Exit {
    super::or_complain(look(Duration::from_secs_f64(args.time), None).map(|found| {
        found.iter().for_each(|server| print(Stream::Out, &shown(server)));
        if found.is_empty() {
            print(Stream::Err, &format!("no SiLA 2 server answered on the network within {} s\n", args.time));
        }
        Exit::Fine
    }))
}

fn shown(server: &Found) -> String {
    let addresses: Vec<String> = server.addresses.iter().map(ToString::to_string).collect();
    // What a server says of itself is one line each, whatever is in it.
    let line = |text: &str| visible(&text.split_whitespace().collect::<Vec<_>>().join(" ")).into_owned();
    let mut out = format!("{}  {}\n  {}\n", line(&server.uuid), line(&server.name), addresses.join(", "));
    for (name, text) in [("certificate", server.fingerprint.as_deref().unwrap_or_default()), ("", &server.description)]
    {
        if !text.is_empty() {
            out.push_str(&format!("  {}{}{}\n", name, if name.is_empty() { "" } else { ": " }, line(text)));
        }
    }
    out
}
