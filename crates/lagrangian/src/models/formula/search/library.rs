//! The terms that a formula may have, the simplest first, without those that the others express.

use std::f64::consts::TAU;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::super::term::Term;
use crate::dataset::Dataset;
use lagrangian_motion::noise::normal;
use lagrangian_motion::statistics::{size, sort_by_number};
use lagrangian_motion::{Coordinates, Samples, Topology};

/// The largest number of terms.
const MOST: usize = 240;
/// The largest sum of exponents and multiples in a potential, in a mass, and in what velocities multiply.
const DEPTHS: [i8; 3] = [6, 2, 2];
/// The largest of the first for three coordinates and more, and the others for one.
const SMALLER: i8 = 4;
/// The part of its size by which a term must differ from those before it.
const INDEPENDENT: f64 = 1e-6;

/// The coordinates as they were declared, then as they may be: a line whose unit is not known may be an angle, the fewest angles first; angles
/// that stay within a turn may be on lines, as those of a torsion wire, which does not repeat.
pub(super) fn readings(coordinates: &Coordinates, data: &Samples) -> Vec<Coordinates> {
    let n = coordinates.dof();
    let may_turn = |i: &usize| {
        let own = &coordinates.0[*i];
        own.topology == Topology::Line && ["", "rad"].contains(&&*own.unit)
    };
    let open: Vec<usize> = (0..n).filter(may_turn).collect();
    let turned = |which: &[usize]| {
        let mut own = coordinates.clone();
        which
            .iter()
            .for_each(|i| own.0[*i].topology = Topology::Circle);
        own
    };
    let mut all = vec![coordinates.clone()];
    all.extend(open.iter().map(|i| turned(&[*i])));
    if open.len() > 1 {
        all.push(turned(&open));
    }
    let circles: Vec<usize> = (0..n).filter(|i| coordinates.is_circle(*i)).collect();
    let is_within = |i: &usize| {
        let [least, most] = range(data, *i);
        most - least < TAU
    };
    if !cfg!(target_family = "wasm") && !circles.is_empty() && circles.iter().all(is_within) {
        let mut own = coordinates.clone();
        circles
            .iter()
            .for_each(|i| own.0[*i].topology = Topology::Line);
        all.push(own);
    }
    all
}

/// The least and the largest value of a coordinate.
fn range(data: &Samples, i: usize) -> [f64; 2] {
    let column = data.q.iter().skip(i).step_by(data.n);
    column.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], x| {
        [x.min(a), x.max(b)]
    })
}

/// All terms of coordinates that differ in the motion that they give, in the order of their complexity; none depends on a cyclic coordinate.
pub(super) fn library(dataset: &Dataset, coordinates: &Coordinates) -> Vec<Term> {
    let Dataset {
        train: data,
        cyclic,
        ..
    } = dataset;
    let n = coordinates.dof();
    let moving: Vec<usize> = (0..n).filter(|i| !coordinates.is_parameter(*i)).collect();
    let mut all = Vec::new();
    let pairs = moving.iter().enumerate();
    let pairs = pairs.flat_map(|(at, a)| moving[at..].iter().map(move |b| vec![*a, *b]));
    let speeds = [
        vec![Vec::new()],
        pairs.collect(),
        moving.iter().map(|a| vec![*a]).collect(),
    ];
    for (speeds, depth) in speeds.into_iter().zip(DEPTHS) {
        let positions = positions(
            coordinates,
            data,
            match (n, depth) {
                (1, 2) | (3.., 6) => SMALLER,
                _ => depth,
            },
        );
        for speeds in &speeds {
            let term = |own: &Term| Term {
                speeds: speeds.clone(),
                ..own.clone()
            };
            all.extend(positions.iter().map(term));
        }
    }
    all.extend(moving.iter().filter_map(|i| steady(coordinates, *i)));
    all.extend(Term::dampers(coordinates));
    all.retain(|term| cyclic.iter().all(|i| !term.depends_on(*i)));
    sort_by_number(&mut all, Term::complexity);
    independent(all, coordinates, data)
}

/// The potential of a torque that does not change, of an angle; what it says of a full turn is no matter to the motion.
fn steady(coordinates: &Coordinates, i: usize) -> Option<Term> {
    let mut powers = vec![0; coordinates.dof()];
    powers[i] = 1;
    coordinates.is_circle(i).then(|| Term {
        powers,
        ..Term::default()
    })
}

