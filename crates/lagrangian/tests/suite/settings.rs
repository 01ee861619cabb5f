//! The tables of settings: a given setting changes a fit, or is refused.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::collections::BTreeMap;

use lagrangian::models::{Entry, FAMILIES};
use lagrangian::settings::{Kind, Setting, Values};
use lagrangian::{
    Coordinates, Dataset, FitConfig, LnnConfig, Optimizer, Provenance, Signals, Trajectory, fit,
};
use lagrangian::{
    FitSpec,
    fit::{ROLLOUT_SETTINGS, SETTINGS},
    train::DataFacts,
};
use serde_json::{Value, json};

/// The number of steps of a fit: some under a short horizon, some under the whole.
const STEPS: usize = 4;

/// Two coordinates that swing, free or under forces, with momenta, and with goals where forces are given.
fn dataset(forced: bool, positions: bool) -> Dataset {
    let (n, len) = (2, 24);
    let wave = |phase: f64| -> Vec<f64> {
        let at = |k: usize| (k / n) as f64 * 0.1 * (1.0 + 0.7 * (k % n) as f64) + phase;
        (0..len * n).map(|k| at(k).sin()).collect()
    };
    let motion = |phase: f64| {
        let signals = Signals {
            q: wave(phase),
            qd: wave(phase + 1.5),
            qdd: wave(phase + 3.1),
            p: wave(phase + 1.4),
            pd: wave(phase + 2.9),
            tau: if forced {
                wave(phase + 0.7)
            } else {
                Vec::new()
            },
            goal: wave(phase + 0.3),
            kp: vec![2.0; len * n],
            kd: vec![0.1; len * n],
            ..Signals::default()
        };
        let t = (0..len).map(|k| 0.1 * k as f64).collect();
        Trajectory::new("waves", t, signals)
    };
    let (train, held) = ([motion(0.0), motion(0.8)], [motion(1.9)]);
    match positions {
        true => Dataset::of_positions(Coordinates::angles(n), &train, &held, 1).unwrap(),
        false => Dataset::new(Coordinates::angles(n), &train, &held).unwrap(),
    }
}

/// Data and settings to which a setting is added.
struct Context {
    forced: bool,
    positions: bool,
    settings: Value,
    training: Value,
}

fn contexts(family: &str) -> Vec<Context> {
    let has = |name: &str| Entry::by_name(family).unwrap().has(name);
    // Settings for a quick fit; one family tries all kinds of friction where the request gives none.
    let settings = match (has("width"), has("friction")) {
        (true, _) => json!({ "width": 16 }),
        (_, true) => json!({ "friction": "m1" }),
        _ => json!({}),
    };
    let of = |forced, positions, training| Context {
        forced,
        positions,
        settings: settings.clone(),
        training,
    };
    let mut all = vec![
        of(false, false, json!({})),
        of(true, false, json!({})),
        of(false, true, json!({ "loss": "positions" })),
        of(true, false, json!({ "loss": "torque" })),
        of(false, false, json!({ "loss": "rollout", "batch": 24 })),
        of(
            false,
            false,
            json!({ "loss": "acceleration", "optimizer": "adam" }),
        ),
        of(
            false,
            false,
            json!({ "loss": "rollout", "optimizer": "adam" }),
        ),
    ];
    let limited = json!({ "speed_limit": 9.0 });
    if has("speed_limit") {
        let mut limit = of(false, false, json!({}));
        limit
            .settings
            .as_object_mut()
            .unwrap()
            .extend(limited.as_object().unwrap().clone());
        all.push(limit);
    }
    // A servo has no torques, and its fits are long.
    all.truncate(if has("friction") { 1 } else { all.len() });
    all
}

