//! Bytes that are almost those of a file.

use rand::{Rng, RngExt};

/// A longer input is cut: what a parser does with much is what it does with little, more slowly.
const LONGEST: usize = 1 << 16;

/// Numbers at which programs go wrong, as text.
const NUMBERS: [&str; 24] = [
    "0",
    "-0",
    "1",
    "-1",
    "2",
    "7",
    "255",
    "256",
    "65535",
    "65536",
    "4294967295",
    "4294967296",
    "9223372036854775807",
    "18446744073709551615",
    "1e308",
    "-1e308",
    "1e-320",
    "1e999",
    "nan",
    "inf",
    "-inf",
    "0.1",
    "1e15",
    "",
];

/// The same as integers of eight bytes, of which fewer are used too.
const INTEGERS: [u64; 12] = [
    0,
    1,
    0x7f,
    0x80,
    0xff,
    0x7fff,
    0xffff,
    0x7fff_ffff,
    0xffff_ffff,
    1 << 40,
    i64::MAX as u64,
    u64::MAX,
];

/// A mutant of one entry of the corpus, which must not be empty; text is changed in its words and numbers too.
pub fn mutant(rng: &mut impl Rng, corpus: &[Vec<u8>], text: bool) -> Vec<u8> {
    let other = |rng: &mut dyn Rng| &corpus[rng.random_range(0..corpus.len())][..];
    let mut bytes = other(rng).to_vec();
    // One change most often, many now and then.
    let changes = 1 + rng.random_range(0..8_u32) * rng.random_range(0..2_u32);
    for _ in 0..changes {
        let is_word = rng.random_range(0..100) < if text { 60 } else { 25 };
        if is_word {
            change_word(rng, &mut bytes, other);
        } else {
            change_bytes(rng, &mut bytes, other);
        }
        bytes.truncate(LONGEST);
    }
    bytes
}

/// Changes some bytes, whatever they mean.
fn change_bytes<'a>(
    rng: &mut impl Rng,
    bytes: &mut Vec<u8>,
    other: impl Fn(&mut dyn Rng) -> &'a [u8],
) {
    let at = rng.random_range(0..=bytes.len());
    let part = at..at + length(rng, bytes.len() - at);
    match rng.random_range(0..9) {
        0 | 1 => {
            if let Some(byte) = bytes.get_mut(at) {
                *byte ^= 1 << rng.random_range(0..8);
            }
        }
        2 => overwrite(rng, &mut bytes[at..]),
        3 => bytes.truncate(at),
        4 => drop(bytes.drain(part)),
        5 => {
            let copy = bytes[part].to_vec();
            bytes.splice(at..at, copy);
        }
        6 => {
            let new = (0..length(rng, 16)).map(|_| rng.random());
            let new: Vec<u8> = new.collect();
            bytes.splice(at..at, new);
        }
        7 => {
            let other = other(rng);
            let from = rng.random_range(0..=other.len());
            let to = from + length(rng, other.len() - from);
            bytes.splice(part, other[from..to].iter().copied());
        }
        _ => {
            let other = other(rng);
            let from = at.min(other.len());
            bytes.truncate(at);
            bytes.extend(&other[from..]);
        }
    }
}

/// Puts an integer of one to eight bytes over what is there, in either order.
fn overwrite(rng: &mut impl Rng, bytes: &mut [u8]) {
    let value = INTEGERS[rng.random_range(0..INTEGERS.len())];
    let value = value.wrapping_add(rng.random_range(0..3)).wrapping_sub(1);
    let width = (1 << rng.random_range(0..4)).min(bytes.len());
    let mut digits = value.to_le_bytes();
    if rng.random() {
        digits[..width].reverse();
    }
    bytes[..width].copy_from_slice(&digits[..width]);
}

/// Changes one word or number, or one line.
fn change_word<'a>(
    rng: &mut impl Rng,
    bytes: &mut Vec<u8>,
    other: impl Fn(&mut dyn Rng) -> &'a [u8],
) {
    let Some(place) = word(rng, bytes) else {
        return change_bytes(rng, bytes, other);
    };
    let is_number = bytes[place.clone()].iter().any(u8::is_ascii_digit);
    match rng.random_range(0..8) {
        0..4 if is_number => {
            let number = NUMBERS[rng.random_range(0..NUMBERS.len())];
            bytes.splice(place, number.bytes());
        }
        0..6 => {
            let other = other(rng);
            let new = word(rng, other).map_or(&[][..], |place| &other[place]);
            bytes.splice(place, new.iter().copied());
        }
        6 => {
            let line = line(bytes, place.start);
            let copy = bytes[line.clone()].to_vec();
            let times = length(rng, 40);
            bytes.splice(line.start..line.start, copy.repeat(times));
        }
        _ => drop(bytes.drain(line(bytes, place.start))),
    }
}

/// The place of a word or number, near a random place.
fn word(rng: &mut impl Rng, bytes: &[u8]) -> Option<std::ops::Range<usize>> {
    let is_part = |byte: &u8| byte.is_ascii_alphanumeric() || b".-+_".contains(byte);
    let at = rng.random_range(0..=bytes.len());
    let near = bytes[at..].iter().take(400).position(is_part)? + at;
    let before = bytes[..near]
        .iter()
        .rev()
        .take(40)
        .take_while(|b| is_part(b))
        .count();
    let after = bytes[near..]
        .iter()
        .take(40)
        .take_while(|b| is_part(b))
        .count();
    Some(near - before..near + after)
}

/// The line around a place, with its end.
fn line(bytes: &[u8], at: usize) -> std::ops::Range<usize> {
    let is_end = |byte: &u8| *byte == b'\n';
    let start = bytes[..at].iter().rposition(is_end).map_or(0, |k| k + 1);
    let end = bytes[at..]
        .iter()
        .position(is_end)
        .map_or(bytes.len(), |k| at + k + 1);
    start..end
}

/// A length of at most `most`, most often a small one.
fn length(rng: &mut impl Rng, most: usize) -> usize {
    let longest = (1_usize << rng.random_range(0..13)).min(most);
    rng.random_range(0..=longest)
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    use super::*;

    #[test]
    fn mutants_differ_are_bounded_and_repeat_by_their_seed() {
        let corpus = [
            b"t,q1\n0,0.5\n1,0.25\n".to_vec(),
            b"angle = [\"q1\"]\n".to_vec(),
        ];
        let mutants = |seed| -> Vec<Vec<u8>> {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            (0..2000)
                .map(|k| mutant(&mut rng, &corpus, k % 2 == 0))
                .collect()
        };
        let (one, same, other) = (mutants(1), mutants(1), mutants(2));
        assert_eq!(one, same);
        assert_ne!(one, other);
        assert!(one.iter().all(|bytes| bytes.len() <= LONGEST));
        let changed = one.iter().filter(|bytes| !corpus.contains(bytes)).count();
        assert!(changed > 1500, "{changed} of 2000 differ from the corpus");
    }

    #[test]
    fn nothing_can_be_changed_too() {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let all: Vec<_> = (0..200)
            .map(|_| mutant(&mut rng, &[Vec::new()], true))
            .collect();
        assert!(all.iter().any(|bytes| !bytes.is_empty()));
    }
}
