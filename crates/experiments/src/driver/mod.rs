//! The plain command on files whose truth is known: what its choices cost, and whether what it says is true.

pub(crate) mod cases;
pub(crate) mod measure;
mod peers;
pub(crate) mod systems;

use anyhow::{Error, Result};
use lagrangian_report::{Role, Table};

use crate::harness::failure::mistake;
use crate::harness::spread::scientific;
use crate::harness::{Experiment, Lab, less, neither};
use cases::{Case, cases};
use measure::{Record, measured};

pub(crate) const EXPERIMENT: Experiment = Experiment {
    name: "driver",
    about: "the plain command on files whose truth is known: what its choices cost, and whether what it says is true",
    run,
    title: "The plain command beside the truth",
    text: &[
        "Each case is a file of motions of a known system, clean or noisy, with and without velocities, of few or many motions, free or driven, and in \
         some cases spoiled by a mistake. The plain command is run on it. Its model is judged by 12 new motions without noise: squared errors of \
         accelerations in parts of their variance, and errors of positions half a second and one slowest period ahead in parts of their deviation.",
        "Systems are split in two halves by name; nothing is tuned on the second.",
        "Regret is the error of the kept model over the least of all that were fitted to the file. A sparse regression and a plain network are fitted to the \
         same samples; other flags with --flags. Errors below 1e-9 of the variance count as equal.",
    ],
    parts: Some("a part of the name of a case"),
    quantities: &[
        neither("cases", "cases", ""),
        less("regret_median", "regret, median", ""),
        less("regret_mean", "geometric mean", ""),
        less("regret_most", "95 %", ""),
        less("regret_worst", "worst", ""),
        less("behind", "behind a peer", "%"),
        less("overclaimed", "good, but worse than claimed", "%"),
        less("useless", "good or fair, but a constant is better", "%"),
        less("strict", "good, but called less", "%"),
        neither("covered", "interval holds the truth", "%"),
        neither("spoiled", "files with flaws", ""),
        less("flaws", "flaws called good or fair", "%"),
        neither("seconds", "time, median", "s"),
    ],
    about_quantities: "Good means an error of at most 5 % of the deviation half a second ahead, where no interval is claimed. Percentages are of the cases \
                       that could be so.",
    ..Experiment::EMPTY
};

/// Measured cases, a line each, so that a run that was cut goes on and another analysis fits nothing again.
const KEPT: &str = "cases.jsonl";
/// Errors below this part of the variance are equal.
const FLOOR: f64 = 1e-9;
/// An error half a second ahead that deserves to be called good.
const GOOD: f64 = 0.05;
/// A peer with this part of an error is ahead.
const AHEAD: f64 = 0.8;
/// Cases of a quick run.
const QUICK: usize = 12;

fn run(lab: &mut Lab) -> Result<()> {
    let chosen = chosen(lab)?;
    let seconds = lab
        .args
        .seconds
        .map_or("default".into(), |s| format!("{s} s"));
    let length = if lab.quick() { "quick".into() } else { seconds };
    let flags = if lab.args.flags { ", flags" } else { "" };
    let asked = format!("{length}{flags}, seed {}", lab.args.seed);
    let mut records: Vec<Record> = Vec::new();
    lab.plan(chosen.len());
    for case in &chosen {
        let name = case.name();
        lab.begin(&name)?;
        let own = |own: &Record| own.name == name && own.asked == asked;
        records.push(lab.remembered(KEPT, own, |lab| measured(lab, case, asked.clone()))?);
    }
    for half in ["first", "second"] {
        let own: Vec<&Record> = records.iter().filter(|r| r.half == half).collect();
        if !own.is_empty() {
            summarise(lab, half, &own);
        }
    }
    list(lab, &records)
}

