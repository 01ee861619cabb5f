//! Checks of sizes that a file claims against its contents, before decoders allocate memory.
//!
//! Source: Apache Parquet, `parquet.thrift` (`FileMetaData`, `SchemaElement`, `PageHeader`).

use std::io::{self, BufReader, Read, Seek};

use parquet::basic::{Compression, Type};
use parquet::file::metadata::{ColumnChunkMetaData, ParquetMetaData};

use super::super::npz::{PACKING, UNPACKED, WIDEST};
use super::super::shared::Shared;
use super::malformed;
use super::thrift::{Known, Wire, damaged, walk};
use lagrangian_motion::Result;

/// Longest footer, bytes. Decoders allocate some hundred times as much.
const FOOTER: u64 = 16 << 20;
/// Largest nesting of groups of columns, which decoders follow by recursion.
const DEEPEST: usize = 64;
/// Largest ratio of Snappy: three bytes unpack to at most 64.
const SNAPPY: u64 = 22;
/// Encodings of text whose decoders allocate memory for as many values as their data claim.
const DIFFERENCES: [i32; 2] = [6, 7];
/// Type of a page that holds a dictionary.
const DICTIONARY: i32 = 2;

/// Checks the footer before it is decoded.
pub(super) fn check_footer<R: Read + Seek>(shared: &Shared<R>) -> Result<()> {
    // Magic bytes, and the footer with its length at the end of the file: the decoder refuses shorter files.
    let Some(end) = shared.size.checked_sub(8) else {
        return Ok(());
    };
    let mut length = [0; 4];
    shared.at(end).read_exact(&mut length)?;
    let length = u64::from(u32::from_le_bytes(length));
    if length > FOOTER.min(end) {
        return Err(malformed(format!(
            "its footer claims {length} bytes of the {} of the file, and may have {FOOTER}: write it again, in fewer groups of rows",
            shared.size
        )));
    }
    let footer = BufReader::new(shared.at(end - length)).take(length);
    let unreadable = |_| {
        malformed(format!(
            "its footer is damaged, or has columns that are nested more than {DEEPEST} deep: write it again"
        ))
    };
    walk(footer, &mut Schema::default()).map_err(unreadable)
}

/// Nesting of the columns of a footer.
#[derive(Default)]
struct Schema {
    children: i32,
    /// Number of columns still to come, in each open group.
    open: Vec<i32>,
}

impl Known for Schema {
    fn wire(&self, path: &[i16]) -> Option<Wire> {
        Some(match path {
            [1] | [2, 1..=3 | 5..=9] | [2, 10, 5, 1 | 2] | [2, 10, 18, 2] => Wire::Integer,
            [2] => Wire::List,
            [2, 4] | [2, 10, 17 | 18, 1] => Wire::Text,
            [2, 10] | [2, 10, _] | [2, 10, 7 | 8, 2] => Wire::Structure,
            [2, 10, 7 | 8, 1] | [2, 10, 10, 2] => Wire::Bool,
            [2, 10, 10 | 16, 1] => Wire::Byte,
            _ => return None,
        })
    }

    fn integer(&mut self, path: &[i16], value: i32) {
        if path == [2, 5] {
            self.children = value;
        }
    }

    fn end(&mut self, path: &[i16]) -> io::Result<()> {
        if path != [2] {
            return Ok(());
        }
        if let Some(left) = self.open.last_mut() {
            *left -= 1;
        }
        let children = std::mem::take(&mut self.children);
        if children > 0 {
            self.open.push(children);
        }
        while self.open.last() == Some(&0) {
            self.open.pop();
        }
        match self.open.len() > DEEPEST {
            true => Err(damaged()),
            false => Ok(()),
        }
    }
}

/// Checks that no page of a list column claims more values than lists of rows can have: decoders allocate memory for them.
pub(super) fn check_lists<R: Read + Seek>(
    shared: &Shared<R>,
    metadata: &ParquetMetaData,
    lists: &[usize],
) -> Result<()> {
    check_rows(metadata, lists.len(), shared.size)?;
    let groups = metadata.row_groups().iter();
    for (group, &leaf) in groups.flat_map(|group| lists.iter().map(move |leaf| (group, leaf))) {
        let rows = u64::try_from(group.num_rows()).unwrap_or(0);
        let chunk = group.column(leaf);
        let name = chunk.column_path().string();
        check_place(chunk, &name)?;
        let most = rows.saturating_mul(WIDEST as u64).min(UNPACKED / 8);
        let checked = check_chunk(shared, chunk, &name)?;
        if checked.values > most {
            return Err(malformed(format!(
                "column '{name}' claims {} numbers for {rows} rows, at most {most} are read: write it again, in smaller groups of rows",
                checked.values
            )));
        }
    }
    Ok(())
}

/// Checks all pages of the columns `used`; returns the size of the largest dictionary of text, bytes.
pub(super) fn check_pages<R: Read + Seek>(
    shared: &Shared<R>,
    metadata: &ParquetMetaData,
    used: &[usize],
) -> Result<u64> {
    check_rows(metadata, used.len(), shared.size)?;
    let groups = metadata.row_groups().iter();
    let chunks = groups.flat_map(|group| used.iter().map(|&column| group.column(column)));
    let (mut left, mut dictionary) = (shared.size, 0);
    for chunk in chunks {
        let name = chunk.column_path().string();
        check_place(chunk, &name)?;
        let claimed = chunk.byte_range().1;
        left = left.checked_sub(claimed).ok_or_else(|| {
            malformed(format!(
                "with column '{name}' its columns claim more than its {} bytes: write it again",
                shared.size
            ))
        })?;
        dictionary = dictionary.max(check_chunk(shared, chunk, &name)?.dictionary);
    }
    Ok(dictionary)
}

