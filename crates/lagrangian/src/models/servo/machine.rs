//! A planar chain of joints with geared, position-controlled motors, and one implicit step of its motion.

use lagrangian_mechanics::forces::{Command, Drive, DrySolver, GearFriction, Load, Scalar};

/// A planar chain of n links with geared motors at its joints; over any scalar, so that motions have sensitivities.
///
/// With the absolute angles θᵢ = q₁ + … + qᵢ, M = Sᵀ (A ∘ cos(θᵢ − θⱼ)) S + diag r and
/// c = Sᵀ (Σⱼ Aᵢⱼ sin(θᵢ − θⱼ) θ̇ⱼ² + wᵢ sin(θᵢ + φᵢ)), where S sums angles (theory.md, equation 127).
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Machine<T> {
    /// Inertia of the chain A, positive definite, kg·m², row-major `[n, n]`.
    pub(crate) inertia: Vec<T>,
    /// Inertia of rotors r, kg·m², `[n]`; that of the first is part of A and 0 here.
    pub(crate) rotor: Vec<T>,
    /// Moments of weights w, N·m, `[n]`.
    pub(crate) weight: Vec<T>,
    /// Directions of the centres of mass from those of the links φ, rad, `[n]`.
    pub(crate) phase: Vec<T>,
    /// The gears, `[n]`.
    pub(crate) gears: Vec<GearFriction<T>>,
    /// The drives, `[n]`.
    pub(crate) drives: Vec<Drive<T>>,
}

/// A state of the chain.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Moving<T> {
    pub(crate) q: Vec<T>,
    pub(crate) qd: Vec<T>,
}

/// M and c at a state, and memory for a step.
#[derive(Debug, Clone)]
pub(crate) struct Workspace<T> {
    /// M, `[n, n]`.
    pub(crate) mass: Vec<T>,
    /// c, `[n]`.
    pub(crate) bias: Vec<T>,
    absolute: Vec<T>,
    rates: Vec<T>,
    impulse: Vec<T>,
    threshold: Vec<T>,
    damping: Vec<T>,
    solver: DrySolver<T>,
}

impl<T: Scalar> Moving<T> {
    pub(crate) fn at(q: &[f64], qd: &[f64]) -> Self {
        let constants = |x: &[f64]| x.iter().map(|&x| T::of(x)).collect();
        let (q, qd) = (constants(q), constants(qd));
        Self { q, qd }
    }
}

impl<T: Scalar> Workspace<T> {
    pub(crate) fn new(n: usize) -> Self {
        let zeros = |n| vec![T::of(0.0); n];
        Self {
            mass: zeros(n * n),
            bias: zeros(n),
            absolute: zeros(n),
            rates: zeros(n),
            impulse: zeros(n),
            threshold: zeros(n),
            damping: zeros(n),
            solver: DrySolver::new(n),
        }
    }
}

impl<T: Scalar> Machine<T> {
    pub(crate) fn dof(&self) -> usize {
        self.weight.len()
    }

    /// Writes M and c of a state.
    pub(crate) fn mechanics(&self, state: &Moving<T>, work: &mut Workspace<T>) {
        let n = self.dof();
        let (mut angle, mut rate) = (T::of(0.0), T::of(0.0));
        for i in 0..n {
            (angle, rate) = (angle + state.q[i], rate + state.qd[i]);
            (work.absolute[i], work.rates[i]) = (angle, rate);
        }
        for i in 0..n {
            let mut bias = self.weight[i] * (work.absolute[i] + self.phase[i]).sin();
            work.mass[i * n + i] = self.inertia[i * n + i];
            for j in (0..n).filter(|&j| j != i) {
                let difference = work.absolute[i] - work.absolute[j];
                let coupling = self.inertia[i * n + j];
                work.mass[i * n + j] = coupling * difference.cos();
                bias = bias + coupling * difference.sin() * work.rates[j] * work.rates[j];
            }
            work.bias[i] = bias;
        }
        self.to_joints(work);
    }

    /// Sᵀ M S + diag r and Sᵀ c, from sums over the links beyond each joint.
    fn to_joints(&self, work: &mut Workspace<T>) {
        let n = self.dof();
        for i in (0..n.saturating_sub(1)).rev() {
            work.bias[i] = work.bias[i] + work.bias[i + 1];
            for j in 0..n {
                work.mass[i * n + j] = work.mass[i * n + j] + work.mass[(i + 1) * n + j];
            }
        }
        for j in (0..n.saturating_sub(1)).rev() {
            for i in 0..n {
                work.mass[i * n + j] = work.mass[i * n + j] + work.mass[i * n + j + 1];
            }
        }
        for i in 0..n {
            work.mass[i * n + i] = work.mass[i * n + i] + self.rotor[i];
        }
    }

    /// One step of semi-implicit Euler over `h` seconds, implicit in friction and induced voltage:
    /// (M + h diag(b + e)) q̇⁺ + h s sgn(q̇⁺) ∋ M q̇ + h (τ − c), q⁺ = q + h q̇⁺ (theory.md, equation 128). A joint whose forces stay
    /// within its dry friction comes to rest, exactly, and remains there.
    pub(crate) fn step(
        &self,
        commands: &[Command],
        h: f64,
        state: &mut Moving<T>,
        work: &mut Workspace<T>,
    ) {
        self.mechanics(state, work);
        let n = self.dof();
        for (i, command) in commands.iter().enumerate().take(n) {
            let (q, v) = (state.q[i], state.qd[i]);
            let (gear, drive) = (&self.gears[i], &self.drives[i]);
            let commanded = drive.commanded(command, q, v);
            let induced = drive.damping(command);
            let load = Load {
                motor: commanded - induced * v,
                external: -work.bias[i],
            };
            work.threshold[i] = gear.dry(load, v).times(h);
            work.damping[i] = (gear.viscous + induced).times(h);
            work.impulse[i] = (commanded - work.bias[i]).times(h);
            for j in 0..n {
                work.impulse[i] = work.impulse[i] + work.mass[i * n + j] * state.qd[j];
            }
        }
        for (i, damping) in work.damping.iter().enumerate() {
            work.mass[i * (n + 1)] = work.mass[i * (n + 1)] + *damping;
        }
        let (impulse, threshold) = (&work.impulse, &work.threshold);
        if !work
            .solver
            .solve(&work.mass, impulse, threshold, &mut state.qd)
        {
            state.qd.fill(T::of(f64::NAN));
        }
        for (q, v) in state.q.iter_mut().zip(&state.qd) {
            *q = *q + v.times(h);
        }
    }
}
