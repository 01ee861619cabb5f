//! Chains of 1, 2, 3 and 5 pendulums from few short pieces of motion, against the published errors.

mod contestants;
mod learning;
mod protocol;

use crate::chart::Chart;
use crate::data::{Chunks, TEST_SEED};
use anyhow::Result;
use lagrangian::text::counted;
use lagrangian::train::RolloutLoss;
use lagrangian::{FitConfig, Rollout, State, TrainingTask};
use lagrangian_report::{Axis, Role};

use crate::harness::failure::mistake;
use crate::harness::{Contestant, Experiment, Lab, Layout, contestant, less};
use contestants::{CONTESTANTS, PUBLISHED, Recipe};
use learning::{Teaching, learn};
use protocol::{INTERVAL, SAMPLES, Score, chain, floor, motions, predictions, score, test_starts};

pub(crate) const EXPERIMENT: Experiment = Experiment {
    name: "chains",
    about: "chains of pendulums from 800 short pieces of motion, beside the published errors",
    run,
    parts: Some("the number of links, 1 to 7"),
    title: "Chains of pendulums",
    text: &[
        "Learned from 800 pieces of motion of five samples; 100 test motions of 10 s. All networks: two hidden layers of 64 \
         units (96 for 5 links), natural gradient, batches of 256 samples (128 for 5 links). With accelerations: squared \
         errors of q̈. States alone: q̈ by Hermite interpolation, corrected twice by the model so far; absolute errors; 20, \
         20 and 60 % of the steps.",
    ],
    quantities: &[less("error", "relative error", "")],
    about_quantities: "Geometric mean over 100 steps of 0.1 s and all test motions of ‖ẑ − z‖/‖ẑ + z‖, z Cartesian positions \
                       and velocities. Published, from states alone: Finzi, Wang, Wilson 2020; their constrained network is \
                       given Cartesian coordinates and the rods. The floor is the truth restarted 10⁻⁴ away.",
    published: PUBLISHED,
    layout: Layout::Groups,
    ..Experiment::EMPTY
};

/// Pieces of motion to learn from and to choose weights by, and motions to test on (Finzi, Wang, Wilson 2020).
const TRAIN: usize = 800;
const HELD: usize = 100;
const TEST: usize = 100;
/// As many times more pieces show what data bring.
const MORE: usize = 10;

const FLOOR: Contestant = contestant("floor", "floor: truth restarted", Role::Truth, ());

/// What predictions are compared with.
struct Test {
    starts: Vec<State>,
    truth: Vec<Rollout>,
}

fn run(lab: &mut Lab) -> Result<()> {
    let usual: &[usize] = if lab.quick() { &[1, 2] } else { &[1, 2, 3, 5] };
    let chains = match &lab.args.only {
        None => usual.to_vec(),
        Some(part) => vec![only(part)?],
    };
    let teachings = &Teaching::ALL[..if lab.quick() { 2 } else { 3 }];
    let fits = lab.seeds().len() * teachings.len() * CONTESTANTS.len();
    lab.plan(fits * chains.iter().map(|links| links * links).sum::<usize>());
    for &links in &chains {
        let group = group(links);
        let starts = test_starts(links, if lab.quick() { 20 } else { TEST }, TEST_SEED)?;
        let truth = predictions(&chain(links, Chart::Own), &Chart::Own, &starts)?;
        let floor = floor(links, &starts, &truth, TEST_SEED + 1)?;
        lab.row(&group, &FLOOR).add("error", floor.error);
        let test = Test { starts, truth };
        for &teaching in teachings {
            draw(lab, links, teaching, (FLOOR.name, FLOOR.role), &floor);
            for who in CONTESTANTS
                .iter()
                .filter(|c| c.config.teachings.contains(&teaching))
            {
                for seed in lab.seeds() {
                    let score = measure(lab, links, (who, teaching), seed, &test)?;
                    lab.variant(&group, who, teaching.words())
                        .add("error", score.error)
                        .detail("over_time", &score.over_time)
                        .detail("unfinished", score.unfinished);
                    draw(lab, links, teaching, (who.name, who.role), &score);
                }
            }
        }
    }
    Ok(())
}

/// The number of links that `--only` asks for.
fn only(part: &str) -> Result<usize> {
    let links = part.parse().ok().filter(|links| (1..=7).contains(links));
    links.ok_or_else(|| {
        mistake(
            format!("there is no chain of '{part}' links"),
            "give --only a number from 1 to 7",
        )
    })
}

fn group(links: usize) -> String {
    counted(links, "pendulum")
}

fn config(lab: &Lab, recipe: &Recipe, links: usize, seed: u64) -> FitConfig {
    let steps = if links < 5 { 600 } else { 1000 };
    FitConfig {
        family: (recipe.family)(if links < 5 { 64 } else { 96 }),
        training: TrainingTask {
            // Steps, so that it is the same on every machine.
            budget: lab.budget(steps, 25), // Fewer of many coordinates, since the cost of a step grows with the square of the residuals.
            batch: if links < 5 { 256 } else { 128 },
            seed,
            validate_every: 10,
            loss: recipe.loss,
            rollout: RolloutLoss {
                horizon: SAMPLES - 1,
                ..RolloutLoss::default()
            },
            ..TrainingTask::default()
        },
    }
}

fn measure(
    lab: &mut Lab,
    links: usize,
    (who, teaching): (&Contestant<Recipe>, Teaching),
    seed: u64,
    test: &Test,
) -> Result<Score> {
    let [_, name] = teaching.words();
    let part = format!("{links} links, {}, {name}, seed {seed}", who.name);
    lab.begin_weighted(part, (links * links) as f64)?;
    let chart = who.config.chart();
    let count = match teaching {
        Teaching::More => MORE * TRAIN,
        _ => TRAIN,
    };
    let chunks = Chunks {
        train: motions(links, chart.clone(), count, 2 * seed)?,
        held: motions(links, chart.clone(), HELD, 2 * seed + 1)?,
    };
    let truth = chain(links, chart.clone());
    let config = config(lab, &who.config, links, seed);
    let model = learn(&truth, &config, teaching, &chunks, lab)?;
    let predicted = predictions(&model, &chart, &test.starts)?;
    Ok(score(&predicted, &chart, &test.truth))
}

/// Errors over time.
fn draw(
    lab: &mut Lab,
    links: usize,
    teaching: Teaching,
    (name, role): (&str, Role),
    score: &Score,
) {
    let [key, what] = teaching.words();
    let t = (0..score.over_time.len()).map(|k| INTERVAL * k as f64);
    let t: Vec<f64> = t.collect();
    let caption = "Geometric mean over the test motions; median and range of the seeds.";
    lab.plot(
        format!("over-time-{links}-{}", key.replace('_', "-")),
        format!("{}, {what}", group(links)),
    )
    .caption(caption)
    .x(Axis::linear("time", "s"))
    .y(Axis::log("relative error", "").between(1e-6, 1.0))
    .add(name, role, &t, score.over_time.clone());
}
