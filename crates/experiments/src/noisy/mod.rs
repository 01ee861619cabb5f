//! Noisy recordings: fits of estimated accelerations against fits through an integrator.

mod protocol;

use anyhow::Result;
use lagrangian::analytic::by_name;
use lagrangian::models::{Family, Order};
use lagrangian::train::{AdamConfig, RolloutLoss, Start};
use lagrangian::{FitConfig, Loss, Optimizer, TrainingTask};
use lagrangian_report::Axis;

use crate::families::{self, MakeFamily};
use crate::harness::{Contestant, Experiment, Lab, contestants, less, more, neither};
use protocol::{Errors, Protocol, errors, record};

pub(crate) const EXPERIMENT: Experiment = Experiment {
    name: "noisy",
    about: "models of noisy recordings: estimated accelerations against the rollout loss",
    run,
    title: "Models of noisy recordings",
    text: &[
        "White noise on positions and velocities, samples 0.05 s apart. A fit of accelerations has to estimate them from \
         noisy velocities first. The rollout loss compares states after k samples instead, through the integrator; with \
         free starts the state that each segment begins at is learned with the weights.",
    ],
    quantities: &[
        less("acceleration", "error of q̈", ""),
        more("valid", "valid prediction", "s"),
        more("valid_quarter_step", "at ¼ step", "s"),
        more("valid_four_steps", "at 4 steps", "s"),
        neither("seconds", "training", "s"),
    ],
    about_quantities: "Error of the accelerations along true motions over their root mean square; valid prediction time (of \
                       10 s) with the model integrated exactly, and by rk4 with steps of a quarter of and four times that \
                       of the data.",
    ..Experiment::EMPTY
};

/// Systems with the number of their recordings.
const SYSTEMS: [(&str, usize); 2] = [("pendulum", 10), ("double-pendulum", 40)];
const NOISE: [f64; 2] = [0.01, 0.05];
const STEP: f64 = 0.05;

/// How a family is fitted: the samples that are predicted, and whether starts are free; `None` fits accelerations.
type Prediction = Option<(usize, Start)>;

/// Names of the losses, in tables and below the axis of figures.
const LOSSES: [(&str, &str, Prediction); 5] = [
    ("accelerations", "q̈", None),
    ("k = 1", "1", Some((1, Start::Recorded))),
    ("k = 5", "5", Some((5, Start::Recorded))),
    ("k = 20", "20", Some((20, Start::Recorded))),
    ("k = 20, free starts", "20 free", Some((20, Start::Free))),
];

/// Units of a layer: few for Lagrangians of noisy data, as `lagrangian fit` takes them.
const NARROW: usize = 16;
const WIDTH: usize = 32;

const FAMILIES: [Contestant<MakeFamily>; 4] = contestants! {
    "lnn", "LNN", Lnn, |_| families::convex(NARROW);
    "delan", "DeLaN", Other(0), |_| families::delan(NARROW);
    "neural_ode", "neural ODE", Baseline, |width| families::neural_ode(Order::Second, width);
    "neural_ode_1", "neural ODE, order 1", Other(1), |width| families::neural_ode(Order::First, width);
};

fn config(family: Box<dyn Family>, prediction: Prediction, lab: &Lab, seed: u64) -> FitConfig {
    let every = if lab.quick() { 5 } else { 10 };
    let usual = FitConfig {
        family,
        training: TrainingTask {
            validate_every: every,
            seed,
            ..TrainingTask::default()
        },
    };
    match prediction {
        None => FitConfig {
            training: TrainingTask {
                loss: Loss::ACCELERATION,
                optimizer: Optimizer::Adam(AdamConfig::default()),
                budget: lab.budget(1000, 150),
                batch: 256,
                ..usual.training
            },
            ..usual
        },
        Some((horizon, start)) => FitConfig {
            training: TrainingTask {
                loss: Loss::ROLLOUT,
                rollout: RolloutLoss {
                    horizon,
                    start,
                    growth: if horizon > 1 { 0.6 } else { 0.0 },
                    warm_start: 0.1,
                    ..RolloutLoss::default()
                },
                optimizer: families::natural(1e-4),
                budget: lab.budget(100, 15),
                batch: 128,
                ..usual.training
            },
            ..usual
        },
    }
}

