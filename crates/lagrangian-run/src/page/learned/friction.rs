//! Friction of each joint over its velocity.

use lagrangian::mechanics::Dissipation;
use lagrangian_report::{Along, Axis, Figure, Sweep};

use super::Subject;
use lagrangian_report::force_unit;

/// The largest number of joints that are drawn.
const MOST: usize = 8;

pub(super) fn figures(subject: &Subject) -> Vec<Figure> {
    let mut moved = subject.moved.clone();
    moved.sort_unstable();
    let figure = |&i: &usize| figure(subject, i);
    moved.iter().take(MOST).filter_map(figure).collect()
}

fn figure(subject: &Subject, i: usize) -> Option<Figure> {
    let n = subject.coordinates.dof();
    let learned = subject.model.dissipation()?;
    let (at, data) = subject.places(n + i);
    let mut velocities = vec![0.0; at.len() * n];
    velocities
        .iter_mut()
        .skip(i)
        .step_by(n)
        .zip(&at)
        .for_each(|(v, at)| *v = *at);
    let of = |dissipation: &Dissipation| -> Vec<f64> {
        let mut force = vec![0.0; velocities.len()];
        dissipation.force(&velocities, &mut force);
        force.into_iter().skip(i).step_by(n).collect()
    };
    let scaled = |model: &lagrangian::Learned, force: Vec<f64>| -> Vec<f64> {
        let factor = subject.factor(model);
        force.into_iter().map(|x| factor * x).collect()
    };
    let truth = subject.truth.as_ref();
    let truth = truth.map(|truth| of(&Dissipation::viscous(vec![truth.friction; n])));
    let members = subject.members.iter();
    let members = members.filter_map(|own| Some(scaled(own, of(own.dissipation()?))));
    let sweep = Sweep {
        quantities: vec![Along {
            learned: scaled(subject.model, of(learned)),
            truth: truth.unwrap_or_default(),
            members: members.collect(),
            ..Along::default()
        }],
        at,
        data,
    };
    let coordinate = &subject.coordinates.0[i];
    let axes = [
        Axis::velocity(&coordinate.name, &coordinate.unit),
        Axis::linear("friction", subject.unit(force_unit(&coordinate.unit))),
    ];
    let title = format!("Friction of {}", coordinate.name);
    let figure = sweep.figure(&format!("learned-friction-{}", i + 1), title, axes);
    Some(Figure {
        caption: format!(
            "The force d against the motion, without a load.{}",
            subject.aligned()
        ),
        ..figure
    })
}
