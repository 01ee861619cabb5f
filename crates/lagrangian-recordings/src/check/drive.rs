//! Consistency of forces and motion: delay, sign and size of the forces.

use std::f64::consts::TAU;

use super::regression::{
    self, Coupling, DeadZone, FrictionTerm, JointFit, JointFits, Readings, Undriven,
};
use super::swings::{Swings, swings};
use super::{Item, range, swings_of_all};
use crate::Recording;
use lagrangian_motion::statistics::column;
use lagrangian_motion::{Topology, counted};

/// An inertia or a sign is assessed only where the motion explains this part of the variance of the force …
const EXPLAINED: f64 = 0.5;
/// … and a delay, which changes little of it, or a missing force, where it explains this part.
const WELL_EXPLAINED: f64 = 0.9;
/// A delay counts only beyond this many standard errors, because many joints are tested …
const ERRORS: f64 = 4.0;
/// … and beyond so many samples: a force that a controller holds between samples is half a sample late on average, dry friction that leads
/// looks like as much again, and a fit finds what is less with the joints known.
const SAMPLES: f64 = 1.0;
/// … and if the unexplained variance of the force is larger by this factor without it.
const GAIN: f64 = 1.15;
/// An inertia outside of this range suggests wrong units, kg m² or kg.
const INERTIA: (f64, f64) = (1e-6, 1e4);
/// Drives brake where this part of their work is against the motion, each and all together: a single one may be moved by the others.
const BRAKING: f64 = 0.5;
/// A joint that moves one way gives back the energy stored in it; with this many swings it has moved back and forth.
const FORTH_AND_BACK: usize = 3;
/// Coordinates are assumed to be in degrees where that reduces the unexplained part of the forces below this ratio.
const DEGREES: f64 = 0.5;
/// Angles that were converted from degrees may span this many turns as radians.
const TURNS: f64 = 4.0;
/// A dead zone is suspected where it divides the unexplained part of a force by this.
const DEAD_ZONE: f64 = 2.0;
/// … where this part of the force is on either side.
const TURNING: f64 = 0.05;
/// Forces beyond this, N·m or N, suggest wrong units.
const IMPLAUSIBLE: f64 = 1e4;
/// A wrong sign is certain beyond this many standard errors …
const SIGN_ERRORS: f64 = 5.0;
/// … where inertia accounts for this part of the force, and …
const INERTIAL_PART: f64 = 0.2;
/// … a mean inertia of 0 lets the unexplained variance of the force grow by this factor: below it, the misfit of the
/// terms themselves may make an inertia.
const WORSE: f64 = 4.0;
/// Friction is certain beyond this many standard errors, where it is this part of a force …
const FRICTION_ERRORS: f64 = 5.0;
const FRICTION_PART: f64 = 0.03;
/// … and the friction of another joint replaces a joint's own only where its own is below this part of the other.
const OWN_FRICTION: f64 = 0.25;
/// The smallest number of parameters of a joint: inertia, gravity, friction. Each needs a swing.
const PARAMETERS: usize = 3;
/// The mass matrix is compared with its transpose where both change alike, by the cosine of their angle …
const SYMMETRIC: f64 = 0.9;
/// … and its halves have different units where they differ by this factor, and exchanged rows where Σ Mᵢⱼ Mⱼᵢ is this many times Σ Mᵢᵢ Mⱼⱼ.
const UNEQUAL: f64 = 4.0;
const EXCHANGED: f64 = 2.0;
/// Accelerations with a relative error above this need a filter.
const UNCERTAIN: f64 = 0.1;
/// A motion that explains less than this part of the forces is that of a real machine, with friction and noise.
const EXACT: f64 = 0.999;
/// Forces with more noise than this part of their deviation are those of a real machine, too …
pub const NOISY_FORCES: f64 = 0.01;
/// … where q̈ has this relative error: noise of forces alone biases nothing.
const SHAKEN: f64 = 0.01;
/// An inertia that grows by more than this part from one cut-off to a lower one is unreliable.
const GROWTH: f64 = 0.2;

