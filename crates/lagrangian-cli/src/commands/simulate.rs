//! `lagrangian simulate`: trajectories of a system whose Lagrangian is known.

use std::process::ExitCode;

use anyhow::{Result, bail};
use lagrangian::analytic::{AnalyticModel, Parameter, by_name, systems};
use lagrangian::mechanics::momenta;
use lagrangian::rigid::RigidBodies;
use lagrangian::rollout::{self, rollout_many};
use lagrangian::{Dissipation, Outcome, Rollout, State, Trajectory};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use serde::Serialize;
use serde_json::json;

use super::OutputMode;
use crate::cli::{SimulateArgs, Starts};
use crate::failure::{Advise, mistake};
use crate::motion::{energies, note_early_end};
use crate::output;
use crate::robot;
use crate::task::{Size, Task};

pub(super) fn run(args: &SimulateArgs, mode: OutputMode) -> Result<ExitCode> {
    if args.system.as_deref() == Some("list") {
        return list(mode);
    }
    let robots: Vec<_> = args.urdf.iter().cloned().collect();
    args.output.refuse_inputs_of_motions(&robots)?;
    args.output.refuse_unwritable()?;
    let samples = f64::from(args.trajectories) * args.motion.duration / args.motion.step;
    let size = Size::of_files(&robots).with_samples(samples);
    let task = Task::start("simulate", mode.quiet, size)?;
    let system = system(args)?;
    let mut rollouts = motions(args, &*system)?;
    drop(task);
    omit_stopped(&mut rollouts)?;
    let summaries = rollouts
        .iter()
        .map(|rollout| Summary::of(rollout, &*system));
    let summaries: Vec<Summary> = summaries.collect();
    for (k, rollout) in (1..).zip(&rollouts) {
        note_early_end(&format!("trajectory {k}"), rollout.outcome);
    }
    if args.momenta {
        for rollout in &mut rollouts {
            let motion = &mut rollout.trajectory;
            motion.p = momenta(system.lagrangian(), &motion.q, &motion.qd);
        }
    }
    let trajectories = recorded(rollouts, args);
    let (out, existing) = (&args.output.out, args.output.existing());
    let layout = match out {
        Some(path) => {
            let coordinates = system.coordinates();
            Some(output::write_trajectories(
                path,
                existing,
                &trajectories,
                coordinates,
            )?)
        }
        None if mode.json => None,
        None => {
            output::print_trajectories(&trajectories)?;
            None
        }
    };
    if mode.json {
        output::print_json(&json!({
            "command": "simulate",
            "system": system.name(),
            "parameters": parameters(args),
            "coordinates": system.coordinates(),
            "seed": args.seed,
            "drive": args.drive,
            "friction": args.friction,
            "motion": args.motion,
            "momenta": args.momenta,
            "noise": args.noise,
            "out": out,
            "layout": layout,
            "trajectories": summaries,
        }))?;
    } else if let (Some(path), Some(layout)) = (out, layout) {
        let samples: usize = trajectories.iter().map(Trajectory::len).sum();
        let (count, name) = (trajectories.len(), system.name());
        let (path, layout) = (path.display(), layout.display());
        tell!(
            "{count} trajectories of '{name}', {samples} samples: {path} (columns and angles: {layout})"
        );
    }
    Ok(ExitCode::SUCCESS)
}

/// The motions of the system, with the forces that drove them.
fn motions(args: &SimulateArgs, system: &dyn AnalyticModel) -> Result<Vec<Rollout>> {
    let times = rollout::times(args.motion.duration, args.motion.step).advise(
        "cannot simulate",
        "give a shorter --duration or a longer --step",
    )?;
    refuse_too_many(args.trajectories, times.len())?;
    let starts = starts(args, system)?;
    let n = system.coordinates().dof();
    let drive = rollout::sines(n, args.drive.unwrap_or(0.0), args.seed);
    let friction = Dissipation::viscous(vec![args.friction; n]);
    let force = rollout::with_friction(&drive, &friction);
    let options = args.motion.options();
    let mut rollouts = rollout_many(system, &starts, &times, &force, &options).advise(
        "cannot simulate",
        "give --q0 and --qd0 one value per coordinate, or neither for a random start",
    )?;
    for rollout in &mut rollouts {
        rollout::record_forces(&mut rollout.trajectory, &drive);
    }
    Ok(rollouts)
}

/// Of motions that were stopped, those that had hardly begun are omitted.
fn omit_stopped(rollouts: &mut Vec<Rollout>) -> Result<()> {
    let all = rollouts.len();
    rollouts.retain(|r| !r.outcome.is_stopped() || r.trajectory.len() > 1);
    let omitted = all - rollouts.len();
    if rollouts.is_empty() && omitted > 0 {
        bail!("stopped before any motion had begun: nothing was written");
    }
    if omitted > 0 {
        tell!("note: {omitted} of {all} trajectories had not begun and are omitted");
    }
    Ok(())
}

/// Samples of all trajectories at most: they are held in memory.
const MOST_SAMPLES: u64 = 20_000_000;

