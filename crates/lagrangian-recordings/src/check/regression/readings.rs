//! Other readings of the same data: angles in another unit, and forces that act beyond a threshold only.
//!
//! Each reading changes the recordings, and a regression tells what it leaves unexplained on omitted stretches: of each force, or of the
//! acceleration of a coordinate without one.

use super::cutoff::left;
use super::least_squares::{Part, RIDGE};
use super::undriven::{is_driven, of_acceleration};
use super::{Filtered, Stretches};
use crate::Recording;
use lagrangian_motion::statistics::{column, mean, root_mean_square};
use lagrangian_motion::{Coordinate, Signal, Topology};

/// Thresholds of a dead zone that are tried, in root mean squares of the force.
const THRESHOLDS: [f64; 8] = [0.1, 0.14, 0.2, 0.28, 0.4, 0.56, 0.8, 1.1];
/// A dead zone is sought where the force as recorded leaves more than this part unexplained.
const LEFT: f64 = 0.01;

/// A unit counts where the motion with it leaves less than this part unexplained.
const UNEXPLAINED: f64 = 0.5;

/// What remains unexplained under other readings.
pub(in crate::check) struct Readings {
    /// With angles read as degrees, in parts of what remains of radians.
    pub(in crate::check) degrees: Option<f64>,
    /// With angles that were converted from degrees read as radians, likewise.
    pub(in crate::check) radians: Option<f64>,
    /// For each coordinate, the best dead zone of its force.
    pub(in crate::check) dead_zones: Vec<Option<DeadZone>>,
}

/// Forces below a threshold that have no effect.
#[derive(Debug, Clone, Copy)]
pub(in crate::check) struct DeadZone {
    /// The threshold, N·m or N.
    pub(in crate::check) threshold: f64,
    /// The part of the force that the motion leaves unexplained with it, and as recorded.
    pub(in crate::check) left: (f64, f64),
}

impl Readings {
    /// The readings of recordings with forces, those of free motions 0.
    pub(super) fn new(recordings: Vec<Recording>, hertz: f64) -> Option<Self> {
        let stretches = stretches(&recordings, hertz)?;
        let own = left_of_each(&stretches);
        let is_forced = recordings.iter().any(|r| r.tau.iter().any(|x| *x != 0.0));
        let circle = |c: &Coordinate| c.topology == Topology::Circle;
        let ratio = |angle: &dyn Fn(&Coordinate) -> bool, unit: f64| {
            let coordinates = &recordings[0].coordinates.0;
            coordinates.iter().any(angle).then_some(())?;
            let other = in_unit(&recordings, angle, unit);
            let other = left_of_each(&self::stretches(&other, hertz)?);
            let known = own
                .iter()
                .zip(other)
                .filter_map(|(a, b)| Some((a.as_ref()?.ln(), b?.ln())));
            let (before, after): (Vec<f64>, Vec<f64>) = known.unzip();
            let [before, after] = [before, after].map(|all| mean(&mut all.into_iter()).exp());
            (after < UNEXPLAINED).then_some(after / before)
        };
        Some(Self {
            // Free motions of wheels are smooth in any unit.
            degrees: ratio(&|c| is_forced && c.unit != "m", 1.0_f64.to_radians()),
            radians: ratio(&circle, 1.0_f64.to_degrees()),
            dead_zones: dead_zones(&recordings, hertz, (stretches, &own)),
        })
    }
}

/// The signals of all stretches after a low-pass.
fn stretches(recordings: &[Recording], hertz: f64) -> Option<Stretches<'_>> {
    let recordings: Vec<&Recording> = recordings.iter().collect();
    Filtered::new(&recordings, hertz).signals([0.0; 2], &[0.0])
}

/// The part of each coordinate's force, or acceleration, that a regression leaves unexplained on omitted stretches.
fn left_of_each(stretches: &Stretches<'_>) -> Vec<Option<f64>> {
    let of = |i: usize| {
        let parts = stretches.parts(i);
        if is_driven(stretches, i) {
            return left(&parts, &parts);
        }
        let moving = !stretches.coordinates.is_parameter(i);
        let left = 1.0 - moving.then(|| of_acceleration(&parts))??;
        (left > 0.0).then_some(left)
    };
    (0..stretches.speeds.len()).map(of).collect()
}

