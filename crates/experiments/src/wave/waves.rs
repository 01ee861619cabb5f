//! What a physicist asks of a field: its dispersion relation, the speed of a pulse, where a kink is.

use std::f64::consts::{PI, TAU};

use lagrangian::Model;

/// The angle in (−π, π] that differs from `x` by whole turns.
pub(super) fn wrapped(x: f64) -> f64 {
    PI - (PI - x).rem_euclid(TAU)
}

/// ω² of small waves with `mode` wavelengths around a ring, by the model's own accelerations: −1 times the share of
/// cos kx in φ̈ at φ = ± `amplitude` · cos kx at rest, over the amplitude. Negative where the ring is unstable.
pub(super) fn dispersion(model: &dyn Model, mode: usize, amplitude: f64) -> f64 {
    let n = model.coordinates().dof();
    let shape: Vec<f64> = (0..n)
        .map(|i| (TAU * (mode * i % n) as f64 / n as f64).cos())
        .collect();
    let (zero, mut qdd) = (vec![0.0; n], vec![0.0; n]);
    let mut evaluator = model.evaluator();
    let mut share = 0.0;
    for sign in [1.0, -1.0] {
        let phi: Vec<f64> = shape.iter().map(|x| sign * amplitude * x).collect();
        let _ = evaluator.forward_dynamics(&phi, &zero, &zero, &mut qdd);
        share += 0.5 * sign * lagrangian::mechanics::dot(&qdd, &shape);
    }
    let norm = lagrangian::mechanics::dot(&shape, &shape);
    -share / (norm * amplitude)
}

/// A Gaussian pulse.
pub(super) struct Pulse {
    /// Its height.
    pub(super) height: f64,
    /// Its centre, in points.
    pub(super) centre: f64,
    /// Points from its centre to where it is e⁻¹ of its height.
    pub(super) width: f64,
}

impl Pulse {
    /// The pulse on a ring, with φ̇ = −`speed` ∂φ/∂x (points a second), so that it runs to the right; at rest with 0.
    pub(super) fn start(&self, points: usize, speed: f64) -> (Vec<f64>, Vec<f64>) {
        let length = points as f64;
        let at = |i: usize| {
            let x = i as f64 - self.centre;
            let x = x - length * (x / length).round();
            let phi = self.height * (-(x / self.width).powi(2)).exp();
            (phi, speed * 2.0 * x / self.width.powi(2) * phi)
        };
        (0..points).map(at).unzip()
    }
}

/// The centre of φ² on the ring, in points: the phase of its first Fourier component.
pub(super) fn centre_of_pulse(phi: &[f64]) -> f64 {
    let n = phi.len() as f64;
    let (mut re, mut im) = (0.0, 0.0);
    for (i, x) in phi.iter().enumerate() {
        let (sin, cos) = (TAU * i as f64 / n).sin_cos();
        re += x * x * cos;
        im += x * x * sin;
    }
    (im.atan2(re) / TAU * n).rem_euclid(n)
}

/// A kink of the sine-Gordon equation that moves at v < c: φ = 4 arctan exp(γ (x − x₀) ω₀/c), φ̇ = −v ∂φ/∂x, from 0 to 2π
/// once around a ring at spacing 1 (γ = 1/√(1 − v²/c²)).
pub(super) fn kink(
    points: usize,
    centre: f64,
    (speed, gap, v): (f64, f64, f64),
) -> (Vec<f64>, Vec<f64>) {
    let steepness = gap / speed / (1.0 - (v / speed).powi(2)).sqrt();
    let at = |i: usize| {
        let x = steepness * (i as f64 - centre);
        (4.0 * x.exp().atan(), -v * 2.0 * steepness / x.cosh())
    };
    (0..points).map(at).unzip()
}

/// Where φ passes π (modulo 2π) on the ring, in points, and its slope there; `None` where it does not.
pub(super) fn kink_position(phi: &[f64]) -> Option<(f64, f64)> {
    let n = phi.len();
    (0..n).find_map(|i| {
        let (from, step) = (wrapped(phi[i] - PI), wrapped(phi[(i + 1) % n] - phi[i]));
        let passes = step != 0.0 && (0.0..1.0).contains(&(-from / step)) && from.abs() < 0.5 * PI;
        passes.then(|| (i as f64 - from / step, step))
    })
}

/// The speed of a place on a ring of this length by least squares, which moves less than half the ring between samples.
pub(super) fn speed_of_motion(times: &[f64], places: &[f64], length: f64) -> f64 {
    let mut unrolled = Vec::with_capacity(places.len());
    for &place in places {
        let last = unrolled.last().copied().unwrap_or(place);
        let step: f64 = place - last;
        unrolled.push(place - length * (step / length).round());
    }
    slope(times, &unrolled)
}

/// The slope of the line through points (x, y) by least squares.
pub(super) fn slope(x: &[f64], y: &[f64]) -> f64 {
    let count = x.len() as f64;
    let (mx, my) = (x.iter().sum::<f64>() / count, y.iter().sum::<f64>() / count);
    let pairs = || x.iter().zip(y).map(|(a, b)| (a - mx, b - my));
    pairs().map(|(a, b)| a * b).sum::<f64>() / pairs().map(|(a, _)| a * a).sum::<f64>()
}
