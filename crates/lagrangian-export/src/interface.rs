//! The functions of a generated model in C, listed once.

use std::collections::BTreeSet;

use lagrangian::text::shown;

use crate::Error;

/// Largest number of joints of an exported model: its adapters keep n × n matrices on the stack.
pub(crate) const MOST_JOINTS: usize = 64;
/// Longest prefix: C99 distinguishes external names by 31 characters at least, every compiler in use by far more.
const LONGEST_NAME: usize = 48;

/// The name of a generated model and its functions.
#[derive(Debug, Clone, PartialEq)]
pub struct Interface {
    /// The prefix of all names in C: `NAME_forward_dynamics`.
    pub name: String,
    /// The joints, in the order of q.
    pub joints: Vec<Joint>,
    /// The meaning of `tau`, and its length `NAME_NU`.
    pub drive: Drive,
    /// The existing functions. `NAME_selftest` always exists.
    pub calls: BTreeSet<Call>,
    /// A description of the model, in a sentence.
    pub description: String,
    /// The version of the program that generated it.
    pub version: String,
    /// The hash of the saved model.
    pub hash: String,
    /// A state within the data, q and then q̇, rad or m and their rates, `[2 n]`, at which examples and simulations begin.
    pub start: Vec<f64>,
}

/// The meaning of the input `tau` of a model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Drive {
    /// The forces on the joints, N or N·m, one each.
    Forces,
    /// This many inputs of actuators, in the units of the data: currents, or forces on some joints.
    Inputs(usize),
}

/// A joint of the model.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Joint {
    /// Its name, as in the data or the robot's description.
    pub name: String,
    /// The unit of its position.
    pub unit: Unit,
}

/// The unit of a position; those of velocities and forces follow.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unit {
    /// rad, with rad/s and N·m.
    Radian,
    /// m, with m/s and N.
    Metre,
}

impl Unit {
    /// The unit of the k-th derivative of the position in time.
    pub(crate) fn rate(self, k: usize) -> &'static str {
        match self {
            Self::Radian => ["rad", "rad/s", "rad/s2"][k],
            Self::Metre => ["m", "m/s", "m/s2"][k],
        }
    }

    /// The unit of a force on the joint.
    pub(crate) fn force(self) -> &'static str {
        match self {
            Self::Radian => "N.m",
            Self::Metre => "N",
        }
    }
}

/// The number of values along an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Axis {
    /// One for each joint.
    Joints,
    /// One for each input.
    Inputs,
}

/// The shape of an argument or a result; matrices are row-major.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shape {
    /// One number.
    Scalar,
    /// A vector.
    Vector(Axis),
    /// A matrix of rows and columns.
    Matrix(Axis, Axis),
}

/// An argument or a result of a function.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Quantity {
    /// The name in C.
    pub name: &'static str,
    /// The shape.
    pub shape: Shape,
}

/// A function of a generated model.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Call {
    /// τ of a motion.
    InverseDynamics,
    /// τ of a desired motion, no farther from the measured position than a leash.
    FeedForward,
    /// q̈ under given forces.
    ForwardDynamics,
    /// M(q, q̇) = ∂²L/∂q̇².
    MassMatrix,
    /// c(q, q̇): the forces at q̈ = 0 without friction.
    Bias,
    /// c(q, 0).
    Gravity,
    /// d(q, q̇), the forces of friction.
    Friction,
    /// p = ∂L/∂q̇.
    Momentum,
    /// E = p·q̇ − L.
    Energy,
    /// The state after a time h under a constant τ.
    Step,
    /// The derivatives of τ with respect to the motion.
    InverseDynamicsDerivatives,
    /// The derivatives of q̈ with respect to the state and the forces.
    ForwardDynamicsDerivatives,
    /// Distance of a state from those of the data; at most 1 inside.
    DistanceFromData,
}

/// Name, arguments and results of a function.
struct Row {
    name: &'static str,
    arguments: &'static [Quantity],
    results: &'static [Quantity],
    about: &'static str,
}

const fn quantity(name: &'static str, shape: Shape) -> Quantity {
    Quantity { name, shape }
}

