//! The measurements behind the cells, one fit for as many of them as it can serve.

use anyhow::Result;
use lagrangian::train::{NaturalConfig, RolloutLoss};
use lagrangian::trajectory::Signal;
use lagrangian::{Budget, Error, FitConfig, Learned, Loss, Observer, TrainingTask, fit};

use super::columns::{Column, Measured};
use super::contestants::Recipe;
use super::early_end::EarlyEnd;
use super::measure::{call_seconds, energy_drift, step_errors};
use super::{Cell, Lesson, Plan, Reads, SAMPLES, Task};
use crate::data::energies;
use crate::families::{self, WIDTH};
use crate::harness::{Contestant, History, Lab, fit_with_history};

/// A row of the table.
type Row = &'static Contestant<Recipe>;

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
/// Columns of what data may lack.
const NEEDS: [(Column, &[Signal]); 3] = [
    (Column::Accelerations, &[Signal::Qdd, Signal::Pd]),
    (Column::Torques, &[Signal::Tau]),
    (Column::Momenta, &[Signal::P, Signal::Pd]),
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

/// Measures all cells that are asked for, for one seed.
pub(super) fn measure(plan: &Plan, seed: u64, lab: &mut Lab, cells: &mut Vec<Cell>) -> Result<()> {
    let mut measuring = Measuring {
        plan,
        seed,
        lab,
        cells,
    };
    let pendulum = || Task::Pendulum.lesson(plan.size, seed);
    if plan.asks(&MAIN) {
        measuring.one_lesson("double pendulum", &pendulum()?, &MAIN)?;
    }
    if plan.asks(&NEEDS.map(|(column, _)| column)) {
        let lesson = pendulum()?;
        for &row in &plan.rows {
            for (column, hidden) in NEEDS.into_iter().filter(|(c, _)| plan.asks(&[*c])) {
                let measured = measuring.without(row, &lesson, hidden);
                measuring.add(row, column, measured);
            }
        }
    }
    if plan.asks(&[Column::Noise]) {
        measuring.one_lesson("noise", &pendulum()?.noisy(NOISE), &[Column::Noise])?;
    }
    for (column, tasks) in SEVERAL.into_iter().filter(|(c, _)| plan.asks(&[*c])) {
        measuring.several(column, tasks)?;
    }
    Ok(())
}

/// A fitted model with what was seen on the way.
struct Fitted {
    model: Learned,
    steps: usize,
    history: History,
}

impl Fitted {
    /// Seconds and steps until the error was at [`LEARNED`].
    fn time(&self) -> Measured {
        let moments = &self.history.moments;
        let cell = match moments.iter().find(|m| m.value <= LEARNED) {
            Some(moment) => Measured {
                figures: vec![("steps", moment.step as f64)],
                ..Measured::value(moment.seconds)
            },
            None => Measured::refused(&"not within the fit"),
        };
        Measured {
            history: moments.iter().map(|m| (m.step, m.value)).collect(),
            ..cell
        }
    }

    /// The cell of a row and a column of the lesson that was fitted.
    fn cell(&self, plan: &Plan, row: Row, lesson: &Lesson, column: Column) -> Result<Measured> {
        let (model, method) = (&self.model, row.config.method);
        Ok(match column {
            Column::Continuous => step_errors(model, lesson, method)?,
            Column::Conservation => energy_drift(model, lesson, method, plan.long)?,
            Column::Training => self.time(),
            Column::Call => Measured::value(1e6 * call_seconds(model, lesson)),
            _ => Measured {
                figures: vec![("steps", self.steps as f64)],
                ..Measured::value((row.config.error)(model, lesson))
            },
        })
    }
}

/// The measurements of one seed.
struct Measuring<'a, 'l> {
    plan: &'a Plan,
    seed: u64,
    lab: &'a mut Lab<'l>,
    cells: &'a mut Vec<Cell>,
}

impl Measuring<'_, '_> {
    fn add(&mut self, row: Row, column: Column, measured: Measured) {
        super::record(self.lab, row, column, &measured);
        let known = |c: &&mut Cell| c.row.key == row.key && c.column == column;
        match self.cells.iter_mut().find(known) {
            Some(cell) => cell.measured.push(measured),
            None => self.cells.push(Cell {
                row,
                column,
                measured: vec![measured],
            }),
        }
    }

    /// Fits every row to a lesson and measures these columns of it; a row that is refused says so in its cells.
    fn one_lesson(&mut self, name: &str, lesson: &Lesson, columns: &[Column]) -> Result<()> {
        let plan = self.plan;
        let asked = || columns.iter().filter(|c| plan.asks(&[**c]));
        for &row in &plan.rows {
            let fitted = self.fitted(name, row, lesson)?;
            for &column in asked() {
                let measured = match &fitted {
                    Ok(fitted) => fitted.cell(plan, row, lesson, column)?,
                    Err(reason) => Measured::refused(reason),
                };
                self.add(row, column, measured);
            }
            self.lab.progress.check()?;
        }
        Ok(())
    }

    /// The largest error of several tasks.
    fn several(&mut self, column: Column, tasks: &[Task]) -> Result<()> {
        let rows = self.plan.rows.iter();
        let mut cells: Vec<_> = rows.map(|row| (*row, Measured::value(0.0))).collect();
        for task in tasks {
            let lesson = task.lesson(self.plan.size, self.seed)?;
            for (row, cell) in &mut cells {
                match self.fitted(task.name(), row, &lesson)? {
                    Ok(fitted) => {
                        let error = (row.config.error)(&fitted.model, &lesson);
                        cell.figures.push((task.name(), error));
                        // A model without energy has no Lagrangian or Hamiltonian that it could have learned.
                        cell.spoiled |= column == Column::Lagrangians
                            && energies(&fitted.model, &lesson.test[0]).is_none();
                        let value = cell.value.filter(|_| error.is_finite());
                        cell.value = value.map(|x| x.max(error));
                    }
                    Err(reason) => {
                        cell.value = None;
                        cell.note
                            .get_or_insert(format!("{}: {reason}", task.name()));
                    }
                }
                self.lab.progress.check()?;
            }
        }
        for (row, measured) in cells {
            self.add(row, column, measured);
        }
        Ok(())
    }

    fn config(&self, row: Row, noisy: bool) -> FitConfig {
        let usual = NaturalConfig::default().damping_last;
        FitConfig {
            family: (row.config.family)(WIDTH),
            training: TrainingTask {
                loss: row.config.loss,
                budget: self.plan.budget,
                batch: row.config.batch,
                optimizer: families::natural(if noisy { NOISY_DAMPING } else { usual }),
                seed: self.seed,
                validate_every: 10,
                rollout: RolloutLoss {
                    horizon: SAMPLES - 1,
                    ..RolloutLoss::default()
                },
                ..TrainingTask::default()
            },
        }
    }

    /// One fit, or why it is refused.
    fn fitted(&mut self, name: &str, row: Row, lesson: &Lesson) -> Result<Result<Fitted, Error>> {
        self.lab
            .begin(format!("{name}, {}, seed {}", row.name, self.seed))?;
        Ok(self.fit(row, lesson))
    }

    fn fit(&mut self, row: Row, lesson: &Lesson) -> Result<Fitted, Error> {
        let data = lesson.data(&[], row.config.reads, self.seed)?;
        let error = |model: &Learned| (row.config.error)(model, lesson);
        let mut config = self.config(row, lesson.noise > 0.0);
        if lesson.task == Task::Pendulum && lesson.noise <= 0.0 {
            config.budget = self.plan.longest;
        }
        let progress = &mut self.lab.progress;
        // What rollouts leave under noise is that of their starts, so that their loss does not say how far they are.
        let watched = row.config.loss != Loss::ROLLOUT || lesson.noise <= 0.0;
        let mut early_end;
        let observer: &mut dyn Observer = match watched {
            true => {
                early_end = EarlyEnd::new(progress);
                &mut early_end
            }
            false => progress,
        };
        let (fit, history) = fit_with_history(&data, &config, observer, &error)?;
        Ok(Fitted {
            model: fit.model,
            steps: fit.steps,
            history,
        })
    }

    /// Whether a fit accepts the data without some of their signals.
    fn without(&self, row: Row, lesson: &Lesson, hidden: &[Signal]) -> Measured {
        let mut config = self.config(row, false);
        config.budget = Budget::Steps(1);
        // Without torques, data are those of free motions.
        let reads = match row.config.reads {
            Reads::Torques if hidden.contains(&Signal::Tau) => Reads::Motions,
            reads => reads,
        };
        let tried = lesson.data(hidden, reads, self.seed);
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
}

/// What a fit is ended with under noise: each batch is solved for itself, noise and all.
const NOISY_DAMPING: f64 = 1e-2;
