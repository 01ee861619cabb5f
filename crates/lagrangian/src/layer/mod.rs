//! A model as a differentiable layer: its equation of motion for a batch of states, and the sensitivities of any loss that is
//! computed from it.
//!
//! A [`Layer`] provides for a program of automatic differentiation the value y = f(x; θ) of a [`Map`], and for a
//! sensitivity g = ∂loss/∂y the products gᵀ ∂f/∂x and gᵀ ∂f/∂θ. They are exact, by the adjoints that train the models
//! themselves (theory.md, sections 5, 14 and 23), without difference quotients, and in double precision.
//!
//! | symbol | meaning | shape |
//! |---|---|---|
//! | q | coordinates | `[m, n]` |
//! | v | q̇; of Hamiltonian networks the momenta p, of a neural ODE of first order its second half z | `[m, n]` |
//! | u | τ (the inputs, where the model has an actuation); of [`Map::Force`] q̈ | `[m, n]` |
//! | θ | weights of the network, then the parameters of friction and actuation | |
//!
//! ```
//! use lagrangian::layer::{Inputs, Layer, Map};
//! use lagrangian::{Coordinates, FitConfig};
//!
//! // A fresh Lagrangian network of a pendulum; `Layer::of` takes a fitted model.
//! let mut layer = Layer::new(Coordinates::angles(1), &FitConfig::default())?;
//! let states = Inputs { q: &[0.3, 1.0], v: &[0.0, -0.5], u: &[] };
//! let qdd = layer.evaluate(Map::Acceleration, &states)?;
//!
//! // One step of gradient descent on Σ q̈².
//! let g: Vec<f64> = qdd.iter().map(|a| 2.0 * a).collect();
//! let slopes = layer.pull_back(Map::Acceleration, &states, &g)?;
//! let mut weights = layer.parameters().to_vec();
//! weights.iter_mut().zip(&slopes.parameters).for_each(|(w, s)| *w -= 1e-4 * s);
//! layer.set_parameters(&weights)?;
//! let after = layer.evaluate(Map::Acceleration, &states)?;
//! let loss = |qdd: &[f64]| qdd.iter().map(|a| a * a).sum::<f64>();
//! assert!(loss(&after) < loss(&qdd));
//! # Ok::<(), lagrangian::Error>(())
//! ```

mod backward;
mod forward;
mod lane;
mod unit;

use std::sync::Arc;

use crate::fit::FitConfig;
use crate::models::{Learned, Residuals, Training};
use lagrangian_mechanics::dynamics::Model;
use lagrangian_motion::{Coordinates, Error, Result};
use nets::Packed;

/// A function of a state that a [`Layer`] computes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Map {
    /// Forward dynamics (q, q̇, τ) → q̈, `[m, n]`, of models with dq/dt = q̇.
    Acceleration,
    /// The right-hand side of the motion (q, v, τ) → (dq/dt, dv/dt), `[m, 2n]`, of every model.
    Rates,
    /// Inverse dynamics (q, q̇, q̈) → τ, `[m, n]`, of models with a Lagrangian; where it is not unique, as with a joint that
    /// is not driven, it has no derivative.
    Force,
    /// One step of the classical Runge–Kutta method over this time, s, under held τ: (q, v, τ) → (q, v) after it, `[m, 2n]`.
    Step(f64),
    /// The learned scalar, J, `[m]`: L(q, q̇), or H(q, p) of Hamiltonian networks. u is ignored.
    Scalar,
}

/// The states at which a [`Map`] is evaluated, all `[m, n]`, row by row.
#[derive(Debug, Clone, Copy)]
pub struct Inputs<'a> {
    /// Coordinates q.
    pub q: &'a [f64],
    /// Velocities, or momenta of a Hamiltonian network.
    pub v: &'a [f64],
    /// Forces τ, or the accelerations of [`Map::Force`]; empty for none.
    pub u: &'a [f64],
}

/// The sensitivities of a loss to all arguments of a [`Map`].
#[derive(Debug, Clone, PartialEq)]
pub struct Slopes {
    /// ∂loss/∂q, `[m, n]`.
    pub q: Vec<f64>,
    /// ∂loss/∂v, `[m, n]`.
    pub v: Vec<f64>,
    /// ∂loss/∂u, `[m, n]`, also where u was empty.
    pub u: Vec<f64>,
    /// ∂loss/∂θ, in the order of [`Layer::parameters`].
    pub parameters: Vec<f64>,
}

/// A model as a differentiable layer; see the [module](self).
#[derive(Clone)]
pub struct Layer {
    training: Arc<Training>,
    model: Learned,
    parameters: Vec<f64>,
    packed: Packed<f64>,
}

impl std::fmt::Debug for Layer {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let model = self.model.family();
        write!(f, "Layer({model}, {} parameters)", self.parameters.len())
    }
}

impl Layer {
    /// The layer of a fitted model.
    ///
    /// # Errors
    /// [`Error::Setting`] for a model without weights that a gradient step could change: of the families rigid, chain,
    /// features and servo, with a nominal robot, with a limit of speed, of torques alone, of a Hamiltonian with friction, or
    /// with parameters among its coordinates.
    pub fn of(model: &Learned) -> Result<Self> {
        if model.coordinates().parameters().next().is_some() {
            return Err(Error::setting(
                "a layer has no derivative by coordinates that are parameters",
                "fit a model whose coordinates all move",
            ));
        }
        let (training, parameters) = model.in_training()?;
        Self::assembled(Arc::new(training), parameters)
    }

