//! Draws a report: pages whose plots a script draws, and pictures of figures and motions as files.

/// Appends formatted text to a string.
macro_rules! put {
    ($text:expr, $($part:tt)*) => {
        // OK because writing to a string cannot fail.
        std::fmt::Write::write_fmt($text, format_args!($($part)*)).unwrap_or_default()
    };
}

mod page;
#[cfg(feature = "pictures")]
mod pictures;
mod short;
mod theme;

pub use page::html;
#[cfg(feature = "pictures")]
pub use pictures::{Error, Result, gif, png, svg};
pub use short::short;

use crate::{Axis, Scale};

/// Larger values cannot be placed on a plot: the arithmetic of its axes would overflow.
const LARGEST: f64 = 1e300;

impl Axis {
    /// The place of a value on the axis, its logarithm on a logarithmic one; NaN where it has none.
    fn inner(&self, value: f64) -> f64 {
        match self.scale {
            _ if value.is_nan() || value.abs() >= LARGEST => f64::NAN,
            Scale::Linear => value,
            Scale::Log if value > 0.0 => value.log10(),
            Scale::Log => f64::NAN,
        }
    }

    /// Its fixed ends, if they can be drawn.
    fn fixed(&self) -> Option<(f64, f64)> {
        let (low, high) = self.range?;
        (self.inner(low) < self.inner(high)).then_some((low, high))
    }

    /// The least and the largest place of values; `None` without any.
    fn extent<'a>(&self, values: impl Iterator<Item = &'a f64>) -> Option<(f64, f64)> {
        let places = values.map(|value| self.inner(*value));
        let places = places.filter(|place| place.is_finite());
        places.fold(None, |ends, place| {
            let (low, high) = ends.unwrap_or((place, place));
            Some((low.min(place), high.max(place)))
        })
    }
}

/// A text of one line without signs that cannot be seen.
fn plain(text: &str) -> String {
    let seen = |letter| match letter {
        '\n' | '\t' => ' ',
        hidden if lagrangian::text::is_hidden(hidden) => '\u{fffd}',
        other => other,
    };
    text.chars().map(seen).collect()
}

/// A text made safe for HTML, in elements and in attributes.
fn escaped(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    for letter in plain(text).chars() {
        match letter {
            '&' => safe.push_str("&amp;"),
            '<' => safe.push_str("&lt;"),
            '>' => safe.push_str("&gt;"),
            '"' => safe.push_str("&quot;"),
            '\'' => safe.push_str("&#39;"),
            other => safe.push(other),
        }
    }
    safe
}

#[cfg(all(test, feature = "pictures"))]
mod tests;
