//! Points under constraints as a family: their data, their saved form.

use super::points::{ERRORS, Points, Shape};
use super::{CartesianConfig, search};
use crate::dataset::Dataset;
use crate::models::family::{self, Abilities, Candidate, Entry, Family, Plan, Solution};
use crate::models::formula::{Style, WINDOW, friction, noise_sizes};
use crate::models::learned::{Description, FittedModel, Linkage, ModelParts, Stored, WrittenLaw};
use crate::models::named::{Named, Parameter};
use crate::saved::{self, SavedModel, WEIGHTS};
use crate::train::{Loss, TrainingTask};
use lagrangian_mechanics::constrained::Constrained;
use lagrangian_mechanics::dynamics::Mechanical;
use lagrangian_mechanics::expression::{self, Equations, Graph};
use lagrangian_motion::settings::{Kind as Values, Named as Value, Setting};
use lagrangian_motion::solve::dot;
use lagrangian_motion::statistics::{column, deviation, positive, root_mean_square};
use lagrangian_motion::{Coordinates, Error, Result, Topology};
use lagrangian_recordings::constraints::{self, Found, Kind, Point, Structure};

/// The row of the table of families.
pub(crate) const ENTRY: Entry = Entry {
    name: NAME,
    about: "points in Cartesian coordinates: the rods that join them or the forces between them, and their masses",
    default: family::default::<CartesianConfig>,
    settings: SETTINGS,
    choose: family::no_choice,
    read: family::read::<CartesianConfig>,
    saved_as: &[NAME],
    load: |saved| Ok(load(saved)?.into()),
    candidates: &[
        Candidate {
            on: |data, robot| !robot && data.train.goal.is_empty() && is_held(data),
            alone: true,
            ..Candidate::of_motion(0, "", &[])
        },
        Candidate {
            on: |data, robot| !robot && data.train.goal.is_empty() && are_free(data),
            ..Candidate::of_motion(0, "", &[])
        },
    ],
    jointed: false,
};

/// The settings of points.
const SETTINGS: &[Setting] = &[Setting::new(
    "constraints",
    Values::Document(&[
        Value {
            name: "find",
            help: "those that the data show",
        },
        Value {
            name: "none",
            help: "none: points that nothing holds",
        },
    ]),
    "The constraints between the coordinates; a file is one that `lagrangian constraints --json` wrote",
)
.shown_as("FILE")
.or("find")];

/// The name of the family.
pub(super) const NAME: &str = "cartesian";

/// A fitted model of points under constraints.
pub(super) type Cartesian = Constrained<Mechanical<Points>>;

impl Family for CartesianConfig {
    fn name(&self) -> &'static str {
        NAME
    }

    fn summary(&self) -> String {
        match self.known().len() {
            0 => "points by the names of their coordinates".into(),
            count => format!("{count} constraints between coordinates"),
        }
    }

    fn abilities(&self) -> Abilities {
        let remedy = "omitted: points are fitted to positions and velocities by simulations";
        Abilities {
            solved: true,
            cyclic: false,
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
        let all = self.alternatives(dataset)?;
        Ok(Plan::Solve(Box::new(move |dataset, observer| {
            let mut best: Result<Solution> = Err(alone());
            for own in &all {
                let found = search::find(dataset, own, observer);
                let better = match (&best, &found) {
                    (Ok(best), Ok(found)) => found.loss < best.loss,
                    (Err(_), _) => true,
                    _ => false,
                };
                if better {
                    best = found;
                }
                let explains = |own: &Solution| own.model.written().is_some_and(|own| own.explains);
                if best.as_ref().is_ok_and(explains) {
                    break;
                }
            }
            best
        })))
    }
}

impl CartesianConfig {
    /// The settings with the constraints that are given, or else with those that the positions keep; where there are none, with the points that
    /// names tell, or those of two and of three coordinates in turn.
    fn alternatives(&self, dataset: &Dataset) -> Result<Vec<Self>> {
        let mut found = structure(dataset, &self.points);
        if !self.known().is_empty() {
            self.contradicted(dataset)?;
            return Ok(vec![Self {
                points: found.points.into_iter().map(|own| own.axes).collect(),
                ..self.clone()
            }]);
        }
        if self.constraints.is_some() {
            found.found.clear();
        }
        let of = |found: Vec<Found>, points: Vec<Point>| Self {
            constraints: Some(found.into_iter().map(|own| own.constraint).collect()),
            points: points.into_iter().map(|own| own.axes).collect(),
        };
        if !found.found.is_empty() {
            return Ok(vec![of(found.found, found.points)]);
        }
        let all: Vec<Self> = match self.points.is_empty() {
            true => free_points(&dataset.coordinates),
            false => vec![found.points],
        }
        .into_iter()
        .map(|points| of(Vec::new(), points))
        .collect();
        if all.is_empty() {
            Err(alone())
        } else {
            Ok(all)
        }
    }
}

