//! `lagrangian export`: a model as C, for controllers and for other tools, and as a module of Python for JAX and `PyTorch`.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::Result;
use lagrangian::text::counted;
use lagrangian::{Learned, Model as _};
use lagrangian_export::arrays::{Library, module};
use lagrangian_export::fmu::{Fmu, archive};
use lagrangian_export::{About, Export, File, export};
use lagrangian_run::{
    Existing, ReadModel, file_name, read_model, refuse_existing, refuse_overwriting, write_bytes,
};
use serde_json::json;

use super::OutputMode;
use crate::export_args::ExportArgs;
use crate::failure::{Context, SUCCESS, mistake};
use crate::task::{Size, Task};

pub(super) fn run(args: &ExportArgs, mode: OutputMode) -> Result<u8> {
    let existing = Existing::from_force(args.force);
    let path = lagrangian_run::model_file(&args.model);
    check(args, &path, existing)?;
    let name = args.name.clone().unwrap_or_else(|| name_of(&path));
    let task = Task::start(
        "export",
        mode.quiet,
        Size::of_files(std::slice::from_ref(&path)),
    )?;
    let hint = "give the model.safetensors of a run, or the run";
    let ReadModel { model, hash, .. } = read_model(&path, hint)?;
    let hash = hash.sha256;
    let about = About {
        name: &name,
        hash: &hash,
    };
    let made = Made::of(args, &model, about).context(
        format!("cannot export '{}'", path.display()),
        "--name gives the prefix of all names in C, and the name of a module of Python",
    )?;
    drop(task);
    let written = made.write(args, existing)?;
    let code = made.export.as_ref().map(|export| &export.code);
    let stack = |number| code.map(|code| code.stack_bytes(number));
    let figures = json!({
        "command": "export",
        "model": path,
        "name": name,
        "sha256": hash,
        "functions": made.functions(),
        "joints": model.coordinates().dof(),
        "constants": code.map(|code| code.constants),
        "stack_bytes": { "double": stack(8), "float": stack(4) },
        "weights": made.weights,
        "compiled": made.unit.as_ref().map(|unit| unit.problem.is_none()),
        "files": written,
    });
    if let Some(problem) = made.unit.as_ref().and_then(|unit| unit.problem.as_ref()) {
        note!(
            "note: the unit holds its sources alone, which its importer has to compile: {problem}"
        );
    }
    mode.print(&figures, || made.as_text(&name, &written, &model))?;
    Ok(SUCCESS)
}

/// The names and the bytes of the files of a folder.
type Files = Vec<(String, Vec<u8>)>;

/// All that a model becomes.
struct Made {
    /// The C, where it is asked for.
    export: Option<Export>,
    unit: Option<Unit>,
    folders: Vec<(PathBuf, Files)>,
    /// Count of the weights of modules of Python.
    weights: Option<usize>,
}

impl Made {
    fn of(
        args: &ExportArgs,
        model: &Learned,
        about: About<'_>,
    ) -> Result<Self, lagrangian_export::Error> {
        let export = (args.c.is_some() || args.fmu.is_some()).then(|| export(model, about));
        let mut made = Self {
            export: export.transpose()?,
            unit: None,
            folders: Vec::new(),
            weights: None,
        };
        if let (Some(folder), Some(export)) = (&args.c, &made.export) {
            let unit = args.fmu.as_ref().map(|path| path.display().to_string());
            let files = export.files(unit.as_deref())?.into_iter();
            let files = files.map(|file| (file.name, file.text.into_bytes()));
            made.folders.push((folder.clone(), files.collect()));
        }
        if let (Some(_), Some(export)) = (&args.fmu, &made.export) {
            made.unit = Some(unit(export)?);
        }
        for (folder, library) in [(&args.jax, Library::Jax), (&args.torch, Library::Torch)] {
            if let Some(folder) = folder {
                let module = module(model, library, about)?;
                made.weights = Some(module.weights);
                made.folders.push((folder.clone(), module.files.into()));
            }
        }
        Ok(made)
    }

    /// Writes all files; returns their paths.
    fn write(&self, args: &ExportArgs, existing: Existing) -> Result<Vec<PathBuf>> {
        let mut written = Vec::new();
        if let (Some(file), Some(unit)) = (&args.fmu, &self.unit) {
            write_bytes(file, existing, &unit.bytes)?;
            written.push(file.clone());
        }
        for (folder, files) in &self.folders {
            written.extend(write(folder, files, existing)?);
        }
        Ok(written)
    }

    /// The names of the functions in C.
    fn functions(&self) -> Option<Vec<&'static str>> {
        let calls = &self.export.as_ref()?.interface.calls;
        Some(calls.iter().map(|call| call.name()).collect())
    }

    fn as_text(&self, name: &str, written: &[PathBuf], model: &Learned) -> String {
        let mut text = format!("{name}: {}", counted(model.coordinates().dof(), "joint"));
        if let Some(Export { interface, code }) = &self.export {
            text += &format!(
                ", {} functions, {} constants, at most {:.1} kB of stack",
                interface.calls.len() + 1,
                code.constants,
                code.stack_bytes(8) as f64 / 1000.0,
            );
        }
        if let Some(count) = self.weights {
            text += &format!(", {}", counted(count, "weight"));
        }
        text += "\n";
        for path in written {
            text += &format!("  {}\n", path.display());
        }
        if self.export.is_some() && model.visited().is_none() {
            text += "note: the model does not know the states of its data (it was saved by an older version): the C cannot tell when it is outside of them\n";
        }
        text
    }
}