/// Items about forces and motion of all recordings together.
pub(super) fn items(recordings: &[Recording], fits: Option<&JointFits>, errors: f64) -> Vec<Item> {
    let mut items: Vec<Item> = silent(recordings).into_iter().collect();
    items.extend(few_swings(recordings, fits));
    if let Some(readings) = regression::readings(recordings, fits) {
        items.extend(units(recordings, &readings));
        items.extend(dead_zones(recordings, &readings));
    }
    let Some(fits) = fits else { return items };
    items.extend(works(recordings));
    items.extend(frictions(recordings, fits, errors));
    items.extend(unrecorded(recordings, fits));
    items.extend(couplings(recordings, fits));
    items.extend(delays(recordings, fits, errors));
    items.extend(inertias(recordings, fits, errors));
    if !fits.given && recordings.iter().any(|r| r.qdd.is_empty()) {
        items.extend(accelerations(recordings, fits));
    }
    items
}

/// An item where forces were recorded and all of them are 0.
fn silent(recordings: &[Recording]) -> Option<Item> {
    let mut forces = recordings.iter().flat_map(|r| &r.tau).peekable();
    forces.peek()?;
    forces.all(|x| *x == 0.0).then(|| {
        let finding = "all forces are 0 throughout, so that the motion is taken for a free one";
        let remedy =
            "record the forces of the drives; where nothing drives the machine, omit their columns";
        Item::doubt("forces", finding, remedy)
    })
}

/// An item where a machine has fewer swings than parameters, unless its motion explains its forces exactly.
fn few_swings(recordings: &[Recording], fits: Option<&JointFits>) -> Option<Item> {
    let swings = swings_of_all(recordings);
    let first = recordings.iter().find(|r| !r.tau.is_empty())?;
    let exact = |fits: &JointFits| fits.low_pass.is_some_and(|c| c.explained > EXACT);
    let n = first.dof() - first.coordinates.parameters().count();
    let enough = PARAMETERS * n;
    (swings < enough && !fits.is_some_and(exact)).then(|| {
        let finding = format!("all coordinates together turn back {swings} times");
        let remedy = format!(
            "record longer, or faster: {enough} swings or more for {}, as many as there are parameters",
            counted(n, "coordinate")
        );
        Item::doubt("swings", finding, remedy).value("swings", swings as f64)
    })
}

/// The names of the coordinates.
fn names(recordings: &[Recording]) -> Vec<&str> {
    let coordinates = recordings.iter().take(1).flat_map(|r| &r.coordinates.0);
    coordinates.map(|c| c.name.as_str()).collect()
}

/// Whether the positions contain vibrations that the force does not, so that neither inertias nor delays can be trusted: the
/// regressor of each joint holds the accelerations of all. An inertia below its own standard error grows by chance.
fn is_shaken(fits: &JointFits) -> bool {
    let known = |f: &&JointFit| f.explained.0 > EXPLAINED && f.inertia.0.abs() > f.inertia.1;
    let mut joints = fits.joints.iter().flatten().filter(known);
    joints.any(|f| f.growth.abs() > GROWTH)
}

/// The span of each coordinate of a recording, `[n]`.
fn spans(recording: &Recording) -> Vec<f64> {
    column(&recording.q, recording.dof(), |x| {
        let (low, high) = range(x);
        high - low
    })
}

/// Whether a coordinate spans more than a turn if it is in radians; read as degrees, such a span is small for a joint.
fn reaches_far(recording: &Recording) -> bool {
    spans(recording).into_iter().any(|span| span > TAU)
}

/// The largest span of an angle in one recording.
fn angles_span(recordings: &[Recording]) -> f64 {
    let angles = |r| {
        let all = spans(r).into_iter().enumerate();
        all.filter_map(|(i, span)| r.coordinates.is_circle(i).then_some(span))
    };
    recordings.iter().flat_map(angles).fold(0.0, f64::max)
}

