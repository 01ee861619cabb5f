//! `cargo xtask wheel`: the wheel of the Python package, tried where there is neither Rust nor a source.

use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::environment::Environment;
use crate::{Failure, root, succeed, target};

/// Its line of the usage.
pub(super) const USAGE: &str = "\
wheel    builds the wheel of the Python package (release, target/wheels), installs it in a fresh environment and tries it there";

pub(super) fn main(flags: &[&str]) -> Result<(), Failure> {
    if let [other, ..] = flags {
        return Err(Failure::usage(
            format!("wheel does not know '{other}'"),
            "wheel",
        ));
    }
    let wheel = build(&target().join("wheels"))?;
    println!(
        "xtask: {} has {:.1} MB",
        wheel.display(),
        fs::metadata(&wheel).map_or(0, |about| about.len()) as f64 / 1e6
    );
    tried(&wheel).map_err(Failure::from)
}

/// Builds the wheel into this folder, which holds nothing else then.
fn build(folder: &Path) -> Result<PathBuf, String> {
    let _ = fs::remove_dir_all(folder);
    let list = root().join("python").join("requirements-test.txt");
    let python = Environment::new(&target().join("python"), &list).python()?;
    let mut pip = Command::new(python);
    pip.args(["-m", "pip", "wheel", "--quiet", "--no-deps", "--wheel-dir"]);
    pip.arg(folder).arg(root().join("python"));
    succeed(&mut pip, "pip wheel")?;
    let files = fs::read_dir(folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let mut wheels = files
        .filter_map(|file| Some(file.ok()?.path()))
        .filter(|path| path.extension() == Some(OsStr::new("whl")));
    wheels
        .next()
        .ok_or_else(|| format!("there is no wheel in {}", folder.display()))
}

/// Installs a wheel where there was nothing, and uses it in a folder of its own.
fn tried(wheel: &Path) -> Result<(), String> {
    let folder = target().join("wheels").join("fresh");
    let list = folder.with_extension("txt");
    fs::write(
        &list,
        format!("lagrangian[ros] @ file://{}\n", wheel.display()),
    )
    .map_err(|e| format!("{}: {e}", list.display()))?;
    let python = Environment::new(&folder, &list).python()?;
    let mut attempt = Command::new(python);
    attempt.arg(root().join("python").join("tools").join("try_wheel.py"));
    attempt.current_dir(&folder).env_remove("PYTHONPATH");
    succeed(&mut attempt, "a fit and the command of the wheel")
}
