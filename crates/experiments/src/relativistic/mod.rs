//! Relativistic particles, the field drawn anew for each sample: what can express their Lagrangian, and what cannot.

mod contestants;
mod particle;

use anyhow::Result;
use lagrangian::trajectory::Samples;
use lagrangian::{Dataset, FitConfig, State};
use lagrangian_report::{Axis, Role};

use crate::data::{TEST_SEED, beyond_delan, lagrangian_of, two_samples};
use crate::harness::{Contestant, Experiment, Lab, contestant, less, neither, published};
use contestants::{CONTESTANTS, Recipe};
pub(crate) use particle::Particle;
use particle::{Sweep, recovered, samples, sweep, weighted_error, weighted_flow_error};

pub(crate) const EXPERIMENT: Experiment = Experiment {
    name: "relativistic",
    about: "relativistic particles, published and physical, in fields that differ from sample to sample",
    run,
    title: "Relativistic particles",
    text: &[
        "Speeds to 0.99999, a field g ~ 10 N(0, 1) for each sample. The field is a parameter: a coordinate that never moves. \
         A network sees its value, and the Euler–Lagrange equation holds it.",
        "Networks that are told the limit c see artanh(q̇/c) or arcsin(q̇/c), the Hamiltonian one arsinh of p over its \
         median. Short fits of several starts come first; their validation loss chooses the one that is continued.",
        "Without forces in the data a Lagrangian of one coordinate is far from unique: the momentum need not be the \
         textbook's even where every acceleration is right.",
    ],
    quantities: &[
        less("weighted_l1", "weighted error of q̈", "1/s"),
        less("momentum_unexplained", "1 − R² of p", ""),
        neither("seconds", "training", "s"),
    ],
    about_quantities: "Error of q̈ weighted by 1 + 1/√(1 − q̇²) (Cranmer et al. 2020, their notebooks), on samples that no \
                       fit has seen, and 1 − R² of the momentum p(q̇) up to its gauge at speeds to 0.99. Seconds: all \
                       starts of a seed.",
    published: published! {
        "published", "LNN", "weighted_l1": 7.9e-4;
        "published", "HNN on (q, q̇)", "weighted_l1": 0.41;
        "published", "HNN on (q, p)", "weighted_l1": 2.4e-4;
    },
    ..Experiment::EMPTY
};

/// The field in which accelerations and momenta are compared, 1/s.
const FIELD: f64 = 10.0;
/// The fastest speed of the data, and one up to which momenta are compared as well.
const FASTEST: f64 = 0.99999;
const FAST: f64 = 0.99;

/// What predicts no acceleration at all.
const NOTHING: Contestant = contestant("no_acceleration", "no acceleration", Role::Other(7), ());

fn run(lab: &mut Lab) -> Result<()> {
    let quick = lab.quick();
    let fits: usize = CONTESTANTS.iter().map(|who| who.config.fits(quick)).sum();
    lab.plan(fits * lab.seeds().len() * Particle::ALL.len());
    for particle in Particle::ALL {
        let test = samples(particle, 50_000, TEST_SEED);
        let system = particle.system();
        let truth = sweep(&*system, Some(system.lagrangian()), (FASTEST, FIELD));
        draw(lab, particle, ("truth", Role::Truth), &truth, &truth);
        for who in &CONTESTANTS {
            if who.key == "delan" {
                let reasons = beyond_delan(system.lagrangian(), &states(&test), false);
                lab.cannot(particle.name(), who, reasons);
            }
            for seed in lab.seeds() {
                measure(lab, particle, who, seed, (&test, &truth))?;
            }
        }
        let mut still = test.clone();
        still.qdd.fill(0.0);
        let error = weighted_error(&*system, &still);
        lab.row(particle.name(), &NOTHING).add("weighted_l1", error);
    }
    Ok(())
}

/// Some states, to ask of what a family can express.
fn states(samples: &Samples) -> Vec<State> {
    let rows = samples.q.chunks_exact(2).zip(samples.qd.chunks_exact(2));
    rows.take(20)
        .map(|(q, qd)| State::new(q.to_vec(), qd.to_vec()))
        .collect()
}

