#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use super::super::config::Start;
use super::super::segments::Recorded;
use super::super::tests::{dataset, direction, families, methods, moved, settings, template};
use super::*;

/// Residuals of two blocks, r − J φ, Jᵀ x for x of `weights`, and the kernel times them.
struct Seen {
    residual: Vec<f64>,
    left: Vec<f64>,
    pulled: Vec<f64>,
    product: Vec<f64>,
}

fn see(
    learner: &dyn Learner<f64>,
    task: &Task<'_>,
    begins: &[usize],
    parameters: &[f64],
    (phi, x): (&[f64], &[f64]),
) -> Seen {
    let (net, terms) = (learner.net(), learner.terms());
    let mut engine = GaussNewton::new(learner, task.config, begins.len());
    let (weights, extra) = parameters.split_at(net.parameters);
    engine.packed.set(net, weights);
    engine.packed_phi.set(net, &phi[..net.parameters]);
    let phi_extra = &phi[net.parameters..];
    for (unit, begins) in engine.units.iter_mut().zip(begins.chunks(SEGMENTS)) {
        let flow = Flow {
            learner,
            packed: &engine.packed,
            extra,
            sizes: unit.block.sizes,
        };
        unit.block.shoot(&flow, task, begins);
        unit.block.back(task, Back::Each);
        unit.mix(task.rows);
        for (work, factors) in unit.block.works.iter().zip(&mut unit.factors) {
            factors.set(net, &work.pass, &terms);
        }
        unit.push(learner, &engine.packed_phi, &terms, (phi_extra, 1.0));
    }
    let used = engine.units.len();
    engine.gram(learner, used, task, &terms);
    engine.mix_gram(used, task);
    let list = |f: &dyn Fn(&Unit) -> &Vec<f64>| -> Vec<f64> {
        engine.units.iter().flat_map(|u| f(u).clone()).collect()
    };
    let (residual, left) = (list(&|u| &u.block.residual), list(&|u| &u.right));
    let size = residual.len();
    let kernel = |i: usize, j: usize| engine.kernel[i.max(j) * size + i.min(j)];
    let product = (0..size).map(|i| (0..size).map(|j| kernel(i, j) * x[j]).sum());
    let product = product.collect();
    let each = size / used;
    for (u, unit) in engine.units.iter_mut().enumerate() {
        unit.right.copy_from_slice(&x[u * each..][..each]);
        unit.pull(learner, &terms);
    }
    let mut pulled = vec![0.0; parameters.len()];
    let config = NaturalConfig {
        momentum: 0.0,
        longest: 1e300,
        ..NaturalConfig::default()
    };
    let _ = engine.advance(
        learner,
        &config,
        (used, 0.0),
        &mut parameters.to_vec(),
        &mut pulled,
    );
    Seen {
        residual,
        left,
        pulled,
        product,
    }
}

#[test]
fn the_jacobian_of_a_rollout_by_its_factors_is_that_of_differences_and_gives_the_kernel() {
    let dataset = dataset();
    for (family, forces) in families() {
        let recorded = Recorded::train(&dataset, &*family);
        let template = template(&dataset, &*family, forces);
        let parameters = template.initialise(4);
        for method in methods(&*family) {
            let config = settings(method);
            let weights = recorded.weights(config.horizon);
            let rows = Rows::new(&config, config.horizon, 2);
            let task = Task {
                recorded,
                config: &config,
                weights: &weights,
                starts: &[],
                rows: &rows,
            };
            let begins = recorded.starts(config.horizon, 2);
            let size = begins.len().next_multiple_of(SEGMENTS) * rows.count();
            let (phi, mut x) = (direction(parameters.len(), 0.7), direction(size, 0.1));
            // What fills a block up weighs nothing.
            x[begins.len() * rows.count()..].fill(0.0);
            template.with_flow(|learner| {
                let look = |parameters: &[f64], phi: &[f64]| {
                    see(learner, &task, &begins, parameters, (phi, &x))
                };
                let seen = look(&parameters, &phi);
                let at = |step| look(&moved(&parameters, &phi, step), &phi).residual;
                let step = 2e-5;
                let [up, down, further, nearer] = [step, -step, 2.0 * step, -2.0 * step].map(at);
                for (at, r) in seen.residual.iter().enumerate() {
                    let near = (up[at] - down[at]) / (2.0 * step);
                    let far = (further[at] - nearer[at]) / (4.0 * step);
                    let difference = (4.0 * near - far) / 3.0;
                    let pushed = r - seen.left[at];
                    assert!(
                        (pushed - difference).abs() < 1e-7 * (1.0 + difference.abs()),
                        "{} {}: {pushed} {difference}",
                        family.name(),
                        method.name()
                    );
                }
                // J (Jᵀ x) = K x.
                let again = look(&parameters, &seen.pulled);
                for (at, k) in seen.product.iter().enumerate() {
                    let through = again.residual[at] - again.left[at];
                    assert!(
                        (through - k).abs() < 1e-9 * (1.0 + k.abs()),
                        "{} {}: {through} {k}",
                        family.name(),
                        method.name()
                    );
                }
            });
        }
    }
}

