//! An arm of two links in a vertical plane, with its motors on stiff shafts or behind gears with play.

use num_dual::DualNum;
use rand::Rng;

use crate::data::without_parameters;
use lagrangian::analytic::{System, uniform};
use lagrangian::{Coordinates, State};

/// Mass at the end of each link, kg, length of a link, m, gravity, m/s², and inertia of a rotor at its joint, kg·m².
const MASS: f64 = 1.0;
const LENGTH: f64 = 0.5;
const GRAVITY: f64 = 9.81;
const ROTOR: f64 = 0.05;

/// Stiffness of a gear, N·m/rad, and its damping, N·m·s/rad.
const STIFFNESS: f64 = 2000.0;
const DAMPING: f64 = 20.0;

/// L = ½ (2m) l² θ̇₁² + ½ m l² θ̇₂² + m l² θ̇₁ θ̇₂ cos q₂ + 2 m g l cos θ₁ + m g l cos θ₂ + ½ J |q̇|² with θ₁ = q₁ and
/// θ₂ = q₁ + q₂: the angle of each joint, 0 hanging down.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Arm;

/// Without its rotors.
fn links<D: DualNum<Primitive = f64> + Copy>(q: &[D], qd: &[D]) -> D {
    let (outer, outer_rate) = (q[0] + q[1], qd[0] + qd[1]);
    let inertia = MASS * LENGTH * LENGTH;
    let weight = MASS * GRAVITY * LENGTH;
    qd[0] * qd[0] * inertia
        + outer_rate * outer_rate * (0.5 * inertia)
        + qd[0] * outer_rate * q[1].cos() * inertia
        + q[0].cos() * (2.0 * weight)
        + outer.cos() * weight
}

fn rotors<D: DualNum<Primitive = f64> + Copy>(qd: &[D]) -> D {
    (qd[0] * qd[0] + qd[1] * qd[1]) * (0.5 * ROTOR)
}

impl System for Arm {
    without_parameters!(
        "arm",
        "two links in a vertical plane, joint angles, with rotors"
    );

    fn coordinates(&self) -> Coordinates {
        Coordinates::angles(2)
    }

    fn lagrangian<D: DualNum<Primitive = f64> + Copy>(&self, q: &[D], qd: &[D]) -> D {
        links(q, qd) + rotors(qd)
    }

    /// q ~ U[−1.5, 1.5]², q̇ ~ U[−2, 2]².
    fn sample_state(&self, rng: &mut dyn Rng) -> State {
        State::new(uniform(rng, 2, -1.5, 1.5), uniform(rng, 2, -2.0, 2.0))
    }
}

/// The same with motors behind gears: the angles of the motors, then those of the joints.
#[derive(Debug, Clone, Copy)]
pub(super) struct Geared;

impl System for Geared {
    without_parameters!("geared-arm", "the arm with its motors behind gears");

    fn coordinates(&self) -> Coordinates {
        Coordinates::angles(4)
    }

    fn lagrangian<D: DualNum<Primitive = f64> + Copy>(&self, q: &[D], qd: &[D]) -> D {
        links(&q[2..], &qd[2..]) + rotors(qd)
    }

    fn sample_state(&self, rng: &mut dyn Rng) -> State {
        let state = Arm.sample_state(rng);
        State::new(state.q.repeat(2), state.qd.repeat(2))
    }
}

impl Geared {
    /// Adds what the gears transmit: nothing within their play, else a stiff damped spring that only pushes.
    pub(super) fn transmit(play: f64, q: &[f64], qd: &[f64], tau: &mut [f64]) {
        for i in 0..2 {
            let wound = q[i] - q[i + 2];
            let pressed = wound.signum() * (wound.abs() - 0.5 * play).max(0.0);
            let torque = STIFFNESS * pressed + DAMPING * (qd[i] - qd[i + 2]);
            // Within the play nothing touches; without any, both flanks always do.
            let torque = if play == 0.0 {
                torque
            } else if pressed == 0.0 || torque * pressed < 0.0 {
                0.0
            } else {
                torque
            };
            tau[i] -= torque;
            tau[i + 2] = torque;
        }
    }
}
