//! Identification of a planar chain of rigid links by least squares: what robotics does where the structure of the
//! machine is known, and so the measure for models that must find it out.
//!
//! | symbol | meaning | shape |
//! |---|---|---|
//! | π | base parameters of the chain, then viscous and Coulomb friction | K |
//! | Y(q, q̇, q̈) | regressor: column k is the inverse dynamics of the chain that has πₖ = 1 and no other | n × K |
//! | W | diagonal, one over the root mean square of each torque | n × n |
//!
//! The Lagrangian is linear in π, so that τ = Y π, and π minimises Σ |W (Y π − τ)|² over all samples (Atkeson, An,
//! Hollerbach, Int. J. Robotics Research 5, 1986). Friction is kept non-negative by leaving out, one after the
//! other, the coefficients that come out below 0.

mod lagrangian;
mod sums;

pub use lagrangian::{Angles, RigidChain};

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::{NAME, RigidConfig, check_errors, solved};

use crate::dataset::Dataset;
use crate::mechanics::dynamics::{EulerLagrange, Evaluator, Mechanical, Model};
use crate::mechanics::forces::Dissipation;
use crate::mechanics::lagrangian::Lagrangian;
use crate::models::learned::{Description, FittedForces, FittedModel, Stored, WEIGHTS};
use crate::models::{Parameter, Solution};
use crate::saved::{self, SavedModel};
use crate::train::Samples;
use crate::{Coordinates, Error, Result};

/// The name under which a chain is saved.
pub(crate) const SAVED_AS: &str = "rigid";

/// The tensor of the standard errors of all parameters.
const ERRORS: &str = "standard_errors";

pub(crate) use sums::Sums;

/// An identified chain.
#[derive(Debug, Clone)]
pub struct Rigid {
    motion: Mechanical<RigidChain>,
    errors: Vec<f64>,
}

impl Rigid {
    /// A chain with the standard errors of its parameters, in the order of [`Rigid::parameters`].
    ///
    /// # Errors
    /// [`Error::Shape`] for another number of errors; [`Error::NotFinite`].
    pub fn new(motion: Mechanical<RigidChain>, errors: Vec<f64>) -> Result<Self> {
        let friction = motion.dissipation().map_or(0, |d| 2 * d.viscous.len());
        let expected = motion.lagrangian.parameters().len() + friction;
        check_errors(&errors, expected)?;
        Ok(Self { motion, errors })
    }

    /// The chain with its friction.
    #[must_use]
    pub fn motion(&self) -> &Mechanical<RigidChain> {
        &self.motion
    }

    /// Standard errors of all parameters.
    #[must_use]
    pub fn standard_errors(&self) -> &[f64] {
        &self.errors
    }

    /// All parameters: those of the chain, then viscous and Coulomb friction where they were identified.
    #[must_use]
    pub fn parameters(&self) -> Vec<Parameter> {
        let chain = &self.motion.lagrangian;
        let mut names = RigidChain::names(chain.coordinates(), chain.angles()).unwrap_or_default();
        let mut values = chain.parameters().to_vec();
        if let Some(friction) = self.motion.dissipation() {
            names.extend(friction_names(friction.viscous.len()));
            values.extend(friction.viscous.iter().chain(&friction.coulomb));
        }
        let named = names.into_iter().zip(values).zip(&self.errors);
        named
            .map(|((name, value), error)| solved(name, value, *error))
            .collect()
    }
}

fn friction_names(n: usize) -> impl Iterator<Item = String> {
    let kinds = ["viscous", "coulomb"].into_iter();
    kinds.flat_map(move |kind| (1..=n).map(move |i| format!("{kind}_{i}")))
}

impl Model for Rigid {
    fn coordinates(&self) -> &Coordinates {
        self.motion.coordinates()
    }

    fn evaluator(&self) -> Box<dyn Evaluator + '_> {
        self.motion.evaluator()
    }

    fn mechanics(&self) -> Option<EulerLagrange<'_>> {
        self.motion.mechanics()
    }
}

impl FittedModel for Rigid {
    fn description(&self) -> Description {
        Description::plain(NAME, "A chain of rigid links")
    }

