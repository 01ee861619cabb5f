//! Points that nothing holds: which forces act on them, and their masses.
//!
//! The accelerations of each point alone are sums of forces over its mass, in rows that hold positions alone (theory.md, equation 130k), so that
//! no column has the noise of an acceleration. Masses follow from what two points do to each other.

use lagrangian_motion::parallel::prelude::*;

use super::points::{MOST_POWERS, PointTerm};
use super::radial::{Radial, RadialLaw};
use super::system::Layout;
use crate::dataset::Dataset;
use crate::models::formula::{STRIDE, WINDOW};
use crate::models::lattice::{EXACT, Moments, bend, clearest, moments};
use lagrangian_mechanics::lattice::Basis;
use lagrangian_motion::solve::dot;
use lagrangian_motion::solve::quadratic::Quadratic;
use lagrangian_motion::solve::ridge::{Ridge, scales};
use lagrangian_motion::statistics::sort_by_number;

/// The powers of distances of a potential.
pub(super) const EXPONENTS: [i32; 10] = [2, 1, -1, 0, -2, 3, 4, -3, -6, -12];
/// The intervals of curves of distances, and the largest number of points for which these are tried.
const INTERVALS: [usize; 2] = [8, 16];
pub(super) const FEW: usize = 8;
/// The number of stretches that there must be of a length.
const FEWEST: usize = 100;
/// The largest number of stretches, and of values of powers in all of them; stretches that are integrated at a time.
const STRETCHES: usize = 3000;
const VALUES: usize = 40_000_000;
const AT_A_TIME: usize = 16;
/// Different choices of powers that are tried, at most.
const CHOICES: usize = 3;
/// A distance is resolved where it changes by less than this part from one sample to the next.
const RESOLVED: f64 = 0.2;
const RIDGE: f64 = 1e-12;
/// The weight of a mass that is given, and of the guess that an unknown one is 1.
const GIVEN: f64 = 1e12;
const GUESS: f64 = 1e-9;

/// Forces and parameters to start from: masses, then the coefficient of each force.
pub(super) struct Start {
    pub(super) terms: Vec<PointTerm>,
    pub(super) theta: Vec<f64>,
    /// The part of the motion that it leaves beyond the noise.
    pub(super) left: f64,
}

/// Forces that are there or not together.
type Group = Vec<PointTerm>;

/// The pairs of points with as many coordinates.
pub(super) fn pairs(points: &[Vec<usize>]) -> impl Iterator<Item = [usize; 2]> + '_ {
    let all = (0..points.len()).flat_map(move |a| (a + 1..points.len()).map(move |b| [a, b]));
    all.filter(|[a, b]| points[*a].len() == points[*b].len())
}

/// The forces that may be, of points in these stretches.
fn groups(layout: &Layout, all: &[Moments]) -> Vec<Group> {
    let radial = |points: &[usize], law: RadialLaw| {
        let points = points.to_vec();
        PointTerm::Radial(Radial { points, law })
    };
    let count = layout.points.len();
    let between: Vec<Vec<usize>> = pairs(&layout.points).map(Vec::from).collect();
    let to_origin: Vec<Vec<usize>> = (0..count).map(|a| vec![a]).collect();
    let powers = |of: &[Vec<usize>]| {
        EXPONENTS.map(|m| {
            of.iter()
                .map(|own| radial(own, RadialLaw::Power(m)))
                .collect()
        })
    };
    let curve = |own: &Vec<usize>, intervals: usize| {
        let states = all.iter().flat_map(|own| own.q.chunks_exact(layout.n));
        let basis = Basis::spline(roots(&layout.points, states, own), intervals);
        let each = (0..basis.count()).map(move |at| RadialLaw::Curve { basis, at });
        each.map(|law| radial(own, law)).collect::<Vec<_>>()
    };
    let curves = |of: &[Vec<usize>]| {
        INTERVALS.map(|intervals| {
            of.iter()
                .filter(|_| count <= FEW)
                .flat_map(|own| curve(own, intervals))
                .collect()
        })
    };
    let linear = (0..layout.n).map(|i| vec![PointTerm::Potential(vec![i])]);
    let squares = (0..layout.n).map(|i| vec![PointTerm::Potential(vec![i, i])]);
    let friction = (0..count).map(PointTerm::Friction).collect();
    let of = [between, to_origin];
    let radial = of
        .iter()
        .flat_map(|of| powers(of).into_iter().chain(curves(of)));
    let all = linear.chain(squares).chain(radial).chain([friction]);
    all.filter(|own: &Group| !own.is_empty()).collect()
}

