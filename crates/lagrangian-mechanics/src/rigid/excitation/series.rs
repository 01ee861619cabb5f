//! Motions that begin and end at rest: finite Fourier series under an envelope.
//!
//! | symbol | meaning |
//! |---|---|
//! | T, ω | duration; 2π over the longest period |
//! | s(t) | envelope: 0 at both ends with its first two derivatives, 1 in between |
//!
//! ```text
//! q(t) = c + s(t) Σₖ [aₖ sin kωt + bₖ cos kωt]
//! ```
//!
//! Series without an envelope begin with a jump of the velocity, or sacrifice coefficients for conditions at the ends
//! (Swevers, Ganseman, Tükel, De Schutter, Van Brussel, IEEE Trans. Robotics and Automation 13, 1997).

use std::f64::consts::TAU;

use lagrangian_motion::{Signals, Trajectory};

/// The longest period of a series, s.
const LONGEST: f64 = 10.0;
/// Longest rise time from rest, s, and its largest fraction of the duration.
const RISE: (f64, f64) = (2.0, 0.25);

/// Timing of the series of a plan.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Timing {
    pub(super) duration: f64,
    pub(super) harmonics: usize,
}

impl Timing {
    fn periods(self) -> f64 {
        (self.duration / LONGEST).ceil().max(1.0)
    }

    /// kω.
    pub(super) fn frequency(self, k: usize) -> f64 {
        TAU * self.periods() * k as f64 / self.duration
    }

    /// Times from the start to the end, `count` in each period of the fastest wave.
    pub(super) fn times(self, count: usize) -> Vec<f64> {
        let steps = count * self.harmonics * self.periods() as usize;
        (0..=steps)
            .map(|k| self.duration * k as f64 / steps as f64)
            .collect()
    }

    /// s and its first two derivatives: 10x³ − 15x⁴ + 6x⁵ of the time since the start, or to the end, in units of the rise time.
    fn envelope(self, t: f64) -> [f64; 3] {
        let rise = RISE.0.min(RISE.1 * self.duration);
        let (near, sign) = match t < 0.5 * self.duration {
            true => (t, 1.0),
            false => (self.duration - t, -1.0),
        };
        let x = (near / rise).clamp(0.0, 1.0);
        let slope = 30.0 * x * x * (1.0 - x).powi(2) / rise;
        let curvature = 60.0 * x * (1.0 - x) * (1.0 - 2.0 * x) / (rise * rise);
        let value = x.powi(3) * (10.0 - 15.0 * x + 6.0 * x * x);
        [value, sign * slope, curvature]
    }
}

/// Envelope and waves at some times.
pub(super) struct Table {
    envelope: Vec<[f64; 3]>,
    /// sin kωt and cos kωt, `[times, harmonics]`.
    waves: Vec<[f64; 2]>,
    frequencies: Vec<f64>,
}

/// Position, velocity and acceleration.
pub(super) type Moment = [f64; 3];

impl Table {
    pub(super) fn new(timing: Timing, times: &[f64]) -> Self {
        let frequencies: Vec<f64> = (1..=timing.harmonics)
            .map(|k| timing.frequency(k))
            .collect();
        let waves = times.iter().flat_map(|t| {
            let wave = move |f: &f64| {
                let (sine, cosine) = (f * t).sin_cos();
                [sine, cosine]
            };
            frequencies.iter().map(wave)
        });
        Self {
            envelope: times.iter().map(|t| timing.envelope(*t)).collect(),
            waves: waves.collect(),
            frequencies: frequencies.clone(),
        }
    }

    /// Deviation from the centre at each time, for the coefficients [aₖ, bₖ].
    pub(super) fn moments(&self, coefficients: &[[f64; 2]]) -> Vec<Moment> {
        let rows = self.waves.chunks_exact(self.frequencies.len());
        let moment = |(s, row): (&[f64; 3], &[[f64; 2]])| {
            let (mut w, mut wd, mut wdd) = (0.0, 0.0, 0.0);
            for ((f, [sine, cosine]), [a, b]) in self.frequencies.iter().zip(row).zip(coefficients)
            {
                let value = a * sine + b * cosine;
                w += value;
                wd += f * (a * cosine - b * sine);
                wdd -= f * f * value;
            }
            let [s, sd, sdd] = *s;
            [s * w, sd * w + s * wd, sdd * w + 2.0 * sd * wd + s * wdd]
        };
        self.envelope.iter().zip(rows).map(moment).collect()
    }
}

/// The motion of one joint.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Series {
    pub(super) centre: f64,
    /// Coefficients aₖ and bₖ.
    pub(super) coefficients: Vec<[f64; 2]>,
}

/// Motion of all joints at some times, without torques.
pub(super) fn motion(series: &[Series], timing: Timing, times: &[f64]) -> Trajectory {
    let (table, n) = (Table::new(timing, times), series.len());
    let size = times.len() * n;
    let [mut q, mut qd, mut qdd] = [vec![0.0; size], vec![0.0; size], vec![0.0; size]];
    for (i, own) in series.iter().enumerate() {
        for (k, [x, v, a]) in table.moments(&own.coefficients).into_iter().enumerate() {
            (q[k * n + i], qd[k * n + i], qdd[k * n + i]) = (own.centre + x, v, a);
        }
    }
    let signals = Signals {
        q,
        qd,
        qdd,
        ..Signals::default()
    };
    Trajectory::new("plan", times.to_vec(), signals)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn velocities_and_accelerations_are_derivatives_and_the_ends_are_at_rest() {
        let timing = Timing {
            duration: 7.0,
            harmonics: 3,
        };
        let series = Series {
            centre: 0.4,
            coefficients: vec![[0.3, -0.2], [0.1, 0.5], [-0.2, 0.05]],
        };
        let h = 1e-5;
        for t in [0.3, 1.2, 3.4999, 3.5, 5.0, 6.9] {
            let motion = motion(std::slice::from_ref(&series), timing, &[t - h, t, t + h]);
            let slope = |x: &[f64]| (x[2] - x[0]) / (2.0 * h);
            assert!((slope(&motion.q) - motion.qd[1]).abs() < 1e-8);
            assert!((slope(&motion.qd) - motion.qdd[1]).abs() < 1e-7);
        }
        let ends = motion(&[series], timing, &[0.0, 7.0]);
        assert!(ends.q.iter().all(|q| (q - 0.4).abs() < 1e-12));
        assert!(ends.qd.iter().chain(&ends.qdd).all(|x| x.abs() < 1e-12));
    }
}
