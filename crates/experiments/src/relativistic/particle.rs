//! The relativistic particle in a field that is drawn anew for each sample (Cranmer et al. 2020, arXiv 2003.04630, and
//! their public notebook): states, the weighted error, and the momentum of a learned Lagrangian.

use num_dual::DualNum;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use lagrangian::analytic::{
    Analytic, AnalyticModel, RelativisticParticle, RelativisticParticlePublished, System, uniform,
};
use lagrangian::mechanics::{Jet, Lagrangian};
use lagrangian::trajectory::{Coordinate, Samples, Topology};
use lagrangian::{Coordinates, Model, Signals, State};

use crate::data::{accelerations, column, without_parameters};

/// Which particle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Particle {
    /// That of the literature on learned Lagrangians, L = γ − 1 + g q.
    Published,
    /// The physical one, L = −1/γ + g q.
    Physical,
}

impl Particle {
    /// Both.
    pub(crate) const ALL: [Self; 2] = [Self::Published, Self::Physical];

    /// Its name in files.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Published => "published",
            Self::Physical => "physical",
        }
    }

    /// The particle with the field as its second coordinate, a parameter.
    pub(crate) fn system(self) -> Box<dyn AnalyticModel> {
        match self {
            Self::Published => Box::new(Analytic::<InField<0>>::standard()),
            Self::Physical => Box::new(Analytic::<InField<1>>::standard()),
        }
    }

    /// Mass ∂p/∂q̇ at speed v, `M(v)`, in rest masses.
    pub(crate) fn mass(self, v: f64) -> f64 {
        let square = (1.0 - v) * (1.0 + v);
        match self {
            Self::Published => (1.0 + 2.0 * v * v) * square.powf(-2.5),
            Self::Physical => square.powf(-1.5),
        }
    }
}

/// The particle with coordinates q and g: the published one, or (1) the physical one.
#[derive(Debug, Clone)]
struct InField<const PHYSICAL: u8>;

impl<const PHYSICAL: u8> System for InField<PHYSICAL> {
    without_parameters!(
        "relativistic-particle-in-any-field",
        "a relativistic particle, the field a parameter"
    );

    fn coordinates(&self) -> Coordinates {
        Coordinates(vec![
            Coordinate::new("q1", "ls", Topology::Line),
            Coordinate::new("g", "1/s", Topology::Parameter),
        ])
    }

    fn lagrangian<D: DualNum<Primitive = f64> + Copy>(&self, q: &[D], qd: &[D]) -> D {
        let free = match PHYSICAL {
            0 => RelativisticParticlePublished { field: 0.0 }.lagrangian(&q[..1], &qd[..1]),
            _ => RelativisticParticle { field: 0.0 }.lagrangian(&q[..1], &qd[..1]),
        };
        free + q[0] * q[1]
    }

    fn sample_state(&self, rng: &mut dyn Rng) -> State {
        let mut state = RelativisticParticle { field: 0.0 }.sample_state(rng);
        let [u, v] = [uniform(rng, 1, 0.0, 1.0)[0], uniform(rng, 1, 0.0, 1.0)[0]];
        // Box and Muller 1958.
        let normal = (-2.0 * (1.0 - u).ln()).sqrt() * (std::f64::consts::TAU * v).cos();
        state.q.push(10.0 * normal);
        state.qd.push(0.0);
        state
    }
}

/// `count` samples as published: q ~ U[−10, 10], q̇ = 0.99999 tanh(2 N(0, 1)), g ~ 10 N(0, 1), with q̈, p and ṗ of the
/// particle.
pub(crate) fn samples(particle: Particle, count: usize, seed: u64) -> Samples {
    let system = particle.system();
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let (mut q, mut qd) = (Vec::new(), Vec::new());
    for _ in 0..count {
        let state = system.sample_state(&mut rng);
        q.extend(state.q);
        qd.extend(state.qd);
    }
    let tau = vec![0.0; q.len()];
    let mut jet = Jet::default();
    system.lagrangian().jets().jet(&q, &qd, &mut jet);
    (0..count).for_each(|row| jet.hold(system.lagrangian().coordinates(), row));
    let signals = Signals {
        qdd: accelerations(&*system, &q, &qd, &tau),
        q,
        qd,
        tau,
        p: jet.momentum,
        pd: jet.dl_dq,
        ..Signals::default()
    };
    Samples::new(2, signals)
}

/// Σ w |q̈ predicted − q̈| / Σ w with w = 1 + 1/√(1 − q̇²), 1/s: the error of the published notebook, where 0.41 is that
/// of predicting no acceleration of the published particle. Infinite where a prediction is not finite.
pub(crate) fn weighted_error(model: &dyn Model, samples: &Samples) -> f64 {
    let found = accelerations(model, &samples.q, &samples.qd, &samples.tau);
    weighted(samples, |k| (found[k] - samples.qdd[k]).abs())
}

