//! The systems and their recordings.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::laws::{active_particle, curl_force, van_der_pol};
use crate::data::column_sizes;
use crate::plausibility::premises::Premise;
use lagrangian::analytic::{
    Analytic, DoublePendulum, Pendulum, System as DataFacts, by_name, normal,
};
use lagrangian::mechanics::{Dissipation, Mechanical};
use lagrangian::rollout::{free, times};
use lagrangian::{Coordinates, Model, Result, RolloutOptions, Trajectory, rollout};
use lagrangian_analysis::existence::Existence;

/// A system whose Lagrangian exists, needs friction beside it, or does not exist.
pub(super) struct System {
    /// Its name in tables and files.
    pub(super) name: &'static str,
    /// What is known of it.
    pub(super) truth: Existence,
    starts: Starts,
    model: fn() -> Result<Box<dyn Model>>,
}

/// Length of a recording, s, and bounds of q and q̇ at its start.
struct Starts {
    seconds: f64,
    q: f64,
    qd: f64,
}

/// Samples of a recording.
const SAMPLES: usize = 150;
/// Drag across the blade, N·s/m.
const ACROSS: f64 = 3.0;

/// Names with what is known, starts, and the model.
macro_rules! systems {
    ($($name:literal, $truth:ident, [$seconds:literal, $q:literal, $qd:literal], $model:expr;)*) => {
        [$(System {
            name: $name,
            truth: Existence::$truth,
            starts: Starts { seconds: $seconds, q: $q, qd: $qd },
            model: || $model,
        }),*]
    };
}

/// All of them: with a Lagrangian (of the charged particle the force depends on velocity, of the relativistic one L is not
/// quadratic in q̇), with friction, and without: the oscillator of van der Pol (locally it has a Lagrangian, on its cycle
/// none), a particle that drives itself, a force of positions that is no gradient, and a driven body on a blade that
/// resists sideways motion.
pub(super) static SYSTEMS: [System; 11] = systems! {
    "pendulum", Lagrangian, [6.0, 2.5, 2.0], known("pendulum", &[]);
    "double-pendulum", Lagrangian, [5.0, 1.5, 1.5], known("double-pendulum", &[]);
    "charged-particle", Lagrangian, [10.0, 1.5, 1.5], known("charged-particle", &[]);
    "relativistic-particle", Lagrangian, [1.0, 1.0, 0.6], known("relativistic-particle", &[("field", 1.0)]);
    "furuta-pendulum", Lagrangian, [4.0, 2.0, 3.0], known("furuta-pendulum", &[]);
    "damped-double-pendulum", WithFriction, [5.0, 1.5, 1.5],
        damped::<DoublePendulum>(Dissipation::viscous(vec![0.15; 2]));
    "coulomb-pendulum", WithFriction, [6.0, 2.5, 2.0], damped::<Pendulum>(Dissipation {
        coulomb: vec![0.3],
        smoothing: vec![0.1],
        ..Dissipation::viscous(vec![0.0])
    });
    "van-der-pol", NoneFound, [15.0, 2.5, 3.0], Ok(Box::new(van_der_pol()));
    "active-particle", NoneFound, [12.0, 1.5, 1.5], Ok(Box::new(active_particle()));
    "curl-force", NoneFound, [6.0, 0.8, 0.8], Ok(Box::new(curl_force()));
    "blade", NoneFound, [10.0, 1.5, 1.5], Ok(Premise::Rolling.unbroken());
};

/// Systems of a quick run.
const QUICK: [&str; 4] = [
    "pendulum",
    "charged-particle",
    "coulomb-pendulum",
    "van-der-pol",
];
/// The system whose recordings are driven.
const BLADE: &str = "blade";

fn known(name: &str, parameters: &[(&str, f64)]) -> Result<Box<dyn Model>> {
    Ok(by_name(name, parameters)?)
}

impl System {
    /// Whether it belongs to a quick run.
    pub(super) fn is_quick(&self) -> bool {
        QUICK.contains(&self.name)
    }

    /// Its coordinates.
    pub(super) fn coordinates(&self) -> Result<Coordinates> {
        Ok((self.model)()?.coordinates().clone())
    }

    /// `count` recordings from random starts, exact to some ten digits.
    pub(super) fn recordings(&self, count: usize, seed: u64) -> Result<Vec<Trajectory>> {
        if self.name == BLADE {
            return Premise::Rolling.recordings(ACROSS, count, seed);
        }
        let (model, starts) = ((self.model)()?, &self.starts);
        let n = model.coordinates().dof();
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut uniform =
            |bound: f64| -> Vec<f64> { (0..n).map(|_| rng.random_range(-bound..bound)).collect() };
        let times = times(starts.seconds, starts.seconds / (SAMPLES - 1) as f64)?;
        let one = |k| {
            let (q, qd) = (uniform(starts.q), uniform(starts.qd));
            let found = rollout(&*model, &q, &qd, &times, &free, &RolloutOptions::default())?;
            let mut recording = found.trajectory;
            recording.name = format!("recording {k}");
            Ok(recording)
        };
        (0..count).map(one).collect()
    }
}

/// A system of the table with its usual parameters, and friction.
fn damped<S: DataFacts>(dissipation: Dissipation) -> Result<Box<dyn Model>> {
    let usual: Vec<f64> = S::PARAMETERS.iter().map(|p| p.value).collect();
    let system = Mechanical::dissipative(Analytic::new(S::new(&usual)), dissipation)?;
    Ok(Box::new(system))
}

/// The recordings with white noise on the accelerations, `part` of the root mean square of each.
pub(super) fn noisy(mut recordings: Vec<Trajectory>, part: f64, seed: u64) -> Vec<Trajectory> {
    let n = recordings.first().map_or(1, Trajectory::dof).max(1);
    let sizes = column_sizes(n, recordings.iter().map(|r| &r.qdd[..]));
    let deviation: Vec<f64> = sizes.iter().map(|size| part * size).collect();
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    for qdd in recordings.iter_mut().map(|r| &mut r.qdd) {
        for (at, x) in qdd.iter_mut().enumerate() {
            *x += deviation[at % n] * normal(&mut rng);
        }
    }
    recordings
}
