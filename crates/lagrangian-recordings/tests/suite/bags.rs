//! Joint states of ROS 2 bags: both containers give the same rows, choices and missing parts are reported, and damaged bags are
//! refused.
#![cfg(feature = "ros")]
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
#![allow(clippy::print_stdout, reason = "a test says that it is skipped")]

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{Cursor, Write};
use std::path::PathBuf;

use lagrangian_motion::{Error, Result, Signals};
use lagrangian_recordings::{
    Format, Layout, Readings, Recording,
    check::{CheckOptions, Verdict, check},
};
use mcap::records::{MessageHeader, op};

const JOINT_STATE: &str = "sensor_msgs/msg/JointState";
const TOPIC: &str = "/joint_states";

/// A message before serialisation.
#[derive(Clone)]
struct State {
    topic: &'static str,
    /// Time, ns.
    stamp: u64,
    log_time: u64,
    names: Vec<&'static str>,
    position: Vec<f64>,
    velocity: Vec<f64>,
    effort: Vec<f64>,
}

impl State {
    /// Message `k` of two joints at 100 Hz.
    fn number(k: u32) -> Self {
        let x = f64::from(k);
        let stamp = 1_763_000_000_000_000_000 + u64::from(k) * 10_000_000;
        Self {
            topic: TOPIC,
            stamp,
            log_time: stamp + 7,
            names: vec!["shoulder", "elbow"],
            position: vec![x.sin(), x.cos()],
            velocity: vec![0.1 * x, -0.1 * x],
            effort: vec![1.0 / (1.0 + x), -x],
        }
    }

    /// Plain CDR, little-endian.
    fn bytes(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        bytes.extend(((self.stamp / 1_000_000_000) as i32).to_le_bytes());
        bytes.extend(((self.stamp % 1_000_000_000) as u32).to_le_bytes());
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
        count(&mut bytes, self.names.len());
        for name in &self.names {
            text(&mut bytes, name);
        }
        for values in [&self.position, &self.velocity, &self.effort] {
            count(&mut bytes, values.len());
            if !values.is_empty() {
                bytes.resize(bytes.len().next_multiple_of(8), 0);
            }
            bytes.extend(values.iter().flat_map(|x| x.to_le_bytes()));
        }
        [&[0, 1, 0, 0], &bytes[..]].concat()
    }
}

fn states(count: u32) -> Vec<State> {
    (0..count).map(State::number).collect()
}

/// A topic with its type.
struct Declared(&'static str, &'static str);

fn declared(states: &[State]) -> Vec<Declared> {
    let mut topics: Vec<&'static str> = states.iter().map(|s| s.topic).collect();
    topics.sort_unstable();
    topics.dedup();
    topics
        .into_iter()
        .map(|name| Declared(name, JOINT_STATE))
        .collect()
}

fn db3(states: &[State]) -> Vec<u8> {
    db3_with(&declared(states), states)
}

fn db3_with(topics: &[Declared], states: &[State]) -> Vec<u8> {
    let mut base = rusqlite::Connection::open_in_memory().unwrap();
    base.execute_batch(
        "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL);
         CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL, data BLOB NOT NULL);
         CREATE INDEX timestamp_idx ON messages (timestamp ASC);",
    )
    .unwrap();
    let transaction = base.transaction().unwrap();
    for Declared(name, kind) in topics {
        let row = "INSERT INTO topics(name, type, serialization_format, offered_qos_profiles) VALUES (?1, ?2, 'cdr', '')";
        transaction.execute(row, [name, kind]).unwrap();
    }
    for state in states {
        let row = "INSERT INTO messages(topic_id, timestamp, data) SELECT id, ?2, ?3 FROM topics WHERE name = ?1";
        let time = state.log_time as i64;
        transaction
            .execute(row, (state.topic, time, state.bytes()))
            .unwrap();
    }
    transaction.commit().unwrap();
    base.serialize("main").unwrap().to_vec()
}

fn mcap(states: &[State]) -> Vec<u8> {
    mcap_with(&declared(states), states, "cdr")
}

