//! A joint state in the serialisation of ROS 2: Common Data Representation (OMG, DDS-XTypes 1.3, §7.4; `PLAIN_CDR`).

/// The first bytes of a compressed message (RFC 8878, §3.1.1).
const ZSTD: [u8; 4] = [0x28, 0xb5, 0x2f, 0xfd];

/// Number of bytes that a serialiser may add after the last value.
const PADDING: usize = 8;

/// A message `sensor_msgs/msg/JointState`; its arrays are empty or have a value for each name.
#[derive(Debug, PartialEq)]
pub(super) struct JointState<'a> {
    /// Time stamp of its header, ns.
    pub(super) stamp: i64,
    pub(super) names: Vec<&'a str>,
    pub(super) position: Vec<f64>,
    pub(super) velocity: Vec<f64>,
    pub(super) effort: Vec<f64>,
}

impl<'a> JointState<'a> {
    /// Decodes a message; the error describes the fault.
    pub(super) fn decode(bytes: &'a [u8]) -> Result<Self, String> {
        let mut cursor = Cursor::new(bytes)?;
        let (seconds, nanoseconds) = (cursor.i32()?, cursor.u32()?);
        cursor.text()?;
        let names = cursor.texts()?;
        let state = Self {
            stamp: i64::from(seconds) * 1_000_000_000 + i64::from(nanoseconds),
            position: cursor.numbers()?,
            velocity: cursor.numbers()?,
            effort: cursor.numbers()?,
            names,
        };
        if cursor.rest.len() >= PADDING {
            return Err(format!(
                "it has {} bytes too many for a joint state",
                cursor.rest.len()
            ));
        }
        state.checked()
    }

    fn checked(self) -> Result<Self, String> {
        let n = self.names.len();
        for (what, values) in [
            ("positions", &self.position),
            ("velocities", &self.velocity),
            ("efforts", &self.effort),
        ] {
            if !values.is_empty() && values.len() != n {
                return Err(format!("it has {} {what} for {n} joints", values.len()));
            }
        }
        let mut names = self.names.clone();
        names.sort_unstable();
        if names.first().is_some_and(|name| name.is_empty()) {
            return Err("it has a joint without a name".into());
        }
        match names.windows(2).find(|pair| pair[0] == pair[1]) {
            Some(pair) => Err(format!("it names joint '{}' twice", pair[0])),
            None => Ok(self),
        }
    }
}

/// The unread bytes, and their byte order.
struct Cursor<'a> {
    rest: &'a [u8],
    /// Number of bytes read after the encapsulation, the origin of alignment.
    position: usize,
    little_endian: bool,
}

impl<'a> Cursor<'a> {
    fn new(bytes: &'a [u8]) -> Result<Self, String> {
        let Some((kind, rest)) = bytes.split_first_chunk::<4>() else {
            return Err(format!("it has only {} bytes", bytes.len()));
        };
        let little_endian = match kind {
            [0, 0, ..] => false,
            [0, 1, ..] => true,
            kind if *kind == ZSTD => {
                let remedy = "write the bag again without compression, by `ros2 bag convert`";
                return Err(format!("it is compressed by itself: {remedy}"));
            }
            [a, b, ..] => {
                return Err(format!("its encoding {a:02x}{b:02x} is not plain CDR"));
            }
        };
        Ok(Self {
            rest,
            position: 0,
            little_endian,
        })
    }

    /// The next `count` bytes.
    fn take(&mut self, count: usize) -> Result<&'a [u8], String> {
        let (taken, rest) = self
            .rest
            .split_at_checked(count)
            .ok_or("it ends in the middle of a joint state")?;
        self.rest = rest;
        self.position += count;
        Ok(taken)
    }

    /// A little-endian number of `N` bytes, after alignment.
    fn number<const N: usize>(&mut self) -> Result<[u8; N], String> {
        self.take(self.position.next_multiple_of(N) - self.position)?;
        let mut bytes = [0; N];
        bytes.copy_from_slice(self.take(N)?);
        if !self.little_endian {
            bytes.reverse();
        }
        Ok(bytes)
    }

    fn i32(&mut self) -> Result<i32, String> {
        self.number().map(i32::from_le_bytes)
    }

    fn u32(&mut self) -> Result<u32, String> {
        self.number().map(u32::from_le_bytes)
    }

    /// Number of elements that follow, of at least `least` bytes each; the claimed number must fit into the message.
    fn count(&mut self, least: usize) -> Result<usize, String> {
        let count = self.u32()? as usize;
        match count <= self.rest.len() / least {
            true => Ok(count),
            false => Err(format!(
                "it claims {count} values where {} bytes are left",
                self.rest.len()
            )),
        }
    }

    /// A string, which ends in a zero byte.
    fn text(&mut self) -> Result<&'a str, String> {
        let length = self.count(1)?;
        let bytes = self.take(length)?;
        let bytes = bytes.strip_suffix(&[0]).unwrap_or(bytes);
        std::str::from_utf8(bytes).map_err(|_| "a name in it is not UTF-8 text".into())
    }

    fn texts(&mut self) -> Result<Vec<&'a str>, String> {
        let count = self.count(4)?;
        (0..count).map(|_| self.text()).collect()
    }

    fn numbers(&mut self) -> Result<Vec<f64>, String> {
        let count = self.count(8)?;
        let number = |_| self.number().map(f64::from_le_bytes);
        (0..count).map(number).collect()
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;

    /// Stamp 1 s 2 ns, frame "x", one joint "ab" at 0.5 without velocity, effort −2.
    const LITTLE: &[u8] = &[
        0, 1, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0, 2, 0, 0, 0, b'x', 0, 7, 7, 1, 0, 0, 0, 3, 0, 0, 0,
        b'a', b'b', 0, 7, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xe0, 0x3f, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0xc0,
    ];

    const BIG: &[u8] = &[
        0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0, 2, b'x', 0, 7, 7, 0, 0, 0, 1, 0, 0, 0, 3,
        b'a', b'b', 0, 7, 0, 0, 0, 1, 0x3f, 0xe0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0xc0,
        0, 0, 0, 0, 0, 0, 0,
    ];

    #[test]
    fn both_orders_of_bytes_give_the_same_message() {
        let expected = JointState {
            stamp: 1_000_000_002,
            names: vec!["ab"],
            position: vec![0.5],
            velocity: vec![],
            effort: vec![-2.0],
        };
        assert_eq!(JointState::decode(LITTLE).unwrap(), expected);
        assert_eq!(JointState::decode(BIG).unwrap(), expected);
    }

    #[test]
    fn a_message_that_is_cut_or_claims_too_much_is_refused() {
        for end in 0..LITTLE.len() {
            assert!(JointState::decode(&LITTLE[..end]).is_err(), "{end}");
        }
        let mut claims = LITTLE.to_vec();
        claims[20..24].copy_from_slice(&[0xff; 4]);
        assert!(JointState::decode(&claims).unwrap_err().contains("claims"));
        let long = [LITTLE, &[0; 8]].concat();
        assert!(JointState::decode(&long).unwrap_err().contains("too many"));
    }

    #[test]
    fn a_compressed_message_says_what_to_do() {
        let message = JointState::decode(&[0x28, 0xb5, 0x2f, 0xfd, 1]).unwrap_err();
        assert!(message.contains("ros2 bag convert"), "{message}");
    }
}
