//! Long signals, thinned for drawing so that peaks survive.

/// Thins a signal to at most about four points per pixel column: the first, lowest, highest and last in each.
///
/// A picture of `columns` pixels is the same with these points as with all. Gaps (NaN) are preserved. A signal whose x does
/// not increase (a phase portrait) has no columns and is returned whole; lengths beyond the shorter of x and y are
/// dropped.
///
/// ```
/// let t: Vec<f64> = (0..100_000).map(|k| f64::from(k) * 1e-3).collect();
/// let mut y: Vec<f64> = t.iter().map(|t| t.sin()).collect();
/// y[54_321] = 7.0; // one sample, far narrower than a pixel
/// let (_, thin) = lagrangian_report::decimate(&t, &y, 500);
/// assert!(thin.len() <= 2_000);
/// assert!(thin.contains(&7.0));
/// ```
#[must_use]
pub fn decimate(x: &[f64], y: &[f64], columns: usize) -> (Vec<f64>, Vec<f64>) {
    let len = x.len().min(y.len());
    let (x, y) = (&x[..len], &y[..len]);
    let increasing = x.windows(2).all(|w| w[0] <= w[1]);
    if len <= 4 * columns || columns == 0 || !increasing || !(x[len - 1] - x[0]).is_finite() {
        return (x.to_vec(), y.to_vec());
    }
    let per_x = columns as f64 / (x[len - 1] - x[0]).max(f64::MIN_POSITIVE);
    let column = |k: usize| (((x[k] - x[0]) * per_x) as usize).min(columns - 1);
    let (mut kept_x, mut kept_y) = (Vec::new(), Vec::new());
    let mut start = 0;
    while start < len {
        let end = (start..len)
            .find(|&k| column(k) != column(start))
            .unwrap_or(len);
        for k in landmarks(y, start, end) {
            kept_x.push(x[k]);
            kept_y.push(y[k]);
        }
        start = end;
    }
    (kept_x, kept_y)
}

/// Indices of the first, lowest, highest and last value of `y[start..end]`, and of one gap if there is one.
fn landmarks(y: &[f64], start: usize, end: usize) -> Vec<usize> {
    let finite = || (start..end).filter(|&k| y[k].is_finite());
    let lowest = finite().min_by(|&a, &b| y[a].total_cmp(&y[b]));
    let highest = finite().max_by(|&a, &b| y[a].total_cmp(&y[b]));
    let gap = (start..end).find(|&k| !y[k].is_finite());
    let mut kept: Vec<usize> = [Some(start), lowest, highest, gap, Some(end - 1)]
        .into_iter()
        .flatten()
        .collect();
    kept.sort_unstable();
    kept.dedup();
    kept
}
