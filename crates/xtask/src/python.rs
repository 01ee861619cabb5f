//! `cargo xtask python`: builds the Python module, and runs the tests, types and examples of the package.

use std::env;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use crate::environment::Environment;
use crate::{Failure, built, cargo, root, succeed, target};

pub(crate) const USAGE: &str = "\
python   builds the Python module in a virtual environment of its own (target/python) and runs its tests and types; what
           follows goes to pytest";

pub(crate) fn main(flags: &[&str]) -> Result<(), Failure> {
    let root = root();
    let list = root.join("python").join("requirements-test.txt");
    let python = Environment::new(&target().join("python"), &list).python()?;
    build(&root)?;
    let package = root.join("python");
    let run = |what: &str, arguments: &[&str]| -> Result<(), String> {
        let mut command = Command::new(&python);
        command.args(arguments).current_dir(&package);
        command.env("LAGRANGIAN_COMMAND", built("lagrangian"));
        command.env("PYTHONPATH", &package);
        succeed(&mut command, what)
    };
    run(
        "the stubs of the estimators",
        &["tools/stubs.py", "--check"],
    )?;
    run("mypy", &["-m", "mypy"])?;
    let stubtest = [
        "-m",
        "mypy.stubtest",
        "lagrangian._lagrangian",
        "--ignore-missing-stub",
        "--mypy-config-file",
        "pyproject.toml",
    ];
    run("stubtest", &stubtest)?;
    // A core each: fits are short, and much of a test waits.
    let side_by_side = ["-m", "pytest", "-q", "-n", "2", "--dist", "loadfile"];
    run("pytest", &[&side_by_side, flags].concat())?;
    with_torch(&python, &package)?;
    Ok(())
}

/// Runs the tests that need `PyTorch` where the environment of the race has it: its package alone is several gigabytes.
fn with_torch(python: &Path, package: &Path) -> Result<(), String> {
    let torch = target()
        .join("race")
        .join("venv")
        .join("bin")
        .join("python");
    let has = |python: &Path| {
        let mut ask = Command::new(python);
        ask.args(["-c", "import torch"]).stderr(Stdio::null());
        ask.status().is_ok_and(|status| status.success())
    };
    if has(python) {
        return Ok(());
    }
    if !has(&torch) {
        let how = "`cargo xtask race` installs it under target/race/venv (6 GB)";
        eprintln!("xtask: python: the tests with PyTorch were not run, as there is none: {how}");
        return Ok(());
    }
    let site = "import sysconfig; print(sysconfig.get_path('purelib'), end='')";
    let site = Command::new(python).args(["-c", site]).output();
    let site = site.map_err(|e| format!("the folder of the packages is not known: {e}"))?;
    let paths = [
        package.into(),
        PathBuf::from(String::from_utf8_lossy(&site.stdout).as_ref()),
    ];
    let paths = env::join_paths(paths).map_err(|e| e.to_string())?;
    let mut command = Command::new(torch);
    command.args([
        "-m",
        "pytest",
        "-q",
        "tests/test_torch.py",
        "lagrangian/torch.py",
    ]);
    command.current_dir(package).env("PYTHONPATH", paths);
    succeed(&mut command, "pytest with PyTorch")
}

/// Builds the module with the features of all other tests, so that nothing is built twice, and puts it into the package.
pub(crate) fn build(root: &Path) -> Result<(), String> {
    let mut command = cargo();
    command.args(["build", "--workspace", "--all-features", "--all-targets"]);
    succeed(command.current_dir(root), "cargo build")?;
    let (from, to) = match cfg!(target_os = "macos") {
        true => ("lib_lagrangian.dylib", "_lagrangian.abi3.so"),
        false => ("lib_lagrangian.so", "_lagrangian.abi3.so"),
    };
    let (from, to) = (built(from), root.join("python").join("lagrangian").join(to));
    // A new file: a process may still hold the old one in its memory.
    let _ = fs::remove_file(&to);
    fs::copy(&from, &to).map_err(|e| format!("cannot copy {}: {e}", from.display()))?;
    Ok(())
}
