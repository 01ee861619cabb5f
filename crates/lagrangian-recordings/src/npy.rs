//! One `NumPy` array: the header, with bounds on every size, and its elements one after another.
//!
//! Format: <https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html>, versions 1 to 3.

use std::io::{Read, Write};

use lagrangian_motion::{Error, Result};

/// Longest header; no header of a plain array comes near this.
const LONGEST_HEADER: usize = 1 << 16;
/// Longest text of a trajectory's name, characters.
const LONGEST_TEXT: usize = 1024;

/// Type of one element.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Float(usize),
    Int(usize),
    Uint(usize),
    Bool,
    /// UCS-4 text of this many characters.
    Text(usize),
    /// Byte text of this many bytes.
    Bytes(usize),
}

/// The header of an array.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Header {
    pub(super) kind: Kind,
    big_endian: bool,
    pub(super) fortran_order: bool,
    pub(super) shape: Vec<usize>,
    /// Bytes before the first element.
    pub(super) length: usize,
}

pub(super) fn malformed(reason: impl Into<String>) -> Error {
    Error::malformed("NPZ", reason.into())
}

impl Header {
    /// Reads the header; `source` is then at the first element.
    pub(super) fn read(source: &mut impl Read) -> Result<Self> {
        let mut start = [0; 8];
        source.read_exact(&mut start)?;
        if &start[..6] != b"\x93NUMPY" {
            return Err(malformed("is not a NumPy array"));
        }
        let mut length = [0; 4];
        let width = if start[6] == 1 { 2 } else { 4 };
        source.read_exact(&mut length[..width])?;
        let length = u32::from_le_bytes(length) as usize;
        if !(1..=3).contains(&start[6]) || length > LONGEST_HEADER {
            return Err(malformed(format!(
                "has a header of version {} with {length} bytes",
                start[6]
            )));
        }
        let mut text = vec![0; length];
        source.read_exact(&mut text)?;
        let text =
            String::from_utf8(text).map_err(|_| malformed("has a header that is not text"))?;
        let header = Self::parse(&text)?;
        Ok(Self {
            length: start.len() + width + length,
            ..header
        })
    }

    /// `{'descr': '<f8', 'fortran_order': False, 'shape': (3, 4), }`
    fn parse(text: &str) -> Result<Self> {
        let unreadable = || {
            malformed(format!(
                "has the header '{}'",
                text.trim().chars().take(120).collect::<String>()
            ))
        };
        let value = |key: &str| {
            text.split_once(&format!("'{key}':"))
                .map(|(_, rest)| rest.trim_start())
        };
        let descr = value("descr").ok_or_else(unreadable)?;
        let descr = descr
            .strip_prefix('\'')
            .and_then(|d| d.split_once('\''))
            .map(|(d, _)| d);
        let fortran_order = value("fortran_order")
            .ok_or_else(unreadable)?
            .starts_with("True");
        let shape = value("shape")
            .and_then(|s| s.strip_prefix('(')?.split_once(')'))
            .ok_or_else(unreadable)?
            .0;
        let sizes = shape.split(',').map(str::trim).filter(|s| !s.is_empty());
        let shape: Vec<usize> = sizes
            .map(|s| s.parse().map_err(|_| unreadable()))
            .collect::<Result<_>>()?;
        let (kind, big_endian) = descr.and_then(kind).ok_or_else(|| {
            malformed(format!(
                "has elements of type {}: store float64",
                descr.map_or("structure".into(), described)
            ))
        })?;
        Ok(Self {
            kind,
            big_endian,
            fortran_order,
            shape,
            length: 0,
        })
    }

    /// Number of elements; `None` on overflow.
    pub(super) fn elements(&self) -> Option<usize> {
        self.shape
            .iter()
            .try_fold(1_usize, |a, b| a.checked_mul(*b))
    }

    /// Bytes of one element.
    pub(super) fn element_size(&self) -> usize {
        self.kind.size()
    }

    /// Bytes of all elements; `None` on overflow.
    pub(super) fn bytes(&self) -> Option<usize> {
        self.elements()?.checked_mul(self.kind.size())
    }

