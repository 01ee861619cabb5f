#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
use std::f64::consts::{PI, TAU};

use super::*;
use lagrangian::analytic::{AnalyticModel, by_name};
use lagrangian::rollout::free;
use lagrangian::{RolloutOptions, rollout};

fn oscillator() -> Box<dyn AnalyticModel> {
    by_name("mass-spring", &[("mass", 2.0), ("stiffness", 8.0)]).unwrap() // ω = 2
}

fn search(system: &dyn AnalyticModel, ends: &Boundary, segments: usize) -> Search {
    let options = SearchOptions {
        segments,
        ..SearchOptions::default()
    };
    stationary_paths(system.lagrangian(), ends, &options).unwrap()
}

fn far(a: &[f64], b: &[f64]) -> f64 {
    a.iter()
        .zip(b)
        .fold(0.0, |far: f64, (a, b)| far.max((a - b).abs()))
}

/// Ends of a true motion of this duration.
fn ends_of_motion(system: &dyn AnalyticModel, q: &[f64], qd: &[f64], duration: f64) -> Boundary {
    let times = [0.0, duration];
    let motion = rollout(system, q, qd, &times, &free, &RolloutOptions::truth()).unwrap();
    Boundary {
        from: q.to_vec(),
        to: motion.trajectory.q[q.len()..].to_vec(),
        duration,
    }
}

/// The path of the search that begins with this velocity.
fn with_velocity<'a>(search: &'a Search, qd: &[f64]) -> &'a StationaryPath {
    let near = |path: &&StationaryPath| far(&path.velocities[0], qd);
    let paths = search.paths.iter();
    paths.min_by(|a, b| near(a).total_cmp(&near(b))).unwrap()
}

#[test]
fn a_free_particle_goes_straight_with_its_action_to_rounding() {
    let free = by_name("charged-particle", &[("charge", 0.0), ("mass", 3.0)]).unwrap();
    let ends = Boundary::new(free.coordinates(), &[1.0, -1.0], &[4.0, 3.0], 2.0).unwrap();
    let search = search(&*free, &ends, 40);
    assert_eq!(search.paths.len(), 1);
    let path = &search.paths[0];
    assert!((path.action - 3.0 * 25.0 / 4.0).abs() < 1e-12); // m |Δx|²/(2 T)
    assert!(far(&path.velocities[0], &[1.5, 2.0]) < 1e-12);
    assert!(path.residual < 1e-10 && path.kind == PathKind::Minimum);
}

#[test]
fn the_action_of_an_oscillator_is_the_closed_form_to_second_order() {
    let (a, b, time, m, w): (f64, f64, f64, f64, f64) = (0.7, -0.2, 1.1, 2.0, 2.0);
    let ends = Boundary::new(&lagrangian::Coordinates::lines(1), &[a], &[b], time).unwrap();
    let (s, c) = (w * time).sin_cos();
    let closed_form = m * w / (2.0 * s) * ((a * a + b * b) * c - 2.0 * a * b);
    let errors = [50, 100, 200].map(|segments| {
        let search = search(&*oscillator(), &ends, segments);
        let path = &search.paths[0];
        let error = (path.action - closed_form).abs();
        assert!(
            (path.action_error / error - 1.0).abs() < 0.01,
            "estimated from two grids"
        );
        error
    });
    for pair in errors.windows(2) {
        assert!((pair[0] / pair[1] - 4.0).abs() < 0.02, "{errors:?}");
    }
}

#[test]
fn after_half_a_period_the_path_of_an_oscillator_is_a_saddle() {
    let half = PI / 2.0; // π/ω
    for (time, index) in [
        (0.9 * half, 0),
        (1.1 * half, 1),
        (1.9 * half, 1),
        (2.5 * half, 2),
    ] {
        let ends = Boundary::new(&lagrangian::Coordinates::lines(1), &[1.0], &[0.3], time).unwrap();
        let found = search(&*oscillator(), &ends, 400);
        assert_eq!(found.paths.len(), 1, "a linear equation has one solution");
        let second = &found.paths[0].second_variation;
        assert_eq!(second.morse_index, index);
        assert_eq!(second.conjugate_times.len(), index);
        for (k, t) in second.conjugate_times.iter().enumerate() {
            // The midpoint rule turns by 2 atan(ω h/2) a step, which delays it by the relative error (ω h)²/12.
            let late = t / ((k + 1) as f64 * half) - 1.0;
            let expected = (2.0 * time / 400.0).powi(2) / 12.0;
            assert!((late / expected - 1.0).abs() < 0.05, "{late} {expected}");
        }
        // λ = m ((π/T)² − ω²).
        let least = 2.0 * ((PI / time).powi(2) - 4.0);
        assert!((second.least_eigenvalue - least).abs() < 1e-3 * least.abs().max(1.0));
        let system = oscillator();
        let mut action = DiscreteAction::new(system.lagrangian());
        let path = &found.paths[0].path;
        let along = action.changes(path, &second.mode, &[-0.1, 0.1]);
        assert!(along.iter().all(|s| (*s < 0.0) == (index > 0)));
    }
}

