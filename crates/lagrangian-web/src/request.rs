//! Requests of a page.

use lagrangian::mechanics::Quantities;
use lagrangian::{FitSpec, Model};
use serde::Deserialize;

use crate::experiment::Experiment;
use crate::motion::Prediction;
use crate::recordings::Columns;
use crate::system::Named;

/// A request of the page: `{"ask": "…", …}`.
#[derive(Debug, Deserialize)]
#[serde(tag = "ask", rename_all = "kebab-case", deny_unknown_fields)]
pub(crate) enum Request {
    /// The known systems, with their parameters and coordinates.
    Systems,
    /// The motion of a system or of a model from a state.
    Simulate(Prediction),
    /// Recordings of a known system, which become the data.
    Experiment(Experiment),
    /// The action of a path, which need not be a motion.
    Action(ActionAsked),
    /// Random states of a known system with their accelerations, which become the data.
    States(States),
    /// A preview of a file: its columns, its first rows, their likely meaning. The bytes come with the message.
    Inspect {
        /// Its name.
        name: String,
        /// Whether it is added to the previous files, instead of replacing them.
        #[serde(default)]
        joins: bool,
    },
    /// The files that were inspected become the data, by these columns.
    Read(Columns),
    /// The check of the data, with remedies.
    Check,
    /// The data as CSV.
    Data,
    /// Begins a fit to the data.
    Start {
        /// The request.
        fit: Box<FitSpec>,
        /// Its time, ms since 1970.
        #[serde(default)]
        started: f64,
    },
    /// Continues the fit for about this time.
    Advance {
        /// The time, ms.
        milliseconds: f64,
    },
    /// Ends the fit with the best model so far.
    Finish,
    /// The errors of predictions of the fitted model for motions that were held back.
    Score,
    /// The page of the fit in one file, identical to that of the command.
    Report,
    /// The energy errors of the fitted model in free motions of a system.
    Energy(EnergyAsked),
    /// The energy of a model at rest along one coordinate.
    Potential(PotentialAsked),
    /// The bytes of the fitted model, identical to those of the command.
    Save,
    /// A model from the bytes of a file.
    Load,
    /// The speed of this machine: seconds of a training step and of an inverse dynamics.
    Speed,
}

/// The system or model that moves: a system, the fitted model, or the model of a file.
#[derive(Debug, Clone, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum By {
    /// A known system.
    System(String),
    /// A known system with some of its parameters set.
    Known(Named),
    /// The fitted model.
    Fitted,
    /// The model that was loaded.
    Loaded,
}

/// The energy test of [`lagrangian::rollout::energy_test`].
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct EnergyAsked {
    /// The system whose energy is compared.
    pub(crate) of: Named,
    /// The number of random starts.
    pub(crate) starts: usize,
    /// The duration of each motion, s.
    pub(crate) duration: f64,
    /// The energy that counts as 100 %, J.
    pub(crate) reference: f64,
    /// The seed of the starts.
    #[serde(default)]
    pub(crate) seed: u64,
}

/// Random states of a known system.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct States {
    /// The system.
    pub(crate) of: Named,
    /// Their number.
    pub(crate) samples: usize,
    /// Their seed.
    #[serde(default)]
    pub(crate) seed: u64,
}

/// The energy at rest, which is V(q) up to a constant.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct PotentialAsked {
    /// The system or model.
    pub(crate) by: By,
    /// The index of the coordinate that changes.
    coordinate: usize,
    /// Its values.
    at: Vec<f64>,
    /// All coordinates, `[n]`; the one that changes is replaced.
    q: Vec<f64>,
}

impl PotentialAsked {
    /// E(q, 0) at each value, J; empty for a model without an energy, or without that coordinate.
    pub(crate) fn of(&self, model: &dyn Model) -> Vec<f64> {
        let n = model.coordinates().dof();
        if self.q.len() != n || self.coordinate >= n {
            return Vec::new();
        }
        let mut q = self.q.repeat(self.at.len());
        for (row, value) in q.chunks_exact_mut(n).zip(&self.at) {
            row[self.coordinate] = *value;
        }
        model.energy(&q, &vec![0.0; q.len()]).unwrap_or_default()
    }
}

/// ∫ L dt along a path.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct ActionAsked {
    /// The system or model with the Lagrangian.
    pub(crate) by: By,
    /// Times, s.
    t: Vec<f64>,
    /// Positions, `[len, n]`.
    q: Vec<f64>,
}

impl ActionAsked {
    /// The action, J s, by the midpoint of each pair of neighbours; `None` for a model without a Lagrangian, or a path of
    /// another shape.
    pub(crate) fn of(&self, model: &dyn Model) -> Option<f64> {
        let n = model.coordinates().dof();
        if self.q.len() != self.t.len() * n || self.t.len() < 2 {
            return None;
        }
        let steps: Vec<f64> = self.t.windows(2).map(|t| t[1] - t[0]).collect();
        let pairs = self.q.iter().zip(&self.q[n..]);
        let (q, rise): (Vec<f64>, Vec<f64>) = pairs.map(|(a, b)| (0.5 * (a + b), b - a)).unzip();
        let rows = rise.chunks_exact(n).zip(&steps);
        let qd: Vec<f64> = rows
            .flat_map(|(row, step)| row.iter().map(move |x| x / step))
            .collect();
        let mut values = vec![0.0; steps.len()];
        let outcome = model.evaluator().lagrangian(&q, &qd, &mut values);
        let sum = || values.iter().zip(&steps).map(|(l, step)| l * step).sum();
        outcome.is_supported().then(sum)
    }
}
