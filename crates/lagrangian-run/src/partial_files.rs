//! Files that are not complete, and folders that hold nothing yet, for a program that is ended at once.

use std::fs;
use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};

static ALL: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// Removes files that are not complete, and folders that were made and hold nothing yet: for a program that ends at once.
pub fn remove_unfinished() {
    let all = ALL.lock().unwrap_or_else(PoisonError::into_inner);
    // OK to ignore: a file that was completed has another name by now, and a folder that holds anything stays.
    all.iter().for_each(|path| drop(fs::remove_file(path)));
    all.iter().for_each(|path| drop(fs::remove_dir(path)));
}

/// Paths that are not what they are to be until this is dropped.
#[derive(Debug)]
pub(crate) struct PartialFiles(Vec<PathBuf>);

impl PartialFiles {
    pub(crate) fn of(paths: impl IntoIterator<Item = PathBuf>) -> Self {
        let paths: Vec<PathBuf> = paths.into_iter().collect();
        let mut all = ALL.lock().unwrap_or_else(PoisonError::into_inner);
        all.extend(paths.iter().cloned());
        Self(paths)
    }
}

impl Drop for PartialFiles {
    fn drop(&mut self) {
        let mut all = ALL.lock().unwrap_or_else(PoisonError::into_inner);
        all.retain(|path| !self.0.contains(path));
    }
}
