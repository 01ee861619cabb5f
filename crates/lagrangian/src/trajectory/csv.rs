//! CSV: a header, then one sample a line.

use std::cell::Cell;
use std::io::{self, BufRead, BufReader, BufWriter, Read, Write};

use super::columns::resolve;
use super::contents::Contents;
use super::rows::Rows;
use super::{Layout, Readings, Trajectory};
use crate::error::shortened;
use crate::{Error, Result};

/// The longest row that is read, bytes: what is no table cannot fill the memory.
const MAX_ROW: usize = 1 << 22;

/// Bytes that the reader takes at a time.
const CHUNK: usize = 1 << 16;

const BYTE_ORDER_MARK: &[u8] = "\u{feff}".as_bytes();

/// Reads the recordings of a CSV text (comma, semicolon or tab between columns, whichever the header uses most).
///
/// Empty cells, `nan` and `inf` are kept as values that are not finite, so that `check` can show them.
///
/// # Errors
/// [`Error::Columns`], [`Error::Cell`] with its line, [`Error::Malformed`] for lines of another length or other
/// text than UTF-8, [`Error::TooShort`] if there is no row.
pub fn read(source: impl Read, name: &str, layout: &Layout) -> Result<Readings> {
    let unread = Cell::new(0);
    let plain = PlainLines {
        source,
        returned: false,
        unread: &unread,
    };
    let mut source = BufReader::with_capacity(CHUNK, plain);
    let start = source.fill_buf()?;
    if let Some(other) = other_format(start) {
        return Err(not_csv(other));
    }
    let delimiter = delimiter(start);
    let mut reader = csv::ReaderBuilder::new()
        .delimiter(delimiter)
        .flexible(true)
        .trim(csv::Trim::All)
        .from_reader(source);
    let headers = reader.headers().map_err(malformed)?;
    let mut headers: Vec<String> = headers.iter().map(String::from).collect();
    if let Some(first) = headers.first_mut() {
        *first = first.trim_start_matches('\u{feff}').trim().into();
        name_unnamed(&mut headers);
    } else {
        return Err(Error::too_short(
            format!("file '{name}' (it is empty, without even a header)"),
            0,
            2,
        ));
    }
    let resolved = resolve(&headers, layout)?;
    let (numbers, trajectory) = (resolved.numbers.clone(), resolved.trajectory);
    let mut rows = Rows::new(resolved, name);
    let mut record = csv::StringRecord::new();
    let mut values = vec![0.0; numbers.len()];
    while reader.read_record(&mut record).map_err(malformed)? {
        unread.set(0);
        // The record's own position stands before the blank lines that were skipped.
        let start = record.position().map_or(0, csv::Position::line);
        let line = start.max(reader.position().line().saturating_sub(1));
        check_length(&record, headers.len(), line)?;
        for (value, &column) in values.iter_mut().zip(&numbers) {
            *value = number(&record, column, &headers, line)?;
        }
        rows.push(trajectory.and_then(|at| record.get(at)), &mut values)?;
    }
    rows.finish()
}

/// What begins with these bytes, and is no text of a table: what to do with it.
fn other_format(start: &[u8]) -> Option<&'static str> {
    let known: [(&[u8], &str); 8] = [
        (
            b"\x1f\x8b",
            "it is compressed with gzip: unpack it with `gunzip`",
        ),
        (
            b"\x28\xb5\x2f\xfd",
            "it is compressed with zstd: unpack it with `zstd -d`",
        ),
        (b"\xff\xfe", UTF_16),
        (b"\xfe\xff", UTF_16),
        (
            b"PK\x03\x04",
            "it is a zip archive: name it .npz if NumPy wrote it, or unpack it",
        ),
        (b"PAR1", "it is a Parquet file: name it .parquet"),
        (
            b"SQLite format 3",
            "it is an SQLite database: name it .db3 if it is a bag",
        ),
        (b"\x89MCAP", "it is an MCAP file: name it .mcap"),
    ];
    let found = known
        .into_iter()
        .find(|(magic, _)| start.starts_with(magic));
    let wide = || start.contains(&0).then_some(UTF_16);
    found.map(|(_, remedy)| remedy).or_else(wide)
}

const UTF_16: &str =
    "it holds zero bytes, as UTF-16 text does: convert it with `iconv -f UTF-16 -t UTF-8`";

fn not_csv(reason: impl Into<String>) -> Error {
    Error::malformed("CSV", reason.into())
}

/// Columns without a name get one that says where they are.
fn name_unnamed(headers: &mut [String]) {
    for (number, header) in (1..).zip(headers) {
        if header.is_empty() {
            *header = format!("(column {number}, without a name)");
        }
    }
}

/// Refuses a row of another length than the header.
fn check_length(record: &csv::StringRecord, expected: usize, line: u64) -> Result<()> {
    let len = record.len();
    if len == expected {
        return Ok(());
    }
    let remedy = if len == expected + 1 && record.iter().next_back() == Some("") {
        "end the header with a separator as well, or none of the rows"
    } else if (expected + 1..=2 * expected).contains(&len) {
        "complete or remove it; if its numbers have decimal commas, write points"
    } else {
        "complete or remove it"
    };
    Err(not_csv(format!(
        "line {line} has {len} cells where the header has {expected}: {remedy}"
    )))
}

/// Writes every line end as `\n`, also those of Windows and of old Macs, so that lines are counted alike wherever the file was
/// written, and ends a row that does not.
struct PlainLines<'a, R> {
    source: R,
    /// Whether the last byte was a carriage return, whose line end is still to be written.
    returned: bool,
    /// Bytes since the last row was complete.
    unread: &'a Cell<usize>,
}

