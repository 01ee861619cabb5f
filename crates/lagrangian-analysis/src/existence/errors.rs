//! Errors of fits on held-out recordings, compared recording by recording.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::Serialize;

use super::field::{accelerations, states};
use lagrangian::{Model, Trajectory};

/// Number of recordings below which they are cut into pieces, so that resampling is possible.
const FEWEST: usize = 8;
/// Limit of errors, as a multiple of the size of the accelerations.
const WORST: f64 = 1e3;
/// Number of resamplings.
const RESAMPLED: usize = 2000;

/// Errors of one fit on held-out recordings.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct HeldOutErrors {
    /// Root mean square error of q̈ over held-out samples and coordinates, each coordinate relative to its root mean
    /// square.
    pub relative: f64,
    /// Mean square of the relative error of each piece, in the order of the held-out recordings.
    pub squares: Vec<f64>,
    /// Error of each coordinate, m/s² or rad/s², `[n]`.
    pub accelerations: Vec<f64>,
}

/// Held-out recordings as pieces: whole, or if there are few, equal parts of each.
pub(super) fn pieces(recordings: &[Trajectory]) -> Vec<Trajectory> {
    let parts = FEWEST.div_ceil(recordings.len().max(1));
    let cut = |r: &Trajectory| -> Vec<Trajectory> {
        let at = |k: usize| r.len() * k / parts;
        let all = (0..parts).map(|k| r.part(at(k)..at(k + 1)));
        all.filter(|piece| !piece.is_empty()).collect()
    };
    recordings.iter().flat_map(cut).collect()
}

impl HeldOutErrors {
    /// Errors of `model` on these pieces; `scale` is the root mean square of each acceleration, `[n]`.
    pub(super) fn of(model: &dyn Model, pieces: &[Trajectory], scale: &[f64]) -> Self {
        let n = scale.len();
        let mut evaluator = model.evaluator();
        let (mut squares, mut sums, mut count) = (Vec::new(), vec![0.0; n], 0);
        for piece in pieces {
            let own = accelerations(&mut *evaluator, &states(piece));
            let mut sum = 0.0;
            for (at, (a, b)) in own.iter().zip(&piece.qdd).enumerate() {
                let square = ((a - b) / scale[at % n]).abs().min(WORST).powi(2);
                sums[at % n] += square;
                sum += square;
            }
            squares.push(sum / own.len() as f64);
            count += piece.len();
        }
        let mean = |sum: &f64| sum / count.max(1) as f64;
        Self {
            relative: (sums.iter().map(mean).sum::<f64>() / n as f64).sqrt(),
            accelerations: (sums.iter().zip(scale))
                .map(|(sum, s)| mean(sum).sqrt() * s)
                .collect(),
            squares,
        }
    }
}

/// Fraction of resamplings of the pieces, with replacement (Efron 1979), for which `holds` is true of the relative errors
/// of the fits, all over the same pieces, so that a difficult piece affects all of them.
pub(super) fn frequency<const FITS: usize>(
    fits: [&HeldOutErrors; FITS],
    holds: impl Fn([f64; FITS]) -> bool,
    seed: u64,
) -> f64 {
    let count = fits[0].squares.len();
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut frequency = 0.0;
    for _ in 0..RESAMPLED {
        let mut sums = [0.0; FITS];
        for _ in 0..count {
            let piece = rng.random_range(0..count);
            for (sum, fit) in sums.iter_mut().zip(fits) {
                *sum += fit.squares[piece];
            }
        }
        if holds(sums.map(|s| (s / count as f64).sqrt())) {
            frequency += 1.0 / RESAMPLED as f64;
        }
    }
    frequency
}

#[cfg(test)]
mod tests {
    use super::*;

    fn held_out(squares: &[f64]) -> HeldOutErrors {
        HeldOutErrors {
            relative: 0.0,
            squares: squares.to_vec(),
            accelerations: Vec::new(),
        }
    }

    #[test]
    fn pieces_that_are_hard_for_all_fits_do_not_blur_which_fit_is_better() {
        let (one, other) = (
            held_out(&[1.0, 100.0, 1.0, 1e4]),
            held_out(&[4.0, 400.0, 4.0, 4e4]),
        );
        let better = frequency([&one, &other], |[a, b]| b > 1.9 * a, 1);
        assert!((better - 1.0).abs() < 1e-9, "{better:?}");
    }

    #[test]
    fn one_piece_of_four_decides_as_often_as_it_is_drawn() {
        let (one, other) = (held_out(&[1.0; 4]), held_out(&[1.0, 1.0, 1.0, 100.0]));
        let better = frequency([&one, &other], |[a, b]| b > 1.5 * a, 1);
        assert!(
            (better - (1.0 - 0.75_f64.powi(4))).abs() < 0.03,
            "{better:?}"
        );
    }
}