fn mcap_with(topics: &[Declared], states: &[State], encoding: &str) -> Vec<u8> {
    let options = mcap::WriteOptions::new()
        .compression(None)
        .chunk_size(Some(2000));
    let mut writer = options.create(Cursor::new(Vec::new())).unwrap();
    let mut channels = BTreeMap::new();
    for Declared(name, kind) in topics {
        let schema = writer.add_schema(kind, "ros2msg", b"").unwrap();
        let id = writer
            .add_channel(schema, name, encoding, &BTreeMap::new())
            .unwrap();
        channels.insert(*name, id);
    }
    for (sequence, state) in (0..).zip(states) {
        let header = MessageHeader {
            channel_id: channels[state.topic],
            sequence,
            log_time: state.log_time,
            publish_time: state.log_time,
        };
        writer
            .write_to_known_channel(&header, &state.bytes())
            .unwrap();
    }
    writer.finish().unwrap();
    writer.into_inner().into_inner()
}

/// The bag with compressed chunks, and without checksums and index; the messages are still counted.
fn packed(bag: &[u8], compression: &str) -> Vec<u8> {
    let put = |bag: &mut Vec<u8>, opcode: u8, body: &[u8]| {
        bag.push(opcode);
        bag.extend((body.len() as u64).to_le_bytes());
        bag.extend(body);
    };
    let mut new = mcap::MAGIC.to_vec();
    let mut rest = &bag[mcap::MAGIC.len()..];
    loop {
        let (opcode, length) = (rest[0], u64::from_le_bytes(rest[1..9].try_into().unwrap()));
        let body = &rest[9..9 + length as usize];
        rest = &rest[9 + length as usize..];
        match mcap::parse_record(opcode, body).unwrap() {
            mcap::records::Record::Chunk { header, data } => {
                let data = pack(&data, compression);
                let head = [
                    &header.message_start_time.to_le_bytes()[..],
                    &header.message_end_time.to_le_bytes(),
                    &header.uncompressed_size.to_le_bytes(),
                    &header.uncompressed_crc.to_le_bytes(),
                    &(compression.len() as u32).to_le_bytes(),
                    compression.as_bytes(),
                    &(data.len() as u64).to_le_bytes(),
                    &data,
                ];
                put(&mut new, opcode, &head.concat());
            }
            mcap::records::Record::Header(_) => put(&mut new, opcode, body),
            mcap::records::Record::DataEnd(_) => put(&mut new, opcode, &[0; 4]),
            mcap::records::Record::Statistics(_) => put(&mut new, opcode, body),
            mcap::records::Record::Footer(_) => break,
            _ => {}
        }
    }
    put(&mut new, op::FOOTER, &[0; 20]);
    new.extend(mcap::MAGIC);
    new
}

fn pack(data: &[u8], compression: &str) -> Cow<'static, [u8]> {
    match compression {
        "lz4" => {
            let mut encoder = lz4_flex::frame::FrameEncoder::new(Vec::new());
            encoder.write_all(data).unwrap();
            encoder.finish().unwrap().into()
        }
        "zstd" => {
            let level = ruzstd::encoding::CompressionLevel::Fastest;
            ruzstd::encoding::compress_to_vec(data, level).into()
        }
        other => panic!("no {other}"),
    }
}

fn read(format: Format, bag: &[u8]) -> Result<Readings> {
    read_with(format, bag, &Layout::default())
}

fn read_with(format: Format, bag: &[u8], layout: &Layout) -> Result<Readings> {
    format.read(Cursor::new(bag.to_vec()), "bag", layout)
}

/// The results of both containers for the same messages.
fn both(states: &[State], layout: &Layout) -> Result<Readings> {
    let from_mcap = read_with(Format::Mcap, &mcap(states), layout);
    let from_db3 = read_with(Format::Db3, &db3(states), layout);
    match (from_mcap, from_db3) {
        (Ok(a), Ok(b)) => {
            assert_eq!(a.columns, b.columns);
            assert_eq!(a.notes, b.notes);
            // NaN differs from itself.
            assert_eq!(format!("{:?}", a.recordings), format!("{:?}", b.recordings));
            Ok(a)
        }
        (Err(a), Err(b)) => {
            assert_eq!(a.to_string(), b.to_string());
            Err(a)
        }
        (a, b) => panic!("{a:?}\n{b:?}"),
    }
}

fn first(readings: &Readings) -> &Recording {
    &readings.recordings[0]
}

fn assert_says(error: &Error, parts: &[&str]) {
    let message = error.to_string();
    for part in parts {
        assert!(message.contains(part), "'{message}' does not say '{part}'");
    }
}

