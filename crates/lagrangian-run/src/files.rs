//! Files that appear whole or not at all.

use std::fs::{self, OpenOptions};
use std::io::{self, Seek, Write};
use std::path::Path;

use tempfile::NamedTempFile;

use crate::error::{Cause, Context, Error, Result};
use crate::partial_files::PartialFiles;

/// The treatment of an existing file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Existing {
    /// Keep it, and refuse to write.
    Keep,
    /// Replace it by the new one, once that is complete.
    Replace,
}

impl Existing {
    /// Whether an existing file is replaced.
    pub fn from_force(force: bool) -> Self {
        if force { Self::Replace } else { Self::Keep }
    }
}

/// A destination for the content of a file.
pub trait Sink: Write + Seek + Send {}

impl<T: Write + Seek + Send> Sink for T {}

/// Refuses a folder, and an existing file, before any work is done for it.
///
/// # Errors
/// [`Error::Refused`], which names the path.
pub fn refuse_existing(path: &Path, existing: Existing) -> Result<()> {
    if path.is_dir() {
        return Err(Error::new(
            format!("cannot write '{}': it is a folder", path.display()),
            "name a file, such as one in that folder",
        ));
    }
    if existing == Existing::Keep && path.is_file() {
        return Err(Error::new(
            format!("'{}' exists already", path.display()),
            "give another `out`, or `force` to replace it",
        ));
    }
    Ok(())
}

/// Writes a file through a temporary one beside it, so that no incomplete file is ever visible and an
/// existing file survives every failure. Devices and pipes are written directly.
///
/// # Errors
/// [`Error::Refused`] where the file exists and is kept, or cannot be written.
pub fn write_file(
    path: &Path,
    existing: Existing,
    content: impl FnOnce(&mut dyn Sink) -> Result<(), Cause>,
) -> Result<()> {
    refuse_existing(path, existing)?;
    let folder = folder_of(path);
    if !folder.is_dir() {
        let (path, folder) = (path.display(), folder.display());
        return Err(Error::new(
            format!("cannot write '{path}': there is no folder '{folder}'"),
            "create the folder first, or give another `out`",
        ));
    }
    let written = if is_special(path) {
        write_directly(path, content)
    } else {
        replace(path, existing, content)
    };
    written.context(
        format!("cannot write '{}'", path.display()),
        "check that the folder is writable and the disk is not full, or give another `out`",
    )
}

/// Writes a file as [`write_file`] does, from content that is already in memory.
///
/// # Errors
/// As [`write_file`].
pub fn write_bytes(path: &Path, existing: Existing, bytes: &[u8]) -> Result<()> {
    write_file(path, existing, |writer| Ok(writer.write_all(bytes)?))
}

fn folder_of(path: &Path) -> &Path {
    let parent = path.parent().filter(|p| !p.as_os_str().is_empty());
    parent.unwrap_or(Path::new("."))
}

/// Whether it is a device or a pipe, which has no content to lose and cannot be replaced by renaming.
fn is_special(path: &Path) -> bool {
    fs::metadata(path).is_ok_and(|m| !m.is_file() && !m.is_dir())
}

fn write_directly(
    path: &Path,
    content: impl FnOnce(&mut dyn Sink) -> Result<(), Cause>,
) -> Result<(), Cause> {
    let mut writer = io::BufWriter::new(OpenOptions::new().write(true).open(path)?);
    content(&mut writer)?;
    Ok(writer.flush()?)
}

fn replace(
    path: &Path,
    existing: Existing,
    content: impl FnOnce(&mut dyn Sink) -> Result<(), Cause>,
) -> Result<(), Cause> {
    let file = temporary(folder_of(path))?;
    let _unfinished = PartialFiles::of([file.path().to_path_buf()]);
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

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;

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
            Err("no more".into())
        };
        assert!(write_file(&path, Existing::Replace, half).is_err());
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert_eq!(names(folder.path()), ["a.csv"]);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_full_disk_is_an_error() {
        let error = write_bytes(Path::new("/dev/full"), Existing::Keep, &[0; 100_000]).unwrap_err();
        let mut cause: Option<&(dyn std::error::Error + 'static)> = Some(&error);
        let mut kinds = Vec::new();
        while let Some(e) = cause {
            kinds.extend(e.downcast_ref::<io::Error>().map(io::Error::kind));
            cause = e.source();
        }
        assert_eq!(kinds, [io::ErrorKind::StorageFull]);
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