const N: Shape = Shape::Vector(Axis::Joints);
const NN: Shape = Shape::Matrix(Axis::Joints, Axis::Joints);
const Q: Quantity = quantity("q", N);
const QD: Quantity = quantity("qd", N);
const QDD: Quantity = quantity("qdd", N);
const TAU: Quantity = quantity("tau", Shape::Vector(Axis::Inputs));
const STATE: &[Quantity] = &[Q, QD];
const MOTION: &[Quantity] = &[Q, QD, QDD];
const FORCED: &[Quantity] = &[Q, QD, TAU];
const TAU_N: Shape = Shape::Matrix(Axis::Inputs, Axis::Joints);
const DESIRED: &[Quantity] = &[
    quantity("leash", Shape::Scalar),
    Q,
    quantity("q_d", N),
    quantity("qd_d", N),
    quantity("qdd_d", N),
];
const TAU_SLOPES: &[Quantity] = &[
    quantity("dtau_dq", TAU_N),
    quantity("dtau_dqd", TAU_N),
    quantity("dtau_dqdd", TAU_N),
];
const QDD_SLOPES: &[Quantity] = &[
    quantity("dqdd_dq", NN),
    quantity("dqdd_dqd", NN),
    quantity("dqdd_dtau", Shape::Matrix(Axis::Joints, Axis::Inputs)),
];
const T: &[Quantity] = &[TAU];
const M: &[Quantity] = &[quantity("m", NN)];
const C: &[Quantity] = &[quantity("c", N)];
const G: &[Quantity] = &[quantity("g", N)];
const D: &[Quantity] = &[quantity("d", N)];
const P: &[Quantity] = &[quantity("p", N)];
const E: &[Quantity] = &[quantity("e", Shape::Scalar)];

impl Call {
    /// All functions, in the order of the header.
    pub const ALL: [Self; 13] = [
        Self::InverseDynamics,
        Self::FeedForward,
        Self::ForwardDynamics,
        Self::MassMatrix,
        Self::Bias,
        Self::Gravity,
        Self::Friction,
        Self::Momentum,
        Self::Energy,
        Self::Step,
        Self::InverseDynamicsDerivatives,
        Self::ForwardDynamicsDerivatives,
        Self::DistanceFromData,
    ];

    /// The name in C, after the prefix and an underscore.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.row().name
    }

    /// Its arguments.
    #[must_use]
    pub fn arguments(self) -> &'static [Quantity] {
        self.row().arguments
    }

    /// Its results.
    #[must_use]
    pub fn results(self) -> &'static [Quantity] {
        self.row().results
    }

    /// Its result, in a few words.
    #[must_use]
    pub fn about(self) -> &'static str {
        self.row().about
    }

    /// The function for the derivatives of its result.
    #[must_use]
    pub fn derivatives(self) -> Option<Self> {
        match self {
            Self::InverseDynamics => Some(Self::InverseDynamicsDerivatives),
            Self::ForwardDynamics => Some(Self::ForwardDynamicsDerivatives),
            _ => None,
        }
    }

    /// Its arguments and then its results as a list with commas; `of` writes each, and its second argument is true for a result.
    pub(crate) fn list(self, of: impl Fn(&Quantity, bool) -> String) -> String {
        let arguments = self.arguments().iter().map(|quantity| of(quantity, false));
        let results = self.results().iter().map(|quantity| of(quantity, true));
        arguments.chain(results).collect::<Vec<_>>().join(", ")
    }

    /// Whether it computes the derivatives of another function.
    pub(crate) fn is_derivatives(self) -> bool {
        Self::ALL
            .iter()
            .any(|other| other.derivatives() == Some(self))
    }

    fn row(self) -> Row {
        let row = |name, arguments, results, about| Row {
            name,
            arguments,
            results,
            about,
        };
        match self {
            Self::InverseDynamics => row("inverse_dynamics", MOTION, T, "the forces of a motion"),
            Self::FeedForward => row(
                "feed_forward",
                DESIRED,
                T,
                "the forces of a desired motion, at most the leash from the measured q in each joint",
            ),
            Self::ForwardDynamics => row(
                "forward_dynamics",
                FORCED,
                &[QDD],
                "the accelerations under given forces",
            ),
            Self::MassMatrix => row("mass_matrix", STATE, M, "M = ∂²L/∂q̇²"),
            Self::Bias => row("bias", STATE, C, "the forces at q̈ = 0, without friction"),
            Self::Gravity => row("gravity", const { &[Q] }, G, "the forces at rest"),
            Self::Friction => row("friction", STATE, D, "what friction takes"),
            Self::Momentum => row("momentum", STATE, P, "p = ∂L/∂q̇"),
            Self::Energy => row("energy", STATE, E, "E = p·q̇ − L, in J"),
            Self::Step => row(
                "step",
                const { &[quantity("h", Shape::Scalar), Q, QD, TAU] },
                const { &[quantity("q_next", N), quantity("qd_next", N)] },
                "the state after h seconds under constant forces",
            ),
            Self::InverseDynamicsDerivatives => row(
                "inverse_dynamics_derivatives",
                MOTION,
                TAU_SLOPES,
                "how the forces change with the motion",
            ),
            Self::ForwardDynamicsDerivatives => row(
                "forward_dynamics_derivatives",
                FORCED,
                QDD_SLOPES,
                "how the accelerations change with state and forces",
            ),
            Self::DistanceFromData => row(
                "distance_from_data",
                STATE,
                const { &[quantity("d", Shape::Scalar)] },
                "how far the state is from what the data visited; at most 1 inside",
            ),
        }
    }
}

