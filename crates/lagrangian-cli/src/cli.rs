//! The command line: every flag, its meaning and its default, in one place.

use std::ffi::OsString;
use std::path::PathBuf;

use anyhow::{Context, Result};
use clap::builder::styling::{AnsiColor, Styles};
use clap::{Args, CommandFactory, FromArgMatches, Parser, Subcommand};
use lagrangian::integrate::Method;
use lagrangian::trajectory::Sampling;
use lagrangian::{Coordinates, Layout};
use lagrangian_run::Links;

use crate::column_args::ColumnArgs;
use crate::command_line::arguments;
use crate::commands::OutputMode;
use crate::compare_args::CompareArgs;
use crate::excite_args::ExciteArgs;
use crate::export_args::ExportArgs;
use crate::fit_args::FitArgs;
use crate::identify_args::IdentifyArgs;
use crate::law_args::{ActionArgs, ConservedArgs, ConstraintsArgs, FormulaArgs};
use crate::out_args::{OutArgs, PlotArgs};
use crate::output;
use crate::track_args::TrackArgs;
use crate::values::{
    Rows, assignment, finite, links, method, name, non_negative, positive, rows, seed, tolerance,
};

const STYLES: Styles = Styles::styled()
    .header(AnsiColor::Green.on_default().bold())
    .usage(AnsiColor::Green.on_default().bold())
    .literal(AnsiColor::Cyan.on_default().bold())
    .placeholder(AnsiColor::Cyan.on_default());

/// Learns the mechanics of a physical system from its trajectories.
///
/// Data in, a Lagrangian out; then long stable rollouts, conserved energy and inverse dynamics from it.
#[derive(Debug, Parser)]
#[command(name = "lagrangian", version, styles = STYLES, propagate_version = true, after_help = "\
Begin with:
  lagrangian demo                                    a double pendulum, learned in a minute
  lagrangian check motion.csv --angle all            is my data good enough?
  lagrangian fit motion.csv --angle all --out run    learn from it
  lagrangian rollout run/model.safetensors --q0 1,0 --qd0 0,0 --duration 10

Environment:
  LAGRANGIAN_SIMD=NAME   CPU instructions of the kernels, in place of the fastest; `lagrangian --version` lists them")]
pub(crate) struct Cli {
    #[command(flatten)]
    pub(crate) mode: OutputMode,

    #[command(subcommand)]
    pub(crate) command: Command,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Learn a double pendulum, and compare the learned Lagrangian with a plain network over 100 s
    Demo(DemoArgs),
    /// Roll out a system whose Lagrangian is known: trajectories to learn from
    Simulate(SimulateArgs),
    /// Convert recordings to another format, several to one file
    Convert(ConvertArgs),
    /// Check recordings before fitting: rate, gaps, noise, units, coverage
    Check(CheckArgs),
    /// Learn a model from recordings, and write a run folder with model, metrics and report
    Fit(Box<FitArgs>),
    /// Find the law of a motion as a formula, with standard errors, or print that of a saved model
    Formula(Box<FormulaArgs>),
    /// Find rods, circles and lines that join recorded points
    Constraints(Box<ConstraintsArgs>),
    /// Plan a motion from which a robot can be identified
    Excite(Box<ExciteArgs>),
    /// Identify a robot from its logs, and write its parameters to its URDF
    Identify(Box<IdentifyArgs>),
    /// Write a model as C, for controllers, CasADi, FMI and Rust without std
    Export(ExportArgs),
    /// Measure a model on recordings that it has not seen
    Score(ScoreArgs),
    /// Compare runs on the same motions: differences with their spread, settings, data
    Compare(Box<CompareArgs>),
    /// Predict a motion from an initial state
    Rollout(RolloutArgs),
    /// Predict the torques of a motion, and divide them into inertial, Coriolis, gravity and friction parts
    Torque(TorqueArgs),
    /// Let a simulated robot follow a motion through a model: tracking errors beside feedback alone and the true model
    Track(Box<TrackArgs>),
    /// Energy, momenta and Noether's charges of a model: which are conserved, and how far they drift
    Conserved(Box<ConservedArgs>),
    /// The paths of stationary action between two ends, and whether they are minima
    Action(Box<ActionArgs>),
    /// Write the page of a run again, and pictures of it
    Report(ReportArgs),
    /// Name the command that runs sweeps
    #[command(hide = true)]
    Sweep {
        /// Plan and flags of the former command
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        plan: Vec<String>,
    },
    /// Name the command that serves the laboratory in the browser
    #[command(hide = true)]
    Lab {
        /// Flags of the former server
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        flags: Vec<String>,
    },
}