/// Units that explain the forces better, or forces that are too large for a machine.
fn units(recordings: &[Recording], readings: &Readings) -> Vec<Item> {
    let mut items = Vec::new();
    let turns = recordings.iter().any(reaches_far);
    if let Some(left) = readings.degrees.filter(|left| *left < DEGREES && turns) {
        let percent = 100.0 * left;
        let finding = format!(
            "read as degrees, the coordinates leave {percent:.0} % of what stays unexplained of the motion in radians"
        );
        let remedy = "declare them: `angles` all and `degrees`, or convert them to radians";
        let item = Item::doubt("unit", finding, remedy).claims(None, 1.0);
        items.push(item.value("left", left));
    }
    let small = angles_span(recordings).to_degrees() < TURNS * TAU;
    if let Some(left) = readings.radians.filter(|left| *left < DEGREES && small) {
        let percent = 100.0 * left;
        let finding = format!(
            "read as radians before they were converted from degrees, the angles leave {percent:.0} % of what stays unexplained of the motion"
        );
        let remedy = "omit `degrees`, or correct the unit in the names of the columns";
        let item = Item::doubt("unit", finding, remedy).claims(None, -1.0);
        items.push(item.value("left", left));
    }
    let forces = recordings.iter().flat_map(|r| &r.tau);
    let largest = forces.fold(0.0_f64, |most, x| most.max(x.abs()));
    if largest > IMPLAUSIBLE {
        let finding = format!("forces of up to {largest:.1e} N·m or N");
        let remedy = "check their unit: SI units are expected, and masses are found in the unit of the forces";
        items.push(Item::doubt("unit", finding, remedy).value("largest", largest));
    }
    items
}

/// Forces that have no effect below a threshold.
fn dead_zones(recordings: &[Recording], readings: &Readings) -> Vec<Item> {
    let item = |(i, zone): (usize, &Option<DeadZone>)| {
        let DeadZone { threshold, left } = (*zone)?;
        let name = names(recordings)[i];
        let finding = format!(
            "{name}: if forces below about {threshold:.2} N·m or N have no effect, and others lose so much, the motion leaves {:.1} % of them unexplained, as recorded {:.1} %",
            100.0 * left.0,
            100.0 * left.1
        );
        let remedy = "look for a dead zone of the drive, and record the force that acts after it";
        let item = Item::warn("dead zone", finding, remedy).claims(Some(i), threshold);
        // A weight that a drive carries is as constant as what a zone takes of a force that never turns.
        let all = recordings
            .iter()
            .flat_map(|r| r.tau.iter().skip(i).step_by(r.dof()));
        let pulls = all.clone().filter(|x| **x < 0.0).count() as f64 / all.count() as f64;
        let turns = pulls.min(1.0 - pulls) > TURNING;
        (turns && left.1 > DEAD_ZONE * left.0 && 1.0 - left.0 > EXPLAINED)
            .then(|| item.value("threshold", threshold))
    };
    readings
        .dead_zones
        .iter()
        .enumerate()
        .filter_map(item)
        .collect()
}

/// The net work of each force over all recordings, relative to the sum of its absolute work: friction takes energy out of a
/// machine, so that its drives put energy in.
fn works(recordings: &[Recording]) -> Vec<Item> {
    let n = recordings.first().map_or(0, Recording::dof);
    let (mut sums, mut sizes) = (vec![0.0; n], vec![0.0; n]);
    for recording in recordings.iter().filter(|r| r.tau.len() == r.q.len()) {
        let steps = recording.q.windows(n + 1).zip(recording.tau.windows(n + 1));
        for (k, (q, tau)) in steps.enumerate() {
            let work = 0.5 * (tau[0] + tau[n]) * (q[n] - q[0]);
            sums[k % n] += work;
            sizes[k % n] += work.abs();
        }
    }
    if sums.iter().sum::<f64>() > -BRAKING * sizes.iter().sum::<f64>() {
        return Vec::new();
    }
    let swings: Vec<Vec<Swings>> = recordings.iter().map(swings).collect();
    let turns = |i: usize| -> usize { swings.iter().filter_map(|s| Some(s.get(i)?.count)).sum() };
    let part = |i: usize| sums[i] / sizes[i];
    let of_joint = |(i, name): (usize, &str)| {
        (part(i) < -BRAKING && turns(i) >= FORTH_AND_BACK).then(|| {
            let finding = format!(
                "{name}: its force takes energy out of the machine ({:.0} % of the work that it does either way), as if it only braked",
                -100.0 * part(i)
            );
            let remedy = "reverse the sign of that force, or of the coordinate, unless something else moves the machine";
            Item::doubt("work", finding, remedy).claims(Some(i), 1.0).value("part", part(i))
        })
    };
    let names = names(recordings).into_iter().enumerate().take(n);
    names.filter_map(of_joint).collect()
}

