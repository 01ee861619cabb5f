//! A file that is hashed while it is read.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

use sha2::{Digest, Sha256};

use crate::content::hex;
use crate::input;

/// Bytes that are hashed at a time.
const CHUNK: usize = 1 << 16;

/// The size and the hash of a file, which identify it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FileHash {
    /// The size, bytes.
    pub bytes: u64,
    /// The SHA-256 of the content.
    pub sha256: String,
}

impl FileHash {
    /// The hash of bytes in memory.
    #[must_use]
    pub fn of(bytes: &[u8]) -> Self {
        Self {
            bytes: bytes.len() as u64,
            sha256: hex(&Sha256::digest(bytes)),
        }
    }
}

/// The beginning of a hash, for readers.
#[must_use]
pub fn brief_hash(sha256: &str) -> String {
    format!("{}…", sha256.get(..12).unwrap_or(sha256))
}

/// A file that the reader of its format reads. Text is hashed while it is read; an archive is read at the positions of its
/// directory, and the remaining bytes are hashed at the end.
pub struct HashingReader {
    file: File,
    position: u64,
    hash: Arc<Mutex<Prefix>>,
}

/// The hash of the first bytes of a file.
#[derive(Default)]
struct Prefix {
    hash: Sha256,
    bytes: u64,
}

impl Prefix {
    /// Adds the bytes at `position`, as far as they continue the hashed ones.
    fn take(&mut self, position: u64, bytes: &[u8]) {
        let known = self.bytes.checked_sub(position);
        let known = known.and_then(|known| usize::try_from(known).ok());
        if let Some(rest) = known.and_then(|known| bytes.get(known..)) {
            self.hash.update(rest);
            self.bytes += rest.len() as u64;
        }
    }
}

/// The hash of a file, once its reader has finished.
pub struct Hashing {
    file: File,
    hash: Arc<Mutex<Prefix>>,
}

impl HashingReader {
    /// Opens a file for its reader, and for its hash.
    ///
    /// # Errors
    /// Errors of the operating system; a pipe or a folder is not a file.
    pub fn open(path: &Path) -> io::Result<(Self, Hashing)> {
        let file = input::open(path)?;
        let hash = Arc::default();
        let hashing = Hashing {
            file: file.try_clone()?,
            hash: Arc::clone(&hash),
        };
        let reader = Self {
            file,
            position: 0,
            hash,
        };
        Ok((reader, hashing))
    }
}

impl Read for HashingReader {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.file.read(buffer)?;
        // OK because a prefix is whole after every call.
        let mut hash = self.hash.lock().unwrap_or_else(PoisonError::into_inner);
        hash.take(self.position, &buffer[..count]);
        self.position += count as u64;
        Ok(count)
    }
}

impl Seek for HashingReader {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.position = self.file.seek(to)?;
        Ok(self.position)
    }
}

impl Hashing {
    /// Reads the bytes that the reader skipped, and returns the hash of the whole file.
    ///
    /// # Errors
    /// Errors of the operating system.
    pub fn finish(mut self) -> io::Result<FileHash> {
        let mut hash = self.hash.lock().unwrap_or_else(PoisonError::into_inner);
        self.file.seek(SeekFrom::Start(hash.bytes))?;
        let mut buffer = vec![0; CHUNK];
        loop {
            match self.file.read(&mut buffer) {
                Ok(0) => break,
                Ok(count) => {
                    let position = hash.bytes;
                    hash.take(position, &buffer[..count]);
                }
                Err(e) if e.kind() == io::ErrorKind::Interrupted => {}
                Err(e) => return Err(e),
            }
        }
        let digest = std::mem::take(&mut hash.hash).finalize();
        Ok(FileHash {
            bytes: hash.bytes,
            sha256: hex(&digest),
        })
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;

    // FIPS 180-2, appendix B.1.
    const ABC: &str = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";

    fn abc(read: impl FnOnce(&mut HashingReader)) -> FileHash {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("abc");
        std::fs::write(&path, "abc").unwrap();
        let (mut reader, hashing) = HashingReader::open(&path).unwrap();
        read(&mut reader);
        hashing.finish().unwrap()
    }

    #[test]
    fn a_file_has_its_hash_however_it_is_read() {
        let whole = |reader: &mut HashingReader| {
            io::copy(reader, &mut io::sink()).unwrap();
        };
        let jumping = |reader: &mut HashingReader| {
            let mut byte = [0];
            for place in [2, 0, 0, 1] {
                reader.seek(SeekFrom::Start(place)).unwrap();
                reader.read_exact(&mut byte).unwrap();
            }
        };
        let expected = FileHash {
            bytes: 3,
            sha256: ABC.into(),
        };
        assert_eq!(abc(whole), expected);
        assert_eq!(abc(jumping), expected);
        assert_eq!(abc(|_| ()), expected);
        assert_eq!(FileHash::of(b"abc"), expected);
    }
}
