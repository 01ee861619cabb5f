//! The largest Lyapunov exponent of a motion.

use lagrangian::integrate::{Control, Dop853, Ending, Span, adaptive};
use lagrangian::rollout::free;
use lagrangian::{Error, Evaluator, Model, Result, RolloutOptions, State, rollout};

/// Distance of the neighbour in the state space, in SI units.
const SEPARATION: f64 = 1e-8;
/// Number of times that the neighbour is brought back in a run.
const RESTARTS: usize = 400;
/// Logarithm of the growth in the second half of a run that shows chaos, e³ = 20 times: in regular motion the
/// distance grows like t, so that it doubles.
const CHAOTIC_GROWTH: f64 = 3.0;

/// Largest Lyapunov exponent of one motion, estimated from a run of finite length.
#[derive(Debug, Clone, PartialEq)]
pub struct Lyapunov {
    /// Mean rate λ at which a neighbour moves away, 1/s.
    pub exponent: f64,
    /// Whether neighbours separate exponentially, judged by the growth in the second half of the run; neighbours in regular
    /// motion separate linearly in time.
    pub chaotic: bool,
}

impl Lyapunov {
    /// Lyapunov time 1/λ, s, of a chaotic motion.
    #[must_use]
    pub fn time(&self) -> Option<f64> {
        self.chaotic.then(|| 1.0 / self.exponent)
    }
}

/// Largest Lyapunov exponent of the free motion from `start`, by Benettin's method: a neighbour 10⁻⁸ away
/// is simulated in parallel and is brought back to that distance along its direction 400 times,
///
///   λ = 1/T Σ ln(dₖ/d₀)
///
/// (Benettin, Galgani, Giorgilli, Strelcyn, Meccanica 15, 1980). Both are integrated as one system, so that both take
/// equal steps; `options` gives the tolerances of the 8th-order method.
///
/// # Errors
/// As [`rollout()`]; [`Error::Argument`] where the duration is not positive.
pub fn largest_lyapunov_exponent(
    model: &dyn Model,
    start: &State,
    duration: f64,
    options: &RolloutOptions,
) -> Result<Lyapunov> {
    if !(duration.is_finite() && duration > 0.0) {
        let must = "a finite number of seconds above 0";
        return Err(Error::argument("duration", duration, must));
    }
    // Runs the checks of a rollout, which are those needed here.
    rollout(model, &start.q, &start.qd, &[0.0], &free, options)?;
    let mut pair = Pair::new(model, start, options.control());
    let interval = duration / RESTARTS as f64;
    let mut growth = Vec::new();
    while growth.len() < RESTARTS
        && let Some(distance) = pair.run(interval)
    {
        growth.push((distance / SEPARATION).ln());
        pair.restart(distance);
    }
    let time = interval * growth.len().max(1) as f64;
    Ok(Lyapunov {
        exponent: growth.iter().sum::<f64>() / time,
        chaotic: growth.len() == RESTARTS
            && growth[RESTARTS / 2..].iter().sum::<f64>() > CHAOTIC_GROWTH,
    })
}

/// A motion and its neighbour as one state: (q, q' of both; q̇, q̇' of both).
struct Pair<'a> {
    evaluator: Box<dyn Evaluator + 'a>,
    x: Vec<f64>,
    n: usize,
    control: Control,
}

impl<'a> Pair<'a> {
    fn new(model: &'a dyn Model, start: &State, control: Control) -> Self {
        let n = start.q.len();
        let mut x = [&start.q[..], &start.q, &start.qd, &start.qd].concat();
        // A direction without symmetry: not along any eigenvector.
        let direction = |i: usize| 1.0 + 0.618 * i as f64;
        let norm = (0..2 * n).map(|i| direction(i).powi(2)).sum::<f64>().sqrt();
        for i in 0..n {
            x[n + i] += SEPARATION * direction(i) / norm;
            x[3 * n + i] += SEPARATION * direction(n + i) / norm;
        }
        Self {
            evaluator: model.evaluator(),
            x,
            n,
            control,
        }
    }

    /// Runs both over an interval; returns their distance at its end, or `None` where a motion ends early.
    fn run(&mut self, interval: f64) -> Option<f64> {
        let both = 2 * self.n;
        let still = vec![0.0; both];
        let (evaluator, x0) = (&mut self.evaluator, self.x.clone());
        let mut f = |_: f64, x: &[f64], dx: &mut [f64]| {
            let ((q, qd), (dq, dqd)) = (x.split_at(both), dx.split_at_mut(both));
            dq.copy_from_slice(qd);
            let _ = evaluator.forward_dynamics(q, qd, &still, dqd);
        };
        let (x, control) = (&mut self.x, self.control);
        let mut sink = |k: usize, state: &[f64]| {
            if k == 1 {
                x.copy_from_slice(state);
            }
        };
        let times = [0.0, interval];
        let span = Span::new(&x0, &times, &control);
        let solution = adaptive::solve::<Dop853>(&mut f, span, &mut sink);
        // The step limit is that of the whole run.
        self.control.max_steps -= solution.steps + solution.rejected;
        let distance = self
            .differences()
            .map(|(i, j)| (self.x[j] - self.x[i]).powi(2))
            .sum::<f64>()
            .sqrt();
        (solution.ending == Ending::Finished && distance > 0.0).then_some(distance)
    }

    fn restart(&mut self, distance: f64) {
        for (i, j) in self.differences() {
            self.x[j] = self.x[i] + (self.x[j] - self.x[i]) * SEPARATION / distance;
        }
    }

    /// Indices of each component and of the neighbour's component.
    fn differences(&self) -> impl Iterator<Item = (usize, usize)> + use<> {
        let n = self.n;
        (0..n).chain(2 * n..3 * n).map(move |i| (i, i + n))
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;
    use lagrangian::analytic::by_name;

    #[test]
    fn the_double_pendulum_is_chaotic_where_it_falls_and_regular_where_it_swings_gently() {
        let model = by_name("double-pendulum", &[]).unwrap();
        let options = RolloutOptions {
            rtol: 1e-12,
            atol: 1e-12,
            ..RolloutOptions::default()
        };
        let chaotic = State::new(vec![2.0, 2.5], vec![0.0, 0.1]);
        let estimate = largest_lyapunov_exponent(&*model, &chaotic, 200.0, &options).unwrap();
        assert!(estimate.chaotic);
        assert!(
            (0.3..3.0).contains(&estimate.exponent),
            "{}",
            estimate.exponent
        );
        assert!((estimate.time().unwrap() * estimate.exponent - 1.0).abs() < 1e-12);
        let gentle = State::new(vec![0.1, -0.05], vec![0.0, 0.1]);
        let estimate = largest_lyapunov_exponent(&*model, &gentle, 200.0, &options).unwrap();
        assert_eq!(estimate.time(), None);
        assert!(largest_lyapunov_exponent(&*model, &gentle, 0.0, &options).is_err());
    }

    #[test]
    fn an_unstable_equilibrium_has_the_exponent_of_its_linearisation() {
        // θ̈ = g θ/l about the top: λ = √(g/l).
        let model = by_name("pendulum", &[]).unwrap();
        let top = State::new(vec![std::f64::consts::PI], vec![0.0]);
        let options = RolloutOptions {
            rtol: 1e-13,
            atol: 1e-13,
            ..RolloutOptions::default()
        };
        let estimate = largest_lyapunov_exponent(&*model, &top, 4.0, &options).unwrap();
        assert!(
            (estimate.exponent / 9.8_f64.sqrt() - 1.0).abs() < 0.05,
            "{}",
            estimate.exponent
        );
    }
}
