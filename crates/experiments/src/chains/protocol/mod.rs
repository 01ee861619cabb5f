//! Chains of pendulums by the protocol of Finzi, Wang and Wilson 2020 (arXiv 2010.13581), in angles.
//!
//! Point masses on massless rods, m = l = g = 1, samples every 0.1 s. A model learns from chunks of five neighbouring
//! samples, each from a motion of its own, and predicts motions of 10 s. The error compares Cartesian positions and
//! velocities z = (x, v) (theory.md, 113).
//!
//! What is not as in their code, where the state is Cartesian: a disturbed state is brought back onto the rods by least
//! squares in the angles (theory.md, 112), theirs by Newton's method in the Cartesian state. For disturbances that are
//! small against the rods both are the same.

mod cartesian;
mod error;

pub(crate) use cartesian::{cartesian, on_the_rods};
pub(crate) use error::{Score, floor, motions, predictions, score, test_starts};

use crate::chart::{Chart, InChart, in_chart};
use lagrangian::analytic::{NLinkPendulum, Rng, normal};
use lagrangian::mechanics::Mechanical;
use lagrangian::{RolloutOptions, State};

use crate::data::prediction;

/// Time between two samples, s.
pub(crate) const INTERVAL: f64 = 0.1;
/// Samples of a chunk.
pub(crate) const SAMPLES: usize = 5;
/// Samples of a whole motion, from 0 s to 9.9 s.
pub(crate) const STEPS: usize = 100;
/// The distance of the restart that makes the floor, m and m/s.
pub(crate) const RESTART: f64 = 1e-4;

/// The chain with this number of links, in the coordinates of a chart of the absolute angles.
pub(crate) fn chain(links: usize, chart: Chart) -> Mechanical<InChart<NLinkPendulum>> {
    let ones = vec![1.0; links];
    let system = NLinkPendulum {
        masses: ones.clone(),
        lengths: ones,
        gravity: 1.0,
    };
    in_chart(system, chart)
}

/// A start of the protocol, in absolute angles: angles and their rates from N(0, 1), then positions disturbed by
/// 0.2 N(0, 1) and velocities halved and disturbed by 0.4 N(0, 1), back on the rods.
fn sample(links: usize, rng: &mut dyn Rng) -> State {
    let mut deviates = |n: usize| -> Vec<f64> { (0..n).map(|_| normal(rng)).collect() };
    let state = State::new(deviates(links), deviates(links));
    let (mut x, mut v) = cartesian(&state);
    let (dx, dv) = (deviates(2 * links), deviates(2 * links));
    x.iter_mut().zip(dx).for_each(|(x, d)| *x += 0.2 * d);
    v.iter_mut()
        .zip(dv)
        .for_each(|(v, d)| *v = 0.5 * *v + 0.4 * d);
    on_the_rods(&x, &v)
}

/// How motions are integrated, the true ones and the predicted.
pub(crate) fn options() -> RolloutOptions {
    prediction(20_000)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;
    use crate::data::with_estimated_accelerations;

    #[test]
    fn the_floor_is_that_of_the_publication() {
        // 3.6e-5 for one pendulum, 5.9e-5 for two (their table).
        for (links, published) in [(1, 3.6e-5), (2, 5.9e-5)] {
            let starts = test_starts(links, 100, 2).unwrap();
            let truth = chain(links, Chart::Own);
            let truth = predictions(&truth, &Chart::Own, &starts).unwrap();
            let found = floor(links, &starts, &truth, 3).unwrap().error;
            let ratio = found / published;
            assert!((0.5..2.0).contains(&ratio), "{links} links: {found:e}");
        }
    }

    #[test]
    fn the_chain_in_relative_angles_predicts_the_motion_in_absolute_ones() {
        let starts = test_starts(3, 4, 2).unwrap();
        let truth = chain(3, Chart::Own);
        let truth = predictions(&truth, &Chart::Own, &starts).unwrap();
        let relative = chain(3, Chart::Relative);
        let predicted = predictions(&relative, &Chart::Relative, &starts).unwrap();
        assert!(score(&predicted, &Chart::Relative, &truth).error < 1e-6);
    }

    #[test]
    fn accelerations_of_most_chunks_follow_from_their_states() {
        for links in [1, 2, 3, 5] {
            let exact = motions(links, Chart::Own, 100, 7).unwrap();
            let estimated = with_estimated_accelerations(&exact);
            let mut errors = Vec::new();
            for (exact, estimated) in exact.iter().zip(&estimated) {
                let pairs = exact.qdd.iter().zip(&estimated.qdd);
                errors.extend(pairs.map(|(a, b)| (a - b).abs()));
            }
            errors.sort_by(f64::total_cmp);
            let median = errors[errors.len() / 2];
            let worst = errors[errors.len() - 1];
            // One link: all; five: a mass at the end of a whip turns within a sample.
            assert!(median < 3e-4, "{links} links: {median:e}");
            assert!(links > 1 || worst < 1e-4, "{worst:e}");
        }
    }
}
