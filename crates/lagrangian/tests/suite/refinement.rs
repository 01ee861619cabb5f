//! Fits of noisy motions, which are refined by long rollouts, and of driven ones that no model of torques explains.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::ops::ControlFlow;

use lagrangian::analytic::{by_name, normal};
use lagrangian::dataset::random_starts;
use lagrangian::fit::{Part, ResolvedConfig, Selection, select};
use lagrangian::rollout::{Force, free, rollout_many, times};
use lagrangian::train::{Ending, FitSpec};
use lagrangian::{
    Checkpoint, Dataset, EstimateOptions, FitConfig, Model, Observer, Progress, Recording, Result,
    RolloutOptions, Signals,
};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// The candidates of a fit of pendulums whose positions alone are recorded, with noise of this deviation.
fn noisy(deviation: f64, spec: &FitSpec) -> (Dataset, Vec<ResolvedConfig>) {
    recorded(deviation, spec, |_| 0.0, &free)
}

/// The drive of a pendulum.
fn drive(t: f64) -> f64 {
    3.0 * (2.0 * t).sin() + 2.0 * (5.0 * t + 1.0).cos()
}

/// The same where this drive is recorded and these forces act.
fn recorded(
    deviation: f64,
    spec: &FitSpec,
    drive: impl Fn(f64) -> f64,
    forces: &Force<'_>,
) -> (Dataset, Vec<ResolvedConfig>) {
    let system = by_name("pendulum", &[]).unwrap();
    let (starts, times) = (random_starts(&*system, 6, 3), times(3.0, 0.05).unwrap());
    let options = RolloutOptions::truth();
    let motions = rollout_many(&*system, &starts, &times, forces, &options).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let (mut trajectories, mut estimates) = (Vec::new(), Vec::new());
    for motion in motions {
        let t = motion.trajectory.t.clone();
        let exact = motion.trajectory.signals.q.iter();
        let q: Vec<f64> = exact.map(|x| x + deviation * normal(&mut rng)).collect();
        let signals = Signals {
            tau: t.iter().map(|t| drive(*t)).collect(),
            q,
            ..Signals::default()
        };
        let recording = Recording::new("noisy", system.coordinates().clone(), t, signals);
        let (trajectory, own) = recording
            .into_trajectory(&EstimateOptions::default())
            .unwrap();
        trajectories.push(trajectory);
        estimates.extend(own);
    }
    let (train, validation) = trajectories.split_at(4);
    let dataset = Dataset::new(system.coordinates().clone(), train, validation).unwrap();
    let mut candidates = FitConfig::candidates(&dataset, &estimates, spec).unwrap();
    // Its law would be found before any of them.
    candidates.retain(|own| own.part != Part::Law);
    (dataset, candidates)
}

fn brief() -> FitSpec {
    FitSpec {
        steps: Some(12),
        ..FitSpec::default()
    }
}

/// The models that were refined, by their names.
fn refined(selection: &Selection) -> usize {
    let tried = selection.tried.iter();
    tried
        .filter(|own| own.name.ends_with("refined by rollouts"))
        .count()
}

fn acceleration(selection: &Selection) -> f64 {
    let (mut evaluator, mut found) = (selection.fit.model.evaluator(), [0.0]);
    let _ = evaluator.forward_dynamics(&[0.7], &[0.3], &[0.0], &mut found);
    found[0]
}

/// Ends a run in its refinement, and keeps its last checkpoint.
#[derive(Default)]
struct Interrupting {
    last: Option<Checkpoint>,
}

impl Observer for Interrupting {
    fn progress(&mut self, _: &Progress) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }

    fn stage(&mut self, what: &str, _: f64) -> ControlFlow<()> {
        match what == "refining by rollouts, horizon 40" {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        }
    }

    fn checkpoint(&mut self, checkpoint: &Checkpoint) -> Result<()> {
        self.last = Some(checkpoint.clone());
        Ok(())
    }
}

#[test]
fn a_run_that_was_interrupted_in_its_refinement_resumes_to_the_same_bits() {
    let (dataset, candidates) = noisy(0.02, &brief());
    let whole = select(&dataset, candidates.clone(), None, &mut ()).unwrap();
    assert_eq!(refined(&whole), 1, "{:?}", whole.tried);
    let settings: Vec<&str> = whole.chosen.choices.iter().map(|c| &*c.setting).collect();
    assert_eq!(settings[..2], ["model", "refinement by rollouts"]);
    let mut observer = Interrupting::default();
    let part = select(&dataset, candidates.clone(), None, &mut observer).unwrap();
    assert_eq!(part.fit.ending, Ending::Interrupted);
    let resumed = select(&dataset, candidates, observer.last.as_ref(), &mut ()).unwrap();
    let bits = |own: &Selection| acceleration(own).to_bits();
    assert_eq!(bits(&resumed), bits(&whole));
    assert_eq!(resumed.fit.ending, whole.fit.ending);
}

#[test]
fn driven_motions_are_refined_beside_a_chain_of_bodies() {
    let force = |t: f64, _: &[f64], _: &[f64], tau: &mut [f64]| tau[0] = drive(t);
    let (dataset, candidates) = recorded(0.02, &brief(), drive, &force);
    let selection = select(&dataset, candidates, None, &mut ()).unwrap();
    let families: Vec<&str> = selection.tried.iter().map(|own| &*own.family).collect();
    assert_eq!(refined(&selection), 1, "{families:?}");
    assert!(families.contains(&"chain"), "{families:?}");
}

#[test]
fn drag_is_found_beside_friction() {
    let selection = clean(&|t, _, qd, tau| tau[0] = drive(t) - 0.5 * qd[0] * qd[0].abs());
    let named = selection.fit.model.parameters();
    let drag = named.iter().find(|own| own.name.starts_with("drag_"));
    let drag = drag.unwrap().value;
    assert!((drag - 0.5).abs() < 0.05, "{drag} {:?}", selection.tried);
}

#[test]
fn a_drive_that_saturates_which_no_model_of_torques_has_is_left_to_a_plain_network() {
    let selection = clean(&|t, _, _, tau| tau[0] = 2.0 * (0.5 * drive(t)).tanh());
    let reason = &selection.chosen.choices[0].reason;
    assert_eq!(selection.chosen.name, "mlp", "{:?}", selection.tried);
    assert!(reason.contains("tells no torques"), "{reason}");
}

/// What is kept of driven motions without noise under these forces.
fn clean(forces: &Force<'_>) -> Selection {
    let spec = FitSpec {
        steps: Some(150),
        ..FitSpec::default()
    };
    let (dataset, candidates) = recorded(0.0, &spec, drive, forces);
    select(&dataset, candidates, None, &mut ()).unwrap()
}

#[test]
fn clean_motions_are_not_refined() {
    let (dataset, candidates) = noisy(0.0, &brief());
    let selection = select(&dataset, candidates, None, &mut ()).unwrap();
    assert_eq!(refined(&selection), 0);
}