    /// The layer of a fresh model with the family, the forces and the seed of `config` and random weights. All scales are one:
    /// give states, velocities, accelerations and forces of order one.
    ///
    /// # Errors
    /// As [`Layer::of`]; [`Error::Argument`] for settings outside their domain.
    pub fn new(coordinates: Coordinates, config: &FitConfig) -> Result<Self> {
        Self::of(&unit::fresh(coordinates, config)?)
    }

    fn assembled(training: Arc<Training>, parameters: Vec<f64>) -> Result<Self> {
        Error::check_finite("parameters of the layer", &parameters)?;
        let model = training.assemble(&parameters)?;
        let learner = training.0.learner(Residuals::OfRates);
        let net = learner.net();
        let packed = Packed::of(net, &parameters[..net.parameters])?;
        drop(learner);
        Ok(Self {
            training,
            model,
            parameters,
            packed,
        })
    }

    /// The coordinates of the states.
    #[must_use]
    pub fn coordinates(&self) -> &Coordinates {
        self.model.coordinates()
    }

    /// The model with the parameters of the layer.
    #[must_use]
    pub fn model(&self) -> &Learned {
        &self.model
    }

    /// Whether v are momenta p and the model moves by a Hamiltonian.
    #[must_use]
    pub fn moves_in_momenta(&self) -> bool {
        self.model.hamiltonian().is_some_and(|h| h.canonical())
    }

    /// All parameters: weights layer by layer (matrices row-major, then biases), then those of friction and actuation.
    #[must_use]
    pub fn parameters(&self) -> &[f64] {
        &self.parameters
    }

    /// Replaces all parameters.
    ///
    /// # Errors
    /// [`Error::Shape`] for another number, [`Error::NotFinite`], [`Error::Argument`] for parameters outside their domain
    /// (see [`Layer::project`]); the layer then keeps its own.
    pub fn set_parameters(&mut self, parameters: &[f64]) -> Result<()> {
        *self = self.with_parameters(parameters)?;
        Ok(())
    }

    /// A layer of this model with other parameters.
    ///
    /// # Errors
    /// As [`Layer::set_parameters`].
    pub fn with_parameters(&self, parameters: &[f64]) -> Result<Self> {
        Self::assembled(Arc::clone(&self.training), parameters.to_vec())
    }

    /// Moves parameters to the nearest values in their domain: some weights of a convex Lagrangian and coefficients of friction
    /// must not be negative. Call it after each step of an optimiser of your own.
    ///
    /// # Errors
    /// [`Error::Shape`] for another number of parameters.
    pub fn project(&self, parameters: &mut [f64]) -> Result<()> {
        let (found, expected) = (parameters.len(), self.parameters.len());
        Error::check_shape("parameters", found, expected, "give those of this layer")?;
        self.training
            .0
            .learner(Residuals::OfRates)
            .project(parameters);
        Ok(())
    }

    /// Random parameters; a seed determines them.
    #[must_use]
    pub fn initialise(&self, seed: u64) -> Vec<f64> {
        self.training.initialise(seed)
    }

    /// The number of states of some inputs, which must be arrays of finite numbers that belong together.
    fn states(&self, inputs: &Inputs<'_>) -> Result<usize> {
        let n = self.coordinates().dof();
        let remedy = "give n values for each state, as many states of q and v, and of u or none";
        let m = inputs.q.len() / n;
        Error::check_shape("q", inputs.q.len(), m * n, remedy)?;
        Error::check_shape("v", inputs.v.len(), m * n, remedy)?;
        if !inputs.u.is_empty() {
            Error::check_shape("u", inputs.u.len(), m * n, remedy)?;
        }
        for (name, values) in [("q", inputs.q), ("v", inputs.v), ("u", inputs.u)] {
            Error::check_finite(name, values)?;
        }
        Ok(m)
    }

    /// The number of values of a map at each state.
    fn width(&self, map: Map) -> usize {
        let n = self.coordinates().dof();
        match map {
            Map::Acceleration | Map::Force => n,
            Map::Rates | Map::Step(_) => 2 * n,
            Map::Scalar => 1,
        }
    }

    /// The error for a map that the model does not have.
    fn unsupported(&self, map: Map) -> Error {
        let family = self.model.family();
        let (what, remedy) = match map {
            Map::Scalar => ("scalar", "take lnn, delan, vin or hnn"),
            Map::Force => ("inverse dynamics in (q, q̇)", "take lnn, delan or vin"),
            _ => (
                "forward dynamics in (q, q̇)",
                "take its rates or a step of them",
            ),
        };
        Error::setting(
            format!("this model of the family {family} has no {what}"),
            remedy,
        )
    }
}

/// The error for a state at which a map has no value or no derivative.
fn undefined(what: &str, state: usize) -> Error {
    Error::setting(
        format!(
            "the {what} of the layer is not finite at state {state}, or its mass matrix is singular there"
        ),
        "leave that state out, or bound the weights or the step",
    )
}

#[cfg(test)]
mod tests;
