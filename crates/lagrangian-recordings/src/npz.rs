//! NPZ: a zip of `NumPy` arrays, `t` `[len]`, and `q` `[len, n]` or `q1 …` `[len]` each.

use std::io::{self, BufReader, BufWriter, Read, Seek, SeekFrom, Write};

use zip::result::ZipError;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipArchive, ZipWriter};

use super::contents::Contents;
use super::matrices::{Named, resolve_arrays};
use super::npy::{Header, malformed, write_header};
use super::rows::Rows;
use super::shared::Shared;
use super::{Layout, Readings};
use lagrangian_motion::{Error, Result};

/// An archive may unpack to this many bytes …
const UNPACKED: u64 = 1 << 30;
/// … or to this many times its own size, where that is more. The ratio of measured motions is two to ten.
const PACKING: u64 = 100;

/// One array of the archive.
struct Array {
    /// Its name, without `.npy`.
    name: String,
    header: Header,
}

/// An entry that is not an array of one or two axes of numbers or text.
struct Unread {
    /// Its name, without `.npy`.
    name: String,
    reason: String,
}

/// Largest number of columns of an array, more than any motion has.
const WIDEST: usize = 1 << 12;

impl Array {
    fn named(&self) -> Named<'_> {
        (&self.name, self.header.shape.get(1).copied())
    }
}

/// An independent stream over a column of an array: the first value at `skip`, the next ones at every `stride`.
struct Stream<R> {
    source: R,
    header: Header,
    stride: usize,
    /// Number of elements to skip before the next value.
    skip: usize,
    /// Number of elements that have not been read.
    left: usize,
}

