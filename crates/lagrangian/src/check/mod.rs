//! A gate before fitting: what a roboticist would look at in recordings before trusting them.
//!
//! Every item has a verdict, a finding in words, the numbers behind it and a remedy. [`Verdict::Fail`] means that
//! a fit of these recordings would be meaningless; [`Verdict::Warn`] that it would be worse than it could be.

mod coverage;
mod drive;
mod regression;
mod signals;
mod time;
mod velocity;

use std::collections::BTreeMap;

use serde::Serialize;

use crate::trajectory::{Recording, Signal};

/// Fewer samples than this in all cannot carry a fit.
const FEWEST_SAMPLES: usize = 20;
/// A fit of a learned model gets poor below this many samples for each axis of the state.
const SAMPLES_PER_AXIS: usize = 100;

/// How good an item is.
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

/// One thing that was looked at.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Item {
    /// What was looked at, e.g. `velocity`.
    pub name: &'static str,
    /// The trajectory; none if it is about all of them.
    pub trajectory: Option<String>,
    /// How good it is.
    pub verdict: Verdict,
    /// What was found, in words.
    pub finding: String,
    /// What to do about it.
    pub remedy: Option<String>,
    /// The numbers behind it, under stable names.
    pub values: BTreeMap<String, f64>,
}

impl Item {
    /// An item that passes.
    #[must_use]
    pub fn pass(name: &'static str, finding: impl Into<String>) -> Self {
        Self {
            name,
            trajectory: None,
            verdict: Verdict::Pass,
            finding: finding.into(),
            remedy: None,
            values: BTreeMap::new(),
        }
    }

    /// An item that warns and says what to do.
    #[must_use]
    pub fn warn(name: &'static str, finding: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self {
            verdict: Verdict::Warn,
            remedy: Some(remedy.into()),
            ..Self::pass(name, finding)
        }
    }

    fn fail(name: &'static str, finding: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self {
            verdict: Verdict::Fail,
            remedy: Some(remedy.into()),
            ..Self::pass(name, finding)
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

/// Everything that was looked at.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CheckReport {
    /// First the items about all recordings together, then those of each.
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
        self.items
            .iter()
            .map(|i| i.verdict)
            .max()
            .unwrap_or(Verdict::Fail)
    }

    /// How many items have this verdict.
    #[must_use]
    pub fn count(&self, verdict: Verdict) -> usize {
        self.items.iter().filter(|i| i.verdict == verdict).count()
    }
}

/// Options of [`check`].
#[derive(Debug, Clone, Default, PartialEq)]
pub struct CheckOptions {
    /// Window of the filter for motion and forces, s, that a fit will use; chosen from the data where there is none.
    pub filter: Option<f64>,
}

/// Looks at recordings before they are fitted. It never fails itself: whatever is wrong is an item.
///
/// # Example
/// ```
/// use lagrangian::{CheckOptions, Format, Layout, Verdict, check};
/// // q̇ in degrees per second, q in radians.
/// let rows: String = (0..200).map(|k| f64::from(k) * 0.02)
///     .map(|t| format!("{t},{},{}\n", t.sin(), t.cos().to_degrees())).collect();
/// let file = std::io::Cursor::new(format!("t,q1,qd1\n{rows}"));
/// let recordings = Format::Csv.read(file, "swing", &Layout::default())?.recordings;
/// let report = check(&recordings, &CheckOptions::default());
/// assert!(!report.passed());
/// assert!(report.items.iter().any(|i| i.verdict == Verdict::Fail && i.finding.contains("degrees")));
/// # Ok::<(), lagrangian::Error>(())
/// ```
#[must_use]
pub fn check(recordings: &[Recording], options: &CheckOptions) -> CheckReport {
    let mut items = vec![
        length(recordings),
        coverage::coverage(recordings),
        same_coordinates(recordings),
    ];
    items.extend(signals::excitation(recordings));
    items.extend(drive::items(recordings, options));
    for recording in recordings {
        let shaped = shapes(recording);
        let whole = shaped.is_none();
        let mut own: Vec<Item> = shaped.into_iter().collect();
        own.extend(time::sample(recording));
        own.extend(time::items(recording));
        own.extend(time::too_short(recording));
        if whole {
            own.extend(parameters(recording));
            own.extend(signals::items(recording));
            own.extend(signals::passive(recording));
        }
        if whole && time::usable(recording) {
            own.extend(signals::sampled_items(recording));
            own.extend(velocity::items(recording));
        }
        items.extend(own.into_iter().map(|item| item.of(recording)));
    }
    CheckReport { items }
}

