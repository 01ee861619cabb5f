//! The systems and their recordings.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::plausibility::premises::Premise;
use lagrangian::dynamics::{Mechanical, Model};
use lagrangian::lagrangian::Dissipation;
use lagrangian::lagrangian::analytic::{
    Analytic, DoublePendulum, Pendulum, System as Known, by_name, normal,
};
use lagrangian::rollout::{RolloutOptions, free, rollout, times};
use lagrangian::{Coordinates, Result, Trajectory};
use lagrangian_analysis::existence::Existence;
use lagrangian_analysis::existence::{active_particle, curl_force, van_der_pol};

/// A system whose Lagrangian exists, needs friction beside it, or does not exist.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum System {
    /// A pendulum.
    Pendulum,
    /// A double pendulum.
    DoublePendulum,
    /// A charged particle in a uniform magnetic field: a force that depends on velocity and has a Lagrangian.
    ChargedParticle,
    /// A relativistic particle in a uniform field: not quadratic in q̇.
    RelativisticParticle,
    /// A Furuta pendulum, free.
    FurutaPendulum,
    /// A double pendulum with viscous friction of both angles.
    DampedDoublePendulum,
    /// A pendulum with dry friction.
    CoulombPendulum,
    /// The oscillator of van der Pol: locally it has a Lagrangian, on its cycle none.
    VanDerPol,
    /// A particle that drives itself.
    ActiveParticle,
    /// A particle in a force of positions that is no gradient.
    CurlForce,
    /// A body on a blade that resists sideways motion, driven.
    Blade,
}

/// Samples of a recording.
const SAMPLES: usize = 150;
/// Drag across the blade, N·s/m.
const ACROSS: f64 = 3.0;

impl System {
    /// All of them.
    pub(crate) const ALL: [Self; 11] = [
        Self::Pendulum,
        Self::DoublePendulum,
        Self::ChargedParticle,
        Self::RelativisticParticle,
        Self::FurutaPendulum,
        Self::DampedDoublePendulum,
        Self::CoulombPendulum,
        Self::VanDerPol,
        Self::ActiveParticle,
        Self::CurlForce,
        Self::Blade,
    ];

    /// Its name in tables and files.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Pendulum => "pendulum",
            Self::DoublePendulum => "double-pendulum",
            Self::ChargedParticle => "charged-particle",
            Self::RelativisticParticle => "relativistic-particle",
            Self::FurutaPendulum => "furuta-pendulum",
            Self::DampedDoublePendulum => "damped-double-pendulum",
            Self::CoulombPendulum => "coulomb-pendulum",
            Self::VanDerPol => "van-der-pol",
            Self::ActiveParticle => "active-particle",
            Self::CurlForce => "curl-force",
            Self::Blade => "blade",
        }
    }

    /// What is known of it.
    pub(crate) fn truth(self) -> Existence {
        match self {
            Self::DampedDoublePendulum | Self::CoulombPendulum => Existence::WithFriction,
            Self::VanDerPol | Self::ActiveParticle | Self::CurlForce | Self::Blade => {
                Existence::NoneFound
            }
            _ => Existence::Lagrangian,
        }
    }

    /// Its coordinates.
    pub(crate) fn coordinates(self) -> Result<Coordinates> {
        Ok(match self {
            Self::Blade => Premise::Rolling.coordinates(),
            _ => self.model()?.coordinates().clone(),
        })
    }

    /// `count` recordings from random starts, exact to some ten digits.
    pub(crate) fn recordings(self, count: usize, seed: u64) -> Result<Vec<Trajectory>> {
        if self == Self::Blade {
            return Premise::Rolling.recordings(ACROSS, count, seed);
        }
        let (model, (duration, q, qd)) = (self.model()?, self.starts());
        let n = model.coordinates().dof();
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut uniform =
            |bound: f64| -> Vec<f64> { (0..n).map(|_| rng.random_range(-bound..bound)).collect() };
        let times = times(duration, duration / (SAMPLES - 1) as f64)?;
        let one = |k| {
            let (q, qd) = (uniform(q), uniform(qd));
            let found = rollout(&*model, &q, &qd, &times, &free, &RolloutOptions::default())?;
            let mut recording = found.trajectory;
            recording.name = format!("recording {k}");
            Ok(recording)
        };
        (0..count).map(one).collect()
    }

    /// Length of a recording, s, and bounds of q and q̇ at its start.
    fn starts(self) -> (f64, f64, f64) {
        match self {
            Self::RelativisticParticle => (1.0, 1.0, 0.6),
            Self::DoublePendulum | Self::DampedDoublePendulum => (5.0, 1.5, 1.5),
            Self::Pendulum | Self::CoulombPendulum => (6.0, 2.5, 2.0),
            Self::FurutaPendulum => (4.0, 2.0, 3.0),
            Self::VanDerPol => (15.0, 2.5, 3.0),
            Self::ActiveParticle => (12.0, 1.5, 1.5),
            Self::CurlForce => (6.0, 0.8, 0.8),
            Self::ChargedParticle | Self::Blade => (10.0, 1.5, 1.5),
        }
    }

    fn model(self) -> Result<Box<dyn Model>> {
        match self {
            Self::RelativisticParticle => Ok(by_name(self.name(), &[("field", 1.0)])?),
            Self::DampedDoublePendulum => {
                damped::<DoublePendulum>(Dissipation::viscous(vec![0.15; 2]))
            }
            Self::CoulombPendulum => damped::<Pendulum>(Dissipation {
                coulomb: vec![0.3],
                smoothing: vec![0.1],
                ..Dissipation::viscous(vec![0.0])
            }),
            Self::VanDerPol => Ok(Box::new(van_der_pol())),
            Self::ActiveParticle => Ok(Box::new(active_particle())),
            Self::CurlForce => Ok(Box::new(curl_force())),
            Self::Blade => Ok(Premise::Rolling.unbroken()),
            _ => Ok(by_name(self.name(), &[])?),
        }
    }
}

/// A system of the table with its usual parameters, and friction.
fn damped<S: Known>(dissipation: Dissipation) -> Result<Box<dyn Model>> {
    let usual: Vec<f64> = S::PARAMETERS.iter().map(|p| p.value).collect();
    let system = Mechanical::dissipative(Analytic::new(S::new(&usual)), dissipation)?;
    Ok(Box::new(system))
}

/// The recordings with white noise on the accelerations, `part` of the root mean square of each.
pub(crate) fn noisy(mut recordings: Vec<Trajectory>, part: f64, seed: u64) -> Vec<Trajectory> {
    let n = recordings.first().map_or(1, Trajectory::dof).max(1);
    let (mut squares, mut count) = (vec![0.0; n], 0.0);
    for qdd in recordings.iter().map(|r| &r.qdd) {
        count += (qdd.len() / n) as f64;
        qdd.iter()
            .enumerate()
            .for_each(|(at, x)| squares[at % n] += x * x);
    }
    let deviation: Vec<f64> = squares
        .iter()
        .map(|s| part * (s / f64::max(count, 1.0)).sqrt())
        .collect();
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    for qdd in recordings.iter_mut().map(|r| &mut r.qdd) {
        for (at, x) in qdd.iter_mut().enumerate() {
            *x += deviation[at % n] * normal(&mut rng);
        }
    }
    recordings
}
