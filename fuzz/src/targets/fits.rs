//! Whole fits of a few steps with random settings: every table, at, within and beyond its bounds.

use lagrangian::models::{Entry, FAMILIES};
use lagrangian::rigid::RobotConfig;
use lagrangian::settings::{Kind, Range, Setting, Values};
use lagrangian::{
    Coordinates, Dataset, Fit, FitConfig, Loss, Model, Provenance, Signals, Trajectory, fit, rigid,
};
use lagrangian::{
    FitSpec,
    fit::{ROLLOUT_SETTINGS, SETTINGS},
    train::DataFacts,
};
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::{Value, json};

use crate::{Outcome, refused};

/// Steps of a fit.
const STEPS: usize = 5;
/// Samples of a motion.
const SAMPLES: usize = 24;
/// Settings whose work grows with them, and the largest value that is fitted: what is slow or large is no fault.
const COSTLY: [(&str, u64); 6] = [
    ("width", 48),
    ("layers", 4),
    ("searches", 1),
    ("horizon", 4),
    ("substeps", 4),
    ("batch", 64),
];

/// What is fitted: most settings of a request suit it.
struct Scene {
    /// The family; none where it is chosen.
    entry: Option<&'static Entry>,
    /// Coordinates.
    n: usize,
    /// The fastest velocity.
    speed: f64,
}

/// The seed of the settings, from the bytes.
pub fn fits(bytes: &[u8]) -> Outcome {
    let rng = &mut ChaCha8Rng::seed_from_u64(crc32fast::hash(bytes).into());
    let (scene, dataset) = scene(rng);
    let request = request(rng, &scene);
    // The settings of a request are refused with words, or make a fit.
    let candidates = FitConfig::candidates(&dataset, &[], &request).map_err(refused)?;
    let mut outcome = Ok(());
    for chosen in candidates {
        // Servos are searched for by simulations, seconds for each fit.
        if chosen.config.family.name() == "servo" {
            outcome = chosen.config.validate(&dataset).map_err(refused);
            continue;
        }
        match fit(&dataset, &chosen.config, None, &mut ()) {
            Ok(fit) => holds(&fit, &dataset),
            Err(why) => outcome = Err(refused(why)),
        }
    }
    outcome
}

/// What must hold of a fit, whatever its settings: it is saved, and is evaluated without a panic.
fn holds(fit: &Fit, dataset: &Dataset) {
    let saved = fit
        .model
        .save(Provenance::default())
        .expect("a fitted model is saved");
    saved.to_bytes().expect("a saved model has bytes");
    let (n, train) = (dataset.coordinates.dof(), &dataset.train);
    let (mut energy, mut tau) = ([0.0], vec![0.0; n]);
    let (q, qd, qdd) = (&train.q[..n], &train.qd[..n], &train.qdd[..n]);
    let mut evaluator = fit.model.evaluator();
    // Whether they are supported and finite they say themselves.
    let _ = evaluator.energy(q, qd, &mut energy);
    let _ = evaluator.inverse_dynamics(q, qd, qdd, &mut tau);
}

