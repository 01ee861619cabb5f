//! The families that can be fitted: one line each in the tables below, one file each elsewhere.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use crate::baseline::{Direction, Mlp, MlpConfig, MlpShape};
use crate::dataset::Dataset;
use crate::dynamics::{EulerLagrange, Evaluator, Mechanical, Model};
use crate::hamiltonian::{Canonical, Hnn, HnnConfig, HnnShape};
use crate::identify::{Rigid, RigidConfig};
use crate::lagrangian::{
    Actuation, Delan, DelanConfig, DelanShape, Dissipation, Lagrangian, Lnn, LnnConfig, LnnShape,
    Rest, Sum,
};
use crate::models::delan::learner::DelanLearner;
use crate::models::hnn::learner::HnnLearner;
use crate::models::lnn::learner::LnnLearner;
use crate::models::mlp::learner::MlpLearner;
use crate::models::{delan::points::DelanPoints, lnn::points::LnnPoints};
use crate::neural_ode::{NeuralOde, NeuralOdeConfig, Order};
use crate::rigid::{IdentifiedRobot, RigidBodies};
use crate::train::FitConfig;
use crate::train::Learner;
use crate::train::remainder;
use crate::train::{CHORDS, PositionsLearner};
use crate::train::{ForceTerms, Forces};
use crate::{Coordinates, Result};

use crate::train::Loss;

/// A family of models and its shape.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase", tag = "name")]
pub enum Family {
    /// Lagrangian neural network.
    Lnn(LnnConfig),
    /// Deep Lagrangian network.
    Delan(DelanConfig),
    /// Hamiltonian network.
    Hnn(HnnConfig),
    /// Plain network, the baseline: of accelerations, or of torques where the loss is theirs.
    Mlp(MlpConfig),
    /// Neural ordinary differential equation.
    #[serde(rename = "neural-ode")]
    NeuralOde(NeuralOdeConfig),
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
            Self::Delan(delan) => delan.inertia.family(),
            Self::Hnn(_) => "hnn",
            Self::Mlp(_) => "mlp",
            Self::NeuralOde(_) => "neural-ode",
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
    /// The same with a mass matrix that is positive definite by construction.
    Delan(Mechanical<Delan>),
    /// A learned Hamiltonian, or the plain flow to compare with.
    Hnn(Canonical<Hnn>),
    /// A plain network.
    Mlp(Mlp),
    /// A plain network as the right-hand side of the motion.
    NeuralOde(NeuralOde),
    /// An identified chain of rigid links.
    Rigid(Rigid),
    /// A robot of known kinematics, identified.
    Robot(IdentifiedRobot),
    /// A robot that is known, and a network of what it leaves.
    Nominal(Box<Mechanical<Sum<RigidBodies, Rest>>>),
}

impl Model for Learned {
    fn coordinates(&self) -> &Coordinates {
        match self {
            Self::Lnn(model) => model.coordinates(),
            Self::Delan(model) => model.coordinates(),
            Self::Hnn(model) => model.coordinates(),
            Self::Mlp(model) => model.coordinates(),
            Self::NeuralOde(model) => model.coordinates(),
            Self::Rigid(model) => model.coordinates(),
            Self::Robot(model) => model.coordinates(),
            Self::Nominal(model) => model.coordinates(),
        }
    }

    fn moves(&self) -> bool {
        match self {
            Self::Mlp(model) => model.moves(),
            _ => true,
        }
    }

    fn evaluator(&self) -> Box<dyn Evaluator + '_> {
        match self {
            Self::Lnn(model) => model.evaluator(),
            Self::Delan(model) => model.evaluator(),
            Self::Hnn(model) => model.evaluator(),
            Self::Mlp(model) => model.evaluator(),
            Self::NeuralOde(model) => model.evaluator(),
            Self::Rigid(model) => model.evaluator(),
            Self::Robot(model) => model.evaluator(),
            Self::Nominal(model) => model.evaluator(),
        }
    }

    fn mechanics(&self) -> Option<EulerLagrange<'_>> {
        match self {
            Self::Lnn(model) => model.mechanics(),
            Self::Delan(model) => model.mechanics(),
            Self::Hnn(model) => model.mechanics(),
            Self::Mlp(model) => model.mechanics(),
            Self::NeuralOde(model) => model.mechanics(),
            Self::Rigid(model) => model.mechanics(),
            Self::Robot(model) => model.mechanics(),
            Self::Nominal(model) => model.mechanics(),
        }
    }
}

