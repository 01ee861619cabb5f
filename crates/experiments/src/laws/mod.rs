//! Laws, momenta and constraints that are found in positions alone, beside what is true of each system, and beside a sparse regression.

mod systems;

use std::io::Write;
use std::process::{Command, Stdio};
use std::time::Instant;

use anyhow::Result;
use lagrangian::constraints::find_in;
use lagrangian::models::Parameter;
use lagrangian::{FitSpec, Model, Recording};
use lagrangian_report::{Role, Table};
use lagrangian_run::{Data, PreparedFit};
use serde::{Deserialize, Serialize};
use serde_json::json;

use crate::data::TEST_SEED;
use crate::driver::cases::Case;
use crate::driver::measure::{MOST, acceleration_errors};
use crate::driver::none_named;
use crate::driver::systems::{Truth, all};
use crate::harness::spread::{scientific, upper_median};
use crate::harness::{Experiment, Lab, less, more, neither};
use systems::{FREE_POINTS, terms};

pub(crate) const EXPERIMENT: Experiment = Experiment {
    name: "laws",
    about: "laws, momenta and constraints in positions alone, beside the truth and PySINDy",
    run,
    title: "Laws that positions tell",
    text: &[
        "Twelve motions of a known system, positions alone, with white noise in parts of their deviations, are searched for a formula, as by `lagrangian \
         formula`; for cyclic coordinates, as by `--cyclic find`; and, where the coordinates are those of free points, for constraints, of which there is \
         none. A law is right where it has the terms of the true one and no others, and its accelerations are the true ones, far beyond the recorded \
         motions too; another form has another number of terms and right accelerations. A law of a system that has none of these terms is wrong, unless its \
         accelerations are right as well.",
        "PySINDy (Kaptanoglu et al. 2022) gets the same positions: velocities and accelerations by its smoothed differences, polynomials of velocities, \
         lines, sines and cosines, and of sixteen settings the one that is nearest to the truth. It runs where `python3`, or the interpreter that PYTHON \
         names, has the package. xL-SINDy (Purnomo, Hayashibe 2023, as the package py-xl-sindy) gets the same derivatives: products of two velocities and of \
         two functions of places at most, and friction; of six settings the one that is nearest to the truth. Its terms of more than two coordinates take hours.",
        "Systems stand in two halves by name, as in the experiment driver; both were seen while the search was built.",
    ],
    parts: Some("a part of the name of a case"),
    quantities: &[
        neither("within", "systems with a law", ""),
        more("right", "law found", ""),
        neither("form", "in another form", ""),
        neither("beyond", "systems without", ""),
        less("wrong", "wrong laws", ""),
        less("error", "error of q̈, median", ""),
        less("away", "of faster motions", ""),
        less("sindy", "PySINDy", ""),
        less("xlsindy", "xL-SINDy", ""),
        more("momenta", "cyclic coordinates found", "%"),
        less("false_momenta", "sets with a false one", ""),
        neither("unjoined", "sets of free points", ""),
        less("joined", "with a constraint", ""),
        less("seconds", "time, median", "s"),
        less("longest", "worst", "s"),
    ],
    about_quantities: "Errors are mean squares of accelerations in parts of their variances, medians over the systems with a law.",
    ..Experiment::EMPTY
};

/// Measured cases, a line each, so that a run that was cut goes on.
const KEPT: &str = "cases.jsonl";
/// Noise in parts of the deviation of each position.
const NOISES: [f64; 3] = [0.0, 1e-3, 1e-2];
const MOTIONS: usize = 12;
/// Motions that judge, and every so many of their samples.
const NEW: usize = 8;
const EVERY: usize = 5;
/// Accelerations are right where their error is below this multiple of the noise, and of what integration errs by.
const RIGHT: f64 = 10.0;
const EXACT: f64 = 1e-5;
/// Systems of a quick run.
const QUICK: usize = 4;

/// What was found in the positions of one system with one noise.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct Record {
    name: String,
    system: String,
    half: String,
    noise: f64,
    /// Terms of the law, where there is one of these functions.
    terms: Option<usize>,
    verdict: String,
    found: usize,
    text: String,
    /// Mean squared errors of accelerations in parts of their variances: on motions of the same kind, and on faster ones.
    errors: [f64; 2],
    seconds: f64,
    /// Coordinates that are cyclic, that were found, and that were found and are not.
    cyclic: [usize; 3],
    /// Constraints that were found among free points.
    constraints: Option<Vec<String>>,
    sindy: Option<Peer>,
    #[serde(default)]
    xlsindy: Option<Peer>,
}

