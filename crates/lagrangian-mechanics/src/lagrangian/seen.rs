//! The feature of a velocity or a momentum, and the initial kinetic term in the same variable.

use num_dual::DualNum;
use serde::{Deserialize, Serialize};

/// The chart of speeds below a limit c (theory.md, equations 108 and 115).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SpeedChart {
    /// u = artanh(q̇/c), which is unbounded: for Lagrangians that grow without bound towards c.
    #[default]
    Artanh,
    /// u = arcsin(q̇/c), which ends at ±π/2: for Lagrangians that stay finite there, though their momenta may not.
    Arcsin,
}

impl SpeedChart {
    /// Whether files omit it.
    pub fn is_default(&self) -> bool {
        *self == Self::default()
    }
}

/// Map from a velocity (or momentum) z to its feature, with the scale s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum VelocityTransform {
    /// u = z/s, kinetic term ½ u².
    Scaled,
    /// u = artanh(z/c), kinetic term ½ u².
    Artanh(f64),
    /// u = arcsin(z/c), kinetic term ½ u².
    Arcsin(f64),
    /// u = arsinh(z/s), kinetic term (s c/E)(√(1 + z²/s²) − 1), whose slope is c tanh u/E.
    Arsinh(f64),
}

impl VelocityTransform {
    /// The feature of a velocity, in the chart below a limit if there is one.
    pub fn of_velocity(limit: Option<f64>, chart: SpeedChart) -> Self {
        match (limit, chart) {
            (None, _) => Self::Scaled,
            (Some(c), SpeedChart::Artanh) => Self::Artanh(c),
            (Some(c), SpeedChart::Arcsin) => Self::Arcsin(c),
        }
    }

    /// Whether the feature is a nonlinear function.
    pub fn bends(self) -> bool {
        self != Self::Scaled
    }

    /// Feature and kinetic term over any scalar: slow and plain, the reference.
    pub fn evaluate<D: DualNum<Primitive = f64> + Copy>(
        self,
        (scale, energy): (f64, f64),
        z: D,
    ) -> (D, D) {
        let u = match self {
            Self::Scaled => z / scale,
            Self::Artanh(c) => (z / c).atanh(),
            Self::Arcsin(c) => (z / c).asin(),
            Self::Arsinh(_) => (z / scale).asinh(),
        };
        let kinetic = match self {
            Self::Arsinh(c) => {
                let pi = z / scale;
                ((pi * pi + 1.0).sqrt() - 1.0) * (scale * c / energy)
            }
            _ => u * u * 0.5,
        };
        (u, kinetic)
    }

    /// Feature and kinetic term with two derivatives by z.
    pub fn feature(self, (scale, energy): (f64, f64), z: f64) -> VelocityFeature {
        let squared = VelocityFeature::squared;
        match self {
            Self::Scaled => VelocityFeature::scaled(1.0 / scale, z),
            Self::Artanh(c) => {
                let x = z / c;
                // (1 − x)(1 + x) loses no digits near the limit.
                let margin = (1.0 - x) * (1.0 + x);
                squared(
                    x.atanh(),
                    1.0 / (c * margin),
                    2.0 * x / (c * margin).powi(2),
                )
            }
            Self::Arcsin(c) => {
                let x = z / c;
                let gamma = ((1.0 - x) * (1.0 + x)).sqrt().recip();
                squared(x.asin(), gamma / c, x * gamma.powi(3) / (c * c))
            }
            Self::Arsinh(c) => {
                let pi = z / scale;
                // √(1 + π²) without overflow.
                let root = pi.hypot(1.0);
                let (slope, unit) = (1.0 / (scale * root), scale * c / energy);
                VelocityFeature {
                    value: pi.asinh(),
                    slope,
                    curvature: -(pi / root) * slope / (scale * root),
                    kinetic: [
                        // √(1 + π²) − 1 = π²/(√(1 + π²) + 1), exact for small π.
                        unit * pi * (pi / (root + 1.0)),
                        unit * pi * slope,
                        unit * slope * (slope / root),
                    ],
                }
            }
        }
    }
}

/// The feature of one velocity or momentum, and the kinetic term of κ = 1, with two derivatives each.
#[derive(Debug, Clone, Copy)]
pub struct VelocityFeature {
    /// The feature.
    pub value: f64,
    /// Its first derivative by the velocity.
    pub slope: f64,
    /// Its second derivative by the velocity.
    pub curvature: f64,
    /// The kinetic term, with its first and second derivative by the velocity.
    pub kinetic: [f64; 3],
}

impl VelocityFeature {
    /// u = z · `inverse` with the kinetic term ½ u².
    #[inline]
    pub fn scaled(inverse: f64, z: f64) -> Self {
        Self::squared(z * inverse, inverse, 0.0)
    }

    /// A feature u with two derivatives, and the kinetic term ½ u².
    #[inline]
    fn squared(value: f64, slope: f64, curvature: f64) -> Self {
        Self {
            value,
            slope,
            curvature,
            kinetic: [
                0.5 * value * value,
                value * slope,
                slope * slope + value * curvature,
            ],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use num_dual::Dual2_64;

    #[test]
    fn every_feature_and_its_kinetic_term_have_the_derivatives_of_dual_numbers() {
        let units = (0.7, 1.9);
        for seen in [
            VelocityTransform::Scaled,
            VelocityTransform::Artanh(1.5),
            VelocityTransform::Arcsin(1.5),
            VelocityTransform::Arsinh(1.5),
        ] {
            for z in [-1.4999, -0.9, -1e-9, 0.0, 0.3, 1.2] {
                let (u, kinetic) = seen.evaluate(units, Dual2_64::from_re(z).derivative());
                let found = seen.feature(units, z);
                let pairs = [
                    (found.value, u.re),
                    (found.slope, u.v1),
                    (found.curvature, u.v2),
                    (found.kinetic[0], kinetic.re),
                    (found.kinetic[1], kinetic.v1),
                    (found.kinetic[2], kinetic.v2),
                ];
                for (k, (found, oracle)) in pairs.into_iter().enumerate() {
                    let error = (found - oracle).abs() / (1.0 + oracle.abs());
                    assert!(
                        error < 1e-10,
                        "{seen:?} at {z}, {k}: {found} is not {oracle}"
                    );
                }
            }
        }
    }

    #[test]
    fn the_start_of_a_momentum_moves_at_rest_like_a_mass_and_never_faster_than_the_limit() {
        let (scale, energy, c) = (7.0, 3.0, 2.0);
        let speed = |p: f64| {
            energy
                * VelocityTransform::Arsinh(c)
                    .feature((scale, energy), p)
                    .kinetic[1]
        };
        assert!((speed(1e-6) - 1e-6 * c / scale).abs() < 1e-18);
        assert!(speed(1e9) <= c && speed(1e9) > c * (1.0 - 1e-12));
        assert!(speed(-1e300) >= -c);
    }

    #[test]
    fn the_mass_of_the_start_is_positive_at_all_speeds_in_both_charts() {
        for seen in [
            VelocityTransform::Artanh(1.0),
            VelocityTransform::Arcsin(1.0),
        ] {
            for k in -400..=400 {
                let v = (f64::from(k) / 50.0).tanh();
                assert!(seen.feature((1.0, 1.0), v).kinetic[2] > 0.0, "{seen:?} {v}");
            }
        }
    }
}
