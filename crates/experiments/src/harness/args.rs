//! The command line.

use std::path::PathBuf;

use clap::Parser;

/// Comparisons of papers that can be repeated: figures, curves and a page.
#[derive(Debug, Parser, serde::Serialize)]
#[command(
    name = "experiments",
    after_help = "\
Examples:
  cargo run --release -p experiments -- list
  cargo run --release -p experiments -- letters --seeds 3 --json
  cargo run --release -p experiments -- letters --quick --data ../shared/data --out first-try"
)]
pub(crate) struct Args {
    /// Name of the experiment, or `list`
    pub(crate) name: String,

    /// Number of runs, each with a seed of its own [default: 3, 1 with --quick]
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=100))]
    pub(crate) seeds: Option<u32>,

    /// The first seed
    #[arg(long, default_value_t = 0, value_parser = clap::value_parser!(u64).range(..=i64::MAX as u64))]
    pub(crate) seed: u64,

    /// Time for each main fit, s [default: that of the experiment]
    #[arg(long, value_parser = positive)]
    pub(crate) seconds: Option<f64>,

    /// The whole in less than a minute, with few steps: to see that it works, not for comparisons
    #[arg(long)]
    pub(crate) quick: bool,

    /// One part only, where the experiment has parts; `list` names them
    #[arg(long, value_name = "PART")]
    pub(crate) only: Option<String>,

    /// Number of cases, evenly spread over all, where the experiment has cases
    #[arg(long, value_name = "N")]
    pub(crate) cases: Option<usize>,

    /// One half of the systems, where the experiment has halves
    #[arg(long, value_parser = ["first", "second"])]
    pub(crate) half: Option<String>,

    /// Fit with other flags too, where the experiment has them: slow
    #[arg(long)]
    pub(crate) flags: bool,

    /// Folder of the reference data [default: the variable `LAGRANGIAN_DATA`, else shared/data, else ../shared/data]
    #[arg(long, value_name = "DIR")]
    pub(crate) data: Option<PathBuf>,

    /// Folder for figures and page [default: experiment-NAME, with a number if that is taken]
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,

    /// Replace an earlier run in the folder
    #[arg(long)]
    pub(crate) force: bool,

    /// Print all figures as one JSON object
    #[arg(long)]
    pub(crate) json: bool,

    /// Show no progress
    #[arg(long)]
    pub(crate) quiet: bool,
}

impl Args {
    /// The seeds, one for each run.
    pub(crate) fn seeds(&self) -> Vec<u64> {
        let runs = self.seeds.unwrap_or(if self.quick { 1 } else { 3 });
        (0..u64::from(runs))
            .map(|k| self.seed.wrapping_add(k))
            .collect()
    }
}

fn positive(text: &str) -> Result<f64, String> {
    let number = text.trim().parse().ok();
    let number = number.filter(|x: &f64| x.is_finite() && *x > 0.0);
    number.ok_or_else(|| "it must be a number above 0".into())
}
