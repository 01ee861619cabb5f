//! The flags of `lagrangian fit`.

use std::path::PathBuf;

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use clap::{Args, ValueEnum};
use lagrangian::Loss;
use serde::{Deserialize, Serialize};

use crate::cli::{DataArgs, EstimateArgs, SampleArgs};
use crate::robot::RobotArgs;
use crate::rollout_args::RolloutArgs;
use crate::values::{fraction, non_negative, positive, seed, steps};

#[derive(Debug, Clone, Args, Serialize, Deserialize)]
#[command(after_help = "\
Examples:
  lagrangian fit motion.csv --angle all --out run
  lagrangian fit log*.csv --time t --q theta --qd omega --tau torque --angle theta --dissipation --out run
  lagrangian fit train.parquet --validate held-out.parquet --seconds 300 --out run
  lagrangian fit log*.csv --angle all --dissipation --loss torque --filter 0.3 --out run   a real machine
  lagrangian fit log*.csv --model delan --forces viscous,coulomb,offset --delay 16 --out run    a robot with torques
  lagrangian fit noisy.csv --angle all --loss rollout --horizon 20 --starts free --out run     no accelerations needed
  lagrangian fit motion.csv --angle all --model hnn --p p1,p2 --out run     a Hamiltonian, from momenta
  lagrangian fit log*.csv --model rigid --urdf robot.urdf --dissipation --out run   identify a robot
  lagrangian fit log*.csv --nominal robot.urdf --loss torque --out run      learn what the description leaves
  lagrangian fit video.csv --angle all --loss positions --out run           angles alone, no velocities
  lagrangian fit --out run --resume                 go on with a run that was interrupted")]
pub(crate) struct FitArgs {
    /// Files with recordings: .csv, .npz, .parquet
    #[arg(required_unless_present = "resume")]
    pub(crate) files: Vec<PathBuf>,

    /// Folder of the run
    #[arg(long, value_name = "DIR", default_value = "runs/latest")]
    pub(crate) out: PathBuf,

    /// Go on with the interrupted run in that folder, with its settings, to the same bits
    #[arg(long, conflicts_with_all = ["force", "files"])]
    pub(crate) resume: bool,

    /// Begin anew in a folder that holds a run
    #[arg(long)]
    pub(crate) force: bool,

    #[command(flatten)]
    pub(crate) model: ModelArgs,

    #[command(flatten)]
    #[serde(default)]
    pub(crate) robot: RobotArgs,

    #[command(flatten)]
    pub(crate) training: TrainingArgs,

    #[command(flatten)]
    #[serde(default)]
    pub(crate) rollout: RolloutArgs,

    #[command(flatten)]
    pub(crate) estimate: EstimateArgs,

    #[command(flatten)]
    pub(crate) data: DataArgs,

    #[command(flatten)]
    #[serde(default)]
    pub(crate) sample: SampleArgs,
}

#[derive(Debug, Clone, Args, Serialize, Deserialize)]
#[command(next_help_heading = "Model")]
pub(crate) struct ModelArgs {
    /// Any Lagrangian; one with a mass matrix; or, to compare with, a plain network (q, q̇, τ) → q̈ (with --loss torque,
    /// (q, q̇, q̈) → τ) or a chain of rigid links
    #[arg(long, value_enum, default_value_t)]
    pub(crate) model: Family,

    /// Any Lagrangian, or one convex in q̇, whose mass matrix is positive everywhere [default: free; convex where
    /// accelerations are uncertain by more than 0.5 %]
    #[arg(long, value_enum)]
    pub(crate) form: Option<Form>,

    /// A speed that no coordinate reaches, in their unit a second: the network of --model lnn then sees
    /// artanh(q̇/c) in place of q̇ (see --speed-chart), that of --model hnn arsinh(p/s), s the median |p|
    #[arg(long, value_name = "C", value_parser = crate::values::positive)]
    #[serde(default)]
    pub(crate) speed_limit: Option<f64>,

    /// What --model lnn sees of q̇ below --speed-limit: artanh(q̇/c), for Lagrangians that grow without bound
    /// towards c, or arcsin(q̇/c), for those that stay finite there [default: artanh]
    #[arg(long, value_enum)]
    #[serde(default)]
    pub(crate) speed_chart: Option<SpeedChartName>,