/// The recordings with their angles in another unit.
fn in_unit(
    recordings: &[Recording],
    angle: &dyn Fn(&Coordinate) -> bool,
    unit: f64,
) -> Vec<Recording> {
    let mut all = recordings.to_vec();
    for recording in &mut all {
        let units: Vec<f64> = recording
            .coordinates
            .0
            .iter()
            .map(|c| if angle(c) { unit } else { 1.0 })
            .collect();
        for signal in [Signal::Q, Signal::Qd, Signal::Qdd] {
            let values = recording.signals.get_mut(signal).iter_mut();
            values
                .zip(units.iter().cycle())
                .for_each(|(x, unit)| *x *= unit);
        }
    }
    all
}

/// The dead zone of each force that leaves least unexplained, beside the signals as recorded and what these leave.
fn dead_zones(
    recordings: &[Recording],
    hertz: f64,
    (mut stretches, own): (Stretches<'_>, &[Option<f64>]),
) -> Vec<Option<DeadZone>> {
    let n = own.len();
    let forces: Vec<f64> = recordings
        .iter()
        .flat_map(|r| r.tau.iter().copied())
        .collect();
    let sizes = column(&forces, n, root_mean_square);
    let sought =
        |i: &usize| sizes[*i] > 0.0 && own[*i].is_some_and(|left| (LEFT..1.0).contains(&left));
    let mut best = vec![None; n];
    if !(0..n).any(|i| sought(&i)) {
        return best;
    }
    if act_beyond_thresholds(&mut stretches, recordings, hertz, &sizes).is_none() {
        return best;
    }
    for i in (0..n).filter(sought) {
        let left = left_in_columns(&stretches.parts(i)).unwrap_or_default();
        let known = left.into_iter().zip(THRESHOLDS);
        let least = known.min_by(|a, b| a.0.total_cmp(&b.0));
        best[i] = least.zip(own[i]).map(|((left, part), before)| DeadZone {
            threshold: part * sizes[i],
            left: (left, before),
        });
    }
    best
}

/// Puts the forces beyond each threshold in the place of those at several delays.
fn act_beyond_thresholds(
    stretches: &mut Stretches<'_>,
    recordings: &[Recording],
    hertz: f64,
    sizes: &[f64],
) -> Option<()> {
    let n = sizes.len();
    let beyond = |part: f64| -> Option<Vec<Vec<f64>>> {
        let mut all = recordings.to_vec();
        for r in &mut all {
            let forces = r.signals.tau.iter_mut().zip(sizes.iter().cycle());
            forces.for_each(|(x, size)| *x = x.signum() * (x.abs() - part * size).max(0.0));
        }
        let signals = self::stretches(&all, hertz)?.signals;
        Some(signals.into_iter().map(|s| s.tau).collect())
    };
    let forces: Vec<Vec<Vec<f64>>> = THRESHOLDS.into_iter().map(beyond).collect::<Option<_>>()?;
    for (k, signals) in stretches.signals.iter_mut().enumerate() {
        let rows = (0..signals.q.len()).step_by(n);
        let of_row = |m: usize| forces.iter().flat_map(move |f| &f[k][m..m + n]);
        signals.tau = rows.flat_map(of_row).copied().collect();
    }
    Some(())
}

/// The part of the variance of the force in each column that is left on omitted stretches.
fn left_in_columns(parts: &[Part]) -> Option<Vec<f64>> {
    let mut all = Part::sum(parts)?;
    let columns = 0..THRESHOLDS.len();
    let errors = all.without_each(parts, |sums, k| {
        let found = sums.coefficients(RIDGE)?;
        let law = |d: usize| -> Vec<f64> { (0..found.nrows()).map(|r| found[(r, d)]).collect() };
        let errors = columns.clone().map(|d| parts[k].misfit(&law(d), d, 1.0));
        Some(errors.collect::<Vec<f64>>())
    })?;
    let left = |d: usize| errors.iter().map(|e| e[d]).sum::<f64>() / all.variance_in(d);
    Some(columns.clone().map(left).collect())
}
