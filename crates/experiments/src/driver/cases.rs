//! The list of cases: which system, what a sensor makes of its motions, and what is wrong with the files.

use anyhow::Result;
use lagrangian::Recording;
use lagrangian::trajectory::Trajectory;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::systems::{Loss, Motion, Named, SAMPLES, Truth, all};
use crate::data::deviation;
use crate::mistakes::case::Log;
use crate::mistakes::sources::{normal, of_motion};

/// Noise in parts of the deviation of each signal.
const NOISE: [f64; 3] = [0.0, 1e-3, 5e-3];
/// Numbers of motions.
const COUNTS: [usize; 2] = [6, 30];
/// Of the 24 kinds of data each system has so many.
const KINDS: usize = 6;
/// Each flaw spoils the data of so many systems.
const SPOILED: usize = 3;

/// One file that is given to the plain command.
#[derive(Clone)]
pub(crate) struct Case {
    pub(crate) system: Named,
    pub(crate) noise: f64,
    velocities: bool,
    count: usize,
    pub(super) forced: bool,
    pub(super) flaw: Option<&'static Flaw>,
    /// Other motions of the same kind for another seed.
    pub(super) seed: u64,
}

/// What the command is given.
pub(crate) struct Files {
    pub(crate) training: Vec<Recording>,
    pub(super) validation: Vec<Recording>,
}

/// Something that is wrong with the files.
pub(super) struct Flaw {
    pub(super) name: &'static str,
    /// The fewest coordinates, and whether there must be an angle.
    needs: (usize, bool),
    forced: bool,
    make: fn(&mut Spoiled),
}

/// The logs before they are files.
struct Spoiled {
    logs: Vec<Log>,
    validation: Vec<Log>,
    angles: Vec<String>,
    rng: ChaCha8Rng,
}

const fn driven(name: &'static str, joints: usize, make: fn(&mut Spoiled)) -> Flaw {
    Flaw {
        name,
        needs: (joints, false),
        forced: true,
        make,
    }
}

const fn free(name: &'static str, angle: bool, make: fn(&mut Spoiled)) -> Flaw {
    Flaw {
        name,
        needs: (1, angle),
        forced: false,
        make,
    }
}

fn scale(columns: &mut [Vec<f64>], factor: f64) {
    columns.iter_mut().flatten().for_each(|x| *x *= factor);
}

const FLAWS: &[Flaw] = &[
    driven("torques of one log doubled", 1, |s| {
        scale(&mut s.logs[1].tau, 2.0)
    }),
    driven("torques of one log zero", 1, |s| {
        scale(&mut s.logs[1].tau, 0.0)
    }),
    driven("torques of one log negated", 1, |s| {
        scale(&mut s.logs[1].tau, -1.0)
    }),
    driven("torques of one log exchanged", 2, |s| {
        s.logs[1].tau.swap(0, 1)
    }),
    driven("torques of one log late", 1, |s| {
        s.logs[1].tau.iter_mut().for_each(|x| x.rotate_right(5))
    }),
    driven("torques late by 100 samples", 1, |s| {
        s.logs
            .iter_mut()
            .flat_map(|log| &mut log.tau)
            .for_each(|x| x.rotate_right(100))
    }),
    driven("torques negated", 1, |s| {
        s.logs.iter_mut().for_each(|log| scale(&mut log.tau, -1.0))
    }),
    driven("torques in another order", 2, |s| {
        s.logs.iter_mut().for_each(|log| log.tau.swap(0, 1))
    }),
    driven("one torque of the motor's side", 2, |s| {
        s.logs
            .iter_mut()
            .for_each(|log| scale(&mut log.tau[..1], 0.02))
    }),
    driven("a torque forgotten", 2, |s| {
        s.logs
            .iter_mut()
            .for_each(|log| scale(&mut log.tau[1..2], 0.0))
    }),
    free("time as row numbers", false, |s| {
        s.logs
            .iter_mut()
            .for_each(|log| log.t = (0..SAMPLES).map(|k| k as f64).collect())
    }),
    free("one clock at half its speed", false, |s| {
        s.logs[1].t.iter_mut().for_each(|t| *t *= 2.0)
    }),
    free("degrees taken for radians", true, |s| {
        for log in &mut s.logs {
            scale(&mut log.q, 57.295_779_5);
            scale(&mut log.qd, 57.295_779_5);
        }
    }),
    free("velocities in degrees", true, |s| {
        s.logs
            .iter_mut()
            .for_each(|log| scale(&mut log.qd, 57.295_779_5))
    }),
    free("velocities of another log", false, |s| {
        s.logs[1].qd = s.logs[2].qd.clone()
    }),
    free("two machines", false, |s| {
        for log in s.logs.iter_mut().step_by(2) {
            log.t.iter_mut().for_each(|t| *t *= 1.3);
            scale(&mut log.qd, 1.0 / 1.3);
        }
    }),
    free("white noise in place of data", false, |s| {
        for log in &mut s.logs {
            log.qd.clear();
            log.q
                .iter_mut()
                .flatten()
                .for_each(|x| *x = normal(&mut s.rng));
        }
    }),
    free("validation is a rounded copy", false, |s| {
        s.validation = s.logs[..2].to_vec();
        let values = s
            .validation
            .iter_mut()
            .flat_map(Log::signals)
            .flatten()
            .flatten();
        values.for_each(|x| *x = (*x * 1e3).round() * 1e-3);
    }),
    free("validation is a thinned copy", false, |s| {
        s.validation = s.logs[..2].to_vec();
        for log in &mut s.validation {
            log.t = log.t.iter().copied().step_by(2).collect();
            let thin = |x: &mut Vec<f64>| *x = x.iter().copied().step_by(2).collect();
            log.signals().into_iter().flatten().for_each(thin);
        }
    }),
    free("an angle as its cosine and sine", true, |s| {
        let of: usize = s.angles[0].trim_start_matches('q').parse().unwrap_or(1) - 1;
        for log in &mut s.logs {
            log.qd.clear();
            let sines = log.q[of].iter().map(|x| x.sin()).collect();
            log.q[of].iter_mut().for_each(|x| *x = x.cos());
            log.q.push(sines);
        }
        s.angles.remove(0);
    }),
];

