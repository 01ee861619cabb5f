//! A real servo under its own position control, learned without torque: motions and gains that it has not been fitted to.

use std::io::Cursor;

use anyhow::Result;
use lagrangian::models::{Friction, Servo, ServoConfig};
use lagrangian::score::predict;
use lagrangian::{
    Coordinates, Dataset, EstimateOptions, FitConfig, Format, Layout, RolloutOptions, Trajectory,
};

use crate::harness::failure::{Context, mistake};
use crate::harness::{Contestant, Experiment, Lab, contestants, less, neither};

pub(crate) const EXPERIMENT: Experiment = Experiment {
    name: "servo",
    about: "a real servo without torque: its position by the goal alone, for new motions and gains",
    run,
    title: "A position-controlled servo from logs without torque",
    text: &[
        "A servo (XL330) swings a mass under its own position control: 4 motions of 6 s, each at 4 gains kp. Its input is the goal, \
         there is no torque; in one motion the motor is switched off on the way. Simulated once from the first sample, by the goal \
         alone.",
        "New motion: fitted to sin_sin, lift_and_drop and up_and_down at all gains, tested on sin_time_square at all gains. New gain: \
         fitted to kp 100, 200 and 800, tested on kp 400.",
        "Friction m1 to m6 are the models of Duclusaud et al. 2025 (arXiv 2410.08650); errors of 69 to 82 mrad are published. Chosen: \
         the terms of friction and the length of \
         the simulations that are fitted, by the error on motions that are held out of the training ones.",
        "Data: Rhoban/bam (Apache-2.0).",
    ],
    quantities: &[
        less("test", "test, mean absolute error", "mrad"),
        less("train", "training", "mrad"),
        neither("seconds", "time of the fit", "s"),
    ],
    about_quantities: "Mean absolute error of the simulated position over 6 s, mean over the recordings.",
    ..Experiment::EMPTY
};

const MOTIONS: [&str; 4] = ["lift_and_drop", "sin_sin", "sin_time_square", "up_and_down"];
const GAINS: [u32; 4] = [100, 200, 400, 800];

/// A division of the recordings.
struct Protocol {
    name: &'static str,
    is_test: fn(motion: &str, gain: u32) -> bool,
}

const PROTOCOLS: [Protocol; 2] = [
    Protocol {
        name: "new motion",
        is_test: |motion, _| motion == "sin_time_square",
    },
    Protocol {
        name: "new gain",
        is_test: |_, gain| gain == 400,
    },
];

const CONTESTANTS: &[Contestant<Option<Friction>>] = &contestants! {
    "chosen", "chosen by held-out motions", Lnn, None;
    "m1", "Coulomb and viscous (m1)", Baseline, Some(Friction::M1);
    "m2", "Stribeck (m2)", Other(1), Some(Friction::M2);
    "m3", "by the load (m3)", Other(2), Some(Friction::M3);
    "m4", "by the load, Stribeck (m4)", Other(3), Some(Friction::M4);
    "m5", "directional (m5)", Other(4), Some(Friction::M5);
    "m6", "quadratic (m6)", Other(5), Some(Friction::M6);
};

fn run(lab: &mut Lab) -> Result<()> {
    let contestants = if lab.quick() {
        &CONTESTANTS[3..4]
    } else {
        CONTESTANTS
    };
    lab.plan(PROTOCOLS.len() * contestants.len());
    for protocol in &PROTOCOLS {
        let logs = Logs::read(lab, protocol)?;
        for who in contestants {
            lab.begin(format!("{}, {}", protocol.name, who.name))?;
            compete(lab, &logs, protocol, who)?;
        }
    }
    Ok(())
}

/// The recordings of a protocol.
struct Logs {
    train: Vec<Trajectory>,
    test: Vec<Trajectory>,
}

impl Logs {
    fn read(lab: &Lab, protocol: &Protocol) -> Result<Self> {
        let (mut train, mut test) = (Vec::new(), Vec::new());
        for motion in MOTIONS {
            for gain in GAINS {
                let log = read(lab, &format!("{motion}_kp{gain}"))?;
                match (protocol.is_test)(motion, gain) {
                    true => test.push(log),
                    false => train.push(log),
                }
            }
        }
        Ok(Self { train, test })
    }
}

/// What is known of the columns: the motor is off where the servo's estimate of its load is exactly 0.
const COLUMNS: &str = "
[drive]
goal = 'goal'
kp = 'kp{}'
enabled = 'load'
";

fn read(lab: &Lab, name: &str) -> Result<Trajectory> {
    let file = lab.data(&format!("servo_real/{name}.csv"))?;
    let shown = format!("cannot read '{name}.csv'");
    let hint = "give the reference data with --data";
    let layout = Layout::from_toml(COLUMNS).context(&shown, hint)?;
    let read = Format::Csv.read(Cursor::new(file), name, &layout);
    let recording = read.context(&shown, hint)?.recordings.into_iter().next();
    let recording = recording.ok_or_else(|| mistake(&shown, hint))?;
    let (log, _) = recording
        .into_trajectory(&EstimateOptions::default())
        .context(shown, hint)?;
    Ok(log)
}

fn compete(
    lab: &mut Lab,
    logs: &Logs,
    protocol: &Protocol,
    who: &Contestant<Option<Friction>>,
) -> Result<()> {
    let dataset = Dataset::new(coordinates(), &logs.train, &[])?;
    let family = ServoConfig {
        friction: who.config,
        ..ServoConfig::default()
    };
    let config = FitConfig {
        family: family.into(),
        ..FitConfig::default()
    };
    let fit = lab.fit(&dataset, &config)?;
    let errors = |logs: &[Trajectory]| -> Result<f64> {
        let each = logs.iter().map(|log| error(&fit.model, log));
        Ok(each.collect::<Result<Vec<_>>>()?.iter().sum::<f64>() / logs.len() as f64)
    };
    let (train, test) = (errors(&logs.train)?, errors(&logs.test)?);
    let friction = fit.model.downcast_ref::<Servo>().map(Servo::friction);
    let row = lab.row(protocol.name, who);
    row.detail("friction", friction.map_or("", Friction::name))
        .add("test", Some(1e3 * test))
        .add("train", Some(1e3 * train))
        .add("seconds", Some(fit.seconds));
    Ok(())
}

fn coordinates() -> Coordinates {
    let mut coordinates = Coordinates::angles(1);
    // The servo turns less than once, and its controller knows no circle.
    coordinates.0[0].topology = lagrangian::trajectory::Topology::Line;
    coordinates
}

/// The mean absolute error of the simulated position, rad.
fn error(model: &lagrangian::Learned, log: &Trajectory) -> Result<f64> {
    let predicted = predict(model, log, &RolloutOptions::default())?.trajectory;
    if predicted.len() < log.len() {
        return Ok(f64::INFINITY);
    }
    let errors = log.q.iter().zip(&predicted.q).map(|(x, y)| (x - y).abs());
    Ok(errors.sum::<f64>() / log.q.len() as f64)
}
