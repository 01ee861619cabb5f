//! Bad input is refused with a helpful message, and no existing file is lost.

use crate::workbench::{Outcome, Workbench, swing};

#[test]
fn a_missing_file_is_named() {
    let message = Workbench::new().refuse("check nowhere.csv");
    assert!(
        message.contains("'nowhere.csv'") && message.contains("hint: "),
        "{message}"
    );
}

#[test]
fn the_command_that_served_the_laboratory_names_the_server_to_use_instead() {
    for line in ["lab", "lab --no-open --folder web/dist"] {
        let message = Workbench::new().refuse(line);
        assert!(
            message.contains("hint: python3 -m http.server --directory web/dist"),
            "{message}"
        );
    }
}

#[test]
fn the_command_that_ran_sweeps_names_the_program_to_use_instead() {
    for line in ["sweep", "sweep plan.toml --out s --shard 1/2"] {
        let message = Workbench::new().refuse(line);
        assert!(
            message.contains("python -m lagrangian.sweep plan.toml --out DIR"),
            "{message}"
        );
    }
}

#[test]
fn an_unknown_format_lists_the_known_ones() {
    let bench = Workbench::new();
    bench.write("a.xlsx", "");
    assert!(bench.refuse("check a.xlsx").contains("csv, npz"));
}

#[test]
fn a_missing_column_quotes_the_flag_that_names_it() {
    let bench = Workbench::new();
    bench.write("a.csv", "time,theta\n0,1\n1,2\n");
    assert!(bench.refuse("check a.csv").contains("--time"));
    assert!(bench.refuse("check a.csv --time time").contains("--q"));
    assert!(
        bench
            .refuse("check a.csv --time time --q angle")
            .contains("time, theta")
    );
}

#[test]
fn text_in_a_number_is_found_with_line_and_column() {
    let bench = Workbench::new();
    bench.write("a.csv", "t,q1\n0,1\n1,two\n");
    let message = bench.refuse("check a.csv");
    assert!(
        message.contains("line 3") && message.contains("'q1'") && message.contains("'two'"),
        "{message}"
    );
}

#[test]
fn data_that_cannot_be_fitted_fails_the_check_and_the_fit() {
    let bench = Workbench::new();
    bench.write("short.csv", "t,q1,qd1\n0,1,0\n0.1,0.9,-1\n");
    let degrees: String = (0..200)
        .map(|k| f64::from(k) * 0.05)
        .map(|t| format!("{t},{},{}\n", t.sin(), t.cos() * 57.3))
        .collect();
    bench.write("degrees.csv", &format!("t,q1,qd1\n{degrees}"));
    bench.write("hole.csv", &swing().replace("\n0.5,", "\nnan,"));
    for file in ["short.csv", "degrees.csv", "hole.csv"] {
        let check = bench.run(&format!("check {file} --json"));
        assert_eq!(check.code, 1, "{file}: {}", check.stderr);
        assert_eq!(check.json()["passed"], false, "{file}");
        let message = bench.refuse(&format!("fit {file} --steps 1 --out run-{file}"));
        assert!(
            message.contains("meaningless") && message.contains("hint: "),
            "{message}"
        );
    }
}

#[test]
fn torques_that_are_no_numbers_are_named_with_their_trajectory() {
    let bench = Workbench::new();
    bench.succeed(
        "simulate pendulum --drive 1 --friction 0.2 --trajectories 5 --duration 2 --out good.csv",
    );
    let good = String::from_utf8(bench.read("good.csv")).unwrap();
    for (name, from, to) in [("huge", 0, "1e308"), ("nan", 0, "nan"), ("inf", 250, "inf")] {
        let bad = |(k, line): (usize, &str)| match line.rsplit_once(',') {
            Some((row, _)) if k > from => format!("{row},{to}\n"),
            _ => format!("{line}\n"),
        };
        let text: String = good.lines().enumerate().map(bad).collect();
        bench.write(&format!("{name}.csv"), &text);
        let check = bench.run(&format!("check {name}.csv --angle all"));
        assert_eq!(check.code, 1, "{name}: {}", check.stdout);
        assert!(
            check.stdout.contains("'tau1'") && !check.stdout.contains("constant at inf"),
            "{name}: {}",
            check.stdout
        );
        let message = bench.refuse(&format!("fit {name}.csv --angle all --out run-{name}"));
        let first = if from == 0 { "'1'" } else { "'2'" };
        assert!(message.contains(first), "{name}: {message}");
    }
    assert!(
        bench
            .refuse("simulate pendulum --friction -1")
            .contains("--friction")
    );
}

