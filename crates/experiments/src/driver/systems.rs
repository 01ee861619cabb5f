//! Systems whose truth is known: those of the library, and one line each for more of them.

use anyhow::{Result, anyhow};
use lagrangian::analytic::{
    Analytic, AnalyticModel, DualNum, Parameter, Rng, System, by_name, uniform,
};
use lagrangian::mechanics::Quantities;
use lagrangian::trajectory::{Coordinate, State, Topology};
use lagrangian::{Coordinates, RolloutOptions, Trajectory, rollout};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::data::deviation;
use crate::mistakes::sources::Path;

/// A system of this table: its coordinates (`a` an angle, `l` a length), and the least and largest initial value of each
/// coordinate, then of each velocity.
struct Row {
    name: &'static str,
    coordinates: &'static str,
    starts: &'static [[f64; 2]],
}

/// One of [`ROWS`].
struct Own(usize);

macro_rules! own {
    ($($name:literal, $coordinates:literal, $starts:expr, |$q:ident, $v:ident| $lagrangian:expr;)*) => {
        const ROWS: &[Row] = &[$(Row { name: $name, coordinates: $coordinates, starts: &$starts }),*];

        fn lagrangian<D: DualNum<Primitive = f64> + Copy>(name: &str, q: &[D], v: &[D]) -> D {
            match name {
                $($name => { let ($q, $v) = (q, v); $lagrangian })*
                _ => D::from(0.0),
            }
        }
    };
}

/// ½ Σ vᵢ².
fn half<D: DualNum<Primitive = f64> + Copy>(v: &[D]) -> D {
    v.iter().fold(D::from(0.0), |sum, v| sum + *v * *v * 0.5)
}

/// x².
fn sq<D: DualNum<Primitive = f64> + Copy>(x: D) -> D {
    x * x
}

const G: f64 = 9.8;

