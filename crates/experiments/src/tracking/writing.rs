//! Arms that write letters while a model of them is learned: references, errors of each letter, and how soon a model
//! recovers from a payload.

use std::f64::consts::TAU;

use crate::families;
use lagrangian::analytic::by_name;
use lagrangian::models::{ChainConfig, Family, RigidConfig};
use lagrangian::rigid::{IdentifiedRobot, LoadParameters, RigidBodies, example};
use lagrangian::trajectory::Samples;
use lagrangian::{
    Dataset, Error, FitConfig, Learned, Loss, Model, Result, Signals, TrainingTask, Trajectory, fit,
};
use lagrangian_control::online::{
    ChangeConfig, Differentiator, FeedForwardSource, OnlineConfig, OnlineLearner, PayloadSource,
    Record, TrackingConfig, track,
};
use lagrangian_control::payload::PayloadConfig;
use lagrangian_control::{
    Desired, Gains, LatencyBin, LoopConfig, Quantiles, Reference, RobotChange, Sensors,
    VelocitySource,
};

/// Samples of a reference in a second, Hz.
const RATE: f64 = 200.0;
/// Time from the end of a letter to the start of the next, s.
const WAY: f64 = 1.0;
/// Length of a window that errors over time are taken in, s.
pub(crate) const WINDOW: f64 = 0.5;
/// Time from the start of one window to that of the next, s.
pub(crate) const STRIDE: f64 = 0.02;

/// Letters one after another, with smooth ways between them.
pub(crate) struct Writing {
    /// The whole motion.
    pub(crate) reference: Reference,
    pub(crate) letters: Vec<Span>,
}

/// A letter, and when it begins and ends, s.
pub(crate) struct Span {
    pub(crate) name: String,
    pub(crate) from: f64,
    pub(crate) to: f64,
}

impl Writing {
    /// These letters in this order, sampled at 200 Hz; quintic polynomials lead from each to the next.
    pub(crate) fn new(letters: &[Trajectory]) -> Result<Self> {
        let first = letters
            .first()
            .ok_or_else(|| Error::too_short("the text to write", 0, 1))?;
        let mut path = Path::default();
        let mut spans = Vec::new();
        for letter in letters {
            Error::check_shape(
                format_args!("letter '{}'", letter.name),
                letter.dof(),
                first.dof(),
                "give letters of the same joints",
            )?;
            let letter_path = Reference::new(letter.clone())?;
            let begin = path.add(&letter_path)?;
            spans.push(Span {
                name: letter.name.clone(),
                from: begin,
                to: path.end(),
            });
        }
        Ok(Self {
            reference: Reference::new(path.0)?,
            letters: spans,
        })
    }

    /// Root mean square of the tracking error over all joints, rad, for each letter.
    pub(crate) fn errors(&self, motion: &Trajectory) -> Vec<f64> {
        let spans = self.letters.iter();
        spans.map(|l| self.error(motion, (l.from, l.to))).collect()
    }

    /// The same over any span of time, s; NaN where there is no sample.
    pub(crate) fn error(&self, motion: &Trajectory, (from, to): (f64, f64)) -> f64 {
        let n = self.reference.dof();
        let mut desired = Desired::new(n);
        let (mut sum, mut count) = (0.0, 0usize);
        let inside = |t: &f64| (from..to).contains(t);
        for (k, &t) in motion.t.iter().enumerate().filter(|(_, t)| inside(t)) {
            self.reference.at(t, &mut desired);
            let pairs = motion.row(k).q.iter().zip(&desired.q);
            sum += pairs.map(|(a, b)| (a - b).powi(2)).sum::<f64>();
            count += n;
        }
        (sum / count as f64).sqrt()
    }

