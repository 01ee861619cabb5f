//! Vectors of NEON, which is part of AArch64.

use std::arch::aarch64::*;

use super::register::register;
use super::{Arithmetic, Memory, Vector};

register!(
    F32x4,
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
    |a, b, c| vfmaq_f32(c, a, b),
    vsqrtq_f32,
    vmaxq_f32,
    |s, yes, no| vbslq_f32(vcgezq_f32(s), yes, no),
    |x| vreinterpretq_f32_s32(vshlq_n_s32::<23>(vaddq_s32(
        vreinterpretq_s32_f32(x),
        vdupq_n_s32(127)
    ))),
    |a, b| (vzip1q_f32(a, b), vzip2q_f32(a, b))
);
register!(
    F64x2,
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
    |a, b, c| vfmaq_f64(c, a, b),
    vsqrtq_f64,
    vmaxq_f64,
    |s, yes, no| vbslq_f64(vcgezq_f64(s), yes, no),
    |x| vreinterpretq_f64_s64(vshlq_n_s64::<52>(vaddq_s64(
        vreinterpretq_s64_f64(x),
        vdupq_n_s64(1023)
    ))),
    |a, b| (vzip1q_f64(a, b), vzip2q_f64(a, b))
);
