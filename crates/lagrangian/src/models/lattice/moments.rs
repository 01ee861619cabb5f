//! Stretches of motion as integrals: ∫ q ẅ dt is that of q̈ w, so that no velocity is needed.

use lagrangian_motion::parallel::prelude::*;

use crate::dataset::Dataset;
use crate::models::formula::{Stretch, WINDOW, Weight, positions, stretches};
use lagrangian_motion::Coordinates;
use lagrangian_motion::solve::dot;

/// A stretch of all sites.
pub(crate) struct Moments {
    /// q at each sample, `[samples, n]`, without jumps of whole turns.
    pub(crate) q: Vec<f64>,
    /// ∫ q w, ∫ q̇ w, ∫ q̈ w and ∫ τ w of each site.
    pub(crate) place: Vec<f64>,
    pub(crate) rate: Vec<f64>,
    pub(crate) acceleration: Vec<f64>,
    pub(crate) force: Vec<f64>,
    /// w and ẅ at each sample, times the step.
    pub(crate) weights: Vec<f64>,
    pub(super) curvatures: Vec<f64>,
    /// The mean square of ∫ q̈ w that the noise of the positions alone makes.
    pub(crate) noise: f64,
    /// Whether it is held out.
    pub(crate) held: bool,
}

impl Moments {
    /// ∫ sin(qⱼ − qᵢ) w, and ∫ sin qᵢ w for a site itself.
    pub(super) fn sine(&self, i: usize, j: usize) -> f64 {
        let n = self.place.len();
        let each = self.q.chunks_exact(n).zip(&self.weights);
        let angle = |q: &[f64]| if i == j { q[i] } else { q[j] - q[i] };
        each.map(|(q, w)| w * angle(q).sin()).sum()
    }
}

/// The orders of differences that tell noise from motion.
const LOWEST: usize = 4;
const HIGHEST: usize = 12;

/// The stretches of so many samples of a dataset, `most` at most.
pub(crate) fn moments(dataset: &Dataset, most: usize, window: usize) -> Vec<Moments> {
    let all = stretches(dataset, most, window);
    all.par_iter()
        .map(|own| Moments::of(&dataset.coordinates, own))
        .collect()
}

/// Lengths of stretches beside the shortest, in its units, and how much clearer beside their noise accelerations are where one is taken.
const LENGTHS: [usize; 3] = [2, 4, 8];
const CLEARER: f64 = 2.0;

/// The stretches of the length, a multiple of [`WINDOW`], whose accelerations are clearest beside their noise, of those of which there are `fewest`.
pub(crate) fn clearest(fewest: usize, of: &dyn Fn(usize) -> Vec<Moments>) -> Vec<Moments> {
    let clear = |all: &[Moments]| {
        let square = |own: &Moments| dot(&own.acceleration, &own.acceleration);
        let noise: f64 = all.iter().map(|own| own.noise).sum();
        all.iter().map(square).sum::<f64>() / noise.max(f64::MIN_POSITIVE)
    };
    let mut best = of(WINDOW);
    for times in LENGTHS {
        let own = of(times * WINDOW);
        if own.len() >= fewest && clear(&own) > CLEARER * clear(&best) {
            best = own;
        }
    }
    best
}

impl Moments {
    fn of(coordinates: &Coordinates, stretch: &Stretch<'_>) -> Self {
        let n = coordinates.dof();
        let samples = stretch.range.start * n..stretch.range.end * n;
        let mut q = positions(stretch.samples, stretch.times)[samples.clone()].to_vec();
        if n > 0 && coordinates.is_circle(0) {
            unwind(coordinates, &mut q, n);
        }
        let weights = stretch.weights();
        let integral = |x: &[f64], of: fn(&Weight) -> f64| {
            let mut sums = vec![0.0; n];
            for (row, w) in x.chunks_exact(n.max(1)).zip(&weights) {
                let first = &x[..n];
                let each = sums.iter_mut().zip(row.iter().zip(first));
                each.for_each(|(sum, (x, origin))| *sum += of(w) * (x - origin));
            }
            sums
        };
        let rate = integral(&q, |w| -w.rate);
        let acceleration = integral(&q, |w| w.curvature);
        let whole: f64 = weights.iter().map(|w| w.value).sum();
        let mut place = integral(&q, |w| w.value);
        let each = place.iter_mut().zip(&q[..n]);
        each.for_each(|(place, origin)| *place += whole * origin);
        let tau = &stretch.samples.tau[samples];
        let mut force = integral(tau, |w| w.value);
        let each = force.iter_mut().zip(&tau[..n]);
        each.for_each(|(force, origin)| *force += whole * origin);
        Self {
            place,
            rate,
            acceleration,
            force,
            noise: noise(&q, n) * weights.iter().map(|w| w.curvature.powi(2)).sum::<f64>(),
            curvatures: weights.iter().map(|w| w.curvature).collect(),
            weights: weights.into_iter().map(|w| w.value).collect(),
            q,
            held: stretch.held,
        }
    }
}

/// The mean variance of the noise, by the differences of the order that leaves least of the motion.
fn noise(q: &[f64], n: usize) -> f64 {
    let mut rows = q.to_vec();
    let mut least = f64::INFINITY;
    for order in 1..=HIGHEST {
        let fewer = rows.len() - n;
        for k in 0..fewer {
            rows[k] = rows[k + n] - rows[k];
        }
        rows.truncate(fewer);
        if order >= LOWEST {
            // The squares of the coefficients of order d add up to (2d)! / d!².
            let sum: f64 = (1..=order).map(|k| (order + k) as f64 / k as f64).product();
            let square: f64 = rows.iter().map(|x| x * x).sum();
            least = least.min(square / fewer.max(1) as f64 / sum);
        }
    }
    least
}

/// Takes whole turns out of angles: from one sample to the next, and at first from one site to the next.
fn unwind(coordinates: &Coordinates, q: &mut [f64], n: usize) {
    for i in 1..n {
        q[i] = q[i - 1] + coordinates.difference(i, q[i], q[i - 1]);
    }
    for k in n..q.len() {
        q[k] = q[k - n] + coordinates.difference(k % n, q[k], q[k - n]);
    }
}
