//! Comparison of compiled C with the library. `LAGRANGIAN_EXPORT=all` tests all installed compilers, levels of optimisation,
//! sanitizers and the emulated processor, and more states; `LAGRANGIAN_EXPORT=arm,delan` does so for these models
//! and omits the others.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    reason = "a test fails by panicking"
)]

mod built;
mod models;
mod rust;

use std::collections::BTreeMap;

use built::{Built, Compiler};
use lagrangian::expression::{Equations, Graph, input};
use lagrangian::mechanics::Evaluation;
use lagrangian::{Evaluator, Learned, Model as _};
use lagrangian_export::{About, Call, Export, Interface, export};
use rand::{RngExt, SeedableRng};

type Rng = rand_chacha::ChaCha8Rng;

/// The states that are compared: (q, q̇, q̈, τ), each `[n]`.
fn states(n: usize, count: usize, size: f64) -> Vec<f64> {
    let mut rng = Rng::seed_from_u64(size.to_bits());
    (0..4 * n * count)
        .map(|_| rng.random_range(-size..size))
        .collect()
}

fn exported(name: &str, model: &Learned) -> Export {
    export(model, About { name, hash: "0" }).unwrap()
}

/// The value of the variable `LAGRANGIAN_EXPORT`: `all`, or names of models.
fn asked() -> Option<String> {
    std::env::var("LAGRANGIAN_EXPORT").ok()
}

fn is_all() -> bool {
    asked().is_some()
}

/// The models that are compared.
fn compared() -> Vec<(String, Learned)> {
    let mut models = models::all();
    if let Some(names) = asked().filter(|x| x != "all") {
        let known: Vec<String> = models.iter().map(|(name, _)| name.clone()).collect();
        let wanted: Vec<&str> = names.split(',').collect();
        let unknown = wanted.iter().find(|w| !known.iter().any(|k| k == *w));
        assert_eq!(unknown, None, "LAGRANGIAN_EXPORT: the models are {known:?}");
        models.retain(|(name, _)| wanted.contains(&name.as_str()));
    }
    models
}

/// A state, the results of the C, and those of the library.
type Pair<'a> = (&'a [f64], &'a [f64], Vec<f64>);

/// The largest number of a list.
fn size(list: &[f64]) -> f64 {
    list.iter().fold(1e-9_f64, |most, x| most.max(x.abs()))
}

/// The largest difference of two lists, relative to the largest number of the second, or to `usual` if that is larger, since
/// a difference of large numbers has their rounding errors.
fn difference(found: &[f64], expected: &[f64], usual: f64) -> f64 {
    let size = size(expected).max(usual);
    let differences = found.iter().zip(expected).map(|(a, b)| (a - b).abs());
    differences.fold(0.0, f64::max) / size
}

/// The results of the library for a state, `None` where it is not defined.
fn expected(
    model: &Learned,
    evaluator: &mut dyn Evaluator,
    call: Call,
    state: &[f64],
) -> Option<Vec<f64>> {
    let n = state.len() / 4;
    let [q, qd, qdd, tau] = [0, 1, 2, 3].map(|k| &state[k * n..][..n]);
    let mut x = vec![0.0; n];
    let outcome = match call {
        Call::InverseDynamics => evaluator.inverse_dynamics(q, qd, qdd, &mut x),
        Call::FeedForward => {
            let held = q.iter().zip(tau).map(|(q, d)| d.clamp(q - 0.1, q + 0.1));
            evaluator.inverse_dynamics(&held.collect::<Vec<_>>(), qd, qdd, &mut x)
        }
        Call::ForwardDynamics => evaluator.forward_dynamics(q, qd, tau, &mut x),
        Call::MassMatrix => {
            x.resize(n * n, 0.0);
            evaluator.mass_matrix(q, qd, &mut x)
        }
        Call::Bias => evaluator.bias(q, qd, &mut x),
        Call::Gravity => evaluator.bias(q, &vec![0.0; n], &mut x),
        Call::Momentum => evaluator.momentum(q, qd, &mut x),
        Call::Energy => {
            x.truncate(1);
            evaluator.energy(q, qd, &mut x)
        }
        Call::Friction => {
            match evaluator.applied().dissipation {
                Some(friction) => friction.force(qd, &mut x),
                None => x.fill(0.0),
            }
            Evaluation::Regular
        }
        Call::DistanceFromData => {
            x = vec![model.visited()?.distance(model.coordinates(), q, qd)];
            Evaluation::Regular
        }
        _ => return None,
    };
    (outcome == Evaluation::Regular).then_some(x)
}

