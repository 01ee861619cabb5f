//! `fit`: from a dataset to a model.

use std::ops::ControlFlow;
use std::time::Instant;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use super::adam::{Adam, AdamConfig};
use super::batch::{Batches, Samples, Value};
use super::checkpoint::Checkpoint;
use super::damping::DampingRule;
use super::descent::Descent;
use super::forces::ForceTerms;
use super::learned::Template;
use super::learned::{Family, Learned};
use super::learner::{Learner, Loss};
use super::natural::{Natural, NaturalConfig};
use super::rollout::{RolloutLoss, Rollouts};
use crate::dataset::{Dataset, shuffle};
use crate::identify::{RigidConfig, identify};
use crate::rigid::{RigidBodies, RobotConfig};
use crate::{Error, Result, rigid};

/// How weights are improved.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase", tag = "name")]
pub enum Optimizer {
    /// The natural gradient in the space of samples: the default where a batch's residuals number some hundreds.
    Natural(NaturalConfig),
    /// Adam(W): for the largest networks and batches.
    Adam(AdamConfig),
}

impl Default for Optimizer {
    fn default() -> Self {
        Self::Natural(NaturalConfig::default())
    }
}

/// When a run ends; the schedules follow it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Budget {
    /// After so many steps: the same seed gives the same bits.
    Steps(usize),
    /// After so many seconds: the best that this machine can do in a given time, not reproducible to the bit.
    Seconds(f64),
}

/// In which numbers the network is evaluated while it is trained with Adam; all else is f64.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Precision {
    /// Single.
    F32,
    /// Double.
    #[default]
    F64,
}

/// All settings of a fit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FitConfig {
    /// What is fitted.
    pub family: Family,
    /// What is minimised.
    pub loss: Loss,
    /// Settings of that loss, where it is a rollout's.
    #[serde(skip_serializing_if = "RolloutLoss::is_default")]
    pub rollout: RolloutLoss,
    /// How.
    pub optimizer: Optimizer,
    /// How long.
    pub budget: Budget,
    /// Samples of one step.
    pub batch: usize,
    /// Samples of the first step, from which they grow geometrically to `batch` with the share of the budget; `None`:
    /// all steps are alike. Small batches are better at first (docs/adr/0050).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub batch_first: Option<usize>,
    /// Of weights and batches.
    pub seed: u64,
    /// Forces that are learned beside those of the Lagrangian (a chain of rigid links knows friction alone).
    pub forces: ForceTerms,
    /// A robot that is known: a Lagrangian network then learns what its description leaves (theory.md, 48), and the
    /// losses are in units of that. `DeLaN` can only add inertia to it, a free network also take some away.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub nominal: Option<RobotConfig>,
    /// Numbers of the kernels under Adam.
    pub precision: Precision,
    /// Steps between two looks at the validation samples.
    pub validate_every: usize,
    /// Looks without improvement after which the run stops; `None`: never.
    pub patience: Option<usize>,
}

impl Default for FitConfig {
    fn default() -> Self {
        Self {
            family: Family::default(),
            loss: Loss::default(),
            rollout: RolloutLoss::default(),
            optimizer: Optimizer::default(),
            budget: Budget::Steps(1000),
            batch: 256,
            batch_first: None,
            seed: 0,
            forces: ForceTerms::default(),
            nominal: None,
            precision: Precision::default(),
            validate_every: 25,
            patience: None,
        }
    }
}

/// Where a run is.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Progress {
    /// Steps done.
    pub step: usize,
    /// Share of the budget used, 0…1.
    pub share: f64,
    /// Seconds of training, over all parts of a resumed run.
    pub seconds: f64,
    /// Mean loss of the last batch, before its step.
    pub loss: f64,
    /// Mean loss on the validation samples, where this step looked at them.
    pub validation: Option<f64>,
    /// Rate of the step.
    pub rate: f64,
    /// Samples of the batch that were left out for a singular mass matrix.
    pub singular: usize,
}