/// Reads the recordings of an archive. All arrays are read side by side, so that memory grows only with the rows that are
/// kept; a header that claims another size than the archive holds is refused. Unused entries are listed, with
/// the reason if they could not be used.
///
/// # Errors
/// [`Error::Columns`]; [`Error::Malformed`] for anything that is not such an archive, for an array that the layout requires
/// and that cannot be read, and for bytes that contradict their checksum; [`Error::Shape`] for arrays of different
/// lengths; [`Error::TooShort`] without rows.
pub(super) fn read(source: impl Read + Seek, name: &str, layout: &Layout) -> Result<Readings> {
    let shared = Shared::new(source)?;
    let (arrays, unread) = list(&shared)?;
    if let Some(Unread { name, reason }) = unread.iter().find(|u| layout.asks_for(&u.name)) {
        return Err(malformed(format!("array '{name}' {reason}")));
    }
    let named = arrays.iter().map(Array::named).collect::<Vec<_>>();
    let (resolved, used) = resolve_arrays(&named, layout, "NPZ")?;
    let used: Vec<(&Array, usize)> = used
        .into_iter()
        .map(|(at, place)| (&arrays[at], place))
        .collect();
    let rows = check_lengths(&used)?;
    let mut archives = Vec::new();
    for _ in &used {
        archives.push(ZipArchive::new(BufReader::new(shared.at(0))).map_err(zipped)?);
    }
    let mut streams = Vec::new();
    for (archive, (array, place)) in archives.iter_mut().zip(&used) {
        let entry = format!("{}.npy", array.name);
        let entry = archive.by_name(&entry).map_err(zipped)?;
        streams.push(Stream::new(BufReader::new(entry), *place)?);
    }
    let mut names = resolved.trajectory.and_then(|_| streams.pop());
    let titles = resolved.names().cloned().collect::<Vec<_>>();
    let mut values = vec![0.0; streams.len()];
    let mut collected = Rows::new(resolved, name);
    for row in 0..rows {
        for ((value, stream), title) in values.iter_mut().zip(&mut streams).zip(&titles) {
            *value = stream.number()?.ok_or_else(|| Error::Cell {
                line: row as u64 + 1,
                column: title.clone(),
                text: "text".into(),
            })?;
        }
        let name = names.as_mut().map(Stream::text).transpose()?;
        collected.push(name.as_deref(), &mut values)?;
    }
    streams
        .into_iter()
        .chain(names)
        .try_for_each(Stream::finish)?;
    let mut readings = collected.finish()?;
    let unread = unread
        .into_iter()
        .map(|u| format!("{} ({})", u.name, u.reason));
    readings.columns.ignored.extend(unread);
    Ok(readings)
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
            left: header.elements().unwrap_or(0),
            header,
            stride,
            skip,
        })
    }

    /// The next value; `None` for text.
    fn number(&mut self) -> Result<Option<f64>> {
        self.pass_over()?;
        self.header.number(&mut self.source)
    }

    fn text(&mut self) -> Result<String> {
        self.pass_over()?;
        self.header.text(&mut self.source)
    }

    /// Skips to the next value and counts it as read.
    fn pass_over(&mut self) -> Result<()> {
        for _ in 0..self.skip {
            self.header.number(&mut self.source)?;
        }
        self.left = self.left.saturating_sub(self.skip + 1);
        self.skip = self.stride - 1;
        Ok(())
    }

    /// Reads to the end, where the archive compares its checksum.
    fn finish(mut self) -> Result<()> {
        let rest = self.left.saturating_mul(self.header.element_size()) as u64;
        let mut rest = self.source.by_ref().take(rest);
        let damaged = |e: io::Error| malformed(format!("{e}: the file is damaged, copy it again"));
        io::copy(&mut rest, &mut io::sink()).map_err(damaged)?;
        // OK because its size was compared with that of the entry.
        self.source.read(&mut [0]).map_err(damaged)?;
        Ok(())
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

/// The headers of all arrays of one or two axes, each checked against the size in the archive, and the other entries.
fn list<R: Read + Seek>(shared: &Shared<R>) -> Result<(Vec<Array>, Vec<Unread>)> {
    let mut archive = ZipArchive::new(BufReader::new(shared.at(0))).map_err(zipped)?;
    let limit = UNPACKED.max(shared.size.saturating_mul(PACKING));
    let mut unpacked = 0_u64;
    let (mut arrays, mut unread) = (Vec::new(), Vec::new());
    for i in 0..archive.len() {
        let mut entry = archive.by_index(i).map_err(zipped)?;
        let file = String::from_utf8_lossy(entry.name_raw()).into_owned();
        let name = file.strip_suffix(".npy").unwrap_or(&file).to_owned();
        let header = match Header::read(&mut entry).map_err(reason).and_then(plain) {
            Ok(header) if name != file => header,
            Ok(_) => {
                let reason = "does not end with .npy".into();
                unread.push(Unread { name: file, reason });
                continue;
            }
            Err(reason) => {
                unread.push(Unread { name, reason });
                continue;
            }
        };
        let claimed = check_size(&name, &header, entry.size())?;
        unpacked = unpacked.saturating_add(claimed);
        if unpacked > limit {
            return Err(malformed(format!(
                "with array '{name}' it unpacks to more than {limit} bytes: the file is damaged, or is not a motion"
            )));
        }
        arrays.push(Array { name, header });
    }
    Ok((arrays, unread))
}

/// The reason for an array that cannot be read.
fn reason(error: Error) -> String {
    match error {
        Error::Malformed { reason, .. } => reason,
        other => other.to_string(),
    }
}

/// A header of one or two axes.
fn plain(header: Header) -> std::result::Result<Header, String> {
    match header.shape[..] {
        [_] => Ok(header),
        [_, width] if width <= WIDEST => Ok(header),
        [_, width] => Err(format!(
            "has {width} columns, more than {WIDEST}: is it transposed?"
        )),
        _ => Err(format!(
            "has {} axes: store arrays of shape (rows,) or (rows, columns)",
            header.shape.len()
        )),
    }
}

/// The number of bytes of an array, which must equal the `size` of its entry.
fn check_size(name: &str, header: &Header, size: u64) -> Result<u64> {
    let claimed = header.bytes().map(|bytes| bytes as u64);
    let all = claimed.and_then(|bytes| bytes.checked_add(header.length as u64));
    match claimed {
        Some(claimed) if all == Some(size) => Ok(claimed),
        _ => Err(malformed(format!(
            "array '{name}' claims a shape of {:?}, which the {size} bytes of the archive do not hold: the file is damaged",
            header.shape
        ))),
    }
}

/// Checks that all used arrays have the same length, and returns it.
fn check_lengths(used: &[(&Array, usize)]) -> Result<usize> {
    let rows = |(array, _): &(&Array, usize)| array.header.shape.first().copied().unwrap_or(0);
    let expected = used.first().map_or(0, rows);
    for column in used {
        let what = format_args!("array '{}'", column.0.name);
        let remedy = "all arrays need one row per time stamp";
        Error::check_shape(what, rows(column), expected, remedy)?;
    }
    Ok(expected)
}

/// Writes all trajectories one after another: an array for each signal, and one of the names of the trajectories if
/// there are several.
pub(super) fn write(sink: impl Write + Seek, contents: &Contents) -> Result<()> {
    let mut archive = ZipWriter::new(FusedWriter::new(sink));
    let options = SimpleFileOptions::default()
        .large_file(true)
        .compression_method(CompressionMethod::Stored);
    let rows = contents.trajectories.iter().map(|t| t.1).sum();
    if contents.is_of_several() {
        archive
            .start_file("trajectory.npy", options)
            .map_err(zipped)?;
        write_names(&mut archive, &contents.trajectories, rows)?;
    }
    for array in &contents.arrays {
        let entry = format!("{}.npy", array.name);
        archive.start_file(entry, options).map_err(zipped)?;
        let shape: Vec<usize> = [rows].into_iter().chain(array.columns).collect();
        write_array(&mut archive, &shape, &array.values)?;
    }
    Ok(archive.finish().map_err(zipped)?.sink.flush()?)
}

fn write_array(sink: impl Write, shape: &[usize], values: &[&[f64]]) -> Result<()> {
    let mut sink = BufWriter::new(sink);
    write_header(&mut sink, "<f8", shape)?;
    for x in values.iter().copied().flatten() {
        sink.write_all(&x.to_le_bytes())?;
    }
    Ok(sink.flush()?)
}

/// Writes the name of each trajectory as often as it has rows.
fn write_names(sink: impl Write, trajectories: &[(String, usize)], rows: usize) -> Result<()> {
    let mut sink = BufWriter::new(sink);
    let lengths = trajectories.iter().map(|(name, _)| name.chars().count());
    let width = lengths.max().unwrap_or(0).max(1);
    write_header(&mut sink, &format!("<U{width}"), &[rows])?;
    for (name, rows) in trajectories {
        let codes = name.chars().flat_map(|c| u32::from(c).to_le_bytes());
        let mut element: Vec<u8> = codes.collect();
        element.resize(4 * width, 0);
        for _ in 0..*rows {
            sink.write_all(&element)?;
        }
    }
    Ok(sink.flush()?)
}

/// A sink that reports its first failure and from then on claims success: a zip writer that is dropped tries to finish its
/// file, and would print or panic on a failure.
struct FusedWriter<W> {
    sink: W,
    failed: bool,
    position: u64,
    end: u64,
}

impl<W> FusedWriter<W> {
    fn new(sink: W) -> Self {
        Self {
            sink,
            failed: false,
            position: 0,
            end: 0,
        }
    }

    /// Moves to the position that `act` returns, or to `pretended` after a failure of the sink.
    fn advance(
        &mut self,
        pretended: u64,
        act: impl FnOnce(&mut W) -> io::Result<u64>,
    ) -> io::Result<u64> {
        self.position = if self.failed {
            pretended
        } else {
            act(&mut self.sink).inspect_err(|_| self.failed = true)?
        };
        self.end = self.end.max(self.position);
        Ok(self.position)
    }
}

impl<W: Write> Write for FusedWriter<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let before = self.position;
        let wanted = before + bytes.len() as u64;
        let after = self.advance(wanted, |sink| Ok(before + sink.write(bytes)? as u64))?;
        // OK because the difference is at most the length of the buffer.
        Ok((after - before) as usize)
    }

    fn flush(&mut self) -> io::Result<()> {
        if self.failed {
            Ok(())
        } else {
            self.sink.flush().inspect_err(|_| self.failed = true)
        }
    }
}

impl<W: Seek> Seek for FusedWriter<W> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let pretended = match to {
            SeekFrom::Start(position) => position,
            SeekFrom::End(offset) => self.end.saturating_add_signed(offset),
            SeekFrom::Current(offset) => self.position.saturating_add_signed(offset),
        };
        self.advance(pretended, |sink| sink.seek(to))
    }
}
