//! From recordings to the data of a fit: the findings of their check, a low-pass where noise calls for one, estimated
//! signals, and held-back samples.

mod cutoff;
mod held;

use crate::dataset::{Dataset, PrepareOptions, split};
use crate::models::Momenta;
use crate::models::formula::family::{FEW, NAME};
use crate::score::accelerations_at;
use crate::train::{AutoSetting, DataFacts, FitSpec, Loss};
use lagrangian_mechanics::Model;
use lagrangian_mechanics::rigid::RigidBodies;
use lagrangian_motion::statistics::{column, mean};
use lagrangian_motion::{Coordinates, Error, Result, Trajectory};
use lagrangian_recordings::check::{
    CONSTRAINTS, CheckOptions, CheckReport, Item, NOISY_FORCES, RANGE, Verdict, check,
    check_validation,
};
use lagrangian_recordings::{
    Estimate, EstimateOptions, Recording, Sampling, are_smooth, between_stops,
};

impl PrepareOptions {
    /// The low-pass that the check of the data suggests, where noise spoils the accelerations and the options name none.
    #[must_use]
    pub fn chosen_low_pass(&self, check: &CheckReport) -> Option<AutoSetting> {
        if self.smooth || self.low_pass.is_some() {
            return None;
        }
        let mut items = check.items.iter();
        let item = items.find(|i| i.name == "acceleration" && i.verdict == Verdict::Warn)?;
        let hertz = *item.values.get("low_pass_hz")?;
        let reason = format!(
            "{}: a low-pass of {hertz} Hz for motion and forces",
            item.finding
        );
        Some(AutoSetting::new("low_pass", hertz, reason))
    }
}

/// Requirements of a fit on its data.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Needs {
    /// Whether recorded momenta are fitted, and so their rates are needed.
    pub momenta: bool,
    /// The number of samples that are predicted from each start; 0 without prediction.
    pub horizon: usize,
    /// Whether positions alone are compared.
    pub positions: bool,
}

impl Needs {
    /// The rows of a stretch of a long log: few where the fit uses each sample by itself.
    #[must_use]
    pub fn stretch(&self, options: &PrepareOptions) -> usize {
        // Space for several windows, segments or neighbours side by side.
        let horizon = 4 * self.horizon;
        let neighbours = match self.positions {
            true => 8 * options.baseline,
            false => 0,
        };
        let filtered = !(options.smooth || options.low_pass == Some(0.0));
        if filtered || !options.delay.is_empty() {
            Sampling::LONGEST.max(horizon).max(neighbours)
        } else if options.smooth || horizon + neighbours > 0 || self.momenta {
            Sampling::LONG.max(horizon).max(neighbours)
        } else {
            Sampling::SHORT
        }
    }
}

impl FitSpec {
    /// The requirements of the fit on its data.
    ///
    /// # Errors
    /// [`Error::Setting`] for a setting that does not belong to the fit, instead of ignoring it; [`Error::UnknownName`].
    pub fn needs(&self) -> Result<Needs> {
        let mut asked = self.checked()?;
        if self.is_open() {
            // Every candidate family learns from single samples, and has its own settings.
            asked.settings.retain(|name, _| name == "robot");
        }
        let config = asked.complete(&DataFacts::default())?.config;
        let rolls_out = config.loss == Loss::ROLLOUT;
        Ok(Needs {
            momenta: config.family.momenta() == Some(&Momenta::Recorded),
            horizon: if rolls_out { config.rollout.horizon } else { 0 },
            positions: config.loss.rule().is_some(),
        })
    }
}

