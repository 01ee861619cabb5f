//! Derivatives of torques by the place of a joint: the tangent of the recursive Newton–Euler algorithm.
//!
//! A displacement δ of the frame of joint i in its parent, as a twist in the axes of the frame, changes the twist and the
//! acceleration that the joint passes on by −δ × v and −δ × a, and the wrench that it hands back by δ ×* f.

use super::dynamics::RigidDynamics;
use super::spatial::{Twist, Wrench, add, cross, scale};

/// Scratch memory of [`RigidDynamics::placement_derivative`].
#[derive(Debug, Clone, Default)]
pub struct Tangents {
    twists: Vec<Option<(Twist, Twist)>>,
    wrenches: Vec<Wrench>,
}

impl RigidDynamics<'_> {
    /// Writes ∂τ/∂ε for the frame of the joint of coordinate `joint` displaced by ε `displacement` before the joint moves,
    /// together with its body and all that it carries. To be called after the inverse dynamics of the same state.
    pub fn placement_derivative(
        &self,
        (q, qd): (&[f64], &[f64]),
        joint: usize,
        displacement: Twist,
        tangents: &mut Tangents,
        derivative: &mut [f64],
    ) {
        let bodies = self.bodies();
        tangents.twists.clear();
        tangents.wrenches.clear();
        let mut displaced = Twist::default();
        for (body, own) in bodies.iter().zip(&self.moving) {
            let parent = body.parent.map(|p| &self.moving[p]);
            let change = if body.coordinate == joint {
                displaced = body.after_moving(displacement, q[joint]);
                let (twist, acceleration) = self.received(own, parent);
                Some((
                    displaced.cross(twist).times(-1.0),
                    displaced.cross(acceleration).times(-1.0),
                ))
            } else {
                let of_parent = body.parent.and_then(|p| tangents.twists[p]);
                of_parent.map(|(v, a)| (own.frame.twist(v), own.frame.twist(a)))
            };
            let change =
                change.map(|(v, a)| (v, a.plus(body.across(&v).times(qd[body.coordinate]))));
            tangents.twists.push(change);
            tangents
                .wrenches
                .push(change.map_or_else(Wrench::default, |(v, a)| {
                    let turning = v
                        .cross_wrench(own.momentum)
                        .plus(own.twist.cross_wrench(body.inertia.times(v)));
                    body.inertia.times(a).plus(turning)
                }));
        }
        for (i, body) in bodies.iter().enumerate().rev() {
            let mut wrench = tangents.wrenches[i];
            derivative[body.coordinate] = body.along(&wrench);
            if let Some(parent) = body.parent {
                if body.coordinate == joint {
                    wrench = wrench.plus(displaced.cross_wrench(self.moving[i].wrench));
                }
                let carried = self.moving[i].frame.wrench_back(wrench);
                tangents.wrenches[parent] = tangents.wrenches[parent].plus(carried);
            }
        }
    }
}

impl Twist {
    /// v × w: the change of a motion w that moves with the frame.
    fn cross(self, other: Self) -> Self {
        Self {
            angular: cross(self.angular, other.angular),
            linear: add(
                cross(self.angular, other.linear),
                cross(self.linear, other.angular),
            ),
        }
    }

    fn times(self, factor: f64) -> Self {
        Self {
            angular: scale(self.angular, factor),
            linear: scale(self.linear, factor),
        }
    }

    fn plus(self, other: Self) -> Self {
        Self {
            angular: add(self.angular, other.angular),
            linear: add(self.linear, other.linear),
        }
    }
}
