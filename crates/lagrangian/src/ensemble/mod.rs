//! Several models of the same data, which together estimate their uncertainty (theory.md, 133 to 135).
//!
//! Each member is fitted to blocks of time that were drawn with replacement from the data (Breiman 1996). Its errors on the blocks
//! that it has not seen, beside the deviation of such members there, calibrate bands that hold a stated part of new samples,
//! whatever the distribution of the errors (Kim, Xu, Barber 2020, jackknife+ after bootstrap).
//!
//! ```
//! use lagrangian::ensemble::fit_ensemble;
//! use lagrangian::{Budget, FitConfig, LnnConfig, TrainingTask, analytic, dataset::random_states};
//!
//! let pendulum = analytic::by_name("pendulum", &[])?;
//! let data = random_states(&*pendulum, 400, 50, 0)?;
//! let network = LnnConfig { width: 8, ..LnnConfig::default() };
//! let task = TrainingTask { budget: Budget::Steps(30), batch: 64, ..TrainingTask::default() };
//! let config = FitConfig::new(network, task);
//! let ensemble = fit_ensemble(&data, &config, 4, &mut ())?;
//! let acceleration = ensemble.accelerations(&[0.5], &[1.0], &[0.0])?;
//! let (low, high) = acceleration.band(0.8)?;
//! assert!(low[0] < acceleration.mean[0] && acceleration.mean[0] < high[0]);
//! # Ok::<(), lagrangian::Error>(())
//! ```

mod bags;
mod calibration;
mod fitting;

pub use calibration::{Calibration, Coverage, Covered, EachSignal, LEVELS, Scale};
pub use fitting::fit_ensemble;

use crate::models::Learned;
use lagrangian_mechanics::dynamics::{Evaluation, Evaluator, Model};
use lagrangian_motion::Signal;
use lagrangian_motion::{Error, Result, Trajectory};

/// The smallest and the largest number of members of an ensemble.
pub const MEMBERS: (usize, usize) = (2, 100);

/// The largest number of recordings whose positions are predicted for a coverage.
const FOLLOWED: usize = 25;

/// Several models of the same data, with the calibration from their errors on held-out blocks.
#[derive(Debug, Clone)]
pub struct Ensemble {
    members: Vec<Learned>,
    calibration: Calibration,
}

/// A prediction of an ensemble: values and their uncertainty.
#[derive(Debug, Clone, PartialEq)]
pub struct Prediction {
    /// The mean of the members, `[m, n]`, in SI units.
    pub mean: Vec<f64>,
    /// The expected deviation of the truth, from the deviation of the members and from the errors that held-out blocks left
    /// unexplained, `[m, n]`, in the units of the mean.
    pub deviation: Vec<f64>,
    scale: Scale,
}

impl Prediction {
    /// The band around the mean that holds the truth with this probability: its lower and its upper end, `[m, n]` each.
    ///
    /// # Errors
    /// [`Error::Argument`] for a level outside of 0 … 0.99.
    pub fn band(&self, level: f64) -> Result<(Vec<f64>, Vec<f64>)> {
        let factors = self.scale.factors(level)?;
        let half = |(k, deviation): (usize, &f64)| factors[k % factors.len()] * deviation;
        let half: Vec<f64> = self.deviation.iter().enumerate().map(half).collect();
        let pairs = || self.mean.iter().zip(&half);
        let low = pairs().map(|(mean, half)| mean - half).collect();
        let high = pairs().map(|(mean, half)| mean + half).collect();
        Ok((low, high))
    }

    /// The quantile of the truth with this probability, `[m, n]`: the median is the mean, and the others are symmetric about it.
    ///
    /// # Errors
    /// [`Error::Argument`] for a probability outside of 0.005 … 0.995.
    pub fn quantile(&self, probability: f64) -> Result<Vec<f64>> {
        let level = (2.0 * probability - 1.0).abs();
        let must = "between 0.005 and 0.995";
        let (low, high) = self
            .band(level)
            .map_err(|_| Error::argument("probability", probability, must))?;
        Ok(if probability < 0.5 { low } else { high })
    }
}

/// The mean of some members and their deviation, `[m, n]`.
struct Spread {
    mean: Vec<f64>,
    deviation: Vec<f64>,
}

impl Ensemble {
    /// Makes an ensemble of these members.
    ///
    /// # Errors
    /// [`Error::Argument`] for fewer than two or more than a hundred members; [`Error::Shape`] for members, or a calibration, of other
    /// numbers of coordinates.
    pub fn new(members: Vec<Learned>, calibration: Calibration) -> Result<Self> {
        check_count(members.len())?;
        let n = members.first().map_or(0, |first| first.coordinates().dof());
        for member in &members {
            let found = member.coordinates().dof();
            Error::check_shape(
                "a member of the ensemble",
                found,
                n,
                "take models of one system",
            )?;
        }
        calibration.check(n)?;
        Ok(Self {
            members,
            calibration,
        })
    }

    /// The members of the ensemble.
    #[must_use]
    pub fn members(&self) -> &[Learned] {
        &self.members
    }

    /// The calibration from the errors on held-out blocks.
    #[must_use]
    pub fn calibration(&self) -> &Calibration {
        &self.calibration
    }

    /// The accelerations at `m` states under forces, `[m, n]` each.
    ///
    /// # Errors
    /// [`Error::Shape`] for arrays of other lengths; [`Error::Setting`] for a model without forward dynamics or data without
    /// accelerations; [`Error::NotFinite`].
    pub fn accelerations(&self, q: &[f64], qd: &[f64], tau: &[f64]) -> Result<Prediction> {
        let scale = self.calibration.acceleration.as_ref();
        self.predict("accelerations", scale, [q, qd, tau], forward)
    }

