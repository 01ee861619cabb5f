//! The joints of a robot as points in space, joined by straight lines, for drawings.

use super::bodies::RigidBodies;
use super::spatial::{Frame, Vec3, add, dot, scale, turn_back};
use super::tree::{Body, Tree};
use lagrangian_motion::{Error, Result};

/// Points of a robot and the lines between them, by the transforms of its tree.
///
/// Point 0 is the base, followed by the joints, parents before their children, and by the tips: for each body without
/// children, the farthest frame that is fixed to it. A body without such a frame ends in the direction of its centre of mass, at
/// the mean distance between the joints.
///
/// ```
/// use lagrangian_mechanics::rigid::{self, RigidBodies};
///
/// let arm = RigidBodies::from_urdf(rigid::example("two_link_arm").unwrap_or_default())?;
/// let skeleton = arm.skeleton();
/// assert_eq!(skeleton.parents(), [0, 0, 1, 2]); // base, shoulder, elbow, hand
///
/// // Upright at 0, two links of 0.5 m.
/// let hand = skeleton.points(&[0.0, 0.0])?[3];
/// assert!((hand[2] - 1.0).abs() < 1e-12);
/// # Ok::<(), lagrangian_motion::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Skeleton<'a> {
    bodies: &'a [Body],
    tips: Vec<Tip>,
}

/// The end of a body without children.
#[derive(Debug, Clone, Copy)]
struct Tip {
    body: usize,
    /// Position in the frame of the body, m.
    place: Vec3,
}

impl RigidBodies {
    /// Points and lines for a drawing of the robot.
    #[must_use]
    pub fn skeleton(&self) -> Skeleton<'_> {
        let tree = self.tree();
        let last = (0..tree.bodies.len()).filter(|&i| !carries(tree, i));
        Skeleton {
            bodies: &tree.bodies,
            tips: last.filter_map(|body| tip(tree, body)).collect(),
        }
    }
}

impl Skeleton<'_> {
    /// Index of the point that each point is joined to, always an earlier one; the base has itself.
    #[must_use]
    pub fn parents(&self) -> Vec<usize> {
        let joint = |body: Option<usize>| body.map_or(0, |k| k + 1);
        let joints = self.bodies.iter().map(|body| joint(body.parent));
        let tips = self.tips.iter().map(|tip| joint(Some(tip.body)));
        std::iter::once(0).chain(joints).chain(tips).collect()
    }

    /// Positions of all points at `q` (`[n]`, rad or m), m, in the axes of the base.
    ///
    /// # Errors
    /// [`Error::Shape`] for another number of coordinates.
    pub fn points(&self, q: &[f64]) -> Result<Vec<[f64; 3]>> {
        let remedy = "give one for each joint";
        Error::check_shape("coordinates", q.len(), self.bodies.len(), remedy)?;
        let mut frames: Vec<Frame> = Vec::with_capacity(self.bodies.len());
        for body in self.bodies {
            let parent = body.parent.map_or(Frame::HERE, |k| frames[k]);
            frames.push(parent.then(&body.at(q[body.coordinate])));
        }
        let joints = frames.iter().map(|frame| frame.origin);
        let tips = self.tips.iter().map(|tip| {
            let Frame { turn, origin } = &frames[tip.body];
            add(*origin, turn_back(turn, tip.place))
        });
        Ok(std::iter::once([0.0; 3])
            .chain(joints)
            .chain(tips)
            .collect())
    }
}

fn carries(tree: &Tree, body: usize) -> bool {
    tree.bodies.iter().any(|other| other.parent == Some(body))
}

fn tip(tree: &Tree, body: usize) -> Option<Tip> {
    let fixed = tree.places.iter().filter(|place| place.body == Some(body));
    let farthest = fixed
        .map(|place| place.frame.origin)
        .max_by(|a, b| length(*a).total_cmp(&length(*b)));
    let place = farthest
        .filter(|place| length(*place) > 0.0)
        .or_else(|| towards_the_centre_of_mass(tree, body))?;
    Some(Tip { body, place })
}

fn towards_the_centre_of_mass(tree: &Tree, body: usize) -> Option<Vec3> {
    let centre = tree.bodies[body].inertia.centre();
    let far = length(centre);
    if !(far.is_finite() && far > 0.0) {
        return None;
    }
    let links = tree.bodies.iter().filter(|body| body.parent.is_some());
    let lengths: Vec<f64> = links.map(|body| length(body.frame.origin)).collect();
    let mean = lengths.iter().sum::<f64>() / lengths.len().max(1) as f64;
    // A single body has its centre in the middle.
    let reach = if mean > 0.0 { mean } else { 2.0 * far };
    Some(scale(centre, reach / far))
}

