//! Plants: machines that a simulator moves, which a frontend in another language opens.

use std::sync::OnceLock;

use anyhow::Result;
use lagrangian::Model;
use lagrangian_run::Cause;

use crate::failure::{Context, mistake};

/// A robot that moves in a control loop.
#[derive(Default)]
pub struct OpenedPlant {
    /// The robot; the saved model itself where there is none.
    pub model: Option<Box<dyn Model>>,
    /// The largest torque of each drive, N·m (N); 0 for a joint without a drive. Empty without limits.
    pub limits: Vec<f64>,
}

/// Opens the plant of a source with the joints that move; all of them where none is named.
pub type OpenPlant = fn(source: &str, joints: &[String]) -> Result<OpenedPlant, Cause>;

static OPENER: OnceLock<OpenPlant> = OnceLock::new();

/// Lets this process open plants.
pub fn open_plants_by(open: OpenPlant) {
    OPENER.get_or_init(|| open);
}

pub(crate) fn open(source: &str, joints: &[String]) -> Result<OpenedPlant> {
    let Some(open) = OPENER.get() else {
        return Err(mistake(
            format!("this program cannot move the plant '{source}': MuJoCo is a library of Python"),
            "the command of the Python package can: pip install 'lagrangian[mujoco]'",
        ));
    };
    Ok(open(source, joints).context(
        format!("cannot open the plant '{source}'"),
        "--plant takes a file in MJCF or URDF, dm_control:DOMAIN-TASK, gymnasium:ID, or the name of an example",
    )?)
}