/// Watches a run; printing, plotting and files are its business.
///
/// A fit calls it on a thread of the pool that it runs in.
pub trait Observer: Send {
    /// After each step; `Break` ends the run and keeps the best weights.
    fn progress(&mut self, progress: &Progress) -> ControlFlow<()>;

    /// After each look at the validation samples: everything that a later run needs to go on to the same bits.
    ///
    /// # Errors
    /// Any error ends the run with it.
    fn checkpoint(&mut self, checkpoint: &Checkpoint) -> Result<()> {
        let _ = checkpoint;
        Ok(())
    }
}

/// Watches nothing.
impl Observer for () {
    fn progress(&mut self, _: &Progress) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }
}

/// Why a run ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Ending {
    /// The budget was used.
    Finished,
    /// The validation loss had not improved for the given patience.
    Converged,
    /// The observer ended it.
    Interrupted,
}

/// A fitted model and how it came about.
#[derive(Debug, Clone)]
pub struct Fit {
    /// The model with the weights of the best validation loss.
    pub model: Learned,
    /// Why the run ended.
    pub ending: Ending,
    /// Best mean validation loss (training loss where there are no validation samples).
    pub best: f64,
    /// Step at which it was reached.
    pub best_step: usize,
    /// Steps done.
    pub steps: usize,
    /// Seconds of training.
    pub seconds: f64,
}

/// Parameters that are trained at most: some ten arrays of that length stay within a few gigabytes.
const MAX_PARAMETERS: usize = 1 << 26;

impl FitConfig {
    /// Checks all settings against the data, as [`fit`] does before it begins.
    ///
    /// # Errors
    /// [`Error::Argument`] for the first that is outside its domain.
    pub fn validate(&self, dataset: &Dataset) -> Result<()> {
        match self.family {
            Family::Rigid(ref rigid) => {
                self.nominal(dataset, &self.family)?;
                if let Some(robot) = &rigid.robot {
                    robot.bodies(&dataset.coordinates)?;
                }
                self.check(dataset)
            }
            _ => self.template(dataset).map(drop),
        }
    }

    /// The robot that is known, as the data see it.
    pub(crate) fn nominal(
        &self,
        dataset: &Dataset,
        family: &Family,
    ) -> Result<Option<RigidBodies>> {
        let Some(robot) = &self.nominal else {
            return Ok(None);
        };
        if !matches!(family, Family::Lnn(_) | Family::Delan(_)) {
            return Err(Error::Argument {
                name: "nominal model",
                value: format!("one beneath the family {}", family.name()),
                must: "beneath a Lagrangian network (--model lnn or delan); rigid takes the robot itself (--urdf)",
            });
        }
        robot.bodies(&dataset.coordinates).map(Some)
    }

    fn template(&self, dataset: &Dataset) -> Result<Template> {
        self.check(dataset)?;
        let template = self.family.template(dataset, self)?;
        let parameters = template.parameters();
        if parameters <= MAX_PARAMETERS {
            return Ok(template);
        }
        Err(Error::Argument {
            name: "number of parameters",
            value: parameters.to_string(),
            must: "at most 67108864: take a smaller --width or fewer --layers",
        })
    }

