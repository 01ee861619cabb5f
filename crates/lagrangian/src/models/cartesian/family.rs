//! Points under relations as a family: their data, their saved form.

use super::points::{ERRORS, Points, Shape};
use super::{CartesianConfig, search};
use crate::dataset::Dataset;
use crate::models::family::{self, Abilities, Entry, Family, Plan};
use crate::models::formula::{Style, friction};
use crate::models::learned::{Description, FittedModel, ModelParts, Stored, WrittenLaw};
use crate::models::named::{Named, Parameter};
use crate::saved::{self, SavedModel, WEIGHTS};
use crate::train::{Loss, TrainingTask};
use lagrangian_mechanics::constrained::Constrained;
use lagrangian_mechanics::dynamics::Mechanical;
use lagrangian_mechanics::expression::{self, Equations, Graph};
use lagrangian_motion::{Error, Result};

/// The row of the table of families.
pub(crate) const ENTRY: Entry = Entry {
    name: NAME,
    about: "points in Cartesian coordinates, joined by rods and other relations: their masses and forces",
    default: family::default::<CartesianConfig>,
    settings: &[],
    choose: family::no_choice,
    read: family::read::<CartesianConfig>,
    saved_as: &[NAME],
    load: |saved| Ok(load(saved)?.into()),
    candidates: &[],
    jointed: false,
};

/// The name of the family.
pub(super) const NAME: &str = "cartesian";

/// A fitted model of points under relations.
pub(super) type Cartesian = Constrained<Mechanical<Points>>;

impl Family for CartesianConfig {
    fn name(&self) -> &'static str {
        NAME
    }

    fn summary(&self) -> String {
        format!("{} relations between coordinates", self.constraints.len())
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
    /// The settings with relations: those that are given.
    fn with_constraints(&self, _dataset: &Dataset) -> Result<Self> {
        match self.constraints.is_empty() {
            true => Err(Error::setting(
                "no relations between the coordinates are given",
                "give them as `constraints`",
            )),
            false => Ok(self.clone()),
        }
    }
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
        Description::mechanical(NAME, "Points under relations")
    }

    fn stored(&self) -> Result<Stored> {
        self.inner.lagrangian.stored()
    }

    fn parts(&self) -> ModelParts<'_> {
        ModelParts {
            forces: self.inner.applied(),
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
            "a model with relations between its coordinates",
        ))
    }
}
