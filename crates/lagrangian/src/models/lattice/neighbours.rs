//! Which sites are neighbours: the accelerations of all sites regressed on the positions of all others, at first by the difference of
//! their indices, which is a convolution, then each bond by itself.

use std::f64::consts::TAU;

use lagrangian_motion::parallel::prelude::*;

use super::moments::Moments;
use super::{LatticeConfig, LatticeEnds};
use crate::models::formula::{STRIDE, WINDOW};
use lagrangian_mechanics::lattice::{Bonds, Ends};
use lagrangian_motion::solve::quadratic::Quadratic;
use lagrangian_motion::solve::ridge::{Ridge, scales};
use lagrangian_motion::statistics::{median, sort_by_number, sort_numbers};
use lagrangian_motion::{Coordinates, Error, Result};

/// The bonds of one law: their pairs as found, and, where it is open what is at the ends, those with walls.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Found {
    pub(super) offset: usize,
    /// The pairs, in the order of preference.
    pub(super) variants: Vec<Vec<[usize; 2]>>,
}

/// Standard errors beyond which a coupling is no chance, and parts of the largest above which it is one of neighbours, times the root of
/// the number of sites: the rows of a grid meet at as few sites.
const SIGNIFICANT: f64 = 5.0;
const LARGE: f64 = 0.4;
/// The number of offsets that are tried beyond those that are no chance.
const MORE: usize = 2;
/// The largest number of offsets; more are no sparse neighbourhood.
const MOST_OFFSETS: usize = 12;
/// A bond weaker than this part of the strongest of its kind does not exist, where it is known to this part.
const WEAK: f64 = 0.3;
const KNOWN: f64 = 0.15;
/// The part of sites without a neighbour up to which they are ends.
const ENDS: f64 = 0.25;
/// Values of one regression of all offsets at most.
const MOST_VALUES: usize = 1_000_000_000;
const RIDGE: f64 = 1e-9;
/// A wave of this part of the mean is absent.
const ABSENT: f64 = 1e-4;

/// The bonds of these motions.
pub(super) fn find(
    moments: &[Moments],
    coordinates: &Coordinates,
    config: &LatticeConfig,
) -> Result<Vec<Found>> {
    let n = coordinates.dof();
    let offsets = match config.neighbours.is_empty() {
        true => offsets(moments, n)?,
        false => {
            let mut given = config.neighbours.clone();
            given.sort_unstable();
            given.dedup();
            given
        }
    };
    let ends = match config.ends {
        LatticeEnds::Find => None,
        LatticeEnds::Ring => Some(Ends::Ring),
        LatticeEnds::Walls => Some(Ends::Walls),
        LatticeEnds::Free => Some(Ends::Free),
    };
    let given = |offset: &usize, ends| Found {
        offset: *offset,
        variants: vec![Bonds::of_chain(n, *offset, ends)],
    };
    if let Some(ends) = ends {
        return Ok(offsets.iter().map(|own| given(own, ends)).collect());
    }
    let known = couplings(moments, n, &offsets, coordinates.is_circle(0));
    let each = offsets.iter().enumerate();
    let widths: Vec<usize> = { offsets.iter().copied() }
        .filter(|width| *width > 1 && *width < n && n.is_multiple_of(*width))
        .collect();
    let found = each.filter_map(|(at, offset)| Found::of(n, *offset, (&known, at), &widths));
    Ok(found.collect())
}

