//! Models as C, through the command line.

use std::process::Command;

use crate::workbench::Workbench;

/// A small robot model in `run`.
fn with_model() -> Workbench {
    let bench = Workbench::new();
    bench.succeed("simulate two-link-arm --drive 3 --friction 0.3 --trajectories 4 --duration 2 --step 0.02 --out arm.csv");
    // The quality of the model does not matter.
    bench.run("fit arm.csv --model delan --forces viscous,coulomb --width 16 --steps 40 --out run");
    bench
}

/// Whether the C compiler of this machine accepts these sources.
fn compiles(bench: &Workbench, arguments: &str) {
    let mut cc = Command::new("cc");
    let strict = [
        "-std=c99",
        "-Wall",
        "-Wextra",
        "-Wpedantic",
        "-Werror",
        "-Wconversion",
    ];
    cc.current_dir(bench.path("."))
        .args(strict)
        .args(arguments.split_whitespace());
    let output = cc.output().unwrap();
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
}

#[test]
fn a_model_becomes_c_that_compiles_and_two_models_make_one_program() {
    let bench = with_model();
    let shown = bench.succeed("export run --c out").stdout;
    for words in [
        "run: 2 joints",
        "14 functions",
        "run.c",
        "run_casadi.c",
        "run.rs",
        "README.md",
        "CMakeLists.txt",
    ] {
        assert!(shown.contains(words), "{words}: {shown}");
    }
    let figures = bench
        .succeed("export run/model.safetensors --c out2 --name other --json")
        .json();
    assert_eq!(figures["joints"], 2);
    assert!(figures["stack_bytes"]["double"].as_u64().unwrap() < 100_000);
    bench.write(
        "both.c",
        "#include \"out/run.h\"\n#include \"out2/other.h\"\nint main(void) { return run_selftest() + other_selftest(); }\n",
    );
    compiles(&bench, "both.c out/run.c out2/other.c -lm -o both");
    assert!(Command::new(bench.path("both")).status().unwrap().success());
    bench.succeed("export run --fmu arm.fmu");
    bench.succeed("export run --fmu two.fmu --fmi 2");
    let unit = bench.read("arm.fmu");
    assert!(unit.starts_with(b"PK") && unit == bench.read("two.fmu"));
}

#[test]
fn what_cannot_be_exported_is_refused_and_nothing_is_lost() {
    let bench = with_model();
    bench.succeed("export run --c out --name arm");
    bench.succeed("export run --jax out-jax --name arm");
    let before = bench.read("out/arm.c");
    for (line, words) in [
        ("export run", "--c FOLDER"),
        ("export run --c out --name arm", "another --c"),
        ("export run --c out --name two__underscores", "letter"),
        ("export run --c out --name 7arm", "letter"),
        ("export run --c out --name été", "letter"),
        ("export run --c arm.csv", "folder"),
        ("export arm.csv --c other", "model"),
        ("export nothing --c other", "model"),
        ("export run --fmu run/model.safetensors --force", "model"),
        ("export run --fmu nowhere/arm.fmu", "folder"),
        (
            "export run --fmu other.fmu --fmi 3",
            "Simulink, Dymola, OpenModelica",
        ),
        ("export run --fmu other.fmu --fmi 3", "FMI 2.0"),
        ("export run --jax other --torch other", "folder of its own"),
        ("export run --jax arm.csv", "folder"),
        ("export run --torch other --name été", "letter"),
        ("export run --jax out-jax --name arm", "another --c, --jax"),
    ] {
        let message = bench.refuse(line);
        assert!(message.contains(words), "{line}: {message}");
    }
    assert_eq!(bench.read("out/arm.c"), before);
    assert!(!bench.path("other").exists() && !bench.path("other.fmu").exists());
    bench.succeed("export run --c out --name arm --force");
    bench.succeed("simulate pendulum --trajectories 3 --duration 2 --step 0.02 --out pendulum.csv");
    bench.run("fit pendulum.csv --model neural-ode --order first --steps 5 --width 16 --out flow");
    let message = bench.refuse("export flow --c other");
    assert!(message.contains("no equations"), "{message}");
    bench.succeed("export flow --jax other");
}

#[test]
fn a_model_becomes_modules_of_python_with_its_weights_beside_them() {
    let bench = with_model();
    let shown = bench.succeed("export run --jax jax --torch torch --name arm");
    assert!(shown.stdout.contains("arm: 2 joints, "), "{}", shown.stdout);
    let figures = bench
        .succeed("export run --c both --jax both --json")
        .json();
    let weights = figures["weights"].as_u64().unwrap() as usize;
    let array = bench.read("jax/arm_weights.npy");
    assert!(array.starts_with(b"\x93NUMPY\x01\x00") && array.len() == 128 + 8 * weights);
    assert_eq!(array, bench.read("torch/arm_weights.npy"));
    assert_eq!(array, bench.read("both/run_weights.npy"));
    for (file, library) in [("jax/arm.py", "jax.numpy"), ("torch/arm.py", "torch")] {
        let text = String::from_utf8(bench.read(file)).unwrap();
        assert!(text.starts_with("\"\"\"arm: ") && text.contains("def acceleration("));
        assert!(text.contains(&format!("import {library} as xp")), "{file}");
    }
}
