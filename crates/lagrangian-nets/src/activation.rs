//! Activations with exact derivatives to third order, for vectors (kernels) and for a generic scalar (oracle).

use num_dual::DualNum;
use serde::{Deserialize, Serialize};

use super::simd::{Real, Vector};

/// A smooth nonlinearity σ, applied to each unit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[non_exhaustive]
pub enum Activation {
    /// log(1 + eˣ): convex and nondecreasing.
    #[default]
    Softplus,
    /// tanh x.
    Tanh,
    /// x Φ(x), with Φ the normal distribution function (Hendrycks, Gimpel 2016, arXiv 1606.08415).
    Gelu,
    /// x tanh x: even, quadratic at 0 and linear far away.
    XTanh,
    /// ½ x²: convex, for quadratic forms.
    Square,
    /// eˣ, continued by its parabola at 40 so that it cannot overflow: convex and increasing, for values that span decades.
    Exp,
}

/// σ, σ′, σ″ and σ‴ at one point.
#[derive(Debug, Clone, Copy)]
pub struct Derivatives<V> {
    pub value: V,
    pub first: V,
    pub second: V,
    pub third: V,
}

impl Activation {
    /// σ over a generic scalar: the oracle of the kernels.
    pub fn evaluate<D: DualNum<Primitive = f64> + Copy>(self, x: D) -> D {
        match self {
            Self::Softplus => {
                if x.re() > 0.0 {
                    x + (-x).exp().ln_1p()
                } else {
                    x.exp().ln_1p()
                }
            }
            Self::Tanh => x.tanh(),
            Self::Gelu => x * normal_distribution(x),
            Self::XTanh => x * x.tanh(),
            Self::Square => x * x * 0.5,
            Self::Exp => exponential(x),
        }
    }

    /// σ and three derivatives of every lane.
    #[inline(always)]
    pub fn derivatives<V: Vector>(self, x: V) -> Derivatives<V> {
        match self {
            Self::Softplus => softplus(x),
            Self::Tanh => tanh(x),
            Self::Gelu => gelu(x),
            Self::XTanh => x_tanh(x),
            Self::Square => Derivatives {
                value: x.mul(x).mul(V::of(0.5)),
                first: x,
                second: V::of(1.0),
                third: V::of(0.0),
            },
            Self::Exp => exp(x),
        }
    }
}

/// Threshold at which the exponential becomes a parabola.
const STEEPEST: f64 = 40.0;

fn exponential<D: DualNum<Primitive = f64> + Copy>(x: D) -> D {
    let beyond = x - STEEPEST;
    if beyond.re() < 0.0 {
        x.exp()
    } else {
        (beyond * beyond * 0.5 + beyond + 1.0) * STEEPEST.exp()
    }
}

#[inline(always)]
fn exp<V: Vector>(x: V) -> Derivatives<V> {
    let (beyond, one) = (x.sub(V::of(STEEPEST)), V::of(1.0));
    let top = V::of(STEEPEST.exp());
    let inner = x.sub(beyond.max(V::of(0.0)));
    let decay = exp_of_negative(V::of(0.0).sub(inner.abs()));
    let below = inner.if_non_negative(one.div(decay), decay);
    let slope = beyond.add(one);
    let parabola = beyond.mul(V::of(0.5)).fma(beyond, slope);
    Derivatives {
        value: beyond.if_non_negative(parabola.mul(top), below),
        first: beyond.if_non_negative(slope.mul(top), below),
        second: beyond.if_non_negative(top, below),
        third: beyond.if_non_negative(V::of(0.0), below),
    }
}