/// The settings of a fit with one more; `None` where they are refused.
fn chosen(
    family: &str,
    context: &Context,
    dataset: &Dataset,
    added: (&str, &str, &Value),
) -> Option<FitConfig> {
    let values = |table: &str, given: &Value| -> Values {
        let mut values = given.as_object().unwrap().clone();
        if table == added.0 {
            values.insert(added.1.into(), added.2.clone());
        }
        values
    };
    let request = FitSpec {
        family: Some(family.into()),
        settings: values("family", &context.settings),
        training: values("training", &context.training),
        rollout: values("rollout", &json!({})),
        steps: Some(STEPS),
        ..FitSpec::default()
    };
    let config = FitConfig::for_data(dataset, &[], &request).ok()?.config;
    config.validate(dataset).ok()?;
    Some(config)
}

/// The bits of all numbers of a fit; `None` where it is refused.
fn bits(dataset: &Dataset, config: &FitConfig) -> Option<Vec<u8>> {
    let fit = fit(dataset, config, None, &mut ()).ok()?;
    let saved = fit.model.save(Provenance::default()).unwrap();
    let tensors: BTreeMap<_, _> = saved.tensors.iter().collect();
    Some(
        tensors
            .values()
            .flat_map(|tensor| tensor.data())
            .flat_map(|x| x.to_le_bytes())
            .collect(),
    )
}

/// Values of a setting of which at most one is the default.
fn values(setting: &Setting) -> Vec<Value> {
    match setting.kind {
        Kind::Flag => vec![json!(true)],
        // The largest of them take seconds.
        Kind::Choice(names) if setting.name == "friction" => names
            .iter()
            .take(3)
            .map(|named| json!(named.name))
            .collect(),
        Kind::Choice(names) => names.iter().map(|named| json!(named.name)).collect(),
        Kind::Choices(names) => names.iter().map(|named| json!([named.name])).collect(),
        Kind::Integer { min, .. } if setting.name == "width" => {
            vec![json!(min + 15), json!(min + 31)]
        }
        Kind::Integer { min, .. } => vec![json!(min + 1), json!(min + 2)],
        // Weights for the residuals of a fit of torques are small.
        Kind::Number(_) if setting.name == "forward" => vec![json!(1e3), json!(1e6)],
        Kind::Number(range) if range.max < 1.0 => vec![json!(0.2), json!(0.7)],
        Kind::Number(_) => vec![json!(3.5), json!(7.5)],
        Kind::Numbers(_) => vec![json!([1.5, 0.5]), json!([2.5, 1.0])],
        Kind::Robot | Kind::Document(_) => Vec::new(),
    }
}

/// Whether a setting has an effect that five steps of a fit do not show; each with the reason.
fn unseen(family: &str, setting: &str) -> bool {
    match (family, setting) {
        // A fit ends early after 25 steps at the earliest.
        (_, "patience") => true,
        // Another number of searches finds the same joints of these waves.
        ("chain", "searches") => true,
        // … with accelerations that no added inertia makes better.
        ("chain", "forward") => true,
        _ => false,
    }
}

/// The settings of a family that change nothing of a fit in a context, each with its value.
fn idle_settings(entry: &Entry, context: &Context) -> Vec<String> {
    let dataset = dataset(context.forced, context.positions);
    let with = |added: (&str, &str, &Value)| chosen(entry.name, context, &dataset, added);
    let Some(base) = with(("", "", &Value::Null)) else {
        return Vec::new();
    };
    let Some(base_bits) = bits(&dataset, &base) else {
        return Vec::new();
    };
    let mut idle = Vec::new();
    let tables = [
        ("family", entry.settings),
        ("training", SETTINGS),
        ("rollout", ROLLOUT_SETTINGS),
    ];
    for (table, all) in tables {
        for setting in all.iter().filter(|row| !unseen(entry.name, row.name)) {
            let values = values(setting);
            let allowed = values.iter().filter_map(|value| {
                let config = with((table, setting.name, value))?;
                Some((value, config))
            });
            let allowed: Vec<_> = allowed.collect();
            // One value may be the automatic one.
            let others = allowed.iter().filter(|(_, config)| *config != base);
            let others: Vec<_> = others.collect();
            if allowed.len() > others.len() + 1 {
                idle.push(format!("{} is not read", setting.name));
            }
            for (value, config) in others {
                if bits(&dataset, config).as_ref() == Some(&base_bits) {
                    idle.push(format!("{} = {value}", setting.name));
                }
            }
        }
    }
    idle
}

