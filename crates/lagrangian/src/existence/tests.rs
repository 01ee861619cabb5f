#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
use super::*;
use crate::experiment::existence::{System, noisy};
use crate::train::Budget;
use crate::{Error, Trajectory};

fn surveyed(system: System, recordings: &[Trajectory]) -> Survey {
    let config = SurveyConfig {
        budget: Budget::Steps(80),
        ..SurveyConfig::default()
    };
    survey(&system.coordinates().unwrap(), recordings, &config, &mut ()).unwrap()
}

#[test]
fn a_pendulum_needs_no_friction_and_one_with_dry_friction_does() {
    for system in [System::Pendulum, System::CoulombPendulum] {
        let found = surveyed(system, &system.recordings(16, 1).unwrap());
        assert_eq!(
            found.verdict.existence,
            system.truth(),
            "{:?}",
            found.verdict
        );
        // Four recordings are held out of the sixteen.
        assert!(
            (0.9..=0.9375).contains(&found.verdict.confidence),
            "{:?}",
            found.verdict
        );
    }
}

#[test]
fn noise_bounds_what_can_be_said_of_hidden_forces() {
    let system = System::Pendulum;
    let clean = system.recordings(16, 1).unwrap();
    let recordings = noisy(clean, 0.05, 7);
    let found = surveyed(system, &recordings);
    assert_eq!(
        found.verdict.existence,
        Existence::Lagrangian,
        "{:?}",
        found.verdict
    );
    let qdd: Vec<f64> = recordings
        .iter()
        .flat_map(|r| r.qdd.clone().unwrap())
        .collect();
    let size = (qdd.iter().map(|x| x * x).sum::<f64>() / qdd.len() as f64).sqrt();
    // A force must add thrice the variance of the noise to double the error.
    assert!(
        (found.hidden[0] / (3.0_f64.sqrt() * 0.05 * size) - 1.0).abs() < 0.3,
        "{found:?}"
    );
}

#[test]
fn one_recording_is_enough_for_a_guess_and_not_for_certainty() {
    let system = System::CoulombPendulum;
    let found = surveyed(system, &system.recordings(1, 1).unwrap());
    assert!(found.verdict.confidence <= 0.75, "{:?}", found.verdict);
    assert_eq!(found.unrestricted.squares.len(), 8);
}

#[test]
fn too_few_samples_are_refused_with_their_number() {
    let system = System::Pendulum;
    let short = system.recordings(1, 1).unwrap()[0].part(0..60);
    let refused = survey(
        &system.coordinates().unwrap(),
        &[short],
        &SurveyConfig::default(),
        &mut (),
    );
    assert!(
        matches!(refused, Err(Error::TooShort { found: 60, .. })),
        "{refused:?}"
    );
}
