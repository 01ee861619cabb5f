//! One row: its duration, and the ratio to the limits of the machine.

use serde_json::{Value, json};

use super::Case;
use super::limits::Limit;

/// The head of the table: [`Row::cells`] after the name.
pub(super) fn head() -> String {
    let [time, spread, speed, peak, flow, memory, limit, rate] = COLUMNS;
    format!(
        "{:48} {time:>9} {spread:>9} {speed:>9} {peak:>8} {flow:>9} {memory:>18} {limit:>9}   {rate}",
        ""
    )
}

/// The names of the columns.
pub(super) const COLUMNS: [&str; 8] = [
    "time",
    "±",
    "GFLOP/s",
    "of peak",
    "GB/s",
    "of memory",
    "× limit",
    "a second",
];

/// A row of the table.
pub(super) struct Row<'a> {
    case: &'a Case,
    limit: Limit,
    /// Median, s.
    pub(super) seconds: f64,
    /// Half the distance of the quartiles, s.
    spread: f64,
    laps: usize,
}

impl<'a> Row<'a> {
    pub(super) fn new(case: &'a Case, mut laps: Vec<f64>, limit: Limit) -> Self {
        laps.sort_by(f64::total_cmp);
        let at = |share: usize| laps.get(laps.len() * share / 4).copied();
        let quartile = |share| at(share).unwrap_or(f64::NAN);
        Self {
            case,
            limit,
            seconds: quartile(2),
            spread: 0.5 * (quartile(3) - quartile(1)),
            laps: laps.len(),
        }
    }

    /// Operations a second.
    fn speed(&self) -> f64 {
        self.case.operations / self.seconds
    }

    /// Bytes a second.
    fn flow(&self) -> f64 {
        self.case.bytes / self.seconds
    }

    /// The time over that of its operations at the peak or of its bytes at the bandwidth, whichever is longer.
    fn times_limit(&self) -> f64 {
        let share = (self.speed() / self.limit.peak).max(self.flow() / self.limit.bandwidth);
        1.0 / share
    }

    /// The columns after the name.
    fn cells(&self) -> [String; 8] {
        let Limit {
            peak,
            bandwidth,
            memory,
        } = self.limit;
        let (count, name) = self.case.things;
        let (operations, bytes) = (self.case.operations > 0.0, self.case.bytes > 0.0);
        [
            time(self.seconds),
            counted(self.laps > 3, || time(self.spread)),
            counted(operations, || digits(1e-9 * self.speed())),
            counted(operations, || percent(self.speed() / peak)),
            counted(bytes, || digits(1e-9 * self.flow())),
            counted(bytes, || of_memory(self.flow() / bandwidth, memory)),
            counted(operations || bytes, || digits(self.times_limit())),
            format!("{} {name}", thousands(count / self.seconds)),
        ]
    }

    pub(super) fn text(&self) -> String {
        let [time, spread, speed, peak, flow, memory, limit, rate] = self.cells();
        let name = &self.case.name;
        format!(
            "{name:48} {time:>9} {spread:>9} {speed:>9} {peak:>8} {flow:>9} {memory:>18} {limit:>9}   {rate}"
        )
    }

    pub(super) fn to_json(&self, bench: &str) -> Value {
        let (operations, bytes) = (self.case.operations > 0.0, self.case.bytes > 0.0);
        let some = |there: bool, x: f64| there.then_some(x);
        json!({
            "bench": bench, "row": self.case.name, "threads": self.case.threads,
            "seconds": self.seconds, "spread_seconds": self.spread, "laps": self.laps,
            "gflops": some(operations, 1e-9 * self.speed()),
            "peak_gflops": some(operations, 1e-9 * self.limit.peak),
            "share_of_peak": some(operations, self.speed() / self.limit.peak),
            "gb_per_second": some(bytes, 1e-9 * self.flow()),
            "memory": bytes.then_some(self.limit.memory),
            "memory_gb_per_second": some(bytes, 1e-9 * self.limit.bandwidth),
            "share_of_memory": some(bytes, self.flow() / self.limit.bandwidth),
            "times_limit": some(operations || bytes, self.times_limit()),
            "per_second": self.case.things.0 / self.seconds, "things": self.case.things.1,
            "cells": self.cells(),
        })
    }
}

fn counted(there: bool, text: impl FnOnce() -> String) -> String {
    if there { text() } else { "–".into() }
}

/// Three digits.
fn digits(x: f64) -> String {
    match x.abs() {
        x if x >= 100.0 => format!("{x:.0}"),
        x if x >= 10.0 => format!("{x:.1}"),
        x if x >= 0.01 => format!("{x:.2}"),
        x => format!("{x:.4}"),
    }
}

fn percent(share: f64) -> String {
    format!("{} %", digits(100.0 * share))
}

/// The part of the bandwidth, and the time over that of reading and writing alone.
fn of_memory(share: f64, memory: &str) -> String {
    format!("{} {memory}, {} ×", percent(share), digits(1.0 / share))
}

fn time(seconds: f64) -> String {
    let (scale, unit) = match seconds {
        s if s >= 1.0 => (1.0, "s"),
        s if s >= 1e-3 => (1e3, "ms"),
        s if s >= 1e-6 => (1e6, "µs"),
        _ => (1e9, "ns"),
    };
    format!("{} {unit}", digits(scale * seconds))
}

fn thousands(x: f64) -> String {
    match x {
        x if x >= 1e6 => format!("{} M", digits(1e-6 * x)),
        x if x >= 1e3 => format!("{} k", digits(1e-3 * x)),
        x => digits(x),
    }
}
