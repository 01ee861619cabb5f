//! Parquet: columns of numbers, read batch by batch (feature `parquet`).

mod claims;
mod thrift;

use std::io::{Read, Seek, Write};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;

use arrow_array::{Array, ArrayRef, Float64Array, RecordBatch, StringArray, cast::AsArray, types};
use arrow_schema::{DataType, Field, Schema};
use bytes::Bytes;
use parquet::arrow::ArrowWriter;
use parquet::arrow::arrow_reader::{
    ArrowReaderMetadata, ArrowReaderOptions, ParquetRecordBatchReader,
    ParquetRecordBatchReaderBuilder,
};
use parquet::arrow::{ProjectionMask, parquet_to_arrow_schema};
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;
use parquet::file::reader::{ChunkReader, Length};

use super::columns::resolve;
use super::contents::Contents;
use super::matrices::numbered;
use super::npz::WIDEST;
use super::rows::Rows;
use super::shared::Shared;
use super::{Layout, Readings};
use lagrangian_motion::{Error, Result};

/// Number of rows that are decoded at a time.
const BATCH: usize = 8192;
/// Number of bytes that are decoded at a time, even if each row has the longest text of a dictionary.
const DECODED: u64 = 1 << 26;

impl<R> Length for Shared<R> {
    fn len(&self) -> u64 {
        self.size
    }
}

impl<R: Read + Seek + Send> ChunkReader for Shared<R> {
    type T = std::io::BufReader<Self>;

    fn get_read(&self, start: u64) -> std::result::Result<Self::T, ParquetError> {
        Ok(std::io::BufReader::new(self.at(start)))
    }

    fn get_bytes(&self, start: u64, length: usize) -> std::result::Result<Bytes, ParquetError> {
        if start.saturating_add(length as u64) > self.size {
            return Err(ParquetError::EOF(format!(
                "{length} bytes at {start} of a file of {} bytes",
                self.size
            )));
        }
        let mut bytes = Vec::with_capacity(length);
        self.at(start).take(length as u64).read_to_end(&mut bytes)?;
        if bytes.len() < length {
            return Err(ParquetError::EOF(
                "the file became shorter while it was read".into(),
            ));
        }
        Ok(bytes.into())
    }
}

fn malformed(error: impl std::fmt::Display) -> Error {
    Error::malformed("Parquet", error)
}

/// Reads the recordings of a Parquet file; nulls become NaN.
///
/// # Errors
/// [`Error::Columns`]; [`Error::Cell`] for columns without numbers; [`Error::Malformed`] for anything that is
/// not a Parquet file; [`Error::TooShort`] without rows.
pub(super) fn read(
    source: impl Read + Seek + Send + 'static,
    name: &str,
    layout: &Layout,
) -> Result<Readings> {
    // The decoders of the library panic on some damaged pages.
    let read = AssertUnwindSafe(|| read_groups(source, name, layout));
    let damaged = || malformed("its pages are damaged: write it again");
    catch_unwind(read).unwrap_or_else(|_| Err(damaged()))
}

