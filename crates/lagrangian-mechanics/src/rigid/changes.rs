//! What data say about the quantities of links and joints: values before and after, standard errors, and how far the data
//! determine each (theory.md, 47a).

use faer::Mat;
use serde::Serialize;

use super::bodies::RigidBodies;
use super::consistent::{Prior, Quadratic, covariance, information};
use super::edited_urdf::in_link;
use super::regressor::PER_BODY;
use super::spatial::{Frame, Inertia};
use crate::forces::Dissipation;

/// A quantity of a link or a joint.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Quantity {
    /// Its name, such as `mass`, `centre_x`, `ixx` or `damping`.
    pub name: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// Its value in the description, where that has one.
    pub before: Option<f64>,
    /// The identified value.
    pub after: f64,
    /// The standard error of the identified value.
    pub standard_error: f64,
    /// The part of the prior's variance that the data removed, from 0 to 1.
    pub determined: f64,
    /// Whether URDF has a place for it.
    pub in_urdf: bool,
}

/// The part of the prior's variance below which the data do not determine a quantity.
const LEAST_DETERMINED: f64 = 0.05;

impl Quantity {
    /// Whether the data say anything about it; where they do not, its value is that of the prior.
    #[must_use]
    pub fn is_determined(&self) -> bool {
        self.determined >= LEAST_DETERMINED
    }
}

/// The quantities of a link or a joint.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PartChange {
    /// The name of the link or joint.
    pub name: String,
    /// Links that are fixed to this one: its quantities are those of all together.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub fixed: Vec<String>,
    /// The quantities.
    pub quantities: Vec<Quantity>,
}

/// All quantities of a robot.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Changes {
    /// Of each link that moves with a joint, with all that is fixed to it: mass, centre of mass and, about that,
    /// inertia, in the axes of the link.
    pub links: Vec<PartChange>,
    /// Of each joint: rotor, constant torque and friction.
    pub joints: Vec<PartChange>,
}

/// Covariances of all parameters before and after data, `[K, K]`.
#[derive(Debug, Clone)]
pub struct Certainty {
    pub(crate) prior: Mat<f64>,
    pub(crate) posterior: Mat<f64>,
}

impl Certainty {
    /// After data about `values` whose residuals have the variance 1 by their weights, in the number of `torques`; the
    /// strength of the prior is one in parts of the data.
    pub fn after(
        data: &Quadratic,
        torques: f64,
        prior: &Prior,
        strength: f64,
        values: &[f64],
    ) -> Self {
        let inverse = |data: &Quadratic| {
            covariance(&information(data, prior, strength, values)) * faer::Scale(1.0 / torques)
        };
        Self {
            prior: inverse(&Quadratic::nothing(values.len())),
            posterior: inverse(data),
        }
    }

    /// The standard error of each parameter, `[K]`.
    pub fn errors(&self) -> Vec<f64> {
        let size = self.posterior.nrows();
        (0..size).map(|k| self.posterior[(k, k)].sqrt()).collect()
    }
}

/// A robot, its description, and what is known of its parameters.
pub struct Known<'a> {
    /// The robot, as it was identified.
    pub robot: &'a RigidBodies,
    /// The robot, as it was described.
    pub described: &'a RigidBodies,
    /// The friction that was identified.
    pub friction: Option<&'a Dissipation>,
    /// How well the parameters are known.
    pub certainty: &'a Certainty,
}

impl Known<'_> {
    /// All quantities.
    pub fn changes(&self) -> Changes {
        let n = self.robot.dof();
        Changes {
            links: (0..n).map(|body| self.link(body)).collect(),
            joints: (0..n).map(|i| self.joint(i)).collect(),
        }
    }

    fn link(&self, body: usize) -> PartChange {
        let robot = self.robot;
        let links = robot.links_of(body);
        let names = links.iter().map(|place| place.link.clone());
        let mut names: Vec<String> = names.collect();
        let frame = links.first().map_or(Frame::HERE, |place| place.frame);
        let inertia = |robot: &RigidBodies| robot.tree().bodies[body].inertia;
        let (own, described) = (inertia(robot), inertia(self.described));
        let before = (described.mass > 0.0).then(|| of_link(&described, &frame));
        let (after, slopes) = (of_link(&own, &frame), slopes(&own, &frame));
        let first = PER_BODY * body;
        let quantity = |k: usize| {
            let variance = |of: &Mat<f64>| squared(&slopes[k], of, first);
            let (name, unit) = OF_LINK[k];
            Quantity {
                name,
                unit,
                before: before.map(|values| values[k]),
                after: after[k],
                standard_error: variance(&self.certainty.posterior).sqrt(),
                determined: removed(
                    variance(&self.certainty.prior),
                    variance(&self.certainty.posterior),
                ),
                in_urdf: true,
            }
        };
        PartChange {
            quantities: (0..PER_BODY).map(quantity).collect(),
            fixed: names.split_off(names.len().min(1)),
            name: names.pop().unwrap_or_default(),
        }
    }

    fn joint(&self, i: usize) -> PartChange {
        let robot = self.robot;
        let n = robot.dof();
        let turns = robot
            .tree()
            .bodies
            .iter()
            .any(|b| b.coordinate == i && b.turns);
        let tree = self.described.tree();
        let mut kinds = vec![
            (ROTOR, None, robot.rotor()[i]),
            (OFFSET, None, robot.offset()[i]),
        ];
        if let Some(friction) = self.friction {
            kinds.push((DAMPING, Some(tree.damping[i]), friction.viscous[i]));
            kinds.push((FRICTION, Some(tree.friction[i]), friction.coulomb[i]));
            kinds.extend(friction.load.iter().map(|load| (LOAD_SHARE, None, load[i])));
        }
        let kinds = kinds.into_iter().enumerate();
        let quantity = |(kind, (of, before, after)): (usize, (OfJoint, Option<f64>, f64))| {
            let k = PER_BODY * n + kind * n + i;
            let variance = |of: &Mat<f64>| of[(k, k)];
            Quantity {
                name: of.name,
                unit: if turns { of.unit } else { of.sliding },
                before,
                after,
                standard_error: variance(&self.certainty.posterior).sqrt(),
                determined: removed(
                    variance(&self.certainty.prior),
                    variance(&self.certainty.posterior),
                ),
                in_urdf: of.in_urdf,
            }
        };
        PartChange {
            name: robot.joints()[i].clone(),
            fixed: Vec::new(),
            quantities: kinds.map(quantity).collect(),
        }
    }
}