    /// Give the network of --model lnn exponential units, for masses that span decades
    #[arg(long)]
    #[serde(default)]
    pub(crate) exponential: bool,

    /// Units in each hidden layer [default: 64; 16 for delan where accelerations are uncertain by more than 0.5 %]
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=4096))]
    pub(crate) width: Option<u32>,

    /// Hidden layers
    #[arg(long, default_value_t = 2, value_parser = clap::value_parser!(u32).range(1..=16))]
    pub(crate) layers: u32,

    /// Activation of the hidden layers
    #[arg(long, value_enum, default_value_t)]
    pub(crate) activation: ActivationName,

    /// Learn viscous and Coulomb friction too
    #[arg(long)]
    pub(crate) dissipation: bool,

    /// Learn these forces too, separated by commas
    #[arg(long, value_enum, value_delimiter = ',', value_name = "LIST")]
    pub(crate) forces: Vec<Force>,

    /// Whether M and V of a deep Lagrangian network are read off the same hidden layers
    #[arg(long, value_enum)]
    pub(crate) trunks: Option<Trunks>,

    /// Any Hamiltonian, one with a mass matrix, or none: the plain flow (q, q̇) → (q̇, q̈) to compare with (hnn)
    #[arg(long, value_enum)]
    #[serde(default)]
    pub(crate) structure: Option<Structure>,

    /// What a Hamiltonian network takes for momenta: recorded ones (columns p1, p2, … or --p), or the velocities in
    /// their place [default: recorded, or p = m q̇ with --masses]
    #[arg(long, value_enum)]
    #[serde(default)]
    pub(crate) momenta: Option<MomentaName>,

    /// Masses m of p = m q̇, one for each coordinate (hnn)
    #[arg(long, value_name = "LIST", value_delimiter = ',', conflicts_with = "momenta", value_parser = positive)]
    #[serde(default)]
    pub(crate) masses: Vec<f64>,

    /// Give a deep Lagrangian network the term A(q)·q̇, for gyroscopic and magnetic forces
    #[arg(long)]
    pub(crate) vector_potential: bool,

    /// Order of a neural ODE: (q, q̇) → (q̇, q̈), or q̈ alone [default: second]
    #[arg(long, value_enum)]
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) order: Option<OrderName>,
}

#[derive(Debug, Clone, Args, Serialize, Deserialize)]
#[command(next_help_heading = "Training")]
pub(crate) struct TrainingArgs {
    /// What is compared with the data [default: acceleration; rollout for neural-ode; positions for vin; torque for delan
    /// where torques are recorded and accelerations certain to 0.5 %]
    #[arg(long, value_parser = named_loss())]
    pub(crate) loss: Option<Loss>,

    /// Distance of the neighbours of a loss of positions, in samples: noise weighs less over a longer one, but the error
    /// of the discrete action more
    #[arg(long, value_name = "SAMPLES", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    #[serde(default = "one")]
    pub(crate) baseline: u32,

    /// Natural gradient, or Adam [default: natural; adam where accelerations are uncertain by more than 0.5 % and
    /// compared]
    #[arg(long, value_enum)]
    pub(crate) optimizer: Option<OptimizerName>,

    /// End after so many steps
    #[arg(long, conflicts_with = "seconds", value_parser = steps)]
    pub(crate) steps: Option<u64>,

    /// End after so many seconds; the schedule is laid out over them [default: 60]
    #[arg(long, value_parser = positive)]
    pub(crate) seconds: Option<f64>,

    /// Samples in a batch [default: natural gradient 128 by time and 256 by steps, Adam 512]
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) batch: Option<u32>,

    /// Samples of the first batch, growing to --batch: for the shortest fits [default: as many as later]
    #[arg(long, value_name = "SAMPLES", value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) batch_first: Option<u32>,

    /// Damping of the natural gradient [default: loss for a fit by time, schedule for one by steps or under --loss rollout]
    #[arg(long, value_enum)]
    pub(crate) damping: Option<DampingName>,

    /// Learning rate at the start [default: by the optimiser]
    #[arg(long, value_parser = positive)]
    pub(crate) learning_rate: Option<f64>,

    /// Weight decay of Adam
    #[arg(long, default_value_t = 0.0, value_parser = non_negative)]
    pub(crate) weight_decay: f64,

    /// Stop after so many looks at the validation data without improvement (one look every 25 steps)
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) patience: Option<u32>,

    /// Seed of weights, split and batches
    #[arg(long, default_value_t = 0, value_parser = seed)]
    pub(crate) seed: u64,

    /// Files to validate on
    #[arg(long, value_name = "FILES", num_args = 1.., conflicts_with = "validate_fraction")]
    pub(crate) validate: Vec<PathBuf>,

    /// Part of the trajectories that is kept for validation, where no files are given
    #[arg(long, value_name = "PART", default_value_t = 0.1, value_parser = fraction)]
    pub(crate) validate_fraction: f64,
}