/// Coordinates that must be driven, although their forces are 0 throughout.
fn unrecorded(recordings: &[Recording], fits: &JointFits) -> Vec<Item> {
    let all = names(recordings);
    let is_told = |u: &&Undriven| u.forces_explained > WELL_EXPLAINED && u.explained < EXPLAINED;
    let item = |u: &Undriven| {
        let finding = format!(
            "{}: its force is 0 throughout, but it does not move as a joint without a drive: {:.0} % of its acceleration follow from the motion of the \
             others, while {:.0} % of their forces follow from the motion",
            all[u.coordinate],
            100.0 * u.explained.max(0.0),
            100.0 * u.forces_explained
        );
        let remedy = "record the force of that drive, or choose its column (`tau`)";
        Item::doubt("forces", finding, remedy)
            .value("explained", u.explained)
            .value("forces_explained", u.forces_explained)
    };
    fits.undriven.iter().filter(is_told).map(item).collect()
}

/// Pairs of coordinates whose forces have different units, or are exchanged.
fn couplings(recordings: &[Recording], fits: &JointFits) -> Vec<Item> {
    let all = names(recordings);
    let item = |c: &Coupling| {
        let (first, second) = (all[c.pair.0], all[c.pair.1]);
        let known = |i: usize| fits.joints[i].is_some_and(|f| f.explained.0 > WELL_EXPLAINED);
        let certain = c.cosine.abs() > SYMMETRIC && known(c.pair.0) && known(c.pair.1);
        if certain && c.mixed > EXCHANGED {
            let finding = format!(
                "the force of {first} accelerates {second} more than itself, and the force of {second} {first}"
            );
            let remedy =
                "exchange the columns of these forces: their order is that of the coordinates";
            return Some(Item::doubt("order", finding, remedy).claims(Some(c.pair.1), c.mixed));
        }
        (certain && !(UNEQUAL.recip()..UNEQUAL).contains(&c.factor.abs())).then(|| {
            let finding = format!(
                "the force of {second} by the acceleration of {first} is {:.3} times that of {first} by the acceleration of {second}: they must be equal",
                c.factor
            );
            let remedy = "check the units of these forces, and that both are those of the joints, not of their motors";
            Item::doubt("unit", finding, remedy).claims(Some(c.pair.1), c.factor)
        })
    };
    fits.couplings.iter().filter_map(item).collect()
}

/// An item about recordings that disagree with the law of others; only those from the index `from` on are suspected.
pub(super) fn disagreement(
    recordings: &[&Recording],
    from: usize,
    low_pass: Option<f64>,
) -> Option<Item> {
    let (odd, (name, finding, remedy)) = regression::disagreement(recordings, from, low_pass)?;
    let odd: Vec<String> = odd.iter().map(|r| recordings[*r].name.clone()).collect();
    let finding = format!("'{}': {finding}", odd.join("', '"));
    Some(Item {
        odd,
        ..Item::doubt(name, finding, remedy).claims(None, 1.0)
    })
}