/// Recordings that are ready for a fit.
#[derive(Debug)]
pub struct Prepared {
    /// The samples of training and validation.
    pub dataset: Dataset,
    /// The methods by which signals that were not measured were estimated.
    pub estimates: Vec<Estimate>,
    /// The findings of the check of the training data.
    pub check: CheckReport,
    /// The low-pass, where it was chosen from the data.
    pub low_pass: Option<AutoSetting>,
    /// The delay of the forces, s, where it was chosen from the data.
    pub delay: Option<AutoSetting>,
    /// The cyclic coordinates, where they were found in the data.
    pub cyclic: Option<AutoSetting>,
    /// The options of the estimates, with the low-pass that was chosen.
    pub options: EstimateOptions,
    /// The motions that a model is evaluated on.
    pub motions: Vec<Trajectory>,
    /// Whether these were held back from the fit; otherwise there were no others.
    pub held_out: bool,
    /// The motions that the check takes for those of another law.
    odd: Vec<Trajectory>,
    /// What a law is evaluated on that was sought in what was measured.
    measured: Option<Measured>,
}

/// Motions that a model is evaluated on, without a low-pass.
#[derive(Debug)]
struct Measured {
    motions: Vec<Trajectory>,
    estimates: Vec<Estimate>,
    options: EstimateOptions,
}

impl Prepared {
    /// Prepares the recordings of a fit. Without recordings to validate on, a part of the others is held back.
    ///
    /// # Errors
    /// [`Error::Data`] for data of which a fit would be meaningless; [`Error::Setting`] for a setting that does not belong to
    /// the fit; as [`Recording::into_trajectories`], [`split`] and [`Dataset::new`].
    pub fn new(
        training: Vec<Recording>,
        validation: Vec<Recording>,
        spec: &FitSpec,
    ) -> Result<Self> {
        let (needs, options) = (spec.needs()?, &spec.prepare);
        check_baseline(options, needs.positions)?;
        let estimates = EstimateOptions {
            momenta: needs.momenta,
            raw: needs.positions || needs.horizon > 0,
            ..options.estimates()
        };
        same_coordinates(&training, &validation)?;
        let mut check = checked(&training, &estimates)?;
        check.items.extend(doubts(&training, &validation)?);
        let count = training.len();
        let mut training = between_stops(training.into_iter().chain(validation).collect());
        let validation = training.split_off(count);
        let all = (training, validation);
        let [spare, measured] = spare(&all, spec);
        let asked = (spec, &check, &estimates);
        let (mut own, mut delay) = (Ready::new(all, (spec, None), (&check, &estimates))?, None);
        if let Some(spare) = spare {
            (own, delay) = own.of_robot(spare, asked)?;
        }
        let keep = |measured| own.keep_unfiltered(measured, delay.as_ref(), asked);
        let measured = measured.map(keep).transpose()?.flatten();
        let (kept, cyclic) = spec.cyclic(&own.dataset)?;
        acquit_wheels(&mut check, &kept);
        own.dataset.keep_from(kept);
        let held_out = !own.validation.is_empty();
        let motions = own.motions();
        Ok(Self {
            dataset: own.dataset,
            estimates: own.estimates,
            low_pass: own.low_pass,
            options: own.options,
            odd: own.odd,
            check,
            delay,
            cyclic,
            motions,
            held_out,
            measured: measured.map(|mut own| Measured {
                motions: own.motions(),
                estimates: own.estimates,
                options: own.options,
            }),
        })
    }

    /// Evaluates what is learned on what was measured, without the low-pass that was chosen for networks: for a law that was sought
    /// there. Whether there was one.
    pub fn without_low_pass(&mut self) -> bool {
        let Some(own) = self.measured.take() else {
            return false;
        };
        (self.motions, self.estimates, self.options) = (own.motions, own.estimates, own.options);
        self.low_pass.take().is_some()
    }