/// Waves of one to three coordinates, of very different sizes, free or forced, with goals or as positions alone: mostly what
/// the family is fitted to.
fn scene(rng: &mut impl Rng) -> (Scene, Dataset) {
    let known = rng.random_bool(0.9);
    let entry = known.then(|| &FAMILIES[rng.random_range(0..FAMILIES.len())]);
    let name = entry.map_or("", |entry| entry.name);
    let n = rng.random_range(1..=3_usize);
    let (size, rate) = (
        10f64.powi(rng.random_range(-3..=3)),
        10f64.powi(rng.random_range(-1..=2)),
    );
    let mut likely = |families: &[&str], otherwise: f64| {
        rng.random_bool(if families.contains(&name) {
            0.95
        } else {
            otherwise
        })
    };
    let forced = likely(&["chain", "rigid"], 0.5);
    let (goals, positions) = (likely(&["servo"], 0.1), likely(&["vin"], 0.03));
    let momenta = likely(&["hnn"], 0.1);
    let step = 0.1 / rate;
    let wave = |scale: f64, phase: f64| -> Vec<f64> {
        let at = |k: usize| (k / n) as f64 * 0.1 * (1.0 + 0.7 * (k % n) as f64) + phase;
        (0..SAMPLES * n).map(|k| scale * at(k).sin()).collect()
    };
    let given = |is: bool, values: Vec<f64>| if is { values } else { Vec::new() };
    let quarter = std::f64::consts::FRAC_PI_2;
    let motion = |name: &str, phase: f64| {
        let signals = Signals {
            q: wave(size, phase),
            qd: wave(size * rate, phase + quarter),
            qdd: wave(size * rate * rate, phase + 2.0 * quarter),
            p: given(momenta, wave(size * rate, phase + quarter)),
            pd: given(momenta, wave(size * rate * rate, phase + 2.0 * quarter)),
            tau: given(forced, wave(size * rate, phase + 1.0)),
            goal: given(goals, wave(size, phase + 0.2)),
            kp: given(goals, vec![1.0; SAMPLES * n]),
            kd: given(goals, vec![0.0; SAMPLES * n]),
            ..Signals::default()
        };
        let t = (0..SAMPLES).map(|k| k as f64 * step).collect();
        Trajectory::new(name, t, signals)
    };
    let (train, held) = (
        [motion("train", 0.0), motion("more", 0.9)],
        [motion("held", 1.7)],
    );
    let coordinates = match rng.random_bool(0.5) {
        true => Coordinates::angles(n),
        false => Coordinates::lines(n),
    };
    let made = match positions {
        true => Dataset::of_positions(coordinates, &train, &held, 1),
        false => Dataset::new(coordinates, &train, &held),
    };
    let speed = size * rate;
    let dataset = made.expect("the motions are complete");
    (Scene { entry, n, speed }, dataset)
}

fn request(rng: &mut impl Rng, scene: &Scene) -> FitSpec {
    let all = FAMILIES.iter().flat_map(|entry| entry.settings);
    let family: Vec<&Setting> = scene
        .entry
        .map_or_else(|| all.collect(), |e| e.settings.iter().collect());
    let abilities = scene.entry.map(|entry| (entry.default)().abilities());
    let share = rng.random_range(0.02..0.3);
    let of_training = match abilities {
        Some(able) if !able.solved => share,
        _ => 0.01,
    };
    let mut request = FitSpec {
        family: scene.entry.map(|entry| entry.name.into()),
        settings: drawn(rng, scene, family, share),
        training: drawn(rng, scene, SETTINGS, of_training),
        steps: Some(STEPS),
        seed: rng.random(),
        ..FitSpec::default()
    };
    let losses = abilities.map_or(&[][..], |able| able.losses);
    let given = |name: &str| request.training.contains_key(name);
    if given("loss") && !given("forward") && !losses.is_empty() && rng.random_bool(0.9) {
        let loss = losses[rng.random_range(0..losses.len())].name();
        request.training.insert("loss".into(), loss.into());
    }
    if rng.random_bool(0.1) && losses.contains(&Loss::ROLLOUT) {
        request.training.insert("loss".into(), "rollout".into());
    }
    // Most other losses have none of these settings.
    let loss = request.loss(&DataFacts::default()).map(|loss| loss.name());
    if loss.is_ok_and(|name| name == "rollout") || rng.random_bool(0.01) {
        request.rollout = drawn(rng, scene, ROLLOUT_SETTINGS, share);
        // The memory of this loss grows with the square of the evaluations of a rollout, and 20 steps are the default.
        let horizon = request.rollout.entry("horizon");
        horizon.or_insert_with(|| json!(rng.random_range(1..=4)));
    }
    let able = abilities.is_some_and(|able| able.nominal);
    if rng.random_bool(if able { 0.1 } else { 0.01 }) {
        let (name, joints) = robot(scene.n);
        (request.nominal, request.joints) = (Some(name.into()), joints);
    }
    request
}

