//! One law of many sites and their neighbours.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use lagrangian::analytic::normal;
use lagrangian::mechanics::lattice::{Basis, Bonds, Ends, Lattice, LatticeShape};
use lagrangian::mechanics::{Evaluation, Evaluator, Model, Quantities};
use lagrangian::models::{LatticeConfig, Parameter};
use lagrangian::rollout::{free, times};
use lagrangian::train::FitSpec;
use lagrangian::trajectory::Coordinates;
use lagrangian::{
    Error, Fit, FitConfig, Learned, Prepared, Provenance, Recording, RolloutOptions, SavedModel,
    Signals, fit, rollout,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Motions of a model from random states, positions alone with noise of this deviation.
fn recordings(truth: &dyn Model, size: f64, noise: f64) -> Vec<Recording> {
    let n = truth.coordinates().dof();
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let times = times(6.0, 0.02).unwrap();
    let motion = |k: usize| {
        let mut random = || -> Vec<f64> { (0..n).map(|_| size * normal(&mut rng)).collect() };
        let (q, qd) = (random(), random());
        let options = RolloutOptions::truth();
        let motion = rollout(truth, &q, &qd, &times, &free, &options).unwrap();
        let mut signals: Signals = Signals::default();
        let noisy = |x: &f64| x + noise * normal(&mut rng);
        signals.q = motion.trajectory.q.iter().map(noisy).collect();
        Recording::new(
            format!("motion {k}"),
            truth.coordinates().clone(),
            motion.trajectory.t,
            signals,
        )
    };
    (0..8).map(motion).collect()
}

fn fitted(recordings: Vec<Recording>, config: LatticeConfig) -> Result<Fit, Error> {
    let spec = FitSpec::of("lattice");
    let prepared = Prepared::new(recordings, Vec::new(), &spec)?;
    let candidates = FitConfig::candidates(&prepared.dataset, &prepared.estimates, &spec)?;
    let mut own = candidates[0].config.clone();
    own.family = config.into();
    fit(&prepared.dataset, &own, None, &mut ())
}

/// A lattice of unit masses whose bonds of these offsets pull by s + ¼ s², or by s + ½ s³ where `even`.
fn lattice(sites: usize, bonds: &[(usize, Ends)], even: bool) -> Lattice {
    let own = |(offset, ends): &(usize, Ends)| Bonds {
        offset: *offset,
        pairs: Bonds::of_chain(sites, *offset, *ends),
        basis: Basis::Powers { degree: 3 },
    };
    let pull = match even {
        true => [0.0, 1.0, 0.0, 0.5, 0.0],
        false => [0.0, 1.0, 0.25, 0.0, 0.0],
    };
    let shape = LatticeShape {
        bonds: bonds.iter().map(own).collect(),
        site: None,
    };
    let parameters = [vec![1.0; sites], pull.repeat(bonds.len())].concat();
    Lattice::new(Coordinates::lines(sites), shape, parameters, None).unwrap()
}

fn law(fit: &Fit) -> (String, String) {
    let written = fit.model.written().unwrap();
    (written.text, written.verdict)
}

#[test]
fn the_law_of_a_chain_between_walls_is_found_saved_and_used_on_more_sites() {
    let truth = lattice(16, &[(1, Ends::Walls)], false);
    let fit = fitted(recordings(&truth, 0.4, 5e-4), LatticeConfig::default()).unwrap();
    let (text, verdict) = law(&fit);
    assert_eq!(verdict, "law", "{text}");
    let terms = fit.model.parameters();
    assert_eq!(terms.len(), 2, "{text}");
    for (term, expected) in terms.iter().zip([0.5, 0.25 / 3.0]) {
        let error = term.standard_error.unwrap();
        assert!(
            (term.value - expected).abs() < 4.0 * error && error < 0.01 * expected,
            "{text}"
        );
    }
    let saved = fit
        .model
        .save(Provenance::of_seed(7))
        .unwrap()
        .to_bytes()
        .unwrap();
    let again = Learned::load(&SavedModel::from_bytes(&saved).unwrap()).unwrap();
    let state: Vec<f64> = (0..16).map(|i| 0.3 * f64::from(i).sin()).collect();
    let none = [0.0; 16];
    let moves = |model: &Learned| model.forward_dynamics(&state, &none, &none).unwrap();
    assert_eq!(moves(&again), moves(&fit.model));
    // The wall is where the chain ends, however long it is.
    let (long, expected) = (
        again.with_sites(400).unwrap(),
        lattice(400, &[(1, Ends::Walls)], false),
    );
    let state: Vec<f64> = (0..400).map(|i| 0.3 * f64::from(i).sin()).collect();
    let none = [0.0; 400];
    let own = long.forward_dynamics(&state, &none, &none).unwrap();
    let expected = expected.forward_dynamics(&state, &none, &none).unwrap();
    assert!(own.iter().zip(&expected).all(|(a, b)| (a - b).abs() < 2e-3));
    assert!(again.with_sites(2).is_err());
}

#[test]
fn weaker_bonds_to_the_next_but_one_are_found_whatever_is_at_the_ends() {
    for [near, far] in [
        [Ends::Free, Ends::Free],
        [Ends::Walls, Ends::Free],
        [Ends::Ring; 2],
    ] {
        let mut truth = lattice(16, &[(1, near), (2, far)], true);
        // Two fifths of the pull of the nearest.
        let (coordinates, shape) = (truth.coordinates().clone(), truth.shape().clone());
        let mut parameters = truth.parameters().to_vec();
        let far = parameters.len() - 5;
        parameters[far..].iter_mut().for_each(|own| *own *= 0.4);
        truth = Lattice::new(coordinates, shape, parameters, None).unwrap();
        let fit = fitted(recordings(&truth, 0.5, 5e-4), LatticeConfig::default()).unwrap();
        let (text, verdict) = law(&fit);
        assert_eq!(verdict, "law", "{text}");
        for (term, expected) in fit.model.parameters().iter().zip([0.5, 0.125, 0.2, 0.05]) {
            assert!((term.value - expected).abs() < 0.02 * expected, "{text}");
        }
    }
}

#[test]
fn the_rows_of_a_grid_are_told_apart_and_it_has_no_other_size() {
    // Rows of 5 that do not meet: 5 apart is a bond, 1 apart is one but across the ends of rows.
    let mut truth = lattice(25, &[(5, Ends::Free)], true);
    let rows = Bonds {
        offset: 1,
        pairs: (0..24).filter(|i| i % 5 < 4).map(|i| [i, i + 1]).collect(),
        basis: Basis::Powers { degree: 3 },
    };
    let mut shape = truth.shape().clone();
    shape.bonds.insert(0, rows);
    let own = [0.0, 2.0, 0.0, 0.0, 0.0];
    let parameters = [&[1.0; 25][..], &own, &truth.parameters()[25..]].concat();
    truth = Lattice::new(Coordinates::lines(25), shape, parameters, None).unwrap();
    let fit = fitted(recordings(&truth, 0.4, 0.0), LatticeConfig::default()).unwrap();
    let (text, verdict) = law(&fit);
    assert_eq!(verdict, "law", "{text}");
    let values: Vec<f64> = fit.model.parameters().iter().map(|own| own.value).collect();
    assert!(values.len() == 3, "{text}");
    let expected = [1.0, 0.5, 0.125];
    assert!(
        values
            .iter()
            .zip(expected)
            .all(|(a, b)| (a - b).abs() < 1e-3),
        "{text}"
    );
    assert!(matches!(
        fit.model.with_sites(100),
        Err(Error::Setting { .. })
    ));
}

#[test]
fn the_edges_of_a_grid_are_told_by_all_bonds_together() {
    // Six rows of five, with bonds along rows, between them, and along one diagonal, of which few samples tell each.
    let inside = |aside: usize, offset: usize| -> Vec<[usize; 2]> {
        let pairs = (0..30 - offset).map(|i| [i, i + offset]);
        pairs.filter(|[i, _]| i % 5 + aside < 5).collect()
    };
    let bonds = [(1, 1), (0, 5), (1, 6)].map(|(aside, offset)| Bonds {
        offset,
        pairs: inside(aside, offset),
        basis: Basis::Powers { degree: 3 },
    });
    let shape = LatticeShape {
        bonds: bonds.into(),
        site: Some(Basis::Powers { degree: 1 }),
    };
    let pull = [0.0, 1.0, 0.0, 0.4, 0.0];
    let parameters = [&[1.0; 30][..], &pull, &pull, &pull, &[0.0, 0.5]].concat();
    let truth = Lattice::new(Coordinates::lines(30), shape, parameters, None).unwrap();
    for noise in [0.0, 1e-3] {
        let fit = fitted(recordings(&truth, 0.8, noise), LatticeConfig::default()).unwrap();
        let (text, verdict) = law(&fit);
        assert_eq!(verdict, "law", "{text}");
        let expected = [0.5, 0.1, 0.5, 0.1, 0.5, 0.1, 0.25];
        let own = fit.model.parameters();
        assert_eq!(own.len(), expected.len(), "{text}");
        for (own, expected) in own.iter().zip(expected) {
            assert!((own.value - expected).abs() < 0.02 * expected, "{text}");
        }
    }
}

#[test]
fn inertia_between_sites_is_found_and_kept_by_a_rollout() {
    let mut parameters = lattice(12, &[(1, Ends::Ring)], true).parameters().to_vec();
    parameters[16] = 0.6;
    let shape = lattice(12, &[(1, Ends::Ring)], true).shape().clone();
    let truth = Lattice::new(Coordinates::lines(12), shape, parameters, None).unwrap();
    let of = |noise| fitted(recordings(&truth, 0.5, noise), LatticeConfig::default()).unwrap();
    for (fit, most) in [(of(0.0), 1e-6), (of(1e-3), 1e-2)] {
        let (text, verdict) = law(&fit);
        let terms = fit.model.parameters();
        let is_inertia = |own: &&Parameter| own.name.contains("inertia");
        let inertia = terms.iter().find(is_inertia).unwrap();
        assert!((inertia.value - 0.6).abs() < most, "{text}");
        // Each site feels all others, and all have one mass.
        assert!(terms.len() == 3 && verdict == "law", "{text}");
        assert!(fit.model.with_sites(40).is_ok(), "{text}");
    }
    let fit = of(0.0);
    let q: Vec<f64> = (0..12).map(|i| 0.4 * f64::from(i).cos()).collect();
    let span = times(10.0, 0.1).unwrap();
    let options = RolloutOptions::truth();
    let away = rollout(&fit.model, &q, &[0.0; 12], &span, &free, &options).unwrap();
    let energies: Vec<f64> = away
        .trajectory
        .q
        .chunks(12)
        .zip(away.trajectory.qd.chunks(12))
        .flat_map(|(q, qd)| fit.model.energy(q, qd).unwrap())
        .collect();
    let spread = energies
        .iter()
        .fold(0.0_f64, |most, x| most.max((x - energies[0]).abs()));
    assert!(spread < 1e-8 * energies[0].abs(), "{spread}");
}

/// Sites that all pull at all others.
#[derive(Debug)]
struct Everyone(Coordinates);

impl Model for Everyone {
    fn coordinates(&self) -> &Coordinates {
        &self.0
    }

    fn evaluator(&self) -> Box<dyn Evaluator + '_> {
        Box::new(self)
    }
}

