//! Limits of the joints of a robot.

use std::f64::consts::PI;

use roxmltree::Node;
use serde::Serialize;

use super::urdf::{child, children, document, optional_number};
use lagrangian_motion::{Error, Result};

/// Limits of a joint, as far as they are known; SI units.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct JointLimits {
    /// The smallest coordinate, rad or m.
    pub lower: Option<f64>,
    /// The largest coordinate.
    pub upper: Option<f64>,
    /// The largest speed, rad/s or m/s.
    pub velocity: Option<f64>,
    /// The largest acceleration, rad/s² or m/s²; by default, the speed is reached in half a second.
    pub acceleration: Option<f64>,
    /// The largest torque, N·m, or force, N; by default unlimited.
    pub effort: Option<f64>,
}

/// Time in which a joint reaches its speed, if its acceleration is not known, s.
const TIME_TO_SPEED: f64 = 0.5;

impl JointLimits {
    /// The `limit` of these joints of a URDF text. A continuous joint may turn to ±π.
    ///
    /// # Errors
    /// [`Error::Robot`] for text that is not URDF, or a limit that is not a number.
    ///
    /// ```
    /// use lagrangian_mechanics::rigid::{self, JointLimits};
    ///
    /// let ur5 = rigid::example("ur5").unwrap_or_default();
    /// let limits = JointLimits::of_urdf(ur5, &["elbow_joint".into()])?;
    /// assert_eq!((limits[0].velocity, limits[0].effort), (Some(3.15), Some(150.0)));
    /// # Ok::<(), lagrangian_motion::Error>(())
    /// ```
    pub fn of_urdf(text: &str, joints: &[String]) -> Result<Vec<Self>> {
        let document = document(text)?;
        let of = |name: &String| {
            let mut nodes = children(document.root_element(), "joint");
            let node = nodes.find(|node| node.attribute("name") == Some(name));
            node.map_or(Ok(Self::default()), Self::of_joint)
        };
        joints.iter().map(of).collect()
    }

    fn of_joint(node: Node<'_, '_>) -> Result<Self> {
        let of = format!("joint '{}'", node.attribute("name").unwrap_or(""));
        let value = |key| optional_number(child(node, "limit"), key, &of);
        let range = match node.attribute("type") {
            Some("continuous") => [Some(-PI), Some(PI)],
            _ => [value("lower")?, value("upper")?],
        };
        Ok(Self {
            lower: range[0],
            upper: range[1],
            velocity: value("velocity")?,
            acceleration: None,
            effort: value("effort")?,
        })
    }

    /// These limits, with those of `other` for the unknown ones.
    #[must_use]
    pub fn or(self, other: Self) -> Self {
        Self {
            lower: self.lower.or(other.lower),
            upper: self.upper.or(other.upper),
            velocity: self.velocity.or(other.velocity),
            acceleration: self.acceleration.or(other.acceleration),
            effort: self.effort.or(other.effort),
        }
    }
}

/// Limits that are all known, and finite except for the effort.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Bounds {
    pub(super) lower: f64,
    pub(super) upper: f64,
    pub(super) velocity: f64,
    pub(super) acceleration: f64,
    pub(super) effort: f64,
}

impl Bounds {
    /// The fraction `margin` of the limits of `joint`.
    ///
    /// # Errors
    /// [`Error::Setting`] for a limit that is missing or allows no motion.
    pub(super) fn of(limits: &JointLimits, joint: &str, margin: f64) -> Result<Self> {
        let known = |value: Option<f64>, name: &str| {
            value.ok_or_else(|| {
                Error::setting(
                    format!("joint '{joint}' has no limit `{name}`"),
                    "give one value for all joints, or one for each",
                )
            })
        };
        let positive = |value: f64, name: &str| match value > 0.0 && !value.is_nan() {
            true => Ok(margin * value),
            false => Err(Error::setting(
                format!("joint '{joint}' has the limit {value} as `{name}`: it cannot move"),
                "give one value above 0 for all joints, or one for each",
            )),
        };
        let (lower, upper) = (known(limits.lower, "lower")?, known(limits.upper, "upper")?);
        if upper <= lower || !(upper - lower).is_finite() {
            return Err(Error::setting(
                format!("joint '{joint}' moves from {lower} to {upper}: it cannot move"),
                "give `lower` and `upper`, one value for all joints, or one for each",
            ));
        }
        let rim = 0.5 * (1.0 - margin) * (upper - lower);
        let velocity = positive(known(limits.velocity, "velocity")?, "velocity")?;
        let acceleration = match limits.acceleration {
            Some(value) => positive(value, "acceleration")?,
            None => velocity / TIME_TO_SPEED,
        };
        let effort = limits.effort.map(|value| positive(value, "effort"));
        let bounds = Self {
            lower: lower + rim,
            upper: upper - rim,
            velocity,
            acceleration,
            effort: effort.transpose()?.unwrap_or(f64::INFINITY),
        };
        Error::check_finite("the limits of the joints", &[velocity, acceleration])?;
        Ok(bounds)
    }
}
