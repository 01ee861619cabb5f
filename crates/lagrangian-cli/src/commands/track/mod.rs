//! `lagrangian track`: a robot follows a motion through a saved model, with a verdict on the model for this task.

mod page;
mod truth;

use std::time::Instant;

use anyhow::Result;
use lagrangian::{Model, Trajectory};
use lagrangian_control::{
    ControlLaw, Driven, Followed, Gains, LoopConfig, LoopOutcome, Reference, Sensors, follow,
    inertia_along, largest_torques,
};
use lagrangian_report::Report;
use serde_json::json;

use super::OutputMode;
use crate::cli::DataArgs;
use crate::data;
use crate::failure::{self, Context, FAILED, SUCCESS, mistake};
use crate::fitted::{self, Fitted};
use crate::out_args::PlotArgs;
use crate::output::Motions;
use crate::task::{Size, Task};
use crate::text;
use crate::track_args::{ControlArgs, ControllerName, TrackArgs};

pub(super) fn run(args: &TrackArgs, mode: OutputMode) -> Result<u8> {
    let PlotArgs { file, plot } = &args.output;
    let robots = args.truth.robot.iter().cloned();
    let inputs = [args.model.clone(), args.reference.clone()];
    let inputs: Vec<_> = inputs.into_iter().chain(robots).collect();
    args.output.check_motions(&inputs)?;
    if let Some(path) = &file.out {
        lagrangian_run::refuse_existing(&path.with_extension("toml"), file.existing())?;
    }
    let task = Task::start("track", mode.quiet, Size::of_files(&inputs))?;
    let fitted = fitted::fitted(&args.model)?;
    let reference = reference(args, &fitted)?;
    let model = fitted.model;
    let plant = truth::read(&args.truth, &model, reference.samples())?;
    let truth = plant.model.as_deref();
    let robot: &dyn Model = truth.unwrap_or(&model);
    let control = loop_config(&args.control, reference.dof(), plant.limits.clone())?;
    let gains = all_gains(&args.control, robot, &reference)?;
    if truth.is_none() {
        note!("note: the model itself is the robot, and right about it; --robot names another");
    }
    let laws = laws(&model, truth, args.control.controller, &gains);
    let at_speed = |&speed: &f64| runs(args, robot, &reference, speed, &laws, &control);
    let factors = args.control.speeds.iter();
    let speeds: Vec<AtSpeed> = factors.map(at_speed).collect::<Result<_>>()?;
    drop(task);
    let runs = speeds.first().map_or(&[][..], |first| &first.runs[..]);
    let reference = speeds.first().map_or(&reference, |first| &first.reference);
    if let (Some(path), Some(first)) = (&file.out, runs.first()) {
        let motion = std::slice::from_ref(&first.followed.driven.trajectory);
        Motions::new(motion, model.coordinates()).write(path, file.existing())?;
    }
    let report = page::TrackingReport {
        plant: truth::shown(&args.truth),
        coordinates: model.coordinates(),
        reference,
        rate: control.rate,
        runs,
        speeds: &speeds,
    };
    let facts = report.facts();
    args.output.draw(|| Report {
        figures: report.figures(),
        ..facts.clone()
    })?;
    let figures = json!({
        "command": "track",
        "answer": facts.answer,
        "model": args.model,
        "reference": args.reference,
        "robot": args.truth.robot,
        "plant_source": args.truth.plant,
        "plant": report.plant,
        "payload": args.truth.payload,
        "control": args.control,
        "gains": gains.own,
        "feedback_gains": gains.forces,
        "coordinates": model.coordinates(),
        "out": file.out,
        "plot": plot,
        "tracking": tracking(runs),
        "speeds": speeds.iter().map(AtSpeed::as_json).collect::<Vec<_>>(),
        "judgements": report.judgements(),
    });
    mode.print(&figures, || text::of(&facts))?;
    Ok(ended(speeds.iter().find_map(|at| at.lost(robot))))
}

/// The exit code; the reason why the robot was lost, where it was.
fn ended(lost: Option<String>) -> u8 {
    let Some(lost) = lost else { return SUCCESS };
    let remedy = "see what `lagrangian check` says of the reference, pass it through a --low-pass, lower the gains, or raise --rate";
    note!("{}", failure::describe(&mistake(lost, remedy)));
    FAILED
}

/// The motions along a reference at one speed.
struct AtSpeed {
    speed: f64,
    reference: Reference,
    /// The selected controller first.
    runs: Vec<Run>,
}