    fn check(&self, dataset: &Dataset) -> Result<()> {
        let argument = |name, value: String, must| Err(Error::Argument { name, value, must });
        if dataset.train.is_empty() {
            return argument("training samples", "none".into(), "at least one");
        }
        if self.batch == 0 || self.batch > 1 << 20 {
            return argument("batch", self.batch.to_string(), "between 1 and 1048576");
        }
        if let Some(first) = self.batch_first
            && !(1..=self.batch).contains(&first)
        {
            let must = "between 1 and the samples of a later step (--batch)";
            return argument("first batch", first.to_string(), must);
        }
        if self.batch_first.is_some() && self.loss == Loss::Rollout {
            let must = "left away under the rollout loss, whose horizon grows instead";
            return argument("first batch", "given".into(), must);
        }
        if matches!(self.optimizer, Optimizer::Natural(_))
            && self.batch * self.residuals(dataset.train.n) > 8192
        {
            let must =
                "at most 8192 residuals under the natural gradient: take a smaller batch, or Adam";
            return argument(
                "batch",
                format!(
                    "{} ({} residuals)",
                    self.batch,
                    self.batch * self.residuals(dataset.train.n)
                ),
                must,
            );
        }
        if self.validate_every == 0 {
            return argument("validate_every", "0".into(), "at least 1");
        }
        match self.budget {
            Budget::Steps(0) => argument("steps", "0".into(), "at least 1"),
            Budget::Seconds(s) if !(s.is_finite() && s > 0.0) => {
                argument("seconds", s.to_string(), "finite and positive")
            }
            _ => self.check_family(dataset),
        }
    }

    /// Residuals of a sample of `n` coordinates.
    fn residuals(&self, n: usize) -> usize {
        match self.family {
            Family::Hnn(_) => 2 * n,
            _ => self.loss.residuals(n),
        }
    }

    /// What this family cannot be fitted to.
    fn check_family(&self, dataset: &Dataset) -> Result<()> {
        let argument = |name, value: String, must| Err(Error::Argument { name, value, must });
        let hnn = match &self.family {
            Family::Hnn(hnn) => Some(hnn),
            _ => None,
        };
        match hnn {
            Some(_)
                if !matches!(
                    self.loss,
                    Loss::Acceleration | Loss::AccelerationL1 | Loss::Rollout
                ) =>
            {
                argument(
                    "loss",
                    self.loss.name().into(),
                    "left away (or acceleration-l1 for absolute errors, or rollout): a Hamiltonian network is fitted to (q̇, ṗ), or to motions in (q, p)",
                )
            }
            Some(_) if self.loss == Loss::Rollout && self.forces != ForceTerms::default() => {
                argument(
                    "forces",
                    "under the rollout loss of a Hamiltonian network".into(),
                    "left away, or learned without --loss rollout",
                )
            }
            Some(hnn) if !hnn.momenta.canonical() && dataset.forced => argument(
                "momenta",
                "velocities, with forces in the data".into(),
                "recorded, or p = m q̇ with --masses: a force changes p, not q̇",
            ),
            Some(hnn) if !hnn.momenta.canonical() && self.forces != ForceTerms::default() => {
                argument(
                    "forces",
                    "beside velocities in the place of momenta".into(),
                    "left away, or momenta recorded or p = m q̇ with --masses",
                )
            }
            _ if self.loss.needs_forces() && !dataset.forced => argument(
                "loss",
                "torque".into(),
                "acceleration: the data hold no force τ",
            ),
            _ if matches!(self.family, Family::NeuralOde(_))
                && !matches!(self.loss, Loss::Rollout | Loss::Acceleration) =>
            {
                argument(
                    "loss",
                    self.loss.name().into(),
                    "rollout or acceleration: a neural ODE has no inverse dynamics (--model mlp has)",
                )
            }
            _ if self.loss == Loss::Rollout && self.nominal.is_some() => argument(
                "loss",
                "rollout".into(),
                "acceleration or torque upon a nominal model: a rollout has no gradient through a robot's description",
            ),
            _ if self.loss == Loss::Rollout && self.precision == Precision::F32 => {
                argument("precision", "f32".into(), "f64 under the rollout loss")
            }
            _ if self.loss.rule().is_some() && dataset.train.steps.is_empty() => argument(
                "loss",
                self.loss.name().into(),
                "acceleration or torque: the samples are not three neighbouring positions (Dataset::of_positions)",
            ),
            _ if self.loss.rule().is_none() && !dataset.train.steps.is_empty() => argument(
                "loss",
                self.loss.name().into(),
                "positions (--loss positions): the samples are neighbouring positions without velocities",
            ),
            _ if self.loss.rule().is_some()
                && !matches!(self.family, Family::Lnn(_) | Family::Delan(_)) =>
            {
                argument(
                    "loss",
                    self.loss.name().into(),
                    "acceleration or torque, of estimated derivatives: only a Lagrangian network (lnn, delan, vin) is fitted to positions alone",
                )
            }
            _ if self.loss.rule().is_some() && self.nominal.is_some() => argument(
                "nominal model",
                format!("one under the loss {}", self.loss.name()),
                "left away, or fitted with --loss torque or acceleration",
            ),
            _ if self.forces.rotor && !matches!(self.family, Family::Delan(_)) => argument(
                "forces",
                "rotor".into(),
                "without rotor inertias: only a deep Lagrangian network (delan) keeps them apart from M",
            ),
            _ if matches!(self.loss, Loss::TorqueAcceleration | Loss::TorquePower)
                && !matches!(self.family, Family::Delan(_)) =>
            {
                argument(
                    "loss",
                    self.loss.name().into(),
                    "torque or acceleration: only deep Lagrangian networks (delan) are fitted to more at once",
                )
            }
            _ if self.loss == Loss::Rollout => {
                self.rollout
                    .validate(dataset, &self.optimizer, &self.family)
            }
            _ => Ok(()),
        }
    }
}

