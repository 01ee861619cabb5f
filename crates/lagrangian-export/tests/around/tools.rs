//! Folders, compilers and interpreters for tests.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use lagrangian_export::fmu::{Fmu, archive};
use lagrangian_export::{File, Interface};

/// An empty folder for one test.
pub(crate) fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("around-{name}"));
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).unwrap();
    folder
}

pub(crate) fn write(folder: &Path, files: &[File]) {
    for file in files {
        let path = folder.join(&file.name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, &file.text).unwrap();
    }
}

pub(crate) fn unit<'a>(interface: &'a Interface, sources: &'a [File]) -> Fmu<'a> {
    Fmu { interface, sources }
}

pub(crate) fn exists(program: &str) -> bool {
    let mut ask = Command::new(program);
    ask.arg("--version")
        .stdout(Stdio::null())
        .stderr(Stdio::null());
    let found = ask.status().is_ok_and(|status| status.success());
    if !found {
        eprintln!("skipped: there is no {program}");
    }
    found
}

pub(crate) fn succeed(command: &mut Command) {
    let output = command.output().unwrap();
    let [out, err] = [&output.stdout, &output.stderr].map(|text| String::from_utf8_lossy(text));
    assert!(output.status.success(), "{command:?}\n{out}\n{err}");
    println!("{out}");
}

/// The interpreter with `CasADi` and `FMPy`, from the environment variable.
pub(crate) fn python() -> Option<PathBuf> {
    let python = std::env::var_os("LAGRANGIAN_ADAPTERS_PYTHON").map(PathBuf::from);
    if python.is_none() {
        eprintln!(
            "skipped: LAGRANGIAN_ADAPTERS_PYTHON names no interpreter with the packages of tests/python/requirements.txt"
        );
    }
    python
}

pub(crate) fn script(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/python")
        .join(name)
}

/// Compiles sources to a shared library in the folder.
pub(crate) fn library(folder: &Path, sources: &[&str], name: &str) -> PathBuf {
    let out = folder.join(name);
    let mut cc = Command::new("cc");
    cc.args(["-std=c99", "-O2", "-shared", "-fPIC", "-o"])
        .arg(&out);
    succeed(cc.args(sources).arg("-lm").current_dir(folder));
    out
}

/// Writes the mock-up unit, compiled for this platform, from sources that are in the folder with their adapter.
pub(crate) fn write_unit(folder: &Path, interface: &Interface, sources: &[File]) {
    let name = &interface.name;
    let (model, adapter) = (format!("{name}.c"), format!("{name}_fmi2.c"));
    let library = fs::read(library(folder, &[&model, &adapter], "fmi2")).unwrap();
    let packed = archive(&unit(interface, sources), Some(&library)).unwrap();
    fs::write(folder.join(format!("{name}.fmu")), packed).unwrap();
}

/// The sources of the unit, with the model.
pub(crate) fn unit_sources(interface: &Interface, sources: &[File]) -> Vec<File> {
    let all = unit(interface, sources).files(true).unwrap().into_iter();
    let named = all.filter_map(|file| {
        let name = file.name.strip_prefix("sources/")?.to_string();
        Some(File { name, ..file })
    });
    named.collect()
}
