//! Relativistic particles, the field drawn anew for each sample: what can express their Lagrangian, and what cannot.

mod contestants;
mod page;

use anyhow::Result;
use lagrangian::State;
use lagrangian::experiment::beyond_delan;
use lagrangian::experiment::relativistic::{
    Particle, Sweep, dataset, recovered, samples, sweep, weighted_error, weighted_flow_error,
};
use lagrangian::hamiltonian::Hamiltonian;
use lagrangian::saved::Provenance;
use lagrangian::train::{Learned, Samples};
use serde_json::{Map, Value, json};

use super::spread::median;
use super::starts::best;
use super::{Course, Experiment, Findings, Setting};
use contestants::{CONTESTANTS, Contestant};

pub(super) const EXPERIMENT: Experiment = Experiment {
    name: "relativistic",
    about: "relativistic particles, published and physical, in fields that differ from sample to sample",
    parts: None,
    run,
};

/// Samples that are learned from, and in a quick run; samples that the error is measured on.
const TRAIN: usize = 100_000;
const FEW: usize = 10_000;
const TEST: usize = 50_000;
/// The test samples are the same for all models and seeds.
const TEST_SEED: u64 = 1_000_003;
/// The field in which accelerations and momenta are looked at, 1/s.
const FIELD: f64 = 10.0;
/// The fastest speed of the data, and one up to which momenta are compared as well.
const FASTEST: f64 = 0.99999;
const FAST: f64 = 0.99;

/// One family with one seed.
struct Fitted {
    /// Weighted error of q̈, 1/s.
    error: f64,
    /// R² of the momentum at speeds to `FAST` and to `FASTEST`.
    momentum: [f64; 2],
    sweep: Sweep,
    seconds: f64,
    /// The start that was chosen.
    start: String,
}

/// One family with all seeds.
struct Found {
    contestant: &'static Contestant,
    /// Why it cannot express the system, known before it was trained.
    cannot: Vec<&'static str>,
    runs: Vec<Fitted>,
}

impl Found {
    fn errors(&self) -> Vec<f64> {
        self.runs.iter().map(|r| r.error).collect()
    }

    fn momentum(&self, k: usize) -> Vec<f64> {
        self.runs.iter().map(|r| r.momentum[k]).collect()
    }

    fn seconds(&self) -> Vec<f64> {
        self.runs.iter().map(|r| r.seconds).collect()
    }

    /// The run whose error is the median, or nearly.
    fn typical(&self) -> Option<&Fitted> {
        let middle = median(&self.errors());
        let far = |r: &&Fitted| (r.error - middle).abs();
        self.runs.iter().min_by(|a, b| far(a).total_cmp(&far(b)))
    }

    fn json(&self) -> Value {
        json!({
            "weighted_l1": self.errors(),
            "weighted_l1_median": median(&self.errors()),
            "momentum_r2": self.momentum(0),
            "momentum_r2_all_speeds": self.momentum(1),
            "seconds": self.seconds(),
            "starts": self.runs.iter().map(|r| &r.start).collect::<Vec<_>>(),
            "cannot_express": self.cannot,
        })
    }
}

/// One particle with all families.
struct Measured {
    particle: Particle,
    truth: Sweep,
    /// Error of predicting no acceleration.
    nothing: f64,
    found: Vec<Found>,
}

fn run(setting: &Setting, course: &mut Course) -> Result<Findings> {
    let (seeds, quick) = (setting.seeds(), setting.args.quick);
    let fits = CONTESTANTS.iter().map(|c| c.fits(quick));
    course.plan((fits.sum::<usize>() * seeds.len() * Particle::ALL.len()) as f64);
    let mut all = Vec::new();
    for particle in Particle::ALL {
        all.push(measure(particle, setting, course)?);
    }
    Ok(Findings {
        figures: figures(&all),
        summary: page::summary(&all),
        report: page::report(&all, quick),
    })
}

