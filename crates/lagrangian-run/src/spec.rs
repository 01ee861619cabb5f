//! The request of a fit, as plain data: all that it depends on beside its recordings.

use lagrangian::models::{Entry, FAMILIES};
use lagrangian::saved::Preparation;
use lagrangian::settings::{Kind, Range, Setting, Values};
use lagrangian::{Budget, PrepareOptions, Provenance, RobotConfig, rigid};
use lagrangian::{
    fit::{ROLLOUT_SETTINGS, SETTINGS},
    train::Request,
};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use sha2::{Digest, Sha256};

use crate::content::hex;
use crate::error::{Error, Result};

/// Digits of a hash that name a folder: of 100 000 units two are the same with a probability below 10⁻⁹.
const DIGITS: usize = 16;

/// Increased when another meaning of a specification or other bits follow from an equal text.
const VERSION: u32 = 2;

/// The request of a fit, beside its recordings. Together they give equal bits wherever the fit ends after a number of steps.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Specification {
    /// The name of the family; `None` for the best of several.
    pub family: Option<String>,
    /// The settings of the family.
    pub settings: Values,
    /// The settings of the training.
    pub training: Values,
    /// The settings of the rollout loss.
    pub rollout: Values,
    /// The number of steps after which the fit ends.
    pub steps: Option<usize>,
    /// The time after which it ends, s, where no number of steps is given.
    pub seconds: Option<f64>,
    /// The seed of weights, split and batches.
    pub seed: u64,
    /// Whether measured q and q̇ are smoothed.
    pub smooth: bool,
    /// The cut-off of the low-pass of motion and forces, Hz; 0 for none, found from the data where it is not given.
    pub low_pass: Option<f64>,
    /// The distance of neighbours of a loss of positions, in samples.
    pub baseline: usize,
    /// The part of the data that is held back for validation, where no other is given.
    pub validate_fraction: f64,
    /// The delays of the forces, s: one for all coordinates, one for each, or none.
    pub delay: Vec<f64>,
    /// The text of the URDF of the robot, or the name of an example.
    pub urdf: Option<String>,
    /// The text of the URDF of a nominal model, or the name of an example; a network learns the forces that it omits.
    pub nominal: Option<String>,
    /// The joints of the robot in the order of the data.
    pub joints: Vec<String>,
}

impl Default for Specification {
    fn default() -> Self {
        let prepare = PrepareOptions::default();
        Self {
            family: None,
            settings: Values::new(),
            training: Values::new(),
            rollout: Values::new(),
            steps: None,
            seconds: None,
            seed: 0,
            smooth: prepare.smooth,
            low_pass: prepare.low_pass,
            baseline: prepare.baseline,
            validate_fraction: prepare.validate_fraction,
            delay: Vec::new(),
            urdf: None,
            nominal: None,
            joints: Vec::new(),
        }
    }
}

/// The numbers of a specification that are in no table of the library.
const NUMBERS: &[Setting] = &[
    Setting::new(
        "steps",
        Kind::Integer {
            min: 1,
            max: 1_000_000_000,
        },
        "",
    ),
    Setting::new("seconds", Kind::Number(Range::POSITIVE), ""),
    Setting::new(
        "seed",
        Kind::Integer {
            min: 0,
            max: i64::MAX as u64,
        },
        "",
    ),
    Setting::new("low_pass", Kind::Number(Range::NON_NEGATIVE), ""),
    Setting::new(
        "baseline",
        Kind::Integer {
            min: 1,
            max: 10_000,
        },
        "",
    ),
    Setting::new("validate_fraction", Kind::Number(Range::new(0.0, 0.99)), ""),
    Setting::new("delay", Kind::Numbers(Range::new(-1e6, 1e6)), ""),
];

impl Specification {
    /// The name of the run folder of a fit in a sweep: a hash of the specification in its normal form, of the roles and the hashes of its
    /// recordings, and of their layout.
    ///
    /// # Errors
    /// [`Error::Refused`] and [`Error::Library`] for a value that a setting does not take.
    pub fn unit_name(self, data: &[(String, String)], layout: &str) -> Result<String> {
        self.bounded()?;
        let asked = json!({
            "version": (VERSION, env!("CARGO_PKG_VERSION")),
            "asked": self.normal()?,
            "data": data,
            "layout": layout,
        });
        let mut name = hex(&Sha256::digest(asked.to_string().as_bytes()));
        name.truncate(DIGITS);
        Ok(name)
    }

    /// Refuses numbers outside their ranges, whatever their origin.
    fn bounded(&self) -> Result<()> {
        if self.steps.is_some() && self.seconds.is_some() {
            return Err(Error::new(
                "both 'steps' and 'seconds' end a fit",
                "give one of them",
            ));
        }
        let values = serde_json::to_value(self).map_err(|e| refused(&e))?;
        let value = |row: &Setting| &values[row.name];
        let mut given = NUMBERS.iter().filter(|row| !value(row).is_null());
        match given.find(|row| row.check(value(row)).is_err()) {
            None => Ok(()),
            Some(row) => Err(Error::new(
                format!(
                    "the setting '{}' has a value that it does not take",
                    row.name
                ),
                format!("it must be {}", row.kind.wanted()),
            )),
        }
    }

