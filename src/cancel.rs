//! Ctrl-C and the other signals that end a command: the first asks the run to stop, so that every `finally` runs; the second ends the command at once.

use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};

use matterix_runtime::record::give_up;

use crate::terminal::{Stream, finish, print};

static PRESSED: AtomicBool = AtomicBool::new(false);
/// Set when a command is to end early.
pub static ASKED: AtomicBool = AtomicBool::new(false);

static LAST_WORDS: OnceLock<fn() -> String> = OnceLock::new();

/// Exit status of a command that was interrupted twice: it did not come to its end.
const INTERRUPTED: i32 = 1;

/// What is said when it ends at once.
pub fn last_words(say: fn() -> String) {
    LAST_WORDS.get_or_init(|| say);
}

/// From here on Ctrl-C, Ctrl-\, a request to terminate and a terminal that is closed set the flag returned.
pub fn on_interrupt() -> Result<&'static AtomicBool, String> {
    listen("\nstopping: `finally` runs first; Ctrl-C again ends at once\n")
}

/// The same for what can stop at once, with nothing to say.
pub fn on_interrupt_quietly() -> Result<&'static AtomicBool, String> {
    listen("\n")
}

/// Asks for it as Ctrl-C does; one more Ctrl-C ends at once.
pub fn ask(said: &str) {
    PRESSED.store(true, Ordering::SeqCst);
    print(Stream::Err, said);
    ASKED.store(true, Ordering::SeqCst);
}

fn listen(said: &'static str) -> Result<&'static AtomicBool, String> {
    let handler = move || {
        if PRESSED.swap(true, Ordering::SeqCst) {
            if let Some(say) = LAST_WORDS.get() {
                print(Stream::Err, &say());
            }
            // Files that belong together are all there or none.
            let _given_up = give_up();
            finish();
            std::process::exit(INTERRUPTED);
        }
        print(Stream::Err, said);
        // Said before it is asked for: what `finally` does comes after it in the text.
        ASKED.store(true, Ordering::SeqCst);
    };
    ctrlc::set_handler(handler).map_err(|e| format!("cannot listen for Ctrl-C: {e}"))?;
    others(handler).map_err(|e| format!("cannot listen for signals: {e}"))?;
    Ok(&ASKED)
}

/// Ctrl-\ ends a command as Ctrl-C does. A file that may not become larger is an error of who writes it, and ends nothing by itself.
#[cfg(unix)]
fn others(handler: impl Fn() + Send + 'static) -> std::io::Result<()> {
    use signal_hook::consts::{SIGQUIT, SIGXFSZ};

    signal_hook::flag::register(SIGXFSZ, std::sync::Arc::new(AtomicBool::new(false)))?;
    let mut signals = signal_hook::iterator::Signals::new([SIGQUIT])?;
    std::thread::spawn(move || signals.forever().for_each(|_| handler()));
    Ok(())
}

#[cfg(not(unix))]
fn others(_: impl Fn() + Send + 'static) -> std::io::Result<()> {
    Ok(())
}
