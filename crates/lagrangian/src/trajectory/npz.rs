//! NPZ: a zip of `NumPy` arrays, `t` `[len]`, and `q` `[len, n]` or `q1 …` `[len]` each.

use std::io::{BufReader, Read, Seek, SeekFrom, Write};

use zip::read::ZipFile;
use zip::result::ZipError;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipArchive, ZipWriter};

use super::columns::{Resolved, resolve};
use super::npy::{Header, malformed, write_header};
use super::rows::Rows;
use super::shared::Shared;
use super::{Layout, Readings, Table, Trajectory, WrittenColumns, unique_names};
use crate::{Error, Result};

/// An archive may unpack to this many bytes …
const UNPACKED: u64 = 1 << 30;
/// … or to so many times its own size, where that is more. Measured motions pack two- to tenfold.
const PACKING: u64 = 100;

/// One array of the archive.
struct Array {
    /// Its name, without `.npy`.
    name: String,
    header: Header,
}

/// A column as a stream of its own: of one array, the first value at `skip`, the next ones at every `stride`.
struct Stream<R> {
    source: R,
    header: Header,
    stride: usize,
    /// Elements to pass over before the next value.
    skip: usize,
}

/// Reads the recordings of an archive. All arrays are read side by side, so that memory grows only with what is
/// kept; a header that claims more than the archive holds is refused.
///
/// # Errors
/// [`Error::Columns`]; [`Error::Malformed`] for anything that is not such an archive; [`Error::Shape`] for arrays
/// of different lengths; [`Error::TooShort`] if there is no row.
pub fn read(source: impl Read + Seek, name: &str, layout: &Layout) -> Result<Readings> {
    let shared = Shared::new(source)?;
    let arrays = list(&shared)?;
    let layout = spread(layout, &arrays);
    let headers: Vec<String> = arrays.iter().flat_map(columns_of).collect();
    let resolved = resolve(&headers, &layout)?;
    let rows = check_lengths(&resolved, &headers, &arrays)?;

    let used = resolved.numbers.iter().chain(resolved.trajectory.as_ref());
    let places: Vec<(usize, usize)> = used.map(|c| place(*c, &arrays)).collect();
    let mut archives = Vec::new();
    for _ in &places {
        archives.push(ZipArchive::new(BufReader::new(shared.at(0))).map_err(zipped)?);
    }
    let mut streams = Vec::new();
    for (archive, (array, column)) in archives.iter_mut().zip(&places) {
        let entry = archive
            .by_name(&format!("{}.npy", arrays[*array].name))
            .map_err(zipped)?;
        streams.push(Stream::new(BufReader::new(entry), *column)?);
    }
    let text = resolved.trajectory.and_then(|_| streams.pop());
    let titles = resolved.names().cloned().collect::<Vec<_>>();
    collect(Rows::new(resolved, name), streams, text, &titles, rows)
}

fn collect<R: Read>(
    mut rows: Rows,
    mut streams: Vec<Stream<R>>,
    mut trajectory: Option<Stream<R>>,
    titles: &[String],
    len: usize,
) -> Result<Readings> {
    let mut values = vec![0.0; streams.len()];
    for row in 0..len {
        for ((value, stream), title) in values.iter_mut().zip(&mut streams).zip(titles) {
            stream.pass()?;
            *value = stream
                .header
                .number(&mut stream.source)?
                .ok_or_else(|| Error::Cell {
                    line: row as u64 + 1,
                    column: title.clone(),
                    text: "text".into(),
                })?;
        }
        let name = trajectory.as_mut().map(Stream::text).transpose()?;
        rows.push(name.as_deref(), &mut values)?;
    }
    rows.finish()
}

impl<R: Read> Stream<R> {
    fn new(mut source: R, column: usize) -> Result<Self> {
        let header = Header::read(&mut source)?;
        let width = header.shape.get(1).copied().unwrap_or(1);
        let len = header.shape.first().copied().unwrap_or(0);
        let (skip, stride) = if header.fortran_order {
            (column * len, 1)
        } else {
            (column, width)
        };
        Ok(Self {
            source,
            header,
            stride,
            skip,
        })
    }

    fn pass(&mut self) -> Result<()> {
        for _ in 0..self.skip {
            self.header.number(&mut self.source)?;
        }
        self.skip = self.stride - 1;
        Ok(())
    }

    fn text(&mut self) -> Result<String> {
        self.header.text(&mut self.source)
    }
}

fn zipped(error: ZipError) -> Error {
    match error {
        ZipError::Io(error) => Error::Io(error),
        other => malformed(format!(
            "{other}: save it with numpy.savez or numpy.savez_compressed"
        )),
    }
}

