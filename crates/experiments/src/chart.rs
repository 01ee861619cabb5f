//! Other coordinates for a known system: a Lagrangian composed with a chart is a Lagrangian.
//!
//! With q = f(Q) and q̇ = (∂f/∂Q) Q̇ the motion in the chart is that of L(f(Q), (∂f/∂Q) Q̇) (theory.md, 111): mechanics
//! knows no preferred coordinates, and what a model family makes of that can be measured.

use lagrangian::analytic::{ClosedForm, DualJets, DualNum, System};
use lagrangian::mechanics::{Jets, Lagrangian, Mechanical, SymmetricSolver};
use lagrangian::{Coordinates, State};

/// A change of coordinates q = f(Q) from those of a chart, Q, to those of a system, q.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) enum Chart {
    /// q = Q.
    #[default]
    Own,
    /// q = Q, and all coordinates are lines: for angles of motions that never turn over.
    Lines,
    /// qᵢ = Σ_{j≤i} Qⱼ: angles against the link before, as the encoder of a joint measures them.
    Relative,
    /// q = A Q: rotated, sheared and stretched; the coordinates of the chart are lines.
    Linear(Linear),
    /// qᵢ = Qᵢ + a sin Qᵢ with |a| < 1; the coordinates of the chart are lines.
    Sine(f64),
}

/// A regular matrix A, `[n, n]`, and Aᵀ A.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Linear {
    n: usize,
    matrix: Vec<f64>,
    normal: Vec<f64>,
}

/// Steps for Qᵢ + a sin Qᵢ = qᵢ: as many as halving alone would need.
const NEWTON_STEPS: usize = 60;

impl Chart {
    /// The coordinates of the chart, for a system with these.
    fn coordinates(&self, system: &Coordinates) -> Coordinates {
        match self {
            Self::Lines | Self::Linear(_) | Self::Sine(_) => Coordinates::lines(system.dof()),
            _ => system.clone(),
        }
    }

    /// (q, q̇) of the system at (Q, Q̇) of the chart, over any scalar.
    fn map<D: DualNum<Primitive = f64> + Copy>(&self, q: &[D], qd: &[D]) -> (Vec<D>, Vec<D>) {
        match self {
            Self::Own | Self::Lines => (q.to_vec(), qd.to_vec()),
            Self::Relative => (sums(q), sums(qd)),
            Self::Linear(linear) => (linear.times(q), linear.times(qd)),
            Self::Sine(a) => q
                .iter()
                .zip(qd)
                .map(|(q, qd)| {
                    let (sin, cos) = q.sin_cos();
                    (*q + sin * *a, *qd * (cos * *a + 1.0))
                })
                .unzip(),
        }
    }

    /// The state of the system at a state of the chart.
    pub(crate) fn to_system(&self, state: &State) -> State {
        let (q, qd) = self.map(&state.q, &state.qd);
        State::new(q, qd)
    }

    /// ∂f/∂Q times a velocity or a difference of accelerations, at the configuration Q of the chart.
    pub(crate) fn push(&self, q: &[f64], rate: &[f64]) -> Vec<f64> {
        self.map(q, rate).1
    }

    /// The state of the chart at a state of the system.
    pub(crate) fn to_chart(&self, state: &State) -> State {
        let State { q, qd } = state;
        match self {
            Self::Own | Self::Lines => state.clone(),
            Self::Relative => State::new(differences(q), differences(qd)),
            Self::Linear(linear) => State::new(linear.solve(q), linear.solve(qd)),
            Self::Sine(a) => {
                let own: Vec<f64> = q.iter().map(|q| without_sine(*q, *a)).collect();
                let rates = own.iter().zip(qd).map(|(q, v)| v / (1.0 + a * q.cos()));
                let rates = rates.collect();
                State::new(own, rates)
            }
        }
    }
}

fn sums<D: DualNum<Primitive = f64> + Copy>(x: &[D]) -> Vec<D> {
    let mut sum = D::from(0.0);
    x.iter()
        .map(|x| {
            sum += *x;
            sum
        })
        .collect()
}

fn differences(x: &[f64]) -> Vec<f64> {
    let before = std::iter::once(&0.0).chain(x);
    x.iter().zip(before).map(|(x, before)| x - before).collect()
}

/// Q of Q + a sin Q = q: Newton's method, halving the bracket q ± |a| where it would leave it.
fn without_sine(q: f64, a: f64) -> f64 {
    let (mut low, mut high) = (q - a.abs(), q + a.abs());
    let mut own = q;
    for _ in 0..NEWTON_STEPS {
        let excess = own + a * own.sin() - q;
        if excess > 0.0 {
            high = own;
        } else {
            low = own;
        }
        let next = own - excess / (1.0 + a * own.cos());
        let inside = (low..=high).contains(&next);
        let next = if inside { next } else { 0.5 * (low + high) };
        let step = (next - own).abs();
        own = next;
        if step <= 4.0 * f64::EPSILON * own.abs() {
            break;
        }
    }
    own
}

