//! The matterix command: arguments, files, and findings on a terminal. All meaning is in the crates below.

/// Checking makes many small values; this allocator is a fifth faster at it than the system's.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

mod args;
mod aside;
mod cache;
mod cancel;
mod command;
mod files;
mod help;
#[cfg(feature = "sila")]
mod identity;
mod keys;
mod lsp;
mod mcp;
mod panel;
mod pipeline;
mod progress;
mod reads;
mod record;
mod report;
mod terminal;
mod tips;
mod uri;

use std::process::ExitCode;

use args::{Cli, Command};
use terminal::{Stream, print};

/// How a command ended; a worse end is greater.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Exit {
    /// Nothing wrong.
    Fine,
    /// Findings, a failed run or a failed expectation.
    Findings,
    /// Usage or files.
    Usage,
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> ExitCode {
        ExitCode::from(match exit {
            Exit::Fine => 0,
            Exit::Findings => 1,
            Exit::Usage => 2,
        })
    }
}

fn main() -> ExitCode {
    let cli = match help::parse() {
        Ok(cli) => cli,
        Err(message) => {
            let is_wrong = message.use_stderr();
            print(if is_wrong { Stream::Err } else { Stream::Out }, &message.render().to_string());
            return if is_wrong { Exit::Usage } else { Exit::Fine }.into();
        }
    };
    // Every pass over a text goes as deep as its brackets; the deepest that are read need more than a thread's usual stack.
    let worker = std::thread::Builder::new().stack_size(STACK).spawn(move || dispatch(cli));
    let ended = worker.map(std::thread::JoinHandle::join);
    terminal::finish();
    match ended {
        Ok(Ok(exit)) => match terminal::lost() {
            None => exit.into(),
            Some(why) => {
                terminal::print_error(&format!("cannot write to standard output: {why}"));
                terminal::finish();
                Exit::Usage.into()
            }
        },
        _ => ExitCode::from(101),
    }
}

/// Bytes; only what is used of it is ever taken.
const STACK: usize = 512 << 20;

fn dispatch(cli: Cli) -> Exit {
    match cli.command {
        Command::Check(args) => command::check(&args, cli.color),
        Command::Fmt(args) => command::fmt(&args, cli.color),
        Command::Run(args) => command::run(&args, cli.color),
        Command::Test(args) => command::test(&args, cli.color),
        Command::Bill(args) => command::bill(&args, cli.color),
        Command::Study(args) => command::study(&args, cli.color),
        Command::Fit(args) => command::fit(&args, cli.color),
        Command::Doc(args) => command::doc(&args, cli.color),
        Command::Emit(args) => command::emit(&args, cli.color),
        Command::Import(args) => command::import(&args),
        Command::Plan(args) => command::plan(&args, cli.color),
        Command::Deploy(args) => command::deploy(&args, cli.color),
        Command::Emulate(args) => command::emulate(&args, cli.color),
        #[cfg(feature = "sila")]
        Command::Serve(args) => command::serve(&args, cli.color),
        #[cfg(feature = "sila")]
        Command::Discover(args) => command::discover(&args),
        Command::Verify(args) => command::verify(&args),
        Command::View(args) => command::view(&args, cli.color),
        Command::Lsp(args) => command::lsp(&args),
        Command::Explain(args) => command::explain(&args),
        Command::Labware(args) => command::labware(&args),
        Command::Substance(args) => command::substance(&args),
        Command::Mcp(args) => command::mcp(&args),
        Command::New(args) => command::new(&args),
        Command::Completions(args) => command::completions(&args),
        Command::Man(args) => command::man(&args),
        Command::Version => command::version(),
    }
}
