//! ROS 2 bags, by the reader that a frontend brings along.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use lagrangian::Layout;
use lagrangian::trajectory::Readings;

use crate::error::{Cause, Context, Error, Result};

/// A reader of bags.
#[derive(Debug, Clone, Copy)]
pub struct BagReader {
    /// The files of a folder, in the order in which they were recorded.
    pub files: fn(&Path) -> Result<Vec<PathBuf>, Cause>,
    /// The recording of a file, of which the name and the layout are given too.
    pub read: fn(&Path, &str, &Layout) -> Result<Readings, Cause>,
}

static READER: OnceLock<BagReader> = OnceLock::new();

/// Lets this process read bags, for which the crate has no reader of its own.
pub fn read_bags_by(reader: BagReader) {
    READER.get_or_init(|| reader);
}

/// Whether a file is a bag, by its extension.
#[must_use]
pub fn is_bag(path: &Path) -> bool {
    path.extension()
        .is_some_and(|own| own == "db3" || own == "mcap")
}

/// The reader of a file, if it is a bag and this process reads these.
pub(crate) fn reader(path: &Path) -> Option<BagReader> {
    READER.get().copied().filter(|_| is_bag(path))
}

/// The named files, with those of a bag in place of its folder.
///
/// # Errors
/// [`Error::Refused`] for a folder that is not a bag.
pub fn files(named: &[PathBuf]) -> Result<Vec<PathBuf>> {
    let hint =
        "give files; the folder of a ROS 2 bag is read after `pip install 'lagrangian[ros]'`";
    let mut files = Vec::new();
    for path in named {
        if !path.is_dir() {
            files.push(path.clone());
            continue;
        }
        let shown = format!("cannot read the folder '{}'", path.display());
        let reader = READER.get().ok_or_else(|| Error::new(&shown, hint))?;
        files.extend((reader.files)(path).context(shown, hint)?);
    }
    Ok(files)
}