/// Fits a model to `dataset`; `resume` goes on from a checkpoint of the same run.
///
/// # Errors
/// [`Error::Argument`] for settings outside their domain, [`Error::Shape`] for a checkpoint of another run, and
/// whatever the observer returns.
pub fn fit(
    dataset: &Dataset,
    config: &FitConfig,
    resume: Option<&Checkpoint>,
    observer: &mut dyn Observer,
) -> Result<Fit> {
    if let Family::Rigid(rigid) = &config.family {
        config.validate(dataset)?;
        return solve(
            dataset,
            rigid,
            config.forces.viscous || config.forces.coulomb,
            observer,
        );
    }
    // Once inside the pool, its threads need not be woken for every step.
    rayon::scope(|_| descend(dataset, config, resume, observer))
}

/// The fit of a family without a closed form.
fn descend(
    dataset: &Dataset,
    config: &FitConfig,
    resume: Option<&Checkpoint>,
    observer: &mut dyn Observer,
) -> Result<Fit> {
    let template = config.template(dataset)?;
    let mut fresh = template.initialise(config.seed);
    let weights = fresh.len();
    if config.loss == Loss::Rollout {
        fresh.extend(template.with_flow(|l| Rollouts::new(dataset, config, l).free_starts()));
    }
    let mut run = Run::new(dataset, config, resume, fresh)?;
    let (ending, progress) = match config.precision {
        _ if config.loss == Loss::Rollout => template.with_flow(|flow| {
            template.with_f64(|learner| run.descend_rollouts(flow, learner, observer))
        }),
        Precision::F32 => template.with_f32(|learner| run.descend_in::<f32>(learner, observer)),
        Precision::F64 => template.with_f64(|learner| run.descend_in_f64(learner, observer)),
    }?;
    let state = run.state;
    Ok(Fit {
        model: template.assemble(&state.best_parameters[..weights])?,
        ending,
        best: state.best,
        best_step: state.best_step,
        steps: progress.step,
        seconds: progress.seconds,
    })
}

