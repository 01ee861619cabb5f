//! Written files read back to the same bits; columns, angles and trajectories are found as declared.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::f64::consts::{PI, TAU};
use std::io::Cursor;

use lagrangian_motion::{Coordinates, Signals, Topology, Trajectory};
use lagrangian_recordings::{EstimateOptions, Format, Layout, Readings, Recording};
use proptest::prelude::*;

fn csv(text: &str, layout: &Layout) -> Readings {
    Format::Csv
        .read(Cursor::new(text.to_owned()), "file", layout)
        .unwrap()
}

fn round_trip(format: Format, trajectories: &[Trajectory]) -> Vec<Trajectory> {
    let mut bytes = Cursor::new(Vec::new());
    format.write(&mut bytes, trajectories).unwrap();
    bytes.set_position(0);
    let readings = format.read(bytes, "file", &Layout::default()).unwrap();
    let plain = EstimateOptions {
        accelerations: false,
        ..EstimateOptions::default()
    };
    readings
        .recordings
        .into_iter()
        .map(|r| r.into_trajectory(&plain).unwrap().0)
        .collect()
}

fn trajectory(name: &str, len: usize, n: usize, seed: f64) -> Trajectory {
    let signal = |k: f64| -> Vec<f64> {
        (0..len * n)
            .map(|i| (k * seed * (i as f64 + 0.1)).sin() * 10f64.powf(k))
            .collect()
    };
    let t = (0..len).map(|k| 0.1 * k as f64 + seed).collect();
    Trajectory::new(
        name,
        t,
        Signals {
            q: signal(1.0),
            qd: signal(-7.0),
            qdd: signal(17.0),
            tau: signal(-300.0),
            p: signal(40.0),
            ..Signals::default()
        },
    )
}

#[test]
fn trajectories_of_unequal_length_come_back_with_their_names_in_every_format() {
    let written = [
        trajectory("b, \"slow\"", 5, 2, 0.3),
        trajectory("ä", 1000, 2, 0.7),
        trajectory("3", 17, 2, 1.1),
    ];
    for format in Format::ALL.map(|(format, _)| format) {
        assert_eq!(round_trip(format, &written), written, "{format:?}");
    }
}

#[test]
fn a_single_trajectory_takes_the_name_of_its_file() {
    for format in Format::ALL.map(|(format, _)| format) {
        assert_eq!(
            round_trip(format, &[trajectory("file", 5, 3, 0.3)]),
            [trajectory("file", 5, 3, 0.3)]
        );
    }
}

#[test]
fn trajectories_of_one_name_stay_apart() {
    let twice = [trajectory("a", 5, 1, 0.3), trajectory("a", 5, 1, 0.3)];
    let names: Vec<String> = round_trip(Format::Csv, &twice)
        .into_iter()
        .map(|t| t.name)
        .collect();
    assert_eq!(names, ["a", "a#2"]);
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_finite_number_reads_back_to_the_same_bits(values in prop::collection::vec(any::<f64>(), 2..20)) {
        let q: Vec<f64> = values.into_iter().filter(|x| x.is_finite()).chain([0.0, -0.0]).collect();
        let t = (0..q.len()).map(|k| k as f64).collect();
        let written = Trajectory::new("file", t, Signals { qd: q.clone(), q, ..Signals::default() });
        for format in Format::ALL.map(|(format, _)| format) {
            let read = round_trip(format, std::slice::from_ref(&written)).remove(0);
            let bits = |x: &[f64]| x.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
            prop_assert_eq!(bits(&read.q), bits(&written.q));
            prop_assert_eq!(bits(&read.qd), bits(&written.qd));
        }
    }
}

#[test]
fn a_name_with_a_zero_byte_is_written_without_it() {
    let motions = [trajectory("a\0", 5, 1, 1.0), trajectory("b", 5, 1, 2.0)];
    let mut file = Cursor::new(Vec::new());
    Format::Csv.write(&mut file, &motions).unwrap();
    let file = Cursor::new(file.into_inner());
    let again = Format::Csv.read(file, "x", &Layout::default()).unwrap();
    let names: Vec<&str> = again.recordings.iter().map(|r| &*r.name).collect();
    assert_eq!(names, ["a\u{fffd}", "b"]);
}