fn q(names: &[&str]) -> Layout {
    let q = names.iter().map(ToString::to_string).collect();
    Layout {
        columns: Signals {
            q,
            ..Signals::default()
        },
        ..Layout::default()
    }
}

#[test]
fn joint_states_are_rows_with_names_of_joints_and_seconds_since_the_first() {
    let states = states(50);
    let readings = both(&states, &Layout::default()).unwrap();
    let bag = first(&readings);
    let names: Vec<&str> = bag.coordinates.0.iter().map(|c| c.name.as_str()).collect();
    assert_eq!(names, ["shoulder", "elbow"]);
    assert_eq!(bag.len(), 50);
    for (k, state) in states.iter().enumerate() {
        assert_eq!(bag.t[k..=k], [k as f64 / 100.0]);
        let row = bag.signals.row(2, k);
        assert_eq!(
            (row.q, row.qd, row.tau),
            (&state.position[..], &state.velocity[..], &state.effort[..])
        );
    }
    assert!(readings.notes.is_empty() && readings.columns.ignored.is_empty());
}

#[test]
fn compressed_chunks_hold_the_same() {
    let plain = mcap(&states(200));
    let expected = read(Format::Mcap, &plain).unwrap();
    for compression in ["lz4", "zstd"] {
        assert_eq!(
            read(Format::Mcap, &packed(&plain, compression)).unwrap(),
            expected,
            "{compression}"
        );
    }
}

#[test]
fn a_database_with_a_log_of_writes_that_is_complete_is_read() {
    let mut bag = db3(&states(5));
    bag[18..20].copy_from_slice(&[2, 2]);
    assert_eq!(first(&read(Format::Db3, &bag).unwrap()).len(), 5);
}

#[test]
fn joints_are_chosen_by_name_in_that_order_whatever_the_order_of_a_message() {
    let mut states = states(10);
    for state in states.iter_mut().skip(1).step_by(2) {
        state.names.reverse();
        for values in [&mut state.position, &mut state.velocity, &mut state.effort] {
            values.reverse();
        }
    }
    let readings = both(&states, &q(&["elbow", "shoulder"])).unwrap();
    let expected: Vec<f64> = (0..10)
        .map(f64::from)
        .flat_map(|x| [x.cos(), x.sin()])
        .collect();
    assert_eq!(first(&readings).q, expected);
    let readings = both(&states, &q(&["elbow"])).unwrap();
    assert_eq!(first(&readings).tau[3..5], [-3.0, -4.0]);
    assert_eq!(
        readings.columns.ignored,
        ["shoulder", "shoulder velocity", "shoulder effort"]
    );
    let error = both(&states, &q(&["elbow", "wrist"])).unwrap_err();
    assert_says(&error, &["no column 'wrist'", "shoulder, elbow", "`q`"]);
}

#[test]
fn messages_of_other_publishers_are_omitted_and_counted() {
    let mut states = states(10);
    let hand = |k: u32| State {
        names: vec!["finger"],
        position: vec![0.0],
        velocity: vec![],
        effort: vec![],
        ..State::number(k)
    };
    states.extend((10..14).map(hand));
    let readings = both(&states, &Layout::default()).unwrap();
    assert_eq!(first(&readings).len(), 10);
    assert!(readings.notes[0].contains("4 of 14 messages") && readings.notes[0].contains("finger"));
    let report = check(&readings.recordings, &CheckOptions::default());
    assert!(report.items.iter().all(|item| item.name != "joints"));
    let error = both(&states, &q(&["finger", "elbow"])).unwrap_err();
    assert_says(&error, &["no message", "finger", "`q`"]);
}

#[test]
fn joints_that_are_renamed_in_the_middle_of_a_bag_are_a_warning_with_their_place() {
    let renamed = |names: [&'static str; 2]| {
        let mut states = states(60);
        states[24..]
            .iter_mut()
            .for_each(|state| state.names = names.to_vec());
        both(&states, &Layout::default()).unwrap()
    };
    for (names, missing, instead) in [
        (
            ["shoulder", "elbow_joint"],
            "no joint elbow,",
            "but elbow_joint:",
        ),
        (
            ["left/shoulder", "left/elbow"],
            "no joint shoulder, elbow,",
            "but left/shoulder, left/elbow:",
        ),
    ] {
        let readings = renamed(names);
        assert_eq!(first(&readings).len(), 24);
        let report = check(&readings.recordings, &CheckOptions::default());
        let item = report
            .items
            .iter()
            .find(|item| item.name == "joints")
            .unwrap();
        assert_eq!(item.verdict, Verdict::Warn);
        for part in [
            "message 25 of 60",
            missing,
            instead,
            "36 messages are omitted",
        ] {
            assert!(item.finding.contains(part), "{}", item.finding);
        }
    }
    let other_order = renamed(["elbow", "shoulder"]);
    let report = check(&other_order.recordings, &CheckOptions::default());
    assert!(report.items.iter().all(|item| item.name != "joints"));
}

