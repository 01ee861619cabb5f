//! The destinations of results: one JSON object on standard output, motions in files.

use std::fs;
use std::io::{self, IsTerminal, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use lagrangian::trajectory::{Table, csv};
use lagrangian::{Coordinates, Format, Layout, Trajectory};
use lagrangian_run::{Error, Existing, FileFormat, refuse_existing, write_bytes, write_file};
use serde::Serialize;

use crate::failure::mistake;

/// The format of a file's extension, before any work is done for it.
pub(crate) fn format_of(path: &Path) -> Result<FileFormat> {
    let shown = format!("cannot write '{}'", path.display());
    let hint = "end the name of --out with .csv, .npz or .parquet";
    FileFormat::to_write(path).map_err(|error| Error::of(error, shown, hint).into())
}

/// Motions in the form in which they are written.
pub(crate) struct Motions<'a> {
    trajectories: &'a [Trajectory],
    /// The declarations of the file beside them: angles and units.
    declared: Layout,
    /// Their columns, where these are not the plain ones.
    table: Option<Table>,
}

impl<'a> Motions<'a> {
    /// Motions of these coordinates in plain columns and SI units.
    pub(crate) fn new(trajectories: &'a [Trajectory], coordinates: &Coordinates) -> Self {
        Self::declared(trajectories, Layout::written(coordinates))
    }

    /// Motions in plain columns with other known declarations.
    pub(crate) fn declared(trajectories: &'a [Trajectory], declared: Layout) -> Self {
        Self {
            trajectories,
            declared,
            table: None,
        }
    }

    /// Motions in the columns and units of the data of a model.
    pub(crate) fn in_columns(
        trajectories: &'a [Trajectory],
        coordinates: &Coordinates,
        layout: &Layout,
    ) -> Self {
        if layout.is_plain() {
            return Self::new(trajectories, coordinates);
        }
        Self {
            trajectories,
            declared: layout.of_motions(trajectories, coordinates),
            table: Some(Table::of_motions(trajectories, coordinates, layout)),
        }
    }

    /// Writes them to a file, in the format of its extension, and the declarations to a TOML file beside it, whose path it returns.
    pub(crate) fn write(&self, path: &Path, existing: Existing) -> Result<PathBuf> {
        let (format, layout) = (format_of(path)?, path.with_extension("toml"));
        refuse_existing(&layout, existing)?;
        write_file(path, existing, |sink| match &self.table {
            Some(table) => format.write_table(sink, table),
            None => format.write(sink, self.trajectories),
        })?;
        write_bytes(&layout, existing, self.declared.to_toml()?.as_bytes())?;
        Ok(layout)
    }

    /// Writes them as CSV to standard output.
    pub(crate) fn print(&self) -> Result<()> {
        let Some(table) = &self.table else {
            refuse_closed()?;
            return csv::write(io::stdout().lock(), self.trajectories).context(CANNOT_PRINT);
        };
        let mut text = io::Cursor::new(Vec::new());
        Format::Csv.write_table(&mut text, table)?;
        print_bytes(text.get_ref())
    }
}

/// Refuses a standard output that was closed. When a program starts, the null device takes the place of a closed output,
/// and is open for reading too, unlike one that was opened to silence the program.
pub(crate) fn refuse_closed() -> Result<()> {
    let is_lost = fs::read_link("/proc/self/fd/1").is_ok_and(|path| path == Path::new("/dev/null"));
    let about = fs::read_to_string("/proc/self/fdinfo/1").unwrap_or_default();
    let flags = about.lines().find_map(|line| line.strip_prefix("flags:"));
    let flags = flags.and_then(|octal| u32::from_str_radix(octal.trim(), 8).ok());
    match is_lost && flags.is_some_and(|flags| flags & 3 == 2) {
        false => Ok(()),
        true => Err(mistake(
            "standard output is closed, and the results would be lost",
            "open it, or give a file with --out where the command has it",
        )),
    }
}

/// The message for a standard output that is full.
pub(crate) const CANNOT_PRINT: &str = "cannot write to standard output";

/// Escape sequences of a terminal that the command itself writes.
const COLOURS: [&str; 4] = ["\u{1b}[32m", "\u{1b}[33m", "\u{1b}[31;1m", "\u{1b}[0m"];

/// Writes text to standard output as it is shown, in colours on a terminal.
pub(crate) fn print(text: &str) -> Result<()> {
    let mut shown = lagrangian::text::shown_lines(text);
    if io::stdout().is_terminal() {
        for colour in COLOURS {
            shown = shown.replace(&lagrangian::text::shown(colour), colour);
        }
    }
    print_bytes(shown.as_bytes())
}

/// Writes to standard output; a closed or full output is an error, not a panic.
fn print_bytes(bytes: &[u8]) -> Result<()> {
    refuse_closed()?;
    let mut out = io::stdout().lock();
    out.write_all(bytes)
        .and_then(|()| out.flush())
        .context(CANNOT_PRINT)
}

/// Writes one JSON object and a line end to standard output; invisible characters are written as escapes.
pub(crate) fn print_json(value: &impl Serialize) -> Result<()> {
    let text = lagrangian::text::shown_json(&serde_json::to_string_pretty(value)?);
    print_bytes((text + "\n").as_bytes())
}
