//! Least-squares polynomials in a moving window of samples, on the true time stamps.
//!
//! The estimate of dᵏy/dtᵏ at a time is Σⱼ aⱼ yⱼ, with weights a that depend on the time stamps alone; at even
//! spacing it is the filter of Savitzky and Golay (Anal. Chem. 36, 1964). White noise of standard deviation σ in
//! y gives the estimate a standard deviation σ ‖a‖ (theory.md, equation 25).

use std::ops::Range;

use super::Recording;
use super::derivatives::GAP;
use lagrangian_motion::statistics::upper_median;

/// Highest degree of the polynomial.
pub(crate) const HIGHEST_DEGREE: usize = 4;
const SIZE: usize = HIGHEST_DEGREE + 1;
/// A pivot below this part of its diagonal means that the time stamps do not determine the degree.
const SMALLEST_PIVOT: f64 = 1e-9;

/// A derivative of order k from polynomials of a degree.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Filter {
    pub(crate) order: usize,
    pub(crate) degree: usize,
}

impl Filter {
    /// The degree that makes the error at the centre of a window of length h of order h⁴, for order 0, 1 or 2.
    pub(crate) fn of_order(order: usize) -> Self {
        Self {
            order,
            degree: if order == 2 { 4 } else { 3 },
        }
    }

    /// Writes the weights `a` for the derivative at time `at` from samples at times `t`.
    ///
    /// The degree is lowered where the samples are too few or too close for it.
    pub(crate) fn weights(self, t: &[f64], at: f64, a: &mut Vec<f64>) {
        a.clear();
        let (first, last) = (*t.first().unwrap_or(&at), *t.last().unwrap_or(&at));
        let (centre, scale) = (0.5 * (first + last), 0.5 * (last - first));
        if scale <= 0.0 {
            a.resize(t.len(), 0.0);
            return;
        }
        let mut moments = [0.0; 2 * SIZE - 1];
        for &t in t {
            let x = (t - centre) / scale;
            let mut power = 1.0;
            for m in &mut moments {
                *m += power;
                power *= x;
            }
        }
        let x = (at - centre) / scale;
        let mut degree = self.degree.min(t.len() - 1);
        let c = loop {
            if let Some(c) = solve(&moments, degree, derivative_of_powers(x, self.order)) {
                break c;
            }
            degree -= 1; // OK because degree 0 always has a pivot.
        };
        let unit = scale.powi(i32::try_from(self.order).unwrap_or(0)).recip();
        let weight = |t: &f64| unit * polynomial(&c, (t - centre) / scale);
        a.extend(t.iter().map(weight));
    }
}

fn polynomial(c: &[f64; SIZE], x: f64) -> f64 {
    c.iter().rev().fold(0.0, |sum, c| sum * x + c)
}

/// dᵏ/dxᵏ of 1, x, x², …
fn derivative_of_powers(x: f64, order: usize) -> [f64; SIZE] {
    let mut v = [0.0; SIZE];
    for (i, v) in v.iter_mut().enumerate().skip(order) {
        let factor: f64 = (i - order + 1..=i).map(|f| f as f64).product();
        *v = factor * x.powi(i32::try_from(i - order).unwrap_or(0));
    }
    v
}

/// Solves G c = v with Gᵢⱼ = moment i + j, up to `degree`, by the factors L D Lᵀ.
fn solve(moments: &[f64; 2 * SIZE - 1], degree: usize, mut v: [f64; SIZE]) -> Option<[f64; SIZE]> {
    let n = degree + 1;
    let mut l = [[0.0; SIZE]; SIZE];
    let mut d = [0.0; SIZE];
    for j in 0..n {
        d[j] = moments[2 * j] - (0..j).map(|k| l[j][k] * l[j][k] * d[k]).sum::<f64>();
        if d[j] <= SMALLEST_PIVOT * moments[2 * j] {
            return None;
        }
        for i in j + 1..n {
            l[i][j] =
                (moments[i + j] - (0..j).map(|k| l[i][k] * l[j][k] * d[k]).sum::<f64>()) / d[j];
        }
    }
    for i in 0..n {
        v[i] -= (0..i).map(|k| l[i][k] * v[k]).sum::<f64>();
    }
    for i in (0..n).rev() {
        v[i] = v[i] / d[i] - (i + 1..n).map(|k| l[k][i] * v[k]).sum::<f64>();
    }
    v[n..].fill(0.0);
    Some(v)
}

/// Samples of `y`, one coordinate of `n`, at times `t`.
#[derive(Clone, Copy)]
pub(crate) struct Series<'a> {
    pub(crate) t: &'a [f64],
    pub(crate) y: &'a [f64],
    pub(crate) n: usize,
    pub(crate) coordinate: usize,
}

impl<'a> Series<'a> {
    /// A coordinate of a signal `y` of a recording.
    pub(crate) fn of(recording: &'a Recording, y: &'a [f64], coordinate: usize) -> Self {
        Self {
            t: &recording.t,
            y,
            n: recording.dof(),
            coordinate,
        }
    }

    pub(crate) fn value(&self, k: usize) -> f64 {
        self.y[k * self.n + self.coordinate]
    }

