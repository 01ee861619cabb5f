//! Virtual environments of Python, for the chores that run programs in it.

use std::env;
use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

/// The oldest interpreter that the package supports.
const OLDEST: (u32, u32) = (3, 10);

/// A virtual environment with the packages of a list.
pub(crate) struct Environment {
    folder: PathBuf,
    list: PathBuf,
}

impl Environment {
    pub(crate) fn new(folder: &Path, list: &Path) -> Self {
        Self {
            folder: folder.into(),
            list: list.into(),
        }
    }

    /// Its interpreter; the environment is made where it is missing or its list has changed.
    pub(crate) fn python(&self) -> Result<PathBuf, String> {
        let python = self.folder.join("bin").join("python");
        let wanted = fs::read(&self.list)
            .map_err(|e| format!("cannot read {}: {e}", self.list.display()))?;
        let installed = self.folder.join("requirements.txt");
        if python.exists() && fs::read(&installed).is_ok_and(|own| own == wanted) {
            return Ok(python);
        }
        self.make()?;
        install(&python, &self.list)?;
        fs::write(&installed, wanted)
            .map_err(|e| format!("cannot write {}: {e}", installed.display()))?;
        Ok(python)
    }

    /// The places of programs, its own before the others.
    pub(crate) fn path(&self) -> Result<OsString, String> {
        let others = env::var_os("PATH").unwrap_or_default();
        let own = [self.folder.join("bin")].into_iter();
        env::join_paths(own.chain(env::split_paths(&others))).map_err(|e| e.to_string())
    }

    fn make(&self) -> Result<(), String> {
        let base = env::var_os("PYTHON").unwrap_or_else(|| "python3".into());
        let old = format!(
            "import sys; raise SystemExit(sys.version_info < {:?})",
            OLDEST
        );
        let remedy = format!(
            "install Python {}.{} or later with venv and pip (Debian: `apt-get install python3-venv`), or name one in PYTHON",
            OLDEST.0, OLDEST.1
        );
        let found = Command::new(&base).args(["-c", &old]).status();
        if !found.is_ok_and(|status| status.success()) {
            return Err(format!("the Python package needs an interpreter: {remedy}"));
        }
        let venv = Command::new(&base)
            .args(["-m", "venv"])
            .arg(&self.folder)
            .status();
        if !venv.is_ok_and(|status| status.success()) {
            return Err(format!("no virtual environment could be made: {remedy}"));
        }
        Ok(())
    }
}

/// Installs the packages of a list for an interpreter: by uv, which takes seconds where pip takes minutes and keeps one copy for all
/// environments; by pip where uv is not to be had or does not reach an index.
pub(crate) fn install(python: &Path, list: &Path) -> Result<(), String> {
    let pip = |arguments: &[&str]| {
        let quiet = [
            "-m",
            "pip",
            "install",
            "--quiet",
            "--disable-pip-version-check",
        ];
        Command::new(python).args(quiet).args(arguments).output()
    };
    let by_uv = pip(&["uv"]).is_ok_and(|o| o.status.success()) && {
        let mut uv = Command::new(python);
        uv.args(["-m", "uv", "pip", "install", "--quiet", "--python"]);
        uv.arg(python).arg("-r").arg(list).stderr(Stdio::null());
        uv.status().is_ok_and(|status| status.success())
    };
    if by_uv {
        return Ok(());
    }
    match pip(&["-r", &list.to_string_lossy()]) {
        Ok(output) if output.status.success() => Ok(()),
        Ok(output) => Err(format!(
            "pip could not install the packages of {}: {}; is there a network?",
            list.display(),
            last_lines(&output)
        )),
        Err(e) => Err(format!("pip did not start: {e}")),
    }
}

/// The last lines of what a program has said.
pub(crate) fn last_lines(output: &Output) -> String {
    let text = [&output.stdout[..], &output.stderr].concat();
    let text = String::from_utf8_lossy(&text);
    let lines: Vec<&str> = text.lines().filter(|l| !l.trim().is_empty()).collect();
    lines[lines.len().saturating_sub(3)..].join("; ")
}
