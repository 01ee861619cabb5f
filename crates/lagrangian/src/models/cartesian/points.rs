//! The Lagrangian of points: L = ½ Σ m |ẋ|² − Σ c φ(x), with φ a coordinate, the product of two, or a function of a distance.

use serde::{Deserialize, Serialize};

use super::family::NAME;
use super::inertia::{Shared, inverse_of, mass_matrix};
use super::radial::{Place, Radial, RadialLaw, places};
use crate::models::formula::{Style, push_term, with_error};
use crate::models::learned::Stored;
use crate::models::named::Parameter;
use lagrangian_mechanics::expression::{Expressed, Moving};
use lagrangian_mechanics::lagrangian::{Jet, Jets, Lagrangian};
use lagrangian_motion::solve::dot;
use lagrangian_motion::{Constraint, Coordinates, Error, Result};

/// At most so many powers of one distance are summed, such as those of a spring or of two molecules: more would be an expansion, and curves are a
/// better one.
pub(super) const MOST_POWERS: usize = 2;

/// Of a law of forces between points each coefficient is at least so many standard errors: smaller ones stand in for what is missing.
const CERTAIN: f64 = 20.0;

/// What is known of the points: their coordinates, their potential, how they are joined.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Shape {
    /// The coordinates of each point.
    pub(super) points: Vec<Vec<usize>>,
    /// The one or two coordinates whose product each term of the potential is.
    pub(super) potential: Vec<Vec<usize>>,
    /// The terms of the potential after these: functions of distances.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(super) radial: Vec<Radial>,
    /// What points of one rigid body share of its inertia.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(super) shared: Vec<Shared>,
    /// The constraints.
    pub(super) constraints: Vec<Constraint>,
    /// χ² over its expectation, where the noise of the data is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) misfit: Option<f64>,
    /// Whether sources with another power of the distance explain the data as well.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub(super) doubtful: bool,
}

impl Shape {
    /// The number of inertias: of points, and of what they share.
    fn inertias(&self) -> usize {
        self.points.len() + self.shared.len()
    }

    /// Refuses terms of other coordinates or points.
    fn check(&self, n: usize) -> Result<()> {
        let wrong = |own: &&Shared| !own.is_right(&self.points);
        if let Some(own) = self.shared.iter().find(wrong) {
            let must = "of two points with as many coordinates, two where it is turned";
            return Err(Error::argument("shared inertia", format!("{own:?}"), must));
        }
        let product =
            |own: &&Vec<usize>| !((1..=2).contains(&own.len()) && own.iter().all(|i| *i < n));
        if let Some(term) = self.potential.iter().find(product) {
            let must = "the product of one or two coordinates";
            return Err(Error::argument("potential", format!("{term:?}"), must));
        }
        let axes = |at: usize| self.points.get(at).map(Vec::len);
        let radial = |own: &&Radial| {
            let placed = own.law.about().is_some();
            let known = match *own.points {
                [a] => axes(a).is_some(),
                [a, b] => !placed && a != b && axes(a).is_some() && axes(a) == axes(b),
                _ => false,
            };
            !known || !own.law.is_right()
        };
        match self.radial.iter().find(radial) {
            Some(term) => {
                let must = "a function of the distance of one point, or of two with as many coordinates, of a basis or a power of at most 24";
                Err(Error::argument("potential", format!("{term:?}"), must))
            }
            None => Ok(()),
        }
    }

    /// Whether some of its forces are curves.
    pub(super) fn has_curves(&self) -> bool {
        self.radial.iter().any(|own| own.law.is_curve())
    }

    /// What motions without friction keep beside the energy: nothing turns or shifts points whose forces depend on their distances alone.
    pub(super) fn kept(&self) -> &'static str {
        let placed = self.radial.iter().any(|own| own.law.about().is_some());
        let free = self.constraints.is_empty() && self.potential.is_empty() && !placed;
        match self.radial.iter().all(|own| own.points.len() == 2) {
            true if free => "; momentum and angular momentum are conserved",
            false if free => "; angular momentum is conserved",
            _ => "",
        }
    }

    /// Whether constraints hold each coordinate of a point, so that its mass has no effect.
    fn is_held(&self, point: &[usize]) -> bool {
        let holds = |own: &Constraint, i: usize| {
            let slopes = own.slopes.iter().filter(|(_, b)| *b != 0.0);
            own.products.is_empty() && own.constant.is_some() && slopes.map(|(j, _)| *j).eq([i])
        };
        (point.iter()).all(|i| self.constraints.iter().any(|own| holds(own, *i)))
    }
}

