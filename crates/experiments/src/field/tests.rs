//! Fields on rings: one density, summed; the same law on any number of points.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::f64::consts::TAU;

use super::density::{Output, Shape, Weighted};
use super::{
    Chain, DensityConfig, DensityNet, Field, FieldFitConfig, FieldScaling, Pulse, RingStates,
    Symmetry, centre_of_pulse, dispersion, fit, kink, kink_position, ring_states, speed_of_motion,
};
use lagrangian::analytic::{Analytic, DualNum, Parameter, Rng, System};
use lagrangian::integrate::Method;
use lagrangian::mechanics::{Lagrangian, Mechanical};
use lagrangian::rollout::{free, times};
use lagrangian::{
    Budget, Coordinates, Dataset, Error, Evaluator, Model, RolloutOptions, State, rollout, split,
};

/// The whole Lagrangian of a rod of sine-Gordon pendulums, written without any density: the dense oracle.
struct WholeRing {
    points: usize,
}

const SPEED: f64 = 1.3;
const RADIUS: f64 = 0.8;

impl System for WholeRing {
    const NAME: &'static str = "whole-ring";
    const ABOUT: &'static str = "a rod";
    const PARAMETERS: &'static [Parameter] = &[];

    fn new(_: &[f64]) -> Self {
        Self { points: 8 }
    }

    fn coordinates(&self) -> Coordinates {
        Coordinates::lines(self.points)
    }

    fn lagrangian<D: DualNum<Primitive = f64> + Copy>(&self, q: &[D], qd: &[D]) -> D {
        let mut l = D::from(0.0);
        for i in 0..self.points {
            let next = (i + 1) % self.points;
            let (stretch, rate) = (q[next] - q[i], qd[next] - qd[i]);
            l += (qd[i] * qd[i] + rate * rate * RADIUS.powi(2)) * 0.5;
            l -= stretch * stretch * (0.5 * SPEED.powi(2));
        }
        l
    }

    fn sample_state(&self, _: &mut dyn Rng) -> State {
        State::new(vec![0.0; self.points], vec![0.0; self.points])
    }
}

fn signal(n: usize, from: f64) -> Vec<f64> {
    (0..n).map(|k| (from + 1.9 * k as f64).sin()).collect()
}

fn largest_difference(a: &[f64], b: &[f64]) -> f64 {
    let pairs = a.iter().zip(b);
    pairs.fold(0.0, |worst, (a, b)| (a - b).abs().max(worst))
}

#[test]
fn the_sum_of_densities_moves_as_the_whole_lagrangian_does_even_where_the_stencil_meets_itself() {
    for points in [3, 4, 5, 6, 9] {
        let whole = Mechanical::conservative(Analytic::new(WholeRing { points }));
        let field = Field::new(Chain::love_rod(SPEED, RADIUS), points).unwrap();
        let (q, qd, tau) = (
            signal(points, 0.3),
            signal(points, 1.1),
            signal(points, 2.0),
        );
        let mut found = [vec![0.0; points], vec![0.0; points]];
        let mut energies = [[0.0]; 2];
        let models: [&dyn Model; 2] = [&whole, &field];
        for (k, model) in models.into_iter().enumerate() {
            let mut evaluator = model.evaluator();
            assert_eq!(
                evaluator
                    .forward_dynamics(&q, &qd, &tau, &mut found[k])
                    .singular(),
                0
            );
            let _ = evaluator.energy(&q, &qd, &mut energies[k]);
        }
        assert!(
            largest_difference(&found[0], &found[1]) < 1e-13,
            "{points} points"
        );
        assert!(largest_difference(&energies[0], &energies[1]) < 1e-13);
    }
}

#[test]
fn small_waves_obey_the_dispersion_relation_of_their_chain() {
    let chains = [
        Chain::wave(1.2),
        // The equation of Klein and Gordon.
        Chain {
            gap: 0.4,
            ..Chain::wave(0.8)
        },
        Chain::love_rod(1.0, 1.5),
        Chain::sine_gordon(1.1, 0.3),
    ];
    for chain in chains {
        let n = 24;
        for mode in 1..=n / 2 {
            let k = TAU * mode as f64 / n as f64;
            let field = Field::new(&chain, n).unwrap();
            let found = dispersion(&field, mode, 1e-4);
            assert!(
                (found / chain.frequency(k).powi(2) - 1.0).abs() < 1e-7,
                "{chain:?} {mode}"
            );
        }
    }
}

