//! An axis laid out: its ends, its ticks and their labels.

use crate::{Axis, Scale};

/// A laid-out axis, which maps values to the unit interval.
pub(super) struct Laid {
    log: bool,
    low: f64,
    high: f64,
    names: Vec<String>,
}

/// A tick: its position in the unit interval and its label.
pub(super) struct Tick {
    pub(super) at: f64,
    pub(super) label: String,
}

/// Larger values cannot be placed on a plot: the arithmetic of its axes would overflow.
const LARGEST: f64 = 1e300;

/// Leading digits of the ticks of a logarithmic axis of less than two decades.
const DIGITS: [i32; 3] = [1, 2, 5];

impl Laid {
    /// The axis that holds all finite values with a margin (a fraction of its length), or `None` without any.
    pub(super) fn new(axis: &Axis, values: impl Iterator<Item = f64>, margin: f64) -> Option<Self> {
        let log = axis.scale == Scale::Log;
        let inner = |value: f64| if log { positive_log(value) } else { value };
        let data = values.map(inner).filter(|value| value.abs() < LARGEST);
        let ends = data.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| {
            (low.min(v), high.max(v))
        });
        if ends.0 > ends.1 {
            return None;
        }
        let fixed = axis.range.map(|(low, high)| (inner(low), inner(high)));
        let fixed =
            fixed.filter(|(low, high)| low.abs() < LARGEST && high.abs() < LARGEST && low < high);
        let (low, high) = fixed.unwrap_or_else(|| padded(ends, margin, log));
        Some(Self {
            log,
            low,
            high,
            names: axis.names.clone(),
        })
    }

    /// The axis with its ends moved outwards to about `count` ticks; an axis of categories is unchanged.
    pub(super) fn ended_at_ticks(mut self, count: usize) -> Self {
        let span = self.high - self.low;
        if self.has_names() {
            return self.widened(0.06 * span);
        }
        if self.log && span < 2.0 {
            return self.ended_between_decades(count);
        }
        let step = if self.log {
            (span / count as f64).floor() + 1.0
        } else {
            nice_step(span / count as f64)
        };
        self.low = (self.low / step + 1e-9).floor() * step;
        self.high = (self.high / step - 1e-9).ceil() * step;
        self
    }

    /// A logarithmic axis of less than two decades with its ends at 1, 2 or 5 times powers of ten. The ends are at whole powers if it
    /// becomes too long for [`Self::between_decades`], and at linear ticks if it spans too little for two such values.
    fn ended_between_decades(self, count: usize) -> Self {
        let with = |low, high| Self {
            low,
            high,
            names: Vec::new(),
            ..self
        };
        if self.digits().len() < 2 {
            let linear = Self {
                log: false,
                ..with(10f64.powf(self.low), 10f64.powf(self.high))
            };
            let linear = linear.ended_at_ticks(count);
            let low = positive_log(linear.low);
            return with(
                if low.is_finite() { low } else { self.low },
                linear.high.log10(),
            );
        }
        let places = (self.low.floor() as i32..=self.high.ceil() as i32)
            .flat_map(|k| DIGITS.map(|digit| f64::from(k) + f64::from(digit).log10()));
        let low = places.clone().filter(|place| *place <= self.low + 1e-9);
        let high = places.filter(|place| *place >= self.high - 1e-9);
        let (low, high) = (
            low.fold(self.low.floor(), f64::max),
            high.fold(self.high.ceil(), f64::min),
        );
        match with(low, high).whole_decades() {
            (first, last) if last - first < 2 => with(low, high),
            _ => with(low.floor(), high.ceil()),
        }
    }

    fn widened(self, margin: f64) -> Self {
        Self {
            low: self.low - margin,
            high: self.high + margin,
            ..self
        }
    }

    /// Its ends; logarithms on a logarithmic axis.
    pub(super) fn ends(&self) -> [f64; 2] {
        [self.low, self.high]
    }

    /// Position of a value; NaN for a value that cannot be placed on the axis.
    pub(super) fn at(&self, value: f64) -> f64 {
        let inner = if self.log { positive_log(value) } else { value };
        (inner - self.low) / (self.high - self.low)
    }

    /// Whether it is an axis of categories, each with a tick.
    pub(super) fn has_names(&self) -> bool {
        !self.names.is_empty()
    }

    /// About `count` ticks, but not closer than that; for categories, all.
    pub(super) fn ticks(&self, count: usize) -> Vec<Tick> {
        let values = if self.has_names() {
            let named = self.names.iter().cloned().enumerate();
            named.map(|(k, name)| (k as f64, name)).collect()
        } else if self.log {
            self.decades(count)
        } else {
            self.steps(count)
        };
        values
            .into_iter()
            .map(|(inner, label)| Tick {
                at: (inner - self.low) / (self.high - self.low),
                label,
            })
            .collect()
    }

    fn steps(&self, count: usize) -> Vec<(f64, String)> {
        let step = nice_step((self.high - self.low) / count.max(1) as f64);
        let first = (self.low / step - 1e-9).ceil();
        let last = (self.high / step + 1e-9).floor();
        let largest = self.low.abs().max(self.high.abs());
        let indices = (0..=(last - first).clamp(0.0, 50.0) as i32).map(|k| first + f64::from(k));
        indices
            .map(|k| (k * step, decimal(k * step, step, largest)))
            .collect()
    }

    fn decades(&self, count: usize) -> Vec<(f64, String)> {
        let (first, last) = self.whole_decades();
        if last - first < 2 {
            return self.between_decades(count);
        }
        let every = ((last - first) as usize / count.max(1) + 1) as i32;
        let plain = first >= -3 && last <= 4;
        let label = |k: i32| {
            if plain {
                decimal(10f64.powi(k), 10f64.powi(k.min(0)), 1.0)
            } else {
                power(k)
            }
        };
        (first..=last)
            .filter(|k| k.rem_euclid(every) == 0)
            .map(|k| (f64::from(k), label(k)))
            .collect()
    }

    /// The first and the last whole power of ten on a logarithmic axis.
    fn whole_decades(&self) -> (i32, i32) {
        (
            (self.low - 1e-9).ceil() as i32,
            (self.high + 1e-9).floor() as i32,
        )
    }

    /// Ticks at 1, 2 and 5 times powers of ten, for an axis of less than two decades.
    fn between_decades(&self, count: usize) -> Vec<(f64, String)> {
        let inside = self.digits();
        if inside.len() < 2 {
            return self.shrunk_linear(count);
        }
        inside
            .into_iter()
            .map(|(inner, k, digit)| (inner, times_power(digit, k)))
            .collect()
    }

    /// Positions of 1, 2 and 5 times powers of ten on a logarithmic axis.
    fn digits(&self) -> Vec<(f64, i32, i32)> {
        let (first, last) = self.whole_decades();
        let all = (first - 1..=last).flat_map(|k| DIGITS.map(|digit| (k, digit)));
        let all = all.map(|(k, digit)| (f64::from(k) + f64::from(digit).log10(), k, digit));
        all.filter(|(inner, ..)| *inner >= self.low - 1e-9 && *inner <= self.high + 1e-9)
            .collect()
    }

    /// Linear ticks on a log axis with a span too small for other ticks.
    fn shrunk_linear(&self, count: usize) -> Vec<(f64, String)> {
        let linear = Self {
            log: false,
            low: 10f64.powf(self.low),
            high: 10f64.powf(self.high),
            names: Vec::new(),
        };
        linear
            .steps(count)
            .into_iter()
            .map(|(value, label)| (value.log10(), label))
            .collect()
    }
}

