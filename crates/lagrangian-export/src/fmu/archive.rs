//! The zip of a unit.

use std::io::{Cursor, Write};

use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, ZipWriter};

use super::Fmu;
use crate::Error;

/// A library that a compiler made of the sources.
#[derive(Debug, Clone, Copy)]
pub struct Binary<'a> {
    /// The folder of its platform, [`Version::platform`](super::Version::platform).
    pub platform: &'a str,
    /// `so`, `dylib` or `dll`.
    pub extension: &'a str,
    /// Its bytes.
    pub bytes: &'a [u8],
}

/// The bytes of a unit, `NAME.fmu`; the same for the same arguments. Without a library it holds sources alone, which its
/// importer has to compile, and its description says so.
///
/// # Errors
/// Those of [`Fmu::files`]; [`Error::Archive`] where names of sources repeat or are too long.
pub fn archive(unit: &Fmu<'_>, binary: Option<Binary<'_>>) -> Result<Vec<u8>, Error> {
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    let files = unit.files(binary.is_some())?;
    let texts = files
        .iter()
        .map(|file| (file.name.clone(), file.text.as_bytes()));
    let library = binary.map(|b| {
        (
            format!(
                "binaries/{}/{}.{}",
                b.platform, unit.interface.name, b.extension
            ),
            b.bytes,
        )
    });
    for (name, bytes) in texts.chain(library) {
        add(&mut zip, &name, bytes).map_err(|error| Error::Archive(error.to_string()))?;
    }
    let bytes = zip
        .finish()
        .map_err(|error| Error::Archive(error.to_string()))?;
    Ok(bytes.into_inner())
}

fn add(
    zip: &mut ZipWriter<Cursor<Vec<u8>>>,
    name: &str,
    bytes: &[u8],
) -> zip::result::ZipResult<()> {
    let options = SimpleFileOptions::default()
        .compression_method(CompressionMethod::Deflated)
        .last_modified_time(DateTime::default())
        .unix_permissions(0o644);
    zip.start_file(name, options)?;
    Ok(zip.write_all(bytes)?)
}
