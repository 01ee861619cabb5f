//! The measurements behind the cells, one fit for as many of them as it can serve.

use anyhow::Result;
use lagrangian::Error;
use lagrangian::dynamics::Model;
use lagrangian::train::{
    Budget, FitConfig, Learned, Loss, NaturalConfig, Observer, Optimizer, RolloutLoss, fit,
};

use super::columns::{Column, Measured, OWN_ENERGY};
use super::contestants::Recipe;
use super::hopeless::Hopeless;
use super::measure::{call_seconds, energy_drift, step_errors};
use super::{Hidden, Lesson, Plan, Reads, SAMPLES, Task};
use crate::harness::{Contestant, History, Lab, fit_with_history};

/// A row of the table.
type Row = &'static Contestant<Recipe>;
/// Cells that were measured for one seed.
type Cells = Vec<(Row, Column, Measured)>;

/// Noise, as a share of the states.
const NOISE: f64 = 0.05;
/// The error that a fit is timed by.
const LEARNED: f64 = 0.05;

/// Columns of the fit to the double pendulum.
const MAIN: [Column; 5] = [
    Column::Dynamics,
    Column::Continuous,
    Column::Conservation,
    Column::Training,
    Column::Call,
];
const NEEDS: [(Column, Hidden); 3] = [
    (Column::Accelerations, Hidden::Accelerations),
    (Column::Torques, Hidden::Torques),
    (Column::Momenta, Hidden::Momenta),
];
/// Columns of an error in several tasks, of which the largest counts.
const SEVERAL: [(Column, &[Task]); 2] = [
    (
        Column::Coordinates,
        &[Task::Swings, Task::Sheared, Task::Bent],
    ),
    (Column::Lagrangians, &[Task::Relativistic, Task::Magnetic]),
];

/// The number of all fits.
pub(super) fn fits(plan: &Plan, seeds: usize) -> usize {
    let main = usize::from(plan.asks(&MAIN)) + usize::from(plan.asks(&[Column::Noise]));
    let several = SEVERAL.iter().filter(|(column, _)| plan.asks(&[*column]));
    let fits = main + several.map(|(_, tasks)| tasks.len()).sum::<usize>();
    seeds * plan.rows.len() * fits
}

/// All cells that are asked for, for one seed.
pub(super) fn measure(plan: &Plan, seed: u64, lab: &mut Lab) -> Result<Cells> {
    let mut found = Vec::new();
    if plan.asks(&MAIN) {
        let lesson = Task::Pendulum.lesson(plan.size, seed)?;
        each(
            plan,
            &lesson,
            ("double pendulum", seed),
            lab,
            &mut found,
            main,
        )?;
    }
    let needs = NEEDS.map(|(column, _)| column);
    if plan.asks(&needs) {
        let lesson = Task::Pendulum.lesson(plan.size, seed)?;
        for &row in &plan.rows {
            for (column, hidden) in NEEDS.into_iter().filter(|(c, _)| plan.asks(&[*c])) {
                found.push((row, column, without(plan, row, &lesson, hidden, seed)));
            }
        }
    }
    if plan.asks(&[Column::Noise]) {
        let lesson = Task::Pendulum.lesson(plan.size, seed)?.noisy(NOISE);
        each(
            plan,
            &lesson,
            ("noise", seed),
            lab,
            &mut found,
            |_, row, lesson, fitted| {
                let error = (row.config.error)(&fitted.model, lesson);
                Ok(vec![(
                    Column::Noise,
                    fitted.with_steps(Measured::value(error)),
                )])
            },
        )?;
    }
    for (column, tasks) in SEVERAL.into_iter().filter(|(c, _)| plan.asks(&[*c])) {
        found.extend(several(plan, column, tasks, seed, lab)?);
    }
    Ok(found)
}

/// A fitted model with what was seen on the way.
struct Fitted {
    model: Learned,
    steps: usize,
    history: History,
}

impl Fitted {
    /// A cell that says how long the fit was.
    fn with_steps(&self, mut cell: Measured) -> Measured {
        cell.figures.push(("steps", self.steps as f64));
        cell
    }

    /// Seconds and steps until the error was at [`LEARNED`].
    fn time(&self) -> Measured {
        let history = self.history.moments.iter().map(|m| (m.step, m.value));
        let mut cell = match self.history.moments.iter().find(|m| m.value <= LEARNED) {
            Some(moment) => Measured {
                figures: vec![("steps", moment.step as f64)],
                ..Measured::value(moment.seconds)
            },
            None => Measured::refused(&"not within the fit"),
        };
        cell.history = history.collect();
        cell
    }
}

/// Fits every row to a lesson and measures it; a row that is refused says so in its cells.
fn each(
    plan: &Plan,
    lesson: &Lesson,
    (name, seed): (&str, u64),
    lab: &mut Lab,
    found: &mut Cells,
    mut measure: impl FnMut(&Plan, Row, &Lesson, &Fitted) -> Result<Vec<(Column, Measured)>>,
) -> Result<()> {
    for &row in &plan.rows {
        lab.begin(format!("{name}, {}, seed {seed}", row.name))?;
        match fitted(plan, row, lesson, seed, lab) {
            Ok(fitted) => {
                let cells = measure(plan, row, lesson, &fitted)?;
                found.extend(cells.into_iter().map(|(column, cell)| (row, column, cell)));
            }
            Err(reason) => {
                let columns: &[Column] = if name == "noise" {
                    &[Column::Noise]
                } else {
                    &MAIN
                };
                let asked = columns.iter().filter(|c| plan.asks(&[**c]));
                found.extend(asked.map(|c| (row, *c, Measured::refused(&reason))));
            }
        }
        lab.progress.check()?;
    }
    Ok(())
}