#[test]
fn a_standing_wave_of_a_rod_keeps_its_shape_and_its_frequency() {
    let (chain, n, mode) = (Chain::love_rod(1.0, 1.5), 40, 3);
    let field = Field::new(&chain, n).unwrap();
    let k = TAU * mode as f64 / n as f64;
    let shape: Vec<f64> = (0..n).map(|i| (k * i as f64).cos()).collect();
    let t = 50.0;
    let options = RolloutOptions::truth();
    let motion = rollout(&field, &shape, &vec![0.0; n], &[0.0, t], &free, &options).unwrap();
    let expected: Vec<f64> = shape
        .iter()
        .map(|x| x * (chain.frequency(k) * t).cos())
        .collect();
    assert!(largest_difference(&motion.trajectory.q[n..], &expected) < 1e-10);
}

#[test]
fn a_kink_runs_at_its_speed_and_is_shorter_for_it() {
    let (speed, gap, v, n) = (1.0, 0.1, 0.6, 200);
    let field = Field::new(Chain::sine_gordon(speed, gap), n).unwrap();
    let (phi, phid) = kink(n, 100.0, (speed, gap, v));
    let times = times(400.0, 4.0).unwrap();
    let options = RolloutOptions::default();
    let motion = rollout(&field, &phi, &phid, &times, &free, &options)
        .unwrap()
        .trajectory;
    let places: Vec<(f64, f64)> = motion
        .q
        .chunks(n)
        .map(|phi| kink_position(phi).unwrap())
        .collect();
    let positions: Vec<f64> = places.iter().map(|p| p.0).collect();
    // It has gone round the ring more than once; the grid slows it by some tenths of a percent.
    let found = speed_of_motion(&times, &positions, n as f64);
    assert!((found / v - 1.0).abs() < 5e-3, "{found}");
    let slope = 2.0 * gap / speed / (1.0 - v * v).sqrt();
    assert!(places.iter().all(|p| (p.1 / slope - 1.0).abs() < 2e-2));
}

#[test]
fn a_pulse_of_the_wave_equation_travels_at_the_wave_speed() {
    let (n, width) = (400, 30.0);
    let field = Field::new(Chain::wave(0.9), n).unwrap();
    let pulse = Pulse {
        height: 1.0,
        centre: 100.0,
        width,
    };
    let (phi, phid) = pulse.start(n, 0.9);
    let times = times(600.0, 20.0).unwrap();
    let motion = rollout(
        &field,
        &phi,
        &phid,
        &times,
        &free,
        &RolloutOptions::default(),
    )
    .unwrap();
    let places: Vec<f64> = motion.trajectory.q.chunks(n).map(centre_of_pulse).collect();
    let found = speed_of_motion(&times, &places, n as f64);
    // (k h)²/24 slower, for a mean square wave number 1/width² of φ².
    assert!((found / 0.9 - 1.0).abs() < 3e-4, "{found}");
}

fn random(symmetry: Symmetry, seed: u64) -> DensityNet {
    let config = DensityConfig {
        symmetry,
        width: 8,
        ..DensityConfig::default()
    };
    DensityNet::random(config, FieldScaling::identity(), seed).unwrap()
}

#[test]
fn any_density_conserves_its_energy() {
    for symmetry in [Symmetry::None, Symmetry::Shift, Symmetry::Turn] {
        let field = Field::new(random(symmetry, 5), 12).unwrap();
        let half = |x: Vec<f64>| x.iter().map(|x| 0.5 * x).collect::<Vec<f64>>();
        let (phi, phid) = (half(signal(12, 0.2)), half(signal(12, 0.9)));
        // Before two neighbours are half a turn apart.
        let times = times(2.0, 0.5).unwrap();
        let motion = rollout(&field, &phi, &phid, &times, &free, &RolloutOptions::truth()).unwrap();
        assert!(motion.outcome.is_finished() && motion.singular == 0);
        let mut evaluator = field.field_evaluator();
        let mut energies = vec![0.0; times.len()];
        let _ = evaluator.energy(&motion.trajectory.q, &motion.trajectory.qd, &mut energies);
        let drift = energies
            .iter()
            .map(|e| (e - energies[0]).abs())
            .fold(0.0, f64::max);
        assert!(drift < 1e-9, "{symmetry:?} {energies:?}");
    }
}

#[test]
fn a_symmetry_that_is_known_is_exact() {
    let (phi, phid) = (signal(12, 0.2), signal(12, 0.9));
    let accelerations = |symmetry, change: &dyn Fn(usize) -> f64| {
        let field = Field::new(random(symmetry, 6), 12).unwrap();
        let phi: Vec<f64> = phi.iter().enumerate().map(|(i, x)| x + change(i)).collect();
        let mut out = vec![0.0; 12];
        let _ = field
            .evaluator()
            .forward_dynamics(&phi, &phid, &[0.0; 12], &mut out);
        out
    };
    let here = accelerations(Symmetry::Shift, &|_| 0.0);
    assert!(largest_difference(&here, &accelerations(Symmetry::Shift, &|_| 0.7)) < 1e-12);
    let here = accelerations(Symmetry::Turn, &|_| 0.0);
    let turned = accelerations(Symmetry::Turn, &|i| TAU * (i % 3) as f64);
    assert!(largest_difference(&here, &turned) < 1e-12);
    let other = accelerations(Symmetry::Turn, &|_| 0.7);
    assert!(largest_difference(&here, &other) > 1e-3);
}

