//! ROS 2 bags in MCAP: chunks of records, one after another. Compressed chunks are unpacked in pure Rust.

use std::collections::{HashMap, HashSet};
use std::io::{Read, Seek};

use mcap::records::op;
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use ruzstd::decoding::StreamingDecoder;

use super::records::{Chunk, Record};
use super::{Bag, Message, Topic};
use lagrangian_motion::error::shortened;
use lagrangian_motion::{Error, Result};

/// The longest record that is read, packed or not, bytes.
const LONGEST: usize = 1 << 28;
/// Number of bytes that are read at a time, so that memory grows with the contents, not with the claimed size.
const PIECE: usize = 1 << 20;
const FORMAT: &str = "MCAP";

/// A bag that is read from beginning to end at each visit.
pub(super) struct Log<R> {
    source: R,
}

impl<R> Log<R> {
    pub(super) fn new(source: R) -> Self {
        Self { source }
    }
}

impl<R: Read + Seek> Bag for Log<R> {
    const FORMAT: &'static str = FORMAT;

    fn visit(
        &mut self,
        wanted: &dyn Fn(&Topic) -> bool,
        take: &mut dyn FnMut(&Topic, Message<'_>) -> Result<()>,
    ) -> Result<Vec<Topic>> {
        self.source.rewind()?;
        let mut reader = LinearReader::new_with_options(options());
        let mut visit = Visit::new(wanted, take);
        while let Some(event) = reader.next_event() {
            match event.map_err(damaged)? {
                LinearReadEvent::ReadRequest(bytes) => {
                    let buffer = reader.insert(bytes.min(PIECE));
                    let count = read_some(&mut self.source, buffer)?;
                    reader.notify_read(count);
                }
                LinearReadEvent::Record { opcode, data } => visit.record(opcode, data)?,
            }
        }
        visit.finish()
    }
}

fn options() -> LinearReaderOptions {
    LinearReaderOptions::default()
        .with_emit_chunks(true)
        .with_check_finishes_after_end_magic(true)
        .with_validate_data_section_crc(true)
        .with_validate_summary_section_crc(true)
        .with_record_length_limit(LONGEST)
}

fn read_some(source: &mut impl Read, buffer: &mut [u8]) -> Result<usize> {
    loop {
        match source.read(buffer) {
            Err(e) if e.kind() == std::io::ErrorKind::Interrupted => {}
            read => return Ok(read?),
        }
    }
}

fn malformed(reason: impl Into<String>) -> Error {
    Error::malformed(FORMAT, reason.into())
}

fn damaged(error: impl std::fmt::Display) -> Error {
    malformed(format!(
        "{error}: copy it again; `mcap recover` saves what is whole of a bag that was cut"
    ))
}

/// State of one pass through a bag.
struct Visit<'a> {
    wanted: &'a dyn Fn(&Topic) -> bool,
    take: &'a mut dyn FnMut(&Topic, Message<'_>) -> Result<()>,
    /// Names of the types by the number of their schema.
    kinds: HashMap<u16, String>,
    channels: HashMap<u16, Channel>,
    topics: Vec<Topic>,
    /// Set of the known topics, for look-up.
    known: HashSet<Topic>,
    messages: u64,
    /// Number of messages that the summary counts, if there is one.
    counted: Option<u64>,
}

struct Channel {
    topic: Topic,
    wanted: bool,
}

