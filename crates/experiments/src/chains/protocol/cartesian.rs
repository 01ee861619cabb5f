//! Between the angles of a chain and the positions of its masses.

use lagrangian::State;
use lagrangian::mechanics::{SymmetricSolver, dot};

/// Gauss–Newton steps at most; a disturbed state needs five or so.
const STEPS: usize = 50;

/// Positions x and velocities v of the masses, m and m/s, `[links, 2]` each: xᵢ = Σ_{j≤i} (sin θⱼ, −cos θⱼ).
pub(crate) fn cartesian(state: &State) -> (Vec<f64>, Vec<f64>) {
    let (mut at, mut rate) = ([0.0; 2], [0.0; 2]);
    let (mut x, mut v) = (Vec::new(), Vec::new());
    for (q, qd) in state.q.iter().zip(&state.qd) {
        let (sin, cos) = q.sin_cos();
        at = [at[0] + sin, at[1] - cos];
        rate = [rate[0] + cos * qd, rate[1] + sin * qd];
        x.extend(at);
        v.extend(rate);
    }
    (x, v)
}

/// The state of the chain nearest to positions and velocities that no chain has, both by least squares
/// (theory.md, 112); the velocities at the angles that were found.
pub(crate) fn on_the_rods(x: &[f64], v: &[f64]) -> State {
    let n = x.len() / 2;
    let mut solver = SymmetricSolver::new(n);
    let mut q = directions(x);
    let still = vec![0.0; n];
    let mut step = vec![0.0; n];
    for _ in 0..STEPS {
        let (found, _) = cartesian(&State::new(q.clone(), still.clone()));
        let apart: Vec<f64> = x.iter().zip(&found).map(|(x, f)| x - f).collect();
        fit(&q, &apart, &mut solver, &mut step);
        q.iter_mut().zip(&step).for_each(|(q, s)| *q += s);
        if step.iter().all(|s| s.abs() < 1e-14) {
            break;
        }
    }
    let mut qd = vec![0.0; n];
    fit(&q, v, &mut solver, &mut qd);
    State::new(q, qd)
}

/// The directions of the rods of disturbed positions.
fn directions(x: &[f64]) -> Vec<f64> {
    let mut before = [0.0; 2];
    let direction = |at: &[f64]| {
        let angle = (at[0] - before[0]).atan2(before[1] - at[1]);
        before = [at[0], at[1]];
        angle
    };
    x.chunks_exact(2).map(direction).collect()
}

/// Rates ω of least ‖J ω − v‖ with J = ∂x/∂θ at the angles `q`.
fn fit(q: &[f64], v: &[f64], solver: &mut SymmetricSolver, rates: &mut [f64]) {
    let n = q.len();
    let columns: Vec<Vec<f64>> = (0..n)
        .map(|j| {
            let unit = (0..n).map(|k| f64::from(u8::from(k == j))).collect();
            cartesian(&State::new(q.to_vec(), unit)).1
        })
        .collect();
    let normal: Vec<f64> = (0..n * n)
        .map(|k| dot(&columns[k / n], &columns[k % n]))
        .collect();
    let right: Vec<f64> = columns.iter().map(|column| dot(column, v)).collect();
    // JᵀJ is the mass matrix of a chain of unit masses: regular.
    let _ = solver.solve(&normal, &right, rates);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_state_of_the_chain_is_the_nearest_to_itself() {
        let state = State::new(vec![0.4, -1.9, 3.0], vec![1.0, -2.0, 0.5]);
        let (x, v) = cartesian(&state);
        let back = on_the_rods(&x, &v);
        for (a, b) in back.q.iter().zip(&state.q) {
            assert!((a - b).abs() < 1e-13);
        }
        for (a, b) in back.qd.iter().zip(&state.qd) {
            assert!((a - b).abs() < 1e-13);
        }
    }

    #[test]
    fn what_a_disturbed_state_is_moved_by_is_perpendicular_to_the_chain() {
        let state = State::new(vec![0.4, -1.9], vec![1.0, -2.0]);
        let (mut x, v) = cartesian(&state);
        let disturbance = [0.1, -0.2, 0.15, 0.05];
        x.iter_mut().zip(disturbance).for_each(|(x, d)| *x += d);
        let nearest = on_the_rods(&x, &v);
        let (found, _) = cartesian(&nearest);
        for j in 0..2 {
            let mut unit = vec![0.0; 2];
            unit[j] = 1.0;
            let (_, tangent) = cartesian(&State::new(nearest.q.clone(), unit));
            let apart: Vec<f64> = x.iter().zip(&found).map(|(a, b)| a - b).collect();
            assert!(dot(&tangent, &apart).abs() < 1e-12);
        }
    }
}
