//! Hamilton's principle of each site and stretch as a row that is linear in the law (theory.md, equation 130k):
//! ∫ q̈ᵢ w = Σ ± ∫ W′ w ± κ ∫ (q̈ⱼ − q̈ᵢ) w − ∫ U′ w − d ∫ q̇ᵢ w, and with forces m ∫ q̈ᵢ w − … = ∫ τᵢ w.

use lagrangian_motion::parallel::prelude::*;

use super::moments::Moments;
use lagrangian_mechanics::lattice::{Basis, LatticeShape};
use lagrangian_motion::Coordinates;
use lagrangian_motion::solve::dot;
use lagrangian_motion::solve::quadratic::Quadratic;

/// What a column of rows multiplies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Column {
    /// A coefficient of W′ of a law of bonds.
    Bond {
        /// The law.
        law: usize,
        /// The coefficient.
        at: usize,
    },
    /// κ of a law.
    Inertia {
        /// The law.
        law: usize,
    },
    /// A coefficient of U′.
    Site {
        /// The coefficient.
        at: usize,
    },
    /// Viscous friction d of the sites.
    Friction,
    /// The mass of the sites, where forces were recorded.
    Mass,
}

/// The columns of a law, in order.
pub(super) fn columns(shape: &LatticeShape, forced: bool) -> Vec<Column> {
    let bonds = shape.bonds.iter().enumerate().flat_map(|(law, bonds)| {
        let each = (0..bonds.basis.count()).map(move |at| Column::Bond { law, at });
        each.chain([Column::Inertia { law }])
    });
    let sites = (0..shape.site.map_or(0, |own| own.count())).map(|at| Column::Site { at });
    let others = [Column::Friction]
        .into_iter()
        .chain(forced.then_some(Column::Mass));
    bonds.chain(sites).chain(others).collect()
}

/// Sums over rows of groups of sites, of the stretches that are fitted and held out.
#[derive(Clone)]
pub(super) struct Sums {
    pub(super) fitted: Vec<Quadratic>,
    pub(super) held: Vec<Quadratic>,
    pub(super) accelerations: Accelerations,
    /// The mean square of a row that the noise of the positions makes of an acceleration.
    pub(super) noise: f64,
}

/// Up to this number of sites each has sums of its own.
const ALONE: usize = 256;
/// Positions of which it is found what noise makes of their rows, about.
const STIRRED: usize = 1_000_000;
/// Stretches whose rows are kept at a time.
const AT_A_TIME: usize = 16;

impl Sums {
    pub(super) fn of(
        moments: &[Moments],
        coordinates: &Coordinates,
        shape: &LatticeShape,
        forced: bool,
    ) -> Self {
        let n = coordinates.dof();
        let columns = columns(shape, forced);
        let width = columns.len();
        let groups = if n <= ALONE { n } else { 1 };
        let empty = || vec![Quadratic::zero(width); groups];
        let mut sums = Self {
            fitted: empty(),
            held: empty(),
            accelerations: Accelerations::of(shape, n, &columns),
            noise: moments.iter().map(|own| own.noise).sum::<f64>() / moments.len().max(1) as f64,
        };
        for some in moments.chunks(AT_A_TIME) {
            let rows: Vec<Vec<f64>> = some
                .par_iter()
                .map(|own| rows(own, coordinates, shape, width, forced))
                .collect();
            for (own, rows) in some.iter().zip(&rows) {
                let to = match own.held {
                    true => &mut sums.held,
                    false => &mut sums.fitted,
                };
                let target = if forced {
                    &own.force
                } else {
                    &own.acceleration
                };
                if groups == n {
                    let each = to.par_iter_mut().zip(rows.par_chunks_exact(width));
                    each.zip(target)
                        .enumerate()
                        .for_each(|(i, ((sum, row), y))| {
                            sum.add_row(row, *y);
                            sums.accelerations.correct(i, own.noise, sum);
                        });
                    continue;
                }
                let part = |part: (&[f64], &[f64])| {
                    let mut sum = Quadratic::zero(width);
                    let each = part.0.chunks_exact(width).zip(part.1);
                    each.for_each(|(row, y)| sum.add_row(row, *y));
                    sum
                };
                let parts: Vec<Quadratic> = rows
                    .par_chunks(width * ALONE)
                    .zip(target.par_chunks(ALONE))
                    .map(part)
                    .collect();
                parts.iter().for_each(|own| to[0].add(own, 1.0));
                (0..n).for_each(|i| sums.accelerations.correct(i, own.noise, &mut to[0]));
            }
        }
        sums
    }

