//! The reliability of a model, from its errors on motions that it has not seen.

use serde::{Deserialize, Serialize};

use super::CandidateResult;
use super::inertia::{Forward, Spectrum, forwards, poles, spectrum};
use super::judgement::PASSIVE;
use super::speed::weakened;
use super::work::unknown_work;
use super::{Errors, Forecast, RestartScore, RolloutScore, Score, SignalError, add_torques};
use crate::models::{Entry, Learned};
use lagrangian_mechanics::Model;
use lagrangian_motion::statistics::sort_by_number;
use lagrangian_motion::{Coordinates, Trajectory};
use lagrangian_motion::{Signal, Stop};
use lagrangian_recordings::check::{CheckReport, Item, LARGEST};

/// A model explains a signal well where the squared error is below this part of the variance.
pub(super) const GOOD: f64 = 0.1;
/// Accelerations of which more than this part is left are predicted no better than by their mean.
const NO_BETTER: f64 = 0.9;
/// A model of torques that leaves more than this part of their variance is of no use.
pub(crate) const HALF: f64 = 0.5;
/// A model learned on top of a nominal one makes it worse where errors are more than this multiple of the nominal ones.
const WORSE: f64 = 1.02;
/// The scaled mass matrix is nearly singular where its smallest eigenvalue is below this.
const NEARLY_SINGULAR: f64 = 1e-7;

/// The reliability of a model.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Grade {
    /// The model explains the recordings.
    Good,
    /// The model can be used, with the given reservations.
    Fair,
    /// The model must not be used.
    Poor,
}

/// A verdict on a model, with its grounds.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Assessment {
    /// The reliability of the model.
    pub verdict: Grade,
    /// The reasons against a better verdict, the gravest first; empty for a good one.
    pub reasons: Vec<Reason>,
    /// The error a short time ahead that new motions can expect; `None` where it is unknown.
    pub forecast: Option<Forecast>,
    /// The same in words; empty where it is unknown.
    pub expectation: String,
    /// The forward dynamics of each coordinate of a driven machine; empty for free motions, and for a model without a mass matrix.
    pub joints: Vec<Forward>,
    /// The eigenvalues of the mass matrix over the motions, where the model has one.
    pub inertia: Option<Spectrum>,
}

/// A reason for a verdict.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Reason {
    /// The gravity of the reason.
    pub grade: Grade,
    /// The finding.
    pub finding: String,
    /// The remedy.
    pub remedy: String,
}

impl Assessment {
    /// Assesses a model by its score on motions that it has not seen.
    #[must_use]
    pub fn new(model: &dyn Model, motions: &[Trajectory], score: &Score) -> Self {
        Self::with_forecast(model, motions, (score, score.forecast), false)
    }

    /// The same of a model that was learned: a law says more of new motions.
    #[must_use]
    pub fn of_learned(model: &Learned, motions: &[Trajectory], score: &Score) -> Self {
        let is_law = model.written().is_some_and(|own| own.is_law());
        let forecast = score.forecast.map(|own| match is_law {
            true => own.of_law(),
            false => own,
        });
        Self::with_forecast(model, motions, (score, forecast), is_law)
    }

    fn with_forecast(
        model: &dyn Model,
        motions: &[Trajectory],
        (score, forecast): (&Score, Option<Forecast>),
        is_law: bool,
    ) -> Self {
        let inertia = spectrum(model, motions);
        let joints = forwards(model, motions, score);
        let ahead = match model.driven() {
            Some(_) => of_positions(motions, score),
            None => of_forecast((score, forecast), &joints),
        };
        // The long rollouts of a law that predicts err by the noise of the first state alone; accelerations of what it explains were estimated.
        let follows = is_law && ahead.is_none();
        let estimated = is_law && forecast.is_some() && joints.is_empty();
        let mut reasons = Vec::new();
        reasons.extend(of_numbers(motions, score));
        reasons.extend(of_torques(score, model.coordinates(), &joints));
        reasons.extend(of_nominal(model, motions, score));
        reasons.extend(of_accelerations(score, &joints).filter(|_| !estimated));
        reasons.extend(of_passive(model.coordinates(), score, &joints));
        reasons.extend(of_speed(model, motions, score));
        reasons.extend(of_work(model, motions, score));
        reasons.extend(inertia.and_then(of_inertia));
        reasons.extend(of_poles(model, motions));
        reasons.extend(of_motions(score).filter(|_| !follows));
        reasons.extend(ahead);
        let assessment = Self {
            verdict: Grade::Good,
            reasons: Vec::new(),
            forecast,
            expectation: forecast.map_or(String::new(), |own| own.sentence()),
            joints,
            inertia,
        };
        assessment.with(reasons)
    }

