//! Settings that several families share.

use lagrangian_motion::settings::{Kind, Named, Range, Setting, named};

/// The number of units of a hidden layer.
pub(crate) const WIDTH: Setting = Setting::new(
    "width",
    Kind::Integer { min: 1, max: 4096 },
    "Units in each hidden layer",
)
.or("64; 16 for delan and vin where the data are noisy");

/// The number of hidden layers.
pub(crate) const LAYERS: Setting =
    Setting::new("layers", Kind::Integer { min: 1, max: 16 }, "Hidden layers").or("2");

/// Nonlinearity.
pub(crate) const ACTIVATION: Setting = Setting::new(
    "activation",
    Kind::Choice(ACTIVATIONS),
    "Activation of the hidden layers",
)
.or("softplus");

/// The activation of networks that are polynomials.
pub(crate) const POLYNOMIAL: &str = "square";

const ACTIVATIONS: &[Named] = &[
    named("softplus", "ln(1 + eˣ)"),
    named("tanh", "tanh x"),
    named("gelu", "x Φ(x)"),
    named("xtanh", "x tanh x"),
    named(POLYNOMIAL, "½ x²: two layers are polynomials of degree 4"),
];

/// A speed that is never reached.
pub(crate) const SPEED_LIMIT: Setting = Setting::new(
    "speed_limit",
    Kind::Number(Range::POSITIVE),
    "A speed that no coordinate reaches, in their unit a second: the network of a Lagrangian then sees artanh(q̇/c) in \
     place of q̇ (see `speed_chart`), that of a Hamiltonian arsinh(p/s), s the median |p|",
)
.shown_as("C");

/// Gyroscopic terms.
pub(crate) const VECTOR_POTENTIAL: Setting = Setting::new(
    "vector_potential",
    Kind::Flag,
    "Give the Lagrangian the term A(q)·q̇, for gyroscopic and magnetic forces",
);

/// Friction of the two most common kinds.
pub(crate) const DISSIPATION: Setting = Setting::new(
    "dissipation",
    Kind::Flag,
    "Learn viscous and Coulomb friction too",
);

/// Forces beside those of the model.
pub(crate) const FORCES: Setting = Setting::new(
    "forces",
    Kind::Choices(crate::train::FORCE_NAMES),
    "Learn these forces too, separated by commas",
)
.shown_as("LIST");
