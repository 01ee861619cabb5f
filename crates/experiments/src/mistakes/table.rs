//! The mistakes, each made by one function from good data.

use lagrangian::rigid::{self, RigidBodies};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::case::{Case, Log};
use super::sources::{arm_log, normal, subtract_gravity};

/// A mistake, and what it is made of.
pub(super) struct Mistake {
    pub(super) name: &'static str,
    /// What the data must have for it.
    needs: Needs,
    make: Make,
    /// Why data alone do not tell, and what that costs.
    pub(super) unknowable: Option<&'static str>,
}

/// What a mistake is made with.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Needs {
    Motion,
    Velocities,
    Torques,
    Accelerations,
    Joints,
    Logs,
    /// Several logs, and torques.
    Several,
    /// Logs of a machine with other lengths.
    Longer,
    /// Torques, and a description to compare them with.
    Description,
}

/// How it is made: in each log alone, or in the whole.
enum Make {
    Log(fn(&mut Log)),
    Case(fn(&mut Case)),
}

use Make::{Case as InCase, Log as InLog};
use Needs::{
    Accelerations, Description, Joints, Logs, Longer, Motion, Several, Torques, Velocities,
};

const fn mistake(name: &'static str, needs: Needs, make: Make) -> Mistake {
    Mistake {
        name,
        needs,
        make,
        unknowable: None,
    }
}

const fn unknowable(name: &'static str, needs: Needs, make: Make, why: &'static str) -> Mistake {
    Mistake {
        unknowable: Some(why),
        ..mistake(name, needs, make)
    }
}

const ZERO: &str = "another zero of a joint is as good a coordinate; a model without a description learns it, one with a description is compared \
                    with a model without it";
const BODIES: &str = "other masses make up for it where the motion allows: the torques are right with them; where they are not, a chain without the \
                      description explains more, and the verdict says so";
const SCALE: &str = "a unit of all torques scales all masses: a model is right in that unit, unless its masses are compared with something";