#[test]
fn free_starts_add_their_own_part_to_the_kernel() {
    let dataset = dataset();
    let (family, forces) = &families()[5];
    let recorded = Recorded::train(&dataset, &**family);
    let template = template(&dataset, &**family, *forces);
    let parameters = template.initialise(4);
    let config = RolloutLoss {
        start: Start::Free,
        ..settings(crate::integrate::Method::Rk4)
    };
    let weights = recorded.weights(config.horizon);
    let rows = Rows::new(&config, config.horizon, 2);
    let states = (0..dataset.train.len() * 4).map(|at| recorded.state(at / 4, at % 4));
    let starts: Vec<f64> = states.collect();
    fn at<'a>(task: &Task<'a>, starts: &'a [f64]) -> Task<'a> {
        Task { starts, ..*task }
    }
    let task = Task {
        recorded,
        config: &config,
        weights: &weights,
        starts: &starts,
        rows: &rows,
    };
    // Two segments have the same start.
    let begins = [0, 3, 6, 14, 3];
    let size = SEGMENTS * rows.count();
    let mut x = direction(size, 0.3);
    x[begins.len() * rows.count()..].fill(0.0);
    let none = vec![0.0; parameters.len()];
    template.with_flow(|learner| {
        let with = see(learner, &task, &begins, &parameters, (&none, &x));
        let mut engine = GaussNewton::new(learner, &config, begins.len());
        let mut moves = Vec::new();
        let mut unit = engine.units.remove(0);
        let mut packed = Packed::new(learner.net());
        let (weights_of, extra) = parameters.split_at(learner.net().parameters);
        packed.set(learner.net(), weights_of);
        let flow = Flow {
            learner,
            packed: &packed,
            extra,
            sizes: unit.block.sizes,
        };
        unit.block.shoot(&flow, &task, &begins);
        unit.block.back(&task, Back::Each);
        unit.right = x.clone();
        engine.units.push(unit);
        // What the starts move by for these weights of the residuals: Cᵀ x; then the change of the residuals: C Cᵀ x.
        engine.move_starts(1, &task, -1.0, &mut moves);
        let mut further = starts.clone();
        let mut nearer = starts.clone();
        for (place, change) in &moves {
            further[*place] += 1e-5 * change;
            nearer[*place] -= 1e-5 * change;
        }
        let residual = |starts: &[f64]| {
            see(
                learner,
                &at(&task, starts),
                &begins,
                &parameters,
                (&none, &x),
            )
            .residual
        };
        let (up, down) = (residual(&further), residual(&nearer));
        let pushed = see(learner, &task, &begins, &parameters, (&with.pulled, &x));
        for (at, k) in with
            .product
            .iter()
            .enumerate()
            .take(begins.len() * rows.count())
        {
            let by_starts = (up[at] - down[at]) / 2e-5;
            let by_weights = pushed.residual[at] - pushed.left[at];
            let sum = by_starts + by_weights;
            assert!((sum - k).abs() < 1e-6 * (1.0 + k.abs()), "{at}: {sum} {k}");
        }
    });
}