    /// The assessment of a model of the data of this check: where the values themselves look wrong no model of them is good,
    /// however well it explains them.
    #[must_use]
    pub fn of_checked(self, check: &CheckReport) -> Self {
        let mut doubts: Vec<Reason> = Vec::new();
        let short = self.verdict > Grade::Good;
        let is_said = |item: &&Item| item.doubtful || item.decides() || short && item.explains();
        for item in check.items.iter().filter(is_said) {
            let what = if item.doubtful {
                "the data look wrong"
            } else {
                "it may be this that is missing"
            };
            let finding = format!("{what}: {}: {}", item.name, item.finding);
            // Too little motion is a reservation; values that contradict themselves make a model of nothing.
            let grade = Grade::of_defect(item.contradicts());
            let remedy = item.remedy.clone().unwrap_or_default();
            // One of a kind is enough: the check has all of them.
            if !doubts.iter().any(|r| r.remedy == remedy) {
                doubts.push(Reason::new(grade, finding, remedy));
            }
        }
        self.with(doubts)
    }

    /// The assessment of a model that was selected from several: a description of the robot that explains much less than a model
    /// without it is that of another robot.
    #[must_use]
    pub fn of_selected(self, candidates: &[CandidateResult]) -> Self {
        self.with(of_description(candidates))
    }

    /// The assessment with more reasons.
    fn with(mut self, reasons: impl IntoIterator<Item = Reason>) -> Self {
        self.reasons.extend(reasons);
        sort_by_number(&mut self.reasons, |r| -f64::from(r.grade as u8));
        self.verdict = self.reasons.first().map_or(Grade::Good, |r| r.grade);
        self
    }
}

/// A robot whose description leaves at least this multiple of the torque error of a model without it …
const DESCRIBED: f64 = 3.0;
/// … and this part of their variance.
const UNDESCRIBED: f64 = 0.02;

fn of_description(candidates: &[CandidateResult]) -> Option<Reason> {
    let error = |robot: bool| {
        let kind = |entry: &Entry| entry.jointed && entry.takes_a_robot() == robot;
        let own = |c: &&CandidateResult| Entry::by_name(&c.family).is_ok_and(kind);
        candidates.iter().filter(own).find_map(|c| c.torque_nmse)
    };
    let (described, free) = (error(true)?, error(false)?);
    (described > DESCRIBED * free && described > UNDESCRIBED).then(|| {
        let finding = format!(
            "the description contradicts the log: its robot leaves {:.1} % of the torques unexplained, a chain without it {:.1} %",
            100.0 * described,
            100.0 * free
        );
        let remedy = "check that the description is that of this robot, in m and rad, its joints in the order of the data (`joints`), positions without an offset";
        Reason::new(Grade::Poor, finding, remedy)
    })
}

impl Grade {
    /// The grade of a model with a defect, which may make it useless.
    fn of_defect(useless: bool) -> Self {
        if useless { Self::Poor } else { Self::Fair }
    }
}

impl Reason {
    fn new(grade: Grade, finding: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self {
            grade,
            finding: finding.into(),
            remedy: remedy.into(),
        }
    }
}

const MODEL: &str =
    "check the data (signs, units and order of the torques), or choose another model";

