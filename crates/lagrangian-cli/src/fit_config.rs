//! From the flags of `lagrangian fit` to what the library takes.

use anyhow::Result;
use clap::ValueEnum;
use lagrangian::baseline::MlpConfig;
use lagrangian::hamiltonian::{HnnConfig, HnnStructure, Momenta};
use lagrangian::identify::RigidConfig;
use lagrangian::lagrangian::{self as mechanics, DelanConfig, LnnConfig, SpeedChart};
use lagrangian::models::vin::VinConfig;
use lagrangian::neural_ode::{NeuralOdeConfig, Order};
use lagrangian::train::{
    self, AdamConfig, Budget, FitConfig, ForceTerms, Input, Loss, NaturalConfig, Optimizer,
};
use nets::Activation;

use crate::failure::mistake;
use crate::fit_args::{
    ActivationName, DampingName, Family, FitArgs, Force, Form, ModelArgs, MomentaName,
    OptimizerName, OrderName, SpeedChartName, Structure, TrainingArgs, Trunks,
};

/// Length of a fit that was given neither steps nor seconds, s.
const SECONDS: f64 = 60.0;

/// Accelerations that are less certain than this part of them are noisy.
const NOISY: f64 = 0.005;

/// The natural gradient solves each batch for itself, noise and all; Adam averages over many.
pub(crate) fn by_noise(uncertainty: f64) -> OptimizerName {
    if uncertainty > NOISY {
        OptimizerName::Adam
    } else {
        OptimizerName::Natural
    }
}

/// Beyond noisy data only a convex Lagrangian stays physical; on exact data a free one is more accurate (ADR 0005).
fn form_by_noise(uncertainty: f64) -> Form {
    if uncertainty > NOISY {
        Form::Convex
    } else {
        Form::Free
    }
}

impl FitArgs {
    /// All settings of the fit to data whose accelerations are uncertain by the part `uncertainty`, with or without
    /// recorded torques.
    pub(crate) fn config(&self, uncertainty: f64, forced: bool) -> FitConfig {
        let training = &self.training;
        let loss = training.loss(self.model.model, forced, uncertainty);
        // Noise of states does no harm to a rollout that noise of accelerations does to a balance (ADR 0042).
        let optimizer = training.optimizer.unwrap_or_else(|| match loss {
            Loss::ROLLOUT => OptimizerName::Natural,
            _ => by_noise(uncertainty),
        });
        FitConfig {
            family: self.model.family(uncertainty),
            loss,
            rollout: self.rollout.settings(),
            optimizer: training.optimizer(optimizer, loss),
            budget: training.budget(),
            batch: training.batch(optimizer, loss),
            batch_first: training.batch_first.map(|samples| samples as usize),
            seed: training.seed,
            forces: self.model.forces(),
            patience: training.patience.map(|looks| looks as usize),
            ..FitConfig::default()
        }
    }
}

/// Units of a layer; few for a deep Lagrangian network of noisy data, whose mass matrix then extrapolates better.
const WIDTH: u32 = 64;
const NARROW: u32 = 16;

impl ModelArgs {
    /// Whether it is fitted to recorded momenta, and so to their rates.
    pub(crate) fn reads_momenta(&self) -> bool {
        let others = self.momenta == Some(MomentaName::Velocities) || !self.masses.is_empty();
        self.model == Family::Hnn && !others
    }

    fn width(&self, uncertainty: f64) -> usize {
        let robots = matches!(self.model, Family::Delan | Family::Vin);
        let narrow = robots && uncertainty > NOISY;
        self.width.unwrap_or(if narrow { NARROW } else { WIDTH }) as usize
    }

