//! sin and cos of every lane, in double precision.

use super::Vector;

/// Limit beyond which angles are too large for [`sin_cos`]: its reduction is exact up to 2²⁰ quarter turns.
pub const LARGEST_ANGLE: f64 = 1e6;

/// (sin x, cos x) for |x| ≤ [`LARGEST_ANGLE`] (Cody–Waite reduction to |r| ≤ π/4, then a polynomial for each); within
/// two roundings.
#[inline(always)]
pub fn sin_cos<V: Vector<Elem = f64>>(x: V) -> (V, V) {
    let (one, two) = (V::of(1.0), V::of(2.0));
    let n = round(x.mul(V::of(std::f64::consts::FRAC_2_PI)));
    let [high, middle, low] = QUARTER_TURN;
    let r = n.fma(V::of(-high), x);
    let r = n.fma(V::of(-low), n.fma(V::of(-middle), r));
    let t = r.mul(r);
    let (sin, cos) = (r.mul(polynomial(&SIN, t)), polynomial(&COS, t));
    // The quadrant, 0 … 3: n modulo 4.
    let turns = round(n.sub(V::of(1.5)).mul(V::of(0.25)));
    let quadrant = turns.fma(V::of(-4.0), n);
    // 3, 0, −1, 0: the square separates even from odd.
    let parity = quadrant.sub(one).mul(quadrant.sub(V::of(3.0)));
    let even = parity.fma(parity, V::of(-0.5));
    let middle = quadrant.sub(V::of(1.5));
    let sin_sign = middle.if_non_negative(V::of(-1.0), one);
    let cos_sign = middle.fma(middle, V::of(-1.0));
    let cos_sign = cos_sign.if_non_negative(two, V::of(0.0)).sub(one);
    (
        even.if_non_negative(sin, cos).mul(sin_sign),
        even.if_non_negative(cos, sin).mul(cos_sign),
    )
}

/// Nearest integer, for |x| < 2⁵¹.
#[inline(always)]
fn round<V: Vector<Elem = f64>>(x: V) -> V {
    let magic = V::of(6_755_399_441_055_744.0);
    x.add(magic).sub(magic)
}

/// Σ cₖ xᵏ.
#[inline(always)]
fn polynomial<V: Vector, const N: usize>(c: &[f64; N], x: V) -> V {
    let mut sum = V::of(c[N - 1]);
    for &c in c[..N - 1].iter().rev() {
        sum = sum.fma(x, V::of(c));
    }
    sum
}

/// π/2 in three parts: multiples of the first two are exact up to 2²⁰.
const QUARTER_TURN: [f64; 3] = [
    1.570_796_326_734_125_6,
    6.077_100_506_303_966e-11,
    2.022_266_248_795_950_6e-21,
];

// Minimax polynomials by Remez' exchange in 60 digits, for |r| ≤ π/4.

/// sin(√t) / √t; relative error 2⁻⁶⁸.
const SIN: [f64; 8] = [
    1.0,
    -0.166_666_666_666_666_66,
    0.008_333_333_333_333_321,
    -0.000_198_412_698_412_530_88,
    2.755_731_921_338_003_6e-6,
    -2.505_210_473_558_719_6e-8,
    1.605_834_727_624_317e-10,
    -7.577_850_411_809_682e-13,
];

/// cos √t; relative error 2⁻⁶⁴.
const COS: [f64; 8] = [
    1.0,
    -0.5,
    0.041_666_666_666_666_43,
    -0.001_388_888_888_885_892,
    2.480_158_728_287_955_6e-5,
    -2.755_731_286_063_666e-7,
    2.087_555_451_047_446e-9,
    -1.135_209_198_367_149e-11,
];
