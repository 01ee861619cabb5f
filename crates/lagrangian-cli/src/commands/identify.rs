//! `lagrangian identify`: from logs of a robot to a URDF with its parameters.

use std::path::PathBuf;

use anyhow::Result;
use lagrangian::mechanics::Mechanical;
use lagrangian::rigid::{
    self, Changes, Identification, IdentifyOptions, PartChange, RigidBodies, RobotConfig,
};
use lagrangian::score::SignalError;
use lagrangian::torque::{predict_torque, summarise};
use lagrangian::trajectory::Sampling;
use lagrangian::{
    Coordinates, Dataset, Estimate, EstimateOptions, Model, Recording, Trajectory, prepared, split,
};
use lagrangian_report::draw::short;
use lagrangian_report::{Report, Table};
use serde::Serialize;
use serde_json::json;

use super::{OutputMode, fit};
use crate::data;
use crate::failure::{self, Context, SUCCESS};
use crate::fitted;
use crate::identify_args::IdentifyArgs;
use crate::parts;
use crate::robot::{self, Robot};
use crate::task::{Size, Task};
use crate::text;

/// The part of the data to identify from that chooses the strength of the prior.
const VALIDATION: f64 = 0.2;

pub(super) fn run(args: &IdentifyArgs, mode: OutputMode) -> Result<u8> {
    let existing = lagrangian_run::Existing::from_force(args.force);
    let logs = [&args.files[..], &args.test].concat();
    let mut inputs = args.data.inputs(&logs)?;
    inputs.push(args.urdf.clone());
    lagrangian_run::refuse_overwriting([&args.out], &inputs)?;
    lagrangian_run::refuse_existing(&args.out, existing)?;
    let task = Task::start("identify", mode.quiet, Size::of_files(&inputs))?;
    let robot = robot::open(&args.urdf, &args.joints)?;
    let data = read(args, &robot)?;
    let found = identify(args, &robot, &data)?;
    data::note_estimates(&data.estimates);
    let motion = found.model.motion();
    let text = motion
        .lagrangian
        .edit_urdf(&robot.text, motion.dissipation())
        .context(
            format!("cannot write into '{}'", args.urdf.display()),
            "`lagrangian fit --model rigid` keeps the identified robot as a model instead",
        )?;
    let errors = data.errors(&robot.config, &text, &found)?;
    drop(task);
    lagrangian_run::write_bytes(&args.out, existing, text.as_bytes())?;
    let changes = found.changes();
    let figures = json!({
        "command": "identify",
        "urdf": args.urdf,
        "out": args.out,
        "estimated": data::estimated_signals(&data.estimates),
        "low_pass": data.low_pass,
        "delay": data.delay,
        "samples": { "identified": found.samples, "held_out": data.held_out_samples() },
        "independent_samples": found.independent,
        "parameters": found.model.parameters().len(),
        "combinations": found.combinations,
        "torque": errors,
        "links": changes.links,
        "joints": changes.joints,
        "smoothing": motion.dissipation().map(|d| &d.smoothing),
    });
    mode.print(&figures, || {
        let facts = facts(&found, &changes, &errors, &data);
        text::of(&facts) + &format!("\n{}\n", args.out.display())
    })?;
    Ok(SUCCESS)
}

/// The motions of the logs.
struct Data {
    coordinates: Coordinates,
    dataset: Dataset,
    held_out: Vec<Trajectory>,
    estimates: Vec<Estimate>,
    /// The cut-off of the low-pass, Hz.
    low_pass: Option<f64>,
    /// By how much the forces were shifted, as a drive that holds them asks, s.
    delay: Option<f64>,
}

fn read(args: &IdentifyArgs, robot: &Robot) -> Result<Data> {
    let sampling = args.sample.sampling(args.seed, Sampling::LONGEST);
    let read = |files: &[PathBuf]| -> Result<Vec<Recording>> {
        Ok(data::read_sample(files, &args.data, sampling)?.recordings)
    };
    let recordings = read(&args.files)?;
    let mut options = args.estimate.options();
    let check = prepared::checked(&recordings, &options).map_err(failure::of_data)?;
    let low_pass = args.estimate.prepare().chosen_low_pass(&check);
    options.low_pass = fit::note_low_pass(low_pass.as_ref()).or(options.low_pass);
    let coordinates = recordings[0].coordinates.clone();
    let mut test = Vec::new();
    if !args.test.is_empty() {
        test = read(&args.test)?;
        fitted::require_dof(&test, &coordinates)?;
    }
    let all = (recordings, test);
    let data = Data::of(all.clone(), args, &options)?;
    let held = args.data.delay.is_empty().then(|| {
        let bodies = robot.config.bodies(&coordinates).ok()?;
        prepared::held(&data.dataset, &bodies, &all)
    });
    match held.flatten() {
        Some((delay, later)) => {
            fit::note_delay(&delay);
            let delay = delay.value.as_f64();
            Ok(Data {
                delay,
                ..Data::of(later, args, &options)?
            })
        }
        None => Ok(data),
    }
}