#[test]
fn signals_that_were_not_recorded_are_unknown_and_said_so() {
    let mut states = states(10);
    for state in &mut states {
        state.velocity.clear();
        state.effort[1] = f64::NAN;
    }
    let readings = both(&states, &Layout::default()).unwrap();
    assert!(first(&readings).qd.is_empty() && first(&readings).tau.is_empty());
    assert_eq!(
        readings.notes,
        [
            "no velocities of shoulder, elbow are recorded: qd is not known",
            "no efforts of elbow are recorded: tau is not known"
        ]
    );
    let driven = Layout {
        actuated: vec!["shoulder".into()],
        ..Layout::default()
    };
    let readings = both(&states, &driven).unwrap();
    assert_eq!(first(&readings).tau[..4], [1.0, 0.0, 0.5, 0.0]);
}

#[test]
fn a_value_that_is_missing_in_some_messages_is_kept_as_such() {
    let mut states = states(10);
    states[3].effort.clear();
    let readings = both(&states, &Layout::default()).unwrap();
    assert!(first(&readings).tau[6].is_nan() && first(&readings).tau[8].is_finite());
    assert_says(
        &first(&readings).validate().unwrap_err(),
        &["sample 4", "shoulder effort"],
    );
}

#[test]
fn without_stamps_the_times_of_the_recorder_are_taken() {
    let mut states = states(10);
    states.iter_mut().for_each(|state| state.stamp = 0);
    let readings = both(&states, &Layout::default()).unwrap();
    assert_eq!(first(&readings).t[8..], [0.08, 0.09]);
    assert!(readings.notes[0].contains("recorder"));
}

#[test]
fn stamps_that_stand_still_or_go_back_fail_the_check() {
    for (change, finding) in [(0, "stands still"), (-20_000_000_i64, "goes back")] {
        let mut states = states(100);
        states[50].stamp = states[49].stamp.checked_add_signed(change).unwrap();
        let recordings = both(&states, &Layout::default()).unwrap().recordings;
        assert_says(
            &recordings[0].validate().unwrap_err(),
            &["sample 51", finding],
        );
        let report = check(&recordings, &CheckOptions::default());
        let is_named = |item: &lagrangian_recordings::check::Item| {
            item.verdict == Verdict::Fail && item.name.contains("time")
        };
        assert!(report.items.iter().any(is_named), "{:?}", report.items);
    }
}

fn assert_says_in(notes: &[String], part: &str) {
    assert!(notes.iter().any(|note| note.contains(part)), "{notes:?}");
}

#[test]
fn of_several_topics_one_must_be_chosen() {
    let mut states = states(10);
    let copy: Vec<State> = states
        .iter()
        .map(|s| State {
            topic: "/copy",
            ..s.clone()
        })
        .collect();
    states.extend(copy.into_iter().take(7));
    let error = both(&states, &Layout::default()).unwrap_err();
    assert_says(
        &error,
        &[
            "2 topics",
            "/copy (sensor_msgs/msg/JointState), /joint_states",
            "`topic`",
        ],
    );
    let of = |topic: &str| Layout {
        topic: Some(topic.into()),
        ..Layout::default()
    };
    let copy = both(&states, &of("/copy")).unwrap();
    assert_eq!(first(&copy).len(), 7);
    assert_says_in(&copy.notes, "topics not used: /joint_states");
    assert_says(
        &both(&states, &of("/other")).unwrap_err(),
        &["no topic '/other'", "/copy"],
    );
}

