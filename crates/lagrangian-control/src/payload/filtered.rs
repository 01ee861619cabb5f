//! The residual torques of the model of the robot, and the regressor of a load, through equal low-passes.

use lagrangian::Evaluator;
use lagrangian::rigid::{LinkLoad, LoadParameters};

/// One tick of a loop: the measured state, and the torque since the last tick.
#[derive(Clone, Copy)]
pub(super) struct Tick<'a> {
    pub(super) t: f64,
    pub(super) q: &'a [f64],
    pub(super) qd: &'a [f64],
    pub(super) tau: &'a [f64],
}

impl Tick<'_> {
    fn is_finite(&self) -> bool {
        let mut all = self.q.iter().chain(self.qd).chain(self.tau);
        self.t.is_finite() && all.all(|x| x.is_finite())
    }
}

/// Residual r = τ − τ̂ and regressor Y of a load over each tick, both through two low-passes of first order
/// (theory.md, 59a).
pub(super) struct Filtered {
    constant: f64,
    last: Option<f64>,
    last_q: Vec<f64>,
    last_qd: Vec<f64>,
    /// Mean motion over the last tick, `[n]` each.
    pub(super) q: Vec<f64>,
    pub(super) qd: Vec<f64>,
    pub(super) qdd: Vec<f64>,
    model: Vec<f64>,
    rows: Vec<LoadParameters>,
    joints: Vec<Joint>,
}

/// State of the low-passes of one joint.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Joint {
    once: f64,
    once_row: LoadParameters,
    /// Filtered residual r.
    pub(super) residual: f64,
    /// Filtered row of Y.
    pub(super) row: LoadParameters,
    thrice: f64,
}

impl Joint {
    fn advance(&mut self, part: f64, residual: f64, row: &LoadParameters) {
        let follow = |x: &mut f64, to: f64| *x += part * (to - *x);
        follow(&mut self.once, residual);
        follow(&mut self.residual, self.once);
        follow(&mut self.thrice, self.residual);
        for (k, raw) in row.iter().enumerate() {
            follow(&mut self.once_row[k], *raw);
            follow(&mut self.row[k], self.once_row[k]);
        }
    }

    fn is_finite(&self) -> bool {
        let mut row = self.once_row.iter().chain(&self.row);
        self.once.is_finite() && self.residual.is_finite() && row.all(|y| y.is_finite())
    }

    /// r less the part explained by a load of these parameters.
    pub(super) fn left_by(&self, load: Option<&LoadParameters>) -> f64 {
        let explained = |load: &LoadParameters| self.row.iter().zip(load).map(|(y, x)| y * x).sum();
        self.residual - load.map_or(0.0, explained)
    }

    /// Square of the noise of r: twice that of the part removed by a third low-pass.
    pub(super) fn noise(&self) -> f64 {
        2.0 * (self.residual - self.thrice).powi(2)
    }
}

/// Maximum time between ticks of one stretch, s.
const GAP: f64 = 0.1;

impl Filtered {
    pub(super) fn new(n: usize, constant: f64) -> Self {
        let zeros = || vec![0.0; n];
        Self {
            constant,
            last: None,
            last_q: zeros(),
            last_qd: zeros(),
            q: zeros(),
            qd: zeros(),
            qdd: zeros(),
            model: zeros(),
            rows: vec![LoadParameters::default(); n],
            joints: vec![Joint::default(); n],
        }
    }

    pub(super) fn joints(&self) -> &[Joint] {
        &self.joints
    }

    /// Begins a new stretch with all filters at 0, so that both sides remain consistent.
    pub(super) fn restart(&mut self) {
        self.joints.fill(Joint::default());
    }

    /// Processes a tick; returns the seconds since the last one, or `None` for a number that is not finite or a new stretch.
    pub(super) fn push(
        &mut self,
        tick: Tick,
        base: &mut dyn Evaluator,
        load: &mut LinkLoad,
    ) -> Option<f64> {
        if !tick.is_finite() {
            self.last = None;
            return None;
        }
        let step = self.last.map(|last| tick.t - last);
        let step = step.filter(|h| *h > 0.0 && *h < GAP);
        let moved = step.filter(|h| self.advance(*h, tick, base, load));
        if moved.is_none() {
            self.restart();
        }
        self.last = Some(tick.t);
        self.last_q.copy_from_slice(tick.q);
        self.last_qd.copy_from_slice(tick.qd);
        moved
    }

    /// Whether all values were finite.
    fn advance(
        &mut self,
        h: f64,
        tick: Tick,
        base: &mut dyn Evaluator,
        load: &mut LinkLoad,
    ) -> bool {
        for i in 0..self.q.len() {
            self.q[i] = 0.5 * (self.last_q[i] + tick.q[i]);
            self.qd[i] = 0.5 * (self.last_qd[i] + tick.qd[i]);
            self.qdd[i] = (tick.qd[i] - self.last_qd[i]) / h;
        }
        let (q, qd, qdd) = (&self.q, &self.qd, &self.qdd);
        let outcome = base.inverse_dynamics(q, qd, qdd, &mut self.model);
        if !outcome.is_finite() {
            return false;
        }
        load.regressor(q, qd, qdd, self.rows.as_flattened_mut());
        let part = h / (self.constant + h);
        let torques = tick.tau.iter().zip(&self.model);
        for ((joint, row), (tau, model)) in self.joints.iter_mut().zip(&self.rows).zip(torques) {
            joint.advance(part, tau - model, row);
        }
        self.joints.iter().all(Joint::is_finite)
    }
}