impl Learned {
    /// Its friction, where it has any.
    #[must_use]
    pub fn dissipation(&self) -> Option<&Dissipation> {
        match self {
            Self::Lnn(model) => model.dissipation(),
            Self::Delan(model) => model.dissipation(),
            Self::Hnn(model) => model.mechanical().dissipation(),
            Self::Mlp(_) | Self::NeuralOde(_) => None,
            Self::Rigid(rigid) => rigid.motion().dissipation(),
            Self::Robot(robot) => robot.motion().dissipation(),
            Self::Nominal(model) => model.dissipation(),
        }
    }

    /// How its forces come from inputs, where they are not the inputs themselves.
    #[must_use]
    pub fn actuation(&self) -> Option<&Actuation> {
        match self {
            Self::Lnn(model) => model.actuation(),
            Self::Delan(model) => model.actuation(),
            Self::Hnn(model) => model.mechanical().actuation(),
            Self::Nominal(model) => model.actuation(),
            Self::Mlp(_) | Self::NeuralOde(_) | Self::Rigid(_) | Self::Robot(_) => None,
        }
    }

    /// The name of its family.
    #[must_use]
    pub fn family(&self) -> &'static str {
        match self {
            Self::Lnn(_) => "lnn",
            Self::Delan(model) => model.lagrangian.config().inertia.family(),
            Self::Hnn(_) => "hnn",
            Self::Mlp(_) => "mlp",
            Self::NeuralOde(_) => "neural-ode",
            Self::Rigid(_) | Self::Robot(_) => "rigid",
            Self::Nominal(model) => match model.lagrangian.rest() {
                Rest::Lnn(_) => "lnn",
                Rest::Delan(delan) => delan.config().inertia.family(),
            },
        }
    }

    /// The robot that it was learned upon, where there is one.
    #[must_use]
    pub fn nominal(&self) -> Option<&RigidBodies> {
        match self {
            Self::Nominal(model) => Some(model.lagrangian.known()),
            _ => None,
        }
    }

    /// This network as what `nominal` leaves.
    pub(crate) fn upon(self, nominal: Option<&RigidBodies>) -> Result<Self> {
        let Some(nominal) = nominal.cloned() else {
            return Ok(self);
        };
        let model = match self {
            Self::Lnn(model) => model.with(|lnn| Sum::new(nominal, Rest::Lnn(lnn)))?,
            Self::Delan(model) => model.with(|delan| Sum::new(nominal, Rest::Delan(delan)))?,
            other => {
                return Err(crate::Error::Argument {
                    name: "nominal model",
                    value: format!("one beneath the family {}", other.family()),
                    must: "beneath a Lagrangian network: lnn or delan",
                });
            }
        };
        Ok(Self::Nominal(Box::new(model)))
    }
}

/// A family with everything but its weights, ready to be trained on a dataset.
pub(crate) enum Template {
    Lnn {
        shape: LnnShape,
        loss: Loss,
        weights: Vec<f64>,
        terms: ForceTerms,
        forces: Forces,
        nominal: Option<RigidBodies>,
    },
    Delan {
        shape: DelanShape,
        loss: Loss,
        weights: Vec<f64>,
        terms: ForceTerms,
        forces: Forces,
        nominal: Option<RigidBodies>,
    },
    Hnn {
        shape: HnnShape,
        loss: Loss,
        weights: Vec<f64>,
        terms: ForceTerms,
        forces: Forces,
    },
    Mlp {
        shape: MlpShape,
        loss: Loss,
        weights: Vec<f64>,
        /// Whether it is the right-hand side of a neural ODE.
        ode: bool,
    },
}

