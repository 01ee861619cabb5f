//! The choice between laws: which functions, which ends, equal masses or not.

use super::LatticeConfig;
use super::family::Misfit;
use super::law::{EXACT, Fitted, is_spline};
use super::moments::{Moments, clearest, moments};
use super::neighbours::{self, Found};
use super::rows::{Column, Sums, at};
use crate::dataset::Dataset;
use crate::models::formula::{STRIDE, WINDOW};
use crate::train::Observer;
use lagrangian_mechanics::forces::Dissipation;
use lagrangian_mechanics::lattice::{Basis, Bonds, Lattice, LatticeShape};
use lagrangian_motion::solve::dot;
use lagrangian_motion::solve::quadratic::Quadratic;
use lagrangian_motion::statistics::sort_numbers;
use lagrangian_motion::{Error, Result};

/// Rows of all sites together, at most; stretches, and the values of all of them.
const MOST_ROWS: usize = 100_000;
const STRETCHES: [usize; 2] = [50, 4_000];
const MOST_VALUES: usize = 20_000_000;
/// The laws that are tried: powers, and splines on so many intervals.
const DEGREES: [usize; 3] = [1, 3, 5];
const HARMONICS: [usize; 2] = [1, 2];
const INTERVALS: [usize; 2] = [8, 16];
/// Stretches of bonds between angles beyond which they turn.
const TURNS: f64 = 2.5;
/// What a law may leave of the motion beyond its noise.
const REFUSED: f64 = 0.1;
/// Rounds of fits of masses and of a law by turns, and the change that ends them.
const ROUNDS: usize = 40;
const SETTLED: f64 = 1e-12;
/// A scatter of masses, in units of its standard error, from which on they are unequal.
const UNEQUAL: f64 = 4.0;

/// A lattice and what the data say of it.
pub(super) struct Solved {
    pub(super) lattice: Lattice,
    /// The standard errors of its parameters, in their order.
    pub(super) errors: Vec<f64>,
    pub(super) misfit: Misfit,
    /// The part of the motion that is left, of the stretches that are fitted and held out.
    pub(super) left: [f64; 2],
}

/// Finds the law of a lattice.
pub(super) fn find(
    dataset: &Dataset,
    config: &LatticeConfig,
    observer: &mut dyn Observer,
) -> Result<Solved> {
    // A page, which everybody loads, is without what follows.
    if cfg!(target_family = "wasm") {
        return Err(Error::setting(
            "a page does not look for the law of a lattice",
            "use the command or the Python package, or take another `family`",
        ));
    }
    let n = dataset.coordinates.dof();
    let mut tell = |what: &str, share: f64| !observer.stage(what, share).is_break();
    tell("integrating motions", 0.0);
    let [fewest, most] = STRETCHES;
    let all = clearest(fewest, &|window| {
        let fitting = MOST_VALUES / (window * n);
        match window > WINDOW && fitting < fewest {
            true => Vec::new(),
            false => moments(dataset, fitting.clamp(fewest, most), window),
        }
    });
    tell("finding neighbours", 0.1);
    let found = neighbours::find(&all, &dataset.coordinates, config)?;
    let every = (all.len() * n).div_ceil(MOST_ROWS).max(1);
    let some: Vec<Moments> = all.into_iter().step_by(every).collect();
    let best = cheapest(dataset, (&found, config), &some, &mut tell);
    let (mut law, sums) = best.ok_or_else(nothing)?;
    let mut masses = vec![1.0; n];
    if let Some((unequal, own)) = unequal(&law, &sums, dataset.forced) {
        tell("fitting masses", 0.9);
        (masses, law) = (unequal, own);
    }
    let noise = law.noise(&sums, &some, dataset);
    check(&law, &sums, noise)?;
    solved(dataset, law, masses, noise)
}

