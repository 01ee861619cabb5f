//! The measurements behind the cells, one fit for as many of them as it can serve.

use anyhow::Result;
use lagrangian::Error;
use lagrangian::dynamics::Model;
use lagrangian::experiment::table::{
    Hidden, Lesson, Reads, SAMPLES, Task, call_seconds, energy_drift, step_errors,
};
use lagrangian::experiment::{History, fit_with_history};
use lagrangian::train::{
    Budget, FitConfig, Learned, Loss, NaturalConfig, Observer, Optimizer, RolloutLoss, fit,
};

use super::columns::{Column, Measured, OWN_ENERGY};
use super::contestants::Contestant;
use super::hopeless::Hopeless;
use super::{Course, Plan};

type Found = Vec<(&'static Contestant, Column, Measured)>;

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
pub(super) fn whole(plan: &Plan) -> f64 {
    let main = usize::from(plan.asks(&MAIN)) + usize::from(plan.asks(&[Column::Noise]));
    let several = SEVERAL.iter().filter(|(column, _)| plan.asks(&[*column]));
    let fits = main + several.map(|(_, tasks)| tasks.len()).sum::<usize>();
    (plan.seeds.len() * plan.rows.len() * fits) as f64
}

/// All cells that are asked for, for one seed.
pub(super) fn measure(plan: &Plan, seed: u64, course: &mut Course) -> Result<Found> {
    let mut found = Vec::new();
    if plan.asks(&MAIN) {
        let lesson = Task::Pendulum.lesson(plan.size, seed)?;
        each(
            plan,
            &lesson,
            ("double pendulum", seed),
            course,
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
            course,
            &mut found,
            |_, row, lesson, fitted| {
                let error = (row.error)(&fitted.model, lesson);
                Ok(vec![(
                    Column::Noise,
                    fitted.with_steps(Measured::value(error)),
                )])
            },
        )?;
    }
    for (column, tasks) in SEVERAL.into_iter().filter(|(c, _)| plan.asks(&[*c])) {
        found.extend(several(plan, column, tasks, seed, course)?);
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
    course: &mut Course,
    found: &mut Found,
    mut measure: impl FnMut(
        &Plan,
        &'static Contestant,
        &Lesson,
        &Fitted,
    ) -> Result<Vec<(Column, Measured)>>,
) -> Result<()> {
    for &row in &plan.rows {
        course.begin(format!("{name}, {}, seed {seed}", row.name), 1.0)?;
        match fitted(plan, row, lesson, seed, course) {
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
        course.check()?;
    }
    Ok(())
}

/// The cells of the fit to the double pendulum.
fn main(
    plan: &Plan,
    row: &'static Contestant,
    lesson: &Lesson,
    fitted: &Fitted,
) -> Result<Vec<(Column, Measured)>> {
    let model = &fitted.model;
    let mut cells = Vec::new();
    for column in MAIN.into_iter().filter(|c| plan.asks(&[*c])) {
        let cell = match column {
            Column::Dynamics => fitted.with_steps(Measured::value((row.error)(model, lesson))),
            Column::Continuous => {
                let errors = step_errors(model, lesson, row.method)?;
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
                let drift = energy_drift(model, lesson, row.method, plan.long)?;
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
fn several(
    plan: &Plan,
    column: Column,
    tasks: &[Task],
    seed: u64,
    course: &mut Course,
) -> Result<Found> {
    let mut cells: Found = plan
        .rows
        .iter()
        .map(|row| (*row, column, Measured::value(0.0)))
        .collect();
    for task in tasks {
        let lesson = task.lesson(plan.size, seed)?;
        for (row, _, cell) in &mut cells {
            let part = format!("{}, {}, seed {seed}", task.name(), row.name);
            course.begin(part, 1.0)?;
            match fitted(plan, row, &lesson, seed, course) {
                Ok(fitted) => {
                    let error = (row.error)(&fitted.model, &lesson);
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
            course.check()?;
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

fn config(plan: &Plan, row: &Contestant, seed: u64, noisy: bool) -> FitConfig {
    let default = NaturalConfig::default();
    FitConfig {
        family: (row.family)(),
        loss: row.loss,
        budget: plan.budget,
        batch: row.batch,
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
    row: &Contestant,
    lesson: &Lesson,
    seed: u64,
    course: &mut Course,
) -> Result<Fitted, Error> {
    let data = lesson.data(row.reads, seed)?;
    let error = |model: &Learned| (row.error)(model, lesson);
    let mut config = config(plan, row, seed, lesson.noise > 0.0);
    if lesson.task == Task::Pendulum && lesson.noise <= 0.0 {
        config.budget = plan.longest;
    }
    // What rollouts leave under noise is that of their starts, so that their loss does not say how far they are.
    let watched = row.loss != Loss::Rollout || lesson.noise <= 0.0;
    let mut hopeless;
    let observer: &mut dyn Observer = match watched {
        true => {
            hopeless = Hopeless::new(course);
            &mut hopeless
        }
        false => course,
    };
    let (fit, history) = fit_with_history(&data, &config, observer, &error)?;
    Ok(Fitted {
        model: fit.model,
        steps: fit.steps,
        history,
    })
}

/// Whether a fit accepts the data without one of their columns.
fn without(plan: &Plan, row: &Contestant, lesson: &Lesson, hidden: Hidden, seed: u64) -> Measured {
    let config = FitConfig {
        budget: Budget::Steps(1),
        ..config(plan, row, seed, false)
    };
    // Nobody is given torques but who cannot do without.
    let reads = match (hidden, row.reads) {
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
