//! The flags of `lagrangian track`.

use std::path::PathBuf;

use clap::Args;

use crate::cli::{EstimateArgs, FileArgs};
use crate::fit_args::families;
use crate::out_args::PlotArgs;
use crate::setting_args::{Hidden, OF_FAMILIES, SettingArgs};
use crate::values::{assignment, name, non_negative, positive, seed};

#[derive(Debug, Args)]
#[command(after_help = "\
The motion of the reference is simulated three times: with the model, with feedback alone, and with the true model.

Examples:
  lagrangian track run/model.safetensors --reference letter.csv --robot two-link-arm
  lagrangian track run/model.safetensors --reference letter.csv --robot robot.urdf --payload 0.5 --limit 30
  lagrangian track run/model.safetensors --reference letter.csv --plant robot.xml --speeds 1,1.5,2.5
  lagrangian track --online rigid --urdf robot.urdf --reference letter.csv --plant robot.xml
  lagrangian track --online delan --dissipation --reference letter.csv --robot two-link-arm --payload 0.5 --payload-at 20
  lagrangian track run/model.safetensors --reference letter.csv --robot iiwa7 --kp 40 --kd 4 --noise 1e-5,2e-3 \\
      --delay 2 --out motion.csv --plot track.html --json")]
#[command(mut_arg("out", |arg| arg.help("File for the motion and its torques, .csv, .npz or .parquet; a .toml that declares the angles is put beside it")))]
#[command(mut_arg("plot", |arg| arg.help("File for a drawing: .html for a page, .svg or .png for the motion of the first joint")))]
#[command(mut_arg("p", |arg| arg.hide(true)), mut_arg("tau", |arg| arg.hide(true)))]
pub(crate) struct TrackArgs {
    /// A saved model, which the controller uses
    #[arg(required_unless_present = "online", conflicts_with = "online")]
    pub(crate) model: Option<PathBuf>,

    /// File with the motion to follow: .csv, .npz, .parquet, .db3, .mcap; of several trajectories the first
    #[arg(long, value_name = "FILE")]
    pub(crate) reference: PathBuf,

    #[command(flatten)]
    pub(crate) output: PlotArgs,

    #[command(flatten)]
    pub(crate) learning: LearningArgs,

    #[command(flatten)]
    pub(crate) truth: TruthArgs,

    #[command(flatten)]
    pub(crate) control: ControlArgs,

    #[command(flatten)]
    pub(crate) estimate: EstimateArgs,

    #[command(flatten)]
    pub(crate) columns: FileArgs,
}

/// A model that is learned during the motion.
#[derive(Debug, Args)]
#[command(next_help_heading = "Online learning")]
pub(crate) struct LearningArgs {
    /// Learn a model of this family from nothing during the motion, in place of a saved one: a network, `rigid` with --urdf, or `chain`; its
    /// settings are those of `lagrangian fit`, such as --width 24 --dissipation
    #[arg(long, value_name = "FAMILY", value_parser = families())]
    pub(crate) online: Option<String>,

    /// URDF of the robot whose bodies are learned (--online rigid): nothing of its masses is used
    #[arg(long, value_name = "FILE", requires = "online")]
    pub(crate) urdf: Option<PathBuf>,

    #[command(flatten)]
    pub(crate) settings: Hidden<SettingArgs<OF_FAMILIES>>,
}

/// The robot that is driven.
#[derive(Debug, Args)]
#[command(next_help_heading = "Robot")]
pub(crate) struct TruthArgs {
    /// The robot that moves: a system (`lagrangian simulate list`), a URDF file, or an example (`two_link_arm`, iiwa7,
    /// ur5, panda) [default: the model itself]
    #[arg(long, value_name = "ROBOT")]
    pub(crate) robot: Option<PathBuf>,

    /// The robot that moves: a plant in MuJoCo, which the Python package brings along: a file in MJCF or URDF,
    /// `dm_control:DOMAIN-TASK`, or `gymnasium:ID`
    #[arg(long, value_name = "PLANT", conflicts_with = "robot")]
    pub(crate) plant: Option<String>,

    /// A parameter of the system; may be repeated
    #[arg(long = "set", value_name = "NAME=VALUE", value_parser = assignment, requires = "robot")]
    pub(crate) parameters: Vec<(String, f64)>,

    /// Joints of a URDF robot or a plant in the order of the reference, the others locked at 0 [default: those that it names, or all]
    #[arg(long, value_name = "NAMES", value_delimiter = ',', value_parser = name)]
    pub(crate) joints: Vec<String>,

    /// Mass in the robot's hand, kg, which the true model includes and the saved one does not
    #[arg(long, value_name = "KG", value_parser = non_negative, requires = "robot")]
    pub(crate) payload: Option<f64>,

    /// When the robot takes the payload, s from the start of the motion
    #[arg(long, value_name = "SECONDS", value_parser = non_negative, default_value_t = 0.0, requires = "payload")]
    pub(crate) payload_at: f64,
}

/// The loop between sensors, controller and drives.
#[derive(Debug, Clone, Args, serde::Serialize)]
#[command(next_help_heading = "Control")]
pub(crate) struct ControlArgs {
    /// Use of the model by the controller
    #[arg(long, value_enum, default_value_t)]
    pub(crate) controller: ControllerName,

    /// How many times as fast the reference is followed; of several, the page and --out show the first
    #[arg(long, value_name = "FACTORS", value_delimiter = ',', default_value = "1", value_parser = positive)]
    pub(crate) speeds: Vec<f64>,

    /// Rate of the control loop, Hz, 10 to 10000
    #[arg(long, default_value_t = 500.0, value_parser = positive)]
    pub(crate) rate: f64,

    /// Gains of the position error, N·m/rad (computed-torque: s⁻²); one, or one for each joint [default: 25 s⁻² times the
    /// joint's mean inertia]
    #[arg(long, value_name = "GAINS", value_delimiter = ',', value_parser = non_negative)]
    pub(crate) kp: Vec<f64>,

    /// Gains of the velocity error, N·m·s/rad (computed-torque: s⁻¹); one, or one for each joint [default: 10 s⁻¹ times
    /// the joint's mean inertia]
    #[arg(long, value_name = "GAINS", value_delimiter = ',', value_parser = non_negative)]
    pub(crate) kd: Vec<f64>,

    /// Largest torque, N·m; one, or one for each joint [default: those of a plant's drives, else none]
    #[arg(long, value_name = "TORQUES", value_delimiter = ',', value_parser = positive)]
    pub(crate) limit: Vec<f64>,

    /// Standard deviation of the sensors' noise: positions, rad, and after a comma velocities, rad/s
    #[arg(long, value_name = "Q,V", value_delimiter = ',', value_parser = non_negative)]
    pub(crate) noise: Vec<f64>,

    /// Step of the encoders, rad
    #[arg(long, value_name = "STEP", default_value_t = 0.0, value_parser = non_negative)]
    pub(crate) quantisation: f64,

    /// Ticks from a decision to its torque
    #[arg(long, value_name = "TICKS", default_value_t = 0)]
    pub(crate) delay: usize,

    /// Seed of the noise
    #[arg(long, default_value_t = 0, value_parser = seed, requires = "noise")]
    pub(crate) seed: u64,
}

/// The use of the model by the controller.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, clap::ValueEnum, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum ControllerName {
    /// None: feedback alone
    Pd,
    /// Feedback, and the model's torque along the reference
    #[default]
    FeedForward,
    /// Feedback through the model at the measured state
    ComputedTorque,
}
