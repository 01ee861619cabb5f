//! The flags of `lagrangian fit`.

use std::path::PathBuf;

use clap::Args;
use clap::builder::PossibleValuesParser;
use lagrangian::models::{Entry, FAMILIES};
use lagrangian::settings::named;
use serde::{Deserialize, Serialize};

use crate::cli::{DataArgs, EstimateArgs, SampleArgs};
use crate::robot::RobotArgs;
use crate::setting_args::{OfFamilies, OfRollouts, OfTraining, SettingArgs, one_of};
use crate::values::{fraction, positive, seed, steps};

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
  lagrangian fit log*.csv --nominal robot.urdf --loss torque --out run      learn the difference from the description
  lagrangian fit video.csv --angle all --loss positions --out run           angles alone, no velocities
  lagrangian fit --out run --resume                 continue an interrupted run")]
pub(crate) struct FitArgs {
    /// Files with recordings: .csv, .npz, .parquet, .db3, .mcap
    #[arg(required_unless_present = "resume")]
    pub(crate) files: Vec<PathBuf>,

    /// Folder of the run
    #[arg(long, value_name = "DIR", default_value = "runs/latest")]
    pub(crate) out: PathBuf,

    /// Continue the interrupted run in that folder, with its settings, to the same bits
    #[arg(long, conflicts_with_all = ["force", "files"])]
    pub(crate) resume: bool,

    /// Restart in a folder that holds a run
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
    pub(crate) rollout: SettingArgs<OfRollouts>,

    #[command(flatten)]
    pub(crate) estimate: EstimateArgs,

    #[command(flatten)]
    pub(crate) data: DataArgs,

    #[command(flatten)]
    #[serde(default)]
    pub(crate) sample: SampleArgs,
}

/// What is fitted. Its settings are those of the families of the library.
#[derive(Debug, Clone, Args, Serialize, Deserialize)]
#[command(next_help_heading = "Model")]
pub(crate) struct ModelArgs {
    /// Any Lagrangian; one with a mass matrix; or, to compare with, a plain network (q, q̇, τ) → q̈ (with --loss torque,
    /// (q, q̇, q̈) → τ) or a chain of rigid links
    #[arg(long, value_parser = families(), default_value = FAMILIES[0].name)]
    pub(crate) model: String,

    #[command(flatten)]
    #[serde(flatten)]
    pub(crate) settings: SettingArgs<OfFamilies>,
}

impl ModelArgs {
    /// Drops what the family does not have: runs of earlier versions wrote all settings with their defaults.
    pub(crate) fn keep_own(&mut self) {
        let entry = FAMILIES.iter().find(|entry| entry.name == self.model);
        let own = entry.map_or(&[][..], |entry| entry.settings);
        let values = &mut self.settings.values;
        values.retain(|name, _| own.iter().any(|setting| setting.name == name));
    }
}

/// The families of the library by their names.
fn families() -> PossibleValuesParser {
    let family = |entry: &Entry| named(entry.name, entry.about);
    one_of(&FAMILIES.iter().map(family).collect::<Vec<_>>())
}

/// How it is fitted.
#[derive(Debug, Clone, Args, Serialize, Deserialize)]
#[command(next_help_heading = "Training")]
pub(crate) struct TrainingArgs {
    #[command(flatten)]
    #[serde(flatten)]
    pub(crate) settings: SettingArgs<OfTraining>,

    /// Distance of the neighbours of a loss of positions, in samples: noise weighs less over a longer one, but the error
    /// of the discrete action more
    #[arg(long, value_name = "SAMPLES", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    #[serde(default = "one")]
    pub(crate) baseline: u32,

    /// End after so many steps
    #[arg(long, conflicts_with = "seconds", value_parser = steps)]
    pub(crate) steps: Option<u64>,

    /// End after so many seconds; the schedule is laid out over them [default: 60]
    #[arg(long, value_parser = positive)]
    pub(crate) seconds: Option<f64>,

    /// Seed of weights, split and batches
    #[arg(long, default_value_t = 0, value_parser = seed)]
    pub(crate) seed: u64,

    /// Files to validate on
    #[arg(long, value_name = "FILES", num_args = 1.., conflicts_with = "validate_fraction")]
    pub(crate) validate: Vec<PathBuf>,

    /// Part of the trajectories that is held back for validation, where no files are given
    #[arg(long, value_name = "PART", default_value_t = 0.1, value_parser = fraction)]
    pub(crate) validate_fraction: f64,
}

/// The baseline of runs from before there was a choice.
fn one() -> u32 {
    1
}
