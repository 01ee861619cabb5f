//! The figures of a run's page: loss, a predicted motion, its energy, accelerations.

use lagrangian::score::Accelerations;
use lagrangian::trajectory::{Coordinate, Signal};
use lagrangian::{Model, Rollout, Trajectory};
use lagrangian_report::{
    Axis, Figure, Motion, Role, Series, energy_error_over_time, loss_curves, parity,
    phase_portrait, trajectories,
};

use super::{Page, learned};
use crate::metrics::Metric;

/// The largest number of dots of a parity figure.
const DOTS: usize = 2000;

/// The coordinates that have figures: all, or of many a few, evenly spread.
fn shown(coordinates: usize) -> impl Iterator<Item = usize> {
    const MANY: usize = 24;
    const FEW: usize = 12;
    let every = if coordinates > MANY {
        coordinates.div_ceil(FEW)
    } else {
        1
    };
    (0..coordinates).step_by(every)
}

/// The energy H at every sample, J; `None` for a model without energy.
#[must_use]
pub fn energies(model: &dyn Model, motion: &Trajectory) -> Option<Vec<f64>> {
    let mut energy = vec![0.0; motion.len()];
    let outcome = model.evaluator().energy(&motion.q, &motion.qd, &mut energy);
    outcome.is_supported().then_some(energy)
}

/// A recorded motion and its prediction by the model.
pub(super) struct Followed<'a> {
    pub(super) truth: &'a Trajectory,
    predicted: Trajectory,
}

impl<'a> Followed<'a> {
    /// The first motion of the evaluation and its prediction, if it exists.
    pub(super) fn first(page: &Page<'a>, predictions: Vec<Rollout>) -> Option<Self> {
        let truth = page.evaluation.motions.first()?;
        let predicted = predictions.into_iter().next()?.trajectory;
        Some(Self { truth, predicted })
    }

    pub(super) fn motions(&self, role: Role) -> [Motion<'_>; 2] {
        [
            Motion::new("recorded", Role::Truth, self.truth),
            Motion::new("predicted", role, &self.predicted),
        ]
    }

    /// The learned energy where it should be constant, coordinates over time, and phase portraits.
    pub(super) fn figures(&self, page: &Page) -> Vec<Figure> {
        let coordinates = page.model.coordinates();
        let motions = self.motions(page.role());
        // The energy is beside the loss, so that each coordinate has a row of its own.
        let mut figures: Vec<Figure> = self.energy(page).into_iter().collect();
        let outside = learned::outside(page.model, &self.predicted);
        figures.extend(shown(coordinates.dof()).flat_map(|i| {
            [
                self.marked(trajectories(coordinates, i, &motions), &outside),
                phase_portrait(coordinates, i, &motions),
            ]
        }));
        figures
    }

    /// The figure of a coordinate over time, with the prediction in another colour where it lies outside of the data of the model.
    fn marked(&self, mut figure: Figure, outside: &[usize]) -> Figure {
        let Some(predicted) = figure.series.iter_mut().find(|s| s.role != Role::Truth) else {
            return figure;
        };
        let mut far = Series {
            name: "predicted, outside of the data of the model".into(),
            // Neither the colour of a Lagrangian nor that of a plain network: it continues the prediction of either.
            role: Role::Other(2),
            y: vec![f64::NAN; predicted.y.len()],
            ..predicted.clone()
        };
        let whole = predicted.y.clone();
        let is_outside = |k: usize| outside.binary_search(&k).is_ok();
        for k in (0..whole.len()).filter(|&k| is_outside(k)) {
            // The line continues from the last sample within, and the other one to the next.
            let neighbours = k.saturating_sub(1)..(k + 2).min(whole.len());
            neighbours.for_each(|j| far.y[j] = whole[j]);
            predicted.y[k] = f64::NAN;
        }
        if far.y.iter().any(|y| y.is_finite()) {
            figure.series.push(far);
        }
        figure
    }

    /// The learned energy along both motions, if neither force nor friction changes it.
    fn energy(&self, page: &Page) -> Option<Figure> {
        let driven = self.truth.tau.iter().any(|tau| *tau != 0.0);
        let damped = page.model.dissipation().is_some();
        if driven || damped {
            return None;
        }
        let scale = largest_kinetic_energy(page.model, self.truth)?;
        let motions = self.motions(page.role());
        let line = |motion: &Motion| {
            let energy = energies(page.model, motion.trajectory)?;
            let start = *energy.first()?;
            let errors = energy.iter().map(|h| (h - start) / scale).collect();
            let t = motion.trajectory.t.clone();
            Some(Series::line(motion.name, motion.role, t, errors))
        };
        let lines = motions.iter().map(line).collect::<Option<_>>()?;
        Some(Figure {
            title: "Change of the learned energy".into(),
            caption: "Of the largest kinetic energy of the motion. Along the recorded motion it tells how well the \
                      model explains it; along its own prediction, the error of the integrator."
                .into(),
            ..energy_error_over_time(lines)
        })
    }
}

/// The largest difference of H at (q, q̇) and at (q, 0) along a motion, J.
fn largest_kinetic_energy(model: &dyn Model, motion: &Trajectory) -> Option<f64> {
    let mut resting = motion.clone();
    resting.qd.fill(0.0);
    let (moving, resting) = (energies(model, motion)?, energies(model, &resting)?);
    let differences = moving.iter().zip(resting).map(|(h, v)| (h - v).abs());
    Some(differences.fold(0.0, f64::max)).filter(|largest| *largest > 0.0)
}

/// Loss over steps.
pub(super) fn loss(metrics: &[Metric], role: Role) -> Figure {
    let line = |name, role, key| {
        let (x, y) = Metric::curve(metrics, key);
        Series::line(name, role, x, y)
    };
    let training = line("training", Role::Other(0), "loss/train");
    let validation = line("validation", role, "loss/validation");
    loss_curves("step", "", vec![training, validation])
}

/// Accelerations, predicted over recorded, for each coordinate.
pub(super) fn parities(page: &Page, accelerations: &[Option<Accelerations>]) -> Vec<Figure> {
    let coordinates = page.model.coordinates();
    let n = coordinates.dof();
    let (mut truth, mut predicted) = (Vec::new(), Vec::new());
    for (motion, own) in page.evaluation.motions.iter().zip(accelerations) {
        if let (Some(qdd), Some(own)) = (motion.values(Signal::Qdd), own) {
            truth.extend_from_slice(qdd);
            predicted.extend_from_slice(&own.qdd);
        }
    }
    let every = (truth.len() / n.max(1)).div_ceil(DOTS).max(1);
    let column = |signal: &[f64], i: usize| -> Vec<f64> {
        let rows = signal.chunks_exact(n).step_by(every);
        rows.map(|row| row[i]).collect()
    };
    let figure = |i: usize| {
        let Coordinate { name, unit, .. } = &coordinates.0[i];
        let (truth, predicted) = (column(&truth, i), column(&predicted, i));
        let model = Series::points("model", page.role(), truth, predicted);
        let figure = parity(
            &format!("acceleration of {name}"),
            &Axis::acceleration(unit),
            vec![model],
        );
        if page.evaluation.held_out {
            return figure;
        }
        let caption =
            "Each dot is a sample of the training data; a perfect model puts it on the diagonal.";
        Figure {
            caption: caption.into(),
            ..figure
        }
    };
    let some = shown(n).filter(|_| !truth.is_empty());
    some.map(figure).collect()
}
