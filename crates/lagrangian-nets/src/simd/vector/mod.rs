//! The operations on vectors that the kernels need, and a file for each kind of register.

#[cfg(target_arch = "aarch64")]
mod neon;
mod pair;
#[cfg(not(all(target_arch = "wasm32", target_feature = "simd128")))]
mod portable;
mod register;
mod scalar;
#[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
mod wasm;
#[cfg(target_arch = "x86_64")]
mod x86;

use std::fmt::Debug;

#[cfg(target_arch = "aarch64")]
pub(crate) use neon::{F32x4, F64x2};
pub(crate) use pair::Pair;
#[cfg(not(all(target_arch = "wasm32", target_feature = "simd128")))]
pub(crate) use portable::Lanes;
#[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
pub(crate) use wasm::{F32x4, F64x2};
#[cfg(target_arch = "x86_64")]
pub(crate) use x86::{F32x8, F32x16, F64x4, F64x8, sums_of_eight};

use super::Isa;
use super::sealed::Sealed;

/// A number that the kernels compute with: `f32` or `f64`.
pub trait Real:
    Copy + Debug + Default + PartialEq + PartialOrd + Send + Sync + num_traits::Float + Sealed + 'static
{
    /// Number of values in a vector of 64 bytes.
    const LANES: usize;
    /// Vector of this number on one instruction set.
    type Vec<I: Isa>: Vector<Elem = Self>;
    /// Rounds from double precision.
    fn of(x: f64) -> Self;
    /// Widens to double precision.
    fn f64(self) -> f64;
}

impl Sealed for f32 {}
impl Real for f32 {
    const LANES: usize = 16;
    type Vec<I: Isa> = I::F32;
    #[inline(always)]
    fn of(x: f64) -> Self {
        x as Self
    }
    #[inline(always)]
    fn f64(self) -> f64 {
        f64::from(self)
    }
}

impl Sealed for f64 {}
impl Real for f64 {
    const LANES: usize = 8;
    type Vec<I: Isa> = I::F64;
    #[inline(always)]
    fn of(x: f64) -> Self {
        x
    }
    #[inline(always)]
    fn f64(self) -> f64 {
        self
    }
}

/// Transfer of values of a vector: from memory, from one number, and back to memory.
pub trait Memory: Copy + Sealed {
    /// Type of the value in a lane.
    type Elem: Real;
    /// Number of lanes.
    const LANES: usize;
    /// Loads `LANES` values from memory of any alignment.
    ///
    /// # Safety
    /// `p` must be valid for reads of `LANES` values.
    unsafe fn load_ptr(p: *const Self::Elem) -> Self;
    /// Stores `LANES` values to memory of any alignment.
    ///
    /// # Safety
    /// `p` must be valid for writes of `LANES` values.
    unsafe fn store_ptr(self, p: *mut Self::Elem);
    /// The vector with `x` in every lane.
    fn splat(x: Self::Elem) -> Self;

    /// Loads the first `LANES` values of a slice; panics where it is shorter.
    #[inline(always)]
    fn load(s: &[Self::Elem]) -> Self {
        assert!(s.len() >= Self::LANES);
        // SAFETY: the assertion.
        unsafe { Self::load_ptr(s.as_ptr()) }
    }
    /// Stores to the first `LANES` values of a slice; panics where it is shorter.
    #[inline(always)]
    fn store(self, s: &mut [Self::Elem]) {
        assert!(s.len() >= Self::LANES);
        // SAFETY: the assertion.
        unsafe { self.store_ptr(s.as_mut_ptr()) }
    }
    /// The vector with `x`, rounded, in every lane.
    #[inline(always)]
    fn of(x: f64) -> Self {
        Self::splat(Self::Elem::of(x))
    }
}

/// Arithmetic on all lanes of a vector at once.
pub trait Arithmetic: Memory {
    /// a + b.
    fn add(self, b: Self) -> Self;
    /// a − b.
    fn sub(self, b: Self) -> Self;
    /// a · b.
    fn mul(self, b: Self) -> Self;
    /// a / b.
    fn div(self, b: Self) -> Self;
    /// a · b + c, rounded once.
    fn fma(self, b: Self, c: Self) -> Self;
    /// √a.
    fn sqrt(self) -> Self;
    /// The larger of a and b, and b where a is NaN.
    fn max(self, b: Self) -> Self;
    /// |a|.
    #[inline(always)]
    fn abs(self) -> Self {
        self.max(Self::of(0.0).sub(self))
    }
}

/// A vector of the kernels: its [`Memory`], its [`Arithmetic`], and operations on the bits or the order of its lanes.
///
/// All methods compile to single instructions when they are inlined below the entry of their instruction set. `f64` is
/// the vector of one lane, for algebra that serves one state as well as a vector of samples; it needs no entry.
pub trait Vector: Arithmetic {
    /// `yes` where a ≥ 0, else `no`.
    fn if_non_negative(self, yes: Self, no: Self) -> Self;
    /// 2ⁿ from n + 1.5·2⁵² (1.5·2²³ in single precision), with n in the normal exponents.
    fn pow2_of_shifted(self) -> Self;
    /// The lanes of a and b interleaved, a₀ b₀ a₁ b₁ …: the first half, and the second.
    fn zip(self, b: Self) -> (Self, Self);

    /// The sum of the lanes, always in the same order.
    #[inline(always)]
    fn sum(self) -> Self::Elem {
        let mut lanes = [Self::Elem::default(); 16];
        self.store(&mut lanes);
        let mut width = Self::LANES / 2;
        while width > 0 {
            for i in 0..width {
                lanes[i] = lanes[i] + lanes[i + width];
            }
            width /= 2;
        }
        lanes[0]
    }
}