fn positive_log(value: f64) -> f64 {
    if value > 0.0 { value.log10() } else { f64::NAN }
}

fn padded((low, high): (f64, f64), margin: f64, log: bool) -> (f64, f64) {
    let span = high - low;
    if span > 1e-9 * low.abs().max(high.abs()).max(1e-300) {
        return (low - margin * span, high + margin * span);
    }
    let half = if log || low.abs() < 1e-300 {
        1.0
    } else {
        0.1 * low.abs()
    };
    (low - half, high + half)
}

/// The smallest of 1, 2, 5 times a power of ten that is not below `least`.
fn nice_step(least: f64) -> f64 {
    let power = 10f64.powf(least.log10().floor());
    let digit = [1.0, 2.0, 5.0]
        .into_iter()
        .find(|digit| digit * power >= least * (1.0 - 1e-9));
    digit.unwrap_or(10.0) * power
}

/// A value with the digits that its step requires; powers of ten if plain digits would be too many.
fn decimal(value: f64, step: f64, largest: f64) -> String {
    let places = (-(step * (1.0 + 1e-9)).log10().floor()).max(0.0) as usize;
    if value.abs() < 0.5 * step {
        return "0".into();
    }
    if places > 4 || largest >= 1e5 {
        let exponent = value.abs().log10().floor() as i32;
        let digits = ((f64::from(exponent) - step.log10()).round().max(0.0) as usize).min(6);
        let mantissa = format!("{:.digits$}", value / 10f64.powi(exponent));
        return minus(&format!("{mantissa}×{}", power(exponent)));
    }
    minus(&format!("{value:.places$}"))
}

fn times_power(digit: i32, exponent: i32) -> String {
    match exponent {
        -3..=-1 => format!(
            "{:.*}",
            -exponent as usize,
            f64::from(digit) * 10f64.powi(exponent)
        ),
        0..=3 => format!("{}", digit * 10i32.pow(exponent.unsigned_abs())),
        _ if digit == 1 => power(exponent),
        _ => format!("{digit}×{}", power(exponent)),
    }
}

fn power(exponent: i32) -> String {
    let digits = exponent.to_string();
    let raised = digits.chars().map(|letter| match letter {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        digit => char::from_u32(0x2070 + digit as u32 - '0' as u32).unwrap_or(digit),
    });
    format!("10{}", raised.collect::<String>())
}

