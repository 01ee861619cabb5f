//! Momenta along a recorded motion, and gyroscopic forces.

use lagrangian::Learned;
use lagrangian::mechanics::Quantities;
use lagrangian::trajectory::Coordinate;
use lagrangian_report::{Axis, Figure, Role, Series, Sweep, force_unit};

use super::Subject;

/// The largest number of coordinates whose momentum is drawn.
const MOST: usize = 4;
/// The largest number of samples of the motion that are drawn.
const DRAWN: usize = 2000;
/// A model has gyroscopic forces where they are more than this part of the bias.
const GYROSCOPIC: f64 = 1e-3;
/// Shifts of a coordinate by which nothing changes where it is cyclic, to rounding.
const SHIFTS: [f64; 3] = [0.3, 1.1, -2.0];
const ROUNDING: f64 = 1e-9;

pub(super) fn figures(subject: &Subject) -> Vec<Figure> {
    let moved = subject.most_moved(MOST).into_iter();
    let momenta = moved.filter_map(|i| momentum(subject, i));
    gyroscopic(subject).into_iter().chain(momenta).collect()
}

/// The momentum of coordinate `i` along the first motion, less that at rest: no gauge of L changes it.
fn momentum(subject: &Subject, i: usize) -> Option<Figure> {
    let motion = subject.motions.first()?;
    let n = subject.coordinates.dof();
    let rows = motion.len().min(DRAWN);
    let (q, qd) = (&motion.q[..rows * n], &motion.qd[..rows * n]);
    let still = vec![0.0; q.len()];
    let each = subject.each(|model, factor| {
        let (p, still) = (model.momentum(q, qd).ok()?, model.momentum(q, &still).ok()?);
        let pairs = p.iter().zip(&still).skip(i).step_by(n);
        Some(
            pairs
                .map(|(p, still)| factor * (p - still))
                .collect::<Vec<f64>>(),
        )
    })?;
    let t = || motion.t[..rows].to_vec();
    let truth = each.truth.into_iter();
    let mut series: Vec<Series> = truth
        .map(|p| Series::line("true", Role::Truth, t(), p))
        .collect();
    if !each.members.is_empty() {
        let members = Series::range("members of the ensemble", Role::Lnn, t(), &each.members);
        series.push(members);
    }
    series.push(Series::line("learned", Role::Lnn, t(), each.learned));
    let coordinate = &subject.coordinates.0[i];
    let (title, kept) = match is_cyclic(subject.model, &q[..n], &qd[..n], i) {
        true => (
            "Conserved momentum",
            format!(
                " Nothing in the model depends on {}, so that only friction and forces on it change its momentum (Noether 1918).",
                coordinate.name
            ),
        ),
        false => ("Momentum", String::new()),
    };
    Some(Figure {
        id: format!("learned-momentum-{}", i + 1),
        title: format!("{title} of {}", coordinate.name),
        caption: format!(
            "p = ∂L/∂q̇ along the motion '{}', less its value at rest, which a gauge of L may change at will.{kept}{}",
            motion.name,
            subject.aligned()
        ),
        x: Axis::linear("time", "s"),
        y: Axis::linear("momentum", subject.unit(unit(coordinate))),
        series,
    })
}

/// Whether the forces of a model are the same wherever coordinate `i` is.
fn is_cyclic(model: &Learned, q: &[f64], qd: &[f64], i: usize) -> bool {
    let forces = |shift: f64| {
        let mut q = q.to_vec();
        q[i] += shift;
        model.inverse_dynamics(&q, qd, qd)
    };
    let same = |(a, b): (&f64, &f64)| (a - b).abs() <= ROUNDING * a.abs().max(1.0);
    forces(0.0).is_ok_and(|own| {
        let as_own = |shift| forces(shift).is_ok_and(|other| own.iter().zip(&other).all(same));
        SHIFTS.into_iter().all(as_own)
    })
}

fn unit(coordinate: &Coordinate) -> &'static str {
    match coordinate.unit.as_str() {
        "rad" => "kg·m²/s",
        "m" => "kg·m/s",
        _ => "",
    }
}

/// The gyroscopic force on one of the two most moved coordinates for each unit of velocity of the other, along the first: the part of
/// the bias that changes its sign with the velocity, as of a charge in a magnetic field.
fn gyroscopic(subject: &Subject) -> Option<Figure> {
    let [i, j, ..] = subject.moved[..] else {
        return None;
    };
    let n = subject.coordinates.dof();
    let speed = subject.visited[n + j].map(|axis| axis.scale)?;
    let (at, data) = subject.places(i);
    let states = subject.along(i, &at);
    let moving = |sign: f64| -> Vec<f64> {
        let velocity = |k: usize| if k % n == j { sign * speed } else { 0.0 };
        (0..states.len()).map(velocity).collect()
    };
    let each = subject.each(|model, factor| {
        let forth = model.bias(&states, &moving(1.0)).ok()?;
        let back = model.bias(&states, &moving(-1.0)).ok()?;
        let pairs = forth.iter().zip(&back).skip(i).step_by(n);
        let odd: Vec<f64> = pairs.map(|(a, b)| 0.5 * factor * (a - b) / speed).collect();
        let size = forth.iter().map(|x| x.abs()).fold(0.0, f64::max) * factor.abs() / speed;
        Some((odd, size))
    })?;
    let has_one = |(odd, size): &(Vec<f64>, f64)| odd.iter().any(|x| x.abs() > GYROSCOPIC * size);
    if !has_one(&each.learned) && !each.truth.as_ref().is_some_and(has_one) {
        return None;
    }
    let sweep = Sweep {
        quantities: vec![each.along(String::new(), |(odd, _)| odd.clone())],
        at,
        data,
    };
    Some(gyroscopic_figure(subject, &sweep, [i, j]))
}

/// The figure of the gyroscopic force on coordinate `i` by the velocity of `j`.
fn gyroscopic_figure(subject: &Subject, sweep: &Sweep, [i, j]: [usize; 2]) -> Figure {
    let [on, of] = [i, j].map(|k| &subject.coordinates.0[k]);
    let label = match (force_unit(&on.unit), of.unit.as_str()) {
        ("", _) | (_, "") => String::new(),
        (force, velocity) => format!("{force}·s/{velocity}"),
    };
    let label = subject.unit(&label);
    let axes = [subject.axis(i), Axis::linear("force by velocity", label)];
    let title = format!(
        "Gyroscopic force on {} by the velocity of {}",
        on.name, of.name
    );
    let caption = format!(
        "The part of the forces that changes its sign with the velocity and does no work, for each unit of velocity.{}{}",
        subject.elsewhere(),
        subject.aligned()
    );
    sweep.figure("learned-gyroscopic", title, caption, axes)
}
