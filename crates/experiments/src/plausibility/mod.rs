//! The claims that would falsify the method: which laws of mechanics each family obeys on motions that it has not seen, and
//! how much is left of the advantage of a Lagrangian as a machine breaks what it assumes.

mod contestants;
mod laws;
pub(crate) mod premises;

use anyhow::Result;
use lagrangian::TrainingTask;
use lagrangian::analytic::by_name;
use lagrangian::{Budget, Dataset, FitConfig, Learned, Model, State, Trajectory};
use lagrangian_report::{Axis, Role};

use crate::data::TEST_SEED;
use crate::families::{WIDTH, is_rigid};
use crate::harness::{Contestant, Experiment, Lab, Row, contestant, less, more, neither};
use contestants::{BROKEN, OBEYED, Recipe};
use laws::{Laws, laws};
use premises::{About, Premise, driven, motion_misfit, torque_misfit};

pub(crate) const EXPERIMENT: Experiment = Experiment {
    name: "plausibility",
    about: "laws of mechanics that each family obeys, and what broken premises cost",
    run,
    title: "Plausibility: what would falsify a Lagrangian model",
    text: &[
        "A Lagrangian that is learned obeys the laws because of its form, whatever its weights; a plain network obeys none of \
         them but as far as it has learned them. The form costs what it cannot express: each curve of a broken premise shows \
         from which violation on.",
        "All networks: 2 × 64, natural gradient, batches of 256 samples, squared errors of τ (one plain network: of q̈), from \
         16 recordings of 3 s.",
    ],
    quantities: &[
        less("asymmetry", "M − Mᵀ", ""),
        more("definite", "M ≻ 0", ""),
        neither("least_eigenvalue", "least eigenvalue", ""),
        less("skew", "Ṁ − 2C", ""),
        less("own_power", "power, own E", ""),
        less("true_power", "power, true E", ""),
        less("own_drift", "drift, own E", ""),
        less("true_drift", "drift, true E", ""),
        less("torque_rms", "torque", "N·m"),
        less("ahead_rms", "q after 0.5 s", "rad or m"),
        neither("violation", "violation", "N·m"),
    ],
    about_quantities: "Laws on held-out driven motions. M from inverse dynamics, M⁻¹ for a network of q̈; its least eigenvalue \
                       over the true one. Powers are root mean squares over that of τ·q̇: q̇ᵀ(Ṁ − 2C)q̇ / 2 with the model's \
                       own Coriolis force (the power identity: Christoffel's C would make any M pass), and dE/dt − τ·q̇ with \
                       the model's own and the true energy. Drift: |E(10 s) − E(0)| of free motions over the deviation of E \
                       in the data. Broken premises: root mean square errors on held-out recordings, and the violation that \
                       the amount is: what the exact Lagrangian of the unbroken machine misses of the recorded torque.",
    ..Experiment::EMPTY
};

/// Recordings to learn from, to choose weights by, and to test on.
const TRAIN: usize = 13;
const HELD: usize = 3;
const TEST: usize = 6;
/// The machines whose laws are measured.
const SYSTEMS: [&str; 3] = ["pendulum", "double-pendulum", "arm"];
/// Starts of the free motions.
const STARTS: usize = 8;
/// Length of a short prediction in samples, which is half a second.
const AHEAD: usize = 25;

const TRUTH: Contestant = contestant("truth", "truth", Role::Truth, ());

fn run(lab: &mut Lab) -> Result<()> {
    let amounts: &[usize] = if lab.quick() { &[0, 2] } else { &[0, 1, 2, 3] };
    let trained =
        |all: &[Contestant<Recipe>]| all.iter().filter(|c| !is_rigid(c.config.family)).count();
    let fits =
        trained(&OBEYED) * SYSTEMS.len() + trained(&BROKEN) * amounts.len() * Premise::ALL.len();
    lab.plan(lab.seeds().len() * fits);
    lab.setting("Time of a fit", format!("{} s", seconds(lab)));
    for name in SYSTEMS {
        obeyed(lab, name)?;
    }
    for premise in Premise::ALL {
        let least = premise.recordings(premise.about().amounts[1], TEST, TEST_SEED)?;
        // Where the unbroken machine stands on a logarithmic axis.
        let unbroken = 0.3 * premise.violation(&least);
        for amount in amounts.iter().map(|k| premise.about().amounts[*k]) {
            broken(lab, premise, amount, unbroken)?;
        }
    }
    Ok(())
}

fn seconds(lab: &Lab) -> f64 {
    let usual = if lab.quick() { 0.15 } else { 3.0 };
    lab.args.seconds.unwrap_or(usual)
}

fn begin(lab: &mut Lab, what: &str, who: &Contestant<Recipe>, seed: u64) -> Result<()> {
    let weight = if is_rigid(who.config.family) {
        0.0
    } else {
        1.0
    };
    lab.begin_weighted(format!("{what}, {}, seed {seed}", who.name), weight)
}