/// A term of the forces on points, with one coefficient.
#[derive(Debug, Clone, PartialEq)]
pub enum PointTerm {
    /// A term of the potential: the product of one or two coordinates.
    Potential(Vec<usize>),
    /// A term of the potential: a function of a distance.
    Radial(Radial),
    /// Viscous friction of a point: the force −b ẋ.
    Friction(usize),
}

impl PointTerm {
    pub(super) fn is_friction(&self) -> bool {
        matches!(self, Self::Friction(_))
    }

    /// The function of a distance that it is.
    pub(super) fn radial(&self) -> Option<&Radial> {
        match self {
            Self::Radial(own) => Some(own),
            _ => None,
        }
    }

    /// The place of its source, where it has one.
    pub(super) fn source(&self) -> Option<[f64; 3]> {
        match self.radial()?.law {
            RadialLaw::Source { about, .. } => Some(about),
            _ => None,
        }
    }

    /// Moves its source.
    pub(super) fn move_to(&mut self, next: [f64; 3]) {
        if let Self::Radial(Radial {
            law: RadialLaw::Source { about, .. },
            ..
        }) = self
        {
            *about = next;
        }
    }
}

/// Points with masses in a potential, in the order of the parameters: masses, what points share, then coefficients of the potential.
#[derive(Debug, Clone)]
pub struct Points {
    pub(super) coordinates: Coordinates,
    pub(super) shape: Shape,
    parameters: Vec<f64>,
    /// The standard error of each parameter, then of each coordinate of a source; 0 where it is not known.
    errors: Vec<f64>,
    /// The mass matrix, `[n, n]`.
    mass: Vec<f64>,
}

impl Points {
    pub(super) fn new(
        coordinates: Coordinates,
        shape: Shape,
        parameters: Vec<f64>,
        errors: Vec<f64>,
    ) -> Result<Self> {
        let n = coordinates.dof();
        let expected = shape.inertias() + shape.potential.len() + shape.radial.len();
        let remedy = "give one for each point and each term of the potential";
        Error::check_shape("parameters", parameters.len(), expected, remedy)?;
        let expected = expected + places(&shape.points, shape.radial.iter()).len();
        let remedy = "give one for each parameter, then for each coordinate of a source";
        Error::check_shape("standard errors", errors.len(), expected, remedy)?;
        Error::check_finite("parameters", &parameters)?;
        Error::check_finite("standard errors", &errors)?;
        shape.check(n)?;
        let of = (&shape.points[..], &shape.shared[..]);
        let mass = mass_matrix(n, of, &parameters[..shape.inertias()]);
        if inverse_of(&mass, n).is_none() {
            let masses = format!("{:?}", &parameters[..shape.inertias()]);
            return Err(Error::argument(
                "masses",
                masses,
                "a positive kinetic energy in all motions",
            ));
        }
        Ok(Self {
            coordinates,
            shape,
            parameters,
            errors,
            mass,
        })
    }

    /// The mass of each point, in units of that of the point that moves most where no forces are known.
    #[must_use]
    pub fn masses(&self) -> &[f64] {
        &self.parameters[..self.shape.points.len()]
    }

    /// The terms of the potential that are products of coordinates, with their coefficients.
    pub fn potential(&self) -> impl Iterator<Item = (&[usize], f64)> {
        let coefficients = &self.parameters[self.shape.inertias()..];
        let terms = self.shape.potential.iter().map(|own| &own[..]);
        terms.zip(coefficients.iter().copied())
    }

    /// The terms of the potential that are functions of distances, with their coefficients.
    pub fn radial(&self) -> impl Iterator<Item = (&Radial, f64)> {
        let first = self.shape.inertias() + self.shape.potential.len();
        let coefficients = &self.parameters[first..];
        self.shape.radial.iter().zip(coefficients.iter().copied())
    }

    /// Whether the coefficient of each force is far from nothing, in standard errors.
    pub(super) fn is_certain(&self) -> bool {
        let all = self.parameters.iter().zip(&self.errors);
        let mut forces = all.skip(self.shape.inertias());
        forces.all(|(value, error)| value.abs() >= CERTAIN * error)
    }

    pub(super) fn stored(&self) -> Result<Stored> {
        let stored = Stored::new(NAME, &self.shape, &(), &self.parameters)?;
        Ok(stored.with(ERRORS, &self.errors))
    }

