//! Lattices as a family: their data, their settings, their saved form.

use serde::{Deserialize, Serialize};

use super::search::{self, Solved};
use super::{LatticeConfig, LatticeEnds};
use crate::dataset::Dataset;
use crate::models::family::{self, Abilities, Candidate, Entry, Family, Plan, Solution};
use crate::models::formula::{Style, WINDOW, friction, push_term};
use crate::models::learned::{Description, FittedModel, Learned, ModelParts, Stored, WrittenLaw};
use crate::models::named::{Named, Parameter};
use crate::saved::{self, SavedModel, WEIGHTS};
use crate::train::{Loss, MAX_DOF, Observer, TrainingTask};
use lagrangian_mechanics::dynamics::{Evaluator, Model};
use lagrangian_mechanics::expression::{self, Equations, Graph};
use lagrangian_mechanics::forces::Applied;
use lagrangian_mechanics::lattice::{Basis, Lattice, LatticeShape};
use lagrangian_motion::settings::{Kind, Named as Choice, Range, Setting};
use lagrangian_motion::{Coordinates, Error, Result};

/// The row of the table of families.
pub(crate) const ENTRY: Entry = Entry {
    name: NAME,
    about: "many sites that obey one law with their neighbours: chains, rings, grids",
    default: family::default::<LatticeConfig>,
    settings: SETTINGS,
    choose: family::no_choice,
    read: family::read::<LatticeConfig>,
    saved_as: &[NAME],
    load: |saved| Ok(load(saved)?.into()),
    candidates: &[Candidate {
        on: |data, robot| !robot && data.train.goal.is_empty() && is_one(data),
        alone: true,
        ..Candidate::of_motion(0, "", &[])
    }],
    jointed: false,
};

const NAME: &str = "lattice";

/// The settings of lattices.
const SETTINGS: &[Setting] = &[
    Setting::new(
        "neighbours",
        Kind::Numbers(Range {
            min: 1.0,
            max: 1e6,
        }),
        "The differences of the indices of neighbours, such as 1 in a chain, or 1 and 32 in a grid of rows of 32",
    )
    .or("found"),
    Setting::new(
        "ends",
        Kind::Choice(&[
            Choice {
                name: "find",
                help: "what the data say",
            },
            Choice {
                name: "ring",
                help: "the last site is a neighbour of the first",
            },
            Choice {
                name: "walls",
                help: "the first and the last sites are bound to walls at 0",
            },
            Choice {
                name: "free",
                help: "nothing",
            },
        ]),
        "What bounds the sites",
    )
    .or("find"),
];

/// The smallest number of sites, and that from which on a lattice is looked for where no family is named.
const FEWEST: usize = 4;
const MANY: usize = 8;
/// The part of the motion that it may leave for a plain fit to take it: of few enough coordinates for other families, and of more.
const TAKEN: [f64; 2] = [1e-3, 0.02];
/// The largest number of sites whose masses are listed.
const LISTED: usize = 64;
/// The largest number of sites whose neighbours are looked for.
const MOST: usize = 20_000;

/// Whether one law of neighbours explains these motions.
fn is_one(dataset: &Dataset) -> bool {
    let config = LatticeConfig::default();
    let n = dataset.coordinates.dof();
    let part = TAKEN[usize::from(n > MAX_DOF)];
    n >= MANY
        && config.refuse(dataset).is_ok()
        && search::find(dataset, &config, &mut ()).is_ok_and(|own| own.is_right(part))
}

impl LatticeConfig {
    fn refuse(&self, dataset: &Dataset) -> Result<()> {
        let coordinates = &dataset.coordinates;
        let n = coordinates.dof();
        if n < FEWEST {
            let must = "at least 4 coordinates: a law of neighbours is one of many sites";
            return Err(Error::argument("q", n, must));
        }
        if n > MOST && self.neighbours.is_empty() {
            let must = "at most 20000 coordinates, or their neighbours given (`neighbours`)";
            return Err(Error::argument("q", n, must));
        }
        let first = coordinates.0[0].topology;
        let other = coordinates.0.iter().find(|own| own.topology != first);
        if let Some(own) =
            other.or_else(|| coordinates.0.iter().find(|_| coordinates.is_parameter(0)))
        {
            let must = "all lines or all angles that move, as the sites of a lattice are";
            return Err(Error::argument("q", own.name.clone(), must));
        }
        if let Some(offset) = self
            .neighbours
            .iter()
            .find(|own| !(1..=n / 2).contains(*own))
        {
            let must = "at least 1, and at most half the number of sites";
            return Err(Error::argument("neighbours", offset, must));
        }
        if dataset.train_times.longest() < WINDOW {
            let must = "of recordings with at least 25 samples each: a law is found in stretches of motion";
            return Err(Error::argument("data", "samples", must));
        }
        Ok(())
    }
}

