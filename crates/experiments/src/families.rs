//! Families of models as experiments compare them: two hidden layers of a width, all else as it is by default; and the
//! optimiser of most.

use lagrangian::models::{
    Family, Form, HnnConfig, HnnStructure, Inertia, MlpConfig, Momenta, NeuralOdeConfig, Order,
    RigidConfig,
};
use lagrangian::train::NaturalConfig;
use lagrangian::{DelanConfig, LnnConfig, Optimizer};

/// Makes a family of models whose layers have this number of units.
pub(crate) type MakeFamily = fn(usize) -> Box<dyn Family>;

/// A family with these fields and the defaults for all others.
macro_rules! family {
    ($config:ident { $($field:ident $(: $value:expr)?),* }) => {
        Box::new($config { $($field $(: $value)?,)* ..$config::default() })
    };
}

/// Units of a layer unless an experiment says otherwise.
pub(crate) const WIDTH: usize = 64;

pub(crate) fn lnn(width: usize) -> Box<dyn Family> {
    family!(LnnConfig { width })
}

pub(crate) fn convex(width: usize) -> Box<dyn Family> {
    family!(LnnConfig {
        form: Form::Convex,
        width
    })
}

pub(crate) fn delan(width: usize) -> Box<dyn Family> {
    family!(DelanConfig { width })
}

pub(crate) fn delan_with_vector_potential(width: usize) -> Box<dyn Family> {
    family!(DelanConfig {
        vector_potential: true,
        width
    })
}

pub(crate) fn vin(width: usize) -> Box<dyn Family> {
    family!(DelanConfig {
        inertia: Inertia::Constant,
        width
    })
}

pub(crate) fn hnn(structure: HnnStructure, momenta: Momenta, width: usize) -> Box<dyn Family> {
    family!(HnnConfig {
        structure,
        momenta,
        width
    })
}

pub(crate) fn neural_ode(order: Order, width: usize) -> Box<dyn Family> {
    family!(NeuralOdeConfig { order, width })
}

pub(crate) fn mlp(width: usize) -> Box<dyn Family> {
    family!(MlpConfig { width })
}

/// A chain of links, which has no layers.
pub(crate) fn rigid(_: usize) -> Box<dyn Family> {
    Box::new(RigidConfig::default())
}

/// Whether a family is [`rigid`]: it is solved for, without training.
pub(crate) fn is_rigid(family: MakeFamily) -> bool {
    family(WIDTH).name() == "rigid"
}

/// The natural gradient with this damping at its end; noise asks for more, because each batch is solved for itself.
pub(crate) fn natural(damping_last: f64) -> Optimizer {
    Optimizer::Natural(NaturalConfig {
        damping_last,
        ..NaturalConfig::default()
    })
}