    fn family(&self, uncertainty: f64) -> Box<dyn train::Family> {
        let (width, layers, activation) = (
            self.width(uncertainty),
            self.layers as usize,
            self.activation.into(),
        );
        match self.model {
            Family::Lnn => {
                let form = self
                    .form
                    .unwrap_or_else(|| form_by_noise(uncertainty))
                    .into();
                Box::new(LnnConfig {
                    form,
                    width,
                    layers,
                    activation,
                    exponential: self.exponential,
                    speed_limit: self.speed_limit,
                    speed_chart: match self.speed_chart {
                        Some(SpeedChartName::Arcsin) => SpeedChart::Arcsin,
                        Some(SpeedChartName::Artanh) | None => SpeedChart::Artanh,
                    },
                    ..LnnConfig::default()
                })
            }
            Family::Vin => Box::new(VinConfig {
                width,
                layers,
                activation,
                vector_potential: self.vector_potential,
                ..VinConfig::default()
            }),
            Family::Delan => Box::new(DelanConfig {
                width,
                layers,
                activation,
                trunks: match self.trunks.unwrap_or_default() {
                    Trunks::Shared => mechanics::Trunks::Shared,
                    Trunks::Separate => mechanics::Trunks::Separate,
                },
                vector_potential: self.vector_potential,
                ..DelanConfig::default()
            }),
            Family::Hnn => Box::new(HnnConfig {
                structure: match self.structure.unwrap_or(Structure::Free) {
                    Structure::Free => HnnStructure::Free,
                    Structure::Mass => HnnStructure::Mass,
                    Structure::None => HnnStructure::None,
                },
                momenta: match (self.momenta, self.masses.is_empty()) {
                    (Some(MomentaName::Velocities), _) => Momenta::Velocities,
                    (_, false) => Momenta::Masses(self.masses.clone()),
                    _ => Momenta::Recorded,
                },
                width,
                layers,
                activation,
                speed_limit: self.speed_limit,
            }),
            Family::Mlp => Box::new(MlpConfig {
                width,
                layers,
                activation,
                ..MlpConfig::default()
            }),
            Family::NeuralOde => Box::new(NeuralOdeConfig {
                order: match self.order {
                    Some(OrderName::First) => Order::First,
                    Some(OrderName::Second) | None => Order::Second,
                },
                width,
                layers,
                activation,
            }),
            Family::Rigid => Box::new(RigidConfig::default()),
        }
    }
}

impl ModelArgs {
    /// Refuses flags that the model does not know, so that none is ignored.
    ///
    /// # Errors
    /// For the first of them.
    pub(crate) fn require_own_flags(&self) -> Result<()> {
        let learns_forces = self.dissipation || !self.forces.is_empty();
        let flags = [
            ("--form", self.form.is_some(), &[Family::Lnn][..]),
            ("--order", self.order.is_some(), &[Family::NeuralOde]),
            ("--structure", self.structure.is_some(), &[Family::Hnn]),
            ("--momenta", self.momenta.is_some(), &[Family::Hnn]),
            ("--masses", !self.masses.is_empty(), &[Family::Hnn]),
            (
                "--speed-limit",
                self.speed_limit.is_some(),
                &[Family::Lnn, Family::Hnn],
            ),
            ("--speed-chart", self.speed_chart.is_some(), &[Family::Lnn]),
            ("--exponential", self.exponential, &[Family::Lnn]),
            ("--trunks", self.trunks.is_some(), &[Family::Delan]),
            (
                "--vector-potential",
                self.vector_potential,
                &[Family::Delan, Family::Vin],
            ),
            (
                "--dissipation and --forces",
                learns_forces,
                &[
                    Family::Lnn,
                    Family::Delan,
                    Family::Vin,
                    Family::Hnn,
                    Family::Rigid,
                ],
            ),
        ];
        for (flag, given, models) in flags {
            if given && !models.contains(&self.model) {
                let name =
                    |model: &Family| model.to_possible_value().map(|v| v.get_name().to_string());
                let names: Vec<String> = models.iter().filter_map(name).collect();
                return Err(mistake(
                    format!("{flag}: not for this model"),
                    format!("omit it, or take --model {}", names.join(" or ")),
                ));
            }
        }
        if self.speed_chart.is_some() && self.speed_limit.is_none() {
            return Err(mistake(
                "--speed-chart: there is no limit of speed",
                "add --speed-limit C, or omit it",
            ));
        }
        let velocities = self.momenta == Some(MomentaName::Velocities);
        if self.structure == Some(Structure::None) && !velocities {
            return Err(mistake(
                "--structure none knows no way from a velocity to its momentum",
                "add --momenta velocities, or take --structure free or mass",
            ));
        }
        Ok(())
    }

    fn forces(&self) -> ForceTerms {
        let wanted = |force| self.forces.contains(&force);
        ForceTerms {
            viscous: self.dissipation || wanted(Force::Viscous),
            coulomb: self.dissipation || wanted(Force::Coulomb),
            stribeck: wanted(Force::Stribeck),
            offset: wanted(Force::Offset),
            rotor: wanted(Force::Rotor),
            input: match (wanted(Force::InputMatrix), wanted(Force::Gains)) {
                (true, _) => Input::Matrix,
                (false, true) => Input::Gains,
                (false, false) => Input::Torque,
            },
        }
    }
}