own! {
    "duffing", "l", [[-1.5, 1.5], [-1.0, 1.0]], |q, v| half(v) - sq(q[0]) * 0.5 - sq(sq(q[0])) * 0.8;
    "double-well", "l", [[-2.0, 2.0], [-1.0, 1.0]], |q, v| half(v) + sq(q[0]) * 1.5 - sq(sq(q[0])) * 0.5;
    "morse", "l", [[-0.5, 1.0], [-1.0, 1.0]], |q, v| half(v) - sq((-q[0]).exp() - 1.0) * 4.0;
    "inertia-by-place", "l", [[-1.5, 1.5], [-1.0, 1.0]], |q, v| half(v) * (sq(q[0]) * 2.0 + 1.0) - sq(q[0]) * 4.0;
    "relativistic-spring", "l", [[-2.0, 2.0], [-0.8, 0.8]], |q, v| -(-sq(v[0]) + 1.0).sqrt() - sq(q[0]) * 0.8;
    "henon-heiles", "ll", [[-0.4, 0.4], [-0.4, 0.4], [-0.4, 0.4], [-0.4, 0.4]],
        |q, v| half(v) - (half(q) + sq(q[0]) * q[1] - q[1].powi(3) / 3.0) * 4.0;
    "quartic-pair", "ll", [[-1.0, 1.0], [-1.5, 1.5], [-1.0, 1.0], [-1.0, 1.0]],
        |q, v| half(v) - sq(q[0]) * 2.0 - sq(q[1]) * 0.5 - sq(q[0] * q[1]);
    "three-springs", "lll", [[-1.0, 1.0], [-1.0, 1.0], [-1.0, 1.0], [-1.0, 1.0], [-1.0, 1.0], [-1.0, 1.0]],
        |q, v| half(v) + sq(v[2]) * 0.5 - sq(q[0]) * 4.0 - sq(q[1] - q[0]) * 6.0 - sq(q[2] - q[1]) * 3.0;
    "toda-five", "lllll", [[-0.7, 0.7], [-0.7, 0.7], [-0.7, 0.7], [-0.7, 0.7], [-0.7, 0.7],
        [-1.0, 1.0], [-1.0, 1.0], [-1.0, 1.0], [-1.0, 1.0], [-1.0, 1.0]],
        |q, v| half(v) - half(q) - (0..4).fold(D::from(0.0), |sum, i| sum + ((q[i] - q[i + 1]) * 1.5).exp());
    "elastic-pendulum", "la", [[0.9, 1.4], [-1.5, 1.5], [-0.5, 0.5], [-1.5, 1.5]],
        |q, v| half(&[v[0], q[0] * v[1]]) + q[0] * q[1].cos() * G - sq(q[0] - 1.0) * 20.0;
    "elastic-plane", "ll", [[-1.0, 1.0], [-1.4, -0.8], [-1.0, 1.0], [-1.0, 1.0]],
        |q, v| half(v) - q[1] * G - sq((sq(q[0]) + sq(q[1])).sqrt() - 1.0) * 20.0;
    "spherical-pendulum", "aa", [[0.4, 2.0], [-3.0, 3.0], [-1.0, 1.0], [-2.0, 2.0]],
        |q, v| half(&[v[0], q[0].sin() * v[1]]) + q[0].cos() * G;
    "double-relative", "aa", [[-2.0, 2.0], [-2.0, 2.0], [-1.0, 1.0], [-1.0, 1.0]], |q, v| {
        let w = v[0] + v[1];
        sq(v[0]) * 1.0 + sq(w) * 0.32 + v[0] * w * q[1].cos() * 0.8 + q[0].cos() * (2.0 * G) + (q[0] + q[1]).cos() * (0.8 * G)
    };
    "coupled-pendulums", "aa", [[-1.5, 1.5], [-1.5, 1.5], [-1.0, 1.0], [-1.0, 1.0]],
        |q, v| half(v) + (q[0].cos() + q[1].cos() * 0.7) * G + (q[0] - q[1]).cos() * 3.0;
    "wheel-pendulum", "aa", [[-2.0, 2.0], [-3.0, 3.0], [-1.0, 1.0], [-5.0, 5.0]],
        |q, v| sq(v[0]) * 0.5 + sq(v[0] + v[1]) * 0.05 + q[0].cos() * (0.8 * G);
    "acrobot-spring", "aa", [[-1.5, 1.5], [-1.5, 1.5], [-1.0, 1.0], [-1.0, 1.0]], |q, v| {
        let w = v[0] + v[1];
        sq(v[0]) * 0.7 + sq(w) * 0.25 + v[0] * w * q[1].cos() * 0.5 + q[0].cos() * (1.5 * G) + (q[0] + q[1]).cos() * (0.5 * G) + q[1].cos() * 6.0
    };
    "slider-crank", "a", [[-3.0, 3.0], [2.0, 6.0]], |q, v| {
        let rod = (-sq(q[0].sin() * 0.3) + 0.25).sqrt();
        let slide = q[0].sin() * -0.3 - q[0].sin() * q[0].cos() * 0.09 / rod;
        sq(v[0]) * (sq(slide) * 1.0 + 0.02) + q[0].sin() * 0.3
    };
    "scotch-yoke", "a", [[-3.0, 3.0], [-4.0, 4.0]], |q, v| sq(v[0]) * (sq(q[0].sin()) * 0.5 + 0.1) - sq(q[0].cos()) * 1.5;
    "quick-return", "a", [[-3.0, 3.0], [3.0, 6.0]], |q, v| {
        let ratio = (q[0].cos() * 0.6 + 0.36) / (q[0].cos() * 1.2 + 1.36);
        sq(v[0]) * (sq(ratio) * 0.5 + 0.05) + q[0].sin() * 0.4
    };
    "bead-parabola", "l", [[-1.2, 1.2], [-1.5, 1.5]], |q, v| half(v) * (sq(q[0]) * 4.0 + 1.0) - sq(q[0]) * G;
    "bead-wave", "l", [[-1.0, 1.0], [-1.0, 1.0]],
        |q, v| half(v) * (sq((q[0] * 2.0).cos()) + 1.0) - (q[0] * 2.0).sin() * (0.5 * G) - sq(q[0]) * 4.0;
    "turning-hoop", "a", [[-2.5, 2.5], [-3.0, 3.0]], |q, v| half(&[v[0], q[0].sin() * 5.0]) + q[0].cos() * (2.0 * G);
    "bowl", "ll", [[-1.0, 1.0], [-1.0, 1.0], [-1.0, 1.0], [-1.0, 1.0]],
        |q, v| half(&[v[0], v[1], q[0] * v[0] + q[1] * v[1]]) - half(q) * G;
    "torus", "aa", [[-3.0, 3.0], [-3.0, 3.0], [-2.0, 2.0], [-2.0, 2.0]],
        |q, v| half(&[v[0] * 0.5, (q[0].cos() * 0.5 + 1.0) * v[1]]) - q[0].sin() * (0.3 * G);
    "cart-two-links", "laa", [[-0.5, 0.5], [-1.5, 1.5], [-1.5, 1.5], [-0.5, 0.5], [-1.0, 1.0], [-1.0, 1.0]], |q, v| {
        let joint = [v[0] + q[1].cos() * v[1], q[1].sin() * v[1]];
        let end = [joint[0] + q[2].cos() * v[2] * 0.7, joint[1] + q[2].sin() * v[2] * 0.7];
        half(&[v[0]]) * 2.0 + half(&joint) + half(&end) * 0.6 + q[1].cos() * (1.6 * G) + q[2].cos() * (0.42 * G) - sq(q[0]) * 2.0
    };
    "cart-spring", "la", [[-0.7, 0.7], [-2.0, 2.0], [-0.5, 0.5], [-1.0, 1.0]],
        |q, v| half(&[v[0]]) * 2.0 + half(&[v[0] + q[1].cos() * v[1] * 0.8, q[1].sin() * v[1] * 0.8]) + q[1].cos() * (0.8 * G) - sq(q[0]) * 10.0;
    "crane", "lal", [[-0.5, 0.5], [-0.8, 0.8], [0.8, 1.3], [-0.5, 0.5], [-1.0, 1.0], [-0.3, 0.3]], |q, v| {
        let load = [v[0] + q[1].sin() * v[2] + q[1].cos() * q[2] * v[1], q[2] * q[1].sin() * v[1] - q[1].cos() * v[2]];
        half(&[v[0]]) * 3.0 + half(&load) + q[1].cos() * q[2] * G - sq(q[0]) * 4.0 - sq(q[2] - 1.0) * 30.0
    };
    "rotating-frame", "ll", [[-1.0, 1.0], [-1.0, 1.0], [-1.0, 1.0], [-1.0, 1.0]],
        |q, v| half(&[v[0] - q[1] * 1.5, v[1] + q[0] * 1.5]) - half(q) * 6.0 - sq(half(q)) * 2.0;
    "charged-quartic", "ll", [[-1.0, 1.0], [-1.0, 1.0], [-1.0, 1.0], [-1.0, 1.0]],
        |q, v| half(v) + (q[0] * v[1] - q[1] * v[0]) * 1.2 - half(q) - sq(sq(q[0])) * 0.5 - sq(sq(q[1])) * 0.3;
    "charged-uneven", "ll", [[-1.0, 1.0], [-1.0, 1.0], [-1.5, 1.5], [-1.5, 1.5]],
        |q, v| half(v) + q[0] * v[1] * (q[1].cos() * 0.6 + 1.5) - half(q) * 1.5;
    "top", "aaa", [[0.4, 1.3], [-3.0, 3.0], [-3.0, 3.0], [-0.5, 0.5], [-1.0, 1.0], [4.0, 9.0]],
        |q, v| half(&[v[0], q[0].sin() * v[1]]) * 0.5 + half(&[v[2] + q[0].cos() * v[1]]) * 0.4 - q[0].cos() * (0.2 * G);
    "rolling-eccentric", "a", [[-3.0, 3.0], [-4.0, 4.0]], |q, v| half(v) * (-q[0].cos() * 0.8 + 1.7) + q[0].cos() * (0.4 * G);
    "hoop-pendulum", "la", [[-0.5, 0.5], [-2.0, 2.0], [-0.5, 0.5], [-1.0, 1.0]],
        |q, v| half(&[v[0]]) * 3.0 + half(&[v[0] + q[1].cos() * v[1], q[1].sin() * v[1]]) + q[1].cos() * G - sq(q[0]) * 3.0;
    "atwood-swinging", "la", [[0.8, 1.3], [-1.2, 1.2], [-0.3, 0.3], [-1.0, 1.0]],
        |q, v| half(&[v[0]]) * 2.0 + half(&[v[0], q[0] * v[1]]) - q[0] * (1.2 * G) + q[0] * q[1].cos() * G - sq(q[0] - 1.0) * 10.0;
    "ball-beam", "la", [[-0.4, 0.4], [-0.3, 0.3], [-0.3, 0.3], [-0.5, 0.5]],
        |q, v| half(&[v[0]]) * 1.4 + half(&[v[1]]) * (sq(q[0]) + 0.5) - q[0] * q[1].sin() * G - sq(q[1]) * 20.0 - sq(q[0]) * 8.0;
    "central-quartic", "la", [[0.8, 1.5], [-3.0, 3.0], [-0.5, 0.5], [0.8, 2.0]], |q, v| half(&[v[0], q[0] * v[1]]) - sq(sq(q[0])) * 0.5;
    "kepler-polar", "la", [[0.8, 1.4], [-3.0, 3.0], [-0.2, 0.2], [1.2, 2.2]],
        |q, v| half(&[v[0], q[0] * v[1]]) + (sq(q[0]) + 0.02).sqrt().recip() * 4.0;
    "two-centres", "ll", [[-0.4, 0.4], [0.8, 1.4], [0.8, 1.6], [-0.3, 0.3]], |q, v| {
        let pull = |at: f64| (sq(q[0] - at) + sq(q[1]) + 0.2).sqrt().recip() * 1.5;
        half(v) + pull(0.6) + pull(-0.6) - half(q) * 0.5
    };
    "lift-arm", "aal", [[-2.0, 2.0], [-2.0, 2.0], [-0.4, 0.4], [-1.0, 1.0], [-2.0, 2.0], [-0.5, 0.5]], |q, v| {
        let w = v[0] + v[1];
        sq(v[0]) * 0.8 + sq(w) * 0.2 + v[0] * w * q[1].cos() * 0.4 + half(&[v[2]]) + q[0].cos() * 3.0 + q[1].cos() * 2.0 - sq(q[2]) * 8.0
    };
}

