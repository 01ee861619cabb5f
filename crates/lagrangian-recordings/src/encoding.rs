//! Text encodings: UTF-8, and others that spreadsheets write.

use std::io::{self, Read};

/// The encoding of the letters of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Encoding {
    /// UTF-8.
    Utf8,
    /// ISO 8859-1: each byte is a letter.
    Latin1,
    /// UTF-16, with the low byte of each unit first.
    Utf16Little,
    /// UTF-16, with the high byte first.
    Utf16Big,
}

/// Number of bytes that are decoded at a time.
const CHUNK: usize = 1 << 13;

impl Encoding {
    /// The encoding of a file that starts with these bytes, and the length of its byte order mark.
    pub(super) fn of(start: &[u8]) -> (Self, usize) {
        match start {
            [0xff, 0xfe, ..] => (Self::Utf16Little, 2),
            [0xfe, 0xff, ..] => (Self::Utf16Big, 2),
            [0xef, 0xbb, 0xbf, ..] => (Self::Utf8, 3),
            [1..=255, 0, 1..=255, 0, ..] => (Self::Utf16Little, 0),
            [0, 1..=255, 0, 1..=255, ..] => (Self::Utf16Big, 0),
            _ => match std::str::from_utf8(start) {
                // The last letter may be cut.
                Err(error) if error.error_len().is_some() => (Self::Latin1, 0),
                _ => (Self::Utf8, 0),
            },
        }
    }

    /// Name of the encoding, unless it is UTF-8.
    pub(super) fn other(self) -> Option<&'static str> {
        match self {
            Self::Utf8 => None,
            Self::Latin1 => Some("Latin-1"),
            Self::Utf16Little | Self::Utf16Big => Some("UTF-16"),
        }
    }

    /// Decodes all complete letters of `raw` and leaves the rest there.
    fn decode(self, raw: &mut Vec<u8>) -> io::Result<String> {
        let number = match self {
            Self::Utf8 | Self::Latin1 => return Ok(raw.drain(..).map(char::from).collect()),
            Self::Utf16Little => u16::from_le_bytes,
            Self::Utf16Big => u16::from_be_bytes,
        };
        let mut units: Vec<u16> = raw.as_chunks().0.iter().map(|pair| number(*pair)).collect();
        // The first half of a letter stays until the second arrives.
        units.pop_if(|unit| (0xd800..0xdc00).contains(unit));
        raw.drain(..2 * units.len());
        String::from_utf16(&units).map_err(|_| not_text())
    }
}

/// Text in another encoding as UTF-8.
pub(super) struct Decoded<R> {
    source: R,
    encoding: Encoding,
    raw: Vec<u8>,
    text: Vec<u8>,
    /// Number of bytes of `text` that were read.
    taken: usize,
}

impl<R: Read> Decoded<R> {
    pub(super) fn new(source: R, encoding: Encoding) -> Self {
        Self {
            source,
            encoding,
            raw: Vec::new(),
            text: Vec::new(),
            taken: 0,
        }
    }

    /// Decodes the next part; returns whether there was one.
    fn refill(&mut self) -> io::Result<bool> {
        self.text.clear();
        self.taken = 0;
        while self.text.is_empty() {
            let part = self.source.by_ref().take(CHUNK as u64);
            if io::copy(&mut { part }, &mut self.raw)? == 0 {
                return match self.raw.is_empty() {
                    true => Ok(false),
                    false => Err(not_text()),
                };
            }
            self.text = self.encoding.decode(&mut self.raw)?.into_bytes();
        }
        Ok(true)
    }
}

impl<R: Read> Read for Decoded<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if self.encoding == Encoding::Utf8 {
            return self.source.read(buffer);
        }
        if self.taken == self.text.len() && !self.refill()? {
            return Ok(0);
        }
        let count = buffer.len().min(self.text.len() - self.taken);
        buffer[..count].copy_from_slice(&self.text[self.taken..][..count]);
        self.taken += count;
        Ok(count)
    }
}

fn not_text() -> io::Error {
    io::Error::new(
        io::ErrorKind::InvalidData,
        "it begins like UTF-16 text, but is not: export it again, as UTF-8",
    )
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;

    #[test]
    fn letters_of_every_encoding_become_the_same_text() {
        let text = "Zeit (µs);Winkel (°)\n".repeat(2000);
        let wide = |bytes: fn(u16) -> [u8; 2], mark: Option<u16>| -> Vec<u8> {
            mark.into_iter()
                .chain(text.encode_utf16())
                .flat_map(bytes)
                .collect()
        };
        let files = [
            text.clone().into_bytes(),
            text.chars().map(|c| c as u8).collect(),
            wide(u16::to_le_bytes, Some(0xfeff)),
            wide(u16::to_be_bytes, Some(0xfeff)),
            wide(u16::to_le_bytes, None),
            wide(u16::to_be_bytes, None),
        ];
        for bytes in files {
            let (encoding, mark) = Encoding::of(&bytes);
            let mut read = String::new();
            let mut decoded = Decoded::new(&bytes[mark..], encoding);
            decoded.read_to_string(&mut read).unwrap();
            assert!(read == text, "{encoding:?}");
        }
    }

    #[test]
    fn a_letter_outside_the_first_plane_may_lie_across_two_parts() {
        let text = "a".repeat(CHUNK / 2 - 1) + "𝜃 and more";
        let bytes: Vec<u8> = text.encode_utf16().flat_map(u16::to_le_bytes).collect();
        let mut read = String::new();
        let mut decoded = Decoded::new(&bytes[..], Encoding::Utf16Little);
        decoded.read_to_string(&mut read).unwrap();
        assert!(read == text);
        for broken in [&bytes[..bytes.len() - 1], &[0x00, 0xd8], &[0x00, 0xdc]] {
            let mut decoded = Decoded::new(broken, Encoding::Utf16Little);
            assert!(decoded.read_to_string(&mut read).is_err());
        }
    }
}
