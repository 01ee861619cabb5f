//! The start of the fit: inertias and gains by a linear regression on derivatives.

use super::motion::Recorded;
use super::parameters::Joint;
use lagrangian_motion::solve::quadratic::Quadratic;

/// Below this speed, rad/s, dry friction hides the motion's equation.
const SLOW: f64 = 0.3;
/// The number of coefficients: inertia, gain, viscous and dry friction.
const TERMS: usize = 4;

/// Inertia and gain of each joint, as if it moved alone: J q̈ + sin θ = a kₚ V (goal − q) − b q̇ − c sgn q̇, in units of the weight's
/// moment. A gain that saturates comes out too small, which the fit corrects.
pub(crate) fn joints(motions: &[&Recorded], n: usize) -> Vec<Joint> {
    (0..n).map(|i| joint(motions, i)).collect()
}

fn joint(motions: &[&Recorded], i: usize) -> Joint {
    let mut sums = Quadratic::zero(TERMS);
    let (mut supply, mut count, mut drives) = (0.0, 0.0_f64, 0.0);
    for (motion, k) in motions
        .iter()
        .flat_map(|m| (0..m.len()).map(move |k| (*m, k)))
    {
        let n = motion.n;
        let [q, qd, qdd] = [0, 1, 2].map(|s| motion.smooth[s][k * n + i]);
        let command = motion.input.at(k)[i];
        supply += command.supply;
        count += 1.0;
        if qd.abs() < SLOW {
            continue;
        }
        let wanted = command.kp * (command.goal - q) - command.kd * qd;
        let driven = if command.on {
            command.supply * wanted
        } else {
            0.0
        };
        drives += f64::abs(driven);
        let absolute: f64 = motion.smooth[0][k * n..=k * n + i].iter().sum();
        sums.add_row(&[qdd, -driven, qd, qd.signum()], -absolute.sin());
    }
    for a in 0..TERMS {
        sums.gram[a * TERMS + a] *= 1.0 + 1e-6;
    }
    let solution = sums.solution();
    let supply = supply / count.max(1.0);
    let (inertia, gain) = (solution[0], solution[1]);
    let usual = Joint::default();
    // A gain at which the mean error requires the weight's moment.
    let plausible = count.max(1.0) / drives.max(1e-9);
    Joint {
        inertia: if inertia > 1e-4 && inertia < 10.0 {
            inertia
        } else {
            usual.inertia
        },
        gain: if gain > 1e-3 * plausible {
            gain
        } else {
            plausible
        },
        supply,
    }
}
