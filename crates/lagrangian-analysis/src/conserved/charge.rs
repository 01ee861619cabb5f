//! A charge: the distance of its direction from a symmetry, and the total derivative that it needs.

use faer::Mat;
use serde::Serialize;

use super::states::States;
use super::symmetry::Symmetry;
use lagrangian::Coordinates;
use lagrangian::mechanics::{Jet, dot};
use lagrangian_motion::statistics::root_mean_square;

/// Part F of a charge Q = ξ·p − F (theory.md, equation 79).
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Gauge {
    /// Whether F contains ξ·p(q, 0), the gauge of the model.
    pub at_rest: bool,
    /// Other terms of F by name, with their factors, for example 1.0 `y` for a magnetic field.
    pub terms: Vec<(String, f64)>,
}

/// The charge ξ·p − F, or the energy if ξ is absent.
pub(super) struct Charge {
    pub(super) name: String,
    pub(super) violation: f64,
    pub(super) gauge: Gauge,
    pub(super) scale: f64,
    pub(super) symmetry: Option<Symmetry>,
    /// Factors f of all functions of [`functions`]; empty for 0.
    pub(super) fitted: Vec<f64>,
}

/// Relative size below which terms of F are omitted.
const NEGLIGIBLE: f64 = 1e-3;

impl Charge {
    pub(super) fn energy(states: &States) -> Self {
        Self {
            name: "energy".into(),
            violation: 0.0,
            gauge: Gauge::default(),
            scale: states.rms(|k| states.norm(k, states.speed(k)).powi(2)),
            symmetry: None,
            fitted: Vec::new(),
        }
    }

    /// Charge with the simplest F that makes the direction a symmetry, else with the F of the smallest
    /// violation.
    pub(super) fn of(symmetry: &Symmetry, states: &States, tolerance: f64) -> Self {
        let along = |k: usize| states.norm(k, &symmetry.at(states.position(k)));
        let size = states.rms(along) * states.inertial;
        let scale = states.rms(|k| along(k) * states.norm(k, states.speed(k)));
        let mut best = Self {
            name: symmetry.name.clone(),
            violation: f64::INFINITY,
            gauge: Gauge::default(),
            scale,
            symmetry: Some(symmetry.clone()),
            fitted: Vec::new(),
        };
        let gauges = [(false, false), (true, false), (false, true), (true, true)];
        // Without a magnetic part F contains at most the gauge at rest.
        for (at_rest, fit) in gauges.into_iter().take(if states.magnetic { 4 } else { 2 }) {
            let rate: Vec<f64> = (0..states.len())
                .map(|k| rate(symmetry, states, k, at_rest))
                .collect();
            let (fitted, left) = match fit {
                true => fit_functions(states, &rate),
                false => (Vec::new(), rms(&rate)),
            };
            let violation = if size > 0.0 {
                left / size
            } else {
                f64::INFINITY
            };
            if violation < best.violation {
                best.violation = violation;
                best.gauge = Gauge::of(&states.coordinates, at_rest, &fitted);
                best.fitted = fitted;
            }
            if best.violation <= tolerance {
                break;
            }
        }
        best
    }

    /// Values at the states of a jet, `[m]`; `rest` is p(q, 0) there.
    pub(super) fn values(
        &self,
        (q, qd): (&[f64], &[f64]),
        jet: &Jet,
        rest: &[f64],
        coordinates: &Coordinates,
    ) -> Vec<f64> {
        let n = coordinates.dof();
        let Some(symmetry) = &self.symmetry else {
            let mut energy = vec![0.0; jet.lagrangian.len()];
            lagrangian::mechanics::energy(jet, n, qd, &mut energy);
            return energy;
        };
        let momenta = jet.momentum.chunks_exact(n).zip(rest.chunks_exact(n));
        let value = |(q, (p, a)): (&[f64], (&[f64], &[f64]))| {
            let xi = symmetry.at(q);
            let mut charge = dot(&xi, p);
            if self.gauge.at_rest {
                charge -= dot(&xi, a);
            }
            if !self.fitted.is_empty() {
                charge -= dot(&self.fitted, &functions(coordinates, q));
            }
            charge
        };
        q.chunks_exact(n).zip(momenta).map(value).collect()
    }
}

