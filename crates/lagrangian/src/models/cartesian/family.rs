//! Points under constraints as a family: their data, their saved form.

use super::points::{ERRORS, Points, Shape};
use super::{CartesianConfig, search};
use crate::dataset::Dataset;
use crate::models::family::{self, Abilities, Candidate, Entry, Family, Plan};
use crate::models::formula::{Style, friction};
use crate::models::learned::{Description, FittedModel, Linkage, ModelParts, Stored, WrittenLaw};
use crate::models::named::{Named, Parameter};
use crate::saved::{self, SavedModel, WEIGHTS};
use crate::train::{Loss, TrainingTask};
use lagrangian_mechanics::constrained::Constrained;
use lagrangian_mechanics::dynamics::Mechanical;
use lagrangian_mechanics::expression::{self, Equations, Graph};
use lagrangian_motion::{Error, Result};
use lagrangian_recordings::constraints::{self, Kind, Point, Structure};

/// The row of the table of families.
pub(crate) const ENTRY: Entry = Entry {
    name: NAME,
    about: "points in Cartesian coordinates, joined by rods and other constraints: their masses and forces",
    default: family::default::<CartesianConfig>,
    settings: &[],
    choose: family::no_choice,
    read: family::read::<CartesianConfig>,
    saved_as: &[NAME],
    load: |saved| Ok(load(saved)?.into()),
    candidates: &[Candidate {
        on: |data, robot| !robot && data.train.goal.is_empty() && is_held(data),
        alone: true,
        ..Candidate::of_motion(0, "", &[])
    }],
    jointed: false,
};

/// The name of the family.
pub(super) const NAME: &str = "cartesian";

/// A fitted model of points under constraints.
pub(super) type Cartesian = Constrained<Mechanical<Points>>;

impl Family for CartesianConfig {
    fn name(&self) -> &'static str {
        NAME
    }

    fn summary(&self) -> String {
        format!("{} constraints between coordinates", self.constraints.len())
    }

    fn abilities(&self) -> Abilities {
        let remedy = "omitted: points are fitted to positions and velocities by simulations";
        Abilities {
            solved: true,
            ..Abilities::of_losses(&[Loss::ACCELERATION, Loss::TORQUE], remedy)
        }
    }

    fn check(&self, dataset: &Dataset, _task: &TrainingTask) -> Result<()> {
        let coordinates = &dataset.coordinates;
        let n = coordinates.dof();
        let turns = (0..n).find(|i| coordinates.is_circle(*i) || coordinates.is_parameter(*i));
        if let Some(i) = turns {
            let must = "lines that move: the positions of points, not angles or parameters";
            return Err(Error::argument("q", coordinates.0[i].name.clone(), must));
        }
        self.all_points(n)?;
        if dataset.train_times.longest() < 3 {
            let must = "of motions with at least 3 samples each, in the order of time";
            return Err(Error::argument("data", "samples", must));
        }
        Ok(())
    }

    fn prepare(&self, dataset: &Dataset, task: &TrainingTask) -> Result<Plan> {
        self.check(dataset, task)?;
        let own = self.with_constraints(dataset)?;
        Ok(Plan::Solve(Box::new(move |dataset, observer| {
            search::find(dataset, &own, observer)
        })))
    }
}

impl CartesianConfig {
    /// The settings with the constraints that are given, or else with those that the positions keep.
    fn with_constraints(&self, dataset: &Dataset) -> Result<Self> {
        if !self.constraints.is_empty() {
            return Ok(self.clone());
        }
        let found = structure(dataset, &self.points);
        if found.found.is_empty() {
            return Err(Error::setting(
                "no constraint between these coordinates was found: each moves by itself",
                "take another `family`, such as delan; `lagrangian constraints` shows what is looked for",
            ));
        }
        Ok(Self {
            constraints: found.found.into_iter().map(|own| own.constraint).collect(),
            points: found.points.into_iter().map(|own| own.axes).collect(),
        })
    }
}

/// The constraints that the fitted positions keep, as they were measured.
fn structure(dataset: &Dataset, points: &[Vec<usize>]) -> Structure {
    let (n, times) = (dataset.coordinates.dof(), &dataset.train_times);
    let measured = Some(&times.measured[0]).filter(|q| !q.is_empty());
    let q = measured.unwrap_or(&dataset.train.q);
    let motions: Vec<&[f64]> = times
        .runs()
        .filter_map(|run| q.get(run.start * n..run.end * n))
        .collect();
    match points.is_empty() {
        true => constraints::find(&dataset.coordinates, &motions),
        false => {
            let points = points
                .iter()
                .map(|axes| Point::of(&dataset.coordinates, axes.clone()));
            constraints::find_between(&dataset.coordinates, points.collect(), &motions)
        }
    }
}

/// Whether rods or circles hold the coordinates, so that no model without them can be right. Lines and other curves may be paths of single motions.
fn is_held(dataset: &Dataset) -> bool {
    let found = structure(dataset, &[]).found;
    found
        .iter()
        .any(|own| matches!(own.kind, Kind::Circle | Kind::Rod))
}

fn load(saved: &SavedModel) -> Result<Cartesian> {
    let header = &saved.header;
    let shape: Shape = saved::read("architecture", &header.architecture)?;
    let [parameters, errors] = saved.vectors([WEIGHTS, ERRORS])?;
    let config = CartesianConfig {
        constraints: shape.constraints.clone(),
        points: shape.points.clone(),
    };
    let n = header.coordinates.dof();
    if config.all_points(n)? != shape.points {
        return Err(saved::damaged(
            "not every coordinate is one of a point".into(),
        ));
    }
    let points = Points::new(header.coordinates.clone(), shape, parameters, errors)?;
    Constrained::new(saved.moving(points)?, config.constraints)
}

/// A misfit up to which the data are explained to their noise.
const FITS: f64 = 1.1;

impl FittedModel for Cartesian {
    fn description(&self) -> Description {
        Description::mechanical(NAME, "Points under constraints")
    }

    fn stored(&self) -> Result<Stored> {
        self.inner.lagrangian.stored()
    }

    fn parts(&self) -> ModelParts<'_> {
        ModelParts {
            forces: self.inner.applied(),
            linkage: Some(Linkage {
                points: &self.inner.lagrangian.shape.points,
                constraints: self.constraints(),
            }),
            ..ModelParts::default()
        }
    }

    fn parameters(&self) -> Vec<Parameter> {
        let points = &self.inner.lagrangian;
        let named = Named::of(&points.coordinates).terms(points.named());
        named.forces(self.inner.applied()).list()
    }

    fn written(&self) -> Option<WrittenLaw> {
        let points = &self.inner.lagrangian;
        let text = |style: Style| {
            let damped = self.inner.dissipation();
            let beside = damped.map(|own| friction(&points.coordinates, own, style));
            points.written(style) + &beside.unwrap_or_default()
        };
        let (verdict, meaning) = match points.shape.misfit {
            Some(misfit) if misfit <= FITS => (
                "law",
                "the law of these points, as far as these data tell: it explains them to their noise",
            ),
            Some(_) => (
                "none",
                "no law: it does not explain the data to their noise",
            ),
            None => (
                "expansion",
                "masses and forces that fit best: motions are too short to tell whether they explain them to their noise",
            ),
        };
        Some(WrittenLaw {
            text: text(Style::Text),
            latex: text(Style::Latex),
            verdict: verdict.into(),
            meaning: meaning.into(),
        })
    }

    fn equations(&self, _: Graph) -> Result<Equations> {
        Err(expression::without(
            "a model with constraints between its coordinates",
        ))
    }
}
