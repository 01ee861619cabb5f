//! A bounded buffer between one non-blocking writer and one reader.
//!
//! Every slot carries the number of the row that it holds, and an odd number during writing (a sequence lock).
//! The writer overwrites the oldest row without waiting; the reader detects that by the number, and counts lost rows.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering, fence};

use lagrangian::{Error, Result};

struct Shared {
    width: usize,
    /// Number of rows written.
    head: AtomicU64,
    /// 2 (row + 1) for a slot that holds a row, 2 row + 1 during writing.
    numbers: Vec<AtomicU64>,
    /// Bits of the values, `[slots, width]`.
    values: Vec<AtomicU64>,
}

/// Writing end, for the control loop.
pub struct Writer {
    shared: Arc<Shared>,
}

/// Reading end, for the learner.
pub struct Reader {
    shared: Arc<Shared>,
    next: u64,
    lost: u64,
}

/// Maximum size of a buffer, in values.
const LARGEST: usize = 1 << 26;

/// A buffer of `slots` rows of `width` values each.
///
/// # Errors
/// [`Error::Argument`] for an empty buffer or more than 2²⁶ values.
pub fn ring(slots: usize, width: usize) -> Result<(Writer, Reader)> {
    let size = slots.saturating_mul(width);
    if size == 0 || size > LARGEST {
        return Err(Error::argument(
            "ring buffer",
            format!("{slots} × {width}"),
            "at least one row, and at most 67108864 values",
        ));
    }
    let zeros = |count| (0..count).map(|_| AtomicU64::new(0)).collect();
    let shared = Arc::new(Shared {
        width,
        head: AtomicU64::new(0),
        numbers: zeros(slots),
        values: zeros(size),
    });
    let reader = Reader {
        shared: shared.clone(),
        next: 0,
        lost: 0,
    };
    Ok((Writer { shared }, reader))
}

impl Shared {
    fn slot(&self, row: u64) -> usize {
        (row % self.numbers.len() as u64) as usize
    }

    fn values(&self, slot: usize) -> &[AtomicU64] {
        &self.values[slot * self.width..(slot + 1) * self.width]
    }
}

impl Writer {
    /// Writes a row, over the oldest one if the buffer is full; never blocks or allocates. If a row is too
    /// long, only the first `width` values are written; a row that is too short leaves old values in place.
    pub fn push(&mut self, row: &[f64]) {
        let shared = &*self.shared;
        // OK because this is the only writer.
        let number = shared.head.load(Ordering::Relaxed);
        let slot = shared.slot(number);
        shared.numbers[slot].store(2 * number + 1, Ordering::Relaxed);
        fence(Ordering::Release);
        for (to, from) in shared.values(slot).iter().zip(row) {
            to.store(from.to_bits(), Ordering::Relaxed);
        }
        shared.numbers[slot].store(2 * (number + 1), Ordering::Release);
        shared.head.store(number + 1, Ordering::Release);
    }
}

impl Reader {
    /// Copies the oldest unread row to `row` and returns it; `None` if all were read.
    pub fn pop<'r>(&mut self, row: &'r mut [f64]) -> Option<&'r [f64]> {
        loop {
            let shared = &*self.shared;
            let head = shared.head.load(Ordering::Acquire);
            let oldest = head.saturating_sub(shared.numbers.len() as u64);
            if self.next < oldest {
                self.lost += oldest - self.next;
                self.next = oldest;
            }
            if self.next >= head {
                return None;
            }
            let (number, slot) = (self.next, shared.slot(self.next));
            let before = shared.numbers[slot].load(Ordering::Acquire);
            for (to, from) in row.iter_mut().zip(shared.values(slot)) {
                *to = f64::from_bits(from.load(Ordering::Relaxed));
            }
            fence(Ordering::Acquire);
            let after = shared.numbers[slot].load(Ordering::Relaxed);
            self.next += 1;
            if before == after && before == 2 * (number + 1) {
                return Some(row);
            }
            // The row was overwritten during the read.
            self.lost += 1;
        }
    }

    /// Number of rows that were overwritten before they were read.
    #[must_use]
    pub fn lost(&self) -> u64 {
        self.lost
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;

    #[test]
    fn the_oldest_rows_are_dropped_and_counted() {
        let (mut writer, mut reader) = ring(4, 2).unwrap();
        (0..10).for_each(|k| writer.push(&[f64::from(k), -f64::from(k)]));
        let mut row = [0.0; 2];
        let mut seen = Vec::new();
        while let Some(row) = reader.pop(&mut row) {
            seen.push(row[0]);
            assert!((row[0] + row[1]).abs() < 1e-300);
        }
        assert_eq!(seen, [6.0, 7.0, 8.0, 9.0]);
        assert_eq!(reader.lost(), 6);
    }

    #[test]
    fn no_row_is_torn_by_a_writer_that_overtakes() {
        let (mut writer, mut reader) = ring(8, 16).unwrap();
        let rows = 200_000u32;
        let (mut seen, mut last) = (0, -1.0);
        std::thread::scope(|scope| {
            scope.spawn(move || (0..rows).for_each(|k| writer.push(&[f64::from(k); 16])));
            let mut row = [0.0; 16];
            while last < f64::from(rows - 1) {
                if let Some(row) = reader.pop(&mut row) {
                    assert!(
                        row.iter().all(|x| x.to_bits() == row[0].to_bits()),
                        "{row:?}"
                    );
                    assert!(row[0] > last);
                    last = row[0];
                    seen += 1;
                }
            }
        });
        assert_eq!(seen + reader.lost(), u64::from(rows));
    }

    #[test]
    fn an_empty_or_endless_buffer_is_refused() {
        assert!(ring(0, 3).is_err() && ring(3, 0).is_err() && ring(usize::MAX, 2).is_err());
    }
}