/// Some settings of a table, each with this probability, and mostly with those that they need.
fn drawn<'a>(
    rng: &mut impl Rng,
    scene: &Scene,
    table: impl IntoIterator<Item = &'a Setting>,
    share: f64,
) -> Values {
    let table: Vec<&Setting> = table.into_iter().collect();
    let mut values = Values::new();
    for setting in &table {
        if !rng.random_bool(share) {
            continue;
        }
        values.insert(setting.name.into(), value(rng, scene, setting));
        let Some(need) = setting.needs.filter(|_| rng.random_bool(0.9)) else {
            continue;
        };
        let needed = table.iter().find(|other| other.name == need.setting);
        let met = match (need.values, needed) {
            ([], Some(needed)) => value(rng, scene, needed),
            ([], None) => continue,
            (values, _) => json!(values[rng.random_range(0..values.len())]),
        };
        values.insert(need.setting.into(), met);
    }
    values
}

/// A value of a setting: mostly within its bounds, else at one of them, beyond, or of another kind.
fn value(rng: &mut impl Rng, scene: &Scene, setting: &Setting) -> Value {
    if rng.random_bool(0.005) {
        return json!("of another kind");
    }
    match setting.kind {
        Kind::Flag => json!(rng.random_bool(0.8)),
        Kind::Choice(names) => json!(names[rng.random_range(0..names.len())].name),
        Kind::Choices(names) => {
            let chosen = names.iter().filter(|_| rng.random_bool(0.2));
            json!(chosen.map(|named| named.name).collect::<Vec<_>>())
        }
        Kind::Integer { min, max } => {
            let costly = COSTLY.iter().find(|(name, _)| *name == setting.name);
            let most = costly.map_or(max, |(_, most)| max.min(*most));
            match rng.random_range(0..200) {
                0 => json!(min.saturating_sub(1)),
                1 => json!(max.saturating_add(1)),
                2 => json!(u64::MAX),
                3..30 => json!(min),
                30..50 => json!(most),
                _ => json!(rng.random_range(min..=most.min(min.saturating_add(40)))),
            }
        }
        Kind::Number(_) if setting.name == "speed_limit" && rng.random_bool(0.9) => {
            json!(scene.speed * 10f64.powf(rng.random_range(0.3..2.5)))
        }
        Kind::Number(range) => json!(number(rng, range)),
        Kind::Numbers(range) => {
            let count = match rng.random_bool(0.9) {
                true => scene.n,
                false => rng.random_range(0..=3),
            };
            json!((0..count).map(|_| number(rng, range)).collect::<Vec<_>>())
        }
        Kind::Robot => described(scene.n).map_or(Value::Null, |robot| json!(robot)),
        Kind::Document(names) if rng.random_bool(0.5) => {
            json!(names[rng.random_range(0..names.len())].name)
        }
        Kind::Document(_) => json!([relation(rng, scene.n)]),
    }
}

/// A relation between coordinates, mostly one that motions do not keep.
fn relation(rng: &mut impl Rng, n: usize) -> Value {
    let i = rng.random_range(0..=n);
    let c = number(rng, Range::new(-10.0, 10.0));
    json!({ "name": "one", "slopes": [[i, 1.0]], "products": [[0, 0, c]], "constant": c })
}

fn number(rng: &mut impl Rng, Range { min, max }: Range) -> f64 {
    let least = min.max(1e-9);
    match rng.random_range(0..200) {
        0 => min - 1.0,
        1 => max * 1.01,
        2 => [1e20, 1e300, -1e300, 5e-324, -0.0][rng.random_range(0..5)],
        3..15 => min,
        15..30 => max,
        _ => least * (max / least).powf(rng.random_range(0.0..1.0)),
    }
}

/// The example of an arm of two links, one of which is locked where a single joint moves.
fn robot(n: usize) -> (&'static str, Vec<String>) {
    let joints = match n {
        1 => vec!["shoulder".to_string()],
        _ => Vec::new(),
    };
    ("two_link_arm", joints)
}

/// Its description as the value of a setting.
fn described(n: usize) -> Option<RobotConfig> {
    let (name, joints) = robot(n);
    RobotConfig::new(rigid::example(name)?, joints).ok()
}
