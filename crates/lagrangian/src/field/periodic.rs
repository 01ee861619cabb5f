//! Whether the points of a recording can be a ring at all.

use super::{Symmetry, wrapped};
use crate::train::Samples;
use crate::{Error, Result};

/// The bend of the field across the seam may exceed that elsewhere by this factor: on a ring they are equal but for
/// chance.
const MOST_SEAM: f64 = 4.0;
/// A point that moves less than this share of the others is held.
const LEAST_MOTION: f64 = 1e-3;

/// Refuses rings that are none: where last and first point are the same one, where a point is held while the others
/// move, and where the field jumps or bends at the seam as nowhere else (root mean squares over all samples of second
/// differences, those of the two points at the seam beside the median of all).
///
/// # Errors
/// [`Error::Argument`], which says what is wrong and how to mend it; [`Error::NotFinite`].
pub fn check_periodic(samples: &Samples, symmetry: Symmetry) -> Result<()> {
    let n = samples.n;
    for (what, signal) in [
        ("phi", &samples.q),
        ("phi velocity", &samples.qd),
        ("phi acceleration", &samples.qdd),
    ] {
        if let Some(index) = signal.iter().position(|x| !x.is_finite()) {
            return Err(Error::NotFinite {
                what: what.into(),
                index,
            });
        }
    }
    if n < 5 || samples.is_empty() {
        return Ok(());
    }
    let step = |ring: &[f64], i: usize| {
        let step = ring[(i + 1) % n] - ring[i % n];
        if symmetry == Symmetry::Turn {
            wrapped(step)
        } else {
            step
        }
    };
    let size = |of: &dyn Fn(&[f64], usize) -> f64, i: usize, signal: &[f64]| {
        let squares = signal.chunks_exact(n).map(|ring| of(ring, i).powi(2));
        (squares.sum::<f64>() / samples.len() as f64).sqrt()
    };
    let all = |of: &dyn Fn(&[f64], usize) -> f64, signal: &[f64]| {
        let sizes = (0..n).map(|i| size(of, i, signal)).collect::<Vec<f64>>();
        let mut sorted = sizes.clone();
        sorted.sort_by(f64::total_cmp);
        (sizes, sorted[n / 2])
    };
    let refuse = |value: String, must| {
        Err(Error::Argument {
            name: "ring of points",
            value,
            must,
        })
    };
    let (steps, usual_step) = all(&step, &samples.q);
    if usual_step > 0.0 && steps[n - 1] < 1e-9 * usual_step {
        let must = "without the repeated point: the last one is the first again, leave it out";
        return refuse(
            format!("{n} points of which the first and the last are always equal"),
            must,
        );
    }
    let (motions, usual_motion) = all(&|ring, i| ring[i], &samples.qd);
    let held = motions
        .iter()
        .position(|x| *x < LEAST_MOTION * usual_motion);
    if let Some(i) = held {
        let must =
            "one where every point moves by the same law: a field with fixed ends is no ring";
        return refuse(format!("one whose point {} stands still", i + 1), must);
    }
    let bend = |ring: &[f64], i: usize| step(ring, i + n) - step(ring, i + n - 1);
    let (bends, usual_bend) = all(&bend, &samples.q);
    let seam = bends[0].max(bends[n - 1]);
    if seam > MOST_SEAM * usual_bend && usual_bend > 0.0 {
        let must = "periodic: record a whole period, or tell the ends apart with another model";
        let value = format!(
            "one that jumps from its last point to its first: {:.1} times the bend elsewhere",
            seam / usual_bend
        );
        return refuse(value, must);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Snapshots of φ(x, t) at `n` points from 0 to `length`.
    fn snapshots(n: usize, length: f64, phi: impl Fn(f64, f64) -> f64) -> Samples {
        let mut samples = Samples {
            n,
            ..Samples::default()
        };
        for t in (0..40).map(|k| 0.37 * f64::from(k)) {
            for x in (0..n).map(|i| length * i as f64 / n as f64) {
                samples.q.push(phi(x, t));
                samples
                    .qd
                    .push((phi(x, t + 1e-4) - phi(x, t - 1e-4)) / 2e-4);
                samples.qdd.push(0.0);
                samples.tau.push(0.0);
            }
        }
        samples
    }

    fn refusal(samples: &Samples) -> String {
        let found = check_periodic(samples, Symmetry::None);
        found.err().map_or_else(String::new, |e| e.to_string())
    }

    #[test]
    fn a_ring_passes_and_pieces_of_a_longer_field_do_not() {
        let wave = |x: f64, t: f64| (x - t).sin() + 0.5 * (2.0 * x + 2.0 * t).cos();
        let whole = std::f64::consts::TAU;
        assert_eq!(refusal(&snapshots(20, whole, wave)), "");
        for length in [0.5 * whole, 0.8 * whole, 1.3 * whole] {
            let message = refusal(&snapshots(20, length, wave));
            assert!(message.contains("jumps"), "{length}: {message}");
        }
        let repeated = snapshots(20, whole * 20.0 / 19.0, wave);
        assert!(refusal(&repeated).contains("leave it out"));
        let string = snapshots(20, 0.5 * whole, |x, t| {
            x.sin() * t.cos() + (2.0 * x).sin() * (2.0 * t).sin()
        });
        assert!(refusal(&string).contains("point 1 stands still"));
    }

    #[test]
    fn an_angle_may_wind_around_the_circle_along_the_ring() {
        let wound = |x: f64, t: f64| x + 0.3 * (x - t).sin();
        let samples = snapshots(20, std::f64::consts::TAU, wound);
        assert!(check_periodic(&samples, Symmetry::Turn).is_ok());
        assert!(check_periodic(&samples, Symmetry::None).is_err());
    }
}
