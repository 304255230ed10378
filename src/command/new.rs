//! `matterixc new`.

use crate::Exit;
use crate::args::NewArgs;
use crate::files;
use crate::terminal::{Stream, print, print_error};

/// The files of a new project.
const PROJECT: &[(&str, &str)] = &[
    ("warm.mtx", include_str!("../template/warm.mtx")),
    ("README.md", include_str!("../template/README.md")),
    (".gitignore", include_str!("../template/gitignore")),
];

/// Creates the project and says what to type next.
pub fn new(args: &NewArgs) -> Exit {
    if let Err(message) = files::create_folder(&args.dir, PROJECT) {
        print_error(&message);
        return Exit::Usage;
    }
    let file = args.dir.join("warm.mtx");
    let created = args.dir.display();
    print(Stream::Out, &format!("created `{created}`; now try\n\n  matterixc run {}\n", file.display()));
    Exit::Fine
}