fn run(lab: &mut Lab) -> Result<()> {
    let kept = if lab.quick() { 1 } else { 2 };
    let cells = kept * kept * FAMILIES.len() * LOSSES.len();
    lab.plan(cells * lab.seeds().len());
    for (name, recordings) in SYSTEMS.into_iter().take(kept) {
        for noise in NOISE.into_iter().take(kept) {
            let protocol = Protocol {
                recordings: if lab.quick() { 4 } else { recordings },
                duration: 6.0,
                step: STEP,
                noise,
                tests: if lab.quick() { 4 } else { 20 },
                test_duration: 10.0,
            };
            measure(lab, name, &protocol)?;
        }
    }
    Ok(())
}

fn measure(lab: &mut Lab, system: &str, protocol: &Protocol) -> Result<()> {
    let group = format!("{system}, {} % noise", 100.0 * protocol.noise);
    for seed in lab.seeds() {
        let data = record(&*by_name(system, &[])?, protocol, seed)?;
        lab.setting(
            &format!("Error of estimated q̈, {group}, seed {seed}"),
            format!("{:.3}", data.estimate_error),
        );
        for family in &FAMILIES {
            let mut along = Vec::new();
            for (loss, _, prediction) in LOSSES {
                lab.begin(format!("{group}, {}, {loss}", family.name))?;
                let config = config((family.config)(WIDTH), prediction, lab, seed);
                let fitted = lab.fit(&data.dataset, &config)?;
                let errors = errors(&fitted.model, &data.truth, STEP)?;
                lab.variant(&group, family, [loss; 2])
                    .add("acceleration", errors.acceleration)
                    .add("valid", errors.valid)
                    .add("valid_quarter_step", errors.steps[0].1)
                    .add("valid_four_steps", errors.steps[2].1)
                    .add("seconds", fitted.seconds);
                along.push(errors);
            }
            draw(lab, &group, family, &along);
        }
    }
    Ok(())
}

/// Errors and valid times over the losses, and valid times over the step of the rollout.
fn draw(lab: &mut Lab, group: &str, family: &Contestant<MakeFamily>, along: &[Errors]) {
    let id = group.replace([',', '%', ' '], "");
    let places: Vec<f64> = (0..along.len()).map(|k| k as f64).collect();
    let mut plot = |what: &str, title: &str, [x, y]: [Axis; 2], values: (&[f64], Vec<f64>)| {
        let caption =
            "q̈: fitted to estimated accelerations; otherwise the samples that a rollout predicts.";
        lab.plot(format!("{what}-{id}"), format!("{title}: {group}"))
            .caption(caption)
            .x(x)
            .y(y)
            .add(family.name, family.role, values.0, values.1);
    };
    let losses = || Axis::of_names("what is fitted", LOSSES.map(|loss| loss.1.into()).to_vec());
    let error = along.iter().map(|e| 100.0 * e.acceleration).collect();
    let axes = [losses(), Axis::log("error of clean accelerations", "%")];
    plot("error", "Accelerations", axes, (&places, error));
    let valid = || Axis::linear("valid prediction time", "s");
    let seconds = along.iter().map(|e| e.valid).collect();
    let axes = [losses(), valid()];
    plot("valid", "Prediction", axes, (&places, seconds));
    let (x, y): (Vec<f64>, Vec<f64>) = along[2].steps.iter().copied().unzip();
    let step = Axis::log("step of rk4 over that of the data, fitted with k = 5", "");
    plot("steps", "Other steps", [step, valid()], (&x, y));
}
