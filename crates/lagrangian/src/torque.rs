//! Torques that a model predicts for a motion, and their parts (theory.md, equations 63 and 64).
//!
//! | part | from inverse dynamics τ(q, q̇, q̈) |
//! |---|---|
//! | inertial | τ(q, q̇, q̈) − τ(q, q̇, 0) = M q̈ |
//! | Coriolis | the remainder: Coriolis, centrifugal and gyroscopic forces |
//! | gravity | τ(q, 0, 0) less the offset: gravity, springs |
//! | friction | d(q̇) |
//! | offset | constant, where the model has one |
//!
//! Only the model's own inverse dynamics is used, so that every family is divided alike.
//!
//! ```
//! use lagrangian::{Model, torque};
//! use lagrangian::analytic::by_name;
//!
//! let pendulum = by_name("pendulum", &[("length", 2.0)])?;
//! let parts = torque::parts(&mut *pendulum.evaluator(), &[0.5], &[3.0], &[1.0]).ok_or("no inverse dynamics")?;
//! // m l² q̈ and m g l sin q.
//! assert!((parts.inertial[0] - 4.0).abs() < 1e-12 && parts.coriolis[0].abs() < 1e-12);
//! assert!((parts.gravity[0] - 19.6 * 0.5_f64.sin()).abs() < 1e-12);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use serde::Serialize;

use crate::score::{Errors, SignalError};
use lagrangian_mechanics::dynamics::{Evaluator, Model};
use lagrangian_motion::Signal;
use lagrangian_motion::{Error, Result, Trajectory};
use lagrangian_recordings::Table;

/// The parts of the torques at `m` states, each `[m, n]`, in the unit of the forces.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct TorqueParts {
    /// The inertial torque M q̈.
    pub inertial: Vec<f64>,
    /// Coriolis torque, quadratic in the velocity for a mechanical system.
    pub coriolis: Vec<f64>,
    /// Torque that holds the system at rest.
    pub gravity: Vec<f64>,
    /// Friction, against the motion.
    pub friction: Vec<f64>,
    /// Constant offset.
    pub offset: Vec<f64>,
}

