//! Constraints that are found in positions of points, and none where there are none.

use lagrangian_motion::{Coordinate, Coordinates, Topology};
use lagrangian_recordings::constraints::{Kind, Structure, find};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Places of points by a time and a number that tells motions apart.
type Places = fn(f64, f64) -> Vec<f64>;

/// What is found in some motions of 200 samples at 50 Hz, with noise.
fn found(names: &[&str], motions: usize, noise: f64, places: Places) -> Structure {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let mut normal = || (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0;
    let of = |k: usize| -> Vec<f64> {
        let at = |s: usize| places(0.02 * s as f64, 1.0 + k as f64);
        let exact: Vec<f64> = (0..200).flat_map(at).collect();
        exact.iter().map(|x| x + noise * normal()).collect()
    };
    let motions: Vec<Vec<f64>> = (0..motions).map(of).collect();
    let motions: Vec<&[f64]> = motions.iter().map(Vec::as_slice).collect();
    let named = |name: &&str| Coordinate::new(*name, "m", Topology::Line);
    find(&Coordinates(names.iter().map(named).collect()), &motions)
}

fn words(found: &Structure) -> Vec<&str> {
    let all = found.found.iter();
    all.map(|own| &*own.constraint.name).collect()
}

/// A slider in a slot at y = 0.1, on a rod of 1.3 from a crank of 0.5.
fn slider_and_crank(t: f64, k: f64) -> Vec<f64> {
    let (y, x) = (k.sqrt() * t * 2.0 + k).sin_cos();
    let (x, y) = (0.5 * x, 0.5 * y);
    vec![x, y, x + (1.69 - (0.1 - y) * (0.1 - y)).sqrt(), 0.1]
}

/// A bar of two ends that moves freely in a plane, and a third point that turns about its first end.
fn bars(t: f64, k: f64) -> Vec<f64> {
    let (x, y) = ((t + k).sin() * k, t * t - k * t);
    let [first, second] = [k * t + k, 2.0 * (t * k.sqrt()).sin()].map(f64::sin_cos);
    vec![
        x,
        y,
        x + 0.7 * first.0,
        y + 0.7 * first.1,
        x + 0.4 * second.0,
        y + 0.4 * second.1,
    ]
}

#[test]
fn a_slider_and_a_crank_have_a_slot_a_circle_and_a_rod() {
    for noise in [0.0, 1e-3, 5e-3] {
        let own = found(&["ax", "ay", "bx", "by"], 4, noise, slider_and_crank);
        assert_eq!(own.freedom, 1, "{own:#?}");
        let kinds: Vec<Kind> = own.found.iter().map(|own| own.kind).collect();
        assert_eq!(kinds, [Kind::Fixed, Kind::Circle, Kind::Rod]);
        let words = words(&own);
        assert!(words[1].starts_with("a on a circle about ("), "{words:?}");
        assert!(words[2].starts_with("rod a–b, length 1.3"), "{words:?}");
    }
}

#[test]
fn rods_that_are_hung_nowhere_are_found_and_a_rod_that_breathes_is_refused() {
    let names = ["x1", "y1", "x2", "y2", "x3", "y3"];
    for motions in [1, 3] {
        let own = found(&names, motions, 1e-3, bars);
        assert_eq!(own.freedom, 4, "{own:#?}");
        let lengths: Vec<f64> = own.found.iter().filter_map(|own| own.length).collect();
        assert!((lengths[0] - 0.7).abs() < 1e-3 && (lengths[1] - 0.4).abs() < 1e-3);
    }
    let breathing = found(&names, 3, 1e-3, |t, k| {
        let mut all = bars(t, k);
        let size = 1.0 + 0.006 * (3.0 * t + k).sin();
        (2..6).for_each(|i| all[i] = all[i % 2] + size * (all[i] - all[i % 2]));
        all
    });
    assert_eq!(breathing.freedom, 6, "{breathing:#?}");
}

#[test]
fn a_rigid_body_has_rods_between_all_its_points_and_none_too_many() {
    let own = found(&["x1", "y1", "x2", "y2", "x3", "y3"], 4, 1e-3, |t, k| {
        let (sin, cos) = (k * t).sin_cos();
        let (x, y) = (k * t, (t + k).sin());
        vec![
            x,
            y,
            x + 0.5 * cos,
            y + 0.5 * sin,
            x - 0.4 * sin,
            y + 0.4 * cos,
        ]
    });
    assert_eq!((own.freedom, own.found.len()), (3, 3), "{own:#?}");
    assert!(own.found.iter().all(|own| own.kind == Kind::Rod));
}

#[test]
fn an_ellipse_and_a_plane_in_space_are_found_in_several_motions_alone() {
    let ellipse: Places = |t, k| vec![1.5 * (k * t).cos(), 0.8 * (k * t).sin()];
    let own = found(&["x", "y"], 3, 1e-3, ellipse);
    assert_eq!((own.freedom, own.found[0].kind), (1, Kind::Quadric));
    assert_eq!(found(&["x", "y"], 1, 1e-3, ellipse).freedom, 2);
    let plane: Places = |t, k| {
        vec![
            (k * t).cos(),
            k * (2.0 * t).sin(),
            0.5 * (k * t).cos() + 0.2,
        ]
    };
    let own = found(&["x", "y", "z"], 3, 1e-3, plane);
    assert_eq!(own.freedom, 2, "{own:#?}");
    assert_eq!(words(&own), ["-0.500 x + z = 0.200"]);
}

#[test]
fn coordinates_that_move_by_themselves_have_no_constraint() {
    let free: [Places; 3] = [
        |t, k| vec![k * (2.0 * t).sin(), (3.0 * t + k).cos()],
        |t, k| {
            vec![
                k * t,
                k * t - 4.9 * t * t,
                (t + k).sin(),
                (1.7 * k * t).cos(),
            ]
        },
        |t, k| {
            vec![
                (1.0 + 0.1 * k) * (k * t).cos(),
                (1.0 + 0.1 * k) * (k * t).sin(),
            ]
        },
    ];
    for places in free {
        for noise in [0.0, 1e-3, 1e-2] {
            let names = ["x1", "y1", "x2", "y2"];
            let n = places(0.0, 1.0).len();
            let own = found(&names[..n], 4, noise, places);
            assert_eq!((own.freedom, own.found.len()), (n, 0), "{own:#?}");
        }
    }
}

#[test]
fn points_that_rest_or_that_constraints_hold_wholly_are_said_to_have_no_freedom() {
    let places: Places = |t, k| vec![1.0, 2.0, 3.0 + 1e-7 * (t * k).sin(), 4.0];
    let own = found(&["x1", "y1", "x2", "y2"], 8, 0.0, places);
    assert!(own.freedom <= 1, "{own:#?}");
    assert_eq!(
        found(&["x", "y"], 8, 1e-3, |_, _| vec![1.0, 2.0]).freedom,
        0
    );
}

/// A skate whose blade is along the line from its first mark to the second, on a curve that it glides along.
fn skate(t: f64, k: f64) -> Vec<f64> {
    let (sin, cos) = (1.3 * t + k).sin_cos();
    let (x, y) = (t - 0.3 * k * t.cos(), 0.3 * k * sin);
    let (dx, dy) = (1.0 + 0.3 * k * t.sin(), 0.39 * k * cos);
    let speed = dx.hypot(dy);
    vec![x, y, x + 0.5 * dx / speed, y + 0.5 * dy / speed]
}

/// An upright disc of radius 0.3 that rolls in a circle: its centre and two marks on its rim, a quarter apart.
fn disc(t: f64, k: f64) -> Vec<f64> {
    let (turn, roll) = (0.9 - 0.27 * k, 1.7 + 0.9 * (2.0 * k).sin());
    let (heading, angle) = (k + turn * t, 2.0 * k + roll * t);
    let (sin, cos) = heading.sin_cos();
    let arc = 0.3 * roll / turn;
    let centre = [arc * sin + k, -arc * cos, 0.3];
    let rim = |angle: f64| {
        let (across, up) = angle.sin_cos();
        [0.3 * across * cos, 0.3 * across * sin, 0.3 * up]
    };
    let marks = [rim(angle), rim(angle + std::f64::consts::FRAC_PI_2)];
    let places = marks.map(|own| [0, 1, 2].map(|i| centre[i] + own[i]));
    [centre, places[0], places[1]].concat()
}

#[test]
fn a_skate_and_a_rolling_disc_do_not_slip() {
    let of_velocities = |own: &Structure| {
        let all = own.found.iter();
        all.filter(|own| own.kind == Kind::Velocity).count()
    };
    for noise in [0.0, 1e-3, 1e-2] {
        let own = found(&["ax", "ay", "bx", "by"], 8, noise, skate);
        assert_eq!((own.freedom, of_velocities(&own)), (2, 1), "{own:#?}");
    }
    for noise in [0.0, 3e-4] {
        let names = ["ax", "ay", "az", "bx", "by", "bz", "cx", "cy", "cz"];
        let own = found(&names, 14, noise, disc);
        assert_eq!((own.freedom, of_velocities(&own)), (2, 2), "{own:#?}");
    }
}

/// A wheel of radius 0.5 that rolls along a line: its hub and a mark on a spoke.
fn wheel(t: f64, k: f64) -> Vec<f64> {
    let angle = 2.0 * k + 1.9 * (1.3 * t + k).sin() + 0.4 * k.cos() * t;
    let (across, up) = angle.sin_cos();
    let hub = 0.5 * angle + k;
    vec![hub, 0.5, hub + 0.4 * across, 0.5 + 0.4 * up]
}

/// A pendulum that hangs from a carriage, and moves by itself.
fn carriage(t: f64, k: f64) -> Vec<f64> {
    let (sin, cos) = (1.2 * (2.1 * t + k).sin()).sin_cos();
    let place = k + 0.6 * (1.3 * t + 2.0 * k).sin();
    vec![place, 0.5, place + 0.4 * sin, 0.5 - 0.4 * cos]
}

#[test]
fn a_wheel_rolls_along_a_line_and_a_carriage_does_not() {
    for noise in [0.0, 1e-3, 1e-2] {
        let names = ["ax", "ay", "bx", "by"];
        let own = found(&names, 8, noise, wheel);
        assert_eq!(own.freedom, 1, "{own:#?}");
        let rolls: Vec<_> = { own.found.iter() }
            .filter(|own| own.kind == Kind::Velocity)
            .collect();
        assert_eq!(rolls.len(), 1, "{own:#?}");
        // The relation says something wherever the mark is.
        let size = |k: usize| {
            let angle = 0.1 * k as f64;
            let (sin, cos) = angle.sin_cos();
            let row = rolls[0]
                .constraint
                .row(&[0.0, 0.5, 0.4 * sin, 0.5 + 0.4 * cos]);
            // Along the hub, and around it.
            let along = row[0] + row[2];
            let around = 0.4 * (row[2] * cos - row[3] * sin);
            along.hypot(around)
        };
        let sizes: Vec<f64> = (0..63).map(size).collect();
        let least = sizes.iter().copied().fold(f64::INFINITY, f64::min);
        let most = sizes.iter().copied().fold(0.0, f64::max);
        assert!(least > 0.2 * most, "{sizes:?}");
        assert_eq!(found(&names, 8, noise, carriage).freedom, 2);
    }
}

#[test]
fn motions_that_slip_or_that_begin_at_rest_have_no_relation_of_velocities() {
    let names = ["x1", "y1", "x2", "y2", "x3", "y3"];
    // Released from rest, each mass keeps the direction of its first step and the angular momentum is 0.
    let released: Places = |t, k| {
        let (first, second) = ((2.0 * t).cos(), (3.1 * t).cos());
        vec![
            k.sin() * first,
            k.cos() * first,
            (3.0 * k).sin() * second,
            (2.0 * k).cos() * second,
        ]
    };
    let drifting: Places = |t, k| {
        let own = skate(t, k);
        vec![own[0], own[1] + 0.05 * t * t, own[2], own[3] + 0.05 * t * t]
    };
    // Waves on a ring without momentum, whose mean stays where it is, in each motion elsewhere.
    let waves: Places = |t, k| {
        let wave = |i: usize, m: f64| {
            let (sin, cos) = (m * std::f64::consts::TAU * i as f64 / 6.0).sin_cos();
            cos * (m * t + k).cos() + sin * (1.3 * m * t + 2.0 * k).sin()
        };
        let all = [1.0, 2.0, 3.0];
        (0..6)
            .map(|i| k.sin() + all.map(|m| wave(i, m)).iter().sum::<f64>())
            .collect()
    };
    for noise in [0.0, 1e-3, 1e-2] {
        assert_eq!(found(&names, 8, noise, waves).freedom, 6);
        assert_eq!(found(&names, 8, noise, bars).freedom, 4);
        assert_eq!(found(&names[..4], 8, noise, released).freedom, 4);
        assert_eq!(found(&names[..4], 8, noise.min(1e-3), drifting).freedom, 3);
    }
}