    /// The error in windows of [`WINDOW`], one every [`STRIDE`], from `from` to the end: (middle of the window, error).
    pub(crate) fn errors_over_time(&self, motion: &Trajectory, from: f64) -> (Vec<f64>, Vec<f64>) {
        let end = motion.t.last().copied().unwrap_or(from);
        let count = ((end - from - WINDOW) / STRIDE + 1.0).floor().max(0.0) as usize;
        let window = |k: usize| {
            let begin = from + STRIDE * k as f64;
            let error = self.error(motion, (begin, begin + WINDOW));
            (begin + 0.5 * WINDOW, error)
        };
        (0..count).map(window).unzip()
    }
}

/// A reference in the making.
#[derive(Default)]
struct Path(Trajectory);

impl Path {
    fn end(&self) -> f64 {
        self.0.t.last().copied().unwrap_or(0.0)
    }

    /// Adds a letter, after a way to its start; where it starts, s.
    fn add(&mut self, letter: &Reference) -> Result<f64> {
        let n = letter.dof();
        let mut start = Desired::new(n);
        letter.at(letter.start(), &mut start);
        if !self.0.is_empty() {
            let way = self.way_to(&start, n)?;
            self.append(&way, way.start() + 1.0 / RATE);
        }
        let begin = self.end();
        let shift = letter.start();
        self.append(letter, shift + if begin > 0.0 { 1.0 / RATE } else { 0.0 });
        Ok(begin)
    }

    /// The quintic from the last sample to `start`.
    fn way_to(&self, start: &Desired, n: usize) -> Result<Reference> {
        let last = |x: &[f64]| x[x.len() - n..].to_vec();
        let t = &self.0;
        let signals = Signals {
            q: [last(&t.q), start.q.clone()].concat(),
            qd: [last(&t.qd), start.qd.clone()].concat(),
            qdd: [last(&t.qdd), start.qdd.clone()].concat(),
            ..Signals::default()
        };
        Reference::new(Trajectory::new("way", vec![0.0, WAY], signals))
    }

    /// Samples `piece` from its time `from` to its end.
    fn append(&mut self, piece: &Reference, from: f64) {
        let mut desired = Desired::new(piece.dof());
        let offset = self.end() - piece.start();
        let count = ((piece.end() - from) * RATE + 1e-9).floor() as usize;
        for k in 0..=count {
            // The last instant of a piece still belongs to it.
            let t = (from + k as f64 / RATE).min(piece.end() - 1e-9);
            piece.at(t, &mut desired);
            let trajectory = &mut self.0;
            trajectory.t.push(offset + from + k as f64 / RATE);
            trajectory.q.extend(&desired.q);
            trajectory.qd.extend(&desired.qd);
            trajectory.qdd.extend(&desired.qdd);
        }
    }
}

/// Letter-like curves of two joints for where no data are at hand: sums of two harmonics, from rest to rest.
pub(crate) fn curves(count: usize) -> Vec<Trajectory> {
    (0..count).map(curve).collect()
}

/// The `index`-th curve: 5 s long; its harmonics and phases follow from the index.
fn curve(index: usize) -> Trajectory {
    const SECONDS: f64 = 5.0;
    let k = index as f64;
    let (a, b) = (1 + index % 3, 2 + (index / 3) % 3);
    let phase = 0.7 * k;
    // Time runs from rest to rest: s goes from 0 to 1 with no speed at either end.
    let wave = move |s: f64, i: usize| {
        let harmonic = TAU * [a as f64, b as f64][i];
        let (centre, size) = [(-0.3, 0.4), (1.7, 0.5)][i];
        let inner = harmonic * s + phase * (i as f64 + 1.0);
        [
            centre + size * inner.sin(),
            size * harmonic * inner.cos(),
            -size * harmonic * harmonic * inner.sin(),
        ]
    };
    let steps = (SECONDS * RATE) as usize;
    let times = (0..=steps).map(|k| k as f64 / RATE).collect();
    let mut out = Trajectory::new(format!("curve {}", index + 1), times, Signals::default());
    for k in 0..=steps {
        let x = out.t[k] / SECONDS;
        let [s, v, w] = [
            x.powi(3) * (10.0 - 15.0 * x + 6.0 * x * x),
            30.0 * x * x * (1.0 - x).powi(2) / SECONDS,
            60.0 * x * (1.0 - x) * (1.0 - 2.0 * x) / SECONDS.powi(2),
        ];
        for i in 0..2 {
            let [q, slope, bend] = wave(s, i);
            out.q.push(q);
            out.qd.push(slope * v);
            out.qdd.push(bend * v * v + slope * w);
        }
    }
    out
}