/// The fit of a family that has a closed form: one step.
fn solve(
    dataset: &Dataset,
    config: &RigidConfig,
    dissipation: bool,
    observer: &mut dyn Observer,
) -> Result<Fit> {
    let clock = Instant::now();
    let found = match &config.robot {
        None => {
            let found = identify(dataset, config, dissipation)?;
            (Learned::Rigid(found.model), found.loss, found.validation)
        }
        Some(robot) => {
            let found = rigid::identify(dataset, robot, config.smoothing, dissipation)?;
            (Learned::Robot(found.model), found.loss, found.validation)
        }
    };
    let (model, loss, validation) = found;
    let progress = Progress {
        step: 1,
        share: 1.0,
        seconds: clock.elapsed().as_secs_f64(),
        loss,
        validation,
        rate: 1.0,
        singular: 0,
    };
    // It has ended whatever the observer says.
    let _ = observer.progress(&progress);
    Ok(Fit {
        model,
        ending: Ending::Finished,
        best: validation.unwrap_or(loss),
        best_step: 1,
        steps: 1,
        seconds: progress.seconds,
    })
}

/// A run: its data, its state and its clock.
struct Run<'a> {
    dataset: &'a Dataset,
    config: &'a FitConfig,
    state: Checkpoint,
    order: Order,
    judge: Vec<usize>,
    before: f64,
    clock: Instant,
}

/// Validation samples that are looked at each time, at most: enough to compare, few enough to be free.
const JUDGED: usize = 2048;

impl<'a> Run<'a> {
    fn new(
        dataset: &'a Dataset,
        config: &'a FitConfig,
        resume: Option<&Checkpoint>,
        fresh: Vec<f64>,
    ) -> Result<Self> {
        let memory = match config.optimizer {
            Optimizer::Natural(_) => 1,
            Optimizer::Adam(_) => 2,
        };
        let state = match resume {
            Some(checkpoint) => checkpoint.clone().for_run(fresh.len(), memory)?,
            None => Checkpoint::fresh(fresh, memory),
        };
        let judged = dataset.validation.len();
        let every = judged.div_ceil(JUDGED).max(1);
        Ok(Self {
            order: Order::new(dataset.train.len(), config.seed),
            judge: (0..judged).step_by(every).collect(),
            before: state.seconds,
            clock: Instant::now(),
            dataset,
            config,
            state,
        })
    }

    fn seconds(&self) -> f64 {
        self.before + self.clock.elapsed().as_secs_f64()
    }

    fn share(&self) -> f64 {
        let share = match self.config.budget {
            Budget::Steps(steps) => self.state.step as f64 / steps as f64,
            Budget::Seconds(seconds) => self.seconds() / seconds,
        };
        share.min(1.0)
    }

    fn descend_in_f64(
        &mut self,
        learner: &dyn Learner<f64>,
        observer: &mut dyn Observer,
    ) -> Result<(Ending, Progress)> {
        let Optimizer::Natural(natural) = &self.config.optimizer else {
            return self.descend_in::<f64>(learner, observer);
        };
        let batch = self.config.batch.min(self.dataset.train.len());
        let mut engine = Natural::new(learner, batch);
        let config = self.config;
        let adaptive = matches!(natural.damping_rule, DampingRule::Adaptive { .. });
        let mut after = adaptive.then(|| Batches::<f64>::new(learner, batch));

        let judge = self.judged::<f64>(learner);
        self.descend(
            judge,
            observer,
            |state: &mut Checkpoint, share: f64, (samples, numbers): (&Samples, &[usize])| {
                let rate = natural.rate * cosine(share);
                let damping = natural.damping(share, state.setbacks, state.damping);
                engine.phi.copy_from_slice(&state.memory[0]);
                let (parameters, batch) = (&mut state.parameters, (samples, numbers));
                let at = (rate, damping);
                let value = engine.step(learner, natural, config.loss, at, batch, parameters);
                state.memory[0].copy_from_slice(&engine.phi);
                if let Some(after) = &mut after {
                    let after = after.evaluate(learner, config.loss, parameters, batch, None);
                    let gain = engine.gain(learner, at, (value, after), numbers.len());
                    let damping = state.damping.unwrap_or(natural.damping_first);
                    state.damping = Some(natural.damping_rule.adapted(damping, gain));
                }
                (value, rate)
            },
        )
    }

