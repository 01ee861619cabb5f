//! A single value as a vector of one lane, so that algebra written over vectors serves one state too. It needs no
//! particular instructions and may be used outside of kernels.

use super::{Arithmetic, Memory, Vector};

macro_rules! scalar {
    ($($operation:ident($a:ident $(, $other:ident)*) => $value:expr;)*) => {$(
        #[inline(always)]
        fn $operation(self $(, $other: Self)*) -> Self {
            let $a = self;
            $value
        }
    )*};
}

impl Memory for f64 {
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
}

impl Arithmetic for f64 {
    scalar! {
        add(a, b) => a + b;
        sub(a, b) => a - b;
        mul(a, b) => a * b;
        div(a, b) => a / b;
        // Two roundings: without the instruction, `mul_add` is a slow library call.
        fma(a, b, c) => a * b + c;
        sqrt(a) => Self::sqrt(a);
        max(a, b) => if a > b { a } else { b };
    }
}

impl Vector for f64 {
    scalar! {
        if_non_negative(a, yes, no) => if a >= 0.0 { yes } else { no };
        pow2_of_shifted(a) => Self::from_bits(a.to_bits().wrapping_add(1023) << 52);
    }
    #[inline(always)]
    fn zip(self, b: Self) -> (Self, Self) {
        (self, b)
    }
}