fn measure(
    lab: &mut Lab,
    particle: Particle,
    who: &Contestant<Recipe>,
    seed: u64,
    (test, truth): (&Samples, &Sweep),
) -> Result<()> {
    let (quick, budget) = (lab.quick(), lab.args.seconds);
    let count = if quick { 10_000 } else { 100_000 };
    let states = |count, seed| samples(particle, count, seed);
    let data = two_samples(particle.system().coordinates(), states, count, seed)?;
    let what = format!("{} particle, {}, seed {seed}", particle.name(), who.key);
    let trials = who.config.trials(seed, budget, quick);
    let (start, seeking) = match trials.is_empty() {
        true => (0, 0.0),
        false => {
            let clock = std::time::Instant::now();
            let start = best_start(lab, &what, &data, &trials)?;
            (start, clock.elapsed().as_secs_f64())
        }
    };
    lab.begin(what)?;
    let fit = lab.fit(&data, &who.config.full(start, seed, budget, quick))?;
    let model = &fit.model;
    lab.save(&format!("{}-{}", particle.name(), who.key), model, seed)?;
    // A network on (q, q̇) has no momenta.
    let error = match model.family() == "hnn" && model.lagrangian().is_some() {
        true => weighted_flow_error(model, particle, test),
        false => weighted_error(model, test),
    };
    let system = particle.system();
    let lagrangian = lagrangian_of(model);
    let r2 = |fastest: f64| {
        let truth = sweep(&*system, Some(system.lagrangian()), (fastest, FIELD));
        let own = sweep(model, lagrangian, (fastest, FIELD));
        lagrangian.map_or(f64::NAN, |_| recovered(&own.momentum, &truth.momentum).0)
    };
    lab.row(particle.name(), who)
        .add("weighted_l1", error)
        .add("momentum_unexplained", 1.0 - r2(FAST))
        .add("momentum_unexplained_all_speeds", 1.0 - r2(FASTEST))
        .add("seconds", seeking + fit.seconds)
        .detail("start", who.config.describe(start));
    if seed == lab.args.seed {
        let own = sweep(model, lagrangian, (FASTEST, FIELD));
        draw(lab, particle, (who.name, who.role), &own, truth);
    }
    Ok(())
}

/// The number of the fit of the least validation loss.
fn best_start(lab: &mut Lab, what: &str, data: &Dataset, trials: &[FitConfig]) -> Result<usize> {
    let mut best = (0, f64::INFINITY);
    for (k, config) in trials.iter().enumerate() {
        lab.begin(format!("{what}, start {} of {}", k + 1, trials.len()))?;
        let loss = lab.fit(data, config)?.best;
        if loss < best.1 {
            best = (k, loss);
        }
    }
    Ok(best.0)
}

/// Acceleration, mass and momentum over γ = 1/√(1 − v²), at speeds above 0.
fn draw(lab: &mut Lab, particle: Particle, (name, role): (&str, Role), own: &Sweep, truth: &Sweep) {
    let forward = (0..own.speed.len()).filter(|&k| own.speed[k] >= 0.0);
    let forward: Vec<usize> = forward.collect();
    let gamma = |&k: &usize| 1.0 / ((1.0 - own.speed[k]) * (1.0 + own.speed[k])).sqrt();
    let gammas: Vec<f64> = forward.iter().map(gamma).collect();
    let (masses, momenta) = (masses(own, truth), momenta(own, truth));
    let at = |values: &[f64]| -> Vec<f64> {
        let value = |&k: &usize| values.get(k).copied().unwrap_or(f64::NAN);
        forward.iter().map(value).collect()
    };
    let accelerations: Vec<f64> = own.acceleration.iter().map(|a| a.abs()).collect();
    let curves = [
        (
            "acceleration",
            "|q̈| in the field 10, at q = 0; a gap is a model without an acceleration.",
            Axis::log("|q̈|", "1/s").between(1e-13, 30.0),
            at(&accelerations),
        ),
        (
            "mass",
            "M = ∂p/∂q̇ in units of that at rest, since the scale of a Lagrangian is its gauge; a gap is a negative one.",
            Axis::log("M / M at rest", ""),
            at(&masses),
        ),
        (
            "momentum",
            "p less that at rest, with the scale of the gauge fitted at speeds below 0.99.",
            Axis::log("p", ""),
            at(&momenta),
        ),
    ];
    for (what, caption, y, values) in curves {
        lab.plot(
            format!("{what}-{}", particle.name()),
            format!("{what} of the {} particle", particle.name()),
        )
        .caption(caption)
        .x(Axis::log("γ = 1/√(1 − q̇²)", ""))
        .y(y)
        .add(name, role, &gammas, values);
    }
}

/// Masses with the scale that gives the true one at rest.
fn masses(own: &Sweep, truth: &Sweep) -> Vec<f64> {
    let middle = own.mass.len() / 2;
    let at_rest = truth.mass.get(middle).zip(own.mass.get(middle));
    let scale = at_rest.map_or(f64::NAN, |(t, m)| t / m);
    own.mass.iter().map(|m| m * scale).collect()
}

/// Momenta less that at rest, with the slope that fits the true ones best at speeds below 0.99.
fn momenta(own: &Sweep, truth: &Sweep) -> Vec<f64> {
    let slow = |s: &Sweep| -> Vec<f64> {
        let pairs = s.speed.iter().zip(&s.momentum);
        let slow = pairs.filter(|(v, _)| v.abs() < 0.99);
        slow.map(|(_, p)| *p).collect()
    };
    let (_, slope) = recovered(&slow(own), &slow(truth));
    let rest = own.momentum.get(own.momentum.len() / 2);
    let rest = rest.copied().unwrap_or(f64::NAN);
    own.momentum.iter().map(|p| (p - rest) * slope).collect()
}