/// Errors that are NaN, and values beyond all recorded ones, whatever the other errors are.
fn of_numbers(motions: &[Trajectory], score: &Score) -> Option<Reason> {
    let finite = |errors: &[f64]| errors.iter().all(|e| e.is_finite());
    let signal = |error: &Option<SignalError>| error.as_ref().is_none_or(|e| finite(&e.mse));
    let motion = |r: &RolloutScore| !r.outcome.is_finished() || finite(&r.q_mean_absolute);
    let short = |r: &RestartScore| r.unfinished == r.starts || finite(&r.q_rms);
    let mut recorded = motions.iter().flat_map(|m| m.signals.iter());
    let known = [
        (
            "recorded values",
            recorded.all(|(_, values)| values.iter().all(|x| x.abs() <= LARGEST)),
        ),
        ("errors of torques", signal(&score.torque)),
        ("errors of accelerations", signal(&score.acceleration)),
        ("errors of motions", score.rollouts.iter().all(motion)),
        ("errors over short times", score.restarts.iter().all(short)),
    ];
    let lost: Vec<&str> = known.iter().filter(|own| !own.1).map(|own| own.0).collect();
    let finding = format!("{} are not finite, or above 1e100", lost.join(" and "));
    let remedy = "remove such values, which `lagrangian check` names; if there are none, the model is damaged: fit it again";
    (!lost.is_empty()).then(|| Reason::new(Grade::Poor, finding, remedy))
}

/// Torques of a model that has inverse dynamics.
fn of_torques(score: &Score, coordinates: &Coordinates, joints: &[Forward]) -> Vec<Reason> {
    let Some(error) = &score.torque else {
        return Vec::new();
    };
    let error = &error.without(&score.torque_noise);
    let mean = match joints.is_empty() {
        // Nothing identifies a joint without a drive, whose noise is no reason against a model: all squares count alike.
        true => error.unexplained(),
        false => driven(error, joints),
    };
    let grade = Grade::of_error(mean);
    let share = |k: usize| joints.get(k).map_or(0.0, |j| j.inertial_share);
    let is_passive = |k: usize| share(k) > PASSIVE;
    // Beside a joint whose own torque is lost, what cancels there is what is explained.
    let cancels = (0..error.nmse.len()).any(|k| is_passive(k) && error.nmse[k] >= 1.0);
    let of_what = match cancels {
        true => "what acts on the joints, inertia included",
        false => "the torques",
    };
    let finding = match mean < 1.0 {
        true => format!("it explains {:.0} % of {of_what}", 100.0 * (1.0 - mean)),
        false => format!("it predicts torques no better than their mean (nMSE {mean:.3})"),
    };
    let remedy = match grade {
        Grade::Poor => MODEL,
        _ => "record more and faster motions, or choose another model",
    };
    let mut reasons = Vec::new();
    if grade > Grade::Good {
        reasons.push(Reason::new(grade, finding, remedy));
    }
    let names = coordinates.0.iter().map(|c| c.name.as_str());
    let is_remainder = |k: usize| joints.get(k).is_some_and(Forward::is_remainder);
    let lost = names
        .zip(&error.nmse)
        .enumerate()
        .filter(|(k, (_, e))| **e >= 1.0 && !is_remainder(*k) && share(*k).is_finite());
    // Each joint counts by itself, except where inertia and gravity cancel and noise remains: its acceleration tells then.
    let (passive, lost): (Vec<_>, Vec<_>) = lost.partition(|(k, _)| is_passive(*k));
    let small = "small beside the inertia that it balances, and ";
    for (grade, joints, small) in [(Grade::Poor, lost, ""), (Grade::Fair, passive, small)] {
        let names: Vec<&str> = joints.into_iter().map(|(_, (name, _))| name).collect();
        if !names.is_empty() && mean < 1.0 {
            let finding = format!(
                "the torque of {} is {small}predicted no better than its mean",
                names.join(", ")
            );
            let remedy =
                "excite these coordinates more, and check the signs and units of their torques";
            reasons.push(Reason::new(grade, finding, remedy));
        }
    }
    reasons
}

