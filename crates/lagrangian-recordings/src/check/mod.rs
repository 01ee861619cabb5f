//! Quality checks of recordings before a fit.
//!
//! Every item has a verdict, a finding in words, its numbers and a remedy. [`Verdict::Fail`] means that
//! a fit of these recordings would be meaningless; [`Verdict::Warn`] that it would be worse than it could be.

mod column;
mod copies;
mod coverage;
mod dependent;
mod drive;
mod evidence;
mod frozen;
mod goals;
mod joints;
mod pairs;
mod rates;
mod regression;
mod repeated;
mod signals;
mod spikes;
mod swings;
mod time;

use std::borrow::Cow;
use std::collections::BTreeMap;

pub use dependent::CONSTRAINTS;
pub use drive::NOISY_FORCES;
pub use evidence::Claim;
use lagrangian_motion::parallel::prelude::*;
use regression::{JointFits, MOST_JOINTS};
pub use repeated::check_validation;
use serde::Serialize;
pub use signals::{LARGEST, RANGE};

use crate::stops::without;
use crate::{Recording, Stop, stops};
use lagrangian_motion::counted;
use lagrangian_motion::{Signal, Topology};

/// Fewer samples than this in all are too few for a fit.
const FEWEST_SAMPLES: usize = 20;
/// A fit of a learned model gets poor below this many samples for each axis of the state.
const SAMPLES_PER_AXIS: usize = 100;

/// Severity of an item.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// Nothing to do.
    Pass,
    /// A fit would be worse than it could be.
    Warn,
    /// A fit would be meaningless.
    Fail,
}

/// One result of the check.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Item {
    /// Name of the quantity that was checked, e.g. `velocity`.
    pub name: &'static str,
    /// The trajectory; `None` if the item is about all of them.
    pub trajectory: Option<String>,
    /// Severity.
    pub verdict: Verdict,
    /// The finding, in words.
    pub finding: String,
    /// Remedy, in words.
    pub remedy: Option<String>,
    /// Numbers of the finding, under stable names.
    pub values: BTreeMap<String, f64>,
    /// Whether the values themselves look wrong, so that no model of them can be called good.
    pub doubtful: bool,
    /// The claim about all samples: an accusation of this kind must hold in each half of the data.
    #[serde(skip)]
    pub claim: Option<Claim>,
    /// The trajectories that do not follow the law of the others.
    #[serde(skip)]
    pub odd: Vec<String>,
}

/// Findings that single samples, or exact equalities, show values to be wrong; other accusations concern all samples.
const OF_SAMPLES: [&str; 11] = [
    "constraints",
    "copy",
    "forces",
    "frozen",
    "goal",
    "jumps",
    "machines",
    "repeated",
    "repeats",
    "spikes",
    "unit",
];

/// Doubts about the extent of the motion, about single samples, about a scale, or about a small part of the forces: a model may be
/// right all the same.
const RESERVATIONS: [&str; 8] = [
    "coupled",
    "derivative",
    "frozen",
    "repeated",
    "sign",
    "spikes",
    "swings",
    "velocity",
];

/// The part of the forces that must be unexplained before a delay is said to be what a model misses, and that before no model without
/// it is good.
const MATTERS: f64 = 0.005;
const DECIDES: f64 = 0.03;

impl Item {
    /// Whether the finding says that values are wrong, and not only few or noisy.
    #[must_use]
    pub fn accuses(&self) -> bool {
        let is_about_values = self.claim.is_some() || OF_SAMPLES.contains(&self.name);
        self.verdict > Verdict::Pass && is_about_values
    }

    /// Whether values that look wrong contradict one another, and are not only few, scaled, or wrong at single samples.
    #[must_use]
    pub fn contradicts(&self) -> bool {
        self.doubtful && !RESERVATIONS.contains(&self.name)
    }

    /// Whether the finding would explain that a model falls short, which may be right all the same.
    #[must_use]
    pub fn explains(&self) -> bool {
        let own = self.verdict > Verdict::Pass && ["dead zone", "delay"].contains(&self.name);
        own && self
            .left()
            .is_none_or(|[with, without]| without > MATTERS && without > 2.0 * with)
    }