/// An arm that writes: the robot, the same with something in its hand, and how it is driven.
pub(crate) struct Arm {
    /// Its name.
    pub(crate) name: &'static str,
    /// The robot.
    pub(crate) robot: Box<dyn Model>,
    /// With a payload.
    pub(crate) loaded: Box<dyn Model>,
    /// The payload, kg.
    pub(crate) payload: f64,
    /// The bodies of the robot, whose tip carries the payload.
    pub(crate) bodies: RigidBodies,
    /// The link that holds the payload.
    pub(crate) hand: &'static str,
    /// Low gains of the feedback.
    pub(crate) gains: Gains,
    /// Whether a surprise is taken for a load, so that older samples are forgotten. Many joints meet new regions for
    /// long, which surprise as much.
    pub(crate) forgets: bool,
    /// Its loop: 500 Hz, encoders of 20 bits, velocities with noise.
    pub(crate) control: LoopConfig,
    /// What each joint takes of a letter: (joint of the letter, factor, added), `[n]`.
    joints: Vec<(usize, f64, f64)>,
}

/// One step of an encoder of 20 bits, rad.
const ENCODER: f64 = TAU / 1_048_576.0;
/// Noise of measured velocities, rad/s.
const VELOCITY_NOISE: f64 = 2e-3;

/// The arm `two-link-arm` as bodies: uniform rods in a vertical plane, the first angle from the horizontal.
const TWO_LINKS: &str = r#"<robot name="two-link-arm">
  <link name="base"/>
  <link name="upper"><inertial><origin xyz="0.2 0 0"/><mass value="1.0"/>
    <inertia ixx="0" iyy="0.013333333333333334" izz="0.013333333333333334" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="lower"><inertial><origin xyz="0.2 0 0"/><mass value="0.8"/>
    <inertia ixx="0" iyy="0.010666666666666667" izz="0.010666666666666667" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="q1" type="continuous"><parent link="base"/><child link="upper"/><axis xyz="0 -1 0"/></joint>
  <joint name="q2" type="continuous"><origin xyz="0.4 0 0"/><parent link="upper"/><child link="lower"/>
    <axis xyz="0 -1 0"/></joint>
  <link name="hand"/>
  <joint name="wrist" type="fixed"><origin xyz="0.4 0 0"/><parent link="lower"/><child link="hand"/></joint>
</robot>"#;

impl Arm {
    /// The arm `two-link-arm`, 1.0 and 0.8 kg, 0.4 m each; the payload is 0.4 kg.
    pub(crate) fn two_joints() -> Result<Self> {
        let payload = 0.4;
        Ok(Self {
            name: "2 joints",
            robot: by_name("two-link-arm", &[])?,
            loaded: by_name("two-link-arm", &[("payload", payload)])?,
            payload,
            bodies: RigidBodies::from_urdf(TWO_LINKS)?,
            hand: "hand",
            gains: Gains::uniform(2, 20.0, 5.0),
            forgets: true,
            control: control(&[30.0, 30.0], 2e-3),
            joints: vec![(0, 1.0, 0.0), (1, 1.0, 0.0)],
        })
    }

