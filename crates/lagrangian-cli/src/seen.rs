//! Files that a model knows from its fit.

use std::path::{Path, PathBuf};

use lagrangian_run::FileHash;
use lagrangian_run::compare::{DataOverlap, LoadedRun};

/// Those of the files that the fit of a model has used, by their hashes; says so on standard error.
pub(crate) fn noted(model: &Path, files: &[(PathBuf, FileHash)]) -> Vec<DataOverlap> {
    let hashes: Vec<String> = files.iter().map(|(_, hash)| hash.sha256.clone()).collect();
    // OK because the model has been read: what a damaged record beside it says of its data is not known.
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
