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
use parquet::arrow::ProjectionMask;
use parquet::arrow::arrow_reader::{ArrowReaderOptions, ParquetRecordBatchReaderBuilder};
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;
use parquet::file::reader::{ChunkReader, Length};

use super::columns::{Resolved, resolve};
use super::contents::Contents;
use super::rows::Rows;
use super::shared::Shared;
use super::{Layout, Readings};
use crate::{Error, Result};

/// Rows that are decoded at a time.
const BATCH: usize = 8192;
/// Bytes that are decoded at a time, even if each row has the longest text that a dictionary can hold.
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
/// [`Error::Columns`]; [`Error::Cell`] for columns that hold no numbers; [`Error::Malformed`] for anything that is
/// not a Parquet file; [`Error::TooShort`] if there is no row.
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
    // What Arrow adds to the types of the columns is not needed to read numbers and names.
    let options = ArrowReaderOptions::new().with_skip_arrow_metadata(true);
    let pages = shared.at(0);
    let builder = ParquetRecordBatchReaderBuilder::try_new_with_options(shared, options)
        .map_err(malformed)?;
    let fields = builder.schema().fields().iter();
    let headers: Vec<String> = fields.map(|f| f.name().clone()).collect();
    let resolved = resolve(&headers, layout)?;
    check_types(builder.schema(), &resolved)?;
    let schema = builder.parquet_schema();
    let used: Vec<usize> = resolved.used().collect();
    let mask = ProjectionMask::roots(schema, used.iter().copied());
    // Each column that is used has one leaf, as it is not nested.
    let leaves =
        (0..schema.num_columns()).filter(|&leaf| used.contains(&schema.get_column_root_idx(leaf)));
    let leaves: Vec<usize> = leaves.collect();
    let dictionary = claims::check_pages(&pages, builder.metadata(), &leaves)?;
    let row = dictionary.saturating_add(8 * leaves.len() as u64);
    let batch = (DECODED / row.max(1)).clamp(1, BATCH as u64);
    let reader = builder
        .with_projection(mask)
        .with_batch_size(usize::try_from(batch).unwrap_or(BATCH))
        .build()
        .map_err(malformed)?;
    let titles: Vec<String> = resolved.names().cloned().collect();
    let trajectory = resolved.columns.trajectory.clone();
    let mut rows = Rows::new(resolved, name);
    for batch in reader {
        let batch = batch.map_err(malformed)?;
        let columns: Vec<Vec<f64>> = titles
            .iter()
            .map(|title| numbers(&batch, title))
            .collect::<Result<_>>()?;
        let names = trajectory
            .as_ref()
            .map(|title| texts(&batch, title))
            .transpose()?;
        let mut values = vec![0.0; columns.len()];
        for k in 0..batch.num_rows() {
            for (value, column) in values.iter_mut().zip(&columns) {
                *value = column[k];
            }
            rows.push(names.as_ref().map(|names| names[k].as_str()), &mut values)?;
        }
    }
    rows.finish()
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

fn numbers(batch: &RecordBatch, title: &str) -> Result<Vec<f64>> {
    let column = column(batch, title)?;
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

/// A type that cannot be read is refused before any of its values takes memory.
fn check_types(schema: &Schema, resolved: &Resolved) -> Result<()> {
    let is_text = |column| resolved.trajectory == Some(column);
    let unread = resolved
        .used()
        .find(|&column| match schema.field(column).data_type() {
            DataType::Utf8 => !is_text(column),
            other => !other.is_integer() && !matches!(other, DataType::Float32 | DataType::Float64),
        });
    match unread.map(|column| schema.field(column)) {
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
        _ => numbers(batch, title)?.iter().map(f64::to_string).collect(),
    })
}

/// Writes a column for each of the contents, in groups of rows.
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

/// An error of the sink stays one.
fn failed(error: ParquetError) -> Error {
    match error {
        ParquetError::External(error) => match error.downcast::<std::io::Error>() {
            Ok(error) => Error::Io(*error),
            Err(error) => malformed(error),
        },
        other => malformed(other),
    }
}
