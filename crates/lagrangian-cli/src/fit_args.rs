//! The flags of `lagrangian fit`.

use std::path::PathBuf;

use clap::Args;
use clap::builder::PossibleValuesParser;
use lagrangian::models::{Entry, FAMILIES};
use lagrangian::settings::named;
use serde::{Deserialize, Serialize};

use crate::cli::{DataArgs, EstimateArgs, SampleArgs};
use crate::robot::RobotArgs;
use crate::setting_args::{OF_FAMILIES, OF_ROLLOUTS, OF_TRAINING, SettingArgs, one_of};
use crate::values::{fraction, name, positive, seed, steps};

#[derive(Debug, Clone, Args, Serialize, Deserialize)]
#[command(after_help = "\
Examples:
  lagrangian fit motion.csv --angle all --out run
  lagrangian fit robot-log.csv --out run            the low-pass, and the best of several models, are chosen from the log
  lagrangian fit log*.csv --time t --q theta --qd omega --tau torque --angle theta --dissipation --out run
  lagrangian fit train.npz --validate held-out.npz --seconds 300 --out run
  lagrangian fit log*.csv --angle all --dissipation --loss torque --low-pass 5 --out run   a real machine
  lagrangian fit log*.csv --model delan --forces viscous,coulomb,offset --delay 16 --out run    a robot with torques
  lagrangian fit noisy.csv --angle all --loss rollout --horizon 20 --starts free --out run     no accelerations needed
  lagrangian fit motion.csv --angle all --model hnn --p p1,p2 --out run     a Hamiltonian, from momenta
  lagrangian fit log*.csv --model rigid --urdf robot.urdf --dissipation --out run   identify a robot
  lagrangian fit log*.csv --nominal robot.urdf --loss torque --out run      learn the difference from the description
  lagrangian fit video.csv --angle all --loss positions --out run           angles alone, no velocities
  lagrangian fit log*.csv --angle all --ensemble 8 --out run                bands of torque and acceleration as well
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
    pub(crate) rollout: SettingArgs<OF_ROLLOUTS>,

    #[command(flatten)]
    pub(crate) estimate: EstimateArgs,

    #[command(flatten)]
    pub(crate) data: DataArgs,

    #[command(flatten)]
    #[serde(default)]
    pub(crate) sample: SampleArgs,
}

/// The model that is fitted. Its settings are those of the families of the library.
#[derive(Debug, Clone, Args, Serialize, Deserialize)]
#[command(next_help_heading = "Model")]
pub(crate) struct ModelArgs {
    /// The family of models [default: where no setting of a model or loss is given, several are tried and compared on
    /// held-out samples, by torques where these are recorded, else by accelerations; otherwise lnn]
    #[arg(long, value_parser = families())]
    pub(crate) model: Option<String>,

    /// Cyclic coordinates, on which no network may depend, so that their momenta are conserved but for their own friction and force; `find`
    /// for those that the data show, `none` for none [default: find where several models are tried, else none]
    #[arg(long, value_name = "NAMES", value_delimiter = ',', value_parser = name)]
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) cyclic: Vec<String>,

    #[command(flatten)]
    #[serde(flatten)]
    pub(crate) settings: SettingArgs<OF_FAMILIES>,
}

impl ModelArgs {
    /// Drops settings that the family does not have: runs of earlier versions wrote all settings with their defaults.
    pub(crate) fn retain_family_settings(&mut self) {
        let name = self.model.as_deref().unwrap_or(FAMILIES[0].name);
        let entry = FAMILIES.iter().find(|entry| entry.name == name);
        let own = entry.map_or(&[][..], |entry| entry.settings);
        let values = &mut self.settings.values;
        values.retain(|name, _| own.iter().any(|setting| setting.name == name));
    }
}

/// The families of the library by their names.
pub(crate) fn families() -> PossibleValuesParser {
    let family = |entry: &Entry| named(entry.name, entry.about);
    one_of(&FAMILIES.iter().map(family).collect::<Vec<_>>())
}

/// The training of the model.
#[derive(Debug, Clone, Args, Serialize, Deserialize)]
#[command(next_help_heading = "Training")]
pub(crate) struct TrainingArgs {
    #[command(flatten)]
    #[serde(flatten)]
    pub(crate) settings: SettingArgs<OF_TRAINING>,

    /// Distance of the neighbours of a loss of positions, in samples: noise weighs less over a longer one, but the error
    /// of the discrete action more
    #[arg(long, value_name = "SAMPLES", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    #[serde(default = "one")]
    pub(crate) baseline: u32,

    /// Number of steps after which the fit ends
    #[arg(long, conflicts_with = "seconds", value_parser = steps)]
    pub(crate) steps: Option<u64>,

    /// Time after which the fit ends, s; the schedule covers it [default: 60, or a number of steps where several models are tried]
    #[arg(long, value_parser = positive)]
    pub(crate) seconds: Option<f64>,

    /// Number of additional models, each fitted to blocks of time that are drawn from the recordings; they give bands, calibrated on
    /// the blocks that they have not seen; each has the time or the steps of the fit
    #[arg(long, value_name = "MEMBERS", value_parser = clap::value_parser!(u32).range(2..=100))]
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) ensemble: Option<u32>,

    /// Seed of weights, split and batches
    #[arg(long, default_value_t = 0, value_parser = seed)]
    pub(crate) seed: u64,

    /// Files to validate on
    #[arg(long, value_name = "FILES", num_args = 1.., conflicts_with = "validate_fraction")]
    pub(crate) validate: Vec<PathBuf>,

    /// Part of the trajectories that is held back for validation, where no files are given: whole ones where there are many,
    /// blocks of time spread over each where there are few
    #[arg(long, value_name = "PART", default_value_t = 0.2, value_parser = fraction)]
    pub(crate) validate_fraction: f64,
}

/// The baseline of runs of versions without this setting.
fn one() -> u32 {
    1
}
