//! Inputs are files of the expected kind, and no input is written over.

use std::process::Stdio;

use crate::workbench::{Outcome, Workbench, swing};

#[cfg(unix)]
#[test]
fn names_that_are_no_text_are_refused_and_do_not_panic() {
    use std::ffi::OsStr;
    use std::os::unix::ffi::OsStrExt;

    let bench = Workbench::new();
    for words in ["check", "fit a.csv --out", "simulate"] {
        let mut command = bench.command(words);
        command.arg(OsStr::from_bytes(b"b\xff.csv"));
        let outcome = Outcome::of(command.output().unwrap());
        assert_eq!(outcome.code, 2, "{words}: {}", outcome.stderr);
        assert!(outcome.stderr.contains("not UTF-8"), "{}", outcome.stderr);
    }
}

#[test]
fn an_input_is_never_written_over_however_its_path_is_written() {
    let bench = Workbench::new();
    bench.write("a.csv", &swing());
    // A fit of few steps is a poor one.
    bench.run("fit a.csv --angle all --steps 2 --width 8 --out run");
    std::fs::create_dir(bench.path("sub")).unwrap();
    let model = "run/model.safetensors";
    let before = (bench.read("a.csv"), bench.read(model));
    let mut lines = vec![
        "check a.csv --out ./a.csv".to_string(),
        "check a.csv --out sub/../a.csv".into(),
        format!("score {model} a.csv --out a.csv"),
        format!("score {model} a.csv --out run/../{model}"),
        format!("torque {model} a.csv --out ./a.csv"),
        format!("rollout {model} --follow a.csv --out ./a.csv"),
        "convert a.csv --out ./a.csv".into(),
        format!("conserved {model} a.csv --out ./a.csv"),
        format!("report run --out {model}"),
        "report run --out a.csv".into(),
        "fit a.csv --urdf run/model.safetensors --out run".into(),
    ];
    #[cfg(unix)]
    {
        std::fs::hard_link(bench.path("a.csv"), bench.path("hard.json")).unwrap();
        std::os::unix::fs::symlink(bench.path("a.csv"), bench.path("soft.json")).unwrap();
        lines.push("check a.csv --out hard.json".into());
        lines.push("check a.csv --out soft.json".into());
    }
    for line in lines {
        let message = bench.refuse(&format!("{line} --force"));
        assert!(message.contains("written over"), "{line}: {message}");
    }
    assert!(before == (bench.read("a.csv"), bench.read(model)));
}

#[test]
fn a_layout_is_never_written_over_by_that_of_the_motions() {
    let bench = Workbench::new();
    bench.write("a.csv", &swing());
    bench.write("own.toml", "angle = \"all\"\n");
    let message = bench.refuse("convert a.csv --layout own.toml --out own.csv --force");
    assert!(message.contains("own.toml"), "{message}");
}

#[test]
fn names_that_name_nothing_are_refused() {
    let bench = Workbench::new();
    bench.write("a.csv", &swing());
    for flag in [
        "--q=",
        "--q=q1,",
        "--angle=",
        "--time=",
        "--tau=,",
        "--parameters= ",
    ] {
        let mut command = bench.command("check a.csv");
        let outcome = command.arg(flag).output().unwrap();
        assert_eq!(outcome.status.code(), Some(2), "{flag}");
        let message = String::from_utf8(outcome.stderr).unwrap();
        assert!(message.contains("names nothing"), "{flag}: {message}");
    }
    for (layout, part) in [
        ("every = 0", "every = 0"),
        ("[columns]\nq = [\"\"]", "empty"),
        ("angle = \"\"", "empty"),
        ("[columns]\nt = \"\"", "empty"),
        ("angle = 3", "a name, or a list of names"),
        (
            "[drive]\nkp = { a = 1 }",
            "a list of names, a number or true",
        ),
    ] {
        bench.write("l.toml", layout);
        let message = bench.refuse("check a.csv --layout l.toml");
        assert!(message.contains(part), "{layout}: {message}");
    }
}

#[cfg(unix)]
#[test]
fn pipes_folders_and_devices_are_no_recordings_and_no_layouts() {
    let bench = Workbench::new();
    bench.write("a.csv", &swing());
    std::fs::create_dir(bench.path("folder.toml")).unwrap();
    let pipe = bench.path("pipe.csv");
    let made = std::process::Command::new("mkfifo").arg(&pipe).status();
    assert!(made.unwrap().success());
    std::os::unix::fs::symlink("loop.csv", bench.path("loop.csv")).unwrap();
    for (line, part) in [
        ("check pipe.csv", "a pipe"),
        ("fit pipe.csv --out run", "a pipe"),
        ("check a.csv --layout folder.toml", "a folder"),
        ("check a.csv --layout /dev/zero", "a device"),
        ("check loop.csv", "symbolic"),
        ("score pipe.csv a.csv", "a pipe"),
    ] {
        let message = bench.refuse(line);
        assert!(message.contains(part), "{line}: {message}");
    }
}

