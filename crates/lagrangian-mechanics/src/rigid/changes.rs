//! Identified quantities of links and joints: values before and after, standard errors, and the degree to which the data
//! determine each (theory.md, 47a).

use faer::Mat;
use serde::Serialize;

use super::bodies::RigidBodies;
use super::consistent::{Prior, covariance, information};
use super::edited_urdf::in_link;
use super::regressor::PER_BODY;
use super::spatial::{Frame, Inertia};
use crate::forces::Dissipation;
use lagrangian_motion::solve::quadratic::Quadratic;

/// A quantity of a link or a joint.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Quantity {
    /// Name, such as `mass`, `centre_x`, `ixx` or `damping`.
    pub name: &'static str,
    /// Unit of the values.
    pub unit: &'static str,
    /// Value in the description, if it has one.
    pub before: Option<f64>,
    /// The identified value.
    pub after: f64,
    /// Standard error of the identified value.
    pub standard_error: f64,
    /// Fraction of the prior's variance that the data removed, from 0 to 1.
    pub determined: f64,
    /// Whether URDF can store it.
    pub in_urdf: bool,
}

/// Fraction of removed prior variance below which the data do not determine a quantity.
const LEAST_DETERMINED: f64 = 0.05;

impl Quantity {
    /// Whether the data determine it; otherwise its value is that of the prior.
    #[must_use]
    pub fn is_determined(&self) -> bool {
        self.determined >= LEAST_DETERMINED
    }
}

/// Quantities of a link or a joint.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PartChange {
    /// Name of the link or joint.
    pub name: String,
    /// Links that are fixed to this one: the quantities are those of all of them together.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub fixed: Vec<String>,
    /// The quantities.
    pub quantities: Vec<Quantity>,
}

/// All quantities of a robot.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Changes {
    /// Links that move with a joint, each with all that is fixed to it: mass, centre of mass and, about the centre,
    /// inertia, in the axes of the link.
    pub links: Vec<PartChange>,
    /// Joints: rotor, constant torque, friction and spring of each.
    pub joints: Vec<PartChange>,
}

/// Covariances of all parameters before and after data, `[K, K]`.
#[derive(Debug, Clone)]
pub struct Certainty {
    pub(crate) prior: Mat<f64>,
    pub(crate) posterior: Mat<f64>,
    /// After a prior that counts as one torque: what a stronger one decides is known to its own size.
    pub(crate) weak_prior: Mat<f64>,
}

impl Certainty {
    /// Covariances after data about `values` whose weighted residuals have the variance 1, for the number of `torques`; the
    /// strength of the prior is a fraction of the data.
    pub fn after(
        data: &Quadratic,
        torques: f64,
        prior: &Prior,
        strength: f64,
        values: &[f64],
    ) -> Self {
        let inverse = |data: &Quadratic, strength: f64| {
            covariance(&information(data, prior, strength, values)) * faer::Scale(1.0 / torques)
        };
        Self {
            prior: inverse(&Quadratic::zero(values.len()), strength),
            posterior: inverse(data, strength),
            weak_prior: inverse(data, strength.min(torques.recip())),
        }
    }

    /// Standard error of each parameter, `[K]`.
    pub fn errors(&self) -> Vec<f64> {
        let size = self.weak_prior.nrows();
        (0..size).map(|k| self.weak_prior[(k, k)].sqrt()).collect()
    }
}

/// A robot, its description, and the identified parameters with their certainty.
pub struct Known<'a> {
    /// Robot as identified.
    pub robot: &'a RigidBodies,
    /// Robot as described.
    pub described: &'a RigidBodies,
    /// Identified friction.
    pub friction: Option<&'a Dissipation>,
    /// Covariances of the parameters.
    pub certainty: &'a Certainty,
}

impl Known<'_> {
    /// Changes of all quantities.
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
                standard_error: variance(&self.certainty.weak_prior).sqrt(),
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
        let turns = robot.turns()[i];
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
        if robot.is_sprung() {
            kinds.push((SPRING, None, robot.springs()[i]));
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
                standard_error: variance(&self.certainty.weak_prior).sqrt(),
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
const SPRING: OfJoint = OfJoint::new("spring", "N·m/rad", "N/m");
const OFFSET: OfJoint = OfJoint::new("offset", "N·m", "N");
const DAMPING: OfJoint = OfJoint::new("damping", "N·m·s/rad", "N·s/m").in_urdf();
const FRICTION: OfJoint = OfJoint::new("friction", "N·m", "N").in_urdf();

const LOAD_SHARE: OfJoint = OfJoint::new("load share", "", "");

/// Quantities of a link with this frame in its body.
fn of_link(inertia: &Inertia, frame: &Frame) -> [f64; PER_BODY] {
    let own = in_link(inertia, frame);
    let ([x, y, z], [xx, xy, xz, yy, yz, zz]) = (own.centre(), own.about_own_centre());
    [own.mass, x, y, z, xx, xy, xz, yy, yz, zz]
}

/// Derivatives of the quantities of a link by the ten parameters of its body, by central differences.
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

/// Fraction of a variance that data removed; a prior without information has the variance 0 here.
fn removed(prior: f64, posterior: f64) -> f64 {
    match (prior > 0.0, posterior > 0.0) {
        (true, _) => (1.0 - posterior / prior).clamp(0.0, 1.0),
        (false, true) => 1.0,
        (false, false) => 0.0,
    }
}