    fn descend_in<T: crate::mlp::simd::Real>(
        &mut self,
        learner: &dyn Learner<T>,
        observer: &mut dyn Observer,
    ) -> Result<(Ending, Progress)> {
        let adam = match &self.config.optimizer {
            Optimizer::Adam(adam) => adam.clone(),
            Optimizer::Natural(_) => {
                let must = "f64 under the natural gradient";
                return Err(Error::Argument {
                    name: "precision",
                    value: "f32".into(),
                    must,
                });
            }
        };
        let batch = self.config.batch.min(self.dataset.train.len());
        let mut adam = Adams {
            descent: Descent::<T>::new(learner, batch),
            learner,
            adam: &adam,
            loss: self.config.loss,
        };
        adam.load(&self.state);
        let judge = self.judged::<T>(learner);
        self.descend(judge, observer, adam)
    }

    /// The rollout loss, after a fit of accelerations where that is wanted; `flow` gives the rates as they are,
    /// `learner` the residuals of that fit.
    fn descend_rollouts(
        &mut self,
        flow: &dyn Learner<f64>,
        learner: &dyn Learner<f64>,
        observer: &mut dyn Observer,
    ) -> Result<(Ending, Progress)> {
        let config = self.config;
        let mut judges = Rollouts::new(self.dataset, config, flow);
        let judge = |parameters: &[f64]| judges.judge(flow, parameters);
        let mut rollouts = Rollouts::new(self.dataset, config, flow);
        let batch = config.batch.min(self.dataset.train.len());
        let mut gradient = vec![0.0; learner.parameters()];
        let weights = gradient.len();
        match &config.optimizer {
            Optimizer::Natural(natural) => {
                let mut first = Natural::new(learner, batch);
                self.descend(
                    judge,
                    observer,
                    |state: &mut Checkpoint,
                     share: f64,
                     (samples, numbers): (&Samples, &[usize])| {
                        let warm = share < config.rollout.warm_start;
                        // Each part has a schedule of its own.
                        let (share, part) = parts(share, config.rollout.warm_start);
                        let rate = natural.rate * cosine(part);
                        let damping = natural.scheduled(part, state.setbacks);
                        if !warm {
                            let at = (share, rate, damping);
                            return (rollouts.natural_step(flow, natural, state, at), rate);
                        }
                        first.phi.copy_from_slice(&state.memory[0][..weights]);
                        let value = first.step(
                            learner,
                            natural,
                            Loss::Acceleration,
                            (rate, damping),
                            (samples, numbers),
                            &mut state.parameters[..weights],
                        );
                        state.memory[0][..weights].copy_from_slice(&first.phi);
                        (value, rate)
                    },
                )
            }
            Optimizer::Adam(adam) => {
                let mut first = Batches::<f64>::new(learner, batch);
                self.descend(
                    judge,
                    observer,
                    |state: &mut Checkpoint,
                     share: f64,
                     (samples, numbers): (&Samples, &[usize])| {
                        let rate = adam.rate * cosine(share);
                        if share >= config.rollout.warm_start {
                            let at = (share, rate);
                            return (rollouts.adam_step(flow, adam, state, at), rate);
                        }
                        let parameters = &mut state.parameters[..weights];
                        let value = first.evaluate(
                            learner,
                            Loss::Acceleration,
                            parameters,
                            (samples, numbers),
                            Some(&mut gradient),
                        );
                        let mut memory = Adam {
                            first: state.memory[0][..weights].to_vec(),
                            second: state.memory[1][..weights].to_vec(),
                        };
                        memory.step(adam, rate, state.step, &gradient, parameters);
                        learner.project(parameters);
                        state.memory[0][..weights].copy_from_slice(&memory.first);
                        state.memory[1][..weights].copy_from_slice(&memory.second);
                        (value, rate)
                    },
                )
            }
        }
    }