pub(super) const MISTAKES: &[Mistake] = &[
    mistake(
        "q in degrees",
        Velocities,
        InLog(|l| scale(&mut l.q[..], 57.295_779_5)),
    ),
    mistake(
        "q and qd in degrees",
        Velocities,
        InLog(|l| {
            scale(&mut l.q, 57.295_779_5);
            scale(&mut l.qd, 57.295_779_5);
        }),
    ),
    mistake(
        "one joint in degrees, q and qd",
        Joints,
        InLog(|l| {
            scale(&mut l.q[1..2], 57.295_779_5);
            if l.qd.len() > 1 {
                scale(&mut l.qd[1..2], 57.295_779_5)
            }
        }),
    ),
    mistake(
        "velocity in rpm",
        Velocities,
        InLog(|l| scale(&mut l.qd, 9.549_296_6)),
    ),
    mistake(
        "velocity in deg/s",
        Velocities,
        InLog(|l| scale(&mut l.qd, 57.295_779_5)),
    ),
    mistake(
        "velocity of one joint 10 % too large",
        Velocities,
        InLog(|l| scale(&mut l.qd[..1], 1.1)),
    ),
    mistake(
        "velocity of one joint 5 % too small",
        Velocities,
        InLog(|l| scale(&mut l.qd[..1], 0.95)),
    ),
    mistake(
        "velocity with the wrong sign",
        Velocities,
        InLog(|l| scale(&mut l.qd[..1], -1.0)),
    ),
    mistake("two velocities swapped", Joints, InLog(|l| l.qd.swap(0, 1))),
    mistake(
        "q and qd swapped",
        Velocities,
        InLog(|l| std::mem::swap(&mut l.q, &mut l.qd)),
    ),
    mistake(
        "time in milliseconds",
        Motion,
        InLog(|l| l.t.iter_mut().for_each(|t| *t *= 1e3)),
    ),
    mistake(
        "time in milliseconds, no velocities",
        Torques,
        InLog(|l| {
            l.t.iter_mut().for_each(|t| *t *= 1e3);
            l.qd.clear();
        }),
    ),
    unknowable(
        "torques in mN·m",
        Torques,
        InLog(|l| scale(&mut l.tau, 1e3)),
        SCALE,
    ),
    mistake(
        "torque of one joint in mN·m",
        Torques,
        InLog(|l| {
            scale(&mut l.tau[1..2], 1e3);
        }),
    ),
    mistake(
        "all torques with the wrong sign",
        Torques,
        InLog(|l| scale(&mut l.tau, -1.0)),
    ),
    mistake(
        "one torque with the wrong sign",
        Torques,
        InLog(|l| scale(&mut l.tau[1..2], -1.0)),
    ),
    mistake("two torques swapped", Torques, InLog(|l| l.tau.swap(0, 1))),
    mistake(
        "all torques in reverse order",
        Torques,
        InLog(|l| l.tau.reverse()),
    ),
    mistake(
        "two positions and velocities swapped",
        Torques,
        InLog(|l| {
            l.q.swap(0, 1);
            l.qd.swap(0, 1);
        }),
    ),
    mistake("all torques 0", Torques, InLog(|l| scale(&mut l.tau, 0.0))),
    mistake(
        "torque of one joint 0",
        Torques,
        InLog(|l| scale(&mut l.tau[1..2], 0.0)),
    ),
    mistake(
        "torques delayed by 40 ms",
        Torques,
        InLog(|l| {
            let rows = (0.04 / (l.t[1] - l.t[0])).round() as usize;
            l.tau.iter_mut().for_each(|x| late(x, rows));
        }),
    ),
    mistake(
        "one torque delayed by 100 ms",
        Torques,
        InLog(|l| {
            let rows = (0.1 / (l.t[1] - l.t[0])).round() as usize;
            late(&mut l.tau[1], rows);
        }),
    ),
    unknowable(
        "one torque with an offset",
        Torques,
        InLog(|l| shift(&mut l.tau[1], 0.3)),
        "a constant torque is learned beside the model: the sensor's offset and a constant load are the same",
    ),
    mistake(
        "one torque with spikes",
        Torques,
        InLog(|l| spikes(&mut l.tau[1], 20.0)),
    ),
    mistake(
        "velocities with spikes",
        Velocities,
        InLog(|l| spikes(&mut l.qd[0], 20.0)),
    ),
    mistake(
        "positions with spikes",
        Motion,
        InLog(|l| spikes(&mut l.q[0], 3.0)),
    ),
    mistake(
        "one torque clipped at half of its largest",
        Torques,
        InLog(|l| clip(&mut l.tau[1], 0.5)),
    ),
    mistake(
        "one torque in ten steps",
        Torques,
        InLog(|l| quantise(&mut l.tau[1], 10.0)),
    ),
    mistake(
        "positions in thirty steps",
        Motion,
        InLog(|l| {
            quantise(&mut l.q[0], 30.0);
            l.qd.clear();
        }),
    ),
    mistake(
        "one position frozen for a second",
        Motion,
        InLog(|l| freeze(&l.t, &mut l.q[0], 1.0)),
    ),
    mistake(
        "one torque frozen for two seconds",
        Torques,
        InLog(|l| freeze(&l.t, &mut l.tau[1], 2.0)),
    ),
    unknowable(
        "one torque low-passed at 10 Hz, without phase",
        Torques,
        InLog(|l| smooth(&l.t, &mut l.tau[1], 0.1)),
        "what is above the band of the motion is removed by the fit as well",
    ),
    mistake(
        "one torque low-passed, 150 ms late",
        Torques,
        InLog(|l| lag(&l.t, &mut l.tau[1], 0.15)),
    ),
    mistake(
        "one position low-passed, 100 ms late",
        Velocities,
        InLog(|l| lag(&l.t, &mut l.q[0], 0.1)),
    ),
    mistake(
        "a copied position column",
        Joints,
        InLog(|l| {
            l.q[1] = l.q[0].clone();
            if l.qd.len() > 1 {
                l.qd[1] = l.qd[0].clone()
            }
        }),
    ),
    mistake(
        "a copied torque column",
        Torques,
        InLog(|l| l.tau[1] = l.tau[0].clone()),
    ),
    mistake(
        "positions in the columns of torques",
        Torques,
        InLog(|l| l.tau = l.q.clone()),
    ),
    mistake(
        "two joints that move in proportion",
        Joints,
        InLog(|l| {
            let half = |x: &Vec<f64>| x.iter().map(|x| 0.5 * x).collect();
            l.q[1] = half(&l.q[0]);
            if l.qd.len() > 1 {
                l.qd[1] = half(&l.qd[0])
            }
        }),
    ),
    mistake(
        "one joint constant",
        Joints,
        InLog(|l| {
            scale(&mut l.q[1..2], 0.0);
            if l.qd.len() > 1 {
                scale(&mut l.qd[1..2], 0.0)
            }
        }),
    ),
    mistake(
        "one joint that hardly moves",
        Joints,
        InLog(|l| {
            let mut rng = ChaCha8Rng::seed_from_u64(1);
            l.q[1]
                .iter_mut()
                .for_each(|x| *x = 1e-3 * *x + 1e-3 * normal(&mut rng));
            if l.qd.len() > 1 {
                l.qd[1]
                    .iter_mut()
                    .for_each(|x| *x = 1e-3 * *x + 1e-2 * normal(&mut rng))
            }
        }),
    ),
    unknowable(
        "three seconds of one log",
        Motion,
        InCase(|c| {
            c.logs.truncate(1);
            let log = &mut c.logs[0];
            let (begin, t) = (log.t[0], log.t.clone());
            log.keep(|k| t[k] - begin < 3.0);
        }),
        "a short log can be enough: the verdict rests on motions that were not fitted",
    ),
    mistake(
        "a gap of a second",
        Motion,
        InLog(|l| {
            let (begin, t) = (l.t[0] + 2.0, l.t.clone());
            l.keep(|k| !(begin..begin + 1.0).contains(&t[k]));
        }),
    ),
    mistake(
        "a tenth of the samples dropped",
        Motion,
        InLog(|l| {
            let mut rng = ChaCha8Rng::seed_from_u64(2);
            let kept: Vec<bool> = l.t.iter().map(|_| rng.random::<f64>() > 0.1).collect();
            l.keep(|k| kept[k]);
        }),
    ),
    mistake(
        "rows repeated at four times the rate",
        Motion,
        InLog(|l| {
            let order: Vec<usize> = (0..l.t.len()).flat_map(|k| [k; 4]).collect();
            let step = (l.t[1] - l.t[0]) / 4.0;
            l.reorder(&order);
            l.t.iter_mut()
                .enumerate()
                .for_each(|(k, t)| *t = k as f64 * step);
        }),
    ),
    mistake(
        "time that jitters by 1.5 steps",
        Motion,
        InLog(|l| {
            let mut rng = ChaCha8Rng::seed_from_u64(3);
            let step = l.t[1] - l.t[0];
            l.t.iter_mut()
                .for_each(|t| *t += 1.5 * step * rng.random::<f64>());
            l.t.sort_by(f64::total_cmp);
        }),
    ),
    mistake(
        "rows out of order",
        Motion,
        InLog(|l| {
            let mut order: Vec<usize> = (0..l.t.len()).collect();
            let middle = order.len() / 2;
            order.swap(middle, middle + 7);
            l.reorder(&order);
        }),
    ),
    mistake(
        "time that runs backwards",
        Motion,
        InLog(|l| {
            let order: Vec<usize> = (0..l.t.len()).rev().collect();
            l.reorder(&order);
        }),
    ),
    unknowable(
        "a film that runs backwards",
        Velocities,
        InLog(|l| {
            let (t, order): (Vec<f64>, Vec<usize>) = (l.t.clone(), (0..l.t.len()).rev().collect());
            l.reorder(&order);
            l.t = t;
            scale(&mut l.qd, -1.0);
        }),
        "free motions without friction may run backwards; with friction, its sign is then that of a drive",
    ),
    mistake(
        "time that restarts in the middle",
        Motion,
        InLog(|l| {
            let middle = l.t.len() / 2;
            let (begin, at) = (l.t[0], l.t[middle]);
            l.t[middle..].iter_mut().for_each(|t| *t += begin - at);
        }),
    ),
    mistake(
        "two logs joined, time continued",
        Logs,
        InCase(|c| {
            let mut second = c.logs.remove(1);
            let first = &mut c.logs[0];
            let (end, step) = (first.t[first.t.len() - 1], first.t[1] - first.t[0]);
            let begin = second.t[0];
            first
                .t
                .extend(second.t.iter().map(|t| t - begin + end + step));
            let both = first.signals().into_iter().zip(second.signals());
            both.for_each(|(a, b)| a.iter_mut().zip(b).for_each(|(a, b)| a.append(b)));
        }),
    ),
    mistake(
        "holes of NaN",
        Motion,
        InLog(|l| {
            l.q[0]
                .iter_mut()
                .skip(100)
                .step_by(500)
                .for_each(|x| *x = f64::NAN)
        }),
    ),
    mistake(
        "a trajectory twice",
        Motion,
        InCase(|c| c.logs.push(c.logs[0].clone())),
    ),
    mistake(
        "a part of one trajectory as another",
        Motion,
        InCase(|c| {
            let mut part = c.logs[0].clone();
            let rows = part.t.len();
            part.keep(|k| k > rows / 2);
            c.logs.push(part);
        }),
    ),
    mistake(
        "validation on the training files",
        Motion,
        InCase(|c| c.validation = vec![c.logs[0].clone()]),
    ),
    mistake(
        "wrapped angles that are declared as lines",
        Motion,
        InCase(|c| {
            c.angles = false;
            for log in &mut c.logs {
                let turn = std::f64::consts::TAU;
                let (low, high) = range(&log.q[0]);
                let stretch = 1.5 * turn / (high - low).min(1.5 * turn);
                log.q[0]
                    .iter_mut()
                    .for_each(|x| *x = (*x * stretch).rem_euclid(turn));
                log.qd.clear();
            }
        }),
    ),
    unknowable(
        "a position with an offset",
        Joints,
        InLog(|l| shift(&mut l.q[1], 0.4)),
        ZERO,
    ),
    unknowable(
        "a position with an offset against the description",
        Description,
        InLog(|l| l.q[1].iter_mut().for_each(|x| *x += 0.4)),
        BODIES,
    ),
    mistake(
        "accelerations with the wrong sign",
        Accelerations,
        InLog(|l| scale(&mut l.qdd, -1.0)),
    ),
    mistake(
        "two accelerations swapped",
        Accelerations,
        InLog(|l| l.qdd.swap(0, 1)),
    ),
    mistake(
        "accelerations in deg/s²",
        Accelerations,
        InLog(|l| scale(&mut l.qdd, 57.295_779_5)),
    ),
    mistake(
        "accelerations 100 ms late",
        Accelerations,
        InLog(|l| {
            let rows = (0.1 / (l.t[1] - l.t[0])).round() as usize;
            l.qdd.iter_mut().for_each(|x| late(x, rows));
        }),
    ),
    mistake(
        "velocities as accelerations",
        Accelerations,
        InLog(|l| l.qdd = l.qd.clone()),
    ),
    mistake(
        "torques of one log doubled",
        Several,
        InCase(|c| scale(&mut c.logs[2].tau, 2.0)),
    ),
    mistake(
        "torques of one log 0",
        Several,
        InCase(|c| scale(&mut c.logs[2].tau, 0.0)),
    ),
    mistake(
        "torques of one log exchanged",
        Several,
        InCase(|c| c.logs[2].tau.rotate_left(1)),
    ),
    mistake(
        "torques of one log negated",
        Several,
        InCase(|c| scale(&mut c.logs[2].tau, -1.0)),
    ),
    mistake(
        "torques of one log 50 ms late",
        Several,
        InCase(|c| {
            let log = &mut c.logs[2];
            let rows = (0.05 / (log.t[1] - log.t[0])).round() as usize;
            log.tau.iter_mut().for_each(|x| late(x, rows));
        }),
    ),
    mistake(
        "one log of a longer machine",
        Longer,
        InCase(|c| c.logs[2] = c.longer.swap_remove(0)),
    ),
    mistake(
        "three of six logs of a longer machine",
        Longer,
        InCase(|c| {
            for (log, other) in c.logs.iter_mut().skip(3).zip(std::mem::take(&mut c.longer)) {
                *log = other;
            }
        }),
    ),
    mistake(
        "validation on a longer machine",
        Longer,
        InCase(|c| c.validation = c.longer.split_off(2)),
    ),
    mistake(
        "torque of one joint on the side of the motor",
        Torques,
        InLog(|l| scale(&mut l.tau[1..2], 0.02)),
    ),
    mistake(
        "torques 100 samples late",
        Several,
        InLog(|l| l.tau.iter_mut().for_each(|x| late(x, 100))),
    ),
    mistake(
        "radians read as degrees",
        Motion,
        InLog(|l| {
            scale(&mut l.q, 0.017_453_29);
            scale(&mut l.qd, 0.017_453_29);
        }),
    ),
    mistake(
        "time as the number of the row",
        Motion,
        InLog(|l| {
            l.t.iter_mut().enumerate().for_each(|(k, t)| *t = k as f64);
            l.qd.clear();
        }),
    ),
    mistake(
        "white noise in place of the motion",
        Motion,
        InLog(|l| {
            let mut rng = ChaCha8Rng::seed_from_u64(7);
            l.q.iter_mut().flatten().for_each(|x| *x = normal(&mut rng));
            l.qd.clear();
        }),
    ),
    mistake(
        "one torque before a dead zone",
        Torques,
        InLog(|l| {
            let (low, high) = range(&l.tau[0]);
            let width = 0.1 * (high - low);
            l.tau[0].iter_mut().for_each(|x| *x += width * x.signum());
        }),
    ),
    mistake("the torques omitted", Several, InLog(|l| l.tau.clear())),
    mistake(
        "the torque of the first joint omitted",
        Torques,
        InLog(|l| scale(&mut l.tau[..1], 0.0)),
    ),
    mistake(
        "ends of two links in place of angles",
        Joints,
        InCase(|c| {
            c.angles = false;
            let logs = c.logs.iter_mut().chain(&mut c.validation);
            logs.for_each(ends_of_links);
        }),
    ),
    mistake(
        "validation on a rounded copy",
        Motion,
        InCase(|c| {
            let mut copy = c.logs[0].clone();
            copy.each(|x| x.iter_mut().for_each(|x| *x = (1e3 * *x).round() / 1e3));
            c.validation = vec![copy];
        }),
    ),
    mistake(
        "validation on a copy at another rate",
        Motion,
        InCase(|c| c.validation = vec![resampled(&c.logs[0], 0.73)]),
    ),
    mistake(
        "validation that repeats a motion with other noise",
        Motion,
        InCase(|c| {
            let mut rng = ChaCha8Rng::seed_from_u64(8);
            let mut copy = resampled(&c.logs[0], 1.0);
            for column in copy.signals().into_iter().flatten() {
                let (low, high) = range(column);
                let noise = 5e-5 * (high - low);
                column
                    .iter_mut()
                    .for_each(|x| *x += noise * normal(&mut rng));
            }
            copy.keep(|k| k > 57);
            c.validation = vec![copy];
        }),
    ),
    mistake("logs of two robots", Torques, InCase(another_robot)),
    unknowable(
        "a log without gravity",
        Description,
        InCase(without_gravity),
        "a machine that moves in a horizontal plane, or whose controller adds gravity to what it logs, is a machine too",
    ),
    mistake(
        "torques in mN·m beside a description",
        Description,
        InLog(|l| scale(&mut l.tau, 1e3)),
    ),
    unknowable(
        "the description of another robot",
        Description,
        InCase(|c| {
            describe(c, |text| {
                // Another machine with the same joints: its links are longer and lie elsewhere.
                text.replace("0.425", "0.2")
                    .replace("0.612", "0.25")
                    .replace("0.39225", "0.7")
                    .replace("0.5723", "0.9")
            })
        }),
        BODIES,
    ),
    mistake(
        "a description with joints in another order",
        Description,
        InCase(|c| {
            let n = c.joints();
            let Some((text, joints)) = &mut c.urdf else {
                return;
            };
            if joints.is_empty()
                && let Ok(robot) = RigidBodies::from_urdf(text)
            {
                *joints = robot.joints().to_vec();
            }
            if joints.len() == n {
                joints.swap(0, 1)
            }
        }),
    ),
    mistake(
        "a description in millimetres",
        Description,
        InCase(|c| describe(c, millimetres)),
    ),
];

