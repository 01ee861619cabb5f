//! Which optimiser reaches which error in which time.

mod clock;
mod found;
mod page;

use std::fs;
use std::ops::ControlFlow;

use anyhow::Result;
use lagrangian::experiment::letters::Letters;
use lagrangian::experiment::optimizers::{Group, Limit, RECIPES, Recipe, Run, Task, descend};
use serde_json::json;

use super::{Course, Experiment, Findings, Setting};
use crate::failure::{Advise, mistake};
use found::{Found, Line, Runs};

pub(super) const EXPERIMENT: Experiment = Experiment {
    name: "optimizers",
    about: "which optimiser reaches which error in which time: double pendulum and letters",
    parts: Some("TASK, RECIPE or TASK:RECIPE"),
    run,
};

/// The table of figures for a document, in the folder of the run.
const TABLE: &str = "table.md";
/// Names of the tasks on the command line; `letters` becomes `arm` where there are no letters.
const TASKS: [&str; 4] = [
    "double-pendulum",
    "letters",
    "double-pendulum-wide",
    "letters-wide",
];
/// Units of each layer, and of those of the wide networks.
const WIDTHS: [usize; 2] = [64, 512];
/// Recipes of a quick look.
const QUICK: [&str; 6] = [
    "default",
    "momentum-0",
    "batch-64",
    "growth-256-loss",
    "adam-f32",
    "polished-0.1",
];
/// Batches that are tried with wide networks beside the methods.
const WIDE: [&str; 3] = ["batch-64", "batch-64-512", "growth-256-loss"];

/// How long, how often.
struct Plan {
    seeds: Vec<u64>,
    tasks: Vec<&'static str>,
    recipe: Option<&'static str>,
    /// Of a run, and how many times as long a wide network is given.
    seconds: f64,
    wide: f64,
    /// Of the runs of equal length.
    steps: usize,
    quick: bool,
}

impl Plan {
    fn of(setting: &Setting) -> Result<Self> {
        let quick = setting.args.quick;
        let (task, recipe) = chosen(setting.args.only.as_deref())?;
        let all = if quick { &TASKS[..2] } else { &TASKS[..] };
        let given = setting.args.seconds;
        Ok(Self {
            seeds: setting.seeds(),
            tasks: task.map_or(all.to_vec(), |task| vec![task]),
            recipe,
            seconds: given.unwrap_or(if quick { 0.3 } else { 2.0 }),
            wide: 3.0,
            steps: if quick { 25 } else { 100 },
            quick,
        })
    }

    /// The recipes of a task.
    fn recipes(&self, task: &str) -> Vec<&'static Recipe> {
        let wide = is_wide(task);
        let methods = |r: &Recipe| matches!(r.group, Group::Default | Group::Method);
        let wanted = |r: &&Recipe| match self.recipe {
            Some(key) => r.key == key,
            None if self.quick => QUICK.contains(&r.key),
            None => !wide || methods(r) || WIDE.contains(&r.key),
        };
        RECIPES.iter().filter(wanted).collect()
    }

    /// Seconds of a run.
    fn seconds_of(&self, task: &str) -> f64 {
        self.seconds * if is_wide(task) { self.wide } else { 1.0 }
    }

    /// Expected seconds of a task for one recipe and seed: two runs by time and one by steps.
    fn weight(&self, task: &str) -> f64 {
        1.75 * self.seconds_of(task)
    }
}

fn is_wide(task: &str) -> bool {
    task.ends_with("-wide")
}

/// The task and the recipe of `TASK`, `RECIPE` or `TASK:RECIPE`.
fn chosen(only: Option<&str>) -> Result<(Option<&'static str>, Option<&'static str>)> {
    let Some(only) = only else {
        return Ok((None, None));
    };
    let task = |name: &str| TASKS.into_iter().find(|task| *task == name);
    let recipe = |name: &str| RECIPES.iter().map(|r| r.key).find(|key| *key == name);
    let found = match only.split_once(':') {
        Some((left, right)) => (task(left), recipe(right)),
        None => (task(only), recipe(only)),
    };
    let complete = found.0.is_some() && found.1.is_some();
    if complete || (!only.contains(':') && (found.0.is_some() || found.1.is_some())) {
        return Ok(found);
    }
    let recipes: Vec<&str> = RECIPES.iter().map(|r| r.key).collect();
    Err(mistake(
        format!("there is neither a task nor a recipe '{only}'"),
        format!(
            "take a task ({}), a recipe ({}), or TASK:RECIPE",
            TASKS.join(", "),
            recipes.join(", ")
        ),
    ))
}

