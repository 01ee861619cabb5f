//! The files of the page, by their names.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::path::Path;
use std::{fs, io};

use anyhow::{Context, Result};

use crate::failure::mistake;

/// What this binary holds: what was built before it, if anything was.
const OWN: &[(&str, &[u8])] = include!(concat!(env!("OUT_DIR"), "/page.rs"));

/// The most files of a folder that are served, and the most bytes of one.
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
            Some(folder) => format!("'{}' holds no index.html", folder.display()),
        };
        let hint = "build the page with `cargo xtask web`, then the command again, or name its folder: --folder web/dist";
        Err(mistake(message, hint))
    }

    fn own() -> Self {
        let file =
            |(name, bytes): &(&str, &'static [u8])| ((*name).to_string(), Cow::Borrowed(*bytes));
        Self(OWN.iter().map(file).collect())
    }

    fn of_folder(folder: &Path) -> Result<Self> {
        let mut files = BTreeMap::new();
        collect(folder, "", &mut files)
            .with_context(|| format!("cannot read '{}'", folder.display()))?;
        Ok(Self(files))
    }

    /// The file of this name; that of no name is the page itself.
    pub(super) fn file(&self, name: &str) -> Option<&[u8]> {
        let name = if name.is_empty() { "index.html" } else { name };
        self.0.get(name).map(|bytes| &**bytes)
    }
}

/// Reads the files below a folder; links are passed over, so that nothing outside of it is served.
fn collect(
    folder: &Path,
    before: &str,
    files: &mut BTreeMap<String, Cow<'static, [u8]>>,
) -> io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        let (kind, name) = (entry.file_type()?, entry.file_name());
        let name = format!("{before}{}", name.to_string_lossy());
        if kind.is_dir() {
            collect(&entry.path(), &format!("{name}/"), files)?;
        } else if kind.is_file() {
            if files.len() >= MOST_FILES || entry.metadata()?.len() > MOST_BYTES {
                return Err(io::Error::other(
                    "it holds more than a page does: name the folder that `cargo xtask web` made",
                ));
            }
            files.insert(name, Cow::Owned(fs::read(entry.path())?));
        }
    }
    Ok(())
}