/// The smallest and the largest root of a distance.
pub(super) fn roots<'a>(
    points: &[Vec<usize>],
    states: impl Iterator<Item = &'a [f64]>,
    of: &[usize],
) -> [f64; 2] {
    let radial = Radial {
        points: of.to_vec(),
        law: RadialLaw::Power(1),
    };
    let each = states.map(|q| radial.distance(points, q).sqrt());
    each.fold([f64::INFINITY, 0.0], |[low, high], r| {
        [low.min(r), high.max(r)]
    })
}

/// Forces that explain the motions with few coefficients, the best choice first.
pub(super) fn find(dataset: &Dataset, layout: &Layout) -> Vec<Start> {
    let all = clear(dataset, layout);
    if all.is_empty() {
        return Vec::new();
    }
    let groups = groups(layout, &all);
    let power = |own: &Group| match &own[0] {
        PointTerm::Radial(of) => matches!(of.law, RadialLaw::Power(_)).then_some(of.points.len()),
        _ => None,
    };
    let choice = Choice {
        powers: groups.iter().map(power).collect(),
        bodies: bodies(&all, layout, &groups, dataset.forced),
        forced: dataset.forced,
    };
    let curved: Vec<bool> = groups.iter().map(|own| is_curve(&own[0])).collect();
    let powers: Vec<bool> = curved.iter().map(|own| !own).collect();
    let from = |at: usize, may: &[bool]| {
        let mut own = vec![false; groups.len()];
        own[at] = matches!(groups[at][0], PointTerm::Radial(_));
        choice.grown(own, may)
    };
    let grown = |of: &[bool], may: &[bool]| {
        let all = (0..groups.len()).into_par_iter().filter(|at| of[*at]);
        let mut all: Vec<(f64, Vec<bool>)> = all.filter_map(|at| from(at, may)).collect();
        sort_by_number(&mut all, |own| own.0);
        all.dedup_by(|a, b| a.1 == b.1);
        all
    };
    // A law before curves that are as good.
    let mut found = grown(&powers, &powers);
    found.truncate(CHOICES);
    let all_of_them = vec![true; groups.len()];
    found.extend(grown(&curved, &all_of_them).into_iter().take(1));
    let noise = all.iter().map(|own| own.noise).sum::<f64>() / all.len() as f64;
    let start = |own: &(f64, Vec<bool>)| choice.start(layout, &groups, &own.1, noise);
    found.iter().map(start).collect()
}

/// The stretches that are clearest and in which distances are resolved.
pub(super) fn clear(dataset: &Dataset, layout: &Layout) -> Vec<Moments> {
    let distances = pairs(&layout.points).count() + layout.points.len();
    clearest(FEWEST, &|window| {
        let most = VALUES / (window * EXPONENTS.len() * distances);
        resolved(moments(dataset, most.min(STRETCHES), window), layout)
    })
}

/// Whether it is one function of a curve of a distance.
pub(super) fn is_curve(term: &PointTerm) -> bool {
    matches!(term, PointTerm::Radial(own) if own.law.is_curve())
}

/// The stretches in which distances change little from one sample to the next: of two points always, from the origin unless that are few.
fn resolved(all: Vec<Moments>, layout: &Layout) -> Vec<Moments> {
    let points = &layout.points;
    let near = |own: &Moments, of: &[usize]| {
        let radial = Radial {
            points: of.to_vec(),
            law: RadialLaw::Power(1),
        };
        let each = own
            .q
            .chunks_exact(layout.n)
            .map(|q| radial.difference(points, q));
        is_passed_by(&each.collect::<Vec<_>>())
    };
    let apart = |own: &Moments| !pairs(points).any(|pair| near(own, &pair));
    let all: Vec<Moments> = all.into_iter().filter(apart).collect();
    let far = |own: &&Moments| !(0..points.len()).any(|a| near(own, &[a]));
    match all.iter().filter(far).count() * 2 > all.len() {
        true => all.into_iter().filter(|own| far(&own)).collect(),
        false => all,
    }
}