impl Evaluator for &Everyone {
    fn forward_dynamics(&mut self, q: &[f64], _: &[f64], _: &[f64], qdd: &mut [f64]) -> Evaluation {
        let n = self.0.dof();
        for (q, qdd) in q.chunks(n).zip(qdd.chunks_mut(n)) {
            let pull = |x: &f64| q.iter().map(|y| (y - x).sin()).sum::<f64>();
            qdd.iter_mut().zip(q).for_each(|(a, x)| *a = pull(x) / 3.0);
        }
        Evaluation::of(qdd, n, 0)
    }
}

#[test]
fn what_is_no_lattice_is_refused_in_words() {
    let everyone = Everyone(Coordinates::lines(14));
    let none = fitted(recordings(&everyone, 1.0, 0.0), LatticeConfig::default());
    let said = match &none {
        Err(error) => error.to_string(),
        Ok(fit) => law(fit).1,
    };
    assert!(said.contains("no lattice") || said == "none", "{said}");
    let refused = |config: LatticeConfig, sites: usize| {
        let truth = lattice(sites, &[(1, Ends::Free)], true);
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let size = rng.random_range(0.3..0.4);
        fitted(recordings(&truth, size, 0.0), config)
            .unwrap_err()
            .to_string()
    };
    let far = LatticeConfig {
        neighbours: vec![7],
        ..LatticeConfig::default()
    };
    assert!(refused(far, 8).contains("half the number of sites"));
    assert!(refused(LatticeConfig::default(), 3).contains("at least 4"));
}
