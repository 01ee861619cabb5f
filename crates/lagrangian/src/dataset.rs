//! Data of a fit from trajectories: samples, their split, and the scales that a model then owns.

mod momenta;
mod neighbours;
mod options;
mod random;

use lagrangian_mechanics::lagrangian::Scaling;
use lagrangian_motion::Samples;
use lagrangian_motion::Signal;
use lagrangian_motion::solve::quadratic::Quadratic;
use lagrangian_motion::statistics::{
    column, deviation, mean, median_size, positive, root_mean_square, size,
};
use lagrangian_motion::{Coordinates, Error, Result, Trajectory};

pub use momenta::Momenta;
pub use options::PrepareOptions;
pub use random::{random_starts, random_states};

/// Samples to fit and samples to validate on, of the same system.
#[derive(Debug, Clone, PartialEq)]
pub struct Dataset {
    /// The coordinates of all samples.
    pub coordinates: Coordinates,
    /// The samples that are fitted.
    pub train: Samples,
    /// The samples that stop the run and choose the weights.
    pub validation: Samples,
    /// Whether any force τ was recorded.
    pub forced: bool,
    /// The times of the training samples, for losses of more than one sample.
    pub train_times: Timeline,
    /// The times of the validation samples.
    pub validation_times: Timeline,
    /// The coordinates that no network may depend on, see [`Scaling::cyclic`].
    pub cyclic: Vec<usize>,
    /// The recordings without the low-pass, or the shift of forces that are held, that was chosen for them: the search of a law needs white
    /// noise, and knows of both.
    pub unfiltered: Option<Box<Self>>,
}

/// The times of samples: those of a trajectory follow each other.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Timeline {
    /// Time of each sample, s, increasing within a trajectory; empty where samples belong to none.
    pub t: Vec<f64>,
    /// The first sample of each trajectory.
    pub begins: Vec<usize>,
    /// The measured q and q̇ where those of the samples are smoothed, `[m, n]` each; empty where no sample is.
    pub measured: [Vec<f64>; 2],
}

impl Timeline {
    fn of(trajectories: &[Trajectory]) -> Self {
        let mut times = Self::default();
        for trajectory in trajectories.iter().filter(|t| !t.is_empty()) {
            times.begins.push(times.t.len());
            times.t.extend(&trajectory.t);
        }
        for (signal, all) in [Signal::Q, Signal::Qd].into_iter().zip(&mut times.measured) {
            if trajectories
                .iter()
                .any(|t| t.measured.values(signal).is_some())
            {
                let own = |t: &'_ Trajectory| {
                    let measured = t.measured.values(signal).or(t.values(signal));
                    measured.unwrap_or_default().to_vec()
                };
                *all = trajectories.iter().flat_map(own).collect();
            }
        }
        times
    }

    /// The samples of each trajectory.
    pub fn runs(&self) -> impl Iterator<Item = std::ops::Range<usize>> + '_ {
        let ends = self.begins.iter().skip(1).copied().chain([self.t.len()]);
        self.begins.iter().zip(ends).map(|(&begin, end)| begin..end)
    }

    /// The number of samples of the longest trajectory.
    #[must_use]
    pub fn longest(&self) -> usize {
        self.runs().map(|run| run.len()).max().unwrap_or(0)
    }
}

impl Dataset {
    /// The recordings without a low-pass, or the shift of forces that are held, that was chosen for them.
    pub(crate) fn as_measured(&self) -> &Self {
        self.unfiltered.as_deref().unwrap_or(self)
    }

    /// The same with positions that are measured from these.
    pub(crate) fn measured_from(&self, origins: &[f64]) -> Self {
        let mut own = self.clone();
        let [train, validation] = [&mut own.train_times, &mut own.validation_times];
        let measured = [train, validation].map(|times| &mut times.measured[0]);
        for all in [&mut own.train.q, &mut own.validation.q]
            .into_iter()
            .chain(measured)
        {
            for q in all.chunks_exact_mut(origins.len().max(1)) {
                q.iter_mut().zip(origins).for_each(|(q, from)| *q -= from);
            }
        }
        own.unfiltered = None;
        own
    }

