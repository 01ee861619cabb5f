//! The recursions over the bodies of a robot as expressions (theory.md, 40 to 44).

use super::RigidBodies;
use super::spatial::{Inertia, Vec3};
use super::tree::Body;
use crate::expression::{Expressed, Moving, Value};
use lagrangian_motion::statistics::sort_by_number;

/// A vector of space.
type Space<'g> = [Value<'g>; 3];

/// A twist, or a wrench as (force, moment) in the places of (linear, angular).
#[derive(Clone, Copy)]
struct Pair<'g> {
    angular: Space<'g>,
    linear: Space<'g>,
}

/// A frame in its parent's: E and r.
struct Placed<'g> {
    turn: [Space<'g>; 3],
    origin: Space<'g>,
}

/// Values that a body takes from its parent and passes to its children.
#[derive(Clone, Copy)]
struct State<'g> {
    twist: Pair<'g>,
    acceleration: Pair<'g>,
    gravity: Space<'g>,
    height: Value<'g>,
}

fn add<'g>(a: Space<'g>, b: Space<'g>) -> Space<'g> {
    [0, 1, 2].map(|k| a[k] + b[k])
}

fn dot<'g>(a: Space<'g>, b: Space<'g>) -> Value<'g> {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross<'g>(a: Space<'g>, b: Space<'g>) -> Space<'g> {
    [(1, 2), (2, 0), (0, 1)].map(|(i, k)| a[i] * b[k] - a[k] * b[i])
}

impl<'g> Pair<'g> {
    fn plus(self, other: Self) -> Self {
        Self {
            angular: add(self.angular, other.angular),
            linear: add(self.linear, other.linear),
        }
    }
}

impl<'g> Placed<'g> {
    /// The frame of a body at q.
    fn of(body: &Body, q: Value<'g>) -> Self {
        let number = |x: f64| q.graph().number(x);
        let [x, y, z] = body.frame.turn.map(|row| row.map(number));
        let origin = body.frame.origin.map(number);
        if !body.turns {
            return Self {
                turn: [x, y, z],
                origin: add(origin, z.map(|z| z * q)),
            };
        }
        let (s, c) = (q.sin(), q.cos());
        Self {
            turn: [
                [0, 1, 2].map(|k| x[k] * c + y[k] * s),
                [0, 1, 2].map(|k| y[k] * c - x[k] * s),
                z,
            ],
            origin,
        }
    }

    fn turned(&self, v: Space<'g>) -> Space<'g> {
        self.turn.map(|row| dot(row, v))
    }

    fn turned_back(&self, v: Space<'g>) -> Space<'g> {
        [0, 1, 2].map(|k| dot([0, 1, 2].map(|i| self.turn[i][k]), v))
    }

    fn twist(&self, t: Pair<'g>) -> Pair<'g> {
        Pair {
            angular: self.turned(t.angular),
            linear: self.turned(add(t.linear, cross(t.angular, self.origin))),
        }
    }

    fn wrench_back(&self, w: Pair<'g>) -> Pair<'g> {
        let force = self.turned_back(w.linear);
        Pair {
            angular: add(self.turned_back(w.angular), cross(self.origin, force)),
            linear: force,
        }
    }
}

impl Inertia {
    /// (I ω + h × v, m v − h × ω).
    fn of_twist<'g>(&self, t: Pair<'g>) -> Pair<'g> {
        let number = |x: f64| t.linear[0].graph().number(x);
        let first = self.first.map(number);
        let [xx, xy, xz, yy, yz, zz] = self.second.map(number);
        let rows = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]];
        let across = cross(first, t.angular);
        Pair {
            angular: add(rows.map(|row| dot(row, t.angular)), cross(first, t.linear)),
            linear: [0, 1, 2].map(|k| number(self.mass) * t.linear[k] - across[k]),
        }
    }
}

impl Body {
    fn part_along<'g>(&self, w: &Pair<'g>) -> Value<'g> {
        if self.turns {
            w.angular[2]
        } else {
            w.linear[2]
        }
    }

    /// Adds S x.
    fn moved<'g>(&self, t: &mut Pair<'g>, x: Value<'g>) {
        let part = if self.turns {
            &mut t.angular
        } else {
            &mut t.linear
        };
        part[2] = part[2] + x;
    }

    /// Adds v × S x to an acceleration.
    fn turning<'g>(&self, v: &Pair<'g>, acceleration: &mut Pair<'g>, x: Value<'g>) {
        let zero = x.graph().number(0.0);
        let across = |[a, b, _]: Space<'g>| [b * x, -(a * x), zero];
        let turned = across(v.angular);
        if self.turns {
            acceleration.angular = add(acceleration.angular, turned);
            acceleration.linear = add(acceleration.linear, across(v.linear));
        } else {
            acceleration.linear = add(acceleration.linear, turned);
        }
    }
}

