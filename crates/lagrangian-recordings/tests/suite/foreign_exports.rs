//! Files of other programs (`exports/ORIGIN.md`), converted to recordings in SI units.
#![allow(
    clippy::unwrap_used,
    clippy::cast_precision_loss,
    reason = "a test fails by panicking, and counts few rows"
)]

use std::f64::consts::PI;
use std::io::Cursor;
use std::path::Path;

use lagrangian_motion::{Error, Result, Signals, Topology};
use lagrangian_recordings::Polar;
use lagrangian_recordings::{Format, Layout, Readings};

/// The angle that the files hold.
fn theta(t: f64) -> f64 {
    0.5 * (3.0 * t).cos()
}

fn names(list: &str) -> Vec<String> {
    let all = list.split(',').filter(|name| !name.is_empty());
    all.map(String::from).collect()
}

/// A layout of columns: t, q, q̇ and τ.
fn layout(t: &str, q: &str, qd: &str, tau: &str) -> Layout {
    Layout {
        t: Some(t.to_owned()).filter(|t| !t.is_empty()),
        columns: Signals {
            q: names(q),
            qd: names(qd),
            tau: names(tau),
            ..Signals::default()
        },
        ..Layout::default()
    }
}

fn bytes(file: &str) -> Vec<u8> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/exports");
    std::fs::read(folder.join(file)).unwrap()
}

fn read(file: &str, layout: &Layout) -> Result<Readings> {
    let extension = Path::new(file).extension().unwrap().to_str().unwrap();
    let format = Format::from_extension(extension).unwrap();
    format.read(Cursor::new(bytes(file)), "file", layout)
}

fn of_text(text: &str, layout: &Layout) -> Result<Readings> {
    Format::Csv.read(Cursor::new(text.to_owned()), "file", layout)
}

/// Asserts that the first recording holds the angle in its first coordinate, at times from 0 with this interval.
fn assert_swings(readings: &Readings, interval: f64, rows: usize) {
    let recording = &readings.recordings[0];
    assert_eq!(recording.len(), rows);
    let first = recording.t[0];
    for (k, t) in recording.t.iter().enumerate() {
        approx::assert_abs_diff_eq!(t - first, k as f64 * interval, epsilon = 1e-5);
        let q = recording.q[k * recording.dof()];
        approx::assert_abs_diff_eq!(q, theta(k as f64 * interval), epsilon = 2e-4);
    }
}

fn has_note(readings: &Readings, part: &str) -> bool {
    readings.notes.iter().any(|note| note.contains(part))
}

#[test]
fn phones_and_spreadsheets_are_read_in_their_encodings_separators_and_units() {
    for (file, t, q) in [
        ("phyphox.csv", "", "Tilt up/down (deg)"),
        ("phyphox_decimal_comma.csv", "", "Tilt up/down (deg)"),
        ("spreadsheet_utf16.txt", "Zeit (s)", "Winkel (°)"),
        ("spreadsheet_latin1.csv", "", "Winkel (°)"),
    ] {
        let mut layout = layout(t, q, "", "");
        let readings = read(file, &layout).unwrap();
        assert_swings(&readings, 0.01, 12);
        assert!(has_note(&readings, "converted to rad"), "{file}");
        assert_eq!(has_note(&readings, "decimal commas"), file != "phyphox.csv");
        let q = &readings.recordings[0].coordinates.0[0];
        assert_eq!((q.unit.as_str(), q.topology), ("rad", Topology::Line));
        // Declaring degrees as well does not convert twice.
        (layout.degrees, layout.angles) = (true, vec!["all".into()]);
        assert_swings(&read(file, &layout).unwrap(), 0.01, 12);
    }
}

