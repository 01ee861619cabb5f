//! The system that generated the data, where they name it.

use lagrangian::analytic::{AnalyticModel, by_name};
use lagrangian::mechanics::{Dissipation, Quantities};
use lagrangian::rigid::{RigidBodies, RobotConfig};
use lagrangian::trajectory::Simulated;
use lagrangian::{Layout, Learned, Model};

use crate::record::RunRecord;

/// A known system, and its comparison with the learned functions.
pub(super) struct Truth {
    pub(super) system: Box<dyn AnalyticModel>,
    pub(super) friction: Dissipation,
    /// Whether energies are known up to a factor, and scaled to the truth.
    pub(super) is_scaled: bool,
}

/// The columns of the data of a run.
pub(in crate::page) fn layout(record: &RunRecord) -> Option<Layout> {
    let columns = record.resolved.get("data")?.get("columns")?;
    Layout::from_table(columns.as_table()?.clone()).ok()
}

impl Truth {
    /// The system that the data of a run name; `None` for one of other coordinates, to which their columns cannot belong.
    pub(super) fn of(record: &RunRecord, model: &Learned, middle: &[f64]) -> Option<Self> {
        let simulated = layout(record)?.system?;
        let mut friction = Dissipation::viscous(vec![simulated.friction; middle.len()]);
        let system: Box<dyn AnalyticModel> = match &simulated.urdf {
            Some(_) => {
                let robot = robot(&simulated, model)?.with_friction().ok()?;
                if let Some(own) = robot.dissipation() {
                    let viscous = own.viscous.iter().map(|own| own + simulated.friction);
                    friction = Dissipation {
                        viscous: viscous.collect(),
                        ..own.clone()
                    };
                }
                Box::new(robot)
            }
            None => {
                let parameters = simulated.parameters.iter();
                let parameters: Vec<(&str, f64)> =
                    parameters.map(|(k, x)| (k.as_str(), *x)).collect();
                by_name(&simulated.name, &parameters).ok()?
            }
        };
        if system.coordinates().dof() != middle.len() {
            return None;
        }
        Some(Self {
            system,
            friction,
            is_scaled: model
                .visited()
                .is_some_and(lagrangian::trajectory::Visited::is_free),
        })
    }

    /// The factor from the energies of a model to the truth.
    pub(super) fn factor(&self, model: &Learned, middle: &[f64]) -> f64 {
        match self.is_scaled {
            true => factor(model, &*self.system, middle),
            false => 1.0,
        }
    }
}

/// The robot that was simulated for the data of a run.
pub(in crate::page) fn simulated_robot(record: &RunRecord, model: &Learned) -> Option<RigidBodies> {
    robot(&layout(record)?.system?, model)
}

/// The robot of the data with the coordinates of a model; `None` where its text is not a robot, or one of other coordinates.
fn robot(simulated: &Simulated, model: &Learned) -> Option<RigidBodies> {
    let config = RobotConfig {
        urdf: simulated.urdf.clone()?,
        joints: simulated.joints.clone(),
    };
    config.bodies(model.coordinates()).ok()
}

/// The factor from the inertia of a model to that of another, by their traces in the middle of the data; 1 without inertia.
pub(super) fn factor(model: &dyn Model, other: &dyn Model, middle: &[f64]) -> f64 {
    let trace = |model: &dyn Model| -> Option<f64> {
        let mass = model.mass_matrix(middle).ok()?;
        Some(mass.iter().step_by(middle.len() + 1).sum())
    };
    let ratio = trace(other).zip(trace(model)).map(|(a, b)| a / b);
    ratio.filter(|x| x.is_finite() && *x != 0.0).unwrap_or(1.0)
}
