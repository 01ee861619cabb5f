//! `lagrangian identify`: from logs of a robot to a URDF with its parameters.

use anyhow::Result;
use lagrangian::mechanics::Mechanical;
use lagrangian::rigid::{
    self, Changes, Identification, IdentifyOptions, PartChange, Quantity, RigidBodies, RobotConfig,
};
use lagrangian::score::SignalError;
use lagrangian::torque::{predict_torque, summarise};
use lagrangian::trajectory::Sampling;
use lagrangian::{Coordinates, Dataset, Estimate, Model, Trajectory, prepared, split};
use lagrangian_report::draw::short;
use serde::Serialize;
use serde_json::json;

use super::{OutputMode, fit};
use crate::data;
use crate::failure::{self, Context, SUCCESS};
use crate::fitted;
use crate::identify_args::IdentifyArgs;
use crate::robot::{self, Robot};
use crate::task::{Size, Task};

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
    let data = read(args)?;
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
        as_text(&found, &changes, &errors, &data) + &format!("\n{}\n", args.out.display())
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
}

fn read(args: &IdentifyArgs) -> Result<Data> {
    let sampling = args.sample.sampling(args.seed, Sampling::LONGEST);
    let recordings = data::read_sample(&args.files, &args.data, sampling)?.recordings;
    let mut options = args.estimate.options();
    let check = prepared::checked(&recordings, &options).map_err(failure::of_data)?;
    let low_pass = args.estimate.prepare().chosen_low_pass(&check);
    options.low_pass = fit::note_low_pass(low_pass.as_ref()).or(options.low_pass);
    let coordinates = recordings[0].coordinates.clone();
    let (motions, estimates) = data::estimated(recordings, &options)?;
    let (own, held_out) = match args.test.is_empty() {
        true => split(motions, args.hold_out, args.seed)
            .context("cannot hold data out", "take a smaller --hold-out")?,
        false => {
            let other = data::read_sample(&args.test, &args.data, sampling)?.recordings;
            fitted::require_dof(&other, &coordinates)?;
            (motions, data::estimated(other, &options)?.0)
        }
    };
    let (train, validation) = split(own, VALIDATION, args.seed)?;
    let dataset = Dataset::new(coordinates.clone(), &train, &validation)?;
    Ok(Data {
        coordinates,
        dataset,
        held_out,
        estimates,
        low_pass: options.low_pass,
    })
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

fn as_text(found: &Identification, changes: &Changes, errors: &Errors, data: &Data) -> String {
    let parts = changes.links.iter().chain(&changes.joints);
    let width = parts.clone().flat_map(|p| &p.quantities);
    let width = width.map(|q| q.name.len()).max().unwrap_or(0);
    let mut text: String = parts.map(|part| part_text(part, width)).collect();
    text += &format!(
        "\n{} samples, {} of them independent for the joint with the fewest; {} combinations of {} parameters have an effect on these torques\n",
        found.samples,
        found
            .independent
            .iter()
            .copied()
            .fold(f64::INFINITY, f64::min)
            .round(),
        found.combinations,
        found.model.parameters().len(),
    );
    text += &error_text(errors, data);
    text + &omitted(changes)
}

fn part_text(part: &PartChange, width: usize) -> String {
    let fixed = match part.fixed.is_empty() {
        true => String::new(),
        false => format!(" (with {})", part.fixed.join(", ")),
    };
    let line = |q: &Quantity| {
        let before = q.before.map_or_else(|| "–".into(), short);
        let (after, unit) = (short(q.after), q.unit);
        let known = match q.is_determined() {
            true => format!(
                "± {:<10} {:<9}  determined {:.0} %",
                short(q.standard_error),
                unit,
                100.0 * q.determined
            ),
            false => format!(
                "{:<12} {unit:<9}  not determined by these data: value of the prior",
                ""
            ),
        };
        format!("  {:<width$} {before:>11} → {after:>11} {known}\n", q.name)
    };
    let lines: String = part.quantities.iter().map(line).collect();
    format!("\n{}{fixed}\n{lines}", part.name)
}

fn error_text(errors: &Errors, data: &Data) -> String {
    let Errors {
        before,
        after,
        written,
    } = errors;
    let rows = [
        ("before: the URDF, without friction", before),
        ("after: all that was identified", after),
        ("after: what the new URDF says", written),
    ];
    let row = |(name, error): (&str, &Option<SignalError>)| {
        let error = error.as_ref()?;
        let joints: String = error.nmse.iter().map(|x| format!("{x:>10.2e}")).collect();
        Some(format!("  {name:<36}{:>10.2e}{joints}\n", error.nmse_mean))
    };
    let rows: String = rows.into_iter().filter_map(row).collect();
    match data.held_out_samples() {
        0 => String::new(),
        samples => format!(
            "\ntorque error on {samples} samples that were held out, squared, over the variance: mean, and of each joint\n{rows}"
        ),
    }
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
    format!(
        "\nnot in the URDF, which has no place for them: rotors {}; constant torques {}; the speed over which friction changes its sign\n",
        figures("rotor"),
        figures("offset"),
    )
}
