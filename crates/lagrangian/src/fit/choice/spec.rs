//! The numbers of a request that are in no other table, and the robot of its description.

use crate::models::Entry;
use crate::train::FitSpec;
use lagrangian_motion::settings::{Kind, Range, Setting};
use lagrangian_motion::{Error, Result};

/// The numbers of a request, and of the preparation of its recordings.
const NUMBERS: &[Setting] = &[
    Setting::new("steps", whole(1, 1_000_000_000), ""),
    Setting::new("seconds", Kind::Number(Range::POSITIVE), ""),
    Setting::new("seed", whole(0, i64::MAX as u64), ""),
    Setting::new("low_pass", Kind::Number(Range::NON_NEGATIVE), ""),
    Setting::new("baseline", whole(1, 10_000), ""),
    Setting::new("validate_fraction", Kind::Number(Range::new(0.0, 0.99)), ""),
    Setting::new("delay", Kind::Numbers(Range::new(-1e6, 1e6)), ""),
];

const fn whole(min: u64, max: u64) -> Kind {
    Kind::Integer { min, max }
}

impl FitSpec {
    /// The request with its robot among the settings of the family.
    ///
    /// # Errors
    /// [`Error::Setting`] for a number outside its range, as [`RobotConfig::new`](crate::rigid::RobotConfig::new) and
    /// [`Entry::taking_a_robot`].
    pub fn checked(&self) -> Result<Self> {
        self.refuse_out_of_range()?;
        let mut own = self.clone();
        if let Some(text) = own.urdf.take() {
            let setting = Entry::taking_a_robot(self.family.as_deref())?;
            let robot = serde_json::to_value(self.robot(&text)?);
            let robot = robot.map_err(|e| super::setting_error(&e))?;
            own.settings.insert(setting.name.into(), robot);
        }
        Ok(own)
    }

    fn refuse_out_of_range(&self) -> Result<()> {
        if self.steps.is_some() && self.seconds.is_some() {
            return Err(Error::setting(
                "both `steps` and `seconds` end a fit",
                "give one of them",
            ));
        }
        let values = serde_json::to_value(Self {
            urdf: None,
            nominal: None,
            ..self.clone()
        });
        let values = values.map_err(|e| super::setting_error(&e))?;
        let value = |row: &Setting| values.get(row.name).unwrap_or(&values["prepare"][row.name]);
        let mut given = NUMBERS.iter().filter(|row| !value(row).is_null());
        given.try_for_each(|row| row.check(value(row)))
    }
}