    /// The arm `iiwa7`; the payload is 2 kg in its hand.
    pub(crate) fn seven_joints() -> Result<Self> {
        let payload = 2.0;
        let arm = RigidBodies::from_urdf(example("iiwa7").unwrap_or_default())?;
        let home = [0.0, 0.5, 0.0, -1.2, 0.0, 0.9, 0.0];
        // Every other joint follows the second joint of the letter, about its own middle.
        let joint = |i: usize| {
            let (source, middle) = [(0, -0.3), (1, 1.7)][i % 2];
            let factor = if i % 3 == 2 { -0.6 } else { 0.6 };
            (source, factor, home[i] - factor * middle)
        };
        Ok(Self {
            name: "7 joints",
            loaded: Box::new(
                arm.clone()
                    .with_payload("link_7", payload, [0.0, 0.0, 0.08])?,
            ),
            robot: Box::new(arm.clone()),
            bodies: arm,
            hand: "link_7",
            payload,
            forgets: false,
            // The wrist is light: a larger damping would not be stable at 500 Hz.
            gains: Gains {
                kp: vec![60.0, 60.0, 40.0, 40.0, 15.0, 8.0, 2.0],
                kd: vec![6.0, 6.0, 4.0, 4.0, 0.8, 0.4, 0.1],
            },
            control: control(&[176.0, 176.0, 110.0, 110.0, 110.0, 40.0, 40.0], 3e-4),
            joints: (0..7).map(joint).collect(),
        })
    }

    /// What this arm does for a letter of two joints.
    pub(crate) fn write(&self, letter: &Trajectory) -> Trajectory {
        let carry = |x: &[f64], moved: bool| {
            let of = |row: &[f64]| -> Vec<f64> {
                let joint = |&(source, factor, added): &(usize, f64, f64)| {
                    factor * row[source] + if moved { added } else { 0.0 }
                };
                self.joints.iter().map(joint).collect()
            };
            x.chunks_exact(2).flat_map(of).collect()
        };
        let signals = Signals {
            q: carry(&letter.q, true),
            qd: carry(&letter.qd, false),
            qdd: carry(&letter.qdd, false),
            ..Signals::default()
        };
        Trajectory::new(letter.name.clone(), letter.t.clone(), signals)
    }
}

fn control(limit: &[f64], drive_noise: f64) -> LoopConfig {
    LoopConfig {
        limit: limit.to_vec(),
        sensors: Sensors {
            quantisation: ENCODER,
            velocity_noise: VELOCITY_NOISE,
            velocity: VelocitySource::Measured,
            ..Sensors::default()
        },
        drive_noise,
        substeps: 2,
        ..LoopConfig::default()
    }
}

/// Seconds from the change until the errors of windows stay within `factor` times `usual`, counted to the start of the
/// first window from which on they do; `None` if they never do.
pub(crate) fn recovery(after: &[f64], usual: f64, factor: f64) -> Option<f64> {
    let fits = |error: &f64| *error <= factor * usual;
    let above = after.iter().rposition(|error| !fits(error));
    let first = above.map_or(0, |last| last + 1);
    (first < after.len()).then_some(STRIDE * first as f64)
}

/// Who gives the torque of the feed-forward.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Condition {
    /// Nobody: low-gain feedback alone.
    Pd,
    /// A plain network (q, q̇, q̈) → τ, learned online.
    Plain,
    /// A deep Lagrangian network, learned online.
    Learned,
    /// The true model; it knows of no payload.
    Perfect,
    /// The true model with the payload, for a robot that has it from the start: what a model can reach after the change.
    PerfectLoaded,
    /// The true model without the payload, which is estimated.
    Estimated,
    /// A robot identified from a log of the empty arm, and the payload estimated.
    Identified,
    /// A chain learned from a log of the empty arm, and the payload estimated.
    Chain,
    /// A deep Lagrangian network, learned online, and the payload estimated.
    LearnedEstimated,
}

impl Condition {
    /// Whether a model is learned while the arm moves.
    pub(crate) fn learns(self) -> bool {
        matches!(self, Self::Plain | Self::Learned | Self::LearnedEstimated)
    }