impl TrainingArgs {
    /// A torque loss needs certain accelerations: where a machine swings nearly freely, their noise shrinks inertia and
    /// gravity alike.
    fn loss(&self, model: Family, forced: bool, uncertainty: f64) -> Loss {
        match (self.loss, model) {
            (Some(loss), _) => loss,
            (None, Family::NeuralOde) => Loss::ROLLOUT,
            (None, Family::Vin) => Loss::POSITIONS,
            (None, Family::Delan) if forced && uncertainty <= NOISY => Loss::TORQUE,
            (None, _) => Loss::ACCELERATION,
        }
    }

    /// Whether positions alone are compared.
    pub(crate) fn of_positions(&self, model: Family) -> bool {
        self.loss
            .map_or(model == Family::Vin, |loss| loss.rule().is_some())
    }

    /// Whether motions are predicted over many samples.
    pub(crate) fn rolls_out(&self, model: Family) -> bool {
        self.loss
            .map_or(model == Family::NeuralOde, |loss| loss == Loss::ROLLOUT)
    }

    fn optimizer(&self, name: OptimizerName, loss: Loss) -> Optimizer {
        match name {
            OptimizerName::Natural => {
                let default = match self.damping {
                    Some(DampingName::Schedule) => NaturalConfig::default(),
                    Some(DampingName::Loss) => NaturalConfig::following_the_loss(),
                    Some(DampingName::Adaptive) => NaturalConfig::adaptive(),
                    None if self.follows_the_loss(loss) => NaturalConfig::following_the_loss(),
                    None => NaturalConfig::default(),
                };
                Optimizer::Natural(NaturalConfig {
                    rate: self.learning_rate.unwrap_or(default.rate),
                    ..default
                })
            }
            OptimizerName::Adam => {
                let default = AdamConfig::default();
                let rate = self.learning_rate.unwrap_or(default.rate);
                Optimizer::Adam(AdamConfig {
                    rate,
                    decay: self.weight_decay,
                    ..default
                })
            }
        }
    }

    fn budget(&self) -> Budget {
        match self.steps {
            Some(steps) => Budget::Steps(usize::try_from(steps).unwrap_or(usize::MAX)),
            None => Budget::Seconds(self.seconds.unwrap_or(SECONDS)),
        }
    }

    /// Refuses a damping of what has none, or none but a schedule.
    ///
    /// # Errors
    /// What it belongs to.
    pub(crate) fn require(&self, config: &FitConfig) -> Result<()> {
        let Some(damping) = self.damping else {
            return Ok(());
        };
        if matches!(config.optimizer, Optimizer::Adam(_)) {
            return Err(mistake(
                "--damping is a setting of the natural gradient, and this fit is one by Adam",
                "omit it, or add --optimizer natural",
            ));
        }
        if config.loss == Loss::ROLLOUT && damping != DampingName::Schedule {
            return Err(mistake(
                "under --loss rollout the damping follows a schedule",
                "omit --damping, or choose another --loss",
            ));
        }
        Ok(())
    }

    /// Whether the fit has a time to use and squares that λ can follow: then small batches, damped by the loss, are the
    /// best; a number of steps is used best by large ones (docs/adr/0050).
    fn follows_the_loss(&self, loss: Loss) -> bool {
        self.steps.is_none() && loss != Loss::ROLLOUT
    }

    fn batch(&self, optimizer: OptimizerName, loss: Loss) -> usize {
        let by_optimizer = match optimizer {
            OptimizerName::Natural if self.follows_the_loss(loss) => 128,
            OptimizerName::Natural => 256,
            OptimizerName::Adam => 512,
        };
        self.batch.map_or(by_optimizer, |batch| batch as usize)
    }
}

impl From<Form> for lagrangian::lagrangian::Form {
    fn from(form: Form) -> Self {
        match form {
            Form::Free => Self::Free,
            Form::Convex => Self::Convex,
        }
    }
}

impl From<ActivationName> for Activation {
    fn from(name: ActivationName) -> Self {
        match name {
            ActivationName::Softplus => Self::Softplus,
            ActivationName::Tanh => Self::Tanh,
            ActivationName::Gelu => Self::Gelu,
            ActivationName::Xtanh => Self::XTanh,
        }
    }
}