impl<'a> Visit<'a> {
    fn new(
        wanted: &'a dyn Fn(&Topic) -> bool,
        take: &'a mut dyn FnMut(&Topic, Message<'_>) -> Result<()>,
    ) -> Self {
        Self {
            wanted,
            take,
            kinds: HashMap::new(),
            channels: HashMap::new(),
            topics: Vec::new(),
            known: HashSet::new(),
            messages: 0,
            counted: None,
        }
    }

    fn record(&mut self, opcode: u8, body: &[u8]) -> Result<()> {
        let record = Record::parse(opcode, body);
        match record.ok_or_else(|| damaged("a record is not whole"))? {
            Record::Chunk(chunk) => self.chunk(&chunk)?,
            Record::Schema { id, name } => drop(self.kinds.insert(id, name.into())),
            Record::Channel {
                id,
                schema,
                topic,
                encoding,
            } => self.channel(id, schema, topic, encoding),
            Record::Message {
                channel,
                log_time,
                data,
            } => self.message(channel, log_time, data)?,
            Record::Statistics { messages } => self.counted = Some(messages),
            Record::Other => {}
        }
        Ok(())
    }

    fn channel(&mut self, id: u16, schema: u16, topic: &str, encoding: &str) {
        let topic = Topic {
            name: topic.into(),
            kind: self.kinds.get(&schema).cloned().unwrap_or_default(),
            encoding: encoding.into(),
        };
        if self.known.insert(topic.clone()) {
            self.topics.push(topic.clone());
        }
        let wanted = (self.wanted)(&topic);
        self.channels.insert(id, Channel { topic, wanted });
    }

    fn message(&mut self, id: u16, log_time: u64, data: &[u8]) -> Result<()> {
        self.messages += 1;
        let channel = self.channels.get(&id);
        let channel = channel.ok_or_else(|| {
            damaged(format!(
                "a message is of channel {id}, which is not declared"
            ))
        })?;
        if !channel.wanted {
            return Ok(());
        }
        let log_time = i64::try_from(log_time).map_err(damaged)?;
        (self.take)(&channel.topic, Message { log_time, data })
    }

    /// Processes the records of a chunk, after a check that they are complete.
    fn chunk(&mut self, chunk: &Chunk<'_>) -> Result<()> {
        let records = unpacked(chunk)?;
        let records = records.as_deref().unwrap_or(chunk.data);
        if records.len() as u64 != chunk.size
            || chunk.crc != 0 && crc32fast::hash(records) != chunk.crc
        {
            return Err(damaged("a chunk is not what was written"));
        }
        let mut rest = records;
        while !rest.is_empty() {
            let (opcode, body) = split_record(&mut rest)
                .ok_or_else(|| damaged("a chunk ends in the middle of a record"))?;
            if opcode == op::CHUNK {
                return Err(damaged("a chunk lies in a chunk"));
            }
            self.record(opcode, body)?;
        }
        Ok(())
    }

    fn finish(self) -> Result<Vec<Topic>> {
        match self.counted {
            Some(counted) if counted != self.messages => Err(damaged(format!(
                "it holds {} messages where its summary counts {counted}",
                self.messages
            ))),
            _ => Ok(self.topics),
        }
    }
}

/// Opcode and body of the first record; `rest` is then the remainder.
fn split_record<'a>(rest: &mut &'a [u8]) -> Option<(u8, &'a [u8])> {
    let (opcode, after) = rest.split_first()?;
    let (length, after) = after.split_first_chunk::<8>()?;
    let length = usize::try_from(u64::from_le_bytes(*length)).ok()?;
    let (body, after) = after.split_at_checked(length)?;
    *rest = after;
    Some((*opcode, body))
}

/// The unpacked bytes of a compressed chunk.
fn unpacked(chunk: &Chunk<'_>) -> Result<Option<Vec<u8>>> {
    let Chunk { size, data, .. } = *chunk;
    if size > LONGEST as u64 {
        return Err(malformed(format!(
            "a chunk of {size} bytes is longer than what is read ({LONGEST} bytes): write the bag again in smaller chunks"
        )));
    }
    let mut records = Vec::new();
    // One additional byte reveals too many.
    let read = match chunk.compression {
        "" => return Ok(None),
        "lz4" => lz4_flex::frame::FrameDecoder::new(data)
            .take(size + 1)
            .read_to_end(&mut records),
        "zstd" => unzstd(data, size + 1, &mut records),
        other => {
            let remedy = "write it again with zstd, lz4 or none";
            return Err(malformed(format!(
                "its chunks are compressed by '{}': {remedy}",
                shortened(other)
            )));
        }
    };
    read.map_err(|e| damaged(format!("a chunk cannot be unpacked ({e})")))?;
    Ok(Some(records))
}

/// Unpacks the frames of `data`, up to `most` bytes in all.
fn unzstd(mut data: &[u8], most: u64, records: &mut Vec<u8>) -> std::io::Result<usize> {
    while !data.is_empty() && (records.len() as u64) < most {
        let frame = StreamingDecoder::new(&mut data).map_err(std::io::Error::other)?;
        frame
            .take(most - records.len() as u64)
            .read_to_end(records)?;
    }
    Ok(records.len())
}
