//! Incomplete files and empty new folders, for a program that ends abruptly.

use std::fs;
use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};

static ALL: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// Removes incomplete files, and new folders that are still empty, for a program that ends abruptly.
pub fn remove_unfinished() {
    let all = ALL.lock().unwrap_or_else(PoisonError::into_inner);
    // OK to ignore: a file that was completed has another name by now, and a folder that is not empty stays.
    all.iter().for_each(|path| drop(fs::remove_file(path)));
    all.iter().for_each(|path| drop(fs::remove_dir(path)));
}

/// Paths of incomplete files and folders until this is dropped.
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
