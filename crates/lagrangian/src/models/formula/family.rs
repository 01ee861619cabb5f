//! Formulas as a family: their losses and data, their saved form.

use super::term::MOST_COORDINATES;
use super::{Evidence, Formula, FormulaConfig, FormulaShape, search};
use crate::dataset::Dataset;
use crate::models::family::{
    self, Abilities, BoxedLearner, Candidate, Entry, Family, Plan, Residuals, Trained,
};
use crate::models::learned::Learned;
use crate::models::network::NetworkShape;
use crate::models::setup::Setup;
use crate::saved::SavedModel;
use crate::train::{Loss, TrainingTask};
use lagrangian_mechanics::forces::Dissipation;
use lagrangian_motion::{Error, Result};
use nets::simd::Real;

/// The row of the table of families.
pub(crate) const ENTRY: Entry = Entry {
    name: NAME,
    about: "a Lagrangian in closed form: a few terms, found in the motion, with their standard errors",
    default: family::default::<FormulaConfig>,
    settings: &[],
    choose: family::no_choice,
    read: family::read::<FormulaConfig>,
    saved_as: &[NAME],
    load: |saved| load(saved),
    candidates: &[Candidate {
        on: |data, robot| !robot && data.train.goal.is_empty() && can_be_searched(data),
        ..Candidate::of_motion(0, "", &[])
    }],
    jointed: false,
};

pub(crate) const NAME: &str = "formula";

/// The largest number of coordinates of a system whose law is sought where no family is named: with recorded forces, and of free motions.
pub(crate) const FEW: usize = 3;
const FREE: usize = 4;

fn can_be_searched(data: &Dataset) -> bool {
    let most = if data.forced { FEW } else { FREE };
    data.coordinates.dof() <= most && data.train_times.longest() >= search::WINDOW
}

impl Family for FormulaConfig {
    fn name(&self) -> &'static str {
        NAME
    }

    fn summary(&self) -> String {
        match self.terms.len() {
            0 => "the terms of a Lagrangian are found".into(),
            count => format!("the coefficients of {count} terms are found"),
        }
    }

    fn abilities(&self) -> Abilities {
        let remedy =
            "omitted: a formula is found in the motion, and in the forces where they are recorded";
        Abilities {
            solved: true,
            unfiltered: true,
            ..Abilities::of_losses(&[Loss::ACCELERATION, Loss::TORQUE], remedy)
        }
    }

    fn check(&self, dataset: &Dataset, _task: &TrainingTask) -> Result<()> {
        let n = dataset.coordinates.dof();
        if n > MOST_COORDINATES {
            let must = "at most 8 coordinates: terms of more are too many to search";
            return Err(Error::argument("q", n, must));
        }
        if dataset.train_times.longest() < search::WINDOW {
            let must = "of recordings with at least 25 samples each: a formula is found in stretches of motion";
            return Err(Error::argument("data", "samples", must));
        }
        Ok(())
    }

    fn prepare(&self, dataset: &Dataset, task: &TrainingTask) -> Result<Plan> {
        self.check(dataset, task)?;
        let (own, task) = (self.clone(), task.clone());
        Ok(Plan::Solve(Box::new(move |dataset, observer| {
            search::find(dataset.as_measured(), &own, &task, observer)
        })))
    }
}

impl FormulaShape {
    /// The part that is a Lagrangian with its parameters, and the matrix of the dampers between coordinates with their standard errors
    /// among the evidence; empty where there are none.
    fn without_dampers(&self, parameters: &[f64]) -> Result<(Self, Vec<f64>, Vec<f64>)> {
        let terms = &self.config.terms;
        if !terms.iter().any(|term| term.damps) {
            return Ok((self.clone(), parameters.to_vec(), Vec::new()));
        }
        let n = self.coordinates.dof();
        let mut matrices = [vec![0.0; n * n], vec![0.0; n * n]];
        for (k, term) in terms.iter().enumerate().filter(|(_, term)| term.damps) {
            let (i, j) = (term.speeds[0], term.speeds[1]);
            let own = [
                parameters[k] * self.evidence.units[k],
                self.evidence.errors[k],
            ];
            for (matrix, value) in matrices.iter_mut().zip(own) {
                (matrix[i * n + j], matrix[j * n + i]) = (value, value);
            }
        }
        let [between, errors] = matrices;
        let kept: Vec<usize> = (0..terms.len()).filter(|k| !terms[*k].damps).collect();
        let of = |all: &[f64]| kept.iter().map(|k| all[*k]).collect::<Vec<f64>>();
        let mut evidence = Evidence {
            units: of(&self.evidence.units),
            errors: of(&self.evidence.errors),
            ..self.evidence.clone()
        };
        evidence.friction.resize(3 * n, 0.0);
        evidence.friction.extend(errors);
        let config = FormulaConfig {
            terms: kept.iter().map(|k| terms[*k].clone()).collect(),
            origins: self.config.origins.clone(),
        };
        let shape = Self::new(self.coordinates.clone(), config, evidence)?;
        Ok((shape, of(parameters), between))
    }
}

impl Trained for FormulaShape {
    fn learner<'a, T: Real>(&'a self, setup: &'a Setup, of: Residuals) -> BoxedLearner<'a, T> {
        Box::new(setup.learner(self, of))
    }

    fn assemble(&self, setup: &Setup, parameters: &[f64]) -> Result<Learned> {
        let (weights, extra) = parameters.split_at(self.config.terms.len());
        let (shape, weights, between) = self.without_dampers(weights)?;
        let friction = setup.forces.dissipation(extra);
        let friction = match between.is_empty() {
            true => friction,
            false => {
                let none = || Dissipation::viscous(vec![0.0; self.coordinates.dof()]);
                Some(friction.unwrap_or_else(none).with_between(between)?)
            }
        };
        setup.damped(Formula::assemble(shape, weights)?, friction, extra)
    }
}

fn load(saved: &SavedModel) -> Result<Learned> {
    let formula = Formula::load(saved, saved.weights()?)?;
    Ok(saved.moving(formula)?.into())
}