    /// Sets the coordinates that no network may depend on.
    pub(crate) fn keep_from(&mut self, cyclic: Vec<usize>) {
        if let Some(unfiltered) = &mut self.unfiltered {
            unfiltered.cyclic.clone_from(&cyclic);
        }
        self.cyclic = cyclic;
    }

    /// All samples of these trajectories, which must have accelerations. `None` for τ is a free motion.
    ///
    /// # Errors
    /// As [`Trajectory::validate`]; [`Error::Shape`] for trajectories of other degrees of freedom, without
    /// accelerations, or without any sample.
    pub fn new(
        coordinates: Coordinates,
        train: &[Trajectory],
        validation: &[Trajectory],
    ) -> Result<Self> {
        let n = coordinates.dof();
        let forced = is_forced(train);
        let (train_times, validation_times) = (Timeline::of(train), Timeline::of(validation));
        let errors = [train, validation].map(errors);
        let (mut train, mut validation) = (samples(n, train)?, samples(n, validation)?);
        let usual = usual(&errors[0], &train);
        train.weights = weights(&errors[0], &usual);
        validation.weights = weights(&errors[1], &usual);
        for part in [&train, &validation] {
            check_parameters(&coordinates, part)?;
        }
        Ok(Self {
            train,
            validation,
            forced,
            coordinates,
            train_times,
            validation_times,
            cyclic: Vec::new(),
            unfiltered: None,
        })
    }

    /// Triples of neighbouring positions of these trajectories, the samples of a loss of positions alone. Velocities
    /// and accelerations of the trajectories are not used. `baseline` is the distance of the neighbours, in
    /// samples: noise of the positions weighs `baseline`² times less, the error of the discrete action as much more.
    ///
    /// # Errors
    /// As [`Dataset::new`]; [`Error::TooShort`] where no training trajectory has three neighbours without a gap in time
    /// between them; [`Error::Argument`] for a baseline of 0.
    pub fn of_positions(
        coordinates: Coordinates,
        train: &[Trajectory],
        validation: &[Trajectory],
        baseline: usize,
    ) -> Result<Self> {
        Ok(Self {
            train: neighbours::all(&coordinates, train, baseline, true)?,
            validation: neighbours::all(&coordinates, validation, baseline, false)?,
            forced: is_forced(train),
            coordinates,
            train_times: Timeline::default(),
            validation_times: Timeline::default(),
            cyclic: Vec::new(),
            unfiltered: None,
        })
    }

    /// A dataset of samples that belong to no trajectory, such as random states of a known system.
    ///
    /// # Errors
    /// [`Error::Shape`] where the arrays do not belong together or are empty; [`Error::NotFinite`].
    pub fn from_samples(
        coordinates: Coordinates,
        train: Samples,
        validation: Samples,
    ) -> Result<Self> {
        let n = coordinates.dof();
        for part in [&train, &validation] {
            validate(n, part)?;
            check_parameters(&coordinates, part)?;
        }
        let forced = train.tau.iter().any(|&x| x != 0.0);
        Ok(Self {
            coordinates,
            train,
            validation,
            forced,
            train_times: Timeline::default(),
            validation_times: Timeline::default(),
            cyclic: Vec::new(),
            unfiltered: None,
        })
    }

    /// The samples that models are compared on: those of validation, or of training without them.
    pub(crate) fn compared(&self) -> &Samples {
        match self.validation.is_empty() {
            true => &self.train,
            false => &self.validation,
        }
    }

    /// The scales of this data: deviations of lines, root mean squares of velocities, and an energy for which the
    /// inertia of the data is of order one.
    #[must_use]
    pub fn scaling(&self) -> Scaling {
        let n = self.coordinates.dof();
        let data = &self.train;
        let (centre, deviation) = (column(&data.q, n, mean), column(&data.q, n, deviation));
        let circle = |i: usize| self.coordinates.is_circle(i);
        let qd_scale = size(&data.qd, n);
        let moves = |i: &usize| !self.coordinates.is_parameter(*i);
        let inertias = self.inertias();
        let energies = (0..n).filter(moves);
        let energies = energies.map(|i| inertias[i] * qd_scale[i] * qd_scale[i]);
        let logarithms: Vec<f64> = energies.map(f64::ln).collect();
        let mean = logarithms.iter().sum::<f64>() / logarithms.len() as f64;
        let on_line = |i, value| if circle(i) { None } else { Some(value) };
        let centres = (0..n).map(|i| on_line(i, centre[i]).unwrap_or(0.0));
        let scales = (0..n).map(|i| on_line(i, positive(deviation[i])).unwrap_or(1.0));
        Scaling {
            q_center: centres.collect(),
            q_scale: scales.collect(),
            // The geometric mean over the coordinates.
            energy: positive(mean.exp()),
            qd_scale,
            cyclic: self.cyclic.clone(),
        }
    }

