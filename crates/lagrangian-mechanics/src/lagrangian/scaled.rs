//! Scales that bring a network's inputs and its Lagrangian to order one, without a change of the structure.

use num_dual::DualNum;
use serde::{Deserialize, Serialize};

use lagrangian_motion::{Coordinates, Error, Result};

/// One centre and scale per coordinate, one scale per velocity, one energy.
///
/// L(q, q̇) = E · N(x(q), q̇ / s): any such scaling of a Lagrangian is a Lagrangian again (theory.md, equation 22).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Scaling {
    /// Subtracted from coordinates on the line, `[n]`.
    pub q_center: Vec<f64>,
    /// Divides coordinates on the line, `[n]`; angles become cos q and sin q instead.
    pub q_scale: Vec<f64>,
    /// Divides velocities, `[n]`.
    pub qd_scale: Vec<f64>,
    /// The energy of one unit of the network's output, J.
    pub energy: f64,
    /// The cyclic coordinates: their one feature is 0, so that no function of the features depends on them, and their momenta are
    /// conserved by construction (theory.md, equation 130n).
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub cyclic: Vec<usize>,
}

impl Scaling {
    /// The identity scaling, for `n` degrees of freedom.
    #[must_use]
    pub fn identity(n: usize) -> Self {
        Self {
            q_center: vec![0.0; n],
            q_scale: vec![1.0; n],
            qd_scale: vec![1.0; n],
            energy: 1.0,
            cyclic: Vec::new(),
        }
    }

    /// Checks for positive, finite scales of `n` coordinates.
    ///
    /// # Errors
    /// [`Error::Shape`] or [`Error::Argument`].
    pub fn validate(&self, n: usize) -> Result<()> {
        let lists = [
            ("q_center", &self.q_center),
            ("q_scale", &self.q_scale),
            ("qd_scale", &self.qd_scale),
        ];
        for (name, list) in lists {
            Error::check_shape(name, list.len(), n, "give one scale per coordinate")?;
        }
        if let Some(i) = self.cyclic.iter().find(|i| **i >= n) {
            return Err(Error::argument("cyclic coordinate", i, "one of the model"));
        }
        let scales = self.q_scale.iter().chain(&self.qd_scale);
        let wrong = scales
            .chain([&self.energy])
            .find(|x| !(x.is_finite() && **x > 0.0))
            .or_else(|| self.q_center.iter().find(|x| !x.is_finite()));
        match wrong {
            None => Ok(()),
            Some(value) => Err(Error::argument(
                "scaling",
                value,
                "finite, and positive where it divides",
            )),
        }
    }

    /// Whether a coordinate is cyclic; mostly there are none.
    #[inline]
    fn is_cyclic(&self, i: usize) -> bool {
        !self.cyclic.is_empty() && self.names_cyclic(i)
    }

    #[inline(never)]
    fn names_cyclic(&self, i: usize) -> bool {
        self.cyclic.contains(&i)
    }

    /// Whether the features of coordinate `i` are its cosine and sine.
    #[must_use]
    #[inline]
    pub fn is_circle(&self, coordinates: &Coordinates, i: usize) -> bool {
        coordinates.is_circle(i) && !self.is_cyclic(i)
    }

    /// What divides the one feature of coordinate `i`: its scale, or ∞ where it is cyclic.
    #[must_use]
    #[inline]
    pub fn divisor(&self, i: usize) -> f64 {
        match self.is_cyclic(i) {
            true => f64::INFINITY,
            false => self.q_scale[i],
        }
    }

    /// The features of the coordinates over any scalar.
    pub fn evaluate<D: DualNum<Primitive = f64> + Copy>(
        &self,
        coordinates: &Coordinates,
        q: &[D],
    ) -> Vec<D> {
        let mut x = Vec::new();
        for (i, &q) in q.iter().enumerate() {
            if self.is_circle(coordinates, i) {
                x.extend([q.cos(), q.sin()]);
            } else {
                x.push((q - self.q_center[i]) / self.divisor(i));
            }
        }
        x
    }

    /// Number of features of the coordinates.
    #[must_use]
    pub fn features(&self, coordinates: &Coordinates) -> usize {
        (0..coordinates.dof())
            .map(|i| 1 + usize::from(self.is_circle(coordinates, i)))
            .sum()
    }
}

/// The features of one coordinate with their first and second derivatives: (cos q, sin q) or ((q − centre) / scale).
#[derive(Debug, Clone, Copy)]
pub struct Features {
    /// Values and derivatives by q; a line uses the first only.
    pub values: [f64; 2],
    /// First derivatives by q.
    pub slopes: [f64; 2],
    /// Second derivatives by q.
    pub bends: [f64; 2],
    /// Number of features, 1 or 2.
    pub count: usize,
}

impl Features {
    /// The features of coordinate `i` at `q`.
    #[must_use]
    pub fn new(coordinates: &Coordinates, scaling: &Scaling, i: usize, q: f64) -> Self {
        let values = match scaling.is_circle(coordinates, i) {
            true => {
                let (sin, cos) = q.sin_cos();
                [cos, sin]
            }
            false => [(q - scaling.q_center[i]) / scaling.divisor(i), 0.0],
        };
        Self::recall(coordinates, scaling, i, |k| values[k])
    }

    /// The features with these values, which a pass has stored.
    #[inline]
    pub fn recall(
        coordinates: &Coordinates,
        scaling: &Scaling,
        i: usize,
        value: impl Fn(usize) -> f64,
    ) -> Self {
        match scaling.is_circle(coordinates, i) {
            true => Self::circle(value(0), value(1)),
            false => Self::line(value(0), 1.0 / scaling.divisor(i)),
        }
    }

    /// The features of an angle.
    #[inline]
    pub fn circle(cos: f64, sin: f64) -> Self {
        Self {
            values: [cos, sin],
            slopes: [-sin, cos],
            bends: [-cos, -sin],
            count: 2,
        }
    }

    /// The feature of a coordinate on the line; `slope` is 1 / its scale.
    #[inline]
    pub fn line(value: f64, slope: f64) -> Self {
        Self {
            values: [value, 0.0],
            slopes: [slope, 0.0],
            bends: [0.0; 2],
            count: 1,
        }
    }

    /// Second derivative of feature `k` by q.
    pub fn curvature(&self, k: usize) -> f64 {
        if self.count == 2 {
            -self.values[k]
        } else {
            0.0
        }
    }
}
