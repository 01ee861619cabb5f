//! Robots from URDF.

use lagrangian::mechanics::Quantities;
use lagrangian::rigid::RigidBodies;

use crate::{Outcome, refused, text};

/// More joints than this are read, but not evaluated: that is work, and no new code.
const MOST_JOINTS: usize = 12;

/// A robot whose mass matrix, torques and text are those of the same robot.
pub fn urdf(bytes: &[u8]) -> Outcome {
    let text = text(bytes)?;
    let robot = RigidBodies::from_urdf(text).map_err(refused)?;
    let n = robot.dof();
    if n > MOST_JOINTS {
        return Ok(());
    }
    let q: Vec<f64> = (0..n).map(|i| 0.3 * i as f64 - 0.4).collect();
    let mass = robot.mass_matrix(&q).expect("a robot has a mass matrix");
    let largest = mass.iter().fold(f64::MIN_POSITIVE, |a, b| a.max(b.abs()));
    for i in 0..n {
        assert!(
            mass[i * n + i] >= -1e-9 * largest,
            "M has a negative diagonal"
        );
        for k in 0..i {
            let skew = (mass[i * n + k] - mass[k * n + i]).abs();
            assert!(skew <= 1e-9 * largest, "M is symmetric");
        }
    }
    robot
        .inverse_dynamics(&q, &q, &q)
        .expect("a robot has torques");
    Quantities::gravity(&robot, &q).expect("a robot has weight");
    // OK to be refused: a massless link has no acceleration.
    let _ = robot.forward_dynamics(&q, &q, &q);
    let again = RigidBodies::from_urdf(&robot.urdf()).expect("a robot that was written is read");
    let again = again.mass_matrix(&q).expect("it has a mass matrix");
    let differs = |(a, b): (&f64, &f64)| (a - b).abs() > 1e-9 * largest;
    assert!(
        !mass.iter().zip(&again).any(differs),
        "a robot comes back the same"
    );
    let edited = robot.edit_urdf(text, None).map_err(refused)?;
    assert_eq!(edited, text, "nothing was changed");
    Ok(())
}
