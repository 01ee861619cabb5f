//! One call of a control loop: inverse and forward dynamics of one state, on one thread.
//!
//! Beside the time stands that of streaming the weights once from the cache, twice of which a call must not exceed by
//! far: a matrix–vector product does two operations for each number that it reads.
//!
//! `cargo bench -p lagrangian --bench one_state [-- --quick]`

use std::hint::black_box;
use std::time::Instant;

use lagrangian::lagrangian::{Delan, DelanConfig, Lnn, LnnConfig, Scaling};
use lagrangian::{Coordinates, Mechanical, Model};

/// Median and 99th percentile of a call, s.
fn time(calls: usize, mut call: impl FnMut(usize)) -> (f64, f64) {
    (0..calls / 10).for_each(&mut call);
    let mut laps: Vec<f64> = (0..calls)
        .map(|k| {
            let clock = Instant::now();
            call(k);
            clock.elapsed().as_secs_f64()
        })
        .collect();
    laps.sort_by(f64::total_cmp);
    (laps[calls / 2], laps[calls * 99 / 100])
}

/// Seconds to add up as many numbers as the model has weights, again and again.
fn stream(weights: usize) -> f64 {
    let numbers = vec![1.0_f64; weights];
    let add = |_| {
        let lanes = black_box(&numbers)
            .chunks_exact(8)
            .fold([0.0; 8], |mut sum, x| {
                sum.iter_mut().zip(x).for_each(|(s, x)| *s += x);
                sum
            });
        black_box(lanes);
    };
    time(20_000, add).0
}

fn report(name: &str, model: &dyn Model, weights: usize, calls: usize) {
    let n = model.coordinates().dof();
    let mut evaluator = model.evaluator();
    let states: Vec<f64> = (0..n + 64).map(|k| (0.7 * k as f64).sin()).collect();
    let mut out = vec![0.0; n];
    let inverse = time(calls, |k| {
        let x = &states[k % 64..][..n];
        evaluator.inverse_dynamics(x, x, x, &mut out);
        black_box(&out);
    });
    let forward = time(calls, |k| {
        let x = &states[k % 64..][..n];
        evaluator.forward_dynamics(x, x, x, &mut out);
        black_box(&out);
    });
    println!(
        "{name:6} {n:2}   {:7.2} µs {:7.2} µs   {:7.2} µs {:7.2} µs   {:5.2} µs",
        1e6 * inverse.0,
        1e6 * inverse.1,
        1e6 * forward.0,
        1e6 * forward.1,
        1e6 * stream(weights),
    );
}

fn main() {
    let quick = std::env::args().any(|a| a == "--quick" || a == "--test");
    let calls = if quick { 2_000 } else { 100_000 };
    println!("2 × 64    inverse dynamics        forward dynamics        one pass over");
    println!("model  n   median      99 %        median      99 %        the weights");
    for n in [1, 2, 7] {
        let (angles, scaling) = (Coordinates::angles(n), Scaling::identity(n));
        let delan = Delan::random(angles.clone(), DelanConfig::default(), scaling.clone(), 0)
            .unwrap_or_else(|e| panic!("{e}"));
        let weights = delan.parameters().len();
        report("delan", &Mechanical::conservative(delan), weights, calls);
        let lnn =
            Lnn::random(angles, LnnConfig::default(), scaling, 0).unwrap_or_else(|e| panic!("{e}"));
        let weights = lnn.parameters().len();
        report("lnn", &Mechanical::conservative(lnn), weights, calls);
    }
}
