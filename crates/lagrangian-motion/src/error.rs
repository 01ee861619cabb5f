//! The one error type of the library: variants carry values, messages end with the remedy.

use std::fmt::Display;

use crate::shown;

/// An error of the library. A diverged rollout or a fit that did not converge is an outcome, not an error.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// Reading or writing failed in the operating system.
    #[error(transparent)]
    Io(#[from] std::io::Error),

    /// An argument is outside its domain.
    #[error("{name} is {value}: it must be {must}")]
    Argument {
        /// Name of the argument.
        name: &'static str,
        /// The given value.
        value: String,
        /// The condition that it must meet.
        must: &'static str,
    },

    /// A setting is not allowed where it was given.
    #[error("{problem}: {remedy}")]
    Setting {
        /// The setting, in backticks, and the reason.
        problem: String,
        /// The remedy.
        remedy: String,
    },

    /// A fit of the data would be meaningless.
    #[error("a fit of this data would be meaningless: {finding}: {remedy}")]
    Data {
        /// The trajectory, the failed check, and its finding.
        finding: String,
        /// The remedy.
        remedy: String,
    },

    /// A size differs from the one that it must have.
    #[error("{what} has {found} values where {expected} are needed: {remedy}")]
    Shape {
        /// The quantity of the wrong size.
        what: String,
        /// The actual size.
        found: usize,
        /// The required size.
        expected: usize,
        /// The remedy.
        remedy: String,
    },

    /// A name is unknown.
    #[error("there is no {kind} '{}': choose one of {known}", shortened(name))]
    UnknownName {
        /// The kind of thing that was named, e.g. `system`.
        kind: &'static str,
        /// The given name.
        name: String,
        /// The known names.
        known: String,
    },

    /// A value is NaN or infinite.
    #[error("{what} is not finite at index {index}: remove or repair that sample")]
    NotFinite {
        /// The signal or parameter.
        what: String,
        /// Its index.
        index: usize,
    },

    /// The weights of a network or the name of an instruction set were refused.
    #[error(transparent)]
    Network(#[from] nets::Error),

    /// A file is not a saved model.
    #[error("not a saved model ({found}): give a model.safetensors that `lagrangian fit` wrote")]
    NotAModel {
        /// A description of the actual contents.
        found: String,
    },

    /// A saved model comes from a later version.
    #[error(
        "the saved model has format version {found}, this program reads up to {known}: install a newer one"
    )]
    NewerModel {
        /// The version in the file.
        found: u32,
        /// The newest known version.
        known: u32,
    },

    /// A saved model is incomplete or contradicts itself.
    #[error("the saved model is damaged ({reason}): copy it again or repeat the fit")]
    DamagedModel {
        /// The fault.
        reason: String,
    },

    /// A weight of a saved model is missing, unknown, of the wrong shape or type, or not finite.
    #[error(
        "weight '{name}' {problem}: the saved model does not fit its own description, repeat the fit"
    )]
    Tensor {
        /// Name of the weight.
        name: String,
        /// The fault.
        problem: String,
    },

    /// The columns of a file do not match the required ones.
    #[error("{finding} (columns found: {found}): {remedy}")]
    Columns {
        /// The missing, duplicated or mismatched columns.
        finding: String,
        /// The columns of the file, separated by commas.
        found: String,
        /// The remedy.
        remedy: String,
    },

    /// A cell of a file is not a number.
    #[error(
        "line {line}, column '{column}': '{text}' is not a number: correct that cell, or leave it empty and remove the row"
    )]
    Cell {
        /// Line (text formats, the header is line 1) or row (binary formats, the first is 1) of the file.
        line: u64,
        /// Name of the column.
        column: String,
        /// The text of the cell.
        text: String,
    },

    /// A cell of a text file is a number with a decimal comma.
    #[error(
        "line {line}, column '{column}': '{text}' has a decimal comma: write decimal points, e.g. `tr , . < old.csv > new.csv` where semicolons or tabs stand between the columns"
    )]
    DecimalComma {
        /// Line of the file, the header is line 1.
        line: u64,
        /// Name of the column.
        column: String,
        /// The text of the cell.
        text: String,
    },

    /// Bytes are not a file of the format that they claim to be, or the file is damaged.
    #[error("this is not a readable {format} file: {reason}")]
    Malformed {
        /// The format.
        format: &'static str,
        /// The fault, and the remedy.
        reason: String,
    },

    /// A file format is unknown, or omitted from this build.
    #[error("files '.{extension}' cannot be read or written: {remedy}")]
    Format {
        /// The file extension.
        extension: String,
        /// The remedy.
        remedy: String,
    },

    /// A configuration text (TOML) is wrong.
    #[error("the description of the columns is wrong: {0}")]
    Layout(String),

    /// There is too little data.
    #[error(
        "{what} has {found} of the {needed} samples that are needed: record a longer motion, or thin it less (`every`)"
    )]
    TooShort {
        /// The file or trajectory.
        what: String,
        /// Number of samples found.
        found: usize,
        /// Number of samples needed.
        needed: usize,
    },

    /// One sample of a recording cannot be used.
    #[error(
        "trajectory '{trajectory}', sample {row} (counted from 1), column '{column}': {finding}: {remedy}"
    )]
    Sample {
        /// The trajectory.
        trajectory: String,
        /// The sample within it, the first is 1.
        row: usize,
        /// The column.
        column: String,
        /// The fault.
        finding: String,
        /// The remedy.
        remedy: &'static str,
    },

    /// A coordinate that is declared as a parameter is not constant.
    #[error(
        "'{name}' is declared as a parameter, but its {what} at sample {sample} (counted from 1) is not 0: a parameter is constant along a trajectory; omit it from `parameters` if it moves"
    )]
    Moves {
        /// The coordinate.
        name: String,
        /// The rate that is not 0.
        what: String,
        /// The first sample where it is not 0.
        sample: usize,
    },

    /// The description of a robot cannot be used.
    #[error("the robot cannot be used: {finding}: {remedy}")]
    Robot {
        /// The fault, with the name of the link or joint.
        finding: String,
        /// The remedy.
        remedy: &'static str,
    },

    /// A checkpoint cannot be read or written.
    #[error("not a usable checkpoint: {reason}; restart the fit without `resume`")]
    Checkpoint {
        /// The fault.
        reason: String,
    },
}

