//! The machines: which logs are learned from and which are kept.

use anyhow::Result;
use lagrangian::{
    Coordinates, Dataset, EstimateOptions, Format, Layout, Recording, Trajectory, split,
};

use crate::harness::Lab;
use crate::harness::failure::{Context, mistake};

/// A machine and the protocol of its data.
pub(super) struct Machine {
    /// Its name in JSON.
    pub(super) name: &'static str,
    /// What it is.
    pub(super) about: &'static str,
    /// Folder of the reference data.
    folder: &'static str,
    train: &'static [&'static str],
    /// Logs that choose; without any, the last fifth of each training log.
    validation: &'static [&'static str],
    test: &'static [&'static str],
    /// Cut-off of the low-pass of all signals, Hz.
    pub(super) low_pass: f64,
}

pub(super) const MACHINES: &[Machine] = &[
    Machine {
        name: "pendulum",
        about: "A pendulum on a brushless drive: learned from a swing-up by energy shaping and one along an optimised \
                path, judged by two others",
        folder: "pendulum_real",
        train: &["energy_shaping", "ddp"],
        validation: &[],
        test: &["system_identification", "swingup_failure"],
        low_pass: 8.0,
    },
    Machine {
        name: "double_pendulum",
        about: "A double pendulum driven at both joints: learned from logs 00 to 03, validated on 04, judged by 05 and by \
                the swing-up 12, which goes where no log has been",
        folder: "double_pendulum_real",
        train: &[
            "trajectory_00",
            "trajectory_01",
            "trajectory_02",
            "trajectory_03",
        ],
        validation: &["trajectory_04"],
        test: &["trajectory_05", "trajectory_12"],
        low_pass: 5.0,
    },
];

/// What a machine's logs were cut into.
pub(crate) struct Recordings {
    pub(crate) dataset: Dataset,
    pub(super) validation: Vec<Trajectory>,
    pub(crate) test: Vec<Trajectory>,
}

/// The logs of the double pendulum.
pub(crate) fn double_pendulum(lab: &Lab) -> Result<Recordings> {
    MACHINES[1].read(lab)
}

impl Machine {
    pub(super) fn read(&self, lab: &Lab) -> Result<Recordings> {
        let logs = |names: &[&str]| -> Result<Vec<Trajectory>> {
            names.iter().map(|name| self.log(lab, name)).collect()
        };
        let (mut train, mut validation) = (logs(self.train)?, logs(self.validation)?);
        if validation.is_empty() {
            (train, validation) = split(train, 0.2, 0)?;
        }
        Ok(Recordings {
            dataset: Dataset::new(Coordinates::angles(train[0].dof()), &train, &validation)?,
            validation,
            test: logs(self.test)?,
        })
    }

    fn log(&self, lab: &Lab, name: &str) -> Result<Trajectory> {
        let file = lab.data(&format!("{}/{name}.csv", self.folder))?;
        let shown = format!("cannot read '{name}.csv'");
        let layout = Layout {
            angles: vec!["all".into()],
            ..Layout::default()
        };
        let hint = "give the reference data with --data";
        let read = Format::Csv
            .read(std::io::Cursor::new(file), name, &layout)
            .context(&shown, hint)?;
        let options = EstimateOptions {
            low_pass: Some(self.low_pass),
            ..EstimateOptions::default()
        };
        let first: Option<Recording> = read.recordings.into_iter().next();
        let first = first.ok_or_else(|| mistake(&shown, hint))?;
        Ok(first.into_trajectory(&options).context(shown, hint)?.0)
    }
}
