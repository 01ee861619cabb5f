//! Identification of a planar chain of rigid links by least squares.
//!
//! | symbol | meaning | shape |
//! |---|---|---|
//! | π | base parameters of the chain, then viscous and Coulomb friction | K |
//! | Y(q, q̇, q̈) | regressor: column k is the inverse dynamics of the chain that has πₖ = 1 and no other | n × K |
//! | W | diagonal, one over the root mean square of each torque | n × n |
//!
//! The Lagrangian is linear in π, so that τ = Y π, and π minimises Σ |W (Y π − τ)|² over all samples (Atkeson, An,
//! Hollerbach, Int. J. Robotics Research 5, 1986). Friction is kept non-negative by setting the coefficients below 0
//! to 0, one after the other.

mod expression;
mod lagrangian;

pub use lagrangian::{Angles, RigidChain};

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::RigidConfig;
use super::identified::{ERRORS, Identifiable, IdentifiedBodies, parameter};
use super::least_squares::{Columns, loss, solve_non_negative, sums_over};

use crate::dataset::Dataset;
use crate::models::learned::Stored;
use crate::models::{Parameter, Solution};
use crate::saved::WEIGHTS;
use crate::saved::{self, SavedModel};
use lagrangian_mechanics::dynamics::{EulerLagrange, Evaluator, Mechanical};
use lagrangian_mechanics::lagrangian::Lagrangian;
use lagrangian_motion::Samples;
use lagrangian_motion::solve::quadratic::Quadratic;
use lagrangian_motion::{Error, Result};

/// The name under which a chain is saved.
pub(crate) const SAVED_AS: &str = "rigid";

/// An identified chain.
pub type Rigid = IdentifiedBodies<RigidChain>;

impl Identifiable for RigidChain {
    const WHAT: &'static str = "A chain of rigid links";

    fn parameters(motion: &Mechanical<Self>) -> Vec<Parameter> {
        let chain = &motion.lagrangian;
        let mut names = Self::names(chain.coordinates(), chain.angles()).unwrap_or_default();
        let mut values = chain.parameters().to_vec();
        if let Some(friction) = motion.dissipation() {
            for kind in ["viscous", "coulomb"] {
                names.extend((1..=friction.viscous.len()).map(|i| format!("{kind}_{i}")));
            }
            values.extend(friction.viscous.iter().chain(&friction.coulomb));
        }
        let named = names.into_iter().zip(values);
        named
            .map(|(name, value)| parameter(name, value, true))
            .collect()
    }

    fn stored(&self) -> Result<Stored> {
        let shape = Shape {
            angles: self.angles(),
        };
        Stored::new(SAVED_AS, &shape, &Value::Null, self.parameters())
    }
}

/// The convention of the parameters of a chain.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Shape {
    angles: Angles,
}

/// The saved chain.
pub(crate) fn load(saved: &SavedModel) -> Result<Rigid> {
    let header = &saved.header;
    let shape: Shape = saved::read("architecture", &header.architecture)?;
    if !header.scaling.is_null() {
        return Err(saved::damaged("a rigid chain has no scaling".into()));
    }
    let [values, errors] = saved.vectors([WEIGHTS, ERRORS])?;
    let chain = RigidChain::new(header.coordinates.clone(), shape.angles, values)?;
    Rigid::new(saved.moving(chain)?, errors)
}

/// The result of an identification.
#[derive(Debug, Clone)]
pub struct Identified {
    /// The identified chain.
    pub model: Rigid,
    /// The mean of the squared weighted torque residuals on the training samples.
    pub loss: f64,
    /// The mean on the validation samples, where they exist.
    pub validation: Option<f64>,
}

impl From<Identified> for Solution {
    fn from(found: Identified) -> Self {
        Self {
            model: found.model.into(),
            loss: found.loss,
            validation: found.validation,
        }
    }
}

/// Identifies a chain from the samples of `dataset`, with friction if `dissipation`.
///
/// # Errors
/// [`Error::Argument`] where the coordinates are not 1 to 7 angles, or the data hold no forces: without them the
/// scale of a Lagrangian is undetermined. [`Error::NotFinite`] where the samples are too large to be squared.
pub fn identify(dataset: &Dataset, config: &RigidConfig, dissipation: bool) -> Result<Identified> {
    if !dataset.forced || dataset.train.is_empty() {
        return Err(Error::argument(
            "forces",
            "none",
            "recorded (`tau`): a rigid chain is identified from torques; a network such as lnn learns from free motions too",
        ));
    }
    let angles = match config.angles {
        Some(angles) => vec![angles],
        None if dataset.coordinates.dof() == 1 => vec![Angles::Absolute],
        None => vec![Angles::Relative, Angles::Absolute],
    };
    let mut best: Option<(f64, Identified)> = None;
    for angles in angles {
        let problem = Problem::new(dataset, config, angles, dissipation)?;
        let mut own: Option<(f64, Identified)> = None;
        for terms in Terms::ALL {
            let most = own.as_ref().map_or(f64::INFINITY, |(loss, _)| WORTH * loss);
            own = problem
                .best(terms)?
                .filter(|(loss, _)| *loss < most)
                .or(own);
        }
        best = least([best, own].into_iter().flatten());
    }
    let (_, found) =
        best.ok_or_else(|| Error::not_finite("the sums of squares of the samples", 0))?;
    Ok(found)
}

/// The first candidate of the least loss.
fn least(candidates: impl Iterator<Item = (f64, Identified)>) -> Option<(f64, Identified)> {
    candidates.min_by(|a, b| a.0.total_cmp(&b.0))
}