impl Mistake {
    /// The case with this mistake; `None` where the data do not have what it needs.
    pub(super) fn made(&self, good: &Case) -> Option<Case> {
        let log = good.logs.first()?;
        let able = match self.needs {
            Motion => true,
            Velocities => !log.qd.is_empty(),
            Torques => log.tau.len() > 1,
            Accelerations => log.qd.len() > 1,
            Joints => log.q.len() > 1,
            Logs => good.logs.len() > 1,
            Several => good.logs.len() > 2 && !log.tau.is_empty(),
            Longer => !good.longer.is_empty(),
            Description => good.urdf.is_some(),
        };
        let mut case = good.clone();
        if self.needs == Accelerations {
            case = with_accelerations(good);
        }
        // A description is the wish of a user, and would name the mistakes of the data that others must find.
        if self.needs != Description {
            case.urdf = None;
        }
        if !able {
            return None;
        }
        match self.make {
            InCase(make) => make(&mut case),
            InLog(make) => case
                .logs
                .iter_mut()
                .chain(&mut case.validation)
                .for_each(make),
        }
        Some(case)
    }

    /// Whether it spoils accelerations, which the good data do not have.
    pub(super) fn needs_accelerations(&self) -> bool {
        self.needs == Accelerations
    }
}

/// The same data with accelerations.
pub(super) fn with_accelerations(good: &Case) -> Case {
    let mut case = good.clone();
    let logs = case.logs.iter_mut().chain(&mut case.validation);
    logs.for_each(accelerate);
    case
}