    /// Judges parameters by the validation samples; `None` where there are none.
    fn judged<'l, T: crate::mlp::simd::Real>(
        &self,
        learner: &'l dyn Learner<T>,
    ) -> impl FnMut(&[f64]) -> Option<Value> + use<'a, 'l, T> {
        let mut judges = Batches::<T>::new(learner, self.judge.len().clamp(1, 256));
        let (judge, dataset, loss) = (self.judge.clone(), self.dataset, self.config.loss);
        move |parameters| {
            let judged = (&dataset.validation, &judge[..]);
            (!judge.is_empty()).then(|| judges.evaluate(learner, loss, parameters, judged, None))
        }
    }

    /// The loop that all optimisers share; `step` improves the parameters and says the loss before and its rate.
    fn descend(
        &mut self,
        mut judge: impl FnMut(&[f64]) -> Option<Value>,
        observer: &mut dyn Observer,
        mut engine: impl Engine,
    ) -> Result<(Ending, Progress)> {
        let last = self.config.batch;
        let first = self.config.batch_first.unwrap_or(last);
        if self.share() >= 1.0 && !self.state.best_parameters.is_empty() {
            return Ok((Ending::Finished, self.at_the_end()));
        }
        loop {
            let share = self.share();
            let batch = grown(first, last, share).min(self.dataset.train.len());
            let numbers = self.order.batch(self.state.step, batch);
            let batch = (&self.dataset.train, numbers);
            let (value, rate) = engine.step(&mut self.state, share, batch);
            self.state.step += 1;
            let share = self.share();
            let look = self.state.step.is_multiple_of(self.config.validate_every) || share >= 1.0;
            if look {
                engine.save(&mut self.state);
            }
            let validation = look.then(|| self.look(judge(&self.state.parameters), value));
            let progress = Progress {
                step: self.state.step,
                share,
                seconds: self.seconds(),
                loss: value.mean(),
                validation: validation.filter(|(_, held)| *held).map(|(value, _)| value),
                rate,
                singular: value.singular,
            };
            let stop = observer.progress(&progress).is_break();
            let ending = self.ending(share, stop);
            if look {
                // It may have gone back to the best.
                engine.load(&self.state);
            } else if ending.is_some() {
                engine.save(&mut self.state);
            }
            if look || ending.is_some() {
                self.state.seconds = self.seconds();
                observer.checkpoint(&self.state)?;
            }
            if let Some(ending) = ending {
                // Ended before the first look. Not in the checkpoint: a resumed run must not know of it.
                if self.state.best_parameters.is_empty() {
                    self.look(judge(&self.state.parameters), value);
                }
                if self.state.best_parameters.is_empty() {
                    self.state
                        .best_parameters
                        .clone_from(&self.state.parameters);
                }
                return Ok((ending, progress));
            }
        }
    }

    /// Where a run is that was resumed behind its last step.
    fn at_the_end(&self) -> Progress {
        Progress {
            step: self.state.step,
            share: 1.0,
            seconds: self.seconds(),
            loss: self.state.best,
            validation: None,
            rate: 0.0,
            singular: 0,
        }
    }

    fn ending(&self, share: f64, stop: bool) -> Option<Ending> {
        let patience = self
            .config
            .patience
            .map_or(usize::MAX, |p| p.saturating_mul(self.config.validate_every));
        if share >= 1.0 {
            Some(Ending::Finished)
        } else if stop {
            Some(Ending::Interrupted)
        } else if self.state.best.is_finite() && self.state.step - self.state.best_step > patience {
            Some(Ending::Converged)
        } else {
            None
        }
    }

    /// Keeps the parameters if they are the best so far, by the held-back samples, or by the batch where there are
    /// none; returns the loss and whether it is that of held-back samples.
    fn look(&mut self, held: Option<Value>, batch: Value) -> (f64, bool) {
        let value = self.state.judge(held.unwrap_or(batch));
        (value, held.is_some())
    }
}

