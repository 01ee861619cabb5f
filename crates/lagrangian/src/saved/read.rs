//! Reading a file that may come from anywhere.

use std::cmp::Ordering;
use std::collections::BTreeMap;
use std::io::Read;

use safetensors::SafeTensors;
use safetensors::tensor::Metadata;
use serde::Deserialize;

use super::{Envelope, FORMAT, KEY, MAX_HEADER, SavedModel, Tensor, VERSION, checksum, damaged};
use lagrangian_motion::error::brief;
use lagrangian_motion::{Coordinates, Error, Result};

/// The first version of files with a checksum.
const FIRST_WITH_CHECKSUM: u32 = 2;

/// Bytes of the number that opens the file.
const PREFIX: usize = size_of::<u64>();

pub(super) fn from_reader(mut reader: impl Read) -> Result<SavedModel> {
    let mut bytes = Vec::new();
    take(&mut reader, PREFIX, &mut bytes)?;
    let length = header_length(&bytes)?;
    take(&mut reader, length, &mut bytes)?;
    let (metadata, _) = header(&bytes, length)?;
    // One byte more than promised detects a file that is too long.
    take(
        &mut reader,
        metadata.data_len().saturating_add(1),
        &mut bytes,
    )?;
    from_bytes(&bytes)
}

/// Appends at most `length` bytes; memory grows with the bytes that arrive, not with the promised number.
fn take(reader: &mut impl Read, length: usize, bytes: &mut Vec<u8>) -> Result<()> {
    reader.by_ref().take(length as u64).read_to_end(bytes)?;
    Ok(())
}

pub(super) fn from_bytes(bytes: &[u8]) -> Result<SavedModel> {
    let length = header_length(bytes)?;
    let (metadata, envelope) = header(bytes, length)?;
    let found = bytes.len() - PREFIX - length;
    match found.cmp(&metadata.data_len()) {
        Ordering::Less => {
            let expected = metadata.data_len();
            return Err(damaged(format!(
                "it was cut short: {found} of {expected} bytes of weights"
            )));
        }
        Ordering::Greater => return Err(damaged("bytes follow the last weight".into())),
        Ordering::Equal => {}
    }
    let unverified = envelope.version < FIRST_WITH_CHECKSUM;
    if !unverified && !checksum::holds(bytes) {
        return Err(damaged("its checksum does not hold".into()));
    }
    let stored = SafeTensors::deserialize(bytes).map_err(|e| damaged(e.to_string()))?;
    let mut tensors = BTreeMap::new();
    for (name, view) in stored.iter() {
        tensors.insert(name.to_string(), Tensor::from_view(name, &view)?);
    }
    let mut header = envelope.model;
    header.provenance.unverified = unverified;
    Ok(SavedModel { header, tensors })
}

/// The length of the header, if a header can be that long.
pub(super) fn header_length(bytes: &[u8]) -> Result<usize> {
    let Some(prefix) = bytes.first_chunk::<PREFIX>() else {
        return Err(damaged(format!("it was cut short: {} bytes", bytes.len())));
    };
    let length = u64::from_le_bytes(*prefix);
    match usize::try_from(length) {
        Ok(length) if length <= MAX_HEADER => Ok(length),
        _ => Err(Error::NotAModel {
            found: format!("a header of {length} bytes, where {MAX_HEADER} is the most"),
        }),
    }
}

/// The fields of the envelope that every version must have.
#[derive(Deserialize)]
struct Marker {
    format: String,
    version: u32,
}

/// The header: first the format is checked, then the version, then the content.
fn header(bytes: &[u8], length: usize) -> Result<(Metadata, Envelope)> {
    let Some(json) = bytes.get(PREFIX..PREFIX + length) else {
        let found = bytes.len() - PREFIX;
        return Err(damaged(format!(
            "it was cut short: {found} of {length} bytes of the header"
        )));
    };
    let metadata: Metadata = serde_json::from_slice(json)
        .map_err(|e| not_a_model(format!("no safetensors header: {e}")))?;
    let Some(own) = metadata.metadata().as_ref().and_then(|map| map.get(KEY)) else {
        return Err(not_a_model("a safetensors file of another program".into()));
    };
    let marker: Marker = serde_json::from_str(own).map_err(|e| not_a_model(e.to_string()))?;
    if marker.format != FORMAT {
        return Err(not_a_model(format!("format '{}'", marker.format)));
    }
    if marker.version > VERSION {
        return Err(Error::NewerModel {
            found: marker.version,
            known: VERSION,
        });
    }
    if marker.version == 0 {
        return Err(damaged("there is no version 0".into()));
    }
    let envelope: Envelope = serde_json::from_str(own).map_err(|e| damaged(e.to_string()))?;
    check_names(&envelope.model.coordinates)?;
    Ok((metadata, envelope))
}

/// Refuses coordinates that no data could have: without names, or two of one name.
fn check_names(coordinates: &Coordinates) -> Result<()> {
    let names = || coordinates.0.iter().map(|c| c.name.as_str());
    let repeated = |(k, name): (usize, &str)| names().take(k).any(|other| other == name);
    if coordinates.0.is_empty() || names().any(str::is_empty) {
        return Err(damaged(
            "it has no coordinates, or one without a name".into(),
        ));
    }
    match names().enumerate().any(repeated) {
        true => Err(damaged("two of its coordinates have one name".into())),
        false => Ok(()),
    }
}

fn not_a_model(found: String) -> Error {
    Error::NotAModel {
        found: brief(&found),
    }
}
