//! The action of a path by the midpoint rule, its gradient and its Hessian.

use std::f64::consts::PI;

use super::tridiagonal::BlockTridiagonal;
use lagrangian::mechanics::{Curvature, Jet, Jets, Lagrangian};

/// A path on a uniform time grid.
#[derive(Debug, Clone, PartialEq)]
pub struct Path {
    /// Number n of degrees of freedom.
    pub dof: usize,
    /// Time from the first node to the last, s.
    pub duration: f64,
    /// Nodes with unwrapped angles, `[N + 1, n]`.
    pub q: Vec<f64>,
}

impl Path {
    /// Number N of segments.
    #[must_use]
    pub fn segments(&self) -> usize {
        (self.q.len() / self.dof.max(1)).saturating_sub(1)
    }

    /// Duration h of a segment, s.
    #[must_use]
    pub fn step(&self) -> f64 {
        self.duration / self.segments().max(1) as f64
    }

    /// Configuration at node `k`, `[n]`.
    #[must_use]
    pub fn node(&self, k: usize) -> &[f64] {
        &self.q[k * self.dof..(k + 1) * self.dof]
    }

    /// Times of the nodes, s, `[N + 1]`.
    #[must_use]
    pub fn times(&self) -> Vec<f64> {
        let step = self.step();
        (0..=self.segments()).map(|k| k as f64 * step).collect()
    }

    /// Nodes between the ends.
    pub(super) fn inner(&self) -> &[f64] {
        &self.q[self.dof..self.q.len() - self.dof]
    }

    /// The variation sin(k π t/T) of one coordinate at all nodes, `[N + 1, n]`.
    #[must_use]
    pub fn sine(&self, coordinate: usize, k: u32) -> Vec<f64> {
        let last = self.segments();
        let mut eta = vec![0.0; self.q.len()];
        for node in 1..last {
            let phase = PI * f64::from(k) * node as f64 / last as f64;
            eta[node * self.dof + coordinate] = phase.sin();
        }
        eta
    }

    /// The path with an additional node between every two: cubic interpolation inside, quadratic at the ends.
    pub(super) fn refined(&self) -> Self {
        let (n, last) = (self.dof, self.segments());
        let mut q = Vec::with_capacity((2 * last + 1) * n);
        for k in 0..last {
            q.extend_from_slice(self.node(k));
            for i in 0..n {
                let at = |k: usize| self.q[k * n + i];
                let bend = |k: usize| at(k - 1) - 2.0 * at(k) + at(k + 1);
                // The ends do not have a second difference; their segments use that of the other node.
                let (a, b) = (k.clamp(1, last - 1), (k + 1).clamp(1, last - 1));
                q.push(0.5 * (at(k) + at(k + 1)) - 0.0625 * (bend(a) + bend(b)));
            }
        }
        q.extend_from_slice(self.node(last));
        Self { q, ..*self }
    }
}

/// Evaluates S = Σ h L((qₖ + qₖ₊₁)/2, (qₖ₊₁ − qₖ)/h) and its derivatives by the nodes (theory.md, equation 73);
/// owns its scratch memory.
pub struct DiscreteAction<'a> {
    jets: Box<dyn Jets + 'a>,
    jet: Jet,
    curvature: Curvature,
    middle: Vec<f64>,
    speed: Vec<f64>,
}

impl<'a> DiscreteAction<'a> {
    /// Discrete action of this Lagrangian.
    #[must_use]
    pub fn new(lagrangian: &'a dyn Lagrangian) -> Self {
        Self {
            jets: lagrangian.jets(),
            jet: Jet::default(),
            curvature: Curvature::default(),
            middle: Vec::new(),
            speed: Vec::new(),
        }
    }

    /// The action S, J·s, of a path with the coordinates of the Lagrangian and at least one segment; not finite where L is
    /// undefined along the path.
    pub fn action(&mut self, path: &Path) -> f64 {
        self.evaluate(path);
        path.step() * self.jet.lagrangian.iter().sum::<f64>()
    }