    /// Withdraws the finding that coordinates depend on each other, where this model keeps the constraints between them, and the findings
    /// that recordings have another law than the others, where it explains what they, and all held-out ones, do under their forces: the
    /// law of the check has few terms.
    pub fn acquit(&mut self, model: &dyn Model) {
        let n = model.coordinates().dof();
        let keeps = model.integration().projection().is_some();
        for item in self.check.items.iter_mut().filter(|_| keeps) {
            let coupled = item.name == "coupled";
            if item.name == CONSTRAINTS || coupled && item.claim.is_some() {
                item.finding += "; the model keeps these constraints";
                (item.verdict, item.doubtful, item.remedy) = (Verdict::Pass, false, None);
            } else if coupled && item.doubtful {
                item.finding +=
                    "; the model keeps these constraints, which one motion may follow by chance";
                item.remedy = Some("record another motion".into());
            }
        }
        let under = |motion: &Trajectory, part: f64| {
            let mut tau: Vec<f64> = motion.tau.iter().map(|tau| part * tau).collect();
            tau.resize(motion.q.len(), 0.0);
            accelerations_at(model, [&motion.q, &motion.qd, &tau])
        };
        let of_forces = |motion: &Trajectory| match motion.tau.is_empty() {
            true => differences(&motion.qdd, &vec![0.0; motion.q.len()], n),
            false => differences(&under(motion, 1.0), &under(motion, 0.0), n),
        };
        let all: Vec<Vec<f64>> = self.motions.iter().map(of_forces).collect();
        let share = |i: usize| mean(&mut all.iter().map(|own| own[i]));
        let explains = |motion: &Trajectory| {
            let left = differences(&under(motion, 1.0), &motion.qdd, n);
            !motion.qdd.is_empty() && (0..n).all(|i| left[i] < EXPLAINED * share(i))
        };
        // A model that follows the fitted recordings alone may have learned a wrong one by heart.
        if !self.motions.iter().all(explains) {
            return;
        }
        let is_explained = |name: &String| {
            let mut own = self.odd.iter().filter(|motion| motion.name == *name);
            own.clone().count() > 0 && own.all(explains)
        };
        let of_law = (self.check.items.iter_mut()).filter(|item| !item.odd.is_empty());
        for item in of_law.filter(|item| item.odd.iter().all(is_explained)) {
            item.finding += "; but the model explains what they do";
            (item.verdict, item.doubtful) = (Verdict::Pass, false);
        }
    }
}

/// Withdraws the doubt that a coordinate is in degrees where it is cyclic: a wheel turns as far as it likes.
fn acquit_wheels(check: &mut CheckReport, cyclic: &[usize]) {
    for item in check.items.iter_mut().filter(|item| item.name == RANGE) {
        let own = item.claim.and_then(|own| own.coordinate);
        item.doubtful &= !own.is_some_and(|i| cyclic.contains(&i));
    }
}

/// Copies of recordings, of which a delay and a low-pass may be chosen, and a law be sought beside these.
fn spare(all: &Logs, spec: &FitSpec) -> [Option<Logs>; 2] {
    let asked = &spec.prepare;
    let open = asked.delay.is_empty() || asked.low_pass.is_none();
    let forced = all.0.iter().any(|r| !r.tau.is_empty());
    let few = |r: &Recording| r.coordinates.dof() <= FEW;
    let sought = spec.family.as_deref() == Some(NAME) || all.0.first().is_some_and(few);
    let law = asked.low_pass.is_none() && sought;
    [open && forced, open && forced && law].map(|wanted| wanted.then(|| all.clone()))
}

/// Recordings with estimated signals.
struct Ready {
    dataset: Dataset,
    estimates: Vec<Estimate>,
    low_pass: Option<AutoSetting>,
    options: EstimateOptions,
    train: Vec<Trajectory>,
    validation: Vec<Trajectory>,
    odd: Vec<Trajectory>,
}

impl Ready {
    /// The same of recordings with the delay and the low-pass that those of a robot ask for, and that delay.
    fn of_robot(
        self,
        mut spare: Logs,
        (spec, check, estimates): (&FitSpec, &CheckReport, &EstimateOptions),
    ) -> Result<(Self, Option<AutoSetting>)> {
        let Some(robot) = held::robot(&self.dataset, spec) else {
            return Ok((self, None));
        };
        let mut delay = None;
        if spec.prepare.delay.is_empty()
            && let Some((half, later)) = held(&self.dataset, &robot, &spare)
        {
            (spare, delay) = (later, Some(half));
        }
        let low_pass = cutoff::choose(&spare.0, (&self.dataset, &robot), (spec, estimates));
        if delay.is_none() && low_pass.is_none() {
            return Ok((self, None));
        }
        Ok((
            Self::new(spare, (spec, low_pass), (check, estimates))?,
            delay,
        ))
    }

