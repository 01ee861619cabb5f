//! Small bags of joint states.

use std::collections::BTreeMap;
use std::io::Cursor;

use mcap::records::MessageHeader;

const JOINT_STATE: &str = "sensor_msgs/msg/JointState";
const TOPIC: &str = "/joint_states";
/// When a bag begins, ns.
const START: u64 = 1_763_000_000_000_000_000;

/// When message `k` was sent, ns.
fn stamp(k: u32) -> u64 {
    START + u64::from(k) * 10_000_000
}

/// Message `k` of two joints in plain CDR, little end first.
fn message(k: u32) -> Vec<u8> {
    let mut bytes = Vec::new();
    let (seconds, rest) = (stamp(k) / 1_000_000_000, stamp(k) % 1_000_000_000);
    bytes.extend((seconds as u32).to_le_bytes());
    bytes.extend((rest as u32).to_le_bytes());
    let count = |bytes: &mut Vec<u8>, count: usize| {
        bytes.resize(bytes.len().next_multiple_of(4), 0);
        bytes.extend((count as u32).to_le_bytes());
    };
    let text = |bytes: &mut Vec<u8>, text: &str| {
        count(bytes, text.len() + 1);
        bytes.extend(text.as_bytes());
        bytes.push(0);
    };
    text(&mut bytes, "base");
    count(&mut bytes, 2);
    text(&mut bytes, "shoulder");
    text(&mut bytes, "elbow");
    let x = 0.3 * f64::from(k);
    for values in [[x.sin(), x.cos()], [x.cos(), -x.sin()], [1.0 + x, -x]] {
        count(&mut bytes, values.len());
        bytes.resize(bytes.len().next_multiple_of(8), 0);
        bytes.extend(values.iter().flat_map(|value| value.to_le_bytes()));
    }
    [&[0, 1, 0, 0], &bytes[..]].concat()
}

/// A bag in a database of small pages.
pub(crate) fn db3(messages: u32) -> Vec<u8> {
    let mut base = rusqlite::Connection::open_in_memory().unwrap();
    base.execute_batch(
        "PRAGMA page_size = 512;
         CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL);
         CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL, data BLOB NOT NULL);
         CREATE INDEX timestamp_idx ON messages (timestamp ASC);",
    )
    .unwrap();
    let topic = "INSERT INTO topics VALUES (1, ?1, ?2, 'cdr', '')";
    base.execute(topic, [TOPIC, JOINT_STATE]).unwrap();
    for k in 0..messages {
        let row = "INSERT INTO messages(topic_id, timestamp, data) VALUES (1, ?1, ?2)";
        base.execute(row, (stamp(k) as i64, message(k))).unwrap();
    }
    base.serialize("main").unwrap().to_vec()
}

/// A bag without checksums: in chunks, or message by message.
pub(crate) fn mcap(messages: u32, chunks: bool) -> Vec<u8> {
    let options = mcap::WriteOptions::new()
        .compression(None)
        .use_chunks(chunks)
        .calculate_chunk_crcs(false)
        .calculate_data_section_crc(false)
        .calculate_summary_section_crc(false)
        .chunk_size(Some(400));
    let mut writer = options.create(Cursor::new(Vec::new())).unwrap();
    let schema = writer.add_schema(JOINT_STATE, "ros2msg", b"").unwrap();
    let channel = writer
        .add_channel(schema, TOPIC, "cdr", &BTreeMap::new())
        .unwrap();
    for k in 0..messages {
        let header = MessageHeader {
            channel_id: channel,
            sequence: k,
            log_time: stamp(k),
            publish_time: stamp(k),
        };
        writer.write_to_known_channel(&header, &message(k)).unwrap();
    }
    writer.finish().unwrap();
    writer.into_inner().into_inner()
}