/// The best of a peer.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct Peer {
    error: Option<f64>,
    #[serde(default)]
    terms: usize,
}

/// True states and accelerations, `[m, n]`.
struct States {
    n: usize,
    q: Vec<f64>,
    qd: Vec<f64>,
    qdd: Vec<f64>,
}

fn run(lab: &mut Lab) -> Result<()> {
    let mut records: Vec<Record> = Vec::new();
    let chosen = chosen(lab)?;
    lab.plan(chosen.len());
    for case in &chosen {
        lab.begin(case.name())?;
        let name = format!("{}, seed {}", case.name(), lab.args.seed);
        let own = |own: &Record| own.name == name;
        records.push(lab.remembered(KEPT, own, |lab| measured(lab, case, &name))?);
    }
    for half in ["first", "second"] {
        for noise in NOISES {
            let of = |own: &&Record| own.half == half && own.noise.to_bits() == noise.to_bits();
            let own: Vec<&Record> = records.iter().filter(of).collect();
            if !own.is_empty() {
                summarise(lab, (half, noise), &own);
            }
        }
    }
    list(lab, &records)
}

/// The cases that are asked for.
fn chosen(lab: &Lab) -> Result<Vec<Case>> {
    let (half, only) = (lab.args.half.as_deref(), lab.args.only.as_deref());
    let mut systems = all();
    systems.retain(|own| own.is_free() && half.is_none_or(|half| own.half() == half));
    if lab.quick() {
        systems.retain(|own| terms(&own.name()).is_some_and(|count| count < 5));
        systems.truncate(QUICK);
    }
    let noises = match lab.quick() {
        true => &NOISES[1..2],
        false => &NOISES[..],
    };
    let cases = systems.iter().flat_map(|system| {
        let case = |noise: &f64| Case::of_positions(*system, *noise, MOTIONS, lab.args.seed);
        noises.iter().map(case)
    });
    let is_asked = |case: &Case| only.is_none_or(|part| case.name().contains(part));
    let chosen: Vec<Case> = cases.filter(is_asked).collect();
    match chosen.is_empty() {
        true => Err(none_named()),
        false => Ok(chosen),
    }
}

fn measured(lab: &mut Lab, case: &Case, name: &str) -> Result<Record> {
    let system = case.system;
    let truth = system.build()?;
    let recordings = case.files(&truth)?.training;
    let states = |driven| States::of(&truth, driven, case.seed() + TEST_SEED);
    let (usual, faster) = (states(false)?, states(true)?);
    let clock = Instant::now();
    let data = Data {
        training: recordings.clone(),
        ..Data::default()
    };
    let mut spec = FitSpec::of("formula");
    spec.prepare.cyclic = vec!["find".into()];
    let prepared = PreparedFit::new(spec, data);
    let cyclic = prepared
        .as_ref()
        .map_or(Vec::new(), |own| own.prepared.dataset.cyclic.clone());
    let fitted = prepared.and_then(|ready| ready.fit(None, &mut lab.progress));
    let seconds = clock.elapsed().as_secs_f64();
    lab.progress.check()?;
    let mut record = Record {
        name: name.into(),
        system: system.name(),
        half: system.half().into(),
        noise: case.noise,
        terms: terms(&system.name()),
        verdict: "none".into(),
        found: 0,
        text: String::new(),
        errors: [MOST; 2],
        seconds,
        cyclic: judged(&truth, &usual, &cyclic),
        constraints: None,
        sindy: None,
        xlsindy: None,
    };
    match fitted {
        Err(error) => record.text = error.to_string(),
        Ok(fitted) => {
            let model = fitted.selection.fit.model;
            let written = model.written();
            let parameters = model.parameters();
            // At which speed dry friction sets in is no term of its own.
            let is_term = |own: &&Parameter| own.value != 0.0 && !own.name.contains("_speed_");
            record.found = parameters.iter().filter(is_term).count();
            record.errors = [&usual, &faster].map(|states| states.error(&model));
            record.verdict = written
                .as_ref()
                .map_or_else(String::new, |own| own.verdict.clone());
            record.text = written.map_or_else(String::new, |own| own.text);
        }
    }
    if FREE_POINTS.contains(&&*system.name()) {
        let found = find_in(&recordings, None)?.found;
        record.constraints = Some(found.into_iter().map(|own| own.constraint.name).collect());
    }
    record.sindy = peer(include_str!("sindy.py"), &recordings, &usual)?;
    record.xlsindy = peer(include_str!("xlsindy.py"), &recordings, &usual)?;
    Ok(record)
}

