//! Positions and velocities of noisy recordings by local polynomials, so that the noise that they keep is known.

use std::ops::Range;

use faer::linalg::solvers::Solve;
use faer::{Mat, Side};

use crate::dataset::Timeline;
use lagrangian_motion::Coordinates;
use lagrangian_motion::statistics::median_size;

/// The degrees that are tried, and the half widths.
const DEGREES: [usize; 3] = [3, 5, 7];
const WIDTHS: [usize; 10] = [3, 4, 5, 6, 8, 10, 12, 15, 18, 22];
/// The samples from one window that is compared to the next.
const STRIDE: usize = 5;
/// How much steps of time may differ, in parts of them.
const EVEN: f64 = 1e-3;

/// A local polynomial of a coordinate: its coefficients from the samples of a window, `[degree + 1, 2m + 1]`, by time in half widths.
pub(super) struct Polynomial {
    half: usize,
    weights: Mat<f64>,
}

impl Polynomial {
    fn new(half: usize, degree: usize) -> Option<Self> {
        let place = |k: usize| (k as f64 - half as f64) / half as f64;
        let powers = Mat::from_fn(degree + 1, 2 * half + 1, |d, k| place(k).powi(d as i32));
        let weights = (&powers * powers.transpose())
            .llt(Side::Lower)
            .ok()?
            .solve(&powers);
        Some(Self { half, weights })
    }

    /// Whether a run of this length has a window.
    pub(super) fn fits(&self, length: usize) -> bool {
        length > 2 * self.half
    }

    /// The slope at the middle, in samples.
    fn slope(&self) -> Vec<f64> {
        let half = self.half as f64;
        (0..=2 * self.half)
            .map(|k| self.weights[(1, k)] / half)
            .collect()
    }

    /// Value and slope at each sample of these values, which are more than the window.
    pub(super) fn smooth(&self, x: &[f64], step: f64) -> Vec<[f64; 2]> {
        let (m, degree) = (self.half, self.weights.nrows() - 1);
        let at = |t: usize| {
            let middle = t.clamp(m, x.len() - 1 - m);
            let u = (t as f64 - middle as f64) / m as f64;
            let window = &x[middle - m..=middle + m];
            let (mut value, mut slope) = (0.0, 0.0);
            for d in (0..=degree).rev() {
                let c: f64 = window
                    .iter()
                    .enumerate()
                    .map(|(k, x)| self.weights[(d, k)] * x)
                    .sum();
                slope = slope * u + value;
                value = value * u + c;
            }
            [value, slope / (m as f64 * step)]
        };
        (0..x.len()).map(at).collect()
    }

    /// The polynomial whose velocities err least: by noise, and by what one of a higher degree sees beyond noise.
    pub(super) fn best(runs: &[Vec<f64>], noise: f64) -> Option<Self> {
        let shortest = runs.iter().map(Vec::len).min()?;
        let mut best: Option<(f64, Self)> = None;
        for degree in DEGREES {
            for half in WIDTHS
                .into_iter()
                .filter(|m| 2 * m + 1 >= degree + 4 && 2 * m < shortest)
            {
                let own = Self::new(half, degree)?;
                let (slope, finer) = (own.slope(), Self::new(half, degree + 2)?.slope());
                let beyond: Vec<f64> = slope.iter().zip(&finer).map(|(a, b)| a - b).collect();
                let square = |x: &[f64]| x.iter().map(|x| x * x).sum::<f64>();
                let (mut sum, mut count) = (0.0, 0.0);
                for run in runs {
                    for window in run.windows(2 * half + 1).step_by(STRIDE) {
                        let off: f64 = window.iter().zip(&beyond).map(|(x, w)| x * w).sum();
                        (sum, count) = (sum + off * off, count + 1.0);
                    }
                }
                let bent = (sum / count - noise * noise * square(&beyond)).max(0.0);
                let error = bent + noise * noise * square(&slope);
                if best.as_ref().is_none_or(|(least, _)| error < *least) {
                    best = Some((error, own));
                }
            }
        }
        best.map(|(_, own)| own)
    }
}

/// The step of time of all recordings; `None` where it varies.
pub(super) fn even_step(times: &Timeline) -> Option<f64> {
    let steps = || {
        times.runs().flat_map(|run| {
            times.t[run]
                .windows(2)
                .map(|t| t[1] - t[0])
                .collect::<Vec<_>>()
        })
    };
    let step = median_size(&mut steps());
    let even = steps().all(|own| (own - step).abs() <= EVEN * step);
    (even && step > 0.0).then_some(step)
}

/// Values of a coordinate in each run, an angle without turns.
pub(super) fn unwound(
    coordinates: &Coordinates,
    i: usize,
    x: &[f64],
    runs: &[Range<usize>],
) -> Vec<Vec<f64>> {
    let n = coordinates.dof();
    let of_run = |run: &Range<usize>| {
        let mut last = x[run.start * n + i];
        let each = run.clone().map(|s| {
            last += coordinates.difference(i, x[s * n + i], last);
            last
        });
        each.collect()
    };
    runs.iter().map(of_run).collect()
}
