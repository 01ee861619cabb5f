//! An animation of a recorded motion and its prediction: as the robot where its joints are known, as points and
//! rods where constraints join them, else as a chain of equal links.

use std::f64::consts::FRAC_PI_2;

use lagrangian::models::Entry;
use lagrangian::rigid::RigidBodies;
pub use lagrangian::trajectory::Links;
use lagrangian::{Model, Trajectory};
use lagrangian_report::{Animation, Motion, Panel, Shape, Stage, View};

use super::figures::Followed;
use super::{Page, learned, linkage};

/// The largest number of links of a chain that can be distinguished in motion.
pub const MOST_LINKS: usize = 8;
/// The largest number of frames from which the view of a robot is chosen.
const FRAMES: usize = 500;
/// Frames of a film in a second, and the largest number of them.
const RATE: f64 = 30.0;
const MOST_FRAMES: usize = 3000;
/// The radius of the stage over that of the motion.
const MARGIN: f64 = 1.08;

/// An animation of both motions, where they can be drawn: as a chain where `links` are given.
pub(super) fn of(page: &Page, followed: &Followed, links: Option<Links>) -> Option<Animation> {
    let motions = followed.motions(page.role());
    let robot = || robot(page).and_then(|robot| drawn_robot(&motions, &robot));
    let drawn = match links {
        Some(links) => drawn_chain(page, followed, links),
        None => robot()
            .or_else(|| drawn_linkage(page, &motions))
            .or_else(|| drawn_chain(page, followed, self::links(page))),
    };
    let Drawn { panels, what } = drawn?;
    Some(Animation {
        id: "motion".into(),
        title: format!("The motion '{}'", followed.truth.name),
        caption: page.frontend.words(&format!(
            "Predicted from the first state alone; the pale one is the recording. {what}"
        )),
        panels,
        ..Animation::default()
    })
}

/// A film of a robot in these motions, the first of which is drawn pale behind the others; `None` where its joints all coincide.
#[must_use]
pub fn robot_in_motion(robot: &RigidBodies, title: &str, motions: &[Motion]) -> Option<Animation> {
    let Drawn { panels, what } = drawn_robot(motions, robot)?;
    let film = Animation {
        id: "motion".into(),
        title: title.into(),
        caption: format!("The pale one is the {}. {what}", motions.first()?.name),
        panels,
        ..Animation::default()
    };
    Some(film.resampled(RATE, MOST_FRAMES))
}

/// The panels, and their description in a sentence.
struct Drawn {
    panels: Vec<Panel>,
    what: String,
}

/// The robot of a run: that of the model, or of the data.
fn robot(page: &Page) -> Option<RigidBodies> {
    let own = page.model.robot().cloned();
    own.or_else(|| learned::simulated_robot(page.record, page.model))
}

/// Motions by the joints of a robot; `None` where these all coincide.
fn drawn_robot(motions: &[Motion], robot: &RigidBodies) -> Option<Drawn> {
    let skeleton = robot.skeleton();
    let scene = Scene {
        place: &|q| skeleton.points(q).ok(),
        joined: skeleton.parents(),
        gravity: robot.gravity(),
    };
    let what = |seen: &str| {
        format!(
            "Drawn are the joints of the robot '{}' and straight lines between them, {seen}.",
            robot.name(),
        )
    };
    drawn_points(motions, &scene, what)
}

/// Motions by points that constraints join.
fn drawn_linkage(page: &Page, motions: &[Motion]) -> Option<Drawn> {
    let linkage = page.model.linkage()?;
    let marks = linkage::marks(linkage);
    let scene = Scene {
        place: &|q| Some(marks.iter().map(|mark| mark.place(q)).collect()),
        joined: marks.iter().map(|mark| mark.joined).collect(),
        gravity: match linkage.points.iter().any(|own| own.len() == 3) {
            true => [0.0, 0.0, -1.0],
            false => [0.0, -1.0, 0.0],
        },
    };
    let rods = match linkage.constraints.is_empty() {
        true => "",
        false => " and the rods that join them",
    };
    let what = |seen: &str| format!("Drawn are the points{rods}, {seen}.");
    drawn_points(motions, &scene, what)
}

/// The places of points by the coordinates.
type Places<'a> = dyn Fn(&[f64]) -> Option<Vec<[f64; 3]>> + 'a;

/// Points in space that are drawn.
struct Scene<'a> {
    /// Their places by the coordinates.
    place: &'a Places<'a>,
    /// The point that each is joined to, an earlier one or itself.
    joined: Vec<usize>,
    /// The direction downwards.
    gravity: [f64; 3],
}

