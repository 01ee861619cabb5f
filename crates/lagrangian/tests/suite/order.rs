//! The order of the modules: data, training, models, scores, fits. No module uses a later one.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::fs;
use std::path::{Path, PathBuf};

use lagrangian::models::{Entry, FAMILIES};

/// The modules in their order; those of a row may use each other.
const ORDER: [&[&str]; 7] = [
    &["dataset", "saved"],
    &["train"],
    &["models"],
    &["score", "torque"],
    &["fit"],
    &["prepared", "ensemble"],
    &["distil"],
];

#[test]
fn no_module_uses_one_that_comes_later() {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut backwards = Vec::new();
    for (rank, row) in ORDER.iter().enumerate() {
        let later: Vec<String> = ORDER[rank + 1..]
            .concat()
            .iter()
            .map(|name| format!("crate::{name}::"))
            .collect();
        for file in row.iter().flat_map(|name| files(&source, name)) {
            let text = fs::read_to_string(&file).unwrap();
            let code = text
                .split("#[cfg(test)]\nmod tests {")
                .next()
                .unwrap_or_default();
            let lines = code
                .lines()
                .filter(|line| !line.trim_start().starts_with("//"));
            let found = lines.filter(|line| later.iter().any(|name| line.contains(name)));
            backwards.extend(found.map(|line| format!("{}: {line}", file.display())));
        }
    }
    assert!(backwards.is_empty(), "{backwards:#?}");
    let listed = ORDER.concat().len();
    let modules = fs::read_dir(&source).unwrap().filter_map(|entry| {
        let path = entry.ok()?.path();
        Some(path.file_stem()?.to_str()?.to_string())
    });
    let mut modules: Vec<String> = modules.filter(|name| name != "lib").collect();
    modules.sort();
    modules.dedup();
    assert_eq!(modules.len(), listed, "a module has no place: {modules:?}");
}

#[test]
fn a_family_is_named_in_its_folder_alone() {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let others = ORDER.concat().into_iter().filter(|name| *name != "models");
    let mut named = Vec::new();
    for file in others.flat_map(|name| files(&source, name)) {
        let text = fs::read_to_string(&file).unwrap();
        let code = text
            .split("#[cfg(test)]\nmod tests {")
            .next()
            .unwrap_or_default();
        for line in code
            .lines()
            .filter(|line| !line.trim_start().starts_with("//"))
        {
            let family = |entry: &&Entry| line.contains(&format!("\"{}\"", entry.name));
            if let Some(entry) = FAMILIES.iter().find(family) {
                named.push(format!("{} in {}: {line}", entry.name, file.display()));
            }
        }
    }
    assert!(named.is_empty(), "{named:#?}");
}

/// The sources of a module, without its tests.
fn files(source: &Path, module: &str) -> Vec<PathBuf> {
    let mut found: Vec<PathBuf> = Vec::from([source.join(format!("{module}.rs"))]);
    let mut open = vec![source.join(module)];
    while let Some(folder) = open.pop() {
        for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
            let path = entry.path();
            match path.file_stem().and_then(|name| name.to_str()) {
                Some("tests") => (),
                _ if path.is_dir() => open.push(path),
                _ => found.push(path),
            }
        }
    }
    found.retain(|path| path.is_file());
    found
}