impl<R: Read> Read for PlainLines<'_, R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if self.unread.get() > MAX_ROW {
            return Err(io::Error::new(
                io::ErrorKind::InvalidData,
                "a row of more than 4 MB: is it a CSV file, and is each quote closed?",
            ));
        }
        // A line end that is due needs a place of its own.
        let Some(room) = buffer.len().checked_sub(1) else {
            return Ok(0);
        };
        loop {
            let count = self.source.read(&mut buffer[1..=room])?;
            self.unread.set(self.unread.get() + count);
            let kept = self.plain(buffer, count);
            if kept > 0 || count == 0 {
                return Ok(kept);
            }
        }
    }
}

impl<R> PlainLines<'_, R> {
    /// Moves `count` bytes from the second place to the first, with plain line ends; returns how many they become.
    fn plain(&mut self, buffer: &mut [u8], count: usize) -> usize {
        let mut kept = 0;
        for i in 1..=count {
            let byte = buffer[i];
            if byte == b'\r' {
                self.returned = true;
                continue;
            }
            if std::mem::take(&mut self.returned) && byte != b'\n' {
                buffer[kept] = b'\n';
                kept += 1;
            }
            buffer[kept] = byte;
            kept += 1;
        }
        if count == 0 && std::mem::take(&mut self.returned) {
            buffer[kept] = b'\n';
            kept += 1;
        }
        kept
    }
}

/// What separates the columns of a CSV text: a comma, a semicolon or a tab, whichever stands most often between the names of its header.
/// What stands in quotes separates nothing.
#[must_use]
pub fn delimiter(start: &[u8]) -> u8 {
    // The last of equals is taken, so the comma stands last.
    let mut counts = [(b'\t', 0), (b';', 0), (b',', 0)];
    // A quote opens where a name begins, and after one that closed: two of them stand for one.
    let (mut quoted, mut opens) = (false, true);
    for &byte in start.strip_prefix(BYTE_ORDER_MARK).unwrap_or(start) {
        match byte {
            b'"' => (quoted, opens) = (!quoted && opens, quoted),
            b'\n' if !quoted => break,
            _ if quoted => {}
            _ => {
                let own = counts.iter_mut().find(|(separator, _)| *separator == byte);
                opens = own.is_some();
                own.into_iter().for_each(|(_, count)| *count += 1);
            }
        }
    }
    let most = counts.into_iter().max_by_key(|(_, count)| *count);
    most.map_or(b',', |(separator, _)| separator)
}

fn number(record: &csv::StringRecord, column: usize, headers: &[String], line: u64) -> Result<f64> {
    let text = record.get(column).unwrap_or_default();
    if text.is_empty() {
        return Ok(f64::NAN);
    }
    text.parse().map_err(|_| {
        let column = headers[column].clone();
        let comma = text.contains(',') && text.replacen(',', ".", 1).parse::<f64>().is_ok();
        if text.contains('\n') {
            let line = record.position().map_or(line, csv::Position::line);
            return not_csv(format!(
                "line {line}, column '{column}': a quote is opened and not closed in that row"
            ));
        }
        let text = shortened(text);
        match comma {
            true => Error::DecimalComma { line, column, text },
            false => Error::Cell { line, column, text },
        }
    })
}

fn malformed(error: csv::Error) -> Error {
    let reason = match error.kind() {
        csv::ErrorKind::Utf8 { pos, .. } => {
            let line = pos.as_ref().map_or(0, csv::Position::line);
            format!("line {line} is not UTF-8 text: is it a CSV file?")
        }
        _ => error.to_string(),
    };
    match error.into_kind() {
        csv::ErrorKind::Io(error) => Error::Io(error),
        _ => not_csv(reason),
    }
}

/// Writes trajectories with the default header names; the shortest digits that read back to the same bits.
///
/// A column `trajectory` is written where there are several.
///
/// # Errors
/// [`Error::Io`]; [`Error::Shape`] if their degrees of freedom or signals differ.
pub fn write(sink: impl Write, trajectories: &[Trajectory]) -> Result<()> {
    write_contents(sink, &Contents::of_motions(trajectories)?)
}

/// Writes a header and a line for each row.
pub(super) fn write_contents(sink: impl Write, contents: &Contents) -> Result<()> {
    let mut sink = BufWriter::new(sink);
    let headers: Vec<String> = contents.headers().iter().map(|h| quoted(h)).collect();
    writeln!(sink, "{}", headers.join(","))?;
    for (i, (name, rows)) in contents.trajectories.iter().enumerate() {
        let name = match contents.is_of_several() {
            true => quoted(name) + ",",
            false => String::new(),
        };
        for k in 0..*rows {
            write!(sink, "{name}")?;
            let mut separator = "";
            for x in contents.row(i, k) {
                write!(sink, "{separator}{}", Shortest(x))?;
                separator = ",";
            }
            writeln!(sink)?;
        }
    }
    Ok(sink.flush()?)
}

/// The shortest text that reads back to the same bits, with an exponent where that is shorter to read.
struct Shortest(f64);

impl std::fmt::Display for Shortest {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let size = self.0.abs();
        if size == 0.0 || (1e-5..1e16).contains(&size) || !size.is_finite() {
            write!(f, "{}", self.0)
        } else {
            write!(f, "{:e}", self.0)
        }
    }
}

fn quoted(name: &str) -> String {
    if name.contains([',', '"', '\n', '\r', ';', '\t']) || name.trim() != name {
        format!("\"{}\"", name.replace('"', "\"\""))
    } else {
        name.into()
    }
}
