//! The throw-away virtual environment of the peers, under `target/race/venv`.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::environment::{self, last_lines};

/// A Python with the packages of the peers.
pub(super) struct Peers {
    pub(super) python: PathBuf,
    /// Why torch cannot be raced, where it cannot.
    pub(super) no_torch: Option<String>,
}

/// Makes the environment, or finds it as it was made before; torch only where it is wanted, for it takes gigabytes.
pub(super) fn prepare(folder: &Path, peers: &Path, torch: bool) -> Result<Peers, String> {
    let python = folder.join("bin/python");
    if !python.exists() {
        eprintln!("race: making {}", folder.display());
        let made = Command::new("python3")
            .args(["-m", "venv"])
            .arg(folder)
            .output();
        match made {
            Err(e) => {
                return Err(format!(
                    "python3 did not start ({e}): install Python 3.11 or later"
                ));
            }
            Ok(o) if !o.status.success() => {
                let why = last_lines(&o);
                return Err(format!(
                    "python3 -m venv failed: {why}; install the package python3-venv"
                ));
            }
            Ok(_) => {}
        }
    }
    install(folder, &peers.join("requirements.txt"))?;
    let no_torch = match torch {
        true => install(folder, &peers.join("requirements-torch.txt")).err(),
        false => Some("it was not asked for".into()),
    };
    Ok(Peers { python, no_torch })
}

/// Installs what a file of requirements names, unless that was done before.
fn install(folder: &Path, requirements: &Path) -> Result<(), String> {
    let name = requirements.file_name().unwrap_or_default();
    let (mark, wanted) = (folder.join(name), fs::read_to_string(requirements));
    let wanted = wanted.map_err(|e| format!("{}: {e}", requirements.display()))?;
    if fs::read_to_string(&mark).is_ok_and(|done| done == wanted) {
        return Ok(());
    }
    eprintln!(
        "race: installing {}",
        wanted.split_whitespace().collect::<Vec<_>>().join(", ")
    );
    environment::install(&folder.join("bin/python"), requirements)
        .map_err(|why| format!("{why} Python 3.11 or later is needed"))?;
    fs::write(&mark, wanted).map_err(|e| format!("{}: {e}", mark.display()))
}

/// The versions of the peers' packages, and of Python.
pub(super) fn versions(python: &Path) -> Vec<(String, String)> {
    const ASK: &str = "\
import platform, importlib.metadata as m
print('python', platform.python_version())
for name in ('jax', 'jaxlib', 'numpy', 'torch'):
    try: print(name, m.version(name))
    except m.PackageNotFoundError: pass";
    let output = Command::new(python).args(["-c", ASK]).output();
    let text = output
        .map(|o| String::from_utf8_lossy(&o.stdout).into_owned())
        .unwrap_or_default();
    let pairs = text.lines().filter_map(|l| l.split_once(' '));
    pairs
        .map(|(name, version)| (name.into(), version.into()))
        .collect()
}
