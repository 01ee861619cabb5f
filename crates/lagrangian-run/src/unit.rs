//! The names of the units of a sweep.

use lagrangian::FitSpec;
use lagrangian::fit::{ROLLOUT_SETTINGS, SETTINGS};
use lagrangian::models::FAMILIES;
use lagrangian::settings::{Kind, Setting};
use serde_json::{Value, json};
use sha2::{Digest, Sha256};

use crate::content::hex;
use crate::error::Result;

/// Digits of a hash that name a folder: of 100 000 units two are the same with a probability below 10⁻⁹.
const DIGITS: usize = 16;

/// Increased when another meaning of a request or other bits follow from an equal text.
const VERSION: u32 = 3;

/// The name of the run folder of a fit in a sweep: a hash of the request in its normal form, of the roles and the hashes of its
/// recordings, and of their layout.
///
/// # Errors
/// [`Error::Library`](crate::Error::Library) for a value that a setting does not take.
pub fn unit_name(spec: FitSpec, data: &[(String, String)], layout: &str) -> Result<String> {
    spec.checked()?;
    let asked = json!({
        "version": (VERSION, env!("CARGO_PKG_VERSION")),
        "asked": normal(spec)?,
        "data": data,
        "layout": layout,
    });
    let mut name = hex(&Sha256::digest(asked.to_string().as_bytes()));
    name.truncate(DIGITS);
    Ok(name)
}

/// The request in its normal form: real-valued settings are written with a point, and settings that were not given are omitted.
fn normal(mut spec: FitSpec) -> Result<FitSpec> {
    for values in [&mut spec.settings, &mut spec.training, &mut spec.rollout] {
        values.retain(|_, value| !value.is_null());
        for (name, value) in values {
            let Some(setting) = setting(spec.family.as_deref(), name) else {
                continue;
            };
            setting.check(value)?;
            if matches!(setting.kind, Kind::Number(_) | Kind::Numbers(_)) {
                with_point(value);
            }
        }
    }
    Ok(spec)
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

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;
    use lagrangian::PrepareOptions;

    fn lnn(settings: Value) -> FitSpec {
        FitSpec {
            family: Some("lnn".into()),
            settings: settings.as_object().unwrap().clone(),
            ..FitSpec::default()
        }
    }

    #[test]
    fn a_unit_is_named_by_its_settings_data_and_layout() {
        let data = vec![("training".to_string(), "0f".to_string())];
        let name = |own: &FitSpec| unit_name(own.clone(), &data, "").unwrap();
        let own = lnn(json!({ "width": 16 }));
        assert_eq!(
            name(&own),
            name(&lnn(json!({ "width": 16, "layers": null })))
        );
        assert_ne!(name(&own), name(&lnn(json!({ "width": 17 }))));
        assert_ne!(name(&own), unit_name(own.clone(), &[], "").unwrap());
        assert_ne!(name(&own), unit_name(own, &data, "degrees = true").unwrap());
        let rate = |rate: Value| {
            let mut own = lnn(json!({}));
            own.training.insert("learning_rate".into(), rate);
            name(&own)
        };
        assert_eq!(rate(json!(1)), rate(json!(1.0)));
    }

    #[test]
    fn a_value_that_a_setting_does_not_take_has_no_unit() {
        assert!(unit_name(lnn(json!({ "width": 0 })), &[], "").is_err());
        let anything = FitSpec {
            family: None,
            ..lnn(json!({ "width": "x" }))
        };
        assert!(unit_name(anything, &[], "").is_err());
        for bad in [
            FitSpec {
                steps: Some(0),
                ..lnn(json!({}))
            },
            FitSpec {
                prepare: PrepareOptions {
                    validate_fraction: 1.0,
                    ..PrepareOptions::default()
                },
                ..lnn(json!({}))
            },
            FitSpec {
                steps: Some(3),
                seconds: Some(1.0),
                ..lnn(json!({}))
            },
        ] {
            assert!(unit_name(bad, &[], "").is_err());
        }
    }
}
