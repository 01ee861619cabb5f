//! The learned functions, beside the truth where it is known: energy at rest, inertia, friction, gyroscopic forces, momenta, and the
//! states that the data visited.

mod coverage;
mod friction;
mod inertia;
mod momenta;
mod potential;
mod truth;

use std::f64::consts::{PI, TAU};

use lagrangian::trajectory::{Axis as Range, Visited};
use lagrangian::{Coordinates, Learned, Model, Signals, Trajectory};
use lagrangian_motion::statistics::{sort_by_number, upper_median};
use lagrangian_report::{Along, Axis, Figure, HeatMap, Table};

use super::Page;
use truth::Truth;

pub(super) use coverage::outside;
pub(super) use truth::{layout, simulated_robot};

/// The number of places along an axis.
const PLACES: usize = 121;
/// The extension of an axis beyond the data, in parts of their range.
const BEYOND: f64 = 0.25;

/// The parts of a page on the learned functions.
#[derive(Default)]
pub(super) struct Shown {
    pub(super) figures: Vec<Figure>,
    pub(super) maps: Vec<HeatMap>,
    pub(super) tables: Vec<Table>,
}

/// The input of the figures.
struct Subject<'a> {
    model: &'a Learned,
    coordinates: &'a Coordinates,
    motions: &'a [Trajectory],
    /// The members of the ensemble, where there is one.
    members: &'a [Learned],
    truth: Option<Truth>,
    /// The range of each coordinate and each velocity in the data, `[2n]`.
    visited: Vec<Option<Range>>,
    /// The coordinates that move, the one with the largest range first.
    moved: Vec<usize>,
    /// The median of each coordinate, `[n]`.
    middle: Vec<f64>,
}

/// Figures, maps and tables of the learned functions; empty for a model without the states that its data visited.
pub(super) fn shown(page: &Page) -> Shown {
    let Some(subject) = Subject::of(page) else {
        return Shown::default();
    };
    let mut shown = Shown::default();
    let (figure, maps) = potential::shown(&subject);
    shown.figures.extend(figure);
    shown.maps = maps;
    shown.figures.extend(inertia::figures(&subject));
    shown.figures.extend(friction::figures(&subject));
    shown.figures.extend(momenta::figures(&subject));
    shown.figures.extend(coverage::figures(&subject));
    shown.tables.push(coverage::table(&subject));
    shown
}

impl<'a> Subject<'a> {
    fn of(page: &Page<'a>) -> Option<Self> {
        let (model, motions) = (page.model, &page.evaluation.motions);
        let coordinates = model.coordinates();
        let visited = model.visited()?.ranges(coordinates);
        let range = |i: &usize| visited[*i].map_or(0.0, |axis| axis.high - axis.low);
        let n = coordinates.dof();
        let mut moved: Vec<usize> = (0..n).filter(|&i| !coordinates.is_parameter(i)).collect();
        sort_by_number(&mut moved, |i| -range(i));
        if moved.is_empty() || motions.iter().all(|motion| motion.is_empty()) {
            return None;
        }
        let members = page.ensemble.map_or(&[][..], |own| own.ensemble.members());
        let middle: Vec<f64> = (0..n).map(|i| median(motions, i)).collect();
        let truth = Truth::of(page.record, model, &middle);
        Some(Self {
            model,
            coordinates,
            motions,
            members,
            truth,
            visited,
            moved,
            middle,
        })
    }

    /// The places of axis `i` of the 2n: the range of the data and some more at both ends, a whole turn at most.
    fn places(&self, i: usize) -> (Vec<f64>, (f64, f64)) {
        let Some(axis) = self.visited[i] else {
            return (Vec::new(), (0.0, 0.0));
        };
        let (low, high) = (axis.low, axis.high);
        let wide = (high - low).max(axis.scale);
        let most = match axis.circle {
            true => (0.5 * (TAU - wide)).max(0.0),
            false => f64::INFINITY,
        };
        let more = (BEYOND * wide).min(most);
        let (from, to) = (low - more, high + more);
        let place = |k: usize| from + (to - from) * k as f64 / (PLACES - 1) as f64;
        ((0..PLACES).map(place).collect(), (low, high))
    }

    /// States with coordinate `i` at these places and all others in the middle, `[len, n]`.
    fn along(&self, i: usize, places: &[f64]) -> Vec<f64> {
        let at = |place: &f64| {
            let mut q = self.middle.clone();
            q[i] = *place;
            q
        };
        places.iter().flat_map(at).collect()
    }

