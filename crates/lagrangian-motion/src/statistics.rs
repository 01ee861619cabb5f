//! Statistics of columns of arrays `[m, n]`.

/// The results of `f` for each column of `x`, `[m, n]`.
pub fn column(x: &[f64], n: usize, f: impl Fn(&mut dyn Iterator<Item = f64>) -> f64) -> Vec<f64> {
    let own = |i| f(&mut x.iter().skip(i).step_by(n).copied());
    (0..n).map(own).collect()
}

/// Root mean square of each column, `[n]`; 1 in place of 0.
pub fn size(x: &[f64], n: usize) -> Vec<f64> {
    column(x, n, |x| positive(root_mean_square(x)))
}

/// The variance of each column of `x`, `[m, n]`.
pub fn variances(x: &[f64], n: usize) -> Vec<f64> {
    column(x, n, |x| deviation(x).powi(2))
}

/// Mean; 0 of no values.
pub fn mean(x: &mut dyn Iterator<Item = f64>) -> f64 {
    let (count, sum) = x.fold((0.0, 0.0), |(c, s), x| (c + 1.0, s + x));
    if count > 0.0 { sum / count } else { 0.0 }
}

/// Root mean square; 0 of no values.
pub fn root_mean_square(x: &mut dyn Iterator<Item = f64>) -> f64 {
    mean(&mut x.map(|x| x * x)).sqrt()
}

/// Median of |x|; 0 of no values.
pub fn median_size(x: &mut dyn Iterator<Item = f64>) -> f64 {
    upper_median(&mut x.map(f64::abs).collect::<Vec<_>>())
}

/// The upper of the two medians, 0 without values; reorders them.
pub fn upper_median(values: &mut [f64]) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// The median, between the middle two of an even number; NaN without values.
#[must_use]
pub fn median(mut values: Vec<f64>) -> f64 {
    sort_numbers(&mut values);
    match values.len() {
        0 => f64::NAN,
        n if n % 2 == 1 => values[n / 2],
        n => 0.5 * (values[n / 2 - 1] + values[n / 2]),
    }
}

/// Puts numbers in order, the smallest first.
pub fn sort_numbers(values: &mut [f64]) {
    values.sort_by(f64::total_cmp);
}

/// Puts items in the order of a number of each, the smallest first; equal ones keep their order.
///
/// One sort serves items of all types: the code of each of its own is a thousandth of a page's module.
pub fn sort_by_number<T>(items: &mut Vec<T>, number: impl Fn(&T) -> f64) {
    let order = ranked(items.iter().map(number).collect());
    let mut taken: Vec<Option<T>> = items.drain(..).map(Some).collect();
    items.extend(order.into_iter().filter_map(|at| taken[at].take()));
}

fn ranked(numbers: Vec<f64>) -> Vec<usize> {
    let mut order: Vec<usize> = (0..numbers.len()).collect();
    order.sort_by(|a, b| numbers[*a].total_cmp(&numbers[*b]));
    order
}

/// Standard deviation, over the number of values (Welford 1962); 0 of no values.
pub fn deviation(x: &mut dyn Iterator<Item = f64>) -> f64 {
    let (mut count, mut centre, mut squares) = (0.0, 0.0, 0.0);
    for x in x {
        count += 1.0;
        let d = x - centre;
        centre += d / count;
        squares += d * (x - centre);
    }
    if count > 0.0 {
        (squares / count).sqrt()
    } else {
        0.0
    }
}

/// The scale, or 1 if it cannot be a divisor.
pub fn positive(x: f64) -> f64 {
    if x.is_finite() && x > 1e-150 { x } else { 1.0 }
}

/// The jackknife standard error of an estimate, from the estimates without one part of the data each (Efron 1982).
pub fn jackknife(left: impl Iterator<Item = f64> + Clone) -> f64 {
    let count = left.clone().count() as f64;
    let mean = left.clone().sum::<f64>() / count;
    ((count - 1.0) / count * left.map(|x| (x - mean).powi(2)).sum::<f64>()).sqrt()
}
