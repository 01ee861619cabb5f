//! Durations of the ticks of a control loop.

use std::time::Duration;

use serde::{Deserialize, Serialize};

/// Number of bins for each doubling of the time: quantiles are exact to about 4 %.
const BINS_PER_OCTAVE: usize = 16;
/// Number of doublings, beginning at one nanosecond: the last bin holds some minutes.
const OCTAVES: usize = 38;

/// A histogram of times in logarithmic bins. It has a fixed size, so that recording allocates nothing and never waits.
#[derive(Debug, Clone, PartialEq)]
pub struct Latency {
    counts: Vec<u64>,
    total: u64,
    longest: u64,
}

/// Quantiles of a [`Latency`], s.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Quantiles {
    /// Median time.
    pub p50: f64,
    /// 99th percentile.
    pub p99: f64,
    /// Longest time.
    pub max: f64,
    /// Number of ticks.
    pub ticks: u64,
}

/// One bin of a [`Latency`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LatencyBin {
    /// Middle of the bin, s.
    pub seconds: f64,
    /// Number of ticks in the bin.
    pub ticks: u64,
}

impl Default for Latency {
    fn default() -> Self {
        Self {
            counts: vec![0; OCTAVES * BINS_PER_OCTAVE],
            total: 0,
            longest: 0,
        }
    }
}

impl Latency {
    /// Adds one time.
    pub fn record(&mut self, time: Duration) {
        let nanoseconds = u64::try_from(time.as_nanos()).unwrap_or(u64::MAX);
        let bin = bin(nanoseconds).min(self.counts.len() - 1);
        self.counts[bin] += 1;
        self.total += 1;
        self.longest = self.longest.max(nanoseconds);
    }

    /// Median, 99th percentile and longest time.
    #[must_use]
    pub fn quantiles(&self) -> Quantiles {
        Quantiles {
            p50: self.quantile(0.5),
            p99: self.quantile(0.99),
            max: self.longest as f64 * 1e-9,
            ticks: self.total,
        }
    }

    /// Bins that are not empty, shortest times first.
    #[must_use]
    pub fn bins(&self) -> Vec<LatencyBin> {
        let filled = self.counts.iter().enumerate().filter(|(_, c)| **c > 0);
        filled
            .map(|(k, &ticks)| LatencyBin {
                seconds: middle(k),
                ticks,
            })
            .collect()
    }

    fn quantile(&self, part: f64) -> f64 {
        let wanted = (part * self.total as f64).ceil() as u64;
        let mut seen = 0;
        for (k, count) in self.counts.iter().enumerate() {
            seen += count;
            if seen >= wanted && seen > 0 {
                return middle(k).min(self.longest as f64 * 1e-9);
            }
        }
        0.0
    }
}

fn bin(nanoseconds: u64) -> usize {
    let octaves = (nanoseconds.max(1) as f64).log2();
    (octaves * BINS_PER_OCTAVE as f64) as usize
}

fn middle(bin: usize) -> f64 {
    ((bin as f64 + 0.5) / BINS_PER_OCTAVE as f64).exp2() * 1e-9
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_within_a_bin_of_the_truth() {
        let mut latency = Latency::default();
        (1..=1000).for_each(|k| latency.record(Duration::from_micros(k)));
        let found = latency.quantiles();
        assert!((found.p50 / 500e-6 - 1.0).abs() < 0.05, "{found:?}");
        assert!((found.p99 / 990e-6 - 1.0).abs() < 0.05, "{found:?}");
        assert!((found.max - 1e-3).abs() < 1e-12 && found.ticks == 1000);
        latency.record(Duration::MAX);
        assert!(latency.quantiles().max > 1e9);
        assert!(Latency::default().quantiles().p99 <= 0.0);
    }
}
