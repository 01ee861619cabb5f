//! The parameters of a fitted model that have a name and a unit.

use serde::Serialize;

use lagrangian_mechanics::forces::{Actuation, Applied, Directional, Dissipation};
use lagrangian_motion::Coordinates;

/// A parameter with a meaning: a coefficient of friction, an offset, a gain, an inertia.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Parameter {
    /// The name, `kind_coordinate`, such as `viscous_q1`.
    pub name: String,
    /// The value.
    pub value: f64,
    /// The unit.
    pub unit: String,
    /// The standard error, for a parameter that was identified.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub standard_error: Option<f64>,
}

impl Parameter {
    /// Marks a force or an inertia as known up to the factor of a Lagrangian of free motions. Speeds and quotients of two
    /// such parameters do not depend on it.
    pub(super) fn up_to_a_factor(&mut self) {
        if self.unit.starts_with("N") || self.unit.starts_with("kg") {
            self.unit += " up to a common factor";
        }
    }
}

/// The unit for a rotating or a sliding coordinate, by the unit of the coordinate.
fn either(q: &str, rotating: &str, sliding: &str) -> String {
    if q == "rad" { rotating } else { sliding }.into()
}

fn force(q: &str) -> String {
    either(q, "N·m", "N")
}

fn speed(q: &str) -> String {
    format!("{q}/s")
}

fn viscous(q: &str) -> String {
    either(q, "N·m·s/rad", "N·s/m")
}

fn inertia(q: &str) -> String {
    either(q, "kg·m²", "kg")
}

/// A standard error that is known.
fn known(error: Option<&f64>) -> Option<f64> {
    error.copied().filter(|own| *own > 0.0)
}

/// Builds a list of named parameters.
pub(crate) struct Named<'a> {
    coordinates: &'a Coordinates,
    /// The standard errors of friction, as [`LearnedLagrangian::friction_errors`](super::LearnedLagrangian::friction_errors).
    friction_errors: &'a [f64],
    list: Vec<Parameter>,
}

impl<'a> Named<'a> {
    /// An empty list, for a model of these coordinates.
    pub(crate) fn of(coordinates: &'a Coordinates) -> Self {
        Self {
            coordinates,
            friction_errors: &[],
            list: Vec::new(),
        }
    }

    /// The same with the standard errors of friction.
    pub(crate) fn with_friction_errors(self, friction_errors: &'a [f64]) -> Self {
        Self {
            friction_errors,
            ..self
        }
    }

    /// The parameters in the order in which they were added.
    pub(crate) fn list(self) -> Vec<Parameter> {
        self.list
    }

    /// Adds the terms of a formula.
    pub(crate) fn terms(mut self, terms: Vec<Parameter>) -> Self {
        self.list.extend(terms);
        self
    }

    /// Adds friction, offsets and the input matrix.
    pub(crate) fn forces(mut self, forces: Applied<'_>) -> Self {
        if let Some(dissipation) = forces.dissipation {
            self.dissipation(dissipation);
        }
        if let Some(actuation) = forces.actuation {
            self.actuation(actuation);
        }
        self
    }

    /// Adds the inertias of rotors.
    pub(crate) fn rotors(mut self, rotors: &[f64]) -> Self {
        self.add("rotor", rotors, inertia);
        self
    }

    fn add(&mut self, kind: &str, values: &[f64], unit: impl Fn(&str) -> String) {
        self.add_with(&[], kind, values, unit);
    }

    fn add_with(
        &mut self,
        errors: &[f64],
        kind: &str,
        values: &[f64],
        unit: impl Fn(&str) -> String,
    ) {
        for (i, (coordinate, &value)) in self.coordinates.0.iter().zip(values).enumerate() {
            self.list.push(Parameter {
                name: format!("{kind}_{}", coordinate.name),
                value,
                unit: unit(&coordinate.unit),
                standard_error: known(errors.get(i)),
            });
        }
    }

    fn dissipation(&mut self, d: &Dissipation) {
        let (n, errors) = (d.viscous.len(), self.friction_errors);
        let of = |kind: usize| errors.get(kind * n..).unwrap_or_default();
        self.add_with(of(0), "viscous", &d.viscous, viscous);
        if let Some(between) = &d.between {
            let each = self.coordinates.0.iter().enumerate();
            let pairs = each
                .clone()
                .flat_map(|(i, a)| each.clone().skip(i + 1).map(move |b| (i, a, b)));
            self.list.extend(pairs.map(|(i, a, (j, b))| Parameter {
                name: format!("viscous_{}_{}", a.name, b.name),
                value: between[i * n + j],
                unit: match viscous(&a.unit) == viscous(&b.unit) {
                    true => viscous(&a.unit),
                    false => "N·s/rad".into(),
                },
                standard_error: known(of(3).get(i * n + j)),
            }));
        }
        if let Some(drag) = &d.drag {
            let unit = |q: &str| either(q, "N·m·s²/rad²", "N·s²/m²");
            self.add_with(of(2), "drag", drag, unit);
        }
        // Without dry friction there is no speed at which it turns.
        if d.stribeck.is_some() || d.coulomb.iter().any(|own| *own != 0.0) {
            self.add_with(of(1), "coulomb", &d.coulomb, force);
            self.add("coulomb_speed", &d.smoothing, speed);
        }
        if let Some(stribeck) = &d.stribeck {
            self.add("stribeck", &stribeck.height, force);
            self.add("stribeck_speed", &stribeck.speed, speed);
        }
        if let Some(load) = &d.load {
            self.add("load_share", load, |_| String::new());
        }
        if let Some(directional) = &d.directional {
            self.directional(directional);
        }
    }

    fn directional(&mut self, d: &Directional) {
        let share = |_: &str| String::new();
        let square = |q: &str| either(q, "1/(N·m)", "1/N");
        self.add("external_share", &d.external, share);
        self.add("stribeck_motor_share", &d.stribeck_motor, share);
        self.add("stribeck_external_share", &d.stribeck_external, share);
        if d.has_squares() {
            self.add("quadratic_motor", &d.quadratic_motor, square);
            self.add("quadratic_external", &d.quadratic_external, square);
        }
    }

    fn actuation(&mut self, actuation: &Actuation) {
        self.add("offset", actuation.offsets(), force);
        // Joints that are driven by their own torques have the identity, learned or not.
        if actuation.is_direct() {
            return;
        }
        for (j, input) in self.coordinates.0.iter().enumerate() {
            let entries = actuation.matrix().iter().skip(j);
            let column: Vec<f64> = entries.step_by(actuation.dof()).copied().collect();
            let kind = format!("input_{}_to", input.name);
            self.add(&kind, &column, |q| format!("{} a unit of input", force(q)));
        }
    }
}