    /// The torques of `m` motions, `[m, n]` each.
    ///
    /// # Errors
    /// As [`Ensemble::accelerations`].
    pub fn torques(&self, q: &[f64], qd: &[f64], qdd: &[f64]) -> Result<Prediction> {
        let scale = self.calibration.torque.as_ref();
        self.predict("torques", scale, [q, qd, qdd], inverse)
    }

    /// The positions of a motion that all members predicted from the same start at the same times, `[m, n]` each; as long as the
    /// shortest of them.
    ///
    /// # Errors
    /// [`Error::Setting`] for data without motions that a calibration could come from; [`Error::Shape`] for another number of
    /// motions than members.
    pub fn positions(&self, motions: &[&[f64]]) -> Result<Prediction> {
        let remedy = "give the motion of each member";
        Error::check_shape("the motions", motions.len(), self.members.len(), remedy)?;
        let scale = self.calibration.position.as_ref();
        let scale = scale.ok_or_else(|| unknown("positions"))?;
        let shortest = motions.iter().map(|q| q.len()).min().unwrap_or(0);
        let each: Vec<&[f64]> = motions.iter().map(|q| &q[..shortest]).collect();
        Ok(scale.prediction(spread(&each)))
    }

    fn predict(
        &self,
        what: &str,
        scale: Option<&Scale>,
        given: [&[f64]; 3],
        ask: Ask,
    ) -> Result<Prediction> {
        let scale = scale.ok_or_else(|| unknown(what))?;
        let n = self.members[0].coordinates().dof();
        for values in given {
            let remedy = "give n numbers for each state";
            Error::check_shape(what, values.len(), given[0].len(), remedy)?;
            Error::check_finite(what, values)?;
        }
        if !given[0].len().is_multiple_of(n.max(1)) {
            let remedy = "give n numbers for each state";
            return Err(Error::shape(what.to_string(), given[0].len(), n, remedy));
        }
        let members: Vec<&Learned> = self.members.iter().collect();
        let spread = asked(&members, given, ask).ok_or_else(|| unknown(what))?;
        Error::check_finite(what, &spread.mean)?;
        Ok(scale.prediction(spread))
    }

    /// The part of the samples of these motions that lies in the bands of [`Coverage::LEVELS`]; positions of at
    /// most 25 of the motions are predicted.
    #[must_use]
    pub fn coverage(&self, motions: &[Trajectory]) -> Coverage {
        let members: Vec<&Learned> = self.members.iter().collect();
        let n = self.members[0].coordinates().dof();
        let of = |signal: Signal, scale: &Option<Scale>| {
            let mut errors = calibration::Errors::new(n);
            motions
                .iter()
                .for_each(|motion| errors.add_samples(&members, motion, signal));
            scale.as_ref().and_then(|scale| errors.covered(scale))
        };
        Coverage {
            acceleration: of(Signal::Qdd, &self.calibration.acceleration),
            torque: of(Signal::Tau, &self.calibration.torque),
            position: self.calibration.position.as_ref().and_then(|scale| {
                let mut errors = calibration::Errors::new(n);
                let every = motions.len().div_ceil(FOLLOWED).max(1);
                let some = motions.iter().step_by(every);
                some.for_each(|motion| errors.add_motions(&members, motion));
                errors.covered(scale)
            }),
        }
    }
}

/// Refuses a number of members that does not make an ensemble.
fn check_count(members: usize) -> Result<()> {
    let (fewest, most) = MEMBERS;
    match (fewest..=most).contains(&members) {
        true => Ok(()),
        false => Err(Error::argument(
            "the number of members",
            members,
            "between 2 and 100",
        )),
    }
}

fn unknown(what: &str) -> Error {
    Error::setting(
        format!("the ensemble has no bands of {what}"),
        "fit one of models with them, to data in which they were recorded",
    )
}

/// A query of a member at the states of three arrays.
type Ask = fn(&mut dyn Evaluator, [&[f64]; 3], &mut [f64]) -> Evaluation;

fn forward(
    evaluator: &mut dyn Evaluator,
    [q, qd, tau]: [&[f64]; 3],
    out: &mut [f64],
) -> Evaluation {
    evaluator.forward_dynamics(q, qd, tau, out)
}

fn inverse(
    evaluator: &mut dyn Evaluator,
    [q, qd, qdd]: [&[f64]; 3],
    out: &mut [f64],
) -> Evaluation {
    evaluator.inverse_dynamics(q, qd, qdd, out)
}

/// The answers of some members; `None` where one of them has no answer.
fn asked(members: &[&Learned], given: [&[f64]; 3], ask: Ask) -> Option<Spread> {
    let answer = |member: &&Learned| {
        let mut values = vec![0.0; given[0].len()];
        match ask(&mut *member.evaluator(), given, &mut values) {
            Evaluation::Unsupported => None,
            _ => Some(values),
        }
    };
    let answers: Vec<Vec<f64>> = members.iter().map(answer).collect::<Option<_>>()?;
    let answers: Vec<&[f64]> = answers.iter().map(Vec::as_slice).collect();
    Some(spread(&answers))
}

/// The mean and deviation of arrays of one length.
fn spread(answers: &[&[f64]]) -> Spread {
    let count = answers.len() as f64;
    let length = answers.first().map_or(0, |first| first.len());
    let at = |k: usize| answers.iter().map(move |values| values[k]);
    let mean: Vec<f64> = (0..length).map(|k| at(k).sum::<f64>() / count).collect();
    let deviation = |(k, mean): (usize, &f64)| {
        let squares: f64 = at(k).map(|x| (x - mean).powi(2)).sum();
        (squares / (count - 1.0).max(1.0)).sqrt()
    };
    let deviation = mean.iter().enumerate().map(deviation).collect();
    Spread { mean, deviation }
}
