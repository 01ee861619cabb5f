//! The flags of `lagrangian identify`.

use std::path::PathBuf;

use clap::Args;

use crate::cli::{DataArgs, EstimateArgs, SampleArgs};
use crate::values::{fraction, name, seed};

#[derive(Debug, Args)]
#[command(after_help = "\
Mass, centre of mass and inertia of each link that moves, and damping and friction of each joint are replaced in the text of
the URDF; everything else stays byte for byte. Links that are fixed to a moving one keep their inertia where that leaves the
moving link a body that can exist. Inertias of rotors and constant torques have no place in URDF: they are shown alone.

Examples:
  lagrangian identify log.csv --urdf robot.urdf --out identified.urdf
  lagrangian identify monday.csv --test tuesday.csv --urdf robot.urdf --out identified.urdf
  lagrangian identify log*.csv --urdf arm.urdf --joints shoulder,elbow --out arm-identified.urdf
  lagrangian identify log.csv --urdf robot.urdf --low-pass 5 --delay 16 --out identified.urdf --json > changes.json")]
pub(crate) struct IdentifyArgs {
    /// Files with recordings: .csv, .npz, .parquet; with torques
    #[arg(required = true)]
    pub(crate) files: Vec<PathBuf>,

    /// The robot: a URDF file, or an example (`two_link_arm`, iiwa7, ur5, panda)
    #[arg(long, value_name = "FILE")]
    pub(crate) urdf: PathBuf,

    /// Joints of the robot in the order of the data, the others locked at 0 [default: those that the data name, or all]
    #[arg(long, value_name = "NAMES", value_delimiter = ',', value_parser = name)]
    pub(crate) joints: Vec<String>,

    /// File for the URDF with the identified parameters
    #[arg(long, value_name = "FILE")]
    pub(crate) out: PathBuf,

    /// Replace that file if it exists
    #[arg(long)]
    pub(crate) force: bool,

    /// Files to compare the torques on; nothing is identified from them
    #[arg(long, value_name = "FILES", num_args = 1.., conflicts_with = "hold_out")]
    pub(crate) test: Vec<PathBuf>,

    /// Part of the data that the torques are compared on instead: whole logs, or blocks of time in each; 0 for none
    #[arg(long, value_name = "PART", default_value_t = 0.3, value_parser = fraction)]
    pub(crate) hold_out: f64,

    /// Seed of the choice of held-out logs, and of the rows of a long log
    #[arg(long, default_value_t = 0, value_parser = seed)]
    pub(crate) seed: u64,

    #[command(flatten)]
    pub(crate) estimate: EstimateArgs,

    #[command(flatten)]
    pub(crate) data: DataArgs,

    #[command(flatten)]
    pub(crate) sample: SampleArgs,
}
