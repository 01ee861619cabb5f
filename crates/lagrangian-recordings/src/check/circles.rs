//! Circles in the data: two coordinates, or differences of coordinates, that a rod holds at one distance, and so depend on each other.
//!
//! The circle u² + v² + αu + βv + γ = 0 of least distance, in units of the noise, is that of the smallest eigenvalue of A c = λ D c: A the
//! covariance of (u² + v², u, v), D its sensitivity to noise (Taubin 1991). A rod leaves λ ≈ 1; the same for (u, v) alone is that of a line.

use super::Item;
use super::column::{Column, columns};
use crate::Recording;
use lagrangian_motion::solve::{diagonalise, inverse_root, product};
use lagrangian_motion::statistics::{deviation, mean};
use lagrangian_motion::{Signal, Topology};

/// Largest number of samples and of coordinates that are examined.
const SAMPLES: usize = 2000;
const COORDINATES: usize = 16;
/// A circle holds where its distance is below this many deviations of the noise …
const NOISES: f64 = 1.5;
/// … and the motion is this many times farther from any line.
const CURVED: f64 = 30.0;
/// Smallest noise as a part of the motion.
const EXACT: f64 = 1e-5;

/// A coordinate, or the difference of two.
struct Axis {
    name: String,
    /// The coordinates that it contains.
    of: Vec<usize>,
    values: Vec<f64>,
    noise: f64,
}

/// Pairs of coordinates, or of their differences, that stay on one circle in all recordings.
pub(super) fn items(recordings: &[Recording]) -> Option<Item> {
    let axes = axes(recordings)?;
    let pairs = (0..axes.len()).flat_map(|b| (0..b).map(move |a| (a, b)));
    let found: Vec<String> = pairs
        .filter_map(|(a, b)| circle(&axes[a], &axes[b]))
        .collect();
    let finding = format!(
        "{}: they depend on each other, so that nothing tells their masses and forces apart",
        found.join("; ")
    );
    let remedy = "use the angle in place of such a pair (`polar` makes it of their columns), so that each coordinate can move by itself";
    // One motion may follow a circle by chance, as the orbit of a planet does.
    let name = if recordings.len() > 1 {
        "circle"
    } else {
        "coupled"
    };
    (!found.is_empty()).then(|| Item::doubt(name, finding, remedy))
}

/// The positions that may be of a point in space, and their differences; `None` where there are fewer than two, or too many.
fn axes(recordings: &[Recording]) -> Option<Vec<Axis>> {
    let first = recordings.first()?;
    if recordings
        .iter()
        .any(|r| r.coordinates != first.coordinates || r.q.len() != r.len() * r.dof())
    {
        return None;
    }
    let of_positions = |r| -> Vec<Column<'_>> {
        let mut all = columns(r);
        all.retain(|c| {
            c.signal == Signal::Q && first.coordinates.0[c.coordinate].topology == Topology::Line
        });
        all
    };
    let all: Vec<Vec<Column<'_>>> = recordings.iter().map(of_positions).collect();
    let count = all[0].len();
    if !(2..=COORDINATES).contains(&count) || all.iter().flatten().any(|c| !c.is_finite()) {
        return None;
    }
    let rows: usize = recordings.iter().map(Recording::len).sum();
    let own = |k: usize| {
        let values = all.iter().flat_map(|c| c[k].iter());
        let noise = all.iter().map(|c| c[k].steady_noise());
        let exact = all.iter().map(|c| EXACT * c[k].deviation());
        Axis {
            name: all[0][k].name.to_owned(),
            of: vec![k],
            values: values.step_by(rows.div_ceil(SAMPLES).max(1)).collect(),
            noise: noise.chain(exact).fold(0.0, f64::max),
        }
    };
    let mut axes: Vec<Axis> = (0..count).map(own).collect();
    for b in 1..count {
        for a in 0..b {
            let difference = axes[b].minus(&axes[a]);
            axes.push(difference);
        }
    }
    Some(axes)
}

impl Axis {
    fn minus(&self, other: &Self) -> Self {
        let pairs = self.values.iter().zip(&other.values);
        Self {
            name: format!("{} − {}", self.name, other.name),
            of: [&self.of[..], &other.of].concat(),
            values: pairs.map(|(a, b)| a - b).collect(),
            noise: self.noise.hypot(other.noise),
        }
    }

    /// Its values about their mean, in this unit.
    fn centred(&self, scale: f64) -> Vec<f64> {
        let mean = mean(&mut self.values.iter().copied());
        self.values.iter().map(|x| (x - mean) / scale).collect()
    }
}

/// The finding that two axes stay on a circle.
fn circle(a: &Axis, b: &Axis) -> Option<String> {
    if a.of.iter().any(|k| b.of.contains(k)) || a.noise.min(b.noise) <= 0.0 {
        return None;
    }
    let scale =
        deviation(&mut a.values.iter().copied()).hypot(deviation(&mut b.values.iter().copied()));
    let (u, v) = (a.centred(scale), b.centred(scale));
    let noise = (a.noise / scale, b.noise / scale);
    let line = |u: f64, v: f64| [(u, noise.0, 0.0), (v, 0.0, noise.1)];
    let round = |u: f64, v: f64| {
        let [first, second] = line(u, v);
        [
            (u * u + v * v, 2.0 * u * noise.0, 2.0 * v * noise.1),
            first,
            second,
        ]
    };
    let distance = least_distance(&u, &v, round)?;
    let curved = least_distance(&u, &v, line)? > CURVED * distance.max(1.0);
    (curved && distance < NOISES).then(|| {
        let (a, b) = (&a.name, &b.name);
        format!("{a} and {b} stay on a circle, but for their noise")
    })
}

/// The least distance from a curve Σ cₖ fₖ(u, v) = constant, root mean square in units of the noise: `terms` are fₖ and its derivatives by u
/// and v, times the noise of these.
fn least_distance<const K: usize>(
    u: &[f64],
    v: &[f64],
    terms: impl Fn(f64, f64) -> [(f64, f64, f64); K],
) -> Option<f64> {
    let rows: Vec<[(f64, f64, f64); K]> = u.iter().zip(v).map(|(u, v)| terms(*u, *v)).collect();
    let count = rows.len() as f64;
    let of = |k: usize| mean(&mut rows.iter().map(|row| row[k].0));
    let means: Vec<f64> = (0..K).map(of).collect();
    let (mut spread, mut noise) = (vec![0.0; K * K], vec![0.0; K * K]);
    for row in &rows {
        for (k, (f, du, dv)) in row.iter().enumerate() {
            for (j, (g, eu, ev)) in row.iter().enumerate() {
                spread[k * K + j] += (f - means[k]) * (g - means[j]) / count;
                noise[k * K + j] += (du * eu + dv * ev) / count;
            }
        }
    }
    let root = inverse_root(&noise, K, 1e-12)?;
    let mut whitened = product(&product(&root, &spread, K), &root, K);
    diagonalise(&mut whitened, &mut vec![0.0; K * K], K);
    let least = (0..K)
        .map(|k| whitened[k * K + k])
        .fold(f64::INFINITY, f64::min);
    Some(least.max(0.0).sqrt())
}