/// Largest number of characters of a value that a message repeats.
const MOST_SHOWN: usize = 60;

/// A value in the form that messages use: one line of limited length.
pub fn shortened(text: &str) -> String {
    let mut short: String = text.chars().take(MOST_SHOWN).collect();
    if text.chars().nth(MOST_SHOWN).is_some() {
        short.push('…');
    }
    shown(&short)
}

/// A number of things, in the singular for one.
///
/// ```
/// assert_eq!(lagrangian_motion::counted(1, "joint"), "1 joint");
/// assert_eq!(lagrangian_motion::counted(2, "trajectory"), "2 trajectories");
/// ```
#[must_use]
pub fn counted(count: usize, what: &str) -> String {
    match (count, what.strip_suffix('y')) {
        (1, _) => format!("1 {what}"),
        (_, Some(stem)) => format!("{count} {stem}ies"),
        _ => format!("{count} {what}s"),
    }
}

/// Largest number of characters of a message of another program.
const MOST_TOLD: usize = 600;

/// A message that may quote its input: quotations are shortened and [`shown`], and long lines and the whole are shortened.
///
/// ```
/// let told = format!("unknown field `{}`, expected `t`", "x".repeat(10_000));
/// assert!(lagrangian_motion::brief(&told).len() < 120);
/// assert!(lagrangian_motion::brief(&told).ends_with("expected `t`"));
/// ```
#[must_use]
pub fn brief(message: &str) -> String {
    let lines: Vec<String> = message.lines().map(brief_line).collect();
    let text = lines.join("\n");
    match text.char_indices().nth(MOST_TOLD) {
        None => text,
        Some((end, _)) => format!("{}…", &text[..end]),
    }
}

/// Largest number of characters of a line that is not a quotation.
const LONGEST_LINE: usize = 240;

