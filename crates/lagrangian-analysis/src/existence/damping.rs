//! The dissipation of driven motions (theory.md, 85).
//!
//! Forces determine the multiplier: ∂f/∂τ = M⁻¹, so g = M is known, and the condition ġ = −½ (Bᵀg + gB) of a Lagrangian can
//! be checked at single states. Its residual is the symmetric part of ∂d/∂q̇ of a force −d(q, q̇).

use faer::Mat;
use faer::linalg::solvers::DenseSolveCore;
use serde::Serialize;

use super::field::{Field, FieldScale, States};
use lagrangian::{Model, Trajectory};

/// The number of states at which the damping is measured.
const STATES: usize = 200;

/// The damping D = −ġ − ½ (Bᵀg + gB) of a learned field: root mean squares over states, in units of ½ (Bᵀg + gB) and with each
/// coordinate in units of its velocity.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Damping {
    /// The size of D, 0 for a Lagrangian.
    pub whole: f64,
    /// The size of D off its diagonal, 0 for a Lagrangian with friction of its coordinates.
    pub coupled: f64,
    /// The part of `coupled` that errors of learning can explain: the difference, off the diagonal, to the D of a field that
    /// was learned in the same manner from recordings drawn with replacement, over √2.
    pub chance: f64,
    /// The mean of D, N·s/m or N·m·s/rad, `[n, n]`.
    pub mean: Vec<f64>,
}

/// The damping of the first of two models at recorded states, and its difference to the other's.
pub(super) fn damping(
    models: [&dyn Model; 2],
    recordings: &[Trajectory],
    scale: &FieldScale,
    tau_scale: &[f64],
) -> Option<Damping> {
    let states = thinned(recordings);
    let [own, other] = models.map(|model| Dampings::of(model, &states, scale, tau_scale));
    let (own, other) = (own?, other?);
    let n = scale.q.len();
    let off_diagonal = |at: usize| f64::from(u8::from(at / n % n != at % n));
    let off = |at: usize| off_diagonal(at) * own.d[at];
    let apart = |at: usize| off_diagonal(at) * (own.d[at] - other.d[at]) / 2.0_f64.sqrt();
    let size = |of: &dyn Fn(usize) -> f64| (0..own.d.len()).map(|at| of(at).powi(2)).sum::<f64>();
    let unit = size(&|at| own.turning[at]).max(f64::MIN_POSITIVE);
    let part = |of: &dyn Fn(usize) -> f64| (size(of) / unit).sqrt();
    let count = (own.d.len() / (n * n)) as f64;
    let mut mean = vec![0.0; n * n];
    for (at, d) in own.d.iter().enumerate() {
        let (i, j) = (at / n % n, at % n);
        mean[i * n + j] += d / (count * scale.qd[i] * scale.qd[j]);
    }
    Some(Damping {
        whole: part(&|at| own.d[at]),
        coupled: part(&off),
        chance: part(&apart),
        mean,
    })
}

/// D and ½ (Bᵀg + gB) at each state, `[m, n, n]`, coordinates in units of their velocities.
struct Dampings {
    d: Vec<f64>,
    turning: Vec<f64>,
}

impl Dampings {
    fn of(
        model: &dyn Model,
        states: &[Vec<f64>; 3],
        scale: &FieldScale,
        tau_scale: &[f64],
    ) -> Option<Self> {
        let (n, [q, qd, tau]) = (scale.q.len(), states);
        let mut field = Field::new(model, scale);
        let at = States { q, qd, tau };
        let b = field.jacobians(at).by_qd;
        let (before, here, after, h) =
            field.along(at, |field, at| multipliers(n, &field.by_tau(at, tau_scale)));
        let (before, here, after) = (before?, here?, after?);
        let (mut d, mut turning) = (Vec::new(), Vec::new());
        for at in 0..b.len() {
            let (s, i, j) = (at / (n * n) * n * n, at / n % n, at % n);
            let sum: f64 = (0..n)
                .map(|k| {
                    b[s + k * n + i] * here[s + k * n + j] + here[s + i * n + k] * b[s + k * n + j]
                })
                .sum();
            let unit = scale.qd[i] * scale.qd[j];
            let rate = (after[at] - before[at]) / (2.0 * h);
            d.push(-unit * (rate + 0.5 * sum));
            turning.push(0.5 * unit * sum);
        }
        d.iter()
            .all(|x| x.is_finite())
            .then_some(Self { d, turning })
    }
}

/// g = (∂f/∂τ)⁻¹, its symmetric part, at each state; `None` where one is singular.
fn multipliers(n: usize, by_tau: &[f64]) -> Option<Vec<f64>> {
    let mut all = Vec::with_capacity(by_tau.len());
    for inverse in by_tau.chunks_exact(n * n) {
        let g = Mat::from_fn(n, n, |i, j| inverse[i * n + j])
            .partial_piv_lu()
            .inverse();
        for at in 0..n * n {
            all.push(0.5 * (g[(at / n, at % n)] + g[(at % n, at / n)]));
        }
    }
    all.iter().all(|x: &f64| x.is_finite()).then_some(all)
}

/// q, q̇ and τ at evenly chosen states.
fn thinned(recordings: &[Trajectory]) -> [Vec<f64>; 3] {
    let samples: usize = recordings.iter().map(Trajectory::len).sum();
    let every = (samples / STATES).max(1);
    let [mut q, mut qd, mut tau] = [const { Vec::new() }; 3];
    let rows = recordings.iter();
    let rows = rows.flat_map(|r| (0..r.len()).map(move |k| r.row(k)));
    for row in rows.step_by(every) {
        q.extend_from_slice(row.q);
        qd.extend_from_slice(row.qd);
        tau.extend_from_slice(row.tau);
        tau.resize(q.len(), 0.0);
    }
    [q, qd, tau]
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;
    use lagrangian::analytic::by_name;
    use lagrangian::rollout::{sines, times};
    use lagrangian::{Dissipation, Mechanical, RolloutOptions, rollout};

    #[test]
    fn the_damping_that_is_seen_is_the_friction_of_the_joints_whatever_the_mass_matrix_does() {
        let arm = by_name("two-link-arm", &[]).unwrap();
        let friction = Dissipation::viscous(vec![0.3, 0.1]);
        let damped = Mechanical::dissipative(arm.lagrangian(), friction).unwrap();
        let scale = FieldScale {
            q: vec![1.0; 2],
            qd: vec![2.0, 1.0],
            time: 0.5,
        };
        let driven = |seed| {
            let (clock, options) = (times(3.0, 0.02).unwrap(), RolloutOptions::truth());
            let drive = sines(2, 4.0, seed);
            let motion = rollout(&damped, &[0.4, -0.8], &[0.0; 2], &clock, &drive, &options);
            motion.unwrap().trajectory
        };
        let recordings = [driven(1), driven(2)];
        let of = |model: &dyn Model| damping([model; 2], &recordings, &scale, &[1.0; 2]).unwrap();
        let found = of(&damped);
        let truth = [0.3, 0.0, 0.0, 0.1];
        assert!(
            found
                .mean
                .iter()
                .zip(truth)
                .all(|(d, b)| (d - b).abs() < 1e-5),
            "{found:?}"
        );
        assert!(found.coupled < 1e-5 && found.whole > 1e-3, "{found:?}");
        let none = of(&*arm);
        assert!(none.whole < 1e-5, "{none:?}");
    }
}