/// The columns of a file; a TOML file beside it may declare them too.
#[derive(Debug, Clone, Default, Args, serde::Serialize, serde::Deserialize)]
#[command(next_help_heading = "Columns of the data")]
pub(crate) struct FileArgs {
    #[command(flatten)]
    #[serde(flatten)]
    pub(crate) columns: ColumnArgs,

    /// Column of time, s or in the unit that its name states; without one, a number: the seconds between rows [default: t, or
    /// the only one that states a unit of time]
    #[arg(long, value_name = "NAME", value_parser = name)]
    pub(crate) time: Option<String>,

    /// Column that separates several trajectories of one file [default: trajectory, if it exists]
    #[arg(long, value_name = "NAME", value_parser = name)]
    pub(crate) trajectory: Option<String>,

    /// Topic of a ROS 2 bag; its joints are columns that --q names [default: the one with joint states]
    #[arg(long, value_name = "NAME", value_parser = name)]
    pub(crate) topic: Option<String>,

    /// Coordinates that are angles, for which q and q + 2π are equal; `all` for all of them
    #[arg(long, value_name = "NAMES", value_delimiter = ',', value_parser = name)]
    pub(crate) angle: Vec<String>,

    /// A coordinate that is the angle of a point (x, y) about another one, from the x axis: theta=x,y@x0,y0, with columns, or
    /// numbers after the @ [default: @0,0]; several times for several angles
    #[arg(long, value_name = "NAME=X,Y@X0,Y0")]
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) polar: Vec<String>,

    /// Angles are in degrees (never guessed; a unit in the name of a column, such as `Angle (deg)`, is converted without this flag)
    #[arg(long)]
    pub(crate) degrees: bool,

    /// --goal-kp and --goal-kd are in N·m/rad and N·m·s/rad: the torque kp (goal − q) − kd q̇ is then known, and every family fits it
    #[arg(long)]
    #[serde(default)]
    pub(crate) si_gains: bool,

    /// Keep every Nth row
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) every: Option<u32>,

    /// TOML file with these declarations [default: the data file's name with .toml, else lagrangian.toml beside it]
    #[arg(long, value_name = "FILE")]
    pub(crate) layout: Option<PathBuf>,
}

/// Options for reading recordings.
#[derive(Debug, Clone, Default, Args, serde::Serialize, serde::Deserialize)]
#[command(next_help_heading = "Columns of the data")]
pub(crate) struct DataArgs {
    #[command(flatten)]
    #[serde(flatten)]
    pub(crate) file: FileArgs,

    /// Coordinates that the forces act on, in the order of --tau, where they are fewer than the coordinates; the
    /// forces on the others are 0 [default: all, or by the names of the columns]
    #[arg(long, value_name = "NAMES", value_delimiter = ',', value_parser = name)]
    #[serde(default)]
    pub(crate) actuated: Vec<String>,

    /// Delay from the forces to the motion, ms, by which the forces are shifted; one value, or one for each coordinate
    /// (`lagrangian check` measures it)
    #[arg(long, value_name = "MS", value_delimiter = ',', allow_hyphen_values = true, value_parser = finite)]
    #[serde(default)]
    pub(crate) delay: Vec<f64>,

    /// Coordinates that never move, such as a mass, a length or the strength of a field: a model sees their values;
    /// further columns, or some of --q; they need no columns of velocities
    #[arg(long, value_name = "NAMES", value_delimiter = ',', value_parser = name)]
    #[serde(default)]
    pub(crate) parameters: Vec<String>,

    /// The delays of the forces of the data that the model was fitted to, s, used where the command line gives none.
    #[arg(skip)]
    #[serde(skip)]
    pub(crate) fitted_delay: Vec<f64>,

    /// The layout of the data that the model was fitted to, for columns that neither the command line nor a file beside the data declares.
    #[arg(skip)]
    #[serde(skip)]
    pub(crate) fitted: Option<Layout>,

    /// The coordinates of the model that the data are for.
    #[arg(skip)]
    #[serde(skip)]
    pub(crate) model: Option<Coordinates>,
}