impl System for Own {
    const NAME: &'static str = "driver";
    const ABOUT: &'static str = "one of the systems of the experiment";
    const PARAMETERS: &'static [Parameter] = &[Parameter::not_negative("row", "", 0.0)];

    fn new(values: &[f64]) -> Self {
        Self(values[0] as usize)
    }

    fn coordinates(&self) -> Coordinates {
        let named = ROWS[self.0].coordinates.chars().zip(1..);
        let one = |(kind, i)| match kind {
            'a' => Coordinate::new(format!("q{i}"), "rad", Topology::Circle),
            _ => Coordinate::new(format!("q{i}"), "m", Topology::Line),
        };
        Coordinates(named.map(one).collect())
    }

    fn lagrangian<D: DualNum<Primitive = f64> + Copy>(&self, q: &[D], qd: &[D]) -> D {
        lagrangian(ROWS[self.0].name, q, qd)
    }

    fn sample_state(&self, rng: &mut dyn Rng) -> State {
        let starts = ROWS[self.0].starts.iter();
        let mut x: Vec<f64> = starts
            .map(|[low, high]| uniform(rng, 1, *low, *high)[0])
            .collect();
        let qd = x.split_off(x.len() / 2);
        State::new(x, qd)
    }
}

/// Systems of the library, and the parameters that differ from their table.
const LIBRARY: &[(&str, &[(&str, f64)])] = &[
    ("mass-spring", &[]),
    ("pendulum", &[]),
    ("double-pendulum", &[]),
    ("n-link-pendulum", &[]),
    ("cart-pole", &[]),
    ("furuta-pendulum", &[]),
    ("two-link-arm", &[]),
    ("relativistic-particle", &[("field", 0.5)]),
    ("charged-particle", &[]),
    ("magnetic-mirror", &[]),
    ("kepler", &[]),
    ("n-body", &[]),
];