impl AtSpeed {
    fn as_json(&self) -> serde_json::Value {
        json!({"speed": self.speed, "tracking": tracking(&self.runs)})
    }

    /// The reason why the robot did not follow the motion at all with the first controller.
    fn lost(&self, robot: &dyn Model) -> Option<String> {
        let needed = largest_torques(robot, &self.reference);
        let lost = self.runs.first()?.lost(&needed)?;
        Some(format!("{lost}{}", beside_speed(self.speed)))
    }
}

/// The words for a speed other than that of the reference.
fn beside_speed(speed: f64) -> String {
    match speed {
        1.0 => String::new(),
        _ => format!(", at {speed} times the speed of the reference"),
    }
}

/// The motions along the reference by these controllers, at this speed.
fn runs(
    args: &TrackArgs,
    robot: &dyn Model,
    reference: &Reference,
    speed: f64,
    laws: &[(&'static str, &'static str, ControlLaw)],
    control: &LoopConfig,
) -> Result<AtSpeed> {
    let reference = reference.faster(speed).map_err(failure::of_data)?;
    let run = |&(key, name, law): &(&'static str, &'static str, ControlLaw)| {
        let clock = Instant::now();
        let followed = follow(robot, &reference, law, control).context(
            format!(
                "cannot follow '{}'{}",
                args.reference.display(),
                beside_speed(speed)
            ),
            "`lagrangian track --help` says what --robot, --rate, --delay and the gains may be",
        )?;
        let simulated = followed.driven.trajectory.len() as f64 / control.rate;
        let run = Run {
            key,
            name,
            followed,
            real_time: simulated / clock.elapsed().as_secs_f64(),
        };
        run.warn();
        Ok(run)
    };
    let runs = laws.iter().map(run).collect::<Result<_>>()?;
    Ok(AtSpeed {
        speed,
        reference,
        runs,
    })
}

fn tracking(runs: &[Run]) -> serde_json::Map<String, serde_json::Value> {
    let entry = |run: &Run| (run.key.to_string(), run.as_json());
    runs.iter().map(entry).collect()
}

fn reference(args: &TrackArgs, fitted: &Fitted) -> Result<Reference> {
    let files = std::slice::from_ref(&args.reference);
    let columns = DataArgs {
        file: args.columns.clone(),
        ..DataArgs::default()
    };
    let recordings = data::read(files, &fitted.completed(&columns)?)?;
    fitted::require_dof(&recordings, fitted.model.coordinates())?;
    let others = recordings.len() - 1;
    if others > 0 {
        note!("note: the first trajectory is followed; {others} others are omitted");
    }
    let first = recordings.into_iter().take(1).collect();
    let (trajectories, _) = data::trajectories(first, &fitted.estimates(&args.estimate))?;
    let unusable = || {
        mistake(
            "there is no motion in the reference",
            "give a file with at least two rows",
        )
    };
    let trajectory = trajectories.into_iter().next().ok_or_else(unusable)?;
    Ok(Reference::new(without_gaps(trajectory)).context(
        format!("cannot follow '{}'", args.reference.display()),
        "`lagrangian check` shows what is wrong with the data",
    )?)
}

/// The longest piece of a reference that has gaps: its motion across them is unknown.
fn without_gaps(trajectory: Trajectory) -> Trajectory {
    let piece = lagrangian::trajectory::longest_piece(&trajectory.t);
    if piece.len() == trajectory.len() {
        return trajectory;
    }
    let part = trajectory.part(piece);
    let (from, to) = (
        part.t.first().unwrap_or(&0.0),
        part.t.last().unwrap_or(&0.0),
    );
    note!(
        "note: the reference has gaps in time, across which it is not followed: its longest piece without one, from {from} s to {to} s, is"
    );
    part
}

/// The loop of the flags; the torque limits are those of the drives where none are given.
fn loop_config(args: &ControlArgs, n: usize, of_drives: Vec<f64>) -> Result<LoopConfig> {
    let (position_noise, velocity_noise) = match args.noise[..] {
        [] => (0.0, 0.0),
        [q] => (q, 0.0),
        [q, v] => (q, v),
        _ => {
            return Err(mistake(
                format!("--noise has {} values", args.noise.len()),
                "give the deviation of positions, and after a comma that of velocities: --noise 1e-5,2e-3",
            ));
        }
    };
    let config = LoopConfig {
        rate: args.rate,
        limit: match args.limit[..] {
            [] => of_drives,
            [one] => vec![one; n],
            _ => args.limit.clone(),
        },
        actuation_delay: args.delay,
        seed: args.seed,
        sensors: Sensors {
            position_noise,
            velocity_noise,
            quantisation: args.quantisation,
            ..Sensors::default()
        },
        ..LoopConfig::default()
    };
    config.validate(n).context(
        "cannot run this loop",
        "see --rate, --limit, --noise, --quantisation and --delay",
    )?;
    Ok(config)
}