/// The default largest number of rows: a sample of a longer log is enough and bounds memory (ADR 0049).
const ROWS: usize = 1 << 20;

/// Flags that have no effect where no recording is read.
pub(crate) const OF_RECORDINGS: [&str; 6] = [
    "smooth",
    "low_pass",
    "delay",
    "every",
    "topic",
    "trajectory",
];

/// The used part of long recordings.
#[derive(Debug, Clone, Default, Args, serde::Serialize, serde::Deserialize)]
pub(crate) struct SampleArgs {
    /// Largest number of rows that are used; of longer logs a sample is taken, stretches chosen by the seed, in one pass and with
    /// memory for these rows alone; `all` for all [default: 1048576]
    #[arg(long, value_name = "N", help_heading = "Data", value_parser = rows)]
    #[serde(default)]
    pub(crate) rows: Option<Rows>,
}

impl SampleArgs {
    /// The sampling in the form of the library.
    pub(crate) fn sampling(&self, seed: u64, stretch: usize) -> Option<Sampling> {
        Some(Sampling {
            rows: self.rows.map_or(Some(ROWS), |Rows(rows)| rows)?,
            seed,
            stretch,
        })
    }
}

/// Options for the preparation of noisy recordings.
#[derive(Debug, Clone, Default, Args, serde::Serialize, serde::Deserialize)]
#[command(next_help_heading = "Noisy data")]
pub(crate) struct EstimateArgs {
    /// Smooth measured q and q̇, over windows chosen from the data
    #[arg(long, conflicts_with = "low_pass")]
    pub(crate) smooth: bool,

    /// Pass q and τ through one low-pass without delay, with this cut-off, and take q̇ and q̈ from q: for machines with
    /// noise, play or vibrations; 0 for none [default: for `fit` and `identify`, the one of `check` where noise spoils the accelerations]
    #[arg(long, value_name = "HZ", value_parser = non_negative)]
    pub(crate) low_pass: Option<f64>,
}

/// The reading of recordings and their preparation.
#[derive(Debug, Clone, Args)]
pub(crate) struct RecordedArgs {
    #[command(flatten)]
    pub(crate) estimate: EstimateArgs,

    #[command(flatten)]
    pub(crate) data: DataArgs,
}

/// A saved model, and recordings for it.
#[derive(Debug, Clone, Args)]
pub(crate) struct ModelDataArgs {
    /// A saved model
    #[arg(index = 1)]
    pub(crate) model: PathBuf,

    /// Files with recordings: .csv, .npz, .parquet, .db3, .mcap
    #[arg(index = 2, required = true)]
    pub(crate) files: Vec<PathBuf>,

    #[command(flatten)]
    pub(crate) recorded: RecordedArgs,
}

#[derive(Debug, Args, serde::Serialize)]
#[command(after_help = "\
Examples:
  lagrangian demo
  lagrangian demo --seconds 20 --out quick --json")]
pub(crate) struct DemoArgs {
    /// Folder for models, report and figures
    #[arg(long, value_name = "DIR", default_value = "lagrangian-demo")]
    pub(crate) out: PathBuf,

    /// Time for each of the two fits, s
    #[arg(long, default_value_t = 22.0, value_parser = positive)]
    pub(crate) seconds: f64,

    /// Number of states to learn from
    #[arg(long, default_value_t = 100_000, value_parser = clap::value_parser!(u32).range(100..=10_000_000))]
    pub(crate) samples: u32,

    /// Rollouts over which the energy error is averaged
    #[arg(long, default_value_t = 40, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    pub(crate) starts: u32,

    /// Seed of all random numbers
    #[arg(long, default_value_t = 0, value_parser = seed)]
    pub(crate) seed: u64,

    /// Replace an earlier demo in the folder
    #[arg(long)]
    pub(crate) force: bool,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  lagrangian simulate pendulum > motion.csv
  lagrangian simulate double-pendulum --trajectories 20 --duration 10 --out motion.npz
  lagrangian simulate two-link-arm --drive 3 --friction 0.3 --trajectories 10 --out arm.csv
  lagrangian simulate --urdf robot.urdf --drive 20 --trajectories 10 --out motion.npz
  lagrangian simulate pendulum --set length=2 --q0 0.1 --qd0 0 --noise 0.001 --out noisy.csv

`lagrangian simulate list` names the systems and their parameters.")]
#[command(mut_arg("out", |arg| arg.help("File for the trajectories, .csv, .npz or .parquet; a .toml that declares the angles is put beside it [default: CSV on standard output]")))]
pub(crate) struct SimulateArgs {
    #[command(flatten)]
    pub(crate) system: SystemArgs,

