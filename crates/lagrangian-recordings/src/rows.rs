//! Streamed rows of a file, sorted into recordings.

use std::collections::HashMap;
use std::f64::consts::{PI, TAU};
use std::slice::ChunksExactMut;

use super::columns::Resolved;
use super::derivatives::GAP;
use super::even;
use super::sample::{Flaw, Sampled, Stretch, TimeStep, Wrap, drop_stretches};
use super::{Readings, Recording};
use lagrangian_motion::Signals;
use lagrangian_motion::statistics::upper_median;
use lagrangian_motion::{Error, Result, shown};

/// More trajectories than this, with hardly more than one row each, indicate a wrong column.
const MANY_TRAJECTORIES: usize = 1000;

/// Largest number of trajectories of a file: each takes some kilobytes beside its rows.
const MOST_TRAJECTORIES: usize = 1 << 18;

/// A shorter run is no log of its own where time starts again, rows.
const SHORTEST_RUN: usize = 8;

/// Collects rows; the memory grows with the rows that are kept, not with the size that a header claims.
pub(super) struct Rows {
    resolved: Resolved,
    file: String,
    logs: Logs,
    /// Number of rows that repeat the one before.
    repeated: usize,
    partial: Vec<Partial>,
    by_name: HashMap<String, usize>,
    current: usize,
    rows: usize,
    /// Number of rows that are held now.
    held: usize,
    /// Stretches with this number or a larger one are not kept.
    least: u64,
}

/// The times of a log.
#[derive(Default)]
struct Times {
    /// Those of its first rows, as many as make a log.
    first: Vec<f64>,
    last: f64,
    /// The number of rows since time last went back.
    rising: usize,
}

impl Times {
    /// Adds the time of a row; one that stands still counts once.
    fn add(&mut self, t: f64) {
        if self.rising > 0 && t.total_cmp(&self.last).is_eq() {
            return;
        }
        let rises = self.rising > 0 && t > self.last;
        self.rising = if rises { self.rising + 1 } else { 1 };
        self.last = t;
        if self.first.len() < SHORTEST_RUN {
            self.first.push(t);
        }
    }

    /// Whether a log may begin at this time: within a usual step of where this one began, after rows that make one.
    fn may_end_before(&self, t: f64) -> bool {
        let near = |step: f64| t <= self.first[0] + step;
        self.rising >= SHORTEST_RUN && t < self.last && self.usual_step().is_some_and(near)
    }

    /// Whether two times follow each other as those of a log do: a single wrong stamp begins none.
    fn go_on(&self, t: f64, next: f64) -> bool {
        let usual = |step: f64| next > t && next - t <= GAP * step;
        self.usual_step().is_some_and(usual)
    }

    fn usual_step(&self) -> Option<f64> {
        let steps = self.first.windows(2).map(|own| own[1] - own[0]);
        (self.first.len() > 1).then(|| upper_median(&mut steps.collect::<Vec<_>>()))
    }
}

/// The logs of a file that does not name its trajectories: each begins where time starts again.
struct Logs {
    /// The times of the current log, and its name.
    times: Times,
    name: String,
    /// A row that may be the first of the next log.
    waiting: Option<Vec<f64>>,
    /// The rows of the file at which logs after the first begin.
    begins: Vec<usize>,
}

/// One recording while it grows.
struct Partial {
    recording: Recording,
    rows: usize,
    /// The numbers of the previous row, as stored in the file.
    previous: Vec<f64>,
    /// The angles of the previous row, kept or not, as stored in the file.
    last: Vec<f64>,
    turns: Vec<i32>,
    /// Rows of a stretch.
    length: usize,
    /// Number of rows that `every` does not skip.
    counted: usize,
    /// Time of the last of these rows, and the parameters of the first.
    before: f64,
    parameters: Vec<(usize, f64)>,
    low: Vec<f64>,
    high: Vec<f64>,
}

impl Partial {
    fn new(name: String, resolved: &Resolved) -> Self {
        let mut columns = resolved.columns.clone();
        for (_, names) in columns.signals.iter_mut() {
            names.iter_mut().for_each(|name| *name = shown(name));
        }
        let n = columns.signals.q.len();
        let recording = Recording {
            name,
            coordinates: resolved.coordinates.clone(),
            t: Vec::new(),
            signals: Signals::default(),
            columns,
            unwrapped: vec![0; n],
            sampled: Some(Sampled::new()),
            breaks: Vec::new(),
        };
        Self {
            recording,
            rows: 0,
            previous: Vec::new(),
            last: vec![f64::NAN; n],
            turns: vec![0; n],
            length: resolved.sample.map_or(usize::MAX, |s| s.length()),
            counted: 0,
            before: f64::NAN,
            parameters: Vec::new(),
            low: vec![f64::INFINITY; n],
            high: vec![f64::NEG_INFINITY; n],
        }
    }