/// Bounds the number of rows: a file of equal values can claim any number, and each row takes time.
fn check_rows(metadata: &ParquetMetaData, columns: usize, size: u64) -> Result<()> {
    let groups = metadata.row_groups().iter();
    let rows = groups.fold(0, |rows: i64, group| rows.saturating_add(group.num_rows()));
    let rows = u64::try_from(rows).unwrap_or(u64::MAX);
    let limit = UNPACKED.max(size.saturating_mul(PACKING));
    match rows.saturating_mul(8 * columns as u64) > limit {
        true => Err(malformed(format!(
            "with {rows} rows of {columns} columns it unpacks to more than {limit} bytes: the file is damaged, or is no motion"
        ))),
        false => Ok(()),
    }
}

/// Refuses negative offsets and sizes, on which the decoder panics.
fn check_place(chunk: &ColumnChunkMetaData, name: &str) -> Result<()> {
    let start = chunk.dictionary_page_offset().unwrap_or(0);
    let least = start
        .min(chunk.data_page_offset())
        .min(chunk.compressed_size());
    match least < 0 {
        true => Err(malformed(format!(
            "column '{name}' begins before the file, or has a negative length: write it again"
        ))),
        false => Ok(()),
    }
}

/// Totals over the pages of a column.
#[derive(Default)]
struct Checked {
    /// Size of its dictionary of text, bytes.
    dictionary: u64,
    /// Number of its values.
    values: u64,
}

/// Checks the pages of a column.
fn check_chunk<R: Read + Seek>(
    shared: &Shared<R>,
    chunk: &ColumnChunkMetaData,
    name: &str,
) -> Result<Checked> {
    let packing = match chunk.compression() {
        Compression::UNCOMPRESSED => 1,
        Compression::SNAPPY => SNAPPY,
        other => {
            return Err(malformed(format!(
                "column '{name}' is compressed with {other}: write it with Snappy, or without compression"
            )));
        }
    };
    let is_text = chunk.column_type() == Type::BYTE_ARRAY;
    let (mut at, mut left) = chunk.byte_range();
    let mut checked = Checked::default();
    while left > 0 {
        let mut page = Page::default();
        let mut header = BufReader::new(shared.at(at)).take(left);
        let broken =
            |what: &str| malformed(format!("a page of column '{name}' {what}: write it again"));
        walk(&mut header, &mut page).map_err(|_| broken("has a damaged header"))?;
        let length = left - header.limit();
        let size = page.size(left - length, packing).map_err(broken)?;
        if page.kind == DICTIONARY && is_text {
            checked.dictionary = checked.dictionary.max(size);
        }
        checked.values += u64::from(page.held.unsigned_abs());
        if is_text && page.encodings.iter().any(|code| DIFFERENCES.contains(code)) {
            return Err(malformed(format!(
                "the text of column '{name}' is written as differences: write it plain, or with a dictionary"
            )));
        }
        let whole = length + u64::from(page.packed.unsigned_abs());
        (at, left) = (at + whole, left - whole);
    }
    Ok(checked)
}

/// Sizes in the header of a page.
#[derive(Default)]
struct Page {
    kind: i32,
    /// Number of bytes of its values.
    unpacked: i32,
    /// Number of bytes in the file.
    packed: i32,
    /// Number of values in its dictionary.
    values: i32,
    /// Number of values that it holds.
    held: i32,
    encodings: Vec<i32>,
}

impl Page {
    /// The number of bytes that it needs in memory, if that is possible for its bytes in the file; else a message.
    fn size(&self, left: u64, packing: u64) -> std::result::Result<u64, &'static str> {
        let packed = u64::try_from(self.packed).unwrap_or(u64::MAX);
        let unpacked = u64::try_from(self.unpacked).unwrap_or(u64::MAX);
        if packed > left {
            return Err("claims more bytes than the column has");
        }
        if packing > 1 && unpacked > packed.saturating_mul(packing) {
            return Err("claims more values than its bytes can hold");
        }
        let size = match packing {
            1 => packed,
            _ => unpacked.max(packed),
        };
        // The shortest value in a dictionary has four bytes.
        match u64::try_from(self.values).is_ok_and(|values| values <= size / 4) {
            true => Ok(size),
            false => Err("claims more values than its bytes can hold"),
        }
    }
}

impl Known for Page {
    fn wire(&self, path: &[i16]) -> Option<Wire> {
        Some(match path {
            [1..=4] | [5, 1..=4] | [7, 1 | 2] | [8, 1..=6] => Wire::Integer,
            [5..=8] => Wire::Structure,
            [7, 3] | [8, 7] => Wire::Bool,
            _ => return None,
        })
    }

    fn integer(&mut self, path: &[i16], value: i32) {
        match path {
            [1] => self.kind = value,
            [2] => self.unpacked = value,
            [3] => self.packed = value,
            [7, 1] => self.values = value,
            [5 | 8, 1] => self.held = value,
            [5 | 7, 2] | [8, 4] => self.encodings.push(value),
            _ => {}
        }
    }
}
