//! The stages and steps of a refinement.

use super::Shooting;
use super::evidence::Groups;
use super::normal::Normal;
use super::problem::{Problem, Segment};
use crate::train::observer::{Ending, Observer};
use nets::Instant;

/// The result of a refinement.
pub(crate) struct Refined {
    pub(crate) parameters: Vec<f64>,
    /// χ² over its expectation.
    pub(crate) misfit: f64,
    pub(crate) steps: usize,
    pub(crate) seconds: f64,
    pub(crate) ending: Ending,
}

/// A change of the objective per determined parameter that ends a stage, and that ends the last.
const SMALL: [f64; 2] = [0.1, 0.01];

/// The largest number of dampings that are tried in a step.
const TRIES: usize = 10;

/// Where a descent is.
struct Descent<'a> {
    problem: &'a Problem<'a>,
    groups: Groups,
    theta: Vec<f64>,
    segments: Vec<Segment>,
    /// χ² of θ and the segments.
    value: f64,
    gamma: f64,
    /// The damping of steps, in units of [`Groups::metric`].
    damping: f64,
}

/// Refines `theta` in the stages of the settings.
pub(crate) fn descend(
    problem: &Problem<'_>,
    theta: Vec<f64>,
    config: &Shooting,
    observer: &mut dyn Observer,
) -> Refined {
    let clock = Instant::now();
    let mut states = problem.recorded_states();
    let mut descent = Descent {
        groups: Groups::of(problem.learner, &theta),
        problem,
        theta,
        segments: Vec::new(),
        value: f64::INFINITY,
        gamma: 0.0,
        damping: 1.0,
    };
    let (mut steps, mut ending) = (0, Ending::Finished);
    let stages = config.horizons.len();
    'stages: for (stage, &horizon) in config.horizons.iter().enumerate() {
        descent.begin(horizon, &mut states);
        let last = stage + 1 == stages;
        for step in 0..config.steps {
            let share = (stage as f64 + step as f64 / config.steps as f64) / stages as f64;
            let shown = format!("refining by rollouts, horizon {horizon}");
            if observer.stage(&shown, share).is_break() {
                ending = Ending::Interrupted;
                break 'stages;
            }
            if clock.elapsed().as_secs_f64() > config.seconds {
                break 'stages;
            }
            let Some(change) = descent.step() else { break };
            steps += 1;
            let settled = change < SMALL[usize::from(last)] * descent.gamma;
            if last && settled {
                ending = Ending::Converged;
            }
            // Rollouts that err by no more than the noise have no more to say than longer ones.
            if settled || (!last && descent.misfit() <= 1.0) {
                break;
            }
        }
    }
    Refined {
        misfit: descent.misfit(),
        parameters: descent.theta,
        steps,
        seconds: clock.elapsed().as_secs_f64(),
        ending,
    }
}

impl Descent<'_> {
    /// Cuts the recordings into segments that start at `states`, where the last ones passed, improved for the present parameters.
    fn begin(&mut self, horizon: usize, states: &mut [f64]) {
        let (problem, theta) = (self.problem, &self.theta);
        problem.write_states(theta, &self.segments, states);
        (self.segments, self.value) = problem.cut(theta, horizon, states);
    }

    /// The expectation of χ²: the number of residuals less that of the parameters and starts that they determine.
    fn expected(&self) -> f64 {
        let (residuals, starts) = self.problem.counts(&self.segments);
        (residuals as f64 - starts as f64 - self.gamma).max(1.0)
    }

    fn misfit(&self) -> f64 {
        self.value / self.expected()
    }

    /// One step, and how much it lowered the objective over the misfit; `None` where none lowers it.
    fn step(&mut self) -> Option<f64> {
        let normal = Normal::of(self.problem, &self.theta, &self.segments)?;
        // As long as the model errs by more than the noise, its errors count as noise.
        let misfit = self.misfit().max(1.0);
        self.gamma = self.groups.update(&normal.matrix, misfit, &self.theta);
        let unit = self.misfit().max(1.0);
        let scaled = |each: Vec<f64>| -> Vec<f64> { each.iter().map(|a| a * unit).collect() };
        let (prior, metric) = (
            scaled(self.groups.precisions()),
            scaled(self.groups.metric(&self.theta)),
        );
        let penalty = |theta: &[f64]| {
            theta
                .iter()
                .zip(&prior)
                .map(|(x, a)| a * x * x)
                .sum::<f64>()
        };
        let before = self.value + penalty(&self.theta);
        for _ in 0..TRIES {
            if let Some((delta, foreseen)) =
                normal.solve(&self.theta, &prior, &metric, self.damping)
            {
                let mut theta: Vec<f64> =
                    self.theta.iter().zip(&delta).map(|(x, d)| x + d).collect();
                self.problem.learner.project(&mut theta);
                let mut segments = normal.moved(&self.segments, &delta);
                let value = self.problem.improve_starts(&theta, &mut segments);
                let change = before - value - penalty(&theta);
                if change > 0.0 {
                    self.damping = match change / foreseen {
                        gain if gain > 0.75 => self.damping / 2.5,
                        gain if gain < 0.25 => self.damping * 2.0,
                        _ => self.damping,
                    };
                    self.damping = self.damping.max(1e-9);
                    (self.theta, self.segments, self.value) = (theta, segments, value);
                    return Some(change / unit);
                }
            }
            self.damping *= 4.0;
        }
        None
    }
}