/// The headers of all arrays of one or two axes, none larger than the archive can hold.
fn list<R: Read + Seek>(shared: &Shared<R>) -> Result<Vec<Array>> {
    let mut archive = ZipArchive::new(BufReader::new(shared.at(0))).map_err(zipped)?;
    let limit = UNPACKED.max(shared.size.saturating_mul(PACKING));
    let mut unpacked = 0_u64;
    let mut arrays = Vec::new();
    for i in 0..archive.len() {
        let mut entry = archive.by_index(i).map_err(zipped)?;
        let Some(name) = array_name(&entry) else {
            continue;
        };
        let Ok(header) = Header::read(&mut entry) else {
            continue;
        };
        if !matches!(header.shape.len(), 1 | 2) {
            continue;
        }
        let claimed = header.bytes().ok_or_else(|| {
            malformed(format!(
                "array '{name}' claims a shape of {:?}",
                header.shape
            ))
        })?;
        unpacked = unpacked.saturating_add(claimed as u64);
        if claimed as u64 > entry.size() || unpacked > limit {
            return Err(malformed(format!(
                "array '{name}' claims {claimed} bytes, the archive cannot hold them: the file is damaged"
            )));
        }
        arrays.push(Array { name, header });
    }
    Ok(arrays)
}

/// The name of an entry without `.npy`; none for what is not an array.
fn array_name<R: Read>(entry: &ZipFile<R>) -> Option<String> {
    let name = entry.name().ok()?;
    Some(name.strip_suffix(".npy")?.to_owned())
}

/// `q` of shape `[len, 2]` stands for the columns `q1`, `q2`.
fn columns_of(array: &Array) -> Vec<String> {
    match array.header.shape.get(1) {
        Some(&width) => (1..=width.min(1 << 12))
            .map(|i| format!("{}{i}", array.name))
            .collect(),
        None => vec![array.name.clone()],
    }
}

/// The array that column `column` of the headers stands in, and its place there.
fn place(mut column: usize, arrays: &[Array]) -> (usize, usize) {
    for (i, array) in arrays.iter().enumerate() {
        let width = columns_of(array).len();
        if column < width {
            return (i, column);
        }
        column -= width;
    }
    (arrays.len(), 0)
}

/// Names of two-axis arrays in the layout become the names of their columns.
fn spread(layout: &Layout, arrays: &[Array]) -> Layout {
    let mut layout = layout.clone();
    let signals = layout.columns.iter_mut().map(|(_, names)| names);
    for names in signals.chain([&mut layout.angles]) {
        let columns = |name: &String| {
            let matrix = arrays
                .iter()
                .find(|a| a.name == *name && a.header.shape.len() == 2);
            matrix.map_or_else(|| vec![name.clone()], columns_of)
        };
        *names = names.iter().flat_map(columns).collect();
    }
    layout
}

/// All used arrays have the same length, which it returns.
fn check_lengths(resolved: &Resolved, headers: &[String], arrays: &[Array]) -> Result<usize> {
    let mut len = None;
    for &column in resolved.numbers.iter().chain(resolved.trajectory.as_ref()) {
        let found = arrays
            .get(place(column, arrays).0)
            .and_then(|a| a.header.shape.first().copied())
            .unwrap_or(0);
        let expected = *len.get_or_insert(found);
        Error::check_shape(
            format_args!("array '{}'", headers[column]),
            found,
            expected,
            "all arrays need one row per time stamp",
        )?;
    }
    Ok(len.unwrap_or(0))
}

/// Writes arrays `t` `[len]` and `q`, `qd`, … `[len, n]`, all trajectories one after another; `trajectory` holds
/// their names where there are several.
///
/// # Errors
/// [`Error::Io`]; [`Error::Shape`] if their degrees of freedom or signals differ.
pub fn write(sink: impl Write + Seek, trajectories: &[Trajectory]) -> Result<()> {
    let shape = WrittenColumns::of(trajectories)?;
    let rows = trajectories.iter().map(Trajectory::len).sum::<usize>();
    let mut archive = ZipWriter::new(FailsOnce::new(sink));
    let options = SimpleFileOptions::default()
        .large_file(true)
        .compression_method(CompressionMethod::Stored);
    if trajectories.len() > 1 {
        archive
            .start_file("trajectory.npy", options)
            .map_err(zipped)?;
        write_names(&mut std::io::BufWriter::new(&mut archive), trajectories)?;
    }
    archive.start_file("t.npy", options).map_err(zipped)?;
    write_array(
        &mut archive,
        &[rows],
        trajectories.iter().map(|t| t.t.as_slice()),
    )?;
    for signal in &shape.signals {
        archive
            .start_file(format!("{}.npy", signal.name()), options)
            .map_err(zipped)?;
        let values = trajectories.iter().map(|t| t.get(*signal).as_slice());
        write_array(&mut archive, &[rows, shape.n], values)?;
    }
    archive.finish().map_err(zipped)?.sink.flush()?;
    Ok(())
}