fn brief_line(line: &str) -> String {
    let mut short = String::new();
    let mut rest = line;
    while let Some((open, mark)) = opening(rest) {
        let inside = &rest[open + 1..];
        let Some(close) = inside.find(mark) else {
            break;
        };
        short += &brief_words(&rest[..=open]);
        short += &shortened(&inside[..close]);
        short.push(mark);
        rest = &inside[close + 1..];
    }
    short += &brief_words(rest);
    // The beginning states the fault, and the end the remedy.
    let length = short.chars().count();
    if length <= LONGEST_LINE {
        return short;
    }
    let begin: String = short.chars().take(LONGEST_LINE / 2).collect();
    let end: String = short.chars().skip(length - LONGEST_LINE / 2).collect();
    format!("{begin}…{end}")
}

/// Unquoted text, with words of ordinary length.
fn brief_words(text: &str) -> String {
    let words: Vec<String> = text.split(' ').map(shortened).collect();
    words.join(" ")
}

/// The first quotation mark of a line; an apostrophe within a word does not count.
fn opening(line: &str) -> Option<(usize, char)> {
    let mut before = ' ';
    line.char_indices().find(|(_, mark)| {
        let in_word = std::mem::replace(&mut before, *mark).is_alphanumeric();
        matches!(mark, '"' | '`') || *mark == '\'' && !in_word
    })
}

impl Error {
    /// An [`Error::Argument`].
    pub fn argument(name: &'static str, value: impl ToString, must: &'static str) -> Self {
        let value = brief(&value.to_string());
        Self::Argument { name, value, must }
    }

    /// An [`Error::Layout`].
    pub fn layout(problem: impl Display) -> Self {
        Self::Layout(brief(&problem.to_string()))
    }

    /// An [`Error::Malformed`].
    pub fn malformed(format: &'static str, reason: impl Display) -> Self {
        let reason = brief(&reason.to_string());
        Self::Malformed { format, reason }
    }

    /// An [`Error::Setting`].
    pub fn setting(problem: impl Into<String>, remedy: impl Into<String>) -> Self {
        let (problem, remedy) = (brief(&problem.into()), remedy.into());
        Self::Setting { problem, remedy }
    }

    /// An [`Error::Shape`].
    pub fn shape(
        what: impl Into<String>,
        found: usize,
        expected: usize,
        remedy: impl Into<String>,
    ) -> Self {
        let (what, remedy) = (what.into(), remedy.into());
        Self::Shape {
            what,
            found,
            expected,
            remedy,
        }
    }

    /// An [`Error::NotFinite`].
    pub fn not_finite(what: impl Into<String>, index: usize) -> Self {
        let what = what.into();
        Self::NotFinite { what, index }
    }

    /// An [`Error::TooShort`].
    pub fn too_short(what: impl Into<String>, found: usize, needed: usize) -> Self {
        let what = what.into();
        Self::TooShort {
            what,
            found,
            needed,
        }
    }

    /// Refuses values that contain NaN or infinity.
    ///
    /// # Errors
    /// [`Error::NotFinite`] with the index of the first.
    pub fn check_finite(what: impl Display, values: &[f64]) -> Result<()> {
        match values.iter().position(|x| !x.is_finite()) {
            None => Ok(()),
            Some(index) => Err(Self::not_finite(what.to_string(), index)),
        }
    }

    /// Refuses a number of values that is not the expected one.
    ///
    /// # Errors
    /// [`Error::Shape`].
    pub fn check_shape(
        what: impl Display,
        found: usize,
        expected: usize,
        remedy: impl Display,
    ) -> Result<()> {
        if found == expected {
            return Ok(());
        }
        let (what, remedy) = (what.to_string(), remedy.to_string());
        Err(Self::shape(what, found, expected, remedy))
    }

    /// Refuses more coordinates than networks are trained with.
    ///
    /// # Errors
    /// [`Error::Argument`] if `n` is above `most`.
    pub fn check_dof(n: usize, most: usize) -> Result<()> {
        if n <= most {
            return Ok(());
        }
        let must = "at most 64: choose the coordinates to fit with `q`";
        Err(Self::argument("degrees of freedom", n, must))
    }
}

/// Result with the error type of this library.
pub type Result<T> = std::result::Result<T, Error>;
