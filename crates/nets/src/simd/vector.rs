//! Vectors of 64 bytes: the operations that the kernels need, once per kind of register.

use std::fmt::Debug;

use super::Isa;

/// A number that the kernels compute with: `f32` or `f64`.
pub trait Real:
    Copy + Debug + Default + PartialEq + PartialOrd + Send + Sync + num_traits::Float + 'static
{
    /// Numbers in 64 bytes.
    const LANES: usize;
    /// The vector of this number on one instruction set.
    type Vec<I: Isa>: Vector<Elem = Self>;
    /// Rounds from double precision.
    fn of(x: f64) -> Self;
    /// Widens to double precision.
    fn f64(self) -> f64;
}

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

/// Lane-wise arithmetic. All methods compile to single instructions when inlined below the entry of their
/// instruction set; they must not be called elsewhere, but for those of `f64`, which is a vector of one lane.
pub trait Vector: Copy {
    /// The number in a lane.
    type Elem: Real;
    /// Numbers in it.
    const LANES: usize;
    /// Loads `LANES` numbers.
    ///
    /// # Safety
    /// `p` points to that many.
    unsafe fn load_ptr(p: *const Self::Elem) -> Self;
    /// Stores `LANES` numbers.
    ///
    /// # Safety
    /// `p` points to room for that many.
    unsafe fn store_ptr(self, p: *mut Self::Elem);
    /// The same number in every lane.
    fn splat(x: Self::Elem) -> Self;
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
    /// The larger; `b` where `a` is NaN.
    fn max(self, b: Self) -> Self;
    /// The smaller; `b` where `a` is NaN.
    fn min(self, b: Self) -> Self;
    /// `yes` where a ≥ 0, else `no`.
    fn if_non_negative(self, yes: Self, no: Self) -> Self;
    /// 2ⁿ from n + 1.5·2⁵² (1.5·2²³ in single precision), with n in the normal exponents.
    fn pow2_of_shifted(self) -> Self;
    /// The lanes of both in turn, a₀ b₀ a₁ b₁ …: the first half, and the second.
    fn zip(self, b: Self) -> (Self, Self);