fn refuse_too_many(trajectories: u32, samples: usize) -> Result<()> {
    let all = u64::from(trajectories).saturating_mul(samples as u64);
    if all <= MOST_SAMPLES {
        return Ok(());
    }
    Err(mistake(
        format!(
            "{trajectories} trajectories of {samples} samples are more than {MOST_SAMPLES} samples"
        ),
        "give a shorter --duration, a longer --step, or fewer --trajectories with another --seed for each file",
    ))
}

fn system(args: &SimulateArgs) -> Result<Box<dyn AnalyticModel>> {
    if let Some(path) = &args.urdf {
        let robot = robot::read(path, &args.joints)?;
        let bodies = RigidBodies::with_joints(&robot.urdf, &robot.joints).advise(
            format!("cannot simulate the robot of '{}'", path.display()),
            "--joints chooses the joints that move; the others are locked at 0",
        )?;
        return Ok(Box::new(bodies));
    }
    let given = args.parameters.iter().map(|(name, x)| (name.as_str(), *x));
    let name = args.system.as_deref().unwrap_or_default();
    by_name(name, &given.collect::<Vec<_>>()).advise(
        "cannot simulate",
        "`lagrangian simulate list` names the systems and their parameters",
    )
}

/// The values of all parameters, also of those left at their defaults.
fn parameters(args: &SimulateArgs) -> serde_json::Map<String, serde_json::Value> {
    let mut known = systems().iter();
    let own = known.find(|entry| Some(entry.name) == args.system.as_deref());
    let table = own.map_or(&[][..], |entry| entry.parameters);
    let defaults = table.iter().map(|p| (p.name.to_string(), json!(p.value)));
    let given = args
        .parameters
        .iter()
        .map(|(name, x)| (name.clone(), json!(x)));
    defaults.chain(given).collect()
}

fn starts(args: &SimulateArgs, system: &dyn AnalyticModel) -> Result<Vec<State>> {
    if !args.motion.q0.is_empty() {
        if args.trajectories > 1 {
            return Err(mistake(
                "--q0 gives one initial state, --trajectories several",
                "omit one of the two: several trajectories begin at random states",
            ));
        }
        return Ok(vec![args.motion.start()]);
    }
    let mut rng = ChaCha8Rng::seed_from_u64(args.seed);
    let sample = |_| match args.starts {
        Starts::Training => system.sample_state(&mut rng),
        Starts::Test => system.sample_start(&mut rng),
    };
    Ok((0..args.trajectories).map(sample).collect())
}

/// The trajectories as a recording would have them: named, and noisy where that was asked for.
fn recorded(rollouts: Vec<Rollout>, args: &SimulateArgs) -> Vec<Trajectory> {
    let mut rng = ChaCha8Rng::seed_from_u64(args.seed);
    // Another stream than that of the initial states.
    rng.set_stream(1);
    let trajectories = rollouts.into_iter().map(|rollout| rollout.trajectory);
    let mut trajectories: Vec<Trajectory> = trajectories.collect();
    for (k, trajectory) in trajectories.iter_mut().enumerate() {
        trajectory.name = (k + 1).to_string();
        if let Some(sigma) = args.noise {
            trajectory.add_noise(sigma, &mut rng);
        }
    }
    let all_have_qdd = trajectories.iter().all(|t| !t.qdd.is_empty());
    if !all_have_qdd {
        trajectories.iter_mut().for_each(|t| t.qdd = Vec::new());
    }
    trajectories
}

/// What became of one trajectory.
#[derive(Serialize)]
struct Summary {
    samples: usize,
    outcome: Outcome,
    steps: u64,
    rejected: u64,
    evaluations: u64,
    singular: u64,
    /// Energy at the start, J.
    energy_start: f64,
    /// Largest distance of the energy from it, J.
    energy_change_max: f64,
}

impl Summary {
    fn of(rollout: &Rollout, system: &dyn AnalyticModel) -> Self {
        let energy = energies(system, &rollout.trajectory).unwrap_or_default();
        let start = energy.first().copied().unwrap_or_default();
        Self {
            samples: rollout.trajectory.len(),
            outcome: rollout.outcome,
            steps: rollout.steps,
            rejected: rollout.rejected,
            evaluations: rollout.evaluations,
            singular: rollout.singular,
            energy_start: start,
            energy_change_max: energy.iter().map(|e| (e - start).abs()).fold(0.0, f64::max),
        }
    }
}

fn list(mode: OutputMode) -> Result<ExitCode> {
    if mode.json {
        let parameter =
            |p: &Parameter| json!({ "name": p.name, "unit": p.unit, "default": p.value });
        let entry = |e: &lagrangian::analytic::SystemEntry| {
            let parameters: Vec<_> = e.parameters.iter().map(parameter).collect();
            json!({ "name": e.name, "about": e.about, "parameters": parameters })
        };
        let systems: Vec<_> = systems().iter().map(entry).collect();
        output::print_json(&json!({ "command": "simulate", "systems": systems }))?;
        return Ok(ExitCode::SUCCESS);
    }
    let mut text = String::new();
    for entry in systems() {
        text += &format!("{}\n    {}\n", entry.name, entry.about);
        for p in entry.parameters {
            let line = format!("    --set {}={}  {}", p.name, p.value, p.unit);
            text += &format!("{}\n", line.trim_end());
        }
    }
    output::print(&text)?;
    Ok(ExitCode::SUCCESS)
}
