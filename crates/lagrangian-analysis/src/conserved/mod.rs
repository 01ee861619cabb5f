//! Conserved quantities: the energy, momenta, and Noether's charges of translations and rotations, found by measuring the
//! symmetry of L.
//!
//! A symmetry is a direction ξ(q) = A q + b along which L does not change, up to a total derivative dF(q)/dt; its charge
//! Q = ξ·p − F then changes only by the forces, dQ/dt = ξ·(τ − d) (theory.md, equations 78 to 80).

mod charge;
mod drift;
mod generators;
mod states;
mod symmetry;

use serde::Serialize;

pub use charge::Gauge;
pub use drift::{Change, Drift};
pub use generators::Generator;
pub use symmetry::{Symmetry, candidates, points_by_name};

use charge::Charge;
use lagrangian::mechanics::{Applied, Lagrangian};
use lagrangian::rollout::free;
use lagrangian::score::{Grade, Judgement};
use lagrangian::{Error, Model, Result, RolloutOptions, Trajectory, rollout};
use states::States;

/// A model, its Lagrangian and its forces.
#[derive(Clone, Copy)]
pub struct Physics<'a> {
    /// Model that predicts motions.
    pub model: &'a dyn Model,
    /// Lagrangian of the model.
    pub lagrangian: &'a dyn Lagrangian,
    /// Friction of the model, and the map from recorded inputs to forces if the recordings do not contain the forces
    /// themselves.
    pub applied: Applied<'a>,
}

/// Settings of the search for conserved quantities.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ConservedOptions {
    /// Largest violation of a symmetry: the force along its direction relative to inertial forces, r of theory.md (80).
    pub tolerance: f64,
    /// Number of rollouts of the model, each from the first state of a motion; 0 for none.
    pub rollouts: usize,
}

impl Default for ConservedOptions {
    fn default() -> Self {
        Self {
            tolerance: 0.01,
            rollouts: 10,
        }
    }
}

/// A quantity that may be conserved.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Quantity {
    /// Name: `energy`, `momentum of x`, `angular momentum` ….
    pub name: String,
    /// Force along the direction relative to inertial forces, theory.md (80): 0 for a symmetry. It is 0 for the
    /// energy, because L does not depend on time.
    pub violation: f64,
    /// Whether the violation is within the tolerance, so that the model conserves the quantity.
    pub symmetric: bool,
    /// Total derivative that the symmetry needs.
    pub gauge: Gauge,
    /// Scale of the quantity, in its unit: the root mean square of `|ξ|_M |q̇|_M`. Changes are compared with it.
    pub scale: f64,
    /// Drift along the given motions, less the work of forces and friction.
    pub data: Drift,
    /// Drift along rollouts of the model without forces, less the work of its friction.
    pub own: Option<Drift>,
}

impl Quantity {
    /// Agreement of the motions with the model on whether the quantity is conserved; `None` if both let it change.
    #[must_use]
    pub fn judgement(&self) -> Option<Judgement> {
        let of = |drift: &Drift, along: &str| {
            let percent = 100.0 * drift.relative;
            let why = format!("along {along} it changes by {percent:.2} % of its size");
            Judgement::new(Grade::of_change(drift.relative), why)
        };
        let data = of(&self.data, "the motions");
        if !self.symmetric {
            let why = "the motions keep it where the model does not: it missed the symmetry, or these motions do not test it";
            return (data.grade == Grade::Good).then(|| Judgement::new(Grade::Fair, why));
        }
        let own = self
            .own
            .as_ref()
            .map(|own| of(own, "rollouts of the model"));
        let mut drifting = [Some(data), own].into_iter().flatten();
        let first = drifting.find(|judgement| judgement.grade != Grade::Good);
        Some(first.unwrap_or_else(|| Judgement::new(Grade::Good, "")))
    }
}

