//! Parquet files that claim more than they hold are refused before memory is allocated.
#![cfg(feature = "parquet")]
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::io::Cursor;

use lagrangian_motion::{Result, Signals, Trajectory};
use lagrangian_recordings::{Format, Layout, Readings};

fn read(bytes: Vec<u8>) -> Result<Readings> {
    Format::Parquet.read(Cursor::new(bytes), "file", &Layout::default())
}

fn refusal(bytes: Vec<u8>) -> String {
    read(bytes).unwrap_err().to_string()
}

/// Two motions of one coordinate, so that the file has a column of names.
fn file() -> Vec<u8> {
    let motion = |name: &str| {
        let t: Vec<f64> = (0..40).map(|k| 0.1 * f64::from(k)).collect();
        let q = t.iter().map(|t| t.sin()).collect();
        let signals = Signals {
            q,
            ..Signals::default()
        };
        Trajectory::new(name, t, signals)
    };
    let mut file = Cursor::new(Vec::new());
    Format::Parquet
        .write(&mut file, &[motion("one"), motion("two")])
        .unwrap();
    file.into_inner()
}

/// A number with its sign in the lowest bit.
fn integer(value: i64) -> Vec<u8> {
    number((value << 1 ^ value >> 63).cast_unsigned())
}

/// The lowest seven bits first.
fn number(mut left: u64) -> Vec<u8> {
    let mut bytes = Vec::new();
    while left > 0x7f {
        bytes.push(left as u8 | 0x80);
        left >>= 7;
    }
    bytes.push(left as u8);
    bytes
}

/// An `i32` field after the last one.
fn field(value: i64) -> Vec<u8> {
    [vec![0x15], integer(value)].concat()
}

/// The header of a page of these numbers of bytes in the file and in memory, with this structure of its kind as field 5, 7 or 8.
fn header(kind: i64, unpacked: i64, packed: i64, id: u8, inner: &[u8]) -> Vec<u8> {
    let sizes = [field(kind), field(unpacked), field(packed)].concat();
    let begin = (id - 3) << 4 | 12;
    [&sizes[..], &[begin], inner, &[0, 0]].concat()
}

/// A file whose first page has this header: the column of the names, which has a dictionary.
fn with_first_header(header: &[u8]) -> Vec<u8> {
    let mut bytes = file();
    bytes[4..4 + header.len()].copy_from_slice(header);
    bytes
}

#[test]
fn a_good_file_is_read() {
    let readings = read(file()).unwrap();
    let names: Vec<&str> = readings.recordings.iter().map(|r| &*r.name).collect();
    assert_eq!(names, ["one", "two"]);
    // The part that the tests below change: the page of the dictionary, kind 2, begins after the magic bytes.
    assert_eq!(file()[4..6], field(2));
}

#[test]
fn a_dictionary_of_more_values_than_its_bytes_can_hold_takes_no_memory() {
    let dictionary = |values: i64| [field(values), field(0)].concat();
    for values in [100_000_000, i64::from(i32::MAX), -1] {
        let header = header(2, 14, 16, 7, &dictionary(values));
        let message = refusal(with_first_header(&header));
        let parts = [
            "'trajectory'",
            "more values than its bytes can hold",
            "write it again",
        ];
        assert!(parts.iter().all(|part| message.contains(part)), "{message}");
    }
}

#[test]
fn a_page_that_claims_to_unpack_to_gigabytes_takes_no_memory() {
    let data = [field(80), field(8), field(3), field(3)].concat();
    let message = refusal(with_first_header(&header(0, 2_000_000_000, 16, 5, &data)));
    assert!(
        message.contains("more values than its bytes can hold"),
        "{message}"
    );
    let message = refusal(with_first_header(&header(0, 14, 2_000_000_000, 5, &data)));
    assert!(
        message.contains("more bytes than the column has"),
        "{message}"
    );
}

#[test]
fn text_that_is_written_as_differences_is_refused_by_its_encoding() {
    let data = [field(80), field(6), field(3), field(3)].concat();
    let message = refusal(with_first_header(&header(0, 14, 16, 5, &data)));
    let parts = ["'trajectory'", "as differences", "plain"];
    assert!(parts.iter().all(|part| message.contains(part)), "{message}");
}

#[test]
fn a_field_of_another_type_or_out_of_order_is_a_damaged_header() {
    // The size as text of one letter; the size twice.
    let text = [&field(2)[..], &[0x18, 1, b'a'], &field(16), &[0, 0]].concat();
    let twice = [
        field(2),
        field(14),
        vec![0x05],
        integer(2),
        integer(1 << 30),
        vec![0, 0],
    ]
    .concat();
    for header in [text, twice] {
        let message = refusal(with_first_header(&header));
        assert!(message.contains("damaged header"), "{message}");
    }
}

