//! The declarations for Rust, compiled with `core` alone and called.

use std::fs;
use std::path::Path;
use std::process::Command;

use lagrangian_export::Export;

/// Compiles a program of the generated module and the C, and runs it.
pub(crate) fn check(folder: &Path, export: &Export) {
    let name = &export.interface.name;
    for file in export.files(None).unwrap() {
        fs::write(folder.join(&file.name), &file.text).unwrap();
    }
    // The module uses `core` alone; the program around it must print.
    fs::write(
        folder.join("core_only.rs"),
        format!("#![no_std]\n#[path = \"{name}.rs\"]\npub mod model;\n"),
    )
    .unwrap();
    fs::write(
        folder.join("asks.rs"),
        format!(
            "#[path = \"{name}.rs\"]\n#[allow(dead_code)]\nmod model;\nfn main() {{\n    assert!(model::selftest());\n    let mut e = 0.0;\n    \
             let q = [0.1; model::N];\n    assert_ne!(model::energy(&q, &q, &mut e), model::Status::NotFinite);\n    assert!(e.is_finite());\n    \
             let bad = [f64::NAN; model::N];\n    assert_eq!(model::energy(&bad, &q, &mut e), model::Status::NotFinite);\n}}\n"
        ),
    )
    .unwrap();
    let run = |program: &str, arguments: &[&str]| {
        let output = Command::new(program)
            .current_dir(folder)
            .args(arguments)
            .output()
            .unwrap();
        assert!(
            output.status.success(),
            "{program} {arguments:?}: {}",
            String::from_utf8_lossy(&output.stderr)
        );
    };
    let (source, object) = (format!("{name}.c"), format!("{name}.o"));
    run("cc", &["-std=c99", "-O1", "-c", &source, "-o", &object]);
    run(
        "rustc",
        &[
            "--edition=2021",
            "-Dwarnings",
            "--crate-type=lib",
            "--emit=metadata",
            "core_only.rs",
        ],
    );
    let link = format!("-Clink-arg={object}");
    run(
        "rustc",
        &[
            "--edition=2021",
            &link,
            "-Clink-arg=-lm",
            "asks.rs",
            "-o",
            "asks",
        ],
    );
    run(&folder.join("asks").display().to_string(), &[]);
}
