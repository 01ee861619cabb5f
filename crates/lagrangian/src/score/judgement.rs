//! Verdicts on single numbers of a score: good, fair or poor, and why. The verdict on the whole model ([`Assessment`]) rests on the
//! same limits.

use serde::{Deserialize, Serialize};

use super::assessment::{FOLLOWED, GOOD, Grade, HALF, LOST};
use super::{Assessment, Outside, RolloutScore, Score, SignalError};

/// A joint is passive whose recorded force has less than this part of the largest variance of all joints: what is recorded there is
/// mostly noise.
const PASSIVE: f64 = 1e-3;

/// A verdict on one number.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Judgement {
    /// How good it is.
    pub grade: Grade,
    /// Why; empty where the number says it.
    pub why: String,
}

impl Judgement {
    fn new(grade: Grade, why: impl Into<String>) -> Self {
        Self {
            grade,
            why: why.into(),
        }
    }

    /// The grade and the reason, for a line of text.
    #[must_use]
    pub fn text(&self) -> String {
        match self.why.is_empty() {
            true => self.grade.name().into(),
            false => format!("{}: {}", self.grade.name(), self.why),
        }
    }
}

impl Grade {
    /// Its word.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Good => "good",
            Self::Fair => "fair",
            Self::Poor => "poor",
        }
    }

    /// Of a squared error over the variance of its signal.
    #[must_use]
    pub fn of_error(nmse: f64) -> Self {
        match nmse {
            x if x <= GOOD => Self::Good,
            x if x <= HALF => Self::Fair,
            _ => Self::Poor,
        }
    }
}

impl Score {
    /// The error of the torque of coordinate `i`. A joint without a drive is told from one that is not understood.
    #[must_use]
    pub fn judged_torque(&self, i: usize) -> Option<Judgement> {
        let error = self.torque.as_ref()?;
        let (nmse, mse) = (*error.nmse.get(i)?, *error.mse.get(i)?);
        let grade = Grade::of_error(nmse);
        if grade == Grade::Good {
            return Some(Judgement::new(grade, ""));
        }
        let all = variances(error);
        let largest = all.iter().copied().fold(0.0, f64::max);
        if all.get(i).is_none_or(|own| *own < PASSIVE * largest) {
            // Beside the forces of the other joints: what is asked of a joint without a drive.
            let beside = Grade::of_error(mse / largest).max(Grade::Fair);
            let why = "a passive joint: hardly any force is recorded there, so that this part compares the error with noise";
            return Some(Judgement::new(beside, why));
        }
        let why = match nmse {
            x if x.is_nan() || x >= 1.0 => "no better than the mean of the signal",
            _ => "",
        };
        Some(Judgement::new(
            grade,
            extrapolated(why, self.outside.as_ref()),
        ))
    }

    /// The error of the acceleration of coordinate `i`; where friction and noise hide inertia, nobody can predict it.
    #[must_use]
    pub fn judged_acceleration(&self, i: usize, assessment: &Assessment) -> Option<Judgement> {
        let nmse = *self.acceleration.as_ref()?.nmse.get(i)?;
        let grade = Grade::of_error(nmse);
        if grade == Grade::Good {
            return Some(Judgement::new(grade, ""));
        }
        if assessment
            .joints
            .get(i)
            .is_some_and(|joint| !joint.predictable)
        {
            let why = "below the noise: inertia is less of the torque than what stays unexplained, so that nobody can predict it";
            return Some(Judgement::new(Grade::Fair, why));
        }
        let why = match nmse {
            x if x.is_nan() || x >= 1.0 => "no better than the mean of the signal",
            _ => "",
        };
        Some(Judgement::new(
            grade,
            extrapolated(why, self.outside.as_ref()),
        ))
    }

    /// The time for which motion `k` is followed, of the time for which it can be predicted.
    #[must_use]
    pub fn judged_motion(&self, k: usize) -> Option<Judgement> {
        let rollout = self.rollouts.get(k)?;
        Some(rollout.judged(self.outside.as_ref()))
    }
}

impl RolloutScore {
    fn judged(&self, outside: Option<&Outside>) -> Judgement {
        let possible = self.predictable_seconds;
        if !self.exceeded {
            return Judgement::new(Grade::Good, "to its end");
        }
        if possible <= 0.0 {
            let why = "how long it can be predicted is not known: it is noisy, or too short";
            return Judgement::new(Grade::Fair, why);
        }
        let why = format!("it can be predicted for {possible:.2} s");
        match self.followed_seconds / possible {
            x if x >= FOLLOWED => Judgement::new(Grade::Good, why),
            x if x >= LOST => Judgement::new(Grade::Fair, extrapolated(&why, outside)),
            _ => Judgement::new(Grade::Poor, extrapolated(&why, outside)),
        }
    }
}

/// The variances of a signal, `[n]`.
fn variances(error: &SignalError) -> Vec<f64> {
    let variance = |(mse, nmse): (&f64, &f64)| mse / nmse;
    let all = error.mse.iter().zip(&error.nmse).map(variance);
    all.map(|x| if x.is_finite() { x } else { 0.0 }).collect()
}

/// A reason, and that the states lie outside of the data where many do.
fn extrapolated(why: &str, outside: Option<&Outside>) -> String {
    let far = outside.filter(|outside| outside.is_unusual());
    let Some(outside) = far else {
        return why.into();
    };
    let share = 100.0 * outside.share;
    let far =
        format!("{share:.0} % of the states lie outside of those that the model was fitted to");
    match why.is_empty() {
        true => far,
        false => format!("{why}; {far}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn score(mse: &[f64], variance: &[f64]) -> Score {
        Score {
            samples: 100,
            acceleration: None,
            torque: Some(SignalError::new(mse.to_vec(), variance)),
            rollouts: Vec::new(),
            restarts: Vec::new(),
            singular: 0,
            outside: None,
            stopped: 0,
        }
    }

    #[test]
    fn an_error_of_many_times_the_variance_is_poor_unless_the_joint_is_passive() {
        let found = score(&[0.01, 0.21], &[1.0, 0.01]);
        let judged = |score: &Score, i| score.judged_torque(i).map(|j| (j.grade, j.why));
        assert_eq!(judged(&found, 0), Some((Grade::Good, String::new())));
        let poor = judged(&found, 1).unwrap_or((Grade::Good, String::new()));
        assert!(
            poor.0 == Grade::Poor && poor.1.contains("no better"),
            "{poor:?}"
        );
        // 2100 % of what is hardly there.
        let passive = score(&[0.01, 0.002], &[1.0, 1e-4]);
        let fair = judged(&passive, 1).unwrap_or((Grade::Good, String::new()));
        assert!(
            fair.0 == Grade::Fair && fair.1.contains("passive"),
            "{fair:?}"
        );
        assert_eq!(judged(&passive, 2), None);
    }

    #[test]
    fn states_outside_of_the_data_are_a_reason() {
        let outside = Some(Outside {
            share: 0.4,
            farthest: 3.0,
            beyond: None,
        });
        let found = Score {
            outside,
            ..score(&[0.3], &[1.0])
        };
        let why = found.judged_torque(0).map(|j| j.why).unwrap_or_default();
        assert!(why.contains("40 % of the states"), "{why}");
    }
}
