//! The limits of one core of this machine: multiply–adds, and reading from each cache.

use std::fs;

use lagrangian::train::Precision;
use nets::simd::{level, levels};
use serde_json::{Value, json};

use super::Case;
use super::bandwidth::read_rate;
use super::peak::fma_peak;
use super::row::COLUMNS;

/// A cache, or the memory behind all of them.
#[derive(Debug, Clone, Copy)]
struct Memory {
    name: &'static str,
    size: f64,
    /// Whether every core has one of its own.
    own: bool,
    /// The size of the array that is read from here, bytes.
    probe: f64,
}

/// The memories of this machine, and the duration of a measurement, s.
pub(super) struct Limits {
    memories: Vec<Memory>,
    seconds: f64,
}

/// The limits beside a row, with as many threads as it has.
#[derive(Debug, Clone, Copy)]
pub(super) struct Limit {
    /// Operations a second.
    pub(super) peak: f64,
    /// Bytes a second.
    pub(super) bandwidth: f64,
    /// The memory that is read.
    pub(super) memory: &'static str,
}

impl Limits {
    pub(super) fn new(smoke: bool) -> Self {
        let found = [1, 2, 3].map(cache);
        let l1 = found[0].unwrap_or(32e3);
        let l2 = found[1].unwrap_or(16.0 * l1);
        let l3 = found[2].unwrap_or(16.0 * l2);
        let memory = |name, size: f64, probe| Memory {
            name,
            size,
            own: size <= l2,
            probe,
        };
        Self {
            memories: vec![
                memory("L1", l1, 0.5 * l1),
                memory("L2", l2, 0.5 * l2),
                memory("L3", l3, (0.25 * l3).max(2.0 * l2)),
                memory("RAM", f64::INFINITY, (4.0 * l3).min(256e6)),
            ],
            seconds: if smoke { 1e-4 } else { 0.01 },
        }
    }

    /// The limits, measured now, because the clock of a shared machine drifts.
    pub(super) fn beside(&self, case: &Case) -> Limit {
        let fits = |memory: &&Memory| case.holds <= memory.size;
        // OK because the last of them holds everything.
        let memory = self.memories.iter().find(fits).unwrap_or(&self.memories[0]);
        let threads = case.threads as f64;
        let bandwidth = match case.bytes > 0.0 {
            true => read_rate(memory.probe as usize, self.seconds),
            false => f64::NAN,
        };
        Limit {
            peak: threads * self.peak(case.precision),
            bandwidth: bandwidth * if memory.own { threads } else { 1.0 },
            memory: memory.name,
        }
    }

    fn peak(&self, precision: Precision) -> f64 {
        match precision {
            Precision::F32 => fma_peak::<f32>(self.seconds),
            Precision::F64 => fma_peak::<f64>(self.seconds),
        }
    }

    fn rates(&self) -> Vec<(&'static str, f64)> {
        let rate = |m: &Memory| (m.name, 1e-9 * read_rate(m.probe as usize, self.seconds));
        self.memories.iter().map(rate).collect()
    }

    /// One line for people.
    pub(super) fn describe(&self) -> String {
        let [single, double] = [Precision::F32, Precision::F64].map(|p| 1e-9 * self.peak(p));
        let rates: Vec<String> = self
            .rates()
            .iter()
            .map(|(name, rate)| format!("{rate:.0} GB/s from {name}"))
            .collect();
        format!(
            "{}, {}: one core multiplies and adds at {single:.0} GFLOP/s in f32 and {double:.0} in f64, reads {}",
            processor(),
            level(),
            rates.join(", "),
        )
    }

    /// The limits for programs, with the heads of the columns.
    pub(super) fn to_json(&self, bench: &str, about: &str) -> Value {
        let rates: serde_json::Map<String, Value> = self
            .rates()
            .into_iter()
            .map(|(name, rate)| {
                (
                    format!("{}_gb_per_second", name.to_lowercase()),
                    json!(rate),
                )
            })
            .collect();
        json!({
            "bench": bench, "about": about, "machine": self.describe(), "columns": COLUMNS, "cpu": processor(), "instructions": level().name(),
            "of": levels().iter().map(|l| l.name()).collect::<Vec<_>>(),
            "fma_peak_f32_gflops": 1e-9 * self.peak(Precision::F32),
            "fma_peak_f64_gflops": 1e-9 * self.peak(Precision::F64),
            "reads": rates,
        })
    }
}

/// Bytes of the data cache of this level, where the system reports it.
fn cache(level: usize) -> Option<f64> {
    (0..8).find_map(|index| {
        let folder = format!("/sys/devices/system/cpu/cpu0/cache/index{index}");
        let read = |name: &str| fs::read_to_string(format!("{folder}/{name}")).ok();
        let holds_data = read("type")?.trim() != "Instruction";
        if read("level")?.trim().parse() != Ok(level) || !holds_data {
            return None;
        }
        let size = read("size")?;
        let size = size.trim();
        let (digits, unit) = size.split_at(size.find(|c: char| !c.is_ascii_digit())?);
        let unit = if unit == "M" { 1e6 } else { 1024.0 };
        Some(digits.parse::<f64>().ok()? * unit)
    })
}

/// The name of the CPU, where the system reports it.
fn processor() -> String {
    let info = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let name = info.lines().find_map(|l| l.strip_prefix("model name"));
    let name = name.and_then(|l| l.split_once(':'));
    name.map_or("unknown CPU", |(_, name)| name.trim()).into()
}
