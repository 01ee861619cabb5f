//! Figures of several seeds in one cell of a table.

use lagrangian_report::draw::short;

/// The middle one; NaN of nothing.
pub(crate) fn median(values: &[f64]) -> f64 {
    let mut sorted: Vec<f64> = values.iter().copied().filter(|x| x.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    match sorted.len() {
        0 => f64::NAN,
        len if len % 2 == 1 => sorted[len / 2],
        len => 0.5 * (sorted[len / 2 - 1] + sorted[len / 2]),
    }
}

/// `median (least … largest)`; a dash where there is nothing.
pub(crate) fn cell(values: &[f64]) -> String {
    let finite = || values.iter().copied().filter(|x| x.is_finite());
    let (low, high) = finite().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| {
        (low.min(x), high.max(x))
    });
    match finite().count() {
        0 => "–".into(),
        1 => scientific(low),
        _ => format!(
            "{} ({} … {})",
            scientific(median(values)),
            scientific(low),
            scientific(high)
        ),
    }
}

/// `one seed`, `3 seeds`.
pub(crate) fn seeds(count: usize) -> String {
    match count {
        1 => "one seed".into(),
        _ => format!("{count} seeds"),
    }
}

/// Two digits: `1.2e-9`, `0.35`, `17`.
pub(crate) fn scientific(x: f64) -> String {
    if x != 0.0 && x.is_finite() && !(1e-2..1e4).contains(&x.abs()) {
        format!("{x:.1e}")
    } else {
        short(x)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cell_holds_the_median_and_the_range() {
        assert_eq!(cell(&[3e-9, 1e-9, 2e-9]), "2.0e-9 (1.0e-9 … 3.0e-9)");
        assert_eq!(cell(&[f64::NAN, 4e-7]), "4.0e-7");
        assert_eq!(cell(&[]), "–");
    }
}