/// A network on top of a nominal model that is worse than that model alone.
fn of_nominal(model: &dyn Model, motions: &[Trajectory], score: &Score) -> Option<Reason> {
    let own = score.torque.as_ref()?.nmse_mean;
    let mut torques = Errors::new(model.coordinates().dof());
    let nominal = model.nominal()?;
    motions
        .iter()
        .for_each(|m| add_torques(nominal, m, Stop::default(), &mut torques));
    let alone = torques.finish()?.nmse_mean;
    let finding = format!(
        "what was learned makes the torques worse than those of the nominal model alone (nMSE {own:.3} against {alone:.3})"
    );
    let remedy = "use the description itself, or record motions like these and fit again";
    (own > WORSE * alone).then(|| Reason::new(Grade::Poor, finding, remedy))
}

/// The mean of the errors of all joints; that of a joint whose torque is small beside the torques that cancel there counts beside those.
fn driven(error: &SignalError, joints: &[Forward]) -> f64 {
    let beside = |(nmse, joint): (&f64, &Forward)| match joint.inertial_share {
        share if share.is_infinite() => 0.0,
        share if joint.counts_beside_inertia() => nmse / share,
        _ => *nmse,
    };
    error.nmse.iter().zip(joints).map(beside).sum::<f64>() / joints.len() as f64
}

/// Accelerations: of free motions by their error, of a driven machine where they can be predicted.
fn of_accelerations(score: &Score, joints: &[Forward]) -> Option<Reason> {
    let error = score.acceleration.as_ref()?;
    if let Some(torque) = score.torque.as_ref().filter(|_| !joints.is_empty()) {
        // Of torques that are not predicted either another reason speaks.
        return of_driven(joints).filter(|_| torque.unexplained() < 1.0);
    }
    let mean = error.nmse_mean;
    let finding = format!("the squared error of its accelerations is {mean:.3} of their variance");
    // What is no noise is of their variance too: a mean would leave no more.
    let noise = score.acceleration_noise;
    let most = if noise < 1.0 { 1.0 - noise } else { 1.0 };
    let (grade, remedy) = match mean - noise {
        x if x <= GOOD => return None,
        x if x < NO_BETTER * most => (
            Grade::Fair,
            "fit longer, or record more motions with less noise",
        ),
        _ => (
            Grade::Poor,
            "check the data with more care (units, angles, noise), fit longer, or choose another model",
        ),
    };
    Some(Reason::new(grade, finding, remedy))
}

/// The accelerations of coordinates without a force, which are all that there is to predict of them.
fn of_passive(coordinates: &Coordinates, score: &Score, joints: &[Forward]) -> Option<Reason> {
    let (error, noise) = (score.acceleration.as_ref()?, score.acceleration_noise);
    let most = if noise < 1.0 { 1.0 - noise } else { 1.0 };
    let each = coordinates.0.iter().zip(joints).zip(&error.nmse);
    let lost =
        each.filter(|((_, joint), e)| joint.inertial_share == f64::INFINITY && *e - noise >= most);
    let names: Vec<&str> = lost.map(|((own, _), _)| own.name.as_str()).collect();
    (!names.is_empty()).then(|| {
        let finding = format!(
            "the acceleration of {}, which no force drives, is predicted no better than its mean",
            names.join(", ")
        );
        let remedy = "choose another model, or record wider motions; a low-pass may have spoiled these (`low_pass` 0)";
        Reason::new(Grade::Poor, finding, remedy)
    })
}

/// Free accelerations that are wrong, and that fall with the speed.
fn of_speed(model: &dyn Model, motions: &[Trajectory], score: &Score) -> Option<Reason> {
    let wrong = score.acceleration.as_ref()?.nmse_mean;
    if wrong <= GOOD || score.torque.is_some() {
        return None;
    }
    let ratio = weakened(model.coordinates(), motions)?;
    let finding = format!(
        "fast states are accelerated {:.1} times less than slow ones at the same place, as if inertia grew towards a speed that nothing reaches",
        1.0 / ratio
    );
    let remedy = "if there is one, give it as `speed_limit` (lnn and hnn have it)";
    Some(Reason::new(Grade::Fair, finding, remedy))
}

