//! One run of the command, and the folder in which it runs.

use std::fs;
use std::path::PathBuf;
use std::process::{Command, Output};

/// The command under test.
pub(super) struct Bench {
    /// The program.
    pub(super) binary: PathBuf,
    /// The folder in which it runs.
    pub(super) folder: PathBuf,
    /// The value of `LAGRANGIAN_SIMD`.
    pub(super) instructions: String,
}

/// One run of the command.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Line {
    /// The arguments, separated by spaces, without the ones for the output of figures.
    text: String,
    /// The value of `RAYON_NUM_THREADS`.
    threads: usize,
}

impl Line {
    /// A run on one thread.
    pub(super) fn new(text: impl Into<String>) -> Self {
        let text: String = text.into();
        Self {
            text: text.split_whitespace().collect::<Vec<_>>().join(" "),
            threads: 1,
        }
    }

    /// The same run on several threads.
    pub(super) fn on_threads(self, threads: usize) -> Self {
        Self { threads, ..self }
    }

    /// A run on one thread or on two, as a hash of its text has it: a list then needs each line once only, and keeps its
    /// keys when lines are added.
    pub(super) fn on_either(text: impl Into<String>) -> Self {
        let line = Self::new(text);
        let threads = 1 + (hash(line.text.as_bytes()) >> 32) as usize % 2;
        line.on_threads(threads)
    }

    /// What the record calls it.
    pub(super) fn key(&self) -> String {
        match self.threads {
            1 => self.text.clone(),
            threads => format!("{} [{threads} threads]", self.text),
        }
    }

    /// The word after a flag.
    fn value(&self, flag: &str) -> Option<&str> {
        let mut words = self.text.split(' ').skip_while(|word| *word != flag);
        words.nth(1)
    }

    /// Where its results go: by its own words, else into a folder of its own.
    pub(super) fn output(&self) -> String {
        let own = self.value("--out").map(String::from);
        own.unwrap_or_else(|| format!("run-{:016x}", hash(self.key().as_bytes())))
    }

    /// Runs it to its end.
    pub(super) fn run(&self, bench: &Bench) -> Result<Output, String> {
        let mut command = Command::new(&bench.binary);
        command.current_dir(&bench.folder);
        command.env("LAGRANGIAN_SIMD", &bench.instructions);
        command.env("RAYON_NUM_THREADS", self.threads.to_string());
        command
            .args(self.text.split(' '))
            .args(["--json", "--quiet"]);
        if self.text.starts_with("fit ") && self.value("--out").is_none() {
            command.args(["--out", &self.output()]);
        }
        command
            .output()
            .map_err(|e| format!("{}: {e}", bench.binary.display()))
    }
}

impl Bench {
    /// Makes its folder anew, empty.
    pub(super) fn clear(&self) -> Result<(), String> {
        let fail = |e: std::io::Error| format!("{}: {e}", self.folder.display());
        if self.folder.exists() {
            fs::remove_dir_all(&self.folder).map_err(fail)?;
        }
        fs::create_dir_all(&self.folder).map_err(fail)
    }
}

/// The hash FNV-1a of 64 bits (Fowler, Noll and Vo): the same on every machine and in every version of Rust.
pub(super) fn hash(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
        (hash ^ u64::from(*byte)).wrapping_mul(0x0000_0100_0000_01b3)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hash_is_that_of_its_authors() {
        assert_eq!(hash(b""), 0xcbf2_9ce4_8422_2325);
        assert_eq!(hash(b"foobar"), 0x8594_4171_f739_67e8);
    }

    #[test]
    fn a_line_is_known_by_its_text_and_its_threads() {
        let line = Line::new("fit  a.csv --out run");
        assert_eq!(line.key(), "fit a.csv --out run");
        assert_eq!(line.output(), "run");
        assert_eq!(line.on_threads(2).key(), "fit a.csv --out run [2 threads]");
    }
}
