//! Rollouts by the classical Runge–Kutta method, every step recorded: one state, and many side by side.
//!
//! Lower bound: four accelerations a step, of (n + 3) W multiply–adds each for a Lagrangian network and 3 W for
//! a deep one (theory.md, sections 5 and 14), W the weights of all matrices. One state reads all weights at every
//! evaluation, 8 W bytes; with many states, the states themselves are read and written.
//!
//! `cargo bench --bench rk4 -- [delan | 'states 1 ' …]`

mod meter;

use std::hint::black_box;

use lagrangian::integrate::Method;
use lagrangian::rollout::{free, rollout_many, times};
use lagrangian::{Model, RolloutOptions, State, rollout};
use meter::data::wave;
use meter::networks::{delan, delan_weights, lnn, lnn_weights};
use meter::{Case, Meter, expect, on_threads, threads};

/// The step of the integrator, s: so short that no motion of a random network ends before its time.
const STEP: f64 = 1e-4;

fn main() {
    let meter = Meter::new(
        "rk4",
        "steps of RK4 at four accelerations each; one state reads all weights at each of them",
    );
    let n = 2;
    for &width in meter.axis(&[64, 128]) {
        let lnn_costs = (n + 3) * lnn_weights(n, width);
        let deep_costs = 3 * delan_weights(n, width);
        for (states, steps) in [(1, 1000), (100, 100), (1000, 20)] {
            let threads = if states == 1 { vec![1] } else { threads() };
            for &threads in meter.axis(&threads) {
                let sizes = (n, states, if meter.smoke() { 2 } else { steps }, threads);
                let name = format!("lnn n {n} width {width}");
                let weights = lnn_weights(n, width);
                row(&meter, &name, &lnn(n, width), sizes, (lnn_costs, weights));
                let name = format!("delan n {n} width {width}");
                let weights = delan_weights(n, width);
                let deep = delan(n, width);
                row(&meter, &name, &deep, sizes, (deep_costs, weights));
            }
        }
    }
}

/// Rollouts of some states over some steps, where an acceleration costs `costs` multiply–adds.
fn row(
    meter: &Meter,
    name: &str,
    model: &dyn Model,
    (n, states, steps, threads): (usize, usize, usize, usize),
    (costs, weights): (usize, usize),
) {
    let evaluations = (4 * states * steps) as f64;
    let one = states == 1;
    let case = Case {
        threads,
        operations: 2.0 * costs as f64 * evaluations,
        bytes: if one {
            8.0 * weights as f64
        } else {
            32.0 * n as f64
        } * evaluations,
        holds: if one {
            16.0 * weights as f64
        } else {
            (16 * n * states) as f64
        },
        things: ((states * steps) as f64, "steps"),
        ..Case::new(format!("{name} states {states} threads {threads}"))
    };
    let options = RolloutOptions {
        method: Method::Rk4,
        step: STEP,
        ..RolloutOptions::default()
    };
    let times = expect(times(steps as f64 * STEP, STEP));
    let [q, qd] = [0.37, 0.73].map(|f| wave(states * n, f, 0.5));
    let starts: Vec<State> = q
        .chunks(n)
        .zip(qd.chunks(n))
        .map(|(q, qd)| State::new(q.to_vec(), qd.to_vec()))
        .collect();
    let run = || match &starts[..] {
        [start] => {
            let found = rollout(model, &start.q, &start.qd, &times, &free, &options);
            vec![expect(found)]
        }
        _ => expect(rollout_many(model, &starts, &times, &free, &options)),
    };
    let ended = run().iter().all(|found| found.outcome.is_finished());
    expect(ended.then_some(()).ok_or("a motion ended before its time"));
    let call = |_: usize| {
        black_box(run());
    };
    on_threads(threads, || meter.calls(&case, call));
}