/// A model of free motions that neither keep their energy nor lose it as the model says lacks a friction or a drive.
const LACKING: f64 = 0.2;

fn of_work(model: &dyn Model, motions: &[Trajectory], score: &Score) -> Option<Reason> {
    let free = score.torque.is_none() && score.stopped == 0;
    let share = free.then(|| unknown_work(model, motions)).flatten()?;
    let finding = format!(
        "the motions gain or lose {:.0} % of their energy by forces that it does not have: friction, or a drive that was not recorded",
        100.0 * share
    );
    let remedy = "learn friction (`forces`), or record the force that drives (`tau`)";
    (share > LACKING).then(|| Reason::new(Grade::Fair, finding, remedy))
}

fn of_driven(joints: &[Forward]) -> Option<Reason> {
    let remedy = "use it for inverse dynamics alone, or record faster motions";
    let predictable = || joints.iter().filter(|j| j.predictable);
    if predictable().next().is_none() {
        let finding = "inertia makes up less of the torques than what stays unexplained: it predicts torques, but accelerations cannot be predicted from these motions";
        return Some(Reason::new(Grade::Fair, finding, remedy));
    }
    let is_wrong = |j: &&Forward| j.acceleration_nmse.is_nan() || j.acceleration_nmse >= 1.0;
    let wrong: Vec<&str> = predictable().filter(is_wrong).map(|j| &*j.name).collect();
    let finding = format!(
        "it predicts torques, but the acceleration of {} no better than the mean",
        wrong.join(", ")
    );
    (!wrong.is_empty()).then(|| Reason::new(Grade::Fair, finding, remedy))
}

fn of_inertia(spectrum: Spectrum) -> Option<Reason> {
    let Spectrum {
        smallest, scaled, ..
    } = spectrum;
    // The sign of a Lagrangian is arbitrary.
    (smallest > 0.0 && scaled < NEARLY_SINGULAR).then(|| {
        let finding = format!("its mass matrix is nearly singular over the motions: scaled to a diagonal of 1 its smallest eigenvalue is {scaled:.1e}");
        Reason::new(Grade::Poor, finding, "fit fewer weights, or choose the family chain or rigid")
    })
}

/// A mass matrix with other signs in more than this part of the states is of no use.
const MANY: f64 = 0.02;

/// Accelerations with poles among states like the recorded ones.
fn of_poles(model: &dyn Model, motions: &[Trajectory]) -> Option<Reason> {
    let all = |signal: Signal| -> Vec<f64> {
        let own = motions.iter().filter_map(|m| m.values(signal));
        own.flatten().copied().collect()
    };
    let share = poles(model, &all(Signal::Q), &all(Signal::Qd));
    let finding = format!(
        "its mass matrix changes its signs in {:.1} % of the states that combine recorded positions and velocities: accelerations have poles on the way there",
        100.0 * share
    );
    let remedy = "choose a family whose mass matrix is positive definite by construction, such as chain or delan";
    (share > 0.0).then(|| Reason::new(Grade::of_defect(share > MANY), finding, remedy))
}

/// A forecast is good where new motions can expect less than this part of their deviation, and of no use where it errs by more than that.
const NEAR: f64 = 0.05;
const USELESS: f64 = 0.3;
/// Of a machine all of whose joints are driven, and whose accelerations its inertia tells, it is of no use where it errs by more than that.
const OF_DRIVEN: f64 = 1.0;