/// The cases that are asked for.
fn chosen(lab: &Lab) -> Result<Vec<Case>> {
    let mut all = cases();
    let half = lab.args.half.as_deref();
    all.retain(|case| half.is_none_or(|half| case.system.half() == half));
    all.retain(|case| !lab.quick() || case.is_small());
    all.iter_mut().for_each(|case| case.seed = lab.args.seed);
    all.retain(|case| {
        lab.args
            .only
            .as_ref()
            .is_none_or(|part| case.name().contains(part))
    });
    if all.is_empty() {
        return Err(none_named());
    }
    let most = lab
        .args
        .cases
        .unwrap_or(if lab.quick() { QUICK } else { all.len() });
    let count = most.clamp(1, all.len());
    Ok((0..count)
        .map(|k| all[k * all.len() / count].clone())
        .collect())
}

/// That no case has what was asked for in its name.
pub(crate) fn none_named() -> Error {
    mistake(
        "no case has this in its name",
        "omit --only, or give a part of the name of a system, flaw or noise",
    )
}

impl Record {
    /// The error over the least of all fits.
    fn regret(&self) -> f64 {
        let others = self.others.iter().chain(&self.peers);
        let least = others.fold(self.plain.errors.acceleration(), |least, (_, own)| {
            least.min(own.acceleration())
        });
        (self.plain.errors.acceleration() + FLOOR) / (least + FLOOR)
    }

    fn is_behind(&self) -> bool {
        let own = self.plain.errors.acceleration() + FLOOR;
        self.peers
            .iter()
            .any(|(_, peer)| peer.acceleration() + FLOOR < AHEAD * own)
    }

    fn says(&self, words: &[&str]) -> bool {
        words.contains(&self.plain.verdict.as_str())
    }

    fn half_second(&self) -> f64 {
        self.plain.errors.ahead[0]
    }

    /// Whether a constant is better: for an acceleration, or for the positions half a second ahead.
    fn is_useless(&self) -> bool {
        self.plain.errors.acceleration() >= 1.0 || self.half_second() >= 1.0
    }
}

/// The part of these for which this holds, in percent; NaN of none.
fn percent<'a>(of: impl Iterator<Item = &'a Record>, is: impl Fn(&Record) -> bool) -> f64 {
    let all: Vec<bool> = of.map(is).collect();
    100.0 * all.iter().filter(|own| **own).count() as f64 / all.len() as f64
}

/// The value below which this part of them lies.
fn quantile(mut values: Vec<f64>, part: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    let at = (part * values.len() as f64).ceil() as usize;
    values
        .get(at.saturating_sub(1))
        .copied()
        .unwrap_or(f64::NAN)
}

fn summarise(lab: &mut Lab, half: &str, records: &[&Record]) {
    let good = || records.iter().copied().filter(|r| r.flaw.is_none());
    let flawed = records.iter().copied().filter(|r| r.flaw.is_some());
    let regrets: Vec<f64> = good().map(Record::regret).collect();
    let upper = |r: &Record| r.plain.claim.map_or(GOOD, |claim| claim[1]);
    let values = [
        ("cases", records.len() as f64),
        ("regret_median", quantile(regrets.clone(), 0.5)),
        (
            "regret_mean",
            (regrets.iter().map(|x| x.ln()).sum::<f64>() / regrets.len() as f64).exp(),
        ),
        ("regret_most", quantile(regrets.clone(), 0.95)),
        ("regret_worst", quantile(regrets, 1.0)),
        ("behind", percent(good(), Record::is_behind)),
        (
            "overclaimed",
            percent(good().filter(|r| r.says(&["good"])), |r| {
                r.half_second() > upper(r)
            }),
        ),
        (
            "useless",
            percent(
                good().filter(|r| r.says(&["good", "fair"])),
                Record::is_useless,
            ),
        ),
        (
            "strict",
            percent(good().filter(|r| r.half_second() <= GOOD), |r| {
                !r.says(&["good"])
            }),
        ),
        (
            "covered",
            percent(good().filter(|r| r.plain.claim.is_some()), |r| {
                r.plain
                    .claim
                    .is_some_and(|[low, high]| (low..=high).contains(&r.half_second()))
            }),
        ),
        ("spoiled", flawed.clone().count() as f64),
        ("flaws", percent(flawed, |r| r.says(&["good", "fair"]))),
        (
            "seconds",
            quantile(records.iter().map(|r| r.plain.seconds).collect(), 0.5),
        ),
    ];
    let row = lab
        .results
        .row("", half, &format!("the {half} half"), Role::Lnn);
    for (key, value) in values {
        row.add(key, value);
    }
}

