//! Friction of each joint over its velocity.

use lagrangian::Learned;
use lagrangian::mechanics::Dissipation;
use lagrangian_report::{Axis, Figure, Sweep, force_unit};

use super::{Each, Subject};

/// The largest number of joints that are drawn.
const MOST: usize = 8;

pub(super) fn figures(subject: &Subject) -> Vec<Figure> {
    let figure = |i| figure(subject, i);
    let moved = subject.most_moved(MOST).into_iter();
    moved.filter_map(figure).collect()
}

fn figure(subject: &Subject, i: usize) -> Option<Figure> {
    let n = subject.coordinates.dof();
    let (at, data) = subject.places(n + i);
    let velocity = |at: f64| (0..n).map(move |k| if k == i { at } else { 0.0 });
    let velocities: Vec<f64> = at.iter().flat_map(|at| velocity(*at)).collect();
    let force = |dissipation: &Dissipation, factor: f64| -> Vec<f64> {
        let mut force = vec![0.0; velocities.len()];
        dissipation.force(&velocities, &mut force);
        force
            .into_iter()
            .skip(i)
            .step_by(n)
            .map(|x| factor * x)
            .collect()
    };
    let of = |model: &Learned| Some(force(model.dissipation()?, subject.factor(model)));
    let each = Each {
        learned: of(subject.model)?,
        truth: subject
            .truth
            .as_ref()
            .map(|truth| force(&truth.friction, 1.0)),
        members: subject.members.iter().filter_map(of).collect(),
    };
    let sweep = Sweep {
        quantities: vec![each.along(String::new(), Vec::clone)],
        at,
        data,
    };
    let coordinate = &subject.coordinates.0[i];
    let axes = [
        Axis::velocity(&coordinate.name, &coordinate.unit),
        Axis::linear("friction", subject.unit(force_unit(&coordinate.unit))),
    ];
    let caption = format!(
        "The force d against the motion, without a load.{}",
        subject.aligned()
    );
    let title = format!("Friction of {}", coordinate.name);
    Some(sweep.figure(&format!("learned-friction-{}", i + 1), title, caption, axes))
}