/// Motions by points in space, seen as the first of them asks for; `None` where these all coincide.
fn drawn_points(
    motions: &[Motion],
    scene: &Scene<'_>,
    what: impl Fn(&str) -> String,
) -> Option<Drawn> {
    let places = |motion: &Trajectory| -> Option<Vec<Vec<[f64; 3]>>> {
        let rows = motion.q.chunks_exact(motion.dof());
        rows.map(scene.place).collect()
    };
    let recorded = places(motions.first()?.trajectory)?;
    let some = recorded
        .iter()
        .step_by(recorded.len().div_ceil(FRAMES).max(1));
    let view = View::of(some.map(Vec::as_slice), scene.gravity);
    let in_plane = |frame: &Vec<[f64; 3]>| -> Vec<[f64; 2]> {
        frame.iter().map(|point| view.place(*point)).collect()
    };
    let stage = stage(recorded.iter().flat_map(in_plane))?;
    let panel = |motion: &Motion| -> Option<Panel> {
        let frames = places(motion.trajectory)?;
        let values = frames.iter().flat_map(in_plane).flatten();
        Some(Panel {
            name: motion.name.into(),
            role: motion.role,
            shape: Shape::Points {
                joined: scene.joined.clone(),
                stage,
            },
            t: motion.trajectory.t.clone(),
            values: values.collect(),
            energy_error: None,
        })
    };
    let panels: Option<Vec<Panel>> = motions.iter().map(panel).collect();
    Some(Drawn {
        panels: panels?,
        what: what(view.words()),
    })
}

/// The circle around these points, about the middle of their box; `None` for coinciding points.
fn stage(points: impl Iterator<Item = [f64; 2]> + Clone) -> Option<Stage> {
    let finite = points.filter(|point| point.iter().all(|x| x.is_finite()));
    let empty = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    let (low, high) = finite.clone().fold(empty, |(low, high), point| {
        let pairs = [0, 1].map(|k| (low[k].min(point[k]), high[k].max(point[k])));
        (pairs.map(|pair| pair.0), pairs.map(|pair| pair.1))
    });
    let middle = [0, 1].map(|k| 0.5 * (high[k] + low[k]));
    let far = |point: [f64; 2]| (point[0] - middle[0]).hypot(point[1] - middle[1]);
    let radius = MARGIN * finite.map(far).fold(0.0, f64::max);
    (radius.is_finite() && radius > 0.0).then_some(Stage { middle, radius })
}

/// Both motions as pendulum chains, where all coordinates are angles.
fn drawn_chain(page: &Page, followed: &Followed, links: Links) -> Option<Drawn> {
    let coordinates = page.model.coordinates();
    let n = coordinates.dof();
    let angles = (0..n).all(|i| coordinates.is_circle(i));
    if !angles || n > MOST_LINKS {
        return None;
    }
    let panel = |motion: &Motion| {
        let chain = as_chain(motion.trajectory, links);
        Panel::chain(motion.name, motion.role, &vec![1.0; n], &chain, None)
    };
    let what = match (n, links) {
        (1, _) => "Drawn as a pendulum whose angle is measured from hanging down.",
        (_, Links::Absolute) => {
            "Drawn as a chain of equal links, each angle measured from hanging down; the command report \
             with `links` relative measures it from the link before."
        }
        (_, Links::Relative) => {
            "Drawn as a chain of equal links, each angle measured from the link before."
        }
        (_, Links::Horizontal) => {
            "Drawn as a chain of equal links, the first angle measured from the horizontal, each other from the link before."
        }
    };
    Some(Drawn {
        panels: followed.motions(page.role()).iter().map(panel).collect(),
        what: what.into(),
    })
}

/// The reference of the angles of the links of a run: as its data state, else the link before for a robot, as for its joints, and hanging
/// down for anything else.
fn links(page: &Page) -> Links {
    let layout = learned::layout(page.record);
    let told = layout.and_then(|own| own.links.or_else(|| own.system?.links()));
    let is_robot = Entry::by_name(page.model.family()).is_ok_and(|entry| entry.jointed)
        || page.model.nominal().is_some();
    told.unwrap_or(match is_robot {
        true => Links::Relative,
        false => Links::Absolute,
    })
}

/// The motion with each angle measured from hanging down, whatever the reference of its links.
#[must_use]
pub fn as_chain(motion: &Trajectory, links: Links) -> Trajectory {
    let n = motion.dof().max(1);
    let mut chain = motion.clone();
    if links == Links::Absolute {
        return chain;
    }
    for row in chain.q.chunks_exact_mut(n) {
        if links == Links::Horizontal {
            row[0] += FRAC_PI_2;
        }
        for i in 1..n {
            row[i] += row[i - 1];
        }
    }
    chain
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_stage_holds_every_point_that_is_finite() {
        let points = [[0.0, 0.0], [9.0, f64::NAN], [2.0, 0.0], [1.0, -2.0]];
        let found = stage(points.into_iter());
        assert!(found.is_some_and(|own| {
            let moved = (own.middle[0] - 1.0).hypot(own.middle[1] + 1.0);
            moved < 1e-12 && (own.radius - MARGIN * 2.0_f64.sqrt()).abs() < 1e-12
        }));
        assert!(stage([[1.0, 1.0]].into_iter()).is_none());
        assert!(stage(std::iter::empty()).is_none());
    }
}