/// Forces that brake the velocity of another joint, or drive their own velocity where friction should brake it.
fn frictions(recordings: &[Recording], fits: &JointFits, errors: f64) -> Vec<Item> {
    let all = names(recordings);
    let certain =
        |rub: &FrictionTerm, sign| rub.is_certain(sign, errors * FRICTION_ERRORS, FRICTION_PART);
    let of_force = |(i, rubs): (usize, &Vec<FrictionTerm>)| {
        let own = rubs[i];
        if certain(&own, -1.0) {
            let finding = format!(
                "{}: its force helps its velocity where friction must brake it ({:.0} ± {:.0} % of the force)",
                all[i],
                -100.0 * own.size,
                100.0 * own.error
            );
            let remedy = "reverse the sign of that force, or of the coordinate and its velocity";
            let item = Item::doubt("sign", finding, remedy).claims(Some(i), 1.0);
            return Some(item.value("friction", own.size));
        }
        let others = rubs.iter().enumerate().filter(|(j, _)| *j != i);
        let (j, most) = others.max_by(|a, b| a.1.size.total_cmp(&b.1.size))?;
        // A force across the velocity, as of a magnet, does no work: its counterpart has the opposite sign.
        let across = certain(&fits.rubs[j][i], -1.0);
        if !certain(most, 1.0) || own.size > OWN_FRICTION * most.size || across {
            return None;
        }
        let finding = format!(
            "the friction in the force of {} goes with the velocity of {} ({:.0} ± {:.0} % of the force), not with its own ({:.0} %)",
            all[i],
            all[j],
            100.0 * most.size,
            100.0 * most.error,
            100.0 * own.size
        );
        let remedy = "check the order of the columns of the forces: that of the coordinates";
        let item = Item::doubt("order", finding, remedy).claims(Some(i), 1.0);
        Some(item.value("friction", most.size).value("own", own.size))
    };
    fits.rubs.iter().enumerate().filter_map(of_force).collect()
}

fn is_delay(found: &JointFit, step: f64, errors: f64) -> bool {
    let (at_delay, at_none) = (1.0 - found.explained.0, 1.0 - found.explained.1);
    !found.at_end
        && found.explained.0 > WELL_EXPLAINED
        && found.delay.abs() - errors * ERRORS * found.error > SAMPLES * step
        && at_none > GAIN * at_delay
}

/// Gives the items about delays their remedy, which names the shifts of all forces.
pub(super) fn name_the_shifts(items: &mut [Item], recordings: &[Recording]) {
    let mut shifts = vec!["0".to_string(); recordings.first().map_or(0, Recording::dof)];
    let is_delay = |item: &&mut Item| item.name == "delay" && item.accuses();
    for item in items.iter_mut().filter(is_delay) {
        if let Some(i) = item.claim.and_then(|claim| claim.coordinate) {
            shifts[i] = format!("{:.3}", 1e3 * item.values["delay_s"]);
        }
    }
    let remedy = format!("shift the forces: `delay` {}", shifts.join(","));
    let delays = items.iter_mut().filter(is_delay);
    delays.for_each(|item| item.remedy = Some(remedy.clone()));
}

fn delays(recordings: &[Recording], fits: &JointFits, errors: f64) -> Vec<Item> {
    // Vibrations are detected on all data: in a half an inertia grows by chance.
    let (step, shaken) = (fits.step, errors >= 1.0 && is_shaken(fits));
    let item = |(i, name): (usize, &str)| {
        // Without a reliable estimate there is no finding.
        let known = |f: &JointFit| f.explained.0 > WELL_EXPLAINED && !shaken && !f.at_end;
        let found = fits.joints[i].filter(known)?;
        let explained = 100.0 * found.explained.0;
        let (samples, error) = (found.delay / step, found.error / step);
        let (ms, ms_error) = (1e3 * found.delay, 1e3 * found.error);
        let size = format!("{samples:.2} ± {error:.2} samples ({ms:.2} ± {ms_error:.2} ms)");
        let delayed = is_delay(&found, step, errors);
        let finding = if delayed {
            let (side, size) = match found.delay > 0.0 {
                true => ("after", size),
                false => ("before", size.replace('-', "")),
            };
            let without = 100.0 * found.explained.1;
            format!(
                "{name} moves {size} {side} its force: that explains {explained:.2} % of the force, no delay {without:.2} %"
            )
        } else if found.delay.abs() > ERRORS * found.error {
            format!("{name}: {size}: too little to matter")
        } else {
            format!("{name}: {size}: none that is certain")
        };
        let item = Item::pass("delay", finding)
            .warn_if(delayed, "shift the forces")
            .claims(Some(i), found.delay)
            .value("delay_s", found.delay)
            .value("error_s", found.error)
            .value("delay_samples", samples)
            .value("explained", found.explained.0)
            .value("explained_without", found.explained.1);
        Some(item)
    };
    names(recordings)
        .into_iter()
        .enumerate()
        .filter_map(item)
        .collect()
}