#[test]
fn ends_that_are_conjugate_are_connected_by_no_path() {
    let ends = Boundary::new(&lagrangian::Coordinates::lines(1), &[1.0], &[0.3], PI / 2.0).unwrap();
    let found = search(&*oscillator(), &ends, 200);
    assert_eq!(found.failure(), Some(Failure::Unresolved));
}

#[test]
fn nothing_is_faster_than_light() {
    let particle = by_name("relativistic-particle", &[("field", 0.0)]).unwrap();
    let ends = Boundary::new(particle.coordinates(), &[0.0], &[2.0], 1.0).unwrap();
    let found = search(&*particle, &ends, 40);
    assert_eq!(found.failure(), Some(Failure::Undefined));
    assert!(
        found
            .failure()
            .unwrap()
            .to_string()
            .contains("too far apart")
    );
}

#[test]
fn stationary_paths_are_motions_at_second_order() {
    let cases: [(&str, Vec<f64>, Vec<f64>, f64); 4] = [
        ("pendulum", vec![1.0], vec![2.0], 1.0),
        ("double-pendulum", vec![1.0, -0.4], vec![1.0, 2.0], 0.6),
        ("kepler", vec![1.0, 0.0], vec![0.2, 1.1], 1.5),
        ("charged-particle", vec![1.0, 0.0], vec![0.5, 0.7], 2.0),
    ];
    for (name, q, qd, time) in cases {
        let system = by_name(name, &[]).unwrap();
        let ends = ends_of_motion(&*system, &q, &qd, time);
        let errors = [100, 200].map(|segments| {
            let found = search(&*system, &ends, segments);
            let path = with_velocity(&found, &qd);
            let times = path.path.times();
            let motion = rollout(&*system, &q, &qd, &times, &free, &RolloutOptions::truth());
            let error = far(&path.path.q, &motion.unwrap().trajectory.q);
            assert!(
                (path.path_error / error - 1.0).abs() < 0.1,
                "{name}: {}",
                path.path_error
            );
            let [e0, e1] = path.energies;
            assert!(
                (e0 - e1).abs() < 1e-3 * (1.0 + e0.abs()),
                "{name}: {e0} {e1}"
            );
            (error, far(&path.velocities[0], &qd))
        });
        for (coarse, fine) in [(errors[0].0, errors[1].0), (errors[0].1, errors[1].1)] {
            assert!((3.7..4.3).contains(&(coarse / fine)), "{name}: {errors:?}");
        }
        assert!(errors[1].0 < 1e-3, "{name}: {errors:?}");
    }
}

#[test]
fn the_action_of_the_ends_is_hamilton_jacobi() {
    let system = by_name("double-pendulum", &[]).unwrap();
    let ends = ends_of_motion(&*system, &[1.0, -0.4], &[1.0, 2.0], 0.6);
    let of = |ends: &Boundary| {
        let found = search(&*system, ends, 200);
        with_velocity(&found, &[1.0, 2.0]).clone()
    };
    let here = of(&ends);
    let d = 1e-4;
    for i in 0..2 {
        let moved = |x: &[f64], by: f64| {
            let mut x = x.to_vec();
            x[i] += by;
            x
        };
        let slope = |make: &dyn Fn(f64) -> Boundary| {
            (of(&make(d)).action - of(&make(-d)).action) / (2.0 * d)
        };
        let start = slope(&|by| Boundary {
            from: moved(&ends.from, by),
            ..ends.clone()
        });
        let end = slope(&|by| Boundary {
            to: moved(&ends.to, by),
            ..ends.clone()
        });
        assert!((start + here.momenta[0][i]).abs() < 1e-6, "∂S/∂q₀ = −p₀");
        assert!((end - here.momenta[1][i]).abs() < 1e-6, "∂S/∂q₁ = p₁");
    }
    let lasting = |by: f64| {
        of(&Boundary {
            duration: ends.duration + by,
            ..ends.clone()
        })
        .action
    };
    let slope = (lasting(d) - lasting(-d)) / (2.0 * d);
    assert!(
        (slope + here.energies[0]).abs() < 1e-3,
        "∂S/∂T = −H: {slope} {:?}",
        here.energies
    );
}

#[test]
fn a_pendulum_gets_there_directly_or_over_the_top() {
    let pendulum = by_name("pendulum", &[]).unwrap();
    let ends = |turns: i32| {
        let shorter = Boundary::new(pendulum.coordinates(), &[0.2], &[TAU + 0.6], 1.0).unwrap();
        shorter.winding(pendulum.coordinates(), &[turns]).unwrap()
    };
    let motion = |turns: i32| search(&*pendulum, &ends(turns), 100).paths.remove(0);
    assert!((ends(0).to[0] - 0.6).abs() < 1e-12);
    let (direct, over, back) = (motion(0), motion(1), motion(-1));
    assert!(over.velocities[0][0] > TAU && back.velocities[0][0] < -TAU);
    assert!(direct.action < over.action && direct.action < back.action);
    assert!(
        ends(0)
            .winding(&lagrangian::Coordinates::lines(1), &[1])
            .is_err()
    );
}

