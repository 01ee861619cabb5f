//! The records of MCAP that are read (<https://mcap.dev/spec>). All data are borrowed, so that a claimed length takes no memory.

use mcap::records::op;

/// A record, with the fields that are read.
pub(super) enum Record<'a> {
    Schema {
        id: u16,
        name: &'a str,
    },
    Channel {
        id: u16,
        schema: u16,
        topic: &'a str,
        encoding: &'a str,
    },
    Message {
        channel: u16,
        log_time: u64,
        data: &'a [u8],
    },
    Chunk(Chunk<'a>),
    /// The number of messages that the summary counts.
    Statistics {
        messages: u64,
    },
    /// Any other record.
    Other,
}

/// Records, packed or not.
pub(super) struct Chunk<'a> {
    /// Their length, unpacked.
    pub(super) size: u64,
    /// Their CRC-32, unpacked; 0 if unknown.
    pub(super) crc: u32,
    pub(super) compression: &'a str,
    pub(super) data: &'a [u8],
}

impl<'a> Record<'a> {
    /// A record; `None` where it ends too early, or a name is not UTF-8.
    pub(super) fn parse(opcode: u8, body: &'a [u8]) -> Option<Self> {
        let mut fields = Fields(body);
        Some(match opcode {
            op::SCHEMA => Self::Schema {
                id: fields.u16()?,
                name: fields.text()?,
            },
            op::CHANNEL => Self::Channel {
                id: fields.u16()?,
                schema: fields.u16()?,
                topic: fields.text()?,
                encoding: fields.text()?,
            },
            op::MESSAGE => {
                let (channel, _sequence) = (fields.u16()?, fields.u32()?);
                let (log_time, _publish_time) = (fields.u64()?, fields.u64()?);
                Self::Message {
                    channel,
                    log_time,
                    data: fields.0,
                }
            }
            op::CHUNK => {
                let (_first, _last) = (fields.u64()?, fields.u64()?);
                let (size, crc, compression) = (fields.u64()?, fields.u32()?, fields.text()?);
                let length = usize::try_from(fields.u64()?).ok()?;
                let data = fields.take(length)?;
                Self::Chunk(Chunk {
                    size,
                    crc,
                    compression,
                    data,
                })
            }
            op::STATISTICS => Self::Statistics {
                messages: fields.u64()?,
            },
            _ => Self::Other,
        })
    }
}

/// The fields of a record that have not been read.
struct Fields<'a>(&'a [u8]);

impl<'a> Fields<'a> {
    fn take(&mut self, length: usize) -> Option<&'a [u8]> {
        let (taken, rest) = self.0.split_at_checked(length)?;
        self.0 = rest;
        Some(taken)
    }

    fn array<const N: usize>(&mut self) -> Option<[u8; N]> {
        self.take(N)?.try_into().ok()
    }

    fn u16(&mut self) -> Option<u16> {
        Some(u16::from_le_bytes(self.array()?))
    }

    fn u32(&mut self) -> Option<u32> {
        Some(u32::from_le_bytes(self.array()?))
    }

    fn u64(&mut self) -> Option<u64> {
        Some(u64::from_le_bytes(self.array()?))
    }

    fn text(&mut self) -> Option<&'a str> {
        let length = usize::try_from(self.u32()?).ok()?;
        std::str::from_utf8(self.take(length)?).ok()
    }
}