/// Whether there is enough of it.
fn length(recordings: &[Recording]) -> Item {
    let samples: usize = recordings.iter().map(Recording::len).sum();
    let seconds: f64 = recordings
        .iter()
        .filter_map(|r| Some(r.t.last()? - r.t.first()?))
        .sum();
    let n = recordings.first().map_or(0, Recording::dof);
    let finding = format!(
        "{samples} samples, {seconds:.4} s, {} trajectories, {n} coordinates",
        recordings.len()
    );
    let item = if samples < FEWEST_SAMPLES {
        Item::fail(
            "length",
            finding,
            format!(
                "record more: at least {FEWEST_SAMPLES} samples, some thousand for a learned model"
            ),
        )
    } else if samples < SAMPLES_PER_AXIS * 2 * n {
        Item::warn(
            "length",
            finding,
            format!(
                "record more: {} samples or more for {n} coordinates",
                SAMPLES_PER_AXIS * 2 * n
            ),
        )
    } else {
        Item::pass("length", finding)
    };
    item.value("samples", samples as f64)
        .value("seconds", seconds)
        .value("trajectories", recordings.len() as f64)
}

fn same_coordinates(recordings: &[Recording]) -> Item {
    let Some(first) = recordings.first() else {
        return Item::fail(
            "coordinates",
            "there is no recording",
            "name files that hold some",
        );
    };
    match recordings
        .iter()
        .find(|r| r.coordinates != first.coordinates)
    {
        Some(other) => Item::fail(
            "coordinates",
            format!(
                "'{}' and '{}' have different coordinates",
                first.name, other.name
            ),
            "fit recordings of one system at a time; name the columns with `q`, the angles with `angles`",
        ),
        None => {
            let names: Vec<String> = first
                .coordinates
                .0
                .iter()
                .enumerate()
                .map(|(i, c)| describe(first, i, &c.name))
                .collect();
            Item::pass("coordinates", names.join(", "))
        }
    }
}

fn describe(recording: &Recording, i: usize, name: &str) -> String {
    let kind = if recording.coordinates.is_circle(i) {
        "angle"
    } else if recording.coordinates.is_parameter(i) {
        "parameter"
    } else {
        "line"
    };
    let force = recording.columns.signals.tau.get(i);
    let free = force.is_some_and(String::is_empty);
    let drive = if free {
        ", no column of its force: 0"
    } else {
        ""
    };
    format!("{name} ({kind}{drive})")
}

/// An item if a parameter is not constant.
fn parameters(recording: &Recording) -> Option<Item> {
    match recording.parameters_are_constant() {
        Err(crate::Error::Sample {
            row,
            finding,
            remedy,
            ..
        }) => Some(Item::fail(
            "parameter",
            format!("{finding} at sample {row}"),
            remedy,
        )),
        _ => None,
    }
}

/// An item if a signal has another length than the time stamps.
fn shapes(recording: &Recording) -> Option<Item> {
    let expected = recording.len() * recording.dof();
    let (signal, values) = recording.iter().find(|(signal, values)| {
        let measured = *signal == Signal::Q || !values.is_empty();
        measured && values.len() != expected
    })?;
    let finding = format!(
        "{} has {} values where {expected} are needed",
        signal.name(),
        values.len()
    );
    Some(Item::fail(
        "shape",
        finding,
        "give one value per sample and coordinate",
    ))
}
