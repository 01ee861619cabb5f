//! The numbers of the plots of a page: each array once, as a start and a step if that suffices, else with 24 bits a value
//! in base64. `plot/arrays.js` reads them.

use std::collections::HashMap;

use serde::Serialize;

/// The largest integer of 24 bits is a gap; smaller ones count from the least value to the largest.
const GAP: u32 = 0xff_ffff;
/// Steps of a regular array may differ by this part of a step.
const IRREGULAR: f64 = 1e-6;

/// The distribution of the values of an array.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Spread {
    /// Equal differences matter: fixed point between the least and the largest value.
    Even,
    /// Equal ratios matter, or a few values are far from all others: the upper 24 bits of an `f32`.
    Wide,
}

/// One array in the format of the page.
#[derive(Debug, PartialEq, Serialize)]
#[serde(untagged)]
enum Packed {
    Regular {
        length: usize,
        from: f64,
        step: f64,
    },
    Even {
        length: usize,
        low: f64,
        high: f64,
        bits: String,
    },
    Wide {
        length: usize,
        bits: String,
    },
}

/// The arrays of a page.
#[derive(Debug, Default, Serialize)]
#[serde(transparent)]
pub(super) struct Arrays {
    packed: Vec<Packed>,
    /// Index of the array with these bits.
    #[serde(skip)]
    known: HashMap<(Spread, Vec<u64>), usize>,
}

impl Arrays {
    /// The index of an array among those of the page; equal arrays share it.
    pub(super) fn add(&mut self, values: &[f64], spread: Spread) -> usize {
        let bits = values.iter().map(|value| value.to_bits()).collect();
        *self.known.entry((spread, bits)).or_insert_with(|| {
            self.packed.push(packed(values, spread));
            self.packed.len() - 1
        })
    }
}

/// Whether a start and a step describe all of an array.
pub(super) fn is_regular(values: &[f64]) -> bool {
    regular(values).is_some()
}

fn regular(values: &[f64]) -> Option<(f64, f64)> {
    let (first, last) = (*values.first()?, *values.last()?);
    let step = (last - first) / (values.len() - 1).max(1) as f64;
    let near = |(k, value): (usize, &f64)| {
        (value - (first + k as f64 * step)).abs() <= IRREGULAR * step.abs()
    };
    (first.is_finite() && step.is_finite() && values.iter().enumerate().all(near))
        .then_some((first, step))
}

fn packed(values: &[f64], spread: Spread) -> Packed {
    let length = values.len();
    if let Some((from, step)) = regular(values) {
        return Packed::Regular { length, from, step };
    }
    let finite = || values.iter().copied().filter(|value| value.is_finite());
    let low = finite().fold(f64::INFINITY, f64::min);
    let high = finite().fold(f64::NEG_INFINITY, f64::max);
    if spread == Spread::Even && (high - low).is_finite() {
        let bits = base64(values.iter().map(|value| fixed(*value, low, high)));
        return Packed::Even {
            length,
            low,
            high,
            bits,
        };
    }
    let bits = base64(values.iter().map(|value| floating(*value)));
    Packed::Wide { length, bits }
}

fn fixed(value: f64, low: f64, high: f64) -> u32 {
    if !value.is_finite() {
        return GAP;
    }
    let part = (value - low) / (high - low).max(f64::MIN_POSITIVE);
    (part.clamp(0.0, 1.0) * f64::from(GAP - 1)).round() as u32
}

/// The upper 24 bits of the nearest `f32`, rounded.
fn floating(value: f64) -> u32 {
    let bits = (value as f32).to_bits();
    bits.checked_add(0x80).unwrap_or(bits) >> 8
}

/// Four letters for each number of 24 bits.
fn base64(words: impl Iterator<Item = u32>) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let letter = |word: u32, shift: u32| char::from(LETTERS[(word >> shift) as usize & 63]);
    words
        .flat_map(|word| [18, 12, 6, 0].map(|shift| letter(word, shift)))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_of_a_clock_are_a_start_and_a_step() {
        let clock: Vec<f64> = (0..1000).map(|k| 0.5 + f64::from(k) * 0.01).collect();
        let expected = Packed::Regular {
            length: 1000,
            from: 0.5,
            step: (clock[999] - 0.5) / 999.0,
        };
        assert_eq!(packed(&clock, Spread::Even), expected);
        assert!(!is_regular(&[0.0, 1.0, 2.5]) && !is_regular(&[f64::NAN, 1.0]) && !is_regular(&[]));
    }

    #[test]
    fn the_ends_and_a_gap_have_their_letters() {
        let Packed::Even {
            bits, low, high, ..
        } = packed(&[-2.0, 1.0, f64::NAN, -0.5], Spread::Even)
        else {
            panic!("an uneven array is packed in bits");
        };
        assert_eq!(
            (low.to_bits(), high.to_bits()),
            ((-2f64).to_bits(), 1f64.to_bits())
        );
        assert_eq!(bits, "AAAA///+////f///");
    }

    #[test]
    fn ratios_survive_over_many_decades() {
        for value in [1.0, -3.25e-12, 6.02e23, 1e-30, 0.0] {
            let read = f64::from(f32::from_bits(floating(value) << 8));
            assert!(
                (read - value).abs() <= 1.6e-5 * value.abs(),
                "{value} {read}"
            );
        }
        assert!(f32::from_bits(floating(f64::NAN) << 8).is_nan());
        assert!(!f32::from_bits(floating(f64::MAX) << 8).is_finite());
    }

    #[test]
    fn the_same_values_are_held_once() {
        let mut arrays = Arrays::default();
        let first = arrays.add(&[1.0, 4.0, 2.0], Spread::Even);
        assert_eq!(arrays.add(&[1.0, 4.0, 2.0], Spread::Even), first);
        assert_ne!(arrays.add(&[1.0, 4.0, 2.0], Spread::Wide), first);
    }

    #[test]
    fn values_beyond_all_bounds_leave_no_infinity_in_the_page() {
        for spread in [Spread::Even, Spread::Wide] {
            let json = serde_json::to_string(&packed(&[f64::MAX, -f64::MAX, 1.0], spread));
            assert!(json.is_ok_and(|json| !json.contains("null")), "{spread:?}");
        }
    }
}