    /// Keeps the recordings as they were measured beside those that a low-pass, or a shift of forces that are held, was chosen for: a law
    /// is sought there. Returns those on which it is evaluated, which have that shift.
    fn keep_unfiltered(
        &mut self,
        measured: Logs,
        delay: Option<&AutoSetting>,
        (spec, check, estimates): (&FitSpec, &CheckReport, &EstimateOptions),
    ) -> Result<Option<Self>> {
        let changed = self.low_pass.is_some() || delay.is_some();
        if !changed || delay.is_some_and(|own| !held::is_half(own, &self.dataset)) {
            return Ok(None);
        }
        let mut unfiltered = spec.clone();
        unfiltered.prepare.low_pass = Some(0.0);
        let ready = |all| Self::new(all, (&unfiltered, None), (check, estimates));
        let filtered = self.low_pass.is_some();
        let later = delay
            .filter(|_| filtered)
            .and_then(|half| held::later(&measured, half));
        let mut own = ready(measured)?;
        if let Some(low_pass) = self.low_pass.as_mut().filter(|_| spec.is_open()) {
            low_pass.reason += "; a law is sought without it";
        }
        self.dataset.unfiltered = Some(Box::new(own.dataset.clone()));
        if let Some(later) = later {
            own = ready(later)?;
        }
        Ok(filtered.then_some(own))
    }

    /// The motions that a model is evaluated on, in the order of their names.
    fn motions(&mut self) -> Vec<Trajectory> {
        let held_out = !self.validation.is_empty();
        let own = if held_out {
            &mut self.validation
        } else {
            &mut self.train
        };
        let mut motions = std::mem::take(own);
        motions.sort_by_cached_key(|motion| with_long_numbers(&motion.name));
        motions
    }

    fn new(
        (training, validation): Logs,
        (spec, chosen): (&FitSpec, Option<AutoSetting>),
        (check, options): (&CheckReport, &EstimateOptions),
    ) -> Result<Self> {
        let (needs, asked) = (spec.needs()?, &spec.prepare);
        let coordinates = same_coordinates(&training, &validation)?;
        let (low_pass, whole) = match chosen {
            Some(chosen) => (Some(chosen), None),
            None => low_pass(&training, asked, (check, options))?,
        };
        let mut options = options.clone();
        if let Some(hertz) = low_pass.as_ref().and_then(|choice| choice.value.as_f64()) {
            options.low_pass = Some(hertz);
        }
        let (train, mut estimates) = whole.map_or_else(|| estimated(training, &options), Ok)?;
        let odd = odd(check, &train);
        let (train, validation) = match validation.is_empty() {
            true => split(train, asked.validate_fraction, spec.seed)?,
            false => {
                let (validation, own) = estimated(validation, &options)?;
                estimates.extend(own);
                (train, validation)
            }
        };
        let dataset = match needs.positions {
            true => Dataset::of_positions(coordinates, &train, &validation, asked.baseline)?,
            false => Dataset::new(coordinates, &train, &validation)?,
        };
        Ok(Self {
            dataset,
            estimates,
            low_pass,
            options,
            train,
            validation,
            odd,
        })
    }
}

/// Returns an error for a baseline under a loss that does not compare positions.
fn check_baseline(options: &PrepareOptions, positions: bool) -> Result<()> {
    match !positions && options.baseline > 1 {
        true => Err(Error::setting(
            "`baseline` is not for this loss",
            "omit it, or take `loss` positions",
        )),
        false => Ok(()),
    }
}

/// What is doubtful about recordings to validate on; those of which a validation would be meaningless are refused.
fn doubts(training: &[Recording], validation: &[Recording]) -> Result<Vec<Item>> {
    if validation.is_empty() {
        return Ok(Vec::new());
    }
    let own = check_validation(training, validation);
    refuse_failed(&own)?;
    Ok(own.items.into_iter().filter(|item| item.doubtful).collect())
}

