//! Particles in magnetic fields: a force that is no gradient and does no work, and who can learn it.

mod page;

use anyhow::{Result, anyhow};
use lagrangian::State;
use lagrangian::baseline::MlpConfig;
use lagrangian::experiment::magnetic::{
    Field, Orbit, acceleration_error, dataset, field_error, orbit,
};
use lagrangian::experiment::{beyond_delan, random_starts};
use lagrangian::lagrangian::analytic::AnalyticModel;
use lagrangian::lagrangian::{DelanConfig, LnnConfig};
use lagrangian::saved::Provenance;
use lagrangian::train::{Budget, Family, FitConfig, Learned, Loss};
use lagrangian_report::Role;
use serde_json::{Map, Value, json};

use super::spread::median;
use super::starts::best;
use super::{Course, Experiment, Findings, Setting};

pub(super) const EXPERIMENT: Experiment = Experiment {
    name: "magnetic",
    about: "charged particles in a uniform field and between magnetic mirrors: the field, the energy, the bounce",
    parts: None,
    run,
};

/// Samples that are learned from, and in a quick run.
const TRAIN: usize = 20_000;
const FEW: usize = 2_000;
/// Steps of a fit, and in a quick run.
const STEPS: usize = 5000;
const SHORT: usize = 100;
/// Circles of the long orbit, and in a quick run.
const CIRCLES: f64 = 100.0;
const TURNS: f64 = 20.0;
/// The states of the test are the same for all models and seeds.
const TEST_SEED: u64 = 1_000_003;

/// A family of models in the comparison.
struct Contestant {
    key: &'static str,
    name: &'static str,
    role: Role,
    family: fn() -> Box<dyn Family>,
}

const CONTESTANTS: &[Contestant] = &[
    Contestant {
        key: "lnn",
        name: "Lagrangian network, free",
        role: Role::Lnn,
        family: || Box::<dyn Family>::from(LnnConfig::default()),
    },
    Contestant {
        key: "delan_vector_potential",
        name: "deep Lagrangian network with A(q)·q̇",
        role: Role::Other(0),
        family: || delan(true),
    },
    Contestant {
        key: "delan",
        name: "deep Lagrangian network",
        role: Role::Other(1),
        family: || delan(false),
    },
    Contestant {
        key: "baseline",
        name: "plain network",
        role: Role::Baseline,
        family: || Box::<dyn Family>::from(MlpConfig::default()),
    },
];

fn delan(vector_potential: bool) -> Box<dyn Family> {
    Box::<dyn Family>::from(DelanConfig {
        vector_potential,
        ..DelanConfig::default()
    })
}

/// One family with one seed.
struct Fitted {
    acceleration: f64,
    /// NaN where there is no Lagrangian.
    field: f64,
    orbit: Orbit,
    /// Distance from the true orbit, m.
    distance: Vec<f64>,
    seconds: f64,
}

/// One family with all seeds.
struct Found {
    contestant: &'static Contestant,
    /// Why it cannot express the system, known before it was trained.
    cannot: Vec<&'static str>,
    runs: Vec<Fitted>,
}

impl Found {
    fn each(&self, value: fn(&Fitted) -> f64) -> Vec<f64> {
        self.runs.iter().map(value).collect()
    }

    fn json(&self) -> Value {
        let drifts = self.each(|r| r.orbit.drift());
        json!({
            "acceleration_error": self.each(|r| r.acceleration),
            "field_error": self.each(|r| r.field),
            "field_error_median": median(&self.each(|r| r.field)),
            "energy_drift": drifts,
            "energy_drift_median": median(&drifts),
            "largest_distance": self.each(Fitted::farthest),
            "seconds": self.each(|r| r.seconds),
            "cannot_express": self.cannot,
        })
    }
}

impl Fitted {
    fn farthest(&self) -> f64 {
        self.distance.iter().fold(0.0, |most, x| most.max(*x))
    }
}

