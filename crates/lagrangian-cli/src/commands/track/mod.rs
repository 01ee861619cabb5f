//! `lagrangian track`: a robot follows a motion through a saved model, with a verdict on the model for this task.

mod page;
mod run;
mod source;
mod truth;

use std::time::Instant;

use anyhow::Result;
use lagrangian::{Coordinates, Learned, Model, Trajectory};
use lagrangian_control::{
    ControlLaw, Gains, LoopConfig, Reference, RobotChange, Sensors, follow, inertia_along,
    largest_torques,
};
use lagrangian_report::Report;
use serde_json::json;

use self::run::{PARTS, Run};
use self::source::Source;
use super::OutputMode;
use crate::cli::DataArgs;
use crate::data;
use crate::failure::{self, Context, FAILED, SUCCESS, mistake};
use crate::fitted::{self, Fitted};
use crate::output::Motions;
use crate::plants::OpenedPlant;
use crate::task::{Size, Task};
use crate::text;
use crate::track_args::{ControlArgs, ControllerName, TrackArgs};

pub(super) fn run(args: &TrackArgs, mode: OutputMode) -> Result<u8> {
    let file = &args.output.file;
    let robots = args.truth.robot.iter().chain(&args.learning.urdf);
    let given = args.model.iter().chain([&args.reference]);
    let inputs: Vec<_> = given.chain(robots).cloned().collect();
    args.output.check_motions(&inputs)?;
    if let Some(path) = &file.out {
        lagrangian_run::refuse_existing(&path.with_extension("toml"), file.existing())?;
    }
    let source = Source::of(args)?;
    let task = Task::start("track", mode.quiet, Size::of_files(&inputs))?;
    let saved = source.saved();
    let desired = desired(args, saved)?;
    let model = saved.map(|fitted| &fitted.model);
    let machine = Machine::open(args, model, &desired)?;
    let own = model.map(|model| model as &dyn Model);
    let whole = machine.loaded.model.as_deref().or(own).ok_or_else(|| {
        let finding = "there is no robot from whose motion a model could learn";
        mistake(finding, truth::REMEDY)
    })?;
    let coordinates = model.map_or(whole.coordinates(), Model::coordinates);
    source.check(coordinates)?;
    let truth = machine.loaded.model.as_deref();
    let robot = machine.robot(whole, args.truth.payload_at);
    let control = loop_config(
        &args.control,
        coordinates.dof(),
        machine.loaded.limits.clone(),
    )?;
    let gains = all_gains(&args.control, whole, &desired.motion)?;
    if truth.is_none() {
        note!("note: the model itself is the robot, and right about it; --robot names another");
    }
    let laws = laws(&source, whole, truth, args.control.controller, &gains);
    let at_speed = |&speed: &f64| runs(args, &robot, &desired.motion, speed, &laws, &control);
    let factors = args.control.speeds.iter();
    let speeds: Vec<AtSpeed> = factors.map(at_speed).collect::<Result<_>>()?;
    drop(task);
    let runs = speeds.first().map_or(&[][..], |first| &first.runs[..]);
    let reference = speeds
        .first()
        .map_or(&desired.motion, |first| &first.reference);
    if let (Some(path), Some(first)) = (&file.out, runs.first()) {
        let motion = std::slice::from_ref(&first.followed.driven.trajectory);
        Motions::new(motion, coordinates).write(path, file.existing())?;
    }
    let report = page::TrackingReport {
        plant: truth::shown(&args.truth),
        coordinates,
        reference,
        rate: control.rate,
        runs,
        speeds: &speeds,
    };
    print((args, model), &report, &gains, mode)?;
    Ok(ended(speeds.iter().find_map(|at| at.lost(whole))))
}

/// Draws and prints the results.
fn print(
    (args, model): (&TrackArgs, Option<&Learned>),
    report: &page::TrackingReport,
    gains: &AllGains,
    mode: OutputMode,
) -> Result<()> {
    let facts = report.facts();
    args.output.draw(|| {
        let robot = truth::kinematics(args, model, report.coordinates);
        let film = robot.and_then(|robot| report.film(&robot));
        Report {
            figures: report.figures(),
            animations: film.into_iter().collect(),
            ..facts.clone()
        }
    })?;
    let figures = json!({
        "command": "track",
        "answer": facts.answer,
        "model": args.model,
        "online": args.learning.online,
        "reference": args.reference,
        "robot": args.truth.robot,
        "plant_source": args.truth.plant,
        "plant": report.plant,
        "payload": args.truth.payload,
        "payload_at": args.truth.payload_at,
        "control": args.control,
        "gains": gains.own,
        "feedback_gains": gains.forces,
        "coordinates": report.coordinates,
        "out": args.output.file.out,
        "plot": args.output.plot,
        "tracking": tracking(report.runs),
        "speeds": report.speeds.iter().map(AtSpeed::as_json).collect::<Vec<_>>(),
        "judgements": report.judgements(),
    });
    mode.print(&figures, || text::of(&facts))
}

/// The motion to follow, and its coordinates.
struct Desired {
    motion: Reference,
    coordinates: Coordinates,
}

/// The robot of the flags, with its payload, and without it where it takes it on the way.
struct Machine {
    loaded: OpenedPlant,
    unloaded: Option<Box<dyn Model>>,
}