    /// Whether it can come to know a payload.
    pub(crate) fn recovers(self) -> bool {
        !matches!(self, Self::Pd | Self::Perfect)
    }
}

/// What came of one run.
pub(crate) struct Outcome {
    /// Root mean square error of each letter, rad.
    pub(crate) errors: Vec<f64>,
    /// Middle of each window of [`WINDOW`] after the change, s from it, and the error there.
    pub(crate) after: (Vec<f64>, Vec<f64>),
    /// The load that was carried in the end, where one is estimated.
    pub(crate) load: Option<LoadParameters>,
    /// What the learner did.
    pub(crate) record: Option<Record>,
    /// Times of the controller, s.
    pub(crate) latency: Quantiles,
    /// Their histogram.
    pub(crate) histogram: Vec<LatencyBin>,
    /// The motion.
    pub(crate) motion: Trajectory,
    /// Whether it went on to the end.
    pub(crate) finished: bool,
}

/// Units of a hidden layer of a network that is learned online; there are two.
const WIDTH: usize = 24;
/// Training steps, and hand-overs, in a second of motion.
const STEPS: f64 = 100.0;
const HAND_OVERS: f64 = 20.0;

/// How learning and motion share time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Clock {
    /// In lock step, so that a run can be repeated.
    LockStep,
    /// On a thread of its own while the motion runs in real time.
    RealTime,
}

/// One run of an arm.
pub(crate) struct Run {
    pub(crate) condition: Condition,
    /// When the payload comes, s.
    pub(crate) change: Option<f64>,
    pub(crate) clock: Clock,
    pub(crate) seed: u64,
}

impl Run {
    /// The arm writes.
    pub(crate) fn outcome(&self, arm: &Arm, writing: &Writing) -> Result<Outcome> {
        let aware = self.condition == Condition::PerfectLoaded;
        let identified = self.identified(arm, writing)?;
        let robot = if aware { &arm.loaded } else { &arm.robot };
        let config = TrackingConfig {
            robot: &**robot,
            change: self.change.filter(|_| !aware).map(|at| RobotChange {
                at,
                robot: &*arm.loaded,
            }),
            gains: arm.gains.clone(),
            payload: self.payload(arm, writing, identified.as_ref()),
            control: LoopConfig {
                seed: self.seed,
                ..arm.control.clone()
            },
        };
        let feed = match self.condition {
            Condition::Pd => FeedForwardSource::None,
            Condition::Perfect | Condition::PerfectLoaded | Condition::Estimated => {
                FeedForwardSource::Model(&**robot)
            }
            Condition::Plain => self.learned(arm, families::mlp(WIDTH))?,
            Condition::Learned | Condition::LearnedEstimated => {
                self.learned(arm, families::delan(WIDTH))?
            }
            Condition::Identified | Condition::Chain => match &identified {
                Some(model) => FeedForwardSource::Model(model),
                None => FeedForwardSource::None,
            },
        };
        let tracked = track(&config, &writing.reference, feed)?;
        let motion = tracked.driven.trajectory;
        let after = self.change.map(|change| {
            let (t, errors) = writing.errors_over_time(&motion, change);
            (t.iter().map(|t| t - change).collect(), errors)
        });
        Ok(Outcome {
            errors: writing.errors(&motion),
            after: after.unwrap_or_default(),
            record: tracked.record,
            load: tracked.load,
            latency: tracked.driven.latency.quantiles(),
            histogram: tracked.driven.latency.bins(),
            finished: !tracked.driven.outcome.is_diverged(),
            motion,
        })
    }

