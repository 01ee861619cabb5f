//! Two vectors side by side, where a register holds less than 64 bytes.

use super::Vector;
use crate::simd::sealed::Sealed;

/// The lanes of the first vector, then those of the second.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pair<V>(V, V);

impl<V: Vector> Sealed for Pair<V> {}

impl<V: Vector> Vector for Pair<V> {
    type Elem = V::Elem;
    const LANES: usize = 2 * V::LANES;

    #[inline(always)]
    unsafe fn load_ptr(p: *const Self::Elem) -> Self {
        // SAFETY: the caller's.
        unsafe { Self(V::load_ptr(p), V::load_ptr(p.add(V::LANES))) }
    }
    #[inline(always)]
    unsafe fn store_ptr(self, p: *mut Self::Elem) {
        // SAFETY: the caller's.
        unsafe {
            self.0.store_ptr(p);
            self.1.store_ptr(p.add(V::LANES));
        }
    }
    #[inline(always)]
    fn splat(x: Self::Elem) -> Self {
        Self(V::splat(x), V::splat(x))
    }
    #[inline(always)]
    fn add(self, b: Self) -> Self {
        Self(self.0.add(b.0), self.1.add(b.1))
    }
    #[inline(always)]
    fn sub(self, b: Self) -> Self {
        Self(self.0.sub(b.0), self.1.sub(b.1))
    }
    #[inline(always)]
    fn mul(self, b: Self) -> Self {
        Self(self.0.mul(b.0), self.1.mul(b.1))
    }
    #[inline(always)]
    fn div(self, b: Self) -> Self {
        Self(self.0.div(b.0), self.1.div(b.1))
    }
    #[inline(always)]
    fn fma(self, b: Self, c: Self) -> Self {
        Self(self.0.fma(b.0, c.0), self.1.fma(b.1, c.1))
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(self.0.sqrt(), self.1.sqrt())
    }
    #[inline(always)]
    fn max(self, b: Self) -> Self {
        Self(self.0.max(b.0), self.1.max(b.1))
    }
    #[inline(always)]
    fn min(self, b: Self) -> Self {
        Self(self.0.min(b.0), self.1.min(b.1))
    }
    #[inline(always)]
    fn if_non_negative(self, yes: Self, no: Self) -> Self {
        Self(
            self.0.if_non_negative(yes.0, no.0),
            self.1.if_non_negative(yes.1, no.1),
        )
    }
    #[inline(always)]
    fn pow2_of_shifted(self) -> Self {
        Self(self.0.pow2_of_shifted(), self.1.pow2_of_shifted())
    }
    #[inline(always)]
    fn zip(self, b: Self) -> (Self, Self) {
        let (low, high) = (self.0.zip(b.0), self.1.zip(b.1));
        (Self(low.0, low.1), Self(high.0, high.1))
    }
}
