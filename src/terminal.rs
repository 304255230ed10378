//! Standard output and standard error: written as far as somebody reads, coloured only for people.

use std::io::{self, IsTerminal, Write};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use matterix_ir::hidden::visible;

use crate::args::Color;
use crate::aside::Aside;
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

/// What waits to be written to standard output and standard error, once they are written aside.
static WAITING: [Aside; 2] = [Aside::new(), Aside::new()];

/// Whether they are.
static IS_ASIDE: AtomicBool = AtomicBool::new(false);

/// So long what waits for each of them may take to be written at the end.
const LAST: Duration = Duration::from_secs(1);

/// From here on nothing that is written waits for a reader: a terminal that was told to stand still, or a pipe that nobody reads,
/// would hold up who feeds watchdogs and heeds a stop.
pub fn step_aside() -> Result<(), String> {
    let [out, err] = &WAITING;
    let named = |name: &str| std::thread::Builder::new().name(name.to_owned());
    let begun = named("standard output")
        .spawn(|| out.serve(pour_now))
        .and_then(|_| named("standard error").spawn(|| err.serve(|text| drop(write(io::stderr().lock(), text)))));
    begun.map_err(|e| format!("cannot write aside: {e}"))?;
    IS_ASIDE.store(true, Ordering::SeqCst);
    // A thread that breaks down would wait for the reader before anybody hears of it.
    std::panic::set_hook(Box::new(|panic| print(Stream::Err, &format!("{panic}\n"))));
    Ok(())
}

/// At the end: what waits is written, as far as somebody reads it within seconds, and it is said how much was left out.
pub fn finish() {
    if !IS_ASIDE.load(Ordering::SeqCst) {
        return;
    }
    let left_out: u64 = WAITING.iter().map(|stream| stream.drained(LAST)).sum();
    if left_out > 0 {
        let lines = if left_out == 1 { "1 line was".to_owned() } else { format!("{left_out} lines were") };
        print(Stream::Err, &format!("{lines} not shown because nobody read them; a journal has all of them\n"));
        WAITING[1].drained(LAST);
    }
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
        Stream::Err if IS_ASIDE.load(Ordering::SeqCst) => WAITING[1].put(text.as_bytes()),
        // There is nowhere left to say that this failed.
        Stream::Err => drop(write(io::stderr().lock(), text.as_bytes())),
    }
}

/// Writes a result that may not be text.
pub fn pour(bytes: &[u8]) {
    if IS_ASIDE.load(Ordering::SeqCst) { WAITING[0].put(bytes) } else { pour_now(bytes) }
}

fn pour_now(bytes: &[u8]) {
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