#[test]
fn the_leapfrog_keeps_the_energy_of_a_learnable_ring_for_a_long_time() {
    let field = Field::new(Chain::love_rod(1.0, 1.0), 30).unwrap();
    let pulse = Pulse {
        height: 1.0,
        centre: 10.0,
        width: 4.0,
    };
    let (phi, phid) = pulse.start(30, 0.0);
    let options = RolloutOptions {
        method: Method::StormerVerlet,
        step: 0.02,
        ..RolloutOptions::default()
    };
    let times = times(300.0, 1.0).unwrap();
    let motion = rollout(&field, &phi, &phid, &times, &free, &options)
        .unwrap()
        .trajectory;
    let mut energies = vec![0.0; times.len()];
    let _ = field
        .evaluator()
        .energy(&motion.q, &motion.qd, &mut energies);
    let drift = energies
        .iter()
        .map(|e| (e / energies[0] - 1.0).abs())
        .fold(0.0, f64::max);
    assert!(drift < 1e-4, "{drift}");
}

fn rings(chain: Chain, motions: usize) -> (Dataset, RingStates) {
    let states = RingStates {
        mean: 0.5,
        amplitude: 0.7,
        rate: 0.7,
        windings: 0,
        seconds: 4.0,
        interval: 0.5,
    };
    let truth = Field::new(chain, 10).unwrap();
    let all = ring_states(&truth, &states, motions, 3).unwrap();
    let (train, validation) = split(all, 0.2, 0).unwrap();
    let coordinates = truth.coordinates().clone();
    (
        Dataset::new(coordinates, &train, &validation).unwrap(),
        states,
    )
}

fn config(symmetry: Symmetry, steps: usize) -> FieldFitConfig {
    FieldFitConfig {
        network: DensityConfig {
            symmetry,
            width: 16,
            ..DensityConfig::default()
        },
        budget: Budget::Steps(steps),
        rings: 24,
        ..FieldFitConfig::default()
    }
}

#[test]
fn the_wave_speed_learned_on_ten_points_holds_on_a_thousand() {
    let chain = Chain::wave(1.0);
    let (data, _) = rings(chain.clone(), 80);
    let learned = fit(&data, &config(Symmetry::Shift, 120), &mut ()).unwrap();
    let ring = learned.model.ring(1000).unwrap();
    for mode in [1, 10, 100, 300] {
        let truth = chain.frequency(TAU * mode as f64 / 1000.0);
        let found = dispersion(&*ring, mode, 1e-3).sqrt();
        assert!(
            (found / truth - 1.0).abs() < 1e-3,
            "{mode}: {found} {truth}"
        );
    }
    // The same seed gives the same bits on one thread.
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .unwrap();
    let again = pool
        .install(|| fit(&data, &config(Symmetry::Shift, 120), &mut ()))
        .unwrap();
    assert_eq!(again.best.to_bits(), learned.best.to_bits());
}

#[test]
fn what_cannot_be_a_field_is_refused_with_the_remedy() {
    let message = |e: Error| e.to_string();
    let few = Field::new(Chain::wave(1.0), 2).err().map(message).unwrap();
    assert!(few.contains("3 to") && few.contains("same point"), "{few}");
    let pendulum = Analytic::<lagrangian::analytic::Pendulum>::standard();
    let one = Field::new(&pendulum as &dyn Lagrangian, 10)
        .err()
        .map(message)
        .unwrap();
    assert!(one.contains("left, here and right"), "{one}");
}

#[test]
fn a_saved_density_is_the_same_law_and_no_ordinary_model() {
    use lagrangian::{Provenance, SavedModel};
    let density = random(Symmetry::Turn, 9);
    let bytes = density
        .save(Provenance::of_seed(9))
        .unwrap()
        .to_bytes()
        .unwrap();
    let saved = SavedModel::from_bytes(&bytes).unwrap();
    let header = &saved.header;
    let config: DensityConfig = serde_json::from_value(header.architecture.clone()).unwrap();
    let scaling: FieldScaling = serde_json::from_value(header.scaling.clone()).unwrap();
    assert_eq!(config, density.network.shape.config);
    let shape = Shape::new(Output::Density, config, scaling);
    let weights = saved.tensors["parameters"].data().to_vec();
    let again = DensityNet::of(Weighted::new(shape, weights).unwrap());
    assert_eq!(*again.coordinates(), header.coordinates);
    assert_eq!(again.network.parameters, density.network.parameters);
    assert!(lagrangian::Learned::load(&saved).is_err());
}