/// Whether a place whose differences follow each other so is passed by within a few samples.
pub(super) fn is_passed_by(differences: &[[f64; 3]]) -> bool {
    differences.windows(2).any(|pair| {
        let step: [f64; 3] = std::array::from_fn(|k| pair[1][k] - pair[0][k]);
        dot(&step, &step) > RESOLVED.powi(2) * dot(&pair[0], &pair[0])
    })
}

/// The rows of one point.
struct Body {
    sums: Quadratic,
    /// The group and the place in it of each column; that of recorded forces, where there are any, comes last and has none.
    columns: Vec<(usize, usize)>,
    /// The square of the second differences of curves, `[columns, columns]`.
    bend: Vec<f64>,
}

fn touches(layout: &Layout, term: &PointTerm, point: usize) -> bool {
    match term {
        PointTerm::Potential(of) => of.iter().any(|i| layout.points[point].contains(i)),
        PointTerm::Radial(of) => of.points.contains(&point),
        PointTerm::Friction(own) => *own == point,
    }
}

/// The sums over the rows of each point.
fn bodies(all: &[Moments], layout: &Layout, groups: &[Group], forced: bool) -> Vec<Body> {
    let own = |point: usize| {
        let each = groups.iter().enumerate().flat_map(|(g, group)| {
            let own = group.iter().enumerate();
            let own = own.filter(|(_, term)| touches(layout, term, point));
            own.map(move |(k, _)| (g, k))
        });
        let columns: Vec<(usize, usize)> = each.collect();
        Body {
            sums: Quadratic::zero(columns.len() + usize::from(forced)),
            columns,
            bend: Vec::new(),
        }
    };
    let mut bodies: Vec<Body> = (0..layout.points.len()).map(own).collect();
    let mut firsts = vec![0];
    for group in groups {
        firsts.push(firsts[firsts.len() - 1] + group.len());
    }
    for some in all.chunks(AT_A_TIME) {
        let forces: Vec<Vec<Vec<f64>>> = some
            .par_iter()
            .map(|own| integrals(own, layout, groups.iter().flatten()))
            .collect();
        let add = |(body, axes): (&mut Body, &Vec<usize>)| {
            for (own, forces) in some.iter().zip(&forces) {
                for i in axes {
                    let columns = body.columns.iter().map(|(g, k)| forces[firsts[*g] + k][*i]);
                    let row: Vec<f64> = columns.chain(forced.then_some(own.force[*i])).collect();
                    body.sums.add_row(&row, own.acceleration[*i]);
                }
            }
        };
        bodies.par_iter_mut().zip(&layout.points).for_each(add);
    }
    for body in &mut bodies {
        let curve = |k: usize| match body.columns.get(k).map(|(g, k)| (*g, &groups[*g][*k])) {
            Some((g, term @ PointTerm::Radial(own))) if is_curve(term) => {
                Some((g, own.points.clone()))
            }
            _ => None,
        };
        body.bend = bend(body.sums.size(), curve, |k| body.sums.row(k)[k]);
    }
    bodies
}

/// ∫ F w of each force with the coefficient 1, `[forces][n]`.
pub(super) fn integrals<'a>(
    own: &Moments,
    layout: &Layout,
    terms: impl IntoIterator<Item = &'a PointTerm>,
) -> Vec<Vec<f64>> {
    let n = layout.n;
    let mut all = Vec::new();
    for term in terms {
        let mut sum = vec![0.0; n];
        if let PointTerm::Friction(point) = term {
            layout.points[*point]
                .iter()
                .for_each(|i| sum[*i] = -own.rate[*i]);
        } else {
            let mut state = vec![0.0; 2 * n];
            for (q, w) in own.q.chunks_exact(n).zip(&own.weights) {
                state[..n].copy_from_slice(q);
                layout.add_force(term, *w, &state, &mut sum);
            }
        }
        all.push(sum);
    }
    all
}

/// What is chosen among.
struct Choice {
    bodies: Vec<Body>,
    /// For powers of distances, of how many points these are.
    powers: Vec<Option<usize>>,
    forced: bool,
}

