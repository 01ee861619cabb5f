//! The 2-joint arm that writes letters: torques of letters that no model has seen, learning curves, faster writing and
//! noisy torques, for learned Lagrangians, a plain network and the identified chain.

mod contestants;
mod data;
mod noise;
mod torque;

use anyhow::{Result, anyhow};
use lagrangian::TrainingTask;
use lagrangian::{Budget, Dataset, FitConfig, Learned, Loss, Model};
use lagrangian_report::Axis;

use crate::families::{MakeFamily, WIDTH, is_rigid};
use crate::harness::failure::Context;
use crate::harness::{Contestant, Experiment, Lab, less, more, neither, published};
use contestants::CONTESTANTS;
use data::valid_seconds;
pub use data::{Letter, Letters};
pub use torque::{TorqueError, error};

pub(crate) const EXPERIMENT: Experiment = Experiment {
    name: "letters",
    about: "2-joint arm: torques of unseen letters, learning curve, faster writing, noise",
    run,
    title: "Letters: the torques of a 2-joint arm",
    text: &[
        "17 letters to learn from; e, q and v are the test. Each model learns from (q, q̇, q̈, τ) alone; the parts of the \
         torque come from its own inverse dynamics. Data: characters.csv of the public deep_lagrangian_networks (MIT).",
        "The identified chain is given the structure of the arm and is the true model up to rounding, so its valid time is the \
         limit; a plain network of torques does not move, and one of accelerations stands in for it there.",
    ],
    quantities: &[
        less("torque_mse", "torque MSE", "N²m²"),
        less("inertial", "inertial", "N²m²"),
        less("coriolis", "Coriolis", "N²m²"),
        less("gravity", "gravity", "N²m²"),
        less("seconds_to_1_5e-5", "to 1.5e-5", "s"),
        less("seconds_to_1e-8", "to 1e-8", "s"),
        more("valid_seconds", "valid", "s"),
        less("error_over_noise_variance", "error / noise variance", ""),
    ],
    about_quantities: "Errors on the letters e, q, v: mean squares summed over the joints. Valid: seconds until ‖q − q̂‖² \
                       reaches 0.01 by RK4 under torques held between samples. Noisy torques: mean squared error against the \
                       clean torque over the variance of the noise (to reach: 0.3); the last damping is chosen for each seed \
                       by three letters held back. Published: the public code on the same split, torque errors as means over \
                       ten seeds of 20 000 steps.",
    details: &[
        less("torque_nmse", "torque nMSE", ""),
        neither("steps", "steps", ""),
        neither("train_seconds", "training", "s"),
    ],
    published: published! {
        "", "deep Lagrangian network, public code (177 s)", "torque_mse": 2.2e-5, "valid_seconds": 2.3;
        "", "black-box Lagrangian, public code", "torque_mse": 2.8e-5, "valid_seconds": 2.8;
        "", "plain network, public code", "torque_mse": 6.2e-4, "valid_seconds": 1.8;
    },
    ..Experiment::EMPTY
};

/// How many times as fast the test letters are written.
const SPEEDS: [f64; 7] = [1.0, 1.25, 1.5, 1.75, 2.0, 2.25, 2.5];
/// The error of the public code, and the one to reach, (N·m)².
const BOUNDS: [(&str, f64); 2] = [("seconds_to_1_5e-5", 1.5e-5), ("seconds_to_1e-8", 1e-8)];
/// Time of the forward network that stands in where a torque network cannot move, in parts of a main fit.
const COMPANION: f64 = 1.0 / 3.0;
/// Errors below this are those of the data's own rounding.
const LEAST: f64 = 1e-13;

/// How long: seconds of a main fit and of one of the curves, and numbers of training letters of the learning curve.
struct Plan {
    main: f64,
    short: f64,
    counts: &'static [usize],
}

