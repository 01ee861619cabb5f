//! What is asked of a fit, as plain data: all that it depends on beside its recordings.

use lagrangian::models::{Entry, FAMILIES};
use lagrangian::saved::Preparation;
use lagrangian::settings::{Kind, Range, Setting, Values};
use lagrangian::train::{ROLLOUT_SETTINGS, Request, SETTINGS};
use lagrangian::{Budget, PrepareOptions, Provenance, RobotConfig, rigid};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::error::{Error, Result};
use crate::nearest::nearest;

/// What is asked of a fit, beside its recordings. Together they give the same bits wherever the fit ends after a number of steps.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Specification {
    /// The name of the family; the best of several without one.
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
    /// The same of a nominal model, whose omissions a network learns.
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

/// The settings of a specification that belong to no table of the library.
const OWN: [&str; 12] = [
    "model",
    "steps",
    "seconds",
    "seed",
    "smooth",
    "low_pass",
    "baseline",
    "validate_fraction",
    "delay",
    "urdf",
    "nominal",
    "joints",
];

/// The numbers among them.
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
    /// The specification that these settings make, by the names of the flags of a fit (`model` is the family); each is checked against
    /// the tables of the library.
    ///
    /// # Errors
    /// [`Error::Refused`] for an unknown setting, with the nearest name, and for a value that a setting does not take.
    pub fn of(values: &Values) -> Result<Self> {
        let mut own = Values::new();
        let mut specification = Self::default();
        let family = values.get("model").and_then(Value::as_str);
        let entry = family.map(Entry::by_name).transpose()?;
        for (name, value) in values {
            if OWN.contains(&name.as_str()) {
                let key = if name == "model" { "family" } else { name };
                own.insert(key.into(), value.clone());
                continue;
            }
            let (table, setting) = of_tables(entry, name)?;
            setting.check(value)?;
            let values = match table {
                Table::Family => &mut specification.settings,
                Table::Training => &mut specification.training,
                Table::Rollout => &mut specification.rollout,
            };
            values.insert(name.clone(), value.clone());
        }
        let base = serde_json::to_value(&specification).map_err(|e| refused(&e))?;
        let mut all = base.as_object().cloned().unwrap_or_default();
        all.extend(own);
        let made: Self = serde_json::from_value(Value::Object(all)).map_err(|e| refused(&e))?;
        made.bounded()?;
        Ok(made.normal())
    }

    /// Refuses numbers outside their ranges, wherever they come from.
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

    /// The same specification in its one form: numbers of settings that are no whole ones with a point, and nothing that was not given.
    #[must_use]
    pub fn normal(mut self) -> Self {
        let entry = self.family.as_deref().map(Entry::by_name);
        let entry = entry.and_then(lagrangian::Result::ok);
        for values in [&mut self.settings, &mut self.training, &mut self.rollout] {
            values.retain(|_, value| !value.is_null());
            for (name, value) in values {
                let kind = of_tables(entry, name).map(|(_, setting)| setting.kind);
                if matches!(kind, Ok(Kind::Number(_) | Kind::Numbers(_))) {
                    with_point(value);
                }
            }
        }
        self
    }

    /// What the library is asked for.
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

    /// Where a model comes from that is kept in no folder.
    pub(crate) fn provenance(&self, preparation: Preparation) -> Provenance {
        Provenance {
            preparation: Some(preparation),
            ..Provenance::of_seed(self.seed)
        }
    }

    /// What is done with the recordings.
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

/// A table of settings.
enum Table {
    Family,
    Training,
    Rollout,
}

/// Where a setting stands; those of all families where none is chosen.
fn of_tables(entry: Option<&'static Entry>, name: &str) -> Result<(Table, &'static Setting)> {
    let of = |table: &'static [Setting]| table.iter().find(|setting| setting.name == name);
    let families: Vec<&'static Entry> = match entry {
        Some(entry) => vec![entry],
        None => FAMILIES.iter().collect(),
    };
    let family = families.iter().find_map(|entry| of(entry.settings));
    let training = || of(SETTINGS).map(|setting| (Table::Training, setting));
    let rollout = || of(ROLLOUT_SETTINGS).map(|setting| (Table::Rollout, setting));
    let found = family.map(|setting| (Table::Family, setting));
    found.or_else(training).or_else(rollout).ok_or_else(|| {
        let own = families.iter().flat_map(|entry| entry.settings);
        let tables = own.chain(SETTINGS).chain(ROLLOUT_SETTINGS);
        let known: Vec<&str> = tables.map(|setting| setting.name).chain(OWN).collect();
        let near = nearest(name, known.iter().copied());
        let remedy = near.map(|near| format!("did you mean '{near}'?"));
        let all = || format!("choose from {}", known.join(", "));
        let of = entry.map(|entry| format!(" of the model {}", entry.name));
        Error::new(
            format!(
                "there is no setting '{}'{}",
                lagrangian::brief(name),
                of.unwrap_or_default()
            ),
            remedy.unwrap_or_else(all),
        )
    })
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
    use serde_json::json;

    fn of(values: Value) -> Result<Specification> {
        Specification::of(values.as_object().unwrap())
    }

    #[test]
    fn settings_stand_in_the_tables_that_know_them() {
        let own = of(json!({
            "model": "lnn", "width": 16, "learning_rate": 1, "steps": 5, "seed": 3, "low_pass": 5
        }));
        let own = own.unwrap();
        assert_eq!(own.settings["width"], json!(16));
        assert_eq!(own.training["learning_rate"], json!(1.0));
        assert_eq!((own.steps, own.seed, own.low_pass), (Some(5), 3, Some(5.0)));
        let request = own.request().unwrap();
        assert_eq!(request.budget, Some(Budget::Steps(5)));
        assert!(own.prepare().low_pass == Some(5.0));
    }

    #[test]
    fn what_no_setting_takes_is_refused_with_the_nearest_name() {
        for (values, words) in [
            (json!({ "widht": 3 }), "did you mean 'width'?"),
            (json!({ "zzzzzzzzz": 3 }), "choose from"),
            (json!({ "steps": 0 }), "from 1 to 1000000000"),
            (json!({ "steps": 3, "seconds": 1.0 }), "one of them"),
            (json!({ "steps": "many" }), "without quotes"),
            (json!({ "validate_fraction": 1.0 }), "at most 0.99"),
        ] {
            let error = of(values.clone()).unwrap_err();
            assert!(error.remedy().contains(words), "{values}: {error}");
        }
        assert!(of(json!({ "model": "lmm" })).is_err());
        assert!(of(json!({ "model": "lnn", "width": 0 })).is_err());
    }
}