impl Family {
    pub(crate) fn template(&self, dataset: &Dataset, config: &FitConfig) -> Result<Template> {
        let n = dataset.coordinates.dof();
        crate::Error::check_dof(n, crate::train::MAX_DOF)?;
        let nominal = config.nominal(dataset, self)?;
        let left = nominal.as_ref().map(|nominal| remainder(nominal, dataset));
        let dataset = left.as_ref().unwrap_or(dataset);
        let (qdd, tau) = (dataset.acceleration_scale(), dataset.force_scale());
        // Under the rollout loss it is what the run begins with.
        let loss = match config.loss {
            Loss::Rollout => Loss::Acceleration,
            loss => loss,
        };
        let weights = loss.weights(dataset);
        let (coordinates, scaling) = (dataset.coordinates.clone(), dataset.scaling());
        let terms = config.forces;
        let forces = Forces::new(terms, tau.clone(), scaling.qd_scale.clone(), qdd.clone());
        Ok(match self {
            Self::Lnn(LnnConfig { speed_limit, .. }) | Self::Hnn(HnnConfig { speed_limit, .. })
                if speed_limit.is_some_and(|c| dataset.fastest() >= c) =>
            {
                return Err(crate::Error::Argument {
                    name: "fastest velocity of the data",
                    value: dataset.fastest().to_string(),
                    must: "below the speed limit (--speed-limit)",
                });
            }
            Self::Lnn(lnn) => Template::Lnn {
                shape: LnnShape::new(coordinates, lnn.clone(), scaling)?,
                loss,
                weights,
                terms,
                forces,
                nominal,
            },
            Self::Delan(delan) => Template::Delan {
                shape: DelanShape::new(coordinates, delan.clone(), dataset.mass_scaling())?,
                loss,
                weights,
                terms,
                forces,
                nominal,
            },
            Self::Hnn(hnn) => {
                let (scaling, weights) = dataset.phase_scaling(hnn)?;
                Template::Hnn {
                    shape: HnnShape::new(coordinates, hnn.clone(), scaling)?,
                    loss,
                    weights,
                    terms,
                    forces,
                }
            }
            Self::Mlp(mlp) => {
                let direction = match loss {
                    Loss::Torque | Loss::TorqueL1 => Direction::Inverse,
                    _ => Direction::Forward,
                };
                let mlp = MlpConfig {
                    direction,
                    forced: dataset.forced,
                    ..mlp.clone()
                };
                Template::Mlp {
                    shape: MlpShape::new(coordinates, mlp, scaling, (qdd, tau))?,
                    loss,
                    weights,
                    ode: false,
                }
            }
            Self::NeuralOde(ode) => {
                let network = ode.network(dataset.forced);
                let weights = match ode.order {
                    Order::First => {
                        let of_velocities = scaling.qd_scale.iter().map(|s| 1.0 / s);
                        of_velocities.chain(weights).collect()
                    }
                    Order::Second => weights,
                };
                Template::Mlp {
                    shape: MlpShape::new(coordinates, network, scaling, (qdd, tau))?,
                    loss,
                    weights,
                    ode: true,
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

impl Template {
    fn learner(&self) -> Trainee<'_> {
        match self {
            Self::Lnn {
                shape,
                loss,
                weights,
                forces,
                nominal,
                ..
            } => match loss.rule() {
                None => Trainee::Lnn(LnnLearner {
                    shape,
                    loss: *loss,
                    weights,
                    forces: forces.clone(),
                    nominal: nominal.as_ref(),
                }),
                Some(rule) => Trainee::LnnPositions(PositionsLearner {
                    family: LnnPoints(shape),
                    loss: *loss,
                    rule,
                    constant: false,
                    weights,
                    forces: forces.clone(),
                    chords: CHORDS,
                }),
            },
            Self::Delan {
                shape,
                loss,
                weights,
                forces,
                nominal,
                ..
            } => match loss.rule() {
                None => Trainee::Delan(DelanLearner {
                    shape,
                    loss: *loss,
                    weights,
                    forces: forces.clone(),
                    nominal: nominal.as_ref(),
                }),
                Some(rule) => Trainee::DelanPositions(PositionsLearner {
                    family: DelanPoints(shape),
                    loss: *loss,
                    rule,
                    constant: shape.config.has_constant_momentum(),
                    weights,
                    forces: forces.clone(),
                    chords: CHORDS,
                }),
            },
            Self::Hnn {
                shape,
                loss,
                weights,
                forces,
                ..
            } => Trainee::Hnn(HnnLearner {
                shape,
                loss: *loss,
                weights,
                forces: forces.clone(),
                phase: false,
            }),
            Self::Mlp {
                shape,
                loss,
                weights,
                ..
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
            Trainee::Delan(learner) => f(&learner),
            Trainee::LnnPositions(learner) => f(&learner),
            Trainee::DelanPositions(learner) => f(&learner),
            Trainee::Hnn(learner) => f(&learner),
            Trainee::Mlp(learner) => f(&learner),
        }
    }

    /// As [`Template::with_f64`], its residuals the rates themselves: errors of accelerations of weight 1.
    pub(crate) fn with_flow<R>(&self, f: impl FnOnce(&dyn Learner<f64>) -> R) -> R {
        let ones = vec![1.0; 2 * crate::train::MAX_DOF];
        let learner = self.learner();
        let weights = |weights: &[f64]| &ones[..weights.len()];
        match learner {
            Trainee::Lnn(learner) => f(&LnnLearner {
                weights: weights(learner.weights),
                loss: Loss::Acceleration,
                ..learner
            }),
            Trainee::Delan(learner) => f(&DelanLearner {
                weights: weights(learner.weights),
                loss: Loss::Acceleration,
                ..learner
            }),
            Trainee::Mlp(learner) => f(&MlpLearner {
                weights: weights(learner.weights),
                loss: Loss::Acceleration,
                ..learner
            }),
            Trainee::Hnn(learner) => f(&HnnLearner {
                weights: &ones[..learner.weights.len()],
                loss: Loss::Acceleration,
                phase: true,
                ..learner
            }),
            // Refused before: these are no flows.
            Trainee::LnnPositions(learner) => f(&learner),
            Trainee::DelanPositions(learner) => f(&learner),
        }
    }

    pub(crate) fn with_f32<R>(&self, f: impl FnOnce(&dyn Learner<f32>) -> R) -> R {
        match self.learner() {
            Trainee::Lnn(learner) => f(&learner),
            Trainee::Delan(learner) => f(&learner),
            Trainee::LnnPositions(learner) => f(&learner),
            Trainee::DelanPositions(learner) => f(&learner),
            Trainee::Hnn(learner) => f(&learner),
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
            parameters.extend(learner.forces().map(Forces::initial).unwrap_or_default());
            parameters
        })
    }

    pub(crate) fn assemble(&self, parameters: &[f64]) -> Result<Learned> {
        Ok(match self {
            Self::Lnn {
                shape,
                terms,
                forces,
                nominal,
                ..
            } => {
                let (weights, extra) = parameters.split_at(shape.net.parameters);
                let lnn = Lnn::assemble(shape.clone(), weights.to_vec())?;
                Learned::Lnn(forces.mechanical(lnn, *terms, extra)?).upon(nominal.as_ref())?
            }
            Self::Delan {
                shape,
                terms,
                forces,
                nominal,
                ..
            } => {
                let (weights, extra) = parameters.split_at(shape.net.parameters);
                let rotors = forces.rotors(extra);
                let delan = Delan::assemble(shape.clone(), weights.to_vec(), rotors)?;
                Learned::Delan(forces.mechanical(delan, *terms, extra)?).upon(nominal.as_ref())?
            }
            Self::Hnn {
                shape,
                terms,
                forces,
                ..
            } => {
                let (weights, extra) = parameters.split_at(shape.layers().parameters);
                let hnn = Hnn::assemble(shape.clone(), weights.to_vec())?;
                let dissipation = forces.dissipation(*terms, extra);
                let actuation = forces.actuation(*terms, extra)?;
                Learned::Hnn(Canonical::with(hnn, dissipation, actuation)?)
            }
            Self::Mlp { shape, ode, .. } => {
                let network = Mlp::assemble(shape.clone(), parameters.to_vec())?;
                match ode {
                    true => Learned::NeuralOde(NeuralOde::new(network)?),
                    false => Learned::Mlp(network),
                }
            }
        })
    }
}

impl Forces {
    /// A Lagrangian with the trained forces.
    fn mechanical<L: Lagrangian>(
        &self,
        lagrangian: L,
        terms: ForceTerms,
        extra: &[f64],
    ) -> Result<Mechanical<L>> {
        let model = match self.dissipation(terms, extra) {
            None => Mechanical::conservative(lagrangian),
            Some(dissipation) => Mechanical::dissipative(lagrangian, dissipation)?,
        };
        match self.actuation(terms, extra)? {
            None => Ok(model),
            Some(actuation) => model.driven(actuation),
        }
    }
}

impl Loss {
    /// The weights of a sample's residuals, `[m]`: one over the root mean square of what they are errors of, 0 of
    /// parameters.
    fn weights(self, dataset: &Dataset) -> Vec<f64> {
        let (qdd, tau) = (dataset.acceleration_scale(), dataset.force_scale());
        let scales = match self {
            Self::TorqueAcceleration => [tau, qdd].concat(),
            Self::TorquePower => {
                let power = dataset.power_scale();
                [tau, vec![power]].concat()
            }
            _ if self.needs_forces() => tau,
            _ => qdd,
        };
        let n = dataset.coordinates.dof();
        let mut weights: Vec<f64> = scales.iter().map(|s| 1.0 / s).collect();
        for i in dataset.coordinates.parameters() {
            let own = weights.chunks_exact_mut(n).map(|set| &mut set[i]);
            own.for_each(|w| *w = 0.0);
        }
        weights
    }
}

enum Trainee<'a> {
    Lnn(LnnLearner<'a>),
    Delan(DelanLearner<'a>),
    LnnPositions(PositionsLearner<'a, LnnPoints<'a>>),
    DelanPositions(PositionsLearner<'a, DelanPoints<'a>>),
    Hnn(HnnLearner<'a>),
    Mlp(MlpLearner<'a>),
}
