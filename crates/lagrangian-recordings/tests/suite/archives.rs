//! Archives of arrays: an unreadable array is an error if it is requested, and is listed otherwise.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::io::{Cursor, Write};

use lagrangian_motion::{Result, Signals};
use lagrangian_recordings::{Format, Layout, Readings};
use zip::ZipWriter;
use zip::write::SimpleFileOptions;

/// Number of rows of every array.
const ROWS: usize = 20;

/// An array in the format of `NumPy`.
fn array(descr: &str, shape: &str, elements: &[u8]) -> Vec<u8> {
    let text = format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': {shape}, }}");
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend(u16::try_from(text.len()).unwrap().to_le_bytes());
    bytes.extend(text.as_bytes());
    bytes.extend(elements);
    bytes
}

/// Numbers in double precision: `values` for each row.
fn numbers(shape: &str, values: usize, value: impl Fn(usize) -> f64) -> Vec<u8> {
    let elements = (0..ROWS * values).flat_map(|k| value(k).to_le_bytes());
    array("<f8", shape, &elements.collect::<Vec<u8>>())
}

fn archive(entries: &[(&str, Vec<u8>)]) -> Vec<u8> {
    let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
    let stored = SimpleFileOptions::default().compression_method(zip::CompressionMethod::Stored);
    for (name, bytes) in entries {
        archive.start_file(*name, stored).unwrap();
        archive.write_all(bytes).unwrap();
    }
    archive.finish().unwrap().into_inner()
}

fn read(bytes: Vec<u8>, layout: &Layout) -> Result<Readings> {
    Format::Npz.read(Cursor::new(bytes), "log", layout)
}

/// Time, one coordinate, and another entry.
fn motion_with(name: &'static str, bytes: Vec<u8>) -> Vec<u8> {
    archive(&[
        ("t.npy", numbers("(20,)", 1, |k| k as f64)),
        ("q.npy", numbers("(20, 1)", 1, |k| 0.5 * k as f64)),
        (name, bytes),
    ])
}

/// Types and shapes that cannot be read, with the text of the message.
fn unreadable() -> [(Vec<u8>, &'static str); 4] {
    [
        (array("|O", "(20,)", b"pickled"), "object"),
        (array("<f2", "(20, 1)", &[0; 40]), "float16"),
        (array("<f8", "(20, 1, 1)", &[0; 160]), "3 axes"),
        (b"no array at all".to_vec(), "not a NumPy array"),
    ]
}

#[test]
fn forces_that_cannot_be_read_are_an_error_and_no_free_motion() {
    for (bytes, what) in unreadable() {
        for name in ["tau.npy", "tau1.npy", "trajectory.npy"] {
            let error = read(motion_with(name, bytes.clone()), &Layout::default()).unwrap_err();
            let (error, array) = (error.to_string(), name.trim_end_matches(".npy"));
            let named = error.contains(&format!("array '{array}'"));
            assert!(named && error.contains(what), "{name}: {error}");
        }
        let layout = Layout {
            columns: Signals {
                tau: vec!["torque".into()],
                ..Signals::default()
            },
            ..Layout::default()
        };
        let error = read(motion_with("torque.npy", bytes), &layout).unwrap_err();
        assert!(error.to_string().contains(what), "{error}");
    }
}

#[test]
fn what_is_not_used_is_named_with_its_reason() {
    for (bytes, what) in unreadable() {
        let readings = read(motion_with("labels.npy", bytes), &Layout::default()).unwrap();
        let [unused] = &readings.columns.ignored[..] else {
            panic!("{:?}", readings.columns.ignored);
        };
        assert!(
            unused.contains("labels") && unused.contains(what),
            "{unused}"
        );
        assert_eq!(readings.recordings[0].len(), ROWS);
    }
    let readme = read(
        motion_with("readme.txt", b"text".to_vec()),
        &Layout::default(),
    )
    .unwrap();
    assert!(readme.columns.ignored[0].contains("readme.txt"));
}

#[test]
fn a_flipped_bit_is_found_by_the_checksum() {
    let good = motion_with("unused.npy", numbers("(20,)", 1, |_| 7.0));
    assert!(read(good.clone(), &Layout::default()).is_ok());
    let value = 8.5_f64.to_le_bytes();
    let at = good.windows(8).position(|w| w == value).unwrap();
    let mut damaged = good;
    damaged[at + 6] ^= 1;
    let error = read(damaged, &Layout::default()).unwrap_err().to_string();
    assert!(
        error.contains("checksum") && error.contains("damaged"),
        "{error}"
    );
}

#[test]
fn an_array_of_another_size_than_its_entry_is_refused() {
    for elements in [152, 168] {
        let bytes = motion_with("tau.npy", array("<f8", "(20, 1)", &vec![0; elements]));
        let error = read(bytes, &Layout::default()).unwrap_err().to_string();
        assert!(error.contains("array 'tau'"), "{error}");
    }
}

#[test]
fn time_may_be_an_array_of_one_column() {
    let of_time = |shape, values| {
        archive(&[
            ("time.npy", numbers(shape, values, |k| k as f64)),
            ("q.npy", numbers("(20, 2)", 2, |k| k as f64)),
        ])
    };
    let layout = Layout {
        t: Some("time".into()),
        ..Layout::default()
    };
    let readings = read(of_time("(20, 1)", 1), &layout).unwrap();
    assert!((readings.recordings[0].t[19] - 19.0).abs() < 1e-12);
    let error = read(of_time("(20, 2)", 2), &layout)
        .unwrap_err()
        .to_string();
    assert!(error.contains("'time' has 2 columns"), "{error}");
}
