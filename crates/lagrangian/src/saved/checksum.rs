//! A checksum over a whole file, which is stored in the file's own header.
//!
//! Headers are JSON within JSON, so that the field is written `\"checksum\":\"89abcdef\"`. The CRC-32 (IEEE 802.3) is that of
//! the file with zeros in the place of its digits: it finds every burst of up to 32 wrong bits, at any position.

/// The digits of a header before its checksum is known.
pub(crate) const BLANK: &str = "00000000";

/// The bytes before the digits.
const FIELD: &[u8] = br#"\"checksum\":\""#;

/// The first bytes of a file, which contain the field: no text that a user can name comes before it.
const START: usize = 256;

/// The place of the digits.
fn place(file: &[u8]) -> Option<std::ops::Range<usize>> {
    let start = &file[..file.len().min(START)];
    let field = start.windows(FIELD.len()).position(|w| w == FIELD)?;
    let begin = field + FIELD.len();
    let end = begin + BLANK.len();
    (end <= file.len()).then_some(begin..end)
}

/// The digits that belong in that place.
fn digits(file: &[u8], place: &std::ops::Range<usize>) -> String {
    let mut hasher = crc32fast::Hasher::new();
    hasher.update(&file[..place.start]);
    hasher.update(BLANK.as_bytes());
    hasher.update(&file[place.end..]);
    format!("{:08x}", hasher.finalize())
}

/// Writes the checksum into its place, and returns whether the file has one.
pub(crate) fn seal(file: &mut [u8]) -> bool {
    let Some(place) = place(file) else {
        return false;
    };
    let digits = digits(file, &place);
    file[place].copy_from_slice(digits.as_bytes());
    true
}

/// Whether a file holds its own checksum.
pub(crate) fn holds(file: &[u8]) -> bool {
    place(file).is_some_and(|place| digits(file, &place).as_bytes() == &file[place])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sealed_file_holds_and_one_with_any_wrong_bit_does_not() {
        let mut file = br#"{"a":"{\"checksum\":\"00000000\",\"b\":1}"} weights"#.to_vec();
        assert!(!holds(&file));
        assert!(seal(&mut file) && holds(&file));
        for bit in 0..8 * file.len() {
            let mut damaged = file.clone();
            damaged[bit / 8] ^= 1 << (bit % 8);
            assert!(!holds(&damaged), "bit {bit}");
        }
    }

    #[test]
    fn a_file_without_a_place_is_not_sealed() {
        assert!(!seal(&mut b"no place".to_vec()));
        assert!(!holds(br#"\"checksum\":\"00"#));
    }
}
