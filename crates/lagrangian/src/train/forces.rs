//! Friction and actuation in training: forces of each coordinate that are learned with the Lagrangian.
//!
//! The balance that is trained is M q̈ + c + d(q̇, B u − o) + o + J q̈ = B u. The contribution of a term to the left side depends on
//! a few parameters of its own coordinate; their slopes join the Jacobian beside those of the network.

mod terms;

pub(crate) use terms::{Drive, Forces};

use serde::{Deserialize, Serialize};
use serde_json::Value;

use lagrangian_motion::settings::{Named, Values, named};
use lagrangian_motion::{Error, Result};

/// The forces that are learned beside a Lagrangian.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ForceTerms {
    /// Whether viscous friction b q̇ is learned.
    pub viscous: bool,
    /// Whether the drag of a fluid a q̇ |q̇| is learned.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub drag: bool,
    /// Whether Coulomb friction c tanh(q̇ / vₛ) is learned, with vₛ.
    pub coulomb: bool,
    /// Whether Stribeck friction h tanh(q̇ / vₛ) exp(−(q̇ / vₕ)²) is learned, with vₛ and vₕ.
    pub stribeck: bool,
    /// Whether friction in proportion to the force F of the drive l |F| tanh(q̇ / vₛ) is learned, with vₛ.
    pub load: bool,
    /// Whether friction in proportion to the force that comes through the gear is learned beside that by the force of the drive, so that
    /// a gear that is driven backwards loses another part; near standstill too where `stribeck` is learned. Implies `load`.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub directional: bool,
    /// Whether friction by the squares of these forces near standstill is learned. Implies `directional` and `stribeck`.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub quadratic: bool,
    /// Whether constant torques o are learned.
    pub offset: bool,
    /// Whether the inertias J of rotors are learned, as seen by their joints, for families with a mass matrix.
    pub rotor: bool,
    /// The part of the input matrix B that is learned.
    pub input: Input,
}

/// The names of the forces in settings.
pub(crate) const FORCE_NAMES: &[Named] = &[
    named("viscous", "Friction b q̇"),
    named("drag", "The drag of a fluid a q̇ |q̇|"),
    named("coulomb", "Friction c tanh(q̇ / v), with the speed v"),
    named(
        "stribeck",
        "What friction near standstill exceeds Coulomb friction by, with its speed",
    ),
    named(
        "load",
        "Friction in proportion to the force of the drive, as in gears",
    ),
    named(
        "directional",
        "The same by the force that comes through the gear: driven backwards, a gear loses another share",
    ),
    named(
        "quadratic",
        "The same with the squares of these forces near standstill",
    ),
    named("offset", "A constant torque: the offset of a sensor"),
    named("rotor", "The inertia of a rotor behind a gear (delan)"),
    named(
        "gains",
        "A gain for each joint, relative to the first: the recorded inputs are currents",
    ),
    named(
        "input-matrix",
        "The matrix from inputs to torques, relative to its first entry: joints that are not driven themselves",
    ),
];

/// The part of the input matrix B that is learned. Its first entry is 1, which fixes the unit of energy.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Input {
    /// No part: inputs are torques.
    #[default]
    Torque,
    /// A gain for each joint, for inputs such as currents.
    Gains,
    /// The whole matrix.
    Matrix,
}

impl ForceTerms {
    /// Viscous and Coulomb friction.
    #[must_use]
    pub fn friction() -> Self {
        Self {
            viscous: true,
            coulomb: true,
            ..Self::default()
        }
    }

    /// Takes `dissipation` and `forces` out of the settings of a request.
    pub(crate) fn take(settings: &mut Values) -> Result<Self> {
        let friction = settings.remove("dissipation") == Some(Value::Bool(true));
        let names = settings.remove("forces").unwrap_or_default();
        let names = names.as_array().map_or(&[][..], Vec::as_slice);
        let names: Vec<&str> = names.iter().filter_map(Value::as_str).collect();
        let known = || FORCE_NAMES.iter().map(|force| force.name);
        if let Some(name) = names.iter().find(|name| !known().any(|k| k == **name)) {
            return Err(Error::UnknownName {
                kind: "force",
                name: (*name).into(),
                known: known().collect::<Vec<_>>().join(", "),
            });
        }
        let wanted = |name| names.contains(&name);
        Ok(Self {
            viscous: friction || wanted("viscous"),
            drag: wanted("drag"),
            coulomb: friction || wanted("coulomb"),
            stribeck: wanted("stribeck"),
            load: wanted("load"),
            directional: wanted("directional"),
            quadratic: wanted("quadratic"),
            offset: wanted("offset"),
            rotor: wanted("rotor"),
            input: match (wanted("input-matrix"), wanted("gains")) {
                (true, _) => Input::Matrix,
                (false, true) => Input::Gains,
                (false, false) => Input::Torque,
            },
        })
    }

    /// Whether no force is learned.
    #[must_use]
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }

    /// Whether a term depends on recorded forces alone.
    pub(crate) fn of_recorded(&self) -> bool {
        self.complete().load || self.input != Input::Torque
    }

    /// The terms with all those that they imply.
    fn complete(mut self) -> Self {
        self.directional |= self.quadratic;
        self.stribeck |= self.quadratic;
        self.load |= self.directional;
        self
    }
}