/// A file that consists of a footer: this many groups of columns within each other.
fn nested(depth: usize) -> Vec<u8> {
    let group = [&[0x48, 1, b'g', 0x15][..], &integer(1), &[0]].concat();
    let list = [vec![0x19, 0xfc], number(depth as u64)].concat();
    let footer = [field(1), list, group.repeat(depth), vec![0]].concat();
    let length = (footer.len() as u32).to_le_bytes();
    [b"PAR1", &footer[..], &length, b"PAR1"].concat()
}

#[test]
fn columns_within_columns_do_not_exhaust_the_stack() {
    let message = refusal(nested(200_000));
    assert!(message.contains("nested more than 64 deep"), "{message}");
}

#[test]
fn a_footer_longer_than_the_file_or_than_any_is_refused() {
    for length in [1_u32 << 20, u32::MAX] {
        let bytes = [&b"PAR1"[..], &length.to_le_bytes(), b"PAR1"].concat();
        let message = refusal(bytes);
        assert!(message.contains("footer claims"), "{message}");
    }
}

/// A field of a structure, `skipped` numbers after the last one: its type and its bytes.
fn after(skipped: u8, kind: u8, bytes: impl AsRef<[u8]>) -> Vec<u8> {
    [&[skipped << 4 | kind], bytes.as_ref()].concat()
}

fn text(text: &str) -> Vec<u8> {
    [number(text.len() as u64), text.into()].concat()
}

/// A list of structures.
fn structures(all: &[Vec<u8>]) -> Vec<u8> {
    let ended: Vec<u8> = all
        .iter()
        .flat_map(|one| [&one[..], &[0]].concat())
        .collect();
    [vec![(all.len() as u8) << 4 | 12], ended].concat()
}

/// A file of the columns t and q1 of doubles, a plain page each, whose headers have these checksums.
fn with_checksums(checksum: impl Fn(&[u8]) -> u32) -> Vec<u8> {
    const ROWS: i64 = 20;
    let mut bytes = b"PAR1".to_vec();
    let mut chunks = Vec::new();
    for name in ["t", "q1"] {
        let values = (0..ROWS).flat_map(|k| (0.1 * k as f64).to_le_bytes());
        let page: Vec<u8> = values.collect();
        let size = page.len() as i64;
        let data = [field(ROWS), field(0), field(3), field(3), vec![0]].concat();
        let crc = i64::from(checksum(&page).cast_signed());
        let header = [
            field(0),
            field(size),
            field(size),
            field(crc),
            after(1, 12, data),
            vec![0],
        ];
        let (begin, header) = (bytes.len() as i64, header.concat());
        let whole = header.len() as i64 + size;
        bytes.extend([header, page].concat());
        let encodings = [vec![0x15], integer(0)].concat();
        let path = [&[0x18][..], &text(name)].concat();
        let about = [
            field(5),
            after(1, 9, encodings),
            after(1, 9, path),
            field(0),
            after(1, 6, integer(ROWS)),
            after(1, 6, integer(whole)),
            after(1, 6, integer(whole)),
            after(2, 6, integer(begin)),
            vec![0],
        ];
        chunks.push([after(2, 6, integer(begin)), after(1, 12, about.concat())].concat());
    }
    let column = |name: &str| [field(5), after(2, 5, integer(0)), after(1, 8, text(name))].concat();
    let root = [after(4, 8, text("schema")), after(1, 5, integer(2))].concat();
    let group = [
        after(1, 9, structures(&chunks)),
        after(1, 6, integer(bytes.len() as i64)),
        after(1, 6, integer(ROWS)),
    ];
    let footer = [
        field(1),
        after(1, 9, structures(&[root, column("t"), column("q1")])),
        after(1, 6, integer(ROWS)),
        after(1, 9, structures(&[group.concat()])),
        vec![0],
    ];
    let footer = footer.concat();
    let length = (footer.len() as u32).to_le_bytes();
    [&bytes[..], &footer, &length, b"PAR1"].concat()
}

#[test]
fn a_page_whose_checksum_is_another_is_refused() {
    let good = read(with_checksums(crc32fast::hash)).unwrap();
    assert_eq!(good.recordings[0].len(), 20);
    let message = refusal(with_checksums(|page| crc32fast::hash(page) ^ 1));
    assert!(message.contains("checksum"), "{message}");
}
