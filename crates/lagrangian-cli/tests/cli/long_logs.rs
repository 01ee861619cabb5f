//! Logs with more rows than a fit needs.

use crate::workbench::Workbench;

/// A pendulum under a torque of two sines, at 100 Hz, by the symplectic Euler method.
fn log(rows: usize) -> String {
    let (mut q, mut v, step) = (0.5_f64, 0.0_f64, 0.01);
    let mut text = String::from("t,q1,qd1,qdd1,tau1\n");
    for k in 0..rows {
        let t = step * k as f64;
        let tau = 2.0 * (1.1 * t).sin() + 1.5 * (2.7 * t).sin();
        let a = tau - 9.81 * q.sin() - 0.1 * v;
        text += &format!("{t:.2},{q:.8},{v:.8},{a:.8},{:.8}\n", tau - 0.1 * v);
        v += step * a;
        q += step * v;
    }
    text
}

#[test]
fn a_long_log_is_fitted_with_the_rows_that_were_asked_for() {
    let bench = Workbench::new();
    bench.write("log.csv", &log(20_000));
    let outcome =
        bench.succeed("fit log.csv --angle all --rows 3000 --steps 40 --width 8 --out run --json");
    assert!(
        outcome.stderr.contains("of 20000 rows are used"),
        "{}",
        outcome.stderr
    );
    let found = outcome.json();
    let (train, held) = (&found["samples"]["train"], &found["samples"]["validation"]);
    let (train, held) = (train.as_u64().unwrap(), held.as_u64().unwrap());
    assert!(
        train + held <= 3000 && train + held > 2800,
        "{train} + {held}"
    );
    assert!((400..=800).contains(&held), "{held}");
    let again = bench
        .succeed("fit log.csv --angle all --rows 3000 --steps 40 --width 8 --out again --json");
    assert_eq!(found["loss"], again.json()["loss"]);
    bench.succeed("report run --out page.html");
}

#[test]
fn a_log_without_velocities_is_fitted_in_pieces() {
    let bench = Workbench::new();
    bench.write("log.csv", &log(20_000));
    let text = String::from_utf8(bench.read("log.csv")).unwrap();
    let short: String = text
        .lines()
        .map(|line| {
            let cells: Vec<&str> = line.split(',').collect();
            format!("{},{},{}\n", cells[0], cells[1], cells[4])
        })
        .collect();
    bench.write("angles.csv", &short);
    for more in [
        "",
        "--loss positions",
        "--loss rollout --horizon 5 --width 4",
        "--delay 20",
    ] {
        let line = format!("fit angles.csv --angle all --rows 8000 --steps 5 {more} --force");
        let outcome = bench.run(&line);
        assert!(outcome.code < 2, "{line}: {}", outcome.stderr);
        assert!(outcome.stderr.contains("rows are used"), "{line}");
    }
}

#[test]
fn what_is_wrong_with_a_long_log_is_found_outside_the_sample_too() {
    let bench = Workbench::new();
    let good = log(20_000);
    let with = |row: usize, line: &str| -> String {
        let mut lines: Vec<&str> = good.lines().collect();
        lines[row] = line;
        lines.join("\n")
    };
    bench.write("nan.csv", &with(12_345, "123.44,nan,0,0,0"));
    // The note on the sample comes before the error.
    let refused = |line: &str| -> String {
        let outcome = bench.run(line);
        assert_eq!(outcome.code, 2, "{line}: {}", outcome.stderr);
        assert!(outcome.stderr.contains("\nerror: ") && outcome.stderr.contains("\nhint: "));
        outcome.stderr
    };
    let message = refused("fit nan.csv --angle all --rows 2000 --out run");
    assert!(
        message.contains("row 12345") && message.contains("'q1'"),
        "{message}"
    );
    let report = bench.run("check nan.csv --angle all --rows 2000");
    assert!(
        report.code == 1 && report.stdout.contains("row 12345"),
        "{}",
        report.stdout
    );
    bench.write("text.csv", &with(15_000, "149.99,oops,0,0,0"));
    let message = bench.refuse("fit text.csv --angle all --rows 2000 --out run");
    assert!(
        message.contains("line 15001") && message.contains("'oops'"),
        "{message}"
    );
    bench.write("back.csv", &with(9_000, "1.0,0,0,0,0"));
    let message = refused("fit back.csv --angle all --rows 2000 --out run");
    assert!(
        message.contains("row 9000") && message.contains("goes back"),
        "{message}"
    );
}

#[test]
fn a_number_of_rows_that_is_none_is_refused() {
    let bench = Workbench::new();
    bench.write("log.csv", &log(50));
    for rows in ["0", "999", "-5", "many", "1e6"] {
        let message = bench.refuse(&format!("fit log.csv --rows={rows}"));
        assert!(message.contains("1000 or above, or `all`"), "{message}");
    }
    bench.succeed("check log.csv --angle all --rows all");
}

#[test]
fn many_short_trajectories_are_checked_in_part_and_the_bad_ones_among_all() {
    let bench = Workbench::new();
    let rows = |k: u32, bad: bool| {
        let time = |i: u32| if bad { 0.1 } else { 0.1 * f64::from(i) };
        let row = |i: u32| format!("{k},{},{}\n", time(i), f64::from(k + i).sin());
        (0..4).map(row).collect::<String>()
    };
    let all: String = (0..20_010).map(|k| rows(k, k == 4321)).collect();
    bench.write("many.csv", &format!("trajectory,t,q1\n{all}"));
    let outcome = bench.run("check many.csv");
    assert!(
        outcome
            .stderr
            .contains("of 20010 trajectories (20000 at most)"),
        "{}",
        outcome.stderr
    );
    assert!(outcome.stdout.contains("'4321'"), "{}", outcome.stdout);
}
