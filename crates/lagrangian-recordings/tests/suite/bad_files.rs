//! Bad input: no panic, and every message states the location and a remedy.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::io::{Cursor, Read, Seek, SeekFrom, Write};

use lagrangian_motion::{Error, Result, Signals, Trajectory};
use lagrangian_recordings::csv;
use lagrangian_recordings::{EstimateOptions, Format, Layout, Readings, check::CheckOptions};
use proptest::prelude::*;

fn read(text: &str) -> Result<Readings> {
    read_with(text, &Layout::default())
}

fn read_with(text: &str, layout: &Layout) -> Result<Readings> {
    Format::Csv.read(Cursor::new(text.to_owned()), "file", layout)
}

/// The message of the error of reading `text`.
fn refusal(text: &str) -> String {
    read(text).unwrap_err().to_string()
}

/// The message of the error of making a trajectory of the first recording of `text`.
fn conversion_refusal(text: &str) -> String {
    let recording = read(text).unwrap().recordings.remove(0);
    recording
        .into_trajectory(&EstimateOptions::default())
        .unwrap_err()
        .to_string()
}

fn assert_says(message: &str, parts: &[&str]) {
    for part in parts {
        assert!(message.contains(part), "'{message}' does not say '{part}'");
    }
}

#[test]
fn a_row_without_end_is_refused_before_it_fills_the_memory() {
    for (start, endless) in [("", b'1'), ("t,q1\n0,1\n", b'7'), ("t,q1\n0,\"", b'\n')] {
        let text = start.as_bytes().chain(std::io::repeat(endless));
        let message = csv::read(text, "file", &Layout::default())
            .unwrap_err()
            .to_string();
        assert_says(&message, &["more than 4 MB", "quote"]);
    }
}

#[test]
fn a_missing_column_lists_those_that_are_there_and_the_flag() {
    assert_says(
        &refusal("time,q1\n0,0\n"),
        &["no column 't'", "time, q1", "`t`"],
    );
    assert_says(
        &refusal("t,theta\n0,0\n"),
        &["no column 'q1'", "t, theta", "`q`"],
    );
    let named = Layout {
        columns: Signals {
            qd: vec!["w".into()],
            ..Signals::default()
        },
        ..Layout::default()
    };
    assert_says(
        &read_with("t,q1,v\n0,0,0\n", &named)
            .unwrap_err()
            .to_string(),
        &["no column 'w'", "t, q1, v", "`qd`"],
    );
}

#[test]
fn an_unknown_column_is_ignored_but_listed() {
    let readings = read("t,q1,temperature,qd1\n0,1,20,2\n1,2,20,3\n").unwrap();
    assert_eq!(readings.columns.ignored, ["temperature"]);
    assert_eq!(readings.recordings[0].qd, [2.0, 3.0]);
}

#[test]
fn a_doubled_column_is_refused() {
    assert_says(&refusal("t,q1,q1\n0,0,0\n"), &["two columns 'q1'", "`q`"]);
    let twice = Layout {
        columns: Signals {
            q: vec!["a".into()],
            qd: vec!["a".into()],
            ..Signals::default()
        },
        ..Layout::default()
    };
    assert_says(
        &read_with("t,a\n0,0\n", &twice).unwrap_err().to_string(),
        &["'a' is used for two signals"],
    );
}

#[test]
fn signals_of_another_number_of_columns_are_refused() {
    assert_says(
        &refusal("t,q1,q2,qd1\n0,0,0,0\n"),
        &["1 columns for qd", "2 for q", "`qd`"],
    );
    assert_says(
        &refusal("t,q1,tau1,tau2\n0,0,0,0\n"),
        &["2 columns for tau", "1 for q", "`tau`"],
    );
    assert_says(
        &refusal("t,q1,q3\n0,0,0\n"),
        &["'q3' is there but 'q2' is not", "`q`"],
    );
    assert_says(
        &refusal("t,q1,qd2\n0,0,0\n"),
        &["'qd2' is there but 'qd1' is not", "`qd`"],
    );
}

#[test]
fn an_angle_that_is_no_coordinate_and_degrees_without_an_angle_are_refused() {
    let angle = Layout {
        angles: vec!["q7".into()],
        ..Layout::default()
    };
    assert_says(
        &read_with("t,q1\n0,0\n", &angle).unwrap_err().to_string(),
        &["'q7'", "`angles`"],
    );
    let degrees = Layout {
        degrees: true,
        ..Layout::default()
    };
    assert_says(
        &read_with("t,q1\n0,0\n", &degrees).unwrap_err().to_string(),
        &["degrees", "`angles`"],
    );
}

#[test]
fn text_in_a_number_is_refused_with_line_column_and_text() {
    assert_says(
        &refusal("t,q1\n0,0\n\n1,abc\n"),
        &["line 4", "'q1'", "'abc'"],
    );
    assert_says(&refusal("t,q1\r\n0,0\r\n1,abc\r\n"), &["line 3"]);
    assert_says(&refusal("t,q1\n0,0\n1,abc"), &["line 3"]);
    assert_says(
        &refusal("t;q1\n0;1.5\n1;0,5\n"),
        &["line 3", "'q1'", "'0,5'"],
    );
}