/// A model in the first version of the format, with blanks in the place of the checksum.
fn without_checksum(mut model: Vec<u8>) -> Vec<u8> {
    let field = br#"2,\"checksum\":\"01234567\","#;
    let begin = model.windows(13).position(|w| w == &field[..13]).unwrap();
    model[begin..begin + field.len()].fill(b' ');
    model[begin..begin + 2].copy_from_slice(b"1,");
    model
}

#[test]
fn a_damaged_model_that_predicts_no_numbers_says_so() {
    let bench = Workbench::new();
    bench.succeed("simulate pendulum --duration 2 --out data.csv");
    bench.succeed("fit data.csv --model delan --steps 2 --width 8 --out run");
    let model = bench.read("run/model.safetensors");
    let header = u64::from_le_bytes(model[..8].try_into().unwrap()) as usize + 8;
    let huge = 1e308_f64.to_le_bytes();
    let weights = (model.len() - header) / 8;
    let damaged = [&model[..header], &huge.repeat(weights)].concat();
    std::fs::write(bench.path("damaged.safetensors"), &damaged).unwrap();
    let message = bench.refuse("torque damaged.safetensors data.csv");
    assert!(message.contains("checksum"), "{message}");
    std::fs::write(bench.path("old.safetensors"), without_checksum(damaged)).unwrap();
    let told = bench.run("torque old.safetensors data.csv");
    assert!(
        told.stderr.contains("before models held a checksum"),
        "{}",
        told.stderr
    );
    assert!(told.stderr.contains("not finite"), "{}", told.stderr);
    let scored = bench.run("score old.safetensors data.csv");
    assert_eq!(scored.code, 1, "{}", scored.stdout);
}

#[test]
fn steps_durations_and_tolerances_must_be_positive_numbers() {
    let bench = Workbench::new();
    for flag in [
        "--step 0",
        "--step -1",
        "--step nan",
        "--duration 0",
        "--duration -3",
        "--tolerance inf",
    ] {
        assert!(
            bench
                .refuse(&format!("simulate pendulum {flag}"))
                .contains("above 0"),
            "{flag}"
        );
    }
}

#[test]
fn an_unknown_system_or_parameter_lists_the_known_ones() {
    let bench = Workbench::new();
    assert!(
        bench
            .refuse("simulate pendulun")
            .contains("double-pendulum")
    );
    assert!(
        bench
            .refuse("simulate pendulum --set len=1")
            .contains("length")
    );
    assert!(
        bench
            .refuse("simulate pendulum --set length=-1")
            .contains("length is -1")
    );
    assert!(
        bench
            .refuse("simulate pendulum --set length")
            .contains("name=value")
    );
}

#[test]
fn an_initial_state_of_another_size_is_refused() {
    let message = Workbench::new().refuse("simulate pendulum --q0 1,2 --qd0 0,0");
    assert!(message.contains("2 values where 1"), "{message}");
}

#[test]
fn a_file_that_was_there_survives_every_command() {
    let bench = Workbench::new();
    for name in ["a.csv", "a.json", "b.toml"] {
        bench.write(name, "precious");
    }
    bench.write("swing.csv", &swing());
    assert!(
        bench
            .refuse("simulate pendulum --out a.csv")
            .contains("--force")
    );
    assert!(
        bench
            .refuse("simulate pendulum --out b.csv")
            .contains("b.toml")
    );
    assert!(
        bench
            .refuse("check swing.csv --out a.json")
            .contains("--force")
    );
    for name in ["a.csv", "a.json", "b.toml"] {
        assert_eq!(bench.read(name), b"precious");
    }
    assert!(!bench.path("b.csv").exists());
}

