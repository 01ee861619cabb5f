//! Lists the files of the page of `lagrangian lab`, so that the binary can hold them: what `cargo xtask web` left in `web/dist`, or
//! nothing where the page was not built.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::{env, fs, io};

fn main() -> io::Result<()> {
    println!("cargo::rerun-if-changed=build.rs");
    if env::var_os("CARGO_FEATURE_LAB").is_none() {
        return Ok(());
    }
    let root = PathBuf::from(env::var("CARGO_MANIFEST_DIR").unwrap_or_default());
    let page = root.join("../../web/dist");
    println!("cargo::rerun-if-changed={}", page.display());
    let out = PathBuf::from(env::var("OUT_DIR").unwrap_or_default());
    let mut list = String::from("&[\n");
    for (number, file) in files(&page)?.into_iter().enumerate() {
        let name = file.strip_prefix(&page).unwrap_or(&file);
        let name = name.to_string_lossy().replace('\\', "/");
        // A copy, so that a page that is built again meanwhile does not change under the compiler.
        let copy = out.join(format!("page-{number}"));
        fs::copy(&file, &copy)?;
        // OK because writing to a string does not fail.
        let _ = writeln!(list, "    ({name:?}, include_bytes!({copy:?})),");
    }
    list.push_str("]\n");
    fs::write(out.join("page.rs"), list)
}

/// All files below a folder but hidden ones, in an order that is always the same; none where there is no such folder.
fn files(folder: &Path) -> io::Result<Vec<PathBuf>> {
    let mut all = Vec::new();
    if !folder.is_dir() {
        return Ok(all);
    }
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        if entry.file_name().to_string_lossy().starts_with('.') {
            continue;
        }
        let path = entry.path();
        match path.is_dir() {
            true => all.extend(files(&path)?),
            false => all.push(path),
        }
    }
    all.sort();
    Ok(all)
}