/// All cases, in an order that never changes.
pub(super) fn cases() -> Vec<Case> {
    let systems = all();
    let kinds = |(at, system): (usize, &Named)| {
        let system = *system;
        (0..KINDS).map(move |k| {
            let kind = (7 * at + 5 * k) % 24;
            let (velocities, forced) = (
                kind / 3 % 2 == 1,
                kind / 12 == 1 || system.loss == Loss::DeadZone,
            );
            Case {
                system,
                noise: NOISE[kind % 3],
                velocities,
                count: COUNTS[kind / 6 % 2],
                forced,
                flaw: None,
                seed: 0,
            }
        })
    };
    let good = systems.iter().enumerate().flat_map(kinds);
    let spoiled = FLAWS.iter().enumerate().flat_map(|(at, flaw)| {
        let fits = |system: &&Named| {
            system
                .shape()
                .is_ok_and(|(n, angle)| n >= flaw.needs.0 && (angle || !flaw.needs.1))
        };
        let suited: Vec<Named> = systems.iter().filter(fits).copied().collect();
        (0..SPOILED).map(move |k| {
            let system = suited[(5 * at + 17 * k) % suited.len()];
            Case {
                system,
                noise: NOISE[1],
                velocities: true,
                count: COUNTS[0],
                forced: flaw.forced,
                flaw: Some(flaw),
                seed: 0,
            }
        })
    });
    good.chain(spoiled).collect()
}

impl Case {
    /// Positions alone of so many motions that nothing drives.
    pub(crate) fn of_positions(system: Named, noise: f64, count: usize, seed: u64) -> Self {
        Self {
            system,
            noise,
            velocities: false,
            count,
            forced: false,
            flaw: None,
            seed,
        }
    }

    /// Its name, which says what is known of it.
    pub(crate) fn name(&self) -> String {
        let Self { noise, count, .. } = self;
        let drive = if self.forced { "forced" } else { "free" };
        match self.flaw {
            Some(flaw) => format!("{}: {}", self.system.name(), flaw.name),
            None => {
                let velocities = if self.velocities { "q, qd" } else { "q" };
                format!(
                    "{}: {count} {drive} motions, {velocities}, noise {noise}",
                    self.system.name()
                )
            }
        }
    }

    /// The seed of its motions.
    pub(crate) fn seed(&self) -> u64 {
        let add = |sum: u64, byte: u8| sum.wrapping_mul(131).wrapping_add(byte.into()) % 1_000_003;
        self.name().bytes().fold(17, add) + 7_000_003 * self.seed
    }

    /// Whether it is small enough for a quick run.
    pub(super) fn is_small(&self) -> bool {
        self.count == COUNTS[0] && self.system.shape().is_ok_and(|(n, _)| n <= 2)
    }

    /// The recordings as a file gives them.
    pub(crate) fn files(&self, truth: &Truth) -> Result<Files> {
        let mut motions: Vec<Trajectory> = truth
            .motions(self.count, self.forced, self.seed())?
            .into_iter()
            .map(|m: Motion| m.shown)
            .collect();
        let mut rng = ChaCha8Rng::seed_from_u64(self.seed());
        let n = truth.model.coordinates().dof();
        let signals: [fn(&mut Trajectory) -> &mut Vec<f64>; 2] =
            [|m| &mut m.signals.q, |m| &mut m.signals.qd];
        let circles = (0..n).filter(|i| truth.model.coordinates().is_circle(*i));
        let circles: Vec<usize> = circles.collect();
        for (of, turns) in signals.into_iter().zip([true, false]) {
            for i in 0..n {
                let all: Vec<f64> = motions
                    .iter_mut()
                    .flat_map(|m| of(m).iter().skip(i).step_by(n).copied())
                    .collect();
                // An angle that turns round and round is not measured worse for it.
                let most = if circles.contains(&i) && turns {
                    1.8
                } else {
                    f64::INFINITY
                };
                let size = self.noise * deviation(&all).min(most);
                let values = motions
                    .iter_mut()
                    .flat_map(|m| of(m).iter_mut().skip(i).step_by(n));
                values.for_each(|x| *x += size * normal(&mut rng));
            }
        }
        let mut logs: Vec<Log> = motions
            .iter()
            .map(|motion| of_motion(motion, self.forced))
            .collect();
        for log in &mut logs {
            log.qdd.clear();
            if !self.velocities {
                log.qd.clear();
            }
        }
        let angles = circles.iter().map(|i| format!("q{}", i + 1)).collect();
        let mut spoiled = Spoiled {
            logs,
            validation: Vec::new(),
            angles,
            rng,
        };
        if let Some(flaw) = self.flaw {
            (flaw.make)(&mut spoiled);
        }
        let read = |what: &str, logs: &[Log]| -> Result<Vec<Recording>> {
            let mut all = Vec::new();
            for (log, k) in logs.iter().zip(1..) {
                all.extend(log.read(&format!("{what} {k}"), &spoiled.angles)?);
            }
            Ok(all)
        };
        Ok(Files {
            training: read("log", &spoiled.logs)?,
            validation: read("validation", &spoiled.validation)?,
        })
    }
}
