//! Ctrl-C, and time that is up: the first ends a command cleanly, a second Ctrl-C at once.

use std::fs;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};

use anyhow::{Context, Result};
use lagrangian::Stop;

/// Exit code of a program ended by Ctrl-C (128 + SIGINT).
pub(crate) const INTERRUPTED: u8 = 130;

/// Whether Ctrl-C was pressed.
static PRESSED: AtomicBool = AtomicBool::new(false);
/// Whether to end, because Ctrl-C was pressed or time is up.
static ENDING: AtomicBool = AtomicBool::new(false);
/// Whether Ctrl-C is listened for.
static LISTENING: AtomicBool = AtomicBool::new(false);

/// Files that are not complete, and folders that hold nothing yet.
static UNFINISHED: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// Takes files that are not complete, and folders that hold nothing yet: [`end_now`] removes those that are still so.
pub(crate) fn remove_at_forced_end(paths: impl IntoIterator<Item = PathBuf>) {
    let mut all = UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner);
    all.extend(paths);
}

/// Ends the program, with what it has written completely and nothing else.
pub(crate) fn end_now(code: u8) -> ! {
    let all = UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner);
    // OK to ignore: a file that was completed has another name by now, and a folder that holds anything stays.
    all.iter().for_each(|path| drop(fs::remove_file(path)));
    all.iter().for_each(|path| drop(fs::remove_dir(path)));
    std::process::exit(i32::from(code))
}

/// Listens for Ctrl-C from now on.
pub(crate) fn listen() -> Result<()> {
    if LISTENING.swap(true, Ordering::SeqCst) {
        return Ok(());
    }
    ctrlc::set_handler(|| {
        if PRESSED.swap(true, Ordering::SeqCst) {
            end_now(INTERRUPTED);
        }
        ENDING.store(true, Ordering::SeqCst);
        tell!("\nending cleanly; press Ctrl-C again to stop at once");
    })
    .context("cannot listen for Ctrl-C")
}

/// Whether Ctrl-C was pressed.
pub(crate) fn is_pressed() -> bool {
    PRESSED.load(Ordering::SeqCst)
}

/// What long computations ask whether to end.
pub(crate) fn stop() -> Stop {
    Stop::when(&ENDING)
}

/// Ends long computations, as if Ctrl-C were pressed.
pub(crate) fn time_is_up() {
    ENDING.store(true, Ordering::SeqCst);
}
