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
        /// The place; what a point lacks of coordinates is not used.
        about: [f64; 3],
    },
}

/// The largest size of an exponent.
const MOST_EXPONENT: i32 = 24;

impl RadialLaw {
    /// Whether it is one function of many that are a curve or a field together.
    pub(super) fn is_curve(&self) -> bool {
        !matches!(self, Self::Power(_))
    }

    /// Whether it is one function, of a basis that has it.
    pub(super) fn is_right(&self) -> bool {
        match self {
            Self::Power(own) => own.abs() <= MOST_EXPONENT,
            Self::Curve { basis, at } => basis.check().is_ok() && *at < basis.count(),
            Self::Field { about } => about.iter().all(|x| x.is_finite()),
        }
    }

    fn value(&self, r: f64) -> f64 {
        match *self {
            Self::Power(0) => r.ln(),
            Self::Power(own) => r.powi(own),
            Self::Curve { basis, at } => one(at, |add| basis.integrals(r.sqrt(), add)),
            Self::Field { .. } => r.powi(3),
        }
    }

    /// Its derivative, and the slope of this.
    fn slopes(&self, r: f64) -> [f64; 2] {
        match *self {
            Self::Power(0) => [1.0 / r, -1.0 / (r * r)],
            Self::Power(1) => [1.0, 0.0],
            Self::Power(own) => {
                let m = f64::from(own);
                [m * r.powi(own - 1), m * (m - 1.0) * r.powi(own - 2)]
            }
            Self::Curve { basis, at } => {
                let s = r.sqrt();
                let own = one(at, |add| basis.values(s, add));
                let rate = one(at, |add| basis.rates(s, add));
                [0.5 * own / s, 0.25 * (rate - own / s) / r]
            }
            Self::Field { .. } => [3.0 * r * r, 6.0 * r],
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
        let mut difference = match self.law {
            RadialLaw::Field { about } => about.map(|x| -x),
            _ => [0.0; 3],
        };
        difference[first.len()..].fill(0.0);
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

    /// Passes the second derivative of the potential with c = 1 by each pair of coordinates to `add`.
    pub(super) fn bends(
        &self,
        points: &[Vec<usize>],
        q: &[f64],
        mut add: impl FnMut(usize, usize, f64),
    ) {
        let difference = self.difference(points, q);
        let r = dot(&difference, &difference).sqrt().max(f64::MIN_POSITIVE);
        let [slope, bend] = self.law.slopes(r);
        let across = slope / r;
        let along = |x: f64, y: f64| (bend - across) * (x / r) * (y / r);
        let [first, second] = self.axes(points);
        for (k, x) in difference.iter().enumerate().take(first.len()) {
            for (l, y) in difference.iter().enumerate().take(first.len()) {
                let own = along(*x, *y) + if k == l { across } else { 0.0 };
                add(first[k], first[l], own);
                if !second.is_empty() {
                    add(second[k], second[l], own);
                    add(first[k], second[l], -own);
                    add(second[k], first[l], -own);
                }
            }
        }
    }

    /// The potential with c = 1 as an expression; `None` for a curve.
    pub(super) fn expressed<'g>(
        &self,
        points: &[Vec<usize>],
        q: &[Value<'g>],
    ) -> Option<Value<'g>> {
        let RadialLaw::Power(exponent) = self.law else {
            return None;
        };
        let [first, second] = self.axes(points);
        let apart = first.iter().enumerate().map(|(k, i)| match second.get(k) {
            Some(j) => q[*i] - q[*j],
            None => q[*i],
        });
        let graph = q.first()?.graph();
        let square = apart.fold(graph.number(0.0), |sum, x| sum + x * x);
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
        (coordinates, points): (&Coordinates, &[Vec<usize>]),
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
        let names: Vec<String> = self.points.iter().map(name).collect();
        let names = names.join(" - ");
        let distance = match style {
            Style::Text => format!("|{names}|"),
            Style::Latex => format!("|\\mathbf{{{names}}}|"),
        };
        match (self.law, style) {
            (RadialLaw::Power(0), Style::Text) => format!("ln {distance}"),
            (RadialLaw::Power(0), Style::Latex) => format!("\\ln {distance}"),
            (RadialLaw::Power(own), style) => style.power(distance, own),
            (RadialLaw::Curve { .. }, _) => format!("W({distance})"),
            (RadialLaw::Field { .. }, _) => format!("W({names})"),
        }
    }

    /// The unit of its coefficient.
    pub(super) fn unit(&self) -> String {
        match self.law {
            RadialLaw::Power(0) => "J".into(),
            RadialLaw::Power(1) => "N".into(),
            RadialLaw::Power(2) => "N/m".into(),
            RadialLaw::Power(-1) => "J·m".into(),
            RadialLaw::Power(own) if own > 0 => format!("J/m^{own}"),
            RadialLaw::Power(own) => format!("J·m^{}", -own),
            RadialLaw::Curve { .. } => "J/m^0.5".into(),
            RadialLaw::Field { .. } => "J/m^3".into(),
        }
    }
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
        let single = laws.chain([RadialLaw::Field { about }]);
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