/// What improves the parameters of a run.
trait Engine {
    /// One step on a batch; returns the loss before it and its rate.
    fn step(
        &mut self,
        state: &mut Checkpoint,
        share: f64,
        batch: (&Samples, &[usize]),
    ) -> (Value, f64);
    /// Writes what it keeps to itself between two looks.
    fn save(&self, _: &mut Checkpoint) {}
    /// Takes it back, perhaps changed.
    fn load(&mut self, _: &Checkpoint) {}
}

/// Engines that keep nothing to themselves.
impl<F: FnMut(&mut Checkpoint, f64, (&Samples, &[usize])) -> (Value, f64)> Engine for F {
    fn step(
        &mut self,
        state: &mut Checkpoint,
        share: f64,
        batch: (&Samples, &[usize]),
    ) -> (Value, f64) {
        self(state, share, batch)
    }
}

/// Adam, which keeps parameters and moments as the kernels want them.
struct Adams<'a, T: crate::mlp::simd::Real> {
    descent: Descent<T>,
    learner: &'a dyn Learner<T>,
    adam: &'a AdamConfig,
    loss: Loss,
}

impl<T: crate::mlp::simd::Real> Engine for Adams<'_, T> {
    fn step(
        &mut self,
        state: &mut Checkpoint,
        share: f64,
        batch: (&Samples, &[usize]),
    ) -> (Value, f64) {
        let rate = self.adam.rate * cosine(share);
        let at = (rate, state.step);
        (
            self.descent
                .step(self.learner, (self.adam, self.loss), at, batch),
            rate,
        )
    }
    fn save(&self, state: &mut Checkpoint) {
        self.descent.save(self.learner, state);
    }
    fn load(&mut self, state: &Checkpoint) {
        self.descent.load(self.learner, state);
    }
}

/// The share of the whole budget, and that of the part before or behind `warm_start`.
fn parts(share: f64, warm_start: f64) -> (f64, f64) {
    let part = match share < warm_start {
        true => share / warm_start,
        false => (share - warm_start) / (1.0 - warm_start),
    };
    (share, part)
}

/// From 1 to 0.
pub(crate) fn cosine(share: f64) -> f64 {
    0.5 * (1.0 + (std::f64::consts::PI * share).cos())
}

/// Samples of a batch at this share of the budget: whole blocks of 16, so that none is filled with padding.
pub(crate) fn grown(first: usize, last: usize, share: f64) -> usize {
    if first >= last {
        return last;
    }
    let samples = first as f64 * (last as f64 / first as f64).powf(share);
    (samples as usize).next_multiple_of(16).clamp(first, last)
}

/// The order in which samples are visited: a new random one for each pass, a function of seed and step alone.
pub(crate) struct Order {
    seed: u64,
    epoch: Option<usize>,
    numbers: Vec<usize>,
    wrapped: Vec<usize>,
}

impl Order {
    pub(crate) fn new(len: usize, seed: u64) -> Self {
        Self {
            seed,
            epoch: None,
            numbers: (0..len).collect(),
            wrapped: Vec::new(),
        }
    }

    /// The samples of a step; the few that are left at the end of a pass are skipped.
    pub(crate) fn batch(&mut self, step: usize, batch: usize) -> &[usize] {
        let steps = (self.numbers.len() / batch).max(1);
        let epoch = step / steps;
        if self.epoch != Some(epoch) {
            self.epoch = Some(epoch);
            self.numbers.sort_unstable();
            let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
            rng.set_stream(1 + epoch as u64);
            shuffle(&mut self.numbers, &mut rng);
        }
        let start = step % steps * batch;
        self.wrapped.clear();
        self.wrapped
            .extend_from_slice(&self.numbers[start..start + batch]);
        &self.wrapped
    }
}