fn scale(columns: &mut [Vec<f64>], factor: f64) {
    columns.iter_mut().flatten().for_each(|x| *x *= factor);
}

fn range(x: &[f64]) -> (f64, f64) {
    let start = (f64::INFINITY, f64::NEG_INFINITY);
    x.iter()
        .fold(start, |(low, high), x| (low.min(*x), high.max(*x)))
}

/// Adds a part of the range.
fn shift(x: &mut [f64], part: f64) {
    let (low, high) = range(x);
    x.iter_mut().for_each(|x| *x += part * (high - low));
}

/// The positions x and y of the ends of two links of length 1 with absolute angles, in place of these.
fn ends_of_links(log: &mut Log) {
    let [a, b] = [0, 1].map(|i| log.q[i].clone());
    let sum = |f: fn(f64) -> f64, second: f64| -> Vec<f64> {
        let pairs = a.iter().zip(&b);
        pairs.map(|(a, b)| f(*a) + second * f(*b)).collect()
    };
    let mut positions = Vec::new();
    for second in [0.0, 1.0] {
        positions.extend([sum(f64::sin, second), sum(|x| -x.cos(), second)]);
    }
    *log = Log {
        t: std::mem::take(&mut log.t),
        q: positions,
        ..Log::default()
    };
}

/// A log at steps that are this many times as long, by cubic interpolation.
fn resampled(log: &Log, step: f64) -> Log {
    let rows = ((log.t.len() - 4) as f64 / step) as usize;
    let at = |x: &[f64], k: usize| {
        let place = 1.0 + k as f64 * step;
        let (row, u) = (place as usize, place.fract());
        let [a, b, c, d] = [0, 1, 2, 3].map(|j| x[row + j - 1]);
        let slope = [0.5 * (c - a), 0.5 * (d - b)];
        let (u2, u3) = (u * u, u * u * u);
        (2.0 * u3 - 3.0 * u2 + 1.0) * b
            + (u3 - 2.0 * u2 + u) * slope[0]
            + (3.0 * u2 - 2.0 * u3) * c
            + (u3 - u2) * slope[1]
    };
    let mut copy = log.clone();
    copy.t = (0..rows).map(|k| at(&log.t, k)).collect();
    copy.each(|x| *x = (0..rows).map(|k| at(x, k)).collect());
    copy
}

