//! The action of true and learned Lagrangians between the same ends.
//!
//! L and α L + dF(q)/dt + c have the same motions, and their actions are α S + F(q(T)) − F(q(0)) + c T. Between fixed ends,
//! differences of S are known to the factor α alone. It is taken from the mass matrices along the path, M′ ≈ α M, which know
//! neither F nor c. Where every motion has its own α (one coordinate: H and any function of it have the same motions), it
//! is that of this path.

use std::sync::LazyLock;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use lagrangian::analytic::{AnalyticModel, by_name};
use lagrangian::mechanics::{Jet, Lagrangian, dot};
use lagrangian::rollout::free;
use lagrangian::{Error, Model, Result, RolloutOptions, rollout};
use lagrangian_analysis::action::{DiscreteAction, Path, StationaryPath, stationary_path_from};

/// Segments of the paths.
pub(crate) const SEGMENTS: usize = 400;
/// The largest variation.
pub(crate) const LARGEST: f64 = 0.2;
/// Sizes of the variations, even, 0 in the middle.
pub(crate) static SIZES: LazyLock<[f64; 21]> =
    LazyLock::new(|| std::array::from_fn(|k| LARGEST * (k as f64 - 10.0) / 10.0));

/// A motion whose ends are connected, short of its first conjugate point and beyond it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Case {
    /// Name of the system.
    pub(crate) system: &'static str,
    /// Where the motion starts.
    pub(crate) q: &'static [f64],
    /// How fast.
    pub(crate) qd: &'static [f64],
    /// A time before the first conjugate point, s.
    pub(crate) short: f64,
    /// A time after it, s.
    pub(crate) long: f64,
}

/// The cases of the experiment.
pub(crate) const CASES: [Case; 3] = [
    Case {
        system: "pendulum",
        q: &[0.5],
        qd: &[2.0],
        short: 0.8,
        long: 1.8,
    },
    Case {
        system: "double-pendulum",
        q: &[0.6, -0.3],
        qd: &[1.0, 1.5],
        short: 0.5,
        long: 1.6,
    },
    Case {
        system: "charged-particle",
        q: &[1.0, 0.0],
        qd: &[0.6, 0.8],
        short: 3.0,
        long: 7.0,
    },
];

impl Case {
    /// The system with the parameters of its table.
    pub(crate) fn system(&self) -> Result<Box<dyn AnalyticModel>> {
        by_name(self.system, &[])
    }

    /// The motion over this time at the nodes of half the segments: a first path for all who are compared.
    pub(crate) fn motion(&self, seconds: f64) -> Result<Path> {
        let system = self.system()?;
        let half = SEGMENTS / 2;
        let times: Vec<f64> = (0..=half)
            .map(|k| seconds * k as f64 / half as f64)
            .collect();
        let options = RolloutOptions::truth();
        let motion = rollout(&*system, self.q, self.qd, &times, &free, &options)?;
        Ok(Path {
            dof: self.q.len(),
            duration: seconds,
            q: motion.trajectory.signals.q,
        })
    }
}

/// What one Lagrangian says of the paths between two ends.
pub(crate) struct Measured {
    /// Its stationary path.
    pub(crate) stationary: StationaryPath,
    /// S(ε) − S(0) along sines of one and of two half waves of each coordinate, `[2 n]`.
    pub(crate) families: Vec<Vec<f64>>,
    /// Largest |dS/dε| at ε = 0 over the change of S at the largest ε: 0 where the path is stationary.
    pub(crate) slope: f64,
    /// Least eigenvalue of the second variation at parts of the time, (s, 1/s² in units of mass).
    pub(crate) eigenvalues: Vec<(f64, f64)>,
}

/// Measures the stationary path next to a first path; `None` where there is none.
pub(crate) fn measure(lagrangian: &dyn Lagrangian, first: &Path) -> Result<Option<Measured>> {
    let Ok(stationary) = stationary_path_from(lagrangian, first)? else {
        return Ok(None);
    };
    let mut action = DiscreteAction::new(lagrangian);
    let path = &stationary.path;
    let directions = directions(path);
    let families = directions.iter();
    let families = families.map(|eta| action.changes(path, eta, &*SIZES));
    let families: Vec<Vec<f64>> = families.collect();
    let slope = directions.iter().zip(&families).map(|(eta, far)| {
        // Small enough for the cubic part, large enough for rounding.
        let near = action.changes(path, eta, &[-1e-4, 1e-4]);
        let slope = (near[1] - near[0]) / 2e-4;
        let largest = far.iter().fold(f64::MIN_POSITIVE, |l, x| l.max(x.abs()));
        slope.abs() * LARGEST / largest
    });
    let slope = slope.fold(0.0, f64::max);
    let eigenvalues = eigenvalues(lagrangian, path)?;
    Ok(Some(Measured {
        families,
        slope,
        eigenvalues,
        stationary,
    }))
}

/// The variations that all are compared along, each `[N + 1, n]`.
pub(crate) fn directions(path: &Path) -> Vec<Vec<f64>> {
    let pairs = (0..path.dof).flat_map(|i| [(i, 1), (i, 2)]);
    pairs.map(|(i, k)| path.sine(i, k)).collect()
}