impl Gauge {
    fn of(coordinates: &Coordinates, at_rest: bool, fitted: &[f64]) -> Self {
        let largest = fitted.iter().fold(0.0, |l: f64, f| l.max(f.abs()));
        let named = names(coordinates).into_iter().zip(fitted.iter().copied());
        Self {
            at_rest,
            terms: named
                .filter(|(_, f)| f.abs() > NEGLIGIBLE * largest)
                .collect(),
        }
    }
}

/// δL, less the rate of ξ·a if F contains that, at state `k`.
pub(super) fn rate(symmetry: &Symmetry, states: &States, k: usize, at_rest: bool) -> f64 {
    let (n, jet) = (states.n(), &states.jet);
    let along = |x: &[f64], signal: &[f64]| dot(x, &signal[k * n..(k + 1) * n]);
    let xi = symmetry.at(states.position(k));
    let turned: Vec<f64> = symmetry.turned(states.speed(k)).collect();
    let change = along(&xi, &jet.dl_dq) + along(&turned, &jet.momentum);
    match at_rest {
        true => change - along(&turned, &states.rest) - along(&xi, &states.rest_rate),
        false => change,
    }
}

/// φ(q): coordinates on the line, their products, cos and sin of angles.
fn functions(coordinates: &Coordinates, q: &[f64]) -> Vec<f64> {
    over_functions(
        coordinates,
        |i| q[i],
        |i, j| q[i] * q[j],
        |i| [q[i].cos(), q[i].sin()],
    )
}

/// dφ/dt.
fn function_rates(coordinates: &Coordinates, q: &[f64], qd: &[f64]) -> Vec<f64> {
    over_functions(
        coordinates,
        |i| qd[i],
        |i, j| q[i] * qd[j] + qd[i] * q[j],
        |i| [-q[i].sin() * qd[i], q[i].cos() * qd[i]],
    )
}

fn names(coordinates: &Coordinates) -> Vec<String> {
    let name = |i: usize| coordinates.0[i].name.clone();
    over_functions(
        coordinates,
        name,
        |i, j| format!("{} {}", name(i), name(j)),
        |i| [format!("cos {}", name(i)), format!("sin {}", name(i))],
    )
}

fn over_functions<T>(
    coordinates: &Coordinates,
    line: impl Fn(usize) -> T,
    product: impl Fn(usize, usize) -> T,
    circle: impl Fn(usize) -> [T; 2],
) -> Vec<T> {
    let n = coordinates.dof();
    let mut all = Vec::new();
    for i in 0..n {
        if coordinates.is_circle(i) {
            all.extend(circle(i));
            continue;
        }
        all.push(line(i));
        let lines = (i..n).filter(|&j| !coordinates.is_circle(j));
        all.extend(lines.map(|j| product(i, j)));
    }
    all
}

/// Least-squares fit f of `rate` − f·φ′ on every other state, and the root mean square residual on the remaining ones; empty for
/// too few states.
fn fit_functions(states: &States, rate: &[f64]) -> (Vec<f64>, f64) {
    let rows = rates_of_functions(states);
    let width = rows.first().map_or(0, Vec::len);
    let fitted = rows.len().div_ceil(2);
    let matrix = Mat::from_fn(fitted, width, |r, c| rows[2 * r][c]);
    let Some(svd) = matrix.thin_svd().ok().filter(|_| fitted >= 2 * width) else {
        return (Vec::new(), rms(rate));
    };
    let f = svd.pseudoinverse() * Mat::from_fn(fitted, 1, |r, _| rate[2 * r]);
    let f: Vec<f64> = f.col(0).iter().copied().collect();
    let others = rows.iter().zip(rate).skip(1).step_by(2);
    let left: Vec<f64> = others.map(|(row, rate)| rate - dot(row, &f)).collect();
    (f, rms(&left))
}

/// Rates of the functions φ, one row for each state.
pub(super) fn rates_of_functions(states: &States) -> Vec<Vec<f64>> {
    let of = |k: usize| function_rates(&states.coordinates, states.position(k), states.speed(k));
    (0..states.len()).map(of).collect()
}

fn rms(x: &[f64]) -> f64 {
    root_mean_square(&mut x.iter().copied())
}
