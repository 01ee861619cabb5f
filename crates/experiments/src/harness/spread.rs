//! Measurements of several seeds in one cell of a table.

/// The median of those that are finite; NaN of none.
pub(crate) fn median(values: &[f64]) -> f64 {
    let mut sorted: Vec<f64> = values.iter().copied().filter(|x| x.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    match sorted.len() {
        0 => f64::NAN,
        len if len % 2 == 1 => sorted[len / 2],
        len => 0.5 * (sorted[len / 2 - 1] + sorted[len / 2]),
    }
}

/// The middle one, the upper of two; none of nothing.
pub(crate) fn upper_median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}

/// `median (least … largest)`, and how many are not finite; a dash where there is nothing.
pub(crate) fn cell(values: &[f64]) -> String {
    let finite: Vec<f64> = values.iter().copied().filter(|x| x.is_finite()).collect();
    let least = finite.iter().copied().fold(f64::INFINITY, f64::min);
    let largest = finite.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let text = match finite.len() {
        0 => return "–".into(),
        1 => scientific(least),
        _ => format!(
            "{} ({} … {})",
            scientific(median(&finite)),
            scientific(least),
            scientific(largest)
        ),
    };
    match values.len() - finite.len() {
        0 => text,
        lost => format!("{text}, {lost} not"),
    }
}

/// Two digits: `1.2e-9`, `0.35`, `17`.
pub(crate) fn scientific(x: f64) -> String {
    if x != 0.0 && x.is_finite() && !(1e-2..1e4).contains(&x.abs()) {
        format!("{x:.1e}")
    } else {
        lagrangian_report::draw::short(x)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cell_holds_the_median_the_range_and_how_many_failed() {
        assert_eq!(cell(&[3e-9, 1e-9, 2e-9]), "2.0e-9 (1.0e-9 … 3.0e-9)");
        assert_eq!(cell(&[f64::NAN, 4e-7]), "4.0e-7, 1 not");
        assert_eq!(cell(&[f64::NAN]), "–");
    }
}