/// Φ(x) over a generic scalar, from its series Φ = ½ + φ(x) Σ x^(2k+1)/(2k+1)!! near 0 and from the continued
/// fraction of its tail beyond |x| = 3 (Abramowitz, Stegun 1964, 26.2.11 and 26.2.14).
fn normal_distribution<D: DualNum<Primitive = f64> + Copy>(x: D) -> D {
    let density = (x * x * -0.5).exp() * INV_SQRT_TAU;
    if x.re().abs() < 3.0 {
        let mut term = x;
        let mut sum = x;
        for k in 1..60 {
            term = term * x * x / f64::from(2 * k + 1);
            sum += term;
        }
        return density * sum + 0.5;
    }
    let tail_at = if x.re() > 0.0 { x } else { -x };
    let mut fraction = tail_at;
    for k in (1..120).rev() {
        fraction = tail_at + fraction.recip() * f64::from(k);
    }
    let tail = density / fraction;
    if x.re() > 0.0 { -tail + 1.0 } else { tail }
}

const INV_SQRT_TAU: f64 = 0.398_942_280_401_432_7;

#[inline(always)]
fn softplus<V: Vector>(x: V) -> Derivatives<V> {
    let e = exp_of_negative(V::of(0.0).sub(x.abs()));
    // One division for 1 / (1 + e) and e / (2 + e).
    let (one, two) = (V::of(1.0).add(e), V::of(2.0).add(e));
    let shared = V::of(1.0).div(one.mul(two));
    let r = shared.mul(two);
    let s = e.mul(shared.mul(one));
    let er = e.mul(r);
    let first = x.if_non_negative(r, er);
    let second = er.mul(r);
    let value = x.max(V::of(0.0)).add(twice_artanh(s));
    let third = second.mul(V::of(-2.0).fma(first, V::of(1.0)));
    Derivatives {
        value,
        first,
        second,
        third,
    }
}

#[inline(always)]
fn tanh<V: Vector>(x: V) -> Derivatives<V> {
    let e = exp_of_negative(x.abs().mul(V::of(-2.0)));
    let r = V::of(1.0).div(V::of(1.0).add(e));
    let positive = V::of(1.0).sub(e).mul(r);
    let value = x.if_non_negative(positive, V::of(0.0).sub(positive));
    let first = V::of(4.0).mul(e).mul(r).mul(r);
    let second = V::of(-2.0).mul(value).mul(first);
    let third = first.mul(value.mul(value).fma(V::of(6.0), V::of(-2.0)));
    Derivatives {
        value,
        first,
        second,
        third,
    }
}

#[inline(always)]
fn x_tanh<V: Vector>(x: V) -> Derivatives<V> {
    let t = tanh(x);
    Derivatives {
        value: x.mul(t.value),
        first: x.fma(t.first, t.value),
        second: x.fma(t.second, t.first.add(t.first)),
        third: x.fma(t.third, t.second.mul(V::of(3.0))),
    }
}

#[inline(always)]
fn gelu<V: Vector>(x: V) -> Derivatives<V> {
    let square = x.mul(x);
    let density = exp_of_negative(square.mul(V::of(-0.5))).mul(V::of(INV_SQRT_TAU));
    // The error function has no short vector form of full precision; lane by lane from the maths library.
    let mut lanes = [V::Elem::default(); 16];
    x.store(&mut lanes);
    for lane in &mut lanes[..V::LANES] {
        *lane = V::Elem::of(0.5 * libm::erfc(-lane.f64() * std::f64::consts::FRAC_1_SQRT_2));
    }
    let distribution = V::load(&lanes);
    Derivatives {
        value: x.mul(distribution),
        first: x.fma(density, distribution),
        second: density.mul(V::of(2.0).sub(square)),
        third: density.mul(x).mul(square.sub(V::of(4.0))),
    }
}

