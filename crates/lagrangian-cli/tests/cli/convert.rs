//! Recordings in other formats: equal values, and no input is lost.

use crate::workbench::{Workbench, swing};

#[test]
fn a_file_goes_through_other_formats_and_comes_back_the_same() {
    let bench = Workbench::new();
    bench.succeed("simulate double-pendulum --drive 1 --duration 1 --trajectories 3 --out a.csv");
    let there = bench.succeed("convert a.csv --out b.npz");
    assert!(
        there.stderr.contains("3 trajectories, 303 rows: b.npz"),
        "{}",
        there.stderr
    );
    bench.succeed("convert b.npz --out c.csv");
    assert_eq!(bench.read("c.csv"), bench.read("a.csv"));
    assert_eq!(bench.read("c.toml"), bench.read("a.toml"));
}

#[test]
fn several_recordings_become_one_file_and_what_is_not_used_is_said() {
    let bench = Workbench::new();
    bench.write("a.csv", "t,q1,heat\n0,1,20\n1,nan,20\n2,1,20\n3,,20\n");
    bench.write("b.csv", "t,q1,heat\n0,3,20\n");
    let outcome = bench.succeed("convert a.csv b.csv --out ab.csv --json");
    let json = outcome.json();
    assert_eq!(
        String::from_utf8(bench.read("ab.csv")).unwrap(),
        "trajectory,t,q1\na,0,1\na,2,1\nb,0,3\n"
    );
    assert_eq!(
        (&json["rows"], &json["trajectories"]),
        (&3.into(), &2.into())
    );
    assert_eq!(json["files"][0]["unused"][0], "heat");
    assert_eq!(json["signals"], serde_json::json!(["q"]));
    assert!(outcome.stderr.contains("columns not used: heat"));
    let omitted = "2 rows without a value: omitted";
    assert!(outcome.stderr.contains(omitted), "{}", outcome.stderr);
}

#[test]
fn flags_name_columns_and_units_and_the_new_file_needs_none() {
    let bench = Workbench::new();
    bench.write("log.csv", "time,angle,torque\n0,0,1\n1,90,2\n2,180,3\n");
    let how = "--time time --q angle --tau torque --angle angle --degrees --every 2";
    let outcome = bench.succeed(&format!("convert log.csv {how} --out new.csv"));
    assert!(outcome.stderr.contains("q1 is angle"), "{}", outcome.stderr);
    assert_eq!(
        String::from_utf8(bench.read("new.csv")).unwrap(),
        format!("t,q1,tau1\n0,0,1\n2,{},3\n", std::f64::consts::PI)
    );
    assert_eq!(
        String::from_utf8(bench.read("new.toml"))
            .unwrap()
            .trim_end(),
        "angle = [\"q1\"]\n\n[columns]"
    );
    assert_eq!(
        bench.succeed("convert new.csv").stdout.as_bytes(),
        bench.read("new.csv")
    );
}

#[test]
fn no_input_is_written_over_however_its_path_is_written() {
    let bench = Workbench::new();
    std::fs::create_dir(bench.path("sub")).unwrap();
    bench.write("a.csv", &swing());
    bench.write("columns.toml", "angle = \"all\"\n");
    #[cfg(unix)]
    std::os::unix::fs::symlink(bench.path("a.csv"), bench.path("link.csv")).unwrap();
    #[cfg(unix)]
    assert!(
        bench
            .refuse("convert a.csv --out link.csv --force")
            .contains("'link.csv' would be written over")
    );
    for out in ["a.csv", "./a.csv", "sub/../a.csv", "sub/../a.npz", "a.npz"] {
        let message = bench.refuse(&format!("convert a.csv --out {out} --force"));
        assert!(
            message.contains("the input") || message.contains("--out"),
            "{message}"
        );
    }
    let message = bench.refuse("convert a.csv --layout columns.toml --out columns.csv --force");
    assert!(
        message.contains("'columns.toml' would be written over"),
        "{message}"
    );
    assert!(
        bench
            .refuse("convert a.csv --out a.npz")
            .contains("as well")
    );
    assert_eq!(bench.read("a.csv"), swing().as_bytes());
    assert_eq!(bench.read("columns.toml"), b"angle = \"all\"\n");
}

#[test]
fn a_file_that_exists_is_replaced_only_by_force_and_not_by_a_failure() {
    let bench = Workbench::new();
    bench.write("a.csv", &swing());
    bench.write("bad.csv", "t,q1\n0,1\n1,two\n");
    bench.write("old.csv", "precious");
    assert!(
        bench
            .refuse("convert a.csv --out old.csv")
            .contains("--force")
    );
    assert!(
        bench
            .refuse("convert bad.csv --out old.csv --force")
            .contains("line 3")
    );
    assert!(
        bench
            .refuse("convert a.csv bad.csv --out new.csv")
            .contains("line 3")
    );
    assert_eq!(bench.read("old.csv"), b"precious");
    assert_eq!(bench.names("."), ["a.csv", "bad.csv", "old.csv"]);
    bench.succeed("convert a.csv --out old.csv --force");
    assert_eq!(bench.read("old.csv"), swing().as_bytes());
}

#[test]
fn what_cannot_be_converted_is_refused() {
    let bench = Workbench::new();
    bench.write("a.csv", &swing());
    bench.write("b.csv", "t,q1,q2\n0,1,2\n1,1,2\n");
    bench.write("c.csv", "t,q1\n0,1\n1,1\n");
    assert!(bench.refuse("convert a.csv --out x.xlsx").contains(".npz"));
    assert!(
        bench
            .refuse("convert a.csv b.csv --out x.csv")
            .contains("different coordinates")
    );
    assert!(
        bench
            .refuse("convert a.csv c.csv --out x.csv")
            .contains("same signals")
    );
    assert!(
        bench
            .refuse("convert a.csv --topic /joints --out x.csv")
            .contains("--topic")
    );
    bench.write("old.bag", "#ROSBAG V2.0\n");
    assert!(
        bench
            .refuse("convert old.bag --out x.csv")
            .contains("rosbags-convert")
    );
    std::fs::create_dir(bench.path("folder")).unwrap();
    assert!(
        bench
            .refuse("convert folder --out x.csv")
            .contains("pip install 'lagrangian[ros]'")
    );
    assert_eq!(
        bench.names("."),
        ["a.csv", "b.csv", "c.csv", "folder", "old.bag"]
    );
}

#[test]
fn a_file_that_python_reads_names_the_line_to_run() {
    let bench = Workbench::new();
    for (command, extra) in [
        ("check a.db3", "ros"),
        ("check a.db3 --topic /joints", "ros"),
        ("check a.parquet", "parquet"),
        ("simulate pendulum --out b.parquet", "parquet"),
    ] {
        bench.write("a.db3", "");
        bench.write("a.parquet", "");
        let message = bench.refuse(command);
        let line = format!("pip install 'lagrangian[{extra}]'");
        assert!(message.contains(&line), "{command}: {message}");
    }
    let message = bench.refuse("convert a.csv --out x.mcap");
    assert!(message.contains(".csv, .npz or .parquet"), "{message}");
}
