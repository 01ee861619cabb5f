//! Forces along the line between two points, or between a point and the origin or another fixed place: functions of their distance.

use serde::{Deserialize, Serialize};

use crate::models::formula::Style;
use lagrangian_mechanics::expression::{Function, Value};
use lagrangian_mechanics::lattice::Basis;
use lagrangian_motion::Coordinates;
use lagrangian_motion::solve::dot;
use lagrangian_recordings::constraints::Point;

/// A function of a distance as a term of a potential, with one coefficient.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Radial {
    /// One point, whose distance is that from the origin, or two, by their indices.
    pub points: Vec<usize>,
    /// The function.
    pub law: RadialLaw,
}

/// A function of a distance r.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase", deny_unknown_fields)]
pub enum RadialLaw {
    /// rᵐ, or ln r for m = 0.
    Power(i32),
    /// The integral of one of the functions of a basis over √r.
    Curve {
        /// The basis.
        basis: Basis,
        /// The number of the function.
        at: usize,
    },
    /// r³ from this place: one of the functions of a smooth potential of one point (Duchon 1977).
    Field {
        /// The place.
        about: [f64; 3],
    },
    /// rᵐ from this place, or ln r for m = 0: a source that does not move. Where a point has two coordinates the third is how far it is beside
    /// their plane.
    Source {
        /// The exponent m.
        exponent: i32,
        /// The place.
        about: [f64; 3],
    },
}

/// The largest size of an exponent.
const MOST_EXPONENT: i32 = 24;

impl RadialLaw {
    /// Whether it is one function of many that are a curve or a field together.
    pub(super) fn is_curve(&self) -> bool {
        matches!(self, Self::Curve { .. } | Self::Field { .. })
    }

    /// The exponent of a power of the distance, 0 for its logarithm.
    fn exponent(&self) -> Option<i32> {
        match *self {
            Self::Power(own) | Self::Source { exponent: own, .. } => Some(own),
            Self::Field { .. } => Some(3),
            Self::Curve { .. } => None,
        }
    }

    /// The place that it is about, where that is not the origin or another point.
    pub(super) fn about(&self) -> Option<[f64; 3]> {
        match *self {
            Self::Field { about } | Self::Source { about, .. } => Some(about),
            _ => None,
        }
    }

    /// Whether it is one function, of a basis that has it.
    pub(super) fn is_right(&self) -> bool {
        match self {
            Self::Curve { basis, at } => basis.check().is_ok() && *at < basis.count(),
            _ => {
                self.exponent().is_some_and(|m| m.abs() <= MOST_EXPONENT)
                    && self
                        .about()
                        .is_none_or(|about| about.iter().all(|x| x.is_finite()))
            }
        }
    }

    fn value(&self, r: f64) -> f64 {
        match (self.exponent(), *self) {
            (Some(0), _) => r.ln(),
            (Some(own), _) => r.powi(own),
            (None, Self::Curve { basis, at }) => one(at, |add| basis.integrals(r.sqrt(), add)),
            (None, _) => 0.0,
        }
    }

    /// Its derivative, and the slope of this.
    fn slopes(&self, r: f64) -> [f64; 2] {
        match (self.exponent(), *self) {
            (Some(0), _) => [1.0 / r, -1.0 / (r * r)],
            (Some(1), _) => [1.0, 0.0],
            (Some(own), _) => {
                let m = f64::from(own);
                [m * r.powi(own - 1), m * (m - 1.0) * r.powi(own - 2)]
            }
            (None, Self::Curve { basis, at }) => {
                let s = r.sqrt();
                let own = one(at, |add| basis.values(s, add));
                let rate = one(at, |add| basis.rates(s, add));
                [0.5 * own / s, 0.25 * (rate - own / s) / r]
            }
            (None, _) => [0.0; 2],
        }
    }
}

/// The value of function `at` among those that are passed on.
fn one(at: usize, each: impl FnOnce(&mut dyn FnMut(usize, f64))) -> f64 {
    let mut sum = 0.0;
    each(&mut |k, value| {
        if k == at {
            sum += value;
        }
    });
    sum
}

