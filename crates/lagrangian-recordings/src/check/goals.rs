//! Goals of position controllers: their match with the positions, and their use where no force was recorded.

use super::Item;
use super::pairs::Sums;
use crate::Recording;

/// A position follows its goal, or its negative, beyond this correlation; gravity and stalls reduce it.
const FOLLOWS: f64 = 0.5;
/// A goal whose deviation is this many times that of the position (√(180/π)) is nearer to degrees than to radians.
const DEGREES: f64 = 7.6;
/// Words in the names of columns that hold goals.
const WORDS: [&str; 6] = [
    "goal",
    "target",
    "setpoint",
    "desired",
    "reference",
    "command",
];

const WAY: &str = "name them with `goal` and their gain with `kp`: the family servo needs no force, and with gains in N·m/rad `si_gains` makes forces of them";

/// Items about the goals of all recordings together.
pub(super) fn items(recordings: &[Recording]) -> Vec<Item> {
    let Some(first) = recordings.first() else {
        return Vec::new();
    };
    let forced = recordings.iter().any(|r| !r.tau.is_empty());
    let known = recordings.iter().any(|r| !r.goal.is_empty());
    if !known {
        return unused(first).filter(|_| !forced).into_iter().collect();
    }
    let own = |i: usize| of_coordinate(recordings, i);
    let mut items: Vec<Item> = (0..first.dof()).filter_map(own).collect();
    if !forced {
        let finding = "goals in place of forces: the family servo learns the drive, or, with gains in N·m/rad, `si_gains` makes forces of them";
        items.push(Item::pass("goal", finding));
    }
    items
}

/// Columns that look like goals and are not used.
fn unused(recording: &Recording) -> Option<Item> {
    let is_goal = |name: &&String| {
        let name = name.to_lowercase();
        WORDS.iter().any(|word| name.contains(word))
    };
    let ignored = recording.columns.ignored.iter();
    let names: Vec<&str> = ignored.filter(is_goal).map(String::as_str).collect();
    (!names.is_empty()).then(|| {
        let finding = format!(
            "no forces, so that the motion is taken for a free one, but columns that look like goals of a controller: {}",
            names.join(", ")
        );
        Item::doubt("goal", finding, WAY)
    })
}

/// Sums over goals and positions at the samples at which a motor is on.
fn sums(recordings: &[Recording], i: usize) -> Sums {
    let mut sums = Sums::default();
    for r in recordings.iter().filter(|r| r.goal.len() == r.q.len()) {
        let on = |k: &usize| r.enabled.get(*k).is_none_or(|x| *x != 0.0);
        for k in (i..r.q.len()).step_by(r.dof()).filter(on) {
            // Differences from the first goal, so that far goals lose no digits.
            sums.add(r.goal[k] - r.goal[i], r.q[k] - r.goal[i]);
        }
    }
    sums
}

fn of_coordinate(recordings: &[Recording], i: usize) -> Option<Item> {
    let name = &recordings[0].coordinates.0[i].name;
    let Sums {
        xx: goal,
        yy: position,
        xy: both,
        ..
    } = sums(recordings, i).centred();
    let (correlation, ratio) = (both / (goal * position).sqrt(), (goal / position).sqrt());
    if !correlation.is_finite() {
        return None; // A goal or a position is constant; other items report it.
    }
    let figures = format!(
        "{name}: correlation of the position with its goal {correlation:.2}, deviation of the goal {ratio:.2} times that of the position"
    );
    let same_unit = (1.0 / DEGREES..=DEGREES).contains(&ratio);
    let item = if correlation < -FOLLOWS {
        let remedy = "reverse the sign of the goal, or of the position and its velocity";
        Item::doubt("goal", figures + ": it moves against its goal", remedy)
    } else if correlation > FOLLOWS && !same_unit {
        let remedy = "give goals and positions in one unit: radians, or `degrees` for both";
        Item::doubt("goal", figures + ": they are in different units", remedy)
    } else {
        Item::pass("goal", figures)
    };
    let item = item.claims(Some(i), correlation.signum());
    Some(item.value("correlation", correlation).value("ratio", ratio))
}
