//! The families of models that can be saved, one arm each.

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::{Header, Provenance, SavedModel, Tensor, damaged};
use crate::baseline::{Mlp, MlpConfig};
use crate::dynamics::{Mechanical, Model};
use crate::hamiltonian::{Canonical, Hamiltonian, Hnn, HnnConfig};
use crate::identify::Rigid;
use crate::lagrangian::{
    Actuation, Angles, Delan, DelanConfig, Dissipation, Inertia, Lagrangian, Lnn, LnnConfig, Rest,
    RigidChain, Scaling, Sum,
};
use crate::neural_ode::NeuralOde;
use crate::rigid::{IdentifiedRobot, RigidBodies, RobotConfig};
use crate::train::Learned;
use crate::{Coordinates, Result};

/// The one tensor of a network: all weights, in the order of its `parameters`.
const WEIGHTS: &str = "parameters";

const LNN: &str = "lnn";
const DELAN: &str = "delan";
const VIN: &str = "vin";
const HNN: &str = "hnn";
const MLP: &str = "mlp";
const NEURAL_ODE: &str = "neural-ode";
const RIGID: &str = "rigid";
const ROBOT: &str = "robot";

/// Before the family of a network that was learned upon a robot.
const UPON: &str = "nominal+";

/// The other tensor of a chain: the standard errors of all its parameters.
const ERRORS: &str = "standard_errors";

/// The other tensor of a deep Lagrangian network: inertias of rotors, one a coordinate or none.
const ROTORS: &str = "rotor_inertias";

/// What a chain's parameters mean.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct ChainShape {
    angles: Angles,
}

/// Tensors of a robot's drives.
const ROTOR: &str = "rotor";
const OFFSET: &str = "offset";

/// The robot that the parameters belong to.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RobotShape {
    robot: RobotConfig,
    gravity: [f64; 3],
}

impl RobotShape {
    fn of(bodies: &RigidBodies) -> Self {
        Self {
            robot: bodies.config(),
            gravity: bodies.gravity(),
        }
    }

    fn bodies(&self, coordinates: &Coordinates) -> Result<RigidBodies> {
        RigidBodies::with_joints(&self.robot.urdf, &self.robot.joints)?
            .with_coordinates(coordinates.clone())?
            .with_gravity(self.gravity)
    }
}

/// The scales of an [`Mlp`].
#[derive(Serialize, Deserialize)]
struct MlpScales {
    inputs: Scaling,
    qdd: Vec<f64>,
    tau: Vec<f64>,
}

impl Learned {
    /// What is to be saved of it.
    ///
    /// # Errors
    /// [`crate::Error::Tensor`] where a weight is not finite, [`crate::Error::DamagedModel`] where its description
    /// cannot be written.
    pub fn save(&self, provenance: Provenance) -> Result<SavedModel> {
        let header = |family: &str, architecture, scaling| Header {
            family: family.into(),
            form: None,
            coordinates: self.coordinates().clone(),
            architecture,
            scaling,
            dissipation: Value::Null,
            nominal: Value::Null,
            actuation: Value::Null,
            provenance: provenance.clone(),
        };
        match self {
            Self::Lnn(model) => {
                let lnn = &model.lagrangian;
                let mut header = header(LNN, describe(lnn.config())?, describe(lnn.scaling())?);
                header.form = describe(&lnn.config().form)?.as_str().map(String::from);
                header.forces(model)?;
                saved(header, lnn.parameters())
            }
            Self::Delan(model) => {
                let delan = &model.lagrangian;
                let (config, scaling) = (describe(delan.config())?, describe(delan.scaling())?);
                let mut header = header(self.family(), config, scaling);
                header.forces(model)?;
                let mut saved = saved(header, delan.parameters())?;
                let rotors = delan.rotors();
                let rotors = Tensor::new(vec![rotors.len()], rotors.to_vec())?;
                saved.tensors.insert(ROTORS.into(), rotors);
                Ok(saved)
            }
            Self::Hnn(model) => {
                let hnn = model.hamiltonian();
                let mut header = header(HNN, describe(hnn.config())?, describe(hnn.scaling())?);
                header.form = describe(&hnn.config().structure)?
                    .as_str()
                    .map(String::from);
                header.forces(model.mechanical())?;
                saved(header, hnn.parameters())
            }
            Self::Mlp(mlp) => network(MLP, mlp, &header),
            Self::NeuralOde(ode) => network(NEURAL_ODE, ode.network(), &header),
            Self::Rigid(rigid) => {
                let chain = &rigid.motion().lagrangian;
                let angles = chain.angles();
                let mut header = header(RIGID, describe(&ChainShape { angles })?, Value::Null);
                header.dissipation = describe(&rigid.motion().dissipation())?;
                let errors = rigid.standard_errors();
                let mut model = saved(header, chain.parameters())?;
                let errors = Tensor::new(vec![errors.len()], errors.to_vec())?;
                model.tensors.insert(ERRORS.into(), errors);
                Ok(model)
            }
            Self::Nominal(model) => upon(model, provenance),
            Self::Robot(robot) => {
                let bodies = &robot.motion().lagrangian;
                let mut header = header(ROBOT, describe(&RobotShape::of(bodies))?, Value::Null);
                header.dissipation = describe(&robot.motion().dissipation())?;
                let mut model = saved(header, &bodies.inertial_parameters())?;
                for (name, list) in [
                    (ROTOR, bodies.rotor()),
                    (OFFSET, bodies.offset()),
                    (ERRORS, robot.standard_errors()),
                ] {
                    let list = Tensor::new(vec![list.len()], list.to_vec())?;
                    model.tensors.insert(name.into(), list);
                }
                Ok(model)
            }
        }
    }