fn read_groups(
    source: impl Read + Seek + Send + 'static,
    name: &str,
    layout: &Layout,
) -> Result<Readings> {
    let shared = Shared::new(source)?;
    claims::check_footer(&shared)?;
    // Numbers and names can be read without the metadata that Arrow adds to the types.
    let options = ArrowReaderOptions::new().with_skip_arrow_metadata(true);
    let metadata = ArrowReaderMetadata::load(&shared, options).map_err(malformed)?;
    let (schema, parquet) = (metadata.schema(), metadata.metadata());
    let asked = |field: &Field| is_list(field) && layout.asks_for(field.name());
    let lists = roots(schema, asked);
    claims::check_lists(&shared, parquet, &leaves(&metadata, &lists))?;
    let widths = widths(&shared, &metadata, &lists)?;
    let layout = layout.spread(&widths).map_err(malformed)?;
    let columns = Column::all(schema, &widths);
    let headers: Vec<String> = columns.iter().map(|column| column.name.clone()).collect();
    let resolved = resolve(&headers, &layout)?;
    let used: Vec<&Column> = resolved.used().map(|at| &columns[at]).collect();
    check_types(
        schema,
        &used,
        resolved.trajectory.map(|at| columns[at].root),
    )?;
    let mut roots: Vec<usize> = used.iter().map(|column| column.root).collect();
    roots.sort_unstable();
    roots.dedup();
    refuse_durations(&metadata, &roots)?;
    // Each used column has one leaf: it is not nested, or is a list.
    let leaves = leaves(&metadata, &roots);
    let dictionary = claims::check_pages(&shared, parquet, &leaves)?;
    let width = |root: &usize| Column::width(&widths, schema.field(*root).name()).unwrap_or(1);
    let numbers = roots.iter().map(width).sum::<usize>() as u64;
    let batch = (DECODED / dictionary.saturating_add(8 * numbers).max(1)).clamp(1, BATCH as u64);
    let places = resolved.numbers.iter().map(|&at| {
        let column = &columns[at];
        // OK because `roots` contains the root of every used column.
        (
            roots.binary_search(&column.root).unwrap_or_default(),
            column.place,
        )
    });
    let places: Vec<(usize, usize)> = places.collect();
    let trajectory = resolved.columns.trajectory.clone();
    let reader = reader(
        &shared,
        &metadata,
        &roots,
        usize::try_from(batch).unwrap_or(BATCH),
    )?;
    let titles: Vec<(&str, usize)> = roots
        .iter()
        .map(|root| (schema.field(*root).name().as_str(), width(root)))
        .collect();
    let mut rows = Rows::new(resolved, name);
    for batch in reader {
        let batch = batch.map_err(malformed)?;
        let is_text = |title: &str| trajectory.as_deref() == Some(title);
        let blocks: Vec<Vec<f64>> = titles
            .iter()
            .map(|(title, width)| match is_text(title) {
                true => Ok(Vec::new()),
                false => numbers_of(&batch, title, *width),
            })
            .collect::<Result<_>>()?;
        let names = trajectory
            .as_ref()
            .map(|title| texts(&batch, title))
            .transpose()?;
        let mut values = vec![0.0; places.len()];
        for k in 0..batch.num_rows() {
            for (value, &(block, place)) in values.iter_mut().zip(&places) {
                *value = blocks[block][k * titles[block].1 + place];
            }
            rows.push(names.as_ref().map(|names| names[k].as_str()), &mut values)?;
        }
    }
    rows.finish()
}

/// A column of numbers or text: a column of the file, or one entry of a list column.
struct Column {
    name: String,
    root: usize,
    place: usize,
}

impl Column {
    /// The columns of a file; a list column of known width gives several.
    fn all(schema: &Schema, widths: &[(&str, usize)]) -> Vec<Self> {
        let fields = schema.fields().iter().enumerate();
        let columns = fields.flat_map(|(root, field)| {
            let names = match Self::width(widths, field.name()) {
                Some(width) => numbered(field.name(), width),
                None => vec![field.name().clone()],
            };
            let column = move |(place, name)| Self { name, root, place };
            names.into_iter().enumerate().map(column)
        });
        columns.collect()
    }

    fn width(widths: &[(&str, usize)], name: &str) -> Option<usize> {
        let own = widths.iter().find(|(own, _)| *own == name);
        own.map(|(_, width)| *width)
    }
}

fn is_list(field: &Field) -> bool {
    matches!(field.data_type(), DataType::List(inner) if is_numeric(inner.data_type()))
}

fn is_numeric(kind: &DataType) -> bool {
    kind.is_integer() || matches!(kind, DataType::Float32 | DataType::Float64)
}

/// Indices of the columns for which `is` holds.
fn roots(schema: &Schema, is: impl Fn(&Field) -> bool) -> Vec<usize> {
    let fields = schema.fields();
    (0..fields.len())
        .filter(|&root| is(&fields[root]))
        .collect()
}

/// The leaves of columns.
fn leaves(metadata: &ArrowReaderMetadata, roots: &[usize]) -> Vec<usize> {
    let schema = metadata.parquet_schema();
    let own = |leaf: &usize| roots.contains(&schema.get_column_root_idx(*leaf));
    (0..schema.num_columns()).filter(own).collect()
}

