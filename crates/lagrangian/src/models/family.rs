//! The interface of a family of models: a configuration that can be fitted, and a row of a table.

use std::any::Any;
use std::fmt::Debug;

use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use serde_json::Value;

use super::setup::Setup;
use super::{FAMILIES, Learned, Recursive};
use crate::dataset::{Dataset, Momenta};
use crate::saved::{self, SavedModel};
use crate::train::{AutoSetting, DataFacts, FitSpec, Learner, Loss, Observer, TrainingTask};
use lagrangian_mechanics::integrate::Method;
use lagrangian_motion::settings::{Kind, Setting};
use lagrangian_motion::statistics::sort_by_number;
use lagrangian_motion::{Coordinates, Error, Result};
use nets::simd::Real;

/// A family of models with its settings.
///
/// Implemented by the configuration of each family, such as [`LnnConfig`](crate::LnnConfig).
pub trait Family: Configuration {
    /// The name of the family on the command line and in files.
    fn name(&self) -> &'static str;

    /// The size of the model in a few words.
    fn summary(&self) -> String;

    /// The losses, forces and nominal models that the family can be fitted with.
    fn abilities(&self) -> Abilities;

    /// Refuses data and settings that the family cannot be fitted to, beyond its [`Abilities`].
    ///
    /// # Errors
    /// [`Error::Argument`] for the first refused setting.
    fn check(&self, dataset: &Dataset, task: &TrainingTask) -> Result<()> {
        let _ = (dataset, task);
        Ok(())
    }

    /// What learns the model while it moves by sums of its samples, where the family has such: for these coordinates.
    ///
    /// # Errors
    /// As [`RobotConfig::bodies`](crate::rigid::RobotConfig::bodies).
    fn recursive(&self, coordinates: &Coordinates) -> Result<Option<Recursive>> {
        let _ = coordinates;
        Ok(None)
    }

    /// The momenta, where the model moves in phase space.
    fn momenta(&self) -> Option<&Momenta> {
        None
    }

    /// The plan of a fit to these data.
    ///
    /// # Errors
    /// [`Error::Argument`] for settings outside their domain.
    fn prepare(&self, dataset: &Dataset, task: &TrainingTask) -> Result<Plan>;
}

/// The methods of configurations of any family.
pub trait Configuration: Any + Debug + Send + Sync {
    /// The settings as one JSON object.
    ///
    /// # Errors
    /// [`Error::DamagedModel`], should a setting have no JSON.
    fn settings(&self) -> Result<Value>;

    /// A copy on the heap.
    fn boxed(&self) -> Box<dyn Family>;
}

impl<C: Family + Clone + Serialize> Configuration for C {
    fn settings(&self) -> Result<Value> {
        saved::describe(self)
    }

    fn boxed(&self) -> Box<dyn Family> {
        Box::new(self.clone())
    }
}

/// The losses, forces and nominal models that a family can be fitted with.
#[derive(Debug, Clone, Copy)]
pub struct Abilities {
    /// The losses that the family can be trained with.
    pub losses: &'static [Loss],
    /// The remedy for any other loss.
    pub remedy: &'static str,
    /// Whether the family has a Lagrangian that can be added to a nominal model.
    pub nominal: bool,
    /// Whether the family keeps the inertia of rotors apart from its mass matrix.
    pub rotor: bool,
    /// Whether inertia of drives can be added to a fitted model.
    pub drives: bool,
    /// The number of residuals of a coordinate under a loss of rates: 2 where both halves of the state have rates, else 1.
    pub rates: usize,
    /// Whether the family is fitted in closed form, without an optimiser.
    pub solved: bool,
    /// Whether the family can be kept from depending on a coordinate.
    pub cyclic: bool,
    /// Whether the family is fitted to recordings without the low-pass that was chosen for others.
    pub unfiltered: bool,
}

impl Abilities {
    /// Abilities of these losses, and nothing else.
    pub(crate) const fn of_losses(losses: &'static [Loss], remedy: &'static str) -> Self {
        Self {
            losses,
            remedy,
            nominal: false,
            rotor: false,
            drives: false,
            rates: 1,
            solved: false,
            cyclic: true,
            unfiltered: false,
        }
    }
}

/// The method of a fit.
#[allow(
    missing_debug_implementations,
    reason = "closures and trait objects have nothing to show"
)]
pub enum Plan {
    /// Training by an optimiser.
    Train(Training),
    /// A solution in closed form.
    Solve(Box<Solve>),
}

/// A fit in closed form.
pub type Solve = dyn Fn(&Dataset, &mut dyn Observer) -> Result<Solution> + Send + Sync;

/// The result of a fit in closed form.
#[derive(Debug)]
pub struct Solution {
    /// The fitted model.
    pub model: Learned,
    /// The mean loss on the training samples.
    pub loss: f64,
    /// The mean loss on the validation samples, where they exist.
    pub validation: Option<f64>,
}