impl Body {
    /// The columns of some groups, and the solution of the others' being nothing.
    fn solve(&self, chosen: &[bool], forced: bool) -> Option<(Vec<usize>, Ridge, Vec<f64>)> {
        let of_groups = self
            .columns
            .iter()
            .enumerate()
            .filter(|(_, (g, _))| chosen[*g]);
        let own: Vec<usize> = of_groups
            .map(|(k, _)| k)
            .chain(forced.then_some(self.columns.len()))
            .collect();
        let width = self.sums.size();
        let entry =
            |a: usize, b: usize| self.sums.row(own[a])[own[b]] + self.bend[own[a] * width + own[b]];
        let scale = scales(own.len(), |a| entry(a, a), f64::MIN_POSITIVE);
        let ridge = Ridge::new(entry, scale, RIDGE)?;
        let x = ridge.solve_one(|a| self.sums.right[own[a]])?;
        Some((own, ridge, x))
    }

    fn left(&self, own: &[usize], x: &[f64]) -> f64 {
        let terms = own.iter().copied().zip(x.iter().copied());
        self.sums.residual(terms).max(0.0)
    }
}

impl Choice {
    /// The number of rows that share no samples.
    fn rows(&self) -> f64 {
        let rows: usize = self.bodies.iter().map(|own| own.sums.rows).sum();
        (rows as f64 * STRIDE as f64 / WINDOW as f64).max(2.0)
    }

    /// What it costs to describe the motions by these groups: the logarithm of what is left, and that of the number of rows for each coefficient.
    fn cost(&self, chosen: &[bool]) -> Option<f64> {
        let (mut left, mut count) = (0.0, 0);
        for body in &self.bodies {
            let (own, _, x) = body.solve(chosen, self.forced)?;
            left += body.left(&own, &x) + EXACT * body.sums.square;
            count += own.len();
        }
        let rows = self.rows();
        Some(rows * left.max(f64::MIN_POSITIVE).ln() + count as f64 * rows.ln())
    }

    /// The groups after those that may be have been added and removed, one at a time, where that lowers the cost most.
    fn grown(&self, mut chosen: Vec<bool>, may: &[bool]) -> Option<(f64, Vec<bool>)> {
        let mut cost = self.cost(&chosen)?;
        for _ in 0..2 * may.len() {
            let changed = |at: usize| {
                let same = self.powers[at].map(|own| {
                    let all = (0..may.len()).filter(|k| chosen[*k]);
                    all.filter(|k| self.powers[*k] == Some(own)).count()
                });
                if !chosen[at] && same.is_some_and(|count| count >= MOST_POWERS) {
                    return None;
                }
                let mut other = chosen.clone();
                other[at] = !other[at];
                Some((self.cost(&other)?, other))
            };
            let all = (0..may.len()).filter(|at| may[*at]).filter_map(changed);
            match all.min_by(|a, b| a.0.total_cmp(&b.0)) {
                Some(best) if best.0 < cost => (cost, chosen) = best,
                _ => break,
            }
        }
        Some((cost, chosen))
    }

    /// The part of the motion that some groups leave beyond this mean square of noise.
    fn left(&self, chosen: &[bool], noise: f64) -> f64 {
        let (mut left, mut whole, mut rows) = (0.0, 0.0, 0);
        for body in &self.bodies {
            if let Some((own, _, x)) = body.solve(chosen, self.forced) {
                left += body.left(&own, &x);
            }
            whole += body.sums.square;
            rows += body.sums.rows;
        }
        (left - noise * rows as f64).max(0.0) / f64::max(whole, f64::MIN_POSITIVE)
    }