#[test]
fn a_line_of_another_length_is_refused_with_its_number() {
    assert_says(
        &refusal("t,q1\n0,0\n1\n"),
        &["line 3", "1 cells", "header has 2"],
    );
}

#[test]
fn values_that_are_not_finite_are_kept_for_the_check_and_refused_for_a_fit() {
    for (cell, shown) in [
        ("nan", "NaN"),
        ("inf", "inf"),
        ("-Infinity", "-inf"),
        ("", "NaN"),
        ("1e999", "inf"),
    ] {
        let text = format!("t,q1,qd1\n0,0,0\n1,1,{cell}\n2,2,2\n");
        assert!(!read(&text).unwrap().recordings[0].qd[1].is_finite());
        assert_says(
            &conversion_refusal(&text),
            &["sample 2", "'qd1'", shown, "remove"],
        );
    }
    assert_says(
        &conversion_refusal("t,q1\n0,0\nnan,1\n2,2\n"),
        &["sample 2", "'t'", "NaN"],
    );
}

#[test]
fn an_empty_file_a_header_alone_and_one_row_are_refused() {
    assert_says(&refusal(""), &["empty", "0 of the 2 samples"]);
    assert_says(&refusal("t,q1\n"), &["0 of the 2 samples"]);
    assert_says(&conversion_refusal("t,q1\n0,0\n"), &["1 of the 2 samples"]);
    assert!(read_bytes(Format::Npz, Vec::new()).is_err());
}

#[test]
fn times_that_go_back_or_stand_still_are_refused_with_their_place() {
    assert_says(
        &conversion_refusal("t,q1\n0,0\n1,1\n0.5,2\n"),
        &["sample 3", "goes back", "0.5 after 1", "sort"],
    );
    assert_says(
        &conversion_refusal("t,q1\n0,0\n1,1\n1,2\n"),
        &["sample 3", "stands still", "remove repeats"],
    );
}

#[test]
fn a_column_that_names_a_trajectory_a_row_is_refused_before_memory_is_gone() {
    let layout = Layout {
        trajectory: Some("x".into()),
        ..Layout::default()
    };
    let rows: String = (0..5000).map(|k| format!("{k},{k},{k}.5\n")).collect();
    let error = read_with(&format!("t,q1,x\n{rows}"), &layout).unwrap_err();
    assert_says(&error.to_string(), &["'x'", "`trajectory`"]);
}

#[test]
fn values_without_finite_derivatives_are_refused_with_their_place() {
    let rows: String = (0..12)
        .map(|k| format!("{k},{}e308\n", 1.7 * f64::from(k % 2 * 2 - 1)))
        .collect();
    assert_says(
        &conversion_refusal(&format!("t,q1\n{rows}")),
        &["'q1'", "not finite", "remove or repair"],
    );
}

#[test]
fn what_is_quoted_from_a_file_is_short() {
    let long = "k".repeat(5000);
    for text in [
        format!("{long} = 1"),
        format!("angle = {long}"),
        format!("angle = \"{long}"),
        format!("[columns]\n{long} = \"a\""),
    ] {
        let message = Layout::from_toml(&text).unwrap_err().to_string();
        assert!(!message.contains(&"k".repeat(61)), "{message}");
        assert!(message.len() < 1000, "{message}");
    }
    let column = Layout {
        columns: Signals {
            q: vec![long.clone()],
            ..Signals::default()
        },
        ..Layout::default()
    };
    let message = read_with("t,q1\n0,0\n", &column).unwrap_err().to_string();
    assert!(!message.contains(&"k".repeat(61)), "{message}");
}

#[test]
fn an_unknown_extension_lists_the_known_ones() {
    assert_says(
        &Format::from_extension("xlsx").unwrap_err().to_string(),
        &["xlsx", "csv, npz"],
    );
    assert_eq!(Format::from_extension(".CSV").unwrap(), Format::Csv);
}

#[test]
fn the_error_for_a_file_that_python_reads_names_the_line_to_run() {
    for (extension, name, extra) in [
        ("db3", "ROS 2", "ros"),
        ("mcap", "ROS 2", "ros"),
        ("parquet", "Parquet", "parquet"),
    ] {
        let error = Format::from_extension(extension).unwrap_err();
        let line = format!("pip install 'lagrangian[{extra}]'");
        assert_says(&error.to_string(), &[name, &line]);
    }
    let error = Format::from_extension("bag").unwrap_err();
    assert_says(&error.to_string(), &["ROS 1", "rosbags-convert"]);
}

#[test]
fn a_wrong_description_of_the_columns_says_where() {
    assert_says(
        &Layout::from_toml("angel = ['q1']").unwrap_err().to_string(),
        &["angel", "angle"],
    );
    assert!(matches!(
        Layout::from_toml("[columns"),
        Err(Error::Layout(_))
    ));
}

