//! Triples of neighbouring positions: samples without velocities (theory.md, equation 104).

use lagrangian_motion::Samples;
use lagrangian_motion::{Coordinates, Error, Result, Trajectory};
use lagrangian_recordings::local_polynomial::median_step;

/// A step longer than this multiple of the median one is a gap: no sample crosses it.
const GAP: f64 = 5.0;

/// All neighbours of these trajectories that are `baseline` samples apart; at least one where they are `needed`.
pub(super) fn all(
    coordinates: &Coordinates,
    trajectories: &[Trajectory],
    baseline: usize,
    needed: bool,
) -> Result<Samples> {
    if baseline == 0 {
        return Err(Error::argument(
            "baseline",
            "0",
            "at least 1: the distance of neighbouring positions, in samples",
        ));
    }
    let n = coordinates.dof();
    let mut samples = Samples::empty(n);
    for trajectory in trajectories {
        trajectory.validate()?;
        if !trajectory.is_empty() {
            trajectory.check_dof(n)?;
        }
        add(coordinates, trajectory, baseline, &mut samples);
    }
    if needed && samples.is_empty() {
        let longest = trajectories.iter().map(Trajectory::len).max();
        return Err(Error::too_short(
            "each trajectory, for three neighbouring positions without a gap in time,",
            longest.unwrap_or(0),
            2 * baseline + 1,
        ));
    }
    Ok(samples)
}

fn add(coordinates: &Coordinates, trajectory: &Trajectory, baseline: usize, samples: &mut Samples) {
    let (n, t) = (trajectory.dof(), &trajectory.t);
    if t.len() <= 2 * baseline {
        return;
    }
    let longest = GAP * median_step(t);
    for k in baseline..t.len() - baseline {
        let around = k - baseline..k + baseline + 1;
        if t[around.clone()].windows(2).any(|w| w[1] - w[0] > longest) {
            continue;
        }
        let (before, after) = (t[k] - t[around.start], t[around.end - 1] - t[k]);
        let mean = 0.5 * (before + after);
        for i in 0..n {
            let q = |k: usize| trajectory.q[k * n + i];
            let past = coordinates.difference(i, q(k), q(around.start)) / before;
            let next = coordinates.difference(i, q(around.end - 1), q(k)) / after;
            samples.q.push(q(k));
            samples.qd.push(past);
            samples.qdd.push((next - past) / mean);
            samples.tau.push(mean_force(trajectory, i, around.clone()));
        }
        samples.steps.extend([before, after]);
    }
}

/// The mean of force `i` over the time of these samples, by the trapezoidal rule; 0 where none is recorded.
fn mean_force(trajectory: &Trajectory, i: usize, range: std::ops::Range<usize>) -> f64 {
    let (n, t) = (trajectory.dof(), &trajectory.t);
    let tau = &trajectory.tau;
    if tau.is_empty() {
        return 0.0;
    }
    let pieces = (range.start..range.end - 1).map(|k| {
        let pair = tau[k * n + i] + tau[(k + 1) * n + i];
        0.5 * pair * (t[k + 1] - t[k])
    });
    pieces.sum::<f64>() / (t[range.end - 1] - t[range.start])
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;
    use lagrangian_motion::Signals;

    fn motion(t: Vec<f64>, q: impl Fn(f64) -> f64) -> Trajectory {
        let signals = Signals {
            q: t.iter().map(|&t| q(t)).collect(),
            qd: vec![0.0; t.len()],
            ..Signals::default()
        };
        Trajectory::new("motion", t, signals)
    }

    #[test]
    fn a_constant_acceleration_is_found_exactly_at_uneven_times() {
        let t = vec![0.0, 0.1, 0.25, 0.3, 0.42, 0.5];
        let motion = motion(t, |t| 1.0 - 2.0 * t + 1.5 * t * t);
        for (baseline, count) in [(1, 4), (2, 2)] {
            let lines = Coordinates::lines(1);
            let samples = all(&lines, std::slice::from_ref(&motion), baseline, true).unwrap();
            assert_eq!(samples.len(), count);
            assert!(samples.qdd.iter().all(|a| (a - 3.0).abs() < 1e-12));
        }
    }

    #[test]
    fn an_angle_goes_the_shorter_way_and_no_sample_crosses_a_gap() {
        let mut t: Vec<f64> = (0..20).map(|k| 0.1 * f64::from(k)).collect();
        t.iter_mut().skip(10).for_each(|t| *t += 7.0);
        let wrapped = |t: f64| (3.0 * t).rem_euclid(std::f64::consts::TAU);
        let samples = all(&Coordinates::angles(1), &[motion(t, wrapped)], 1, true).unwrap();
        assert_eq!(samples.len(), 16);
        assert!(samples.qd.iter().all(|v| (v - 3.0).abs() < 1e-9));
    }

    #[test]
    fn two_samples_are_too_few() {
        let motion = motion(vec![0.0, 0.1], f64::sin);
        let error = all(&Coordinates::lines(1), &[motion], 1, true).unwrap_err();
        assert!(error.to_string().contains("has 2 of the 3 samples"));
    }
}