/// The forces of a motion are explained where a model leaves less than this part of the accelerations that forces make.
const EXPLAINED: f64 = 0.02;

/// The mean squares of the differences of signals `[len, n]`, of each coordinate.
fn differences(a: &[f64], b: &[f64], n: usize) -> Vec<f64> {
    let left: Vec<f64> = a.iter().zip(b).map(|(a, b)| a - b).collect();
    column(&left, n, |x| mean(&mut x.map(|x| x * x)))
}

/// The motions that the check takes for those of another law.
fn odd(check: &CheckReport, motions: &[Trajectory]) -> Vec<Trajectory> {
    let is_odd = |motion: &&Trajectory| {
        let mut items = check.items.iter();
        items.any(|item| item.odd.contains(&motion.name))
    };
    motions.iter().filter(is_odd).cloned().collect()
}

/// Trajectories with the methods by which their signals were estimated.
type Estimated = (Vec<Trajectory>, Vec<Estimate>);

/// The low-pass that the check suggests, or what the training recordings are without one where they need none.
fn low_pass(
    training: &[Recording],
    options: &PrepareOptions,
    (check, estimates): (&CheckReport, &EstimateOptions),
) -> Result<(Option<AutoSetting>, Option<Estimated>)> {
    let suggested = (options.chosen_low_pass(check)).filter(|_| !estimates.raw);
    let clean = suggested.is_some() && are_clean(check);
    let whole = clean.then(|| estimated(training.to_vec(), estimates));
    let whole = whole.transpose()?.filter(|(_, how)| are_whole(how));
    Ok((suggested.filter(|_| whole.is_none()), whole))
}

/// Whether the forces have no noise to speak of.
fn are_clean(check: &CheckReport) -> bool {
    let noise = |item: &Item| item.values.get("force_noise").copied();
    let mut noises = check.items.iter().filter_map(noise);
    noises.all(|noise| noise <= NOISY_FORCES)
}

/// Whether most accelerations need no low-pass: their noise is white, or there is none.
fn are_whole(estimates: &[Estimate]) -> bool {
    let of = estimates.iter().filter(|own| own.signal == "qdd");
    let whole = of.clone().filter(|own| own.whole).count();
    2 * whole >= of.count().max(1)
}

/// A name whose numbers are padded with zeros: in this order 2 comes before 10.
fn with_long_numbers(name: &str) -> String {
    let words = name.split_inclusive(|c: char| !c.is_ascii_digit());
    let long = words.map(
        |word| match word.trim_end_matches(|c: char| !c.is_ascii_digit()) {
            "" => word.into(),
            digits => format!("{digits:0>20}{}", &word[digits.len()..]),
        },
    );
    long.collect()
}

/// The coordinates of the recordings. At least one recording is needed, and all must have equal coordinates.
fn same_coordinates(training: &[Recording], validation: &[Recording]) -> Result<Coordinates> {
    let Some(first) = training.first() else {
        return Err(Error::argument(
            "the number of recordings",
            0,
            "at least one",
        ));
    };
    let dof = first.dof();
    let mut others = training.iter().chain(validation);
    match others.find(|r| r.dof() != dof) {
        None => Ok(first.coordinates.clone()),
        Some(other) => Err(Error::shape(
            format!("a row of trajectory '{}'", other.name),
            other.dof(),
            dof,
            format!(
                "give recordings of one machine; '{}' is the first",
                first.name
            ),
        )),
    }
}

/// Makes trajectories of recordings, with the methods by which their signals were estimated. What lies between impacts with a stop is
/// a motion of its own.
///
/// # Errors
/// As [`Recording::into_trajectories`].
pub fn estimated(recordings: Vec<Recording>, options: &EstimateOptions) -> Result<Estimated> {
    let recordings = between_stops(recordings);
    let (mut trajectories, mut estimates) = (Vec::new(), Vec::new());
    let windowed = options.low_pass.is_some() || options.window.is_some();
    let options = EstimateOptions {
        clean: options.clean || !windowed && are_smooth(&recordings, options),
        ..options.clone()
    };
    for recording in recordings {
        let (own, how) = recording.into_trajectories(&options)?;
        trajectories.extend(own);
        estimates.extend(how);
    }
    Ok((trajectories, estimates))
}