fn late(x: &mut Vec<f64>, rows: usize) {
    let first = x[0];
    x.splice(0..0, std::iter::repeat_n(first, rows));
    x.truncate(x.len() - rows);
}

fn spikes(x: &mut [f64], size: f64) {
    let (low, high) = range(x);
    x.iter_mut()
        .skip(50)
        .step_by(701)
        .for_each(|x| *x += size * (high - low));
}

fn clip(x: &mut [f64], part: f64) {
    let (low, high) = range(x);
    let most = part * low.abs().max(high.abs());
    x.iter_mut().for_each(|x| *x = x.clamp(-most, most));
}

fn quantise(x: &mut [f64], levels: f64) {
    let (low, high) = range(x);
    let step = (high - low) / levels;
    x.iter_mut().for_each(|x| *x = (*x / step).round() * step);
}

/// Repeats one value for some seconds from the middle on.
fn freeze(t: &[f64], x: &mut [f64], seconds: f64) {
    let middle = t.len() / 2;
    let (begin, value) = (t[middle], x[middle]);
    let moved = x.iter_mut().zip(t).skip(middle);
    moved
        .take_while(|(_, t)| **t < begin + seconds)
        .for_each(|(x, _)| *x = value);
}

/// The mean over a window without phase.
fn smooth(t: &[f64], x: &mut [f64], seconds: f64) {
    let half = (0.5 * seconds / (t[1] - t[0])) as usize;
    let old = x.to_vec();
    for (k, x) in x.iter_mut().enumerate() {
        let window = &old[k.saturating_sub(half)..(k + half + 1).min(old.len())];
        *x = window.iter().sum::<f64>() / window.len() as f64;
    }
}

