//! Verdicts on single numbers of a score: good, fair or poor, and the reason. The verdict on the whole model ([`Assessment`]) rests on
//! these limits too.

use serde::{Deserialize, Serialize};

use super::assessment::{FOLLOWED, GOOD, Grade, HALF, LOST};
use super::{Assessment, Forward, Outside, RolloutScore, Score, SignalError};
use lagrangian_motion::Coordinates;

/// A joint is passive, or nearly, where the variance of its inertial torque is more than this multiple of that of its force: inertia and
/// gravity cancel there, and the recorded force is their small remainder and noise.
pub(super) const PASSIVE: f64 = 10.0;

/// A change of a conserved quantity, or an error of a solved one, is good up to this part of the size of the quantity, and fair up
/// to `NOTICEABLE`.
const SMALL: f64 = 0.01;
const NOTICEABLE: f64 = 0.1;

/// A drive is reported as limited if it is at its limit for more than this part of the time.
const LIMITED: f64 = 0.01;

/// A verdict on one number.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Judgement {
    /// The grade of the number.
    pub grade: Grade,
    /// The reason; empty where the number itself is the reason.
    pub why: String,
}

impl Judgement {
    /// A verdict and its reason.
    pub fn new(grade: Grade, why: impl Into<String>) -> Self {
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

    /// The grade and the reason as a sentence of its own, for the first line of an answer.
    #[must_use]
    pub fn sentence(&self) -> String {
        let text = self.text();
        let (first, rest) = text.split_at(1);
        format!("{}{rest}.", first.to_uppercase())
    }
}

impl SignalError {
    /// The explained part of a signal, such as `torques`, over these coordinates, with the worst of them.
    #[must_use]
    pub fn judgement(&self, signal: &str, coordinates: &Coordinates) -> Judgement {
        let left = self.unexplained();
        let percent = |nmse: f64| match nmse {
            x if x <= 0.0 => "all".into(),
            x if x < 1e-9 => format!("all but {:.0e} %", 100.0 * x),
            x if x < 1.0 => format!("{} %", explained(100.0 * x)),
            _ => "nothing".into(),
        };
        let pairs = coordinates.0.iter().zip(&self.nmse);
        let known = pairs.filter(|(_, nmse)| self.nmse.len() > 1 && !nmse.is_nan());
        let worst = known.max_by(|a, b| a.1.total_cmp(b.1));
        let worst = worst.map_or(String::new(), |(own, nmse)| {
            format!("; least: {}, {}", own.name, percent(*nmse))
        });
        let why = match left < 1.0 {
            true => format!(
                "it explains {} of the variance of the {signal}{worst}",
                percent(left)
            ),
            false => format!("it predicts the {signal} no better than by their mean"),
        };
        Judgement::new(Grade::of_error(left), why)
    }
}

/// The explained percentage, 100 less this unexplained one, of which two digits are significant.
fn explained(left: f64) -> String {
    let digits = 1 - left.log10().floor().clamp(-8.0, 1.0) as i32;
    format!("{:.1$}", 100.0 - left, digits.unsigned_abs() as usize)
}

impl Grade {
    /// The word of the grade.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Good => "good",
            Self::Fair => "fair",
            Self::Poor => "poor",
        }
    }

    /// The grade of a squared error over the variance of its signal.
    #[must_use]
    pub fn of_error(nmse: f64) -> Self {
        match nmse {
            x if x <= GOOD => Self::Good,
            x if x <= HALF => Self::Fair,
            _ => Self::Poor,
        }
    }

    /// The grade of a change of a conserved quantity, or of an error of a solved one, as a part of the size of the quantity.
    #[must_use]
    pub fn of_change(part: f64) -> Self {
        match part {
            x if x <= SMALL => Self::Good,
            x if x <= NOTICEABLE => Self::Fair,
            _ => Self::Poor,
        }
    }
}