    /// Reads the next element as a number; `None` for text.
    pub(super) fn number(&self, source: &mut impl Read) -> Result<Option<f64>> {
        let mut b = [0; 8];
        let size = match self.kind {
            Kind::Float(size) | Kind::Int(size) | Kind::Uint(size) => size,
            Kind::Bool => 1,
            Kind::Text(_) | Kind::Bytes(_) => return Ok(None),
        };
        source.read_exact(&mut b[..size])?;
        if self.big_endian {
            b[..size].reverse();
        }
        let unsigned = u64::from_le_bytes(b);
        #[allow(
            clippy::cast_precision_loss,
            clippy::cast_possible_wrap,
            clippy::cast_possible_truncation,
            reason = "numbers of any type become f64"
        )]
        Ok(Some(match (self.kind, size) {
            (Kind::Float(_), 8) => f64::from_bits(unsigned),
            (Kind::Float(_), _) => f64::from(f32::from_bits(unsigned as u32)),
            (Kind::Int(_), _) => {
                let unused = 64 - 8 * size;
                (((unsigned << unused) as i64) >> unused) as f64
            }
            _ => unsigned as f64,
        }))
    }

    /// Reads the next element as text: names of trajectories may be numbers.
    pub(super) fn text(&self, source: &mut impl Read) -> Result<String> {
        match self.kind {
            Kind::Text(length) => {
                let mut bytes = vec![0; 4 * length];
                source.read_exact(&mut bytes)?;
                let code = |c: &[u8]| {
                    let c = [c[0], c[1], c[2], c[3]];
                    if self.big_endian {
                        u32::from_be_bytes(c)
                    } else {
                        u32::from_le_bytes(c)
                    }
                };
                let characters = bytes.chunks_exact(4).map(code).take_while(|c| *c != 0);
                Ok(characters
                    .map(|c| char::from_u32(c).unwrap_or(char::REPLACEMENT_CHARACTER))
                    .collect())
            }
            Kind::Bytes(length) => {
                let mut bytes = vec![0; length];
                source.read_exact(&mut bytes)?;
                Ok(String::from_utf8_lossy(&bytes)
                    .trim_end_matches('\0')
                    .to_owned())
            }
            _ => Ok(self
                .number(source)?
                .map(|x| x.to_string())
                .unwrap_or_default()),
        }
    }
}

/// A readable name of a type that cannot be read.
fn described(descr: &str) -> String {
    let plain = descr.trim_start_matches(['<', '>', '|', '=']);
    match plain {
        "O" => "object".into(),
        "f2" => "float16".into(),
        "f16" | "f12" => "longdouble".into(),
        "c8" | "c16" => "complex".into(),
        _ => descr.chars().take(60).collect(),
    }
}

fn kind(descr: &str) -> Option<(Kind, bool)> {
    let big_endian = descr.starts_with('>');
    let mut characters = descr.trim_start_matches(['<', '>', '|', '=']).chars();
    let letter = characters.next()?;
    let size: usize = characters.as_str().parse().ok()?;
    let kind = match (letter, size) {
        ('f', 4 | 8) => Kind::Float(size),
        ('i', 1 | 2 | 4 | 8) => Kind::Int(size),
        ('u', 1 | 2 | 4 | 8) => Kind::Uint(size),
        ('b', 1) => Kind::Bool,
        ('U', 0..=LONGEST_TEXT) => Kind::Text(size),
        ('S', 0..=LONGEST_TEXT) => Kind::Bytes(size),
        _ => return None,
    };
    Some((kind, big_endian))
}

impl Kind {
    fn size(self) -> usize {
        match self {
            Self::Float(size) | Self::Int(size) | Self::Uint(size) | Self::Bytes(size) => size,
            Self::Bool => 1,
            Self::Text(length) => 4 * length,
        }
    }
}

/// Writes the header of an array in C order; `descr` is e.g. `<f8`.
pub(super) fn write_header(sink: &mut impl Write, descr: &str, shape: &[usize]) -> Result<()> {
    let sizes: String = shape.iter().map(|s| format!("{s}, ")).collect();
    let text = format!(
        "{{'descr': '{descr}', 'fortran_order': False, 'shape': ({}), }}",
        sizes.trim_end()
    );
    // The elements begin at a multiple of 64 bytes.
    let length = (10 + text.len() + 1).next_multiple_of(64) - 10;
    sink.write_all(b"\x93NUMPY\x01\x00")?;
    // OK because two sizes of at most 20 digits fit in 16 bits.
    sink.write_all(&u16::try_from(length).unwrap_or(u16::MAX).to_le_bytes())?;
    sink.write_all(format!("{text:<width$}\n", width = length - 1).as_bytes())?;
    Ok(())
}
