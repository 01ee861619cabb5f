//! The settings of a run in its record, `run.toml`.

use lagrangian::FitConfig;
use lagrangian::FitSpec;
use lagrangian::settings::Values;
use lagrangian::train::DataFacts;
use serde_json::Value;

use super::dataset;
use crate::{Outcome, refused, text};

/// Larger networks are described, but not made: that is work, and no new code.
const MOST_PARAMETERS: usize = 10_000;

/// Settings that were given, and those that followed from them.
pub fn settings(bytes: &[u8]) -> Outcome {
    let record: toml::Table = toml::from_str(text(bytes)?).map_err(|e| e.message().to_owned())?;
    let record = serde_json::to_value(record).map_err(refused)?;
    let given = request(&record["settings"]);
    let asked = given.choose(&DataFacts::default()).map_err(refused);
    let asked = asked.map(|chosen| used(chosen.config));
    let fits = record["resolved"]["fit"].as_object();
    for config in fits.into_iter().flatten().map(|(_, config)| config) {
        let config: FitConfig = serde_json::from_value(config.clone()).map_err(refused)?;
        used(config)?;
    }
    asked?
}

/// What the library is asked for by the settings of a record.
fn request(settings: &Value) -> FitSpec {
    let table = |name: &str| -> Values {
        let values = settings[name].as_object();
        values.cloned().unwrap_or_default()
    };
    let (mut family, mut training) = (table("model"), table("training"));
    let seconds = training.remove("seconds").and_then(|s| s.as_f64());
    FitSpec {
        family: family
            .remove("model")
            .and_then(|name| name.as_str().map(String::from)),
        settings: family,
        seed: training
            .remove("seed")
            .and_then(|seed| seed.as_u64())
            .unwrap_or(0),
        training,
        rollout: table("rollout"),
        seconds,
        ..FitSpec::default()
    }
}

/// Settings come back the same, and are refused or give a model.
fn used(config: FitConfig) -> Outcome {
    let written = serde_json::to_value(&config).map_err(refused)?;
    let again: FitConfig = serde_json::from_value(written).expect("written settings are read");
    assert_eq!(again, config, "settings come back the same");
    config.validate(dataset()).map_err(refused)?;
    let training = config.trainable(dataset()).map_err(refused)?;
    if training.parameters() <= MOST_PARAMETERS {
        let parameters = training.initialise(config.seed);
        training.assemble(&parameters).map_err(refused)?;
    }
    Ok(())
}