    #[command(flatten)]
    pub(crate) recorded: SimulatedArgs,

    #[command(flatten)]
    pub(crate) output: OutArgs,

    /// Number of trajectories, from random initial states
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub(crate) trajectories: u32,

    /// Distribution of the random initial states
    #[arg(long, value_enum, default_value_t, conflicts_with = "q0")]
    pub(crate) starts: Starts,

    /// Seed of the initial states, of the drive and of the noise [default: 0]
    #[arg(long, value_parser = seed)]
    pub(crate) seed: Option<u64>,

    #[command(flatten)]
    pub(crate) motion: MotionArgs,
}

/// The system that moves.
#[derive(Debug, Args)]
pub(crate) struct SystemArgs {
    /// Name of the system, or `list`
    #[arg(id = "system", value_name = "SYSTEM", required_unless_present = "urdf")]
    pub(crate) name: Option<String>,

    /// A robot instead, with the friction of its description: its URDF file, or the name of an example (`two_link_arm`, iiwa7, ur5, panda)
    #[arg(long, value_name = "FILE", conflicts_with_all = ["system", "parameters"])]
    pub(crate) urdf: Option<PathBuf>,

    /// Joints of the robot that move, in this order, the others locked at 0 [default: all]
    #[arg(long, value_name = "NAMES", value_delimiter = ',', requires = "urdf", value_parser = name)]
    pub(crate) joints: Vec<String>,

    /// A parameter of the system; may be repeated
    #[arg(long = "set", value_name = "NAME=VALUE", value_parser = assignment)]
    pub(crate) parameters: Vec<(String, f64)>,
}

/// The forces on the system, and what is recorded of it.
#[derive(Debug, Args)]
pub(crate) struct SimulatedArgs {
    /// Drive every coordinate by a sine of this amplitude, N·m or N, of random phase and 0.2 to 1.5 Hz
    #[arg(long, value_name = "TORQUE", value_parser = positive)]
    pub(crate) drive: Option<f64>,

    /// Viscous friction on every coordinate, N·m·s/rad or N·s/m; it is not part of the recorded forces
    #[arg(long, value_name = "COEFFICIENT", default_value_t = 0.0, value_parser = non_negative)]
    pub(crate) friction: f64,

    /// Also write the momenta p = ∂L/∂q̇
    #[arg(long)]
    pub(crate) momenta: bool,

    /// Standard deviation of Gaussian noise on q (in its unit), q̇ and p; accelerations are then omitted
    #[arg(long, value_name = "SIGMA", value_parser = non_negative)]
    pub(crate) noise: Option<f64>,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Every value is kept, also those that `lagrangian check` refuses, and none is estimated; degrees become radians, and wrapped
angles are unwrapped.

Examples:
  lagrangian convert motion.csv --out swings.npz
  lagrangian convert log1.csv log2.csv --time time --q theta --tau torque --angle theta --degrees --out logs.npz
  lagrangian convert bag.db3 --angle all --out arm.csv
  lagrangian convert bag_folder --topic /joint_states --q shoulder,elbow --every 2 --out arm.csv")]
#[command(mut_arg("out", |arg| arg.help("File for the recordings, .csv, .npz or .parquet; a .toml that declares the angles is put beside it [default: CSV on standard output]")))]
pub(crate) struct ConvertArgs {
    /// Files with recordings: .csv, .npz, .parquet, .db3, .mcap, or folders of bags; several become one file with a
    /// column `trajectory`
    #[arg(required = true)]
    pub(crate) files: Vec<PathBuf>,

    #[command(flatten)]
    pub(crate) output: OutArgs,