/// One fit to recordings, of which the last are held back.
fn fitted(
    lab: &mut Lab,
    who: &Contestant<Recipe>,
    truth: &dyn Model,
    mut recordings: Vec<Trajectory>,
    seed: u64,
) -> Result<Learned> {
    let held = recordings.split_off(TRAIN);
    let data = Dataset::new(truth.coordinates().clone(), &recordings, &held)?;
    let config = FitConfig {
        family: (who.config.family)(WIDTH),
        training: TrainingTask {
            loss: who.config.loss,
            forces: (who.config.forces)(),
            budget: Budget::Seconds(seconds(lab)),
            seed,
            validate_every: 10,
            ..TrainingTask::default()
        },
    };
    Ok(lab.fit(&data, &config)?.model)
}

/// The laws that models of an unbroken machine obey.
fn obeyed(lab: &mut Lab, name: &str) -> Result<()> {
    let truth: Box<dyn Model> = match name {
        "arm" => Premise::Friction.unbroken(),
        name => by_name(name, &[])?,
    };
    let test = driven(&*truth, TEST, TEST_SEED)?;
    let n = truth.coordinates().dof();
    // At rest where other motions begin, so that the energy is one that was seen.
    let others = driven(&*truth, STARTS, TEST_SEED + 1)?;
    let at_rest = |motion: &Trajectory| State::new(motion.q[..n].to_vec(), vec![0.0; n]);
    let starts: Vec<State> = others.iter().map(at_rest).collect();
    let exact = laws(&*truth, &*truth, &test, &starts)?;
    record(lab.row(name, &TRUTH), &exact);
    for who in &OBEYED {
        for seed in lab.seeds() {
            begin(lab, name, who, seed)?;
            let recordings = driven(&*truth, TRAIN + HELD, seed)?;
            let model = fitted(lab, who, &*truth, recordings, seed)?;
            record(lab.row(name, who), &laws(&model, &*truth, &test, &starts)?);
        }
    }
    Ok(())
}

fn record(row: &mut Row, laws: &Laws) {
    row.add("asymmetry", laws.asymmetry)
        .add("definite", laws.definite)
        .add("least_eigenvalue", laws.least_eigenvalue)
        .add("skew", laws.skew)
        .add("own_power", laws.own_power)
        .add("true_power", laws.true_power)
        .add("own_drift", laws.own_drift)
        .add("true_drift", laws.true_drift)
        .add("unfinished", laws.unfinished as f64);
}

/// Errors of models of a machine that breaks a premise; the same recordings for every family.
fn broken(lab: &mut Lab, premise: Premise, amount: f64, unbroken: f64) -> Result<()> {
    let About { name, unit, .. } = premise.about();
    let group = format!("{name} {amount} {unit}");
    let group = group.trim_end();
    let test = premise.recordings(amount, TEST, TEST_SEED)?;
    let violation = premise.violation(&test);
    lab.row(group, &TRUTH)
        .add("violation", violation)
        .add("torque_rms", violation);
    let is_broken = violation > 1e-6;
    let place = if is_broken { violation } else { unbroken };
    if is_broken {
        let name = "exact Lagrangian of the unbroken machine";
        draw(lab, premise, name, Role::Truth, (place, violation));
    }
    // The body on a blade is no chain of links.
    let applies =
        |who: &&Contestant<Recipe>| !(is_rigid(who.config.family) && premise == Premise::Rolling);
    for seed in lab.seeds() {
        let recordings = premise.recordings(amount, TRAIN + HELD, seed)?;
        for who in BROKEN.iter().filter(applies) {
            begin(lab, group, who, seed)?;
            let model = fitted(lab, who, &*premise.unbroken(), recordings.clone(), seed)?;
            let torque = torque_misfit(&model, &test).unwrap_or(f64::NAN);
            let ahead = motion_misfit(&model, &test, AHEAD)?;
            lab.row(group, who)
                .add("torque_rms", torque)
                .add("ahead_rms", ahead);
            draw(lab, premise, who.name, who.role, (place, torque));
        }
    }
    Ok(())
}

/// The torque error over the violation.
fn draw(lab: &mut Lab, premise: Premise, name: &str, role: Role, (violation, error): (f64, f64)) {
    let caption = "Torque error on held-out recordings over how much the machine breaks the premise, a dot for each \
                       seed. The leftmost dots are the unbroken machine, whose place on a logarithmic axis is no \
                       value.";
    lab.plot(
        format!("premise-{}", premise.about().name),
        format!("Broken premise: {}", premise.about().name),
    )
    .caption(caption)
    .x(Axis::log("violation", "N·m"))
    .y(Axis::log("torque error, RMS", "N·m"))
    .dot(name, role, violation, error);
}