#[test]
fn columns_named_by_the_user_are_taken_in_that_order() {
    let layout = Layout {
        t: Some("time".into()),
        columns: Signals {
            q: vec!["b".into(), "a".into()],
            tau: vec!["m2".into(), "m1".into()],
            ..Signals::default()
        },
        angles: vec!["a".into()],
        ..Layout::default()
    };
    let readings = csv("a,b,m1,m2,time\n1,2,3,4,0\n2,6,7,8,1\n", &layout);
    let r = &readings.recordings[0];
    assert_eq!(
        (r.q.as_slice(), r.tau.as_slice()),
        (&[2.0, 1.0, 6.0, 2.0][..], &[4.0, 3.0, 8.0, 7.0][..])
    );
    assert_eq!(r.coordinates.0[0].topology, Topology::Line);
    assert_eq!(
        (
            r.coordinates.0[1].name.as_str(),
            r.coordinates.0[1].topology
        ),
        ("a", Topology::Circle)
    );
}

#[test]
fn rows_of_trajectories_may_alternate_and_their_names_may_be_numbers() {
    let readings = csv(
        "run,t,q1\n7,0,1\n8,0,2\n7,1,3\n8,1,4\n",
        &Layout {
            trajectory: Some("run".into()),
            ..Layout::default()
        },
    );
    let found: Vec<_> = readings
        .recordings
        .iter()
        .map(|r| (r.name.as_str(), r.q.as_slice()))
        .collect();
    assert_eq!(found, [("7", &[1.0, 3.0][..]), ("8", &[2.0, 4.0][..])]);
}

#[test]
fn logs_that_were_written_one_after_the_other_are_motions_of_their_own() {
    let log = |rows: u32| -> String {
        let row = |k: u32| format!("{},{}\n", 0.1 * f64::from(k), k * k);
        (0..rows).map(row).collect()
    };
    let text = format!("t,q1\n{}{}{}", log(9), log(12), log(10));
    let readings = csv(&text, &Layout::default());
    let names: Vec<&str> = readings.recordings.iter().map(|r| &*r.name).collect();
    assert_eq!(names, ["file", "file#2", "file#3"]);
    assert_eq!(readings.recordings[1].len(), 12);
    assert!(readings.notes[0].contains("first in row 10") && readings.notes[0].contains(": 3"));
    // Each row twice, in one log or several.
    let twice: String = text
        .lines()
        .skip(1)
        .flat_map(|row| [row, "\n", row, "\n"])
        .collect();
    let readings = csv(&format!("t,q1\n{twice}"), &Layout::default());
    let lengths: Vec<usize> = readings.recordings.iter().map(Recording::len).collect();
    assert_eq!(lengths, [9, 12, 10]);
    // A clock that goes back otherwise is a mistake, as are one wrong stamp, a start after a few rows, and rows from last to first.
    let backwards: String = log(40).lines().rev().flat_map(|row| [row, "\n"]).collect();
    for text in [
        format!("t,q1\n{}0.45,7\n0.55,8\n", log(9)),
        format!("t,q1\n{}0,7\n0.9,81\n1,100\n", log(9)),
        format!("t,q1\n{}0,7\n", log(9)),
        format!("t,q1\n{}{}", log(7), log(9)),
        format!("t,q1\n{backwards}"),
    ] {
        assert_eq!(csv(&text, &Layout::default()).recordings.len(), 1, "{text}");
    }
}

#[test]
fn a_row_that_was_written_twice_is_read_once() {
    let text = "t,q1\n0,1\n0,1\n1,1\n2,4\n2,4\n2,4\n2,5\n";
    let readings = csv(text, &Layout::default());
    assert_eq!(readings.recordings[0].t, [0.0, 1.0, 2.0, 2.0]);
    assert!(readings.notes[0].contains("read once: 3"));
}

#[test]
fn a_wrapped_angle_is_unwrapped_even_where_thinning_hides_the_jumps() {
    let truth = |k: u32| 0.3 * f64::from(k);
    let wrapped = |k: u32| (truth(k) + PI).rem_euclid(TAU) - PI;
    let rows: String = (0..200).map(|k| format!("{k},{}\n", wrapped(k))).collect();
    for every in [1, 15] {
        let layout = Layout {
            angles: vec!["all".into()],
            every,
            ..Layout::default()
        };
        let readings = csv(&format!("t,q1\n{rows}"), &layout);
        let r = &readings.recordings[0];
        assert_eq!(r.unwrapped, [10]);
        for (t, q) in r.t.iter().zip(&r.q) {
            approx::assert_abs_diff_eq!(*q, 0.3 * t, epsilon = 1e-9);
        }
    }
}