/// The kind of the residuals of a [`Trainable`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Residuals {
    /// The residuals of the loss that the fit minimises.
    OfLoss,
    /// The unweighted errors of the rates of the state, for rollouts.
    OfRates,
}

/// A model with everything but its parameters, ready to be trained.
#[allow(
    missing_debug_implementations,
    reason = "trait objects have nothing to show"
)]
pub struct Training(Box<dyn Trainable>);

impl Training {
    /// Evaluates residuals in double precision.
    pub(crate) fn learner(&self, residuals: Residuals) -> BoxedLearner<'_, f64> {
        self.0.learner(residuals)
    }

    /// Evaluates the residuals of the loss, the network in single precision.
    pub(crate) fn single(&self) -> BoxedLearner<'_, f32> {
        self.0.single()
    }

    /// The model with these parameters.
    ///
    /// # Errors
    /// [`Error::NotFinite`] where training has diverged; [`Error::Shape`] for another number of parameters.
    pub fn assemble(&self, parameters: &[f64]) -> Result<Learned> {
        let remedy = "give those of a model of the same shape";
        Error::check_shape("parameters", parameters.len(), self.parameters(), remedy)?;
        self.0.assemble(parameters)
    }

    /// The parameters that a fit with this seed begins with: random weights, and little friction.
    #[must_use]
    pub fn initialise(&self, seed: u64) -> Vec<f64> {
        self.learner(Residuals::OfLoss).initialise(seed)
    }

    /// The number of all parameters.
    #[must_use]
    pub fn parameters(&self) -> usize {
        self.learner(Residuals::OfLoss).parameters()
    }
}

impl Plan {
    /// Training of a network by an optimiser.
    pub(crate) fn train(network: impl Trained + 'static, setup: Setup) -> Self {
        Self::Train(Training(Box::new(NetworkTraining { network, setup })))
    }
}

/// A model in training in either precision, see the methods of [`Training`].
trait Trainable: Send + Sync {
    fn learner(&self, residuals: Residuals) -> BoxedLearner<'_, f64>;
    fn single(&self) -> BoxedLearner<'_, f32>;
    fn assemble(&self, parameters: &[f64]) -> Result<Learned>;
}

/// A learner of a training.
pub(crate) type BoxedLearner<'a, T> = Box<dyn Learner<T> + 'a>;

/// The training of a network of a family in either precision, from which a [`Trainable`] is made.
pub(crate) trait Trained: Send + Sync {
    /// Evaluates residuals, the network in this precision.
    fn learner<'a, T: Real>(&'a self, setup: &'a Setup, of: Residuals) -> BoxedLearner<'a, T>;

    /// The model with these parameters.
    ///
    /// # Errors
    /// [`Error::NotFinite`] where training has diverged.
    fn assemble(&self, setup: &Setup, parameters: &[f64]) -> Result<Learned>;
}

/// A network with everything but its weights, and the part of its fit that does not depend on it.
struct NetworkTraining<N> {
    network: N,
    setup: Setup,
}

impl<N: Trained> Trainable for NetworkTraining<N> {
    fn learner(&self, residuals: Residuals) -> BoxedLearner<'_, f64> {
        self.network.learner(&self.setup, residuals)
    }

    fn single(&self) -> BoxedLearner<'_, f32> {
        self.network.learner(&self.setup, Residuals::OfLoss)
    }

    fn assemble(&self, parameters: &[f64]) -> Result<Learned> {
        self.network.assemble(&self.setup, parameters)
    }
}

/// A row of the table of families.
#[derive(Debug, Clone, Copy)]
pub struct Entry {
    /// The name on the command line and in files.
    pub name: &'static str,
    /// A description of the family in one line.
    pub about: &'static str,
    /// The default configuration.
    pub default: fn() -> Box<dyn Family>,
    /// The settings of the family and of the forces beside it.
    pub settings: &'static [Setting],
    /// The choices of the family for settings and the loss that a request omits.
    ///
    /// # Errors
    /// [`Error::Setting`] for settings that exclude each other.
    pub choose: fn(&DataFacts, &FitSpec) -> Result<Vec<AutoSetting>>,
    /// Reads a configuration from its JSON object.
    pub read: fn(Value) -> serde_json::Result<Box<dyn Family>>,
    /// The names under which its models are saved.
    pub saved_as: &'static [&'static str],
    /// Loads a saved model.
    pub load: fn(&SavedModel) -> Result<Learned>,
    /// How it is tried where a request names no family; empty for a family that is only fitted by name.
    pub candidates: &'static [Candidate],
    /// Whether it describes machines of joints, whose angles are measured from the link before.
    pub jointed: bool,
}

