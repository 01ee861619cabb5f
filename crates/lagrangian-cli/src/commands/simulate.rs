//! `lagrangian simulate`: trajectories of a system whose Lagrangian is known.

use anyhow::{Result, bail};
use lagrangian::analytic::{AnalyticModel, Parameter, by_name, systems};
use lagrangian::mechanics::Outcome;
use lagrangian::rigid::{RigidBodies, RobotConfig};
use lagrangian::rollout::Simulation;
use lagrangian::text::counted;
use lagrangian::trajectory::Simulated;
use lagrangian::{Layout, Rollout, Trajectory};
use serde::Serialize;
use serde_json::json;

use super::OutputMode;
use crate::cli::{SimulateArgs, Starts, SystemArgs};
use crate::failure::{Context, SUCCESS, mistake};
use crate::motion::note_early_end;
use crate::output::{self, Motions};
use crate::robot;
use crate::task::{Size, Task};

pub(super) fn run(args: &SimulateArgs, mode: OutputMode) -> Result<u8> {
    if args.system.name.as_deref() == Some("list") {
        return list(mode);
    }
    args.motion.refuse_idle()?;
    let robots: Vec<_> = args.system.urdf.iter().cloned().collect();
    args.output.check_motions(&robots)?;
    let samples = f64::from(args.trajectories) * args.motion.duration / args.motion.step;
    let size = Size::of_files(&robots).with_samples(samples);
    let task = Task::start("simulate", mode.quiet, size)?;
    let moved = system(&args.system)?;
    let system = &*moved.model;
    let simulation = simulation(args)?;
    let hint = match args.motion.q0.is_empty() {
        true => "give a shorter --duration, a longer --step, or fewer --trajectories",
        false => "give --q0 and --qd0 one value per coordinate, or neither for a random start",
    };
    let run = simulation.run(system, &args.motion.options());
    let mut rollouts = run.context("cannot simulate", hint)?;
    drop(task);
    omit_stopped(&mut rollouts)?;
    let summaries = rollouts.iter().map(|rollout| Summary::of(rollout, system));
    let summaries: Vec<Summary> = summaries.collect();
    for (k, rollout) in (1..).zip(&rollouts) {
        note_early_end(&format!("trajectory {k}"), rollout.outcome);
    }
    let trajectories = simulation.recorded(system, rollouts);
    let motions = Motions::declared(&trajectories, declared(args, &moved));
    let (out, layout) = (&args.output.out, args.output.write_motions(mode, &motions)?);
    if mode.json {
        output::print_json(&json!({
            "command": "simulate",
            "system": system.name(),
            "parameters": parameters(&args.system),
            "coordinates": system.coordinates(),
            "seed": args.seed.unwrap_or(0),
            "drive": args.recorded.drive,
            "friction": args.recorded.friction,
            "motion": args.motion,
            "momenta": args.recorded.momenta,
            "noise": args.recorded.noise,
            "out": out,
            "layout": layout,
            "trajectories": summaries,
        }))?;
    } else if let (Some(path), Some(layout)) = (out, layout) {
        let samples: usize = trajectories.iter().map(Trajectory::len).sum();
        let (count, name) = (counted(trajectories.len(), "trajectory"), system.name());
        let (path, layout) = (path.display(), layout.display());
        note!("{count} of '{name}', {samples} samples: {path} (columns and angles: {layout})");
    }
    Ok(SUCCESS)
}

/// The declarations of the file beside the motions: columns, angles, and the system that made them, for a comparison with learned models.
fn declared(args: &SimulateArgs, System { model, robot }: &System) -> Layout {
    let described = robot
        .as_ref()
        .map(|own| (own.urdf.clone(), own.joints.clone()));
    let (urdf, joints) = described.unzip();
    let made_by = Simulated {
        name: model.name().into(),
        friction: args.recorded.friction,
        parameters: args.system.parameters.iter().cloned().collect(),
        urdf,
        joints: joints.unwrap_or_default(),
    };
    Layout {
        system: Some(made_by),
        ..Layout::written(model.coordinates())
    }
}

