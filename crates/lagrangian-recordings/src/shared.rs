//! One file read at several positions at once.

use std::io::{Read, Result, Seek, SeekFrom};
use std::sync::{Arc, Mutex, PoisonError};

/// A reader with its own position in a source that others read too.
pub(super) struct Shared<R> {
    source: Arc<Mutex<R>>,
    position: u64,
    pub(super) size: u64,
}

impl<R: Read + Seek> Shared<R> {
    pub(super) fn new(mut source: R) -> Result<Self> {
        let size = source.seek(SeekFrom::End(0))?;
        Ok(Self {
            source: Arc::new(Mutex::new(source)),
            position: 0,
            size,
        })
    }
}

impl<R> Shared<R> {
    /// Another reader of the same source, at `position`.
    pub(super) fn at(&self, position: u64) -> Self {
        Self {
            source: Arc::clone(&self.source),
            position,
            size: self.size,
        }
    }
}

impl<R: Read + Seek> Read for Shared<R> {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize> {
        // OK because a panic in another reader leaves no partial state: every read seeks first.
        let mut source = self.source.lock().unwrap_or_else(PoisonError::into_inner);
        source.seek(SeekFrom::Start(self.position))?;
        let count = source.read(buffer)?;
        self.position += count as u64;
        Ok(count)
    }
}

impl<R> Seek for Shared<R> {
    fn seek(&mut self, to: SeekFrom) -> Result<u64> {
        let (base, offset) = match to {
            SeekFrom::Start(position) => (position, 0),
            SeekFrom::End(offset) => (self.size, offset),
            SeekFrom::Current(offset) => (self.position, offset),
        };
        let outside = || {
            std::io::Error::new(
                std::io::ErrorKind::InvalidInput,
                "seek before the start of the file",
            )
        };
        self.position = base.checked_add_signed(offset).ok_or_else(outside)?;
        Ok(self.position)
    }
}