/// eˣ for x ≤ 0 (Cody–Waite reduction to |r| ≤ ½ log 2, then a polynomial); 0 below the normal numbers.
#[inline(always)]
fn exp_of_negative<V: Vector>(x: V) -> V {
    let single = size_of::<V::Elem>() == 4;
    let lowest = if single { -87.0 } else { -708.0 };
    let magic = V::of(if single {
        12_582_912.0
    } else {
        6_755_399_441_055_744.0
    });
    // log 2 in two parts: multiples of the first are exact.
    let (ln2_high, ln2_low) = if single {
        (0.693_359_375, -2.121_944_4e-4)
    } else {
        (0.693_147_180_369_123_8, 1.908_214_929_270_587_7e-10)
    };
    let clamped = x.max(V::of(lowest));
    let shifted = clamped.fma(V::of(std::f64::consts::LOG2_E), magic);
    let n = shifted.sub(magic);
    let r = n.fma(V::of(-ln2_low), n.fma(V::of(-ln2_high), clamped));
    let sum = match single {
        true => polynomial(&EXP_SINGLE, r),
        false => polynomial(&EXP_DOUBLE, r),
    };
    let power = sum.mul(shifted.pow2_of_shifted());
    x.sub(V::of(lowest)).if_non_negative(power, V::of(0.0))
}

/// 2 artanh(s) for 0 ≤ s ≤ ⅓: log(1 + e) where s = e / (2 + e).
#[inline(always)]
fn twice_artanh<V: Vector>(s: V) -> V {
    let t = s.mul(s);
    let sum = match size_of::<V::Elem>() == 4 {
        true => polynomial(&ARTANH_SINGLE, t),
        false => polynomial(&ARTANH_DOUBLE, t),
    };
    s.add(s).mul(sum)
}

/// Σ cₖ xᵏ, with even and odd powers separate: half the length of the chain of additions.
#[inline(always)]
fn polynomial<V: Vector, const N: usize>(c: &[f64; N], x: V) -> V {
    let square = x.mul(x);
    let (mut even, mut odd) = (V::of(0.0), V::of(0.0));
    for k in (0..N).rev() {
        let sum = match k % 2 {
            0 => &mut even,
            _ => &mut odd,
        };
        *sum = match k + 2 < N {
            true => sum.fma(square, V::of(c[k])),
            false => V::of(c[k]),
        };
    }
    odd.fma(x, even)
}

// Minimax polynomials by Remez' exchange in 60 digits, of the least degree whose relative error is below a quarter of a
// rounding.

/// eˣ for |x| ≤ ½ log 2; relative error 2⁻²⁹.
const EXP_SINGLE: [f64; 7] = [
    1.000_000_000_554_653_8,
    1.000_000_036_343_919,
    0.499_999_920_729_653_1,
    0.166_664_200_734_886_83,
    0.041_668_226_648_924_05,
    0.008_374_824_027_988_477,
    0.001_383_681_226_994_477,
];

/// As [`EXP_SINGLE`]; relative error 2⁻⁵⁸.
const EXP_DOUBLE: [f64; 12] = [
    1.0,
    1.0,
    0.500_000_000_000_001_8,
    0.166_666_666_666_661_7,
    0.041_666_666_666_492_62,
    0.008_333_333_333_559_439,
    0.001_388_888_895_126_233_2,
    0.000_198_412_694_324_596_5,
    0.000_024_801_486_480_229_03,
    2.755_762_263_130_627_6e-6,
    2.763_230_857_660_222_5e-7,
    2.499_429_955_511_974_7e-8,
];

/// artanh(√t) / √t for 0 ≤ t ≤ 1/9; relative error 2⁻²⁸.
const ARTANH_SINGLE: [f64; 5] = [
    1.000_000_003_960_098_6,
    0.333_331_573_439_315_7,
    0.200_124_550_756_228_4,
    0.139_803_019_068_910_37,
    0.140_891_664_117_409_75,
];

/// As [`ARTANH_SINGLE`]; relative error 2⁻⁵⁹.
const ARTANH_DOUBLE: [f64; 11] = [
    1.0,
    0.333_333_333_333_330_67,
    0.200_000_000_000_951_6,
    0.142_857_142_724_627_06,
    0.111_111_120_558_794_86,
    0.090_908_698_940_720_96,
    0.076_933_177_233_062_21,
    0.066_500_512_986_410_38,
    0.060_561_241_977_928_47,
    0.041_578_432_424_067_99,
    0.085_300_295_088_372_53,
];