    /// The specification in its normal form: real-valued settings are written with a point, and settings that were not given are omitted.
    fn normal(mut self) -> Result<Self> {
        for values in [&mut self.settings, &mut self.training, &mut self.rollout] {
            values.retain(|_, value| !value.is_null());
            for (name, value) in values {
                let Some(setting) = setting(self.family.as_deref(), name) else {
                    continue;
                };
                setting.check(value)?;
                if matches!(setting.kind, Kind::Number(_) | Kind::Numbers(_)) {
                    with_point(value);
                }
            }
        }
        Ok(self)
    }

    /// The request to the library.
    ///
    /// # Errors
    /// As [`RobotConfig::new`] and [`Entry::taking_a_robot`].
    pub fn request(&self) -> Result<Request> {
        self.bounded()?;
        let seconds = self.seconds.map(Budget::Seconds);
        let mut request = Request {
            family: self.family.clone(),
            settings: self.settings.clone(),
            training: self.training.clone(),
            rollout: self.rollout.clone(),
            budget: self.steps.map(Budget::Steps).or(seconds),
            seed: self.seed,
            nominal: None,
        };
        let robot = |text: &String| {
            let text = rigid::example(text).unwrap_or(text);
            RobotConfig::new(text, self.joints.clone())
        };
        request.nominal = self.nominal.as_ref().map(robot).transpose()?;
        if let Some(urdf) = &self.urdf {
            let setting = Entry::taking_a_robot(request.family.as_deref())?;
            let config = serde_json::to_value(robot(urdf)?).map_err(|e| refused(&e))?;
            request.settings.insert(setting.name.into(), config);
        }
        Ok(request)
    }

    /// The origin of a model that is not kept in a folder.
    pub(crate) fn provenance(&self, preparation: Preparation) -> Provenance {
        Provenance {
            preparation: Some(preparation),
            ..Provenance::of_seed(self.seed)
        }
    }

    /// The options of the preparation of the recordings.
    #[must_use]
    pub fn prepare(&self) -> PrepareOptions {
        PrepareOptions {
            smooth: self.smooth,
            low_pass: self.low_pass,
            baseline: self.baseline,
            validate_fraction: self.validate_fraction,
            delayed: !self.delay.is_empty(),
        }
    }
}

/// The row of a setting in the tables of a family, of the training and of the rollout loss; of all families where none is chosen.
fn setting(family: Option<&str>, name: &str) -> Option<&'static Setting> {
    let families = FAMILIES
        .iter()
        .filter(|entry| family.is_none_or(|own| own == entry.name));
    let tables = families.map(|entry| entry.settings);
    let mut rows = tables.chain([SETTINGS, ROLLOUT_SETTINGS]).flatten();
    rows.find(|setting| setting.name == name)
}

/// A whole number, or a list of them, as numbers with a point.
fn with_point(value: &mut Value) {
    match value {
        Value::Array(items) => items.iter_mut().for_each(with_point),
        number => {
            if let Some(x) = number.as_f64() {
                *number = x.into();
            }
        }
    }
}

fn refused(error: &serde_json::Error) -> Error {
    let finding = format!("the settings cannot be read: {error}");
    Error::new(
        finding,
        "correct the value: numbers without quotes, names with them",
    )
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;
    fn lnn(settings: Value) -> Specification {
        Specification {
            family: Some("lnn".into()),
            settings: settings.as_object().unwrap().clone(),
            ..Specification::default()
        }
    }

    #[test]
    fn a_unit_is_named_by_its_settings_data_and_layout() {
        let data = vec![("training".to_string(), "0f".to_string())];
        let name = |own: &Specification| own.clone().unit_name(&data, "").unwrap();
        let own = lnn(json!({ "width": 16 }));
        assert_eq!(
            name(&own),
            name(&lnn(json!({ "width": 16, "layers": null })))
        );
        assert_ne!(name(&own), name(&lnn(json!({ "width": 17 }))));
        assert_ne!(name(&own), own.clone().unit_name(&[], "").unwrap());
        assert_ne!(name(&own), own.unit_name(&data, "degrees = true").unwrap());
        let rate = |rate: Value| {
            let mut own = lnn(json!({}));
            own.training.insert("learning_rate".into(), rate);
            name(&own)
        };
        assert_eq!(rate(json!(1)), rate(json!(1.0)));
    }

    #[test]
    fn a_value_that_a_setting_does_not_take_has_no_unit() {
        assert!(lnn(json!({ "width": 0 })).unit_name(&[], "").is_err());
        let anything = Specification {
            family: None,
            ..lnn(json!({ "width": "x" }))
        };
        assert!(anything.unit_name(&[], "").is_err());
        for bad in [
            Specification {
                steps: Some(0),
                ..lnn(json!({}))
            },
            Specification {
                validate_fraction: 1.0,
                ..lnn(json!({}))
            },
            Specification {
                steps: Some(3),
                seconds: Some(1.0),
                ..lnn(json!({}))
            },
        ] {
            assert!(bad.unit_name(&[], "").is_err());
        }
    }
}