/// Recordings to fit, and to compare with.
type Logs = (Vec<Recording>, Vec<Recording>);

/// How much later a robot moves than its forces act, s, where that is a part of a row, as where a drive holds each force until the next; and
/// its recordings, to fit and to compare with, with their forces shifted by that.
#[must_use]
pub fn held(
    dataset: &Dataset,
    robot: &RigidBodies,
    recordings: &Logs,
) -> Option<(AutoSetting, Logs)> {
    let delay = held::delay(dataset, robot)?;
    let later = held::later(recordings, &delay)?;
    Some((delay, later))
}

/// Checks the data of a fit, and refuses those of which a fit would be meaningless.
///
/// # Errors
/// [`Error::Data`] with the first finding that fails.
pub fn checked(recordings: &[Recording], options: &EstimateOptions) -> Result<CheckReport> {
    let low_pass = options.low_pass;
    let report = check(recordings, &CheckOptions { low_pass });
    refuse_failed(&report)?;
    Ok(report)
}

/// Refuses data with an item that fails.
fn refuse_failed(report: &CheckReport) -> Result<()> {
    let mut items = report.items.iter();
    let Some(item) = items.find(|item| item.verdict == Verdict::Fail) else {
        return Ok(());
    };
    let about = match &item.trajectory {
        Some(name) => format!("trajectory '{name}': "),
        None => String::new(),
    };
    let remedy = item.remedy.clone();
    Err(Error::Data {
        finding: format!("{about}{}: {}", item.name, item.finding),
        remedy: remedy.unwrap_or_else(|| "a check of the data says more".into()),
    })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::{EstimateOptions, Prepared, Trajectory, estimated, with_long_numbers};
    use lagrangian_mechanics::analytic::by_name;
    use lagrangian_mechanics::rollout::{RolloutOptions, rollout, times};
    use lagrangian_recordings::Recording;
    use lagrangian_recordings::check::Item;

    use crate::train::FitSpec;

    #[test]
    fn a_model_that_explains_an_odd_motion_acquits_it() {
        let system = by_name("pendulum", &[]).unwrap();
        let drive = |t: f64| 3.0 * (2.0 * t).sin();
        let force = |t: f64, _: &[f64], _: &[f64], tau: &mut [f64]| tau[0] = drive(t);
        let recording = |(r, wrong): (usize, f64)| {
            let start = [0.3 * r as f64 - 0.5];
            let (t, options) = (times(3.0, 0.02).unwrap(), RolloutOptions::truth());
            let made = rollout(&*system, &start, &[0.0], &t, &force, &options).unwrap();
            let mut signals = made.trajectory.signals;
            signals.tau = t.iter().map(|t| wrong * drive(*t)).collect();
            Recording::new(format!("log {r}"), system.coordinates().clone(), t, signals)
        };
        let doubts = |wrong: f64| {
            let factors = [1.0, wrong, 1.0, 1.0];
            let training: Vec<Recording> = factors.into_iter().enumerate().map(recording).collect();
            let (motions, _) = estimated(training.clone(), &EstimateOptions::default()).unwrap();
            let mut prepared = Prepared::new(training, Vec::new(), &FitSpec::default()).unwrap();
            prepared.check.items.retain(|item| item.odd.is_empty());
            let mut item = Item::warn("machines", "another law", "omit it");
            (item.doubtful, item.odd) = (true, vec!["log 1".into()]);
            prepared.check.items.push(item);
            prepared.odd = vec![motions[1].clone()];
            prepared.acquit(&*system);
            prepared
                .check
                .items
                .iter()
                .filter(|item| item.doubtful)
                .count()
        };
        assert_eq!(doubts(1.0), 0);
        assert_eq!(doubts(2.0), 1);
    }

    #[test]
    fn half_a_row_is_shifted_where_every_joint_is_so_late_and_none_is_given() {
        let system = by_name("pendulum", &[]).unwrap();
        let (rate, held) = (0.02, |t: f64| (t / 0.02 + 1e-6).floor() * 0.02);
        let recording = |hold: bool| {
            let drive = move |t: f64| 3.0 * (2.0 * if hold { held(t) } else { t }).sin();
            let force = move |t: f64, _: &[f64], _: &[f64], tau: &mut [f64]| tau[0] = drive(t);
            let (t, options) = (times(12.0, rate).unwrap(), RolloutOptions::truth());
            let made = rollout(&*system, &[0.4], &[0.0], &t, &force, &options).unwrap();
            let mut signals = made.trajectory.signals;
            signals.tau = t.iter().map(|t| drive(*t)).collect();
            // Known accelerations are those of the held force, which is not late for them.
            signals.qdd.clear();
            Recording::new("log", system.coordinates().clone(), t, signals)
        };
        let chosen = |hold, given: &[f64]| {
            let mut spec = FitSpec::default();
            spec.prepare.delay = given.to_vec();
            let prepared = Prepared::new(vec![recording(hold)], Vec::new(), &spec).unwrap();
            prepared.delay.and_then(|delay| delay.value.as_f64())
        };
        assert!((chosen(true, &[]).unwrap() - 0.01).abs() < 1e-9);
        assert_eq!(chosen(false, &[]), None);
        assert_eq!(chosen(true, &[0.0]), None);
    }

    #[test]
    fn a_law_is_evaluated_without_the_low_pass() {
        let system = by_name("pendulum", &[]).unwrap();
        // Steps of 0.1 s, by a bit of noise of their own.
        let drive = |t: f64| 6.0 * (1e3 * ((t / 0.1 + 1e-6).floor() + 1.0).sin()).sin();
        let force = |t: f64, _: &[f64], _: &[f64], tau: &mut [f64]| tau[0] = drive(t);
        let recording = |k: usize| {
            let (t, options) = (times(8.0, 0.01).unwrap(), RolloutOptions::truth());
            let start = [0.4 - 0.3 * k as f64];
            let made = rollout(&*system, &start, &[0.0], &t, &force, &options).unwrap();
            let mut signals = made.trajectory.signals;
            signals.tau = t.iter().map(|t| drive(*t)).collect();
            let noise = |i: usize| 3e-4 * (1e4 * (i as f64 + 1.0).sin()).sin();
            (signals.q.iter_mut().enumerate()).for_each(|(i, q)| *q += noise(i));
            (signals.qd, signals.qdd) = Default::default();
            Recording::new(format!("log {k}"), system.coordinates().clone(), t, signals)
        };
        let training: Vec<Recording> = (0..3).map(recording).collect();
        let mut spec = FitSpec::default();
        spec.prepare.delay = vec![0.0];
        let mut prepared = Prepared::new(training, Vec::new(), &spec).unwrap();
        let filtered = prepared.motions.clone();
        assert!(prepared.low_pass.is_some());
        assert!(prepared.without_low_pass());
        assert_eq!(
            (prepared.low_pass.as_ref(), prepared.options.low_pass),
            (None, None)
        );
        let names = |all: &[Trajectory]| -> Vec<String> {
            all.iter().map(|own| own.name.clone()).collect()
        };
        assert_eq!(names(&prepared.motions), names(&filtered));
        assert_ne!(prepared.motions[0].tau, filtered[0].tau);
        assert!(!prepared.without_low_pass());
    }

    #[test]
    fn motions_are_in_the_order_of_their_numbers() {
        let mut names = [
            "run 10",
            "run 2",
            "10",
            "b",
            "2",
            "run 2 (3)",
            "run 2 (12)",
            "9",
        ];
        names.sort_by_cached_key(|name| with_long_numbers(name));
        let wanted = [
            "2",
            "9",
            "10",
            "b",
            "run 2",
            "run 2 (3)",
            "run 2 (12)",
            "run 10",
        ];
        assert_eq!(names, wanted);
    }
}
