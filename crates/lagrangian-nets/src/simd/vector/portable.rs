//! Vectors as plain arrays, for CPUs with unknown instructions.

use super::{Arithmetic, Memory, Vector};
use crate::simd::sealed::Sealed;

/// An array of lanes, vectorised by the compiler where possible.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Lanes<T, const N: usize>([T; N]);

impl<T, const N: usize> Sealed for Lanes<T, N> {}

/// Operations lane by lane.
macro_rules! lanes {
    ($($operation:ident($a:ident $(, $other:ident)*) => $value:expr;)*) => {$(
        #[inline(always)]
        fn $operation(self $(, $other: Self)*) -> Self {
            Self(std::array::from_fn(|i| {
                let $a = self.0[i];
                $(let $other = $other.0[i];)*
                $value
            }))
        }
    )*};
}

macro_rules! portable {
    ($elem:ty, $n:literal, $bits:ty, $bias:literal, $shift:literal) => {
        impl Memory for Lanes<$elem, $n> {
            type Elem = $elem;
            const LANES: usize = $n;
            #[inline(always)]
            unsafe fn load_ptr(p: *const $elem) -> Self {
                // SAFETY: the caller's.
                Self(unsafe { p.cast::<[$elem; $n]>().read_unaligned() })
            }
            #[inline(always)]
            unsafe fn store_ptr(self, p: *mut $elem) {
                // SAFETY: the caller's.
                unsafe { p.cast::<[$elem; $n]>().write_unaligned(self.0) }
            }
            #[inline(always)]
            fn splat(x: $elem) -> Self {
                Self([x; $n])
            }
        }

        impl Arithmetic for Lanes<$elem, $n> {
            lanes! {
                add(a, b) => a + b;
                sub(a, b) => a - b;
                mul(a, b) => a * b;
                div(a, b) => a / b;
                // Two roundings: without the instruction, `mul_add` is a slow library call.
                fma(a, b, c) => a * b + c;
                sqrt(a) => num_traits::Float::sqrt(a);
                max(a, b) => if a > b { a } else { b };
            }
        }

        impl Vector for Lanes<$elem, $n> {
            lanes! {
                if_non_negative(a, yes, no) => if a >= 0.0 { yes } else { no };
            }
            #[inline(always)]
            fn pow2_of_shifted(self) -> Self {
                Self(
                    self.0
                        .map(|x| <$elem>::from_bits(x.to_bits().wrapping_add($bias) << $shift)),
                )
            }
            #[inline(always)]
            fn zip(self, b: Self) -> (Self, Self) {
                let of = |i: usize| {
                    if i % 2 == 0 {
                        self.0[i / 2]
                    } else {
                        b.0[i / 2]
                    }
                };
                let half = |first: usize| Self(std::array::from_fn(|i| of(first + i)));
                (half(0), half($n))
            }
        }
    };
}
portable!(f32, 16, u32, 127, 23);
portable!(f64, 8, u64, 1023, 52);
