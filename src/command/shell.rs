//! `matterixc completions` and `matterixc man`: what shells and `man` are given of the command line.

use crate::Exit;
use crate::args::{CompletionsArgs, ManArgs};
use crate::help;
use crate::terminal::{Stream, print, print_error};

/// Prints what completes commands and options.
pub fn completions(args: &CompletionsArgs) -> Exit {
    let mut out = Vec::new();
    clap_complete::generate(args.shell, &mut help::cli(), "matterixc", &mut out);
    print(Stream::Out, &String::from_utf8_lossy(&out));
    Exit::Fine
}

/// Writes a page for the command and one for each subcommand: `matterixc.1`, `matterixc-run.1`.
pub fn man(args: &ManArgs) -> Exit {
    let written =
        std::fs::create_dir_all(&args.folder).and_then(|()| clap_mangen::generate_to(help::cli(), &args.folder));
    match written {
        Ok(()) => Exit::Fine,
        Err(why) => {
            print_error(&format!("cannot write pages to `{}`: {why}", args.folder.display()));
            Exit::Usage
        }
    }
}
