//! Kernels over vectors of 64 bytes, compiled for each instruction set and chosen when the program runs.
//!
//! A kernel is a [`Task`], written once over an instruction set [`Isa`]; [`dispatch`] runs it with AVX-512, AVX2 with
//! FMA, NEON, the vectors of WebAssembly or portable code. Everything below this entry is `#[inline(always)]`, so that it is compiled with the
//! instructions of the entry; without them a fused multiply-add is a library call, thirty times slower.
//!
//! This is the only module with `unsafe` code: loads and stores of vectors, buffers aligned to 64 bytes, and calls of
//! functions compiled for CPU features that have been detected. Every kernel checks the lengths of its slices before
//! the first load. The traits are sealed, and the types of vectors private, so that code outside can have a vector only
//! inside a [`Task`] that `dispatch` runs.
#![allow(
    unsafe_code,
    reason = "CPU vector instructions; every other module is safe"
)]

mod activate;
mod buffer;
mod circle;
mod combine;
mod contract;
mod factors;
mod gates;
mod gemm;
mod level;
mod planes;
mod rows;
mod sensitivity;
mod shape;
#[cfg(test)]
mod tests;
mod update;
mod vector;

pub(crate) use activate::{PointForward, PointSecond, PointTangent};
pub use buffer::Buffer;
pub use circle::{LARGEST_ANGLE, sin_cos};
pub(crate) use combine::Combine;
pub(crate) use contract::Contract;
pub(crate) use factors::{GramTile, RowDots, WeighRows};
pub(crate) use gates::{GateForward, GateReverse, Gates};
pub(crate) use gemm::{Gemm, Init};
pub use level::{Level, level, levels, set_level};
pub(crate) use planes::{FromPlanes, ToPlanes};
pub use planes::{Planes, set_vector, vector};
pub(crate) use rows::{Rows, Weights, collect, contract, product, pull};
pub(crate) use sensitivity::{PointReverse2, PointReverseTangents};
pub(crate) use shape::Shape;
pub use update::{AdamRule, AdamStep};
pub(crate) use update::{AddTo, SumOfSquares, SumRows};
pub use vector::{Arithmetic, Memory, Real, Vector};

#[cfg(not(all(target_arch = "wasm32", target_feature = "simd128")))]
use vector::Lanes;
pub(crate) use vector::Pair;

/// Prevents implementations of the traits of this module elsewhere: kernels rely on them for their safety.
mod sealed {
    /// Implemented in this crate only.
    pub trait Sealed {}
}

/// One set of CPU instructions: its vectors of 64 bytes, and the tile of the matrix product that fits its registers.
pub trait Isa: Copy + sealed::Sealed {
    /// Vector of 16 values in single precision.
    type F32: Vector<Elem = f32>;
    /// Vector of 8 values in double precision.
    type F64: Vector<Elem = f64>;
    /// Number of panels, each 64 bytes wide, that one register tile of the matrix product spans.
    const TILE_PANELS: usize;
    /// Maximum number of rows of a register tile of one panel.
    const TILE_ROWS: usize = 4;
    /// Sums of the lanes of eight vectors, sum i in lane i.
    #[inline(always)]
    fn sums(vectors: [Self::F64; 8]) -> Self::F64 {
        Self::F64::load(&vectors.map(Vector::sum))
    }
}

/// A kernel that can be compiled for every instruction set.
pub trait Task {
    /// Runs the kernel with one instruction set. Implementations must be `#[inline(always)]` to use it.
    fn run<I: Isa>(self);
}

/// Runs a kernel with the instructions of [`level()`]: the fastest of the CPU, unless the program chose others.
#[inline]
pub fn dispatch<K: Task>(task: K) {
    dispatch_on(level(), task);
}

/// Runs a kernel with the instructions of `level`, which must be one of [`levels`].
#[inline]
pub(crate) fn dispatch_on<K: Task>(level: Level, task: K) {
    match level {
        #[cfg(not(all(target_arch = "wasm32", target_feature = "simd128")))]
        Level::Portable => task.run::<Portable>(),
        // SAFETY: `level` and `levels` return only detected levels of the CPU, and `level` comes from one of them.
        #[cfg(target_arch = "x86_64")]
        Level::Avx2 => unsafe { enter_avx2(task) },
        // SAFETY: as above.
        #[cfg(target_arch = "x86_64")]
        Level::Avx512 => unsafe { enter_avx512(task) },
        #[cfg(target_arch = "aarch64")]
        Level::Neon => task.run::<Neon>(),
        #[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
        Level::Simd128 => task.run::<Simd128>(),
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
unsafe fn enter_avx2<K: Task>(task: K) {
    task.run::<Avx2>();
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512dq,avx2,fma")]
unsafe fn enter_avx512<K: Task>(task: K) {
    task.run::<Avx512>();
}

/// Portable code, which the compiler vectorises as it can.
#[cfg(not(all(target_arch = "wasm32", target_feature = "simd128")))]
#[derive(Debug, Clone, Copy)]
pub(crate) struct Portable;
#[cfg(not(all(target_arch = "wasm32", target_feature = "simd128")))]
impl sealed::Sealed for Portable {}
#[cfg(not(all(target_arch = "wasm32", target_feature = "simd128")))]
impl Isa for Portable {
    type F32 = Lanes<f32, 16>;
    type F64 = Lanes<f64, 8>;
    const TILE_PANELS: usize = 1;
}

/// AVX2 with FMA.
#[cfg(target_arch = "x86_64")]
#[derive(Debug, Clone, Copy)]
pub(crate) struct Avx2;
#[cfg(target_arch = "x86_64")]
impl sealed::Sealed for Avx2 {}
#[cfg(target_arch = "x86_64")]
impl Isa for Avx2 {
    type F32 = vector::Pair<vector::F32x8>;
    type F64 = vector::Pair<vector::F64x4>;
    const TILE_PANELS: usize = 1;
}

/// AVX-512 F and DQ.
#[cfg(target_arch = "x86_64")]
#[derive(Debug, Clone, Copy)]
pub(crate) struct Avx512;
#[cfg(target_arch = "x86_64")]
impl sealed::Sealed for Avx512 {}
#[cfg(target_arch = "x86_64")]
impl Isa for Avx512 {
    type F32 = vector::F32x16;
    type F64 = vector::F64x8;
    const TILE_PANELS: usize = 2;
    #[inline(always)]
    fn sums(vectors: [Self::F64; 8]) -> Self::F64 {
        vector::sums_of_eight(vectors)
    }
}

/// NEON.
#[cfg(target_arch = "aarch64")]
#[derive(Debug, Clone, Copy)]
pub(crate) struct Neon;
#[cfg(target_arch = "aarch64")]
impl sealed::Sealed for Neon {}
#[cfg(target_arch = "aarch64")]
impl Isa for Neon {
    type F32 = vector::Pair<vector::Pair<vector::F32x4>>;
    type F64 = vector::Pair<vector::Pair<vector::F64x2>>;
    const TILE_PANELS: usize = 1;
}

/// The vectors of WebAssembly.
#[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
#[derive(Debug, Clone, Copy)]
pub(crate) struct Simd128;
#[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
impl sealed::Sealed for Simd128 {}
#[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
impl Isa for Simd128 {
    type F32 = vector::Pair<vector::Pair<vector::F32x4>>;
    type F64 = vector::Pair<vector::Pair<vector::F64x2>>;
    const TILE_PANELS: usize = 1;
    const TILE_ROWS: usize = 2;
}
