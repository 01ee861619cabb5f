//! The states at which symmetries are measured, with the derivatives of L there.

use lagrangian::mechanics::{Curvature, Jet, Lagrangian, SymmetricSolver, dot};
use lagrangian::{Coordinates, Error, Result, Trajectory, mechanics as dynamics};

/// Thinned states of motions, with the quantities of theory.md (78) to (80); arrays are `[m, n]` or `[m, n, n]`.
pub(super) struct States {
    pub(super) coordinates: Coordinates,
    pub(super) q: Vec<f64>,
    pub(super) qd: Vec<f64>,
    pub(super) jet: Jet,
    /// a(q) = p(q, 0); 0 where that is not finite.
    pub(super) rest: Vec<f64>,
    /// (∂a/∂q) q̇.
    pub(super) rest_rate: Vec<f64>,
    /// max(rms |q̈|_M, rms |q̇|_M / T), the size of inertial forces.
    pub(super) inertial: f64,
    /// Whether a(q) is more than a gauge and exerts forces.
    pub(super) magnetic: bool,
}

/// Ratio of magnetic to inertial forces below which the magnetic ones are attributed to an imperfect model.
const MAGNETIC: f64 = 1e-3;

impl States {
    /// At most `most` states of the motions, evenly chosen; if the model has a magnetic part, also the reverse of each.
    ///
    /// On few orbits a force may look like a total derivative. In reversed motion, one stays and the other changes its sign.
    pub(super) fn of(
        lagrangian: &dyn Lagrangian,
        motions: &[Trajectory],
        most: usize,
    ) -> Result<Self> {
        let n = lagrangian.coordinates().dof();
        let total: usize = motions.iter().map(Trajectory::len).sum();
        let every = total.div_ceil(most).max(1);
        let rows = |signal: fn(&Trajectory) -> &[f64]| -> Vec<f64> {
            let all = motions
                .iter()
                .flat_map(|motion| signal(motion).chunks_exact(n));
            all.step_by(every).flatten().copied().collect()
        };
        let (q, qd) = (rows(|motion| &motion.q), rows(|motion| &motion.qd));
        let duration = motions
            .iter()
            .filter(|m| m.len() > 1)
            .map(|m| m.t[m.len() - 1] - m.t[0]);
        let longest = duration.fold(f64::MIN_POSITIVE, f64::max);
        let forward = Self::at(lagrangian, q, qd, longest)?;
        if !forward.magnetic {
            return Ok(forward);
        }
        let back: Vec<f64> = forward.qd.iter().map(|v| -v).collect();
        let (q, qd) = (
            [&forward.q[..], &forward.q].concat(),
            [forward.qd, back].concat(),
        );
        Self::at(lagrangian, q, qd, longest)
    }

    fn at(lagrangian: &dyn Lagrangian, q: Vec<f64>, qd: Vec<f64>, longest: f64) -> Result<Self> {
        let n = lagrangian.coordinates().dof();
        let mut jets = lagrangian.jets();
        let mut jet = Jet::default();
        jets.jet(&q, &qd, &mut jet);
        for signal in [&jet.lagrangian, &jet.dl_dq, &jet.momentum, &jet.mass_matrix] {
            Error::check_finite("the Lagrangian at a state of the motions", signal)?;
        }
        let (still, mut at_rest, mut bend) =
            (vec![0.0; qd.len()], Jet::default(), Curvature::default());
        jets.jet(&q, &still, &mut at_rest);
        jets.curvature(&q, &still, &mut bend);
        let mut rest = at_rest.momentum;
        if !rest.iter().chain(&bend.dp_dq).all(|x| x.is_finite()) {
            rest.fill(0.0);
            bend.dp_dq.fill(0.0);
        }
        let rates = bend.dp_dq.chunks_exact(n * n).zip(qd.chunks_exact(n));
        let rest_rate = rates.flat_map(|(p, qd)| p.chunks_exact(n).map(move |row| dot(row, qd)));
        let mut states = Self {
            coordinates: lagrangian.coordinates().clone(),
            rest,
            rest_rate: rest_rate.collect(),
            q,
            qd,
            jet,
            inertial: 0.0,
            magnetic: false,
        };
        let speed = states.rms(|k| states.norm(k, states.speed(k)));
        let mut qdd = vec![0.0; states.q.len()];
        let mut force = qdd.clone();
        let mut solver = SymmetricSolver::new(n);
        let _ = dynamics::forward(&states.jet, &mut solver, &mut force, &mut qdd);
        let pull = states.rms(|k| states.norm(k, &qdd[k * n..(k + 1) * n]));
        states.inertial = pull.max(speed / longest);
        states.magnetic = states.magnetic_size(&bend, &mut solver) > MAGNETIC * states.inertial;
        Ok(states)
    }

    /// rms |M⁻¹ (∂a/∂q − (∂a/∂q)ᵀ) q̇|_M: the force of a vector potential beyond a gauge.
    fn magnetic_size(&self, bend: &Curvature, solver: &mut SymmetricSolver) -> f64 {
        let n = self.n();
        let mut moved = vec![0.0; n];
        let size = |k: usize| {
            let part = k * n * n..(k + 1) * n * n;
            let (p, mass) = (&bend.dp_dq[part.clone()], &self.jet.mass_matrix[part]);
            let curl = |i: usize| (0..n).map(move |j| p[i * n + j] - p[j * n + i]);
            let force = (0..n).map(|i| curl(i).zip(self.speed(k)).map(|(b, v)| b * v).sum());
            let force: Vec<f64> = force.collect();
            solver.solve(mass, &force, &mut moved);
            dot(&force, &moved).abs()
        };
        let sum: f64 = (0..self.len()).map(size).sum();
        (sum / self.len().max(1) as f64).sqrt()
    }

    pub(super) fn n(&self) -> usize {
        self.coordinates.dof()
    }

    /// Number of states m.
    pub(super) fn len(&self) -> usize {
        self.jet.lagrangian.len()
    }

    pub(super) fn position(&self, k: usize) -> &[f64] {
        &self.q[k * self.n()..(k + 1) * self.n()]
    }

    pub(super) fn speed(&self, k: usize) -> &[f64] {
        &self.qd[k * self.n()..(k + 1) * self.n()]
    }

    /// xᵀ M y at state `k`.
    pub(super) fn product(&self, k: usize, x: &[f64], y: &[f64]) -> f64 {
        let n = self.n();
        let mass = &self.jet.mass_matrix[k * n * n..(k + 1) * n * n];
        let rows = mass.chunks_exact(n).zip(x);
        rows.map(|(row, x)| x * dot(row, y)).sum()
    }

    /// |x|_M at state `k`.
    pub(super) fn norm(&self, k: usize, x: &[f64]) -> f64 {
        self.product(k, x, x).abs().sqrt()
    }

    /// Root mean square over the states.
    pub(super) fn rms(&self, value: impl Fn(usize) -> f64) -> f64 {
        let sum: f64 = (0..self.len()).map(|k| value(k).powi(2)).sum();
        (sum / self.len().max(1) as f64).sqrt()
    }
}
