#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use super::super::config::{RolloutLoss, SEGMENTS, Start};
use super::super::gauss_newton::{GaussNewton, RolloutProblem, Segments};
use super::super::segments::{Recorded, Rows};
use super::{dataset, direction, families, methods, moved, settings, template, with_flow};
use crate::train::System;
use crate::train::learner::Learner;
use crate::train::problem::LeastSquares;
use lagrangian_mechanics::integrate::Method;

/// The values of a problem at θ: r, J φ, Jᵀ x of the parameters, and J Jᵀ x.
struct Seen {
    residual: Vec<f64>,
    pushed: Vec<f64>,
    pulled: Vec<f64>,
    product: Vec<f64>,
}

fn see(problem: &mut RolloutProblem<'_>, theta: &[f64], phi: &[f64], x: &[f64]) -> Seen {
    let mut system = System::new();
    problem.residuals(theta);
    problem.linearise(phi);
    let size = problem.products(0.0, &mut system);
    let mut product = vec![0.0; size];
    for j in 0..size {
        let column = system.column_mut(j);
        for i in j..size {
            product[i] += column[i] * x[j];
            if i > j {
                product[j] += column[i] * x[i];
            }
        }
    }
    let mut pulled = vec![0.0; phi.len()];
    problem.pull_back(x, &mut pulled);
    Seen {
        residual: system.residual.clone(),
        pushed: system.pushed.clone(),
        pulled,
        product,
    }
}

#[test]
fn the_jacobian_of_a_rollout_by_its_factors_is_that_of_differences_and_gives_the_kernel() {
    let dataset = dataset();
    for (family, forces) in families() {
        let recorded = Recorded::train(&dataset, family.momenta());
        let template = template(&dataset, &*family, forces);
        let mut theta = template.initialise(4);
        // Forces that a difference would reveal.
        with_flow(&template, |learner| {
            let forces = &mut theta[learner.net().parameters..];
            forces.iter_mut().for_each(|x| *x += 0.2);
        });
        for method in methods(&*family) {
            let config = settings(method);
            let weights = recorded.weights(config.horizon);
            let begins = recorded.starts(config.horizon, 2);
            with_flow(&template, |learner| {
                let mut memory = GaussNewton::new(learner, &config, begins.len());
                let mut problem = problem(&mut memory, learner, (recorded, &config, &weights));
                problem.segments.begins.clone_from(&begins);
                let rows = problem.segments.rows.count();
                let size = begins.len().next_multiple_of(SEGMENTS) * rows;
                let (phi, mut x) = (direction(theta.len(), 0.7), direction(size, 0.1));
                // The padding of a block has no weight.
                x[begins.len() * rows..].fill(0.0);
                let seen = see(&mut problem, &theta, &phi, &x);
                let mut at =
                    |step| see(&mut problem, &moved(&theta, &phi, step), &phi, &x).residual;
                // The step is so short that no sample crosses the kink where the output of a gear vanishes.
                let step = 4e-6;
                let [up, down, further, nearer] =
                    [step, -step, 2.0 * step, -2.0 * step].map(&mut at);
                let name = format!("{} {}", family.name(), method.name());
                for (at, pushed) in seen.pushed.iter().enumerate() {
                    let near = (up[at] - down[at]) / (2.0 * step);
                    let far = (further[at] - nearer[at]) / (4.0 * step);
                    let difference = (4.0 * near - far) / 3.0;
                    assert!(
                        (pushed - difference).abs() < 1e-7 * (1.0 + difference.abs()),
                        "{name}: {pushed} {difference}"
                    );
                }
                // J (Jᵀ x) = J Jᵀ x.
                let again = see(&mut problem, &theta, &seen.pulled, &x);
                for (through, k) in again.pushed.iter().zip(&seen.product) {
                    assert!(
                        (through - k).abs() < 1e-9 * (1.0 + k.abs()),
                        "{name}: {through} {k}"
                    );
                }
            });
        }
    }
}

/// The problem of segments that have no starts yet.
fn problem<'p>(
    memory: &'p mut GaussNewton,
    learner: &'p dyn Learner<f64>,
    (recorded, config, weights): (Recorded<'p>, &'p RolloutLoss, &'p [f64]),
) -> RolloutProblem<'p> {
    RolloutProblem {
        memory,
        learner,
        segments: Segments {
            recorded,
            config,
            weights,
            rows: Rows::new(config, config.horizon, recorded.samples.n),
            begins: Vec::new(),
        },
        terms: learner.terms(),
    }
}

#[test]
fn free_starts_add_their_own_part_to_the_kernel() {
    let dataset = dataset();
    let (family, forces) = &families()[5];
    let recorded = Recorded::train(&dataset, family.momenta());
    let template = template(&dataset, &**family, *forces);
    let parameters = template.initialise(4);
    let config = RolloutLoss {
        start: Start::Free,
        ..settings(Method::Rk4)
    };
    let weights = recorded.weights(config.horizon);
    let states = (0..dataset.train.len() * 4).map(|at| recorded.state(at / 4, at % 4));
    let theta: Vec<f64> = parameters.iter().copied().chain(states).collect();
    let begins = vec![0, 3, 6, 14, 17];
    with_flow(&template, |learner| {
        let mut memory = GaussNewton::new(learner, &config, begins.len());
        let mut problem = problem(&mut memory, learner, (recorded, &config, &weights));
        problem.segments.begins.clone_from(&begins);
        let counted = begins.len() * problem.segments.rows.count();
        let mut x = direction(SEGMENTS * problem.segments.rows.count(), 0.3);
        x[counted..].fill(0.0);
        let none = vec![0.0; parameters.len()];
        let with = see(&mut problem, &theta, &none, &x);
        // The moves of the starts for these weights of the residuals, Cᵀ x; then the change of the residuals, C Cᵀ x.
        let mut starts = theta.clone();
        problem.settle(&mut starts, -1.0);
        let change: Vec<f64> = (0..theta.len())
            .map(|k| match k < parameters.len() {
                true => 0.0,
                false => starts[k] - theta[k],
            })
            .collect();
        let mut residual =
            |step| see(&mut problem, &moved(&theta, &change, step), &none, &x).residual;
        let (up, down) = (residual(1e-5), residual(-1e-5));
        let by_weights = see(&mut problem, &theta, &with.pulled, &x).pushed;
        for (at, k) in with.product.iter().enumerate().take(counted) {
            let sum = (up[at] - down[at]) / 2e-5 + by_weights[at];
            assert!((sum - k).abs() < 1e-6 * (1.0 + k.abs()), "{at}: {sum} {k}");
        }
    });
}
