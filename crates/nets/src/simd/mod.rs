//! The one module with `unsafe`: vectors of 64 bytes on whatever the CPU offers, chosen when the program runs.
//!
//! A kernel is written once over [`Isa`] and entered through `dispatch`, which compiles it for AVX-512, AVX2
//! with FMA, NEON and a portable fallback. Everything below an entry is `#[inline(always)]`, so that it is
//! compiled with the features of the entry; without them a fused multiply-add is a library call, thirty times
//! slower.
#![allow(
    unsafe_code,
    reason = "CPU vector instructions; every other module is safe"
)]

mod bandwidth;
mod buffer;
mod circle;
mod elementwise;
mod factors;
mod gemm;
mod level;
mod peak;
mod planes;
mod rows;
mod single;
#[cfg(test)]
mod tests;
mod update;
mod vector;

pub use bandwidth::read_rate;
pub use buffer::Buffer;
pub use circle::{LARGEST_ANGLE, sin_cos};
pub(crate) use elementwise::{
    Combine, Contract, GateForward, GateReverse, Gates, PointForward, PointReverse2,
    PointReverseTangents, PointSecond, PointTangent, Shape,
};
pub(crate) use factors::{GramTile, RowDots, WeighRows};
pub(crate) use gemm::{Gemm, Init};
pub use level::{Level, level, levels, set_level};
pub use peak::fma_peak;
pub(crate) use planes::{FromPlanes, ToPlanes};
pub use planes::{Planes, set_vector, vector};
pub(crate) use rows::{Rows, Weights, collect, contract, product, pull};
pub use update::{AdamRule, AdamStep};
pub(crate) use update::{AddTo, SumOfSquares, SumRows};
pub use vector::{Real, Vector};

use vector::Lanes;
pub(crate) use vector::Pair;

/// One set of CPU instructions: its vectors of 64 bytes, and the tile of the matrix product that fits its registers.
pub trait Isa: Copy {
    /// 16 × f32.
    type F32: Vector<Elem = f32>;
    /// 8 × f64.
    type F64: Vector<Elem = f64>;
    /// Panels (64 bytes wide) of one register tile.
    const TILE_PANELS: usize;
    /// The sums of the lanes of eight vectors.
    #[inline(always)]
    fn sums(vectors: [Self::F64; 8]) -> Self::F64 {
        Self::F64::load(&vectors.map(Vector::sum))
    }
}

/// A kernel that can be compiled for every [`Isa`].
pub trait Task {
    /// Runs it with one instruction set; implementations are `#[inline(always)]`.
    fn run<I: Isa>(self);
}

/// Runs a kernel with the instructions of [`level`]: the best that the CPU has, unless the program chose others.
#[inline]
pub fn dispatch<K: Task>(task: K) {
    dispatch_on(level(), task);
}

/// Runs a kernel with the instructions of `level`, which must be one of [`levels`].
#[inline]
pub(crate) fn dispatch_on<K: Task>(level: Level, task: K) {
    match level {
        Level::Portable => task.run::<Portable>(),
        // SAFETY: `level` and `levels` give only what the CPU was asked for, and `level` comes from one of them.
        #[cfg(target_arch = "x86_64")]
        Level::Avx2 => unsafe { enter_avx2(task) },
        // SAFETY: as above.
        #[cfg(target_arch = "x86_64")]
        Level::Avx512 => unsafe { enter_avx512(task) },
        #[cfg(target_arch = "aarch64")]
        Level::Neon => task.run::<Neon>(),
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

/// Plain arrays that the compiler may vectorise as it can.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Portable;
impl Isa for Portable {
    type F32 = Lanes<f32, 16>;
    type F64 = Lanes<f64, 8>;
    const TILE_PANELS: usize = 1;
}

#[cfg(target_arch = "x86_64")]
#[derive(Debug, Clone, Copy)]
pub(crate) struct Avx2;
#[cfg(target_arch = "x86_64")]
impl Isa for Avx2 {
    type F32 = vector::Pair<std::arch::x86_64::__m256>;
    type F64 = vector::Pair<std::arch::x86_64::__m256d>;
    const TILE_PANELS: usize = 1;
}

#[cfg(target_arch = "x86_64")]
#[derive(Debug, Clone, Copy)]
pub(crate) struct Avx512;
#[cfg(target_arch = "x86_64")]
impl Isa for Avx512 {
    type F32 = std::arch::x86_64::__m512;
    type F64 = std::arch::x86_64::__m512d;
    const TILE_PANELS: usize = 2;
    #[inline(always)]
    fn sums(vectors: [Self::F64; 8]) -> Self::F64 {
        vector::sums_of_eight(vectors)
    }
}

#[cfg(target_arch = "aarch64")]
#[derive(Debug, Clone, Copy)]
pub(crate) struct Neon;
#[cfg(target_arch = "aarch64")]
impl Isa for Neon {
    type F32 = vector::Pair<vector::Pair<std::arch::aarch64::float32x4_t>>;
    type F64 = vector::Pair<vector::Pair<std::arch::aarch64::float64x2_t>>;
    const TILE_PANELS: usize = 1;
}
