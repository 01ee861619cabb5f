//! The files around a model in C, with a handwritten cart-pole: compiled without warnings, tested by its own build, and in
//! `CasADi` and `FMPy`. If a compiler or these packages are missing, the tests print that they were skipped.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod learned;
mod tools;

use std::fs;
use std::path::Path;
use std::process::Command;

use lagrangian_export::fmu::{Fmu, archive};
use lagrangian_export::support_files::SupportFiles;
use lagrangian_export::{Call, Drive, Error, File, Interface, Joint, Unit, casadi};
use tools::{
    exists, folder, library, python, script, succeed, unit, unit_sources, write, write_unit,
};

fn cart_pole() -> Interface {
    let joint = |name: &str, unit| Joint {
        name: name.into(),
        unit,
    };
    Interface {
        name: "cart_pole".into(),
        joints: vec![
            joint("cart <left & right>", Unit::Metre),
            joint("pole \"1\" */", Unit::Radian),
        ],
        drive: Drive::Inputs(1),
        calls: [
            Call::InverseDynamics,
            Call::ForwardDynamics,
            Call::MassMatrix,
            Call::Energy,
            Call::Step,
            Call::InverseDynamicsDerivatives,
            Call::ForwardDynamicsDerivatives,
            Call::DistanceFromData,
        ]
        .into(),
        description: "A cart with a pole, in closed form */".into(),
        version: env!("CARGO_PKG_VERSION").into(),
        hash: "0123abcd".into(),
        start: vec![0.0, 0.5, 0.0, 0.0],
    }
}

/// The message of an error.
fn text(error: Error) -> String {
    error.to_string()
}

fn sources() -> Vec<File> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixture");
    let read = |name: &str| File {
        name: name.into(),
        text: fs::read_to_string(folder.join(name)).unwrap(),
    };
    vec![read("cart_pole.h"), read("cart_pole.c")]
}

/// Model, adapters and support files.
fn all_files(interface: &Interface) -> Vec<File> {
    let around = SupportFiles {
        interface,
        mock_up: Some("cart_pole.fmu"),
        stack: [800, 400],
    };
    let mut files = around.files().unwrap();
    files.push(casadi::file(interface).unwrap());
    files.extend(unit_sources(interface, &sources()));
    files
}

#[test]
fn all_c_compiles_without_warnings() {
    let folder = folder("warnings");
    let files = all_files(&cart_pole());
    write(&folder, &files);
    let flags = [
        "-std=c99",
        "-Wall",
        "-Wextra",
        "-Wpedantic",
        "-Wconversion",
        "-Werror",
        "-fsyntax-only",
    ];
    let names = files.iter().map(|file| file.name.as_str());
    let c: Vec<&str> = names.filter(|name| name.ends_with(".c")).collect();
    assert_eq!(c.len(), 5, "{c:?}");
    for compiler in ["gcc", "clang"].into_iter().filter(|c| exists(c)) {
        for name in &c {
            let mut cc = Command::new(compiler);
            succeed(cc.args(flags).arg(name).current_dir(&folder));
            if !name.contains("casadi") {
                succeed(cc.arg("-Dcart_pole_FLOAT"));
            }
        }
    }
}

#[test]
fn the_build_of_an_export_passes_its_own_tests() {
    if !exists("cmake") || !exists("ctest") {
        return;
    }
    let folder = folder("build");
    write(&folder, &all_files(&cart_pole()));
    for arguments in [
        &["-S", ".", "-B", "build"][..],
        &["--build", "build"],
        &[
            "-E",
            "chdir",
            "build",
            "ctest",
            "--output-on-failure",
            "--no-tests=error",
        ],
    ] {
        succeed(Command::new("cmake").args(arguments).current_dir(&folder));
    }
    assert!(folder.join("build/cart_pole_casadi.so").exists() || !cfg!(target_os = "linux"));
}

#[test]
fn casadi_computes_differentiates_and_swings_a_pole_up() {
    let (Some(python), true) = (python(), exists("cc")) else {
        return;
    };
    let folder = folder("casadi");
    write(&folder, &all_files(&cart_pole()));
    let library = library(
        &folder,
        &["cart_pole.c", "cart_pole_casadi.c"],
        "cart_pole_casadi.so",
    );
    succeed(
        Command::new(python)
            .arg(script("with_casadi.py"))
            .arg(library),
    );
}

