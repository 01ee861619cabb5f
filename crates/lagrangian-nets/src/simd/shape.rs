//! Memory layout of the components of a layer.
//!
//! The components of a block of B samples are stored below each other in every panel: row `c · B + s` belongs to component c
//! of sample s. Component 0 is the value, 1 the tangent ′, followed by the tangents i and the mixed second derivatives
//! i′ (theory.md, section 5).

use super::{Real, Vector};

/// Sizes of the matrices of one layer, `[panels, components · samples, LANES]`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Shape {
    /// Number of samples of the block.
    pub samples: usize,
    /// Number of components that the matrices hold, 2 + 2 · `capacity`.
    pub components: usize,
    /// Number of tangents i that the matrices hold: i is component 2 + i, i′ is component 2 + `capacity` + i.
    pub capacity: usize,
    /// Number of panels of the layer.
    pub panels: usize,
}

impl Shape {
    /// Number of rows of a panel.
    #[cfg(test)]
    pub(crate) fn rows(&self) -> usize {
        self.components * self.samples
    }

    #[inline(always)]
    pub(super) fn at<T: Real>(&self, panel: usize, component: usize, sample: usize) -> usize {
        ((panel * self.components + component) * self.samples + sample) * T::LANES
    }
    #[inline(always)]
    pub(super) fn slope<T: Real>(&self, panel: usize, sample: usize) -> usize {
        (panel * self.samples + sample) * T::LANES
    }
    #[inline(always)]
    pub(super) fn mixed(&self, i: usize) -> usize {
        2 + self.capacity + i
    }

    /// Panics unless a matrix holds all panels, and each of them components below `end`.
    #[inline(always)]
    pub(super) fn check<T: Real>(&self, matrix: &[T], end: usize) {
        assert!(end <= self.components);
        assert!(self.panels * self.components * self.samples * T::LANES <= matrix.len());
    }

    /// As [`Shape::check`], for a matrix with one component.
    #[inline(always)]
    pub(super) fn check_slope<T: Real>(&self, slope: &[T]) {
        assert!(self.panels * self.samples * T::LANES <= slope.len());
    }
}

/// Loads the vector `offset` values after a pointer.
///
/// # Safety
/// The vector must lie inside the allocation of the pointer.
#[inline(always)]
pub(super) unsafe fn load<V: Vector>(from: *const V::Elem, offset: usize) -> V {
    // SAFETY: the caller's.
    unsafe { V::load_ptr(from.add(offset)) }
}