    /// The scales of a deep Lagrangian network. They are those of [`Dataset::scaling`], but where forces are recorded the energy is
    /// that of the largest of them over a radian (or the deviation of a line), so that V is of order one. The scale of each
    /// velocity is the velocity at which the coordinate's own inertia has this energy, so that M is of order one too, for a heavy
    /// shoulder and a light wrist alike. The network sees no velocity, so nothing else depends on it.
    #[must_use]
    pub fn mass_scaling(&self) -> Scaling {
        let mut scaling = self.scaling();
        if !self.forced {
            return scaling;
        }
        let moves = |i: &usize| !self.coordinates.is_parameter(*i);
        let forces = self.force_scale();
        let work = (0..forces.len())
            .filter(moves)
            .map(|i| forces[i] * scaling.q_scale[i]);
        scaling.energy = positive(work.fold(0.0, f64::max));
        let ratios = self.inertias();
        for i in (0..ratios.len()).filter(moves) {
            let (s, ratio) = (&mut scaling.qd_scale[i], ratios[i]);
            *s = positive((scaling.energy / self.own_inertia(i, ratio)).sqrt());
        }
        scaling
    }

    /// The slope of the force of coordinate `i` over its acceleration, beside a constant and the features of all coordinates,
    /// by least squares, limited to two decades around `ratio`, force over acceleration. It is the ratio itself where these explain
    /// less than half of the force: in fast motion it is the small rest of inertial and centrifugal forces.
    fn own_inertia(&self, i: usize, ratio: f64) -> f64 {
        let (data, n) = (&self.train, self.coordinates.dof());
        let every = data.len().div_ceil(LOOKED_AT).max(1);
        let columns = 2 + 2 * n;
        let (mut sums, mut row) = (Quadratic::zero(columns), vec![0.0; columns]);
        for s in (0..data.len()).step_by(every) {
            (row[0], row[1]) = (data.qdd[s * n + i], 1.0);
            for (j, q) in data.q[s * n..][..n].iter().enumerate() {
                (row[2 + 2 * j], row[3 + 2 * j]) = match self.coordinates.is_circle(j) {
                    true => (q.cos(), q.sin()),
                    false => (*q, 0.0),
                };
            }
            sums.add_row(&row, data.tau[s * n + i]);
        }
        let solution = sums.solution();
        let slope = solution[0].abs();
        let explained: f64 = solution.iter().zip(&sums.right).map(|(x, r)| x * r).sum();
        if slope.is_finite() && explained > 0.5 * sums.square {
            slope.clamp(1e-2 * ratio, ratio)
        } else {
            ratio
        }
    }

    /// A guess of the inertia of each coordinate: force over acceleration where forces are recorded, else 1.
    fn inertias(&self) -> Vec<f64> {
        let n = self.coordinates.dof();
        if !self.forced {
            return vec![1.0; n];
        }
        let (tau, qdd) = (self.force_scale(), self.acceleration_scale());
        tau.iter().zip(qdd).map(|(f, a)| f / a).collect()
    }

    /// Root mean square of each acceleration, `[n]`; 1 where it is 0.
    #[must_use]
    pub fn acceleration_scale(&self) -> Vec<f64> {
        size(&self.train.qdd, self.coordinates.dof())
    }

    /// Root mean square of each force, `[n]`, and at least 0.3 % of the largest: a force below that is below the noise of most drives,
    /// which would otherwise rule a fit. That of a coordinate without a force is the largest of the others, or 1.
    #[must_use]
    pub fn force_scale(&self) -> Vec<f64> {
        force_scale(&column(
            &self.train.tau,
            self.coordinates.dof(),
            root_mean_square,
        ))
    }

