//! Vectors of x86-64: AVX2 with FMA and AVX-512.

use std::arch::x86_64::*;

use super::register::register;
use super::{Arithmetic, Memory, Vector};

register!(
    F32x8,
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
    |a, b, c| _mm256_fmadd_ps(a, b, c),
    _mm256_sqrt_ps,
    _mm256_max_ps,
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
    F64x4,
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
    |a, b, c| _mm256_fmadd_pd(a, b, c),
    _mm256_sqrt_pd,
    _mm256_max_pd,
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
    F32x16,
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
    |a, b, c| _mm512_fmadd_ps(a, b, c),
    _mm512_sqrt_ps,
    _mm512_max_ps,
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
    F64x8,
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
    |a, b, c| _mm512_fmadd_pd(a, b, c),
    _mm512_sqrt_pd,
    _mm512_max_pd,
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

/// Sums of the lanes of eight vectors, by repeated addition of neighbours.
#[inline(always)]
pub(crate) fn sums_of_eight(v: [F64x8; 8]) -> F64x8 {
    let [a, b, c, d, e, f, g, h] = v.map(|v| v.0);
    let low = four(two(a, b), two(c, d));
    F64x8(four(low, four(two(e, f), two(g, h))))
}

/// Sums of pairs of lanes, alternating between a and b.
#[inline(always)]
fn two(a: __m512d, b: __m512d) -> __m512d {
    // SAFETY: inlined below an entry that has detected AVX-512.
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
