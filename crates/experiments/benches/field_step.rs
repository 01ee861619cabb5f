//! One evaluation of a ring of points with a learned density, on one thread: all of it, the banded solve, and a dense
//! solve beside it.
//!
//! What cannot be saved of the banded solve: the Cholesky factor of a band of b = 4 off-diagonals (points two apart are
//! coupled, the ring is folded flat), b (b + 2) operations a point, and the two substitutions, 4 b + 2; three numbers of
//! M and one of the right-hand side read, one written. Of the dense solve: N³/3. Of the whole evaluation nothing is
//! counted: a density has a network, and derivatives, of its own.
//!
//! `cargo bench -p experiments --bench field_step -- [whole | banded | dense …]`

#[path = "../../lagrangian/benches/meter/mod.rs"]
mod meter;

use std::hint::black_box;

use experiments::field::{DensityConfig, DensityNet, Field, FieldScaling};
use lagrangian::Evaluator;
use lagrangian::mechanics::SymmetricSolver;
use meter::data::wave;
use meter::{Case, Meter, expect};

/// More points than this are not solved as a dense matrix: the time grows with their cube.
const DENSE: usize = 300;
/// Off-diagonals of the ring folded flat.
const BAND: usize = 4;

fn main() {
    let meter = Meter::new("field_step", "one evaluation of a ring, in points a second");
    let config = DensityConfig {
        width: 24,
        ..DensityConfig::default()
    };
    let density = expect(DensityNet::random(config, FieldScaling::identity(), 0));
    for &points in meter.axis(&[10, 30, 100, 300, 1000, 3000, 10_000]) {
        ring(&meter, &density, points);
    }
}

fn ring(meter: &Meter, density: &DensityNet, points: usize) {
    let field = expect(Field::new(density, points));
    let case = |part: &str| Case {
        things: (points as f64, "points"),
        ..Case::new(format!("{part} points {points}"))
    };
    let (phi, phid) = (wave(points, 0.7, 1.0), wave(points, 0.9, 1.0));
    let (zero, mut out) = (vec![0.0; points], vec![0.0; points]);
    let mut evaluator = field.field_evaluator();
    meter.calls(&case("whole"), |_| {
        let _ = evaluator.forward_dynamics(&phi, &phid, &zero, black_box(&mut out));
    });
    let mut band = evaluator.mass_band(&phi, &phid);
    let banded = Case {
        operations: ((BAND * (BAND + 2) + 4 * BAND + 2) * points) as f64,
        bytes: (40 * points) as f64,
        holds: (40 * points) as f64,
        ..case("banded solve")
    };
    meter.calls(&banded, |_| {
        let _ = band.solve(&phi, black_box(&mut out));
    });
    if points > DENSE {
        return;
    }
    let mut solver = SymmetricSolver::new(points);
    let dense = Case {
        operations: (points as f64).powi(3) / 3.0,
        ..case("dense solve")
    };
    let mass = evaluator.mass_matrix(&phi, &phid);
    meter.calls(&dense, |_| {
        let _ = solver.solve(&mass, &phi, black_box(&mut out));
    });
}