    /// The masses and coefficients with their names.
    pub(super) fn named(&self) -> Vec<Parameter> {
        let names = |of: &[usize], between: &str| {
            let each = of.iter().map(|i| &*self.coordinates.0[*i].name);
            each.collect::<Vec<_>>().join(between)
        };
        let mass = |own: &Vec<usize>| {
            let name = format!("mass of ({})", names(own, ", "));
            (name, "kg".to_owned())
        };
        let term = |own: &Vec<usize>| {
            let unit = if own.len() == 1 { "N" } else { "N/m" };
            (format!("V: {}", names(own, " ")), unit.to_owned())
        };
        let places = self.places();
        let of = (&self.coordinates, &self.shape.points[..], &places[..]);
        let radial = self.shape.radial.iter();
        let radial = radial.map(|own| (format!("V: {}", own.written(of, Style::Text)), own.unit()));
        let potential = self.shape.potential.iter().map(term).chain(radial);
        let share = |own: &Shared| {
            let [a, b] = own.points.map(|at| names(&self.shape.points[at], ", "));
            let what = if own.turned {
                "turned inertia"
            } else {
                "inertia"
            };
            (format!("{what} shared by ({a}) and ({b})"), "kg".to_owned())
        };
        let masses = self.shape.points.iter().map(mass);
        let all = masses
            .chain(self.shape.shared.iter().map(share))
            .chain(potential);
        let values = self.parameters.iter().zip(&self.errors);
        let first = self.shape.inertias() + self.shape.potential.len();
        // What has no effect, and functions that mean something together alone.
        let held = |at: usize| match at.checked_sub(first) {
            Some(radial) => self.shape.radial[radial].law.is_curve(),
            None => (self.shape.points.get(at)).is_some_and(|own| self.shape.is_held(own)),
        };
        let each = all
            .zip(values)
            .enumerate()
            .filter(|(at, _)| !held(*at))
            .map(|(_, own)| own)
            .map(|((name, unit), (value, error))| Parameter {
                name,
                value: *value,
                unit,
                standard_error: (*error > 0.0).then_some(*error),
            });
        each.chain(self.named_places()).collect()
    }

    /// The coordinates of the places of its sources with their names.
    fn named_places(&self) -> Vec<Parameter> {
        let axes = self.shape.points.first().map_or(0, Vec::len);
        let place = |(own, error): (&Place, &f64)| {
            let axis = match own.axis < axes {
                true => ["x", "y", "z"][own.axis],
                false => "height",
            };
            Parameter {
                name: format!("place of {}: {axis}", own.name(Style::Text)),
                value: own.value(),
                unit: "m".into(),
                standard_error: (*error > 0.0).then_some(*error),
            }
        };
        let errors = &self.errors[self.parameters.len()..];
        self.places().iter().zip(errors).map(place).collect()
    }

    /// The coordinates of the places of its sources.
    fn places(&self) -> Vec<Place> {
        places(&self.shape.points, self.shape.radial.iter())
    }

    /// L as a sum.
    pub(super) fn written(&self, style: Style) -> String {
        let space = if style == Style::Text { " " } else { "\\," };
        let name = |i: &usize| style.name(&self.coordinates.0[*i].name);
        let mut text = String::from("L =");
        let mut add =
            |value: f64, error: f64, of: &str| push_term(&mut text, [value, error], of, style);
        let (inertias, others) = self.errors.split_at(self.shape.inertias());
        let (masses, shared) = inertias.split_at(self.shape.points.len());
        let points = self.shape.points.iter().zip(self.masses()).zip(masses);
        for ((point, mass), error) in points.filter(|own| !self.shape.is_held(own.0.0)) {
            let squares = point.iter().map(|i| format!("{}^2", style.rate(&name(i))));
            let sum = squares.collect::<Vec<_>>().join(" + ");
            let sum = if point.len() > 1 {
                format!("({sum})")
            } else {
                sum
            };
            add(0.5 * mass, 0.5 * error, &sum);
        }
        let values = &self.parameters[self.shape.points.len()..];
        for ((own, value), error) in self.shape.shared.iter().zip(values).zip(shared) {
            add(
                *value,
                *error,
                &own.written(&self.shape.points, |i| name(&i), style),
            );
        }
        let (products, radial) = others.split_at(self.shape.potential.len());
        let mut curves: Vec<String> = Vec::new();
        let places = self.places();
        for ((term, c), error) in self.radial().zip(radial) {
            let own = term.written((&self.coordinates, &self.shape.points, &places), style);
            match term.law.is_curve() {
                false => add(-c, *error, &own),
                _ if curves.contains(&own) => (),
                _ => curves.push(own),
            }
        }
        for ((term, c), error) in self.potential().zip(products) {
            let product = match term {
                [i, j] if i == j => format!("{}^2", name(i)),
                term => term.iter().map(name).collect::<Vec<_>>().join(space),
            };
            add(-c, *error, &product);
        }
        for own in curves {
            text += &format!(" - {own}");
        }
        text + &self.written_places(style)
    }