impl CartesianConfig {
    /// Refuses a given constraint that the positions do not keep.
    fn contradicted(&self, dataset: &Dataset) -> Result<()> {
        let n = dataset.coordinates.dof();
        let noise = noise_sizes(&dataset.coordinates, &dataset.train, &dataset.train_times);
        let spread = column(&dataset.train.q, n, deviation);
        for own in self.known() {
            let mut distances = dataset.train.q.chunks_exact(n).filter_map(|q| {
                let row = own.row(q);
                Some(own.value(q)? / positive(dot(&row, &row).sqrt()))
            });
            let off = root_mean_square(&mut distances);
            let largest = |all: &[f64]| all.iter().copied().fold(0.0, f64::max);
            if off > (OFF * largest(&noise)).max(FAR * largest(&spread)) {
                return Err(Error::setting(
                    format!(
                        "the data contradict the constraint '{}': positions are {off:.2e} off",
                        own.name
                    ),
                    "correct or omit it; `lagrangian constraints` shows those that hold",
                ));
            }
        }
        Ok(())
    }
}

fn alone() -> Error {
    Error::setting(
        "no constraint between these coordinates was found, and they are not those of points: each moves by itself",
        "give two or three coordinates of each point, named as in x1, y1, x2, y2, or take another `family`, such as delan; `lagrangian constraints` shows what is looked for",
    )
}

/// The points that the names of coordinates tell, or else those of two and of three coordinates in turn.
fn free_points(coordinates: &Coordinates) -> Vec<Vec<Point>> {
    let named = Point::named(coordinates);
    if !named.is_empty() {
        return vec![named];
    }
    let whole = |axes: &usize| coordinates.dof().is_multiple_of(*axes);
    let axes = [2, 3].into_iter().filter(whole);
    axes.map(|axes| Point::in_turn(coordinates, axes)).collect()
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

/// Whether all coordinates are those of points that nothing holds: by their names, or where there are at least two lengths.
fn are_free(dataset: &Dataset) -> bool {
    let coordinates = &dataset.coordinates;
    let n = coordinates.dof();
    let length =
        |i: usize| coordinates.0[i].topology == Topology::Line && coordinates.0[i].unit == "m";
    let named = !Point::named(coordinates).is_empty();
    let points = free_points(coordinates);
    let all = |points: &Vec<Point>| points.iter().map(|own| own.axes.len()).sum::<usize>() == n;
    n > 1
        && points.iter().any(all)
        && (named || (0..n).all(length))
        && dataset.train_times.longest() >= WINDOW
        && CartesianConfig::default().all_points(n).is_ok()
        && structure(dataset, &[]).found.is_empty()
}

fn load(saved: &SavedModel) -> Result<Cartesian> {
    let header = &saved.header;
    let shape: Shape = saved::read("architecture", &header.architecture)?;
    let [parameters, errors] = saved.vectors([WEIGHTS, ERRORS])?;
    let config = CartesianConfig {
        constraints: Some(shape.constraints.clone()),
        points: shape.points.clone(),
    };
    let n = header.coordinates.dof();
    if config.all_points(n)? != shape.points {
        return Err(saved::damaged(
            "not every coordinate is one of a point".into(),
        ));
    }
    let points = Points::new(header.coordinates.clone(), shape, parameters, errors)?;
    Constrained::new(saved.moving(points)?, config.known().to_vec())
}

/// A given constraint may be off by so many times the largest noise, or by this part of the widest coordinate.
const OFF: f64 = 5.0;
const FAR: f64 = 0.02;
/// A misfit up to which the data are explained to their noise.
const FITS: f64 = 1.1;
/// … and up to which no other model is tried: beyond the noise it leaves no more than the noise itself.
const EXPLAINS: f64 = 2.0;

impl FittedModel for Cartesian {
    fn description(&self) -> Description {
        let what = match self.constraints().is_empty() {
            true => "Points and the forces between them",
            false => "Points under constraints",
        };
        Description::mechanical(NAME, what)
    }

    fn stored(&self) -> Result<Stored> {
        self.inner.lagrangian.stored()
    }

    fn parts(&self) -> ModelParts<'_> {
        let free = self.constraints().is_empty();
        ModelParts {
            lagrangian: free.then_some(&self.inner.lagrangian),
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
            let beside = damped.map(|own| friction(&points.coordinates, (own, &[]), style));
            points.written(style) + &beside.unwrap_or_default()
        };
        let (verdict, meaning) = match points.shape.misfit {
            Some(misfit) if misfit <= FITS && points.shape.has_curves() => (
                "expansion",
                "an expansion and not the law: forces as curves of distances or fields of places, which explain the data to their noise",
            ),
            Some(misfit) if misfit <= FITS && points.shape.doubtful => (
                "expansion",
                "perhaps not the law: it explains the data to their noise, but another power of the distance from its sources does so as well",
            ),
            Some(misfit)
                if misfit <= FITS && self.constraints().is_empty() && !points.is_certain() =>
            {
                (
                    "expansion",
                    "perhaps not the law: it explains the data to their noise, but some of its terms are too uncertain to be told from others",
                )
            }
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
        let kept = match self.inner.dissipation() {
            None => points.shape.kept(),
            Some(_) => "",
        };
        Some(WrittenLaw {
            text: text(Style::Text),
            latex: text(Style::Latex),
            verdict: verdict.into(),
            meaning: format!("{meaning}{kept}"),
            explains: points.shape.misfit.is_some_and(|own| own <= EXPLAINS),
        })
    }

    fn equations(&self, graph: Graph) -> Result<Equations> {
        let points = &self.inner.lagrangian;
        let without = match (self.constraints().is_empty(), points.shape.has_curves()) {
            (false, _) => "a model with constraints between its coordinates",
            (true, true) => "a model whose forces are curves of distances or fields",
            (true, false) => return expression::of(graph, points, &self.inner.applied()),
        };
        Err(expression::without(without))
    }
}