fn inertias(recordings: &[Recording], fits: &JointFits, errors: f64) -> Vec<Item> {
    let item = |(i, name): (usize, &str)| {
        let found = fits.joints[i].filter(|f| f.explained.0 > EXPLAINED)?;
        let (inertia, error) = found.inertia;
        if !inertia.is_finite() || inertia.abs() == 0.0 {
            return None; // no force, or one whose square overflows
        }
        let circle = recordings[0].coordinates.0[i].topology == Topology::Circle;
        let unit = if circle { "kg m²" } else { "kg or kg m²" };
        let finding = format!("{name}: inertia {inertia:.3e} ± {error:.1e} {unit}");
        let certain = inertia.abs() > errors * SIGN_ERRORS * error
            && found.inertial_part > INERTIAL_PART
            && found.worse_without > WORSE;
        if !certain {
            return None; // The inertia of one joint alone does not determine the others.
        }
        let item = if inertia < 0.0 {
            let finding = format!("{finding}: the force pushes against the acceleration");
            let remedy = "reverse the sign of that force (or that of the coordinate and its velocity): a positive force must accelerate forwards";
            Item::fail("inertia", finding, remedy)
        } else if !(INERTIA.0..INERTIA.1).contains(&inertia) {
            let finding = format!("{finding}: implausible for a machine");
            let remedy = "check the unit of that force (N·m, N) and of the coordinate: SI units are expected";
            Item::doubt("inertia", finding, remedy)
        } else {
            Item::pass("inertia", finding)
        };
        let item = item.claims(Some(i), inertia.signum());
        Some(item.value("inertia", inertia).value("error", error))
    };
    names(recordings)
        .into_iter()
        .enumerate()
        .filter_map(item)
        .collect()
}

/// An item about noise in the accelerations, with the low-pass that helps.
fn accelerations(recordings: &[Recording], fits: &JointFits) -> Option<Item> {
    let known = fits.uncertainty.iter().zip(names(recordings));
    let known = known.filter(|(c, _)| c.is_finite());
    let (worst, joint) = known.max_by(|a, b| a.0.total_cmp(b.0))?;
    let percent = 100.0 * worst;
    let noises = fits.noise.iter().copied().filter(|x| x.is_finite());
    let noise = noises.fold(0.0, f64::max);
    let finding = format!(
        "estimated q̈ is uncertain by {percent:.1} % ({joint}), the forces by {:.1} % or less",
        100.0 * noise
    );
    let noisy = *worst > UNCERTAIN || *worst > SHAKEN && noise > NOISY_FORCES;
    let all_driven = fits.undriven.is_empty();
    let Some(low_pass) = fits.low_pass.filter(|_| all_driven) else {
        let remedy = match fits.low_pass {
            None => {
                "record faster or more exciting motions, or choose a `low_pass` yourself: the motion explains too little of the forces to tell which"
            }
            Some(_) => {
                "record faster or more exciting motions: a coordinate without a force is learned from its accelerations, for which no low-pass is chosen"
            }
        };
        let item = Item::pass("acceleration", finding).warn_if(noisy, remedy);
        return Some(item.value("uncertainty", *worst));
    };
    let (hertz, explained) = (low_pass.hertz, 100.0 * low_pass.explained);
    let finding = format!(
        "{finding}; after a low-pass of {hertz} Hz the motion explains {explained:.1} % of the forces"
    );
    let remedy = format!("pass motion and forces through the same low-pass: `low_pass` {hertz}");
    let item = Item::pass("acceleration", finding)
        .warn_if(noisy, remedy)
        .value("uncertainty", *worst)
        .value("force_noise", noise)
        .value("explained", low_pass.explained);
    Some(item.value("low_pass_hz", hertz))
}
