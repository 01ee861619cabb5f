//! `lagrangian excite`: a motion from which a robot can be identified.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::Result;
use lagrangian::rigid::{
    Excitation, ExcitationConfig, JointLimits, RigidBodies, SearchProgress, excite, excite_joints,
};
use lagrangian::trajectory::{Coordinate, Topology};
use lagrangian::{Coordinates, Model};
use lagrangian_report::draw::short;
use lagrangian_report::{Figure, Motion, Report, Role, phase_portrait, trajectories};
use serde_json::json;

use super::OutputMode;
use crate::excite_args::{ExciteArgs, LimitArgs};
use crate::failure::{Context, SUCCESS, mistake};
use crate::interrupt;
use crate::output::Motions;
use crate::parts;
use crate::progress::Progress;
use crate::robot;
use crate::text;

/// The largest number of joints of a plan without a robot.
const MOST_JOINTS: usize = 64;

pub(super) fn run(args: &ExciteArgs, mode: OutputMode) -> Result<u8> {
    let robots: Vec<_> = args.urdf.iter().cloned().collect();
    args.output.check_motions(&robots)?;
    let files = Files::of(args)?;
    let layout = files.validate.with_extension("toml");
    lagrangian_run::refuse_overwriting([&files.validate, &layout], &robots)?;
    let subject = Subject::read(args)?;
    let config = args.config();
    let mut bar = Progress::start("excite", mode.quiet);
    interrupt::listen()?;
    let start = Instant::now();
    let found = subject.search(&config, &mut |progress| {
        let part = start.elapsed().as_secs_f64() / args.seconds;
        bar.update(part, &news(progress));
        match part >= 1.0 || interrupt::is_pressed() {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        }
    })?;
    bar.finish(&format!(
        "{} motions, information × {:.1}",
        found.tried, found.gain
    ));
    let other = ExcitationConfig {
        seed: config.seed ^ 1,
        ..config
    };
    let validation = subject.search(&other, &mut |progress| match progress.tried < other.starts
        && !interrupt::is_pressed()
    {
        true => ControlFlow::Continue(()),
        false => ControlFlow::Break(()),
    })?;
    let existing = args.output.file.existing();
    for (path, found) in [(&files.plan, &found), (&files.validate, &validation)] {
        let plan = std::slice::from_ref(&found.plan);
        Motions::new(plan, &subject.coordinates).write(path, existing)?;
    }
    let facts = facts(&found, &subject, &files);
    args.output.draw(|| Report {
        figures: drawn(&subject, &found, &validation),
        ..facts.clone()
    })?;
    let figures = json!({
        "command": "excite",
        "out": files.plan,
        "validate": files.validate,
        "samples": found.plan.len(),
        "tried": found.tried,
        "gain": found.gain,
        "combinations": found.combinations,
        "noise": found.noise,
        "limits": subject.limits,
        "expected": found.expected,
        "collisions_checked": false,
    });
    mode.print(&figures, || text::of(&facts))?;
    Ok(SUCCESS)
}

fn news(progress: &SearchProgress) -> String {
    let SearchProgress { tried, gain, .. } = progress;
    format!("{tried} motions · information × {gain:.1}")
}

impl ExciteArgs {
    fn config(&self) -> ExcitationConfig {
        ExcitationConfig {
            duration: self.duration,
            rate: self.rate,
            harmonics: self.harmonics as usize,
            margin: self.limits.margin,
            noise: self.noise,
            seed: self.seed,
            ..ExcitationConfig::default()
        }
    }
}

/// The joints that move.
struct Subject {
    coordinates: Coordinates,
    robot: Option<RigidBodies>,
    limits: Vec<JointLimits>,
}

impl Subject {
    fn read(args: &ExciteArgs) -> Result<Self> {
        let Some(path) = &args.urdf else {
            return Self::of_joints(args);
        };
        let described = robot::open(path, &args.joints)?;
        let shown = format!("cannot use the robot of '{}'", path.display());
        let hint = "`lagrangian excite --help` lists the flags of joints and limits";
        let bodies = RigidBodies::with_joints(&described.text, &args.joints);
        let bodies = bodies.context(&shown, hint)?;
        let limits = JointLimits::of_urdf(&described.text, bodies.joints()).context(shown, hint)?;
        Ok(Self {
            coordinates: Model::coordinates(&bodies).clone(),
            limits: args.limits.before(&limits)?,
            robot: Some(bodies),
        })
    }

    fn of_joints(args: &ExciteArgs) -> Result<Self> {
        let names = names(&args.joints)?;
        let line = |name: &String| Coordinate::new(name, "rad", Topology::Line);
        let unknown = vec![JointLimits::default(); names.len()];
        Ok(Self {
            coordinates: Coordinates(names.iter().map(line).collect()),
            limits: args.limits.before(&unknown)?,
            robot: None,
        })
    }

    fn search(
        &self,
        config: &ExcitationConfig,
        watch: &mut dyn FnMut(&SearchProgress) -> ControlFlow<()>,
    ) -> Result<Excitation> {
        let found = match &self.robot {
            Some(robot) => excite(robot, &self.limits, config, watch),
            None => excite_joints(&self.coordinates, &self.limits, config, watch),
        };
        Ok(found.context(
            "cannot plan a motion",
            "`lagrangian excite --help` lists the flags of limits",
        )?)
    }
}