/// The functions of q up to this depth: harmonics and powers of one coordinate, of two, and a power times a harmonic.
pub(super) fn positions(coordinates: &Coordinates, data: &Samples, depth: i8) -> Vec<Term> {
    let n = coordinates.dof();
    let mut all = vec![Term::default()];
    let unit = |at: &[(usize, i8)]| {
        let mut each = vec![0; n];
        at.iter().for_each(|(i, k)| each[*i] = *k);
        each
    };
    let mut waves = Vec::new();
    let mut powers = Vec::new();
    for i in 0..n {
        match coordinates.is_circle(i) {
            true => waves.extend((1..=depth).map(|k| unit(&[(i, k)]))),
            false => {
                powers.extend((1..=depth).map(|k| unit(&[(i, k)])));
                let [least, most] = range(data, i);
                if least > 0.0 || most < 0.0 {
                    // Magnets attract with the potential of the third.
                    let least = if depth > DEPTHS[1] { -3 } else { -2 };
                    powers.extend((least..0).rev().map(|k| unit(&[(i, k)])));
                }
            }
        }
        for j in i + 1..n {
            for a in 1..depth {
                for b in 1..=depth - a {
                    match (coordinates.is_circle(i), coordinates.is_circle(j)) {
                        (true, true) => waves.extend([b, -b].map(|b| unit(&[(i, a), (j, b)]))),
                        (false, false) => powers.push(unit(&[(i, a), (j, b)])),
                        _ => (),
                    }
                }
            }
        }
    }
    let wave = |turns: &Vec<i8>| {
        [false, true].map(|sine| Term {
            turns: turns.clone(),
            sine,
            ..Term::default()
        })
    };
    all.extend(powers.iter().map(|powers| Term {
        powers: powers.clone(),
        ..Term::default()
    }));
    all.extend(waves.iter().flat_map(wave));
    let simple = |turns: &&Vec<i8>| turns.iter().map(|k| k.unsigned_abs()).sum::<u8>() == 1;
    for turned in waves.iter().filter(simple).flat_map(wave) {
        let low = powers
            .iter()
            .filter(|p| p.iter().map(|p| p.abs()).sum::<i8>() < depth.min(3));
        all.extend(low.map(|powers| Term {
            powers: powers.clone(),
            ..turned.clone()
        }));
    }
    all
}

/// The first of the terms, without those whose motion the ones before them give: a total derivative gives none.
fn independent(all: Vec<Term>, coordinates: &Coordinates, data: &Samples) -> Vec<Term> {
    let (n, mut rng) = (coordinates.dof(), ChaCha8Rng::seed_from_u64(1));
    let states = (4 * MOST).div_ceil(n);
    let mut drawn = |signal: &[f64]| -> Vec<f64> {
        let rows = signal.len() / n;
        let value = |i: usize, row: usize| signal[row * n + i];
        (0..states * n)
            .map(|at| value(at % n, rng.random_range(0..rows)))
            .collect()
    };
    let [q, qd] = [&data.q, &data.qd].map(|signal| drawn(signal));
    // Any accelerations, also where those of the data are all alike: what the equation of motion relates is no gauge.
    let usual = size(&data.qdd, n);
    let qdd = (0..states * n).map(|at| usual[at % n] * normal(&mut rng));
    let qdd: Vec<f64> = qdd.collect();
    let mut basis: Vec<Vec<f64>> = Vec::new();
    let mut kept = Vec::new();
    for term in all {
        let state = |s: usize| {
            let row = s * n..(s + 1) * n;
            let own = term.balance((&q[row.clone()], &qd[row.clone()]), &qdd[row]);
            own.into_iter().take(n)
        };
        let mut column: Vec<f64> = (0..states).flat_map(state).collect();
        let size = norm(&column);
        if size > 0.0 {
            column.iter_mut().for_each(|x| *x /= size);
        }
        for _ in 0..2 {
            for own in &basis {
                let along: f64 = own.iter().zip(&column).map(|(a, b)| a * b).sum();
                column
                    .iter_mut()
                    .zip(own)
                    .for_each(|(x, a)| *x -= along * a);
            }
        }
        let rest = norm(&column);
        if size > 0.0 && rest > INDEPENDENT && rest.is_finite() {
            column.iter_mut().for_each(|x| *x /= rest);
            basis.push(column);
            kept.push(term);
        }
        if kept.len() == MOST {
            break;
        }
    }
    kept
}

fn norm(x: &[f64]) -> f64 {
    x.iter().map(|x| x * x).sum::<f64>().sqrt()
}
