//! Rows of a file, as they stream in, sorted into recordings.

use std::collections::HashMap;
use std::f64::consts::{PI, TAU};

use super::columns::Resolved;
use super::{Readings, Recording};
use crate::{Error, Result};

/// More trajectories than this, each of hardly more than one row, are a wrong column.
const MANY_TRAJECTORIES: usize = 1000;

/// Collects rows; the memory grows with the rows that are kept, never with what a header claims.
pub(super) struct Rows {
    resolved: Resolved,
    file: String,
    partial: Vec<Partial>,
    by_name: HashMap<String, usize>,
    current: usize,
    rows: usize,
}

/// One recording while it grows.
struct Partial {
    recording: Recording,
    rows: usize,
    /// The angles of the row before, kept or not, as the file has them.
    last: Vec<f64>,
    turns: Vec<i32>,
    /// Where an angle has wrapped: (kept row, coordinate, turns from there on).
    wraps: Vec<(usize, usize, i32)>,
    low: Vec<f64>,
    high: Vec<f64>,
}

impl Partial {
    fn new(name: String, resolved: &Resolved) -> Self {
        let columns = resolved.columns.clone();
        let n = columns.q.len();
        let signal = |names: &[String]| (!names.is_empty()).then(Vec::new);
        let recording = Recording {
            name,
            coordinates: resolved.coordinates.clone(),
            t: Vec::new(),
            q: Vec::new(),
            qd: signal(&columns.qd),
            qdd: signal(&columns.qdd),
            p: signal(&columns.p),
            tau: signal(&columns.tau),
            columns,
            unwrapped: vec![0; n],
        };
        Self {
            recording,
            rows: 0,
            last: vec![f64::NAN; n],
            turns: vec![0; n],
            wraps: Vec::new(),
            low: vec![f64::INFINITY; n],
            high: vec![f64::NEG_INFINITY; n],
        }
    }

    fn push(&mut self, values: &mut [f64], resolved: &Resolved) {
        if resolved.degrees {
            to_radians(values, resolved);
        }
        let n = self.last.len();
        let keep = self.rows.is_multiple_of(resolved.every);
        self.rows += 1;
        for i in (0..n).filter(|&i| resolved.coordinates.is_circle(i)) {
            self.watch(i, values[1 + i]);
        }
        if !keep {
            return;
        }
        let r = &mut self.recording;
        r.t.push(values[0]);
        r.q.extend_from_slice(&values[1..=n]);
        let mut rest = &values[1 + n..];
        let signals = [
            (&mut r.qd, &r.columns.qd),
            (&mut r.qdd, &r.columns.qdd),
            (&mut r.p, &r.columns.p),
        ];
        for (signal, names) in signals {
            let Some(signal) = signal else { continue };
            for name in names {
                // A parameter without a column has no velocity.
                let (value, behind) = match rest.split_first() {
                    Some((value, behind)) if !name.is_empty() => (*value, behind),
                    _ => (0.0, rest),
                };
                signal.push(value);
                rest = behind;
            }
        }
        if let Some(tau) = &mut r.tau {
            let row = tau.len();
            tau.resize(row + n, 0.0);
            for (&i, force) in resolved.driven.iter().zip(rest) {
                tau[row + i] = *force;
            }
        }
    }

    /// Follows angle `i` through all rows, so that thinning cannot hide a turn.
    fn watch(&mut self, i: usize, q: f64) {
        if !q.is_finite() {
            return;
        }
        let step = q - self.last[i];
        if step.abs() > PI {
            self.turns[i] -= if step > 0.0 { 1 } else { -1 };
            self.wraps.push((self.recording.t.len(), i, self.turns[i]));
        }
        self.last[i] = q;
        self.low[i] = self.low[i].min(q);
        self.high[i] = self.high[i].max(q);
    }

    /// Unwraps the angles whose values all lie within one turn: others were unwrapped when they were recorded.
    fn finish(mut self) -> Recording {
        let n = self.last.len();
        let r = &mut self.recording;
        for i in 0..n {
            let wrapped = self.wraps.iter().any(|w| w.1 == i);
            if !wrapped || self.high[i] - self.low[i] > TAU * 1.001 {
                continue;
            }
            let mut wraps = self.wraps.iter().filter(|w| w.1 == i).peekable();
            r.unwrapped[i] = self.wraps.iter().filter(|w| w.1 == i).count();
            let mut turns = 0;
            for k in 0..r.t.len() {
                while let Some(wrap) = wraps.next_if(|w| w.0 <= k) {
                    turns = wrap.2;
                }
                r.q[k * n + i] += TAU * f64::from(turns);
            }
        }
        self.recording
    }
}

fn to_radians(values: &mut [f64], resolved: &Resolved) {
    let columns = &resolved.columns;
    let kinematic = [&columns.q, &columns.qd, &columns.qdd];
    let coordinates = kinematic
        .into_iter()
        .flat_map(|names| names.iter().enumerate());
    let given = coordinates.filter(|(_, name)| !name.is_empty());
    for ((i, _), value) in given.zip(&mut values[1..]) {
        if resolved.coordinates.is_circle(i) {
            *value = value.to_radians();
        }
    }
}

impl Rows {
    pub(super) fn new(resolved: Resolved, file: &str) -> Self {
        Self {
            resolved,
            file: file.into(),
            partial: Vec::new(),
            by_name: HashMap::new(),
            current: 0,
            rows: 0,
        }
    }

    /// Takes one row: the numbers t, q, qd, qdd, p, tau (which it may change) of `trajectory`, if there are several.
    pub(super) fn push(&mut self, trajectory: Option<&str>, values: &mut [f64]) -> Result<()> {
        let name = trajectory.unwrap_or(&self.file);
        self.rows += 1;
        let same = self
            .partial
            .get(self.current)
            .is_some_and(|p| p.recording.name == name);
        if !same {
            self.current = match self.by_name.get(name) {
                Some(&at) => at,
                None => {
                    self.by_name.insert(name.to_owned(), self.partial.len());
                    self.partial
                        .push(Partial::new(name.to_owned(), &self.resolved));
                    self.partial.len() - 1
                }
            };
            self.refuse_a_name_per_row()?;
        }
        self.partial[self.current].push(values, &self.resolved);
        Ok(())
    }

    fn refuse_a_name_per_row(&self) -> Result<()> {
        if self.partial.len() <= MANY_TRAJECTORIES || self.partial.len() * 3 < self.rows * 2 {
            return Ok(());
        }
        let column = self.resolved.columns.trajectory.clone().unwrap_or_default();
        Err(Error::Columns {
            finding: format!("column '{column}' names a new trajectory at nearly every row"),
            found: self
                .resolved
                .names()
                .cloned()
                .collect::<Vec<_>>()
                .join(", "),
            remedy: "name the column that tells trajectories apart with --trajectory".into(),
        })
    }

    pub(super) fn finish(self) -> Result<Readings> {
        if self.partial.is_empty() {
            return Err(Error::TooShort {
                what: format!("file '{}'", self.file),
                found: 0,
                needed: 2,
            });
        }
        let recordings = self.partial.into_iter().map(Partial::finish).collect();
        Ok(Readings {
            recordings,
            columns: self.resolved.columns,
        })
    }
}