/// The offsets at which sites are coupled, the strongest first, or the next site where the motions do not tell; then others that may be.
fn offsets(moments: &[Moments], n: usize) -> Result<Vec<usize>> {
    let every = (moments.len() * n * n).div_ceil(MOST_VALUES).max(1);
    let some: Vec<&Moments> = moments.iter().step_by(every).collect();
    let centred = Centred::of(&some, n);
    let sum = |of: &[Vec<f64>]| -> Vec<f64> {
        let along = |shift: usize| -> f64 {
            let each = of.iter().zip(&centred.places).map(|(own, place)| {
                let (head, tail) = place.split_at(shift);
                let turned = tail.iter().chain(head);
                own.iter().zip(turned).map(|(a, b)| a * b).sum::<f64>()
            });
            each.sum()
        };
        (0..n).into_par_iter().map(along).collect()
    };
    let (gram, across) = (sum(&centred.places), sum(&centred.accelerations));
    let table: Vec<[f64; 2]> = (0..n)
        .map(|k| (TAU * k as f64 / n as f64).sin_cos())
        .map(|(sin, cos)| [cos, sin])
        .collect();
    let waves = |x: &[f64], k: usize| -> [f64; 2] {
        let each = x
            .iter()
            .enumerate()
            .map(|(i, x)| table[i * k % n].map(|w| w * x));
        each.fold([0.0; 2], |[a, b], [c, d]| [a + c, b + d])
    };
    // Waves that the motions hardly have, such as the rest of the whole where its momentum is 0, tell nothing.
    let floor = ABSENT * gram[0].max(f64::MIN_POSITIVE);
    let sizes: Vec<f64> = (0..n).into_par_iter().map(|k| waves(&gram, k)[0]).collect();
    let told = |k: usize| (sizes[k] > floor).then(|| 1.0 / sizes[k]);
    let spectrum: Vec<[f64; 2]> = (0..n)
        .into_par_iter()
        .map(|k| told(k).map_or([0.0; 2], |part| waves(&across, k).map(|x| x * part)))
        .collect();
    let coupling = |shift: usize| -> f64 {
        let each = spectrum.iter().enumerate().map(|(k, [a, b])| {
            let [cos, sin] = table[shift * k % n];
            a * cos + b * sin
        });
        each.sum::<f64>() / n as f64
    };
    let all: Vec<f64> = (0..n).into_par_iter().map(coupling).collect();
    let square: f64 = centred.accelerations.iter().flatten().map(|a| a * a).sum();
    let explained: f64 = all.iter().zip(&across).map(|(j, c)| j * c).sum();
    let independent = (some.len() * n * STRIDE) as f64 / WINDOW as f64;
    let noise = (square - explained).max(1e-12 * square) / independent;
    let inverse = (0..n).filter_map(told).sum::<f64>() / n as f64;
    let error = (noise * inverse * WINDOW as f64 / STRIDE as f64).sqrt();
    let strength = |offset: usize| all[offset].abs().max(all[n - offset].abs());
    let largest = (1..=n / 2).map(strength).fold(0.0, f64::max);
    let least = (SIGNIFICANT * error).max(LARGE / (n as f64).sqrt() * largest);
    strongest(n, strength, least)
}

/// The offsets whose coupling is larger than this, the strongest first, then others that may be.
fn strongest(n: usize, strength: impl Fn(usize) -> f64, least: f64) -> Result<Vec<usize>> {
    let mut offsets: Vec<usize> = (1..=n / 2).collect();
    sort_by_number(&mut offsets, |own| -strength(*own));
    let significant = offsets.partition_point(|own| strength(*own) > least);
    match significant {
        0 => sort_by_number(&mut offsets, |own| f64::from(u8::from(*own != 1))),
        1..=MOST_OFFSETS => {}
        many => return Err(not_sparse(many)),
    }
    // A chain with ends is no ring: a law of those alone that does not explain the motions is compared with one of more.
    offsets.truncate(significant.max(1) + MORE);
    Ok(offsets)
}

fn not_sparse(many: usize) -> Error {
    Error::setting(
        format!(
            "no lattice: each coordinate is coupled to {} others at least, so that none are its neighbours",
            2 * many
        ),
        "take another `family`, or name the differences of the indices of neighbours with `neighbours`",
    )
}

/// Integrals of positions and accelerations without the mean of each site.
struct Centred {
    places: Vec<Vec<f64>>,
    accelerations: Vec<Vec<f64>>,
}

impl Centred {
    /// The positions and accelerations of each stretch.
    fn each(&self) -> impl Iterator<Item = (&[f64], &[f64])> {
        let accelerations = self.accelerations.iter().map(|own| &own[..]);
        self.places.iter().map(|own| &own[..]).zip(accelerations)
    }

    fn of(moments: &[&Moments], n: usize) -> Self {
        let centre = |of: fn(&Moments) -> &[f64]| -> Vec<Vec<f64>> {
            let mut mean = vec![0.0; n];
            for own in moments {
                let each = mean.iter_mut().zip(of(own));
                each.for_each(|(sum, x)| *sum += x / moments.len() as f64);
            }
            let less = |own: &&Moments| of(own).iter().zip(&mean).map(|(x, m)| x - m).collect();
            moments.iter().map(less).collect()
        };
        Self {
            places: centre(|own| &own.place),
            accelerations: centre(|own| &own.acceleration),
        }
    }
}

/// What each site says of its neighbours at each offset: the coupling to the one before, to the one after, and their standard error.
type Coupling = Vec<[f64; 3]>;