fn reader<R: Read + Seek + Send + 'static>(
    shared: &Shared<R>,
    metadata: &ArrowReaderMetadata,
    roots: &[usize],
    batch: usize,
) -> Result<ParquetRecordBatchReader> {
    let mask = ProjectionMask::roots(metadata.parquet_schema(), roots.iter().copied());
    ParquetRecordBatchReaderBuilder::new_with_metadata(shared.at(0), metadata.clone())
        .with_projection(mask)
        .with_batch_size(batch)
        .build()
        .map_err(malformed)
}

/// The names of list columns, and the number of values in the first row of each.
fn widths<'a, R: Read + Seek + Send + 'static>(
    shared: &Shared<R>,
    metadata: &'a ArrowReaderMetadata,
    lists: &[usize],
) -> Result<Vec<(&'a str, usize)>> {
    if lists.is_empty() {
        return Ok(Vec::new());
    }
    let Some(first) = reader(shared, metadata, lists, 1)?.next() else {
        return Ok(Vec::new());
    };
    let first = first.map_err(malformed)?;
    let width = |&root: &usize| {
        let name = metadata.schema().field(root).name().as_str();
        let width = column(&first, name)?.as_list::<i32>().value(0).len();
        match (1..=WIDEST).contains(&width) {
            true => Ok((name, width)),
            false => Err(malformed(format!(
                "the first list of column '{name}' has {width} numbers, not 1 to {WIDEST}"
            ))),
        }
    };
    lists.iter().map(width).collect()
}

fn column<'a>(batch: &'a RecordBatch, title: &str) -> Result<&'a ArrayRef> {
    batch
        .column_by_name(title)
        .ok_or_else(|| malformed(format!("column '{title}' is missing in a row group")))
}

macro_rules! as_numbers {
    ($column:expr, $($arrow:ident $kind:ident as $convert:expr),+ $(,)?) => {
        match $column.data_type() {
            $(DataType::$arrow => {
                let values = $column.as_primitive::<types::$kind>();
                Some(values.iter().map(|x| x.map_or(f64::NAN, $convert)).collect())
            })+
            _ => None,
        }
    };
}

/// The numbers of a column, `width` for each row; NaN for a null list.
fn numbers_of(batch: &RecordBatch, title: &str, width: usize) -> Result<Vec<f64>> {
    let column = column(batch, title)?;
    let DataType::List(_) = column.data_type() else {
        return numbers(column, title);
    };
    let lists = column.as_list::<i32>();
    let all = numbers(lists.values(), title)?;
    let mut own = Vec::new();
    for (k, range) in lists.value_offsets().windows(2).enumerate() {
        let row = &all[range[0] as usize..range[1] as usize];
        match row.len() {
            len if len == width => own.extend(row),
            _ if lists.is_null(k) => own.extend(std::iter::repeat_n(f64::NAN, width)),
            len => {
                return Err(malformed(format!(
                    "a list of column '{title}' has {len} numbers, the first has {width}"
                )));
            }
        }
    }
    Ok(own)
}

fn numbers(column: &ArrayRef, title: &str) -> Result<Vec<f64>> {
    #[allow(clippy::cast_precision_loss, reason = "numbers of any type become f64")]
    let values = as_numbers!(
        column,
        Float64 Float64Type as |x| x, Float32 Float32Type as f64::from,
        Int64 Int64Type as |x| x as f64, UInt64 UInt64Type as |x| x as f64,
        Int32 Int32Type as f64::from, UInt32 UInt32Type as f64::from,
        Int16 Int16Type as f64::from, UInt16 UInt16Type as f64::from,
        Int8 Int8Type as f64::from, UInt8 UInt8Type as f64::from,
    );
    values.ok_or_else(|| of_type(title, column.data_type()))
}

/// Refuses types that cannot be read before any of their values is allocated.
fn check_types(schema: &Schema, used: &[&Column], text: Option<usize>) -> Result<()> {
    let is_read = |field: &Field, column: &Column| match field.data_type() {
        DataType::Utf8 => text == Some(column.root),
        // In this case its name differs from that of the field.
        DataType::List(_) => column.name != *field.name(),
        other => is_numeric(other),
    };
    let fields = used
        .iter()
        .map(|column| (schema.field(column.root), *column));
    match fields
        .into_iter()
        .find(|(field, column)| !is_read(field, column))
    {
        Some((field, _)) => Err(of_type(field.name(), field.data_type())),
        None => Ok(()),
    }
}

