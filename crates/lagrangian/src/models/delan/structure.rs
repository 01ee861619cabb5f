//! The terms of the equation of motion of a deep Lagrangian network: M(q), C(q, q̇), gravity, and the energies.

use super::{Delan, Factor};
use crate::models::NetworkShape;
use nets::Pass;

/// M q̈ + C q̇ + g = τ − d at one state, and the energies (theory.md, equations 27, 33 and 34).
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Terms {
    /// Mass matrix M(q), kg·m² (angles), symmetric and positive definite, `[n, n]`.
    pub mass_matrix: Vec<f64>,
    /// ∂M/∂qₖ, `[n, n, n]` with k first.
    pub mass_slopes: Vec<f64>,
    /// C(q, q̇) by Christoffel's symbols, so that Ṁ − 2C is skew-symmetric, `[n, n]`. The forces of a vector potential
    /// are included, since they do no work either.
    pub coriolis_matrix: Vec<f64>,
    /// g = ∂V/∂q, N·m, `[n]`.
    pub gravity: Vec<f64>,
    /// ½ q̇ᵀ M q̇, J.
    pub kinetic_energy: f64,
    /// V(q), J, up to a constant.
    pub potential_energy: f64,
}

/// Evaluates the terms of one network; allocates nothing after its first call. See [`Delan::structure`].
#[derive(Debug)]
pub struct Structure<'a> {
    delan: &'a Delan,
    pass: Pass<f64>,
    factor: Factor,
    terms: Terms,
}

impl<'a> Structure<'a> {
    pub(super) fn new(delan: &'a Delan) -> Self {
        let n = delan.shape.dof();
        Self {
            delan,
            pass: Pass::new(&delan.shape.net, 1, n),
            factor: delan.shape.factor(),
            terms: Terms {
                mass_matrix: vec![0.0; n * n],
                mass_slopes: vec![0.0; n * n * n],
                coriolis_matrix: vec![0.0; n * n],
                gravity: vec![0.0; n],
                ..Terms::default()
            },
        }
    }

    /// The terms at the state (`q`, `qd`), `[n]` each.
    ///
    /// # Panics
    /// If `q` or `qd` have another length than the coordinates.
    pub fn at(&mut self, q: &[f64], qd: &[f64]) -> &Terms {
        let shape = &self.delan.shape;
        let n = shape.dof();
        assert!(q.len() == n && qd.len() == n, "a state has {n} coordinates");
        let (e, scale) = (shape.scaling.energy, &shape.scaling.qd_scale);
        shape.write(&mut self.pass, 0, q, qd);
        for k in 0..n {
            let unit = |i: usize| f64::from(u8::from(i == k));
            shape.write_tangent(&mut self.pass, (0, k), unit);
        }
        self.pass.forward(&shape.net, &self.delan.packed, Some(n));
        let potential = n * (n + 1) / 2;
        for k in 0..n {
            // The change along qₖ takes the place of that along q̇.
            let along = |c: usize, o: usize| self.pass.output(&shape.net, c * (2 + k), 0, o);
            self.factor.read(along, |i| qd[i] / scale[i]);
            self.terms.gravity[k] = e * along(1, potential);
            for i in 0..n {
                for j in 0..=i {
                    let slope = e / (scale[i] * scale[j]) * self.factor.mass_rate::<f64>(i, j);
                    self.terms.mass_slopes[(k * n + i) * n + j] = slope;
                    self.terms.mass_slopes[(k * n + j) * n + i] = slope;
                }
            }
        }
        self.finish(qd);
        &self.terms
    }

    fn finish(&mut self, qd: &[f64]) {
        let (shape, n) = (&self.delan.shape, qd.len());
        let (e, scale) = (shape.scaling.energy, &shape.scaling.qd_scale);
        let terms = &mut self.terms;
        for i in 0..n {
            for j in 0..n {
                let rotor = self
                    .delan
                    .rotors()
                    .get(i)
                    .filter(|_| i == j)
                    .unwrap_or(&0.0);
                terms.mass_matrix[i * n + j] =
                    e / (scale[i] * scale[j]) * self.factor.mass::<f64>(i, j) + rotor;
                let slope = |k: usize, i: usize, j: usize| terms.mass_slopes[(k * n + i) * n + j];
                let symbols = |k: usize| 0.5 * (slope(k, i, j) + slope(j, i, k) - slope(i, j, k));
                terms.coriolis_matrix[i * n + j] = (0..n).map(|k| symbols(k) * qd[k]).sum();
                if shape.config.vector_potential {
                    let at = n * (n + 1) / 2 + 1;
                    let curl = |i: usize, j: usize| {
                        e / scale[i] * self.pass.output(&shape.net, 2 + j, 0, at + i)
                    };
                    terms.coriolis_matrix[i * n + j] += curl(i, j) - curl(j, i);
                }
            }
        }
        let rotors = self.delan.rotors().iter().zip(qd);
        terms.kinetic_energy =
            e * self.factor.kinetic::<f64>() + rotors.map(|(j, v)| 0.5 * j * v * v).sum::<f64>();
        terms.potential_energy = e * self.factor.potential::<f64>();
    }
}
