//! Allocation of vectors in one array, where memory is reused once a vector is no longer needed.

use std::collections::HashMap;

use lagrangian::expression::Id;

/// The offsets of vectors.
#[derive(Debug, Default)]
pub(crate) struct Places {
    /// The offset of each vector.
    pub(crate) of: HashMap<Id, usize>,
    /// Count of numbers in the array.
    pub(crate) numbers: usize,
    /// Allocated ranges, ordered by offset: offset, length, and the last statement that needs them.
    taken: Vec<(usize, usize, usize)>,
}

impl Places {
    /// Frees all ranges that neither this statement nor a later one needs.
    pub(crate) fn free_before(&mut self, statement: usize) {
        self.taken.retain(|(_, _, last)| *last >= statement);
    }

    /// Allocates the first gap that is long enough, until after the statement `last`.
    pub(crate) fn take(&mut self, id: Id, length: usize, last: usize) {
        let mut at = 0;
        let mut position = self.taken.len();
        for (k, (first, taken, _)) in self.taken.iter().enumerate() {
            if at + length <= *first {
                position = k;
                break;
            }
            at = first + taken;
        }
        self.taken.insert(position, (at, length, last));
        self.numbers = self.numbers.max(at + length);
        self.of.insert(id, at);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gaps_are_used_again_and_nothing_overlaps() {
        let mut places = Places::default();
        places.take(0, 4, 2);
        places.take(1, 3, 9);
        places.free_before(3);
        places.take(2, 2, 9);
        places.take(3, 2, 9);
        places.take(4, 1, 9);
        let of = |id: Id| places.of[&id];
        assert_eq!((of(0), of(1), of(2), of(3), of(4)), (0, 4, 0, 2, 7));
        assert_eq!(places.numbers, 8);
    }
}