/// All cases, those with the largest regret first, then those with flaws.
fn list(lab: &mut Lab, records: &[Record]) -> Result<()> {
    let mut sorted: Vec<&Record> = records.iter().collect();
    sorted.sort_by(|a, b| {
        (a.flaw.is_some(), -a.regret())
            .partial_cmp(&(b.flaw.is_some(), -b.regret()))
            .unwrap_or(std::cmp::Ordering::Equal)
    });
    let peer = |r: &Record, name: &str| {
        let own = r.peers.iter().find(|own| own.0 == name);
        own.map_or("–".into(), |own| scientific(own.1.acceleration()))
    };
    let row = |r: &&Record| {
        let best = r
            .others
            .iter()
            .chain(&r.peers)
            .min_by(|a, b| a.1.acceleration().total_cmp(&b.1.acceleration()));
        let mut cells = vec![
            r.name.clone(),
            r.half.clone(),
            r.plain.verdict.clone(),
            r.plain.family.clone(),
        ];
        match r.flaw {
            Some(_) => cells.extend(["–"; 7].map(String::from)),
            None => {
                let errors = &r.plain.errors;
                cells.extend(
                    [errors.acceleration(), errors.ahead[0], errors.ahead[1]].map(scientific),
                );
                cells.push(scientific(r.regret()));
                cells.extend([peer(r, "sparse regression"), peer(r, "plain network")]);
                cells.push(best.map_or("–".into(), |own| own.0.clone()));
            }
        }
        cells.push(format!("{:.0}", r.plain.seconds));
        cells.push(r.plain.reasons.first().cloned().unwrap_or_default());
        cells
    };
    let header = [
        "case",
        "half",
        "verdict",
        "model",
        "error of q̈",
        "½ s ahead",
        "a period ahead",
        "regret",
        "sparse",
        "network",
        "best other",
        "s",
        "first reason",
    ];
    let caption = "Each case, the largest regret first, then those that are spoiled.";
    let rows = sorted.iter().map(row).collect();
    lab.list(Table::new(caption, &header, rows))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;
    use std::collections::HashSet;

    #[test]
    fn there_are_enough_cases_of_systems_that_move_and_both_halves_have_their_share() {
        let all = cases();
        let names: HashSet<String> = all.iter().map(Case::name).collect();
        assert!(
            names.len() == all.len() && all.len() >= 300,
            "{} of {}",
            names.len(),
            all.len()
        );
        let first = all
            .iter()
            .filter(|case| case.system.half() == "first")
            .count();
        assert!(
            (0.35..0.65).contains(&(first as f64 / all.len() as f64)),
            "{first}"
        );
        for system in systems::all() {
            let truth = system.build().unwrap();
            for forced in [false, true] {
                let motions = truth.motions(3, forced, 7);
                let motions = motions.unwrap_or_else(|error| panic!("{}: {error}", system.name()));
                let rows = motions.iter().map(|motion| &motion.shown);
                assert!(rows.clone().all(|row| row.tau.is_empty() != forced));
                let moved =
                    rows.map(|row| row.qdd.iter().fold(0.0_f64, |most, x| most.max(x.abs())));
                println!(
                    "{} {forced} {} {:?}",
                    system.name(),
                    truth.seconds,
                    moved.clone().collect::<Vec<_>>()
                );
                assert!(
                    moved.into_iter().any(|most| most > 1e-2),
                    "{}",
                    system.name()
                );
            }
        }
    }
}
