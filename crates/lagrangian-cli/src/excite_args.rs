//! The flags of `lagrangian excite`.

use std::path::PathBuf;

use clap::Args;

use crate::out_args::PlotArgs;
use crate::values::{finite, name, positive, seed};

#[derive(Debug, Args)]
#[command(after_help = "\
COLLISIONS ARE NOT CHECKED, neither of the robot with itself nor with anything around it: simulate the plan, and run it slowly
first. All joints move at once. The plan begins and ends at rest, and stays within --margin of every limit of position,
speed, acceleration and, for a robot with a description, effort; friction is no part of the predicted torques.

Beside plan.csv a second motion is written, plan-validate.csv, to validate on what was identified. Ctrl-C ends the search and
keeps the best plan so far.

Examples:
  lagrangian excite robot.urdf --duration 30 --out plan.csv
  lagrangian excite ur5 --acceleration 4 --lower -1.5 --upper 1.5 --seconds 60 --out plan.csv --plot plan.html
  lagrangian excite --joints 6 --lower -1 --upper 1 --velocity 1.5 --out plan.csv       no description
Then run the plan, record the torques, and
  lagrangian identify log.csv --urdf robot.urdf --out identified.urdf")]
#[command(mut_arg("out", |arg| arg.required(true).help("File for the plan, .csv, .npz or .parquet; a .toml that declares the angles is put beside it")))]
#[command(mut_arg("plot", |arg| arg.help("File for a drawing: .html for a page, .svg or .png for the motion of the first joint")))]
pub(crate) struct ExciteArgs {
    /// The robot: a URDF file, or an example (`two_link_arm`, iiwa7, ur5, panda); without one, --joints and limits
    pub(crate) urdf: Option<PathBuf>,

    /// Joints that move, in this order, the others locked at 0; without a robot, their number or names [default: all]
    #[arg(long, value_name = "NAMES", value_delimiter = ',', value_parser = name)]
    pub(crate) joints: Vec<String>,

    #[command(flatten)]
    pub(crate) output: PlotArgs,

    #[command(flatten)]
    pub(crate) limits: LimitArgs,

    /// Duration of the plan, s
    #[arg(long, value_name = "SECONDS", default_value_t = 30.0, value_parser = positive)]
    pub(crate) duration: f64,

    /// Samples of the plan per second
    #[arg(long, value_name = "HZ", default_value_t = 100.0, value_parser = positive)]
    pub(crate) rate: f64,

    /// Waves of each joint: harmonics of a period of 10 s at most
    #[arg(long, value_name = "N", default_value_t = 6, value_parser = clap::value_parser!(u32).range(1..=50))]
    pub(crate) harmonics: u32,

    /// Deviation of the noise of the torques, in parts of the limits of effort, for the expected standard errors
    #[arg(long, value_name = "PART", default_value_t = 0.01, value_parser = positive)]
    pub(crate) noise: f64,

    /// Time for the search, s
    #[arg(long, default_value_t = 20.0, value_parser = positive)]
    pub(crate) seconds: f64,

    /// Seed of the search
    #[arg(long, default_value_t = 0, value_parser = seed)]
    pub(crate) seed: u64,
}

/// Limits of the joints: one value for all, or one for each.
#[derive(Debug, Args)]
#[command(
    next_help_heading = "Limits of the joints, one value for all or one for each, in place of the URDF's"
)]
pub(crate) struct LimitArgs {
    /// Smallest coordinates, rad or m
    #[arg(long, value_name = "VALUES", value_delimiter = ',', allow_hyphen_values = true, value_parser = finite)]
    pub(crate) lower: Vec<f64>,

    /// Largest coordinates, rad or m
    #[arg(long, value_name = "VALUES", value_delimiter = ',', allow_hyphen_values = true, value_parser = finite)]
    pub(crate) upper: Vec<f64>,

    /// Largest speeds, rad/s or m/s
    #[arg(long, value_name = "VALUES", value_delimiter = ',', allow_hyphen_values = true, value_parser = finite)]
    pub(crate) velocity: Vec<f64>,

    /// Largest accelerations, rad/s² or m/s² [default: the speed is reached in half a second]
    #[arg(long, value_name = "VALUES", value_delimiter = ',', allow_hyphen_values = true, value_parser = finite)]
    pub(crate) acceleration: Vec<f64>,

    /// Largest torques or forces, N·m or N
    #[arg(long, value_name = "VALUES", value_delimiter = ',', allow_hyphen_values = true, value_parser = finite)]
    pub(crate) effort: Vec<f64>,

    /// The part of each limit that is used
    #[arg(long, value_name = "PART", default_value_t = 0.9, value_parser = positive)]
    pub(crate) margin: f64,
}