    /// The model that was saved.
    ///
    /// # Errors
    /// [`crate::Error::DamagedModel`] for an unknown family or a description that is not that of its family;
    /// [`crate::Error::Tensor`], [`crate::Error::Shape`] or [`crate::Error::Argument`] for weights that do not belong
    /// to it.
    pub fn load(saved: &SavedModel) -> Result<Self> {
        let header = &saved.header;
        if let Some(family) = header.family.strip_prefix(UPON) {
            if ![LNN, DELAN, VIN].contains(&family) {
                return Err(damaged(format!("'{family}' is no network upon a robot")));
            }
            let mut rest = saved.clone();
            rest.header.family = family.into();
            let shape: RobotShape = read("nominal model", &header.nominal)?;
            return Self::load(&rest)?.upon(Some(&shape.bodies(&header.coordinates)?));
        }
        if header.family == RIGID {
            return chain(saved).map(Self::Rigid);
        }
        if header.family == ROBOT {
            return robot(saved).map(Self::Robot);
        }
        let coordinates = header.coordinates.clone();
        if [DELAN, VIN].contains(&&*header.family) {
            let (weights, rotors) = (tensor(saved, WEIGHTS)?, tensor(saved, ROTORS)?);
            saved.expect_tensors(&[
                (WEIGHTS.into(), vec![weights.len()]),
                (ROTORS.into(), vec![rotors.len()]),
            ])?;
            let config: DelanConfig = read("architecture", &header.architecture)?;
            if header.family == VIN && config.inertia != Inertia::Constant {
                return Err(damaged("a vin whose inertia is not constant".into()));
            }
            let scaling = read("scaling", &header.scaling)?;
            let delan = Delan::with_parameters(coordinates, config, scaling, weights, rotors)?;
            return Ok(Self::Delan(moving(delan, header)?));
        }
        let weights = weights(saved)?;
        match header.family.as_str() {
            LNN => {
                let config: LnnConfig = read("architecture", &header.architecture)?;
                let lnn = Lnn::with_parameters(
                    coordinates,
                    config,
                    read("scaling", &header.scaling)?,
                    weights,
                )?;
                Ok(Self::Lnn(moving(lnn, header)?))
            }
            HNN => {
                let config: HnnConfig = read("architecture", &header.architecture)?;
                let scaling = read("scaling", &header.scaling)?;
                let hnn = Hnn::with_parameters(coordinates, config, scaling, weights)?;
                let dissipation = read("dissipation", &header.dissipation)?;
                let actuation = read("actuation", &header.actuation)?;
                Ok(Self::Hnn(Canonical::with(hnn, dissipation, actuation)?))
            }
            MLP | NEURAL_ODE => {
                let config: MlpConfig = read("architecture", &header.architecture)?;
                let scales: MlpScales = read("scaling", &header.scaling)?;
                let outputs = (scales.qdd, scales.tau);
                let mlp =
                    Mlp::with_parameters(coordinates, config, scales.inputs, outputs, weights)?;
                match header.family.as_str() {
                    NEURAL_ODE => Ok(Self::NeuralOde(NeuralOde::new(mlp)?)),
                    _ => Ok(Self::Mlp(mlp)),
                }
            }
            super::field::FIELD => Err(crate::Error::Argument {
                name: "saved model",
                value: "the density of a field".into(),
                must: "a model of coordinates of its own: a density moves on a ring of any size \
                       (`field::DensityNet::load` in the library)",
            }),
            other => Err(damaged(format!(
                "'{other}' is no family of models that is known"
            ))),
        }
    }

    /// Its Lagrangian, where it has one.
    #[must_use]
    pub fn lagrangian(&self) -> Option<&dyn Lagrangian> {
        match self {
            Self::Lnn(model) => Some(&model.lagrangian),
            Self::Delan(model) => Some(&model.lagrangian),
            Self::Hnn(model) if model.hamiltonian().canonical() => {
                Some(&model.mechanical().lagrangian)
            }
            Self::Hnn(_) | Self::Mlp(_) | Self::NeuralOde(_) => None,
            Self::Rigid(rigid) => Some(&rigid.motion().lagrangian),
            Self::Robot(robot) => Some(&robot.motion().lagrangian),
            Self::Nominal(model) => Some(&model.lagrangian),
        }
    }
}