    fn stored(&self) -> Result<Stored> {
        let chain = &self.motion.lagrangian;
        let shape = Shape {
            angles: chain.angles(),
        };
        let stored = Stored::new(SAVED_AS, &shape, &Value::Null, chain.parameters())?;
        Ok(stored.with(ERRORS, &self.errors))
    }

    fn lagrangian(&self) -> Option<&dyn Lagrangian> {
        Some(&self.motion.lagrangian)
    }

    fn forces(&self) -> FittedForces<'_> {
        self.motion.fitted_forces()
    }

    fn parameters(&self) -> Vec<Parameter> {
        Self::parameters(self)
    }

    fn boxed(&self) -> Box<dyn FittedModel> {
        Box::new(self.clone())
    }
}

/// What the parameters of a chain mean.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Shape {
    angles: Angles,
}

/// The chain that was saved.
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

/// What came out of an identification.
#[derive(Debug, Clone)]
pub struct Identified {
    /// The chain.
    pub model: Rigid,
    /// Mean of the squared weighted torque residuals on the training samples.
    pub loss: f64,
    /// The same on the validation samples, where there are any.
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
            let Some((judged, found)) = problem.best(terms)? else {
                continue;
            };
            if own.as_ref().is_none_or(|(least, _)| judged < WORTH * least) {
                own = Some((judged, found));
            }
        }
        if let Some((judged, found)) = own
            && best.as_ref().is_none_or(|(least, _)| judged < *least)
        {
            best = Some((judged, found));
        }
    }
    match best {
        Some((_, found)) => Ok(found),
        None => Err(Error::not_finite("the sums of squares of the samples", 0)),
    }
}

/// Terms beyond those of a chain that hangs at 0; each only where it pays, since over small angles they can hardly
/// be told apart, and what small angles leave open errs most at large ones.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Terms {
    /// None.
    Hanging,
    /// Gravity in any direction.
    AnyDirection,
    /// And constant torques.
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

/// More terms must bring the loss below this part of what it was.
const WORTH: f64 = 0.8;

/// Smoothing speeds that are tried, in parts of the smallest root mean square of a velocity.
pub(crate) const SMOOTHING: [f64; 7] = [0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5];