/// The cells of the fit to the double pendulum.
fn main(
    plan: &Plan,
    row: Row,
    lesson: &Lesson,
    fitted: &Fitted,
) -> Result<Vec<(Column, Measured)>> {
    let model = &fitted.model;
    let mut cells = Vec::new();
    for column in MAIN.into_iter().filter(|c| plan.asks(&[*c])) {
        let cell = match column {
            Column::Dynamics => {
                fitted.with_steps(Measured::value((row.config.error)(model, lesson)))
            }
            Column::Continuous => {
                let errors = step_errors(model, lesson, row.config.method)?;
                Measured {
                    figures: vec![
                        ("h", errors.trained),
                        ("half", errors.half),
                        ("double", errors.double),
                        ("adaptive", errors.adaptive),
                    ],
                    ..Measured::value(errors.ratio)
                }
            }
            Column::Conservation => {
                let drift = energy_drift(model, lesson, row.config.method, plan.long)?;
                Measured {
                    spoiled: drift.own.is_none_or(|own| own > OWN_ENERGY),
                    figures: vec![
                        ("own_energy", drift.own.unwrap_or(f64::NAN)),
                        ("truth", drift.truth),
                        ("unfinished", drift.unfinished as f64),
                    ],
                    ..Measured::value(drift.exact)
                }
            }
            Column::Training => fitted.time(),
            _ => Measured::value(1e6 * call_seconds(model, lesson)),
        };
        cells.push((column, cell));
    }
    Ok(cells)
}

/// The largest error of several tasks.
fn several(plan: &Plan, column: Column, tasks: &[Task], seed: u64, lab: &mut Lab) -> Result<Cells> {
    let mut cells: Cells = plan
        .rows
        .iter()
        .map(|row| (*row, column, Measured::value(0.0)))
        .collect();
    for task in tasks {
        let lesson = task.lesson(plan.size, seed)?;
        for (row, _, cell) in &mut cells {
            let part = format!("{}, {}, seed {seed}", task.name(), row.name);
            lab.begin(part)?;
            match fitted(plan, row, &lesson, seed, lab) {
                Ok(fitted) => {
                    let error = (row.config.error)(&fitted.model, &lesson);
                    cell.figures.push((task.name(), error));
                    cell.spoiled |=
                        column == Column::Lagrangians && !has_energy(&fitted.model, &lesson);
                    cell.value = cell
                        .value
                        .filter(|_| error.is_finite())
                        .map(|x| x.max(error));
                }
                Err(reason) => {
                    cell.value = None;
                    cell.note
                        .get_or_insert(format!("{}: {reason}", task.name()));
                }
            }
            lab.progress.check()?;
        }
    }
    Ok(cells)
}

/// Whether a model has an energy, and so a Lagrangian or Hamiltonian that it could have learned.
fn has_energy(model: &Learned, lesson: &Lesson) -> bool {
    let motion = &lesson.test[0];
    let mut energy = vec![0.0; motion.len()];
    model.evaluator().energy(&motion.q, &motion.qd, &mut energy)
}

/// What a fit is ended with under noise: each batch is solved for itself, noise and all.
const NOISY_DAMPING: f64 = 1e-2;

fn config(plan: &Plan, row: Row, seed: u64, noisy: bool) -> FitConfig {
    let default = NaturalConfig::default();
    FitConfig {
        family: (row.config.family)(),
        loss: row.config.loss,
        budget: plan.budget,
        batch: row.config.batch,
        optimizer: Optimizer::Natural(NaturalConfig {
            damping_last: if noisy {
                NOISY_DAMPING
            } else {
                default.damping_last
            },
            ..default
        }),
        seed,
        validate_every: 10,
        rollout: RolloutLoss {
            horizon: SAMPLES - 1,
            ..RolloutLoss::default()
        },
        ..FitConfig::default()
    }
}

fn fitted(
    plan: &Plan,
    row: Row,
    lesson: &Lesson,
    seed: u64,
    lab: &mut Lab,
) -> Result<Fitted, Error> {
    let data = lesson.data(row.config.reads, seed)?;
    let error = |model: &Learned| (row.config.error)(model, lesson);
    let mut config = config(plan, row, seed, lesson.noise > 0.0);
    if lesson.task == Task::Pendulum && lesson.noise <= 0.0 {
        config.budget = plan.longest;
    }
    // What rollouts leave under noise is that of their starts, so that their loss does not say how far they are.
    let watched = row.config.loss != Loss::ROLLOUT || lesson.noise <= 0.0;
    let mut hopeless;
    let observer: &mut dyn Observer = match watched {
        true => {
            hopeless = Hopeless::new(&mut lab.progress);
            &mut hopeless
        }
        false => &mut lab.progress,
    };
    let (fit, history) = fit_with_history(&data, &config, observer, &error)?;
    Ok(Fitted {
        model: fit.model,
        steps: fit.steps,
        history,
    })
}

/// Whether a fit accepts the data without one of their columns.
fn without(plan: &Plan, row: Row, lesson: &Lesson, hidden: Hidden, seed: u64) -> Measured {
    let config = FitConfig {
        budget: Budget::Steps(1),
        ..config(plan, row, seed, false)
    };
    // Nobody is given torques but who cannot do without.
    let reads = match (hidden, row.config.reads) {
        (Hidden::Torques, Reads::Torques) => Reads::Motions,
        (_, reads) => reads,
    };
    let tried = lesson.data_without(hidden, reads, seed);
    match tried.and_then(|data| fit(&data, &config, None, &mut ())) {
        Ok(_) => Measured {
            accepted: Some(true),
            ..Measured::default()
        },
        Err(reason) => Measured {
            accepted: Some(false),
            ..Measured::refused(&reason)
        },
    }
}