/// A number with two or three digits, e.g. `1200`, `0.41`, `0.0021` or `3.2×10⁻⁶`.
pub fn short(value: f64) -> String {
    if !value.is_finite() {
        return "–".into();
    }
    let exponent = if value == 0.0 {
        0
    } else {
        value.abs().log10().floor() as i32
    };
    let text = if (-4..5).contains(&exponent) {
        let digits = if exponent < 0 {
            1 - exponent
        } else {
            2 - exponent
        };
        format!("{value:.*}", digits.max(0) as usize)
    } else {
        format!("{:.1}×{}", value / 10f64.powi(exponent), power(exponent))
    };
    minus(&text)
}

/// The typographic minus sign.
fn minus(text: &str) -> String {
    text.replace('-', "−")
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

    use super::*;

    fn labels(axis: &Axis, values: &[f64], count: usize) -> Vec<String> {
        let laid = Laid::new(axis, values.iter().copied(), 0.0).unwrap();
        laid.ticks(count)
            .into_iter()
            .map(|tick| tick.label)
            .collect()
    }

    #[test]
    fn linear_ticks_are_round_numbers() {
        let axis = Axis::linear("x", "");
        assert_eq!(
            labels(&axis, &[0.0, 100.0], 5),
            ["0", "20", "40", "60", "80", "100"]
        );
        assert_eq!(labels(&axis, &[-0.3, 0.3], 4), ["−0.2", "0", "0.2"]);
        assert_eq!(labels(&axis, &[0.0, 2e6], 2), ["0", "1×10⁶", "2×10⁶"]);
    }

    #[test]
    fn log_ticks_are_powers_of_ten_and_thin_out() {
        let axis = Axis::log("x", "");
        assert_eq!(labels(&axis, &[1e-6, 1e2], 3), ["10⁻⁶", "10⁻³", "10⁰"]);
        assert_eq!(labels(&axis, &[0.01, 10.0], 6), ["0.01", "0.1", "1", "10"]);
        assert_eq!(labels(&axis, &[0.9, 11.0], 6), ["1", "2", "5", "10"]);
    }

    #[test]
    fn an_axis_that_ends_at_ticks_holds_all_data_below_its_last_number() {
        let axis = |scale: &Axis, values: &[f64]| {
            let laid = Laid::new(scale, values.iter().copied(), 0.0).unwrap();
            let laid = laid.ended_at_ticks(6);
            let ends = |count| {
                laid.ticks(count)
                    .pop()
                    .is_some_and(|tick| tick.at > 1.0 - 1e-6)
            };
            assert!((2..12).any(ends), "{values:?}");
            assert!(values.iter().all(|value| laid.at(*value) < 1.0 + 1e-9));
            laid.ends()
        };
        let linear = Axis::linear("y", "");
        for top in [0.93, 1.0, 1.01, 7.0, 432.0, 1e-9] {
            let [low, high] = axis(&linear, &[0.0, top]);
            assert!(low.abs() < 1e-15 && high < 2.0 * top, "{top}: {high}");
        }
        let log = Axis::log("y", "");
        for values in [
            [0.05, 0.3],
            [0.9, 11.0],
            [1.0, 1.1],
            [0.011, 1.05],
            [2e-7, 3e-6],
            [3.0, 4.9],
        ] {
            let [low, high] = axis(&log, &values);
            assert!(
                high - low < 2.1 * (values[1] / values[0]).log10() + 0.41,
                "{values:?}: {low} {high}"
            );
        }
        assert_eq!(labels(&log, &[0.05, 0.5], 6), ["0.05", "0.1", "0.2", "0.5"]);
        let [low, high] = axis(&log, &[3e-9, 4.0]);
        assert!(low <= -9.0 && (high - 2.0).abs() < 1e-9, "{low} {high}");
    }

    #[test]
    fn small_numbers_keep_two_digits_and_absent_ones_are_a_dash() {
        let words = [0.000_91, -0.031, 2.5e-10, 6.02e23, f64::NAN].map(short);
        assert_eq!(words, ["0.00091", "−0.031", "2.5×10⁻¹⁰", "6.0×10²³", "–"]);
    }

    #[test]
    fn values_without_a_place_are_nan_and_no_value_means_no_axis() {
        let axis = Axis::log("x", "");
        assert!(Laid::new(&axis, [0.0, -1.0, f64::NAN].into_iter(), 0.1).is_none());
        let laid = Laid::new(&axis, [0.0, 1.0, 10.0].into_iter(), 0.0).unwrap();
        assert!(laid.at(0.0).is_nan());
        assert!((laid.at(10.0) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn one_value_and_enormous_values_still_have_an_axis() {
        for values in [
            vec![3.0],
            vec![0.0, 0.0],
            vec![f64::MAX, -f64::MAX],
            vec![1e-310, 2e-310],
        ] {
            for axis in [Axis::linear("x", ""), Axis::log("x", "")] {
                let Some(laid) = Laid::new(&axis, values.iter().copied(), 0.04) else {
                    continue;
                };
                let ticks = laid.ticks(5);
                assert!(ticks.iter().all(|tick| tick.at.is_finite()), "{values:?}");
                assert!(ticks.len() < 60);
            }
        }
    }
}
