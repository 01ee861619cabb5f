//! The command line of a bench.

use std::fs::OpenOptions;
use std::io::Write;
use std::path::PathBuf;
use std::process::exit;

use serde_json::Value;

/// The options of a bench.
pub(super) struct Options {
    pub(super) smoke: bool,
    /// Words that the name of a row must contain.
    pub(super) words: Vec<String>,
    json: Option<PathBuf>,
}

impl Options {
    pub(super) fn from_command_line(bench: &str) -> Self {
        let mut options = Self {
            // `cargo bench` passes `--bench`; `cargo test --benches` does not.
            smoke: true,
            words: Vec::new(),
            json: None,
        };
        let mut asked = false;
        let mut arguments = std::env::args().skip(1);
        while let Some(argument) = arguments.next() {
            match argument.as_str() {
                "--bench" => options.smoke = false,
                "--smoke" | "--test" | "--quick" => asked = true,
                "--json" => match arguments.next() {
                    Some(path) => options.json = Some(path.into()),
                    None => refuse(bench, "--json needs the name of a file"),
                },
                flag if flag.starts_with('-') => refuse(bench, &format!("unknown flag '{flag}'")),
                _ => options.words.push(argument),
            }
        }
        options.smoke |= asked;
        options
    }

    /// Appends a line to the file of figures, if one is given.
    pub(super) fn write(&self, line: impl FnOnce() -> Value) {
        let Some(path) = &self.json else { return };
        let file = OpenOptions::new().create(true).append(true).open(path);
        let written = file.and_then(|mut file| writeln!(file, "{}", line()));
        if let Err(e) = written {
            eprintln!(
                "--json {}: {e}: give a file in a folder that exists",
                path.display()
            );
            exit(2);
        }
    }
}

fn refuse(bench: &str, what: &str) -> ! {
    eprintln!("{what}\nusage: cargo bench --bench {bench} -- [WORD…] [--smoke] [--json FILE]");
    exit(2);
}