/// What is saved of a plain network.
fn network(
    family: &str,
    mlp: &Mlp,
    header: &dyn Fn(&str, Value, Value) -> Header,
) -> Result<SavedModel> {
    let (qdd, tau) = mlp.scales();
    let scales = MlpScales {
        inputs: mlp.scaling().clone(),
        qdd: qdd.into(),
        tau: tau.into(),
    };
    let header = header(family, describe(mlp.config())?, describe(&scales)?);
    saved(header, mlp.parameters())
}

/// The chain that was saved.
fn chain(saved: &SavedModel) -> Result<Rigid> {
    let header = &saved.header;
    let shape: ChainShape = read("architecture", &header.architecture)?;
    if !header.scaling.is_null() {
        return Err(damaged("a rigid chain has no scaling".into()));
    }
    let values = tensor(saved, WEIGHTS)?;
    let errors = tensor(saved, ERRORS)?;
    saved.expect_tensors(&[
        (WEIGHTS.into(), vec![values.len()]),
        (ERRORS.into(), vec![errors.len()]),
    ])?;
    let chain = RigidChain::new(header.coordinates.clone(), shape.angles, values)?;
    Rigid::new(moving(chain, header)?, errors)
}

/// A network upon a robot: what is saved of the network, and the robot in its header.
fn upon(model: &Mechanical<Sum<RigidBodies, Rest>>, provenance: Provenance) -> Result<SavedModel> {
    let network = match model.lagrangian.rest() {
        Rest::Lnn(lnn) => Learned::Lnn(model.clone().with(|_| Ok(lnn.clone()))?),
        Rest::Delan(delan) => Learned::Delan(model.clone().with(|_| Ok(delan.clone()))?),
    };
    let mut saved = network.save(provenance)?;
    saved.header.family.insert_str(0, UPON);
    saved.header.nominal = describe(&RobotShape::of(model.lagrangian.known()))?;
    Ok(saved)
}

/// The robot that was saved.
fn robot(saved: &SavedModel) -> Result<IdentifiedRobot> {
    let header = &saved.header;
    let shape: RobotShape = read("architecture", &header.architecture)?;
    if !header.scaling.is_null() {
        return Err(damaged("a robot has no scaling".into()));
    }
    let lists = [WEIGHTS, ROTOR, OFFSET, ERRORS].map(|name| tensor(saved, name));
    let [weights, rotor, offset, errors] = lists;
    let bodies = shape
        .bodies(&header.coordinates)?
        .with_inertial_parameters(&weights?)?
        .with_drives(rotor?, offset?)?;
    let robot = IdentifiedRobot::new(moving(bodies, header)?, errors?)?;
    let (n, errors) = (
        robot.motion().lagrangian.dof(),
        robot.standard_errors().len(),
    );
    let expected = [(WEIGHTS, 10 * n), (ROTOR, n), (OFFSET, n), (ERRORS, errors)];
    saved.expect_tensors(&expected.map(|(name, count)| (name.into(), vec![count])))?;
    Ok(robot)
}

/// A Lagrangian with the dissipation of the header.
fn moving<L: Lagrangian>(lagrangian: L, header: &Header) -> Result<Mechanical<L>> {
    let dissipation: Option<Dissipation> = read("dissipation", &header.dissipation)?;
    let model = match dissipation {
        None => Mechanical::conservative(lagrangian),
        Some(dissipation) => Mechanical::dissipative(lagrangian, dissipation)?,
    };
    let actuation: Option<Actuation> = read("actuation", &header.actuation)?;
    match actuation {
        None => Ok(model),
        Some(actuation) => model.driven(actuation),
    }
}

impl Header {
    /// Describes the forces of a model beside those of its Lagrangian.
    fn forces<L: Lagrangian>(&mut self, model: &Mechanical<L>) -> Result<()> {
        self.dissipation = describe(&model.dissipation())?;
        self.actuation = describe(&model.actuation())?;
        Ok(())
    }
}

pub(super) fn saved(header: Header, weights: &[f64]) -> Result<SavedModel> {
    let tensor = Tensor::new(vec![weights.len()], weights.to_vec())?;
    Ok(SavedModel {
        header,
        tensors: [(WEIGHTS.to_string(), tensor)].into(),
    })
}

pub(super) fn weights(saved: &SavedModel) -> Result<Vec<f64>> {
    let weights = tensor(saved, WEIGHTS)?;
    saved.expect_tensors(&[(WEIGHTS.to_string(), vec![weights.len()])])?;
    Ok(weights)
}

/// A list of any length.
fn tensor(saved: &SavedModel, name: &str) -> Result<Vec<f64>> {
    let count = saved
        .tensors
        .get(name)
        .map_or(0, |tensor| tensor.data().len());
    Ok(saved.tensor(name, &[count])?.to_vec())
}

pub(super) fn describe(part: &impl Serialize) -> Result<Value> {
    serde_json::to_value(part).map_err(|e| damaged(e.to_string()))
}

pub(super) fn read<T: serde::de::DeserializeOwned>(part: &str, value: &Value) -> Result<T> {
    serde_json::from_value(value.clone()).map_err(|e| damaged(format!("its {part}: {e}")))
}