#[test]
fn standard_names_may_be_followed_by_their_units() {
    let rows: String = (0..40)
        .map(|k| format!("{},{k},0.5,{}\n", 10 * k, k * k))
        .collect();
    let read = |header: &str, layout: &Layout| of_text(&(header.to_owned() + "\n" + &rows), layout);
    let units = "t [ms],q1 [deg],q2 (mm),tau2 [mN]";
    let swings = read(units, &Layout::default())
        .unwrap()
        .recordings
        .remove(0);
    let names = swings
        .coordinates
        .0
        .iter()
        .map(|c| (c.name.as_str(), c.unit.as_str()));
    assert_eq!(names.collect::<Vec<_>>(), [("q1", "rad"), ("q2", "m")]);
    approx::assert_abs_diff_eq!(swings.t[1], 0.01);
    approx::assert_abs_diff_eq!(swings.q[2], PI / 180.0);
    approx::assert_abs_diff_eq!(swings.q[3], 5e-4);
    approx::assert_abs_diff_eq!(swings.tau[5], 4e-3);
    // A force of an unknown unit is not left out: its motion is not free.
    let volts = "t [ms],q1 [deg],q2 (mm),tau1 (V)";
    let refused = read(volts, &Layout::default()).unwrap_err().to_string();
    assert!(refused.contains("'tau1 (V)' is not known"), "{refused}");
    let named = Layout {
        columns: Signals {
            q: vec!["q1".into()],
            tau: vec!["tau1 (V)".into()],
            ..Signals::default()
        },
        ..Layout::default()
    };
    let driven = read(volts, &named).unwrap().recordings.remove(0);
    approx::assert_abs_diff_eq!(driven.tau[5], 25.0);
    // A flag names them with or without the unit.
    for name in ["q1", "q1 [deg]"] {
        let layout = Layout {
            angles: vec![name.into()],
            ..Layout::default()
        };
        assert!(
            read(units, &layout).unwrap().recordings[0]
                .coordinates
                .is_circle(0)
        );
    }
    // Two columns of one name are not chosen from; that without a unit is meant.
    assert!(read("t,q1 [deg],q1 [rad],x", &Layout::default()).is_err());
    let both = read("t,q1,q1 [rad],x", &Layout::default()).unwrap();
    approx::assert_abs_diff_eq!(both.recordings[0].q[1], 1.0);
}

#[test]
fn a_rate_is_refused_as_a_coordinate_with_the_flag_that_takes_it() {
    let layout = layout("", "Gyroscope x (rad/s)", "", "");
    let message = read("phyphox.csv", &layout).unwrap_err().to_string();
    assert!(message.contains("not a unit of coordinates") && message.contains("`qd`"));
    let layout = self::layout("Tilt up/down (deg)", "Time (s)", "", "");
    let message = read("phyphox.csv", &layout).unwrap_err().to_string();
    assert!(message.contains("not a unit of time"), "{message}");
}

#[test]
fn an_angle_of_two_points_is_read_from_the_marks_of_a_video() {
    let polar: Polar = "theta=x,y".parse().unwrap();
    let layout = Layout {
        polar: vec![polar],
        ..Layout::default()
    };
    let readings = read("tracker_one_mass.csv", &layout).unwrap();
    assert!(has_note(&readings, "mass A") && has_note(&readings, "2 rows"));
    let recording = &readings.recordings[0];
    assert_eq!(
        recording.len(),
        10,
        "rows without a mark at both ends are omitted"
    );
    for (t, q) in recording.t.iter().zip(&recording.q) {
        approx::assert_abs_diff_eq!(*q, theta(*t) - PI / 2.0, epsilon = 1e-5);
    }
    assert!(recording.coordinates.is_circle(0));
    assert!(read("tracker_dialog.txt", &layout).is_ok());
    // The mass may be named above the column of time, and frames without a mark are omitted.
    let marks = "mass A,,\nt,x,y\n0.000,1.0,0.0\n0.033,0.9,0.3\n0.067,,\n0.100,0.5,0.8\n";
    let readings = of_text(marks, &layout).unwrap();
    assert!(has_note(&readings, "mass A") && has_note(&readings, "1 row without a value"));
    assert_eq!(readings.recordings[0].t, [0.0, 0.033, 0.1]);
}

#[test]
fn several_point_masses_are_columns_of_their_names() {
    let angles = [
        "theta1=mass A: x,mass A: y@0,0",
        "theta2=mass B: x,mass B: y@mass A: x,mass A: y",
    ];
    let layout = Layout {
        polar: angles.map(|text| text.parse().unwrap()).to_vec(),
        ..Layout::default()
    };
    let again = Layout::from_toml(&layout.to_toml().unwrap()).unwrap();
    assert_eq!(again, layout);
    let recording = read("tracker_two_masses.txt", &again)
        .unwrap()
        .recordings
        .remove(0);
    assert_eq!(recording.len(), 12);
    for (t, q) in recording.t.iter().zip(recording.q.chunks_exact(2)) {
        approx::assert_abs_diff_eq!(q[0], theta(*t) - PI / 2.0, epsilon = 1e-5);
        approx::assert_abs_diff_eq!(q[1], 0.3 * (4.0 * t).sin() - PI / 2.0, epsilon = 1e-5);
    }
}