/// Root mean square errors with which a coordinate follows a reference, rad or m; NaN where the motion diverged.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrackingErrors {
    /// Errors with the torques of the model and feedback.
    pub model: f64,
    /// Errors with feedback alone.
    pub feedback: f64,
    /// Errors with the torques of the true model.
    pub truth: f64,
    /// The part of the time for which the drive was at its limit.
    pub at_limit: f64,
}

impl TrackingErrors {
    /// The part of the gain of the true model over feedback alone that the model reaches.
    #[must_use]
    pub fn judgement(&self) -> Judgement {
        let possible = self.feedback - self.truth;
        let gained = (self.feedback - self.model) / possible;
        let share = format!(
            "{:.0} % of what the true model gains over feedback alone",
            100.0 * gained
        );
        let (grade, why) = match gained {
            _ if !self.model.is_finite() => (Grade::Poor, "the motion diverged".into()),
            _ if !possible.is_finite() => {
                let why =
                    "feedback alone or the true model diverged: there is nothing to compare with";
                (Grade::Fair, why.into())
            }
            _ if possible <= 0.0 => {
                let why = "even the true model gains nothing over feedback alone";
                (Grade::Fair, why.into())
            }
            x if x >= FOLLOWED => (Grade::Good, share),
            x if x >= HALF => (Grade::Fair, share),
            x if x > 0.0 => (Grade::Poor, share),
            _ => {
                let why = "no better than feedback alone";
                (Grade::Poor, why.into())
            }
        };
        if self.at_limit <= LIMITED {
            return Judgement { grade, why };
        }
        let limited = format!(
            "the drive is at its limit in {:.0} % of the time",
            100.0 * self.at_limit
        );
        Judgement::new(grade, format!("{why}; {limited}"))
    }
}

/// A reason for states outside of the data of a model, which make a result fair at best; `None` where few lie there.
#[must_use]
pub fn extrapolation(outside: Option<&Outside>) -> Option<Judgement> {
    let why = extrapolated("", outside);
    (!why.is_empty()).then(|| Judgement::new(Grade::Fair, why))
}

impl Score {
    /// The error of the torque of coordinate `i`. A joint without a drive is distinguished from one that is not understood.
    #[must_use]
    pub fn torque_judgement(&self, i: usize, assessment: &Assessment) -> Option<Judgement> {
        let nmse = *self.torque.as_ref()?.nmse.get(i)?;
        let grade = Grade::of_error(nmse);
        if grade == Grade::Good {
            return Some(Judgement::new(grade, ""));
        }
        if !nmse.is_finite()
            && let Some(own) = self.acceleration_judgement(i, assessment)
        {
            let why = "a force that never changes: its acceleration is judged";
            return Some(Judgement::new(own.grade, why));
        }
        let joint = assessment.joints.get(i);
        let is_passive =
            |joint: &&Forward| joint.counts_beside_inertia() && joint.inertial_share.is_finite();
        if let Some(joint) = joint.filter(is_passive) {
            // A joint without a drive is compared to the torques that cancel there.
            let beside = Grade::of_error(nmse / joint.inertial_share).max(Grade::Fair);
            let why = "a passive joint, or nearly: its force is a small remainder of inertia and gravity, which cancel there";
            return Some(Judgement::new(beside, why));
        }
        Some(self.judgement(nmse))
    }

    /// The error of the acceleration of coordinate `i`; it cannot be predicted where friction and noise hide inertia.
    #[must_use]
    pub fn acceleration_judgement(&self, i: usize, assessment: &Assessment) -> Option<Judgement> {
        let nmse = *self.acceleration.as_ref()?.nmse.get(i)?;
        let grade = Grade::of_error(nmse);
        if grade == Grade::Good {
            return Some(Judgement::new(grade, ""));
        }
        if assessment.joints.get(i).is_some_and(|joint| {
            // Of a coordinate without a force nothing hides it.
            nmse.is_finite() && joint.inertial_share.is_finite() && !joint.predictable
        }) {
            let why = "below the noise: inertia is less of the torque than what stays unexplained, so that it cannot be predicted";
            return Some(Judgement::new(Grade::Fair, why));
        }
        Some(self.judgement(nmse))
    }