/// Systems that lose energy too, or are driven over a dead zone.
const LOSSY: &[(&str, Loss)] = &[
    ("pendulum", Loss::Viscous),
    ("pendulum", Loss::Coulomb),
    ("double-relative", Loss::Viscous),
    ("duffing", Loss::Drag),
    ("elastic-pendulum", Loss::Viscous),
    ("quartic-pair", Loss::Coulomb),
    ("cart-spring", Loss::Viscous),
    ("bead-parabola", Loss::Drag),
    ("torus", Loss::Viscous),
    ("coupled-pendulums", Loss::DeadZone),
    ("three-springs", Loss::Coulomb),
    ("two-link-arm", Loss::Viscous),
    ("turning-hoop", Loss::DeadZone),
    ("quick-return", Loss::Coulomb),
];

/// What takes energy, or force, away.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Loss {
    None,
    Viscous,
    Coulomb,
    /// In proportion to the square of the speed.
    Drag,
    /// Small forces of a drive move nothing.
    DeadZone,
}

/// A system by its name: that of its Lagrangian, and what it loses.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Named {
    lagrangian: &'static str,
    pub(super) loss: Loss,
}

/// All systems.
pub(crate) fn all() -> Vec<Named> {
    let plain = LIBRARY
        .iter()
        .map(|own| own.0)
        .chain(ROWS.iter().map(|row| row.name));
    let plain = plain.map(|name| (name, Loss::None));
    let named = plain.chain(LOSSY.iter().copied());
    named
        .map(|(lagrangian, loss)| Named { lagrangian, loss })
        .collect()
}