/// A low-pass of first order with this time constant.
fn lag(t: &[f64], x: &mut [f64], seconds: f64) {
    let part = (t[1] - t[0]) / seconds;
    let mut level = x[0];
    for x in x {
        level += part * (*x - level);
        *x = level;
    }
}

/// Adds accelerations: the slopes of the velocities over a short window.
fn accelerate(log: &mut Log) {
    let half = 6;
    let t = &log.t;
    let slope = |x: &[f64], k: usize| {
        let (a, b) = (k.saturating_sub(half), (k + half).min(x.len() - 1));
        (x[b] - x[a]) / (t[b] - t[a])
    };
    let column = |x: &Vec<f64>| (0..x.len()).map(|k| slope(x, k)).collect();
    log.qdd = log.qd.iter().map(column).collect();
}

/// Adds a log of another robot with as many joints.
fn another_robot(case: &mut Case) {
    let n = case.joints();
    let log = &case.logs[0];
    let hertz = ((log.t.len() - 1) as f64 / (log.t[log.t.len() - 1] - log.t[0])).round();
    let seconds = log.t.len() as f64 / hertz;
    let other = rigid::example("iiwa7").and_then(|text| {
        let all = RigidBodies::from_urdf(text).ok()?;
        let joints = all.joints().get(..n)?.to_vec();
        RigidBodies::with_joints(text, &joints).ok()
    });
    let log = other.and_then(|robot| arm_log(&robot, hertz, seconds, 9).ok());
    case.logs.extend(log);
}