/// The names of joints without a robot, or of the requested number of joints.
fn names(joints: &[String]) -> Result<Vec<String>> {
    let refuse = |finding: String| {
        Err(mistake(
            finding,
            "give a URDF file, or --joints 6 with --lower, --upper and --velocity",
        ))
    };
    let count = match joints {
        [] => return refuse("there is no robot".into()),
        [one] => one.parse::<usize>().ok(),
        _ => None,
    };
    match count {
        Some(0) => refuse("--joints 0: nothing moves".into()),
        Some(n) if n > MOST_JOINTS => refuse(format!("--joints {n}: {MOST_JOINTS} is the most")),
        Some(n) => Ok((1..=n).map(|k| format!("q{k}")).collect()),
        None if joints
            .iter()
            .any(|own| own.parse().is_ok_and(f64::is_finite)) =>
        {
            refuse(format!(
                "--joints {} is neither a number of joints, 1 to {MOST_JOINTS}, nor their names",
                joints.join(",")
            ))
        }
        None => Ok(joints.to_vec()),
    }
}

impl LimitArgs {
    /// The given limits, or the `known` ones where none are given.
    fn before(&self, known: &[JointLimits]) -> Result<Vec<JointLimits>> {
        let n = known.len();
        let of = |flag: &str, values: &Vec<f64>| -> Result<Vec<Option<f64>>> {
            match values.len() {
                0 => Ok(vec![None; n]),
                1 => Ok(vec![Some(values[0]); n]),
                found if found == n => Ok(values.iter().copied().map(Some).collect()),
                found => Err(mistake(
                    format!("--{flag} has {found} values where {n} joints move"),
                    "give one value for all joints, or one for each",
                )),
            }
        };
        let (lower, upper) = (of("lower", &self.lower)?, of("upper", &self.upper)?);
        let velocity = of("velocity", &self.velocity)?;
        let acceleration = of("acceleration", &self.acceleration)?;
        let effort = of("effort", &self.effort)?;
        let given = |i: usize| JointLimits {
            lower: lower[i],
            upper: upper[i],
            velocity: velocity[i],
            acceleration: acceleration[i],
            effort: effort[i],
        };
        let known = known.iter().enumerate();
        Ok(known.map(|(i, known)| given(i).or(*known)).collect())
    }
}

/// The files of both plans.
struct Files {
    plan: PathBuf,
    validate: PathBuf,
}

impl Files {
    fn of(args: &ExciteArgs) -> Result<Self> {
        let plan = args.output.file.out.clone().unwrap_or_default();
        let validate = beside(&plan);
        let layouts = [&plan, &validate].map(|path| path.with_extension("toml"));
        for path in layouts.iter().chain([&validate]) {
            lagrangian_run::refuse_existing(path, args.output.file.existing())?;
        }
        Ok(Self { plan, validate })
    }
}

/// `plan-validate.csv` beside `plan.csv`.
fn beside(plan: &Path) -> PathBuf {
    let part =
        |part: Option<&std::ffi::OsStr>| part.unwrap_or_default().to_string_lossy().into_owned();
    let (stem, extension) = (part(plan.file_stem()), part(plan.extension()));
    plan.with_file_name(format!("{stem}-validate.{extension}"))
}

fn drawn(subject: &Subject, found: &Excitation, validation: &Excitation) -> Vec<Figure> {
    let motions = [
        Motion::new("plan", Role::Truth, &found.plan),
        Motion::new("to validate on", Role::Other(0), &validation.plan),
    ];
    let figures = (0..subject.coordinates.dof()).flat_map(|i| {
        // Both files are plans: there is no prediction to compare them with.
        let over_time = Figure {
            caption: "The plan, and the second motion to validate on what was identified.".into(),
            ..trajectories(&subject.coordinates, i, &motions)
        };
        let portrait = Figure {
            caption: "Velocity over position along the plan: the states that it visits.".into(),
            ..phase_portrait(&subject.coordinates, i, &motions[..1])
        };
        [over_time, portrait]
    });
    figures.collect()
}

/// The expected errors of what can be identified from the plan, and the warning about collisions.
fn facts(found: &Excitation, subject: &Subject, files: &Files) -> Report {
    let expected = found.expected.iter();
    let parts = expected.flat_map(|e| e.links.iter().chain(&e.joints));
    let units = subject.coordinates.0.iter();
    let units = units.map(|c| if c.unit == "m" { "N" } else { "N·m" });
    let noise = found.noise.iter().zip(units);
    let noise: Vec<String> = noise
        .map(|(x, unit)| format!("{} {unit}", short(*x)))
        .collect();
    let expected = (!noise.is_empty()).then(|| {
        format!(
            "{} combinations of parameters can be found. The expected standard errors are for noise of the torques of {}, independent \
             from sample to sample, beside bodies that are known to a factor of two.",
            found.combinations,
            noise.join(", ")
        )
    });
    let written = format!(
        "{} and {}: {} samples each; collisions are NOT checked: simulate the plan, and run it slowly first",
        files.plan.display(),
        files.validate.display(),
        found.plan.len()
    );
    Report {
        title: "A motion for identification".into(),
        subtitle: "collisions are not checked".into(),
        summary: expected.into_iter().chain([written]).collect(),
        tables: parts.map(|part| parts::table(part, false)).collect(),
        ..Report::default()
    }
}