    #[command(flatten)]
    pub(crate) data: DataArgs,
}

/// The distribution of random initial states.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, clap::ValueEnum, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Starts {
    /// The states that models are trained on (fast motions)
    #[default]
    Training,
    /// The states that rollouts are tested from (e.g. nearly at rest)
    Test,
}

/// An initial state, a duration and a method.
#[derive(Debug, Clone, Args, serde::Serialize)]
#[command(next_help_heading = "Motion")]
pub(crate) struct MotionArgs {
    /// Initial coordinates, in SI units or in those of the data that the model was fitted to (--degrees)
    #[arg(
        long,
        value_name = "VALUES",
        value_delimiter = ',',
        allow_hyphen_values = true,
        value_parser = finite,
        requires = "qd0"
    )]
    pub(crate) q0: Vec<f64>,

    /// Initial velocities, in the same units
    #[arg(
        long,
        value_name = "VALUES",
        value_delimiter = ',',
        allow_hyphen_values = true,
        value_parser = finite,
        requires = "q0"
    )]
    pub(crate) qd0: Vec<f64>,

    /// Duration, s
    #[arg(long, default_value_t = 10.0, allow_hyphen_values = true, value_parser = positive)]
    pub(crate) duration: f64,

    /// Time between samples, and step of the methods of fixed step, s
    #[arg(long, default_value_t = 0.01, allow_hyphen_values = true, value_parser = positive)]
    pub(crate) step: f64,

    /// Method of integration
    #[arg(long, value_parser = method(), default_value = Method::default().name())]
    pub(crate) method: Method,

    /// Tolerance of the adaptive methods, relative and absolute [default: 1e-10]
    #[arg(long, allow_hyphen_values = true, value_parser = tolerance)]
    pub(crate) tolerance: Option<f64>,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Exit code: 0 if the data can be fitted, 1 if a fit would be meaningless, 2 for files that cannot be read.

Examples:
  lagrangian check motion.csv
  lagrangian check log1.csv log2.csv --time t --q theta --qd omega --tau torque --angle theta
  lagrangian check motion.csv --lagrangian --seconds 10")]
#[command(mut_arg("out", |arg| arg.help("File for the findings as JSON")))]
pub(crate) struct CheckArgs {
    /// Files with recordings: .csv, .npz, .parquet, .db3, .mcap
    #[arg(required = true)]
    pub(crate) files: Vec<PathBuf>,

    #[command(flatten)]
    pub(crate) output: OutArgs,

    /// Check the forces after the low-pass of `fit --low-pass`, with this cut-off
    #[arg(long, value_name = "HZ", value_parser = positive)]
    pub(crate) low_pass: Option<f64>,

    /// Also test whether any Lagrangian exists for these motions. It compares fits with and without one, so it takes time
    #[arg(long)]
    pub(crate) lagrangian: bool,

    /// Time for each of the five to nine fits of that test, s
    #[arg(long, value_name = "SECONDS", value_parser = positive, default_value_t = 3.0, requires = "lagrangian")]
    pub(crate) seconds: f64,

    #[command(flatten)]
    pub(crate) data: DataArgs,

    #[command(flatten)]
    pub(crate) sample: SampleArgs,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  lagrangian score run/model.safetensors test.csv
  lagrangian score run/model.safetensors test1.csv test2.csv --json --out scores.json")]
#[command(mut_arg("model", |arg| arg.help("A saved model, or the folder of a run with an ensemble, for the part of the recordings in its bands")))]
pub(crate) struct ScoreArgs {
    #[command(flatten)]
    pub(crate) given: ModelDataArgs,

    #[command(flatten)]
    pub(crate) output: OutArgs,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Parts: inertial τ(q, q̇, q̈) − τ(q, q̇, 0); gravity τ(q, 0, 0); friction as learned; Coriolis the rest.

Examples:
  lagrangian torque run/model.safetensors test.csv
  lagrangian torque run/model.safetensors test.csv --out torques.npz --plot torques.html
  lagrangian torque run/model.safetensors log.csv --low-pass 5 --delay 16 --json")]
#[command(mut_arg("out", |arg| arg.help("File for the torques and their parts at every sample, .csv, .npz or .parquet")))]
#[command(mut_arg("plot", |arg| arg.help("File for a drawing of the first motion: .html for a page, .svg or .png for its first joint")))]
#[command(mut_arg("files", |arg| arg.help("Files with recordings: .csv, .npz, .parquet, .db3, .mcap; with torques, the prediction is compared with them")))]
pub(crate) struct TorqueArgs {
    #[command(flatten)]
    pub(crate) given: ModelDataArgs,