    /// An error whose only cause is the model, or states outside of its data.
    fn judgement(&self, nmse: f64) -> Judgement {
        let why = match nmse {
            x if x.is_nan() || x >= 1.0 => "no better than the mean of the signal",
            _ => "",
        };
        let why = extrapolated(why, self.outside.as_ref());
        Judgement::new(Grade::of_error(nmse), why)
    }

    /// The time for which motion `k` is followed, of the time for which it can be predicted.
    #[must_use]
    pub fn motion_judgement(&self, k: usize) -> Option<Judgement> {
        let rollout = self.rollouts.get(k)?;
        Some(rollout.judgement(self.outside.as_ref()))
    }
}

impl RolloutScore {
    fn judgement(&self, outside: Option<&Outside>) -> Judgement {
        let possible = self.predictable_seconds;
        if !self.exceeded {
            return Judgement::new(Grade::Good, "to its end");
        }
        if possible <= 0.0 {
            let why = "how long it can be predicted is not known: it is noisy, or too short";
            return Judgement::new(Grade::Fair, why);
        }
        let followed = self.followed_seconds / possible;
        let expected = format!("{possible:.2} s for which a model can be expected to follow it");
        let closer = match self.followed_seconds < self.valid_seconds {
            // A free motion is followed more closely than that.
            true => format!(
                "with half of that error for {:.2} s, ",
                self.followed_seconds
            ),
            false => String::new(),
        };
        let why = match followed {
            x if x >= 1.0 => format!("{closer}at least the {expected}"),
            x if x >= FOLLOWED => format!("{closer}nearly the {expected}"),
            _ => format!("{closer}less than the {expected}"),
        };
        match followed {
            x if x >= FOLLOWED => Judgement::new(Grade::Good, why),
            x if x >= LOST => Judgement::new(Grade::Fair, extrapolated(&why, outside)),
            _ => Judgement::new(Grade::Poor, extrapolated(&why, outside)),
        }
    }
}

