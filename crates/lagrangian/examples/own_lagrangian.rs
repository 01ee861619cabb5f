//! A Lagrangian of one's own: a bead on a hoop that turns about its vertical diameter.
//!
//! `cargo run --release -p lagrangian --example own_lagrangian`

use lagrangian::analytic::{Analytic, DualNum, Parameter, Rng, System, uniform};
use lagrangian::mechanics::Quantities;
use lagrangian::rollout::{free, times};
use lagrangian::{Coordinates, Result, RolloutOptions, State, rollout};

/// L / m = ½ r² (θ̇² + Ω² sin² θ) + g r cos θ, with θ = 0 at the bottom of the hoop, which turns at Ω.
struct Bead {
    radius: f64,
    turning: f64,
}

impl System for Bead {
    const NAME: &'static str = "bead";
    const ABOUT: &'static str = "a bead of 1 kg on a turning hoop, angle from the bottom";
    const PARAMETERS: &'static [Parameter] = &[
        Parameter::positive("radius", "m", 0.5),
        Parameter::finite("turning", "rad/s", 6.0),
    ];

    fn new(values: &[f64]) -> Self {
        let (radius, turning) = (values[0], values[1]);
        Self { radius, turning }
    }

    fn coordinates(&self) -> Coordinates {
        Coordinates::angles(1)
    }

    fn lagrangian<D: DualNum<Primitive = f64> + Copy>(&self, q: &[D], qd: &[D]) -> D {
        let around = q[0].sin() * self.turning;
        let kinetic = (qd[0] * qd[0] + around * around) * (0.5 * self.radius.powi(2));
        kinetic + q[0].cos() * (9.8 * self.radius)
    }

    fn sample_state(&self, rng: &mut dyn Rng) -> State {
        State::new(uniform(rng, 1, -3.0, 3.0), uniform(rng, 1, -5.0, 5.0))
    }
}

fn main() -> Result<()> {
    let bead = Analytic::<Bead>::standard();
    let Bead { radius, turning } = bead.system();
    let rest = (9.8 / (radius * turning.powi(2))).acos();
    let qdd = bead.forward_dynamics(&[rest], &[0.0], &[0.0])?;
    println!("at rest at {rest:.4} rad, where q̈ = {:.0e} rad/s²", qdd[0]);

    let (times, options) = (times(10.0, 0.01)?, RolloutOptions::default());
    let motion = rollout(&bead, &[rest + 0.05], &[0.0], &times, &free, &options)?;
    let q = motion.trajectory.q.iter().copied();
    let lowest = rest - q.fold(f64::INFINITY, f64::min);
    println!("let go 0.05 rad above, it swings to {lowest:.4} rad below");
    Ok(())
}
