//! Functions of one variable that are linear in their coefficients: the derivatives of potentials.

use std::f64::consts::TAU;

use serde::{Deserialize, Serialize};

use lagrangian_motion::{Error, Result};

/// The functions whose sum a curve is.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase", deny_unknown_fields)]
pub enum Basis {
    /// 1, x, x², … up to this degree.
    Powers {
        /// The highest power.
        degree: usize,
    },
    /// sin x, cos x, sin 2x, … up to this multiple.
    Harmonics {
        /// The highest multiple.
        count: usize,
    },
    /// Cubic B-splines on equal intervals; beyond them the curve goes on along its slope.
    Spline {
        /// Where the first interval begins.
        low: f64,
        /// The length of an interval.
        step: f64,
        /// The number of intervals.
        intervals: usize,
        /// Whether the last interval is followed by the first.
        turns: bool,
    },
}

/// The largest number of functions.
const MOST: usize = 1000;

impl Basis {
    /// Splines on this number of intervals between two values.
    #[must_use]
    pub fn spline([low, high]: [f64; 2], intervals: usize) -> Self {
        let step = ((high - low) / intervals as f64).max(f64::MIN_POSITIVE);
        Self::Spline {
            low,
            step,
            intervals,
            turns: false,
        }
    }

    /// Splines on this number of intervals of a turn.
    #[must_use]
    pub fn turning_spline(intervals: usize) -> Self {
        Self::Spline {
            low: -0.5 * TAU,
            step: TAU / intervals as f64,
            intervals,
            turns: true,
        }
    }

    /// The number of functions.
    #[must_use]
    pub fn count(&self) -> usize {
        match *self {
            Self::Powers { degree } => degree.saturating_add(1),
            Self::Harmonics { count } => count.saturating_mul(2),
            Self::Spline {
                intervals, turns, ..
            } => intervals.saturating_add(if turns { 0 } else { 3 }),
        }
    }

    /// Refuses a basis without functions, or of too many.
    ///
    /// # Errors
    /// [`Error::Argument`] for the number of functions, or the intervals of splines.
    pub fn check(&self) -> Result<()> {
        if !(1..=MOST).contains(&self.count()) {
            return Err(Error::argument(
                "basis",
                self.count(),
                "of 1 to 1000 functions",
            ));
        }
        if let Self::Spline {
            low,
            step,
            intervals,
            turns,
        } = *self
        {
            let least = if turns { 4 } else { 1 };
            if !(low.is_finite() && step.is_finite() && step > 0.0 && intervals >= least) {
                let must = "finite, with a positive step and at least one interval, four in a turn";
                return Err(Error::argument("spline", format!("{self:?}"), must));
            }
        }
        Ok(())
    }

    /// The sum of the functions times these coefficients at x.
    #[must_use]
    pub fn value(&self, coefficients: &[f64], x: f64) -> f64 {
        let mut sum = 0.0;
        self.values(x, |k, value| sum += coefficients[k] * value);
        sum
    }

    /// Its slope.
    #[must_use]
    pub fn slope(&self, coefficients: &[f64], x: f64) -> f64 {
        let mut sum = 0.0;
        self.rates(x, |k, rate| sum += coefficients[k] * rate);
        sum
    }

    /// Its integral, as of [`Self::integrals`].
    #[must_use]
    pub fn integral(&self, coefficients: &[f64], x: f64) -> f64 {
        let mut sum = 0.0;
        self.integrals(x, |k, value| sum += coefficients[k] * value);
        sum
    }

    /// Passes the index and the value at x of each function that is not 0 there to `add`.
    pub fn values(&self, x: f64, mut add: impl FnMut(usize, f64)) {
        match *self {
            Self::Powers { degree } => {
                let mut power = 1.0;
                for k in 0..=degree {
                    add(k, power);
                    power *= x;
                }
            }
            Self::Harmonics { count } => {
                for k in 0..count {
                    let (sin, cos) = ((k + 1) as f64 * x).sin_cos();
                    add(2 * k, sin);
                    add(2 * k + 1, cos);
                }
            }
            Self::Spline { step, .. } => {
                let (index, u, beyond) = self.place(x);
                let v = 1.0 - u;
                let values = [
                    v * v * v / 6.0,
                    (3.0 * u * u * u - 6.0 * u * u + 4.0) / 6.0,
                    (3.0 * v * v * v - 6.0 * v * v + 4.0) / 6.0,
                    u * u * u / 6.0,
                ];
                let slopes = slopes(u);
                for (k, (value, slope)) in values.into_iter().zip(slopes).enumerate() {
                    add(self.index(index + k), value + slope * beyond / step);
                }
            }
        }
    }

    /// The same of the slope of each function.
    pub fn rates(&self, x: f64, mut add: impl FnMut(usize, f64)) {
        match *self {
            Self::Powers { degree } => {
                let mut power = 1.0;
                for k in 1..=degree {
                    add(k, k as f64 * power);
                    power *= x;
                }
            }
            Self::Harmonics { count } => {
                for k in 0..count {
                    let multiple = (k + 1) as f64;
                    let (sin, cos) = (multiple * x).sin_cos();
                    add(2 * k, multiple * cos);
                    add(2 * k + 1, -multiple * sin);
                }
            }
            Self::Spline { step, .. } => {
                let (index, u, _) = self.place(x);
                for (k, slope) in slopes(u).into_iter().enumerate() {
                    add(self.index(index + k), slope / step);
                }
            }
        }
    }

