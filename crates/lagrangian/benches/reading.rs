//! Reading recordings of two joints with all signals (t, q, q̇, q̈, τ: nine columns) from memory.
//!
//! Lower bound: every byte of the file is read once.
//!
//! `cargo bench --bench reading -- [csv | npz | 'rows 100000' …]`.

mod meter;

use std::hint::black_box;
use std::io::Cursor;

use lagrangian::{Format, Layout, Signals, Trajectory};
use meter::data::wave;
use meter::{Case, Meter, expect};

/// Degrees of freedom.
const N: usize = 2;

fn main() {
    let meter = Meter::new("reading", "a file in memory; its bytes read once");
    for (format, name) in Format::ALL {
        for &rows in meter.axis(&[1_000, 10_000, 100_000]) {
            if let Err(e) = file(&meter, format, name, rows) {
                println!("{name}: {e}");
                break;
            }
        }
    }
}

fn file(meter: &Meter, format: Format, name: &str, rows: usize) -> lagrangian::Result<()> {
    let mut bytes = Cursor::new(Vec::new());
    format.write(&mut bytes, &[recording(rows)])?;
    // A reader may keep its source: one that lives as long as the program needs no copy.
    let bytes: &'static [u8] = bytes.into_inner().leak();
    let case = Case {
        bytes: bytes.len() as f64,
        holds: bytes.len() as f64,
        things: (rows as f64, "rows"),
        ..Case::new(format!("{name} rows {rows}"))
    };
    let layout = Layout::default();
    meter.calls(&case, |_| {
        black_box(expect(format.read(Cursor::new(bytes), "bench", &layout)));
    });
    Ok(())
}

fn recording(rows: usize) -> Trajectory {
    let column = |f: f64| wave(rows * N, f, 1.0);
    Trajectory::new(
        "bench",
        (0..rows).map(|k| 0.01 * k as f64).collect(),
        Signals {
            q: column(0.01),
            qd: column(0.02),
            qdd: column(0.03),
            tau: column(0.05),
            ..Signals::default()
        },
    )
}