/// The derivatives of inverse dynamics from the expressions, row by row.
fn slopes(graph: &Graph, along: [usize; 3], state: &[f64]) -> Vec<f64> {
    let n = state.len() / 4;
    let [q, qd, qdd, tau] = [0, 1, 2, 3].map(|k| &state[k * n..][..n]);
    let mut all = vec![0.0; 3 * n * n];
    for k in 0..n {
        let unit: Vec<f64> = (0..n).map(|i| if i == k { 1.0 } else { 0.0 }).collect();
        let inputs = [
            (input::Q, q),
            (input::QD, qd),
            (input::QDD, qdd),
            (input::TAU, tau),
            (input::DIRECTION, &unit[..]),
        ];
        let values = along.map(|id| graph.value(id));
        for (part, column) in graph.evaluate(&inputs, &values).unwrap().iter().enumerate() {
            (0..n).for_each(|i| all[(part * n + i) * n + k] = column[i]);
        }
    }
    all
}

/// The largest differences of each call over these states.
fn compare(
    model: &Learned,
    interface: &Interface,
    built: &Built,
    states: &[f64],
    tolerance: f64,
    name: &str,
) {
    let n = interface.joints.len();
    let answers = built.run(interface, states);
    let mut evaluator = model.evaluator();
    let mut pairs: BTreeMap<Call, Vec<Pair<'_>>> = BTreeMap::new();
    for (state, answer) in states.chunks_exact(4 * n).zip(&answers) {
        for (call, (status, found)) in answer {
            let expected = expected(model, &mut *evaluator, *call, state);
            let defined = |x: &Vec<f64>| x.iter().all(|x| x.is_finite() && x.abs() < 1e200);
            let Some(expected) = expected.filter(defined) else {
                continue;
            };
            assert!(
                *status <= 1,
                "{name}, {call:?}: status {status} at {state:?}"
            );
            pairs
                .entry(*call)
                .or_default()
                .push((state, found, expected));
        }
    }
    let mut worst_of: BTreeMap<Call, f64> = BTreeMap::new();
    for (call, pairs) in &pairs {
        let mut sizes: Vec<f64> = pairs
            .iter()
            .map(|(_, _, expected)| size(expected))
            .collect();
        let middle = sizes.len() / 2;
        let usual = *sizes.select_nth_unstable_by(middle, f64::total_cmp).1;
        // A nearly singular M loses digits in both.
        let bound = if *call == Call::ForwardDynamics {
            1e3 * tolerance
        } else {
            tolerance
        };
        for (state, found, expected) in pairs {
            let worst = difference(found, expected, usual);
            assert!(
                worst <= bound,
                "{name}, {call:?}: {worst:e} at {state:?}: {found:?} is not {expected:?}"
            );
            let most = worst_of.entry(*call).or_default();
            *most = most.max(worst);
        }
    }
    assert!(!worst_of.is_empty(), "{name}: nothing was compared");
    if is_all() {
        let words = worst_of
            .iter()
            .map(|(call, worst)| format!("{} {worst:.1e}", call.name()));
        println!(
            "{name} {}: {}",
            built.about(),
            words.collect::<Vec<_>>().join(", ")
        );
    }
}