/// How many coordinates are cyclic, how many of these were found, and how many were found that are not. Where energy is lost, no momentum
/// of an unforced coordinate need be kept, and none is asked for.
fn judged(truth: &Truth, states: &States, found: &[usize]) -> [usize; 3] {
    let mut cyclic = Vec::new();
    for i in 0..states.n {
        let mut changes = 0.0_f64;
        for s in (0..states.q.len() / states.n).step_by(23) {
            let row = s * states.n..(s + 1) * states.n;
            let (mut q, qd) = (states.q[row.clone()].to_vec(), &states.qd[row.clone()]);
            let before = &states.qdd[row];
            q[i] += 0.7;
            let after = truth.accelerations(&q, qd);
            let change = before.iter().zip(&after).map(|(a, b)| (a - b).abs());
            changes = changes.max(change.fold(0.0, f64::max));
        }
        if changes < 1e-9 {
            cyclic.push(i);
        }
    }
    let wrong = found.iter().filter(|i| !cyclic.contains(i)).count();
    let asked = if truth.loses() { 0 } else { cyclic.len() };
    [asked, (found.len() - wrong).min(asked), wrong]
}

impl States {
    /// States of new motions, free or driven, with the accelerations that the system has there when nothing drives it.
    fn of(truth: &Truth, driven: bool, seed: u64) -> Result<Self> {
        let n = truth.model.coordinates().dof();
        let mut all = Self {
            n,
            q: Vec::new(),
            qd: Vec::new(),
            qdd: Vec::new(),
        };
        for motion in truth.motions(NEW, driven, seed)? {
            for k in (0..motion.shown.len()).step_by(EVERY) {
                let row = motion.shown.row(k);
                all.q.extend(row.q);
                all.qd.extend(row.qd);
                all.qdd.extend(truth.accelerations(row.q, row.qd));
            }
        }
        Ok(all)
    }

    /// The mean over the coordinates of the squared error of a model's accelerations in parts of their variance.
    fn error(&self, model: &dyn Model) -> f64 {
        let mut found = vec![f64::NAN; self.qdd.len()];
        let still = vec![0.0; self.q.len()];
        let _ = model
            .evaluator()
            .forward_dynamics(&self.q, &self.qd, &still, &mut found);
        let each = acceleration_errors(&found, &self.qdd, self.n);
        each.iter().sum::<f64>() / self.n as f64
    }

    fn rows(&self, x: &[f64]) -> Vec<Vec<f64>> {
        x.chunks(self.n).map(<[f64]>::to_vec).collect()
    }
}

/// What the peer of a script makes of the same positions; none where it is not installed.
fn peer(script: &str, recordings: &[Recording], states: &States) -> Result<Option<Peer>> {
    let Some(first) = recordings.first() else {
        return Ok(None);
    };
    let motions: Vec<Vec<Vec<f64>>> = recordings
        .iter()
        .map(|own| states.rows(&own.signals.q))
        .collect();
    let case = json!({
        "dt": (first.t[first.t.len() - 1] - first.t[0]) / (first.t.len() - 1) as f64,
        "angles": (0..states.n).map(|i| first.coordinates.is_circle(i)).collect::<Vec<_>>(),
        "motions": motions,
        "q": states.rows(&states.q),
        "qd": states.rows(&states.qd),
        "qdd": states.rows(&states.qdd),
    });
    let python = std::env::var_os("PYTHON").unwrap_or_else(|| "python3".into());
    let mut command = Command::new(python);
    command
        .args(["-c", script])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::null());
    let Ok(mut child) = command.spawn() else {
        return Ok(None);
    };
    if let Some(mut input) = child.stdin.take() {
        // A program that ends without reading says so by its exit status.
        let _ = input.write_all(case.to_string().as_bytes());
    }
    let output = child.wait_with_output()?;
    Ok(output
        .status
        .success()
        .then(|| serde_json::from_slice(&output.stdout))
        .transpose()?)
}

impl Record {
    fn is_law(&self) -> bool {
        self.verdict == "law"
    }

    /// Whether all accelerations are right to the noise.
    fn is_right(&self) -> bool {
        let most = (RIGHT * self.noise + EXACT).powi(2);
        self.errors.iter().all(|error| *error <= most)
    }

    /// What became of it, in a word.
    fn outcome(&self) -> &'static str {
        match (self.is_law(), self.is_right()) {
            (true, true) if self.terms == Some(self.found) => "right",
            (true, true) => "another form",
            (true, false) => "wrong",
            (false, _) => "no law",
        }
    }
}