    /// Where the payload is estimated, if it is.
    fn payload<'a>(
        &self,
        arm: &'a Arm,
        writing: &Writing,
        identified: Option<&'a Learned>,
    ) -> Option<PayloadSource<'a>> {
        let learned = || identified?.downcast_ref::<IdentifiedRobot>();
        let of = |bodies: &'a RigidBodies, link: &'a str, from: f64| PayloadSource {
            bodies,
            link,
            from,
            config: PayloadConfig::default(),
            absorbed: false,
        };
        match self.condition {
            Condition::Estimated | Condition::Identified => Some(of(&arm.bodies, arm.hand, 0.0)),
            Condition::LearnedEstimated => {
                let known = writing.letters.len().saturating_sub(3);
                Some(of(&arm.bodies, arm.hand, writing.letters[known].from))
            }
            Condition::Chain => {
                let chain = &learned()?.motion().lagrangian;
                Some(of(chain, chain.tip(), 0.0))
            }
            _ => None,
        }
    }

    /// A model of the empty arm from a log: it writes the letters before the payload with feedback alone.
    fn identified(&self, arm: &Arm, writing: &Writing) -> Result<Option<Learned>> {
        let family: Box<dyn Family> = match self.condition {
            Condition::Identified => Box::new(RigidConfig {
                robot: Some(arm.bodies.config()),
                ..RigidConfig::default()
            }),
            Condition::Chain => Box::new(ChainConfig::default()),
            _ => return Ok(None),
        };
        let config = TrackingConfig {
            robot: &*arm.robot,
            change: None,
            gains: arm.gains.clone(),
            payload: None,
            control: LoopConfig {
                seed: self.seed + 1000,
                ..arm.control.clone()
            },
        };
        let log = track(&config, &writing.reference, FeedForwardSource::None)?;
        let dataset = dataset(arm, &log.driven.measured)?;
        let config = FitConfig {
            family,
            training: TrainingTask {
                loss: Loss::TORQUE,
                seed: self.seed,
                ..TrainingTask::default()
            },
        };
        Ok(Some(fit(&dataset, &config, None, &mut ())?.model))
    }

    /// A model of this family that is learned while the arm moves.
    fn learned<'a>(&self, arm: &Arm, family: Box<dyn Family>) -> Result<FeedForwardSource<'a>> {
        let usual = OnlineConfig::default();
        let online = OnlineConfig {
            family,
            seed: self.seed,
            change: ChangeConfig {
                factor: if arm.forgets {
                    usual.change.factor
                } else {
                    f64::MAX
                },
                ..usual.change
            },
            ..usual
        };
        let coordinates = arm.robot.coordinates().clone();
        let learner = Box::new(OnlineLearner::new(coordinates, online)?);
        Ok(match self.clock {
            Clock::RealTime => FeedForwardSource::Thread(learner),
            Clock::LockStep => FeedForwardSource::LockStep {
                learner,
                steps: STEPS,
                hand_overs: HAND_OVERS,
            },
        })
    }
}

/// Samples of a log: every fifth tick, the last fifth of the time held back.
fn dataset(arm: &Arm, log: &Trajectory) -> Result<Dataset> {
    let n = log.dof();
    let mut differentiator = Differentiator::new(n, LOG_WINDOW)?;
    let mut samples = [
        Samples {
            n,
            ..Samples::default()
        },
        Samples {
            n,
            ..Samples::default()
        },
    ];
    for k in 0..log.len() {
        let row = [
            &log.t[k..=k],
            log.row(k).q,
            log.row(k).qd,
            &log.tau[k * n..][..n],
        ]
        .concat();
        let Some(sample) = differentiator.push(&row).filter(|_| k % LOG_EVERY == 0) else {
            continue;
        };
        let into = &mut samples[usize::from(5 * k > 4 * log.len())];
        into.q.extend(sample.q);
        into.qd.extend(sample.qd);
        into.qdd.extend(sample.qdd);
        into.tau.extend(sample.tau);
    }
    let [train, held] = samples;
    Dataset::from_samples(arm.robot.coordinates().clone(), train, held)
}

/// The window over which the accelerations of a log are estimated, and the ticks from sample to sample.
const LOG_WINDOW: usize = 40;
const LOG_EVERY: usize = 5;