    /// Whether a force acts on each coordinate in some sample, `[n]`; without one it is passive.
    #[must_use]
    pub fn driven(&self) -> Vec<bool> {
        let sizes = column(&self.train.tau, self.coordinates.dof(), root_mean_square);
        sizes.into_iter().map(|size| size > 0.0).collect()
    }
}

impl Dataset {
    /// The largest |q̇| of all coordinates, in training and validation.
    #[must_use]
    pub fn fastest(&self) -> f64 {
        let all = self.train.qd.iter().chain(&self.validation.qd);
        all.fold(0.0, |most, v| most.max(v.abs()))
    }

    /// Root mean square of the power τ·q̇, W; 1 where it is 0.
    #[must_use]
    pub fn power_scale(&self) -> f64 {
        let n = self.coordinates.dof().max(1);
        let Samples { signals, .. } = &self.train;
        let samples = signals.tau.chunks_exact(n).zip(signals.qd.chunks_exact(n));
        let mut power = samples.map(|(tau, v)| tau.iter().zip(v).map(|(f, v)| f * v).sum::<f64>());
        positive(root_mean_square(&mut power))
    }
}

/// Whether any force of these motions is not 0.
fn is_forced(trajectories: &[Trajectory]) -> bool {
    trajectories.iter().flat_map(|t| &t.tau).any(|&x| x != 0.0)
}

/// The scales of forces of these root mean squares, see [`Dataset::force_scale`].
pub(crate) fn force_scale(sizes: &[f64]) -> Vec<f64> {
    let largest = sizes.iter().copied().fold(0.0, f64::max);
    let scale = |own: f64| match own > 0.0 {
        true => own.max(FAINTEST * largest),
        false => largest,
    };
    sizes.iter().map(|own| positive(scale(*own))).collect()
}

/// The smallest scale of a force, in parts of the largest.
const FAINTEST: f64 = 3e-3;
/// The largest number of samples that inertias are estimated from.
const LOOKED_AT: usize = 4096;

/// Divides trajectories into training and validation: whole trajectories of about `fraction` of the samples, chosen by
/// `seed`; where whole ones would be far more than that, blocks of time that are spread over each.
///
/// # Errors
/// [`Error::Argument`] for a fraction outside 0…0.9 or no trajectory.
pub fn split(
    mut trajectories: Vec<Trajectory>,
    fraction: f64,
    seed: u64,
) -> Result<(Vec<Trajectory>, Vec<Trajectory>)> {
    use rand::SeedableRng;
    if !(0.0..=0.9).contains(&fraction) {
        let must = "between 0 and 0.9";
        return Err(Error::argument("validation fraction", fraction, must));
    }
    let total: usize = trajectories.iter().map(Trajectory::len).sum();
    let wanted = (total as f64 * fraction).round() as usize;
    if wanted == 0 {
        return Ok((trajectories, Vec::new()));
    }
    shuffle(
        &mut trajectories,
        &mut rand_chacha::ChaCha8Rng::seed_from_u64(seed),
    );
    let mut count = 0;
    let mut enough = |next: &Trajectory| {
        let before = count;
        count += next.len();
        before < wanted
    };
    let whole = trajectories.iter().rev().take_while(|t| enough(t)).count();
    let kept = trajectories.len() - whole;
    let held: usize = trajectories[kept..].iter().map(Trajectory::len).sum();
    if kept == 0 || held as f64 > MOST_HELD * wanted as f64 {
        let parts: (Vec<_>, Vec<_>) = trajectories.iter().map(|t| blocks(t, fraction)).unzip();
        return Ok((parts.0.concat(), parts.1.concat()));
    }
    let held = trajectories.split_off(kept);
    Ok((trajectories, held))
}

/// Whole trajectories are held back only if their samples are at most this multiple of the requested number.
const MOST_HELD: f64 = 2.5;

/// The largest number of blocks that are held back of a trajectory, and the smallest number of samples of each.
const BLOCKS: usize = 5;
const SHORTEST_BLOCK: usize = 20;
/// Neighbouring samples resemble each other: this part of a block is omitted next to it …
const GUARD_PART: usize = 10;
/// … but at most this number of samples.
const GUARD: usize = 10;

