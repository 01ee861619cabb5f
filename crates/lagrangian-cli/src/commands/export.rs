//! `lagrangian export`: a model as C, for controllers and for other tools.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::Result;
use lagrangian::{Learned, Model as _, SavedModel};
use lagrangian_export::{About, Export, export};
use lagrangian_run::{Existing, Hashed, refuse_existing, write_bytes};
use serde_json::json;

use super::OutputMode;
use crate::export_args::ExportArgs;
use crate::failure::{Advise, mistake};
use crate::task::{Size, Task};

pub(super) fn run(args: &ExportArgs, mode: OutputMode) -> Result<ExitCode> {
    let existing = Existing::from_force(args.force);
    let path = model_file(&args.model);
    let name = match &args.name {
        Some(name) => name.clone(),
        None => name_of(&path),
    };
    let Some(folder) = &args.c else {
        return Err(mistake(
            "export to what?",
            "give --c FOLDER for C99 (with CasADi and Rust), and --fmu FILE for a functional mock-up unit",
        ));
    };
    if folder.is_file() {
        return Err(mistake(
            format!("cannot write to '{}': it is a file", folder.display()),
            "name a folder",
        ));
    }
    let task = Task::start("export", mode.quiet, Size::of_files(&[path.clone()]))?;
    let (model, hash) = open(&path)?;
    let export = export(&model, About { name: &name, hash: &hash }).advise(
        format!("cannot export '{}'", path.display()),
        "--name gives the prefix of all names in C",
    )?;
    let files = export.files();
    for file in &files {
        refuse_existing(&folder.join(&file.name), existing)?;
    }
    drop(task);
    fs::create_dir_all(folder).advise(
        format!("cannot make the folder '{}'", folder.display()),
        "check that its parent is writable",
    )?;
    let mut written = Vec::new();
    for file in &files {
        let path = folder.join(&file.name);
        write_bytes(&path, existing, file.text.as_bytes())?;
        written.push(path);
    }
    let Export { interface, code } = &export;
    let functions: Vec<&str> = interface.calls.iter().map(|call| call.name()).collect();
    let figures = json!({
        "command": "export",
        "model": path,
        "name": name,
        "sha256": hash,
        "functions": functions,
        "joints": interface.joints.len(),
        "constants": code.constants,
        "stack_bytes": { "double": 8 * code.stack + 512, "float": 4 * code.stack + 512 },
        "files": written,
    });
    mode.print(&figures, || as_text(&export, &written, &model))?;
    Ok(ExitCode::SUCCESS)
}

fn as_text(export: &Export, written: &[PathBuf], model: &Learned) -> String {
    let Export { interface, code } = export;
    let mut text = format!(
        "{}: {} joints, {} functions, {} constants, at most {:.1} kB of stack\n",
        interface.name,
        interface.joints.len(),
        interface.calls.len() + 1,
        code.constants,
        (8 * code.stack + 512) as f64 / 1000.0,
    );
    for path in written {
        text += &format!("  {}\n", path.display());
    }
    if model.visited().is_none() {
        text += "note: the model does not know the states of its data (it was saved by an older version): the C cannot tell when it is outside of them\n";
    }
    text
}

/// The model of a run, where a run is given.
fn model_file(path: &Path) -> PathBuf {
    match path.is_dir() {
        true => path.join("model.safetensors"),
        false => path.to_path_buf(),
    }
}

/// A prefix in C from the name of the file, or of its run where all files have the same.
fn name_of(path: &Path) -> String {
    let of = |path: &Path| path.file_stem().map(|name| name.to_string_lossy().into_owned());
    let own = of(path).filter(|name| name != "model");
    let run = || path.canonicalize().ok().and_then(|path| of(path.parent()?));
    identifier(&own.or_else(run).unwrap_or_default())
}

/// The text with what no identifier of C may have as single underscores.
fn identifier(text: &str) -> String {
    let lower = text.to_lowercase();
    let parts = lower.split(|c: char| !c.is_ascii_alphanumeric()).filter(|part| !part.is_empty());
    let name = parts.collect::<Vec<_>>().join("_");
    let name = match name.starts_with(|c: char| c.is_ascii_alphabetic()) {
        true => name,
        false => format!("model_{name}"),
    };
    name.chars().take(40).collect::<String>().trim_end_matches('_').to_string()
}

/// A saved model, and the hash of its file.
fn open(path: &Path) -> Result<(Learned, String)> {
    let shown = format!("cannot read the model '{}'", path.display());
    let hint = "give the model.safetensors of a run, or the run";
    let (reader, hashing) = Hashed::open(path).advise(&shown, hint)?;
    let saved = SavedModel::read(reader).advise(&shown, hint)?;
    let model = Learned::load(&saved).advise(&shown, hint)?;
    Ok((model, hashing.finish().advise(&shown, hint)?.sha256))
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
        ] {
            assert_eq!(identifier(text), name);
        }
    }
}
