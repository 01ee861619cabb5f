//! Two real arms, learned from one exciting motion: with and without a description, forwards and backwards.

use std::io::Cursor;

use anyhow::Result;
use lagrangian::rigid::RobotConfig;
use lagrangian::score::Assessment;
use lagrangian::{
    Coordinates, Dataset, Estimate, EstimateOptions, FitConfig, FitSpec, Format, Layout,
    RolloutOptions, Trajectory, score, split,
};
use serde_json::{Value, json};

use crate::harness::failure::{Context, mistake};
use crate::harness::spread::median;
use crate::harness::{Contestant, Experiment, Lab, contestants, less, neither};

pub(crate) const EXPERIMENT: Experiment = Experiment {
    name: "robots",
    about: "two real arms from one motion each, with and without a URDF",
    run,
    title: "Real robots from their logs",
    text: &[
        "A UR10 (6 joints, 27.5 s) and a Panda (7 joints, 24.2 s), each along one exciting motion: models are fitted to the first \
         70 % of the time and measured on the rest, all signals after the same low-pass of 5 Hz without phase.",
        "A chain finds its joints, bodies and friction from the log alone; rigid bodies know the kinematics of a URDF; both are \
         physically consistent. Of the torque of most joints inertia makes up less than friction leaves unexplained: there no \
         model predicts accelerations, and the error is what the inertia added to the drives leaves of it.",
        "Data: inverse-dynamics-solver (Petrone, Ferrentino, Chiacchio 2025, BSD-3).",
    ],
    quantities: &[
        less("torque_nmse", "torque nMSE", ""),
        less(
            "acceleration_nmse",
            "acceleration nMSE, median of the joints",
            "",
        ),
        neither("condition", "condition number of M, largest", ""),
        neither("smallest", "smallest eigenvalue of M", "kg m²"),
        neither("seconds", "time of the fit", "s"),
    ],
    about_quantities: "On the last 30 % of the time. Errors over the variance of the signal, mean over the joints for torques.",
    ..Experiment::EMPTY
};

/// The low-pass of all signals, Hz.
const LOW_PASS: f64 = 5.0;
/// The part of the time that is learned from, and the samples between it and the rest.
const LEARNED: f64 = 0.7;
const BETWEEN: usize = 10;
/// The part of that which validates.
const VALIDATION: f64 = 0.2;

/// The robots, with the number of joints and the name of each but for its number, where not all joints of the URDF are meant.
const ROBOTS: [(&str, Option<(usize, &str)>); 2] =
    [("ur10", None), ("panda", Some((7, "panda_joint")))];

/// What is asked for.
struct Recipe {
    family: &'static str,
    settings: fn(Option<&RobotConfig>) -> Value,
    /// The weight of accelerations; `None` for the default.
    forward: Option<f64>,
}

const CHAIN: Recipe = Recipe {
    family: "chain",
    settings: |_| json!({}),
    forward: None,
};

const RIGID: Recipe = Recipe {
    family: "rigid",
    settings: |robot| json!({ "dissipation": true, "robot": robot }),
    forward: None,
};

const CONTESTANTS: &[Contestant<Recipe>] = &contestants! {
    "chain", "chain", Lnn, CHAIN;
    "chain_torque", "chain, torques alone", Other(0), Recipe { forward: Some(0.0), ..CHAIN };
    "rigid", "rigid bodies, URDF", Other(1), RIGID;
    "rigid_torque", "rigid bodies, URDF, torques alone", Other(2), Recipe { forward: Some(0.0), ..RIGID };
    "delan", "deep Lagrangian network", Baseline, Recipe {
        family: "delan",
        settings: |_| json!({ "forces": ["viscous", "coulomb", "offset"] }),
        forward: None,
    };
};