#[test]
fn a_run_folder_that_holds_something_is_refused() {
    let bench = Workbench::new();
    bench.write("swing.csv", &swing());
    std::fs::create_dir(bench.path("run")).unwrap();
    bench.write("run/notes.txt", "precious");
    assert!(
        bench
            .refuse("fit swing.csv --steps 1 --out run")
            .contains("not empty")
    );
    assert!(
        bench
            .refuse("fit --resume --out run")
            .contains("no run to resume")
    );
    assert!(
        bench
            .refuse("fit swing.csv --steps 1 --out swing.csv")
            .contains("cannot write to the folder")
    );
    assert_eq!(bench.names("run"), ["notes.txt"]);
    assert_eq!(bench.read("swing.csv"), swing().as_bytes());
}

/// A swing without signals to estimate, so that there is no note before an error.
fn swing_with_accelerations() -> String {
    let row = |t: f64| format!("{t},{},{},{}\n", t.sin(), t.cos(), -t.sin());
    let rows: String = (0..200).map(|k| row(f64::from(k) * 0.05)).collect();
    format!("t,q1,qd1,qdd1\n{rows}")
}

#[test]
fn a_mistake_under_force_does_not_cost_the_earlier_run() {
    let bench = Workbench::new();
    bench.write("swing.csv", &swing_with_accelerations());
    bench.succeed("fit swing.csv --steps 2 --width 16 --out run");
    let (names, model) = (bench.names("run"), bench.read("run/model.safetensors"));
    for mistake in [
        "nowhere.csv",
        "swing.csv --q theta",
        "swing.csv --form convex --width 20",
        "swing.csv --form convex --model mlp",
        "swing.csv --trunks separate",
        "swing.csv --vector-potential --model mlp",
        "swing.csv --forces rotor",
        "swing.csv --model mlp --dissipation",
        "swing.csv --model delan --loss torque-power",
        "swing.csv --batch 1000000000",
        "swing.csv --batch 32 --batch-first 64",
        "swing.csv --batch-first 16 --loss rollout",
        "swing.csv --optimizer adam --damping loss",
        "swing.csv --loss rollout --damping adaptive",
        "swing.csv --loss torque",
    ] {
        bench.refuse(&format!("fit {mistake} --steps 2 --out run --force"));
        assert_eq!(bench.names("run"), names, "{mistake}");
        assert_eq!(bench.read("run/model.safetensors"), model, "{mistake}");
    }
}

#[test]
fn a_refused_resume_makes_no_folder() {
    let bench = Workbench::new();
    bench.refuse("fit --resume --out run");
    assert!(!bench.path("run").exists());
}

#[test]
fn more_than_the_memory_holds_is_refused_at_once() {
    let bench = Workbench::new();
    for flags in [
        "simulate pendulum --trajectories 1000000 --duration 1000",
        "simulate pendulum --duration 1e12 --step 1e-9",
        "simulate pendulum --duration 99 --step 1e-6",
    ] {
        let message = bench.refuse(flags);
        assert!(message.contains("hint: "), "{flags}: {message}");
    }
    for (flags, bound) in [
        ("--trajectories 4000000000", "1..=1000000"),
        ("--step 1e300 --duration 1e-300", "from 1e-12 to 1e12"),
    ] {
        let message = bench.refuse(&format!("simulate pendulum {flags}"));
        assert!(message.contains(bound), "{flags}: {message}");
    }
    bench.write("swing.csv", &swing_with_accelerations());
    let message = bench.refuse("fit swing.csv --width 4096 --layers 16 --steps 1 --out run");
    assert!(message.contains("--width"), "{message}");
}

#[test]
fn a_folder_that_does_not_exist_is_named() {
    assert!(
        Workbench::new()
            .refuse("simulate pendulum --out no/where.csv")
            .contains("'no'")
    );
}