/// Takes the torques of gravity of the description away.
fn without_gravity(case: &mut Case) {
    let robot = case.robot();
    case.urdf = None;
    for log in case.logs.iter_mut().chain(&mut case.validation) {
        if let Some(robot) = &robot {
            subtract_gravity(robot, log);
        }
    }
}

fn describe(case: &mut Case, change: impl Fn(&str) -> String) {
    if let Some((text, _)) = &mut case.urdf {
        *text = change(text);
    }
}

/// A description whose lengths are in millimetres: all `xyz` of origins a thousand times as long.
fn millimetres(text: &str) -> String {
    let mut parts = text.split("<origin");
    let mut out = parts.next().unwrap_or_default().to_string();
    for part in parts {
        out.push_str("<origin");
        let (head, rest) = part.split_once('>').unwrap_or((part, ""));
        let (before, xyz) = head.split_once("xyz=\"").unwrap_or((head, ""));
        let (xyz, after) = xyz.split_once('"').unwrap_or(("", ""));
        let long = |x: &str| x.parse::<f64>().map(|x| (1e3 * x).to_string());
        let long: Result<Vec<String>, _> = xyz.split_whitespace().map(long).collect();
        match long {
            Ok(long) if !long.is_empty() => {
                out += &format!("{before}xyz=\"{}\"{after}>{rest}", long.join(" "));
            }
            _ => out += &format!("{head}>{rest}"),
        }
    }
    out
}
