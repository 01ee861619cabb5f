//! `cargo xtask package`: each published crate packages alone, with its licences and a page, and compiles nothing from outside of its
//! folder.

use std::fs;
use std::path::{Component, Path};

use super::lines::sources;
use super::{Failure, cargo, root, succeed, target};

/// Its line of the usage.
pub(super) const USAGE: &str = "\
package  packages each crate that is published (target/package), and looks for what a registry asks of it; needs the net";

/// Files of a package.
const FILES: [&str; 4] = ["Cargo.toml", "LICENSE-MIT", "LICENSE-APACHE", "README.md"];

/// Keys of a manifest.
const KEYS: [&str; 6] = [
    "description",
    "license",
    "keywords",
    "categories",
    "documentation",
    "readme",
];

pub(super) fn main(flags: &[&str]) -> Result<(), Failure> {
    if let [other, ..] = flags {
        return Err(Failure::usage(
            format!("package does not know '{other}'"),
            "package",
        ));
    }
    let mut package = cargo();
    package.current_dir(root());
    package.args(["package", "--workspace", "--no-verify", "--allow-dirty"]);
    package.arg("--target-dir").arg(target().join("package"));
    let (mut published, mut faults) = (Vec::new(), outside()?);
    for (name, manifest) in manifests()? {
        if manifest.get("publish").is_some() {
            package.args(["--exclude", &name]);
            continue;
        }
        let missing = KEYS.iter().filter(|key| !manifest.contains_key(**key));
        faults.extend(missing.map(|key| format!("{name} has no {key}")));
        published.push(name);
    }
    succeed(&mut package, "cargo package")?;
    for name in published {
        faults.extend(lacking(&name)?);
    }
    match faults.is_empty() {
        true => Ok(()),
        false => Err(Failure::Work(format!("not ready: {}", faults.join("; ")))),
    }
}

/// The names of the packages, and the tables of their manifests.
fn manifests() -> Result<Vec<(String, toml::Table)>, String> {
    let words = |e: &dyn std::fmt::Display| format!("a manifest cannot be read: {e}");
    let mut found = Vec::new();
    let crates = fs::read_dir(root().join("crates")).map_err(|e| words(&e))?;
    let crates = crates.filter_map(|entry| Some(entry.ok()?.path()));
    for folder in crates.chain([root().join("fuzz")]) {
        let Ok(text) = fs::read_to_string(folder.join("Cargo.toml")) else {
            continue;
        };
        let whole: toml::Table = text.parse().map_err(|e| words(&e))?;
        let own = whole.get("package").and_then(toml::Value::as_table);
        let own = own.ok_or_else(|| words(&"it has no package"))?;
        let name = own.get("name").and_then(toml::Value::as_str);
        found.push((name.unwrap_or_default().into(), own.clone()));
    }
    Ok(found)
}

/// What the package of a crate lacks.
fn lacking(name: &str) -> Result<Vec<String>, String> {
    let mut list = cargo();
    list.current_dir(root());
    list.args(["package", "--list", "--allow-dirty", "--package", name]);
    let output = list
        .output()
        .map_err(|e| format!("cargo did not start: {e}"))?;
    let files = String::from_utf8_lossy(&output.stdout);
    let missing = FILES
        .iter()
        .filter(|file| !files.lines().any(|own| own == **file));
    Ok(missing
        .map(|file| format!("the package of {name} has no {file}"))
        .collect())
}

/// Files outside of its folder that a crate includes when it is compiled; a page that is tested as documentation is not.
fn outside() -> Result<Vec<String>, String> {
    let mut found = Vec::new();
    for (path, text) in sources(&root().join("crates"))? {
        let lines = text
            .lines()
            .filter(|line| !line.contains("#[doc = include_str!"));
        for line in lines.filter(|line| line.contains("include_")) {
            let named = line.split('"').nth(1).unwrap_or_default();
            let above = Path::new(named).components();
            let above = above.filter(|part| *part == Component::ParentDir).count();
            // The path begins with the folder of the crate.
            if above > path.components().count() - 2 {
                found.push(format!("{} includes {named}", path.display()));
            }
        }
    }
    Ok(found)
}