    /// Where its sources are.
    fn written_places(&self, style: Style) -> String {
        let (places, mut text) = (self.places(), String::new());
        let errors = &self.errors[self.parameters.len()..];
        for (at, (own, error)) in places.iter().zip(errors).enumerate() {
            let (first, last) = (
                at == 0 || places[at - 1].source != own.source,
                places
                    .get(at + 1)
                    .is_none_or(|next| next.source != own.source),
            );
            let sign = if own.value() < 0.0 { "-" } else { "" };
            let value = with_error(own.value().abs(), *error);
            match first {
                true => text += &format!("; {} = ({sign}{value}", own.name(style)),
                false => text += &format!(", {sign}{value}"),
            }
            text += if last { ")" } else { "" };
        }
        text
    }
}

/// The tensor of the standard errors.
pub(super) const ERRORS: &str = "standard_errors";

impl Lagrangian for Points {
    fn coordinates(&self) -> &Coordinates {
        &self.coordinates
    }

    fn jets(&self) -> Box<dyn Jets + '_> {
        Box::new(PointJets(self))
    }

    fn expressed<'g>(&self, at: &Moving<'g>) -> Option<Expressed<'g>> {
        let (q, qd, graph) = (at.q.each(), at.qd.each(), at.q.graph());
        let mut sum = graph.number(0.0);
        let entries = self.mass.iter().enumerate().filter(|own| *own.1 != 0.0);
        for (at, mass) in entries {
            sum = sum + graph.number(0.5 * mass) * qd[at / qd.len()] * qd[at % qd.len()];
        }
        for (term, c) in self.potential() {
            let product = term.iter().map(|i| q[*i]);
            sum = sum - product.fold(graph.number(c), |product, q| product * q);
        }
        for (term, c) in self.radial() {
            sum = sum - graph.number(c) * term.expressed(&self.shape.points, &q)?;
        }
        Some(Expressed::of(sum, at))
    }
}

/// The derivatives of the Lagrangian of points.
struct PointJets<'a>(&'a Points);

impl Jets for PointJets<'_> {
    fn jet(&mut self, q: &[f64], qd: &[f64], jet: &mut Jet) {
        let n = self.0.coordinates.dof();
        let states = q.len() / n.max(1);
        jet.resize(states, n);
        let fields = [&mut jet.lagrangian, &mut jet.dl_dq];
        let others = [&mut jet.mass_matrix, &mut jet.momentum_drift];
        let all = fields.into_iter().chain(others);
        all.for_each(|field| field.fill(0.0));
        for s in 0..states {
            let (q, qd) = (&q[s * n..][..n], &qd[s * n..][..n]);
            jet.mass_matrix[s * n * n..][..n * n].copy_from_slice(&self.0.mass);
            for (i, row) in self.0.mass.chunks_exact(n).enumerate() {
                jet.momentum[s * n + i] = dot(row, qd);
                jet.lagrangian[s] += 0.5 * jet.momentum[s * n + i] * qd[i];
            }
            for (term, c) in self.0.potential() {
                let value: f64 = term.iter().map(|i| q[*i]).product();
                jet.lagrangian[s] -= c * value;
                gradient(term, q, |i, slope| jet.dl_dq[s * n + i] -= c * slope);
            }
            let points = &self.0.shape.points;
            for (term, c) in self.0.radial() {
                jet.lagrangian[s] -= c * term.potential(points, q);
                term.gradient(points, q, |i, slope| jet.dl_dq[s * n + i] -= c * slope);
            }
        }
    }
}

/// Passes the derivatives of a product of coordinates to `add`.
pub(super) fn gradient(term: &[usize], q: &[f64], mut add: impl FnMut(usize, f64)) {
    match *term {
        [i] => add(i, 1.0),
        [i, j] => {
            add(i, q[j]);
            add(j, q[i]);
        }
        _ => (),
    }
}
