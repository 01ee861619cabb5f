//! Conversion of a description to moving bodies: fixed and locked joints merge their link into the body that carries it.

use super::spatial::{Frame, Inertia, Vec3, dot, scale, transposed, turning_to_z};
use super::urdf::{Description, Inertial, Joint, JointKind, unusable};
use lagrangian_motion::{Coordinate, Topology};
use lagrangian_motion::{Coordinates, Error, Result};

/// Maximum number of joints of a robot.
pub const MAX_JOINTS: usize = 12;

/// Tolerance of the triangle inequality of principal moments, as a part of the largest: descriptions have two or
/// three digits.
const TRIANGLE: f64 = 0.01;

/// All that moves with one joint. The frame is in the joint, with z along the joint's axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Body {
    /// Body that carries it, always an earlier one; `None` for the base.
    pub(crate) parent: Option<usize>,
    /// Whether it turns; otherwise it slides.
    pub(crate) turns: bool,
    /// Index of the coordinate that moves it.
    pub coordinate: usize,
    /// Frame in the parent's at q = 0.
    pub(crate) frame: Frame,
    /// Inertia of all that is fixed to it.
    pub(crate) inertia: Inertia,
}

/// The place of a link: the body that carries it (`None` for the base), and its frame in the body.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Place {
    pub(crate) link: String,
    pub(crate) body: Option<usize>,
    pub(crate) frame: Frame,
}

/// A tree of bodies on a fixed base.
#[derive(Debug, Clone, PartialEq)]
pub struct Tree {
    pub(crate) coordinates: Coordinates,
    /// Names of the joints, in the order of the coordinates.
    pub(crate) joints: Vec<String>,
    /// Bodies, parents before their children.
    pub bodies: Vec<Body>,
    pub(crate) places: Vec<Place>,
    /// Viscous and Coulomb friction of the description, `[n]`.
    pub(crate) damping: Vec<f64>,
    pub(crate) friction: Vec<f64>,
}

impl Tree {
    /// Bodies of `description` that move with `joints`, in their order; all other joints are locked at 0. An empty
    /// list means all joints that can move, depth first.
    ///
    /// # Errors
    /// [`Error::Robot`] naming the link or joint that cannot be used; [`Error::UnknownName`] for a joint that is not
    /// in the file.
    pub(crate) fn new(description: &Description, joints: &[String]) -> Result<Self> {
        let walk = Walk::new(description)?;
        let selection = selection(description, joints, &walk)?;
        let chosen = || selection.iter().map(|&j| &description.joints[j]);
        let mut tree = Self {
            coordinates: Coordinates(chosen().map(coordinate).collect()),
            joints: chosen().map(|joint| joint.name.clone()).collect(),
            bodies: Vec::new(),
            places: Vec::new(),
            damping: chosen().map(|joint| joint.damping).collect(),
            friction: chosen().map(|joint| joint.friction).collect(),
        };
        // The place of each link, filled from the root outwards.
        let mut places: Vec<Option<(Option<usize>, Frame)>> = vec![None; description.links.len()];
        places[walk.root] = Some((None, Frame::HERE));
        for &(link, by) in &walk.order {
            if let Some(joint) = by {
                let own = &description.joints[joint];
                let (body, frame) = places[own.parent].unwrap_or((None, Frame::HERE));
                let place = frame.then(&own.frame());
                let moving = selection.iter().position(|&j| j == joint);
                places[link] = Some(match moving {
                    None => (body, place),
                    Some(coordinate) => tree.add(own, coordinate, body, &place)?,
                });
            }
            let (body, frame) = places[link].unwrap_or((None, Frame::HERE));
            let own = &description.links[link];
            if let Some(inertial) = &own.inertial {
                let inertia = checked(inertial, &own.name)?;
                if let Some(body) = body {
                    let sum = tree.bodies[body]
                        .inertia
                        .plus(&inertia.seen_from_parent(&frame));
                    tree.bodies[body].inertia = sum;
                }
            }
            let link = own.name.clone();
            tree.places.push(Place { link, body, frame });
        }
        tree.check_masses()?;
        Ok(tree)
    }