#[test]
fn an_angle_that_was_unwrapped_before_is_left_alone_however_coarse() {
    let readings = csv(
        "t,q1\n0,0\n1,5\n2,10\n3,5\n",
        &Layout {
            angles: vec!["q1".into()],
            ..Layout::default()
        },
    );
    assert_eq!(readings.recordings[0].q, [0.0, 5.0, 10.0, 5.0]);
}

#[test]
fn degrees_are_converted_where_declared_and_only_for_angles() {
    let layout = Layout {
        angles: vec!["q1".into()],
        degrees: true,
        ..Layout::default()
    };
    let readings = csv(
        "t,q1,q2,qd1,qd2,tau1,tau2\n0,90,90,180,180,5,5\n1,90,90,180,180,5,5\n",
        &layout,
    );
    let r = &readings.recordings[0];
    assert_eq!(r.q[..2], [PI / 2.0, 90.0]);
    assert_eq!(r.qd[..2], [PI, 180.0]);
    assert_eq!(r.tau[..2], [5.0, 5.0]);
}

#[test]
fn the_description_beside_the_data_survives_writing_and_flags_win_over_it() {
    let beside = Layout::from_toml(
        "angle = 'all'\ndegrees = true\n[columns]\nt = 'time'\nq = ['a', 'b']\n[units]\nb = 'm'",
    )
    .unwrap();
    assert_eq!(
        Layout::from_toml(&beside.to_toml().unwrap()).unwrap(),
        beside
    );
    let flags = Layout {
        columns: Signals {
            q: vec!["c".into()],
            ..Signals::default()
        },
        ..Layout::default()
    };
    let both = flags.or(beside);
    assert_eq!(
        (both.columns.q, both.t.as_deref(), both.degrees),
        (vec!["c".into()], Some("time"), true)
    );
    let written = Layout::written(&Coordinates::angles(2));
    assert_eq!(written.angles, ["q1", "q2"]);
}

#[test]
fn semicolons_tabs_spaces_and_a_byte_order_mark_are_understood() {
    for text in [
        "t;q1\n0;1\n1;2\n",
        "t\tq1\n0\t1\n1\t2\n",
        "\u{feff}t, q1\n0, 1\n1, 2\n",
        "t,q1\r\n0,1\r\n1,2\r\n",
    ] {
        assert_eq!(
            csv(text, &Layout::default()).recordings[0].q,
            [1.0, 2.0],
            "{text:?}"
        );
    }
}

#[test]
fn separators_within_quotes_are_letters_of_a_name() {
    let layout = Layout {
        t: Some("time; s".into()),
        columns: Signals {
            q: vec!["angle, left, smoothed".into()],
            ..Signals::default()
        },
        ..Layout::default()
    };
    for text in [
        "\"angle, left, smoothed\";\"time; s\"\n1;0\n2;1\n",
        "\u{feff}\"time; s\"\t\"angle, left, smoothed\"\n0\t1\n1\t2\n",
        "\"angle, left, smoothed\",\"time; s\",a \"\",b;\n1,0,3,4\n2,1,3,4\n",
    ] {
        assert_eq!(csv(text, &layout).recordings[0].q, [1.0, 2.0], "{text:?}");
    }
}

#[test]
fn an_archive_of_numpy_is_read_whatever_its_order_types_and_packing() {
    let bytes = include_bytes!("../golden/numpy_compressed.npz").as_slice();
    let readings = Format::Npz
        .read(Cursor::new(bytes), "file", &Layout::default())
        .unwrap();
    let names: Vec<&str> = readings
        .recordings
        .iter()
        .map(|r| r.name.as_str())
        .collect();
    assert_eq!(names, ["left", "right"]);
    let r = &readings.recordings[1];
    for (k, t) in r.t.iter().enumerate() {
        approx::assert_abs_diff_eq!(*t, 0.1 * (k + 3) as f64, epsilon = 1e-12);
        approx::assert_abs_diff_eq!(r.q[2 * k], t.sin(), epsilon = 1e-12);
        approx::assert_abs_diff_eq!(r.q[2 * k + 1], t.cos(), epsilon = 1e-12);
        approx::assert_abs_diff_eq!(r.qd[2 * k], t.cos(), epsilon = 1e-6);
    }
    assert_eq!(r.tau, [6.0, 7.0, 8.0, 9.0, 10.0, 11.0]);
}
