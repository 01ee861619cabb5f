//! One call of a control loop: acceleration, inverse dynamics and energy of one state, on one thread.
//!
//! Lower bounds, with W the weights of all matrices (theory.md, sections 5 and 14), two operations each:
//!
//! | | Lagrangian network | deep Lagrangian network |
//! |---|---|---|
//! | acceleration, inverse dynamics | (n + 3) W: value, n + 1 tangents, one reverse pass | 3 W: value, one tangent, one reverse pass |
//! | energy | 2 W: value and gradient | W: M and V are outputs |
//!
//! and every weight is read once, 8 W bytes. The call holds them twice, for both passes, which decides the cache. Where
//! "of memory" is 50 %, a call takes twice the time of streaming the weights; "× limit" is over the longer of both.
//!
//! `cargo bench --bench one_state -- [acceleration | inverse | energy | lnn | delan | 'n 2' …]`

mod meter;

use std::hint::black_box;

use lagrangian::Model;
use lagrangian::mechanics::Quantities;
use meter::data::wave;
use meter::networks::{delan, delan_weights, lnn, lnn_weights};
use meter::{Case, Meter};

/// The number of states that the calls use in turn.
const TURNS: usize = 64;

fn main() {
    let meter = Meter::new(
        "one_state",
        "one call; (n + 3) W multiply–adds of a Lagrangian network, 3 W of a deep one; W weights read once",
    );
    for &width in meter.axis(&[64, 128, 256]) {
        for &n in meter.axis(&[1, 2, 7]) {
            let weights = lnn_weights(n, width);
            let products = [n + 3, n + 3, 2];
            network(&meter, ("lnn", n, width), &lnn(n, width), weights, products);
            let weights = delan_weights(n, width);
            let deep = delan(n, width);
            network(&meter, ("delan", n, width), &deep, weights, [3, 3, 1]);
        }
    }
}

/// The three calls, with the products of all weights that each of them needs.
fn network(
    meter: &Meter,
    (family, n, width): (&str, usize, usize),
    model: &dyn Model,
    weights: usize,
    products: [usize; 3],
) {
    let case = |call: &str, products: usize| Case {
        operations: 2.0 * (products * weights) as f64,
        bytes: 8.0 * weights as f64,
        holds: 16.0 * weights as f64,
        ..Case::new(format!("{call} {family} n {n} width {width}"))
    };
    let mut evaluator = model.evaluator();
    let states = wave(n + TURNS, 0.7, 1.0);
    let state = |k: usize| &states[k % TURNS..][..n];
    let (mut out, mut energy) = (vec![0.0; n], [0.0]);
    meter.calls(&case("acceleration", products[0]), |k| {
        let x = state(k);
        let _ = evaluator.forward_dynamics(x, x, x, black_box(&mut out));
    });
    meter.calls(&case("inverse dynamics", products[1]), |k| {
        let x = state(k);
        let _ = evaluator.inverse_dynamics(x, x, x, black_box(&mut out));
    });
    meter.calls(&case("energy", products[2]), |k| {
        let x = state(k);
        let _ = evaluator.energy(x, x, black_box(&mut energy));
    });
    meter.calls(&case("checked inverse dynamics", products[1]), |k| {
        let x = state(k);
        let _ = black_box(model.inverse_dynamics(x, x, x));
    });
}
