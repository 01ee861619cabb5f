//! Analytic Lagrangians: one system per file, each written once over a generic scalar.
//!
//! Dual numbers give the derivatives exactly, so these are the reference that learned models are measured
//! against, and the source of training data: there is no separate simulator.
//!
//! A new system is one file that implements [`System`], and one line in the table below.

mod derivatives;
mod parameter;

pub use derivatives::Analytic;
#[doc(hidden)]
pub use derivatives::{ClosedForm, DualJets, OverDuals};
pub use num_dual::{Dual64, DualNum, HyperDual64};
pub use parameter::{Domain, Parameter};
pub use rand::Rng;

use super::lagrangian::Lagrangian;
use crate::dynamics::Model;
pub use lagrangian_motion::noise::normal;
use lagrangian_motion::{Coordinate, Coordinates, Error, Result, State, Topology};

/// A mechanical system whose Lagrangian is known in closed form.
pub trait System: Send + Sync + Sized + 'static {
    /// Name on the command line and in files.
    const NAME: &'static str;
    /// Description, in one line.
    const ABOUT: &'static str;
    /// Parameters, in the order that [`System::new`] takes them.
    const PARAMETERS: &'static [Parameter];

    /// The system with these values, one for each of [`System::PARAMETERS`] and within its domain.
    fn new(values: &[f64]) -> Self;

    /// Coordinates of the system.
    fn coordinates(&self) -> Coordinates;

    /// L(q, q̇), J, over any scalar.
    fn lagrangian<D: DualNum<Primitive = f64> + Copy>(&self, q: &[D], qd: &[D]) -> D;

    /// A state from the distribution that models of this system are trained on.
    fn sample_state(&self, rng: &mut dyn Rng) -> State;

    /// A state from the distribution that rollouts of this system are tested from.
    fn sample_start(&self, rng: &mut dyn Rng) -> State {
        self.sample_state(rng)
    }
}

/// An analytic system of any type: a model that has a Lagrangian and samples its states.
pub trait AnalyticModel: Model {
    /// Name, as in [`systems`].
    fn name(&self) -> &str;

    /// Lagrangian of the system.
    fn lagrangian(&self) -> &dyn Lagrangian;

    /// A state from the distribution that models of this system are trained on.
    fn sample_state(&self, rng: &mut dyn Rng) -> State;

    /// A state from the distribution that rollouts of this system are tested from.
    fn sample_start(&self, rng: &mut dyn Rng) -> State;
}

/// One line of the table of systems.
#[derive(Debug)]
pub struct SystemEntry {
    /// Name on the command line and in files.
    pub name: &'static str,
    /// Description, in one line.
    pub about: &'static str,
    /// Parameters with their default values.
    pub parameters: &'static [Parameter],
    build: fn(&[f64]) -> Box<dyn AnalyticModel>,
}

impl SystemEntry {
    const fn of<S: System>() -> Self {
        fn build<S: System>(values: &[f64]) -> Box<dyn AnalyticModel> {
            Box::new(Analytic::new(S::new(values)))
        }
        Self {
            name: S::NAME,
            about: S::ABOUT,
            parameters: S::PARAMETERS,
            build: build::<S>,
        }
    }

    /// The system with the named parameters set; the others have the values of the table.
    ///
    /// # Errors
    /// [`Error::UnknownName`] for a parameter that the system does not have, [`Error::Argument`] for a value outside
    /// its domain.
    pub fn build(&self, parameters: &[(&str, f64)]) -> Result<Box<dyn AnalyticModel>> {
        let mut values: Vec<f64> = self.parameters.iter().map(|p| p.value).collect();
        for &(name, value) in parameters {
            let index = self
                .parameters
                .iter()
                .position(|p| p.name == name)
                .ok_or_else(|| {
                    unknown("parameter", name, self.parameters.iter().map(|p| p.name))
                })?;
            self.parameters[index].check(value)?;
            values[index] = value;
        }
        Ok((self.build)(&values))
    }
}

/// Declares a system with only numeric parameters: the struct of its parameters with their domains, units and
/// usual values, and [`System`] with the methods that follow.
macro_rules! system {
    (
        $(#[$doc:meta])*
        pub struct $system:ident = $name:literal, $about:literal {
            $($(#[$about_field:meta])* $field:ident: $domain:ident($unit:literal, $value:literal),)*
        }
        $($methods:tt)*
    ) => {
        $(#[$doc])*
        #[derive(Debug, Clone, PartialEq)]
        pub struct $system {
            $($(#[$about_field])* pub $field: f64,)*
        }

        impl System for $system {
            const NAME: &'static str = $name;
            const ABOUT: &'static str = $about;
            const PARAMETERS: &'static [Parameter] =
                &[$(Parameter::$domain(stringify!($field), $unit, $value)),*];

            fn new(values: &[f64]) -> Self {
                let mut values = values.iter().copied();
                Self { $($field: values.next().unwrap_or($value)),* }
            }

            $($methods)*
        }
    };
}

macro_rules! table {
    ($($module:ident::{$($system:ident),*},)*) => {
        $(mod $module; pub use $module::{$($system),*};)*
        const SYSTEMS: &[SystemEntry] = &[$($(SystemEntry::of::<$system>()),*),*];
    };
}

table! {
    mass_spring::{MassSpring},
    pendulum::{Pendulum},
    double_pendulum::{DoublePendulum},
    n_link_pendulum::{NLinkPendulum},
    cart_pole::{CartPole},
    furuta_pendulum::{FurutaPendulum},
    two_link_arm::{TwoLinkArm},
    relativistic_particle::{RelativisticParticle, RelativisticParticlePublished},
    charged_particle::{ChargedParticle},
    magnetic_mirror::{MagneticMirror},
    kepler::{Kepler},
    n_body::{NBody},
}

/// All analytic systems.
#[must_use]
pub fn systems() -> &'static [SystemEntry] {
    SYSTEMS
}

/// The system of this name, with some of its parameters set.
///
/// ```
/// let pendulum = lagrangian_mechanics::analytic::by_name("pendulum", &[("length", 2.0)])?;
/// assert_eq!(pendulum.coordinates().dof(), 1);
/// # Ok::<(), lagrangian_motion::Error>(())
/// ```
///
/// # Errors
/// [`Error::UnknownName`] where no system or parameter has that name, [`Error::Argument`] for a value outside
/// its domain.
pub fn by_name(name: &str, parameters: &[(&str, f64)]) -> Result<Box<dyn AnalyticModel>> {
    let entry = SYSTEMS.iter().find(|entry| entry.name == name);
    entry
        .ok_or_else(|| unknown("system", name, SYSTEMS.iter().map(|entry| entry.name)))?
        .build(parameters)
}

fn unknown<'a>(kind: &'static str, name: &str, known: impl Iterator<Item = &'a str>) -> Error {
    let known = known.collect::<Vec<_>>().join(", ");
    Error::UnknownName {
        kind,
        name: name.into(),
        known,
    }
}

/// `n` uniform deviates from `low` to `high`.
pub fn uniform(rng: &mut dyn Rng, n: usize, low: f64, high: f64) -> Vec<f64> {
    use rand::RngExt;
    (0..n)
        .map(|_| low + (high - low) * rng.random::<f64>())
        .collect()
}