#[test]
fn every_setting_changes_the_bits_of_a_fit_or_is_refused() {
    let mut idle = Vec::new();
    for entry in FAMILIES {
        for context in contexts(entry.name) {
            let found = idle_settings(entry, &context);
            let of = |setting| {
                let Context {
                    forced,
                    positions,
                    settings,
                    training,
                } = &context;
                format!(
                    "{} {setting} (forced {forced}, positions {positions}, {settings} {training})",
                    entry.name
                )
            };
            idle.extend(found.into_iter().map(of));
        }
    }
    assert!(
        idle.is_empty(),
        "{} settings change nothing:\n{}",
        idle.len(),
        idle.join("\n")
    );
}

#[test]
fn numbers_outside_their_bounds_are_refused_with_the_bounds() {
    for entry in FAMILIES {
        let tables = [
            ("family", entry.settings),
            ("training", SETTINGS),
            ("rollout", ROLLOUT_SETTINGS),
        ];
        for (table, setting) in tables
            .iter()
            .flat_map(|(t, all)| all.iter().map(move |s| (*t, s)))
        {
            let (beyond, bound) = match setting.kind {
                Kind::Integer { max, .. } => (json!(max + 1), max.to_string()),
                Kind::Number(range) => (json!(1e20), range.words()),
                Kind::Numbers(range) => (json!([1e20]), range.words()),
                _ => continue,
            };
            let mut request = FitSpec::of(entry.name);
            let values = match table {
                "family" => &mut request.settings,
                "training" => &mut request.training,
                _ => {
                    request.training.insert("loss".into(), json!("rollout"));
                    &mut request.rollout
                }
            };
            values.insert(setting.name.into(), beyond);
            let refused = request
                .choose(&DataFacts::default())
                .unwrap_err()
                .to_string();
            let is_named = refused.contains(setting.name) && refused.contains(&bound);
            assert!(is_named, "{} {}: {refused}", entry.name, setting.name);
        }
    }
}

#[test]
fn bounds_hold_for_settings_that_no_request_gave() {
    let config = FitConfig {
        family: LnnConfig {
            speed_limit: Some(1e20),
            ..LnnConfig::default()
        }
        .into(),
        ..FitConfig::default()
    };
    let refused = config
        .validate(&dataset(false, false))
        .unwrap_err()
        .to_string();
    assert!(
        refused.contains("speed_limit") && refused.contains("1e12"),
        "{refused}"
    );
    let mut config = FitConfig::default();
    if let Optimizer::Natural(natural) = &mut config.optimizer {
        natural.rate = 1e20;
    }
    assert!(config.validate(&dataset(false, false)).is_err());
}

#[test]
fn the_settings_of_a_fit_are_one_object_in_json_and_in_toml() {
    let config = lagrangian::FitConfig::default();
    let json = serde_json::to_string(&config).unwrap();
    assert!(json.contains(r#""batch":256"#), "{json}");
    let back: lagrangian::FitConfig = serde_json::from_str(&json).unwrap();
    assert_eq!(back, config);
    let text = toml::to_string(&config).unwrap();
    let back: lagrangian::FitConfig = toml::from_str(&text).unwrap();
    assert_eq!(back, config);
    let unknown = json.replacen(r#""batch":256"#, r#""batsch":256"#, 1);
    let refused = serde_json::from_str::<lagrangian::FitConfig>(&unknown);
    assert!(refused.unwrap_err().to_string().contains("batsch"));
}