/// Terms beyond those of a chain that hangs at 0. Each is used only where it lowers the loss much: small angles hardly
/// distinguish them, and errors grow at large angles.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Terms {
    /// No further terms.
    Hanging,
    /// Gravity in any direction.
    AnyDirection,
    /// Gravity in any direction, and constant torques.
    Offsets,
}

impl Terms {
    const ALL: [Self; 3] = [Self::Hanging, Self::AnyDirection, Self::Offsets];

    fn allow(self, name: &str) -> bool {
        match self {
            Self::Hanging => !name.starts_with("gravity_sin") && !name.starts_with("offset"),
            Self::AnyDirection => !name.starts_with("offset"),
            Self::Offsets => true,
        }
    }
}

/// More terms must lower the loss to below this part.
const WORTH: f64 = 0.8;

/// One convention of angles: sums over the samples, for all candidates of the smoothing at once.
struct Problem<'a> {
    dataset: &'a Dataset,
    angles: Angles,
    columns: Columns,
    /// Names of the columns of the chain.
    names: Vec<String>,
    train: Quadratic,
    validation: Quadratic,
}

impl<'a> Problem<'a> {
    fn new(
        dataset: &'a Dataset,
        config: &RigidConfig,
        angles: Angles,
        dissipation: bool,
    ) -> Result<Self> {
        let coordinates = &dataset.coordinates;
        let names = RigidChain::names(coordinates, angles)?;
        let chain = names.len();
        let unit = |k| {
            let mut parameters = vec![0.0; chain];
            parameters[k] = 1.0;
            RigidChain::new(coordinates.clone(), angles, parameters)
        };
        let links = (0..chain).map(unit).collect::<Result<Vec<_>>>()?;
        let columns = Columns::new(dataset, chain, config.smoothing, dissipation);
        let weights: Vec<f64> = dataset.force_scale().iter().map(|s| 1.0 / s).collect();
        let sums = |samples| sums_of(samples, &links, &columns, &weights);
        Ok(Self {
            train: sums(&dataset.train),
            validation: sums(&dataset.validation),
            dataset,
            angles,
            columns,
            names,
        })
    }

    /// The loss over all samples: with so few parameters a chain does not overfit, and a validation on slow motions alone
    /// would mean little.
    fn pooled(&self, found: &Identified) -> f64 {
        let (train, held) = (self.train.rows as f64, self.validation.rows as f64);
        (found.loss * train + found.validation.unwrap_or(0.0) * held) / (train + held)
    }

    /// The best candidate with these terms, and its loss.
    fn best(&self, terms: Terms) -> Result<Option<(f64, Identified)>> {
        let all = (0..self.columns.speeds.len()).map(|candidate| self.solve(candidate, terms));
        let found: Vec<Option<Identified>> = all.collect::<Result<_>>()?;
        let found = found.into_iter().flatten();
        Ok(least(found.map(|found| (self.pooled(&found), found))))
    }

    /// The chain of this candidate; `None` where the sums are not finite.
    fn solve(&self, candidate: usize, terms: Terms) -> Result<Option<Identified>> {
        let chain = self.names.len();
        let columns = self.columns.of(candidate);
        let allowed = |&k: &usize| self.names.get(k).is_none_or(|name| terms.allow(name));
        let free = (0..columns.len()).filter(allowed).collect();
        let any_sign = |k| k < chain;
        let Some(solution) = solve_non_negative(&self.train, &columns, free, any_sign) else {
            return Ok(None);
        };
        let values = solution.values;
        let (pi, friction) = values.split_at(chain);
        let links = RigidChain::new(self.dataset.coordinates.clone(), self.angles, pi.to_vec())?;
        let motion = self.columns.moving(links, friction, candidate)?;
        Ok(Some(Identified {
            model: Rigid::new(motion, solution.errors)?,
            loss: loss(&self.train, &columns, &values),
            validation: (self.validation.rows > 0)
                .then(|| loss(&self.validation, &columns, &values)),
        }))
    }
}

fn sums_of(
    samples: &Samples,
    chain: &[RigidChain],
    columns: &Columns,
    weights: &[f64],
) -> Quadratic {
    let n = samples.n.max(1);
    sums_over(samples.len(), columns.count(), weights, |range| {
        let rows = range.start * n..range.end * n;
        let columns = regressor(samples, rows.clone(), chain, columns.friction_speeds());
        (columns, samples.tau[rows].to_vec())
    })
}

/// The columns of Y for the rows `rows` of the samples.
fn regressor(
    samples: &Samples,
    rows: std::ops::Range<usize>,
    chain: &[RigidChain],
    smoothing: &[f64],
) -> Vec<Vec<f64>> {
    let (n, qd, qdd) = (
        samples.n,
        &samples.qd[rows.clone()],
        &samples.qdd[rows.clone()],
    );
    let of_link = |link: &RigidChain| {
        let mut tau = vec![0.0; rows.len()];
        let q = &samples.q[rows.clone()];
        let _ = EulerLagrange::new(link, None).inverse_dynamics(q, qd, qdd, &mut tau);
        tau
    };
    let mut columns: Vec<Vec<f64>> = chain.iter().map(of_link).collect();
    let mut friction = |force: &dyn Fn(f64, f64) -> f64| {
        for i in 0..n {
            let own = |(k, (v, a))| if k % n == i { force(v, a) } else { 0.0 };
            let motion = qd.iter().copied().zip(qdd.iter().copied());
            columns.push(motion.enumerate().map(own).collect());
        }
    };
    if !smoothing.is_empty() {
        friction(&|v, _| v);
    }
    for speed in smoothing {
        friction(&|v, a| (v / samples.smoothing(*speed, a)).tanh());
    }
    columns
}