impl Named {
    /// Whether a motion that nothing drives shows all of it.
    pub(crate) fn is_free(self) -> bool {
        self.loss != Loss::DeadZone
    }

    /// Its name, which says what it loses.
    pub(crate) fn name(self) -> String {
        match self.loss {
            Loss::None => self.lagrangian.into(),
            loss => format!("{}, {loss:?}", self.lagrangian).to_lowercase(),
        }
    }

    /// The half that it belongs to, by a bit of the FNV-1a sum of its Lagrangian's name: nothing is tuned on the second.
    pub(crate) fn half(self) -> &'static str {
        let add = |sum: u64, byte: u8| (sum ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        let sum = self.lagrangian.bytes().fold(0xcbf2_9ce4_8422_2325, add);
        ["first", "second"][(sum >> 16) as usize % 2]
    }

    fn model(self) -> Result<Box<dyn AnalyticModel>> {
        if let Some(row) = ROWS.iter().position(|row| row.name == self.lagrangian) {
            return Ok(Box::new(Analytic::new(Own(row))));
        }
        let own = LIBRARY.iter().find(|own| own.0 == self.lagrangian);
        Ok(by_name(self.lagrangian, own.map_or(&[], |own| own.1))?)
    }

    /// The number of its coordinates, and whether one is an angle.
    pub(super) fn shape(self) -> Result<(usize, bool)> {
        let model = self.model()?;
        let (n, coordinates) = (model.coordinates().dof(), model.coordinates());
        Ok((n, (0..n).any(|i| coordinates.is_circle(i))))
    }

    /// The system, with the sizes of its speeds and forces.
    pub(crate) fn build(self) -> Result<Truth> {
        let model = self.model()?;
        let n = model.coordinates().dof();
        let mut truth = Truth {
            model,
            loss: self.loss,
            seconds: SECONDS[0],
            force: vec![0.0; n],
            speed: vec![0.0; n],
        };
        let mut motions = Vec::new();
        for seconds in SECONDS {
            truth.seconds = seconds;
            let all = (0..12)
                .map(|k| truth.motion(false, k))
                .collect::<Result<Vec<_>>>()?;
            motions = all.into_iter().flatten().collect();
            if motions.len() >= 9 {
                break;
            }
        }
        for (motion, k) in motions
            .iter()
            .flat_map(|m| (0..m.shown.len()).step_by(5).map(move |k| (&m.shown, k)))
        {
            let row = motion.row(k);
            let mass = truth.model.mass_matrix(row.q)?;
            for i in 0..n {
                let force: f64 = (0..n).map(|j| mass[i * n + j] * row.qdd[j]).sum();
                truth.force[i] += force * force;
                truth.speed[i] += row.qd[i] * row.qd[i];
            }
        }
        let rows = motions
            .iter()
            .map(|m| m.shown.len().div_ceil(5))
            .sum::<usize>();
        let size = |sum: &mut f64| *sum = (*sum / rows as f64).sqrt();
        truth
            .force
            .iter_mut()
            .chain(&mut truth.speed)
            .for_each(size);
        let largest = truth.force.iter().fold(0.0_f64, |most, x| most.max(*x));
        truth
            .force
            .iter_mut()
            .for_each(|x| *x = x.max(0.2 * largest));
        Ok(truth)
    }
}

/// Lengths of motions, s: the longest whose samples resolve most motions.
const SECONDS: [f64; 3] = [5.0, 2.5, 1.25];
/// Samples of a motion.
pub(super) const SAMPLES: usize = 250;
/// A motion is resolved where no acceleration moves a coordinate farther in a step than this part of its deviation, or of a radian.
const RESOLVED: f64 = 0.05;
/// The drive at its usual strength, in parts of the usual force.
const DRIVEN: f64 = 0.4;
/// Friction at the usual speed, in parts of the usual force; the dead zone in parts of that of the drive.
const LOST: f64 = 0.15;

/// A system that moves.
pub(crate) struct Truth {
    pub(crate) model: Box<dyn AnalyticModel>,
    loss: Loss,
    /// The length of its motions, s.
    pub(super) seconds: f64,
    /// The usual force on each coordinate, and the usual speed.
    force: Vec<f64>,
    speed: Vec<f64>,
}

