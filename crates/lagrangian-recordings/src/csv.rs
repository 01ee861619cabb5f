//! CSV: a header, then one sample a line.

use std::cell::Cell;
use std::io::{self, BufRead, BufReader, BufWriter, Cursor, Read, Write};

use super::columns::resolve;
use super::contents::Contents;
use super::dialect::{Dialect, with_point};
use super::encoding::{Decoded, Encoding};
use super::rows::Rows;
use super::{Layout, Readings};
use lagrangian_motion::Trajectory;
use lagrangian_motion::error::{brief, counted, shortened};
use lagrangian_motion::{Error, Result};

pub use super::programs::{coordinates, time};

/// Longest row that is read, bytes: input that is not a table cannot fill the memory.
const MAX_ROW: usize = 1 << 22;

/// Bytes that the reader takes at a time.
const CHUNK: usize = 1 << 16;

/// Reads the recordings of a text table: CSV, and similar exports of other programs.
///
/// Columns are separated by commas, semicolons or tabs, whichever the header uses most, or by blanks; numbers have decimal points, or
/// commas if columns are not separated by them; the text is UTF-8, UTF-16 or Latin-1; titles, comments and units around the header
/// are understood. Skipped or changed parts are listed in [`Readings::notes`].
///
/// Empty cells, `nan` and `inf` are kept as values that are not finite, so that `check` can show them; rows without any value of a signal are
/// omitted.
///
/// # Errors
/// [`Error::Columns`], [`Error::Cell`] with its line, [`Error::Malformed`] for lines of another length or bytes that are not
/// text, [`Error::TooShort`] without rows.
pub fn read(source: impl Read, name: &str, layout: &Layout) -> Result<Readings> {
    let unread = Cell::new(0);
    let mut text = Text::open(source, &unread)?;
    let beginning = std::mem::take(&mut text.beginning);
    let shown = |error| match error {
        Error::Columns {
            finding,
            found,
            remedy,
        } => Error::Columns {
            finding,
            found,
            remedy: remedy + &beginning,
        },
        other => other,
    };
    text.recordings(name, layout).map_err(shown)
}

/// A preview of a text table.
#[derive(Debug, Clone, Default)]
pub struct Look {
    /// The names of its columns.
    pub headers: Vec<String>,
    /// Its first rows.
    pub rows: Vec<Vec<String>>,
    /// Skipped or changed parts, in sentences.
    pub notes: Vec<String>,
}

/// Reads the header and the first `rows` rows of a text table.
///
/// # Errors
/// As [`read`], for input that is not text.
pub fn look(source: impl Read, rows: usize) -> Result<Look> {
    let unread = Cell::new(0);
    let Text {
        source, dialect, ..
    } = Text::open(source, &unread)?;
    let (mut reader, headers) = Text::reader(source, &dialect)?;
    let mut look = Look {
        headers,
        notes: dialect.notes,
        ..Look::default()
    };
    for record in reader.records().take(rows) {
        let record = record.map_err(malformed)?;
        look.rows.push(record.iter().map(shortened).collect());
    }
    let commas = |cell: &String| dialect.separator != b',' && with_point(cell).is_some();
    if look.rows.iter().flatten().any(commas) {
        look.notes.push(COMMAS.into());
    }
    Ok(look)
}

const COMMAS: &str = "the numbers have decimal commas, which were read as points";

type Source<'a> = BufReader<Box<dyn Read + 'a>>;

/// An open text, with its dialect.
struct Text<'a> {
    source: Source<'a>,
    unread: &'a Cell<usize>,
    dialect: Dialect,
    /// The first lines, for messages.
    beginning: String,
}

impl<'a> Text<'a> {
    fn open(mut source: impl Read + 'a, unread: &'a Cell<usize>) -> Result<Self> {
        let mut start = Vec::with_capacity(CHUNK);
        source.by_ref().take(CHUNK as u64).read_to_end(&mut start)?;
        if let Some(other) = other_format(&start) {
            return Err(not_csv(other));
        }
        let (encoding, mark) = Encoding::of(&start);
        let known = known(&start[mark..], encoding);
        let control = |c: char| c == '\0' || encoding != Encoding::Utf8 && c.is_ascii_control();
        if known.contains(|c: char| control(c) && !"\t\n".contains(c)) {
            return Err(not_csv(NO_TEXT));
        }
        let mut dialect = Dialect::of(&known);
        if let Some(other) = encoding.other() {
            let note = format!("the text is not in UTF-8; it was read as {other}");
            dialect.notes.insert(0, note);
        }
        let mut all = Cursor::new(start);
        all.set_position(mark as u64);
        let decoded = Decoded::new(all.chain(source), encoding);
        let plain: Box<dyn Read> = Box::new(PlainLines::new(decoded, dialect.blanks, unread));
        let mut source = BufReader::with_capacity(CHUNK, plain);
        for _ in 0..dialect.skip {
            source.skip_until(b'\n')?;
        }
        unread.set(0);
        Ok(Self {
            source,
            unread,
            beginning: beginning(&known, &dialect.notes),
            dialect,
        })
    }