impl Radial {
    /// The axes of the first point, and those of the second where there is one.
    fn axes<'a>(&self, points: &'a [Vec<usize>]) -> [&'a [usize]; 2] {
        let own = |at: usize| self.points.get(at).map_or(&[][..], |point| &points[*point]);
        [own(0), own(1)]
    }

    /// The difference of the places.
    pub(super) fn difference(&self, points: &[Vec<usize>], x: &[f64]) -> [f64; 3] {
        let [first, second] = self.axes(points);
        let mut difference = self.law.about().map_or([0.0; 3], |own| own.map(|x| -x));
        for (k, i) in first.iter().enumerate() {
            difference[k] += x[*i] - second.get(k).map_or(0.0, |j| x[*j]);
        }
        difference
    }

    /// The distance.
    pub(super) fn distance(&self, points: &[Vec<usize>], q: &[f64]) -> f64 {
        let difference = self.difference(points, q);
        dot(&difference, &difference).sqrt()
    }

    /// The potential with c = 1.
    pub(super) fn potential(&self, points: &[Vec<usize>], q: &[f64]) -> f64 {
        self.law.value(self.distance(points, q))
    }

    /// Passes the derivative of the potential with c = 1 by each coordinate to `add`.
    pub(super) fn gradient(
        &self,
        points: &[Vec<usize>],
        q: &[f64],
        mut add: impl FnMut(usize, f64),
    ) {
        let difference = self.difference(points, q);
        // A field is smooth in its places.
        let r = dot(&difference, &difference).sqrt().max(f64::MIN_POSITIVE);
        let [slope, _] = self.law.slopes(r);
        let force = difference.map(|x| slope * x / r);
        let [first, second] = self.axes(points);
        let each = first.iter().zip(force);
        each.for_each(|(i, force)| add(*i, force));
        let each = second.iter().zip(force);
        each.for_each(|(j, force)| add(*j, -force));
    }

    /// The second derivatives of the potential with c = 1 by the difference of the places.
    fn hessian(&self, points: &[Vec<usize>], q: &[f64]) -> impl Fn(usize, usize) -> f64 + use<> {
        let difference = self.difference(points, q);
        let r = dot(&difference, &difference).sqrt().max(f64::MIN_POSITIVE);
        let [slope, bend] = self.law.slopes(r);
        let across = slope / r;
        let turned = difference.map(|x| x / r);
        move |k, l| {
            let own = if k == l { across } else { 0.0 };
            own + (bend - across) * turned[k] * turned[l]
        }
    }

    /// Passes the derivative of the force with c = 1 by a coordinate of the place of its source to `add`.
    pub(super) fn moved(
        &self,
        points: &[Vec<usize>],
        q: &[f64],
        axis: usize,
        mut add: impl FnMut(usize, f64),
    ) {
        let bend = self.hessian(points, q);
        let each = self.axes(points)[0].iter().enumerate();
        each.for_each(|(k, i)| add(*i, bend(k, axis)));
    }

    /// Passes the second derivative of the potential with c = 1 by each pair of coordinates to `add`.
    pub(super) fn bends(
        &self,
        points: &[Vec<usize>],
        q: &[f64],
        mut add: impl FnMut(usize, usize, f64),
    ) {
        let bend = self.hessian(points, q);
        let [first, second] = self.axes(points);
        for k in 0..first.len() {
            for l in 0..first.len() {
                let own = bend(k, l);
                add(first[k], first[l], own);
                if !second.is_empty() {
                    add(second[k], second[l], own);
                    add(first[k], second[l], -own);
                    add(second[k], first[l], -own);
                }
            }
        }
    }

    /// The potential with c = 1 as an expression; `None` for a curve of a basis.
    pub(super) fn expressed<'g>(
        &self,
        points: &[Vec<usize>],
        q: &[Value<'g>],
    ) -> Option<Value<'g>> {
        let exponent = self.law.exponent()?;
        let graph = q.first()?.graph();
        let about = self.law.about();
        let [first, second] = self.axes(points);
        let apart = first
            .iter()
            .enumerate()
            .map(|(k, i)| match (second.get(k), about) {
                (Some(j), _) => q[*i] - q[*j],
                (None, Some(about)) => q[*i] - graph.number(about[k]),
                (None, None) => q[*i],
            });
        let beside = about.map_or(0.0, |own| own[first.len()..].iter().map(|x| x * x).sum());
        let square = apart.fold(graph.number(beside), |sum, x| sum + x * x);
        let distance = square.map(Function::SquareRoot);
        if exponent == 0 {
            return Some((distance - graph.number(1.0)).map(Function::LogOnePlus));
        }
        let size = exponent.unsigned_abs();
        let odd = if size % 2 == 1 {
            distance
        } else {
            graph.number(1.0)
        };
        let power = (0..size / 2).fold(odd, |power, _| power * square);
        Some(if exponent > 0 {
            power
        } else {
            graph.number(1.0) / power
        })
    }

    /// The function as it is written.
    pub(super) fn written(
        &self,
        (coordinates, points, places): (&Coordinates, &[Vec<usize>], &[Place]),
        style: Style,
    ) -> String {
        let known = Point::named(coordinates);
        let name = |at: &usize| {
            let own = known.iter().find(|own| own.axes == points[*at]);
            match own {
                Some(own) => style.name(&own.name),
                None => Point::of(coordinates, points[*at].clone()).name,
            }
        };
        let mut names: Vec<String> = self.points.iter().map(name).collect();
        if let RadialLaw::Source { about, .. } = self.law {
            let own = places.iter().find(|own| is_same(own.about, about));
            names.extend(own.map(|own| own.name(style)));
        }
        let names = names.join(" - ");
        let distance = match style {
            Style::Text => format!("|{names}|"),
            Style::Latex => format!("|\\mathbf{{{names}}}|"),
        };
        match (self.law, self.law.exponent()) {
            (RadialLaw::Field { .. }, _) => format!("W({names})"),
            (_, None) => format!("W({distance})"),
            (_, Some(0)) if style == Style::Text => format!("ln {distance}"),
            (_, Some(0)) => format!("\\ln {distance}"),
            (_, Some(own)) => style.power(distance, own),
        }
    }

    /// The unit of its coefficient.
    pub(super) fn unit(&self) -> String {
        match self.law.exponent() {
            Some(0) => "J".into(),
            Some(1) => "N".into(),
            Some(2) => "N/m".into(),
            Some(-1) => "J·m".into(),
            Some(own) if own > 0 => format!("J/m^{own}"),
            Some(own) => format!("J·m^{}", -own),
            None => "J/m^0.5".into(),
        }
    }
}