/// Names and units of the quantities of a link.
const OF_LINK: [(&str, &str); PER_BODY] = [
    ("mass", "kg"),
    ("centre_x", "m"),
    ("centre_y", "m"),
    ("centre_z", "m"),
    ("ixx", "kg·m²"),
    ("ixy", "kg·m²"),
    ("ixz", "kg·m²"),
    ("iyy", "kg·m²"),
    ("iyz", "kg·m²"),
    ("izz", "kg·m²"),
];

/// A kind of quantity of a joint; its unit where it turns and where it slides.
#[derive(Clone, Copy)]
struct OfJoint {
    name: &'static str,
    unit: &'static str,
    sliding: &'static str,
    in_urdf: bool,
}

impl OfJoint {
    const fn new(name: &'static str, unit: &'static str, sliding: &'static str) -> Self {
        Self {
            name,
            unit,
            sliding,
            in_urdf: false,
        }
    }

    const fn in_urdf(self) -> Self {
        Self {
            in_urdf: true,
            ..self
        }
    }
}

const ROTOR: OfJoint = OfJoint::new("rotor", "kg·m²", "kg");
const OFFSET: OfJoint = OfJoint::new("offset", "N·m", "N");
const DAMPING: OfJoint = OfJoint::new("damping", "N·m·s/rad", "N·s/m").in_urdf();
const FRICTION: OfJoint = OfJoint::new("friction", "N·m", "N").in_urdf();

const LOAD_SHARE: OfJoint = OfJoint::new("load share", "", "");

/// The quantities of a link with this frame in its body.
fn of_link(inertia: &Inertia, frame: &Frame) -> [f64; PER_BODY] {
    let own = in_link(inertia, frame);
    let ([x, y, z], [xx, xy, xz, yy, yz, zz]) = (own.centre(), own.about_own_centre());
    [own.mass, x, y, z, xx, xy, xz, yy, yz, zz]
}

/// The derivatives of the quantities of a link by the ten parameters of its body, by central differences.
fn slopes(inertia: &Inertia, frame: &Frame) -> [[f64; PER_BODY]; PER_BODY] {
    let parameters = inertia.parameters();
    let [xx, _, _, yy, _, zz] = inertia.second;
    let moment = (xx + yy + zz).abs();
    let length = (moment / inertia.mass).sqrt();
    let mut slopes = [[0.0; PER_BODY]; PER_BODY];
    for k in 0..PER_BODY {
        let step = 1e-5
            * match k {
                0 => inertia.mass,
                1..4 => inertia.mass * length,
                _ => moment,
            };
        let at = |h: f64| {
            let mut moved = parameters;
            moved[k] += h;
            of_link(&Inertia::of_parameters(moved), frame)
        };
        let (above, below) = (at(step), at(-step));
        for (row, (a, b)) in slopes.iter_mut().zip(above.iter().zip(below)) {
            row[k] = (a - b) / (2.0 * step);
        }
    }
    slopes
}

/// sᵀ C s for the parameters of a body from `first`.
fn squared(slope: &[f64; PER_BODY], covariance: &Mat<f64>, first: usize) -> f64 {
    let row = |k: usize| -> f64 {
        let terms = (0..PER_BODY).map(|j| covariance[(first + k, first + j)] * slope[j]);
        terms.sum()
    };
    (0..PER_BODY)
        .map(|k| slope[k] * row(k))
        .sum::<f64>()
        .max(0.0)
}

/// The part of a variance that data removed; a prior that says nothing has the variance 0 here.
fn removed(prior: f64, posterior: f64) -> f64 {
    match (prior > 0.0, posterior > 0.0) {
        (true, _) => (1.0 - posterior / prior).clamp(0.0, 1.0),
        (false, true) => 1.0,
        (false, false) => 0.0,
    }
}
