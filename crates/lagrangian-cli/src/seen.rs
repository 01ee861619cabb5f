//! Files that the fit of a model used.

use std::path::{Path, PathBuf};

use lagrangian_run::FileHash;
use lagrangian_run::compare::{DataOverlap, LoadedRun};

/// The files that the fit of a model has used, by their hashes, which are reported on standard error.
pub(crate) fn noted(model: &Path, files: &[(PathBuf, FileHash)]) -> Vec<DataOverlap> {
    let hashes: Vec<String> = files.iter().map(|(_, hash)| hash.sha256.clone()).collect();
    // OK because the model has been read: a damaged record beside it only leaves its data unknown.
    let overlap = LoadedRun::read(model).map(|run| run.overlap(&hashes));
    let overlap = overlap.unwrap_or_default();
    for DataOverlap { file, role } in &overlap {
        let how = match role.as_str() {
            "training" => "the model was fitted to it",
            "validation" => "its weights were chosen by it",
            _ => "the fit of the model used it",
        };
        note!("note: '{file}' was used in the fit: {how}");
    }
    overlap
}