/// The letters, or the arm where their folder is absent.
fn robot(setting: &Setting, course: &Course, width: usize) -> Result<Task> {
    let folder = match setting.data("characters") {
        Ok(folder) => folder,
        Err(error) if setting.args.data.is_some() => return Err(error),
        Err(_) => {
            course.note(
                "the letters are skipped: there is no folder 'characters' of reference data (--data); \
                 a two-link arm takes their place",
            );
            return Ok(Task::arm(width)?);
        }
    };
    let path = folder.join("characters.csv");
    let shown = format!("cannot read '{}'", path.display());
    let file = fs::read(&path).advise(&shown, "check that the file may be read")?;
    let letters = Letters::read(&file).advise(shown, "give the reference data with --data")?;
    Ok(Task::letters(letters, width)?)
}

fn task(name: &str, setting: &Setting, course: &Course) -> Result<Task> {
    let width = WIDTHS[usize::from(is_wide(name))];
    match name.starts_with("double-pendulum") {
        true => Ok(Task::double_pendulum(width)?),
        false => robot(setting, course, width),
    }
}

/// One run of a recipe; `None` where it was interrupted.
fn one(
    task: &Task,
    recipe: &Recipe,
    at: (Limit, u64),
    course: &mut Course,
    part: (String, f64),
) -> Result<Run> {
    course.begin(part.0, part.1)?;
    let mut watch = |share: f64, loss: f64| {
        course.move_to(share, &format!("loss {loss:.1e}"));
        match course.interrupted() {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        }
    };
    let run = descend(task, recipe, at, &clock::seconds, &mut watch)?;
    course.check()?;
    Ok(run)
}

fn line(
    task: &Task,
    recipe: &'static Recipe,
    (plan, name): (&Plan, &str),
    course: &mut Course,
) -> Result<Line> {
    let seconds = plan.seconds_of(name);
    let limits = [
        (Limit::Seconds(seconds), 1.0),
        (Limit::Seconds(0.25 * seconds), 0.25),
        (Limit::Steps(plan.steps), 0.5),
    ];
    let mut runs = Runs::default();
    for &seed in &plan.seeds {
        let part = format!("{}: {}, seed {seed}", task.key, recipe.name);
        let mut found = Vec::new();
        // Equal steps are looked at once: their order is that of the whole runs.
        let count = if seed == plan.seeds[0] { 3 } else { 2 };
        for (limit, weight) in limits.into_iter().take(count) {
            let part = (part.clone(), weight * seconds);
            found.push(one(task, recipe, (limit, seed), course, part)?);
        }
        runs.push(found);
    }
    Ok(Line { recipe, runs })
}

fn run(setting: &Setting, course: &mut Course) -> Result<Findings> {
    let plan = Plan::of(setting)?;
    let weight = |task: &&str| plan.recipes(task).len() as f64 * plan.weight(task);
    course.plan(plan.seeds.len() as f64 * plan.tasks.iter().map(weight).sum::<f64>());
    let mut found = Vec::new();
    for &name in &plan.tasks {
        let task = task(name, setting, course)?;
        let recipes = plan.recipes(name).into_iter();
        let lines = recipes.map(|recipe| line(&task, recipe, (&plan, name), course));
        found.push(Found {
            lines: lines.collect::<Result<_>>()?,
            seconds: plan.seconds_of(name),
            steps: plan.steps,
            wide: is_wide(name),
            task,
        });
    }
    let tables: Vec<String> = found.iter().map(page::markdown).collect();
    setting.folder.write(TABLE, tables.join("\n").as_bytes())?;
    Ok(Findings {
        figures: json!({
            "clock": clock::NAME,
            "tasks": found.iter().map(Found::json).collect::<Vec<_>>(),
            "winners": found::winners(&found),
        }),
        summary: page::summary(&found),
        report: page::report(&plan, &found),
    })
}
