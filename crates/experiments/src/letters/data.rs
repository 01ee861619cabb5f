//! The 2-joint arm that writes letters, with the true parts of each torque: the data of deep Lagrangian networks.
//!
//! Trained on 17 letters, tested on e, q and v (Lutter, Ritter, Peters 2019, arXiv 1907.04490, and its code).

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::torque::{self, variances};
use lagrangian::dataset::shuffle;
use lagrangian::integrate::Method;
use lagrangian::rollout::{Hold, rollout_recorded};
use lagrangian::torque::TorqueParts;
use lagrangian::trajectory::csv;
use lagrangian::{
    Coordinates, Error, EstimateOptions, Layout, Model, Result, RolloutOptions, Signals, Trajectory,
};

/// Letters that no model is trained on.
const TEST: [&str; 3] = ["e", "q", "v"];

/// ‖q − q̂‖² beyond which a prediction is no longer valid, rad².
const THRESHOLD: f64 = 1e-2;

/// Step of a prediction, s: a quarter of the time between two samples.
const STEP: f64 = 0.01;

/// One letter: its motion with q̈ and τ, and the true parts of τ.
#[derive(Debug, Clone, PartialEq)]
pub struct Letter {
    /// The motion.
    pub motion: Trajectory,
    /// The parts of its torque.
    pub parts: TorqueParts,
}

impl Letter {
    /// The same letter written `alpha` times as fast, q(t) → q(α t), with the torque that this needs.
    #[must_use]
    pub fn faster(&self, alpha: f64) -> Self {
        let parts = torque::faster(&self.parts, alpha);
        let mut motion = self.motion.faster(alpha);
        motion.tau = parts.total();
        Self { motion, parts }
    }
}

/// All letters, divided as the protocol says.
#[derive(Debug, Clone, PartialEq)]
pub struct Letters {
    /// The joints of the arm, two angles.
    pub coordinates: Coordinates,
    /// The letters to learn from.
    pub train: Vec<Letter>,
    /// The letters to test on.
    pub test: Vec<Letter>,
}

impl Letters {
    /// Reads `characters.csv`: columns trajectory, t, q, qd, qdd, tau, and the parts inertial, coriolis, gravity.
    ///
    /// # Errors
    /// As [`csv::read`]; [`Error::Shape`] where a test letter or all others are missing.
    pub fn read(file: &[u8]) -> Result<Self> {
        let (coordinates, motions) = column(file, "tau")?;
        let [inertial, coriolis, gravity] = ["inertial", "coriolis", "gravity"].map(|part| {
            let parts = column(file, part)?.1.into_iter();
            Ok::<_, Error>(parts.map(|motion| motion.signals.tau))
        });
        let parts = inertial?.zip(coriolis?).zip(gravity?);
        let parts = parts.map(|((inertial, coriolis), gravity)| TorqueParts {
            inertial,
            coriolis,
            gravity,
            ..TorqueParts::default()
        });
        let letters = motions.into_iter().zip(parts);
        let letters = letters.map(|(motion, parts)| Letter { motion, parts });
        let is_test = |letter: &Letter| TEST.contains(&letter.motion.name.as_str());
        let (test, train): (Vec<_>, Vec<_>) = letters.partition(is_test);
        if test.len() != TEST.len() || train.is_empty() {
            return Err(Error::shape(
                "the file of letters",
                test.len(),
                TEST.len(),
                "give one with the trajectories e, q, v and others to learn from",
            ));
        }
        Ok(Self {
            coordinates,
            train,
            test,
        })
    }

    /// Motions of `count` training letters (at most all), chosen by `seed`; a larger choice contains the smaller.
    #[must_use]
    pub fn chosen(&self, count: usize, seed: u64) -> Vec<Trajectory> {
        let mut motions: Vec<Trajectory> = self.train.iter().map(|l| l.motion.clone()).collect();
        shuffle(&mut motions, &mut ChaCha8Rng::seed_from_u64(seed));
        motions.truncate(count);
        motions
    }

    /// Variance of each training torque, `[n]`, (N·m)².
    #[must_use]
    pub fn torque_variance(&self) -> Vec<f64> {
        let tau: Vec<f64> = self.train.iter().flat_map(|l| l.parts.total()).collect();
        variances(&tau, self.coordinates.dof())
    }
}

