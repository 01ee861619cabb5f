//! Thrift's compact protocol, restricted to reading integers.
//!
//! A decoder identifies a field by its number and ignores its type. For this walk to see the same fields, those that
//! the decoder reads must have their type in Parquet, and numbers must ascend, as all writers write them.
//!
//! Source: Apache Thrift, `doc/specs/thrift-compact-protocol.md`.

use std::io::{Error, ErrorKind, Read, Result, copy, sink};

/// Largest nesting of structures and lists: those of Parquet have at most eight levels.
const DEEPEST: usize = 24;

/// The type of a field in the file.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Wire {
    Bool,
    Byte,
    /// An integer of 16, 32 or 64 bits; all are encoded alike.
    Integer,
    Double,
    Text,
    List,
    Structure,
}

impl Wire {
    fn of(code: u8) -> Result<Self> {
        Ok(match code {
            1 | 2 => Self::Bool,
            3 => Self::Byte,
            4..=6 => Self::Integer,
            7 => Self::Double,
            8 => Self::Text,
            9 | 10 => Self::List,
            12 => Self::Structure,
            _ => return Err(damaged()),
        })
    }
}

/// A structure with known fields.
pub(super) trait Known {
    /// The type of the field at this path of numbers, outermost first; `None` if the decoder skips it.
    fn wire(&self, path: &[i16]) -> Option<Wire>;

    /// Receives an integer; of a longer one the decoder uses the last 32 bits as well.
    fn integer(&mut self, path: &[i16], value: i32);

    /// Called at the end of a nested structure.
    fn end(&mut self, _path: &[i16]) -> Result<()> {
        Ok(())
    }
}

/// Walks through one structure.
pub(super) fn walk(source: impl Read, known: &mut impl Known) -> Result<()> {
    let mut walk = Walk {
        source,
        known,
        path: Vec::new(),
    };
    walk.structure(0)
}

pub(super) fn damaged() -> Error {
    Error::new(ErrorKind::InvalidData, "a header is damaged")
}

struct Walk<'a, R, K> {
    source: R,
    known: &'a mut K,
    path: Vec<i16>,
}

impl<R: Read, K: Known> Walk<'_, R, K> {
    fn structure(&mut self, depth: usize) -> Result<()> {
        let mut last = 0;
        loop {
            let head = self.byte()?;
            if head & 15 == 0 {
                return self.known.end(&self.path);
            }
            let id = match head >> 4 {
                0 => i16::try_from(self.integer()?).map_err(|_| damaged())?,
                step => last + i16::from(step),
            };
            if id <= last || id > 1000 {
                return Err(damaged());
            }
            last = id;
            self.path.push(id);
            let wire = Wire::of(head & 15)?;
            let expected = self.known.wire(&self.path);
            if expected.is_some_and(|expected| expected != wire) {
                return Err(damaged());
            }
            // The type of a flag contains its value.
            if wire != Wire::Bool {
                self.value(wire, depth + 1)?;
            }
            self.path.pop();
        }
    }

    fn value(&mut self, wire: Wire, depth: usize) -> Result<()> {
        if depth > DEEPEST {
            return Err(damaged());
        }
        match wire {
            Wire::Bool | Wire::Byte => self.byte().map(drop),
            Wire::Integer => {
                #[allow(clippy::cast_possible_truncation, reason = "as the decoder does")]
                let value = self.integer()? as i32;
                self.known.integer(&self.path, value);
                Ok(())
            }
            Wire::Double => self.pass_over(8),
            Wire::Text => {
                let length = self.number()?;
                self.pass_over(length)
            }
            Wire::List => self.list(depth),
            Wire::Structure => self.structure(depth),
        }
    }

    fn list(&mut self, depth: usize) -> Result<()> {
        let head = self.byte()?;
        let length = match head >> 4 {
            15 => self.number()?,
            length => length.into(),
        };
        if length == 0 {
            return Ok(());
        }
        let wire = Wire::of(head & 15)?;
        // Each value takes a byte, so that this ends with the source.
        (0..length).try_for_each(|_| self.value(wire, depth + 1))
    }

    fn byte(&mut self) -> Result<u8> {
        let mut byte = [0];
        self.source.read_exact(&mut byte)?;
        Ok(byte[0])
    }

    /// A number with seven bits a byte, the lowest first.
    fn number(&mut self) -> Result<u64> {
        let mut number = 0;
        for shift in (0..64).step_by(7) {
            let byte = self.byte()?;
            number |= u64::from(byte & 0x7f) << shift;
            if byte & 0x80 == 0 {
                return Ok(number);
            }
        }
        Err(damaged())
    }

    /// A number whose lowest bit is the sign.
    fn integer(&mut self) -> Result<i64> {
        let number = self.number()?;
        Ok((number >> 1).cast_signed() ^ -(number & 1).cast_signed())
    }

    fn pass_over(&mut self, length: u64) -> Result<()> {
        match copy(&mut self.source.by_ref().take(length), &mut sink())? == length {
            true => Ok(()),
            false => Err(damaged()),
        }
    }
}