/// Compares the derivatives with those of the expressions and with each other.
fn compare_slopes(
    model: &Learned,
    interface: &Interface,
    built: &Built,
    states: &[f64],
    name: &str,
) {
    let n = interface.joints.len();
    let equations = model.equations(Graph::new()).unwrap();
    let (graph, along) = match &equations {
        Equations::Mechanics(of) => (&of.graph, of.needed_along),
        Equations::Plain(of) => (&of.graph, of.along),
        Equations::Hamiltonian(_) | Equations::Flow(_) => return,
    };
    for (state, answer) in states.chunks_exact(4 * n).zip(built.run(interface, states)) {
        let of = |call: Call| {
            answer
                .iter()
                .find(|(own, _)| *own == call)
                .map(|(_, (_, x))| x)
        };
        let expected = slopes(graph, along, state);
        let plain_forward = !interface.calls.contains(&Call::InverseDynamics);
        let first = if plain_forward {
            Call::ForwardDynamicsDerivatives
        } else {
            Call::InverseDynamicsDerivatives
        };
        let worst = difference(of(first).unwrap(), &expected, 0.0);
        assert!(worst < 1e-12, "{name}, {first:?}: {worst:e}");
        let (Some(forward), Some(qdd)) = (
            of(Call::ForwardDynamicsDerivatives),
            of(Call::ForwardDynamics),
        ) else {
            continue;
        };
        if plain_forward {
            continue;
        }
        // (dτ/dq̈) (dq̈/dx) = −dτ/dx at the accelerations that τ gives, and 1 for τ itself.
        let moved = [&state[..2 * n], qdd, &state[3 * n..]].concat();
        let inverse = slopes(graph, along, &moved);
        let (by_state, mass) = inverse.split_at(2 * n * n);
        for (part, sign) in [(0, -1.0), (1, -1.0), (2, 1.0)] {
            for (i, k) in (0..n).flat_map(|i| (0..n).map(move |k| (i, k))) {
                let product: f64 = (0..n)
                    .map(|j| mass[i * n + j] * forward[(part * n + j) * n + k])
                    .sum();
                let wanted = match part {
                    2 => f64::from(u8::from(i == k)),
                    _ => sign * by_state[(part * n + i) * n + k],
                };
                let size = by_state.iter().fold(1.0_f64, |most, x| most.max(x.abs()));
                assert!(
                    (product - wanted).abs() < 1e-8 * size,
                    "{name}, part {part} ({i}, {k}): {product} is not {wanted}"
                );
            }
        }
    }
}

#[test]
fn rust_without_std_calls_the_same_functions() {
    let folder = tempfile::tempdir().unwrap();
    let (name, model) = models::all()
        .into_iter()
        .find(|(name, _)| name == "arm")
        .unwrap();
    rust::check(folder.path(), &exported(&name, &model));
}

#[test]
fn no_call_takes_more_of_the_stack_than_is_said() {
    let folder = tempfile::tempdir().unwrap();
    for (name, model) in models::all() {
        let Export { interface, code } = exported(&name, &model);
        let frames = built::frames(folder.path(), &interface, &code);
        let most = |which: &dyn Fn(&str) -> bool| {
            let of = frames.iter().filter(|(own, _)| which(own));
            of.map(|(_, bytes)| *bytes).max().unwrap_or(0)
        };
        let solves = |own: &str| {
            [
                "solve",
                "slopes",
                "momentum_of",
                "terms_of",
                "bias_of",
                "velocity_of",
                "slopes_of",
            ]
            .contains(&own)
        };
        let helpers = most(&|own| !own.starts_with(&name) && !solves(own));
        let outer = |which: &[Call]| {
            let names: Vec<String> = which
                .iter()
                .map(|call| format!("{name}_{}", call.name()))
                .collect();
            most(&|own| names.iter().any(|name| name == own))
        };
        let forward = outer(&[Call::ForwardDynamicsDerivatives])
            .max(outer(&[Call::Step]) + outer(&[Call::ForwardDynamics]));
        let callers = (forward + most(&solves)).max(most(&|own| own.starts_with(&name)));
        let most = helpers;
        let bound = code.stack_bytes(8);
        assert!(
            callers + most <= bound,
            "{name}: {callers} + {most} bytes of {bound}"
        );
    }
}

#[test]
fn exported_functions_are_those_of_the_library() {
    let folder = tempfile::tempdir().unwrap();
    for (name, model) in compared() {
        let Export { interface, code } = exported(&name, &model);
        let n = interface.joints.len();
        // Far outside of the data of a network, momenta are at the limit of what Newton's method can solve for, in both.
        let has_momenta = interface.calls.contains(&Call::Momentum);
        let by_newton = has_momenta && !interface.calls.contains(&Call::InverseDynamicsDerivatives);
        let reach = if by_newton { 10.0 } else { 1e3 };
        let (random, extreme) = if is_all() { (10_000, 1000) } else { (400, 100) };
        for compiler in Compiler::all(is_all(), &name) {
            let built = Built::new(folder.path(), &interface, &code, &compiler);
            assert_eq!(built.selftest(), "0", "{name} by {compiler:?}");
            let tolerance = if compiler.single { 2e-4 } else { 1e-12 };
            compare(
                &model,
                &interface,
                &built,
                &states(n, random, 2.0),
                tolerance,
                &name,
            );
            if !compiler.single {
                compare(
                    &model,
                    &interface,
                    &built,
                    &states(n, extreme, reach),
                    1e-10,
                    &name,
                );
                compare_slopes(&model, &interface, &built, &states(n, 4, 1.0), &name);
            }
        }
    }
}