#[test]
fn what_is_no_model_is_refused() {
    let bench = Workbench::new();
    bench.write("model.safetensors", "");
    bench.write(
        "huge.safetensors",
        "\u{7f}\u{7f}\u{7f}\u{7f}\u{7f}\u{7f}\u{7f}\u{7f}{}",
    );
    for model in [
        "model.safetensors",
        "huge.safetensors",
        "missing.safetensors",
    ] {
        let message = bench.refuse(&format!("rollout {model} --q0 1 --qd0 0"));
        assert!(
            message.contains(model) && message.contains("hint: "),
            "{message}"
        );
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_a_failure_and_leaves_nothing_behind() {
    let bench = Workbench::new();
    let full = std::fs::OpenOptions::new()
        .write(true)
        .open("/dev/full")
        .unwrap();
    let outcome = Outcome::of(
        bench
            .command("simulate pendulum")
            .stdout(full)
            .output()
            .unwrap(),
    );
    assert_eq!(outcome.code, 1, "{}", outcome.stderr);
    assert!(
        outcome.stderr.contains("No space left"),
        "{}",
        outcome.stderr
    );

    // A limit on the size of files, so that no output can be completed.
    let program = bench.command("").get_program().to_owned();
    let script =
        "trap '' XFSZ; ulimit -f 1; exec \"$0\" simulate pendulum --duration 100 --out a.csv";
    let mut shell = std::process::Command::new("sh");
    shell
        .arg("-c")
        .arg(script)
        .arg(program)
        .current_dir(bench.path(""));
    let outcome = Outcome::of(shell.output().unwrap());
    assert_eq!(outcome.code, 1, "{}", outcome.stderr);
    assert!(bench.names("").is_empty(), "{:?}", bench.names(""));
}

#[test]
fn a_negative_number_is_a_value_that_the_flag_refuses() {
    let bench = Workbench::new();
    bench.write("swing.csv", &swing());
    for (flag, must) in [
        ("fit swing.csv --seconds -1", "above 0"),
        ("fit swing.csv --steps -1", "1 or above"),
        ("fit swing.csv --seed -1", "0 or above"),
        ("fit swing.csv --learning-rate -0.1", "above 0"),
        ("fit swing.csv --low-pass -1", "0 or above"),
        ("check swing.csv --every -2", "-2 is not in"),
        ("simulate pendulum --noise -1", "0 or above"),
        ("demo --samples -5", "-5 is not in"),
    ] {
        let message = bench.refuse(flag);
        assert!(message.contains(must), "{flag}: {message}");
    }
}

#[test]
fn a_fit_that_does_not_begin_leaves_no_folder() {
    let bench = Workbench::new();
    std::fs::create_dir(bench.path("own")).unwrap();
    bench.write("short.csv", "t,q1\n0,1\n0.1,0.9\n");
    for command in [
        "fit nothere.csv --out new/run",
        "fit short.csv --out new/run",
        "fit nothere.csv --out own",
    ] {
        bench.refuse(command);
    }
    assert_eq!(bench.names(""), ["own", "short.csv"]);
}

#[test]
fn forces_that_cannot_be_told_apart_ask_for_their_joints() {
    let bench = Workbench::new();
    let rows: String = (0..200)
        .map(|k| f64::from(k) * 0.02)
        .map(|t| format!("{t},{},{},{}\n", t.sin(), t.cos(), (2.0 * t).sin()))
        .collect();
    bench.write("cart.csv", &format!("t,x,theta,u\n{rows}"));
    let columns = "check cart.csv --q x,theta --tau u";
    assert!(bench.refuse(columns).contains("--actuated"));
    assert!(
        bench
            .refuse(&format!("{columns} --actuated y"))
            .contains("'y'")
    );
    let report = bench.run(&format!("{columns} --actuated x --json"));
    assert!(
        report.stderr.contains("no column for the force on theta"),
        "{}",
        report.stderr
    );
    assert!(
        report.stdout.contains("no column of its force"),
        "{}",
        report.stdout
    );
}

#[test]
fn a_delay_of_another_number_of_joints_or_longer_than_the_motion_is_refused() {
    let bench = Workbench::new();
    bench.write("swing.csv", "t,q1,tau1\n0,0,0\n1,1,1\n2,0,0\n3,1,0\n");
    for delay in ["1,2", "1e6", "-1e6", "late"] {
        let message = bench.refuse(&format!("check swing.csv --delay {delay}"));
        assert!(
            message.contains("delay") && message.contains("hint: ") || delay == "late",
            "{message}"
        );
    }
}

#[test]
fn a_search_for_a_lagrangian_needs_its_flag_a_positive_time_and_data_that_pass() {
    let bench = Workbench::new();
    bench.write("a.csv", &swing());
    assert!(
        bench
            .refuse("check a.csv --seconds 1")
            .contains("--lagrangian")
    );
    assert!(
        bench
            .refuse("check a.csv --lagrangian --seconds 0")
            .contains("--seconds")
    );
    bench.write("short.csv", "t,q1,qd1\n0,1,0\n0.1,0.9,-1\n");
    let message = bench.refuse("check short.csv --lagrangian");
    assert!(message.contains("without --lagrangian"), "{message}");
}

#[test]
fn a_hamiltonian_network_says_what_it_needs() {
    let bench = Workbench::new();
    bench.succeed("simulate pendulum --duration 2 --step 0.01 --q0 1 --qd0 0 --out plain.csv");
    bench.succeed("simulate pendulum --duration 2 --step 0.01 --drive 1 --out driven.csv");
    for (line, remedy) in [
        ("plain.csv --model hnn", "--masses"),
        (
            "plain.csv --model hnn --structure none",
            "--momenta velocities",
        ),
        (
            "plain.csv --model hnn --masses 1,2",
            "one for each coordinate",
        ),
        ("plain.csv --model hnn --masses 0", "above 0"),
        (
            "plain.csv --model hnn --masses 1 --momenta recorded",
            "--momenta",
        ),
        ("plain.csv --model lnn --masses 1", "--model hnn"),
        ("plain.csv --model hnn --form convex", "--model lnn"),
        (
            "plain.csv --model hnn --masses 1 --loss torque",
            "acceleration",
        ),
        ("plain.csv --model hnn --p q9", "--p"),
        ("driven.csv --model hnn --momenta velocities", "--masses"),
        (
            "plain.csv --model hnn --momenta velocities --dissipation",
            "omitted",
        ),
        (
            "plain.csv --model hnn --masses 1 --nominal two_link_arm",
            "lnn",
        ),
    ] {
        let message = bench.refuse(&format!("fit {line} --angle all --steps 1"));
        assert!(message.contains(remedy), "{line}: {message}");
    }
}

#[test]
fn values_of_any_length_are_repeated_in_at_most_sixty_characters() {
    let bench = Workbench::new();
    let long = "x".repeat(10_000);
    bench.write("a.csv", "t,q1\n0,1\n1,2\n2,3\n");
    bench.write("b.csv", "t,q1\n0,1\n1,2\n2,3\n");
    bench.write("b.toml", &format!("angle = \"q1\"\n{long} = \"{long}\"\n"));
    std::fs::create_dir(bench.path("run")).unwrap();
    bench.write("run/run.toml", &format!("command = {long}\n"));
    let arm = "<robot name=\"r\"><link name=\"a\"/><link name=\"b\"/><joint name=\"";
    bench.write(
        "r.urdf",
        &format!("{arm}{long}\" type=\"{long}\"/></robot>"),
    );
    for line in [
        format!("check --{long}"),
        format!("check a.csv --rows {long}"),
        format!("check a.csv --q {long}"),
        format!("fit a.csv --model {long}"),
        format!("fit a.csv --width {long}"),
        format!("{long} a.csv"),
        format!("simulate {long}"),
        format!("simulate pendulum --set {long}=1"),
        "check b.csv".into(),
        "report run".into(),
        "simulate --urdf r.urdf --duration 1".into(),
    ] {
        let message = bench.refuse(&line);
        let begin = &line[..line.len().min(30)];
        assert!(!message.contains(&"x".repeat(61)), "`{begin}…`: {message}");
        assert!(message.len() < 3000, "`{begin}…`: {message}");
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_closed_standard_output_is_an_error_where_it_is_all_that_there_is() {
    let bench = Workbench::new();
    let shell = |line: &str| {
        let program = bench.command("").get_program().to_owned();
        let mut shell = std::process::Command::new("sh");
        let line = format!("exec \"$0\" simulate pendulum --duration 1 {line}");
        shell.arg("-c").arg(line).arg(program);
        Outcome::of(shell.current_dir(bench.path("")).output().unwrap())
    };
    let closed = shell(">&-");
    assert_eq!(closed.code, 2, "{}", closed.stderr);
    assert!(closed.stderr.contains("--out"), "{}", closed.stderr);
    assert_eq!(shell(">/dev/null").code, 0);
    assert_eq!(shell("--out a.csv >&-").code, 0);
}
