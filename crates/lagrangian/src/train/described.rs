//! The numbers of a learned model that have a name and a unit.

use serde::Serialize;

use super::Learned;
use crate::dynamics::Model;
use crate::identify;
use crate::rigid::IdentifiedRobot;

/// A number with a meaning: a coefficient of friction, an offset, a gain, an inertia.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Parameter {
    /// Its name, `kind_coordinate`, e.g. `viscous_q1`.
    pub name: String,
    /// Its value.
    pub value: f64,
    /// Its unit.
    pub unit: String,
    /// Its standard error, where it was solved for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub standard_error: Option<f64>,
}

/// Units of one coordinate.
struct Units {
    q: String,
}

impl Units {
    fn rotates(&self) -> bool {
        self.q == "rad"
    }
    fn force(&self) -> String {
        if self.rotates() { "N·m" } else { "N" }.into()
    }
    fn speed(&self) -> String {
        format!("{}/s", self.q)
    }
    fn viscous(&self) -> String {
        let unit = if self.rotates() {
            "N·m·s/rad"
        } else {
            "N·s/m"
        };
        unit.into()
    }
    fn inertia(&self) -> String {
        if self.rotates() { "kg·m²" } else { "kg" }.into()
    }
}

impl Learned {
    /// Its numbers that have a name: friction, offsets, gains, rotor inertias; for a chain of rigid links or a robot
    /// all.
    #[must_use]
    pub fn parameters(&self) -> Vec<Parameter> {
        if let Self::Rigid(rigid) = self {
            return rigid.parameters().into_iter().map(solved).collect();
        }
        if let Self::Robot(robot) = self {
            return of_robot(robot);
        }
        let mut list = Vec::new();
        let coordinates = &self.coordinates().0;
        let mut add = |kind: &str, values: &[f64], unit: &dyn Fn(&Units) -> String| {
            for (coordinate, &value) in coordinates.iter().zip(values) {
                list.push(Parameter {
                    name: format!("{kind}_{}", coordinate.name),
                    value,
                    unit: unit(&Units {
                        q: coordinate.unit.clone(),
                    }),
                    standard_error: None,
                });
            }
        };
        if let Some(d) = self.dissipation() {
            add("viscous", &d.viscous, &Units::viscous);
            add("coulomb", &d.coulomb, &Units::force);
            add("coulomb_speed", &d.smoothing, &Units::speed);
            if let Some(stribeck) = &d.stribeck {
                add("stribeck", &stribeck.height, &Units::force);
                add("stribeck_speed", &stribeck.speed, &Units::speed);
            }
        }
        if let Some(actuation) = self.actuation() {
            let n = actuation.dof();
            add("offset", actuation.offsets(), &Units::force);
            // The identity is what joints driven by their own torques have, learned or not.
            let driven = if actuation.is_direct() {
                &[][..]
            } else {
                coordinates
            };
            for (j, input) in driven.iter().enumerate() {
                let column: Vec<f64> = actuation
                    .matrix()
                    .iter()
                    .skip(j)
                    .step_by(n)
                    .copied()
                    .collect();
                let name = format!("input_{}_to", input.name);
                add(&name, &column, &|units| {
                    format!("{} a unit of input", units.force())
                });
            }
        }
        if let Self::Delan(model) = self {
            add("rotor", model.lagrangian.rotors(), &Units::inertia);
        }
        list
    }
}

/// The parameters of an identified robot: ten of each body, then those of the joints; joints that slide have N for N·m
/// and kg for kg·m².
fn of_robot(robot: &IdentifiedRobot) -> Vec<Parameter> {
    let bodies = 10 * robot.coordinates().dof();
    let unit = |k: usize| match k % 10 {
        0 => "kg",
        1..=3 => "kg·m",
        _ => "kg·m²",
    };
    let all = robot.parameters().into_iter().map(solved).enumerate();
    all.map(|(k, parameter)| match k < bodies {
        true => Parameter {
            unit: unit(k).into(),
            ..parameter
        },
        false => parameter,
    })
    .collect()
}

/// A parameter of a chain of rigid links.
fn solved(parameter: identify::Parameter) -> Parameter {
    let unit = match parameter.name.split('_').next() {
        Some("inertia" | "rotor") => "kg·m²",
        Some("gravity") => "J",
        Some("viscous") => "N·m·s/rad",
        _ => "N·m",
    };
    Parameter {
        name: parameter.name,
        value: parameter.value,
        unit: unit.into(),
        standard_error: Some(parameter.standard_error),
    }
}