    /// Whether the finding is so large that no model without it can be good.
    #[must_use]
    pub fn decides(&self) -> bool {
        let much = |[with, without]: [f64; 2]| without > DECIDES && without > 3.0 * with;
        self.explains() && self.left().is_some_and(much)
    }

    /// The parts of the forces that a delay leaves unexplained, and that no delay does.
    fn left(&self) -> Option<[f64; 2]> {
        let left = |name| self.values.get(name).map(|explained: &f64| 1.0 - explained);
        left("explained")
            .zip(left("explained_without"))
            .map(|(a, b)| [a, b])
    }

    /// The trajectory that the item is about.
    fn about(&self) -> Option<&str> {
        self.trajectory.as_deref()
    }

    /// An item that passes.
    pub fn pass(name: &'static str, finding: impl Into<String>) -> Self {
        Self {
            name,
            trajectory: None,
            verdict: Verdict::Pass,
            finding: finding.into(),
            remedy: None,
            values: BTreeMap::new(),
            doubtful: false,
            claim: None,
            odd: Vec::new(),
        }
    }

    /// A warning that the values themselves are wrong, and not only few or noisy.
    fn doubt(name: &'static str, finding: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self::warn(name, finding, remedy).in_doubt()
    }

    fn in_doubt(self) -> Self {
        Self {
            doubtful: true,
            ..self
        }
    }

    /// An item that warns and names a remedy.
    pub fn warn(name: &'static str, finding: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self::pass(name, finding).with(Verdict::Warn, remedy)
    }

    fn fail(name: &'static str, finding: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self::pass(name, finding).with(Verdict::Fail, remedy)
    }

    fn with(self, verdict: Verdict, remedy: impl Into<String>) -> Self {
        Self {
            verdict,
            remedy: Some(remedy.into()),
            ..self
        }
    }

    /// Turns the item into a warning where the condition holds.
    fn warn_if(self, condition: bool, remedy: impl Into<String>) -> Self {
        match condition {
            true => self.with(Verdict::Warn, remedy),
            false => self,
        }
    }

    /// Adds a figure under a stable name.
    #[must_use]
    pub fn value(mut self, name: impl Into<String>, value: f64) -> Self {
        self.values.insert(name.into(), value);
        self
    }

    fn of(mut self, recording: &Recording) -> Self {
        self.trajectory = Some(recording.name.clone());
        self
    }
}

/// The results of a check.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CheckReport {
    /// Items about all recordings together come first, then those of each.
    pub items: Vec<Item>,
}

impl CheckReport {
    /// Whether a fit makes sense: no item fails.
    #[must_use]
    pub fn passed(&self) -> bool {
        self.verdict() < Verdict::Fail
    }

    /// The worst verdict.
    #[must_use]
    pub fn verdict(&self) -> Verdict {
        let verdicts = self.items.iter().map(|i| i.verdict);
        verdicts.max().unwrap_or(Verdict::Fail)
    }

