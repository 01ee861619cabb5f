//! Spatial algebra (Featherstone 2008, chapter 2), as far as a fixed-base tree needs it.
//!
//! | symbol | meaning |
//! |---|---|
//! | E, r | a frame in its parent's: coordinates turn by v = E v_parent, its origin is at r, in the parent's axes |
//! | (ω, v) | twist: angular velocity, and linear velocity of the point at the origin |
//! | (n, f) | wrench: moment about the origin, and force |
//! | (m, h, I) | rigid inertia: mass, first moment m·centre, second moment about the origin |

/// A vector of space.
pub type Vec3 = [f64; 3];

/// A rotation, or any 3 × 3 matrix, by rows.
pub(crate) type Mat3 = [Vec3; 3];

pub(crate) const IDENTITY: Mat3 = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// a + b.
#[inline(always)]
#[must_use]
pub fn add(a: Vec3, b: Vec3) -> Vec3 {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// a − b.
#[inline(always)]
#[must_use]
pub fn sub(a: Vec3, b: Vec3) -> Vec3 {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// s a.
#[inline(always)]
#[must_use]
pub fn scale(a: Vec3, s: f64) -> Vec3 {
    a.map(|x| x * s)
}

/// a · b.
#[inline(always)]
#[must_use]
pub fn dot(a: Vec3, b: Vec3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// a × b.
#[inline(always)]
#[must_use]
pub fn cross(a: Vec3, b: Vec3) -> Vec3 {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// A v.
#[inline(always)]
pub(crate) fn turn(a: &Mat3, v: Vec3) -> Vec3 {
    [dot(a[0], v), dot(a[1], v), dot(a[2], v)]
}

/// Aᵀ v.
#[inline(always)]
pub fn turn_back(a: &Mat3, v: Vec3) -> Vec3 {
    [0, 1, 2].map(|k| a[0][k] * v[0] + a[1][k] * v[1] + a[2][k] * v[2])
}

/// A B.
pub(crate) fn product(a: &Mat3, b: &Mat3) -> Mat3 {
    a.map(|row| turn_back(b, row))
}

/// Aᵀ.
pub(crate) fn transposed(a: &Mat3) -> Mat3 {
    [0, 1, 2].map(|k| [a[0][k], a[1][k], a[2][k]])
}

/// A rotation E with E a = z, for a unit vector a.
pub fn turning_to_z(a: Vec3) -> Mat3 {
    let [x, y, z] = a;
    if x * x + y * y < 1e-28 {
        return if z > 0.0 {
            IDENTITY
        } else {
            [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]]
        };
    }
    // Rows: two axes perpendicular to a, then a itself. The axis of the frame that is most perpendicular to a comes first.
    let smallest = (0..3).min_by(|&i, &k| a[i].abs().total_cmp(&a[k].abs()));
    let mut across = [0.0; 3];
    across[smallest.unwrap_or(0)] = 1.0;
    let second = cross(a, across);
    let second = scale(second, 1.0 / dot(second, second).sqrt());
    [cross(second, a), second, a]
}

/// Rotation matrix R = Rz(yaw) Ry(pitch) Rx(roll) of URDF's `rpy`: the frame's axes in the parent's, in columns.
pub(crate) fn from_roll_pitch_yaw([roll, pitch, yaw]: Vec3) -> Mat3 {
    let ((sr, cr), (sp, cp), (sy, cy)) = (roll.sin_cos(), pitch.sin_cos(), yaw.sin_cos());
    [
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ]
}

/// A twist, or a spatial acceleration.
#[derive(Debug, Clone, Copy, Default)]
pub struct Twist {
    /// The angular part.
    pub angular: Vec3,
    /// The linear part.
    pub linear: Vec3,
}

/// A wrench, or a momentum.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Wrench {
    pub(crate) moment: Vec3,
    pub(crate) force: Vec3,
}

impl Wrench {
    #[inline(always)]
    pub(crate) fn plus(self, other: Self) -> Self {
        Self {
            moment: add(self.moment, other.moment),
            force: add(self.force, other.force),
        }
    }
}

impl Twist {
    /// v ×* f: the change of a momentum f that moves with the frame.
    #[inline(always)]
    pub(crate) fn cross_wrench(self, f: Wrench) -> Wrench {
        Wrench {
            moment: add(cross(self.angular, f.moment), cross(self.linear, f.force)),
            force: cross(self.angular, f.force),
        }
    }
}

/// The pose of a frame in its parent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Frame {
    /// E: from the parent's coordinates to the frame's.
    pub(crate) turn: Mat3,
    /// r: the origin, in the parent's coordinates.
    pub(crate) origin: Vec3,
}

impl Frame {
    pub(crate) const HERE: Self = Self {
        turn: IDENTITY,
        origin: [0.0; 3],
    };

    /// The frame of an `origin` in URDF.
    pub(crate) fn new(xyz: Vec3, rpy: Vec3) -> Self {
        Self {
            turn: transposed(&from_roll_pitch_yaw(rpy)),
            origin: xyz,
        }
    }

    /// Frame of the parent in this one.
    pub(crate) fn inverse(&self) -> Self {
        Self {
            turn: transposed(&self.turn),
            origin: scale(turn(&self.turn, self.origin), -1.0),
        }
    }

    /// The frame `inner`, given in this one, expressed in this one's parent.
    pub(crate) fn then(&self, inner: &Self) -> Self {
        Self {
            turn: product(&inner.turn, &self.turn),
            origin: add(self.origin, turn_back(&self.turn, inner.origin)),
        }
    }

    /// A twist of the parent, expressed in this frame.
    #[inline(always)]
    pub(crate) fn twist(&self, t: Twist) -> Twist {
        Twist {
            angular: turn(&self.turn, t.angular),
            linear: turn(&self.turn, add(t.linear, cross(t.angular, self.origin))),
        }
    }

    /// A wrench of this frame, expressed in the parent.
    #[inline(always)]
    pub(crate) fn wrench_back(&self, w: Wrench) -> Wrench {
        let force = turn_back(&self.turn, w.force);
        let moment = turn_back(&self.turn, w.moment);
        Wrench {
            moment: add(moment, cross(self.origin, force)),
            force,
        }
    }
}

/// A rigid inertia about the origin of its frame.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Inertia {
    /// m, kg.
    pub(crate) mass: f64,
    /// h = m·centre, kg·m.
    pub(crate) first: Vec3,
    /// I: xx, xy, xz, yy, yz, zz, kg·m².
    pub(crate) second: [f64; 6],
}

