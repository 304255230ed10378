//! Standard output and standard error: written as far as somebody reads, coloured only for people.

use std::io::{self, IsTerminal, Write};
use std::sync::OnceLock;

use matterix_ir::hidden::visible;

use crate::args::Color;
use crate::report::Look;

/// Width where no terminal tells one.
const WIDTH: usize = 100;

/// The narrowest and widest running text that reads well.
const READABLE: std::ops::RangeInclusive<usize> = 40..=120;

/// A standard stream.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stream {
    /// Results.
    Out,
    /// Everything else.
    Err,
}

/// Why a result could not be written, the first time.
static LOST: OnceLock<String> = OnceLock::new();

/// Why results could not be written to standard output, if they could not.
pub fn lost() -> Option<&'static str> {
    LOST.get().map(String::as_str)
}

/// Writes text; a reader that has gone away ends the writing, not the command. What a terminal would obey is written in letters: texts of
/// files, devices and servers are in it, and none of them may clear a screen or hide a line.
pub fn print(stream: Stream, text: &str) {
    paint(stream, &visible(text));
}

/// Writes text as it is, with the escape sequences that this command puts into it.
pub fn paint(stream: Stream, text: &str) {
    match stream {
        Stream::Out => pour(text.as_bytes()),
        // There is nowhere left to say that this failed.
        Stream::Err => drop(write(io::stderr().lock(), text.as_bytes())),
    }
}

/// Writes a result that may not be text.
pub fn pour(bytes: &[u8]) {
    if let Err(why) = write(io::stdout().lock(), bytes)
        && why.kind() != io::ErrorKind::BrokenPipe
    {
        LOST.get_or_init(|| crate::files::reason(&why));
    }
}

/// Writes one `error: ` line to standard error.
pub fn print_error(message: &str) {
    print(Stream::Err, &format!("error: {message}\n"));
}

/// How to lay out findings on a stream.
pub fn look(stream: Stream, color: Color) -> Look {
    let color = match color {
        Color::Always => true,
        Color::Never => false,
        Color::Auto => {
            is_terminal(stream) && !is_set("NO_COLOR") && std::env::var_os("TERM").is_none_or(|t| t != "dumb")
        }
    };
    Look { color, width: width(stream) }
}

/// Whether a person is at the other end.
pub fn is_terminal(stream: Stream) -> bool {
    match stream {
        Stream::Out => io::stdout().is_terminal(),
        Stream::Err => io::stderr().is_terminal(),
    }
}

/// Columns of the terminal at the other end, or 100.
pub fn width(stream: Stream) -> usize {
    let size = match stream {
        Stream::Out => terminal_size::terminal_size_of(io::stdout()),
        Stream::Err => terminal_size::terminal_size_of(io::stderr()),
    };
    size.map_or(WIDTH, |(width, _)| usize::from(width.0)).clamp(*READABLE.start(), *READABLE.end())
}

fn is_set(name: &str) -> bool {
    std::env::var_os(name).is_some_and(|value| !value.is_empty())
}

fn write(mut to: impl Write, bytes: &[u8]) -> io::Result<()> {
    to.write_all(bytes)?;
    to.flush()
}