    /// The findings to show: all of them for up to [`CheckReport::IN_FULL`] trajectories. For more, those about all together,
    /// then each kind of warning or failure once, with its trajectories.
    ///
    /// ```
    /// use lagrangian_recordings::check::{CheckReport, Item};
    /// let about = |name: &str| Item { trajectory: Some(name.into()), ..Item::warn("noise", "much", "filter") };
    /// let report = CheckReport { items: ["a", "b", "c", "d"].map(about).to_vec() };
    /// let shown = report.shown();
    /// assert_eq!(shown.len(), 1);
    /// assert_eq!(shown[0].trajectories, ["a", "b", "c", "d"]);
    /// ```
    #[must_use]
    pub fn shown(&self) -> Vec<ShownItem<'_>> {
        let mut names: Vec<&str> = self.items.iter().filter_map(Item::about).collect();
        names.dedup();
        let short = names.len() > Self::IN_FULL;
        let mut shown: Vec<ShownItem> = Vec::new();
        for (first, item) in self.items.iter().enumerate() {
            let Some(name) = item.about().filter(|_| short) else {
                let trajectories = item.about().into_iter().collect();
                shown.push(ShownItem {
                    first,
                    trajectories,
                });
                continue;
            };
            if item.verdict == Verdict::Pass {
                continue;
            }
            let same = |own: &&mut ShownItem| {
                let first = &self.items[own.first];
                !own.trajectories.is_empty()
                    && first.name == item.name
                    && first.verdict == item.verdict
            };
            match shown.iter_mut().find(same) {
                // A trajectory may have several items of a kind.
                Some(own) if own.trajectories.last() == Some(&name) => {}
                Some(own) => own.trajectories.push(name),
                None => shown.push(ShownItem {
                    first,
                    trajectories: vec![name],
                }),
            }
        }
        shown
    }

    /// Above this number of trajectories, passing items of single ones are not shown, and other items once.
    pub const IN_FULL: usize = 3;

    /// Number of items with this verdict.
    #[must_use]
    pub fn count(&self, verdict: Verdict) -> usize {
        self.items.iter().filter(|i| i.verdict == verdict).count()
    }
}

/// A finding to show, see [`CheckReport::shown`].
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct ShownItem<'a> {
    /// Index of its first item.
    pub first: usize,
    /// The trajectories that it is about; empty if it is about all together.
    pub trajectories: Vec<&'a str>,
}

/// Options of [`check`].
#[derive(Debug, Clone, Default, PartialEq)]
pub struct CheckOptions {
    /// Cut-off of the low-pass for motion and forces that a fit will use, Hz; `None` chooses it from the data.
    pub low_pass: Option<f64>,
}

/// Checks recordings before they are fitted. It returns no error: each problem is an item.
///
/// # Example
/// ```
/// use lagrangian_recordings::{check::{CheckOptions, Verdict, check}, Format, Layout};
/// // q̇ in degrees per second, q in radians.
/// let rows: String = (0..200).map(|k| f64::from(k) * 0.02)
///     .map(|t| format!("{t},{},{}\n", t.sin(), t.cos().to_degrees())).collect();
/// let file = std::io::Cursor::new(format!("t,q1,qd1\n{rows}"));
/// let recordings = Format::Csv.read(file, "swing", &Layout::default())?.recordings;
/// let report = check(&recordings, &CheckOptions::default());
/// assert!(!report.passed());
/// assert!(report.items.iter().any(|i| i.verdict == Verdict::Fail && i.finding.contains("degrees")));
/// # Ok::<(), lagrangian_motion::Error>(())
/// ```
#[must_use]
pub fn check(recordings: &[Recording], options: &CheckOptions) -> CheckReport {
    if recordings.len() <= MOST_CHECKED {
        return check_all(recordings, options);
    }
    let some = some_of(recordings);
    let mut report = check_all(&some, options);
    let finding = format!(
        "the check is of {} of {} trajectories ({MOST_CHECKED} at most), and of any that cannot be used",
        some.len(),
        recordings.len()
    );
    report.items.insert(0, Item::pass(CHECKED, finding));
    report
}

/// Largest number of trajectories that are checked one by one: each has a dozen findings.
const MOST_CHECKED: usize = 20_000;

/// Name of the items about stops that are hit.
pub const IMPACTS: &str = "impacts";

/// Name of the item which reports that not all trajectories were checked.
pub const CHECKED: &str = "checked";

/// A subset of too many trajectories: those that cannot be used, and others evenly spread.
fn some_of(recordings: &[Recording]) -> Vec<Recording> {
    let every = recordings.len().div_ceil(MOST_CHECKED / 2).max(1);
    let numbered = recordings.iter().enumerate();
    let bad = numbered.filter(|(k, r)| k % every != 0 && r.validate().is_err());
    let bad = bad.map(|(_, r)| r).take(MOST_CHECKED / 2);
    let spread = recordings.iter().step_by(every);
    spread.chain(bad).cloned().collect()
}

