//! Numbers as a reader sees them.

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
    text.replace('-', "−")
}

/// A power of ten, e.g. `10⁻⁶`.
pub(super) fn power(exponent: i32) -> String {
    let raised = exponent.to_string();
    let raised = raised.chars().map(|letter| match letter {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        digit => char::from_u32(0x2070 + digit as u32 - '0' as u32).unwrap_or(digit),
    });
    format!("10{}", raised.collect::<String>())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_numbers_keep_two_digits_and_absent_ones_are_a_dash() {
        let words = [0.000_91, -0.031, 2.5e-10, 6.02e23, f64::NAN].map(short);
        assert_eq!(words, ["0.00091", "−0.031", "2.5×10⁻¹⁰", "6.0×10²³", "–"]);
    }
}
