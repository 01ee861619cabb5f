//! Loops on all cores. Where there are no threads, as in a browser, on the one there is, and without the code of a pool, which would be a
//! fifteenth of what every visitor of a page loads.

#[cfg(not(target_family = "wasm"))]
pub use rayon::{current_num_threads, current_thread_index, prelude, scope};

#[cfg(target_family = "wasm")]
pub use alone::{current_num_threads, current_thread_index, prelude, scope};

/// The same names for loops on one core.
#[cfg(target_family = "wasm")]
#[allow(missing_docs, reason = "the names are those of rayon")]
mod alone {
    pub fn current_num_threads() -> usize {
        1
    }

    pub fn current_thread_index() -> Option<usize> {
        None
    }

    pub fn scope<R>(run: impl FnOnce(&()) -> R) -> R {
        run(&())
    }

    pub mod prelude {
        use std::slice::{Chunks, ChunksExact, ChunksMut, Iter, IterMut};

        pub trait IntoParallelIterator: IntoIterator + Sized {
            fn into_par_iter(self) -> Self::IntoIter {
                self.into_iter()
            }
        }

        impl<I: IntoIterator> IntoParallelIterator for I {}

        pub trait ParallelSlice<T> {
            fn par_iter(&self) -> Iter<'_, T>;
            fn par_iter_mut(&mut self) -> IterMut<'_, T>;
            fn par_chunks(&self, size: usize) -> Chunks<'_, T>;
            fn par_chunks_exact(&self, size: usize) -> ChunksExact<'_, T>;
            fn par_chunks_mut(&mut self, size: usize) -> ChunksMut<'_, T>;
        }

        impl<T> ParallelSlice<T> for [T] {
            fn par_iter(&self) -> Iter<'_, T> {
                self.iter()
            }

            fn par_iter_mut(&mut self) -> IterMut<'_, T> {
                self.iter_mut()
            }

            fn par_chunks(&self, size: usize) -> Chunks<'_, T> {
                self.chunks(size)
            }

            fn par_chunks_exact(&self, size: usize) -> ChunksExact<'_, T> {
                self.chunks_exact(size)
            }

            fn par_chunks_mut(&mut self, size: usize) -> ChunksMut<'_, T> {
                self.chunks_mut(size)
            }
        }

        pub trait ParallelIterator: Iterator + Sized {
            fn flat_map_iter<U: IntoIterator>(
                self,
                of: impl FnMut(Self::Item) -> U,
            ) -> impl Iterator<Item = U::Item> {
                self.flat_map(of)
            }

            fn for_each_init<S>(
                self,
                init: impl FnOnce() -> S,
                mut run: impl FnMut(&mut S, Self::Item),
            ) {
                let mut state = init();
                self.for_each(|item| run(&mut state, item));
            }

            fn reduce_with(
                self,
                of: impl FnMut(Self::Item, Self::Item) -> Self::Item,
            ) -> Option<Self::Item> {
                self.reduce(of)
            }

            fn with_min_len(self, _: usize) -> Self {
                self
            }
        }

        impl<I: Iterator> ParallelIterator for I {}
    }
}
