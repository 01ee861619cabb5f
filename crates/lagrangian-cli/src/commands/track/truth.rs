//! The robot that moves: a known system, or rigid bodies.

use std::path::{Path, PathBuf};

use anyhow::Result;
use lagrangian::analytic::{by_name, systems};
use lagrangian::rigid::RigidBodies;
use lagrangian::text::counted;
use lagrangian::{Coordinates, Learned, Model};
use lagrangian_control::Reference;

use super::Desired;
use crate::failure::{Context, mistake};
use crate::plants::OpenedPlant;
use crate::robot;
use crate::track_args::{TrackArgs, TruthArgs};

/// The robot of the flags, as a report names it.
pub(super) fn shown(args: &TruthArgs) -> String {
    match (&args.robot, &args.plant) {
        (Some(robot), _) => format!("'{}'", robot.display()),
        (_, Some(plant)) => format!("'{plant}' in MuJoCo"),
        _ => "the model itself".into(),
    }
}

/// What to do where there is no robot.
pub(super) const REMEDY: &str =
    "name the robot that moves: --robot two-link-arm, or a URDF file, or a --plant";

/// The robot of the flags with this payload; without a model where the saved one itself moves.
pub(super) fn read(
    args: &TruthArgs,
    saved: Option<&Learned>,
    reference: &Desired,
    payload: Option<f64>,
) -> Result<OpenedPlant> {
    if let Some(source) = &args.plant {
        let plant = crate::plants::open(source, &args.joints)?;
        require_dof(source, plant.model.as_deref(), &reference.motion)?;
        return Ok(plant);
    }
    let Some(path) = &args.robot else {
        if !args.joints.is_empty() {
            return Err(mistake(
                "--joints chooses joints of a robot, and there is none",
                "name the robot that moves as --robot or --plant, or omit --joints",
            ));
        }
        if saved.is_some_and(|model| !model.moves()) {
            return Err(mistake(
                "the model gives torques and no motion, so that it cannot be the robot",
                REMEDY,
            ));
        }
        return Ok(OpenedPlant::default());
    };
    let robot: Box<dyn Model> = match system(path) {
        Some(name) => analytic(name, args, payload)?,
        None => Box::new(robot::with_friction(bodies(
            path,
            args,
            &reference.coordinates,
            payload,
        )?)?),
    };
    require_dof(&path.to_string_lossy(), Some(&*robot), &reference.motion)?;
    Ok(OpenedPlant {
        model: Some(robot),
        limits: Vec::new(),
    })
}

fn require_dof(name: &str, robot: Option<&dyn Model>, reference: &Reference) -> Result<()> {
    let expected = reference.dof();
    let found = robot.map_or(expected, |robot| robot.coordinates().dof());
    if found == expected {
        return Ok(());
    }
    Err(mistake(
        format!(
            "the robot '{name}' has {}, the model and the reference have {expected}",
            counted(found, "joint")
        ),
        "give the robot of the model, and the joints that move as --joints where it comes from a file",
    ))
}

/// The kinematics of the robot that moves, of the one that is learned, or of the model, where they are known: what is drawn in motion.
pub(super) fn kinematics(
    args: &TrackArgs,
    saved: Option<&Learned>,
    coordinates: &Coordinates,
) -> Option<RigidBodies> {
    let described = |path: &PathBuf| {
        let config = robot::read(path, &args.truth.joints).ok()?;
        config.bodies(coordinates).ok()
    };
    let moving = args
        .truth
        .robot
        .as_ref()
        .filter(|path| system(path).is_none());
    let of_file = moving.or(args.learning.urdf.as_ref()).and_then(described);
    of_file.or_else(|| saved?.robot().cloned())
}

/// The system of a name that is not a file.
fn system(path: &Path) -> Option<&'static str> {
    let name = path.to_str().filter(|_| !path.exists())?;
    let mut known = systems().iter().map(|entry| entry.name);
    known.find(|known| *known == name)
}

fn analytic(name: &str, args: &TruthArgs, payload: Option<f64>) -> Result<Box<dyn Model>> {
    if !args.joints.is_empty() {
        return Err(mistake(
            format!("--joints chooses joints of a URDF, and '{name}' is a system"),
            "omit --joints",
        ));
    }
    let given = args.parameters.iter().map(|(name, x)| (name.as_str(), *x));
    let load = payload.map(|kg| ("payload", kg));
    let all: Vec<(&str, f64)> = given.chain(load).collect();
    let system = by_name(name, &all).context(
        format!("cannot take '{name}' as the robot"),
        "`lagrangian simulate list` names the systems and their parameters; --payload sets the one of that name",
    )?;
    Ok(system)
}

fn bodies(
    path: &Path,
    args: &TruthArgs,
    coordinates: &Coordinates,
    payload: Option<f64>,
) -> Result<RigidBodies> {
    let shown = path.display();
    if !args.parameters.is_empty() {
        return Err(mistake(
            format!("--set is for systems, and '{shown}' is not one"),
            "change the URDF instead; `lagrangian simulate list` names the systems",
        ));
    }
    let named: Vec<&str> = systems().iter().map(|entry| entry.name).collect();
    let hint = format!(
        "--joints chooses its joints; or name a system: {}",
        named.join(", ")
    );
    let config = robot::read(path, &args.joints)?;
    let bodies = config
        .bodies(coordinates)
        .context(format!("cannot take '{shown}' as the robot"), hint)?;
    let Some(kg) = payload else {
        return Ok(bodies);
    };
    let tip = bodies.tip().to_string();
    note!("note: the payload of {kg} kg is at the origin of link '{tip}'");
    Ok(bodies.with_payload(&tip, kg, [0.0; 3]).context(
        format!("cannot put a payload on '{shown}'"),
        "give --payload as a mass, kg",
    )?)
}
