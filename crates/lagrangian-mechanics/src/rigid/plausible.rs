//! What no robot has: lengths of hundreds of metres, angles of many turns, friction that drives. It is a matter of units or of a
//! slip of the pen, and a model of it would be wrong in silence.

use std::f64::consts::TAU;

use super::spatial::Vec3;
use super::urdf::{Inertial, JointKind, unusable};
use lagrangian_motion::Result;

/// Links and joints are nearer to one another than this, m.
const FARTHEST: f64 = 100.0;
/// The rotation of a frame is written within so many turns: 7 may be radians, 90 are degrees.
const MOST_TURNS: f64 = 1.05;
/// The limits of a joint that turns are within so many turns of each other.
const MOST_TURNS_OF_JOINT: f64 = 6.0;
/// No link is heavier, kg.
const HEAVIEST: f64 = 1e5;
/// The radius of gyration of a link, m.
const WIDEST: f64 = 30.0;

/// Refuses the place of a link or joint that is not in m and rad.
pub(super) fn place(xyz: Vec3, rpy: Vec3, of: &str) -> Result<()> {
    if let Some(x) = xyz.iter().find(|x| x.abs() > FARTHEST) {
        let finding = format!("{of}: its origin is {x} m away");
        return Err(unusable(
            finding,
            "write lengths in m: they look like millimetres",
        ));
    }
    if let Some(angle) = rpy.iter().find(|x| x.abs() > MOST_TURNS * TAU) {
        let finding = format!("{of}: its frame is turned by {angle} rad");
        return Err(unusable(
            finding,
            "write angles in radians, within one turn: they look like degrees",
        ));
    }
    Ok(())
}

/// Refuses mass and inertia that are not in kg and kg m².
pub(super) fn inertial(i: &Inertial, of: &str) -> Result<()> {
    place(i.xyz, i.rpy, of)?;
    if i.mass > HEAVIEST {
        let finding = format!("{of} has mass {} kg", i.mass);
        return Err(unusable(
            finding,
            "write masses in kg, or correct the exponent",
        ));
    }
    let [xx, _, _, yy, _, zz] = i.inertia;
    let radius = (xx.max(yy).max(zz) / i.mass).sqrt();
    if i.mass > 0.0 && radius > WIDEST {
        let finding = format!("{of}: inertia and mass are those of a body {radius:.0} m wide");
        return Err(unusable(
            finding,
            "write inertias in kg m²: they look like those in other units",
        ));
    }
    Ok(())
}

/// Refuses friction that drives a joint.
pub(super) fn friction(damping: f64, friction: f64, of: &str) -> Result<()> {
    for (name, value) in [("damping", damping), ("friction", friction)] {
        if value < 0.0 {
            let finding = format!("{of}: {name} is {value}");
            return Err(unusable(
                finding,
                "write friction as positive numbers: it takes energy out of a joint",
            ));
        }
    }
    Ok(())
}

/// Refuses limits between which there is nothing, or more than a joint turns.
pub(super) fn limits(
    kind: JointKind,
    lower: Option<f64>,
    upper: Option<f64>,
    of: &str,
) -> Result<()> {
    let (Some(lower), Some(upper)) = (lower, upper) else {
        return Ok(());
    };
    if matches!(kind, JointKind::Revolute | JointKind::Prismatic) && lower > upper {
        let finding = format!("{of}: its lower limit {lower} is above the upper one {upper}");
        return Err(unusable(finding, "exchange the two limits"));
    }
    if kind == JointKind::Revolute && upper - lower > MOST_TURNS_OF_JOINT * TAU {
        let finding = format!("{of} turns from {lower} to {upper} rad");
        return Err(unusable(
            finding,
            "write limits in radians: they look like degrees; a joint without end is `continuous`",
        ));
    }
    Ok(())
}