/// The error a short time ahead, of motions whose accelerations can be predicted.
fn of_forecast(
    (score, forecast): (&Score, Option<Forecast>),
    joints: &[Forward],
) -> Option<Reason> {
    let Some(forecast) = forecast else {
        let short = !score.rollouts.is_empty() && score.torque.is_none() && score.stopped == 0;
        let finding =
            "the motions that it is judged by are too short to tell how far its predictions hold";
        let remedy = "record longer motions, or more of them";
        return short.then(|| Reason::new(Grade::Fair, finding, remedy));
    };
    let [_, most] = forecast.range;
    let torques = score.torque.is_some() && !joints.is_empty();
    if torques && joints.iter().any(|joint| !joint.predictable) {
        return None;
    }
    let all_driven = joints.iter().all(|joint| joint.inertial_share <= PASSIVE);
    let grade = match (forecast.own(), most) {
        (_, most) if most <= NEAR && forecast.brief => {
            let finding = format!(
                "its predictions can be compared over {:.2} periods of the motion only: what it says of longer ones is not known",
                forecast.periods
            );
            let remedy = "record several such motions, or give one to be judged by (`validate`)";
            return Some(Reason::new(Grade::Fair, finding, remedy));
        }
        (_, most) if most <= NEAR => return None,
        // Torques may be right where motions are not, but not where those are lost; of a machine with a joint that no torque drives they
        // are half of it.
        (own, _) if own > USELESS && !(torques && all_driven) => Grade::Poor,
        (own, _) if own > OF_DRIVEN => Grade::Poor,
        (own, _) if own.is_nan() => Grade::Poor,
        _ => Grade::Fair,
    };
    Some(Reason::new(grade, forecast.sentence(), forecast.remedy()))
}

/// Positions that a model with drives simulates from goals alone: their mean absolute error beside their mean absolute deviation.
fn of_positions(motions: &[Trajectory], score: &Score) -> Option<Reason> {
    let errors = score.rollouts.iter().flat_map(|r| &r.q_mean_absolute);
    let errors: Vec<f64> = errors.copied().collect();
    let deviations: f64 = motions.iter().map(deviation).sum();
    let error = errors.iter().sum::<f64>() / errors.len().max(1) as f64;
    let share = errors.iter().sum::<f64>() / deviations;
    let percent = 100.0 * share;
    let finding = format!(
        "the position that it simulates from the goals errs by {error:.3} on average, {percent:.0} % of its deviation"
    );
    let remedy =
        "check goals, gains and whether the motor was on, or record more motions and gains";
    let above = |limit: f64| share.is_nan() || share > limit;
    above(FAR_OFF).then(|| Reason::new(Grade::of_defect(above(HALF)), finding, remedy))
}

/// The sum over the coordinates of the mean absolute deviations of their positions.
fn deviation(motion: &Trajectory) -> f64 {
    let n = motion.dof();
    let of = |i: usize| {
        let column = || motion.q.iter().skip(i).step_by(n);
        let mean = column().sum::<f64>() / motion.len() as f64;
        column().map(|q| (q - mean).abs()).sum::<f64>() / motion.len() as f64
    };
    (0..n).map(of).sum()
}

/// The part of the deviation of positions above which their error is not good.
const FAR_OFF: f64 = 0.2;

/// A model predicts well if it follows motions for this part of the time for which they can be predicted …
pub(super) const FOLLOWED: f64 = 0.8;
/// … and not at all below this one.
pub(super) const LOST: f64 = 0.1;

/// The time for which whole motions are followed, as a part of that for a good model (ADR 0096).
fn of_motions(score: &Score) -> Option<Reason> {
    let known = || score.rollouts.iter().filter(|r| !r.outcome.is_stopped());
    let possible: f64 = known().map(|r| r.predictable_seconds).sum();
    let followed: f64 = known()
        .map(|r| r.followed_seconds.min(r.predictable_seconds))
        .sum();
    let share = followed / possible;
    let finding = format!(
        "it follows the motions for {:.0} % of the time for which they can be predicted, {:.2} of {:.2} s on average",
        100.0 * share,
        followed / known().count().max(1) as f64,
        possible / known().count().max(1) as f64
    );
    let remedy = "do not predict for long with it; fit for longer, learn friction where there is some (`forces`), or record more motions";
    // Torques may be right where motions are not.
    let useless = share < LOST && score.torque.is_none();
    (share < FOLLOWED).then(|| Reason::new(Grade::of_defect(useless), finding, remedy))
}
