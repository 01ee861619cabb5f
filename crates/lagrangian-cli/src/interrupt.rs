//! Ctrl-C, and time that is up: the first ends a command cleanly, a second Ctrl-C at once.

use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::{Context, Result};
use lagrangian::Stop;

/// Exit code of a program ended by Ctrl-C (128 + SIGINT).
pub(crate) const INTERRUPTED: u8 = 130;

/// Whether Ctrl-C was pressed.
static PRESSED: AtomicBool = AtomicBool::new(false);
/// Whether to end, because Ctrl-C was pressed or time is up.
static ENDING: AtomicBool = AtomicBool::new(false);
/// Whether a handler of Ctrl-C is installed.
static LISTENING: AtomicBool = AtomicBool::new(false);

/// Ends the program, keeping only files that are complete.
pub(crate) fn end_now(code: u8) -> ! {
    lagrangian_run::remove_unfinished();
    std::process::exit(i32::from(code))
}

/// Installs a handler of Ctrl-C.
pub(crate) fn listen() -> Result<()> {
    if LISTENING.swap(true, Ordering::SeqCst) {
        return Ok(());
    }
    ctrlc::set_handler(|| {
        if PRESSED.swap(true, Ordering::SeqCst) {
            end_now(INTERRUPTED);
        }
        ENDING.store(true, Ordering::SeqCst);
        note!("\nending cleanly; press Ctrl-C again to stop at once");
    })
    .context("cannot listen for Ctrl-C")
}

/// Whether Ctrl-C was pressed.
pub(crate) fn is_pressed() -> bool {
    PRESSED.load(Ordering::SeqCst)
}

/// The stop of long computations.
pub(crate) fn stop() -> Stop {
    Stop::when(&ENDING)
}

/// Ends long computations, as if Ctrl-C were pressed.
pub(crate) fn time_is_up() {
    ENDING.store(true, Ordering::SeqCst);
}