/// A reason, with a remark that the states lie outside of the data where many do.
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

    fn score(nmse: &[f64]) -> Score {
        Score {
            samples: 100,
            acceleration: None,
            acceleration_noise: 0.0,
            torque_noise: Vec::new(),
            torque: Some(SignalError::new(nmse.to_vec(), &vec![1.0; nmse.len()])),
            rollouts: Vec::new(),
            restarts: Vec::new(),
            forecast: None,
            singular: 0,
            outside: None,
            stopped: 0,
        }
    }

    /// An assessment of joints whose inertial torques have these parts of the variance of their forces.
    fn assessed(shares: &[f64]) -> Assessment {
        let joint = |share: &f64| Forward {
            name: String::new(),
            inertial_share: *share,
            unexplained: 0.0,
            acceleration_nmse: 0.0,
            predictable: true,
        };
        Assessment {
            verdict: Grade::Good,
            reasons: Vec::new(),
            joints: shares.iter().map(joint).collect(),
            inertia: None,
            forecast: None,
            expectation: String::new(),
        }
    }

    fn grades(score: &Score, shares: &[f64]) -> Vec<Grade> {
        let assessment = assessed(shares);
        let judgements = (0..9).filter_map(|i| score.torque_judgement(i, &assessment));
        judgements.map(|own| own.grade).collect()
    }

    #[test]
    fn an_error_of_many_times_the_variance_is_poor_unless_the_joint_is_passive() {
        let found = score(&[0.01, 0.3, 21.0]);
        let driven = [Grade::Good, Grade::Fair, Grade::Poor];
        assert_eq!(grades(&found, &[0.5; 3]), driven);
        assert_eq!(grades(&found, &[]), driven);
        let passive = [Grade::Good, Grade::Fair, Grade::Fair];
        assert_eq!(grades(&found, &[300.0; 3]), passive);
        assert_eq!(grades(&found, &[12.0; 3]), driven);
        // Weights of 1e300: forces that are not finite cancel nowhere.
        assert_eq!(grades(&found, &[f64::INFINITY; 3]), driven);
        let why = found.torque_judgement(2, &assessed(&[300.0; 3]));
        assert!(why.is_some_and(|own| own.why.contains("passive")));
        let why = found.torque_judgement(2, &assessed(&[0.5; 3]));
        assert!(why.is_some_and(|own| own.why.contains("no better")));
    }

    #[test]
    fn a_signal_is_judged_as_a_whole_beside_its_worst_coordinate() {
        let coordinates = Coordinates::lines(3);
        let sentence = |nmse: &[f64]| {
            let error = SignalError::new(nmse.to_vec(), &vec![1.0; nmse.len()]);
            error.judgement("torques", &coordinates).sentence()
        };
        assert_eq!(
            sentence(&[0.001, 0.02, 0.129]),
            "Good: it explains 95.0 % of the variance of the torques; least: q3, 87 %."
        );
        assert_eq!(
            sentence(&[0.000_012_3]),
            "Good: it explains 99.9988 % of the variance of the torques."
        );
        let exact = "Good: it explains all but 7e-11 % of the variance of the torques.";
        assert_eq!(sentence(&[7e-13]), exact);
        let lost = sentence(&[2.0, 3.0]);
        assert!(
            lost.starts_with("Poor: ") && lost.contains("no better"),
            "{lost}"
        );
    }

    #[test]
    fn what_can_be_expected_of_a_motion_is_told_beside_what_it_is() {
        let judgement = |followed: f64, valid: f64| {
            let rollout = RolloutScore {
                outcome: lagrangian_mechanics::Outcome::Finished,
                duration: 5.0,
                valid_seconds: valid,
                exceeded: true,
                followed_seconds: followed,
                predictable_seconds: 0.6,
                q_mean_absolute: vec![0.1],
            };
            rollout.judgement(None).text()
        };
        assert!(judgement(4.8, 4.8).starts_with("good: at least the 0.60 s"));
        assert!(judgement(0.55, 0.55).starts_with("good: nearly the 0.60 s"));
        assert!(judgement(0.1, 0.1).contains(": less than the 0.60 s"));
        let closer = judgement(0.55, 4.8);
        assert!(
            closer.contains("with half of that error for 0.55 s, nearly the 0.60 s"),
            "{closer}"
        );
    }

    #[test]
    fn a_model_is_worth_what_it_gains_over_feedback() {
        let errors = |model, truth| TrackingErrors {
            model,
            feedback: 0.1,
            truth,
            at_limit: 0.0,
        };
        let grade = |own: TrackingErrors| own.judgement().grade;
        assert_eq!(grade(errors(0.02, 0.01)), Grade::Good);
        assert_eq!(grade(errors(0.04, 0.01)), Grade::Fair);
        assert_eq!(grade(errors(0.04, 0.03)), Grade::Good);
        assert_eq!(grade(errors(0.08, 0.0)), Grade::Poor);
        assert_eq!(grade(errors(f64::NAN, 0.0)), Grade::Poor);
        assert!(errors(0.2, 0.0).judgement().why.contains("no better"));
        let alone = TrackingErrors {
            feedback: f64::NAN,
            ..errors(0.02, 0.01)
        };
        assert!(alone.judgement().why.contains("diverged"));
        // Where the truth gains nothing, the model is not to blame.
        assert_eq!(grade(errors(0.1, 0.1)), Grade::Fair);
        let limited = TrackingErrors {
            at_limit: 0.3,
            ..errors(0.02, 0.0)
        };
        assert!(
            limited
                .judgement()
                .why
                .contains("limit in 30 % of the time")
        );
    }

    #[test]
    fn what_should_be_constant_may_change_by_a_hundredth_of_its_size() {
        let found = [0.0, 0.01, 0.05, 0.5, f64::NAN].map(Grade::of_change);
        let (good, poor) = (Grade::Good, Grade::Poor);
        assert_eq!(found, [good, good, Grade::Fair, poor, poor]);
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
            ..score(&[0.3])
        };
        let why = found.torque_judgement(0, &assessed(&[])).map(|own| own.why);
        assert!(why.is_some_and(|why| why.contains("40 % of the states")));
    }
}