impl Linear {
    /// A regular matrix, row-major.
    pub(crate) fn new(matrix: Vec<f64>) -> Self {
        let n = matrix.len().isqrt();
        let at = |i: usize, j: usize| matrix[i * n + j];
        let entry = |k: usize| (0..n).map(|i| at(i, k / n) * at(i, k % n)).sum();
        Self {
            normal: (0..n * n).map(entry).collect(),
            n,
            matrix,
        }
    }

    fn times<D: DualNum<Primitive = f64> + Copy>(&self, x: &[D]) -> Vec<D> {
        let rows = self.matrix.chunks_exact(self.n);
        let product = |row: &[f64]| {
            let terms = row.iter().zip(x);
            terms.fold(D::from(0.0), |sum, (a, x)| sum + *x * *a)
        };
        rows.map(product).collect()
    }

    /// A⁻¹ x.
    fn solve(&self, x: &[f64]) -> Vec<f64> {
        let n = self.n;
        let column = |j: usize| (0..n).map(|i| self.matrix[i * n + j] * x[i]).sum();
        let right: Vec<f64> = (0..n).map(column).collect();
        let mut solution = vec![0.0; n];
        let _ = SymmetricSolver::new(n).solve(&self.normal, &right, &mut solution);
        solution
    }
}

/// A known system in the coordinates of a chart.
#[derive(Debug, Clone)]
pub(crate) struct InChart<S> {
    system: S,
    pub(crate) chart: Chart,
    coordinates: Coordinates,
}

/// The model of a known system in the coordinates of a chart.
pub(crate) fn in_chart<S: System>(system: S, chart: Chart) -> Mechanical<InChart<S>> {
    Mechanical::conservative(InChart {
        coordinates: chart.coordinates(&system.coordinates()),
        system,
        chart,
    })
}

impl<S: System> ClosedForm for InChart<S> {
    fn value<D: DualNum<Primitive = f64> + Copy>(&self, q: &[D], qd: &[D]) -> D {
        let (q, qd) = self.chart.map(q, qd);
        self.system.lagrangian(&q, &qd)
    }
}

impl<S: System> Lagrangian for InChart<S> {
    fn coordinates(&self) -> &Coordinates {
        &self.coordinates
    }

    fn jets(&self) -> Box<dyn Jets + '_> {
        Box::new(DualJets::new(self, self.coordinates.dof()))
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use lagrangian::Model;
    use lagrangian::analytic::{Analytic, AnalyticModel, DoublePendulum};
    use lagrangian::rollout::{RolloutOptions, free, rollout, times};

    fn charts() -> Vec<Chart> {
        vec![
            Chart::Own,
            Chart::Lines,
            Chart::Relative,
            Chart::Linear(Linear::new(vec![0.8, -0.6, 0.9, 0.8])),
            Chart::Sine(0.3),
            Chart::Sine(-0.95),
        ]
    }

    #[test]
    fn a_state_goes_into_every_chart_and_comes_back() {
        let system = Analytic::<DoublePendulum>::standard();
        let mut rng = ChaCha8Rng::seed_from_u64(4);
        for chart in charts() {
            for _ in 0..50 {
                let state = AnalyticModel::sample_state(&system, &mut rng);
                let back = chart.to_system(&chart.to_chart(&state));
                let pairs = back.q.iter().zip(&state.q);
                let rates = back.qd.iter().zip(&state.qd);
                for (a, b) in pairs.chain(rates) {
                    assert!((a - b).abs() < 1e-12, "{chart:?}: {a} against {b}");
                }
            }
        }
    }

    #[test]
    fn the_motion_in_a_chart_is_the_motion_of_the_system() {
        let system = Analytic::<DoublePendulum>::standard();
        let start = State::new(vec![1.2, -0.7], vec![0.3, 2.0]);
        let times = times(2.0, 0.5).unwrap();
        let options = RolloutOptions::truth();
        let moved = |model: &dyn Model, start: &State| {
            let motion = rollout(model, &start.q, &start.qd, &times, &free, &options).unwrap();
            let last = motion.trajectory.q.len() - 2;
            let (q, qd) = (&motion.trajectory.q[last..], &motion.trajectory.qd[last..]);
            State::new(q.to_vec(), qd.to_vec())
        };
        let expected = moved(&system, &start);
        for chart in charts() {
            let model = in_chart(system.system().clone(), chart.clone());
            let end = chart.to_system(&moved(&model, &chart.to_chart(&start)));
            for (a, b) in end.q.iter().zip(&expected.q) {
                assert!((a - b).abs() < 1e-9, "{chart:?}: {a} against {b}");
            }
        }
    }
}
