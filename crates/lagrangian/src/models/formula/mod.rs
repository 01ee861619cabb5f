//! Lagrangians in closed form: a sum of a few terms, found in the data.
//!
//! | file | content |
//! |---|---|
//! | `term.rs` | a term, its derivatives, and how it is written |
//! | `learner.rs` | the refinement of its coefficients by rollouts |
//! | `search/` | which terms: Hamilton's principle as rows (theory.md, section 32) |
//! | `family.rs` | losses and data, settings, saved form, row of the table |

pub(crate) mod family;
mod learner;
mod search;
mod term;

use num_dual::Dual64;
use serde::{Deserialize, Serialize};

pub use search::LawVerdict;
pub(crate) use search::{
    Drift, STRIDE, Stretch, WINDOW, Weight, contradiction, drifts, errors, noise_sizes, positions,
    scores, stretches,
};
pub(crate) use term::Style;
pub use term::Term;
use term::{MOST_COORDINATES, Position, Row};

use crate::models::learned::{Description, LearnedLagrangian, Stored, WrittenLaw};
use crate::models::named::Parameter;
use crate::models::network::{Network, NetworkShape, Parts, check_coordinates};
use lagrangian_mechanics::expression::{Expressed, Moving};
use lagrangian_mechanics::forces::Dissipation;
use lagrangian_mechanics::lagrangian::{Curvature, Jet, Jets, Lagrangian};
use lagrangian_motion::{Coordinates, Error, Result, Topology};
use nets::{Build, Net};

/// A Lagrangian in closed form, L(q, q̇) = Σ c · term.
///
/// Its parameters are c in units of the terms on the data; [`Formula::coefficients`] are c.
pub type Formula = Network<FormulaShape>;

/// The settings of a formula.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FormulaConfig {
    /// The terms; empty where they are to be found.
    pub terms: Vec<Term>,
    /// Where each coordinate is measured from in the terms, `[n]`; empty for 0.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub origins: Vec<f64>,
}

/// What the data say of a formula.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Evidence {
    /// The unit of each coefficient: 1 over the size that its term has in the balance of forces.
    pub units: Vec<f64>,
    /// The standard error of each coefficient; 0 for the one that the others are measured by.
    pub errors: Vec<f64>,
    /// The standard error of the coefficients of friction: viscous, Coulomb and by drag, `[3, n]`, then of dampers between coordinates,
    /// `[n, n]`, where there are any; empty where they are not known.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub friction: Vec<f64>,
    /// χ² of rollouts over its expectation: 1 where the formula errs by the noise of the data alone.
    pub misfit: f64,
    /// What the formula is.
    pub verdict: LawVerdict,
}

/// The shape of a [`Formula`], without its coefficients.
#[derive(Debug, Clone)]
pub struct FormulaShape {
    coordinates: Coordinates,
    config: FormulaConfig,
    evidence: Evidence,
    net: Net,
}

impl NetworkShape for FormulaShape {
    type Config = FormulaConfig;
    type Scaling = Evidence;

    fn new(coordinates: Coordinates, config: FormulaConfig, evidence: Evidence) -> Result<Self> {
        check_coordinates(&coordinates)?;
        let count = config.terms.len();
        if !(1..=MOST).contains(&count) {
            return Err(Error::argument("terms", count, "between 1 and 1000"));
        }
        if let Some(term) = config.terms.iter().find(|term| !term.suits(&coordinates)) {
            let must = "of harmonics, powers and at most two velocities of these coordinates";
            return Err(Error::argument("terms", format!("{term:?}"), must));
        }
        if !config.origins.is_empty() {
            let remedy = "give one for each coordinate, or none";
            Error::check_shape("origins", config.origins.len(), coordinates.dof(), remedy)?;
            Error::check_finite("origins", &config.origins)?;
        }
        let remedy = "give one for each term";
        Error::check_shape("units", evidence.units.len(), count, remedy)?;
        Error::check_shape("errors", evidence.errors.len(), count, remedy)?;
        Error::check_finite("errors", &evidence.errors)?;
        Error::check_finite("errors of friction", &evidence.friction)?;
        if let Some(unit) = evidence
            .units
            .iter()
            .find(|u| !(u.is_finite() && **u > 0.0))
        {
            return Err(Error::argument("units", unit, "finite and positive"));
        }
        let mut build = Build::new(count, 0);
        build.linear(1, &[nets::Source::Features]);
        Ok(Self {
            net: build.finish(),
            coordinates,
            config,
            evidence,
        })
    }