fn summarise(lab: &mut Lab, (half, noise): (&str, f64), records: &[&Record]) {
    let within = || records.iter().filter(|own| own.terms.is_some());
    let count = |what: &str| within().filter(|own| own.outcome() == what).count() as f64;
    let all = |what: &str| records.iter().filter(|own| own.outcome() == what).count() as f64;
    let [cyclic, found] =
        [0, 1].map(|k| records.iter().map(|own| own.cyclic[k]).sum::<usize>() as f64);
    let free: Vec<usize> = records
        .iter()
        .filter_map(|own| own.constraints.as_ref().map(Vec::len))
        .collect();
    let times = || records.iter().map(|own| own.seconds);
    let median = |values: Vec<f64>| upper_median(values).unwrap_or(f64::NAN);
    let sindy = within().filter_map(|own| own.sindy.as_ref()?.error);
    let xlsindy = within().filter_map(|own| own.xlsindy.as_ref()?.error);
    let values = [
        ("within", within().count() as f64),
        ("right", count("right")),
        ("form", count("another form")),
        ("beyond", (records.len() - within().count()) as f64),
        ("wrong", all("wrong")),
        ("error", median(within().map(|own| own.errors[0]).collect())),
        ("away", median(within().map(|own| own.errors[1]).collect())),
        ("sindy", median(sindy.collect())),
        ("xlsindy", median(xlsindy.collect())),
        ("momenta", 100.0 * found / cyclic),
        (
            "false_momenta",
            records.iter().filter(|own| own.cyclic[2] > 0).count() as f64,
        ),
        ("unjoined", free.len() as f64),
        (
            "joined",
            free.iter().filter(|found| **found > 0).count() as f64,
        ),
        ("seconds", median(times().collect())),
        ("longest", times().fold(0.0, f64::max)),
    ];
    let row = lab.results.row(
        half,
        &format!("noise_{noise}"),
        &format!("{half} half, noise {noise}"),
        Role::Lnn,
    );
    for (key, value) in values {
        row.add(key, value);
    }
}

/// All cases, what is wrong first.
fn list(lab: &mut Lab, records: &[Record]) -> Result<()> {
    let order = ["wrong", "no law", "another form", "right"];
    let mut sorted: Vec<&Record> = records.iter().collect();
    sorted.sort_by_key(|own| {
        (
            own.terms.is_none(),
            order.iter().position(|word| *word == own.outcome()),
        )
    });
    let row = |own: &&Record| {
        let peer = |own: &Option<Peer>| {
            let own = own.as_ref().and_then(|own| Some((own.error?, own.terms)));
            own.map_or(["–".into(), "–".into()], |own| {
                [scientific(own.0), own.1.to_string()]
            })
        };
        let [sindy, terms_of_sindy] = peer(&own.sindy);
        let [xlsindy, terms_of_xlsindy] = peer(&own.xlsindy);
        vec![
            own.system.clone(),
            own.half.clone(),
            own.noise.to_string(),
            own.outcome().into(),
            own.verdict.clone(),
            own.terms.map_or("–".into(), |terms| terms.to_string()),
            own.found.to_string(),
            scientific(own.errors[0]),
            scientific(own.errors[1]),
            sindy,
            terms_of_sindy,
            xlsindy,
            terms_of_xlsindy,
            format!(
                "{} of {}, {} false",
                own.cyclic[1], own.cyclic[0], own.cyclic[2]
            ),
            own.constraints
                .as_ref()
                .map_or("–".into(), |all| all.join("; ")),
            format!("{:.1}", own.seconds),
            own.text.clone(),
        ]
    };
    let header = [
        "system",
        "half",
        "noise",
        "outcome",
        "verdict",
        "terms",
        "found",
        "error of q̈",
        "of faster motions",
        "PySINDy",
        "its terms",
        "xL-SINDy",
        "its terms",
        "cyclic",
        "constraints",
        "s",
        "what was found",
    ];
    let rows = sorted.iter().map(row).collect();
    lab.list(Table::new("Each case, what is wrong first.", &header, rows))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::driver::systems::Named;

    #[test]
    fn each_system_that_is_named_is_one_of_the_table() {
        let known: Vec<String> = all().into_iter().map(Named::name).collect();
        let named = systems::named().chain(FREE_POINTS.iter().copied());
        for name in named {
            assert!(known.iter().any(|own| own == name), "{name}");
        }
    }
}