/// The law with the cheapest description of the motions, and its sums, of as few neighbours as explain them. Where sites share inertia each feels all
/// others, and the law of the nearest may do.
fn cheapest(
    dataset: &Dataset,
    (found, config): (&[Found], &LatticeConfig),
    moments: &[Moments],
    tell: &mut dyn FnMut(&str, f64) -> bool,
) -> Option<(Fitted, Sums)> {
    let mut best: Option<(Fitted, Sums)> = None;
    let least = if config.neighbours.is_empty() {
        1
    } else {
        found.len()
    };
    let counts = least.max(1)..=found.len().max(1);
    // Neighbours farther apart may have other ends than the nearest, as where walls hold the last sites alone.
    let each = counts.flat_map(|count| [false, true].map(|mixed| (count, mixed)));
    for (count, mixed) in each.filter(|(count, mixed)| !mixed || *count == 2) {
        let mut own = found[..count.min(found.len())].to_vec();
        own.sort_by_key(|own| own.offset);
        let shapes = shapes(dataset, &own, moments, mixed);
        let last = shapes.len();
        for (k, shape) in shapes.into_iter().enumerate() {
            if !tell("fitting laws", 0.2 + 0.6 * k as f64 / last as f64) && best.is_some() {
                break;
            }
            let sums = Sums::of(moments, &dataset.coordinates, &shape, dataset.forced);
            let Some(law) = Fitted::of(shape, &sums, dataset.forced) else {
                continue;
            };
            if best.as_ref().is_none_or(|(own, _)| law.cost < own.cost) {
                best = Some((law, sums));
            }
        }
        let explains = |(law, sums): &(Fitted, Sums)| {
            misfit(law, law.noise(sums, moments, dataset), false).is_explained()
        };
        if best.as_ref().is_some_and(explains) {
            break;
        }
    }
    best
}

fn nothing() -> Error {
    Error::setting(
        "no law of neighbours explains these motions",
        "take another `family`, such as delan",
    )
}

/// The laws that are tried, the simplest first: with the same variant of each kind of bonds, or of two kinds with different ones.
fn shapes(
    dataset: &Dataset,
    found: &[Found],
    moments: &[Moments],
    mixed: bool,
) -> Vec<LatticeShape> {
    let coordinates = &dataset.coordinates;
    let n = coordinates.dof();
    let states = || {
        let each = moments.iter().map(|own| own.q.chunks_exact(n).step_by(4));
        each.flatten()
    };
    let stretches = |pairs: &Vec<[usize; 2]>| {
        let stretch = |q: &[f64], [i, j]: [usize; 2]| coordinates.difference(0, at(q, j), at(q, i));
        range(states().flat_map(|q| pairs.iter().map(move |pair| stretch(q, *pair))))
    };
    let places = range(states().flatten().copied());
    let most = found
        .iter()
        .map(|own| own.variants.len())
        .max()
        .unwrap_or(1);
    let each = (0..most).flat_map(|first| (0..most).map(move |second| [first, second]));
    let mut all = Vec::new();
    for variants in each.filter(|[first, second]| (first != second) == mixed) {
        let own = |(own, variant): (&Found, usize)| {
            let same = variant.min(own.variants.len() - 1);
            let pairs = own.variants.get(if mixed { variant } else { same })?;
            Some((own.offset, stretches(pairs), pairs.clone()))
        };
        let cycled = variants.into_iter().cycle();
        let bonds: Option<Vec<_>> = found.iter().zip(cycled).map(own).collect();
        let Some(bonds) = bonds else {
            continue;
        };
        let farthest = bonds.iter().flat_map(|own| own.1);
        let turns = farthest.fold(0.0, |most: f64, x| most.max(x.abs())) > TURNS;
        let laws = match coordinates.is_circle(0) {
            true => laws_of_angles(turns),
            false => laws_of_lines(places),
        };
        all.extend(laws.into_iter().map(|(bond, site)| {
            LatticeShape {
                bonds: bonds
                    .iter()
                    .map(|(offset, range, pairs)| Bonds {
                        offset: *offset,
                        pairs: pairs.clone(),
                        basis: bond.on(*range),
                    })
                    .collect(),
                site: Some(site),
            }
        }));
    }
    all
}

/// The smallest and the largest value.
fn range(values: impl Iterator<Item = f64>) -> [f64; 2] {
    let none = [f64::INFINITY, f64::NEG_INFINITY];
    values.fold(none, |[low, high], x| [low.min(x), high.max(x)])
}

/// The functions of bonds, before the range of their stretches is known.
#[derive(Clone, Copy)]
enum BondBasis {
    Known(Basis),
    Spline(usize),
}

impl BondBasis {
    fn on(self, range: [f64; 2]) -> Basis {
        match self {
            Self::Known(basis) => basis,
            Self::Spline(intervals) => Basis::spline(range, intervals),
        }
    }
}

/// The functions of bonds and of sites that are lines between these places.
fn laws_of_lines(places: [f64; 2]) -> Vec<(BondBasis, Basis)> {
    let powers = |degree: usize| Basis::Powers { degree };
    let mut laws: Vec<_> = (DEGREES.iter())
        .map(|degree| (BondBasis::Known(powers(*degree)), powers(*degree)))
        .collect();
    let wave = Basis::Harmonics { count: 1 };
    laws.push((BondBasis::Known(powers(3)), wave));
    laws.extend(INTERVALS.map(|own| (BondBasis::Spline(own), Basis::spline(places, own))));
    laws
}

