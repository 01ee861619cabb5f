//! The desired motion: a trajectory that is interpolated between its samples.

use lagrangian::{Error, Result, State, Trajectory};

/// The desired position, velocity and acceleration at one instant, `[n]` each.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Desired {
    /// `q_d`.
    pub q: Vec<f64>,
    /// `q̇_d`.
    pub qd: Vec<f64>,
    /// `q̈_d`.
    pub qdd: Vec<f64>,
}

impl Desired {
    /// Zeros for `n` coordinates.
    #[must_use]
    pub fn new(n: usize) -> Self {
        Self {
            q: vec![0.0; n],
            qd: vec![0.0; n],
            qdd: vec![0.0; n],
        }
    }
}

/// The desired motion: quintic Hermite polynomials through samples of q, q̇, q̈, so that q̈ is continuous, theory.md (54).
///
/// Rests at the first sample before its time, and at the last sample after its time.
#[derive(Debug, Clone, PartialEq)]
pub struct Reference {
    trajectory: Trajectory,
    qdd: Vec<f64>,
}

/// Minimum number of samples of a reference.
const FEWEST: usize = 2;

impl Reference {
    /// The reference through the samples of a trajectory. Missing accelerations are replaced by differences of its
    /// velocities.
    ///
    /// # Errors
    /// As [`Trajectory::validate`]; [`Error::TooShort`] for fewer than two samples.
    pub fn new(trajectory: Trajectory) -> Result<Self> {
        trajectory.validate()?;
        if trajectory.len() < FEWEST {
            return Err(Error::too_short(
                format!("reference '{}'", trajectory.name),
                trajectory.len(),
                FEWEST,
            ));
        }
        let qdd = if trajectory.qdd.is_empty() {
            differences(&trajectory)
        } else {
            trajectory.qdd.clone()
        };
        Ok(Self { trajectory, qdd })
    }

    /// Degrees of freedom.
    #[must_use]
    pub fn dof(&self) -> usize {
        self.trajectory.dof()
    }

    /// Time of the first sample, s.
    #[must_use]
    pub fn start(&self) -> f64 {
        self.trajectory.t[0]
    }

    /// Time of the last sample, s.
    #[must_use]
    pub fn end(&self) -> f64 {
        self.trajectory.t[self.trajectory.len() - 1]
    }

    /// State at the first sample.
    pub(crate) fn first_state(&self) -> State {
        let (n, samples) = (self.dof(), &self.trajectory);
        State::new(samples.q[..n].to_vec(), samples.qd[..n].to_vec())
    }

    /// Samples that the reference passes through.
    #[must_use]
    pub fn samples(&self) -> &Trajectory {
        &self.trajectory
    }

    /// The same path, `factor` times as fast, from the same instant on.
    ///
    /// # Errors
    /// [`Error::Argument`] for a factor that is not positive and finite.
    pub fn faster(&self, factor: f64) -> Result<Self> {
        if !(factor.is_finite() && factor > 0.0) {
            return Err(Error::argument("speed", factor, "finite and above 0"));
        }
        let (mut new, start) = (self.clone(), self.start());
        let Trajectory { t, signals, .. } = &mut new.trajectory;
        t.iter_mut()
            .for_each(|t| *t = start + (*t - start) / factor);
        signals.qd.iter_mut().for_each(|qd| *qd *= factor);
        let accelerations = signals.qdd.iter_mut().chain(&mut new.qdd);
        accelerations.for_each(|qdd| *qdd *= factor * factor);
        Ok(new)
    }

    /// Writes the desired motion at time `t`; allocates nothing.
    pub fn at(&self, t: f64, desired: &mut Desired) {
        let knots = &self.trajectory.t;
        let n = self.dof();
        let k = knots.partition_point(|&knot| knot <= t);
        if k == 0 || k == knots.len() {
            let row = k.min(knots.len() - 1).saturating_sub(usize::from(k == 0)) * n;
            desired.q.copy_from_slice(&self.trajectory.q[row..row + n]);
            desired.qd.fill(0.0);
            desired.qdd.fill(0.0);
            return;
        }
        let h = knots[k] - knots[k - 1];
        let s = (t - knots[k - 1]) / h;
        for i in 0..n {
            let (a, b) = ((k - 1) * n + i, k * n + i);
            let (q, qd, qdd) = (&self.trajectory.q, &self.trajectory.qd, &self.qdd);
            let ends = [
                [q[a], qd[a] * h, qdd[a] * h * h],
                [q[b], qd[b] * h, qdd[b] * h * h],
            ];
            let [x, v, w] = quintic(ends, s);
            desired.q[i] = x;
            desired.qd[i] = v / h;
            desired.qdd[i] = w / (h * h);
        }
    }
}

/// Value and first two derivatives, at s ∈ [0, 1], of the quintic through two ends, each given by its value,
/// slope and curvature.
fn quintic([a, b]: [[f64; 3]; 2], s: f64) -> [f64; 3] {
    let rest = [
        b[0] - a[0] - a[1] - 0.5 * a[2],
        b[1] - a[1] - a[2],
        b[2] - a[2],
    ];
    let c3 = 10.0 * rest[0] - 4.0 * rest[1] + 0.5 * rest[2];
    let c4 = -15.0 * rest[0] + 7.0 * rest[1] - rest[2];
    let c5 = 6.0 * rest[0] - 3.0 * rest[1] + 0.5 * rest[2];
    let x = a[0] + s * (a[1] + s * (0.5 * a[2] + s * (c3 + s * (c4 + s * c5))));
    let v = a[1] + s * (a[2] + s * (3.0 * c3 + s * (4.0 * c4 + s * 5.0 * c5)));
    let w = a[2] + s * (6.0 * c3 + s * (12.0 * c4 + s * 20.0 * c5));
    [x, v, w]
}

/// Central differences of the velocity, one-sided at the ends.
fn differences(trajectory: &Trajectory) -> Vec<f64> {
    let (n, len) = (trajectory.dof(), trajectory.len());
    let slope = |k: usize, i: usize| {
        let (a, b) = (k.saturating_sub(1), (k + 1).min(len - 1));
        let change = trajectory.qd[b * n + i] - trajectory.qd[a * n + i];
        change / (trajectory.t[b] - trajectory.t[a])
    };
    (0..len * n).map(|at| slope(at / n, at % n)).collect()
}