fn measure(particle: Particle, setting: &Setting, course: &mut Course) -> Result<Measured> {
    let test = samples(particle, TEST, TEST_SEED);
    let system = particle.system();
    let mut still = test.clone();
    still.qdd.fill(0.0);
    let mut found = Vec::new();
    for contestant in CONTESTANTS {
        let cannot = match contestant.key {
            "delan" => beyond_delan(system.lagrangian(), &states(&test), false),
            _ => Vec::new(),
        };
        for reason in &cannot {
            let name = particle.name();
            course.note(&format!(
                "{} cannot express the {name} particle: {reason}",
                contestant.name
            ));
        }
        let runs = setting.seeds().into_iter();
        let runs = runs.map(|seed| one(particle, contestant, (setting, seed), &test, course));
        let runs = runs.collect::<Result<Vec<_>>>()?;
        found.push(Found {
            contestant,
            cannot,
            runs,
        });
    }
    Ok(Measured {
        particle,
        truth: sweep(&*system, Some(system.lagrangian()), (FASTEST, FIELD)),
        nothing: weighted_error(&*system, &still),
        found,
    })
}

/// Some states, to ask of what a family can express.
fn states(samples: &Samples) -> Vec<State> {
    let rows = samples.q.chunks_exact(2).zip(samples.qd.chunks_exact(2));
    rows.take(20)
        .map(|(q, qd)| State::new(q.to_vec(), qd.to_vec()))
        .collect()
}

fn one(
    particle: Particle,
    contestant: &Contestant,
    (setting, seed): (&Setting, u64),
    test: &Samples,
    course: &mut Course,
) -> Result<Fitted> {
    let quick = setting.args.quick;
    let data = dataset(particle, if quick { FEW } else { TRAIN }, seed)?;
    let what = format!(
        "{} particle, {}, seed {seed}",
        particle.name(),
        contestant.key
    );
    let seconds = setting.args.seconds;
    let trials = contestant.trials(seed, seconds, quick);
    let sought = best(&format!("{what}, seeking"), &data, &trials, course)?;
    let (start, trial_seconds) = sought.map_or((0, 0.0), |found| (found.start, found.seconds));
    let full = [contestant.full(start, seed, seconds, quick)];
    let best = best(&what, &data, &full, course)?;
    let best = best.ok_or_else(|| anyhow::anyhow!("{what}: no start"))?;
    let model = &best.fit.model;
    let file = format!("{}-{}-{seed}.safetensors", particle.name(), contestant.key);
    setting
        .folder
        .write(&file, &model.save(Provenance::of_seed(seed))?.to_bytes()?)?;
    let lagrangian = Contestant::lagrangian(model);
    let system = particle.system();
    let r2 = |fastest: f64| {
        let truth = sweep(&*system, Some(system.lagrangian()), (fastest, FIELD));
        let own = sweep(model, lagrangian, (fastest, FIELD));
        lagrangian.map_or(f64::NAN, |_| recovered(&own.momentum, &truth.momentum).0)
    };
    Ok(Fitted {
        // A network on (q, q̇) has no momenta.
        error: match model.family() == "hnn" && model.lagrangian().is_some() {
            true => weighted_flow_error(model, particle, test),
            false => weighted_error(model, test),
        },
        momentum: [r2(FAST), r2(FASTEST)],
        sweep: sweep(model, lagrangian, (FASTEST, FIELD)),
        seconds: trial_seconds + best.seconds,
        start: contestant.describe(start),
    })
}

/// The published particle's families at the top, as the published figures are for it; the physical one's below its
/// name.
fn figures(all: &[Measured]) -> Value {
    let mut figures = Map::new();
    for measured in all {
        let mut own: Map<String, Value> = Map::new();
        for found in &measured.found {
            let mut value = found.json();
            if measured.particle == Particle::Published {
                value["published_weighted_l1"] = json!(found.contestant.published);
            }
            own.insert(found.contestant.key.into(), value);
        }
        own.insert(
            "no_acceleration".into(),
            json!({ "weighted_l1": measured.nothing }),
        );
        if measured.particle == Particle::Published {
            figures.extend(own);
        } else {
            figures.insert(measured.particle.name().into(), own.into());
        }
    }
    figures.into()
}
