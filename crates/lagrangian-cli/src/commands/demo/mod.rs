//! `lagrangian demo`: a double pendulum learned by a Lagrangian and by a plain network, and compared.

mod measure;
mod page;

use std::time::Instant;

use anyhow::{Result, bail};
use lagrangian::analytic::{AnalyticModel, by_name};
use lagrangian::dataset::random_states;
use lagrangian::models::{Family, MlpConfig};
use lagrangian::train::{Ending, NaturalConfig};
use lagrangian::{
    Budget, Dataset, Fit, FitConfig, LnnConfig, Loss, Optimizer, Provenance, TrainingTask,
};
use lagrangian_run::{
    Existing, ExistingRun, FIGURES, MODEL, Metric, REPORT, RunFolder, RunRecord, Tensorboard, Watch,
};
use serde_json::json;

use super::OutputMode;
use crate::cli::DemoArgs;
use crate::command_line::command_line;
use crate::failure::{Context, SUCCESS};
use crate::frontend::ProgressDisplay;
use crate::interrupt;
use crate::output::{self, Motions};

use measure::{Measured, Measurements};

/// The system that is learned.
const SYSTEM: &str = "double-pendulum";
/// The energy that counts as 100 %: that of hanging upside down above resting at the height of the pivot, J.
const REFERENCE_ENERGY: f64 = 29.4;
/// The number of states that stop and select the fits.
const VALIDATION: usize = 2000;

/// A model of the demo, fitted.
struct Trained {
    fit: Fit,
    config: FitConfig,
    metrics: Vec<Metric>,
}

pub(super) fn run(args: &DemoArgs, mode: OutputMode) -> Result<u8> {
    let start = Instant::now();
    let folder = RunFolder::open(&args.out, ExistingRun::from_force(args.force))?;
    let record = RunRecord::now(command_line(), args.seed, args, Vec::new())?;
    folder.write_record(&record)?;
    let system = by_name(SYSTEM, &[])?;
    let data = random_states(&*system, args.samples as usize, VALIDATION, args.seed)?;
    interrupt::listen()?;
    let lnn = train(args, "lnn", lagrangian_network(), &data, mode)?;
    let mlp = train(args, "mlp", plain_network(), &data, mode)?;
    let measurements = Measurements::of(args, &*system, &lnn.fit.model, &mlp.fit.model, mode)?;
    write_rollouts(&folder, &*system, &measurements)?;
    let seconds = start.elapsed().as_secs_f64();
    let report = page::report(args, &*system, &data, [&lnn, &mlp], &measurements, seconds)?;
    folder.write(REPORT, lagrangian_report::draw::html(&report).as_bytes())?;
    folder.write(FIGURES, &serde_json::to_vec(&report)?)?;
    let page = folder.file(REPORT);
    if mode.json {
        let figures = json!({
            "command": "demo",
            "out": args.out,
            "report": page,
            "seed": args.seed,
            "samples": args.samples,
            "starts": args.starts,
            "comparable": !page::is_quick(args),
            "seconds": seconds,
            "lnn": figures(&measurements.lnn, &lnn),
            "baseline": figures(&measurements.mlp, &mlp),
            "truth": {
                "energy_error_mean_percent": measurements.truth.energy.mean,
                "valid_time": measurements.restarted,
            },
        });
        output::print_json(&figures)?;
    } else {
        let [lnn, mlp] = [&measurements.lnn, &measurements.mlp].map(|j| j.energy.mean);
        note!(
            "energy error at 100 s, mean of {} starts: {lnn:.5} % (plain network {mlp:.2} %)",
            args.starts
        );
        if page::is_quick(args) {
            note!("note: {}", page::QUICK);
        }
        note!("open {}", page.display());
        note!("your own data: `lagrangian check FILES`, then `lagrangian fit FILES --out run`");
    }
    Ok(SUCCESS)
}

/// The settings of `fit` for a budget of time: many small steps whose damping follows the loss (ADR 0050).
fn lagrangian_network() -> FitConfig {
    FitConfig {
        family: Box::<dyn Family>::from(LnnConfig::default()),
        training: TrainingTask {
            optimizer: Optimizer::Natural(NaturalConfig::following_the_loss()),
            batch: 128,
            ..TrainingTask::default()
        },
    }
}

/// The plain network is better by larger steps with the damping of a schedule: with those of the Lagrangian network its energy error doubles.
fn plain_network() -> FitConfig {
    FitConfig {
        family: Box::<dyn Family>::from(MlpConfig::default()),
        ..FitConfig::default()
    }
}

/// Trains one model for the given time, in a run folder of its own.
fn train(
    args: &DemoArgs,
    name: &str,
    config: FitConfig,
    data: &Dataset,
    mode: OutputMode,
) -> Result<Trained> {
    let folder = RunFolder::open(&args.out.join(name), ExistingRun::from_force(args.force))?;
    let mut config = config;
    config.loss = Loss::ACCELERATION;
    config.budget = Budget::Seconds(args.seconds);
    config.seed = args.seed;
    let record = RunRecord::now(command_line(), args.seed, &config, Vec::new())?;
    folder.write_record(&record)?;
    let metrics = folder.metrics(0, Tensorboard::Written)?;
    let mut shown = ProgressDisplay::start(format!("fit {name}"), mode.quiet);
    let mut watch = Watch::new(&folder, metrics, &mut shown);
    let fit = lagrangian::fit(data, &config, None, &mut watch)
        .context("cannot fit", "give --samples and --seconds more")?;
    watch.finish()?;
    shown.finish(&format!(
        "{} steps, error of the accelerations {:.1e} of their deviation",
        fit.steps,
        fit.best.sqrt()
    ));
    folder.write(
        MODEL,
        &fit.model.save(Provenance::of_seed(args.seed))?.to_bytes()?,
    )?;
    if fit.ending == Ending::Interrupted {
        bail!(
            "interrupted; the best model so far is in '{}'",
            folder.file(MODEL).display()
        );
    }
    Ok(Trained {
        fit,
        config,
        metrics: folder.read_metrics()?,
    })
}

/// Writes the rollouts from which the figures of energy and prediction are computed.
fn write_rollouts(
    folder: &RunFolder,
    system: &dyn AnalyticModel,
    measurements: &Measurements,
) -> Result<()> {
    let files = [
        ("truth.npz", &measurements.truth),
        ("lnn.npz", &measurements.lnn),
        ("mlp.npz", &measurements.mlp),
    ];
    for (name, measured) in files {
        let rollouts = measured.rollouts.iter();
        let motions: Vec<_> = rollouts.map(|r| r.trajectory.clone()).collect();
        let motions = Motions::new(&motions, system.coordinates());
        motions.write(&folder.file(name), Existing::Replace)?;
    }
    Ok(())
}

fn figures(measured: &Measured, trained: &Trained) -> serde_json::Value {
    json!({
        "energy_error_mean_percent": measured.energy.mean,
        "energy_error_median_percent": measured.energy.median,
        "energy_error_worst_percent": measured.energy.worst,
        "unfinished": measured.energy.unfinished,
        "valid_time": measured.valid,
        "acceleration_loss": trained.fit.best,
        "train_seconds": trained.fit.seconds,
        "steps": trained.fit.steps,
    })
}