#[test]
fn points_in_different_units_make_no_angle() {
    let layout = Layout {
        polar: vec!["theta=x (cm),y (m)".parse().unwrap()],
        ..Layout::default()
    };
    let message = of_text("t,x (cm),y (m)\n0,1,2\n1,2,3\n", &layout)
        .unwrap_err()
        .to_string();
    assert!(message.contains("same unit of length"), "{message}");
    for wrong in ["theta", "theta=x", "=x,y", "theta=x,y@1", "theta=x,y,z@1,2"] {
        assert!(wrong.parse::<Polar>().is_err(), "{wrong}");
    }
}

#[test]
fn runs_side_by_side_are_read_one_at_a_time() {
    let first = layout("Run 1: Time (s)", "Run 1: Angle (rad)", "", "");
    let readings = read("logger_pro.csv", &first).unwrap();
    assert_swings(&readings, 0.05, 8);
    assert!(has_note(&readings, "4 rows"));
    // The choice between two columns of time is not guessed.
    let unnamed = layout("", "Run 1: Angle (rad)", "", "");
    assert!(matches!(
        read("logger_pro.csv", &unnamed),
        Err(Error::Columns { .. })
    ));
}

#[test]
fn units_in_lines_of_their_own_belong_to_the_names() {
    let layout = layout("Time (ms)", "Position (cm)", "Velocity (m/s)", "");
    let readings = read("logger_pro.txt", &layout).unwrap();
    assert_swings(&readings, 0.05, 12);
    assert_eq!(readings.recordings[0].coordinates.0[0].name, "Position");
    assert_eq!(readings.recordings[0].coordinates.0[0].unit, "m");
}

#[test]
fn measurement_files_of_labview_are_read_with_their_headers_units_and_comments() {
    let readings = read(
        "labview.lvm",
        &layout("", "Angle (deg)", "", "Torque (mNm)"),
    )
    .unwrap();
    assert_swings(&readings, 0.001, 12);
    approx::assert_abs_diff_eq!(readings.recordings[0].tau[0], 0.025, epsilon = 1e-9);
    let layout = layout("X_Value (s)", "Angle (rad)", "", "Torque (N*m)");
    let readings = read("labview_several_times.lvm", &layout).unwrap();
    assert_swings(&readings, 0.001, 12);
    assert!(
        readings
            .columns
            .ignored
            .contains(&"X_Value 2 (s)".to_owned())
    );
}

#[test]
fn the_columns_of_robots_are_recognised_and_their_flags_told() {
    for (file, program, flags) in [
        (
            "libfranka.csv",
            "libfranka",
            "`t` 'duration' `q` 'q[0],q[1],",
        ),
        (
            "libfranka_newer.csv",
            "libfranka",
            "`t` 'time' `q` 'state.q[0],",
        ),
        (
            "ur_rtde.csv",
            "Universal Robots",
            "`t` 'timestamp' `q` 'actual_q_0,",
        ),
        (
            "plotjuggler.csv",
            "PlotJuggler",
            "`q` '/joint_states/elbow/position,",
        ),
        (
            "mujoco.npz",
            "MuJoCo",
            "`q` 'qpos1,qpos2' `qd` 'qvel1,qvel2'",
        ),
    ] {
        let message = read(file, &Layout::default()).unwrap_err().to_string();
        assert!(
            message.contains(program) && message.contains(flags),
            "{message}"
        );
    }
}