    /// Loads from the head of a slice.
    #[inline(always)]
    fn load(s: &[Self::Elem]) -> Self {
        assert!(s.len() >= Self::LANES);
        // SAFETY: the assertion.
        unsafe { Self::load_ptr(s.as_ptr()) }
    }
    /// Stores to the head of a slice.
    #[inline(always)]
    fn store(self, s: &mut [Self::Elem]) {
        assert!(s.len() >= Self::LANES);
        // SAFETY: the assertion.
        unsafe { self.store_ptr(s.as_mut_ptr()) }
    }
    /// The number nearest to `x` in every lane.
    #[inline(always)]
    fn of(x: f64) -> Self {
        Self::splat(Self::Elem::of(x))
    }
    /// |a|.
    #[inline(always)]
    fn abs(self) -> Self {
        self.max(Self::of(0.0).sub(self))
    }
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

/// Two vectors side by side, where a register holds less than 64 bytes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pair<V>(V, V);

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

/// Plain arrays.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Lanes<T, const N: usize>([T; N]);

macro_rules! portable {
    ($elem:ty, $n:literal, $bits:ty, $bias:literal, $shift:literal) => {
        impl Vector for Lanes<$elem, $n> {
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
            #[inline(always)]
            fn add(self, b: Self) -> Self {
                Self(std::array::from_fn(|i| self.0[i] + b.0[i]))
            }
            #[inline(always)]
            fn sub(self, b: Self) -> Self {
                Self(std::array::from_fn(|i| self.0[i] - b.0[i]))
            }
            #[inline(always)]
            fn mul(self, b: Self) -> Self {
                Self(std::array::from_fn(|i| self.0[i] * b.0[i]))
            }
            #[inline(always)]
            fn div(self, b: Self) -> Self {
                Self(std::array::from_fn(|i| self.0[i] / b.0[i]))
            }
            #[inline(always)]
            fn fma(self, b: Self, c: Self) -> Self {
                // Two roundings: without the instruction, `mul_add` is a slow library call.
                Self(std::array::from_fn(|i| self.0[i] * b.0[i] + c.0[i]))
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                Self(std::array::from_fn(|i| num_traits::Float::sqrt(self.0[i])))
            }
            #[inline(always)]
            fn max(self, b: Self) -> Self {
                Self(std::array::from_fn(|i| {
                    if self.0[i] > b.0[i] {
                        self.0[i]
                    } else {
                        b.0[i]
                    }
                }))
            }
            #[inline(always)]
            fn min(self, b: Self) -> Self {
                Self(std::array::from_fn(|i| {
                    if self.0[i] < b.0[i] {
                        self.0[i]
                    } else {
                        b.0[i]
                    }
                }))
            }
            #[inline(always)]
            fn if_non_negative(self, yes: Self, no: Self) -> Self {
                Self(std::array::from_fn(|i| {
                    if self.0[i] >= 0.0 { yes.0[i] } else { no.0[i] }
                }))
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

#[cfg(target_arch = "x86_64")]
pub(super) use x86::sums_of_eight;

#[cfg(target_arch = "x86_64")]
mod x86 {
    use std::arch::x86_64::*;

    use super::Vector;

    macro_rules! register {
        ($v:ty, $elem:ty, $n:literal, $load:ident, $store:ident, $splat:ident, $add:ident, $sub:ident, $mul:ident,
         $div:ident, $fma:ident, $sqrt:ident, $max:ident, $min:ident, |$s:ident, $yes:ident, $no:ident| $select:expr,
         |$x:ident| $pow2:expr, |$first:ident, $second:ident| $zip:expr) => {
            impl Vector for $v {
                type Elem = $elem;
                const LANES: usize = $n;
                #[inline(always)]
                unsafe fn load_ptr(p: *const $elem) -> Self {
                    // SAFETY: the caller's; inlined below an entry that has seen the CPU feature.
                    unsafe { $load(p) }
                }
                #[inline(always)]
                unsafe fn store_ptr(self, p: *mut $elem) {
                    // SAFETY: as above.
                    unsafe { $store(p, self) }
                }
                #[inline(always)]
                fn splat(x: $elem) -> Self {
                    // SAFETY: as above.
                    unsafe { $splat(x) }
                }
                #[inline(always)]
                fn add(self, b: Self) -> Self {
                    // SAFETY: as above.
                    unsafe { $add(self, b) }
                }
                #[inline(always)]
                fn sub(self, b: Self) -> Self {
                    // SAFETY: as above.
                    unsafe { $sub(self, b) }
                }
                #[inline(always)]
                fn mul(self, b: Self) -> Self {
                    // SAFETY: as above.
                    unsafe { $mul(self, b) }
                }
                #[inline(always)]
                fn div(self, b: Self) -> Self {
                    // SAFETY: as above.
                    unsafe { $div(self, b) }
                }
                #[inline(always)]
                fn fma(self, b: Self, c: Self) -> Self {
                    // SAFETY: as above.
                    unsafe { $fma(self, b, c) }
                }
                #[inline(always)]
                fn sqrt(self) -> Self {
                    // SAFETY: as above.
                    unsafe { $sqrt(self) }
                }
                #[inline(always)]
                fn max(self, b: Self) -> Self {
                    // SAFETY: as above.
                    unsafe { $max(self, b) }
                }
                #[inline(always)]
                fn min(self, b: Self) -> Self {
                    // SAFETY: as above.
                    unsafe { $min(self, b) }
                }
                #[inline(always)]
                fn if_non_negative(self, $yes: Self, $no: Self) -> Self {
                    let $s = self;
                    // SAFETY: as above.
                    unsafe { $select }
                }
                #[inline(always)]
                fn pow2_of_shifted(self) -> Self {
                    let $x = self;
                    // SAFETY: as above.
                    unsafe { $pow2 }
                }
                #[inline(always)]
                fn zip(self, b: Self) -> (Self, Self) {
                    let ($first, $second) = (self, b);
                    // SAFETY: as above.
                    unsafe { $zip }
                }
            }
        };
    }

    register!(
        __m256,
        f32,
        8,
        _mm256_loadu_ps,
        _mm256_storeu_ps,
        _mm256_set1_ps,
        _mm256_add_ps,
        _mm256_sub_ps,
        _mm256_mul_ps,
        _mm256_div_ps,
        _mm256_fmadd_ps,
        _mm256_sqrt_ps,
        _mm256_max_ps,
        _mm256_min_ps,
        |s, yes, no| _mm256_blendv_ps(no, yes, _mm256_cmp_ps::<_CMP_GE_OQ>(s, _mm256_setzero_ps())),
        |x| _mm256_castsi256_ps(_mm256_slli_epi32::<23>(_mm256_add_epi32(
            _mm256_castps_si256(x),
            _mm256_set1_epi32(127)
        ))),
        |a, b| {
            let (low, high) = (_mm256_unpacklo_ps(a, b), _mm256_unpackhi_ps(a, b));
            (
                _mm256_permute2f128_ps::<0x20>(low, high),
                _mm256_permute2f128_ps::<0x31>(low, high),
            )
        }
    );
    register!(
        __m256d,
        f64,
        4,
        _mm256_loadu_pd,
        _mm256_storeu_pd,
        _mm256_set1_pd,
        _mm256_add_pd,
        _mm256_sub_pd,
        _mm256_mul_pd,
        _mm256_div_pd,
        _mm256_fmadd_pd,
        _mm256_sqrt_pd,
        _mm256_max_pd,
        _mm256_min_pd,
        |s, yes, no| _mm256_blendv_pd(no, yes, _mm256_cmp_pd::<_CMP_GE_OQ>(s, _mm256_setzero_pd())),
        |x| _mm256_castsi256_pd(_mm256_slli_epi64::<52>(_mm256_add_epi64(
            _mm256_castpd_si256(x),
            _mm256_set1_epi64x(1023)
        ))),
        |a, b| {
            let (low, high) = (_mm256_unpacklo_pd(a, b), _mm256_unpackhi_pd(a, b));
            (
                _mm256_permute2f128_pd::<0x20>(low, high),
                _mm256_permute2f128_pd::<0x31>(low, high),
            )
        }
    );
    register!(
        __m512,
        f32,
        16,
        _mm512_loadu_ps,
        _mm512_storeu_ps,
        _mm512_set1_ps,
        _mm512_add_ps,
        _mm512_sub_ps,
        _mm512_mul_ps,
        _mm512_div_ps,
        _mm512_fmadd_ps,
        _mm512_sqrt_ps,
        _mm512_max_ps,
        _mm512_min_ps,
        |s, yes, no| _mm512_mask_blend_ps(
            _mm512_cmp_ps_mask::<_CMP_GE_OQ>(s, _mm512_setzero_ps()),
            no,
            yes
        ),
        |x| _mm512_castsi512_ps(_mm512_slli_epi32::<23>(_mm512_add_epi32(
            _mm512_castps_si512(x),
            _mm512_set1_epi32(127)
        ))),
        |a, b| {
            let low = _mm512_setr_epi32(0, 16, 1, 17, 2, 18, 3, 19, 4, 20, 5, 21, 6, 22, 7, 23);
            let high = _mm512_add_epi32(low, _mm512_set1_epi32(8));
            (
                _mm512_permutex2var_ps(a, low, b),
                _mm512_permutex2var_ps(a, high, b),
            )
        }
    );
    register!(
        __m512d,
        f64,
        8,
        _mm512_loadu_pd,
        _mm512_storeu_pd,
        _mm512_set1_pd,
        _mm512_add_pd,
        _mm512_sub_pd,
        _mm512_mul_pd,
        _mm512_div_pd,
        _mm512_fmadd_pd,
        _mm512_sqrt_pd,
        _mm512_max_pd,
        _mm512_min_pd,
        |s, yes, no| _mm512_mask_blend_pd(
            _mm512_cmp_pd_mask::<_CMP_GE_OQ>(s, _mm512_setzero_pd()),
            no,
            yes
        ),
        |x| _mm512_castsi512_pd(_mm512_slli_epi64::<52>(_mm512_add_epi64(
            _mm512_castpd_si512(x),
            _mm512_set1_epi64(1023)
        ))),
        |a, b| {
            let low = _mm512_setr_epi64(0, 8, 1, 9, 2, 10, 3, 11);
            let high = _mm512_add_epi64(low, _mm512_set1_epi64(4));
            (
                _mm512_permutex2var_pd(a, low, b),
                _mm512_permutex2var_pd(a, high, b),
            )
        }
    );

    /// The sums of the lanes of eight vectors: neighbours are added until each is one number.
    #[inline(always)]
    pub(in super::super) fn sums_of_eight(v: [__m512d; 8]) -> __m512d {
        let low = four(two(v[0], v[1]), two(v[2], v[3]));
        four(low, four(two(v[4], v[5]), two(v[6], v[7])))
    }

    /// Sums of pairs of lanes, those of a and of b in turns.
    #[inline(always)]
    fn two(a: __m512d, b: __m512d) -> __m512d {
        // SAFETY: inlined below an entry that has seen AVX-512.
        unsafe { _mm512_add_pd(_mm512_unpacklo_pd(a, b), _mm512_unpackhi_pd(a, b)) }
    }

    /// Sums of neighbouring pairs of lanes, those of a before those of b.
    #[inline(always)]
    fn four(a: __m512d, b: __m512d) -> __m512d {
        // SAFETY: as above.
        unsafe {
            let even = _mm512_shuffle_f64x2::<0b10_00_10_00>(a, b);
            _mm512_add_pd(even, _mm512_shuffle_f64x2::<0b11_01_11_01>(a, b))
        }
    }
}

#[cfg(target_arch = "aarch64")]
mod neon {
    use std::arch::aarch64::*;

    use super::Vector;

    macro_rules! register {
        ($v:ty, $elem:ty, $n:literal, $load:ident, $store:ident, $splat:ident, $add:ident, $sub:ident, $mul:ident,
         $div:ident, $fma:ident, $sqrt:ident, $max:ident, $min:ident, |$s:ident, $yes:ident, $no:ident| $select:expr,
         |$x:ident| $pow2:expr, |$first:ident, $second:ident| $zip:expr) => {
            impl Vector for $v {
                type Elem = $elem;
                const LANES: usize = $n;
                #[inline(always)]
                unsafe fn load_ptr(p: *const $elem) -> Self {
                    // SAFETY: the caller's; NEON is part of AArch64.
                    unsafe { $load(p) }
                }
                #[inline(always)]
                unsafe fn store_ptr(self, p: *mut $elem) {
                    // SAFETY: as above.
                    unsafe { $store(p, self) }
                }
                #[inline(always)]
                fn splat(x: $elem) -> Self {
                    // SAFETY: as above.
                    unsafe { $splat(x) }
                }
                #[inline(always)]
                fn add(self, b: Self) -> Self {
                    // SAFETY: as above.
                    unsafe { $add(self, b) }
                }
                #[inline(always)]
                fn sub(self, b: Self) -> Self {
                    // SAFETY: as above.
                    unsafe { $sub(self, b) }
                }
                #[inline(always)]
                fn mul(self, b: Self) -> Self {
                    // SAFETY: as above.
                    unsafe { $mul(self, b) }
                }
                #[inline(always)]
                fn div(self, b: Self) -> Self {
                    // SAFETY: as above.
                    unsafe { $div(self, b) }
                }
                #[inline(always)]
                fn fma(self, b: Self, c: Self) -> Self {
                    // SAFETY: as above.
                    unsafe { $fma(c, self, b) }
                }
                #[inline(always)]
                fn sqrt(self) -> Self {
                    // SAFETY: as above.
                    unsafe { $sqrt(self) }
                }
                #[inline(always)]
                fn max(self, b: Self) -> Self {
                    // SAFETY: as above.
                    unsafe { $max(self, b) }
                }
                #[inline(always)]
                fn min(self, b: Self) -> Self {
                    // SAFETY: as above.
                    unsafe { $min(self, b) }
                }
                #[inline(always)]
                fn if_non_negative(self, $yes: Self, $no: Self) -> Self {
                    let $s = self;
                    // SAFETY: as above.
                    unsafe { $select }
                }
                #[inline(always)]
                fn pow2_of_shifted(self) -> Self {
                    let $x = self;
                    // SAFETY: as above.
                    unsafe { $pow2 }
                }
                #[inline(always)]
                fn zip(self, b: Self) -> (Self, Self) {
                    let ($first, $second) = (self, b);
                    // SAFETY: as above.
                    unsafe { $zip }
                }
            }
        };
    }

    register!(
        float32x4_t,
        f32,
        4,
        vld1q_f32,
        vst1q_f32,
        vdupq_n_f32,
        vaddq_f32,
        vsubq_f32,
        vmulq_f32,
        vdivq_f32,
        vfmaq_f32,
        vsqrtq_f32,
        vmaxq_f32,
        vminq_f32,
        |s, yes, no| vbslq_f32(vcgezq_f32(s), yes, no),
        |x| vreinterpretq_f32_s32(vshlq_n_s32::<23>(vaddq_s32(
            vreinterpretq_s32_f32(x),
            vdupq_n_s32(127)
        ))),
        |a, b| (vzip1q_f32(a, b), vzip2q_f32(a, b))
    );
    register!(
        float64x2_t,
        f64,
        2,
        vld1q_f64,
        vst1q_f64,
        vdupq_n_f64,
        vaddq_f64,
        vsubq_f64,
        vmulq_f64,
        vdivq_f64,
        vfmaq_f64,
        vsqrtq_f64,
        vmaxq_f64,
        vminq_f64,
        |s, yes, no| vbslq_f64(vcgezq_f64(s), yes, no),
        |x| vreinterpretq_f64_s64(vshlq_n_s64::<52>(vaddq_s64(
            vreinterpretq_s64_f64(x),
            vdupq_n_s64(1023)
        ))),
        |a, b| (vzip1q_f64(a, b), vzip2q_f64(a, b))
    );
}