    /// Whether a row is the previous one once more, its time included.
    fn repeats(&mut self, values: &[f64]) -> bool {
        let same = is_same(&self.previous, values);
        self.previous.clear();
        self.previous.extend(values);
        same
    }

    /// Adds a row; returns whether it is kept. Stretches whose number is `least` or more are skipped.
    fn push(&mut self, values: &mut [f64], resolved: &Resolved, least: u64) -> bool {
        for (value, factor) in values.iter_mut().zip(&resolved.factors) {
            *value *= factor;
        }
        for points in &resolved.points {
            values[points.at] = points.angle(values);
        }
        if let Some(interval) = resolved.interval {
            values[0] = interval * self.rows as f64;
        }
        let n = self.last.len();
        let counts = self.rows.is_multiple_of(resolved.every);
        self.rows += 1;
        for i in (0..n).filter(|&i| resolved.coordinates.is_circle(i)) {
            self.follow_angle(i, values[1 + i]);
        }
        let keep = counts && self.is_kept(resolved, least);
        if counts {
            self.inspect(values, resolved);
        }
        if keep {
            self.append(values);
        }
        keep
    }

    /// Whether the next row belongs to a kept stretch; begins a stretch at its first row.
    fn is_kept(&mut self, resolved: &Resolved, least: u64) -> bool {
        let place = self.counted / self.length;
        let r = &mut self.recording;
        let Some(sampled) = &mut r.sampled else {
            return true;
        };
        if !self.counted.is_multiple_of(self.length) {
            return sampled.stretches.last().is_some_and(|s| s.place == place);
        }
        let number = resolved.sample.map_or(0, |s| s.number(&r.name, place));
        if number >= least {
            return false;
        }
        let turns = self.turns.iter().enumerate().filter(|(_, t)| **t != 0);
        sampled.stretches.push(Stretch {
            place,
            row: self.counted,
            at: r.t.len(),
            number,
            wraps: turns.map(|(i, turns)| Wrap::at(0, i, *turns)).collect(),
        });
        true
    }

    /// Collects the facts of every row, kept or not.
    fn inspect(&mut self, values: &[f64], resolved: &Resolved) {
        self.counted += 1;
        let sampled = self.recording.sampled.as_mut();
        let Some(sampled) = sampled.filter(|_| resolved.sample.is_some()) else {
            return;
        };
        sampled.rows = self.counted;
        let (before, step) = (self.before, values[0] - self.before);
        self.before = values[0];
        if step > sampled.longest_step.seconds {
            sampled.longest_step = TimeStep {
                seconds: step,
                after: before,
            };
        }
        if self.counted == 1 {
            let parameters = resolved.coordinates.parameters();
            self.parameters = parameters.map(|i| (i, values[1 + i])).collect();
        }
        if sampled.flaw.is_none() {
            let found = flaw(values, before, &self.parameters);
            sampled.flaw = found.map(|(column, finding, remedy)| Flaw {
                row: self.rows - 1,
                column: resolved.names().nth(column).cloned().unwrap_or_default(),
                finding,
                remedy,
            });
        }
    }

    fn append(&mut self, values: &[f64]) {
        let r = &mut self.recording;
        r.t.push(values[0]);
        let mut rest = values[1..].iter();
        let signals = r.signals.iter_mut().zip(r.columns.signals.iter());
        for ((_, signal), (_, names)) in signals {
            // A parameter without a column has velocity 0, and a coordinate without one has force 0.
            signal.extend(names.iter().map(|name| match name.as_str() {
                "" => 0.0,
                _ => rest.next().copied().unwrap_or_default(),
            }));
        }
    }

    /// Follows angle `i` through all rows, so that thinning cannot hide a turn.
    fn follow_angle(&mut self, i: usize, q: f64) {
        if !q.is_finite() {
            return;
        }
        let step = q - self.last[i];
        if step.abs() > PI {
            self.turns[i] -= if step > 0.0 { 1 } else { -1 };
            let (r, place) = (&mut self.recording, self.counted / self.length);
            r.unwrapped[i] += 1;
            let last = r.sampled.as_mut().and_then(|s| s.stretches.last_mut());
            // A stretch that begins with the next row starts from the current number of turns.
            if let Some(stretch) = last.filter(|s| s.place == place) {
                let row = r.t.len() - stretch.at;
                stretch.wraps.push(Wrap::at(row, i, self.turns[i]));
            }
        }
        self.last[i] = q;
        self.low[i] = self.low[i].min(q);
        self.high[i] = self.high[i].max(q);
    }