/// The simulation of the flags.
fn simulation(args: &SimulateArgs) -> Result<Simulation> {
    let (given, own) = (!args.motion.q0.is_empty(), &args.recorded);
    if given && args.trajectories > 1 {
        return Err(mistake(
            "--q0 gives one initial state, --trajectories several",
            "omit one of the two: several trajectories begin at random states",
        ));
    }
    if given && own.drive.is_none() && own.noise.is_none() && args.seed.is_some() {
        return Err(mistake(
            "--seed changes nothing: the initial state is given, and there is neither noise nor drive",
            "omit it, or omit --q0 and --qd0 for a random start",
        ));
    }
    Ok(Simulation {
        starts: given.then(|| args.motion.start()).into_iter().collect(),
        test_starts: args.starts == Starts::Test,
        trajectories: args.trajectories as usize,
        duration: args.motion.duration,
        step: args.motion.step,
        drive: own.drive.unwrap_or(0.0),
        friction: own.friction,
        momenta: own.momenta,
        noise: own.noise,
        seed: args.seed.unwrap_or(0),
    })
}

/// Omits stopped motions that had hardly begun.
fn omit_stopped(rollouts: &mut Vec<Rollout>) -> Result<()> {
    let all = rollouts.len();
    rollouts.retain(|r| !r.outcome.is_stopped() || r.trajectory.len() > 1);
    let omitted = all - rollouts.len();
    if rollouts.is_empty() && omitted > 0 {
        bail!("stopped before any motion had begun: nothing was written");
    }
    if omitted > 0 {
        note!("note: {omitted} of {all} trajectories had not begun and are omitted");
    }
    Ok(())
}

/// The system that moves, and its description where it is a robot.
struct System {
    model: Box<dyn AnalyticModel>,
    robot: Option<RobotConfig>,
}

fn system(args: &SystemArgs) -> Result<System> {
    if let Some(path) = &args.urdf {
        let robot = robot::read(path, &args.joints)?;
        let bodies = RigidBodies::with_joints(&robot.urdf, &robot.joints).context(
            format!("cannot simulate the robot of '{}'", path.display()),
            "--joints chooses the joints that move; the others are locked at 0",
        )?;
        return Ok(System {
            robot: Some(bodies.config()),
            model: Box::new(robot::with_friction(bodies)?),
        });
    }
    let given = args.parameters.iter().map(|(name, x)| (name.as_str(), *x));
    let name = args.name.as_deref().unwrap_or_default();
    let model = by_name(name, &given.collect::<Vec<_>>()).context(
        "cannot simulate",
        "`lagrangian simulate list` names the systems and their parameters",
    )?;
    Ok(System { model, robot: None })
}

/// The values of all parameters, also of those with default values.
fn parameters(args: &SystemArgs) -> serde_json::Map<String, serde_json::Value> {
    let mut known = systems().iter();
    let own = known.find(|entry| Some(entry.name) == args.name.as_deref());
    let table = own.map_or(&[][..], |entry| entry.parameters);
    let defaults = table.iter().map(|p| (p.name.to_string(), json!(p.value)));
    let given = args.parameters.iter();
    let given = given.map(|(name, x)| (name.clone(), json!(x)));
    defaults.chain(given).collect()
}

/// The outcome of one trajectory.
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
        let energy = lagrangian_run::energies(system, &rollout.trajectory).unwrap_or_default();
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

fn list(mode: OutputMode) -> Result<u8> {
    if mode.json {
        let parameter =
            |p: &Parameter| json!({ "name": p.name, "unit": p.unit, "default": p.value });
        let entry = |e: &lagrangian::analytic::SystemEntry| {
            let parameters: Vec<_> = e.parameters.iter().map(parameter).collect();
            json!({ "name": e.name, "about": e.about, "parameters": parameters })
        };
        let systems: Vec<_> = systems().iter().map(entry).collect();
        output::print_json(&json!({ "command": "simulate", "systems": systems }))?;
        return Ok(SUCCESS);
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
    Ok(SUCCESS)
}