    /// The same of the integral of each function from 0, for splines from their first interval on.
    pub fn integrals(&self, x: f64, mut add: impl FnMut(usize, f64)) {
        match *self {
            Self::Powers { degree } => {
                let mut power = x;
                for k in 0..=degree {
                    add(k, power / (k + 1) as f64);
                    power *= x;
                }
            }
            Self::Harmonics { count } => {
                for k in 0..count {
                    let multiple = (k + 1) as f64;
                    let (sin, cos) = (multiple * x).sin_cos();
                    add(2 * k, (1.0 - cos) / multiple);
                    add(2 * k + 1, sin / multiple);
                }
            }
            Self::Spline { step, .. } => {
                let (index, u, beyond) = self.place(x);
                let whole = areas(1.0);
                for interval in 0..index {
                    for (k, area) in whole.into_iter().enumerate() {
                        add(self.index(interval + k), step * area);
                    }
                }
                let slope = slopes(u).map(|own| 0.5 * own * beyond * beyond / step);
                for (k, (area, slope)) in areas(u).into_iter().zip(slope).enumerate() {
                    add(self.index(index + k), step * area + slope);
                }
                if beyond != 0.0 {
                    let end = Self::values;
                    end(self, x - beyond, |k, value| add(k, beyond * value));
                }
            }
        }
    }

    /// The interval of x, the part of it that is passed, and how far x is beyond the last or before the first.
    fn place(&self, x: f64) -> (usize, f64, f64) {
        let Self::Spline {
            low,
            step,
            intervals,
            turns,
        } = *self
        else {
            return (0, 0.0, 0.0);
        };
        let mut at = (x - low) / step;
        if turns {
            at = at.rem_euclid(intervals as f64);
        }
        let inside = at.clamp(0.0, intervals as f64);
        let index = (inside as usize).min(intervals - 1);
        (index, inside - index as f64, (at - inside) * step)
    }

    fn index(&self, k: usize) -> usize {
        match *self {
            Self::Spline {
                intervals,
                turns: true,
                ..
            } => k % intervals,
            _ => k,
        }
    }
}

/// The slopes of the four splines of an interval, times its length.
fn slopes(u: f64) -> [f64; 4] {
    let v = 1.0 - u;
    [
        -0.5 * v * v,
        1.5 * u * u - 2.0 * u,
        2.0 * v - 1.5 * v * v,
        0.5 * u * u,
    ]
}

/// Their integrals over the part u of the interval, over its length.
fn areas(u: f64) -> [f64; 4] {
    let v = 1.0 - u;
    let middle = |x: f64| (0.75 * x.powi(4) - 2.0 * x.powi(3) + 4.0 * x) / 6.0;
    [
        (1.0 - v.powi(4)) / 24.0,
        middle(u),
        middle(1.0) - middle(v),
        u.powi(4) / 24.0,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    const SPLINE: Basis = Basis::Spline {
        low: -1.0,
        step: 0.25,
        intervals: 9,
        turns: false,
    };

    fn sum(coefficients: &[f64], visit: impl FnOnce(&mut dyn FnMut(usize, f64))) -> f64 {
        let mut sum = 0.0;
        visit(&mut |k, value| sum += coefficients[k] * value);
        sum
    }

    #[test]
    fn a_curve_is_the_slope_of_its_integral_and_has_the_slope_that_it_says() {
        let all = [
            Basis::Powers { degree: 4 },
            Basis::Harmonics { count: 2 },
            SPLINE,
            Basis::turning_spline(7),
        ];
        for basis in all {
            let coefficients: Vec<f64> = (0..basis.count())
                .map(|k| (1.3 * k as f64).sin() + 0.2)
                .collect();
            for x in [-2.7, -1.0, -0.31, 0.0, 0.4, 1.2, 1.9, 3.0] {
                let area = |x: f64| sum(&coefficients, |add| basis.integrals(x, add));
                let slope = (area(x + 1e-5) - area(x - 1e-5)) / 2e-5;
                let value = sum(&coefficients, |add| basis.values(x, add));
                assert!(
                    (slope - value).abs() < 1e-8,
                    "{basis:?} at {x}: {slope} {value}"
                );
                let curve = |x: f64| sum(&coefficients, |add| basis.values(x, add));
                let slope = (curve(x + 1e-6) - curve(x - 1e-6)) / 2e-6;
                let rate = sum(&coefficients, |add| basis.rates(x, add));
                assert!(
                    (slope - rate).abs() < 1e-5 * (1.0 + rate.abs()),
                    "{basis:?} at {x}: {slope} {rate}"
                );
            }
        }
    }

    #[test]
    fn splines_are_smooth_add_up_to_one_and_go_on_straight() {
        let ones = vec![1.0; SPLINE.count()];
        let line: Vec<f64> = (0..SPLINE.count()).map(|k| k as f64).collect();
        for x in [-3.0, -1.0, 0.1, 1.25, 4.0] {
            assert!((sum(&ones, |add| SPLINE.values(x, add)) - 1.0).abs() < 1e-14);
            let expected = (x + 1.0) / 0.25 + 1.0;
            assert!((sum(&line, |add| SPLINE.values(x, add)) - expected).abs() < 1e-12);
        }
        let turning = Basis::turning_spline(5);
        let own = [0.3, -1.0, 2.0, 0.4, 0.1];
        let at = |x: f64| sum(&own, |add| turning.values(x, add));
        assert!((at(3.0) - at(3.0 - TAU)).abs() < 1e-12);
        assert!((at(0.5 * TAU - 1e-9) - at(-0.5 * TAU + 1e-9)).abs() < 1e-7);
    }

    #[test]
    fn a_basis_without_functions_or_intervals_is_refused() {
        let without = Basis::Spline {
            low: 0.0,
            step: 0.0,
            intervals: 3,
            turns: false,
        };
        for wrong in [
            without,
            Basis::Harmonics { count: 0 },
            Basis::Powers { degree: usize::MAX },
            Basis::turning_spline(3),
        ] {
            assert!(wrong.check().is_err(), "{wrong:?}");
        }
    }
}