    pub(crate) fn dot(&self, from: usize, a: &[f64]) -> f64 {
        let samples = a.iter().enumerate();
        samples.map(|(j, a)| a * self.value(from + j)).sum()
    }

    /// Sum of squared residuals of the polynomial through the window, and its degrees of freedom.
    pub(crate) fn residual(&self, window: Range<usize>, degree: usize) -> (f64, f64) {
        let t = &self.t[window.clone()];
        let filter = Filter { order: 0, degree };
        let mut a = Vec::with_capacity(t.len());
        let mut sum = 0.0;
        // Residuals at a few positions represent all of the window.
        let places = [t.len() / 4, t.len() / 2, (3 * t.len()) / 4];
        let mut expected = 0.0;
        for place in places {
            filter.weights(t, t[place], &mut a);
            let fitted = self.dot(window.start, &a);
            sum += (self.value(window.start + place) - fitted).powi(2);
            expected += 1.0 - a[place];
        }
        (sum, expected)
    }
}

/// The `window` samples around `k`, shifted to stay inside `segment`; fewer in a shorter segment.
pub(crate) fn around(k: usize, window: usize, segment: &Range<usize>) -> Range<usize> {
    let window = window.min(segment.len());
    let start = k
        .saturating_sub(window / 2)
        .clamp(segment.start, segment.end - window);
    start..start + window
}

/// Indices of the longest piece between gaps: steps of more than five median steps, as in [`EstimateOptions`](super::EstimateOptions).
#[must_use]
pub fn longest_piece(t: &[f64]) -> Range<usize> {
    let pieces = segments(t, GAP).into_iter();
    pieces.max_by_key(Range::len).unwrap_or_default()
}

/// Cuts time at gaps longer than `gap` median steps.
pub(crate) fn segments(t: &[f64], gap: f64) -> Vec<Range<usize>> {
    let longest = gap * median_step(t);
    let mut segments = Vec::new();
    let mut start = 0;
    for k in 1..t.len() {
        if t[k] - t[k - 1] > longest {
            segments.push(start..k);
            start = k;
        }
    }
    if start < t.len() {
        segments.push(start..t.len());
    }
    segments
}

/// Median step of the time stamps, 0 for fewer than two.
pub fn median_step(t: &[f64]) -> f64 {
    let mut steps: Vec<f64> = t.windows(2).map(|w| w[1] - w[0]).collect();
    upper_median(&mut steps)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;

    #[test]
    fn a_polynomial_of_its_degree_is_differentiated_exactly_on_uneven_times() {
        let t = [0.0, 0.1, 0.15, 0.4, 0.41, 0.7, 1.0];
        let y: Vec<f64> = t
            .iter()
            .map(|t: &f64| 1.0 + 2.0 * t - t * t + 3.0 * t.powi(3))
            .collect();
        let series = Series {
            t: &t,
            y: &y,
            n: 1,
            coordinate: 0,
        };
        let mut a = Vec::new();
        for at in [0.0_f64, 0.33, 1.0] {
            let truth = [
                1.0 + 2.0 * at - at * at + 3.0 * at.powi(3),
                2.0 - 2.0 * at + 9.0 * at * at,
                -2.0 + 18.0 * at,
            ];
            for (order, truth) in truth.into_iter().enumerate() {
                Filter::of_order(order).weights(&t, at, &mut a);
                approx::assert_abs_diff_eq!(series.dot(0, &a), truth, epsilon = 1e-9);
            }
        }
    }

    #[test]
    fn even_spacing_gives_the_weights_of_savitzky_and_golay() {
        let t: Vec<f64> = (0..5).map(f64::from).collect();
        let mut a = Vec::new();
        Filter {
            order: 1,
            degree: 2,
        }
        .weights(&t, 2.0, &mut a);
        for (a, published) in a.iter().zip([-0.2, -0.1, 0.0, 0.1, 0.2]) {
            approx::assert_abs_diff_eq!(*a, published, epsilon = 1e-12);
        }
        Filter {
            order: 0,
            degree: 2,
        }
        .weights(&t, 2.0, &mut a);
        for (a, published) in a.iter().zip([-3.0, 12.0, 17.0, 12.0, -3.0]) {
            approx::assert_abs_diff_eq!(*a, published / 35.0, epsilon = 1e-12);
        }
    }

    #[test]
    fn nearly_coincident_times_lower_the_degree_instead_of_exploding() {
        let t = [0.0, 1e-13, 2e-13, 1.0, 1.0 + 1e-13];
        let mut a = Vec::new();
        Filter::of_order(2).weights(&t, 0.5, &mut a);
        assert!(a.iter().all(|a| a.is_finite() && a.abs() < 1e6));
    }

    #[test]
    fn a_window_stays_inside_its_segment() {
        assert_eq!(around(0, 5, &(0..10)), 0..5);
        assert_eq!(around(9, 5, &(0..10)), 5..10);
        assert_eq!(around(4, 50, &(3..7)), 3..7);
        assert_eq!(
            segments(&[0.0, 1.0, 2.0, 3.0, 9.0, 10.0], 3.0),
            [0..4, 4..6]
        );
    }
}