impl<'g> State<'g> {
    /// The base, which is accelerated against this gravity.
    fn of_base(gravity: Space<'g>) -> Self {
        let zero = gravity[0].graph().number(0.0);
        let still = Pair {
            angular: [zero; 3],
            linear: [zero; 3],
        };
        Self {
            twist: still,
            acceleration: Pair {
                linear: gravity.map(|g| -g),
                ..still
            },
            gravity,
            height: zero,
        }
    }
}

impl RigidBodies {
    /// L, p and M q̈ + c by one outward and one inward sweep.
    pub(crate) fn terms_of<'g>(&self, at: &Moving<'g>) -> Expressed<'g> {
        let graph = at.q.graph();
        let number = |x: f64| graph.number(x);
        let space = |v: Vec3| v.map(number);
        let base = State::of_base(space(self.gravity()));
        let (q, qd, qdd) = (at.q.each(), at.qd.each(), at.qdd.each());
        let springs = self
            .is_sprung()
            .then(|| graph.constant(self.springs()) * at.q);
        let mut potential = (graph.constant(self.offset()) * at.q).sum();
        if let Some(pull) = springs {
            potential = potential + number(0.5) * pull.dot(at.q);
        }
        let mut kinetic = (graph.constant(self.rotor()) * at.qd).dot(at.qd);
        let mut states: Vec<State<'g>> = Vec::new();
        let mut frames = Vec::new();
        let (mut momenta, mut wrenches) = (Vec::new(), Vec::new());
        for body in &self.tree().bodies {
            let k = body.coordinate;
            let before = body.parent.map_or(base, |parent| states[parent]);
            let frame = Placed::of(body, q[k]);
            let mut own = State {
                twist: frame.twist(before.twist),
                acceleration: frame.twist(before.acceleration),
                gravity: frame.turned(before.gravity),
                height: before.height - dot(before.gravity, frame.origin),
            };
            body.moved(&mut own.twist, qd[k]);
            body.moved(&mut own.acceleration, qdd[k]);
            body.turning(&own.twist, &mut own.acceleration, qd[k]);
            let momentum = body.inertia.of_twist(own.twist);
            let turning = Pair {
                angular: add(
                    cross(own.twist.angular, momentum.angular),
                    cross(own.twist.linear, momentum.linear),
                ),
                linear: cross(own.twist.angular, momentum.linear),
            };
            wrenches.push(body.inertia.of_twist(own.acceleration).plus(turning));
            kinetic = kinetic
                + dot(momentum.angular, own.twist.angular)
                + dot(momentum.linear, own.twist.linear);
            let weight = dot(space(body.inertia.first), own.gravity);
            potential = potential + number(body.inertia.mass) * own.height - weight;
            momenta.push(momentum);
            frames.push(frame);
            states.push(own);
        }
        let along = |wrenches: Vec<Pair<'g>>| graph.join(&self.inwards(&frames, wrenches));
        let (rotor, offset) = (graph.constant(self.rotor()), graph.constant(self.offset()));
        let forces = along(wrenches) + rotor * at.qdd + offset;
        Expressed {
            lagrangian: number(0.5) * kinetic - potential,
            momentum: along(momenta) + rotor * at.qd,
            forces: springs.map_or(forces, |pull| forces + pull),
        }
    }

    /// Components of wrenches along the joints, each wrench with those of all that its body carries.
    fn inwards<'g>(&self, frames: &[Placed<'g>], mut wrenches: Vec<Pair<'g>>) -> Vec<Value<'g>> {
        let mut along = Vec::new();
        for (i, body) in self.tree().bodies.iter().enumerate().rev() {
            along.push((body.coordinate, body.part_along(&wrenches[i])));
            if let Some(parent) = body.parent {
                wrenches[parent] = wrenches[parent].plus(frames[i].wrench_back(wrenches[i]));
            }
        }
        sort_by_number(&mut along, |(coordinate, _)| *coordinate as f64);
        along.into_iter().map(|(_, part)| part).collect()
    }
}