/// The same of a model that moves in (q, p): Σ w (|q̇ found − q̇| + |q̈ found − q̈|) / Σ w, as published, with
/// q̈ = ṗ / M(q̇) by the true mass.
pub(crate) fn weighted_flow_error(model: &dyn Model, particle: Particle, samples: &Samples) -> f64 {
    let (mut rate, mut push) = (vec![0.0; samples.q.len()], vec![0.0; samples.q.len()]);
    let (q, p, tau) = (&samples.q, &samples.p, &samples.tau);
    if let Some(phase) = model.evaluator().phase_flow() {
        let _ = phase.flow(q, p, tau, &mut rate, &mut push);
    }
    weighted(samples, |k| {
        let (v, qdd) = (samples.qd[k], samples.qdd[k]);
        (rate[k] - v).abs() + (push[k] / particle.mass(v) - qdd).abs()
    })
}

/// The mean of the errors of the particle by the weights w; infinite where one is not finite.
fn weighted(samples: &Samples, error: impl Fn(usize) -> f64) -> f64 {
    let (mut sum, mut weights) = (0.0, 0.0);
    for k in (0..samples.q.len()).step_by(2) {
        let v = samples.qd[k];
        let weight = 1.0 + 1.0 / ((1.0 - v) * (1.0 + v)).sqrt();
        sum += weight * error(k);
        weights += weight;
    }
    match sum.is_finite() {
        true => sum / weights,
        false => f64::INFINITY,
    }
}

/// What a model has at speeds −c < v < c, at q = 0 in one field.
pub(crate) struct Sweep {
    /// q̇.
    pub(crate) speed: Vec<f64>,
    /// q̈.
    pub(crate) acceleration: Vec<f64>,
    /// p, empty where there is no Lagrangian.
    pub(crate) momentum: Vec<f64>,
    /// M, likewise.
    pub(crate) mass: Vec<f64>,
}

/// Sweeps speeds that are equally far apart in artanh v, up to `fastest`, in the field `g`.
pub(crate) fn sweep(
    model: &dyn Model,
    lagrangian: Option<&dyn Lagrangian>,
    (fastest, g): (f64, f64),
) -> Sweep {
    const HALF: i32 = 200;
    let most = fastest.atanh();
    let speed: Vec<f64> = (-HALF..=HALF)
        .map(|k| (most * f64::from(k) / f64::from(HALF)).tanh())
        .collect();
    let pair = |first: &dyn Fn(f64) -> f64, second: f64| -> Vec<f64> {
        speed.iter().flat_map(|v| [first(*v), second]).collect()
    };
    let (q, qd) = (pair(&|_| 0.0, g), pair(&|v| v, 0.0));
    let qdd = accelerations(model, &q, &qd, &vec![0.0; q.len()]);
    let mut jet = Jet::default();
    if let Some(lagrangian) = lagrangian {
        lagrangian.jets().jet(&q, &qd, &mut jet);
    }
    Sweep {
        acceleration: column(&qdd, 2, 0),
        momentum: column(&jet.momentum, 2, 0),
        mass: column(&jet.mass_matrix, 4, 0),
        speed,
    }
}

/// R² of the line through (p found, p true), whose slope and offset are the gauge (theory.md, equation 23); the
/// slope as well, by which M and p of the model are multiplied.
pub(crate) fn recovered(found: &[f64], truth: &[f64]) -> (f64, f64) {
    let count = found.len().min(truth.len()).max(1) as f64;
    let mean = |x: &[f64]| x.iter().sum::<f64>() / count;
    let (a, b) = (mean(found), mean(truth));
    let sum = |f: &dyn Fn(f64, f64) -> f64| {
        let pairs = found.iter().zip(truth);
        pairs.map(|(x, y)| f(x - a, y - b)).sum::<f64>()
    };
    let (xx, xy, yy) = (sum(&|x, _| x * x), sum(&|x, y| x * y), sum(&|_, y| y * y));
    (xy * xy / (xx * yy), xy / xx)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;

    #[test]
    fn both_particles_have_their_closed_accelerations_in_the_field_of_the_sample() {
        for particle in Particle::ALL {
            let samples = samples(particle, 500, 1);
            for (k, qdd) in samples.qdd.chunks(2).enumerate() {
                let (g, v) = (samples.q[2 * k + 1], samples.qd[2 * k]);
                let truth = g / particle.mass(v);
                assert!(
                    (qdd[0] - truth).abs() <= 1e-9 * truth.abs(),
                    "{} is not {truth}",
                    qdd[0]
                );
                assert!(qdd[1].abs() < f64::MIN_POSITIVE);
                assert!((samples.pd[2 * k] - g).abs() <= 1e-12 * g.abs());
            }
        }
    }

    #[test]
    fn predicting_no_acceleration_of_the_published_particle_has_the_error_of_the_plateau() {
        let samples = samples(Particle::Published, 200_000, 2);
        let mut nothing = samples.clone();
        nothing.qdd.fill(0.0);
        let error = weighted_error(&*Particle::Published.system(), &nothing);
        // 0.41 is where the published networks begin.
        assert!((0.40..0.43).contains(&error), "{error}");
    }

    #[test]
    fn a_momentum_is_recovered_whatever_its_gauge() {
        let truth = [-2.0, 0.5, 1.0, 4.0];
        let found = truth.map(|p| 3.0 - 2.0 * p);
        let (r2, slope) = recovered(&found, &truth);
        assert!((r2 - 1.0).abs() < 1e-14 && (slope + 0.5).abs() < 1e-14);
    }
}