    /// Changes S(q + ε η) − S(q) of the action along a variation η, `[N + 1, n]`, for each ε; η should vanish at the
    /// ends.
    pub fn changes(&mut self, path: &Path, eta: &[f64], epsilon: &[f64]) -> Vec<f64> {
        let still = self.action(path);
        let mut change = |epsilon: &f64| {
            let q = path.q.iter().zip(eta).map(|(q, e)| q + epsilon * e);
            let varied = Path {
                q: q.collect(),
                ..*path
            };
            self.action(&varied) - still
        };
        epsilon.iter().map(&mut change).collect()
    }

    /// ∂S/∂q at the inner nodes, `[N − 1, n]`, which is 0 along a motion.
    pub fn gradient(&mut self, path: &Path) -> Vec<f64> {
        self.evaluate(path);
        let n = path.dof;
        let inner = (0..(path.segments() - 1) * n).map(|at| (at / n, at % n));
        inner
            .map(|(k, i)| self.slope(path, k, i, 1.0) + self.slope(path, k + 1, i, -1.0))
            .collect()
    }

    /// Momenta at the ends of a stationary path, −∂S/∂q₀ and ∂S/∂q₁ (theory.md, equation 74).
    pub fn end_momenta(&mut self, path: &Path) -> [Vec<f64>; 2] {
        self.evaluate(path);
        let last = path.segments() - 1;
        let first = (0..path.dof).map(|i| -self.slope(path, 0, i, -1.0));
        let end = (0..path.dof).map(|i| self.slope(path, last, i, 1.0));
        [first.collect(), end.collect()]
    }

    /// Hessian H over the inner nodes, and the mass matrices at the middles of the segments, `[N, n, n]`.
    pub(super) fn hessian(&mut self, path: &Path) -> (BlockTridiagonal, &[f64]) {
        self.evaluate(path);
        self.jets
            .curvature(&self.middle, &self.speed, &mut self.curvature);
        let (n, h) = (path.dof, path.step());
        let mut hessian = BlockTridiagonal::zeros(n, path.segments() - 1);
        let size = n * n;
        for at in 0..path.segments() * size {
            let (s, ij) = (at / size, at % size);
            let transposed = s * size + ij % n * n + ij / n;
            let quarter = 0.25 * h * self.curvature.dl_dqdq[at];
            let mass = self.jet.mass_matrix[at] / h;
            let (pq, qp) = (self.curvature.dp_dq[at], self.curvature.dp_dq[transposed]);
            let mixed = 0.5 * (pq + qp);
            if s > 0 {
                hessian.diagonal[at - size] += quarter - mixed + mass;
                hessian.upper[at - size] = quarter + 0.5 * (qp - pq) - mass;
            }
            if s + 1 < path.segments() {
                hessian.diagonal[at] += quarter + mixed + mass;
            }
        }
        (hessian, &self.jet.mass_matrix)
    }

    fn evaluate(&mut self, path: &Path) {
        let (n, h) = (path.dof, path.step());
        let pairs = || path.q.iter().zip(&path.q[n..]);
        self.middle.clear();
        self.middle.extend(pairs().map(|(a, b)| 0.5 * (a + b)));
        self.speed.clear();
        self.speed.extend(pairs().map(|(a, b)| (b - a) / h));
        self.jets.jet(&self.middle, &self.speed, &mut self.jet);
    }

    /// ∂Lᵈ/∂qᵢ of segment `s` by its first node (`sign` −1) or its last one (1): h/2 ∂L/∂q ∓ p.
    fn slope(&self, path: &Path, s: usize, i: usize, sign: f64) -> f64 {
        let at = s * path.dof + i;
        0.5 * path.step() * self.jet.dl_dq[at] + sign * self.jet.momentum[at]
    }
}
