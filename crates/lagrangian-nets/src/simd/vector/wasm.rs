//! Vectors of WebAssembly with the feature `simd128`, which every browser since 2023 has.
#![allow(
    unused_unsafe,
    reason = "these intrinsics are safe but for loads and stores, and `register!` serves other instruction sets too"
)]

use std::arch::wasm32::*;

use super::register::register;
use super::{Arithmetic, Memory, Vector};

register!(
    F32x4,
    v128,
    f32,
    4,
    load,
    store,
    f32x4_splat,
    f32x4_add,
    f32x4_sub,
    f32x4_mul,
    f32x4_div,
    |a, b, c| multiply_add_f32(a, b, c),
    f32x4_sqrt,
    larger_f32,
    |s, yes, no| v128_bitselect(yes, no, f32x4_ge(s, f32x4_splat(0.0))),
    |x| i32x4_shl(i32x4_add(x, i32x4_splat(127)), 23),
    |a, b| (
        i32x4_shuffle::<0, 4, 1, 5>(a, b),
        i32x4_shuffle::<2, 6, 3, 7>(a, b)
    )
);
register!(
    F64x2,
    v128,
    f64,
    2,
    load,
    store,
    f64x2_splat,
    f64x2_add,
    f64x2_sub,
    f64x2_mul,
    f64x2_div,
    |a, b, c| multiply_add_f64(a, b, c),
    f64x2_sqrt,
    larger_f64,
    |s, yes, no| v128_bitselect(yes, no, f64x2_ge(s, f64x2_splat(0.0))),
    |x| i64x2_shl(i64x2_add(x, i64x2_splat(1023)), 52),
    |a, b| (i64x2_shuffle::<0, 2>(a, b), i64x2_shuffle::<1, 3>(a, b))
);

/// Sixteen bytes from any address.
#[inline(always)]
unsafe fn load<T>(p: *const T) -> v128 {
    // SAFETY: the caller's; the instruction takes any alignment.
    unsafe { v128_load(p.cast()) }
}

/// Sixteen bytes to any address.
#[inline(always)]
unsafe fn store<T>(p: *mut T, value: v128) {
    // SAFETY: as above.
    unsafe { v128_store(p.cast(), value) }
}

/// The larger of a and b, and b where a is NaN: the pseudo-maximum, which is b < a ? a : b, with its operands exchanged.
#[inline(always)]
fn larger_f32(a: v128, b: v128) -> v128 {
    f32x4_pmax(b, a)
}

/// As [`larger_f32`].
#[inline(always)]
fn larger_f64(a: v128, b: v128) -> v128 {
    f64x2_pmax(b, a)
}

/// a · b + c, with `relaxed-simd` rounded once where the processor of the browser can, else twice.
#[inline(always)]
fn multiply_add_f32(a: v128, b: v128, c: v128) -> v128 {
    #[cfg(target_feature = "relaxed-simd")]
    return f32x4_relaxed_madd(a, b, c);
    #[cfg(not(target_feature = "relaxed-simd"))]
    return f32x4_add(f32x4_mul(a, b), c);
}

/// As [`multiply_add_f32`].
#[inline(always)]
fn multiply_add_f64(a: v128, b: v128, c: v128) -> v128 {
    #[cfg(target_feature = "relaxed-simd")]
    return f64x2_relaxed_madd(a, b, c);
    #[cfg(not(target_feature = "relaxed-simd"))]
    return f64x2_add(f64x2_mul(a, b), c);
}