/// The letters with this column as their torque.
fn column(file: &[u8], name: &str) -> Result<(Coordinates, Vec<Trajectory>)> {
    let layout = Layout {
        angles: vec!["all".into()],
        columns: Signals {
            tau: (1..=2).map(|i| format!("{name}{i}")).collect(),
            ..Signals::default()
        },
        ..Layout::default()
    };
    let readings = csv::read(file, "characters", &layout)?.recordings;
    let coordinates = readings.first().map(|r| r.coordinates.clone());
    let options = EstimateOptions::default();
    let motions = readings
        .into_iter()
        .map(|r| Ok(r.into_trajectory(&options)?.0));
    let motions = motions.collect::<Result<Vec<_>>>()?;
    Ok((coordinates.unwrap_or(Coordinates::angles(2)), motions))
}

/// Mean time for which a prediction from the first state stays within [`THRESHOLD`], s, over the letters, by RK4 under
/// their torques held between samples. A letter that is followed to its end counts with its duration.
///
/// The torque of the data is not held: the true model parts from the letters too, and its own figure is the limit.
///
/// # Errors
/// As [`rollout_recorded`].
pub(super) fn valid_seconds(model: &dyn Model, letters: &[Letter]) -> Result<f64> {
    let options = RolloutOptions {
        method: Method::Rk4,
        step: STEP,
        ..RolloutOptions::default()
    };
    let n = model.coordinates().dof().max(1);
    let mut sum = 0.0;
    for letter in letters {
        let truth = &letter.motion;
        let found = rollout_recorded(model, truth, Hold::Previous, &options)?.trajectory;
        let pairs = truth.q.chunks_exact(n).zip(found.q.chunks_exact(n));
        let apart = |(q, own): (&[f64], &[f64])| -> f64 {
            q.iter().zip(own).map(|(x, y)| (x - y).powi(2)).sum()
        };
        let lost = pairs
            .map(apart)
            .position(|square| square >= THRESHOLD || square.is_nan())
            .unwrap_or(found.len().min(truth.len() - 1));
        sum += truth.t[lost] - truth.t[0];
    }
    Ok(sum / letters.len().max(1) as f64)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;

    /// The columns of the file for letters of this name, each of `len` samples.
    fn file(names: &[&str], len: usize) -> String {
        let mut text = String::from("trajectory,t");
        for signal in ["q", "qd", "qdd", "tau", "inertial", "coriolis", "gravity"] {
            text += &format!(",{signal}1,{signal}2");
        }
        for name in names {
            for k in 0..len {
                let t = 0.04 * k as f64;
                let row = [t.sin(), 0.2, t.cos(), 0.0, -t.sin(), 0.0, 6.0, 0.6];
                text += &format!("\n{name},{t}");
                let parts = [1.0, 0.1, 2.0, 0.2, 3.0, 0.3];
                row.iter()
                    .chain(&parts)
                    .for_each(|x| text += &format!(",{x}"));
            }
        }
        text
    }

    #[test]
    fn letters_are_read_with_the_parts_of_their_torque_and_divided_by_name() {
        let letters = Letters::read(file(&["a", "e", "b", "q", "v"], 20).as_bytes()).unwrap();
        assert_eq!((letters.train.len(), letters.test.len()), (2, 3));
        let parts = &letters.train[1].parts;
        assert_eq!((parts.coriolis[0], parts.gravity[1]), (2.0, 0.3));
        assert!((parts.total()[0] - letters.train[1].motion.tau[0]).abs() < 1e-12);
        let fast = letters.test[0].faster(2.0);
        assert!((fast.motion.signals.tau[0] - (4.0 + 8.0 + 3.0)).abs() < 1e-12);
        assert!(Letters::read(file(&["a", "e", "v"], 20).as_bytes()).is_err());
    }

    #[test]
    fn a_larger_choice_of_letters_contains_the_smaller() {
        let names = ["a", "b", "c", "d", "e", "q", "v"];
        let letters = Letters::read(file(&names, 5).as_bytes()).unwrap();
        let (two, four) = (letters.chosen(2, 7), letters.chosen(9, 7));
        assert_eq!(four.len(), 4);
        assert_eq!(two[..], four[..2]);
    }
}