fn couplings(moments: &[Moments], n: usize, offsets: &[usize], circle: bool) -> Vec<Coupling> {
    let all: Vec<&Moments> = moments.iter().collect();
    let centred = Centred::of(&all, n);
    let width = 2 * offsets.len() + 1;
    let of = |i: usize| -> Coupling {
        let mut sums = Quadratic::zero(width);
        for (own, (place, acceleration)) in moments.iter().zip(centred.each()) {
            let around = offsets.iter().flat_map(|own| [i + n - own, i + own]);
            let value = |j: usize| match circle {
                true => own.sine(i, j % n),
                false => place[j % n],
            };
            let row: Vec<f64> = [i].into_iter().chain(around).map(value).collect();
            sums.add_row(&row, acceleration[i]);
        }
        let unknown = vec![[0.0, 0.0, f64::INFINITY]; offsets.len()];
        let rows = sums.rows as f64 * STRIDE as f64 / WINDOW as f64;
        if rows <= width as f64 {
            return unknown;
        }
        let scale = scales(width, |k| sums.row(k)[k], f64::MIN_POSITIVE);
        let Some(ridge) = Ridge::new(|k, j| sums.row(k)[j], scale, RIDGE) else {
            return unknown;
        };
        let inverse = ridge.solve(width, |k, j| f64::from(k == j));
        let value = |k: usize| -> f64 {
            let each = sums.right.iter().enumerate();
            each.map(|(j, right)| inverse[(k, j)] * right).sum()
        };
        let x: Vec<f64> = (0..width).map(value).collect();
        let noise = sums.loss(&x) / (rows - width as f64);
        let error = |k: usize| (noise * inverse[(k, k)]).sqrt();
        (0..offsets.len())
            .map(|at| {
                let k = 1 + 2 * at;
                [x[k], x[k + 1], error(k).max(error(k + 1))]
            })
            .collect()
    };
    (0..n).into_par_iter().map(of).collect()
}

impl Found {
    /// The bonds of an offset, perhaps of a grid with rows of one of these widths; `None` where there are none.
    fn of(
        n: usize,
        offset: usize,
        (known, at): (&[Coupling], usize),
        widths: &[usize],
    ) -> Option<Self> {
        let whole = Bonds::of_chain(n, offset, Ends::Ring);
        // A bond shows at both of its sites.
        let strength = |[i, j]: [usize; 2]| {
            let ([_, after, a], [before, _, b]) = (known[i][at], known[j][at]);
            (f64::midpoint(after, before).abs(), 0.5 * a.hypot(b))
        };
        let mut sizes: Vec<f64> = whole.iter().map(|pair| strength(*pair).0).collect();
        sort_numbers(&mut sizes);
        // Where the rows of a grid meet, few of a kind exist.
        let usual = sizes[sizes.len() - 1 - sizes.len() / 100];
        let exists = |pair: &[usize; 2]| {
            let (size, error) = strength(*pair);
            size > WEAK * usual || error > KNOWN * usual
        };
        let (pairs, missing): (Vec<_>, Vec<_>) = whole.iter().partition(|own| exists(own));
        if pairs.is_empty() {
            return None;
        }
        let chain = |ends| Bonds::of_chain(n, offset, ends);
        // Where all but those across the ends exist, the fit of each case tells; that which was found comes first.
        if missing.iter().all(|own: &[usize; 2]| own[0] > own[1]) {
            return Some(Self {
                offset,
                variants: match missing.is_empty() {
                    true => [Ends::Ring, Ends::Walls, Ends::Free],
                    false => [Ends::Free, Ends::Walls, Ends::Ring],
                }
                .map(chain)
                .to_vec(),
            });
        }
        // Of a grid with edges the bonds from one row to the next are none, which few of them tell by themselves.
        let weak = |missing: &[[usize; 2]]| {
            let sizes = missing.iter().map(|pair| strength(*pair).0).collect();
            median(sizes) < WEAK * usual
        };
        let grids = { widths.iter() }.map(|width| in_rows(&whole, *width, offset));
        let grid = grids
            .filter(|(own, missing)| !own.is_empty() && weak(missing))
            .min_by_key(|(own, _)| own.iter().filter(|pair| !pairs.contains(pair)).count());
        let found = (pairs, missing);
        let mut variants = Vec::new();
        for (pairs, missing) in grid.into_iter().chain([found]) {
            let few = (missing.len() as f64) < ENDS * n as f64;
            let walls = missing.into_iter().flat_map(|[i, j]| [[n, j], [i, n]]);
            let walled = few.then(|| pairs.iter().copied().chain(walls).collect());
            for own in [Some(pairs), walled].into_iter().flatten() {
                if !variants.contains(&own) {
                    variants.push(own);
                }
            }
        }
        Some(Self { offset, variants })
    }
}

/// Pairs of sites at this offset in a grid with rows of this width, and those that would leave it.
fn in_rows(
    pairs: &[[usize; 2]],
    width: usize,
    offset: usize,
) -> (Vec<[usize; 2]>, Vec<[usize; 2]>) {
    let aside = match offset % width {
        aside if 2 * aside > width => aside as isize - width as isize,
        aside => aside as isize,
    };
    let is_inside = |[i, j]: &[usize; 2]| {
        let column = (i % width) as isize + aside;
        i < j && column >= 0 && column < width as isize
    };
    pairs.iter().partition(|pair| is_inside(pair))
}
