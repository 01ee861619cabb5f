//! What must hold for any bytes in the place of a file: one function for each parser of the library.
//!
//! A target reads bytes as one kind of file. It refuses them with a message, or it uses what they hold: a motion is checked,
//! prepared, written and read again, a model is evaluated, a run is resumed. It panics where something does not hold. The
//! driver (`src/main.rs`) and libFuzzer (`libfuzzer/`) call the same functions.

#![forbid(unsafe_code)]
#![allow(
    clippy::missing_errors_doc,
    reason = "each target refuses bytes that are no file of its kind"
)]

pub mod mutate;
mod targets;

pub use targets::{
    checkpoint, csv, dataset, fits, layout, model, npy, npz, resumed, settings, table, urdf,
};

/// What a target made of its bytes: nothing where they were accepted, else why not.
pub type Outcome = Result<(), String>;

/// A parser with what must hold of what it accepts.
#[derive(Debug, Clone, Copy)]
pub struct Target {
    /// The name, which is that of its folder in `corpus/` too.
    pub name: &'static str,
    /// Whether its files are text.
    pub text: bool,
    /// Reads bytes and uses what they hold.
    pub run: fn(&[u8]) -> Outcome,
}

const fn target(name: &'static str, text: bool, run: fn(&[u8]) -> Outcome) -> Target {
    Target { name, text, run }
}

/// All targets.
pub const TARGETS: [Target; 10] = [
    target("csv", true, csv),
    target("table", true, table),
    target("npz", false, npz),
    target("npy", false, npy),
    target("layout", true, layout),
    target("settings", true, settings),
    target("urdf", true, urdf),
    target("model", false, model),
    target("checkpoint", false, checkpoint),
    target("fits", false, fits),
];

/// The longest message: a file of any length is refused in a few lines.
pub const LONGEST_MESSAGE: usize = 3000;

/// The message of an error, which repeats little of what was read.
fn refused(error: impl ToString) -> String {
    let message = error.to_string();
    let length = message.chars().count();
    assert!(
        length <= LONGEST_MESSAGE,
        "a message of {length} characters: {}…",
        message.chars().take(300).collect::<String>()
    );
    message
}

/// Bytes that are read as text, as the command reads it.
fn text(bytes: &[u8]) -> Result<&str, String> {
    std::str::from_utf8(bytes).map_err(refused)
}