    /// Unwraps the angles whose values all lie within one turn: others were unwrapped during recording.
    fn finish(mut self, sampled: bool) -> Recording {
        let n = self.last.len();
        let within = |i: &usize| self.high[*i] - self.low[*i] <= TAU * 1.001;
        let wrapped: Vec<usize> = (0..n).filter(within).collect();
        let r = &mut self.recording;
        r.name = shown(&r.name);
        for i in (0..n).filter(|i| !wrapped.contains(i)) {
            r.unwrapped[i] = 0;
        }
        let ranges: Vec<_> = r.sampled.iter().flat_map(|s| s.ranges(r.t.len())).collect();
        let stretches = r.sampled.iter_mut().flat_map(|s| &mut s.stretches);
        for (stretch, range) in stretches.zip(ranges) {
            let wraps = std::mem::take(&mut stretch.wraps);
            for &i in &wrapped {
                let rows = range.start * n..range.end * n;
                unwrap(r.signals.q[rows].chunks_exact_mut(n), i, &wraps);
            }
        }
        if !sampled {
            r.sampled = None;
        }
        self.recording
    }
}

impl Recording {
    /// Takes the even steps that its stamps are rounded from; the step and the last place of the stamps, s.
    fn take_even_steps(&mut self) -> Option<(f64, f64)> {
        let (step, place, times) = even::steps(&self.t)?;
        self.t = times;
        Some((step, place))
    }
}

/// Whether two rows hold the same numbers.
fn is_same(a: &[f64], b: &[f64]) -> bool {
    let mut pairs = a.iter().zip(b);
    a.len() == b.len() && pairs.all(|(a, b)| a.total_cmp(b).is_eq())
}

/// Adds the turns of angle `i` to the rows of a stretch.
fn unwrap(rows: ChunksExactMut<'_, f64>, i: usize, wraps: &[Wrap]) {
    let mut wraps = wraps.iter().filter(|w| w.coordinate == i).peekable();
    let mut turns = 0;
    for (k, row) in rows.enumerate() {
        while let Some(wrap) = wraps.next_if(|w| w.row <= k) {
            turns = wrap.turns;
        }
        // Adding 0 turns would change −0 to 0.
        if turns != 0 {
            row[i] += TAU * f64::from(turns);
        }
    }
}

/// The fault in a row that follows time `before`: the index of the column among the numbers, a finding, a remedy.
fn flaw(
    values: &[f64],
    before: f64,
    parameters: &[(usize, f64)],
) -> Option<(usize, String, &'static str)> {
    if let Some(k) = values.iter().position(|x| !x.is_finite()) {
        let finding = format!("the value is {}", values[k]);
        return Some((k, finding, Recording::REPAIR));
    }
    if values[0] <= before {
        let finding = Recording::not_increasing(before, values[0]);
        return Some((0, finding, Recording::SORT));
    }
    let moved = |(i, first): &&(usize, f64)| values[1 + i].total_cmp(first).is_ne();
    let &(i, first) = parameters.iter().find(moved)?;
    let finding = format!("a parameter changes from {first} to {}", values[1 + i]);
    Some((1 + i, finding, Recording::CONSTANT))
}

impl Rows {
    pub(super) fn new(resolved: Resolved, file: &str) -> Self {
        Self {
            resolved,
            file: file.into(),
            logs: Logs {
                times: Times::default(),
                name: file.into(),
                waiting: None,
                begins: Vec::new(),
            },
            repeated: 0,
            partial: Vec::new(),
            by_name: HashMap::new(),
            current: 0,
            rows: 0,
            held: 0,
            least: u64::MAX,
        }
    }

    /// Adds one row: the numbers t and those of the signals (which it may change) of `trajectory`, if there are several.
    pub(super) fn push(&mut self, trajectory: Option<&str>, values: &mut [f64]) -> Result<()> {
        if let Some(name) = trajectory {
            return self.put(Some(name), values);
        }
        if self.resolved.interval.is_some() {
            return self.put(None, values);
        }
        if let Some(mut first) = self.logs.waiting.take() {
            if is_same(&first, values) {
                self.repeated += 1;
                self.logs.waiting = Some(first);
                return Ok(());
            }
            if self.logs.times.go_on(first[0], values[0]) {
                self.logs.begins.push(self.rows + 1);
                self.logs.name = format!("{}#{}", self.file, self.logs.begins.len() + 1);
                self.logs.times = Times::default();
            }
            self.logs.times.add(first[0]);
            self.put(None, &mut first)?;
        }
        if self.logs.times.may_end_before(values[0]) {
            self.logs.waiting = Some(values.to_vec());
            return Ok(());
        }
        self.logs.times.add(values[0]);
        self.put(None, values)
    }

