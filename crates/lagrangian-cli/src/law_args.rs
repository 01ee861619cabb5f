//! The flags of `lagrangian action` and `lagrangian conserved`.

use std::path::PathBuf;

use clap::Args;

use crate::cli::{DataArgs, OF_RECORDINGS, RecordedArgs};
use crate::out_args::PlotArgs;
use crate::subject::SubjectArgs;
use crate::values::{count, finite, positive, seed};

#[derive(Debug, Args)]
#[command(after_help = "\
The friction of a model has no action and is omitted. Exit code 1 where no path was found.

Examples:
  lagrangian action pendulum --from 0.2 --to 1.5 --time 0.7
  lagrangian action pendulum --from 0 --to 0.5 --turns 1 --time 1.2 --plot over-the-top.html
  lagrangian action run/model.safetensors --from 0.6,-0.3 --to 1,0.4 --time 0.5 --out path.csv --json")]
#[command(mut_arg("out", |arg| arg.help("File for the paths, .csv, .npz or .parquet, the one of least action first")))]
#[command(mut_arg("plot", |arg| arg.help("File for a drawing of the path of least action: .html for a page, .svg or .png for its first coordinate")))]
pub(crate) struct ActionArgs {
    #[command(flatten)]
    pub(crate) subject: SubjectArgs,

    /// Coordinates at the start, SI units
    #[arg(long, value_name = "VALUES", value_delimiter = ',', required = true, allow_hyphen_values = true, value_parser = finite)]
    pub(crate) from: Vec<f64>,

    /// Coordinates at the end, SI units; angles take the shorter direction
    #[arg(long, value_name = "VALUES", value_delimiter = ',', required = true, allow_hyphen_values = true, value_parser = finite)]
    pub(crate) to: Vec<f64>,

    /// Time from the start to the end, s
    #[arg(long, value_name = "SECONDS", allow_hyphen_values = true, value_parser = positive)]
    pub(crate) time: f64,

    /// Whole turns of each angle in addition to the shorter direction; negative turns go in the opposite direction [default: 0 each]
    #[arg(
        long,
        value_name = "TURNS",
        value_delimiter = ',',
        allow_hyphen_values = true
    )]
    pub(crate) turns: Vec<i32>,

    /// Steps of the path, an even number
    #[arg(long, value_name = "N", default_value = "200", value_parser = count)]
    pub(crate) steps: usize,

    /// Initial paths of the search: the straight one, and others with random bulges
    #[arg(long, value_name = "N", default_value = "16", value_parser = count)]
    pub(crate) guesses: usize,

    /// Seed of the bulges
    #[arg(long, default_value_t = 0, value_parser = seed)]
    pub(crate) seed: u64,

    #[command(flatten)]
    pub(crate) output: PlotArgs,
}

#[derive(Debug, Args)]
#[command(after_help = "\
The terms are powers of lines and harmonics of angles, alone and times one or two velocities, and friction that is viscous, dry or a
drag. Without recorded forces a motion leaves the unit open: the largest kinetic term has the coefficient 0.5. Digits in brackets are
the standard error of the last digits. A formula is the law where it explains the data to their noise and no term can go or come; else it
is called an expansion, or none (exit code 1). That of a network is found in motions that it predicts, from states that its data visited,
with white noise of 0.01, 0.1 or 1 % of their deviation: the least within which it obeys a law.

Examples:
  lagrangian formula swings.csv --angle all
  lagrangian formula robot.npz --angle all --latex
  lagrangian formula run --json                                      of a fitted model
  lagrangian fit swings.csv --angle all --model formula --out run    as a model, with a page")]
pub(crate) struct FormulaArgs {
    /// Files with recordings, .csv, .npz, .parquet, .db3, .mcap; or a saved model, or the folder of a run
    #[arg(required = true, value_name = "FILES|MODEL")]
    pub(crate) files: Vec<PathBuf>,

    /// Print the formula for LaTeX, and nothing else
    #[arg(long)]
    pub(crate) latex: bool,

    /// Seed of the split into motions that are fitted and held back
    #[arg(long, default_value_t = 0, value_parser = seed)]
    pub(crate) seed: u64,

    #[command(flatten)]
    pub(crate) recorded: RecordedArgs,
}

#[derive(Debug, Args)]
#[command(after_help = "\
A constraint holds where all positions are as far from it as their noise says, in every motion. Found are coordinates that do not move,
lines and other linear relations, circles and spheres, rods, and other curves and surfaces of second order. Relations that a single
motion may follow by chance (all but rods and circles) need three recordings.

Examples:
  lagrangian constraints points.csv --q x1,y1,x2,y2
  lagrangian constraints points.csv --q x1,y1,x2,y2 --points x1:y1,x2:y2 --json")]
pub(crate) struct ConstraintsArgs {
    /// Files with recordings, .csv, .npz, .parquet, .db3, .mcap
    #[arg(required = true)]
    pub(crate) files: Vec<PathBuf>,

    /// Points, as their Cartesian coordinates: x1:y1,x2:y2 [default: by the names; without such names, two or three coordinates each]
    #[arg(long, value_name = "POINTS", value_delimiter = ',')]
    pub(crate) points: Vec<String>,

    #[command(flatten)]
    pub(crate) data: DataArgs,
}

#[derive(Debug, Args)]
#[command(after_help = "\
r is the force along a direction, of the inertial forces: 0 for a symmetry. Drifts are the largest change of a
quantity, with the work of forces and friction taken off, of its size.

Examples:
  lagrangian conserved run/model.safetensors test.csv
  lagrangian conserved run/model.safetensors planet.csv --points x:y
  lagrangian conserved n-body --points x1:y1,x2:y2,x3:y3 --json
  lagrangian conserved kepler --points q1:q2 --plot kepler.html
  lagrangian conserved furuta-pendulum")]
#[command(mut_args(|arg| match OF_RECORDINGS.contains(&arg.get_id().as_str()) {
    // The parser does not require a flag that another one excludes.
    true => arg.requires("files").conflicts_with_all(["seed", "duration"]),
    false => arg,
}))]
pub(crate) struct ConservedArgs {
    #[command(flatten)]
    pub(crate) subject: SubjectArgs,

    /// Files with recordings, .csv, .npz, .parquet, .db3, .mcap; without any, a system is rolled out from random states
    pub(crate) files: Vec<PathBuf>,

    /// Points that turn and shift together, as their Cartesian coordinates: x1:y1,x2:y2 [default: by the names]
    #[arg(long, value_name = "POINTS", value_delimiter = ',')]
    pub(crate) points: Vec<String>,

    /// Largest r of a symmetry
    #[arg(long, value_name = "R", default_value_t = 0.01, value_parser = positive)]
    pub(crate) tolerance: f64,

    /// Number of recordings from whose first states the model is rolled out
    #[arg(long, value_name = "N", default_value = "10", value_parser = count)]
    pub(crate) rollouts: usize,

    /// Seed of the random states
    #[arg(long, default_value_t = 0, value_parser = seed, conflicts_with = "files")]
    pub(crate) seed: u64,

    /// Duration of the rollout of a system, s
    #[arg(long, value_name = "SECONDS", default_value_t = 5.0, value_parser = positive, conflicts_with = "files")]
    pub(crate) duration: f64,

    #[command(flatten)]
    pub(crate) output: PlotArgs,

    #[command(flatten)]
    pub(crate) recorded: RecordedArgs,
}