#[test]
fn tens_of_thousands_of_topics_are_read_in_a_pass() {
    let many = |count: u32, kind| {
        let name = move |k| &*Box::leak(format!("/topic/{k}").into_boxed_str());
        (0..count).map(move |k| Declared(name(k), kind))
    };
    let scans = many(60_000, "sensor_msgs/msg/LaserScan");
    let topics: Vec<Declared> = scans.chain(declared(&states(1))).collect();
    let bag = mcap_with(&topics, &states(10), "cdr");
    // One topic among them is compared with each other one: 24 s before, less than 1 s now.
    let begun = std::time::Instant::now();
    let readings = read(Format::Mcap, &bag).unwrap();
    assert_eq!(first(&readings).len(), 10);
    assert_says_in(&readings.notes, "60000 in all");
    let bag = db3_of_each(&many(20_000, JOINT_STATE).collect::<Vec<_>>());
    let error = read(Format::Db3, &bag).unwrap_err();
    assert_says(&error, &["20000 topics", "`topic`"]);
    assert!(begun.elapsed().as_secs() < 12, "{:?}", begun.elapsed());
}

/// A database with a message of each topic.
fn db3_of_each(topics: &[Declared]) -> Vec<u8> {
    let (mut base, empty) = (
        rusqlite::Connection::open_in_memory().unwrap(),
        db3_with(topics, &[]),
    );
    base.deserialize_read_exact("main", &empty[..], empty.len(), false)
        .unwrap();
    let transaction = base.transaction().unwrap();
    let message = State::number(0).bytes();
    let row = "INSERT INTO messages(topic_id, timestamp, data) SELECT id, id, ?1 FROM topics";
    transaction.execute(row, [message]).unwrap();
    transaction.commit().unwrap();
    base.serialize("main").unwrap().to_vec()
}

#[test]
fn a_bag_without_joint_states_lists_what_it_has() {
    let topics = [
        Declared("/scan", "sensor_msgs/msg/LaserScan"),
        Declared("/empty", JOINT_STATE),
    ];
    let named = Layout {
        topic: Some("/scan".into()),
        ..Layout::default()
    };
    for (format, bag) in [
        (Format::Db3, db3_with(&topics, &[])),
        (Format::Mcap, mcap_with(&topics, &[], "cdr")),
    ] {
        assert_says(
            &read(format, &bag).unwrap_err(),
            &["no message of type", "/scan (sensor_msgs/msg/LaserScan)"],
        );
        assert_says(
            &read_with(format, &bag, &named).unwrap_err(),
            &["'/scan' holds sensor_msgs/msg/LaserScan"],
        );
    }
    let old = [Declared(TOPIC, "sensor_msgs/JointState")];
    let bag = mcap_with(&old, &states(3), "ros1");
    assert_says(
        &read(Format::Mcap, &bag).unwrap_err(),
        &["ROS 1", "rosbags-convert"],
    );
}

#[test]
fn what_is_no_bag_is_refused() {
    let base = |sql: &str| {
        let mut base = rusqlite::Connection::open_in_memory().unwrap();
        base.execute_batch(sql).unwrap();
        base.serialize("main").unwrap().to_vec()
    };
    let db3 = |bytes: &[u8]| read(Format::Db3, bytes).unwrap_err();
    assert_says(&db3(b""), &["does not begin"]);
    assert_says(&db3(b"t,q1\n0,1\n"), &["does not begin"]);
    assert_says(
        &db3(&base("CREATE TABLE songs(x)")),
        &["without the table 'messages'", "songs"],
    );
    let endless = "CREATE TABLE topics(x); CREATE VIEW messages AS WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n) SELECT * FROM n";
    assert_says(&db3(&base(endless)), &["without the table 'messages'"]);
    assert_says(
        &db3(&base("CREATE TABLE messages(x); CREATE TABLE topics(y)")),
        &["topic_id"],
    );
    for bytes in [&b""[..], b"t,q1\n0,1\n", mcap::MAGIC] {
        assert!(matches!(
            read(Format::Mcap, bytes),
            Err(Error::Malformed { .. })
        ));
    }
}

#[test]
fn messages_that_are_no_joint_states_are_named() {
    let mut states = states(5);
    states[2].position.pop();
    assert!(
        read(Format::Db3, &db3(&states))
            .unwrap_err()
            .to_string()
            .contains("message 3 of '/joint_states': it has 1 positions for 2 joints")
    );
    states[2] = State {
        names: vec!["elbow", "elbow"],
        ..State::number(2)
    };
    assert!(
        read(Format::Mcap, &mcap(&states))
            .unwrap_err()
            .to_string()
            .contains("names joint 'elbow' twice")
    );
}

