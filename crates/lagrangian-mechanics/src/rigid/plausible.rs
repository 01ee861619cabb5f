//! Checks for implausible robots: lengths of hundreds of metres, angles of many turns, friction that drives. They come from wrong
//! units or typing errors, and a model of such a robot would be wrong without notice.

use std::f64::consts::TAU;

use super::spatial::Vec3;
use super::urdf::{Inertial, JointKind, unusable};
use lagrangian_motion::Result;

/// Maximum coordinate of the origin of a link or joint, m.
const FARTHEST: f64 = 100.0;
/// Maximum angle of the rotation of a frame, in turns: 7 may be radians, 90 are degrees.
const MOST_TURNS: f64 = 1.05;
/// Maximum range between the limits of a joint that turns, in turns.
const MOST_TURNS_OF_JOINT: f64 = 6.0;
/// Maximum mass of a link, kg.
const HEAVIEST: f64 = 1e5;
/// Maximum radius of gyration of a link, m.
const WIDEST: f64 = 30.0;

/// Returns an error for the place of a link or joint that is not in m and rad.
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

/// Returns an error for mass and inertia that are not in kg and kg m².
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

/// Returns an error for friction that drives a joint.
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

/// Returns an error for limits that leave no range, or more than a joint turns.
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