/// The same of angles, whose bonds may turn.
fn laws_of_angles(turns: bool) -> Vec<(BondBasis, Basis)> {
    let harmonics = HARMONICS.map(|count| Basis::Harmonics { count });
    let cubic = BondBasis::Known(Basis::Powers { degree: 3 });
    let mut laws: Vec<_> = harmonics.map(|own| (cubic, own)).to_vec();
    laws.extend(harmonics.map(|own| (BondBasis::Known(own), own)));
    laws.extend(INTERVALS.map(|own| {
        let site = Basis::turning_spline(own);
        let bond = if turns {
            BondBasis::Known(site)
        } else {
            BondBasis::Spline(own)
        };
        (bond, site)
    }));
    laws
}

/// Masses of free motions that the data tell apart, and the law with them; their mean is 1.
fn unequal(law: &Fitted, sums: &Sums, forced: bool) -> Option<(Vec<f64>, Fitted)> {
    let n = sums.fitted.len();
    if forced || n == 1 {
        return None;
    }
    let own = lightness(law, sums);
    let scatter = own.iter().map(|[x, error]| ((x - 1.0) / error).powi(2));
    if scatter.sum::<f64>() / (n as f64) < UNEQUAL.powi(2) {
        return None;
    }
    let mut masses: Vec<f64> = vec![1.0; n];
    let mut best: Option<(Vec<f64>, Fitted)> = None;
    let mut law = law.clone();
    for _ in 0..ROUNDS {
        let next: Vec<f64> = lightness(&law, sums).iter().map(|[x, _]| 1.0 / x).collect();
        let mean = next.iter().sum::<f64>() / n as f64;
        if !next.iter().all(|own| *own > 0.0 && own.is_finite()) {
            return best;
        }
        let change = masses
            .iter_mut()
            .zip(next)
            .map(|(own, next)| {
                let before = std::mem::replace(own, next / mean);
                ((*own - before) / before).abs()
            })
            .fold(0.0, f64::max);
        let [fitted, held] = [&sums.fitted, &sums.held].map(|own| scaled(own, &masses));
        let scaled = Sums {
            fitted,
            held,
            accelerations: sums.accelerations.clone(),
            noise: sums.noise,
        };
        law = Fitted::of(law.shape.clone(), &scaled, false)?;
        best = Some((masses.clone(), law.clone()));
        if change < SETTLED {
            break;
        }
    }
    best
}

/// 1 over the mass of each site, by its rows, and its standard error.
fn lightness(law: &Fitted, sums: &Sums) -> Vec<[f64; 2]> {
    let terms = || law.coefficients.iter().copied().enumerate();
    let own = |(site, own): (usize, &Quadratic)| {
        let pull: f64 = terms().map(|(k, c)| c * own.right[k]).sum();
        let square: f64 = terms()
            .map(|(k, c)| c * dot(own.row(k), &law.coefficients))
            .sum();
        let square = square.max(f64::MIN_POSITIVE);
        let lightness = pull / square;
        let gain = sums.accelerations.gain(Some(site), |k| law.coefficients[k]);
        let least = (EXACT * own.square).max(own.rows as f64 * sums.noise);
        let left = gain * (own.square - lightness * pull).max(least);
        let overlap = WINDOW as f64 / STRIDE as f64;
        [
            lightness,
            (left / own.rows.max(1) as f64 / square * overlap).sqrt(),
        ]
    };
    sums.fitted.iter().enumerate().map(own).collect()
}

/// The sums of rows that are divided by the mass of their site.
fn scaled(of: &[Quadratic], masses: &[f64]) -> Vec<Quadratic> {
    let each = of.iter().zip(masses).map(|(own, mass)| Quadratic {
        gram: own.gram.iter().map(|x| x / (mass * mass)).collect(),
        right: own.right.iter().map(|x| x / mass).collect(),
        ..own.clone()
    });
    each.collect()
}

/// Refuses a law that does not explain the motions.
fn check(law: &Fitted, sums: &Sums, noise: f64) -> Result<()> {
    let at = usize::from(law.whole[1] > 0.0);
    let beyond = (law.left[at] - noise).max(0.0) / law.whole[at].max(f64::MIN_POSITIVE);
    if beyond < REFUSED {
        return Ok(());
    }
    let each = law.left_of_each(sums);
    let worst = (0..each.len()).max_by(|a, b| each[*a].total_cmp(&each[*b]));
    let mut sorted = each.clone();
    sort_numbers(&mut sorted);
    let differ = each.len() > 1 && sorted[each.len() - 1] > 10.0 * sorted[each.len() / 2];
    Err(Error::setting(
        match worst.filter(|_| differ) {
            Some(site) => format!(
                "no lattice: its sites differ, since one law leaves {:.0} % of the motion of coordinate {}, and {:.2} % of most",
                100.0 * each[site],
                site + 1,
                100.0 * sorted[each.len() / 2]
            ),
            None => format!(
                "no lattice: one law of neighbours leaves {:.0} % of the motion beyond its noise",
                100.0 * beyond
            ),
        },
        "take another `family`, name the differences of the indices of neighbours with `neighbours` and what is at the ends with `ends`, or \
         declare rotors as angles with `angle`",
    ))
}

