//! Preparation of the embedded font: complete if bitmaps need outlines of words, else without outlines, as words are only measured.

use std::path::Path;
use std::{env, fs, io};

const FONT: &str = "src/draw/font/Inter-subset.ttf";

fn main() -> io::Result<()> {
    println!("cargo::rerun-if-changed={FONT}");
    let whole = fs::read(FONT)?;
    let font = match env::var_os("CARGO_FEATURE_RASTER") {
        Some(_) => whole,
        None => without_outlines(&whole).ok_or(io::ErrorKind::InvalidData)?,
    };
    let folder = env::var_os("OUT_DIR").ok_or(io::ErrorKind::NotFound)?;
    fs::write(Path::new(&folder).join("font.ttf"), font)
}

/// The font without the outlines of its glyphs (`glyf`) and their offsets (`loca`). A font begins with its version, the number of
/// its tables and three numbers for searching; then each table has its name, a checksum, its offset and its length.
fn without_outlines(font: &[u8]) -> Option<Vec<u8>> {
    let number = |at: usize| -> Option<usize> {
        let bytes = font.get(at..at + 4)?.try_into().ok()?;
        usize::try_from(u32::from_be_bytes(bytes)).ok()
    };
    let count = u16::from_be_bytes(font.get(4..6)?.try_into().ok()?);
    let all =
        (0..usize::from(count)).map(|k| font.get(12 + 16 * k..28 + 16 * k).map(|own| (k, own)));
    let all: Vec<(usize, &[u8])> = all.collect::<Option<_>>()?;
    let kept = all
        .iter()
        .filter(|(_, own)| !matches!(&own[..4], b"glyf" | b"loca"));
    let kept: Vec<_> = kept.collect();
    let mut head = font.get(..12)?.to_vec();
    head[4..6].copy_from_slice(&u16::try_from(kept.len()).ok()?.to_be_bytes());
    let (mut tables, begin) = (Vec::new(), 12 + 16 * kept.len());
    for (k, own) in kept {
        let (place, length) = (number(12 + 16 * k + 8)?, number(12 + 16 * k + 12)?);
        head.extend_from_slice(&own[..8]);
        head.extend_from_slice(&u32::try_from(begin + tables.len()).ok()?.to_be_bytes());
        head.extend_from_slice(&own[12..]);
        tables.extend_from_slice(font.get(place..place + length)?);
        tables.resize(tables.len().next_multiple_of(4), 0);
    }
    Some([head, tables].concat())
}