    /// The sums of all sites.
    pub(super) fn all(of: &[Quadratic]) -> Quadratic {
        let mut sum = of[0].clone();
        of[1..].iter().for_each(|own| sum.add(own, 1.0));
        sum
    }
}

/// The columns that are accelerations, whose noise would make them look smaller than they are.
#[derive(Clone)]
pub(super) struct Accelerations {
    /// The column of κ of each law, with the number of bonds of each site.
    inertia: Vec<(usize, Vec<f64>)>,
    /// The column of the mass, where forces were recorded.
    mass: Option<usize>,
}

impl Accelerations {
    fn of(shape: &LatticeShape, n: usize, columns: &[Column]) -> Self {
        let inertia = columns.iter().enumerate().filter_map(|(k, own)| {
            let Column::Inertia { law } = own else {
                return None;
            };
            let mut bonds = vec![0.0; n];
            let sites = shape.bonds[*law].pairs.iter().flatten();
            sites.for_each(|i| {
                if let Some(count) = bonds.get_mut(*i) {
                    *count += 1.0;
                }
            });
            Some((k, bonds))
        });
        Self {
            inertia: inertia.collect(),
            mass: columns.iter().position(|own| *own == Column::Mass),
        }
    }

    /// Whether forces were recorded.
    pub(super) fn is_forced(&self) -> bool {
        self.mass.is_some()
    }

    /// The mass of a site that has these coefficients.
    pub(super) fn mass(&self, coefficient: impl Fn(usize) -> f64) -> f64 {
        self.mass.map_or(1.0, coefficient)
    }

    /// The mean square of the noise of rows with these coefficients, in units of that of the mass times the acceleration: of a site, or of one in the middle.
    pub(super) fn gain(&self, site: Option<usize>, coefficient: impl Fn(usize) -> f64) -> f64 {
        let mass = self.mass(&coefficient);
        let each = self.inertia.iter().map(|(k, bonds)| {
            let inertia = coefficient(*k) / mass;
            let pull = inertia * bonds[site.unwrap_or(bonds.len() / 2)];
            [pull, inertia * pull]
        });
        let [pull, others] = each.fold([0.0; 2], |[a, b], [x, y]| [a + x, b + y]);
        (1.0 + pull).powi(2) + others
    }

    /// Subtracts what noise of this mean square adds to the sums of a site: the acceleration of the site itself is in all of these columns, those of its
    /// neighbours in one each.
    fn correct(&self, site: usize, noise: f64, sum: &mut Quadratic) {
        let width = sum.size();
        for (k, bonds) in &self.inertia {
            for (j, others) in &self.inertia {
                let own = if k == j { bonds[site] } else { 0.0 };
                sum.gram[k * width + j] -= noise * (bonds[site] * others[site] + own);
            }
            match self.mass {
                Some(mass) => {
                    sum.gram[k * width + mass] -= noise * bonds[site];
                    sum.gram[mass * width + k] -= noise * bonds[site];
                }
                None => sum.right[*k] += noise * bonds[site],
            }
        }
        if let Some(mass) = self.mass {
            sum.gram[mass * width + mass] -= noise;
        }
    }
}