fn check_all(recorded: &[Recording], options: &CheckOptions) -> CheckReport {
    let repaired: Vec<Cow<Recording>> = recorded.par_iter().map(Recording::repaired).collect();
    let pairs = recorded.iter().zip(&repaired);
    let jitter: Vec<Option<Item>> = pairs.map(|(a, b)| time::jitter(a, b)).collect();
    let owned: Vec<Recording>;
    let mut recordings = recorded;
    if jitter.iter().any(Option::is_some) {
        owned = repaired.into_iter().map(Cow::into_owned).collect();
        recordings = &owned;
    }
    let stops = stops(recordings);
    let free: Vec<Recording>;
    if !stops.is_empty() {
        free = (recordings.iter().cloned().map(|r| without(r, &stops))).collect();
        recordings = &free;
    }
    let swings = swings_of_all(recordings);
    let mut items = vec![
        length(recordings, swings),
        coverage::coverage(recordings, swings),
        same_coordinates(recordings),
    ];
    items.extend(stops.iter().map(impacts));
    items.extend(signals::excitation(recordings));
    items.extend(repeated::items(recordings));
    items.extend(dependent::items(recordings));
    let fits = regression::fit_joints(recordings, options, false);
    let mut shared = of_all(recordings, fits.as_ref(), 1.0);
    // A half uses the same low-pass and range of delays, so that it differs by its samples alone.
    let found = fits.and_then(|fits| fits.low_pass);
    let low_pass = options.low_pass.or(found.map(|found| found.hertz));
    let in_half = |half: &[Recording]| {
        let fits = regression::fit_joints(half, &CheckOptions { low_pass }, true);
        of_all(half, fits.as_ref(), evidence::OF_HALF)
    };
    evidence::confirm(&mut shared, recordings, in_half);
    drive::name_the_shifts(&mut shared, recordings);
    let all: Vec<&Recording> = recordings.iter().collect();
    shared.extend(drive::disagreement(&all, 0, low_pass));
    items.extend(shared);
    items.extend(recordings.first().filter(|r| r.dof() > MOST_JOINTS).map(|r| {
        let finding = format!(
            "{} coordinates: whether forces, signs and units fit the motion is examined for {MOST_JOINTS} at most",
            r.dof()
        );
        Item::pass(CHECKED, finding)
    }));
    for (recording, jitter) in recordings.iter().zip(jitter) {
        let mut own = of_one(recording, 1.0);
        own.extend(jitter);
        let in_half = |half: &[Recording]| {
            half.iter()
                .flat_map(|r| of_one(r, evidence::OF_HALF))
                .collect()
        };
        evidence::confirm(&mut own, std::slice::from_ref(recording), in_half);
        items.extend(own.into_iter().map(|item| item.of(recording)));
    }
    CheckReport { items }
}

/// What is left out at a stop.
fn impacts(stop: &Stop) -> Item {
    let finding = format!(
        "{stop}: the samples there are left out, and what lies between is fitted as free motion, without the stop"
    );
    let remedy = "predict from one impact to the next; to learn all of it without impacts, record smaller motions";
    Item::warn(IMPACTS, finding, remedy)
        .value("at", stop.at)
        .value("hits", stop.hits as f64)
}

/// Findings about all recordings together; `errors` scales the number of standard errors that they need.
fn of_all(recordings: &[Recording], fits: Option<&JointFits>, errors: f64) -> Vec<Item> {
    let mut items = copies::items(recordings);
    items.extend(drive::items(recordings, fits, errors));
    items.extend(goals::items(recordings));
    items
}

/// Findings about one recording; `errors` scales the number of standard errors that they need.
fn of_one(recording: &Recording, errors: f64) -> Vec<Item> {
    let mut own: Vec<Item> = shapes(recording).into_iter().collect();
    let whole = own.is_empty();
    own.extend(time::sample(recording));
    own.extend(joints::renamed(recording));
    own.extend(time::items(recording));
    own.extend(time::too_short(recording));
    if whole {
        own.extend(parameters(recording));
        own.extend(signals::items(recording, errors));
        own.extend(signals::passive(recording));
    }
    if whole && time::usable(recording) {
        own.extend(signals::sampled_items(recording));
        own.extend(rates::items(recording, errors));
    }
    own
}