/// Yields the same thousand rows again and again, without holding them all in memory.
struct Endless {
    block: Vec<u8>,
    blocks: usize,
    rest: Cursor<Vec<u8>>,
}

impl Read for Endless {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let count = self.rest.read(buffer)?;
        if count > 0 || self.blocks == 0 {
            return Ok(count);
        }
        self.blocks -= 1;
        self.rest = Cursor::new(self.block.clone());
        self.rest.read(buffer)
    }
}

#[test]
fn ten_million_rows_stream_through_and_only_the_kept_ones_stay() {
    let block: String = (0..1000).map(|k| format!("{k},{}\n", k % 97)).collect();
    let file = Endless {
        block: block.into(),
        blocks: 10_000,
        // Time that goes back to later than these two is a mistake, and no new log.
        rest: Cursor::new(b"t,q1\n-2,0\n-1,0\n".to_vec()),
    };
    let readings = csv::read(
        file,
        "long",
        &Layout {
            every: 1000,
            ..Layout::default()
        },
    )
    .unwrap();
    let recording = &readings.recordings[0];
    assert_eq!(recording.len(), 10_001);
    assert!(recording.t.capacity() < 20_000);
}

fn written(format: Format) -> Vec<u8> {
    let t: Vec<f64> = (0..20).map(f64::from).collect();
    let trajectory = |name: &str| {
        Trajectory::new(
            name,
            t.clone(),
            Signals {
                q: t.clone(),
                qd: t.clone(),
                ..Signals::default()
            },
        )
    };
    let mut bytes = Cursor::new(Vec::new());
    format
        .write(&mut bytes, &[trajectory("a"), trajectory("b")])
        .unwrap();
    bytes.into_inner()
}

fn read_bytes(format: Format, bytes: Vec<u8>) -> Result<Readings> {
    format.read(Cursor::new(bytes), "file", &Layout::default())
}

/// A disk with room for this many bytes.
struct Disk {
    room: usize,
    file: Cursor<Vec<u8>>,
}

impl Write for Disk {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        if self.file.position() as usize + bytes.len() > self.room {
            return Err(std::io::Error::from(std::io::ErrorKind::StorageFull));
        }
        self.file.write(bytes)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.file.flush()
    }
}

impl Seek for Disk {
    fn seek(&mut self, to: SeekFrom) -> std::io::Result<u64> {
        self.file.seek(to)
    }
}

#[test]
fn a_full_disk_is_an_error_in_every_format() {
    let t: Vec<f64> = (0..2000).map(f64::from).collect();
    let whole = Trajectory::new(
        "a",
        t.clone(),
        Signals {
            q: t.clone(),
            qd: t.clone(),
            ..Signals::default()
        },
    );
    for (format, _) in Format::ALL {
        for room in [0, 10, 100, 3_000] {
            let disk = Disk {
                room,
                file: Cursor::new(Vec::new()),
            };
            let error = format
                .write(disk, std::slice::from_ref(&whole))
                .unwrap_err();
            assert!(
                matches!(error, Error::Io(_)),
                "{format:?} {room}: {error:?}"
            );
        }
    }
}

#[test]
fn an_array_that_claims_more_than_the_archive_holds_is_refused() {
    let bytes = written(Format::Npz);
    for (from, to) in [
        ("(40,)", "(9999999999,)"),
        ("(40, 1,)", "(4, 9999999999999999999,)"),
        ("(40, 1,)", "(4294967296, 4294967296,)"),
    ] {
        // The header is padded with blanks, so that a longer shape fits.
        let mut damaged = bytes.clone();
        let at = damaged
            .windows(from.len())
            .rposition(|w| w == from.as_bytes())
            .unwrap();
        damaged[at..at + to.len()].copy_from_slice(to.as_bytes());
        let error = read_bytes(Format::Npz, damaged).unwrap_err();
        println!("{error}");
    }
}

#[test]
fn a_truncated_archive_is_refused() {
    let bytes = written(Format::Npz);
    for keep in 0..bytes.len() {
        assert!(read_bytes(Format::Npz, bytes[..keep].to_vec()).is_err());
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_damaged_file_never_panics(
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..8),
    ) {
        let mut bytes = written(Format::Npz);
        for (at, value) in &changes {
            let at = at.index(bytes.len());
            bytes[at] = *value;
        }
        let _ = read_bytes(Format::Npz, bytes);
    }

    #[test]
    fn bytes_of_any_kind_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        for (format, _) in Format::ALL {
            let _ = read_bytes(format, bytes.clone());
        }
    }

    #[test]
    fn text_of_any_kind_never_panics(text in "t,q1,qd1\n([0-9einaf.,\"\n;-]{0,60}\n){0,8}") {
        if let Ok(readings) = read(&text) {
            let report = lagrangian_recordings::check::check(&readings.recordings, &CheckOptions::default());
            prop_assert!(!report.passed() || !report.items.is_empty());
            for recording in readings.recordings {
                let _ = recording.into_trajectory(&EstimateOptions::default());
            }
        }
    }
}