fn identify(args: &IdentifyArgs, robot: &Robot, data: &Data) -> Result<Identification> {
    let found = rigid::identify(&data.dataset, &robot.config, &IdentifyOptions::default());
    Ok(found.context(
        format!("cannot identify '{}'", args.urdf.display()),
        "`lagrangian identify --help` lists the flags of joints and columns",
    )?)
}

/// Torque errors on the held-out motions.
#[derive(Serialize)]
struct Errors {
    /// Errors of the original description, without friction.
    before: Option<SignalError>,
    /// Errors of all identified parameters.
    after: Option<SignalError>,
    /// Errors of the written URDF, with the same speed of smoothing.
    written: Option<SignalError>,
}

impl Data {
    /// The data of these logs, and of those that test.
    fn of(
        (recordings, test): (Vec<Recording>, Vec<Recording>),
        args: &IdentifyArgs,
        options: &EstimateOptions,
    ) -> Result<Self> {
        let coordinates = recordings[0].coordinates.clone();
        let (motions, estimates) = data::estimated(recordings, options)?;
        let (own, held_out) = match test.is_empty() {
            true => split(motions, args.hold_out, args.seed)
                .context("cannot hold data out", "take a smaller --hold-out")?,
            false => (motions, data::estimated(test, options)?.0),
        };
        let (train, validation) = split(own, VALIDATION, args.seed)?;
        Ok(Self {
            dataset: Dataset::new(coordinates.clone(), &train, &validation)?,
            coordinates,
            held_out,
            estimates,
            low_pass: options.low_pass,
            delay: None,
        })
    }

    fn held_out_samples(&self) -> usize {
        self.held_out.iter().map(Trajectory::len).sum()
    }

    fn error(&self, model: &dyn Model) -> Result<Option<SignalError>> {
        let predictions = self.held_out.iter().map(|m| predict_torque(model, m));
        let predictions: lagrangian::Result<Vec<_>> = predictions.collect();
        Ok(summarise(&predictions?, self.coordinates.dof()).error)
    }

    fn errors(&self, before: &RobotConfig, text: &str, found: &Identification) -> Result<Errors> {
        let motion = found.model.motion();
        let joints = motion.lagrangian.joints();
        let written = RigidBodies::with_joints(text, joints)?;
        let written = written.with_coordinates(self.coordinates.clone())?;
        let written = Mechanical::with_forces(written, motion.dissipation().cloned(), None)?;
        Ok(Errors {
            before: self.error(&before.bodies(&self.coordinates)?)?,
            after: self.error(&found.model)?,
            written: self.error(&written)?,
        })
    }
}

/// The identified quantities, and the torque errors before and after.
fn facts(found: &Identification, changes: &Changes, errors: &Errors, data: &Data) -> Report {
    let parts = changes.links.iter().chain(&changes.joints);
    let tables = parts.map(|part| parts::table(part, true));
    let independent = found.independent.iter().copied();
    Report {
        subtitle: format!(
            "{} samples, {} of them independent for the joint with the fewest; {} combinations of {} parameters have an effect on these torques",
            found.samples,
            independent.fold(f64::INFINITY, f64::min).round(),
            found.combinations,
            found.model.parameters().len(),
        ),
        summary: vec![omitted(changes)],
        tables: tables.chain([error_table(errors, data)]).collect(),
        ..Report::default()
    }
}

fn error_table(errors: &Errors, data: &Data) -> Table {
    let rows = [
        ("before: the URDF, without friction", &errors.before),
        ("after: all that was identified", &errors.after),
        ("after: what the new URDF says", &errors.written),
    ];
    let row = |(name, error): (&str, &Option<SignalError>)| {
        let error = error.as_ref()?;
        let all = [error.nmse_mean]
            .into_iter()
            .chain(error.nmse.iter().copied());
        let cells = all.map(|nmse| format!("{} %", short(100.0 * nmse)));
        Some([name.to_string()].into_iter().chain(cells).collect())
    };
    let joints = data.coordinates.0.iter().map(|joint| joint.name.as_str());
    let header: Vec<&str> = ["", "mean"].into_iter().chain(joints).collect();
    Table::new(
        format!(
            "Torque error on {} samples that were held out, squared, over the variance.",
            data.held_out_samples()
        ),
        &header,
        rows.into_iter().filter_map(row).collect(),
    )
}

/// Identified parameters that URDF cannot represent.
fn omitted(changes: &Changes) -> String {
    let figures = |name: &str| {
        let of = |part: &PartChange| {
            let own = part.quantities.iter().find(|q| q.name == name)?;
            Some(format!("{} {}", short(own.after), own.unit))
        };
        let all: Vec<String> = changes.joints.iter().filter_map(of).collect();
        all.join(", ")
    };
    let springs = match figures("spring") {
        none if none.is_empty() => none,
        some => format!("springs {some}; "),
    };
    format!(
        "Not in the URDF, which has no place for them: rotors {}; constant torques {}; {springs}the speed over which friction changes its sign.",
        figures("rotor"),
        figures("offset"),
    )
}