fn length(v: Vec3) -> f64 {
    dot(v, v).sqrt()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::super::example;
    use super::super::screws::Screw;
    use super::super::spatial::sub;
    use super::super::urdf::JointKind;
    use super::*;
    use lagrangian_motion::Coordinates;

    fn points(robot: &RigidBodies, q: &[f64]) -> Vec<Vec3> {
        robot.skeleton().points(q).unwrap()
    }

    fn near(a: Vec3, b: Vec3) -> bool {
        length(sub(a, b)) < 1e-9
    }

    #[test]
    fn a_planar_arm_stands_where_sines_and_cosines_put_it() {
        let arm = RigidBodies::from_urdf(example("two_link_arm").unwrap()).unwrap();
        let (a, b) = (0.7_f64, -1.9_f64);
        let elbow = [0.5 * a.sin(), 0.0, 0.5 * a.cos()];
        let hand = add(elbow, [0.5 * (a + b).sin(), 0.0, 0.5 * (a + b).cos()]);
        let found = points(&arm, &[a, b]);
        assert_eq!(found.len(), 4);
        let expected = [[0.0; 3], [0.0; 3], elbow, hand];
        let pairs = found.iter().zip(expected);
        assert!(pairs.clone().all(|(a, b)| near(*a, b)), "{found:?}");
        assert!(arm.skeleton().points(&[0.0]).is_err());
    }

    /// Tool of a UR5 by the table of Denavit and Hartenberg that its maker publishes.
    fn tool(q: &[f64; 6]) -> Vec3 {
        let table = [
            (0.0, 0.089159, 0.5),
            (-0.425, 0.0, 0.0),
            (-0.39225, 0.0, 0.0),
            (0.0, 0.10915, 0.5),
            (0.0, 0.09465, -0.5),
            (0.0, 0.0823, 0.0),
        ];
        let mut axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let mut place = [0.0; 3];
        for ((a, d, quarter), q) in table.into_iter().zip(q) {
            let [x, y, z] = axes;
            let across = add(scale(x, q.cos()), scale(y, q.sin()));
            let third = sub(scale(y, q.cos()), scale(x, q.sin()));
            let (s, c) = (quarter * std::f64::consts::PI).sin_cos();
            place = add(place, add(scale(z, d), scale(across, a)));
            axes = [
                across,
                add(scale(third, c), scale(z, s)),
                sub(scale(z, c), scale(third, s)),
            ];
        }
        // The base of the description is turned by half a turn.
        [-place[0], -place[1], place[2]]
    }

    #[test]
    fn the_tool_of_a_ur5_is_where_the_table_of_its_maker_puts_it() {
        let robot = RigidBodies::from_urdf(example("ur5").unwrap()).unwrap();
        for k in 0..20 {
            let q =
                [0, 1, 2, 3, 4, 5].map(|i| (1.7 * f64::from(k) + 0.9 * f64::from(i)).sin() * 3.0);
            let found = points(&robot, &q);
            assert_eq!(found.len(), 8);
            // The description gives its angles to eleven digits.
            assert!(length(sub(found[7], tool(&q))) < 1e-9, "{found:?}");
        }
    }

    #[test]
    fn the_links_of_every_example_keep_their_lengths() {
        for name in super::super::EXAMPLES {
            let robot = RigidBodies::from_urdf(example(name).unwrap()).unwrap();
            let parents = robot.skeleton().parents();
            assert!((1..parents.len()).all(|k| parents[k] < k), "{name}");
            let lengths = |q: f64| -> Vec<f64> {
                let own = points(&robot, &vec![q; robot.dof()]);
                let line = |k: usize| length(sub(own[k], own[parents[k]]));
                (0..own.len()).map(line).collect()
            };
            if robot.tree().bodies.iter().all(|body| body.turns) {
                let pairs = lengths(0.3).into_iter().zip(lengths(-1.4));
                assert!(pairs.clone().all(|(a, b)| (a - b).abs() < 1e-9), "{name}");
            }
        }
    }

    #[test]
    fn a_joint_that_slides_carries_what_follows_along_its_axis() {
        let screw = |kind, axis, point| Screw { kind, axis, point };
        let screws = [
            screw(JointKind::Prismatic, [0.0, 1.0, 0.0], [0.0, 0.0, 0.2]),
            screw(JointKind::Revolute, [0.0, 0.0, 1.0], [0.3, 0.0, 0.2]),
            screw(JointKind::Revolute, [0.0, 0.0, 1.0], [0.8, 0.0, 0.2]),
        ];
        let names = ["rail", "shoulder", "elbow"];
        let mut coordinates = Coordinates::angles(3);
        for (coordinate, name) in coordinates.0.iter_mut().zip(names) {
            coordinate.name = name.into();
        }
        let robot = RigidBodies::of_screws(&screws, &coordinates).unwrap();
        let quarter = 0.5 * std::f64::consts::PI;
        let found = points(&robot, &[0.7, quarter, 0.0]);
        assert!(near(found[1], [0.0, 0.7, 0.2]), "{found:?}");
        assert!(near(found[2], [0.3, 0.7, 0.2]), "{found:?}");
        assert!(near(found[3], [0.3, 1.2, 0.2]), "{found:?}");
        // Generic links have their centre of mass in the joint, so the last one has no tip.
        assert_eq!(found.len(), 4);
        // With a centre of mass beside the last joint there is a tip, at the mean distance of the joints.
        let mut parameters = robot.inertial_parameters();
        parameters[21..24].copy_from_slice(&[0.0, 0.6, 0.0]);
        let robot = robot.with_inertial_parameters(&parameters).unwrap();
        let tip = *points(&robot, &[0.0; 3]).last().unwrap();
        let mean = 0.5 * (0.3 + 0.5);
        assert!(
            (length(sub(tip, [0.8, 0.0, 0.2])) - mean).abs() < 1e-9,
            "{tip:?}"
        );
    }
}
