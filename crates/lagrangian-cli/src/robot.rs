//! The flags that name a robot, and the files that they name.

use std::path::{Path, PathBuf};

use anyhow::Result;
use clap::Args;
use lagrangian::mechanics::Mechanical;
use lagrangian::rigid::{self, RigidBodies, RobotConfig};
use lagrangian_run::{DataFile, FileHash};
use serde::{Deserialize, Serialize};

use crate::failure::{Context, mistake};
use crate::values::name;

#[derive(Debug, Clone, Default, Args, Serialize, Deserialize)]
#[command(next_help_heading = "Robot")]
#[serde(default)]
pub(crate) struct RobotArgs {
    /// URDF of the robot, whose parameters --model rigid identifies
    #[arg(long, value_name = "FILE", conflicts_with = "nominal")]
    pub(crate) urdf: Option<PathBuf>,

    /// URDF of a nominal model: the network (lnn or delan) learns the difference from it
    #[arg(long, value_name = "FILE")]
    pub(crate) nominal: Option<PathBuf>,

    /// Joints of the robot in the order of the data, the others locked at 0 [default: those that the data name, or all]
    #[arg(long, value_name = "NAMES", value_delimiter = ',', value_parser = name)]
    pub(crate) joints: Vec<String>,
}

impl RobotArgs {
    /// Reads the robot that the flags name, if they do.
    pub(crate) fn read(&self) -> Result<Option<Robot>> {
        let path = self.urdf.as_ref().or(self.nominal.as_ref());
        path.map(|path| open(path, &self.joints)).transpose()
    }

    /// The file of a robot that was read, for the record of the run.
    pub(crate) fn file(&self, robot: &Robot) -> Option<DataFile> {
        let path = self.urdf.as_ref().or(self.nominal.as_ref())?;
        let hash = robot.hash.clone()?;
        Some(DataFile::new("robot", path, hash))
    }

    /// Refuses joints without a robot.
    pub(crate) fn refuse_needless_joints(&self) -> Result<()> {
        if self.urdf.is_some() || self.nominal.is_some() || self.joints.is_empty() {
            return Ok(());
        }
        Err(mistake(
            "--joints names joints of a robot, and none is given",
            "add --urdf robot.urdf (--model rigid) or --nominal robot.urdf (--model lnn, delan)",
        ))
    }
}

/// The example robot of a name that is not a file.
fn example(path: &Path) -> Option<&'static str> {
    let name = path.to_str().filter(|_| !path.exists())?;
    rigid::example(name)
}

/// The robot of a URDF file, or the example of that name.
pub(crate) fn read(path: &Path, joints: &[String]) -> Result<RobotConfig> {
    Ok(open(path, joints)?.config)
}

/// A robot, its original description, and the hash of its file where it is not an example.
pub(crate) struct Robot {
    pub(crate) config: RobotConfig,
    pub(crate) text: String,
    hash: Option<FileHash>,
}

/// Reads the robot of a URDF file, or the example of that name.
pub(crate) fn open(path: &Path, joints: &[String]) -> Result<Robot> {
    let (text, hash) = match example(path) {
        Some(text) => (text.to_owned(), None),
        None => {
            let names = rigid::EXAMPLES.join(", ");
            let text = lagrangian_run::text(path).context(
                format!("cannot read '{}'", path.display()),
                format!("give a URDF file that may be read (expand xacro first), or name an example: {names}"),
            )?;
            let hash = FileHash::of(text.as_bytes());
            (text, Some(hash))
        }
    };
    let config = RobotConfig::new(&text, joints.to_vec()).context(
        format!("cannot use the robot of '{}'", path.display()),
        "`check_urdf` of ROS finds most mistakes in a URDF file",
    )?;
    Ok(Robot { config, text, hash })
}

/// The robot as it moves, with the friction of its description.
pub(crate) fn with_friction(bodies: RigidBodies) -> Result<Mechanical<RigidBodies>> {
    let robot = bodies.with_friction().context(
        "cannot take the friction of the robot",
        "`damping` and `friction` of <dynamics> are 0 or more",
    )?;
    if let Some(friction) = robot.dissipation() {
        let largest = |of: &[f64]| of.iter().copied().fold(0.0, f64::max);
        note!(
            "note: the friction of the URDF acts: damping up to {}, friction up to {}",
            largest(&friction.viscous),
            largest(&friction.coulomb)
        );
    }
    Ok(robot)
}
