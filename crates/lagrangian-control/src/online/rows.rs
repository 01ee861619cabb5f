//! Rows from a control loop to a learner: a bounded queue whose writer neither waits nor allocates.

use std::sync::atomic::{AtomicU64, Ordering};

use crossbeam_queue::ArrayQueue;

/// A queue of rows that drops the oldest one when it is full.
pub(super) struct Rows {
    full: ArrayQueue<Box<[f64]>>,
    /// Memory for the next rows.
    empty: ArrayQueue<Box<[f64]>>,
    lost: AtomicU64,
}

impl Rows {
    /// A queue of at most `most` rows of `width` values.
    pub(super) fn new(most: usize, width: usize) -> Self {
        let (full, empty) = (ArrayQueue::new(most), ArrayQueue::new(most + 1));
        while empty.push(vec![0.0; width].into()).is_ok() {}
        Self {
            full,
            empty,
            lost: AtomicU64::new(0),
        }
    }

    /// Adds a row; values beyond its width are omitted.
    pub(super) fn push(&self, row: &[f64]) {
        // The memory of the oldest row, where the reader holds the last that is free.
        let memory = self.empty.pop().or_else(|| {
            self.lost.fetch_add(1, Ordering::Relaxed);
            self.full.pop()
        });
        let Some(mut memory) = memory else { return };
        let pairs = memory.iter_mut().zip(row);
        pairs.for_each(|(to, from)| *to = *from);
        if let Some(oldest) = self.full.force_push(memory) {
            self.lost.fetch_add(1, Ordering::Relaxed);
            let _ = self.empty.push(oldest);
        }
    }

    /// Passes the oldest row to `read`; `None` if all were read.
    pub(super) fn read<R>(&self, read: impl FnOnce(&[f64]) -> R) -> Option<R> {
        let row = self.full.pop()?;
        let result = read(&row);
        let _ = self.empty.push(row);
        Some(result)
    }

    /// The number of rows that were dropped before they were read.
    pub(super) fn lost(&self) -> u64 {
        self.lost.load(Ordering::Relaxed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_oldest_rows_are_dropped_and_counted() {
        let rows = Rows::new(4, 2);
        (0..10).for_each(|k| rows.push(&[f64::from(k), -f64::from(k)]));
        let mut seen = Vec::new();
        while let Some([k, negative]) = rows.read(|row| [row[0], row[1]]) {
            seen.push(k);
            assert!((k + negative).abs() < 1e-300);
        }
        assert_eq!(seen, [6.0, 7.0, 8.0, 9.0]);
        assert_eq!(rows.lost(), 6);
    }

    #[test]
    fn no_row_is_torn_by_a_writer_that_overtakes() {
        let rows = Rows::new(8, 16);
        let count = 200_000u32;
        let (mut seen, mut last) = (0, -1.0);
        std::thread::scope(|scope| {
            scope.spawn(|| (0..count).for_each(|k| rows.push(&[f64::from(k); 16])));
            while last < f64::from(count - 1) {
                rows.read(|row| {
                    assert!(
                        row.iter().all(|x| x.to_bits() == row[0].to_bits()),
                        "{row:?}"
                    );
                    assert!(row[0] > last);
                    last = row[0];
                    seen += 1;
                });
            }
        });
        assert_eq!(seen + rows.lost(), u64::from(count));
    }
}
