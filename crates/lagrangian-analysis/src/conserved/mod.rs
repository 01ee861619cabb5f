//! What is conserved: energy, momenta, and Noether's charges of shifts and turns, found by measuring the symmetry.
//!
//! A symmetry is a direction ξ(q) = A q + b of which L takes no notice, up to a total derivative dF(q)/dt; its charge
//! Q = ξ·p − F then changes only by the forces, dQ/dt = ξ·(τ − d) (theory.md, equations 78 to 80).
//!
//! ```
//! use lagrangian::analytic::by_name;
//! use lagrangian_analysis::conserved::{Conserved, ConservedOptions, Physics, candidates, conserved};
//! use lagrangian::rollout::{RolloutOptions, free, rollout, times};
//!
//! let planet = by_name("kepler", &[])?;
//! let orbit = rollout(&*planet, &[1.0, 0.0], &[0.0, 1.2], &times(10.0, 0.05)?, &free, &RolloutOptions::default())?;
//! let turns = candidates(planet.coordinates(), &[vec![0, 1]])?;
//! let physics = Physics { model: &*planet, lagrangian: planet.lagrangian(), dissipation: None, actuation: None };
//! let found: Conserved = conserved(&physics, &turns, &[orbit.trajectory], &ConservedOptions::default())?;
//! let names: Vec<&str> = found.quantities.iter().filter(|q| q.symmetric).map(|q| q.name.as_str()).collect();
//! assert_eq!(names, ["energy", "angular momentum"]);
//! # Ok::<(), lagrangian::Error>(())
//! ```

mod charge;
mod drift;
mod generators;
mod states;
mod symmetry;

use serde::Serialize;

pub use charge::Gauge;
pub use drift::Drift;
pub use generators::Generator;
pub use symmetry::{Symmetry, candidates, points_by_name};

use charge::Charge;
use lagrangian::dynamics::Model;
use lagrangian::lagrangian::{Actuation, Dissipation, Lagrangian};
use lagrangian::rollout::{RolloutOptions, free, rollout};
use lagrangian::{Error, Result, Trajectory};
use states::States;

/// A model, its Lagrangian and its forces.
#[derive(Clone, Copy)]
pub struct Physics<'a> {
    /// What is rolled out.
    pub model: &'a dyn Model,
    /// Its Lagrangian.
    pub lagrangian: &'a dyn Lagrangian,
    /// Its friction, where it has any.
    pub dissipation: Option<&'a Dissipation>,
    /// How its forces come from what is recorded, where that is not the forces themselves.
    pub actuation: Option<&'a Actuation>,
}

/// How conserved quantities are looked for.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ConservedOptions {
    /// Largest force along a direction, of the inertial forces, at which it counts as a symmetry: r of theory.md (80).
    pub tolerance: f64,
    /// Rollouts of the model's own, each from the first state of a motion; 0 for none.
    pub rollouts: usize,
    /// How they are computed.
    pub rollout: RolloutOptions,
    /// Look for linear directions that nobody named.
    pub search: bool,
}

impl Default for ConservedOptions {
    fn default() -> Self {
        Self {
            tolerance: 0.01,
            rollouts: 10,
            rollout: RolloutOptions::default(),
            search: true,
        }
    }
}

/// One quantity that may be conserved.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Quantity {
    /// `energy`, `momentum of x`, `angular momentum` ….
    pub name: String,
    /// Force along its direction, of the inertial forces: 0 for a symmetry, theory.md (80). 0 for the energy: L does
    /// not depend on time.
    pub violation: f64,
    /// Whether that is within the tolerance, so that the model conserves it.
    pub symmetric: bool,
    /// The part of F that was needed.
    pub gauge: Gauge,
    /// What one is to hold changes of its value against: root mean square of |ξ|_M |q̇|_M, in its unit.
    pub scale: f64,
    /// Along the motions that were given, the work of forces and friction taken off.
    pub data: Drift,
    /// Along the model's own motions without forces, its friction taken off.
    pub own: Option<Drift>,
}

/// What was found.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Conserved {
    /// Energy first, then the candidates in their order.
    pub quantities: Vec<Quantity>,
    /// All linear directions that are symmetries, as a reduced basis; `None` where they were not looked for.
    pub generators: Option<Vec<Generator>>,
    /// States that the symmetries were measured at.
    pub states: usize,
}

/// States that symmetries are measured at, at most.
const MOST_STATES: usize = 2000;

/// Measures the energy and the charges of `symmetries` along `motions`.
///
/// Symmetries are measured at the states of the motions, so these must differ: on one circular orbit a force along x is
/// indistinguishable from a magnetic one.
///
/// # Errors
/// [`Error::Argument`] without motions or for options outside their domain; [`Error::Shape`] where motions or symmetries
/// have other coordinates than the model; as [`Trajectory::validate`]; [`Error::NotFinite`] where L is not finite at a
/// state of a motion.
pub fn conserved(
    physics: &Physics<'_>,
    symmetries: &[Symmetry],
    motions: &[Trajectory],
    options: &ConservedOptions,
) -> Result<Conserved> {
    validate(physics, symmetries, motions, options)?;
    let states = States::of(physics.lagrangian, motions, MOST_STATES)?;
    let charges: Vec<Charge> = std::iter::once(Charge::energy(&states))
        .chain(
            symmetries
                .iter()
                .map(|s| Charge::of(s, &states, options.tolerance)),
        )
        .collect();
    let data = drift::along(physics, &charges, motions, true)?;
    let own = own_motions(physics, motions, options)?;
    let own = match own.is_empty() {
        true => None,
        false => Some(drift::along(physics, &charges, &own, false)?),
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
        generators: options
            .search
            .then(|| generators::search(&states, options.tolerance))
            .flatten(),
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
        return Err(Error::Argument {
            name: "motions",
            value: "none of two samples or more".into(),
            must: "at least one: give recordings, or roll the model out",
        });
    }
    if !(options.tolerance.is_finite() && options.tolerance > 0.0) {
        return Err(Error::Argument {
            name: "tolerance",
            value: options.tolerance.to_string(),
            must: "a number above 0, e.g. 0.01",
        });
    }
    for motion in motions {
        motion.validate()?;
        let found = motion.dof();
        if found != n && !motion.is_empty() {
            return Err(Error::Shape {
                what: format!("a state of '{}'", motion.name),
                found,
                expected: n,
                remedy: "give motions of the model's coordinates".into(),
            });
        }
    }
    symmetries
        .iter()
        .try_for_each(|symmetry| symmetry.validate(n))
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
        rollout(physics.model, q, qd, &motion.t, &free, &options.rollout).map(|r| r.trajectory)
    };
    let all: Result<Vec<Trajectory>> = long.take(options.rollouts).map(own).collect();
    Ok(all?.into_iter().filter(|motion| motion.len() > 1).collect())
}

#[cfg(test)]
mod tests;