/// The losses of the library by their names.
fn named_loss() -> impl TypedValueParser<Value = Loss> {
    let values = Loss::ALL.map(|entry| PossibleValue::new(entry.name).help(entry.about));
    PossibleValuesParser::new(values).try_map(|name| name.parse::<Loss>())
}

/// The baseline of runs from before there was a choice.
fn one() -> u32 {
    1
}

/// A family of models.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Family {
    /// Lagrangian neural network
    #[default]
    Lnn,
    /// Deep Lagrangian network: ½ q̇ᵀM(q)q̇ − V(q), M positive definite by construction; for robots
    Delan,
    /// Variational integrator network: ½ q̇ᵀMq̇ − V(q) with a constant M, of positions alone (--loss positions)
    Vin,
    /// Hamiltonian network H(q, p), fitted to (q̇, ṗ), or to motions in (q, p) with --loss rollout
    Hnn,
    /// Plain network
    Mlp,
    /// Neural ordinary differential equation: a plain network trained through its integrator
    NeuralOde,
    /// Planar chain of rigid links, or with --urdf a robot, identified by least squares from torques: the classical fit
    /// to compare with
    Rigid,
}

/// A form of the Lagrangian network.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Form {
    /// Any function of q and q̇
    Free,
    /// Convex in q̇
    Convex,
}

/// A structure of the Hamiltonian network.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Structure {
    /// Any function of q and p
    Free,
    /// ½ pᵀM⁻¹(q)p + V(q), M positive definite by construction
    Mass,
    /// None: a plain network of the flow
    None,
}

/// What stands for momenta.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum MomentaName {
    /// The recorded ones
    Recorded,
    /// Velocities in their place
    Velocities,
}

/// What a network sees of a velocity below a limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum SpeedChartName {
    /// artanh(q̇/c), without end
    Artanh,
    /// arcsin(q̇/c), which ends at ±π/2
    Arcsin,
}

/// An activation function.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum ActivationName {
    /// ln(1 + eˣ)
    #[default]
    Softplus,
    /// tanh x
    Tanh,
    /// x Φ(x)
    Gelu,
    /// x tanh x
    Xtanh,
}

/// Order of a differential equation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum OrderName {
    /// (q, q̇, τ) → (q̇, q̈)
    First,
    /// (q, q̇, τ) → q̈
    Second,
}

/// A force that is learned beside those of the Lagrangian.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Force {
    /// Friction b q̇
    Viscous,
    /// Friction c tanh(q̇ / v), with the speed v
    Coulomb,
    /// What friction near standstill exceeds Coulomb friction by, with its speed
    Stribeck,
    /// A constant torque: the offset of a sensor
    Offset,
    /// The inertia of a rotor behind a gear (delan)
    Rotor,
    /// A gain for each joint, relative to the first: the recorded inputs are currents
    Gains,
    /// The matrix from inputs to torques, relative to its first entry: joints that are not driven themselves
    InputMatrix,
}

/// Hidden layers of a deep Lagrangian network.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Trunks {
    /// One stack for all
    #[default]
    Shared,
    /// One for M, one for V
    Separate,
}

/// How the damping of the natural gradient falls.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum DampingName {
    /// Geometrically over the whole fit
    Schedule,
    /// As the loss of the batch does
    Loss,
    /// As long as each step lowers the loss by what its quadratic model foresaw
    Adaptive,
}

/// An optimiser.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum OptimizerName {
    /// Damped natural gradient with momentum (SPRING)
    Natural,
    /// Adam with decoupled weight decay
    Adam,
}