/// Conserved quantities of a model.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Conserved {
    /// Quantities: first the energy, then the candidates in their order.
    pub quantities: Vec<Quantity>,
    /// A reduced basis of all linear symmetries; `None` if the states are too few or too similar to determine it.
    pub generators: Option<Vec<Generator>>,
    /// Number of states at which the symmetries were measured.
    pub states: usize,
}

/// Maximum number of states at which symmetries are measured.
const MOST_STATES: usize = 2000;

/// Measures the energy and the charges of `symmetries` along `motions`.
///
/// Symmetries are measured at the states of the motions, so these must vary: on one circular orbit a force along x is
/// indistinguishable from a magnetic one.
///
/// # Errors
/// [`Error::Argument`] without motions or for options outside their domain; [`Error::Shape`] for motions or symmetries
/// with other coordinates than the model; as [`Trajectory::validate`]; [`Error::NotFinite`] where L is not finite at a
/// state of a motion.
pub fn conserved(
    physics: &Physics<'_>,
    symmetries: &[Symmetry],
    motions: &[Trajectory],
    options: &ConservedOptions,
) -> Result<Conserved> {
    validate(physics, symmetries, motions, options)?;
    let states = States::of(physics.lagrangian, motions, MOST_STATES)?;
    let mut charges = vec![Charge::energy(&states)];
    let of = |symmetry| Charge::of(symmetry, &states, options.tolerance);
    charges.extend(symmetries.iter().map(of));
    let data = drift::along(physics, &charges, motions)?;
    let own = own_motions(physics, motions, options)?;
    let own = match own.is_empty() {
        true => None,
        false => Some(drift::along(physics, &charges, &own)?),
    };
    let quantity = |(k, charge): (usize, Charge)| Quantity {
        symmetric: charge.violation <= options.tolerance,
        name: charge.name,
        violation: charge.violation,
        gauge: charge.gauge,
        scale: charge.scale,
        data: data[k].clone(),
        own: own.as_ref().map(|own| own[k].clone()),
    };
    Ok(Conserved {
        states: states.len(),
        generators: generators::search(&states, options.tolerance),
        quantities: charges.into_iter().enumerate().map(quantity).collect(),
    })
}

fn validate(
    physics: &Physics<'_>,
    symmetries: &[Symmetry],
    motions: &[Trajectory],
    options: &ConservedOptions,
) -> Result<()> {
    let n = physics.lagrangian.coordinates().dof();
    if motions.iter().all(|motion| motion.len() < 2) {
        let must = "at least one: give recordings, or roll the model out";
        let found = "none of two samples or more";
        return Err(Error::argument("motions", found, must));
    }
    if !(options.tolerance.is_finite() && options.tolerance > 0.0) {
        let must = "a number above 0, e.g. 0.01";
        return Err(Error::argument("tolerance", options.tolerance, must));
    }
    for motion in motions {
        motion.validate()?;
        if !motion.is_empty() {
            motion.check_dof(n)?;
        }
    }
    symmetries.iter().try_for_each(|s| s.validate(n))
}

/// Free motions of the model from the first states of those given, over their times.
fn own_motions(
    physics: &Physics<'_>,
    motions: &[Trajectory],
    options: &ConservedOptions,
) -> Result<Vec<Trajectory>> {
    if !physics.model.moves() {
        return Ok(Vec::new());
    }
    let long = motions.iter().filter(|motion| motion.len() > 1);
    let own = |motion: &Trajectory| {
        let n = motion.dof();
        let (q, qd) = (&motion.q[..n], &motion.qd[..n]);
        let rolled = rollout(
            physics.model,
            q,
            qd,
            &motion.t,
            &free,
            &RolloutOptions::default(),
        );
        rolled.map(|r| r.trajectory)
    };
    let all: Result<Vec<Trajectory>> = long.take(options.rollouts).map(own).collect();
    Ok(all?.into_iter().filter(|motion| motion.len() > 1).collect())
}

#[cfg(test)]
mod tests;