/// The gains of the selected controller, and the equivalent forces for feedback alone.
struct AllGains {
    own: Gains,
    forces: Gains,
}

fn all_gains(args: &ControlArgs, robot: &dyn Model, reference: &Reference) -> Result<AllGains> {
    let linear = args.controller == ControllerName::ComputedTorque;
    let inertia = inertia_along(robot, reference).context(
        "cannot control this robot",
        "give the robot that moves as --robot, or a model with inverse dynamics",
    )?;
    let unit = vec![1.0; reference.dof()];
    let usual = Gains::usual(if linear { &unit } else { &inertia });
    let own = usual.replaced(&args.kp, &args.kd).context(
        "cannot use these gains",
        "give --kp and --kd, each one value or one for each joint",
    )?;
    let forces = if linear {
        own.of_inertia(&inertia)
    } else {
        own.clone()
    };
    Ok(AllGains { own, forces })
}

/// The controllers that follow the reference, the selected one first: a key, a name, and the controller.
fn laws<'a>(
    model: &'a dyn Model,
    truth: Option<&'a dyn Model>,
    controller: ControllerName,
    gains: &'a AllGains,
) -> Vec<(&'static str, &'static str, ControlLaw<'a>)> {
    let through = |model| match controller {
        ControllerName::ComputedTorque => ControlLaw::ComputedTorque(model, &gains.own),
        _ => ControlLaw::FeedForward(model, &gains.forces),
    };
    let mut all = Vec::new();
    if controller != ControllerName::Pd {
        all.push(("model", "this model", through(model)));
    }
    all.push((
        "feedback",
        "feedback alone",
        ControlLaw::Feedback(&gains.forces),
    ));
    all.extend(truth.map(|truth| ("perfect", "the true model", through(truth))));
    all
}

/// One motion along the reference.
struct Run {
    key: &'static str,
    name: &'static str,
    followed: Followed,
    /// Seconds of motion that were simulated in a second.
    real_time: f64,
}

/// A drive cannot give more than this multiple of the largest torque that a motion needs.
const BEYOND: f64 = 20.0;

impl Run {
    /// The reason why a robot that needs these torques did not follow the motion at all.
    fn lost(&self, needed: &[f64]) -> Option<String> {
        let Driven {
            trajectory,
            outcome,
            ..
        } = &self.followed.driven;
        let largest = |torques: &[f64]| torques.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
        let (asked, needed) = (largest(&trajectory.tau), largest(needed));
        let name = self.name;
        match outcome {
            LoopOutcome::Diverged { t } => {
                Some(format!("with {name} the robot diverged after {t} s"))
            }
            LoopOutcome::Finished if asked > BEYOND * needed => Some(format!(
                "with {name} the drives would give up to {asked:.3e} N·m (N), where the motion needs {needed:.3e}"
            )),
            LoopOutcome::Finished => None,
        }
    }

    /// Reports failures and limits.
    fn warn(&self) {
        let driven = &self.followed.driven;
        if let LoopOutcome::Diverged { t } = driven.outcome {
            let name = self.name;
            note!(
                "note: with {name} the robot diverged after {t} s; lower the gains, or raise --rate"
            );
        }
        let lost = self.followed.without_model + driven.not_finite;
        if lost > 0 {
            let name = self.name;
            note!("note: with {name}, {lost} torques were not finite and are omitted");
        }
    }

    /// The root mean square of the error over all joints; infinite for a robot that was lost.
    fn overall(&self) -> f64 {
        let rmse = &self.followed.following.rmse;
        match self.followed.driven.outcome {
            LoopOutcome::Diverged { .. } => f64::INFINITY,
            LoopOutcome::Finished => {
                (lagrangian::mechanics::dot(rmse, rmse) / rmse.len() as f64).sqrt()
            }
        }
    }

    fn as_json(&self) -> serde_json::Value {
        let driven = &self.followed.driven;
        json!({
            "rmse": self.followed.following.rmse,
            "largest": self.followed.following.largest,
            "at_limit": self.followed.following.at_limit,
            "latency": driven.latency.quantiles(),
            "real_time": self.real_time,
            "ending": driven.outcome,
            "without_model": self.followed.without_model,
            "not_finite": driven.not_finite,
        })
    }
}