impl Interface {
    /// Checks that all adapters can be generated from it.
    ///
    /// # Errors
    /// [`Error::Name`] if the name is not a safe identifier in C; [`Error::Joints`], [`Error::Inputs`] if no model can have
    /// these sizes; [`Error::Start`] if the first state has another size or is not finite.
    pub fn check(&self) -> Result<(), Error> {
        check_name(&self.name)?;
        let joints = self.joints.len();
        if !(1..=MOST_JOINTS).contains(&joints) {
            return Err(Error::Joints(joints));
        }
        let inputs = self.inputs();
        if !(1..=joints).contains(&inputs) {
            return Err(Error::Inputs { inputs, joints });
        }
        let given = self.start.iter().filter(|x| x.is_finite()).count();
        if given != 2 * joints || self.start.len() != given {
            return Err(Error::Start {
                expected: 2 * joints,
                given,
            });
        }
        Ok(())
    }

    /// The length of `tau`.
    pub(crate) fn inputs(&self) -> usize {
        match self.drive {
            Drive::Forces => self.joints.len(),
            Drive::Inputs(count) => count,
        }
    }

    /// The number of values along an axis.
    pub(crate) fn count(&self, axis: Axis) -> usize {
        match axis {
            Axis::Joints => self.joints.len(),
            Axis::Inputs => self.inputs(),
        }
    }

    /// Rows and columns of a quantity; vectors are columns.
    pub(crate) fn rows_and_columns(&self, shape: Shape) -> [usize; 2] {
        match shape {
            Shape::Scalar => [1, 1],
            Shape::Vector(rows) => [self.count(rows), 1],
            Shape::Matrix(rows, columns) => [self.count(rows), self.count(columns)],
        }
    }

    pub(crate) fn has(&self, call: Call) -> bool {
        self.calls.contains(&call)
    }

    /// The existing functions, in the order of the header.
    pub(crate) fn offered(&self) -> impl Iterator<Item = Call> {
        Call::ALL.into_iter().filter(|call| self.has(*call))
    }

    /// The origin of the code, as a line that is safe in a comment of C.
    pub(crate) fn origin(&self) -> String {
        let line = format!(
            "lagrangian {} from the model {}: {}",
            self.version, self.hash, self.description
        );
        comment(&line)
    }
}

/// A text in a form that is safe in a comment of C.
pub(crate) fn comment(text: &str) -> String {
    shown(text)
        .replace("*/", "* /")
        .replace("/*", "/ *")
        .replace("??", "? ?")
}

/// Refuses a name that cannot begin the names of functions.
pub(crate) fn check_name(name: &str) -> Result<(), Error> {
    let (first, rest) = name.split_at_checked(1).unwrap_or_default();
    let letter = first.starts_with(|c: char| c.is_ascii_alphabetic());
    let word = rest.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
    let plain = !name.contains("__") && !name.ends_with('_');
    match letter && word && plain && name.len() <= LONGEST_NAME {
        true => Ok(()),
        false => Err(Error::Name(name.into())),
    }
}