/// A motion with what a sensor at the drive shows.
pub(crate) struct Motion {
    /// q, q̇, q̈, and the forces of the drive where there is one.
    pub(crate) shown: Trajectory,
    drive: Vec<(f64, Path)>,
    pace: f64,
}

impl Motion {
    /// The forces of the drive at a time.
    pub(super) fn drive(&self, t: f64, tau: &mut [f64]) {
        tau.fill(0.0);
        for (tau, (size, path)) in tau.iter_mut().zip(&self.drive) {
            *tau = size * path.at(self.pace * t)[0];
        }
    }
}

impl Truth {
    /// So many motions, each from its own start and under its own forces.
    pub(crate) fn motions(&self, count: usize, forced: bool, seed: u64) -> Result<Vec<Motion>> {
        let tries = (0..20 * count as u64).map(|k| seed.wrapping_mul(1009).wrapping_add(k));
        let mut all = Vec::new();
        for seed in tries {
            all.extend(self.motion(forced, seed)?);
            if all.len() == count {
                return Ok(all);
            }
        }
        Err(anyhow!("too few motions of this system are resolved"))
    }

    /// A motion; none where it ends early, or its samples do not resolve it.
    fn motion(&self, forced: bool, seed: u64) -> Result<Option<Motion>> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let step = self.seconds / SAMPLES as f64;
        let times: Vec<f64> = (0..SAMPLES).map(|k| k as f64 * step).collect();
        let options = RolloutOptions {
            rtol: 1e-10,
            atol: 1e-10,
            max_steps: 50_000,
            ..RolloutOptions::default()
        };
        let drives = if forced { &self.force[..] } else { &[] };
        let drives = drives
            .iter()
            .map(|size| (DRIVEN * size, Path::random(&mut rng)));
        let mut motion = Motion {
            shown: Trajectory::default(),
            drive: drives.collect(),
            pace: 7.5 / self.seconds,
        };
        let start = self.model.sample_start(&mut rng);
        let force = |t: f64, _: &[f64], qd: &[f64], tau: &mut [f64]| {
            motion.drive(t, tau);
            self.lose(qd, tau);
        };
        let made = rollout(&*self.model, &start.q, &start.qd, &times, &force, &options)?;
        let (n, shown) = (start.q.len(), made.trajectory);
        let resolved = (0..n).all(|i| {
            let column = |x: &[f64]| x.iter().skip(i).step_by(n).copied().collect::<Vec<f64>>();
            let most = column(&shown.qdd)
                .iter()
                .fold(0.0_f64, |most, x| most.max(x.abs()));
            let size = match self.model.coordinates().is_circle(i) {
                true => 1.0,
                false => deviation(&column(&shown.q)),
            };
            most * step * step <= RESOLVED * size
        });
        if !(made.outcome.is_finished() && resolved) {
            return Ok(None);
        }
        motion.shown = shown;
        let mut tau = vec![0.0; if forced { n * times.len() } else { 0 }];
        let rows = times.iter().zip(tau.chunks_exact_mut(n));
        rows.for_each(|(t, tau)| motion.drive(*t, tau));
        motion.shown.tau = tau;
        Ok(Some(motion))
    }

    /// Whether it loses energy.
    pub(crate) fn loses(&self) -> bool {
        self.loss != Loss::None
    }

    /// The accelerations of a state that nothing drives, `[n]`.
    pub(crate) fn accelerations(&self, q: &[f64], qd: &[f64]) -> Vec<f64> {
        let [mut tau, mut qdd] = [vec![0.0; q.len()], vec![f64::NAN; q.len()]];
        self.lose(qd, &mut tau);
        let _ = self
            .model
            .evaluator()
            .forward_dynamics(q, qd, &tau, &mut qdd);
        qdd
    }

    /// What is left of the forces of a drive.
    fn lose(&self, qd: &[f64], tau: &mut [f64]) {
        let sizes = self.force.iter().zip(&self.speed);
        for ((tau, v), (force, speed)) in tau.iter_mut().zip(qd).zip(sizes) {
            if *speed == 0.0 {
                continue;
            }
            let (lost, pace) = (LOST * force, v / speed);
            match self.loss {
                Loss::None => {}
                Loss::Viscous => *tau -= lost * pace,
                Loss::Coulomb => *tau -= lost * (20.0 * pace).tanh(),
                Loss::Drag => *tau -= lost * pace * pace.abs(),
                Loss::DeadZone => *tau -= tau.clamp(-DRIVEN * lost, DRIVEN * lost),
            }
        }
    }
}
