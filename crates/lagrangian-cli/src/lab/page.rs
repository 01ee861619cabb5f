//! The files of the page, by their names.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::path::Path;
use std::{fs, io};

use anyhow::Result;

use crate::failure::{Advise, mistake};

/// What this binary holds: what was built before it, if anything was.
const OWN: &[(&str, &[u8])] = include!(concat!(env!("OUT_DIR"), "/page.rs"));

/// What to do where there is no page.
const BUILD: &str = "build the page with `cargo xtask web --build`, then the command again, or name its folder: --folder web/dist";

/// The file that is the page itself.
const INDEX: &str = "index.html";

/// The most files of a folder that are served, and the most bytes of all of them.
const MOST_FILES: usize = 1000;
const MOST_BYTES: u64 = 64 << 20;

/// The files of a page, by the names that a request gives.
#[derive(Debug)]
pub(crate) struct Page(BTreeMap<String, Cow<'static, [u8]>>);

impl Page {
    /// The page of a folder, or the one that this binary holds.
    ///
    /// # Errors
    /// Where there is none, with how to build it.
    pub(crate) fn new(folder: Option<&Path>) -> Result<Self> {
        let page = match folder {
            None => Self::own(),
            Some(folder) => Self::of_folder(folder)?,
        };
        if page.file("").is_some() {
            return Ok(page);
        }
        let message = match folder {
            None => "this build of the command holds no page".to_string(),
            Some(folder) => format!("'{}' holds no {INDEX}", folder.display()),
        };
        Err(mistake(message, BUILD))
    }

    fn own() -> Self {
        let file =
            |(name, bytes): &(&str, &'static [u8])| ((*name).to_string(), Cow::Borrowed(*bytes));
        Self(OWN.iter().map(file).collect())
    }

    fn of_folder(folder: &Path) -> Result<Self> {
        let mut files = BTreeMap::new();
        // Any other folder may be as large as the disk.
        if !folder.join(INDEX).is_file() {
            return Ok(Self(files));
        }
        let shown = format!("cannot read '{}'", folder.display());
        collect(folder, "", &mut files).advise(shown, BUILD)?;
        Ok(Self(files))
    }

    /// The file of this name; that of no name is the page itself.
    pub(super) fn file(&self, name: &str) -> Option<&[u8]> {
        let name = if name.is_empty() { INDEX } else { name };
        self.0.get(name).map(|bytes| &**bytes)
    }
}

/// Reads the files below a folder but hidden ones; links are passed over, so that nothing outside of it is served.
fn collect(
    folder: &Path,
    before: &str,
    files: &mut BTreeMap<String, Cow<'static, [u8]>>,
) -> io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        let (kind, name) = (entry.file_type()?, entry.file_name());
        let name = name.to_string_lossy();
        if name.starts_with('.') {
            continue;
        }
        let name = format!("{before}{name}");
        if kind.is_dir() {
            collect(&entry.path(), &format!("{name}/"), files)?;
        } else if kind.is_file() {
            let held: usize = files.values().map(|bytes| bytes.len()).sum();
            if files.len() >= MOST_FILES || held as u64 + entry.metadata()?.len() > MOST_BYTES {
                let what = "it holds more than a page does";
                return Err(io::Error::new(io::ErrorKind::InvalidInput, what));
            }
            files.insert(name, Cow::Owned(fs::read(entry.path())?));
        }
    }
    Ok(())
}
