//! Ensembles on two real machines: how much of new motions lies in their bands.

use anyhow::Result;
use lagrangian::FitSpec;
use lagrangian::ensemble::fit_ensemble;
use lagrangian::{Coordinates, Dataset, Estimate, FitConfig, Trajectory, split};
use serde_json::{Value, json};

use crate::harness::{Contestant, Experiment, Lab, contestants, less, neither};
use crate::{real, robots};

pub(crate) const EXPERIMENT: Experiment = Experiment {
    name: "ensembles",
    about: "bands of torque on the held-out logs of a UR10 and a double pendulum",
    run,
    title: "Ensembles and what they do not know",
    text: &[
        "Eight members, each on blocks of time that were drawn with replacement from the logs; their errors on the blocks that they \
         have not seen calibrate bands, which are then compared with motions that no member and no calibration has seen.",
        "The UR10 is learned from the first 70 % of its log and measured on the rest; the double pendulum is learned from logs 00 to 03 \
         and measured on 05, and on the swing-up 12, which goes where no log has been.",
    ],
    quantities: &[
        neither("covered_50", "torques in the band of 50 %", "%"),
        neither("covered_80", "torques in the band of 80 %", "%"),
        neither("covered_95", "torques in the band of 95 %", "%"),
        neither("least_80", "least joint in the band of 80 %", "%"),
        neither("outside", "states outside of the data", "%"),
        less("seconds", "time of the fit", "s"),
    ],
    about_quantities: "Mean over the joints, of samples after the same low-pass of 5 Hz.",
    ..Experiment::EMPTY
};

/// The members of an ensemble.
const MEMBERS: usize = 8;
/// The part of a log that validates.
const VALIDATION: f64 = 0.2;

/// The family that is fitted, and its settings.
struct Recipe {
    family: &'static str,
    settings: fn() -> Value,
}

const CONTESTANTS: &[Contestant<Recipe>] = &contestants! {
    "chain", "chain", Lnn, Recipe { family: "chain", settings: || json!({}) };
    "delan", "deep Lagrangian network", Baseline, Recipe {
        family: "delan",
        settings: || json!({ "forces": ["viscous", "coulomb", "offset"] }),
    };
};

/// A machine: what is learned from, and the motions that it is measured on.
struct Machine {
    dataset: Dataset,
    estimates: Vec<Estimate>,
    tests: Vec<(String, Trajectory)>,
}

fn run(lab: &mut Lab) -> Result<()> {
    let machines = [ur10(lab)?, double_pendulum(lab)?];
    lab.plan(machines.len() * CONTESTANTS.len() * lab.seeds().len());
    for machine in &machines {
        for who in CONTESTANTS {
            for seed in lab.seeds() {
                let (first, _) = &machine.tests[0];
                lab.begin(format!("{first}, {}, seed {seed}", who.name))?;
                compete(lab, machine, who, seed)?;
            }
        }
    }
    Ok(())
}

fn ur10(lab: &Lab) -> Result<Machine> {
    let log = robots::read(lab, "ur10")?;
    let coordinates = Coordinates::angles(log.learned.dof());
    let (train, validation) = split(vec![log.learned], VALIDATION, 0)?;
    Ok(Machine {
        dataset: Dataset::new(coordinates, &train, &validation)?,
        estimates: log.estimates,
        tests: vec![("ur10".into(), log.rest)],
    })
}

fn double_pendulum(lab: &Lab) -> Result<Machine> {
    let recordings = real::double_pendulum(lab)?;
    let named = |test: Trajectory| (format!("double_pendulum, {}", test.name), test);
    Ok(Machine {
        dataset: recordings.dataset,
        estimates: Vec::new(),
        tests: recordings.test.into_iter().map(named).collect(),
    })
}

fn compete(lab: &mut Lab, machine: &Machine, who: &Contestant<Recipe>, seed: u64) -> Result<()> {
    let Recipe { family, settings } = &who.config;
    let mut request = FitSpec {
        seed,
        seconds: Some(if lab.quick() { 2.0 } else { 20.0 }),
        ..FitSpec::of(family)
    };
    request.settings = settings().as_object().cloned().unwrap_or_default();
    request.training.insert("loss".into(), json!("torque"));
    let config = FitConfig::for_data(&machine.dataset, &machine.estimates, &request)?.config;
    let clock = std::time::Instant::now();
    let ensemble =
        lab.watched(|observer| fit_ensemble(&machine.dataset, &config, MEMBERS, observer))?;
    let seconds = clock.elapsed().as_secs_f64();
    for (name, test) in &machine.tests {
        let coverage = ensemble.coverage(std::slice::from_ref(test));
        let outside =
            lagrangian::score::outside(&ensemble.members()[0], std::slice::from_ref(test));
        let torque = coverage.torque;
        let all = |k: usize| torque.as_ref().map(|t| 100.0 * t.all[k]);
        let eighty = torque.as_ref().map(|t| &t.each[1]);
        let least = eighty.map(|joints| 100.0 * joints.iter().copied().fold(1.0, f64::min));
        let row = lab.row(name, who);
        row.add("covered_50", all(0))
            .add("covered_80", all(1))
            .add("covered_95", all(2))
            .add("least_80", least)
            .add("outside", outside.map(|o| 100.0 * o.share))
            .add("seconds", Some(seconds));
    }
    Ok(())
}