    /// Masses and coefficients of the chosen groups.
    fn start(&self, layout: &Layout, groups: &[Group], chosen: &[bool], noise: f64) -> Start {
        // The coefficient of each force over the mass of each point, with its standard error.
        let rates: Vec<Rates> = self
            .bodies
            .iter()
            .map(|own| self.rates(own, chosen))
            .collect();
        let terms = || {
            let each = groups.iter().enumerate().filter(|(g, _)| chosen[*g]);
            each.flat_map(|(g, group)| {
                group
                    .iter()
                    .enumerate()
                    .map(move |(k, term)| ((g, k), term))
            })
        };
        let masses = masses(
            &rates,
            terms().filter_map(|(at, term)| match term {
                PointTerm::Radial(of) if of.points.len() == 2 => {
                    Some((at, [of.points[0], of.points[1]]))
                }
                _ => None,
            }),
            layout.reference,
        );
        let mut start = Start {
            terms: Vec::new(),
            theta: masses.clone(),
            left: self.left(chosen, noise),
        };
        for (at, term) in terms() {
            let (mut sum, mut weights) = (0.0, 0.0);
            for (rates, mass) in rates.iter().zip(&masses) {
                if let Some([rate, error]) = rates.of(at) {
                    let weight = 1.0 / (mass * error.max(f64::MIN_POSITIVE.sqrt())).powi(2);
                    sum += weight * mass * rate;
                    weights += weight;
                }
            }
            let own = sum / weights;
            if own.is_finite() && !(own <= 0.0 && term.is_friction()) {
                start.terms.push(term.clone());
                start.theta.push(own);
            }
        }
        start
    }

    fn rates(&self, body: &Body, chosen: &[bool]) -> Rates {
        let mut rates = Rates::default();
        let Some((own, ridge, x)) = body.solve(chosen, self.forced) else {
            return rates;
        };
        let inverse = ridge.solve(own.len(), |a, b| f64::from(a == b));
        let rows = body.sums.rows as f64 * STRIDE as f64 / WINDOW as f64;
        let left = body.left(&own, &x) + EXACT * body.sums.square;
        let noise = left / (rows - own.len() as f64).max(1.0);
        for (a, k) in own.iter().enumerate() {
            let value = [x[a], (noise * inverse[(a, a)].max(0.0)).sqrt()];
            match body.columns.get(*k) {
                Some(at) => rates.forces.push((*at, value)),
                None => rates.push = Some(value),
            }
        }
        rates
    }
}

/// The coefficients of one point, each over its mass and with its standard error.
#[derive(Default)]
struct Rates {
    forces: Vec<((usize, usize), [f64; 2])>,
    /// That of recorded forces: 1 over its mass.
    push: Option<[f64; 2]>,
}

impl Rates {
    fn of(&self, at: (usize, usize)) -> Option<[f64; 2]> {
        let found = self.forces.iter().find(|own| own.0 == at)?;
        Some(found.1)
    }
}

/// The mass of each point: what a force between two does to one, and to the other; what recorded forces do.
fn masses(
    rates: &[Rates],
    pairs: impl Iterator<Item = ((usize, usize), [usize; 2])>,
    reference: Option<usize>,
) -> Vec<f64> {
    let count = rates.len();
    // Least squares in the logarithms of the masses.
    let mut sums = Quadratic::zero(count);
    let mut add = |of: &[(usize, f64)], value: f64, error: f64| {
        let weight = 1.0 / error.max(1e-6);
        let mut row = vec![0.0; count];
        of.iter().for_each(|(a, x)| row[*a] = weight * x);
        sums.add_row(&row, weight * value);
    };
    for (at, [a, b]) in pairs {
        let both = rates[a].of(at).zip(rates[b].of(at));
        let Some(([x, x_error], [y, y_error])) = both.filter(|own| own.0[0] * own.1[0] > 0.0)
        else {
            continue;
        };
        let error = (x_error / x).hypot(y_error / y);
        add(&[(a, -1.0), (b, 1.0)], (x / y).ln(), error);
    }
    for (a, own) in rates.iter().enumerate() {
        if let Some([push, error]) = own.push.filter(|own| own[0] > 0.0) {
            add(&[(a, 1.0)], -push.ln(), error / push);
        }
    }
    if let Some(a) = reference {
        add(&[(a, 1.0)], 0.0, 1.0 / GIVEN.sqrt());
    }
    let entry = |a: usize, b: usize| sums.row(a)[b] + if a == b { GUESS } else { 0.0 };
    let scale = scales(count, |a| entry(a, a), GUESS);
    let found = Ridge::new(entry, scale, 0.0).and_then(|own| own.solve_one(|a| sums.right[a]));
    let found = found.unwrap_or_else(|| vec![0.0; count]);
    found.into_iter().map(f64::exp).collect()
}