#[test]
fn files_of_another_kind_say_what_they_are_and_what_to_do() {
    let bench = Workbench::new();
    let files: [(&str, &[u8], &str); 8] = [
        ("zipped.csv", b"\x1f\x8b\x08rest", "gunzip"),
        ("zero.csv", b"t,q1\n0,\0\n", "not text"),
        ("bom.csv", b"\xff\xfet\0\n\0", "no column 'q1'"),
        (
            "quote.csv",
            b"t,q1\n0,\"1\n1,2\n",
            "line 2, column 'q1': a quote is opened",
        ),
        (
            "comma.csv",
            b"t,q1\n0,1,\n1,2,\n",
            "end the header with a separator",
        ),
        ("noext", b"t,q1\n0,1\n", "motion.csv"),
        ("a.csv.gz", b"\x1f\x8b", "gunzip"),
        ("parquet.csv", b"PAR1\x15", ".parquet"),
    ];
    for (name, bytes, part) in files {
        std::fs::write(bench.path(name), bytes).unwrap();
        let message = bench.refuse(&format!("check {name}"));
        assert!(message.contains(part), "{name}: {message}");
    }
    assert!(bench.refuse("check -").contains("standard input"));
}

#[test]
fn a_message_repeats_no_more_of_a_file_than_a_person_reads() {
    let bench = Workbench::new();
    let long = "x".repeat(5000);
    bench.write("cell.csv", &format!("t,q1\n0,{long}\n"));
    bench.write("header.csv", &format!("time,{long}\n0,1\n"));
    for file in ["cell.csv", "header.csv"] {
        let message = bench.refuse(&format!("check {file}"));
        assert!(message.contains("xxx…") && message.len() < 600, "{message}");
    }
}

#[test]
fn line_ends_of_every_system_are_read_alike() {
    let bench = Workbench::new();
    bench.write("unix.csv", &swing());
    bench.write("windows.csv", &swing().replace('\n', "\r\n"));
    bench.write("mac.csv", &swing().replace('\n', "\r"));
    let of = |file: &str| bench.succeed(&format!("convert {file}")).stdout;
    assert!(of("windows.csv") == of("unix.csv") && of("mac.csv") == of("unix.csv"));
}

#[test]
fn a_file_in_the_place_of_a_folder_and_a_folder_in_that_of_a_file_are_named() {
    let bench = Workbench::new();
    bench.write("a.csv", &swing());
    let message = bench.refuse("fit a.csv --out a.csv --force");
    assert!(message.contains("it is a file"), "{message}");
    std::fs::create_dir(bench.path("folder.json")).unwrap();
    let message = bench.refuse("check a.csv --out folder.json --force");
    assert!(message.contains("it is a folder"), "{message}");
}

#[cfg(unix)]
#[test]
fn a_reader_that_goes_away_ends_the_command_quietly() {
    let bench = Workbench::new();
    let mut command = bench.command("simulate pendulum --duration 1000");
    let mut child = command
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let outcome = child.wait_with_output().unwrap();
    assert_eq!(outcome.status.code(), Some(141));
    assert!(!String::from_utf8(outcome.stderr).unwrap().contains("error"));
}

#[cfg(unix)]
#[test]
fn notes_that_nobody_reads_are_no_panic() {
    let bench = Workbench::new();
    bench.write("a.csv", &swing().replace("t,q1,qd1", "t,q1,other"));
    let mut command = bench.command("check a.csv");
    let mut child = command
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stderr.take());
    assert!(matches!(child.wait().unwrap().code(), Some(0 | 1)));
}

#[test]
fn the_number_of_threads_that_is_asked_for_is_bounded() {
    let bench = Workbench::new();
    bench.write("a.csv", &swing());
    let mut command = bench.command("check a.csv");
    let outcome = command
        .env("RAYON_NUM_THREADS", "1000000")
        .output()
        .unwrap();
    assert_eq!(outcome.status.code(), Some(0));
    let notes = String::from_utf8(outcome.stderr).unwrap();
    assert!(notes.contains("256 threads"), "{notes}");
}

/// A file as another program writes it.
fn export(bench: &Workbench, name: &str) {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../lagrangian-recordings/tests/exports");
    std::fs::copy(folder.join(name), bench.path(name)).unwrap();
}

#[test]
fn files_of_other_programs_are_read_with_the_flags_that_a_refusal_names() {
    let bench = Workbench::new();
    for (file, parts) in [
        (
            "libfranka.csv",
            vec!["libfranka", "--time 'duration'", "--tau 'tau_J[0],"],
        ),
        (
            "phyphox.csv",
            vec!["--q 'Tilt up/down (deg)'", "the file begins with"],
        ),
        (
            "matlab_ascii.txt",
            vec!["c1 … c8", "--time takes the seconds"],
        ),
    ] {
        export(&bench, file);
        let message = bench.refuse(&format!("check {file}"));
        for part in parts {
            assert!(message.contains(part), "{file}: {message}");
        }
    }
    let read = |line: &str| bench.succeed(&format!("convert {line}"));
    let outcome = read("libfranka.csv --time duration --q q[0],q[1] --qd dq[0],dq[1]");
    assert!(
        outcome.stderr.contains("'duration' is in ms"),
        "{}",
        outcome.stderr
    );
    assert!(outcome.stdout.contains("\n0.011,"), "{}", outcome.stdout);
    let counted = read("matlab_ascii.txt --time 0.5 --q c1,c2").stdout;
    assert!(counted.contains("\n5.5,"), "{counted}");
    export(&bench, "tracker_two_masses.txt");
    let mut command = bench.command("convert tracker_two_masses.txt --polar");
    let outcome = Outcome::of(
        command
            .arg("theta=mass B: x,mass B: y@mass A: x,mass A: y")
            .output()
            .unwrap(),
    );
    assert!(
        outcome.stdout.starts_with("t,q1\n0,-1.57"),
        "{}",
        outcome.stdout
    );
    assert!(
        bench
            .refuse("check phyphox.csv --polar theta")
            .contains("theta=x,y@x0,y0")
    );
}