    /// The most moved coordinates, at most this number of them, in order.
    fn most_moved(&self, most: usize) -> Vec<usize> {
        let mut moved: Vec<usize> = self.moved.iter().copied().take(most).collect();
        moved.sort_unstable();
        moved
    }

    /// Samples of the motions at equal distances, about `most` of them.
    fn sampled(&self, most: usize) -> impl Iterator<Item = Signals<&'a [f64]>> + use<'a> {
        let motions = self.motions;
        let rows = move || {
            let each = motions.iter();
            each.flat_map(|motion| (0..motion.len()).map(move |k| motion.row(k)))
        };
        let every = rows().count().div_ceil(most).max(1);
        rows().step_by(every)
    }

    /// A quantity of each model, from the model and the factor of its energies; `None` where the learned model lacks it.
    fn each<T>(&self, of: impl Fn(&dyn Model, f64) -> Option<T>) -> Option<Each<T>> {
        let members = self.members.iter();
        let truth = self.truth.as_ref();
        Some(Each {
            learned: of(self.model, self.factor(self.model))?,
            truth: truth.and_then(|truth| of(&*truth.system, 1.0)),
            members: members
                .filter_map(|own| of(own, self.factor(own)))
                .collect(),
        })
    }

    /// The axis of coordinate `i`.
    fn axis(&self, i: usize) -> Axis {
        let coordinate = &self.coordinates.0[i];
        Axis::linear(&coordinate.name, &coordinate.unit)
    }

    /// A value of coordinate `i` on its axis: an angle on the turn on which the data begin.
    fn unwound(&self, i: usize, value: f64) -> f64 {
        match self.visited[i] {
            Some(axis) if axis.circle => {
                let middle = 0.5 * (axis.low + axis.high);
                middle + (value - middle + PI).rem_euclid(TAU) - PI
            }
            _ => value,
        }
    }

    /// The place of the other coordinates, for a caption.
    fn elsewhere(&self) -> &'static str {
        match self.moved.len() {
            1 => "",
            _ => " The other coordinates stand at the median of the data.",
        }
    }

    /// Whether no force was recorded.
    fn is_free(&self) -> bool {
        self.model.visited().is_some_and(Visited::is_free)
    }

    /// The unit of an energy, an inertia or a force: empty where no force was recorded, since motions alone do not determine it.
    fn unit<'u>(&self, unit: &'u str) -> &'u str {
        if self.is_free() { "" } else { unit }
    }

    /// The quantity that motions without forces do not determine, and the alignment of the truth, for a caption.
    fn aligned(&self) -> &'static str {
        match &self.truth {
            Some(truth) if truth.is_scaled => {
                " No force was recorded: energies and inertias have no unit, as motions leave their factor open and, for some systems, their shape. They are scaled to the true inertia."
            }
            None if self.is_free() => {
                " No force was recorded: energies and inertias have no unit, as motions leave their factor open and, for some systems, their shape."
            }
            _ => "",
        }
    }

    /// The factor from the energies of a model to those that are shown.
    fn factor(&self, model: &Learned) -> f64 {
        match &self.truth {
            Some(truth) => truth.factor(model, &self.middle),
            None if model.visited().is_some_and(|own| own.is_free()) => {
                truth::factor(model, self.model, &self.middle)
            }
            None => 1.0,
        }
    }
}

/// A quantity as the model, the truth where it is known, and the members of an ensemble have it.
struct Each<T> {
    learned: T,
    truth: Option<T>,
    members: Vec<T>,
}

impl<T> Each<T> {
    /// Values of the quantity along an axis; the name is empty for a single quantity.
    fn along(&self, name: String, values: impl Fn(&T) -> Vec<f64>) -> Along {
        Along {
            name,
            learned: values(&self.learned),
            truth: self.truth.as_ref().map(&values).unwrap_or_default(),
            members: self.members.iter().map(values).collect(),
        }
    }
}

/// The median of coordinate `i` over all motions.
fn median(motions: &[Trajectory], i: usize) -> f64 {
    let columns = motions
        .iter()
        .flat_map(|motion| motion.q.iter().skip(i).step_by(motion.dof().max(1)));
    let mut values: Vec<f64> = columns.copied().filter(|x| x.is_finite()).collect();
    upper_median(&mut values)
}