    fn parts(&self) -> Parts<'_, FormulaConfig, Evidence> {
        Parts {
            coordinates: &self.coordinates,
            config: &self.config,
            scaling: &self.evidence,
            net: &self.net,
        }
    }
}

/// The largest number of terms.
const MOST: usize = 1000;

impl FormulaShape {
    /// Each term with the unit of its coefficient.
    fn terms(&self) -> impl Iterator<Item = (&Term, f64)> {
        let units = self.evidence.units.iter().copied();
        self.config.terms.iter().zip(units)
    }
}

impl FormulaShape {
    /// The same with terms of positions that are measured from these.
    fn measured_from(self, origins: &[f64]) -> Result<Self> {
        let config = FormulaConfig {
            origins: origins.to_vec(),
            ..self.config
        };
        Self::new(self.coordinates, config, self.evidence)
    }

    /// Positions from the origins of the terms, and zeros.
    fn centred(&self, q: &[f64]) -> Row<f64> {
        let mut own = [0.0; MOST_COORDINATES];
        own.iter_mut().zip(q).for_each(|(own, q)| *own = *q);
        let from = own.iter_mut().zip(&self.config.origins);
        from.for_each(|(own, from)| *own -= from);
        own
    }
}

impl Formula {
    /// The terms of L.
    #[must_use]
    pub fn terms(&self) -> &[Term] {
        &self.shape.config.terms
    }

    /// The coefficient of each term, in SI units.
    #[must_use]
    pub fn coefficients(&self) -> Vec<f64> {
        self.weighted().map(|(_, c)| c).collect()
    }

    /// What the data say of it.
    #[must_use]
    pub fn evidence(&self) -> &Evidence {
        &self.shape.evidence
    }

    /// Each term with its coefficient.
    fn weighted(&self) -> impl Iterator<Item = (&Term, f64)> {
        let all = self.shape.terms().zip(&self.parameters);
        all.map(|((term, unit), theta)| (term, theta * unit))
    }

    /// L as a sum. Digits in brackets are the standard error, in units of the last digits.
    fn sum(&self, style: Style) -> String {
        let mut text = String::from("L =");
        for ((term, c), error) in self.weighted().zip(&self.shape.evidence.errors) {
            let product = term.written(&self.shape.coordinates, style);
            push_term(&mut text, [c, *error], &product, style);
        }
        let coordinates = self.shape.coordinates.0.iter();
        let moved = coordinates.zip(&self.shape.config.origins);
        for (own, from) in moved.filter(|own| *own.1 != 0.0) {
            let sign = if *from < 0.0 { "-" } else { "" };
            text += &format!(
                "; {} from {sign}{}",
                style.name(&own.name),
                short(from.abs())
            );
        }
        text
    }
}

/// Adds a term, its coefficient with the standard error, to a sum.
pub(super) fn push_term(text: &mut String, [c, error]: [f64; 2], product: &str, style: Style) {
    let first = text.ends_with('=');
    text.push_str(match (c < 0.0, first) {
        (true, true) => " -",
        (true, false) => " - ",
        (false, true) => " ",
        (false, false) => " + ",
    });
    text.push_str(&with_error(c.abs(), error));
    if !product.is_empty() {
        text.push_str(if style == Style::Text { " " } else { "\\," });
        text.push_str(product);
    }
}

/// What friction does, for each coordinate that has some; the standard errors of its coefficients are `[3, n]`, or not known.
pub(crate) fn friction(
    coordinates: &Coordinates,
    (friction, errors): (&Dissipation, &[f64]),
    style: Style,
) -> String {
    let (mut text, n) = (String::new(), coordinates.dof());
    let error = |at: usize| errors.get(at).copied().unwrap_or(0.0);
    for (i, coordinate) in coordinates.0.iter().enumerate() {
        let name = style.name(&coordinate.name);
        let rate = style.rate(&name);
        let [size, sign] = match style {
            Style::Text => [format!("{rate} |{rate}|"), format!("sign({rate})")],
            Style::Latex => [
                format!("{rate}\\,|{rate}|"),
                format!("\\operatorname{{sgn}}({rate})"),
            ],
        };
        let drag = friction.drag.as_ref().map_or(0.0, |drag| drag[i]);
        let kinds = [
            (friction.viscous[i], rate),
            (friction.coulomb[i], sign),
            (drag, size),
        ];
        let kinds: Vec<String> = kinds
            .into_iter()
            .enumerate()
            .filter(|(_, (c, _))| *c > 0.0)
            .map(|(kind, (c, of))| format!("{} {of}", with_error(c, error(kind * n + i))))
            .collect();
        let mut own = kinds.join(" + ");
        for j in 0..n {
            let at = i * n + j;
            let c = friction.between.as_ref().map_or(0.0, |own| own[at]);
            if c != 0.0 {
                let of = style.rate(&style.name(&coordinates.0[j].name));
                push_term(&mut own, [c, error(3 * n + at)], &of, style);
            }
        }
        if !own.is_empty() {
            let against = match style {
                Style::Text => format!("; friction of {name}: "),
                Style::Latex => format!(",\\quad d_{{{name}}} = "),
            };
            text.push_str(&against);
            text.push_str(&own);
        }
    }
    text
}