impl Inertia {
    /// The inertia of a body with this mass, centre of mass and inertia about it, all in the same axes.
    pub(crate) fn about_centre(mass: f64, centre: Vec3, inertia: [f64; 6]) -> Self {
        let at_centre = Self {
            mass,
            first: [0.0; 3],
            second: inertia,
        };
        at_centre.seen_from_parent(&Frame {
            turn: IDENTITY,
            origin: centre,
        })
    }

    /// m, hx, hy, hz, Ixx, Ixy, Ixz, Iyy, Iyz, Izz: the ten parameters in which dynamics is linear.
    pub(crate) fn parameters(&self) -> [f64; 10] {
        let (m, [x, y, z], [a, b, c, d, e, f]) = (self.mass, self.first, self.second);
        [m, x, y, z, a, b, c, d, e, f]
    }

    /// The inverse of [`Inertia::parameters`].
    pub(crate) fn of_parameters([m, x, y, z, a, b, c, d, e, f]: [f64; 10]) -> Self {
        Self {
            mass: m,
            first: [x, y, z],
            second: [a, b, c, d, e, f],
        }
    }

    #[inline(always)]
    pub(crate) fn plus(&self, other: &Self) -> Self {
        let mut sum = *self;
        sum.mass += other.mass;
        sum.first = add(sum.first, other.first);
        for (a, b) in sum.second.iter_mut().zip(other.second) {
            *a += b;
        }
        sum
    }

    /// Inertia with the density multiplied by `part`.
    pub(crate) fn scaled(&self, part: f64) -> Self {
        Self {
            mass: part * self.mass,
            first: scale(self.first, part),
            second: self.second.map(|x| part * x),
        }
    }

    /// The centre of mass; not finite for a mass of 0.
    pub(crate) fn centre(&self) -> Vec3 {
        scale(self.first, 1.0 / self.mass)
    }

    /// The second moments about the centre of mass, in the same axes: xx, xy, xz, yy, yz, zz.
    pub(crate) fn about_own_centre(&self) -> [f64; 6] {
        let Self { mass, second, .. } = *self;
        let moved = Self::about_centre(mass, self.centre(), [0.0; 6]).second;
        [0, 1, 2, 3, 4, 5].map(|k| second[k] - moved[k])
    }

    /// I ω about the origin.
    #[inline(always)]
    fn second_times(&self, w: Vec3) -> Vec3 {
        let [xx, xy, xz, yy, yz, zz] = self.second;
        [
            xx * w[0] + xy * w[1] + xz * w[2],
            xy * w[0] + yy * w[1] + yz * w[2],
            xz * w[0] + yz * w[1] + zz * w[2],
        ]
    }

    /// The momentum of a twist, or the force of an acceleration: (I ω + h × v, m v − h × ω).
    #[inline(always)]
    pub(crate) fn times(&self, t: Twist) -> Wrench {
        Wrench {
            moment: add(self.second_times(t.angular), cross(self.first, t.linear)),
            force: sub(scale(t.linear, self.mass), cross(self.first, t.angular)),
        }
    }

    /// This inertia about the origin and in the axes of the parent of `frame`.
    ///
    /// With h and I turned to the parent's axes: h' = h + m r and
    /// I' = I + 2 (r·h) 1 − h rᵀ − r hᵀ + m (r·r 1 − r rᵀ).
    #[inline(always)]
    pub(crate) fn seen_from_parent(&self, frame: &Frame) -> Self {
        let (e, r, m) = (&frame.turn, frame.origin, self.mass);
        let h = turn_back(e, self.first);
        let [xx, xy, xz, yy, yz, zz] = self.second;
        let rows = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]];
        // Columns of I E, then Eᵀ (I E).
        let half = [0, 1, 2].map(|k| {
            let column = [e[0][k], e[1][k], e[2][k]];
            turn(&rows, column)
        });
        let turned =
            |i: usize, k: usize| e[0][i] * half[k][0] + e[1][i] * half[k][1] + e[2][i] * half[k][2];
        let diagonal = 2.0 * dot(r, h) + m * dot(r, r);
        let moved = |i: usize, k: usize| -h[i] * r[k] - r[i] * h[k] - m * r[i] * r[k];
        let at = |i, k| turned(i, k) + moved(i, k);
        Self {
            mass: m,
            first: add(h, scale(r, m)),
            second: [
                at(0, 0) + diagonal,
                at(0, 1),
                at(0, 2),
                at(1, 1) + diagonal,
                at(1, 2),
                at(2, 2) + diagonal,
            ],
        }
    }
}
