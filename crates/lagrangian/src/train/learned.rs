//! The families that can be fitted: one line each in the tables below, one file each elsewhere.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use super::fit::FitConfig;
use super::learner::Learner;
use super::lnn::{Friction, LnnLearner};
use super::plain::MlpLearner;
use crate::baseline::{Mlp, MlpConfig, MlpShape};
use crate::dataset::Dataset;
use crate::dynamics::{Evaluator, Mechanical, Model};
use crate::identify::{Rigid, RigidConfig};
use crate::lagrangian::{Dissipation, Lnn, LnnConfig, LnnShape};
use crate::rigid::IdentifiedRobot;
use crate::{Coordinates, Result};

use super::Loss;

/// A family of models and its shape.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase", tag = "name")]
pub enum Family {
    /// Lagrangian neural network.
    Lnn(LnnConfig),
    /// Plain network, the baseline.
    Mlp(MlpConfig),
    /// Planar chain of rigid links, by least squares.
    Rigid(RigidConfig),
}

impl Default for Family {
    fn default() -> Self {
        Self::Lnn(LnnConfig::default())
    }
}

impl Family {
    /// Its name on the command line and in files.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::Lnn(_) => "lnn",
            Self::Mlp(_) => "mlp",
            Self::Rigid(_) => "rigid",
        }
    }
}

/// A fitted model of any family.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub enum Learned {
    /// A learned Lagrangian, with its friction if that was learned too.
    Lnn(Mechanical<Lnn>),
    /// A plain network.
    Mlp(Mlp),
    /// An identified chain of rigid links.
    Rigid(Rigid),
    /// A robot of known kinematics, identified.
    Robot(IdentifiedRobot),
}

impl Model for Learned {
    fn coordinates(&self) -> &Coordinates {
        match self {
            Self::Lnn(model) => model.coordinates(),
            Self::Mlp(model) => model.coordinates(),
            Self::Rigid(model) => model.coordinates(),
            Self::Robot(model) => model.coordinates(),
        }
    }

    fn evaluator(&self) -> Box<dyn Evaluator + '_> {
        match self {
            Self::Lnn(model) => model.evaluator(),
            Self::Mlp(model) => model.evaluator(),
            Self::Rigid(model) => model.evaluator(),
            Self::Robot(model) => model.evaluator(),
        }
    }
}

impl Learned {
    /// The name of its family.
    #[must_use]
    pub fn family(&self) -> &'static str {
        match self {
            Self::Lnn(_) => "lnn",
            Self::Mlp(_) => "mlp",
            Self::Rigid(_) | Self::Robot(_) => "rigid",
        }
    }
}

/// A family with everything but its weights, ready to be trained on a dataset.
pub(crate) enum Template {
    Lnn {
        shape: LnnShape,
        loss: Loss,
        weights: Vec<f64>,
        friction: Option<Friction>,
    },
    Mlp {
        shape: MlpShape,
        loss: Loss,
        weights: Vec<f64>,
    },
}

impl Family {
    pub(crate) fn template(&self, dataset: &Dataset, config: &FitConfig) -> Result<Template> {
        let n = dataset.coordinates.dof();
        crate::Error::check_dof(n, super::lnn::MAX_DOF)?;
        let (qdd, tau) = (dataset.acceleration_scale(), dataset.force_scale());
        let scale = if config.loss == Loss::Torque {
            &tau
        } else {
            &qdd
        };
        let weights: Vec<f64> = scale.iter().map(|s| 1.0 / s).collect();
        let (coordinates, scaling) = (dataset.coordinates.clone(), dataset.scaling());
        Ok(match self {
            Self::Lnn(lnn) => {
                let friction = config
                    .dissipation
                    .then(|| Friction::unit(&scaling.qd_scale, &tau));
                let shape = LnnShape::new(coordinates, lnn.clone(), scaling)?;
                Template::Lnn {
                    shape,
                    loss: config.loss,
                    weights,
                    friction,
                }
            }
            Self::Mlp(mlp) => {
                let mlp = MlpConfig {
                    forced: dataset.forced,
                    ..mlp.clone()
                };
                Template::Mlp {
                    shape: MlpShape::new(coordinates, mlp, scaling, (qdd, tau))?,
                    loss: config.loss,
                    weights,
                }
            }
            Self::Rigid(_) => {
                return Err(crate::Error::Argument {
                    name: "family",
                    value: "rigid".into(),
                    must: "a network: a rigid chain is solved for, not trained",
                });
            }
        })
    }
}

