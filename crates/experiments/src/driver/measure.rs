//! One case: what the plain command makes of its files, and how far that is from the truth.

use std::time::Instant;

use anyhow::Result;
use lagrangian::fit::fit;
use lagrangian::score::{Assessment, Grade};
use lagrangian::{Dataset, FitConfig, FitSpec, Model, RolloutOptions, rollout};
use lagrangian_run::{Data, PreparedFit};
use serde::{Deserialize, Serialize};
use serde_json::json;

use super::cases::Case;
use super::peers::Sparse;
use super::systems::{Motion, SAMPLES, Truth};
use crate::data::{column, deviation};
use crate::harness::Lab;

/// New motions that judge a model.
const NEW: usize = 12;
/// Samples that are predicted from each start: half a second.
const AHEAD: usize = SAMPLES / 10;
/// The largest error of an acceleration; JSON has no infinity.
pub(crate) const MOST: f64 = 1e9;
/// What a prediction that ends early errs by, in parts of the deviation.
const LOST: f64 = 10.0;

/// All that was measured of a case; a line of the file that keeps it.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Record {
    pub(super) name: String,
    /// The budget, and what else was asked for.
    pub(super) asked: String,
    pub(super) half: String,
    pub(super) flaw: Option<String>,
    pub(super) plain: Plain,
    /// True errors of each fit of the plain command, the one that was kept among them, and of other flags.
    pub(super) others: Vec<(String, Errors)>,
    pub(super) peers: Vec<(String, Errors)>,
}

/// What the plain command said and made.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(super) struct Plain {
    /// `good`, `fair` or `poor`; `refused` where there is no model, `unimproved` where the command calls the fit failed.
    pub(super) verdict: String,
    pub(super) reasons: Vec<String>,
    pub(super) family: String,
    /// What was chosen from the data, and why.
    pub(super) choices: Vec<String>,
    pub(super) seconds: f64,
    /// The error half a second ahead on new motions that is claimed, least and largest, where one is.
    pub(super) claim: Option<[f64; 2]>,
    pub(super) errors: Errors,
}

/// Errors on new motions that nothing has seen.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Errors {
    /// Mean squared error of each acceleration over its variance.
    pub(super) each: Vec<f64>,
    /// Root mean square over the deviations of the positions, half a second and one slowest period ahead.
    pub(super) ahead: [f64; 2],
}

impl Default for Errors {
    fn default() -> Self {
        Self {
            each: vec![MOST],
            ahead: [LOST; 2],
        }
    }
}

impl Errors {
    /// The mean over the coordinates.
    pub(super) fn acceleration(&self) -> f64 {
        let mean = self.each.iter().sum::<f64>() / self.each.len() as f64;
        if mean.is_finite() { mean.min(1e9) } else { 1e9 }
    }
}

/// The claim of an assessment, where it makes one.
fn claim(assessment: &Assessment) -> Option<[f64; 2]> {
    Some(assessment.forecast.as_ref()?.range)
}