impl Plan {
    fn of(lab: &Lab) -> Self {
        let usual = if lab.quick() { 1.5 } else { 60.0 };
        let main = lab.args.seconds.unwrap_or(usual);
        let (part, counts): (f64, &[usize]) = match lab.quick() {
            true => (0.2, &[1, 4, 17]),
            false => (0.1, &[1, 2, 3, 4, 6, 8, 12, 17]),
        };
        Self {
            main,
            short: part * main,
            counts,
        }
    }

    /// Expected seconds of the whole.
    fn seconds(&self, seeds: usize) -> f64 {
        let trained = CONTESTANTS.iter().filter(|c| !is_rigid(c.config)).count() as f64;
        let short = self.counts.len() + noise::LEVELS.len() * noise::CANDIDATES.len();
        seeds as f64 * ((trained + COMPANION) * self.main + trained * short as f64 * self.short)
    }
}

/// The settings of a fit of this length.
fn config(family: MakeFamily, seconds: f64, seed: u64) -> FitConfig {
    FitConfig {
        family: family(WIDTH),
        training: TrainingTask {
            loss: Loss::TORQUE,
            budget: Budget::Seconds(seconds),
            seed,
            validate_every: 10,
            ..TrainingTask::default()
        },
    }
}

/// The file of the letters in the reference data.
pub(crate) const FILE: &str = "characters/characters.csv";

/// The letters in a file; the error names the remedy.
pub(crate) fn read(file: &[u8]) -> Result<Letters> {
    let hint = "give the reference data with --data";
    Letters::read(file).context("cannot read the letters", hint)
}

fn run(lab: &mut Lab) -> Result<()> {
    let letters = read(&lab.data(FILE)?)?;
    let plan = Plan::of(lab);
    lab.progress.plan(plan.seconds(lab.seeds().len()));
    lab.setting("Time of a main fit", format!("{} s", plan.main));
    let short = format!("{} s", plan.short);
    lab.setting("Time of a fit of curves and noise", short);
    for who in &CONTESTANTS {
        lab.setting(who.name, (who.config)(WIDTH).summary());
        for seed in lab.seeds() {
            main_fit(lab, &letters, &plan, who, seed)?;
        }
    }
    for who in &CONTESTANTS {
        for seed in lab.seeds() {
            learning_curve(lab, &letters, &plan, who, seed)?;
        }
    }
    noise::measure(lab, &letters, plan.short)
}

fn begin(
    lab: &mut Lab,
    who: &Contestant<MakeFamily>,
    part: impl std::fmt::Display,
    seconds: f64,
) -> Result<()> {
    let part = format!("{}{part}", who.name);
    lab.begin_weighted(part, if is_rigid(who.config) { 0.0 } else { seconds })
}

fn mse(model: &dyn Model, letters: &[Letter]) -> f64 {
    error(model, letters).map_or(f64::NAN, |e| e.mse)
}

/// A family trained for the full time on all training letters.
fn main_fit(
    lab: &mut Lab,
    letters: &Letters,
    plan: &Plan,
    who: &Contestant<MakeFamily>,
    seed: u64,
) -> Result<()> {
    begin(lab, who, format_args!(", seed {seed}"), plan.main)?;
    let motions = letters.chosen(usize::MAX, 0);
    // Nothing is held back: the weights are those of the least training loss.
    let data = Dataset::new(letters.coordinates.clone(), &motions, &motions)?;
    let measure = |model: &Learned| mse(model, &letters.test);
    let config = config(who.config, plan.main, seed);
    let (fitted, history) = lab.fit_with_history(&data, &config, &measure)?;
    let model = &fitted.model;
    lab.save(who.key, model, seed)?;
    let valid = match model.moves() {
        true => valid_seconds(model, &letters.test)?,
        false => {
            let seconds = COMPANION * plan.main;
            let part = format_args!(", seed {seed}, forward");
            begin(lab, who, part, seconds)?;
            let mut forward = config;
            forward.loss = Loss::ACCELERATION;
            forward.budget = Budget::Seconds(seconds);
            valid_seconds(&lab.fit(&data, &forward)?.model, &letters.test)?
        }
    };
    let error =
        error(model, &letters.test).ok_or_else(|| anyhow!("the {} has no torques", who.name))?;
    let row = lab.row("", who);
    row.add("torque_mse", error.mse)
        .add("torque_nmse", error.nmse)
        .add("inertial", error.inertial)
        .add("coriolis", error.coriolis)
        .add("gravity", error.gravity)
        .add("valid_seconds", valid)
        .add("steps", fitted.steps as f64)
        .add("train_seconds", fitted.seconds);
    for (name, bound) in BOUNDS {
        row.add(name, history.seconds_to(bound));
    }
    draw(lab, letters, plan, who, model, &history);
    Ok(())
}

