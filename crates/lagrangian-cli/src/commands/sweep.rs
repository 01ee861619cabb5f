//! `lagrangian sweep`: many fits by a plan, in units that several machines may share.

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::Result;
use clap::Args;
use lagrangian_run::Tensorboard;
use lagrangian_run::sweep::{Conditions, Ended, Plan, Planned, RESULTS, Shard, Table, Unit};
use serde_json::json;

use super::OutputMode;
use crate::command_line::command_line;
use crate::failure::{FAILED, with_flags};
use crate::interrupt;
use crate::motion;
use crate::output;
use crate::skin::{Flags, Shown};
use crate::task::{Size, Task};

/// Rows of the table that are printed.
const SHOWN: usize = 20;

#[derive(Debug, Args)]
#[command(after_help = "\
A plan names the data, the settings that all fits have, and those that differ:

  [data]
  files = [\"motion.csv\"]               # paths lead from the folder of the plan
  validate = [\"test.csv\"]              # optional
  layout = { angle = \"all\" }           # what a layout file says, optional

  [fixed]
  model = \"lnn\"
  steps = 300                          # a number of steps gives the same bits on every machine

  [space]
  width = [16, 32, 64]
  learning_rate = { from = 1e-3, to = 1e-1, log = true }

  [search]
  method = \"random\"                    # or \"grid\", for lists alone
  number = 20

Each fit is a run folder that is named by the hash of its settings and data. What has ended is not done again.

Examples:
  lagrangian sweep plan.toml --dry-run
  lagrangian sweep plan.toml --out sweep
  lagrangian sweep plan.toml --out sweep --shard 3/16     the third part of sixteen, on a machine of its own")]
pub(crate) struct SweepArgs {
    /// The plan, a TOML file
    pub(crate) plan: PathBuf,

    /// Folder of the runs and of the table of results
    #[arg(long, value_name = "DIR", default_value = "runs/sweep")]
    pub(crate) out: PathBuf,

    /// Do a part of the units: 3/16 is the third of sixteen
    #[arg(long, value_name = "K/N", default_value = "1/1")]
    pub(crate) shard: Shard,

    /// List the units, and do none
    #[arg(long)]
    pub(crate) dry_run: bool,
}

pub(super) fn run(args: &SweepArgs, mode: OutputMode) -> Result<ExitCode> {
    let planned = planned(args, mode)?;
    for note in &planned.told {
        tell!("note: {}", with_flags(note));
    }
    let table = || Table::of(&planned.units, &planned.varied, &args.out);
    if args.dry_run {
        list(args, &table()?, mode)?;
        return Ok(ExitCode::SUCCESS);
    }
    planned.begin(&args.out)?;
    let mine = planned.units.iter().enumerate();
    let mine: Vec<&Unit> = mine
        .filter(|(k, _)| args.shard.has(*k))
        .map(|(_, u)| u)
        .collect();
    work(args, &planned, &mine, mode)?;
    let table = table()?;
    table.write(&args.out)?;
    tell_results(args, &table, mode)?;
    Ok(match table.best() {
        None if table.finished() == table.rows.len() => ExitCode::from(FAILED),
        _ => ExitCode::SUCCESS,
    })
}

/// Reads the plan and its data.
fn planned(args: &SweepArgs, mode: OutputMode) -> Result<Planned> {
    let plan = Plan::read(&args.plan)?;
    let size = Size::of_files(&plan.inputs()?);
    let _reading = Task::start("sweep: reading the data", mode.quiet, size)?;
    Ok(plan.ready()?)
}

/// Does the units one after another, until Ctrl-C.
fn work(args: &SweepArgs, planned: &Planned, mine: &[&Unit], mode: OutputMode) -> Result<()> {
    interrupt::listen()?;
    let conditions = Conditions {
        root: &args.out,
        skin: &Flags,
        command: command_line(),
        options: motion::for_comparison(),
        tensorboard: Tensorboard::Written,
    };
    for (k, unit) in mine.iter().enumerate() {
        let label = format!("unit {} of {} ({})", k + 1, mine.len(), unit.id);
        let mut shown = Shown::start(&label, mode.quiet);
        let ended = unit.run(&planned.data, &conditions, &mut shown)?;
        shown.finish(&in_words(&ended));
        if ended == Ended::Interrupted || interrupt::is_pressed() {
            break;
        }
    }
    Ok(())
}

fn in_words(ended: &Ended) -> String {
    match ended {
        Ended::Interrupted => "interrupted; the same command goes on with it".into(),
        Ended::Busy => "another process works on it".into(),
        Ended::Finished(result) => match (&result.failure, result.error) {
            (Some(failure), _) => format!("failed: {}", with_flags(failure)),
            (None, Some(error)) => format!("error {error:.3e}"),
            (None, None) => "no error is known".into(),
        },
    }
}

fn list(args: &SweepArgs, table: &Table, mode: OutputMode) -> Result<()> {
    if mode.json {
        return output::print_json(&json!({ "command": "sweep", "out": args.out, "table": table }));
    }
    output::print(&table.csv())
}

fn tell_results(args: &SweepArgs, table: &Table, mode: OutputMode) -> Result<()> {
    let (path, best) = (args.out.join(RESULTS), table.best());
    if mode.json {
        return output::print_json(&json!({
            "command": "sweep",
            "out": args.out,
            "results": path,
            "units": table.rows.len(),
            "finished": table.finished(),
            "best": best,
            "table": table,
        }));
    }
    output::print(&with_flags(&table.text(SHOWN)))?;
    let (done, all) = (table.finished(), table.rows.len());
    tell!("{done} of {all} units are done; table: {}", path.display());
    if let Some(best) = best {
        tell!("best: {}", args.out.join(&best.unit).display());
    }
    Ok(())
}