/// Runs the plain command on a case, and its peers.
pub(super) fn measured(lab: &mut Lab, case: &Case, asked: String) -> Result<Record> {
    let truth = case.system.build()?;
    let files = case.files(&truth)?;
    let new = New::of(&truth, case)?;
    let spec = spec(lab);
    let clock = Instant::now();
    let data = Data {
        training: files.training,
        validation: files.validation,
        ..Data::default()
    };
    let prepared = PreparedFit::new(spec.clone(), data);
    let dataset = prepared
        .as_ref()
        .ok()
        .map(|ready| ready.prepared.dataset.clone());
    let (mut plain, mut others, mut peers) = (Plain::default(), Vec::new(), Vec::new());
    let kept = prepared.and_then(|ready| {
        let finished = ready.fit(None, &mut lab.progress)?;
        let report = finished.ended(None);
        let assessed = report.assessed(None, &RolloutOptions::for_comparison())?;
        Ok((report, assessed.1))
    });
    plain.seconds = clock.elapsed().as_secs_f64();
    lab.progress.check()?;
    match kept {
        Err(error) => {
            plain.verdict = "refused".into();
            plain.reasons = vec![error.to_string()];
        }
        Ok((report, assessment)) => {
            plain.verdict = match (report.improved, assessment.verdict) {
                (false, _) => "unimproved",
                (_, Grade::Good) => "good",
                (_, Grade::Fair) => "fair",
                (_, Grade::Poor) => "poor",
            }
            .into();
            plain.reasons = assessment
                .reasons
                .iter()
                .map(|r| r.finding.clone())
                .collect();
            plain.family = report.config.family.name().into();
            plain.choices = report
                .choices
                .iter()
                .map(|c| format!("{} {}: {}", c.setting, c.value, c.reason))
                .collect();
            plain.claim = claim(&assessment);
            if case.flaw.is_none() {
                plain.errors = new.errors(&report.fit.model);
            }
        }
    }
    if let Some(dataset) = dataset.filter(|_| case.flaw.is_none()) {
        let sparse = Sparse::fitted(&dataset);
        peers.push((
            "sparse regression".into(),
            Errors {
                ahead: [LOST; 2],
                each: new.accelerations(|q, v, tau, a| sparse.predict(q, v, tau, a)),
            },
        ));
        let network = FitSpec {
            family: Some("mlp".into()),
            ..spec.clone()
        };
        peers.push(("plain network".into(), one(lab, &dataset, &network, &new)?));
        for (name, spec) in flags(lab, &spec, case.forced) {
            others.push((name, one(lab, &dataset, &spec, &new)?));
        }
    }
    Ok(Record {
        name: case.name(),
        asked,
        half: case.system.half().into(),
        flaw: case.flaw.map(|flaw| flaw.name.into()),
        plain,
        others,
        peers,
    })
}

/// What the command is asked for where nothing but its length is.
fn spec(lab: &Lab) -> FitSpec {
    match lab.quick() {
        true => FitSpec {
            steps: Some(40),
            ..FitSpec::default()
        },
        false => FitSpec {
            seconds: lab.args.seconds,
            ..FitSpec::default()
        },
    }
}

/// Other flags whose best shows what the choice of the plain command costs.
fn flags(lab: &Lab, spec: &FitSpec, forced: bool) -> Vec<(String, FitSpec)> {
    let mut all = Vec::new();
    if !lab.args.flags {
        return all;
    }
    let losses: &[&str] = if forced {
        &["acceleration", "torque"]
    } else {
        &["acceleration"]
    };
    for family in ["lnn", "delan", "mlp"] {
        for friction in [false, true] {
            for loss in losses {
                let mut spec = FitSpec {
                    family: Some(family.into()),
                    ..spec.clone()
                };
                spec.training.insert("loss".into(), json!(loss));
                if friction {
                    spec.settings
                        .insert("forces".into(), json!(["viscous", "coulomb"]));
                }
                let with = if friction { ", friction" } else { "" };
                all.push((format!("{family}, {loss}{with}"), spec));
            }
        }
    }
    all
}

/// The true errors of one fit; those of none where it is refused.
fn one(lab: &mut Lab, dataset: &Dataset, spec: &FitSpec, new: &New) -> Result<Errors> {
    let configs = FitConfig::candidates(dataset, &[], spec);
    let fitted = configs
        .and_then(|mut configs| fit(dataset, &configs.remove(0).config, None, &mut lab.progress));
    lab.progress.check()?;
    Ok(fitted
        .map(|fitted| new.errors(&fitted.model))
        .unwrap_or_default())
}

/// New motions, without noise.
struct New {
    motions: Vec<Motion>,
    n: usize,
    /// Deviations of the positions.
    spread: Vec<f64>,
    /// Samples of the slowest period.
    period: usize,
}

impl New {
    fn of(truth: &Truth, case: &Case) -> Result<Self> {
        let motions = truth.motions(NEW, case.forced, case.seed() + 1_000_003)?;
        let coordinates = truth.model.coordinates();
        let n = coordinates.dof();
        let (mut spread, mut period) = (Vec::new(), AHEAD);
        for i in 0..n {
            let columns = motions.iter().map(|m| {
                m.shown
                    .q
                    .iter()
                    .skip(i)
                    .step_by(n)
                    .copied()
                    .collect::<Vec<f64>>()
            });
            let columns: Vec<Vec<f64>> = columns.collect();
            let most = if coordinates.is_circle(i) {
                1.8
            } else {
                f64::INFINITY
            };
            spread.push(deviation(&columns.concat()).clamp(1e-9, most));
            let crossings: usize = columns.iter().map(|x| crossings(x)).sum();
            // A coordinate that runs on has no period.
            if crossings >= 2 * NEW {
                period = period.max(2 * NEW * SAMPLES / crossings);
            }
        }
        Ok(Self {
            motions,
            n,
            spread,
            period: period.min(SAMPLES / 2),
        })
    }