/// The lattice of a law.
fn solved(dataset: &Dataset, law: Fitted, masses: Vec<f64>, noise: f64) -> Result<Solved> {
    let n = dataset.coordinates.dof();
    let mass = law.part(|own| *own == Column::Mass);
    let mut parameters = match mass.first() {
        Some(mass) => vec![*mass; n],
        None => masses,
    };
    let mut errors = vec![0.0; n];
    let viscous = law.part(|own| *own == Column::Friction)[0];
    let mut shape = LatticeShape {
        bonds: Vec::new(),
        site: None,
    };
    for (k, bonds) in law.shape.bonds.iter().enumerate() {
        let own = taken(
            &law,
            &bonds.basis,
            |own| matches!(own, Column::Bond { law, .. } if *law == k),
        );
        let inertia = law.part(|own| *own == Column::Inertia { law: k })[0];
        let Some((basis, coefficients, sizes)) = own.or_else(|| {
            (inertia > 0.0).then(|| (Basis::Powers { degree: 0 }, vec![0.0], vec![0.0]))
        }) else {
            continue;
        };
        shape.bonds.push(Bonds {
            basis,
            ..bonds.clone()
        });
        parameters.extend(coefficients.iter().chain([&inertia]));
        errors.extend(sizes.iter().chain([&0.0]));
    }
    let site = law.shape.site.as_ref();
    if let Some((basis, coefficients, sizes)) =
        site.and_then(|basis| taken(&law, basis, |own| matches!(own, Column::Site { .. })))
    {
        shape.site = Some(basis);
        parameters.extend(coefficients);
        errors.extend(sizes);
    }
    let friction = (viscous > 0.0).then(|| Dissipation::viscous(vec![viscous; n]));
    let bases = shape.bonds.iter().map(|own| &own.basis);
    let curved = bases.chain(&shape.site).any(is_open);
    Ok(Solved {
        lattice: Lattice::new(dataset.coordinates.clone(), shape, parameters, friction)?,
        errors,
        misfit: misfit(&law, noise, curved),
        left: [0, 1].map(|k| left(&law, k)),
    })
}

/// The part of the motion that a law leaves of the stretches that are fitted, or held out.
fn left(law: &Fitted, k: usize) -> f64 {
    law.left[k] / law.whole[k].max(f64::MIN_POSITIVE)
}

fn misfit(law: &Fitted, noise: f64, curved: bool) -> Misfit {
    Misfit {
        of_noise: law.left[0] / noise.max(f64::MIN_POSITIVE),
        left: left(law, 0),
        curved,
    }
}

/// Whether functions are no formula: splines, and high powers or multiples, which are a series that need not end.
fn is_open(basis: &Basis) -> bool {
    match basis {
        Basis::Powers { degree } => *degree > DEGREES[1],
        Basis::Harmonics { count } => *count == HARMONICS[HARMONICS.len() - 1],
        spline => is_spline(spline),
    }
}

/// The curve of some columns of a law, as [`trimmed`].
fn taken(
    law: &Fitted,
    basis: &Basis,
    is: impl Fn(&Column) -> bool,
) -> Option<(Basis, Vec<f64>, Vec<f64>)> {
    let values = law.coefficients.iter().zip(&law.errors);
    let each = law.columns.iter().zip(values).filter(|(own, _)| is(own));
    trimmed(basis, each.map(|(_, (x, error))| (*x, *error)).unzip())
}

/// A basis without the powers and multiples that no coefficient needs, with its coefficients and their errors; `None` for none.
fn trimmed(
    basis: &Basis,
    (mut coefficients, mut errors): (Vec<f64>, Vec<f64>),
) -> Option<(Basis, Vec<f64>, Vec<f64>)> {
    let last = coefficients.iter().rposition(|x| *x != 0.0)?;
    let own = match *basis {
        Basis::Powers { .. } => Basis::Powers { degree: last },
        Basis::Harmonics { .. } => Basis::Harmonics {
            count: last / 2 + 1,
        },
        spline => spline,
    };
    coefficients.truncate(own.count());
    errors.truncate(own.count());
    Some((own, coefficients, errors))
}
