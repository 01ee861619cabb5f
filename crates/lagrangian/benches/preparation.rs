//! From recordings to samples: velocities and accelerations estimated from positions (with the window chosen from the
//! data, or given), the samples gathered, their scales.
//!
//! Lower bound: the input signals are read and the output signals are written, 8 bytes a number; for the
//! estimates, which choose among windows, nothing is counted.
//!
//! `cargo bench --bench preparation -- [estimates | scales | 'rows 100000' …]`

mod meter;

use std::hint::black_box;
use std::io::Cursor;

use lagrangian::{
    Coordinates, Dataset, EstimateOptions, Format, Layout, Recording, Signals, Trajectory,
};
use meter::{Case, Meter, expect};

fn main() {
    let meter = Meter::new("preparation", "rows of recordings made ready to be fitted");
    for &rows in meter.axis(&[1_000, 10_000, 100_000]) {
        for &n in meter.axis(&[1, 7]) {
            prepare(&meter, rows, n);
        }
    }
}

fn prepare(meter: &Meter, rows: usize, n: usize) {
    // The number of values of a row that are read or written.
    let case = |what: &str, numbers: usize| Case {
        bytes: (8 * numbers * rows) as f64,
        holds: (8 * numbers * rows) as f64,
        things: (rows as f64, "rows"),
        ..Case::new(format!("{what} n {n} rows {rows}"))
    };
    let recording = positions(rows, n);
    let estimate = |options: &EstimateOptions| {
        let (trajectory, _) = expect(recording.clone().into_trajectory(options));
        trajectory
    };
    let free = EstimateOptions::default();
    meter.calls(&case("estimates, window chosen", 0), |_| {
        black_box(estimate(&free));
    });
    let given = EstimateOptions {
        window: Some(21),
        ..EstimateOptions::default()
    };
    meter.calls(&case("estimates, window of 21", 0), |_| {
        black_box(estimate(&given));
    });
    let trajectories = [estimate(&given)];
    let dataset = || {
        let coordinates = Coordinates::lines(n);
        expect(Dataset::new(coordinates, black_box(&trajectories), &[]))
    };
    // t, q, q̇, q̈ in and out, τ out.
    meter.calls(&case("samples", 2 * (1 + 3 * n) + n), |_| {
        black_box(dataset());
    });
    let data = dataset();
    meter.calls(&case("scales", 4 * n), |_| {
        black_box(data.scaling());
    });
}

/// Smooth motions with a little noise, positions alone.
fn positions(rows: usize, n: usize) -> Recording {
    let noise = |k: usize| 1e-4 * (1e3 * (k as f64).sin()).sin();
    let q = |k: usize| (0.01 * (k / n) as f64 * (1.0 + (k % n) as f64)).sin() + noise(k);
    let trajectory = Trajectory::new(
        "bench",
        (0..rows).map(|k| 0.01 * k as f64).collect(),
        Signals {
            q: (0..rows * n).map(q).collect(),
            qd: vec![0.0; rows * n],
            ..Signals::default()
        },
    );
    let mut bytes = Cursor::new(Vec::new());
    expect(Format::Npz.write(&mut bytes, &[trajectory]));
    bytes.set_position(0);
    let readings = expect(Format::Npz.read(bytes, "bench", &Layout::default()));
    let recording = readings.recordings.into_iter().next();
    let recording = expect(recording.ok_or("no recording"));
    Recording {
        signals: recording.signals,
        ..recording
    }
}