/// A model that is tried where a request names no family.
#[derive(Debug, Clone, Copy)]
pub struct Candidate {
    /// The place among the models that are tried: those that take most for granted come first.
    pub rank: u8,
    /// What its name says after that of the family.
    pub with: &'static str,
    /// The settings that are not the defaults.
    pub settings: &'static [(&'static str, &'static str)],
    /// Whether it learns the accelerations of the motion, whatever forces were recorded.
    pub by_motion: bool,
    /// Whether no other model is tried where this one is.
    pub alone: bool,
    /// Whether it is tried on these data, with the description of a robot or without.
    pub on: fn(data: &Dataset, robot: bool) -> bool,
}

/// The setting that learns friction beside a free motion.
pub(crate) const DAMPED: (&str, &str) = ("forces", r#"["viscous", "drag", "coulomb"]"#);

/// A family of earlier versions that is an experiment now.
pub(crate) const EXPERIMENT: &str = "features";

pub(crate) fn experiment() -> Error {
    Error::setting(
        "random features are no longer a `family`, but an experiment",
        "run `cargo run --release -p experiments -- features` in the sources, or take `family` lnn",
    )
}

impl Entry {
    /// The family of this name.
    ///
    /// # Errors
    /// [`Error::UnknownName`], with the known names; [`Error::Setting`] for one that is an experiment now.
    pub fn by_name(name: &str) -> Result<&'static Self> {
        if name == EXPERIMENT {
            return Err(experiment());
        }
        let found = FAMILIES.iter().find(|entry| entry.name == name);
        found.ok_or_else(|| Error::UnknownName {
            kind: "family",
            name: name.into(),
            known: FAMILIES
                .iter()
                .map(|entry| entry.name)
                .collect::<Vec<_>>()
                .join(", "),
        })
    }
}

impl Candidate {
    /// With its defaults.
    pub(crate) const fn new(rank: u8, on: fn(&Dataset, bool) -> bool) -> Self {
        Self {
            rank,
            with: "",
            settings: &[],
            by_motion: false,
            alone: false,
            on,
        }
    }

    /// On motions, by their accelerations.
    pub(crate) const fn of_motion(
        rank: u8,
        with: &'static str,
        settings: &'static [(&'static str, &'static str)],
    ) -> Self {
        Self {
            with,
            settings,
            by_motion: true,
            ..Self::new(rank, |data, robot| !robot && data.train.goal.is_empty())
        }
    }

    /// As [`Candidate::of_motion`], on free motions alone.
    pub(crate) const fn of_free(
        rank: u8,
        with: &'static str,
        settings: &'static [(&'static str, &'static str)],
    ) -> Self {
        Self {
            on: |data, robot| !robot && !data.forced && data.train.goal.is_empty(),
            ..Self::of_motion(rank, with, settings)
        }
    }
}

impl Entry {
    /// Whether the family has a setting of this name.
    #[must_use]
    pub fn has(&self, name: &str) -> bool {
        self.settings.iter().any(|setting| setting.name == name)
    }

    /// The models that are tried on these data, with the description of a robot or without.
    pub(crate) fn tried(data: &Dataset, robot: bool) -> Vec<(&'static Self, &'static Candidate)> {
        let own = |entry: &'static Self| entry.candidates.iter().map(move |own| (entry, own));
        let all = FAMILIES.iter().flat_map(own);
        let mut all: Vec<_> = all.filter(|(_, own)| (own.on)(data, robot)).collect();
        sort_by_number(&mut all, |(_, own)| f64::from(own.rank));
        let alone = all.iter().find(|(_, own)| own.alone).copied();
        alone.map_or(all, |alone| vec![alone])
    }

    /// Whether it takes the description of a robot.
    #[must_use]
    pub fn takes_a_robot(&self) -> bool {
        self.robot().is_some()
    }

    /// The first family that takes a robot.
    pub(crate) fn by_robot() -> Option<&'static Self> {
        FAMILIES.iter().find(|entry| entry.robot().is_some())
    }

    /// The setting of this family whose value is a robot, where it has one.
    fn robot(&self) -> Option<&'static Setting> {
        self.settings.iter().find(|s| s.kind == Kind::Robot)
    }

    /// The setting that takes a robot: that of the family of this name, or of the first family that takes one.
    ///
    /// # Errors
    /// [`Error::UnknownName`]; [`Error::Setting`] for a family without such a setting.
    pub fn taking_a_robot(family: Option<&str>) -> Result<&'static Setting> {
        let all = || {
            FAMILIES
                .iter()
                .filter_map(|entry| Some((entry.name, entry.robot()?)))
        };
        let found = match family {
            Some(family) => Self::by_name(family)?.robot(),
            None => Self::by_robot().and_then(Self::robot),
        };
        found.ok_or_else(|| {
            let others: Vec<&str> = all().map(|(name, _)| name).collect();
            let others = others.join(" or ");
            let family = family.unwrap_or_default();
            Error::setting(
                format!("`urdf` is for `family` {others}, not for {family}"),
                format!("give the robot as `nominal`, or take `family` {others}"),
            )
        })
    }
}