/// A number to five digits.
fn short(value: f64) -> String {
    let places = (4.0 - value.abs().max(1e-300).log10().floor()).clamp(0.0, 12.0) as usize;
    let text = format!("{value:.places$}");
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').into(),
        false => text,
    }
}

/// A number with its standard error in brackets, in units of the last digits: 9.810(2).
pub(super) fn with_error(value: f64, error: f64) -> String {
    if !(error > 0.0 && error.is_finite()) {
        return short(value);
    }
    let places = -error.log10().floor();
    if !(-3.0..=12.0).contains(&places) || error >= value {
        return format!("{value:.3e} ± {error:.0e}");
    }
    let places = places.max(0.0) as usize;
    let digits = (error * 10f64.powi(places as i32)).round();
    format!("{value:.places$}({digits})")
}

impl LearnedLagrangian for Formula {
    fn description(&self) -> Description {
        Description::mechanical(family::NAME, "A formula")
    }

    fn stored(&self) -> Result<Stored> {
        self.stored_as(family::NAME)
    }

    fn written(&self, friction_beside: Option<&Dissipation>) -> Option<WrittenLaw> {
        let text = |style: Style| {
            let beside = friction_beside.map(|own| {
                let own = (own, &*self.shape.evidence.friction);
                friction(&self.shape.coordinates, own, style)
            });
            self.sum(style) + &beside.unwrap_or_default()
        };
        let verdict = self.shape.evidence.verdict;
        Some(WrittenLaw {
            text: text(Style::Text),
            latex: text(Style::Latex),
            verdict: verdict.name().into(),
            meaning: verdict.meaning().to_owned()
                + &self.undeclared()
                + self.others(friction_beside),
            explains: verdict == LawVerdict::Law,
        })
    }

    fn terms(&self) -> Vec<Parameter> {
        let all = self.weighted().zip(&self.shape.evidence.errors);
        let parameter = |((term, value), error): ((&Term, f64), &f64)| Parameter {
            name: term.written(&self.shape.coordinates, Style::Text),
            value,
            unit: String::new(),
            standard_error: (*error > 0.0).then_some(*error),
        };
        all.map(parameter).collect()
    }

    fn friction_errors(&self) -> &[f64] {
        &self.shape.evidence.friction
    }
}

impl Formula {
    /// Whether other Lagrangians have the same motions, in words: M A and K A with the A that keep both symmetric.
    fn others(&self, friction: Option<&Dissipation>) -> &'static str {
        let evidence = &self.shape.evidence;
        let mut terms = self.shape.config.terms.iter();
        let is_linear = terms
            .clone()
            .all(|own| own.is_linear() && own.speeds.len() != 1);
        let together = terms.any(|own| {
            (0..self.coordinates().dof())
                .filter(|i| own.uses(*i))
                .count()
                > 1
        });
        let scaled = evidence.errors.contains(&0.0);
        let rubs = friction.is_some_and(|own| own.viscous.iter().any(|b| *b > 0.0));
        match is_linear && together && scaled && !rubs && evidence.verdict == LawVerdict::Law {
            true => {
                "; without friction or forces a linear system has other Lagrangians of the same motions, which share its masses out otherwise"
            }
            false => "",
        }
    }

    /// The lines that turn as angles do, in words.
    fn undeclared(&self) -> String {
        let uses = |of: fn(&Term) -> &Vec<i8>, i: usize| {
            let terms = &self.shape.config.terms;
            terms
                .iter()
                .any(|own| of(own).get(i).is_some_and(|k| *k != 0))
        };
        let named = |topology: Topology, of: fn(&Term) -> &Vec<i8>| {
            let all = self.shape.coordinates.0.iter().enumerate();
            let all = all.filter(|(i, own)| own.topology == topology && uses(of, *i));
            all.map(|(_, own)| &*own.name).collect::<Vec<_>>()
        };
        let says = |names: Vec<&str>, what: &str| match names.is_empty() {
            true => String::new(),
            false => format!("; {} {what}", names.join(", ")),
        };
        let turning = named(Topology::Line, |own| &own.turns);
        let lying = named(Topology::Circle, |own| &own.powers);
        says(turning, "turns as an angle does, which nobody declared")
            + &says(lying, "does not repeat after a turn")
    }
}