impl TorqueParts {
    /// The parts with their names in files.
    #[must_use]
    pub fn named(&self) -> [(&'static str, &[f64]); 5] {
        [
            ("inertial", &self.inertial),
            ("coriolis", &self.coriolis),
            ("gravity", &self.gravity),
            ("friction", &self.friction),
            ("offset", &self.offset),
        ]
    }

    /// The sum of the parts, the predicted τ, `[m, n]`.
    #[must_use]
    pub fn total(&self) -> Vec<f64> {
        let mut sum = vec![0.0; self.inertial.len()];
        for (_, part) in self.named() {
            sum.iter_mut().zip(part).for_each(|(s, x)| *s += x);
        }
        sum
    }
}

/// Divides the torques at `m` states, `[m, n]`; `None` for a model without inverse dynamics.
pub fn parts(
    evaluator: &mut dyn Evaluator,
    q: &[f64],
    qd: &[f64],
    qdd: &[f64],
) -> Option<TorqueParts> {
    let zero = vec![0.0; q.len()];
    let mut torque = |qd: &[f64], qdd: &[f64]| {
        let mut tau = vec![0.0; q.len()];
        let outcome = evaluator.inverse_dynamics(q, qd, qdd, &mut tau);
        outcome.is_supported().then_some(tau)
    };
    let (whole, steady, still) = (torque(qd, qdd)?, torque(qd, &zero)?, torque(&zero, &zero)?);
    // Friction in a gear depends on the torque, and is less without acceleration.
    let (mut friction, mut unaccelerated, mut offset) = (zero.clone(), zero.clone(), zero);
    let applied = evaluator.applied();
    applied.friction_and_offset(qd, &steady, &mut unaccelerated, &mut offset);
    applied.friction_and_offset(qd, &whole, &mut friction, &mut offset);
    let difference =
        |a: &[f64], b: &[f64]| -> Vec<f64> { a.iter().zip(b).map(|(a, b)| a - b).collect() };
    let by_acceleration = difference(&friction, &unaccelerated);
    Some(TorqueParts {
        inertial: difference(&difference(&whole, &steady), &by_acceleration),
        coriolis: difference(&difference(&steady, &still), &unaccelerated),
        gravity: difference(&still, &offset),
        friction,
        offset,
    })
}

/// The torques of one motion.
#[derive(Debug, Clone, PartialEq)]
pub struct TorquePrediction {
    /// Name of the trajectory.
    pub name: String,
    /// Time stamps, s, `[len]`.
    pub t: Vec<f64>,
    /// The predicted torques.
    pub parts: TorqueParts,
    /// The measured torques, `[len, n]`, where they exist.
    pub measured: Option<Vec<f64>>,
}

/// Predicts the torques of a motion.
///
/// # Errors
/// As [`Trajectory::validate`]; [`Error::Shape`] for another number of coordinates, or a motion without
/// accelerations; [`Error::Argument`] for a model without inverse dynamics.
pub fn predict_torque(model: &dyn Model, motion: &Trajectory) -> Result<TorquePrediction> {
    motion.validate()?;
    motion.check_dof(model.coordinates().dof())?;
    let Some(qdd) = motion.values(Signal::Qdd) else {
        return Err(Error::shape(
            format!("qdd of trajectory '{}'", motion.name),
            0,
            motion.q.len(),
            "estimate the accelerations when the recording becomes a trajectory",
        ));
    };
    let parts = parts(&mut *model.evaluator(), &motion.q, &motion.qd, qdd);
    let parts = parts.ok_or(Error::argument(
        "model",
        "a network that predicts accelerations only",
        "one with inverse dynamics, such as a Lagrangian (`family` lnn)",
    ))?;
    Ok(TorquePrediction {
        name: motion.name.clone(),
        t: motion.t.clone(),
        parts,
        measured: motion.values(Signal::Tau).map(<[f64]>::to_vec),
    })
}

/// The size of a part of the torque, by coordinate.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PartSize {
    /// The name of the part.
    pub part: &'static str,
    /// Root mean square over all samples, `[n]`, in the unit of the forces.
    pub rms: Vec<f64>,
}

/// A summary of the torques of some motions.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TorqueSummary {
    /// The number of all samples.
    pub samples: usize,
    /// The sizes of the prediction and of each of its parts.
    pub sizes: Vec<PartSize>,
    /// Root mean square of the measured torque, `[n]`, where it exists.
    pub measured: Option<Vec<f64>>,
    /// Error against the measured torques, where they exist.
    pub error: Option<SignalError>,
}

/// Sums up predictions of one model with `n` coordinates.
#[must_use]
pub fn summarise(predictions: &[TorquePrediction], n: usize) -> TorqueSummary {
    let totals: Vec<Vec<f64>> = predictions.iter().map(|p| p.parts.total()).collect();
    let mut sizes = vec![PartSize {
        part: "predicted",
        rms: root_mean_square(totals.iter().map(Vec::as_slice), n),
    }];
    for k in 0..TorqueParts::default().named().len() {
        let part = TorqueParts::default().named()[k].0;
        let values = predictions.iter().map(|p| p.parts.named()[k].1);
        sizes.push(PartSize {
            part,
            rms: root_mean_square(values, n),
        });
    }
    let mut errors = Errors::new(n);
    for (prediction, total) in predictions.iter().zip(&totals) {
        if let Some(measured) = &prediction.measured {
            errors.add(measured, total);
        }
    }
    let measured = || predictions.iter().filter_map(|p| p.measured.as_deref());
    TorqueSummary {
        samples: predictions.iter().map(|p| p.t.len()).sum(),
        sizes,
        measured: measured().next().map(|_| root_mean_square(measured(), n)),
        error: errors.finish(),
    }
}