/// The choices of a family that chooses nothing from the data.
pub(crate) fn no_choice(_: &DataFacts, _: &FitSpec) -> Result<Vec<AutoSetting>> {
    Ok(Vec::new())
}

/// The width for motions whose accelerations are uncertain: few enough parameters to be refined.
pub(crate) fn narrow(known: &DataFacts) -> Option<AutoSetting> {
    const NARROW: usize = 32;
    let reason = format!("{}: they determine few weights", known.certainty());
    known
        .uncertain()
        .then(|| AutoSetting::new("width", NARROW, reason))
}

/// Reads a configuration for a row of the table.
pub(crate) fn read<F: Family + for<'a> Deserialize<'a>>(
    settings: Value,
) -> serde_json::Result<Box<dyn Family>> {
    Ok(Box::new(serde_json::from_value::<F>(settings)?))
}

/// The default configuration for a row of the table.
pub(crate) fn default<F: Family + Default>() -> Box<dyn Family> {
    Box::new(F::default())
}

/// The largest limit of speed, as a multiple of the fastest velocity of the data.
const FARTHEST: f64 = 1e3;

/// Refuses a limit of speed that the data exceed or do not show, or that has no gradient through a rollout.
pub(crate) fn check_speed_limit(
    limit: Option<f64>,
    dataset: &Dataset,
    task: &TrainingTask,
) -> Result<()> {
    let argument = |name, value, must| Err(Error::Argument { name, value, must });
    match limit {
        Some(_) if task.loss == Loss::ROLLOUT => {
            let must = "acceleration under a speed limit: a rollout has no gradient through it";
            argument("loss", task.loss.name().into(), must)
        }
        Some(limit) if dataset.fastest() >= limit => {
            let value = dataset.fastest().to_string();
            let must = "below the speed limit";
            argument("fastest velocity of the data", value, must)
        }
        Some(limit) if limit > FARTHEST * dataset.fastest() => {
            let must = "at most 1000 times the fastest velocity of the data: they say nothing of a limit that is farther, omit it";
            argument("speed limit", limit.to_string(), must)
        }
        _ => Ok(()),
    }
}

/// Refuses a rollout of an equation of first order by a method that needs dq/dt = q̇.
pub(crate) fn check_first_order(task: &TrainingTask) -> Result<()> {
    if task.loss != Loss::ROLLOUT || task.rollout.integrator != Method::StormerVerlet {
        return Ok(());
    }
    Err(Error::argument(
        "integrator",
        Method::StormerVerlet.name(),
        "rk4 or implicit-midpoint (symplectic as well) for an equation of first order: the leapfrog needs dq/dt = q̇",
    ))
}

impl dyn Family {
    /// The configuration, if it is one of family `F`.
    #[must_use]
    pub fn downcast_ref<F: Family>(&self) -> Option<&F> {
        (self as &dyn Any).downcast_ref()
    }

    /// The configuration, if it is one of family `F`, to be changed.
    #[must_use]
    pub fn downcast_mut<F: Family>(&mut self) -> Option<&mut F> {
        (self as &mut dyn Any).downcast_mut()
    }
}

impl<F: Family> From<F> for Box<dyn Family> {
    fn from(family: F) -> Self {
        Box::new(family)
    }
}

impl Clone for Box<dyn Family> {
    fn clone(&self) -> Self {
        self.boxed()
    }
}

impl PartialEq for dyn Family {
    fn eq(&self, other: &Self) -> bool {
        self.name() == other.name() && self.settings().ok() == other.settings().ok()
    }
}

/// Comparison for derived comparisons of structs that hold a boxed family.
impl PartialEq<&Self> for Box<dyn Family> {
    fn eq(&self, other: &&Self) -> bool {
        **self == ***other
    }
}

/// The key of the family's name among its settings.
const NAME: &str = "name";

impl Serialize for dyn Family {
    fn serialize<S: Serializer>(&self, serializer: S) -> std::result::Result<S::Ok, S::Error> {
        let mut settings = self.settings().map_err(serde::ser::Error::custom)?;
        if let Value::Object(settings) = &mut settings {
            settings.insert(NAME.into(), self.name().into());
        }
        settings.serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for Box<dyn Family> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> std::result::Result<Self, D::Error> {
        let mut settings = serde_json::Map::<String, Value>::deserialize(deserializer)?;
        let name = settings.remove(NAME);
        let name = name.as_ref().and_then(Value::as_str).unwrap_or_default();
        let entry = Entry::by_name(name).map_err(D::Error::custom)?;
        (entry.read)(Value::Object(settings)).map_err(D::Error::custom)
    }
}
