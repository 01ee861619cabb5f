//! Number of swings: the information in a motion grows with its swings, not with its samples.

use super::column::{Column, columns};
use crate::Recording;
use lagrangian_motion::Signal;

/// Smallest swing that counts, as a fraction of the range, and in standard deviations of the noise.
const SMALLEST: f64 = 0.05;
const NOISES: f64 = 6.0;

/// Number of moves of one coordinate from a turning point to the next, and the total distance.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Swings {
    pub(super) count: usize,
    pub(super) travel: f64,
}

/// The swings of each coordinate of a recording.
pub(super) fn swings(recording: &Recording) -> Vec<Swings> {
    of_signal(recording, Signal::Q)
}

/// The swings of each column of a signal; empty where it was not recorded.
pub(super) fn of_signal(recording: &Recording, signal: Signal) -> Vec<Swings> {
    let columns = columns(recording);
    let own = columns.iter().filter(|c| c.signal == signal);
    own.map(of_column).collect()
}

/// Swings about the line from the first sample to the last, so that a wheel that keeps turning has swings too.
fn of_column(column: &Column<'_>) -> Swings {
    let q: Vec<f64> = column.iter().collect();
    let (Some(first), Some(last)) = (q.first(), q.last()) else {
        return Swings::default();
    };
    let slope = (last - first) / q.len().max(2) as f64;
    let about = |(k, q): (usize, &f64)| q - slope * k as f64;
    let level: Vec<f64> = q.iter().enumerate().map(about).collect();
    let (low, high) = super::range(level.iter().copied());
    let least = (SMALLEST * (high - low)).max(NOISES * column.steady_noise());
    if !(least.is_finite() && least > 0.0) {
        return Swings::default();
    }
    let mut swings = Swings {
        count: 1,
        travel: 0.0,
    };
    let (mut extreme, mut rises, mut origin) = (level[0], None, level[0]);
    for &x in &level {
        let beyond = match rises {
            Some(true) => x > extreme,
            Some(false) => x < extreme,
            None => (x - extreme).abs() > least,
        };
        if beyond {
            rises = rises.or(Some(x > extreme));
            extreme = x;
        } else if let Some(up) = rises
            && (x - extreme).abs() > least
        {
            swings.count += 1;
            swings.travel += (extreme - origin).abs();
            (origin, extreme, rises) = (extreme, x, Some(!up));
        }
    }
    swings.travel += (extreme - origin).abs();
    swings
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;
    use crate::{Format, Layout};

    fn counted(q: impl Fn(f64) -> f64) -> Swings {
        let row = |k: i32| format!("{k},{}\n", q(f64::from(k) * 0.01));
        let text = format!("t,q1\n{}", (0..1000).map(row).collect::<String>());
        let read = Format::Csv.read(std::io::Cursor::new(text), "x", &Layout::default());
        swings(&read.unwrap().recordings[0])[0]
    }

    #[test]
    fn a_sine_swings_twice_a_period_also_on_a_slope() {
        use std::f64::consts::TAU;
        for slope in [0.0, 3.0] {
            let swings = counted(|t| (TAU * t).sin() + slope * t);
            assert!((20..=22).contains(&swings.count), "{swings:?}");
            assert!((swings.travel - 40.0).abs() < 2.0, "{swings:?}");
        }
        assert_eq!(counted(|_| 1.0), Swings::default());
    }
}
