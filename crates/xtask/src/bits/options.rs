//! The flags of `cargo xtask bits`.

use std::path::PathBuf;

use super::Failure;

/// Its lines of the usage.
pub(crate) const USAGE: &str = "\
bits [--record] [--binary PATH] [--simd NAME] [--jobs N] [WORD…]

  bits   the bits of some hundred short fits and the figures of every command, against bench/bits.json; prints every
         difference and ends with exit code 1 if there is one
           WORD            the entries whose keys contain all the words alone
           --record        write the record (of the entries that were asked for) in place of comparing
           --binary PATH   the command to run, in place of a fresh build
           --simd NAME     CPU instructions of the kernels, in place of avx2, which the record is made with
           --jobs N        runs of the command at a time [default: 2]";

/// Whether the record is read or written.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) enum Task {
    #[default]
    Compare,
    Record,
}

/// What the arguments ask for.
#[derive(Debug, PartialEq)]
pub(super) struct Options {
    pub(super) task: Task,
    pub(super) binary: Option<PathBuf>,
    pub(super) instructions: String,
    /// Runs of the command at a time.
    pub(super) jobs: usize,
    words: Vec<String>,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            task: Task::Compare,
            binary: None,
            instructions: "avx2".into(),
            jobs: 2,
            words: Vec::new(),
        }
    }
}

impl Options {
    /// Reads the arguments.
    pub(super) fn parse(arguments: &[&str]) -> Result<Self, Failure> {
        let mut options = Self::default();
        let mut rest = arguments.iter();
        while let Some(argument) = rest.next() {
            let mut value = || {
                rest.next()
                    .ok_or_else(|| usage(format!("{argument} needs a value")))
            };
            match *argument {
                "--record" => options.task = Task::Record,
                "--binary" => options.binary = Some(value()?.into()),
                "--simd" => options.instructions = value()?.to_string(),
                "--jobs" => options.jobs = count(value()?)?,
                flag if flag.starts_with("--") => {
                    return Err(usage(format!("bits does not know '{flag}'")));
                }
                word => options.words.push(word.into()),
            }
        }
        Ok(options)
    }

    /// Whether an entry was asked for.
    pub(super) fn asks(&self, key: &str) -> bool {
        self.words.iter().all(|word| key.contains(word))
    }
}

fn count(text: &str) -> Result<usize, Failure> {
    let count = text.parse().ok().filter(|n| *n > 0);
    count.ok_or_else(|| usage(format!("--jobs: '{text}' is not a whole number above 0")))
}

fn usage(message: String) -> Failure {
    Failure::Usage {
        message,
        hint: format!("usage: cargo xtask {USAGE}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_choose_entries_and_flags_are_known() {
        let options = Options::parse(&["--record", "--simd", "portable", "fit", "delan"]);
        let options = options.unwrap_or_default();
        assert_eq!(options.task, Task::Record);
        assert_eq!(options.instructions, "portable");
        assert!(options.asks("fit arm.csv --model delan") && !options.asks("fit arm.csv"));
        assert!(Options::parse(&["--fast"]).is_err() && Options::parse(&["--binary"]).is_err());
    }
}