/// λ of the first parts of a path, from an eighth of it on.
fn eigenvalues(lagrangian: &dyn Lagrangian, path: &Path) -> Result<Vec<(f64, f64)>> {
    const PARTS: usize = 24;
    let last = path.segments();
    let mut all = Vec::new();
    for part in PARTS / 8..=PARTS {
        let segments = last * part / PARTS;
        let short = Path {
            dof: path.dof,
            duration: segments as f64 * path.step(),
            q: path.q[..(segments + 1) * path.dof].to_vec(),
        };
        let mut action = DiscreteAction::new(lagrangian);
        let second = action.second_variation(&short);
        all.push((short.duration, second.least_eigenvalue));
    }
    Ok(all)
}

/// A learned Lagrangian beside the true one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Comparison {
    /// α, from the mass matrices along the path.
    pub(crate) scale: f64,
    /// Largest distance of the stationary paths, in the units of the coordinates.
    pub(crate) path_distance: f64,
    /// Root mean square of the differences of S, of all families, over that of the true ones; the model's over α.
    pub(crate) action_error: f64,
}

/// Compares two that were measured from the same first path.
pub(crate) fn compare(truth: &Measured, learned: &Measured, scale: f64) -> Comparison {
    let [q, other] = [truth, learned].map(|measured| &measured.stationary.path.q);
    let (mut missed, mut all) = (0.0, 0.0);
    for (own, other) in truth.families.iter().zip(&learned.families) {
        for (s, model) in own.iter().zip(other) {
            missed += (model / scale - s).powi(2);
            all += s * s;
        }
    }
    Comparison {
        scale,
        path_distance: q
            .iter()
            .zip(other)
            .fold(0.0, |far: f64, (a, b)| far.max((a - b).abs())),
        action_error: (missed / all).sqrt(),
    }
}

/// α of the mass matrices at the middles of a path, by least squares on M′ = α M.
pub(crate) fn mass_scale(truth: &dyn Lagrangian, learned: &dyn Lagrangian, path: &Path) -> f64 {
    let n = path.dof;
    let nodes = || path.q.iter().zip(&path.q[n..]);
    let middle: Vec<f64> = nodes().map(|(a, b)| 0.5 * (a + b)).collect();
    let speed: Vec<f64> = nodes().map(|(a, b)| (b - a) / path.step()).collect();
    let masses = |lagrangian: &dyn Lagrangian| {
        let mut jet = Jet::default();
        lagrangian.jets().jet(&middle, &speed, &mut jet);
        jet.mass_matrix
    };
    let (own, other) = (masses(truth), masses(learned));
    dot(&own, &other) / dot(&own, &own)
}

/// α and the part of the variance that is missed, of `model`'s energies as α H + c at random states of the system.
pub(crate) fn energy_scale(system: &dyn AnalyticModel, model: &dyn Model) -> Result<(f64, f64)> {
    const STATES: usize = 1000;
    let mut rng = ChaCha8Rng::seed_from_u64(99);
    let states: Vec<_> = (0..STATES).map(|_| system.sample_state(&mut rng)).collect();
    let q: Vec<f64> = states.iter().flat_map(|s| s.q.clone()).collect();
    let qd: Vec<f64> = states.iter().flat_map(|s| s.qd.clone()).collect();
    let energy = |model: &dyn Model| {
        let mut energy = vec![0.0; STATES];
        let outcome = model.evaluator().energy(&q, &qd, &mut energy);
        outcome.is_supported().then_some(energy)
    };
    let (Some(truth), Some(learned)) = (energy(system), energy(model)) else {
        return Err(Error::argument(
            "model",
            "one without energy",
            "a Lagrangian",
        ));
    };
    let mean = |x: &[f64]| x.iter().sum::<f64>() / STATES as f64;
    let (h, k) = (mean(&truth), mean(&learned));
    let pairs = || truth.iter().zip(&learned);
    let both: f64 = pairs().map(|(a, b)| (a - h) * (b - k)).sum();
    let own: f64 = truth.iter().map(|a| (a - h).powi(2)).sum();
    let scale = both / own;
    let missed: f64 = pairs()
        .map(|(a, b)| (b - k - scale * (a - h)).powi(2))
        .sum();
    Ok((scale, missed / (scale * scale * own)))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;
    use lagrangian_analysis::action::PathKind;

    #[test]
    fn every_case_has_a_minimum_before_and_a_saddle_behind_its_conjugate_point() {
        for case in CASES {
            let system = case.system().unwrap();
            let measured = |seconds| {
                let first = case.motion(seconds).unwrap();
                measure(system.lagrangian(), &first).unwrap().unwrap()
            };
            let (short, long) = (measured(case.short), measured(case.long));
            assert_eq!(short.stationary.kind, PathKind::Minimum, "{}", case.system);
            assert_eq!(long.stationary.kind, PathKind::Saddle, "{}", case.system);
            assert!(short.slope < 1e-5 && long.slope < 1e-5, "{}", case.system);
            assert!(short.families.iter().all(|f| f.iter().all(|s| *s >= 0.0)));
            let crossing = long
                .eigenvalues
                .windows(2)
                .find(|w| w[0].1 > 0.0 && w[1].1 <= 0.0);
            let at = long.stationary.second_variation.conjugate_times[0];
            let crossing = crossing.unwrap();
            assert!(
                (crossing[0].0..=crossing[1].0).contains(&at),
                "{}",
                case.system
            );
            let path = &long.stationary.path;
            let scale = mass_scale(system.lagrangian(), system.lagrangian(), path);
            let same = compare(&long, &long, scale);
            assert!(same.path_distance < 1e-15 && same.action_error < 1e-12);
            let (scale, missed) = energy_scale(&*system, &*system).unwrap();
            assert!((scale - 1.0).abs() < 1e-12 && missed < 1e-12);
        }
    }
}
