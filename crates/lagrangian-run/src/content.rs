//! The content of recordings as one hash: equal for equal numbers, whatever file they were read from.

use lagrangian::Recording;
use lagrangian::trajectory::Signal;
use sha2::{Digest, Sha256};

use crate::record::DataFile;

/// A hash that counts its input.
#[derive(Default)]
struct Content {
    hash: Sha256,
    bytes: u64,
}

impl Content {
    /// Adds some bytes; their number before them distinguishes `ab, c` from `a, bc`.
    fn take(&mut self, bytes: &[u8]) {
        self.hash.update((bytes.len() as u64).to_le_bytes());
        self.hash.update(bytes);
        self.bytes += bytes.len() as u64;
    }

    fn numbers(&mut self, numbers: &[f64]) {
        let bytes: Vec<u8> = numbers.iter().flat_map(|x| x.to_le_bytes()).collect();
        self.take(&bytes);
    }
}

/// The size and the hash of names, coordinates, times and signals.
pub(crate) fn content(recordings: &[Recording]) -> DataFile {
    let mut content = Content::default();
    for recording in recordings {
        content.take(recording.name.as_bytes());
        for coordinate in &recording.coordinates.0 {
            let kind = format!("{:?}", coordinate.topology);
            for text in [&coordinate.name, &coordinate.unit, &kind] {
                content.take(text.as_bytes());
            }
        }
        content.numbers(&recording.t);
        for signal in Signal::IN_FILES {
            content.take(signal.name().as_bytes());
            content.numbers(recording.signals.get(signal));
        }
    }
    DataFile {
        role: String::new(),
        path: String::new(),
        bytes: content.bytes,
        sha256: hex(&content.hash.finalize()),
    }
}

/// Bytes as hexadecimal digits.
pub(crate) fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}
