//! Scalars for `TensorBoard`: an event file is a sequence of framed protobuf records.
//!
//! A record is `length: u64 · crc(length): u32 · data · crc(data): u32`, little endian, with crc the masked CRC-32C
//! of the `TFRecord` format. The messages used (`Event`, `Summary`, `Summary.Value` of tensorflow's `event.proto` and
//! `summary.proto`) have six fields, written here by hand:
//!
//! | message | field | number, type |
//! |---|---|---|
//! | `Event` | `wall_time` | 1, double |
//! | | `step` | 2, int64 |
//! | | `file_version` | 3, string |
//! | | `summary` | 5, message |
//! | `Summary` | `value` | 1, message |
//! | `Value` | `tag`, `simple_value` | 1, string; 2, float |

use std::io::{self, Write};

/// The version that opens every event file.
const FILE_VERSION: &str = "brain.Event:2";

/// Writes scalars to an event file.
#[derive(Debug)]
pub(crate) struct EventWriter<W: Write> {
    writer: W,
}

impl<W: Write> EventWriter<W> {
    /// Opens the file with its version record; `wall_time` in s since 1970.
    pub(crate) fn new(writer: W, wall_time: f64) -> io::Result<Self> {
        let mut this = Self { writer };
        let mut event = Message::default();
        event.double(1, wall_time);
        event.bytes(3, FILE_VERSION.as_bytes());
        this.record(&event.0)?;
        Ok(this)
    }

    /// Writes some scalars of one step.
    pub(crate) fn scalars(
        &mut self,
        wall_time: f64,
        step: u64,
        values: &[(&str, f64)],
    ) -> io::Result<()> {
        let mut summary = Message::default();
        for (tag, value) in values {
            let mut scalar = Message::default();
            scalar.bytes(1, tag.as_bytes());
            #[expect(
                clippy::cast_possible_truncation,
                reason = "the format stores single precision"
            )]
            scalar.float(2, *value as f32);
            summary.bytes(1, &scalar.0);
        }
        let mut event = Message::default();
        event.double(1, wall_time);
        event.integer(2, step);
        event.bytes(5, &summary.0);
        self.record(&event.0)
    }

    fn record(&mut self, data: &[u8]) -> io::Result<()> {
        let length = (data.len() as u64).to_le_bytes();
        self.writer.write_all(&length)?;
        self.writer.write_all(&masked_crc(&length).to_le_bytes())?;
        self.writer.write_all(data)?;
        self.writer.write_all(&masked_crc(data).to_le_bytes())?;
        self.writer.flush()
    }
}

/// A protobuf message under construction.
#[derive(Default)]
struct Message(Vec<u8>);

impl Message {
    const VARINT: u64 = 0;
    const FIXED64: u64 = 1;
    const LENGTH: u64 = 2;
    const FIXED32: u64 = 5;

    fn varint(&mut self, mut value: u64) {
        while value >= 0x80 {
            self.0.push(value.to_le_bytes()[0] | 0x80);
            value >>= 7;
        }
        self.0.push(value.to_le_bytes()[0]);
    }

    fn key(&mut self, field: u64, wire_type: u64) {
        self.varint(field << 3 | wire_type);
    }

    fn integer(&mut self, field: u64, value: u64) {
        self.key(field, Self::VARINT);
        self.varint(value);
    }

    fn double(&mut self, field: u64, value: f64) {
        self.key(field, Self::FIXED64);
        self.0.extend(value.to_le_bytes());
    }

    fn float(&mut self, field: u64, value: f32) {
        self.key(field, Self::FIXED32);
        self.0.extend(value.to_le_bytes());
    }

    fn bytes(&mut self, field: u64, value: &[u8]) {
        self.key(field, Self::LENGTH);
        self.varint(value.len() as u64);
        self.0.extend(value);
    }
}

/// CRC-32C (Castagnoli, reflected polynomial 0x82F63B78), rotated and shifted so that data that holds its own checksum
/// is not valid by chance.
fn masked_crc(data: &[u8]) -> u32 {
    crc32c(data).rotate_right(15).wrapping_add(0xa282_ead8)
}

fn crc32c(data: &[u8]) -> u32 {
    // Bit by bit: records are short.
    let shifted = |crc: u32, _| (crc >> 1) ^ (0x82F6_3B78 * (crc & 1));
    let next = |crc: u32, byte: &u8| (0..8).fold(crc ^ u32::from(*byte), shifted);
    !data.iter().fold(!0, next)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;

    #[test]
    fn the_checksum_is_that_of_the_standard() {
        // RFC 3720, appendix B.4.
        assert_eq!(crc32c(b"123456789"), 0xE306_9283);
        assert_eq!(crc32c(&[0; 32]), 0x8A91_36AA);
        assert_eq!(crc32c(&[0xff; 32]), 0x62A8_AB43);
    }

    #[test]
    fn an_event_file_has_the_bytes_that_tensorboard_reads() {
        let mut bytes = Vec::new();
        let mut events = EventWriter::new(&mut bytes, 1.5).unwrap();
        events
            .scalars(2.5, 300, &[("loss/train", 0.25), ("lr", 1e-3)])
            .unwrap();
        let hex: String = bytes.iter().map(|b| format!("{b:02x}")).collect();
        assert_eq!(hex, include_str!("tensorboard.golden").trim());
    }
}
