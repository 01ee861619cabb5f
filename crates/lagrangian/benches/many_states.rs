//! Accelerations of 10 000 states of a Lagrangian network, in chunks on all threads.
//!
//! Lower bound: (n + 3) W multiply–adds a state (theory.md, section 5), W the weights of all matrices; q, q̇, τ
//! read and q̈ written, 32 n bytes a state.
//!
//! `cargo bench --bench many_states -- ['width 128' | '1 thread' …]`

mod meter;

use std::hint::black_box;

use lagrangian::Model;
use meter::data::wave;
use meter::networks::{lnn, lnn_weights};
use meter::{Case, Meter, on_threads, threads};
use rayon::prelude::*;

/// The number of all states, and of those that a thread takes at a time.
const STATES: usize = 10_000;
const CHUNK: usize = 512;

fn main() {
    let meter = Meter::new(
        "many_states",
        "accelerations of 10 000 states; (n + 3) W multiply–adds and 32 n bytes a state",
    );
    for &width in meter.axis(&[64, 128, 256]) {
        for &n in meter.axis(&[2, 7]) {
            for &threads in meter.axis(&threads()) {
                row(&meter, n, width, threads);
            }
        }
    }
}

fn row(meter: &Meter, n: usize, width: usize, threads: usize) {
    let bytes = (32 * n * STATES) as f64;
    let case = Case {
        threads,
        operations: 2.0 * ((n + 3) * lnn_weights(n, width) * STATES) as f64,
        bytes,
        holds: bytes,
        things: (STATES as f64, "states"),
        ..Case::new(format!("lnn n {n} width {width} threads {threads}"))
    };
    let model = lnn(n, width);
    let [q, qd, tau] = [0.37, 0.73, 0.11].map(|f| wave(STATES * n, f, 1.0));
    let mut out = vec![0.0; STATES * n];
    let call = |_: usize| {
        let inputs = q.par_chunks(CHUNK * n).zip(qd.par_chunks(CHUNK * n));
        let inputs = inputs.zip(tau.par_chunks(CHUNK * n));
        let both = inputs.zip(out.par_chunks_mut(CHUNK * n));
        both.for_each_init(
            || model.evaluator(),
            |evaluator, (((q, qd), tau), out)| {
                let _ = evaluator.forward_dynamics(q, qd, tau, black_box(out));
            },
        );
    };
    on_threads(threads, || meter.calls(&case, call));
}