    #[command(flatten)]
    pub(crate) output: PlotArgs,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  lagrangian rollout run/model.safetensors --q0 1.5,0 --qd0 0,0 --duration 100 --out motion.csv
  lagrangian rollout run/model.safetensors --follow test.csv    from its first state, under its torques")]
#[command(mut_arg("out", |arg| arg.help("File for the trajectory, .csv, .npz or .parquet [default: CSV on standard output]")))]
#[command(mut_arg("duration", |arg| arg.conflicts_with("follow")))]
#[command(mut_args(|arg| match OF_RECORDINGS.contains(&arg.get_id().as_str()) {
    true => arg.requires("follow"),
    false => arg,
}))]
pub(crate) struct RolloutArgs {
    /// A saved model
    pub(crate) model: PathBuf,

    #[command(flatten)]
    pub(crate) output: OutArgs,

    /// Start from the first state of this recording, under its forces, at its times
    #[arg(long, value_name = "FILE")]
    pub(crate) follow: Option<PathBuf>,

    #[command(flatten)]
    pub(crate) motion: MotionArgs,

    #[command(flatten)]
    pub(crate) recorded: RecordedArgs,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  lagrangian report run
  lagrangian report run --out page.html --pictures pictures
  lagrangian report lagrangian-demo --gif demo.gif")]
#[command(mut_arg("out", |arg| arg.help("File for the page [default: report.html in the run]")))]
pub(crate) struct ReportArgs {
    /// Folder of a run, or of a demo
    pub(crate) run: PathBuf,

    #[command(flatten)]
    pub(crate) output: OutArgs,

    /// Folder for the figures as separate pictures, SVG and PNG
    #[arg(long, value_name = "DIR")]
    pub(crate) pictures: Option<PathBuf>,

    /// File for the motion as an animated GIF (coordinates that are all angles)
    #[arg(long, value_name = "FILE")]
    pub(crate) gif: Option<PathBuf>,

    /// Reference of the angles of the moving chain of a run: each from hanging down, or from the link before and the first from
    /// hanging down or from the horizontal [default: as its data state (`links` in the file beside them), else from the link
    /// before for a robot]
    #[arg(long, value_parser = links())]
    pub(crate) links: Option<Links>,
}

/// A longer word is not repeated in full, bytes.
const LONG_WORD: usize = 60;

impl Cli {
    /// Reads the command line; a negative number is a value of the flag before it, which may refuse it.
    ///
    /// # Errors
    /// If the requested help cannot be printed.
    pub(crate) fn from_command_line() -> Result<Self> {
        let program = std::iter::once(OsString::from("lagrangian"));
        let words = program.chain(arguments().iter().cloned());
        let matches = Self::numeric().try_get_matches_from(words);
        let parsed = matches.and_then(|matches| Self::from_arg_matches(&matches));
        let error = match parsed {
            Ok(own) => return Ok(own),
            Err(error) => error,
        };
        // The parser repeats words of any length and content.
        let is_short =
            |word: &str| word.len() <= LONG_WORD && !word.contains(lagrangian::text::is_hidden);
        let is_plain = |word: &OsString| word.to_str().is_some_and(is_short);
        if !error.use_stderr() {
            output::refuse_closed()?;
            error.print().context(output::CANNOT_PRINT)?;
        } else if arguments().iter().all(is_plain) {
            error.exit();
        } else {
            note!("{}", lagrangian::text::brief(&error.render().to_string()));
        }
        std::process::exit(error.exit_code())
    }

    /// The command of a list of words that this program composes.
    pub(crate) fn of_words<'a>(words: impl IntoIterator<Item = &'a str>) -> Option<Self> {
        let matches = Self::numeric().try_get_matches_from(words).ok()?;
        Self::from_arg_matches(&matches).ok()
    }

    fn numeric() -> clap::Command {
        let takes_value =
            |arg: &clap::Arg| arg.get_long().is_some() && arg.get_action().takes_values();
        let command = Self::command().long_version(crate::instructions::version().leak() as &str);
        command.mut_subcommands(|command| {
            command.mut_args(|arg| {
                let value = takes_value(&arg) && !arg.is_allow_hyphen_values_set();
                arg.allow_negative_numbers(value)
            })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_line_is_well_formed() {
        Cli::numeric().debug_assert();
    }
}