impl Family for LatticeConfig {
    fn name(&self) -> &'static str {
        NAME
    }

    fn summary(&self) -> String {
        let ends = match self.ends {
            LatticeEnds::Find => "ends as found",
            LatticeEnds::Ring => "a ring",
            LatticeEnds::Walls => "between walls",
            LatticeEnds::Free => "free ends",
        };
        match self.neighbours.is_empty() {
            true => format!("neighbours and their law are found, {ends}"),
            false => format!("neighbours {:?} sites apart, {ends}", self.neighbours),
        }
    }

    fn abilities(&self) -> Abilities {
        let remedy =
            "omitted: a lattice is found in positions, and in the forces where they are recorded";
        Abilities {
            solved: true,
            cyclic: false,
            ..Abilities::of_losses(&[Loss::ACCELERATION, Loss::TORQUE], remedy)
        }
    }

    fn check(&self, dataset: &Dataset, _task: &TrainingTask) -> Result<()> {
        self.refuse(dataset)
    }

    fn prepare(&self, dataset: &Dataset, task: &TrainingTask) -> Result<Plan> {
        self.check(dataset, task)?;
        let own = self.clone();
        Ok(Plan::Solve(Box::new(
            move |dataset, observer: &mut dyn Observer| {
                let found = search::find(dataset, &own, observer)?;
                let [loss, validation] = found.left;
                Ok(Solution {
                    model: LearnedLattice::from(found).into(),
                    loss,
                    validation: (validation > 0.0).then_some(validation),
                })
            },
        )))
    }
}

/// What a law leaves of the motions.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Misfit {
    /// In units of what the noise of positions leaves.
    pub(super) of_noise: f64,
    /// In parts of the motion.
    pub(super) left: f64,
    /// Whether splines, or series that need not end, stand for functions that are not known.
    pub(super) curved: bool,
}

/// A misfit up to which the data are explained to their noise; a part of the motion that the steps of integrals leave.
const FITS: f64 = 1.15;
const ROUNDED: f64 = 1e-7;

impl Misfit {
    pub(super) fn is_explained(&self) -> bool {
        self.of_noise <= FITS || self.left <= ROUNDED
    }
}

impl Solved {
    /// Whether there are bonds, and it explains the motion to its noise or to a part.
    fn is_right(&self, part: f64) -> bool {
        let right = self.misfit.is_explained() || self.left.iter().all(|own| *own <= part);
        right && self.lattice.laws().next().is_some()
    }
}

/// All of a saved lattice but its numbers.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Architecture {
    shape: LatticeShape,
    misfit: Misfit,
}

/// A fitted lattice.
#[derive(Debug, Clone)]
pub(crate) struct LearnedLattice {
    lattice: Lattice,
    /// The standard error of each parameter; 0 where it is not known.
    errors: Vec<f64>,
    misfit: Misfit,
}

impl From<Solved> for LearnedLattice {
    fn from(own: Solved) -> Self {
        Self {
            lattice: own.lattice,
            errors: own.errors,
            misfit: own.misfit,
        }
    }
}

/// The tensor of the standard errors.
const ERRORS: &str = "standard_errors";

fn load(saved: &SavedModel) -> Result<LearnedLattice> {
    let header = &saved.header;
    let own: Architecture = saved::read("architecture", &header.architecture)?;
    let [parameters, errors] = saved.vectors([WEIGHTS, ERRORS])?;
    let (dissipation, _) = saved.forces()?;
    let coordinates = header.coordinates.clone();
    let remedy = "give one for each parameter";
    Error::check_shape("standard errors", errors.len(), parameters.len(), remedy)?;
    Ok(LearnedLattice {
        lattice: Lattice::new(coordinates, own.shape, parameters, dissipation)?,
        errors,
        misfit: own.misfit,
    })
}

impl Model for LearnedLattice {
    fn coordinates(&self) -> &Coordinates {
        self.lattice.coordinates()
    }