impl Friction {
    /// Coefficients of 1 mean friction of the size of the forces, which changes its sign within 10 % of the speeds:
    /// recordings rarely show it sharper.
    fn unit(qd_scale: &[f64], tau_scale: &[f64]) -> Self {
        Self {
            viscous: tau_scale.iter().zip(qd_scale).map(|(f, v)| f / v).collect(),
            coulomb: tau_scale.to_vec(),
            smoothing: 0.1 * qd_scale.iter().copied().fold(f64::INFINITY, f64::min),
        }
    }
}

impl Template {
    fn learner(&self) -> Trainee<'_> {
        match self {
            Self::Lnn {
                shape,
                loss,
                weights,
                friction,
            } => Trainee::Lnn(LnnLearner {
                shape,
                loss: *loss,
                weights,
                friction: friction.clone(),
            }),
            Self::Mlp {
                shape,
                loss,
                weights,
            } => Trainee::Mlp(MlpLearner {
                shape,
                loss: *loss,
                weights,
            }),
        }
    }

    pub(crate) fn with_f64<R>(&self, f: impl FnOnce(&dyn Learner<f64>) -> R) -> R {
        match self.learner() {
            Trainee::Lnn(learner) => f(&learner),
            Trainee::Mlp(learner) => f(&learner),
        }
    }

    pub(crate) fn with_f32<R>(&self, f: impl FnOnce(&dyn Learner<f32>) -> R) -> R {
        match self.learner() {
            Trainee::Lnn(learner) => f(&learner),
            Trainee::Mlp(learner) => f(&learner),
        }
    }

    /// Number of all parameters.
    pub(crate) fn parameters(&self) -> usize {
        self.with_f64(|learner| learner.parameters())
    }

    /// Random weights; friction begins small.
    pub(crate) fn initialise(&self, seed: u64) -> Vec<f64> {
        self.with_f64(|learner| {
            let mut parameters = learner
                .net()
                .initialise(&mut ChaCha8Rng::seed_from_u64(seed));
            parameters.resize(learner.parameters(), 0.01);
            parameters
        })
    }

    pub(crate) fn assemble(&self, parameters: &[f64]) -> Result<Learned> {
        Ok(match self {
            Self::Lnn {
                shape, friction, ..
            } => {
                let (weights, extra) = parameters.split_at(shape.net.parameters);
                let lnn = Lnn::assemble(shape.clone(), weights.to_vec())?;
                Learned::Lnn(match friction {
                    None => Mechanical::conservative(lnn),
                    Some(unit) => Mechanical::dissipative(lnn, unit.times(extra))?,
                })
            }
            Self::Mlp { shape, .. } => {
                Learned::Mlp(Mlp::assemble(shape.clone(), parameters.to_vec())?)
            }
        })
    }
}

impl Friction {
    /// The dissipation of trained coefficients `[2, n]`.
    fn times(&self, extra: &[f64]) -> Dissipation {
        let (viscous, coulomb) = extra.split_at(self.viscous.len());
        let product = |x: &[f64], unit: &[f64]| x.iter().zip(unit).map(|(x, u)| x * u).collect();
        Dissipation {
            viscous: product(viscous, &self.viscous),
            coulomb: product(coulomb, &self.coulomb),
            smoothing: self.smoothing,
        }
    }
}

enum Trainee<'a> {
    Lnn(LnnLearner<'a>),
    Mlp(MlpLearner<'a>),
}
