//! Where results go: one JSON object on standard output, and files that appear whole or not at all.

use std::fs::{self, OpenOptions};
use std::io::{self, Seek, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use lagrangian::trajectory::{Table, csv};
use lagrangian::{Coordinates, Format, Layout, Trajectory};
use serde::Serialize;
use tempfile::NamedTempFile;

use crate::failure::{Advise, mistake};
use crate::interrupt;

/// What to do with a file that is already there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Existing {
    /// Leave it and refuse.
    Keep,
    /// Put the new one in its place, once that is complete.
    Replace,
}

impl Existing {
    /// The meaning of `--force`.
    pub(crate) fn from_force(force: bool) -> Self {
        if force { Self::Replace } else { Self::Keep }
    }
}

/// Where a file's content goes.
pub(crate) trait Sink: Write + Seek + Send {}

impl<T: Write + Seek + Send> Sink for T {}

/// Refuses a folder, and a file that is already there, before any work is done for it.
pub(crate) fn refuse_existing(path: &Path, existing: Existing) -> Result<()> {
    if path.is_dir() {
        return Err(mistake(
            format!("cannot write '{}': it is a folder", path.display()),
            "name a file, such as one in that folder",
        ));
    }
    if existing == Existing::Keep && path.is_file() {
        return Err(mistake(
            format!("'{}' exists already", path.display()),
            "give another --out, or --force to replace it",
        ));
    }
    Ok(())
}

/// Writes a file through a temporary one beside it, so that no incomplete file is ever visible and an
/// existing file survives every failure. Devices and pipes are written directly.
pub(crate) fn write_file(
    path: &Path,
    existing: Existing,
    content: impl FnOnce(&mut dyn Sink) -> Result<()>,
) -> Result<()> {
    refuse_existing(path, existing)?;
    let folder = folder_of(path);
    if !folder.is_dir() {
        let (path, folder) = (path.display(), folder.display());
        return Err(mistake(
            format!("cannot write '{path}': there is no folder '{folder}'"),
            "create the folder first, or give another --out",
        ));
    }
    let written = if is_special(path) {
        write_directly(path, content)
    } else {
        replace(path, existing, content)
    };
    written.advise(
        format!("cannot write '{}'", path.display()),
        "check that the folder is writable and the disk is not full, or give another --out",
    )
}

/// [`write_file`] for content that is already in memory.
pub(crate) fn write_bytes(path: &Path, existing: Existing, bytes: &[u8]) -> Result<()> {
    write_file(path, existing, |writer| Ok(writer.write_all(bytes)?))
}

fn folder_of(path: &Path) -> &Path {
    let parent = path.parent().filter(|p| !p.as_os_str().is_empty());
    parent.unwrap_or(Path::new("."))
}

/// A device or a pipe: nothing to lose there, and no renaming onto it.
fn is_special(path: &Path) -> bool {
    fs::metadata(path).is_ok_and(|m| !m.is_file() && !m.is_dir())
}

fn write_directly(path: &Path, content: impl FnOnce(&mut dyn Sink) -> Result<()>) -> Result<()> {
    let mut writer = io::BufWriter::new(OpenOptions::new().write(true).open(path)?);
    content(&mut writer)?;
    Ok(writer.flush()?)
}

fn replace(
    path: &Path,
    existing: Existing,
    content: impl FnOnce(&mut dyn Sink) -> Result<()>,
) -> Result<()> {
    let file = temporary(folder_of(path))?;
    interrupt::remove_at_forced_end([file.path().to_path_buf()]);
    let mut writer = io::BufWriter::new(file);
    content(&mut writer)?;
    let file = writer
        .into_inner()
        .map_err(io::IntoInnerError::into_error)?;
    file.as_file().sync_all()?;
    match existing {
        Existing::Keep => file.persist_noclobber(path)?,
        Existing::Replace => file.persist(path)?,
    };
    Ok(())
}

/// A temporary file with the permissions of an ordinary one.
fn temporary(folder: &Path) -> io::Result<NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".lagrangian-");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        builder
            .permissions(fs::Permissions::from_mode(0o666))
            .tempfile_in(folder)
    }
    #[cfg(not(unix))]
    builder.tempfile_in(folder)
}

/// The format that a file's extension means, before any work is done for it.
pub(crate) fn format_of(path: &Path) -> Result<Format> {
    let shown = format!("cannot write '{}'", path.display());
    let hint = "end the name of --out with .csv, .npz or .parquet";
    match format_named(path).advise(&shown, hint)? {
        format if format.is_written() => Ok(format),
        _ => Err(mistake(
            format!("{shown}: bags are read, but not written"),
            hint,
        )),
    }
}

/// The format that a file's extension means.
pub(crate) fn format_named(path: &Path) -> lagrangian::Result<Format> {
    let extension = path.extension().and_then(|e| e.to_str());
    Format::from_extension(extension.unwrap_or_default())
}

