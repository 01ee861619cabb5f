//! Two vectors side by side, where a register holds less than 64 bytes.

use super::{Arithmetic, Memory, Vector};
use crate::simd::sealed::Sealed;

/// Operations that act on both vectors alike.
macro_rules! both {
    ($($operation:ident($($other:ident),*)),*) => {$(
        #[inline(always)]
        fn $operation(self $(, $other: Self)*) -> Self {
            Self(self.0.$operation($($other.0),*), self.1.$operation($($other.1),*))
        }
    )*};
}

/// The lanes of the first vector, then those of the second.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pair<V>(V, V);

impl<V: Vector> Sealed for Pair<V> {}

impl<V: Vector> Memory for Pair<V> {
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
}

impl<V: Vector> Arithmetic for Pair<V> {
    both!(add(b), sub(b), mul(b), div(b), fma(b, c), sqrt(), max(b));
}

impl<V: Vector> Vector for Pair<V> {
    both!(if_non_negative(yes, no), pow2_of_shifted());
    #[inline(always)]
    fn zip(self, b: Self) -> (Self, Self) {
        let (low, high) = (self.0.zip(b.0), self.1.zip(b.1));
        (Self(low.0, low.1), Self(high.0, high.1))
    }
}
