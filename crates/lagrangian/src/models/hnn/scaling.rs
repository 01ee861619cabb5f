//! The scales of a Hamiltonian network.

use super::HnnConfig;
use crate::dataset::{Dataset, Momenta};
use lagrangian_mechanics::Scaling;
use lagrangian_motion::statistics::{column, median_size, positive, size};
use lagrangian_motion::{Error, Result};

impl Dataset {
    /// The scales of a Hamiltonian network, whose velocities divide p, with an energy for which ∂H/∂p is of the order of q̇;
    /// and the weights of its residuals (q̇, ṗ), `[2 n]`: one over the root mean square of each. Below a limit of speed
    /// p is divided by its median instead, as few momenta may outweigh all others.
    ///
    /// # Errors
    /// [`Error::Argument`] where momenta are needed and missing; [`Error::Shape`] for another number of masses.
    pub fn phase_scaling(&self, hnn: &HnnConfig) -> Result<(Scaling, Vec<f64>)> {
        let (n, data) = (self.coordinates.dof(), &self.train);
        let size_of_momenta = |p: &[f64]| match hnn.speed_limit {
            None => size(p, n),
            Some(_) => column(p, n, |p| positive(median_size(p))),
        };
        let (velocities, accelerations) = (size(&data.qd, n), size(&data.qdd, n));
        let times = |x: &[f64], masses: &[f64]| -> Vec<f64> {
            x.iter().zip(masses).map(|(x, m)| x * m).collect()
        };
        let (p, pd) = match &hnn.momenta {
            Momenta::Recorded if data.p.is_empty() || data.pd.is_empty() => {
                return Err(Error::argument(
                    "momenta",
                    "none in the data",
                    "recorded (columns p1, p2, … or `p`), or p = m q̇ with `masses`, or `momenta` velocities",
                ));
            }
            Momenta::Recorded => (size_of_momenta(&data.p), size(&data.pd, n)),
            Momenta::Masses(m) => (times(&velocities, m), times(&accelerations, m)),
            Momenta::Velocities => (velocities.clone(), accelerations),
        };
        Error::check_shape("masses", p.len(), n, "give one for each coordinate")?;
        let moves = |i: &usize| !self.coordinates.is_parameter(*i);
        let moving: Vec<usize> = (0..n).filter(moves).collect();
        let energies = moving.iter().map(|&i| (p[i] * velocities[i]).ln());
        let energy = positive((energies.sum::<f64>() / moving.len() as f64).exp());
        let mut weights: Vec<f64> = velocities.iter().chain(&pd).map(|x| 1.0 / x).collect();
        for i in self.coordinates.parameters() {
            (weights[i], weights[n + i]) = (0.0, 0.0);
        }
        let scaling = Scaling {
            qd_scale: p,
            energy,
            ..self.scaling()
        };
        Ok((scaling, weights))
    }
}