#[test]
fn the_same_ends_may_have_several_motions() {
    // From the bottom to the bottom in a time that both a swing and a rest can take.
    let pendulum = by_name("pendulum", &[]).unwrap();
    let ends = Boundary::new(pendulum.coordinates(), &[0.0], &[0.0], 1.5).unwrap();
    let found = search(&*pendulum, &ends, 100);
    assert!(
        found.paths.len() >= 3,
        "rest, and a swing to each side: {}",
        found.paths.len()
    );
    let rest = with_velocity(&found, &[0.0]);
    // At rest T = 1.5 s lies after π/√(g/l) = 1.0035 s.
    assert_eq!(rest.second_variation.morse_index, 1);
    assert!((rest.second_variation.conjugate_times[0] - PI / 9.8_f64.sqrt()).abs() < 1e-3);
    let least = &found.paths[0];
    assert!(least.action < rest.action && least.kind == PathKind::Minimum);
}

#[test]
fn the_conjugate_points_of_a_circular_orbit_are_those_of_hill() {
    // Neighbours of a circular orbit meet it again where 8 (1 − cos x) = 3 x sin x (Clohessy, Wiltshire 1960): after a
    // full turn, and at tan x/2 = 3 x/8.
    let system = by_name("kepler", &[]).unwrap();
    let ends = ends_of_motion(&*system, &[1.0, 0.0], &[0.0, 1.0], 1.5 * TAU);
    let mut first = Vec::new();
    for k in 0..=400 {
        let (sin, cos) = (1.5 * TAU * f64::from(k) / 400.0).sin_cos();
        first.extend([cos, sin]);
    }
    let mut path = Path {
        dof: 2,
        duration: ends.duration,
        q: first,
    };
    let mut action = DiscreteAction::new(system.lagrangian());
    super::newton::newton(&mut action, &mut path).unwrap();
    let times = action.second_variation(&path).conjugate_times;
    assert_eq!(times.len(), 2);
    assert!((times[0] - TAU).abs() < 5e-3, "{times:?}");
    let x = times[1];
    assert!(((0.5 * x).tan() - 0.375 * x).abs() < 0.05, "{times:?}");
}

#[test]
fn two_directions_that_meet_at_once_count_twice() {
    // All motions from a point of a uniform magnetic field meet at it again after 2π m/(e B).
    let system = by_name("charged-particle", &[]).unwrap();
    let ends = ends_of_motion(&*system, &[1.0, 0.0], &[0.5, 0.7], 1.2 * TAU);
    let found = search(&*system, &ends, 400);
    assert_eq!(found.paths.len(), 1);
    let second = &found.paths[0].second_variation;
    assert_eq!((second.morse_index, second.conjugate_times.len()), (2, 2));
    assert!(
        second
            .conjugate_times
            .iter()
            .all(|t| (t - TAU).abs() < 1e-3)
    );
}

#[test]
fn another_gauge_moves_the_action_and_not_the_path() {
    // B × x/2 against x B: dF/dt with F = −½ e B x y is the difference of two vector potentials.
    use lagrangian::analytic::{Analytic, ChargedParticle, Domain, Parameter, Rng, System};
    use lagrangian::{Coordinates, State};
    #[derive(Clone)]
    struct Landau(ChargedParticle);
    impl System for Landau {
        const NAME: &'static str = "landau";
        const ABOUT: &'static str = "a charged particle in another gauge";
        const PARAMETERS: &'static [Parameter] = &[Parameter {
            name: "none",
            unit: "",
            value: 0.0,
            domain: Domain::Finite,
        }];
        fn new(_: &[f64]) -> Self {
            Self(ChargedParticle::new(&[2.0, 1.0, 1.0, 1.0, 0.0]))
        }
        fn coordinates(&self) -> Coordinates {
            self.0.coordinates()
        }
        fn lagrangian<D: num_dual::DualNum<Primitive = f64> + Copy>(&self, q: &[D], qd: &[D]) -> D {
            self.0.lagrangian(q, qd) + (qd[0] * q[1] + q[0] * qd[1]) * 0.5
        }
        fn sample_state(&self, rng: &mut dyn Rng) -> State {
            self.0.sample_state(rng)
        }
    }
    let (symmetric, landau) = (
        Analytic::<ChargedParticle>::standard(),
        Analytic::<Landau>::standard(),
    );
    let ends = Boundary::new(
        &symmetric.system().coordinates(),
        &[1.0, 0.5],
        &[-0.5, 2.0],
        1.0,
    );
    let ends = ends.unwrap();
    let (a, b) = (search(&symmetric, &ends, 100), search(&landau, &ends, 100));
    assert!(far(&a.paths[0].path.q, &b.paths[0].path.q) < 1e-10);
    let f = |q: &[f64]| 0.5 * q[0] * q[1];
    let expected = f(&ends.to) - f(&ends.from);
    assert!((b.paths[0].action - a.paths[0].action - expected).abs() < 1e-12);
}
