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

/// Writes trajectories to a file, in the format of its extension, and beside it the TOML file that declares angles
/// and units; returns the path of the latter.
pub(crate) fn write_trajectories(
    path: &Path,
    existing: Existing,
    trajectories: &[Trajectory],
    coordinates: &Coordinates,
) -> Result<PathBuf> {
    write_declared(path, existing, trajectories, &Layout::written(coordinates))
}

/// [`write_trajectories`] with other known declarations.
pub(crate) fn write_declared(
    path: &Path,
    existing: Existing,
    trajectories: &[Trajectory],
    declared: &Layout,
) -> Result<PathBuf> {
    let format = format_of(path)?;
    let layout = path.with_extension("toml");
    refuse_existing(&layout, existing)?;
    write_file(path, existing, |sink| format.write(sink, trajectories))?;
    let text = declared.to_toml()?;
    write_bytes(&layout, existing, text.as_bytes())?;
    Ok(layout)
}

/// The columns and units of motions: those of the data of a model.
pub(crate) struct Columns<'a> {
    pub(crate) coordinates: &'a Coordinates,
    pub(crate) layout: &'a Layout,
}

impl Columns<'_> {
    /// [`write_trajectories`] in these columns and units.
    pub(crate) fn write(
        &self,
        path: &Path,
        existing: Existing,
        motions: &[Trajectory],
    ) -> Result<PathBuf> {
        let Self {
            coordinates,
            layout,
        } = self;
        if layout.is_plain() {
            return write_trajectories(path, existing, motions, coordinates);
        }
        let (format, beside) = (format_of(path)?, path.with_extension("toml"));
        refuse_existing(&beside, existing)?;
        let table = Table::of_motions(motions, coordinates, layout);
        write_file(path, existing, |sink| format.write_table(sink, &table))?;
        let text = layout.of_motions(motions, coordinates).to_toml()?;
        write_bytes(&beside, existing, text.as_bytes())?;
        Ok(beside)
    }

    /// [`print_trajectories`] in these columns and units.
    pub(crate) fn print(&self, motions: &[Trajectory]) -> Result<()> {
        if self.layout.is_plain() {
            return print_trajectories(motions);
        }
        let table = Table::of_motions(motions, self.coordinates, self.layout);
        let mut text = io::Cursor::new(Vec::new());
        Format::Csv.write_table(&mut text, &table)?;
        print_bytes(text.get_ref())
    }
}

/// Writes trajectories as CSV to standard output.
pub(crate) fn print_trajectories(trajectories: &[Trajectory]) -> Result<()> {
    refuse_closed()?;
    csv::write(io::stdout().lock(), trajectories).context(CANNOT_PRINT)
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