/// Total length of the recordings.
fn length(recordings: &[Recording], swings: usize) -> Item {
    let samples: usize = recordings.iter().map(Recording::len).sum();
    let seconds = duration(recordings);
    let n = recordings.first().map_or(0, Recording::dof);
    let finding = format!(
        "{samples} samples, {seconds:.4} s, {}, {}",
        counted(recordings.len(), "trajectory"),
        counted(n, "coordinate")
    );
    let enough = SAMPLES_PER_AXIS * 2 * n;
    let item = if samples < FEWEST_SAMPLES {
        let remedy = format!(
            "record more: at least {FEWEST_SAMPLES} samples, some thousand for a learned model"
        );
        Item::fail("length", finding, remedy)
    } else {
        let finding = format!("{finding}; they turn back {swings} times in all");
        let coordinates = counted(n, "coordinate");
        let remedy = format!("record more: {enough} samples or more for {coordinates}");
        Item::pass("length", finding)
            .warn_if(samples < enough, remedy)
            .value("swings", swings as f64)
    };
    item.value("samples", samples as f64)
        .value("seconds", seconds)
        .value("trajectories", recordings.len() as f64)
}

/// The duration of all recordings together, s.
fn duration(recordings: &[Recording]) -> f64 {
    let durations = recordings.iter();
    let durations = durations.filter_map(|r| Some(r.t.last()? - r.t.first()?));
    durations.sum()
}

/// The swings of all coordinates in all recordings.
fn swings_of_all(recordings: &[Recording]) -> usize {
    let all = recordings.iter().flat_map(swings::swings);
    all.map(|s| s.count).sum()
}

fn same_coordinates(recordings: &[Recording]) -> Item {
    let Some(first) = recordings.first() else {
        let finding = "there is no recording";
        return Item::fail("coordinates", finding, "name files that hold some");
    };
    let mut others = recordings.iter();
    if let Some(other) = others.find(|r| r.coordinates != first.coordinates) {
        let (one, other) = (&first.name, &other.name);
        let finding = format!("'{one}' and '{other}' have different coordinates");
        let remedy = "fit recordings of one system at a time; name the columns with `q`, the angles with `angles`";
        return Item::fail("coordinates", finding, remedy);
    }
    let named = first.coordinates.0.iter().enumerate();
    let names: Vec<String> = named.map(|(i, c)| describe(first, i, &c.name)).collect();
    Item::pass("coordinates", signals::listed(&names))
}

fn describe(recording: &Recording, i: usize, name: &str) -> String {
    let kind = match recording.coordinates.0[i].topology {
        Topology::Circle => "angle",
        Topology::Parameter => "parameter",
        Topology::Line => "line",
    };
    let drive = match recording.columns.signals.tau.get(i) {
        Some(column) if column.is_empty() => ", no column of its force: 0",
        _ => "",
    };
    format!("{name} ({kind}{drive})")
}

/// An item if a parameter is not constant.
fn parameters(recording: &Recording) -> Option<Item> {
    let Err(lagrangian_motion::Error::Sample {
        row,
        finding,
        remedy,
        ..
    }) = recording.parameters_are_constant()
    else {
        return None;
    };
    let finding = format!("{finding} at sample {row}");
    Some(Item::fail("parameter", finding, remedy))
}

/// An item if a signal has another length than the time stamps.
fn shapes(recording: &Recording) -> Option<Item> {
    let expected = recording.len() * recording.dof();
    let (signal, values) = recording.iter().find(|(signal, values)| {
        let measured = *signal == Signal::Q || !values.is_empty();
        measured && values.len() != expected
    })?;
    let (signal, count) = (signal.name(), values.len());
    let finding = format!("{signal} has {count} values where {expected} are needed");
    let remedy = "give one value per sample and coordinate";
    Some(Item::fail("shape", finding, remedy))
}

/// The lowest and the highest of some values, ignoring NaN; an empty range without any.
pub(crate) fn range(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let start = (f64::INFINITY, f64::NEG_INFINITY);
    values.fold(start, |(low, high), x| (low.min(x), high.max(x)))
}
