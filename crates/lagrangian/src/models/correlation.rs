//! The number of independent residuals that a motion holds (theory.md, 16).
//!
//! The residuals of a recorded motion come from friction, play and filters: neighbours in time are nearly equal, so
//! that N of them hold as much information as N/κ independent ones, with κ the sum of the autocorrelations ρ at all lags (Bayley,
//! Hammersley, J. Royal Statistical Society, Supplement 8, 1946). ρ is summed until it first is negative: later lags are
//! noise of the estimate (Geyer, Statistical Science 7, 1992).

use std::ops::Range;

use crate::dataset::{Dataset, Timeline};
use lagrangian_mechanics::dynamics::Model;
use lagrangian_motion::Samples;

/// κ of the torque residuals of each joint, `[n]`; 1 for samples without motions.
pub(crate) fn correlations(dataset: &Dataset, model: &dyn Model) -> Vec<f64> {
    let n = dataset.coordinates.dof();
    let parts = [
        (&dataset.train, &dataset.train_times),
        (&dataset.validation, &dataset.validation_times),
    ];
    let mut residuals = Vec::new();
    let mut runs = Vec::new();
    for (samples, times) in parts {
        let first = residuals.len() / n.max(1);
        runs.extend(of(times).map(|run| first + run.start..first + run.end));
        residuals.extend(torque_errors(model, samples));
    }
    let joint = |j: usize| {
        let own: Vec<f64> = residuals.iter().skip(j).step_by(n).copied().collect();
        correlation(&own, &runs)
    };
    (0..n).map(joint).collect()
}

fn of(times: &Timeline) -> impl Iterator<Item = Range<usize>> + '_ {
    times.runs().filter(|_| !times.t.is_empty())
}

fn torque_errors(model: &dyn Model, samples: &Samples) -> Vec<f64> {
    let mut errors = vec![0.0; samples.tau.len()];
    let (q, qd, qdd) = (&samples.q, &samples.qd, &samples.qdd);
    let _ = model.evaluator().inverse_dynamics(q, qd, qdd, &mut errors);
    errors
        .iter_mut()
        .zip(&samples.tau)
        .for_each(|(e, tau)| *e -= tau);
    errors
}

/// κ of a series whose parts are successive in time, at least 1. Lags far apart are interpolated linearly.
pub(crate) fn correlation(series: &[f64], runs: &[Range<usize>]) -> f64 {
    let runs: Vec<&[f64]> = runs
        .iter()
        .filter_map(|run| series.get(run.clone()))
        .collect();
    let longest = runs.iter().map(|run| run.len()).max().unwrap_or(0);
    let variance = product_at(&runs, 0);
    if !(variance > 0.0 && variance.is_finite()) {
        return 1.0;
    }
    let (mut lag, mut before, mut sum) = (0, 1.0, 1.0);
    while before > 0.0 {
        let step = 1 + lag / 4;
        if lag + step > longest / 2 {
            break;
        }
        let next = product_at(&runs, lag + step) / variance;
        let between = |k: usize| before + (next - before) * k as f64 / step as f64;
        sum += (1..=step).map(|k| 2.0 * between(k).max(0.0)).sum::<f64>();
        (lag, before) = (lag + step, next);
    }
    sum
}

/// The mean of rₜ rₜ₊ₗ.
fn product_at(runs: &[&[f64]], lag: usize) -> f64 {
    let (mut sum, mut count) = (0.0, 0_usize);
    for run in runs.iter().filter(|run| run.len() > lag) {
        sum += run.iter().zip(&run[lag..]).map(|(a, b)| a * b).sum::<f64>();
        count += run.len() - lag;
    }
    sum / count.max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};

    /// A series rₜ₊₁ = a rₜ + noise, for which κ = (1 + a)/(1 − a).
    fn series(a: f64, length: usize) -> Vec<f64> {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(3);
        let mut r = 0.0;
        let mut next = || {
            r = a * r + rng.random_range(-1.0..1.0);
            r
        };
        (0..length).map(|_| next()).collect()
    }

    #[test]
    fn a_series_of_known_memory_has_the_known_number_of_independent_values() {
        for (a, expected) in [(0.0, 1.0), (0.5, 3.0), (0.9, 19.0), (0.98, 99.0)] {
            let series = series(a, 40_000);
            let runs = [0..15_000, 15_000..40_000];
            let found = correlation(&series, &runs);
            assert!(
                (found / expected - 1.0).abs() < 0.2,
                "{a}: {found} {expected}"
            );
        }
    }

    #[test]
    fn samples_without_time_and_series_without_variance_count_as_independent() {
        assert_eq!(
            correlation(&series(0.9, 100), &[]).to_bits(),
            1.0_f64.to_bits()
        );
        assert_eq!(
            correlation(&[0.0; 50], &[0..20, 20..50]).to_bits(),
            1.0_f64.to_bits()
        );
        assert_eq!(correlation(&[], &[]).to_bits(), 1.0_f64.to_bits());
    }
}