/// The pieces of a trajectory that are kept, and blocks of about `fraction` of it, in the middle of equal parts.
fn blocks(t: &Trajectory, fraction: f64) -> (Vec<Trajectory>, Vec<Trajectory>) {
    let held = (t.len() as f64 * fraction).round() as usize;
    let count = (held / SHORTEST_BLOCK).clamp(1, BLOCKS);
    let (own, part) = (held / count, t.len() / count);
    let guard = (own / GUARD_PART).min(GUARD).min((part - own) / 2);
    if own == 0 {
        return (vec![t.clone()], Vec::new());
    }
    let begins = (0..count).map(|b| b * part + (part - own) / 2);
    let ends = begins.clone().map(|begin| begin + own);
    let after = std::iter::once(0).chain(ends.clone().map(|end| end + guard));
    let before = begins.clone().map(|begin| begin - guard).chain([t.len()]);
    let piece = |(begin, end): (usize, usize)| {
        let name = format!("{} at {:.1} s", t.name, t.t[begin]);
        Trajectory {
            name,
            ..t.part(begin..end)
        }
    };
    let kept = after.zip(before).filter(|(begin, end)| begin < end);
    (
        kept.map(piece).collect(),
        begins.zip(ends).map(piece).collect(),
    )
}

/// A random order (Fisher, Yates).
#[doc(hidden)]
pub fn shuffle<X>(items: &mut [X], rng: &mut impl rand::Rng) {
    use rand::RngExt;
    for i in (1..items.len()).rev() {
        items.swap(i, rng.random_range(0..=i));
    }
}

fn samples(n: usize, trajectories: &[Trajectory]) -> Result<Samples> {
    let mut out = Samples::empty(n);
    for trajectory in trajectories {
        trajectory.validate()?;
        if trajectory.is_empty() {
            continue;
        }
        trajectory.check_dof(n)?;
        if trajectory.qdd.is_empty() {
            return Err(Error::shape(
                format!("qdd of trajectory '{}'", trajectory.name),
                0,
                trajectory.q.len(),
                "estimate the accelerations first",
            ));
        }
        for ((_, all), (_, own)) in out.iter_mut().zip(trajectory.iter()) {
            all.extend(own);
        }
        out.spreading = out.spreading.max(trajectory.spreading);
        // A motion whose forces are not known is free.
        let size = out.q.len();
        out.tau.resize(size, 0.0);
    }
    let size = out.q.len();
    for (_, signal) in out.iter_mut().filter(|(_, x)| x.len() != size) {
        // The signal is missing in one of them.
        signal.clear();
    }
    Ok(out)
}

/// Standard errors of the accelerations of all samples, `[m, n]`, 0 where they were measured; empty where all were.
fn errors(trajectories: &[Trajectory]) -> Vec<f64> {
    if trajectories.iter().all(|t| t.errors.qdd.is_empty()) {
        return Vec::new();
    }
    let own = |t: &Trajectory| match t.errors.qdd.is_empty() {
        true => vec![0.0; t.q.len()],
        false => t.errors.qdd.clone(),
    };
    trajectories.iter().flat_map(own).collect()
}

/// An error of this part of the accelerations is less than what models leave.
const SMALL_ERROR: f64 = 1e-3;

/// The errors of each acceleration, `[n]`, up to which samples weigh alike: the median, and what no model would notice.
fn usual(errors: &[f64], samples: &Samples) -> Vec<f64> {
    let n = samples.n;
    let size = size(&samples.qdd, n);
    let median = column(errors, n, |own| median_size(own));
    let pairs = median.iter().zip(size);
    pairs.map(|(m, size)| m.hypot(SMALL_ERROR * size)).collect()
}

/// The weights of samples whose accelerations have these errors, 1/√(1 + mean (error/usual)²); empty where all were measured.
fn weights(errors: &[f64], usual: &[f64]) -> Vec<f64> {
    let n = usual.len();
    let weight = |own: &[f64]| {
        let squares = own.iter().zip(usual).map(|(e, u)| (e / u).powi(2));
        1.0 / (1.0 + squares.sum::<f64>() / n as f64).sqrt()
    };
    errors.chunks_exact(n.max(1)).map(weight).collect()
}