/// Four bags of the same 200 messages.
fn bags() -> [(Format, Vec<u8>); 4] {
    let states = states(200);
    let plain = mcap(&states);
    [
        (Format::Db3, db3(&states)),
        (Format::Mcap, packed(&plain, "lz4")),
        (Format::Mcap, packed(&plain, "zstd")),
        (Format::Mcap, plain),
    ]
}

#[test]
fn a_bag_that_is_cut_anywhere_is_refused() {
    for (format, bag) in bags() {
        for k in 0..50 {
            let end = bag.len() * k / 50 + k % 7;
            let cut = read(format, &bag[..end.min(bag.len() - 1)]);
            assert!(cut.is_err(), "{format:?} at {end} of {}", bag.len());
        }
        assert!(read(format, &bag[..bag.len() - 1]).is_err());
    }
}

#[test]
fn a_bag_with_a_flipped_bit_never_panics_and_is_never_silently_partial() {
    for (format, bag) in bags() {
        for k in 0..200 {
            let mut damaged = bag.clone();
            // Multiples of the golden ratio reach all parts of the file.
            let at = (0.618_033_988_75 * k as f64).fract() * bag.len() as f64;
            damaged[at as usize] ^= 1 << (k % 8);
            if let Ok(readings) = read(format, &damaged) {
                let whole = first(&readings).len() == 200;
                assert!(whole || !readings.notes.is_empty(), "{format:?} at {at}");
            }
        }
    }
}

#[test]
fn sizes_that_are_claimed_take_no_memory() {
    let plain = mcap(&states(5));
    let chunk = mcap::MAGIC.len()
        + plain[mcap::MAGIC.len()..]
            .windows(1)
            .position(|w| w[0] == op::CHUNK)
            .unwrap();
    for at in chunk..chunk + 60 {
        for value in [0x7f, 0xff] {
            let mut claims = plain.clone();
            claims[at] = value;
            let _ = read(Format::Mcap, &claims);
        }
    }
}

/// The folder of recorded data, if it exists.
fn data() -> Option<PathBuf> {
    let beside = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data");
    let folder =
        std::env::var_os("LAGRANGIAN_DATA").map_or_else(|| PathBuf::from(beside), PathBuf::from);
    if !folder.is_dir() {
        println!("skipped: there is no folder {}", folder.display());
        return None;
    }
    Some(folder)
}

#[test]
fn bags_of_real_robots_hold_what_the_tables_beside_them_hold() {
    let Some(data) = data() else {
        return;
    };
    for (bag, table) in [
        (
            "ur10_real/ur10_exciting_trajectory.db3",
            "ur10_real/ur10.csv",
        ),
        (
            "panda_real/panda_exciting_trajectory.db3",
            "panda_real/panda.csv",
        ),
    ] {
        let of = |format: Format, path: &str| {
            let file = File::open(data.join(path)).unwrap();
            format
                .read(file, "robot", &Layout::default())
                .unwrap()
                .recordings
                .remove(0)
        };
        let (bag, table) = (of(Format::Db3, bag), of(Format::Csv, table));
        // The tables have nine digits.
        let is_close = |(a, b): (&f64, &f64)| (a - b).abs() <= 5.1e-9 * b.abs().max(1e-9);
        assert_eq!(bag.t.len(), table.t.len());
        assert!(bag.t.iter().zip(&table.t).all(is_close));
        for ((signal, own), (_, expected)) in bag.signals.iter().zip(table.signals.iter()) {
            assert_eq!(own.len(), expected.len(), "{signal:?}");
            assert!(own.iter().zip(expected).all(is_close), "{signal:?}");
        }
    }
}

#[test]
fn a_name_that_claims_gigabytes_is_refused_without_memory_for_it() {
    let bag = mcap(&states(5));
    let at = bag
        .windows(JOINT_STATE.len())
        .position(|w| w == JOINT_STATE.as_bytes());
    let mut damaged = bag;
    let at = at.unwrap() - 4;
    damaged[at..at + 4].copy_from_slice(&u32::MAX.to_le_bytes());
    let message = read(Format::Mcap, &damaged).unwrap_err().to_string();
    assert!(
        message.contains("not whole") || message.contains("not what was written"),
        "{message}"
    );
}