/// The error over the time of training, and over the speed of writing.
fn draw(
    lab: &mut Lab,
    letters: &Letters,
    plan: &Plan,
    who: &Contestant<MakeFamily>,
    model: &Learned,
    history: &crate::harness::History,
) {
    if !is_rigid(who.config) {
        let at = |k: i32| 0.005 * plan.main * 200.0_f64.powf(f64::from(k) / 119.0);
        let times: Vec<f64> = (0..120).map(at).collect();
        let values = times.iter().map(|t| history.at(*t)).collect();
        let caption = "Torque MSE on the test letters of the best model so far. The measurement comes after the fit \
                           and steers nothing.";
        lab.plot("over-time", "Error over training time")
            .caption(caption)
            .x(Axis::log("training time", "s"))
            .y(Axis::log("torque MSE", "N²m²"))
            .add(who.name, who.role, &times, values);
    }
    let nmse = |speed: &f64| {
        let fast: Vec<Letter> = letters.test.iter().map(|l| l.faster(*speed)).collect();
        error(model, &fast).map_or(f64::NAN, |e| e.nmse)
    };
    let errors: Vec<f64> = SPEEDS.iter().map(nmse).collect();
    lab.row("", who).detail("faster_nmse", &errors);
    let caption = "Torque error on the test letters written faster, q(t) → q(αt), as a part of the variance of the \
                       torque that this needs (inertial and Coriolis parts times α²: exact).";
    lab.plot("faster", "Faster than trained")
        .caption(caption)
        .x(Axis::linear("times as fast", ""))
        .y(Axis::log("torque nMSE", ""))
        .add(who.name, who.role, &SPEEDS, above_rounding(&errors));
}

/// Errors that are not rounding: an axis would stretch to those.
fn above_rounding(errors: &[f64]) -> Vec<f64> {
    let errors = errors.iter();
    errors
        .map(|e| if *e < LEAST { f64::NAN } else { *e })
        .collect()
}

/// The torque error over the number of letters to learn from, chosen by the seed.
fn learning_curve(
    lab: &mut Lab,
    letters: &Letters,
    plan: &Plan,
    who: &Contestant<MakeFamily>,
    seed: u64,
) -> Result<()> {
    let mut errors = Vec::new();
    for &count in plan.counts {
        let part = format_args!(" from {count} letters, seed {seed}");
        begin(lab, who, part, plan.short)?;
        let motions = letters.chosen(count, seed);
        let data = Dataset::new(letters.coordinates.clone(), &motions, &motions)?;
        let fitted = lab.fit(&data, &config(who.config, plan.short, seed))?;
        errors.push(mse(&fitted.model, &letters.test));
    }
    lab.row("", who).detail("learning_curve", &errors);
    let counts: Vec<f64> = plan.counts.iter().map(|count| *count as f64).collect();
    let caption = "Torque MSE on the test letters over the number of letters to learn from, above the rounding of the \
                       data.";
    lab.plot("learning-curve", "Learning curve")
        .caption(caption)
        .x(Axis::log("training letters", ""))
        .y(Axis::log("torque MSE", "N²m²"))
        .add(who.name, who.role, &counts, above_rounding(&errors));
    Ok(())
}