impl Lagrangian for Formula {
    fn coordinates(&self) -> &Coordinates {
        &self.shape.coordinates
    }

    fn jets(&self) -> Box<dyn Jets + '_> {
        Box::new(FormulaJets(self))
    }

    fn expressed<'g>(&self, at: &Moving<'g>) -> Option<Expressed<'g>> {
        let (mut q, qd) = (at.q.each(), at.qd.each());
        let graph = at.q.graph();
        let from = q.iter_mut().zip(&self.shape.config.origins);
        from.for_each(|(q, from)| *q = *q - graph.number(*from));
        let terms = self
            .weighted()
            .map(|(term, c)| term.expression(&q, &qd) * graph.number(c));
        Some(Expressed::of(
            terms.fold(graph.number(0.0), |sum, term| sum + term),
            at,
        ))
    }
}

/// The derivatives of a formula, term by term.
struct FormulaJets<'a>(&'a Formula);

impl Jets for FormulaJets<'_> {
    fn jet(&mut self, q: &[f64], qd: &[f64], jet: &mut Jet) {
        let n = self.0.shape.dof();
        let m = q.len() / n;
        jet.resize(m, n);
        let fields = [&mut jet.lagrangian, &mut jet.dl_dq, &mut jet.momentum];
        let others = [&mut jet.mass_matrix, &mut jet.momentum_drift];
        fields
            .into_iter()
            .chain(others)
            .for_each(|field| field.fill(0.0));
        for s in 0..m {
            let (q, qd) = (self.0.shape.centred(&q[s * n..][..n]), &qd[s * n..][..n]);
            for (term, c) in self.0.weighted() {
                let Position { value, slope } = term.position(&q[..n]);
                let along: f64 = slope.iter().zip(qd).map(|(g, v)| g * v).sum();
                let speed = term.speed(qd);
                jet.lagrangian[s] += c * value * speed;
                for (i, slope) in slope.iter().enumerate().take(n) {
                    let by_speed = c * term.by_speed(qd, i);
                    jet.dl_dq[s * n + i] += c * speed * slope;
                    jet.momentum[s * n + i] += value * by_speed;
                    jet.momentum_drift[s * n + i] += along * by_speed;
                    for j in 0..n {
                        jet.mass_matrix[(s * n + i) * n + j] += c * value * term.by_speeds(i, j);
                    }
                }
            }
        }
    }

    fn curvature(&mut self, q: &[f64], qd: &[f64], curvature: &mut Curvature) {
        let n = self.0.shape.dof();
        let m = q.len() / n;
        curvature.resize(m, n);
        curvature.dl_dqdq.fill(0.0);
        curvature.dp_dq.fill(0.0);
        for s in 0..m {
            let (q, qd) = (self.0.shape.centred(&q[s * n..][..n]), &qd[s * n..][..n]);
            for j in 0..n {
                let q = along(&q[..n], j);
                for (term, c) in self.0.weighted() {
                    let Position { value, slope } = term.position(&q);
                    let speed = c * term.speed(qd);
                    for (i, slope) in slope.iter().enumerate().take(n) {
                        let at = (s * n + i) * n + j;
                        curvature.dl_dqdq[at] += speed * slope.eps;
                        curvature.dp_dq[at] += c * term.by_speed(qd, i) * value.eps;
                    }
                }
            }
        }
    }
}

/// x with the direction of component `j`.
fn along(x: &[f64], j: usize) -> Vec<Dual64> {
    let each = x.iter().enumerate();
    each.map(|(i, x)| Dual64::new(*x, f64::from(u8::from(i == j))))
        .collect()
}