/// Writes trajectories to a file, in the format of its extension, and beside it the TOML file that declares angles
/// and units; returns the path of the latter.
pub(crate) fn write_trajectories(
    path: &Path,
    existing: Existing,
    trajectories: &[Trajectory],
    coordinates: &Coordinates,
) -> Result<PathBuf> {
    let format = format_of(path)?;
    let layout = path.with_extension("toml");
    refuse_existing(&layout, existing)?;
    write_file(path, existing, |sink| Ok(format.write(sink, trajectories)?))?;
    let text = Layout::written(coordinates).to_toml()?;
    write_bytes(&layout, existing, text.as_bytes())?;
    Ok(layout)
}

/// How motions are written: in the columns and units of the data of a model.
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
        write_file(path, existing, |sink| Ok(format.write_table(sink, &table)?))?;
        let text = layout.of_motions(motions, coordinates).to_toml()?;
        write_bytes(&beside, existing, text.as_bytes())?;
        Ok(beside)
    }

    /// [`print_trajectories`] in these columns and units.
    pub(crate) fn print(&self, motions: &[Trajectory]) -> Result<()> {
        if self.layout.is_plain() {
            return print_trajectories(motions);
        }
        refuse_closed()?;
        let table = Table::of_motions(motions, self.coordinates, self.layout);
        let mut text = io::Cursor::new(Vec::new());
        Format::Csv.write_table(&mut text, &table)?;
        let mut out = io::stdout().lock();
        out.write_all(text.get_ref())
            .and_then(|()| out.flush())
            .context("cannot write to standard output")
    }
}

/// Writes trajectories as CSV to standard output.
pub(crate) fn print_trajectories(trajectories: &[Trajectory]) -> Result<()> {
    refuse_closed()?;
    csv::write(io::stdout().lock(), trajectories).context("cannot write to standard output")
}

/// Refuses a standard output that was closed, where it is all that a command gives. When a program starts, the device that loses
/// everything takes the place of a closed output, open for reading too, as nobody opens it who only wants silence.
fn refuse_closed() -> Result<()> {
    let is_lost = fs::read_link("/proc/self/fd/1").is_ok_and(|path| path == Path::new("/dev/null"));
    let about = fs::read_to_string("/proc/self/fdinfo/1").unwrap_or_default();
    let flags = about.lines().find_map(|line| line.strip_prefix("flags:"));
    let flags = flags.and_then(|octal| u32::from_str_radix(octal.trim(), 8).ok());
    match is_lost && flags.is_some_and(|flags| flags & 3 == 2) {
        false => Ok(()),
        true => Err(mistake(
            "standard output is closed, and the motion would be lost",
            "give a file with --out",
        )),
    }
}

/// Writes text to standard output; a closed or full output is an error, not a panic.
pub(crate) fn print(text: &str) -> Result<()> {
    let mut out = io::stdout().lock();
    out.write_all(text.as_bytes())
        .and_then(|()| out.flush())
        .context("cannot write to standard output")
}

/// Writes one JSON object and a line end to standard output.
pub(crate) fn print_json(value: &impl Serialize) -> Result<()> {
    print(&format!("{}\n", serde_json::to_string_pretty(value)?))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;
    use anyhow::anyhow;

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<String> = fs::read_dir(folder)
            .unwrap()
            .map(|e| e.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }

    #[test]
    fn a_file_that_was_there_is_kept_unless_forced() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.csv");
        write_bytes(&path, Existing::Keep, b"first").unwrap();
        assert!(write_bytes(&path, Existing::Keep, b"second").is_err());
        assert_eq!(fs::read(&path).unwrap(), b"first");
        write_bytes(&path, Existing::Replace, b"third").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"third");
    }

    #[test]
    fn a_write_that_fails_half_way_leaves_the_old_file_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.csv");
        write_bytes(&path, Existing::Keep, b"old").unwrap();
        let half = |writer: &mut dyn Sink| {
            writer.write_all(b"half")?;
            Err(anyhow!("no more"))
        };
        assert!(write_file(&path, Existing::Replace, half).is_err());
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert_eq!(names(folder.path()), ["a.csv"]);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_full_disk_is_an_error() {
        let error = write_bytes(Path::new("/dev/full"), Existing::Keep, &[0; 100_000]).unwrap_err();
        assert_eq!(crate::failure::exit_code(&error), crate::failure::FAILED);
    }

    #[cfg(unix)]
    #[test]
    fn files_have_ordinary_permissions() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let (ours, plain) = (folder.path().join("ours"), folder.path().join("plain"));
        write_bytes(&ours, Existing::Keep, b"").unwrap();
        fs::write(&plain, b"").unwrap();
        let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode();
        assert_eq!(mode(&ours), mode(&plain));
    }
}