    /// Counts a row without a value.
    pub(super) fn skip(&mut self) {
        if let Some(current) = self.partial.get_mut(self.current) {
            current.rows += 1;
        }
    }

    /// Adds a row to a trajectory, or to the current log.
    fn put(&mut self, trajectory: Option<&str>, values: &mut [f64]) -> Result<()> {
        let name = trajectory.unwrap_or(&self.logs.name);
        self.rows += 1;
        let current = self.partial.get(self.current);
        if current.is_none_or(|p| p.recording.name != name) {
            self.current = match self.by_name.get(name) {
                Some(&at) => at,
                None => {
                    let new = Partial::new(name.to_owned(), &self.resolved);
                    self.by_name.insert(name.to_owned(), self.partial.len());
                    self.partial.push(new);
                    self.partial.len() - 1
                }
            };
            self.refuse_a_name_per_row()?;
        }
        let current = &mut self.partial[self.current];
        if self.resolved.interval.is_none() && current.repeats(values) {
            self.repeated += 1;
            return Ok(());
        }
        let kept = current.push(values, &self.resolved, self.least);
        self.held += usize::from(kept);
        if self.resolved.sample.is_some_and(|s| self.held > s.held()) {
            self.thin();
        }
        Ok(())
    }

    /// Drops stretches until the number of rows is within the limit.
    fn thin(&mut self) {
        let Some(sampling) = self.resolved.sample else {
            return;
        };
        let all = self.partial.iter_mut().map(|p| &mut p.recording);
        let mut all: Vec<&mut Recording> = all.collect();
        if let Some(least) = drop_stretches(&mut all, sampling.rows) {
            self.least = least;
        }
        self.held = all.iter().map(|r| r.len()).sum();
    }

    fn refuse_a_name_per_row(&self) -> Result<()> {
        if self.partial.len() > MOST_TRAJECTORIES {
            return Err(Error::Columns {
                finding: format!("the file holds more than {MOST_TRAJECTORIES} trajectories, the most"),
                found: self.resolved.columns.trajectory.clone().unwrap_or_default(),
                remedy: "divide the file, or name the column that tells trajectories apart with `trajectory`".into(),
            });
        }
        if self.partial.len() <= MANY_TRAJECTORIES || self.partial.len() * 3 < self.rows * 2 {
            return Ok(());
        }
        let column = self.resolved.columns.trajectory.clone().unwrap_or_default();
        let names: Vec<&str> = self.resolved.names().map(String::as_str).collect();
        Err(Error::Columns {
            finding: format!("column '{column}' names a new trajectory at nearly every row"),
            found: names.join(", "),
            remedy: "name the column that tells trajectories apart with `trajectory`".into(),
        })
    }

    pub(super) fn finish(mut self) -> Result<Readings> {
        if let Some(mut last) = self.logs.waiting.take() {
            self.put(None, &mut last)?;
        }
        if self.partial.is_empty() {
            return Err(Error::too_short(format!("file '{}'", self.file), 0, 2));
        }
        self.thin();
        let sampled = self.resolved.sample.is_some();
        let all = self.partial.into_iter();
        let mut recordings: Vec<Recording> = all.map(|partial| partial.finish(sampled)).collect();
        let mut notes = self.resolved.notes;
        if !sampled {
            let rounded = recordings.iter_mut().filter_map(Recording::take_even_steps);
            let coarsest = rounded.max_by(|a, b| a.1.total_cmp(&b.1));
            notes.extend(coarsest.map(|(step, place)| {
                format!(
                    "stamps of time are rounded to {place} s: even steps of {step:.7} s are taken"
                )
            }));
        }
        if let Some(first) = self.logs.begins.first() {
            let motions = self.logs.begins.len() + 1;
            notes.push(format!(
                "time starts again, first in row {first}, as in logs one after the other or with a counter that wraps: motions: {motions}"
            ));
        }
        if self.repeated > 0 {
            let rows = self.repeated;
            notes.push(format!(
                "rows written twice, time and values alike, are read once: {rows}"
            ));
        }
        Ok(Readings {
            recordings,
            columns: self.resolved.columns,
            notes,
        })
    }
}
