//! Coordinates that depend on each other: points that rods, circles or lines hold.

use super::Item;
use crate::Recording;
use crate::constraints::{Found, Kind, find};

/// The constraints that all recordings keep, but for coordinates that rest.
pub(super) fn items(recordings: &[Recording]) -> Option<Item> {
    let first = recordings.first()?;
    if recordings
        .iter()
        .any(|r| r.coordinates != first.coordinates)
    {
        return None;
    }
    let motions: Vec<&[f64]> = recordings.iter().map(|r| &*r.signals.q).collect();
    let structure = find(&first.coordinates, &motions);
    let moving = structure
        .found
        .iter()
        .filter(|own| own.kind != Kind::Fixed && !is_centre(own));
    let found: Vec<&str> = moving.map(|own| &*own.constraint.name).collect();
    let finding = format!(
        "{}: {} coordinates depend on each other and have {} degrees of freedom, so that nothing tells their masses and forces apart",
        found.join("; "),
        first.dof(),
        structure.freedom,
    );
    let remedy = "fit them as points that constraints join (`family` cartesian), or use angles (`polar` makes them of two columns each), so that each \
                  coordinate can move by itself";
    // One motion may follow a circle by chance, as the orbit of a planet does.
    let name = if recordings.len() > 1 {
        CONSTRAINTS
    } else {
        "coupled"
    };
    (!found.is_empty()).then(|| Item::doubt(name, finding, remedy))
}

/// Whether it says that the centre of mass of some bodies rests, as it does where their momentum is 0.
fn is_centre(found: &Found) -> bool {
    let slopes = &found.constraint.slopes;
    let alike = slopes.iter().all(|own| own.1 > 0.0) || slopes.iter().all(|own| own.1 < 0.0);
    found.kind == Kind::Line && slopes.len() > 2 && alike
}

/// The name of the item of constraints.
pub const CONSTRAINTS: &str = "constraints";
