//! Particles in magnetic fields: random states under known forces, the field of a learned Lagrangian, and long orbits.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use lagrangian::analytic::{AnalyticModel, by_name, uniform};
use lagrangian::mechanics::{Curvature, Jet, Lagrangian, Outcome};
use lagrangian::rollout::{free, times};
use lagrangian::trajectory::Samples;
use lagrangian::{Model, Result, RolloutOptions, Signals, State, rollout};

use crate::data::{accelerations, energies, relative_error};

/// The field that a particle is in; mass, charge and field are 1.
pub(crate) struct Field {
    /// Its name in files.
    pub(crate) name: &'static str,
    /// Its name in titles.
    pub(crate) title: &'static str,
    /// The name of the system.
    system: &'static str,
    /// Where its long orbit begins.
    start: fn() -> State,
}

/// The same field everywhere, in a plane.
static UNIFORM: Field = Field {
    name: "uniform",
    title: "uniform field",
    system: "charged-particle",
    start: || State::new(vec![0.8, 0.0], vec![0.0, -0.8]),
};

/// Two magnetic mirrors; the orbit turns round near z = ± 0.75 a.
pub(crate) static MIRROR: Field = Field {
    name: "mirror",
    title: "mirror field",
    system: "magnetic-mirror",
    start: || State::new(vec![0.4, 0.0, 0.0], vec![0.0, -0.4, 0.3]),
};

pub(crate) static FIELDS: [&Field; 2] = [&UNIFORM, &MIRROR];

impl Field {
    /// The particle in it.
    pub(crate) fn system(&self) -> Result<Box<dyn AnalyticModel>> {
        by_name(self.system, &[])
    }
}

/// Time of one circle where e B/m = 1, s.
pub(crate) const CIRCLE: f64 = std::f64::consts::TAU;

/// Steps of an orbit; a true one of 100 circles takes a tenth of them.
const MOST_STEPS: u64 = 50_000;

/// `count` random states with random forces of the size of the magnetic ones, and the accelerations that these make:
/// known forces fix the scale of the Lagrangian, (23).
pub(crate) fn samples(system: &dyn AnalyticModel, count: usize, seed: u64) -> Samples {
    let n = system.coordinates().dof();
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let (mut q, mut qd, mut tau) = (Vec::new(), Vec::new(), Vec::new());
    for _ in 0..count {
        let state = system.sample_state(&mut rng);
        q.extend(state.q);
        qd.extend(state.qd);
        tau.extend(uniform(&mut rng, n, -1.0, 1.0));
    }
    let signals = Signals {
        qdd: accelerations(system, &q, &qd, &tau),
        q,
        qd,
        tau,
        ..Signals::default()
    };
    Samples::new(n, signals)
}

/// e B of a Lagrangian at each state: ∂pⱼ/∂qᵢ − ∂pᵢ/∂qⱼ for i < j, row by row, which no gauge changes
/// (theory.md, equation 110).
pub(crate) fn field(lagrangian: &dyn Lagrangian, states: &[State]) -> Vec<f64> {
    let mut jets = lagrangian.jets();
    let (mut curvature, mut field) = (Curvature::default(), Vec::new());
    for state in states {
        let n = state.q.len();
        jets.curvature(&state.q, &state.qd, &mut curvature);
        let slope = |i: usize, j: usize| curvature.dp_dq[i * n + j];
        for i in 0..n {
            field.extend((i + 1..n).map(|j| slope(j, i) - slope(i, j)));
        }
    }
    field
}

/// ‖e B found − e B true‖ / ‖e B true‖ over random states.
pub(crate) fn field_error(found: &dyn Lagrangian, system: &dyn AnalyticModel, seed: u64) -> f64 {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let states: Vec<State> = (0..500).map(|_| system.sample_state(&mut rng)).collect();
    let truth = field(system.lagrangian(), &states);
    let found = field(found, &states);
    relative_error(found.iter().zip(&truth))
}

/// Root of the mean squared error of q̈ over that of q̈ itself, on states that are not in the data.
pub(crate) fn acceleration_error(model: &dyn Model, system: &dyn AnalyticModel, seed: u64) -> f64 {
    let samples = samples(system, 5000, seed);
    let found = accelerations(model, &samples.q, &samples.qd, &samples.tau);
    relative_error(found.iter().zip(&samples.qdd))
}

/// A free orbit.
pub(crate) struct Orbit {
    /// Time, s.
    pub(crate) t: Vec<f64>,
    /// Positions, `[len, n]`.
    pub(crate) q: Vec<f64>,
    /// True energy ½ m |v|² over that at the start, less 1.
    pub(crate) energy: Vec<f64>,
    /// True magnetic moment m v⊥²/(2 B) over that at the start, less 1; that across z where all space is two-dimensional.
    pub(crate) moment: Vec<f64>,
    /// How it ended.
    pub(crate) outcome: Outcome,
}

impl Orbit {
    /// The largest error of the energy.
    pub(crate) fn drift(&self) -> f64 {
        if !self.outcome.is_finished() {
            return f64::INFINITY;
        }
        self.energy.iter().fold(0.0, |most, e| most.max(e.abs()))
    }

