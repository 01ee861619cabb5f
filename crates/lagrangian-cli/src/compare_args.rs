//! The flags of `lagrangian compare`.

use std::path::PathBuf;

use clap::Args;

use crate::cli::RecordedArgs;
use crate::out_args::PlotArgs;

#[derive(Debug, Args)]
#[command(after_help = "\
Differences are those from the first run, with the interval that holds them with 95 %, from paired blocks of the motions. Losses are
compared only where they are of one kind, on the same data, prepared alike.

Examples:
  lagrangian compare run1 run2
  lagrangian compare run1 run2 run3 --on test.csv --plot compare.html
  lagrangian compare run1/model.safetensors other.safetensors --on test1.csv test2.csv --json --out compare.json")]
pub(crate) struct CompareArgs {
    /// Folders of runs, or saved models, two or more; the others are compared with the first
    #[arg(required = true, value_name = "RUN")]
    pub(crate) runs: Vec<PathBuf>,

    /// Files with recordings that no model has seen [default: those that all runs were validated on]
    #[arg(long, value_name = "FILES", num_args = 1..)]
    pub(crate) on: Vec<PathBuf>,

    #[command(flatten)]
    pub(crate) output: PlotArgs,

    #[command(flatten)]
    pub(crate) recorded: RecordedArgs,
}
