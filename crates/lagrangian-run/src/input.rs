//! Input files: paths that lead to files, and protection of these against being overwritten.

use std::fs::{self, File, FileType};
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use crate::error::{Error, Result};

/// The longest text of settings that is read, bytes.
pub const MOST_TEXT: u64 = 8 << 20;

/// Opens a file; a pipe or a device, which could be read only once or without end, is refused.
///
/// # Errors
/// Errors of the operating system; a pipe, a folder or a device is invalid input.
pub fn open(path: &Path) -> io::Result<File> {
    let kind = fs::metadata(path).map_err(about_the_input)?.file_type();
    match kind.is_file() {
        true => File::open(path).map_err(about_the_input),
        false => Err(io::Error::new(io::ErrorKind::InvalidInput, described(kind))),
    }
}

/// The text of a file of settings.
///
/// # Errors
/// As [`open`]; a file above [`MOST_TEXT`] is invalid data.
pub fn text(path: &Path) -> io::Result<String> {
    text_up_to(MOST_TEXT, path)
}

/// The text of a file of no more bytes than `most`.
pub(crate) fn text_up_to(most: u64, path: &Path) -> io::Result<String> {
    let refused = |why: String| io::Error::new(io::ErrorKind::InvalidData, why);
    let mut bytes = Vec::new();
    open(path)?.take(most + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > most {
        return Err(refused(format!("it is longer than {} MB", most >> 20)));
    }
    String::from_utf8(bytes).map_err(|_| refused("it is not text".into()))
}

/// An error of a path that was given, whatever the operating system calls it, with the system's message.
fn about_the_input(error: io::Error) -> io::Error {
    match error.kind() {
        io::ErrorKind::NotFound | io::ErrorKind::PermissionDenied => error,
        _ => io::Error::new(io::ErrorKind::InvalidInput, error),
    }
}

fn described(kind: FileType) -> String {
    if kind.is_dir() {
        return "it is a folder, and a file is needed".into();
    }
    #[cfg(unix)]
    {
        use std::os::unix::fs::FileTypeExt;
        if kind.is_fifo() {
            return "it is a pipe: write its content to a file first, which is read more than once"
                .into();
        }
    }
    "it is a device, and a file is needed".into()
}

/// Refuses to write over files that are read, however their paths are written.
///
/// # Errors
/// [`Error::Refused`], which names both paths.
pub fn refuse_overwriting<'a>(
    written: impl IntoIterator<Item = &'a PathBuf>,
    read: &[PathBuf],
) -> Result<()> {
    for path in written {
        if let Some(input) = read.iter().find(|input| is_same(input, path)) {
            return Err(Error::new(
                format!(
                    "'{}' would be written over the input '{}'",
                    path.display(),
                    input.display()
                ),
                "give what is written another name: the input is kept",
            ));
        }
    }
    Ok(())
}

/// Whether two paths lead to one file: the same path, a symbolic link or a hard link.
pub(crate) fn is_same(a: &Path, b: &Path) -> bool {
    let real = |path: &Path| fs::canonicalize(path).ok();
    real(a).is_some_and(|a| real(b) == Some(a)) || is_hard_link(a, b)
}

#[cfg(unix)]
fn is_hard_link(a: &Path, b: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let node = |path: &Path| fs::metadata(path).ok().map(|m| (m.dev(), m.ino()));
    node(a).is_some_and(|a| node(b) == Some(a))
}

#[cfg(not(unix))]
fn is_hard_link(_: &Path, _: &Path) -> bool {
    false
}

/// Whether two paths, of files that need not exist, are one name in one folder.
pub fn is_same_name(a: &Path, b: &Path) -> bool {
    let real = |path: &Path| {
        let parent = path.parent().filter(|p| !p.as_os_str().is_empty());
        fs::canonicalize(parent.unwrap_or(Path::new("."))).ok()
    };
    a.file_name() == b.file_name() && real(a).is_some_and(|folder| real(b) == Some(folder))
}

#[cfg(all(test, unix))]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;

    #[test]
    fn a_file_is_known_by_every_path_that_leads_to_it() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        fs::create_dir(path("sub")).unwrap();
        fs::write(path("a"), "data").unwrap();
        fs::write(path("b"), "data").unwrap();
        fs::hard_link(path("a"), path("hard")).unwrap();
        std::os::unix::fs::symlink(path("a"), path("soft")).unwrap();
        for other in ["a", "sub/../a", "./a", "hard", "soft"] {
            let read = [path("a")];
            assert!(
                refuse_overwriting([&path(other)], &read).is_err(),
                "{other}"
            );
        }
        for other in ["b", "new", "sub"] {
            refuse_overwriting([&path(other)], &[path("a")]).unwrap();
        }
    }

    #[test]
    fn folders_and_devices_are_no_files() {
        for path in ["/", "/dev/null"] {
            let error = open(Path::new(path)).unwrap_err();
            assert_eq!(error.kind(), io::ErrorKind::InvalidInput, "{path}");
        }
    }
}
