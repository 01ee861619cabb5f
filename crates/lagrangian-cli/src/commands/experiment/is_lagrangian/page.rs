//! The table and the page: is there a Lagrangian?

use lagrangian_analysis::existence::{HeldOut, Survey};
use lagrangian_report::{Axis, Figure, Headline, Report, Role, Series, Table};

use super::Found;
use crate::commands::experiment::spread::{cell, median, scientific};

const ABOUT: &str = "Three kinds of evidence: a Lagrangian, one with friction, and a plain network are fitted alike, and a \
restriction that costs nothing on held-out recordings holds; the conditions of Helmholtz ask the plain network's field for \
a multiplier that makes it a Lagrangian's; and motions that come back must neither draw together nor spread. Below, each \
system without noise, first seed.";

const FRICTION: Role = Role::Other(0);

pub(super) fn summary(found: &[Found]) -> Table {
    let header = [
        "system",
        "noise",
        "truth",
        "right",
        "verdicts",
        "confidence",
        "Lagrangian",
        "with friction",
        "any force",
        "Helmholtz (chance)",
        "damping off the diagonal (chance)",
        "divergence, 1/s",
    ];
    Table {
        caption: "Relative errors of held-out accelerations of the three fits; what the best multiplier of the Helmholtz \
                  conditions leaves, and what errors of learning can make of it; for the driven body, the damping that couples \
                  coordinates; the mean divergence of motions that come back. Medians of the seeds. No published figures \
                  are known to us: the conditions are those of Helmholtz (1887), Darboux (1894) and Douglas (1941)."
            .into(),
        header: header.map(str::to_string).to_vec(),
        rows: found.iter().map(row).collect(),
    }
}

fn row(found: &Found) -> Vec<String> {
    let fit = |of: fn(&Survey) -> &HeldOut| cell(&values(found, |s| Some(of(s).relative)));
    let pair = |a: Vec<f64>, b: Vec<f64>, between: &str| match a.is_empty() {
        true => "–".to_string(),
        false => format!(
            "{} {between}{}",
            scientific(median(&a)),
            scientific(median(&b))
        ),
    };
    let asymmetry = values(found, |s| s.asymmetry.as_ref().map(|a| a.median));
    let chance = values(found, |s| s.asymmetry.as_ref().map(|a| a.chance));
    let coupled = values(found, |s| s.damping.as_ref().map(|d| d.coupled));
    let coupled_chance = values(found, |s| s.damping.as_ref().map(|d| d.chance));
    let rate = values(found, |s| s.contraction.map(|c| c.found.rate));
    let error = values(found, |s| s.contraction.map(|c| c.error()));
    let confidences = values(found, |s| Some(s.verdict.confidence));
    let mut verdicts: Vec<String> = found
        .surveys
        .iter()
        .map(|s| s.verdict.existence.to_string())
        .collect();
    verdicts.dedup();
    vec![
        found.system.name().into(),
        noise(found.noise),
        found.system.truth().to_string(),
        format!("{} of {}", found.right(), found.surveys.len()),
        verdicts.join(", "),
        format!("{:.0} %", 100.0 * median(&confidences)),
        fit(|s| &s.conservative),
        fit(|s| &s.friction),
        fit(|s| &s.unrestricted),
        pair(asymmetry, chance, "/ "),
        pair(coupled, coupled_chance, "/ "),
        pair(rate, error, "± "),
    ]
}

fn noise(part: f64) -> String {
    if part == 0.0 {
        "none".into()
    } else {
        format!("{} %", 100.0 * part)
    }
}

fn values(found: &Found, of: impl Fn(&Survey) -> Option<f64>) -> Vec<f64> {
    found.surveys.iter().filter_map(of).collect()
}

pub(super) fn report(found: &[Found], quick: bool) -> Report {
    let mut noises: Vec<f64> = found.iter().map(|f| f.noise).collect();
    noises.dedup();
    let of_noise = |part: f64| -> Vec<&Found> {
        // OK because both come from the same list of literals.
        found
            .iter()
            .filter(|f| f.noise.to_bits() == part.to_bits())
            .collect()
    };
    let headline = |&part: &f64| {
        let these = of_noise(part);
        Headline {
            label: format!("Right verdicts, noise {}", noise(part)),
            value: these.iter().map(|f| f.right()).sum::<usize>().to_string(),
            unit: format!(
                "of {}",
                these.iter().map(|f| f.surveys.len()).sum::<usize>()
            ),
            note: format!("{} systems", these.len()),
            role: None,
        }
    };
    let clean = of_noise(0.0);
    let mut figures: Vec<Figure> = noises
        .iter()
        .map(|&part| errors(&of_noise(part), part))
        .collect();
    figures.extend([violations(&clean), divergences(&clean)]);
    Report {
        title: "Is it Lagrangian?".into(),
        subtitle: format!(
            "Does any Lagrangian exist for recorded motions? {} systems of which it is known{}",
            clean.len(),
            if quick { ", quick" } else { "" }
        ),
        headlines: noises.iter().map(headline).collect(),
        summary: std::iter::once(ABOUT.to_string())
            .chain(clean.iter().filter_map(|f| reasons(f)))
            .collect(),
        figures,
        ..Report::default()
    }
}

