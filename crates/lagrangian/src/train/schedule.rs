//! Schedules over the budget of a run: of the rate, and of the size of a batch.

/// The schedule of the rate, ½ (1 + cos π x): 1 at the start of a run and 0 at its end, where x is the part of the budget that
/// is used.
#[must_use]
pub fn cosine(part: f64) -> f64 {
    0.5 * (1.0 + (std::f64::consts::PI * part).cos())
}

/// The number of samples of a batch at this part of the budget, in whole blocks of 16.
pub(crate) fn grown(first: usize, last: usize, share: f64) -> usize {
    if first >= last {
        return last;
    }
    let samples = first as f64 * (last as f64 / first as f64).powf(share);
    (samples as usize).next_multiple_of(16).clamp(first, last)
}