    /// Adds the body of a joint; returns the place of its link.
    fn add(
        &mut self,
        joint: &Joint,
        coordinate: usize,
        parent: Option<usize>,
        place: &Frame,
    ) -> Result<(Option<usize>, Frame)> {
        let length = dot(joint.axis, joint.axis).sqrt();
        if length < 1e-9 {
            let finding = format!("joint '{}' has the axis 0", joint.name);
            return Err(unusable(
                finding,
                "give the direction about or along which it moves",
            ));
        }
        let align = turning_to_z(scale(joint.axis, 1.0 / length));
        let frame = place.then(&Frame {
            turn: align,
            origin: [0.0; 3],
        });
        self.bodies.push(Body {
            parent,
            turns: joint.kind != JointKind::Prismatic,
            coordinate,
            frame,
            inertia: Inertia::default(),
        });
        let link = Frame {
            turn: transposed(&align),
            origin: [0.0; 3],
        };
        Ok((Some(self.bodies.len() - 1), link))
    }

    /// Returns an error for a joint that moves no mass, whose acceleration is undefined.
    fn check_masses(&self) -> Result<()> {
        let mut carried: Vec<Inertia> = self.bodies.iter().map(|b| b.inertia).collect();
        for i in (0..self.bodies.len()).rev() {
            let body = &self.bodies[i];
            let along = if body.turns {
                carried[i].second[5]
            } else {
                carried[i].mass
            };
            // A body further out may add inertia about this axis in positions other than q = 0.
            let further = self.bodies.iter().any(|b| b.parent == Some(i));
            if !(along > 0.0 || further && carried[i].mass > 0.0) {
                let name = &self.coordinates.0[body.coordinate].name;
                return Err(unusable(
                    format!("nothing that joint '{name}' moves has inertia"),
                    "give its link an <inertial> with mass and inertia, or leave the joint out of `joints`",
                ));
            }
            if let Some(parent) = body.parent {
                carried[parent] = carried[parent].plus(&carried[i].seen_from_parent(&body.frame));
            }
        }
        Ok(())
    }
}

fn coordinate(joint: &Joint) -> Coordinate {
    let (unit, topology) = match joint.kind {
        JointKind::Prismatic => ("m", Topology::Line),
        _ => ("rad", Topology::Circle),
    };
    Coordinate::new(&joint.name, unit, topology)
}

/// The links from the root outwards, depth first, each with the joint that holds it.
struct Walk {
    root: usize,
    order: Vec<(usize, Option<usize>)>,
}

impl Walk {
    fn new(description: &Description) -> Result<Self> {
        let (links, joints) = (&description.links, &description.joints);
        if links.is_empty() {
            return Err(unusable("it has no link", "give the URDF of a robot"));
        }
        let mut holder: Vec<Option<usize>> = vec![None; links.len()];
        let mut children: Vec<Vec<usize>> = vec![Vec::new(); links.len()];
        for (j, joint) in joints.iter().enumerate() {
            if let Some(other) = holder[joint.child].replace(j) {
                let finding = format!(
                    "link '{}' is the child of joint '{}' and of joint '{}': a closed loop",
                    links[joint.child].name, joints[other].name, joint.name
                );
                return Err(unusable(
                    finding,
                    "open the loop: every link must be the child of one joint at most",
                ));
            }
            children[joint.parent].push(j);
        }
        let roots: Vec<usize> = (0..links.len()).filter(|&l| holder[l].is_none()).collect();
        let &[root] = roots.as_slice() else {
            let finding = match roots.as_slice() {
                [] => "every link is the child of a joint: a closed loop".to_string(),
                [a, b, ..] => format!(
                    "links '{}' and '{}' have no parent joint",
                    links[*a].name, links[*b].name
                ),
                [_] => String::new(),
            };
            return Err(unusable(
                finding,
                "join all links to one tree with one base",
            ));
        };
        let mut order = Vec::new();
        let mut pending = vec![(root, None)];
        while let Some((link, by)) = pending.pop() {
            order.push((link, by));
            pending.extend(
                children[link]
                    .iter()
                    .rev()
                    .map(|&j| (joints[j].child, Some(j))),
            );
        }
        if order.len() < links.len() {
            let lost = (0..links.len()).find(|l| order.iter().all(|(reached, _)| reached != l));
            let finding = format!(
                "link '{}' is part of a closed loop",
                links[lost.unwrap_or(0)].name
            );
            return Err(unusable(
                finding,
                "open the loop: join all links to one tree with one base",
            ));
        }
        Ok(Self { root, order })
    }
}