    /// The reader of its rows, and the names of its columns; `None` for an empty text.
    fn reader(
        source: Source<'a>,
        dialect: &Dialect,
    ) -> Result<(csv::Reader<Source<'a>>, Vec<String>)> {
        let mut reader = csv::ReaderBuilder::new()
            .delimiter(dialect.separator)
            .has_headers(dialect.headers.is_none())
            .flexible(true)
            .trim(csv::Trim::All)
            .from_reader(source);
        let mut headers = match &dialect.headers {
            Some(headers) => headers.clone(),
            None => reader
                .headers()
                .map_err(malformed)?
                .iter()
                .map(String::from)
                .collect(),
        };
        name_unnamed(&mut headers);
        Ok((reader, headers))
    }

    fn recordings(self, name: &str, layout: &Layout) -> Result<Readings> {
        let Self {
            source,
            unread,
            dialect,
            ..
        } = self;
        let (mut reader, headers) = Self::reader(source, &dialect)?;
        if headers.is_empty() {
            let what = format!("file '{name}' (it is empty, without even a header)");
            return Err(Error::too_short(what, 0, 2));
        }
        let resolved = resolve(&headers, layout)?;
        let (numbers, trajectory) = (resolved.numbers.clone(), resolved.trajectory);
        let mut rows = Filled {
            rows: Rows::new(resolved, name),
            omitted: 0,
        };
        let mut record = csv::StringRecord::new();
        let mut values = vec![0.0; numbers.len()];
        let mut cells = Cells {
            headers: &headers,
            mark: if dialect.separator == b',' {
                Mark::Point
            } else {
                Mark::Unknown
            },
            line: 0,
        };
        while reader.read_record(&mut record).map_err(malformed)? {
            unread.set(0);
            // The position of the record precedes the blank lines that were skipped.
            let start = record.position().map_or(0, csv::Position::line);
            let line = start.max(reader.position().line().saturating_sub(1));
            cells.line = line + dialect.skip as u64;
            cells.check_length(&record, dialect.comments)?;
            for (value, &column) in values.iter_mut().zip(&numbers) {
                *value = cells.number(&record, column)?;
            }
            rows.push(trajectory.and_then(|at| record.get(at)), &mut values)?;
        }
        let mut notes = dialect.notes;
        if cells.mark == Mark::Comma {
            notes.push(COMMAS.into());
        }
        rows.finish(notes)
    }
}

/// The text of the first bytes, with plain line ends; a letter that is cut at the end is lost.
fn known(start: &[u8], encoding: Encoding) -> String {
    let unread = Cell::new(0);
    let mut plain = PlainLines::new(Decoded::new(start, encoding), false, &unread);
    let (mut part, mut text) = (vec![0; CHUNK], Vec::new());
    // Bytes that are not text are reported when the rows are read.
    while let Ok(count @ 1..) = plain.read(&mut part) {
        text.extend_from_slice(&part[..count]);
    }
    String::from_utf8_lossy(&text).into_owned()
}

/// Number of lines of a file that a message shows.
const SHOWN: usize = 3;

/// The first lines of a file and its recognised features, for the end of a message.
fn beginning(text: &str, notes: &[String]) -> String {
    let lines = text.lines().filter(|line| !line.trim().is_empty());
    let shown = lines
        .take(SHOWN)
        .map(|line| format!("\n  {}", shortened(line)));
    let notes = notes.iter().map(|note| format!("\nnote: {note}"));
    let notes = brief(&notes.collect::<String>());
    format!("{notes}\nthe file begins with{}", shown.collect::<String>())
}

/// Rows, without those that have no value of any signal, such as frames in which nothing was tracked.
struct Filled {
    rows: Rows,
    omitted: usize,
}

impl Filled {
    fn push(&mut self, trajectory: Option<&str>, values: &mut [f64]) -> Result<()> {
        if values[1..].iter().all(|x| x.is_nan()) {
            self.omitted += 1;
            self.rows.skip();
            return Ok(());
        }
        self.rows.push(trajectory, values)
    }

    fn finish(self, mut notes: Vec<String>) -> Result<Readings> {
        if self.omitted > 0 {
            let rows = counted(self.omitted, "row");
            notes.push(format!("{rows} without a value: omitted"));
        }
        let mut readings = self.rows.finish()?;
        readings.notes.splice(0..0, notes);
        Ok(readings)
    }
}