fn root_mean_square<'a>(signals: impl Iterator<Item = &'a [f64]>, n: usize) -> Vec<f64> {
    let (mut sums, mut count) = (vec![0.0; n], 0);
    for row in signals.flat_map(|s| s.chunks_exact(n.max(1))) {
        sums.iter_mut().zip(row).for_each(|(sum, x)| *sum += x * x);
        count += 1;
    }
    let count = f64::from(u32::try_from(count.max(1)).unwrap_or(u32::MAX));
    sums.iter().map(|sum| (sum / count).sqrt()).collect()
}

/// The columns t, tau1 …, measured1 …, inertial1 …, coriolis1 …, gravity1 …, friction1 …, offset1 … of a file.
#[must_use]
pub fn table(predictions: &[TorquePrediction], n: usize) -> Table {
    let column = |values: &dyn Fn(&TorquePrediction) -> Vec<f64>| -> Vec<f64> {
        predictions.iter().flat_map(values).collect()
    };
    let mut columns = vec![("t".to_owned(), column(&|p| p.t.clone()))];
    let mut signal = |name: &str, values: &dyn Fn(&TorquePrediction) -> Vec<f64>| {
        let all = column(values);
        for i in 0..n {
            let own = all.iter().skip(i).step_by(n).copied().collect();
            columns.push((format!("{name}{}", i + 1), own));
        }
    };
    signal("tau", &|p| p.parts.total());
    if predictions.iter().any(|p| p.measured.is_some()) {
        let none = |p: &TorquePrediction| vec![f64::NAN; p.t.len() * n];
        signal("measured", &|p| {
            p.measured.clone().unwrap_or_else(|| none(p))
        });
    }
    for k in 0..TorqueParts::default().named().len() {
        let name = TorqueParts::default().named()[k].0;
        signal(name, &|p| p.parts.named()[k].1.to_vec());
    }
    Table {
        trajectories: predictions
            .iter()
            .map(|p| (p.name.clone(), p.t.len()))
            .collect(),
        columns,
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;
    use lagrangian_mechanics::analytic::by_name;
    use lagrangian_mechanics::dynamics::Mechanical;
    use lagrangian_mechanics::forces::{Actuation, Dissipation};
    use lagrangian_motion::Signals;

    /// States of a double pendulum, `[3, 2]` each.
    const Q: [f64; 6] = [0.3, -1.0, 2.0, 0.4, -0.7, 0.1];
    const QD: [f64; 6] = [1.0, -2.0, 0.5, 3.0, 0.0, -1.0];
    const QDD: [f64; 6] = [4.0, 1.0, -3.0, 2.0, 0.5, -6.0];

    /// A damped double pendulum.
    fn with_damped(test: impl FnOnce(&dyn Model)) {
        let system = by_name("double-pendulum", &[]).unwrap();
        let d = Dissipation::viscous(vec![0.3, 0.2]);
        test(&Mechanical::dissipative(system.lagrangian(), d).unwrap());
    }

    #[test]
    fn the_parts_are_those_of_the_mechanics_and_add_up_to_the_torque() {
        with_damped(|model| {
            let once = parts(&mut *model.evaluator(), &Q, &QD, &QDD).unwrap();
            let mut tau = [0.0; 6];
            let _ = model.evaluator().inverse_dynamics(&Q, &QD, &QDD, &mut tau);
            let same = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-12);
            assert!(same(&once.total(), &tau));
            let friction: Vec<f64> = QD
                .iter()
                .enumerate()
                .map(|(k, v)| v * [0.3, 0.2][k % 2])
                .collect();
            assert!(same(&once.friction, &friction));
            // Coriolis forces are quadratic in the velocity, inertial forces linear in the acceleration, and neither
            // changes with the other.
            let twice = |x: &[f64; 6]| x.map(|x| 2.0 * x);
            let faster = parts(&mut *model.evaluator(), &Q, &twice(&QD), &twice(&QDD)).unwrap();
            let times =
                |x: &[f64], factor: f64| -> Vec<f64> { x.iter().map(|x| factor * x).collect() };
            assert!(same(&faster.coriolis, &times(&once.coriolis, 4.0)));
            assert!(same(&faster.inertial, &times(&once.inertial, 2.0)));
            assert!(same(&faster.gravity, &once.gravity));
            assert!(once.coriolis.iter().any(|c| c.abs() > 0.1));
        });
    }

    #[test]
    fn inputs_with_gains_and_offsets_are_divided_in_the_unit_of_the_inputs() {
        let system = by_name("double-pendulum", &[]).unwrap();
        let lagrangian = || {
            let d = Dissipation::viscous(vec![0.3, 0.2]);
            Mechanical::dissipative(system.lagrangian(), d).unwrap()
        };
        let gains = Actuation::gains(&[2.0, 4.0], vec![0.5, -1.0]).unwrap();
        let torques = parts(&mut *lagrangian().evaluator(), &Q, &QD, &QDD).unwrap();
        let driven = lagrangian().driven(gains).unwrap();
        let inputs = parts(&mut *driven.evaluator(), &Q, &QD, &QDD).unwrap();
        for (k, gain) in [2.0, 4.0].into_iter().cycle().take(6).enumerate() {
            for ((name, torque), (_, input)) in torques.named().into_iter().zip(inputs.named()) {
                let offset = if name == "offset" {
                    [0.5, -1.0][k % 2]
                } else {
                    0.0
                };
                let expected = (torque[k] + offset) / gain;
                assert!(
                    (input[k] - expected).abs() < 1e-12,
                    "{name}: {} {expected}",
                    input[k]
                );
            }
        }
    }

    #[test]
    fn the_power_of_gravity_is_the_change_of_the_potential_energy() {
        with_damped(|model| {
            let mut evaluator = model.evaluator();
            let gravity = parts(&mut *evaluator, &Q, &QD, &QDD).unwrap().gravity;
            let mut potential = |q: &[f64; 6]| {
                let mut energy = [0.0; 3];
                let _ = evaluator.energy(q, &[0.0; 6], &mut energy);
                energy
            };
            for i in 0..2 {
                let moved = |h: f64| {
                    let mut q = Q;
                    (0..3).for_each(|k| q[2 * k + i] += h);
                    q
                };
                let (more, less) = (potential(&moved(1e-5)), potential(&moved(-1e-5)));
                for k in 0..3 {
                    let slope = (more[k] - less[k]) / 2e-5;
                    assert!(
                        (slope - gravity[2 * k + i]).abs() < 1e-6,
                        "{slope} {gravity:?}"
                    );
                }
            }
        });
    }

    #[test]
    fn the_summary_of_a_perfect_prediction_has_no_error() {
        with_damped(|model| {
            let mut tau = vec![0.0; 6];
            let _ = model.evaluator().inverse_dynamics(&Q, &QD, &QDD, &mut tau);
            let motion = Trajectory::new(
                "a",
                vec![0.0, 0.1, 0.2],
                Signals {
                    q: Q.to_vec(),
                    qd: QD.to_vec(),
                    qdd: QDD.to_vec(),
                    tau: tau.clone(),
                    ..Signals::default()
                },
            );
            let predictions = vec![predict_torque(model, &motion).unwrap(); 2];
            let summary = summarise(&predictions, 2);
            assert!(summary.error.unwrap().nmse_mean < 1e-28);
            assert_eq!(summary.samples, 6);
            let rms = ((tau[0] * tau[0] + tau[2] * tau[2] + tau[4] * tau[4]) / 3.0).sqrt();
            assert!((summary.measured.unwrap()[0] - rms).abs() < 1e-12);
            let table = table(&predictions, 2);
            assert_eq!(table.columns.len(), 1 + 2 * 7);
            assert!(table.columns.iter().all(|(_, values)| values.len() == 6));
            assert_eq!(table.columns[2].0, "tau2");
        });
    }

    #[test]
    fn a_motion_without_accelerations_is_refused() {
        with_damped(|model| {
            let motion = Trajectory::new(
                "a",
                vec![0.0, 0.1, 0.2],
                Signals {
                    q: Q.to_vec(),
                    qd: QD.to_vec(),
                    ..Signals::default()
                },
            );
            assert!(predict_torque(model, &motion).is_err());
        });
    }
}
