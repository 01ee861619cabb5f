//! A single value as a vector of one lane, so that algebra written over vectors serves one state too. It needs no
//! particular instructions and may be used outside of kernels.

use super::Vector;

impl Vector for f64 {
    type Elem = Self;
    const LANES: usize = 1;
    #[inline(always)]
    unsafe fn load_ptr(p: *const Self) -> Self {
        // SAFETY: the caller's.
        unsafe { p.read() }
    }
    #[inline(always)]
    unsafe fn store_ptr(self, p: *mut Self) {
        // SAFETY: the caller's.
        unsafe { p.write(self) }
    }
    #[inline(always)]
    fn splat(x: Self) -> Self {
        x
    }
    #[inline(always)]
    fn add(self, b: Self) -> Self {
        self + b
    }
    #[inline(always)]
    fn sub(self, b: Self) -> Self {
        self - b
    }
    #[inline(always)]
    fn mul(self, b: Self) -> Self {
        self * b
    }
    #[inline(always)]
    fn div(self, b: Self) -> Self {
        self / b
    }
    #[inline(always)]
    fn fma(self, b: Self, c: Self) -> Self {
        // Two roundings: without the instruction, `mul_add` is a slow library call.
        self * b + c
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Self::sqrt(self)
    }
    #[inline(always)]
    fn max(self, b: Self) -> Self {
        if self > b { self } else { b }
    }
    #[inline(always)]
    fn min(self, b: Self) -> Self {
        if self < b { self } else { b }
    }
    #[inline(always)]
    fn if_non_negative(self, yes: Self, no: Self) -> Self {
        if self >= 0.0 { yes } else { no }
    }
    #[inline(always)]
    fn pow2_of_shifted(self) -> Self {
        Self::from_bits(self.to_bits().wrapping_add(1023) << 52)
    }
    #[inline(always)]
    fn zip(self, b: Self) -> (Self, Self) {
        (self, b)
    }
}
