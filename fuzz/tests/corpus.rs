//! The files of the corpus hold what the targets demand, and each target accepts one of them.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::fs;
use std::path::Path;

use fuzz::TARGETS;

#[test]
fn each_target_accepts_a_file_of_its_corpus_and_none_is_at_fault() {
    for target in TARGETS {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("corpus")
            .join(target.name);
        let files = fs::read_dir(folder).unwrap();
        let bytes = files.map(|file| fs::read(file.unwrap().path()).unwrap());
        let accepted = bytes.filter(|bytes| (target.run)(bytes).is_ok()).count();
        assert!(accepted > 0, "{}", target.name);
    }
}

#[test]
fn a_damaged_model_and_a_damaged_checkpoint_are_read_behind_their_checksums() {
    for (file, run) in [
        (
            "model/lnn.safetensors",
            fuzz::model as fn(&[u8]) -> fuzz::Outcome,
        ),
        ("checkpoint/adam.safetensors", fuzz::checkpoint),
    ] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("corpus")
            .join(file);
        let mut bytes = fs::read(path).unwrap();
        let last = bytes.len() - 1;
        // The sign of the last weight.
        bytes[last] ^= 0x80;
        assert_eq!(run(&bytes), Ok(()), "{file}");
    }
}

#[test]
fn a_model_of_random_features_is_refused_with_the_experiment_that_they_are_now() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus/model/features.safetensors");
    let saved = lagrangian::SavedModel::read(fs::File::open(path).unwrap()).unwrap();
    let error = lagrangian::Learned::load(&saved)
        .err()
        .map(|error| error.to_string());
    let error = error.unwrap_or_default();
    assert!(error.contains("experiments -- features"), "{error}");
}