/// The rows of all sites, `[n, width]`.
fn rows(
    own: &Moments,
    coordinates: &Coordinates,
    shape: &LatticeShape,
    width: usize,
    forced: bool,
) -> Vec<f64> {
    let n = own.place.len();
    let mut rows = vec![0.0; n * width];
    let mut first = 0;
    for bonds in &shape.bonds {
        let count = bonds.basis.count();
        let mut pull = vec![0.0; count];
        for [i, j] in bonds.pairs.iter().copied() {
            pull.fill(0.0);
            for (q, w) in own.q.chunks_exact(n).zip(&own.weights) {
                let stretch = coordinates.difference(0, at(q, j), at(q, i));
                bonds.basis.values(stretch, |k, value| pull[k] += w * value);
            }
            let inertia = at(&own.acceleration, j) - at(&own.acceleration, i);
            for (site, sign) in [(i, 1.0), (j, -1.0)] {
                let Some(row) = rows.chunks_exact_mut(width).nth(site) else {
                    continue;
                };
                let row = &mut row[first..];
                let each = row.iter_mut().zip(&pull);
                each.for_each(|(x, pull)| *x += sign * pull);
                row[count] += sign * inertia;
            }
        }
        first += count + 1;
    }
    for (i, row) in rows.chunks_exact_mut(width).enumerate() {
        let mut last = first;
        if let Some(basis) = &shape.site {
            hold(basis, own, i, &mut row[first..]);
            last += basis.count();
        }
        row[last] = -own.rate[i];
        if forced {
            row.iter_mut().for_each(|x| *x = -*x);
            row[last + 1] = own.acceleration[i];
        }
    }
    rows
}

/// Subtracts the integrals of the forces that hold a site.
fn hold(basis: &Basis, own: &Moments, site: usize, row: &mut [f64]) {
    let n = own.place.len();
    let each = own.q.iter().skip(site).step_by(n).zip(&own.weights);
    each.for_each(|(q, w)| basis.values(*q, |k, value| row[k] -= w * value));
}

/// What the noise of positions makes of the rows of these coefficients, in units of what it makes of an acceleration: forces have it as well.
pub(super) fn stirred(
    moments: &[Moments],
    coordinates: &Coordinates,
    shape: &LatticeShape,
    coefficients: &[f64],
) -> f64 {
    let n = coordinates.dof();
    let slope = |basis: &Basis, first: usize, x: f64| basis.slope(&coefficients[first..], x);
    let (mut noise, mut alone) = (0.0, 0.0);
    let values: usize = moments.iter().map(|own| own.q.len()).sum();
    let every = values.div_ceil(STIRRED).max(1);
    for own in moments.iter().step_by(every) {
        for ((q, w), c) in own.q.chunks_exact(n).zip(&own.weights).zip(&own.curvatures) {
            // ẅ − w ∂F/∂q of the site itself; of each neighbour the other part.
            let mut site = vec![*c; n];
            let mut first = 0;
            for bonds in &shape.bonds {
                for [i, j] in bonds.pairs.iter().copied() {
                    let stretch = coordinates.difference(0, at(q, j), at(q, i));
                    let pull = w * slope(&bonds.basis, first, stretch);
                    let ends = [i, j].into_iter().filter(|end| *end < n);
                    ends.clone().for_each(|end| site[end] += pull);
                    noise += (ends.count() / 2 * 2) as f64 * pull * pull;
                }
                first += bonds.basis.count() + 1;
            }
            if let Some(basis) = &shape.site {
                let each = site.iter_mut().zip(q);
                each.for_each(|(site, q)| *site += w * slope(basis, first, *q));
            }
            noise += dot(&site, &site);
            alone += n as f64 * c * c;
        }
    }
    noise / alone.max(f64::MIN_POSITIVE)
}

/// The value of a site; that of a wall is 0.
pub(super) fn at(x: &[f64], site: usize) -> f64 {
    x.get(site).copied().unwrap_or(0.0)
}