/// The reasons of the first seed of each system.
fn reasons(found: &Found) -> Option<String> {
    let verdict = &found.surveys.first()?.verdict;
    let name = found.system.name();
    Some(format!(
        "{name}: {}. {}",
        verdict.existence,
        verdict.reasons.join(" ")
    ))
}

/// `1 pendulum, 2 double-pendulum, …`
fn numbered(found: &[&Found]) -> String {
    let names = found.iter().enumerate();
    let names: Vec<String> = names
        .map(|(k, f)| format!("{} {}", k + 1, f.system.name()))
        .collect();
    names.join(", ")
}

fn places(found: &[&Found]) -> Axis {
    Axis::linear("system", "").between(0.5, found.len() as f64 + 0.5)
}

/// Half the length of a dash.
const DASH: f64 = 0.08;

/// A dash for each seed of each system, `beside` its place.
fn dashes(
    found: &[&Found],
    (name, role, beside): (&str, Role, f64),
    of: impl Fn(&Survey) -> Option<f64>,
) -> Series {
    let (mut x, mut y) = (Vec::new(), Vec::new());
    for (k, f) in found.iter().enumerate() {
        for value in values(f, &of) {
            let middle = (k + 1) as f64 + beside;
            x.extend([middle - DASH, middle + DASH, f64::NAN]);
            y.extend([value, value, f64::NAN]);
        }
    }
    Series::line(name, role, x, y)
}

fn errors(found: &[&Found], part: f64) -> Figure {
    Figure {
        id: format!("errors-{}", if part == 0.0 { "clean" } else { "noisy" }),
        title: format!("Errors of the three fits, noise {}", noise(part)),
        caption: format!(
            "Relative errors of held-out accelerations, a dash a seed. Where a Lagrangian exists, it costs nothing. {}.",
            numbered(found)
        ),
        x: places(found),
        y: Axis::log("error of q̈", ""),
        series: vec![
            dashes(found, ("Lagrangian", Role::Lnn, -0.2), |s| {
                Some(s.conservative.relative)
            }),
            dashes(found, ("with friction", FRICTION, 0.0), |s| {
                Some(s.friction.relative)
            }),
            dashes(found, ("any force", Role::Baseline, 0.2), |s| {
                Some(s.unrestricted.relative)
            }),
        ],
    }
}

fn violations(found: &[&Found]) -> Figure {
    Figure {
        id: "helmholtz".into(),
        title: "What the best multiplier leaves of the Helmholtz conditions".into(),
        caption: format!(
            "Medians over free motions of each learned field, a dash a seed, beside what errors of learning can make. Systems of \
             one coordinate always have a multiplier. {}.",
            numbered(found)
        ),
        x: places(found),
        y: Axis::log("asymmetry, part of Φ", ""),
        series: vec![
            dashes(found, ("errors of learning", Role::Baseline, 0.1), |s| {
                s.asymmetry.as_ref().map(|a| a.chance)
            }),
            dashes(found, ("learned field", Role::Lnn, -0.1), |s| {
                s.asymmetry.as_ref().map(|a| a.median)
            }),
        ],
    }
}

fn divergences(found: &[&Found]) -> Figure {
    Figure {
        id: "divergence".into(),
        title: "Mean divergence of motions that come back".into(),
        caption: format!(
            "Its size, and its standard error, a dash a seed; a Lagrangian keeps it at 0. No dash where no motion comes back. {}.",
            numbered(found)
        ),
        x: places(found),
        y: Axis::log("mean divergence", "1/s"),
        series: vec![
            dashes(found, ("error", Role::Baseline, 0.1), |s| {
                s.contraction.map(|c| c.error())
            }),
            dashes(found, ("|mean|", Role::Lnn, -0.1), |s| {
                s.contraction.map(|c| c.found.rate.abs())
            }),
        ],
    }
}
