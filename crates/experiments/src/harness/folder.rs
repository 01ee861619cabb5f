//! The folder that a run leaves behind: settings, figures, models and the page.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::Result;
use serde::Serialize;

use super::args::Args;
use super::failure::{Context, mistake};

/// An open folder of results.
pub(crate) struct Folder(PathBuf);

/// What a run was made of, as `run.toml` has it.
#[derive(Serialize)]
struct Record<'a> {
    command: String,
    version: &'static str,
    platform: String,
    threads: usize,
    settings: &'a Args,
}

impl Folder {
    /// The folder that was named; without a name, one that no earlier run has taken.
    pub(super) fn open(args: &Args) -> Result<Self> {
        let path = match &args.out {
            Some(path) => path.clone(),
            None => free(&format!("experiment-{}", args.name), args.force),
        };
        let shown = format!("cannot write to the folder '{}'", path.display());
        let hint = "give another --out that is a folder you may write to";
        fs::create_dir_all(&path).context(&shown, hint)?;
        let existing = fs::read_dir(&path).context(&shown, hint)?.next().is_some();
        if existing && !args.force {
            return Err(mistake(
                format!("the folder '{}' is not empty", path.display()),
                "give another --out, or --force to write into it",
            ));
        }
        let folder = Self(path);
        let record = Record {
            command: command_line(),
            version: env!("CARGO_PKG_VERSION"),
            platform: format!("{} {}", std::env::consts::OS, std::env::consts::ARCH),
            threads: threads(),
            settings: args,
        };
        folder.write("run.toml", toml::to_string(&record)?.as_bytes())?;
        Ok(folder)
    }

    pub(super) fn path(&self) -> &Path {
        &self.0
    }

    /// The text of a file of an earlier run in this folder; empty where there is none.
    pub(crate) fn read(&self, name: &str) -> String {
        fs::read_to_string(self.0.join(name)).unwrap_or_default()
    }

    /// Writes one file.
    pub(crate) fn write(&self, name: &str, bytes: &[u8]) -> Result<()> {
        let path = self.0.join(name);
        fs::write(&path, bytes).context(
            format!("cannot write '{}'", path.display()),
            "check that the folder may be written to and has room",
        )
    }
}

/// Threads of the machine.
pub(super) fn threads() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

fn free(name: &str, force: bool) -> PathBuf {
    let numbered = (2..1000).map(|k| PathBuf::from(format!("{name}-{k}")));
    std::iter::once(PathBuf::from(name))
        .chain(numbered)
        .find(|path| force || !path.exists())
        .unwrap_or_else(|| name.into())
}

/// The command line as it could be typed again.
pub(super) fn command_line() -> String {
    let quoted = |word: String| match word.contains([' ', '\'', '"', '$', '*']) {
        true => format!("'{}'", word.replace('\'', r"'\''")),
        false => word,
    };
    let words: Vec<String> = std::env::args().skip(1).map(quoted).collect();
    format!("cargo run --release -p experiments -- {}", words.join(" "))
}