/// Refuses files that cannot be written, before any work is done for them.
fn check(args: &ExportArgs, model: &Path, existing: Existing) -> Result<()> {
    let folders = [&args.c, &args.jax, &args.torch].map(Option::as_deref);
    if folders.iter().all(Option::is_none) && args.fmu.is_none() {
        return Err(mistake(
            "what should the model become?",
            "give --c FOLDER for C99 (with CasADi and Rust), --fmu FILE for a functional mock-up unit, --jax FOLDER or --torch FOLDER for a module \
             of Python, or several of them",
        ));
    }
    if args.jax.is_some() && args.jax == args.torch {
        return Err(mistake(
            "--jax and --torch name the same folder",
            "give each a folder of its own: the modules have the same name",
        ));
    }
    if let Some(version) = (args.fmi.as_deref()).filter(|version| !["2", "2.0"].contains(version)) {
        return Err(mistake(
            format!("units of FMI {version} are not written: those of FMI 2.0 are"),
            "omit --fmi: importing programs read FMI 2.0, among them Simulink, Dymola, OpenModelica, SimulationX and FMPy",
        ));
    }
    let mut folders = folders.into_iter().flatten();
    if let Some(folder) = folders.find(|folder| folder.exists() && !folder.is_dir()) {
        return Err(mistake(
            format!("cannot write to '{}': it is a file", folder.display()),
            "name a folder",
        ));
    }
    if let Some(file) = &args.fmu {
        refuse_overwriting([file], &[model.to_path_buf()])?;
        refuse_existing(file, existing)?;
    }
    Ok(())
}

/// Writes files into a folder; returns their paths.
fn write(folder: &Path, files: &Files, existing: Existing) -> Result<Vec<PathBuf>> {
    let mut paths = files.iter().map(|(name, _)| folder.join(name));
    if let Some(path) = paths.find(|path| existing == Existing::Keep && path.exists()) {
        return Err(mistake(
            format!("'{}' exists already", path.display()),
            "give another --c, --jax or --torch, or --force to replace what an export writes",
        ));
    }
    fs::create_dir_all(folder).context(
        format!("cannot make the folder '{}'", folder.display()),
        "check that its parent is a folder and can be written to",
    )?;
    let mut written = Vec::new();
    for (name, bytes) in files {
        let path = folder.join(name);
        write_bytes(&path, existing, bytes)?;
        written.push(path);
    }
    Ok(written)
}

/// A functional mock-up unit, and the reason for a missing library for this machine.
struct Unit {
    bytes: Vec<u8>,
    problem: Option<String>,
}

fn unit(export: &Export) -> Result<Unit, lagrangian_export::Error> {
    let sources = [export.code.header.clone(), export.code.source.clone()];
    let fmu = Fmu {
        interface: &export.interface,
        sources: &sources,
    };
    let library = library(&fmu.files(true)?, &export.interface.name);
    Ok(Unit {
        bytes: archive(&fmu, library.as_deref().ok())?,
        problem: library.err(),
    })
}

/// The library that the C compiler of this machine builds from the sources of a unit, or the reason why it is missing.
fn library(files: &[File], name: &str) -> Result<Vec<u8>, String> {
    let compile = || -> std::io::Result<Result<Vec<u8>, String>> {
        let folder = tempfile::tempdir()?;
        let mut sources = Vec::new();
        for file in files
            .iter()
            .filter(|file| file.name.starts_with("sources/"))
        {
            let own = file.name.trim_start_matches("sources/");
            fs::write(folder.path().join(own), &file.text)?;
            sources.extend(own.ends_with(".c").then_some(own));
        }
        let out = format!("{name}.{}", std::env::consts::DLL_EXTENSION);
        let mut cc = Command::new("cc");
        cc.current_dir(folder.path())
            .args(["-std=c99", "-O2", "-shared", "-fPIC", "-o", &out]);
        let output = cc.args(sources).arg("-lm").output()?;
        if !output.status.success() {
            let errors = String::from_utf8_lossy(&output.stderr);
            return Ok(Err(format!(
                "the C compiler failed: {}",
                errors.lines().next().unwrap_or_default()
            )));
        }
        Ok(Ok(fs::read(folder.path().join(out))?))
    };
    compile().unwrap_or_else(|error| Err(format!("no C compiler could be run (`cc`: {error})")))
}

/// A prefix in C from the name of the file, or of its run where all files have one name.
fn name_of(path: &Path) -> String {
    let of = |path: &Path| {
        path.file_stem()
            .map(|name| name.to_string_lossy().into_owned())
    };
    let own = of(path).filter(|name| name != "model");
    let run = || path.canonicalize().ok().and_then(|path| of(path.parent()?));
    identifier(&own.or_else(run).unwrap_or_default())
}

/// The text with single underscores in place of the characters that no identifier of C may have.
fn identifier(text: &str) -> String {
    let lower = text.to_lowercase();
    let parts = lower
        .split(|c: char| !c.is_ascii_alphanumeric())
        .filter(|part| !part.is_empty());
    let name = parts.collect::<Vec<_>>().join("_");
    // Its files have this name too.
    let is_plain = name.starts_with(|c: char| c.is_ascii_alphabetic()) && file_name(&name) == name;
    let name = if is_plain {
        name
    } else {
        format!("model_{name}")
    };
    name.chars()
        .take(40)
        .collect::<String>()
        .trim_end_matches('_')
        .to_string()
}

#[cfg(test)]
mod tests {
    use super::identifier;

    #[test]
    fn any_name_becomes_an_identifier() {
        for (text, name) in [
            ("UR10 (left)", "ur10_left"),
            ("7-joints", "model_7_joints"),
            ("бот", "model"),
            ("a__b_", "a_b"),
            ("", "model"),
            ("int", "int"),
            ("NUL", "model_nul"),
        ] {
            assert_eq!(identifier(text), name);
        }
    }
}