impl Machine {
    fn open(args: &TrackArgs, model: Option<&Learned>, desired: &Desired) -> Result<Self> {
        let opened = |payload| truth::read(&args.truth, model, desired, payload);
        Ok(Self {
            loaded: opened(args.truth.payload)?,
            unloaded: match args.truth.payload_at {
                0.0 => None,
                _ => opened(None)?.model,
            },
        })
    }

    /// The robot that moves, and becomes this one.
    fn robot<'a>(&'a self, loaded: &'a dyn Model, at: f64) -> Robot<'a> {
        let change = RobotChange { at, robot: loaded };
        Robot {
            first: self.unloaded.as_deref().unwrap_or(loaded),
            change: self.unloaded.is_some().then_some(change),
            loaded,
        }
    }
}

/// The robot that moves, and what it becomes.
struct Robot<'a> {
    first: &'a dyn Model,
    change: Option<RobotChange<'a>>,
    /// The robot after the change, or where there is none the same.
    loaded: &'a dyn Model,
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
    robot: &Robot,
    reference: &Reference,
    speed: f64,
    laws: &[(&'static str, &'static str, ControlLaw)],
    control: &LoopConfig,
) -> Result<AtSpeed> {
    let reference = reference.faster(speed).map_err(failure::of_data)?;
    let seconds = reference.end() - reference.start();
    if robot.change.is_some_and(|change| change.at >= seconds) {
        note!("note: the motion ends after {seconds} s, before the robot takes its payload");
    }
    let learned = args.learning.online.is_some();
    let run = |&(key, name, law): &(&'static str, &'static str, ControlLaw)| {
        let clock = Instant::now();
        // The true model has the payload from the start: what a model can reach once the robot has it.
        let (first, change) = match key {
            "perfect" => (robot.loaded, None),
            _ => (robot.first, robot.change),
        };
        let followed = follow(first, change, &reference, law, control).context(
            format!(
                "cannot follow '{}'{}",
                args.reference.display(),
                beside_speed(speed)
            ),
            "`lagrangian track --help` says what --robot, --rate, --delay and the gains may be",
        )?;
        let simulated = followed.driven.trajectory.len() as f64 / control.rate;
        let judged = match learned {
            true => followed.part(PARTS - 1, PARTS, &control.limit),
            false => followed.following.clone(),
        };
        let run = Run {
            key,
            name,
            judged,
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

fn desired(args: &TrackArgs, saved: Option<&Fitted>) -> Result<Desired> {
    let files = std::slice::from_ref(&args.reference);
    let columns = DataArgs {
        file: args.columns.clone(),
        ..DataArgs::default()
    };
    let mut columns = saved.map_or(Ok(columns.clone()), |fitted| fitted.completed(&columns))?;
    // A motion to be followed needs no forces.
    if let Some(fitted) = &mut columns.fitted {
        fitted.columns.tau.clear();
        fitted.actuated.clear();
    }
    let recordings = data::read(files, &columns)?;
    let coordinates = match (saved, recordings.first()) {
        (Some(fitted), _) => fitted.model.coordinates().clone(),
        (None, Some(first)) => first.coordinates.clone(),
        (None, None) => Coordinates::lines(0),
    };
    fitted::require_dof(&recordings, &coordinates)?;
    let others = recordings.len() - 1;
    if others > 0 {
        note!("note: the first trajectory is followed; {others} others are omitted");
    }
    let first = recordings.into_iter().take(1).collect();
    let estimates = match saved {
        Some(fitted) => fitted.estimates(&args.estimate),
        None => args.estimate.options(),
    };
    let (trajectories, _) = data::trajectories(first, &estimates)?;
    let unusable = || {
        mistake(
            "there is no motion in the reference",
            "give a file with at least two rows",
        )
    };
    let trajectory = trajectories.into_iter().next().ok_or_else(unusable)?;
    let motion = Reference::new(without_gaps(trajectory)).context(
        format!("cannot follow '{}'", args.reference.display()),
        "`lagrangian check` shows what is wrong with the data",
    )?;
    Ok(Desired {
        motion,
        coordinates,
    })
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
    source: &'a Source,
    robot: &'a dyn Model,
    truth: Option<&'a dyn Model>,
    controller: ControllerName,
    gains: &'a AllGains,
) -> Vec<(&'static str, &'static str, ControlLaw<'a>)> {
    let through = |model: &'a dyn Model| match controller {
        ControllerName::ComputedTorque => ControlLaw::ComputedTorque(model, &gains.own),
        _ => ControlLaw::FeedForward(model, &gains.forces),
    };
    let mut all = Vec::new();
    match source {
        Source::Saved(_) if controller == ControllerName::Pd => {}
        Source::Saved(fitted) => all.push(("model", "this model", through(&fitted.model))),
        Source::Online(online) => {
            let law = ControlLaw::Online(robot.coordinates(), online, &gains.forces);
            all.push(("model", "the learned model", law));
        }
    }
    all.push((
        "feedback",
        "feedback alone",
        ControlLaw::Feedback(&gains.forces),
    ));
    all.extend(truth.map(|truth| ("perfect", "the true model", through(truth))));
    all
}