    fn evaluator(&self) -> Box<dyn Evaluator + '_> {
        self.lattice.evaluator()
    }
}

impl FittedModel for LearnedLattice {
    fn description(&self) -> Description {
        Description::mechanical(NAME, "A lattice")
    }

    fn stored(&self) -> Result<Stored> {
        let own = Architecture {
            shape: self.lattice.shape().clone(),
            misfit: self.misfit.clone(),
        };
        let stored = Stored::new(NAME, &own, &(), self.lattice.parameters())?;
        Ok(stored.with(ERRORS, &self.errors))
    }

    fn parts(&self) -> ModelParts<'_> {
        ModelParts {
            forces: Applied {
                dissipation: self.lattice.dissipation(),
                ..Applied::default()
            },
            ..ModelParts::default()
        }
    }

    fn parameters(&self) -> Vec<Parameter> {
        let mut terms = self.terms();
        terms.extend(self.masses());
        terms.extend(self.lattice.dissipation().map(|own| Parameter {
            name: "viscous friction of each site".into(),
            value: own.viscous[0],
            unit: String::new(),
            standard_error: None,
        }));
        Named::of(self.coordinates()).terms(terms).list()
    }

    fn written(&self) -> Option<WrittenLaw> {
        let text = |style: Style| {
            let damped = self.lattice.dissipation();
            let mut first = self.coordinates().0[0].clone();
            first.name = "q[i]".into();
            let first = Coordinates(vec![first]);
            let beside = damped.map(|own| friction(&first, (own, &[]), style));
            self.sum(style) + &beside.unwrap_or_default()
        };
        let (verdict, meaning) = match (self.misfit.is_explained(), self.misfit.curved) {
            (true, false) => (
                "law",
                "the law of each site, as far as these data tell: it explains them to their noise",
            ),
            (true, true) => (
                "expansion",
                "one law of neighbours explains the data to their noise; its functions are curves or series, not formulas",
            ),
            _ => (
                "none",
                "no law: one law of neighbours does not explain the data to their noise",
            ),
        };
        Some(WrittenLaw {
            text: text(Style::Text),
            latex: text(Style::Latex),
            verdict: verdict.into(),
            meaning: meaning.into(),
            explains: verdict == "law",
        })
    }

    fn equations(&self, _: Graph) -> Result<Equations> {
        Err(expression::without("a lattice"))
    }
}

/// One part of a potential: its functions, their coefficients and standard errors, and what its argument is.
struct PartOfLaw<'a> {
    name: String,
    basis: Basis,
    coefficients: &'a [f64],
    errors: &'a [f64],
    argument: String,
}

impl LearnedLattice {
    /// The law on another number of sites.
    pub(crate) fn with_sites(&self, sites: usize) -> Result<Learned> {
        let lattice = self.lattice.resized(sites)?;
        let own = &self.errors[self.coordinates().dof()..];
        let errors = [&vec![self.errors[0]; sites], own].concat();
        Ok(Self {
            lattice,
            errors,
            misfit: self.misfit.clone(),
        }
        .into())
    }

    fn site(&self, style: Style, offset: usize) -> String {
        let name = &self.coordinates().0[0].name;
        let stem = name.trim_end_matches(|c: char| c.is_ascii_digit());
        let stem = if stem.is_empty() { name } else { stem };
        let index = match offset {
            0 => "i".into(),
            _ => format!("i+{offset}"),
        };
        match style {
            Style::Text => format!("{stem}[{index}]"),
            Style::Latex => format!("{stem}_{{{index}}}"),
        }
    }