/// A coordinate of the place of a source that is found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Place {
    /// Where the source is.
    pub(super) about: [f64; 3],
    /// Which coordinate it is.
    pub(super) axis: usize,
    /// Which of the sources.
    pub(super) source: usize,
}

impl Place {
    /// The name of the source, such as `s1`.
    pub(super) fn name(&self, style: Style) -> String {
        style.name(&format!("s{}", self.source + 1))
    }

    /// The number.
    pub(super) fn value(&self) -> f64 {
        self.about[self.axis]
    }
}

/// The coordinates of the places of all sources, each source once.
pub(super) fn places<'a>(
    points: &[Vec<usize>],
    radial: impl Iterator<Item = &'a Radial>,
) -> Vec<Place> {
    let mut all: Vec<Place> = Vec::new();
    for own in radial {
        let RadialLaw::Source { about, .. } = own.law else {
            continue;
        };
        if all.iter().any(|one| is_same(one.about, about)) {
            continue;
        }
        let axes = own.axes(points)[0].len();
        let source = all.last().map_or(0, |own| own.source + 1);
        all.extend(free_axes(axes, about).map(|axis| Place {
            about,
            axis,
            source,
        }));
    }
    all
}

/// The free coordinates of a place, of points of so many coordinates: how far it is beside their plane only where it is.
pub(super) fn free_axes(axes: usize, about: [f64; 3]) -> impl Iterator<Item = usize> {
    (0..3).filter(move |axis| *axis < axes || about[*axis] != 0.0)
}

/// Whether two places are one.
pub(super) fn is_same(a: [f64; 3], b: [f64; 3]) -> bool {
    a.map(f64::to_bits) == b.map(f64::to_bits)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slopes_and_their_changes_are_those_of_the_potential() {
        let points = [vec![0, 1, 2], vec![5, 4, 3]];
        let q = [0.3, -0.2, 0.9, 1.4, 0.1, -0.5];
        let by = [0.2, 0.7, -0.4, 0.5, -0.3, 0.1];
        let basis = Basis::spline([0.8, 1.6], 4);
        let powers = [-6, -1, 0, 1, 2, 3].map(RadialLaw::Power);
        let curves = [0, 2, 4].map(|at| RadialLaw::Curve { basis, at });
        let about = [0.2, -0.4, 1.3];
        let laws = powers.into_iter().chain(curves);
        let pairs = laws.clone().map(|law| (vec![0, 1], law));
        let sources = [-2, 0, 1].map(|exponent| RadialLaw::Source { exponent, about });
        let single = laws.chain([RadialLaw::Field { about }]).chain(sources);
        for (own, law) in pairs.chain(single.map(|law| (vec![1], law))) {
            let own = Radial { points: own, law };
            let moved =
                |h: f64| -> Vec<f64> { q.iter().zip(by).map(|(q, by)| q + h * by).collect() };
            let gradient = |h: f64| {
                let mut all = vec![0.0; 6];
                own.gradient(&points, &moved(h), |i, x| all[i] += x);
                all
            };
            let value = |h: f64| own.potential(&points, &moved(h));
            let slope = (value(1e-5) - value(-1e-5)) / 2e-5;
            let expected = dot(&gradient(0.0), &by);
            assert!(
                (slope - expected).abs() < 1e-7 * (1.0 + expected.abs()),
                "{own:?}"
            );
            let mut change = [0.0; 6];
            own.bends(&points, &q, |i, j, bend| change[i] += bend * by[j]);
            for (i, change) in change.iter().enumerate() {
                let slope = (gradient(1e-5)[i] - gradient(-1e-5)[i]) / 2e-5;
                assert!(
                    (slope - change).abs() < 1e-6 * (1.0 + change.abs()),
                    "{own:?} {i}"
                );
            }
        }
    }
}