    fn errors(&self, model: &dyn Model) -> Errors {
        if !model.moves() {
            return Errors::default();
        }
        let mut evaluator = model.evaluator();
        let each = self.accelerations(|q, v, tau, a| {
            let _ = evaluator.forward_dynamics(q, v, tau, a);
        });
        let options = RolloutOptions {
            max_steps: 3000,
            ..RolloutOptions::for_comparison()
        };
        let mut sums = [0.0; 2];
        let mut count = 0.0;
        for motion in &self.motions {
            let shown = &motion.shown;
            for from in [0, SAMPLES / 4, SAMPLES / 2 - 1] {
                let rows = [from, from + AHEAD, from + self.period.max(AHEAD + 1)]
                    .map(|k| k.min(SAMPLES - 1));
                let times = rows.map(|k| shown.t[k]);
                let start = shown.row(from);
                let force = |t: f64, _: &[f64], _: &[f64], tau: &mut [f64]| motion.drive(t, tau);
                let made = rollout(model, start.q, start.qd, &times, &force, &options);
                count += 1.0;
                for (sum, (row, k)) in sums.iter_mut().zip(rows[1..].iter().zip(1..)) {
                    let at = made.as_ref().ok().filter(|made| made.trajectory.len() > k);
                    *sum += at.map_or(LOST * LOST, |made| {
                        self.distance(made.trajectory.row(k).q, shown.row(*row).q)
                    });
                }
            }
        }
        Errors {
            each,
            ahead: sums.map(|sum| f64::sqrt(sum / count)),
        }
    }

    /// The mean over the coordinates of squared distances in deviations.
    fn distance(&self, a: &[f64], b: &[f64]) -> f64 {
        let pairs = a.iter().zip(b).zip(&self.spread);
        let sum: f64 = pairs.map(|((a, b), s)| ((a - b) / s).powi(2)).sum();
        let mean = sum / self.n as f64;
        if mean.is_finite() {
            mean.min(LOST * LOST)
        } else {
            LOST * LOST
        }
    }

    /// The error of each acceleration that `predict` writes for samples (q, q̇, τ), `[m, n]`.
    fn accelerations(
        &self,
        mut predict: impl FnMut(&[f64], &[f64], &[f64], &mut [f64]),
    ) -> Vec<f64> {
        let (mut predicted, mut truth) = (Vec::new(), Vec::new());
        for Motion { shown, .. } in &self.motions {
            let mut qdd = vec![0.0; shown.q.len()];
            let tau = if shown.tau.is_empty() {
                qdd.clone()
            } else {
                shown.tau.clone()
            };
            predict(&shown.q, &shown.qd, &tau, &mut qdd);
            predicted.extend(qdd);
            truth.extend(&shown.qdd);
        }
        acceleration_errors(&predicted, &truth, self.n)
    }
}

/// The mean squared error of each of `n` accelerations, `[m, n]`, in parts of its variance, at most [`MOST`].
pub(crate) fn acceleration_errors(predicted: &[f64], truth: &[f64], n: usize) -> Vec<f64> {
    let error = |i: usize| {
        let (own, other) = (column(predicted, n, i), column(truth, n, i));
        let squares: f64 = own.iter().zip(&other).map(|(a, b)| (a - b).powi(2)).sum();
        let mse = squares / own.len() as f64 / deviation(&other).powi(2).max(1e-12);
        if mse.is_finite() { mse.min(MOST) } else { MOST }
    };
    (0..n).map(error).collect()
}

/// How often a signal crosses its mean.
fn crossings(x: &[f64]) -> usize {
    let mean = x.iter().sum::<f64>() / x.len() as f64;
    x.windows(2)
        .filter(|w| (w[0] > mean) != (w[1] > mean))
        .count()
}