    /// Distance of the two positions at each time, m, as far as both go.
    pub(crate) fn distance(&self, other: &Self) -> Vec<f64> {
        let n = self.q.len() / self.t.len().max(1);
        let rows = self.q.chunks_exact(n).zip(other.q.chunks_exact(n));
        let square = |(a, b): (&f64, &f64)| (a - b).powi(2);
        rows.map(|(a, b)| a.iter().zip(b).map(square).sum::<f64>().sqrt())
            .collect()
    }
}

/// The free orbit of `model` over so many circles, 20 samples each.
pub(crate) fn orbit(model: &dyn Model, which: &Field, circles: f64) -> Result<Orbit> {
    let system = which.system()?;
    let start = (which.start)();
    let times = times(circles * CIRCLE, CIRCLE / 20.0)?;
    let options = RolloutOptions {
        max_steps: MOST_STEPS,
        ..RolloutOptions::default()
    };
    let motion = rollout(model, &start.q, &start.qd, &times, &free, &options)?;
    let trajectory = motion.trajectory;
    let moment = (0..trajectory.len()).map(|k| {
        let Signals { q, qd, .. } = trajectory.row(k);
        moment(system.lagrangian(), &State::new(q.to_vec(), qd.to_vec()))
    });
    let moment = relative(moment.collect());
    Ok(Orbit {
        energy: relative(energies(&*system, &trajectory).unwrap_or_default()),
        moment,
        t: trajectory.t,
        q: trajectory.signals.q,
        outcome: motion.outcome,
    })
}

/// x over its first, less 1.
fn relative(x: Vec<f64>) -> Vec<f64> {
    let first = x.first().copied().unwrap_or(1.0);
    x.iter().map(|x| x / first - 1.0).collect()
}

/// The magnetic moment m v⊥²/(2 B) of a charge of 1, with B and m from its Lagrangian.
fn moment(lagrangian: &dyn Lagrangian, state: &State) -> f64 {
    let b = field(lagrangian, std::slice::from_ref(state));
    let mut jet = Jet::default();
    lagrangian.jets().jet(&state.q, &state.qd, &mut jet);
    let v = &state.qd;
    let square = |x: &[f64]| x.iter().map(|x| x * x).sum::<f64>();
    let (strength, mass) = (square(&b).sqrt(), jet.mass_matrix[0]);
    let across = match (&b[..], &v[..]) {
        // B = (b₂₃, −b₁₃, b₁₂).
        (&[b12, b13, b23], &[x, y, z]) => {
            square(v) - ((x * b23 - y * b13 + z * b12) / strength).powi(2)
        }
        _ => square(v),
    };
    0.5 * mass * across / strength
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;
    use crate::data::column;
    use lagrangian::analytic::{MagneticMirror, System};

    #[test]
    fn the_antisymmetric_part_of_the_momenta_is_the_field() {
        let mirror = MagneticMirror::new(&[1.0, 1.0, 1.0, 3.0]);
        let system = MIRROR.system().unwrap();
        let state = State::new(vec![0.3, -0.5, 1.2], vec![0.2, 0.7, -0.4]);
        let found = field(system.lagrangian(), std::slice::from_ref(&state));
        let [x, y, z] = mirror.field(&state.q);
        for (found, truth) in found.iter().zip([z, -y, x]) {
            assert!((found - truth).abs() < 1e-10, "{found} is not {truth}");
        }
        assert!(field_error(system.lagrangian(), &*system, 1) < 1e-12);
    }

    #[test]
    fn a_slow_particle_bounces_between_the_mirrors_and_keeps_energy_and_magnetic_moment() {
        let system = MIRROR.system().unwrap();
        let orbit = orbit(&*system, &MIRROR, 30.0).unwrap();
        assert!(orbit.drift() < 1e-8, "{}", orbit.drift());
        let z = column(&orbit.q, 3, 2);
        let (low, high) = z
            .iter()
            .fold((0.0_f64, 0.0_f64), |(l, h), z| (l.min(*z), h.max(*z)));
        // B = B₀ |v|²/v⊥² at z = ± (0.3/0.4) 3 m.
        assert!(
            (high - 2.25).abs() < 0.15 && (low + 2.25).abs() < 0.15,
            "{low} {high}"
        );
        assert!(orbit.moment.iter().all(|m| m.abs() < 0.2));
    }

    #[test]
    fn a_deep_lagrangian_network_without_a_vector_potential_is_known_to_fail() {
        use crate::data::beyond_delan;
        use crate::relativistic::Particle;
        for which in FIELDS {
            let system = which.system().unwrap();
            let states = [(which.start)()];
            assert_eq!(beyond_delan(system.lagrangian(), &states, false).len(), 1);
            assert!(beyond_delan(system.lagrangian(), &states, true).is_empty());
        }
        let fast = [State::new(vec![1.0, 5.0], vec![0.9, 0.0])];
        for particle in Particle::ALL {
            let reasons = beyond_delan(particle.system().lagrangian(), &fast, true);
            assert!(
                reasons.len() == 1 && reasons[0].contains("mass matrix"),
                "{reasons:?}"
            );
        }
    }
}