    fn parts_of_law(&self, style: Style) -> Vec<PartOfLaw<'_>> {
        let here = self.site(style, 0);
        let mut first = self.coordinates().dof();
        let mut all = Vec::new();
        for law in self.lattice.laws() {
            let offset = law.bonds.offset;
            all.push(PartOfLaw {
                name: format!("W{offset}"),
                basis: law.bonds.basis,
                coefficients: law.coefficients,
                errors: &self.errors[first..first + law.coefficients.len()],
                argument: format!("({} - {here})", self.site(style, offset)),
            });
            first += law.coefficients.len() + 1;
        }
        if let Some((basis, coefficients)) = self.lattice.site() {
            all.push(PartOfLaw {
                name: "U".into(),
                basis,
                coefficients,
                errors: &self.errors[first..],
                argument: here,
            });
        }
        all
    }

    /// The coefficients of the potentials, with their standard errors.
    fn terms(&self) -> Vec<Parameter> {
        let mut all = Vec::new();
        for part in self.parts_of_law(Style::Text) {
            for (value, error, term) in part.terms(Style::Text).into_iter().flatten() {
                all.push(Parameter {
                    name: format!("{}: {term}", part.name),
                    value,
                    unit: String::new(),
                    standard_error: (error > 0.0).then_some(error),
                });
            }
        }
        let coupled = self.lattice.laws().filter(|own| own.inertia > 0.0);
        all.extend(coupled.map(|own| Parameter {
            name: format!("inertia between sites {} apart", own.bonds.offset),
            value: own.inertia,
            unit: String::new(),
            standard_error: None,
        }));
        all
    }

    /// The masses of the sites where they differ, of not too many.
    fn masses(&self) -> impl Iterator<Item = Parameter> + '_ {
        let masses = self.lattice.masses();
        let listed = !self.are_equal() && masses.len() <= LISTED;
        let sites = self.coordinates().0.iter().zip(masses);
        sites.filter(move |_| listed).map(|(site, mass)| Parameter {
            name: format!("mass of {}", site.name),
            value: *mass,
            unit: "of the mean".into(),
            standard_error: None,
        })
    }

    fn are_equal(&self) -> bool {
        let masses = self.lattice.masses();
        masses.iter().all(|own| own.total_cmp(&masses[0]).is_eq())
    }

    /// The Lagrangian of one site.
    fn sum(&self, style: Style) -> String {
        let mut text = match style {
            Style::Text => String::from("L = sum over i of"),
            Style::Latex => String::from("L = \\sum_i"),
        };
        let masses = self.lattice.masses();
        let rate = style.rate(&self.site(style, 0));
        text.push_str(&match (self.are_equal(), style) {
            (true, _) => format!(" {} {rate}^2", 0.5 * masses[0]),
            (false, Style::Text) => format!(" 0.5 m[i] {rate}^2"),
            (false, Style::Latex) => format!(" \\frac{{1}}{{2}} m_i {rate}^2"),
        });
        for law in self.lattice.laws().filter(|own| own.inertia > 0.0) {
            let other = style.rate(&self.site(style, law.bonds.offset));
            let half = [0.5 * law.inertia, 0.0];
            push_term(&mut text, half, &format!("({other} - {rate})^2"), style);
        }
        for part in self.parts_of_law(style) {
            match part.terms(style) {
                Some(terms) => terms
                    .into_iter()
                    .for_each(|(c, error, term)| push_term(&mut text, [-c, error], &term, style)),
                None => {
                    let argument = part.argument.trim_matches(['(', ')']);
                    text.push_str(&format!(" - {}({argument})", part.name));
                }
            }
        }
        text
    }
}

impl PartOfLaw<'_> {
    /// The terms of the potential: coefficient, standard error, product; `None` for a curve.
    fn terms(&self, style: Style) -> Option<Vec<(f64, f64, String)>> {
        let times = |k: usize| {
            if k == 1 {
                String::new()
            } else {
                format!("{k} ")
            }
        };
        let each = self.coefficients.iter().zip(self.errors).enumerate();
        let needed = each.filter(|(_, (c, _))| **c != 0.0);
        let [sin, cos] = match style {
            Style::Text => ["sin", "cos"],
            Style::Latex => ["\\sin", "\\cos"],
        };
        let argument = self.argument.trim_matches(['(', ')']);
        let term = |(k, (c, error)): (usize, (&f64, &f64))| match self.basis {
            Basis::Powers { .. } => {
                let order = k + 1;
                let power = match order {
                    1 => self.argument.clone(),
                    _ => format!("{}^{order}", self.argument),
                };
                (c / order as f64, error / order as f64, power)
            }
            // The integral of a sine is less the cosine.
            _ => {
                let multiple = k / 2 + 1;
                let (function, sign) = if k % 2 == 0 { (cos, -1.0) } else { (sin, 1.0) };
                let product = format!("{function}({}{argument})", times(multiple));
                let factor = 1.0 / multiple as f64;
                (sign * c * factor, error * factor, product)
            }
        };
        (!super::law::is_spline(&self.basis)).then(|| needed.map(term).collect())
    }
}