/// Refuses parameters with a velocity or an acceleration.
fn check_parameters(coordinates: &Coordinates, samples: &Samples) -> Result<()> {
    coordinates.check_parameters("velocity", &samples.qd)?;
    coordinates.check_parameters("acceleration", &samples.qdd)
}

fn validate(n: usize, samples: &Samples) -> Result<()> {
    let size = samples.q.len();
    for (signal, x) in samples.iter() {
        let needed = matches!(signal, Signal::Q | Signal::Qd | Signal::Qdd | Signal::Tau);
        let unknown = !needed && x.is_empty();
        if samples.n != n || x.len() != size && !unknown || !size.is_multiple_of(n.max(1)) {
            return Err(Error::shape(
                format!("{} of the samples", signal.name()),
                x.len(),
                size,
                format!("give {n} numbers for each sample"),
            ));
        }
        Error::check_finite(format_args!("{} of the samples", signal.name()), x)?;
    }
    if !samples.steps.is_empty() && samples.steps.len() != 2 * samples.len() {
        return Err(Error::shape(
            "steps of the samples",
            samples.steps.len(),
            2 * samples.len(),
            "give the step before and after each sample, or none",
        ));
    }
    match samples.steps.iter().find(|h| !(h.is_finite() && **h > 0.0)) {
        None => Ok(()),
        Some(h) => Err(Error::argument(
            "step between positions",
            h,
            "finite and positive",
        )),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;
    use lagrangian_motion::Signals;

    fn recording(name: &str, len: usize) -> Trajectory {
        Trajectory::new(
            name,
            (0..len).map(|k| k as f64).collect(),
            Signals {
                q: vec![0.0; len],
                qd: vec![0.0; len],
                ..Signals::default()
            },
        )
    }

    #[test]
    fn a_joint_of_almost_no_force_does_not_rule_a_loss() {
        let tau = vec![30.0, 0.03, 0.0, -30.0, 2.0, 0.0];
        let samples = Samples::new(
            3,
            Signals {
                q: vec![0.0; 6],
                qd: vec![0.0; 6],
                qdd: vec![0.0; 6],
                tau,
                ..Signals::default()
            },
        );
        let scale = |samples: Samples| {
            let all = Dataset::from_samples(Coordinates::angles(3), samples.clone(), samples);
            all.unwrap().force_scale()
        };
        let mut faint = samples.clone();
        faint.tau[4] = 0.03;
        assert!((scale(samples)[1] - 2.0_f64.sqrt()).abs() < 1e-3);
        let found = scale(faint);
        assert!((found[1] - 0.09).abs() < 1e-12 && (found[2] - 30.0).abs() < 1e-12);
    }

    #[test]
    fn of_many_recordings_whole_ones_are_held_back() {
        let all = (0..20).map(|k| recording(&k.to_string(), 10)).collect();
        let (train, held) = split(all, 0.1, 3).unwrap();
        assert_eq!((train.len(), held.len()), (18, 2));
        assert!(held.iter().all(|t| t.len() == 10));
    }

    #[test]
    fn of_few_recordings_blocks_spread_over_each_are_held_back() {
        for count in [1, 2, 3] {
            let all = (0..count)
                .map(|k| recording(&k.to_string(), 1000))
                .collect();
            let (train, held) = split(all, 0.1, 0).unwrap();
            assert_eq!((train.len(), held.len()), (6 * count, 5 * count));
            assert!(held.iter().all(|t| t.len() == 20));
            let begins: Vec<f64> = held[..5].iter().map(|t| t.t[0]).collect();
            assert_eq!(begins, [90.0, 290.0, 490.0, 690.0, 890.0]);
            // Two samples beside each block are omitted.
            let kept: usize = train.iter().map(Trajectory::len).sum();
            assert_eq!(kept, count * (1000 - 100 - 5 * 2 * 2));
        }
        let (train, held) = split(vec![recording("short", 50)], 0.1, 0).unwrap();
        assert_eq!((train.len(), held.len()), (2, 1));
        assert_eq!((held[0].len(), held[0].t[0]), (5, 22.0));
    }
}