/// Writes each column as an array of one axis, and the names of the trajectories where there are several.
pub(super) fn write_table(sink: impl Write + Seek, table: &Table) -> Result<()> {
    let mut archive = ZipWriter::new(FailsOnce::new(sink));
    let options = SimpleFileOptions::default()
        .large_file(true)
        .compression_method(CompressionMethod::Stored);
    if table.trajectories.len() > 1 {
        archive
            .start_file("trajectory.npy", options)
            .map_err(zipped)?;
        let names: Vec<&str> = table.row_names().collect();
        write_texts(&mut std::io::BufWriter::new(&mut archive), &names)?;
    }
    for (name, values) in &table.columns {
        archive
            .start_file(format!("{name}.npy"), options)
            .map_err(zipped)?;
        write_array(
            &mut archive,
            &[values.len()],
            std::iter::once(values.as_slice()),
        )?;
    }
    archive.finish().map_err(zipped)?.sink.flush()?;
    Ok(())
}

fn write_array<'a>(
    sink: impl Write,
    shape: &[usize],
    values: impl Iterator<Item = &'a [f64]>,
) -> Result<()> {
    let mut sink = std::io::BufWriter::new(sink);
    write_header(&mut sink, "<f8", shape)?;
    for x in values.flatten() {
        sink.write_all(&x.to_le_bytes())?;
    }
    sink.flush()?;
    Ok(())
}

fn write_names(sink: &mut impl Write, trajectories: &[Trajectory]) -> Result<()> {
    let names = unique_names(trajectories);
    let rows = names.iter().zip(trajectories);
    let texts: Vec<&str> = rows
        .flat_map(|(name, t)| vec![name.as_str(); t.len()])
        .collect();
    write_texts(sink, &texts)
}

fn write_texts(sink: &mut impl Write, texts: &[&str]) -> Result<()> {
    let width = texts
        .iter()
        .map(|n| n.chars().count())
        .max()
        .unwrap_or(0)
        .max(1);
    write_header(sink, &format!("<U{width}"), &[texts.len()])?;
    for text in texts {
        let mut element: Vec<u8> = text
            .chars()
            .flat_map(|c| u32::from(c).to_le_bytes())
            .collect();
        element.resize(4 * width, 0);
        sink.write_all(&element)?;
    }
    sink.flush()?;
    Ok(())
}

/// A sink that reports its first failure and from then on pretends: a zip writer that is dropped tries to end its
/// file, and would print or panic where that fails.
struct FailsOnce<W> {
    sink: W,
    failed: bool,
    position: u64,
    end: u64,
}

impl<W> FailsOnce<W> {
    fn new(sink: W) -> Self {
        Self {
            sink,
            failed: false,
            position: 0,
            end: 0,
        }
    }

    /// Moves to where `act` says, or to `pretended` once the sink has failed.
    fn advance(
        &mut self,
        pretended: u64,
        act: impl FnOnce(&mut W) -> std::io::Result<u64>,
    ) -> std::io::Result<u64> {
        self.position = if self.failed {
            pretended
        } else {
            act(&mut self.sink).inspect_err(|_| self.failed = true)?
        };
        self.end = self.end.max(self.position);
        Ok(self.position)
    }
}

impl<W: Write> Write for FailsOnce<W> {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        let before = self.position;
        let wanted = before + bytes.len() as u64;
        let after = self.advance(wanted, |sink| Ok(before + sink.write(bytes)? as u64))?;
        // OK because no more was written than there are bytes.
        Ok((after - before) as usize)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        if self.failed {
            Ok(())
        } else {
            self.sink.flush().inspect_err(|_| self.failed = true)
        }
    }
}

impl<W: Seek> Seek for FailsOnce<W> {
    fn seek(&mut self, to: SeekFrom) -> std::io::Result<u64> {
        let pretended = match to {
            SeekFrom::Start(position) => position,
            SeekFrom::End(offset) => self.end.saturating_add_signed(offset),
            SeekFrom::Current(offset) => self.position.saturating_add_signed(offset),
        };
        self.advance(pretended, |sink| sink.seek(to))
    }
}