/// Refuses durations: Parquet has no such type, so only the metadata of Arrow distinguishes them from integers.
fn refuse_durations(metadata: &ArrowReaderMetadata, roots: &[usize]) -> Result<()> {
    let about = metadata.metadata().file_metadata();
    let added = parquet_to_arrow_schema(about.schema_descr(), about.key_value_metadata());
    let of = |root: &usize| added.as_ref().ok()?.fields().get(*root);
    let is_duration = |field: &&Arc<Field>| matches!(field.data_type(), DataType::Duration(_));
    match roots.iter().filter_map(of).find(is_duration) {
        Some(field) => Err(of_type(field.name(), field.data_type())),
        None => Ok(()),
    }
}

fn of_type(title: &str, of: &DataType) -> Error {
    Error::Cell {
        line: 1,
        column: title.into(),
        text: format!("a value of type {of}"),
    }
}

fn texts(batch: &RecordBatch, title: &str) -> Result<Vec<String>> {
    let column = column(batch, title)?;
    let text = |x: Option<&str>| x.unwrap_or_default().to_owned();
    Ok(match column.data_type() {
        DataType::Utf8 => column.as_string::<i32>().iter().map(text).collect(),
        _ => numbers(column, title)?.iter().map(f64::to_string).collect(),
    })
}

/// Writes a column for each array of the contents, in groups of rows.
pub(super) fn write(sink: impl Write + Send, contents: &Contents) -> Result<()> {
    let type_of = |name: &str| match name {
        "trajectory" if contents.is_of_several() => DataType::Utf8,
        _ => DataType::Float64,
    };
    let field = |name: String| Field::new(&name, type_of(&name), false);
    let fields: Vec<Field> = contents.headers().into_iter().map(field).collect();
    let schema = Arc::new(Schema::new(fields));
    let properties = WriterProperties::builder()
        .set_compression(parquet::basic::Compression::SNAPPY)
        .build();
    let mut writer =
        ArrowWriter::try_new(sink, Arc::clone(&schema), Some(properties)).map_err(failed)?;
    for (t, (name, len)) in contents.trajectories.iter().enumerate() {
        for start in (0..*len).step_by(BATCH) {
            let rows = start..(start + BATCH).min(*len);
            let mut columns: Vec<ArrayRef> = Vec::new();
            if contents.is_of_several() {
                let names = StringArray::from_iter_values(rows.clone().map(|_| name));
                columns.push(Arc::new(names));
            }
            for array in &contents.arrays {
                for i in 0..array.columns.unwrap_or(1) {
                    let values = rows.clone().map(|k| array.row(t, k)[i]);
                    columns.push(Arc::new(Float64Array::from_iter_values(values)));
                }
            }
            let batch = RecordBatch::try_new(Arc::clone(&schema), columns).map_err(malformed)?;
            writer.write(&batch).map_err(failed)?;
        }
    }
    writer.close().map_err(failed)?;
    Ok(())
}

/// Converts an error, and preserves one of the sink.
fn failed(error: ParquetError) -> Error {
    match error {
        ParquetError::External(error) => match error.downcast::<std::io::Error>() {
            Ok(error) => Error::Io(*error),
            Err(error) => malformed(error),
        },
        other => malformed(other),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use std::io::Cursor;

    use arrow_array::{DurationMicrosecondArray, TimestampNanosecondArray};

    use super::*;

    #[test]
    fn stamps_and_durations_are_no_whole_numbers() {
        let stamps: ArrayRef = Arc::new(TimestampNanosecondArray::from(vec![0, 1, 2]));
        let durations: ArrayRef = Arc::new(DurationMicrosecondArray::from(vec![0, 1, 2]));
        let q: ArrayRef = Arc::new(Float64Array::from(vec![0.1, 0.2, 0.3]));
        for (t, named) in [(stamps, "Timestamp"), (durations, "Duration")] {
            let batch = RecordBatch::try_from_iter([("t", t), ("q1", Arc::clone(&q))]).unwrap();
            let mut file = Vec::new();
            let mut writer = ArrowWriter::try_new(&mut file, batch.schema(), None).unwrap();
            writer.write(&batch).unwrap();
            writer.close().unwrap();
            let error = read(Cursor::new(file), "file", &Layout::default()).unwrap_err();
            assert!(error.to_string().contains(named), "{error}");
        }
    }
}
