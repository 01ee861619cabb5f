//! One register of the CPU as a [`Vector`](super::Vector), written once for all instruction sets.

/// Defines a vector `$name` around the register type `$v` of `$n` lanes, from the intrinsics of its instruction set.
///
/// The type is private to the crate, so that a value of it exists only below an entry that has detected the CPU feature.
macro_rules! register {
    ($name:ident, $v:ty, $elem:ty, $n:literal, $load:ident, $store:ident, $splat:ident, $add:ident, $sub:ident,
     $mul:ident, $div:ident, |$a:ident, $b:ident, $c:ident| $fma:expr, $sqrt:ident, $max:ident,
     |$s:ident, $yes:ident, $no:ident| $select:expr, |$x:ident| $pow2:expr,
     |$first:ident, $second:ident| $zip:expr) => {
        #[doc = concat!("The register `", stringify!($v), "`.")]
        #[derive(Debug, Clone, Copy)]
        pub(crate) struct $name($v);

        impl $crate::simd::sealed::Sealed for $name {}

        impl Memory for $name {
            type Elem = $elem;
            const LANES: usize = $n;
            #[inline(always)]
            unsafe fn load_ptr(p: *const $elem) -> Self {
                // SAFETY: the caller's; inlined below an entry that has detected the CPU feature.
                Self(unsafe { $load(p) })
            }
            #[inline(always)]
            unsafe fn store_ptr(self, p: *mut $elem) {
                // SAFETY: as above.
                unsafe { $store(p, self.0) }
            }
            #[inline(always)]
            fn splat(x: $elem) -> Self {
                // SAFETY: as above.
                Self(unsafe { $splat(x) })
            }
        }

        impl Arithmetic for $name {
            $crate::simd::vector::register::binary!(add: $add, sub: $sub, mul: $mul, div: $div, max: $max);
            #[inline(always)]
            fn sqrt(self) -> Self {
                // SAFETY: as above.
                Self(unsafe { $sqrt(self.0) })
            }
            #[inline(always)]
            fn fma(self, b: Self, c: Self) -> Self {
                let ($a, $b, $c) = (self.0, b.0, c.0);
                // SAFETY: as above.
                Self(unsafe { $fma })
            }
        }

        impl Vector for $name {
            #[inline(always)]
            fn if_non_negative(self, yes: Self, no: Self) -> Self {
                let ($s, $yes, $no) = (self.0, yes.0, no.0);
                // SAFETY: as above.
                Self(unsafe { $select })
            }
            #[inline(always)]
            fn pow2_of_shifted(self) -> Self {
                let $x = self.0;
                // SAFETY: as above.
                Self(unsafe { $pow2 })
            }
            #[inline(always)]
            fn zip(self, b: Self) -> (Self, Self) {
                let ($first, $second) = (self.0, b.0);
                // SAFETY: as above.
                let (low, high) = unsafe { $zip };
                (Self(low), Self(high))
            }
        }
    };
}
pub(super) use register;

/// Operations on two registers by one intrinsic each.
macro_rules! binary {
    ($($operation:ident: $intrinsic:ident),*) => {$(
        #[inline(always)]
        fn $operation(self, b: Self) -> Self {
            // SAFETY: inlined below an entry that has detected the CPU feature.
            Self(unsafe { $intrinsic(self.0, b.0) })
        }
    )*};
}
pub(super) use binary;
