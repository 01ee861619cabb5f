//! Newton's method for the Legendre transform: y with ∂F/∂y (q, y) = x, for a batch of states at once.

use lagrangian_motion::solve::{Regularity, SymmetricSolver};

/// Maximum number of rounds, each one evaluation of the batch.
const MAX_ROUNDS: usize = 300;
/// Relative residual below which a state is solved: a part of the values that the residual is the difference of.
const SOLVED: f64 = 2.0 * f64::EPSILON;
/// Relative residual that is accepted where rounding prevents a smaller one.
const NEARLY_SOLVED: f64 = 1e-10;
/// Fraction of Newton's step below which the search gives up.
const SHORTEST: f64 = 1e-9;

/// A function F(q, y) with its derivatives by y.
pub(super) trait Gradient {
    /// ∂F/∂y `[m, n]` and ∂²F/∂y∂y `[m, n, n]` at the states (q, y).
    fn at(&mut self, q: &[f64], y: &[f64]) -> (&[f64], &[f64]);
}

/// Newton's method with a line search on the residual: each step is halved until the residual shrinks, so that it finds
/// the only solution of a convex F from anywhere in its domain (theory.md, equation 90).
#[derive(Debug)]
pub(super) struct Newton {
    n: usize,
    solver: SymmetricSolver,
    trial: Vec<f64>,
    step: Vec<f64>,
    residual: Vec<f64>,
    states: Vec<Search>,
}

/// Progress of the search at one state.
#[derive(Debug, Clone, Copy)]
struct Search {
    norm: f64,
    scale: f64,
    part: f64,
    ended: bool,
}

impl Search {
    fn solved(&self) -> bool {
        self.norm <= NEARLY_SOLVED * self.scale
    }
}

impl Newton {
    pub(super) fn new(n: usize) -> Self {
        Self {
            n,
            solver: SymmetricSolver::new(n),
            trial: Vec::new(),
            step: Vec::new(),
            residual: vec![0.0; n],
            states: Vec::new(),
        }
    }

    /// Number of unknowns of a state.
    pub(super) fn n(&self) -> usize {
        self.n
    }

    /// Solves ∂F/∂y (q, y) = x from y = 0; `q`, `x` and `y` are `[m, n]`. y is NaN at states without a solution.
    pub(super) fn solve(&mut self, f: &mut dyn Gradient, q: &[f64], x: &[f64], y: &mut [f64]) {
        let n = self.n;
        let begin = Search {
            norm: f64::INFINITY,
            scale: 0.0,
            part: 1.0,
            ended: false,
        };
        self.states.clear();
        self.states.resize(x.len() / n, begin);
        y.fill(0.0);
        self.trial.clear();
        self.trial.resize(x.len(), 0.0);
        self.step.resize(x.len(), 0.0);
        for _ in 0..MAX_ROUNDS {
            if self.states.iter().all(|s| s.ended) {
                break;
            }
            let (gradient, hessian) = f.at(q, &self.trial);
            for s in 0..self.states.len() {
                if !self.states[s].ended {
                    let row = s * n..(s + 1) * n;
                    let second = &hessian[s * n * n..][..n * n];
                    self.test(
                        s,
                        &gradient[row.clone()],
                        second,
                        &x[row.clone()],
                        &mut y[row],
                    );
                }
            }
        }
        for (row, state) in y.chunks_exact_mut(n).zip(&self.states) {
            if !state.solved() {
                row.fill(f64::NAN);
            }
        }
    }

    /// Accepts the trial of state `s` if its residual is smaller, and chooses the next trial.
    fn test(&mut self, s: usize, gradient: &[f64], hessian: &[f64], x: &[f64], y: &mut [f64]) {
        let n = self.n;
        let row = s * n..(s + 1) * n;
        let state = &mut self.states[s];
        let (mut norm, mut scale) = (0.0_f64, f64::MIN_POSITIVE);
        for i in 0..n {
            self.residual[i] = gradient[i] - x[i];
            // NaN counts as infinite.
            norm += self.residual[i].powi(2);
            scale = scale.max(gradient[i].abs()).max(x[i].abs());
        }
        let norm = norm.sqrt();
        if norm < state.norm {
            y.copy_from_slice(&self.trial[row.clone()]);
            // At the end both may vanish, as at rest: rounding is then compared with the first residual.
            (state.norm, state.scale, state.part) = (norm, scale.max(state.scale), 1.0);
            state.ended = norm <= SOLVED * state.scale;
            let step = &mut self.step[row.clone()];
            let regular = self.solver.solve(hessian, &self.residual, step);
            state.ended |= matches!(regular, Regularity::Singular | Regularity::NotFinite);
        } else {
            state.part *= 0.5;
            // The start is outside the domain, rounding prevents a smaller residual, or shorter steps do not help.
            state.ended = state.norm.is_infinite() || state.solved() || state.part < SHORTEST;
        }
        for (i, trial) in self.trial[row.clone()].iter_mut().enumerate() {
            *trial = y[i] - state.part * self.step[row.start + i];
        }
    }
}
