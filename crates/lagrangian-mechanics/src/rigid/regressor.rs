//! The dynamics as a linear function of the inertial parameters (Atkeson, An, Hollerbach, Int. J. Robotics Research 5,
//! 1986; theory.md, 45 and 46).

use super::dynamics::RigidDynamics;
use super::spatial::Inertia;

/// Number of inertial parameters of a body.
pub const PER_BODY: usize = 10;

/// Names of the parameters, in the order of `Inertia::parameters`.
pub const NAMES: [&str; PER_BODY] = [
    "mass",
    "mass_x",
    "mass_y",
    "mass_z",
    "inertia_xx",
    "inertia_xy",
    "inertia_xz",
    "inertia_yy",
    "inertia_yz",
    "inertia_zz",
];

impl RigidDynamics<'_> {
    /// The regressor Y(q, q̇, q̈) with τ = Y π for the inertial parameters π of
    /// [`RigidBodies::inertial_parameters`](super::RigidBodies::inertial_parameters), `[n, 10 n]`, row-major: for each
    /// unit parameter of a body, the torques of the resulting wrench at the joints that carry the body.
    pub fn inertial_regressor(
        &mut self,
        q: &[f64],
        qd: &[f64],
        qdd: &[f64],
        regressor: &mut [f64],
    ) {
        self.follow(q, qd, qdd);
        let columns = PER_BODY * self.n();
        regressor.fill(0.0);
        for body in 0..self.n() {
            for k in 0..PER_BODY {
                let mut unit = [0.0; PER_BODY];
                unit[k] = 1.0;
                let wrench = self.needed(body, &Inertia::of_parameters(unit));
                let at = PER_BODY * body + k;
                self.felt(body, wrench, |row, x| regressor[row * columns + at] = x);
            }
        }
    }
}
