//! Chains of 1, 2, 3 and 5 pendulums from few short pieces of motion, against the published figures.

mod contestants;
mod learning;
mod page;

use anyhow::Result;
use lagrangian::experiment::chains::{
    SAMPLES, Score, chain, floor, motions, predictions, score, test_starts,
};
use lagrangian::lagrangian::analytic::Chart;
use lagrangian::rollout::Rollout;
use lagrangian::train::{Budget, FitConfig, RolloutLoss};
use lagrangian::{State, Trajectory};
use serde_json::{Value, json};

use super::{Course, Experiment, Findings, Setting};
use crate::failure::mistake;
use contestants::{CONTESTANTS, Contestant};
use learning::{Teaching, learn};

pub(super) const EXPERIMENT: Experiment = Experiment {
    name: "chains",
    about: "chains of pendulums from 800 short pieces of motion, beside the published figures",
    parts: Some("the number of links, 1 to 7"),
    run,
};

/// Chunks to learn from and to choose weights by, motions to judge by (Finzi, Wang, Wilson 2020).
const TRAIN: usize = 800;
const HELD: usize = 100;
const TEST: usize = 100;
/// As many times more chunks show what data bring.
const MORE: usize = 10;

/// Seeds that all are judged by.
const TEST_SEED: u64 = 1_000_003;

/// How long, how often.
struct Plan {
    seeds: Vec<u64>,
    links: Vec<usize>,
    teachings: Vec<Teaching>,
    test: usize,
    seconds: Option<f64>,
    quick: bool,
}

impl Plan {
    fn of(setting: &Setting) -> Result<Self> {
        let quick = setting.args.quick;
        let usual: &[usize] = if quick { &[1, 2] } else { &[1, 2, 3, 5] };
        let links = match &setting.args.only {
            None => usual.to_vec(),
            Some(part) => vec![only(part)?],
        };
        Ok(Self {
            seeds: setting.seeds(),
            links,
            teachings: if quick {
                vec![Teaching::Exact, Teaching::States]
            } else {
                vec![Teaching::Exact, Teaching::States, Teaching::More]
            },
            test: if quick { 20 } else { TEST },
            seconds: setting.args.seconds,
            quick,
        })
    }

    /// Budget of a fit: steps, so that it is the same on every machine, or the seconds that are asked for.
    fn budget(&self, links: usize) -> Budget {
        let steps = match links {
            _ if self.quick => 25,
            ..5 => 600,
            _ => 1000,
        };
        self.seconds.map_or(Budget::Steps(steps), Budget::Seconds)
    }

    /// Samples of a step: fewer of many coordinates, since its cost grows with the square of the residuals.
    fn batch(links: usize) -> usize {
        if links < 5 { 256 } else { 128 }
    }

    fn whole(&self) -> f64 {
        let fits = self.seeds.len() * self.teachings.len() * CONTESTANTS.len();
        let each = |links: &usize| weight(*links);
        fits as f64 * self.links.iter().map(each).sum::<f64>()
    }
}

/// How long a fit takes, in units of that to one link.
fn weight(links: usize) -> f64 {
    (links * links) as f64
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

/// What models of one chain achieve.
struct Found {
    links: usize,
    floor: Score,
    models: Vec<Model>,
}

struct Model {
    contestant: &'static Contestant,
    teaching: Teaching,
    /// One a seed.
    scores: Vec<Score>,
}

impl Model {
    fn errors(&self) -> Vec<f64> {
        self.scores.iter().map(|score| score.error).collect()
    }
}

/// What predictions are judged by.
struct Test {
    starts: Vec<State>,
    truth: Vec<Rollout>,
}

fn run(setting: &Setting, course: &mut Course) -> Result<Findings> {
    let plan = Plan::of(setting)?;
    course.plan(plan.whole());
    let mut found = Vec::new();
    for &links in &plan.links {
        found.push(measure(links, &plan, course)?);
    }
    Ok(Findings {
        figures: json!({
            "chains": found.iter().map(json).collect::<Vec<_>>(),
            "published": page::published_json(),
            "train_chunks": TRAIN,
        }),
        summary: page::summary(&found),
        report: page::report(&plan, &found),
    })
}

fn measure(links: usize, plan: &Plan, course: &mut Course) -> Result<Found> {
    let starts = test_starts(links, plan.test, TEST_SEED)?;
    let truth = predictions(&chain(links, Chart::Own)?, &Chart::Own, &starts)?;
    let floor = floor(links, &starts, &truth, TEST_SEED + 1)?;
    let test = Test { starts, truth };
    let mut models = Vec::new();
    for &teaching in &plan.teachings {
        let learns = |c: &&Contestant| c.teachings.contains(&teaching);
        for contestant in CONTESTANTS.iter().filter(learns) {
            let scores = plan
                .seeds
                .iter()
                .map(|&seed| one((links, seed), (contestant, teaching), &test, plan, course))
                .collect::<Result<_>>()?;
            models.push(Model {
                contestant,
                teaching,
                scores,
            });
        }
    }
    Ok(Found {
        links,
        floor,
        models,
    })
}

fn one(
    (links, seed): (usize, u64),
    (contestant, teaching): (&Contestant, Teaching),
    test: &Test,
    plan: &Plan,
    course: &mut Course,
) -> Result<Score> {
    let part = format!(
        "{links} links, {}, {}, seed {seed}",
        contestant.name,
        teaching.name()
    );
    course.begin(part, weight(links))?;
    let chunks = |count: usize, seed: u64| -> Result<Vec<Trajectory>> {
        Ok(motions(links, contestant.chart(), count, seed)?)
    };
    let count = if teaching == Teaching::More {
        MORE * TRAIN
    } else {
        TRAIN
    };
    let (train, held) = (chunks(count, 2 * seed)?, chunks(HELD, 2 * seed + 1)?);
    let truth = chain(links, contestant.chart())?;
    let config = FitConfig {
        family: (contestant.family)(links),
        budget: plan.budget(links),
        batch: Plan::batch(links),
        seed,
        validate_every: 10,
        loss: contestant.loss,
        rollout: RolloutLoss {
            horizon: SAMPLES - 1,
            ..RolloutLoss::default()
        },
        ..FitConfig::default()
    };
    let model = learn(&truth, &config, teaching, (train, held), course)?;
    let predicted = predictions(&model, &contestant.chart(), &test.starts)?;
    Ok(score(&predicted, &contestant.chart(), &test.truth))
}

fn json(found: &Found) -> Value {
    let mut models = json!({});
    for model in &found.models {
        models[model.contestant.key][model.teaching.key()] = json!({
            "error": model.errors(),
            "over_time": model.scores.iter().map(|s| &s.over_time).collect::<Vec<_>>(),
            "unfinished": model.scores.iter().map(|s| s.unfinished).collect::<Vec<_>>(),
        });
    }
    json!({ "links": found.links, "floor": found.floor, "models": models })
}