/// One convention of angles: sums over the samples, for all candidates of the smoothing at once.
struct Problem<'a> {
    dataset: &'a Dataset,
    angles: Angles,
    dissipation: bool,
    smoothing: Vec<f64>,
    /// Names of the columns of the chain.
    names: Vec<String>,
    train: Sums,
    validation: Sums,
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
        let columns = (0..chain).map(unit).collect::<Result<Vec<_>>>()?;
        let slowest = dataset
            .scaling()
            .qd_scale
            .into_iter()
            .fold(f64::INFINITY, f64::min);
        let smoothing = match (dissipation, config.smoothing) {
            (false, _) => vec![slowest],
            (true, Some(speed)) => vec![speed],
            (true, None) => SMOOTHING.map(|part| part * slowest).to_vec(),
        };
        let friction: &[f64] = if dissipation { &smoothing } else { &[] };
        let weights: Vec<f64> = dataset.force_scale().iter().map(|s| 1.0 / s).collect();
        let sums = |samples| sums_of(samples, &columns, friction, &weights);
        Ok(Self {
            train: sums(&dataset.train),
            validation: sums(&dataset.validation),
            dataset,
            angles,
            dissipation,
            smoothing,
            names,
        })
    }

    /// The columns with the Coulomb friction of this candidate.
    fn columns(&self, candidate: usize) -> Vec<usize> {
        let n = self.dataset.coordinates.dof();
        let chain = self.names.len();
        let coulomb = chain + n * (1 + candidate);
        match self.dissipation {
            true => (0..chain + n).chain(coulomb..coulomb + n).collect(),
            false => (0..chain).collect(),
        }
    }

    /// The loss over all samples: a chain has so few parameters that it cannot follow those that it was solved from,
    /// and a validation of slow motions alone may say little.
    fn pooled(&self, found: &Identified) -> f64 {
        let (train, held) = (self.train.count as f64, self.validation.count as f64);
        (found.loss * train + found.validation.unwrap_or(0.0) * held) / (train + held)
    }

    /// The best candidate with these terms, and its loss.
    fn best(&self, terms: Terms) -> Result<Option<(f64, Identified)>> {
        let mut best: Option<(f64, Identified)> = None;
        for candidate in 0..self.smoothing.len() {
            let Some(found) = self.solve(candidate, terms)? else {
                continue;
            };
            let judged = self.pooled(&found);
            if best.as_ref().is_none_or(|(least, _)| judged < *least) {
                best = Some((judged, found));
            }
        }
        Ok(best)
    }

    /// The chain of this candidate; `None` where the sums are not finite.
    fn solve(&self, candidate: usize, terms: Terms) -> Result<Option<Identified>> {
        let chain = self.names.len();
        let columns = self.columns(candidate);
        let allowed = |&k: &usize| self.names.get(k).is_none_or(|name| terms.allow(name));
        let mut free: Vec<usize> = columns.iter().copied().filter(allowed).collect();
        let solution = loop {
            let Some(solution) = self.train.solve(&free) else {
                return Ok(None);
            };
            let friction =
                |&(_, (column, x)): &(usize, (&usize, &f64))| *column >= chain && *x < 0.0;
            let worst = free
                .iter()
                .zip(&solution.values)
                .enumerate()
                .filter(friction)
                .min_by(|a, b| a.1.1.total_cmp(b.1.1));
            match worst {
                Some((at, _)) => free.remove(at),
                None => break solution,
            };
        };
        let place = |of: &[f64]| -> Vec<f64> {
            let value = |column| free.iter().position(|f| f == column).map_or(0.0, |k| of[k]);
            columns.iter().map(value).collect()
        };
        let (values, errors) = (place(&solution.values), place(&solution.errors));
        let (pi, friction) = values.split_at(chain);
        let links = RigidChain::new(self.dataset.coordinates.clone(), self.angles, pi.to_vec())?;
        let motion = if self.dissipation {
            let n = friction.len() / 2;
            let (viscous, coulomb) = friction.split_at(n);
            let dissipation = Dissipation {
                viscous: viscous.into(),
                coulomb: coulomb.into(),
                smoothing: vec![self.smoothing[candidate]; n],
                stribeck: None,
            };
            Mechanical::dissipative(links, dissipation)?
        } else {
            Mechanical::conservative(links)
        };
        Ok(Some(Identified {
            model: Rigid::new(motion, errors)?,
            loss: self.train.loss(&columns, &values),
            validation: (self.validation.count > 0)
                .then(|| self.validation.loss(&columns, &values)),
        }))
    }
}

/// Over columns of the chain, then viscous friction, then Coulomb friction for each smoothing speed.
fn sums_of(samples: &Samples, chain: &[RigidChain], smoothing: &[f64], weights: &[f64]) -> Sums {
    let n = samples.n.max(1);
    let friction = match smoothing.len() {
        0 => 0,
        speeds => n * (1 + speeds),
    };
    Sums::over(samples.len(), chain.len() + friction, weights, |range| {
        let rows = range.start * n..range.end * n;
        let columns = regressor(samples, rows.clone(), chain, smoothing);
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
    let (n, qd) = (samples.n, &samples.qd[rows.clone()]);
    let of_link = |link: &RigidChain| {
        let mut tau = vec![0.0; rows.len()];
        let (q, qdd) = (&samples.q[rows.clone()], &samples.qdd[rows.clone()]);
        let _ = EulerLagrange::new(link, None).inverse_dynamics(q, qd, qdd, &mut tau);
        tau
    };
    let mut columns: Vec<Vec<f64>> = chain.iter().map(of_link).collect();
    let mut friction = |force: &dyn Fn(f64) -> f64| {
        for i in 0..n {
            let own = |(k, v): (usize, &f64)| if k % n == i { force(*v) } else { 0.0 };
            columns.push(qd.iter().enumerate().map(own).collect());
        }
    };
    if !smoothing.is_empty() {
        friction(&|v| v);
    }
    for speed in smoothing {
        friction(&|v| (v / speed).tanh());
    }
    columns
}