/// One field with all families.
struct Measured {
    field: Field,
    truth: Orbit,
    found: Vec<Found>,
}

fn run(setting: &Setting, course: &mut Course) -> Result<Findings> {
    let fits = Field::ALL.len() * CONTESTANTS.len() * setting.seeds().len();
    course.plan(fits as f64);
    let mut all = Vec::new();
    for field in Field::ALL {
        all.push(measure(field, setting, course)?);
    }
    let mut figures = Map::new();
    for measured in &all {
        let own = measured
            .found
            .iter()
            .map(|f| (f.contestant.key.to_string(), f.json()));
        figures.insert(measured.field.name().into(), Value::Object(own.collect()));
    }
    figures.insert("circles".into(), json!(circles(setting)));
    Ok(Findings {
        figures: figures.into(),
        summary: page::summary(&all, circles(setting)),
        report: page::report(&all, circles(setting)),
    })
}

fn circles(setting: &Setting) -> f64 {
    if setting.args.quick { TURNS } else { CIRCLES }
}

fn measure(field: Field, setting: &Setting, course: &mut Course) -> Result<Measured> {
    let system = field.system()?;
    let truth = orbit(&*system, field, circles(setting))?;
    let states = random_starts(&*system, 20, TEST_SEED);
    let mut found = Vec::new();
    for contestant in CONTESTANTS {
        let cannot = cannot(contestant, &*system, &states);
        for reason in &cannot {
            let name = field.name();
            course.note(&format!(
                "{} cannot express the {name} field: {reason}",
                contestant.name
            ));
        }
        let runs = setting.seeds().into_iter();
        let runs = runs.map(|seed| one((field, &truth), contestant, (setting, seed), course));
        let runs = runs.collect::<Result<Vec<_>>>()?;
        found.push(Found {
            contestant,
            cannot,
            runs,
        });
    }
    Ok(Measured {
        field,
        truth,
        found,
    })
}

fn cannot(
    contestant: &Contestant,
    system: &dyn AnalyticModel,
    states: &[State],
) -> Vec<&'static str> {
    match (contestant.family)().downcast_ref::<DelanConfig>() {
        Some(config) => beyond_delan(system.lagrangian(), states, config.vector_potential),
        None => Vec::new(),
    }
}

fn one(
    (field, truth): (Field, &Orbit),
    contestant: &Contestant,
    (setting, seed): (&Setting, u64),
    course: &mut Course,
) -> Result<Fitted> {
    let (quick, system) = (setting.args.quick, field.system()?);
    let data = dataset(&*system, if quick { FEW } else { TRAIN }, seed)?;
    let steps = Budget::Steps(if quick { SHORT } else { STEPS });
    let config = FitConfig {
        family: (contestant.family)(),
        loss: Loss::Acceleration,
        budget: setting.args.seconds.map_or(steps, Budget::Seconds),
        batch: 128,
        seed,
        ..FitConfig::default()
    };
    let what = format!("{} field, {}, seed {seed}", field.name(), contestant.key);
    let best = best(&what, &data, &[config], course)?;
    let best = best.ok_or_else(|| anyhow!("{what}: no fit"))?;
    let model = &best.fit.model;
    let file = format!("{}-{}-{seed}.safetensors", field.name(), contestant.key);
    setting
        .folder
        .write(&file, &model.save(Provenance::of_seed(seed))?.to_bytes()?)?;
    let own = match model.lagrangian() {
        Some(lagrangian) if ["lnn", "delan"].contains(&model.family()) => {
            field_error(lagrangian, &*system, TEST_SEED)
        }
        _ => f64::NAN,
    };
    let orbit = orbit(model, field, circles(setting))?;
    Ok(Fitted {
        acceleration: acceleration_error(model, &*system, TEST_SEED),
        field: own,
        distance: orbit.distance(truth),
        orbit,
        seconds: best.seconds,
    })
}
