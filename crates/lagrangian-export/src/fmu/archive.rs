//! The zip of a unit.

use std::env::consts::{ARCH, DLL_EXTENSION, OS};
use std::io::{Cursor, Write};

use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, ZipWriter};

use super::Fmu;
use crate::Error;

/// The bytes of a unit, `NAME.fmu`; equal for equal arguments. `library` is the result of a compiler of this platform for the
/// sources. Without it the unit contains sources alone, which its importer has to compile, as its description says.
///
/// # Errors
/// Those of [`Fmu::files`]; [`Error::Archive`] where names of sources repeat or are too long.
pub fn archive(unit: &Fmu<'_>, library: Option<&[u8]>) -> Result<Vec<u8>, Error> {
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    let files = unit.files(library.is_some())?;
    let texts = files
        .iter()
        .map(|file| (file.name.clone(), file.text.as_bytes()));
    let (name, extension) = (&unit.interface.name, DLL_EXTENSION);
    let libraries = library.into_iter().flat_map(|bytes| {
        let place = |platform| format!("binaries/{platform}/{name}.{extension}");
        platforms(OS, ARCH)
            .into_iter()
            .map(move |p| (place(p), bytes))
    });
    for (name, bytes) in texts.chain(libraries) {
        add(&mut zip, &name, bytes).map_err(|error| Error::Archive(error.to_string()))?;
    }
    let bytes = zip
        .finish()
        .map_err(|error| Error::Archive(error.to_string()))?;
    Ok(bytes.into_inner())
}

/// The folders in which importers search for a library of a platform.
fn platforms(system: &str, processor: &str) -> Vec<String> {
    let (long, short) = match system {
        "macos" => ("darwin", "darwin"),
        "windows" => ("windows", "win"),
        other => (other, other),
    };
    let of_bits = format!("{short}{}", usize::BITS);
    match processor {
        "x86" | "x86_64" => vec![of_bits],
        // FMI 2.0.4 names other processors like `aarch64-linux` (section 2.3); FMPy and OpenModelica use the names of x86.
        _ => vec![format!("{processor}-{long}"), of_bits],
    }
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

#[cfg(test)]
mod tests {
    use super::platforms;

    #[test]
    fn a_library_is_where_importers_of_its_platform_look() {
        let of_bits = |system: &str| format!("{system}{}", usize::BITS);
        for (system, processor, folders) in [
            ("linux", "x86_64", vec![of_bits("linux")]),
            ("windows", "x86_64", vec![of_bits("win")]),
            (
                "linux",
                "aarch64",
                vec!["aarch64-linux".into(), of_bits("linux")],
            ),
            (
                "macos",
                "aarch64",
                vec!["aarch64-darwin".into(), of_bits("darwin")],
            ),
        ] {
            assert_eq!(platforms(system, processor), folders);
        }
    }
}