#[test]
fn a_functional_mock_up_unit_simulates_as_the_model_does() {
    let (Some(python), true) = (python(), exists("cc")) else {
        return;
    };
    let folder = folder("fmu");
    let (interface, sources) = (cart_pole(), sources());
    write(&folder, &all_files(&interface));
    write_unit(&folder, &interface, &sources);
    let alone = archive(&unit(&interface, &sources), None).unwrap();
    fs::write(folder.join("sources_only.fmu"), alone).unwrap();
    succeed(
        Command::new(&python)
            .arg(script("with_fmpy.py"))
            .arg(&folder),
    );
    let model = ["cart_pole.c", "cart_pole_casadi.c"];
    library(&folder, &model, "cart_pole_casadi.so");
    let mut both = Command::new(python);
    succeed(
        both.arg(script("any_model.py"))
            .arg(folder)
            .arg("cart_pole"),
    );
}

#[test]
fn names_that_are_no_identifiers_are_refused() {
    for name in [
        "",
        "1st",
        "a b",
        "a-b",
        "a__b",
        "a_",
        "_a",
        "ü",
        &"x".repeat(49),
        "a\"b",
        "a\n",
    ] {
        let interface = Interface {
            name: name.into(),
            ..cart_pole()
        };
        let found = casadi::file(&interface).map_err(text);
        assert_eq!(found, Err(text(Error::Name(name.into()))));
    }
}

#[test]
fn sizes_that_no_model_has_are_refused() {
    let none = Interface {
        joints: vec![],
        ..cart_pole()
    };
    assert_eq!(none.check().map_err(text), Err(text(Error::Joints(0))));
    let inputs = Interface {
        drive: Drive::Inputs(3),
        ..cart_pole()
    };
    let expected = Error::Inputs {
        inputs: 3,
        joints: 2,
    };
    assert_eq!(inputs.check().map_err(text), Err(text(expected)));
}

#[test]
fn a_unit_needs_accelerations_and_a_finite_first_state() {
    let (mut interface, sources) = (cart_pole(), sources());
    let bad = Interface {
        start: vec![0.0, f64::NAN, 0.0, 0.0],
        ..cart_pole()
    };
    let expected = Error::Start {
        expected: 4,
        given: 3,
    };
    let files = unit(&bad, &sources).files(true);
    assert_eq!(files.map_err(text), Err(text(expected)));
    interface.calls.remove(&Call::ForwardDynamics);
    let error = unit(&interface, &sources).files(true).unwrap_err();
    assert!(error.to_string().contains("forward_dynamics"), "{error}");
}

#[test]
fn a_model_of_accelerations_alone_compiles_everywhere() {
    if !exists("cc") {
        return;
    }
    let interface = Interface {
        calls: [Call::ForwardDynamics].into(),
        ..cart_pole()
    };
    let files = all_files(&interface);
    let folder = folder("plain");
    write(&folder, &files);
    let names = files.iter().map(|file| file.name.as_str());
    for name in names.filter(|name| name.ends_with(".c")) {
        let mut cc = Command::new("cc");
        cc.args([
            "-std=c99",
            "-Wall",
            "-Wextra",
            "-Werror",
            "-fsyntax-only",
            name,
        ]);
        succeed(cc.current_dir(&folder));
    }
    let description = unit(&interface, &[]).files(true).unwrap();
    assert!(!description[0].text.contains("energy"));
    assert!(!description[0].text.contains("unit=\"N\""));
    let forces = Interface {
        drive: Drive::Forces,
        ..cart_pole()
    };
    let forces = unit(&forces, &[]).files(true).unwrap();
    assert!(
        forces[0]
            .text
            .contains("<Real unit=\"N.m\" start=\"0.0\"/>")
    );
    assert!(
        description[0]
            .text
            .contains(r#"providesDirectionalDerivative="false""#)
    );
}

#[test]
fn the_same_unit_has_the_same_bytes() {
    let (interface, sources) = (cart_pole(), sources());
    let unit = unit(&interface, &sources);
    assert_eq!(archive(&unit, None).unwrap(), archive(&unit, None).unwrap());
    let twice = [sources.clone(), sources.clone()].concat();
    let unit = Fmu {
        sources: &twice,
        ..unit
    };
    assert!(matches!(archive(&unit, None), Err(Error::Archive(_))));
}
