//! The distance of motions from the states that the data of a model visited.

use serde::Serialize;

use lagrangian_mechanics::Beyond;
use lagrangian_mechanics::dynamics::Model;
use lagrangian_motion::Trajectory;

/// The largest number of samples that are examined.
const SAMPLES: usize = 10_000;
/// The largest part of the samples outside for a motion like the fitted ones.
const USUAL: f64 = 0.05;

/// The distance of motions from the states that the data of a model [visited](crate::trajectory::Visited).
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Outside {
    /// The part of the samples that lies outside.
    pub share: f64,
    /// The largest distance of a sample, 1 at the border.
    pub farthest: f64,
    /// The axis on which that sample is farthest beyond its range, if it is beyond one.
    pub beyond: Option<Beyond>,
}

impl Outside {
    /// Whether more of the samples lie outside than of motions like the fitted ones.
    #[must_use]
    pub fn is_unusual(&self) -> bool {
        self.share > USUAL
    }
}

/// The distance of motions from the states that the data of a model visited; `None` where these are unknown, and without motion.
#[must_use]
pub fn outside(model: &dyn Model, motions: &[Trajectory]) -> Option<Outside> {
    let (visited, coordinates) = (model.visited()?, model.coordinates());
    let rows = motions.iter().flat_map(|t| (0..t.len()).map(|k| t.row(k)));
    let samples: usize = motions.iter().map(Trajectory::len).sum();
    let mut found = Outside {
        share: 0.0,
        farthest: 0.0,
        beyond: None,
    };
    let mut count = 0.0;
    for row in rows.step_by(samples.div_ceil(SAMPLES).max(1)) {
        let distance = visited.distance(coordinates, row.q, row.qd);
        count += 1.0;
        // A state that is not finite is outside too, and does not count as the farthest.
        found.share += if distance <= 1.0 { 0.0 } else { 1.0 };
        if distance > found.farthest {
            found.farthest = distance;
            found.beyond = visited.beyond(coordinates, row.q, row.qd);
        }
    }
    found.share /= count;
    (count > 0.0).then_some(found)
}
