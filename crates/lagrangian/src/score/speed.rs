//! Accelerations that fall with the speed, as they do near a limit that is never reached.

use lagrangian_motion::Signal;
use lagrangian_motion::statistics::upper_median;
use lagrangian_motion::{Coordinates, Trajectory};

/// The largest number of states that are compared.
const STATES: usize = 2000;
/// Parts of the highest speed above which a state is fast, and below which it is slow.
const FAST: f64 = 0.8;
const SLOW: f64 = 0.4;
/// Two states are at one place if their coordinates differ by at most this part of their deviations.
const PLACE: f64 = 0.3;
/// The smallest number of fast states of each direction.
const FEWEST: usize = 10;
/// The ratio of accelerations of fast states to those of slow ones below which a limit is likely.
const WEAK: f64 = 0.5;

/// The acceleration of fast free states over that of slow ones at the same place, where it is less than half, for motion that is
/// sped up and slowed down alike: as if the inertia grew with the speed. Friction does so in one direction only.
pub(super) fn weakened(coordinates: &Coordinates, motions: &[Trajectory]) -> Option<f64> {
    let states = States::of(coordinates, motions)?;
    let (slow, fast): (Vec<usize>, Vec<usize>) = (0..states.speed.len())
        .filter(|&k| states.speed[k] > FAST || states.speed[k] < SLOW)
        .partition(|&k| states.speed[k] < SLOW);
    let (mut forwards, mut backwards) = (Vec::new(), Vec::new());
    for &k in &fast {
        let near = |j: &usize| (*j, states.apart(coordinates, k, *j));
        let nearest = slow.iter().map(near).min_by(|a, b| a.1.total_cmp(&b.1));
        let Some((j, _)) = nearest.filter(|(_, apart)| *apart < PLACE) else {
            continue;
        };
        let ratio = states.acceleration[k] / states.acceleration[j];
        match states.speeds_up[k] {
            true => forwards.push(ratio),
            false => backwards.push(ratio),
        }
    }
    if forwards.len().min(backwards.len()) < FEWEST {
        return None;
    }
    let ratio = upper_median(&mut forwards).max(upper_median(&mut backwards));
    (ratio < WEAK).then_some(ratio)
}

/// Some states of free motions, each signal in its own deviations.
struct States {
    /// Coordinates, `[m, n]`.
    q: Vec<f64>,
    /// Their deviations, `[n]`.
    scale: Vec<f64>,
    /// The largest |q̇| of the coordinates over the largest of all, `[m]`.
    speed: Vec<f64>,
    /// |q̈|, `[m]`.
    acceleration: Vec<f64>,
    /// Whether q̇·q̈ is positive, `[m]`.
    speeds_up: Vec<bool>,
}

impl States {
    fn of(coordinates: &Coordinates, motions: &[Trajectory]) -> Option<Self> {
        let free =
            |m: &&Trajectory| m.values(Signal::Qdd).is_some() && m.tau.iter().all(|&x| x == 0.0);
        let motions: Vec<&Trajectory> = motions.iter().filter(free).collect();
        let rows = || motions.iter().flat_map(|m| (0..m.len()).map(|k| m.row(k)));
        let stride = rows().count().div_ceil(STATES).max(1);
        let n = coordinates.dof();
        let q: Vec<f64> = rows().step_by(stride).flat_map(|r| r.q.to_vec()).collect();
        let size = |v: &[f64]| v.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
        let speeds: Vec<f64> = rows().step_by(stride).map(|r| size(r.qd)).collect();
        let highest = size(&speeds);
        let norm = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
        let power = |v: &[f64], a: &[f64]| v.iter().zip(a).map(|(v, a)| v * a).sum::<f64>();
        (highest > 0.0).then(|| Self {
            scale: lagrangian_motion::statistics::variances(&q, n)
                .iter()
                .map(|v| v.sqrt())
                .collect(),
            q,
            speed: speeds.iter().map(|s| s / highest).collect(),
            acceleration: rows().step_by(stride).map(|r| norm(r.qdd)).collect(),
            speeds_up: rows()
                .step_by(stride)
                .map(|r| power(r.qd, r.qdd) > 0.0)
                .collect(),
        })
    }

    /// The largest difference of the coordinates of two states, in deviations; on the circle for angles.
    fn apart(&self, coordinates: &Coordinates, k: usize, j: usize) -> f64 {
        let n = coordinates.dof();
        let apart = |i: usize| {
            let d = coordinates.difference(i, self.q[k * n + i], self.q[j * n + i]);
            // Two equal parameters are no distance apart, whatever their deviation.
            if d == 0.0 {
                0.0
            } else {
                d.abs() / self.scale[i]
            }
        };
        (0..n).map(apart).fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;
    use lagrangian_mechanics::analytic::by_name;
    use lagrangian_mechanics::rollout::{Force, RolloutOptions, free, rollout, times};

    /// The result for free motions of a system, from starts with these velocities.
    fn found(system: &str, starts: impl Iterator<Item = f64>, force: &Force<'_>) -> Option<f64> {
        let field: &[(&str, f64)] = match system {
            "relativistic-particle" => &[("field", 1.0)],
            _ => &[],
        };
        let model = by_name(system, field).unwrap();
        let n = model.coordinates().dof();
        let clock = times(2.0, 0.02).unwrap();
        let motion = |v: f64| {
            let (q0, qd0) = (vec![-v; n], vec![v; n]);
            let options = RolloutOptions::default();
            let mut motion = rollout(&*model, &q0, &qd0, &clock, force, &options)
                .unwrap()
                .trajectory;
            motion.signals.tau.clear();
            motion
        };
        let motions: Vec<Trajectory> = starts.map(motion).collect();
        weakened(model.coordinates(), &motions)
    }

    #[test]
    fn accelerations_fall_with_the_speed_near_its_limit_and_nowhere_else() {
        let starts = || (-9..=9).map(f64::from);
        let near = found("relativistic-particle", starts().map(|k| 0.1 * k), &free);
        assert!(near.is_some_and(|ratio| ratio < 0.4), "{near:?}");
        for system in ["pendulum", "double-pendulum", "cart-pole", "mass-spring"] {
            let found = found(system, starts().map(|k| 0.4 * k), &free);
            assert_eq!(found, None, "{system}");
        }
        let brake = |_: f64, _: &[f64], qd: &[f64], tau: &mut [f64]| tau[0] = -0.8 * qd[0];
        assert_eq!(found("pendulum", starts().map(|k| 0.4 * k), &brake), None);
    }
}