/// Advice for a file that begins with these bytes and is not a text table.
fn other_format(start: &[u8]) -> Option<&'static str> {
    let known: [(&[u8], &str); 6] = [
        (
            b"\x1f\x8b",
            "it is compressed with gzip: unpack it with `gunzip`",
        ),
        (
            b"\x28\xb5\x2f\xfd",
            "it is compressed with zstd: unpack it with `zstd -d`",
        ),
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
    let mut known = known.into_iter();
    let found = known.find(|(magic, _)| start.starts_with(magic));
    found.map(|(_, remedy)| remedy)
}

const NO_TEXT: &str = "it holds bytes that are not text: export it again, as UTF-8";

fn not_csv(reason: impl Into<String>) -> Error {
    Error::malformed("CSV", reason.into())
}

/// Gives columns without a name one that states their position.
fn name_unnamed(headers: &mut [String]) {
    for (number, header) in (1..).zip(headers) {
        if header.is_empty() {
            *header = format!("(column {number}, without a name)");
        }
    }
}

/// The decimal mark of numbers.
#[derive(Clone, Copy, PartialEq)]
enum Mark {
    Unknown,
    Point,
    Comma,
}

/// Cells of a row as numbers.
struct Cells<'a> {
    headers: &'a [String],
    mark: Mark,
    /// The line of the row.
    line: u64,
}

impl Cells<'_> {
    /// Refuses a row of another length than the header, except for a comment at its end.
    fn check_length(&self, record: &csv::StringRecord, comments: bool) -> Result<()> {
        let (len, expected, line) = (record.len(), self.headers.len(), self.line);
        if len == expected || comments && len + 1 == expected {
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

    fn number(&mut self, record: &csv::StringRecord, column: usize) -> Result<f64> {
        let text = record.get(column).unwrap_or_default();
        if text.is_empty() {
            return Ok(f64::NAN);
        }
        match text.parse() {
            Ok(x) if self.mark == Mark::Point => return Ok(x),
            Ok(x) if !text.contains('.') => return Ok(x),
            Ok(x) if self.mark == Mark::Unknown => {
                self.mark = Mark::Point;
                return Ok(x);
            }
            _ => {}
        }
        match with_point(text) {
            Some(x) if self.mark != Mark::Point => {
                self.mark = Mark::Comma;
                Ok(x)
            }
            comma => Err(self.no_number(record, column, comma.is_some())),
        }
    }

    fn no_number(&self, record: &csv::StringRecord, column: usize, comma: bool) -> Error {
        let text = record.get(column).unwrap_or_default();
        let (line, column) = (self.line, self.headers[column].clone());
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
    }
}

/// Writes every line end as `\n`, also those of Windows and of old Macs, so that lines are counted alike wherever the file was
/// written, and ends a row that does not; runs of blanks within a line as a tab, where they separate columns.
struct PlainLines<'a, R> {
    source: R,
    blanks: bool,
    /// Whether the last byte was a carriage return, with its line end still to be written.
    returned: bool,
    /// Whether blanks followed the beginning of a line, with their tab still to be written.
    gap: bool,
    /// Whether a line has begun.
    began: bool,
    /// Bytes since the last row was complete.
    unread: &'a Cell<usize>,
}

impl<'a, R> PlainLines<'a, R> {
    fn new(source: R, blanks: bool, unread: &'a Cell<usize>) -> Self {
        Self {
            source,
            blanks,
            returned: false,
            gap: false,
            began: false,
            unread,
        }
    }
}

impl<R: Read> Read for PlainLines<'_, R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if self.unread.get() > MAX_ROW {
            return Err(io::Error::new(
                io::ErrorKind::InvalidData,
                "a row of more than 4 MB: is it a CSV file, and is each quote closed?",
            ));
        }
        // A pending line end needs one byte of the buffer.
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
    /// Whether a byte is one of the blanks that separate columns, or that surround a line.
    fn is_gap(&mut self, byte: u8) -> bool {
        let blank = matches!(byte, b' ' | b'\t');
        self.gap = self.began && (blank || self.gap) && byte != b'\n';
        self.began = byte != b'\n' && (self.began || !blank);
        blank
    }

    /// Moves `count` bytes from the second byte to the first, with plain line ends; returns the new length.
    fn plain(&mut self, buffer: &mut [u8], count: usize) -> usize {
        let mut kept = 0;
        for i in 1..=count {
            let byte = buffer[i];
            if byte == b'\r' {
                (self.returned, self.gap) = (true, false);
                continue;
            }
            if std::mem::take(&mut self.returned) && byte != b'\n' {
                buffer[kept] = b'\n';
                kept += 1;
                self.began = false;
            }
            if self.blanks && self.is_gap(byte) {
                continue;
            }
            if std::mem::take(&mut self.gap) {
                buffer[kept] = b'\t';
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

/// Writes trajectories with the default header names; numbers have the shortest digits that read back to the same bits.
///
/// A column `trajectory` is written if there are several.
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