/// Indices of the joints that move.
fn selection(description: &Description, names: &[String], walk: &Walk) -> Result<Vec<usize>> {
    let joints = &description.joints;
    let selected: Vec<usize> = if names.is_empty() {
        let all = walk.order.iter().filter_map(|(_, by)| *by);
        all.filter(|&j| joints[j].kind != JointKind::Fixed)
            .collect()
    } else {
        names
            .iter()
            .map(|name| named(joints, name))
            .collect::<Result<_>>()?
    };
    for (k, &j) in selected.iter().enumerate() {
        let joint = &joints[j];
        check_movable(joint)?;
        if selected[..k].contains(&j) {
            let finding = format!("joint '{}' is chosen twice", joint.name);
            return Err(unusable(finding, "name each joint once"));
        }
    }
    match selected.len() {
        0 => Err(unusable(
            "no joint can move",
            "give a robot with revolute, continuous or prismatic joints",
        )),
        1..=MAX_JOINTS => Ok(selected),
        n => Err(unusable(
            format!("{n} joints move, where {MAX_JOINTS} is the most"),
            "choose those of one arm with `joints`; the others are locked at 0",
        )),
    }
}

fn named(joints: &[Joint], name: &str) -> Result<usize> {
    joints.iter().position(|j| j.name == name).ok_or_else(|| {
        let movable = joints
            .iter()
            .filter(|j| check_movable(j).is_ok())
            .map(|j| j.name.as_str());
        Error::UnknownName {
            kind: "joint",
            name: name.chars().take(60).collect(),
            known: movable.take(40).collect::<Vec<_>>().join(", "),
        }
    })
}

fn check_movable(joint: &Joint) -> Result<()> {
    let name = &joint.name;
    if let Some(other) = &joint.mimic {
        return Err(unusable(
            format!("joint '{name}' mimics joint '{other}'"),
            "choose the joints that move by themselves with `joints`; the others are locked at 0",
        ));
    }
    match joint.kind {
        JointKind::Revolute | JointKind::Continuous | JointKind::Prismatic => Ok(()),
        kind => Err(unusable(
            format!("joint '{name}' is {}", kind.name()),
            "choose revolute, continuous or prismatic joints with `joints`; the others are locked at 0",
        )),
    }
}

/// Inertia of a link, if a body can have it: m ≥ 0, principal moments ≥ 0, each at most the sum of the others.
pub(crate) fn checked(inertial: &Inertial, link: &str) -> Result<Inertia> {
    let Inertial {
        xyz,
        rpy,
        mass,
        inertia,
    } = *inertial;
    let refuse = |finding: String| {
        Err(unusable(
            format!("link '{link}' {finding}"),
            "correct its <inertial>: no body has it",
        ))
    };
    if mass < 0.0 {
        return refuse(format!("has the mass {mass} kg"));
    }
    let moments = principal_moments(inertia);
    let largest = moments[2];
    if mass == 0.0 && largest.abs() > 0.0 {
        return refuse("has inertia and no mass".into());
    }
    if moments[0] < -1e-6 * largest.abs() {
        return refuse(format!(
            "has an inertia with the principal moment {:.3e} kg·m²",
            moments[0]
        ));
    }
    if moments[0] + moments[1] < (1.0 - TRIANGLE) * largest {
        let [a, b, c] = moments;
        return refuse(format!(
            "has principal moments {a:.3e}, {b:.3e} and {c:.3e} kg·m², the last above the sum of the others"
        ));
    }
    let frame = Frame::new(xyz, rpy);
    let at_centre = Inertia::about_centre(mass, [0.0; 3], inertia);
    Ok(at_centre.seen_from_parent(&frame))
}

/// Eigenvalues of a symmetric matrix in ascending order (Smith, Comm. ACM 4, 1961: the trigonometric closed form).
pub(crate) fn principal_moments([xx, xy, xz, yy, yz, zz]: [f64; 6]) -> Vec3 {
    let mean = (xx + yy + zz) / 3.0;
    let (a, b, c) = (xx - mean, yy - mean, zz - mean);
    let spread = ((a * a + b * b + c * c + 2.0 * (xy * xy + xz * xz + yz * yz)) / 6.0).sqrt();
    if spread <= 1e-15 * mean.abs() {
        return [mean; 3];
    }
    let [a, b, c, xy, xz, yz] = [a, b, c, xy, xz, yz].map(|x| x / spread);
    let determinant = a * (b * c - yz * yz) - xy * (xy * c - yz * xz) + xz * (xy * yz - b * xz);
    let cosine = (0.5 * determinant).clamp(-1.0, 1.0);
    let angle = cosine.acos() / 3.0;
    let largest = mean + 2.0 * spread * angle.cos();
    let smallest = mean + 2.0 * spread * (angle + 2.0 * std::f64::consts::FRAC_PI_3).cos();
    [smallest, 3.0 * mean - largest - smallest, largest]
}