fn run(lab: &mut Lab) -> Result<()> {
    lab.plan(ROBOTS.len() * CONTESTANTS.len() * lab.seeds().len());
    for (robot, joints) in ROBOTS {
        let log = read(lab, robot)?;
        let urdf = lab.data(&format!("{robot}_real/{robot}.urdf"))?;
        let urdf = String::from_utf8_lossy(&urdf);
        let joints = joints.map(|(n, name)| (1..=n).map(|j| format!("{name}{j}")).collect());
        let description = RobotConfig::new(&urdf, joints.unwrap_or_default())
            .context("cannot use the URDF", "give the reference data with --data")?;
        for who in CONTESTANTS {
            for seed in lab.seeds() {
                lab.begin(format!("{robot}, {}, seed {seed}", who.name))?;
                compete(lab, &log, &description, who, seed)?;
            }
        }
    }
    Ok(())
}

/// A log, divided by time.
pub(crate) struct Log {
    robot: &'static str,
    pub(crate) learned: Trajectory,
    pub(crate) rest: Trajectory,
    pub(crate) estimates: Vec<Estimate>,
}

/// The log of a robot, from the folder of the reference data.
pub(crate) fn read(lab: &Lab, robot: &'static str) -> Result<Log> {
    let file = lab.data(&format!("{robot}_real/{robot}.csv"))?;
    let (shown, hint) = (
        format!("cannot read '{robot}.csv'"),
        "give the reference data with --data",
    );
    let layout = Layout {
        angles: vec!["all".into()],
        ..Layout::default()
    };
    let read = Format::Csv
        .read(Cursor::new(file), robot, &layout)
        .context(&shown, hint)?;
    let options = EstimateOptions {
        low_pass: Some(LOW_PASS),
        ..EstimateOptions::default()
    };
    let recording = read.recordings.into_iter().next();
    let recording = recording.ok_or_else(|| mistake(&shown, hint))?;
    let (motion, estimates) = recording.into_trajectory(&options).context(shown, hint)?;
    let end = (LEARNED * motion.len() as f64) as usize;
    Ok(Log {
        robot,
        learned: motion.part(0..end),
        rest: motion.after(end + BETWEEN),
        estimates,
    })
}

fn compete(
    lab: &mut Lab,
    log: &Log,
    description: &RobotConfig,
    who: &Contestant<Recipe>,
    seed: u64,
) -> Result<()> {
    let recipe = &who.config;
    let learned = &log.learned;
    let coordinates = Coordinates::angles(learned.dof());
    let (train, validation) = split(vec![learned.clone()], VALIDATION, seed)?;
    let dataset = Dataset::new(coordinates, &train, &validation)?;
    let mut request = FitSpec {
        seed,
        seconds: Some(match lab.quick() {
            true => 3.0,
            false => 30.0,
        }),
        ..FitSpec::of(recipe.family)
    };
    let settings = (recipe.settings)(Some(description));
    request.settings = settings.as_object().cloned().unwrap_or_default();
    // Chains and rigid bodies are solved from torques anyway.
    if recipe.family == "delan" {
        request.training.insert("loss".into(), json!("torque"));
    }
    if let Some(forward) = recipe.forward {
        request.training.insert("forward".into(), json!(forward));
    }
    let config = FitConfig::for_data(&dataset, &log.estimates, &request)?.config;
    let fit = lab.fit(&dataset, &config)?;
    let rest = std::slice::from_ref(&log.rest);
    let options = RolloutOptions {
        rtol: 1e-6,
        atol: 1e-6,
        ..RolloutOptions::default()
    };
    let scored = score(&fit.model, rest, &options)
        .context("cannot measure a fit", "please report this with the data")?;
    let assessment = Assessment::new(&fit.model, rest, &scored);
    let accelerations = scored.acceleration.as_ref().map(|e| median(&e.nmse));
    let lost = assessment.joints.iter().filter(|j| !j.predictable);
    let lost: Vec<&str> = lost.map(|j| j.name.as_str()).collect();
    let row = lab.row(log.robot, who);
    row.detail("not predictable forwards", lost.join(", "))
        .add("torque_nmse", scored.torque.as_ref().map(|e| e.nmse_mean))
        .add("acceleration_nmse", accelerations)
        .add("condition", assessment.inertia.map(|s| s.condition))
        .add("smallest", assessment.inertia.map(|s| s.smallest))
        .add("seconds", Some(fit.seconds));
    Ok(())
}