#[test]
fn the_logs_of_robots_are_read_with_these_flags() {
    let joints = |pattern: &str, n: usize| -> String {
        let names = (0..n).map(|i| pattern.replace('*', &i.to_string()));
        names.collect::<Vec<_>>().join(",")
    };
    let franka = layout(
        "duration",
        &joints("q[*]", 7),
        &joints("dq[*]", 7),
        &joints("tau_J[*]", 7),
    );
    let readings = read("libfranka.csv", &franka).unwrap();
    assert_swings(&readings, 0.001, 12);
    assert!(has_note(&readings, "'duration' is in ms"));
    let newer = layout(
        "time",
        &joints("state.q[*]", 7),
        "",
        &joints("state.tau_J[*]", 7),
    );
    assert_swings(&read("libfranka_newer.csv", &newer).unwrap(), 0.001, 12);
    let ur = layout(
        "timestamp",
        &joints("actual_q_*", 6),
        &joints("actual_qd_*", 6),
        "",
    );
    assert_swings(&read("ur_rtde.csv", &ur).unwrap(), 0.002, 12);
    let plot = layout(
        "",
        "/joint_states/elbow/position",
        "/joint_states/elbow/velocity",
        "",
    );
    assert_swings(&read("plotjuggler.csv", &plot).unwrap(), 0.01, 12);
    let episodes = Layout {
        trajectory: Some("episode".into()),
        ..layout("time", "qpos", "qvel", "qfrc_actuator")
    };
    let readings = read("mujoco.npz", &episodes).unwrap();
    assert_eq!(readings.recordings.len(), 2);
    assert_swings(&readings, 0.002, 6);
}

#[test]
fn numbers_without_names_get_names_that_are_told() {
    let mut layout = layout("0.01", "c1,c2", "c3,c4", "c7,c8");
    layout.columns.qdd = names("c5,c6");
    let readings = read("matlab_ascii.txt", &layout).unwrap();
    assert!(has_note(&readings, "c1 … c8") && has_note(&readings, "0.01 s apart"));
    assert_swings(&readings, 0.01, 12);
    let recording = readings.recordings.into_iter().next().unwrap();
    assert_eq!(recording.signals.row(2, 0).qdd, [-4.5, -2.25]);
    // A name where a number could be is the name of a column.
    layout.t = Some("time".into());
    let message = read("matlab_ascii.txt", &layout).unwrap_err().to_string();
    assert!(message.contains("seconds between rows"), "{message}");
}

#[test]
fn comments_keys_and_indices_before_a_table_are_passed_over() {
    let layout = layout("time", "a,b", "", "");
    for text in [
        "# made by a script\n# time a b\n0 1 2\n1 2 3\n",
        "# time,a,b\n0,1,2\n1,2,3\n",
        "% first\n% second\ntime\ta\tb\n0\t1\t2\n1\t2\t3\n",
        "Operator: me\n\nrate;100\ntime;a;b\n0;1;2\n1;2;3\n",
        "sep=;\ntime;a;b\n0;1,0;2\n1;2;3\n",
        "time   a   b\n  0  1.0   2\n  1  2   3  \n",
        "time;a;b\ns;;\n0;1;2\n1;2;3\n",
    ] {
        let readings = of_text(text, &layout);
        if text.contains("s;;") {
            // A line with little text may be a row.
            assert!(readings.is_err());
            continue;
        }
        let recording = readings.unwrap().recordings.remove(0);
        assert_eq!(
            (recording.t, recording.signals.q),
            (vec![0.0, 1.0], vec![1.0, 2.0, 2.0, 3.0]),
            "{text}"
        );
    }
}

#[test]
fn numbers_with_points_and_commas_in_one_file_are_refused() {
    let layout = layout("t", "q1", "", "");
    for text in ["t;q1\n0;0.5\n1;0,5\n", "t;q1\n0;0,5\n1;0.5\n"] {
        let message = of_text(text, &layout).unwrap_err().to_string();
        assert!(
            message.contains("line 3") && message.contains("'q1'"),
            "{message}"
        );
    }
}

#[test]
fn a_message_shows_the_first_lines_and_what_was_recognised() {
    let message = read("phyphox_decimal_comma.csv", &Layout::default())
        .unwrap_err()
        .to_string();
    for part in [
        "no column 'q1'",
        "`t` 'Time (s)' `q` 'Tilt up/down (deg)'",
        "the file begins with\n  \"Time (s)\";\"Tilt up/down (deg)\"",
    ] {
        assert!(message.contains(part), "{message}");
    }
    let message = Format::from_extension("mat").unwrap_err().to_string();
    assert!(message.contains("scipy.io.loadmat"), "{message}");
}
