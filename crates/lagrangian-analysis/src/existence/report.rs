//! The verdict in sentences, and as an item of the check of recordings.

use lagrangian::check::Item;

use super::{Existence, Survey};

/// Sentences with the evidence on `n` coordinates, one for each kind.
pub(super) fn reasons(found: &Survey, existence: Existence, n: usize) -> Vec<String> {
    let more = "Record more: longer, more motions, less noise; or fit for longer.";
    let reasons = [
        Some(by_errors(found, existence)),
        by_helmholtz(found, n),
        by_damping(found),
        by_divergence(found),
        (existence == Existence::Undecided).then(|| more.into()),
    ];
    reasons.into_iter().flatten().collect()
}

fn by_errors(found: &Survey, existence: Existence) -> String {
    let claim = match existence {
        Existence::Lagrangian => "A Lagrangian explains what any force explains",
        Existence::WithFriction => "Friction is needed, and it is enough",
        Existence::NoneFound => {
            "The motions follow a law, but not that of a Lagrangian with friction of its coordinates"
        }
        Existence::Undecided => "The fits do not decide",
    };
    format!(
        "{claim}: of held-out accelerations a Lagrangian misses {}, one with friction {}, a fit of any force {}.",
        percent(found.conservative.relative),
        percent(found.friction.relative),
        percent(found.unrestricted.relative)
    )
}

fn by_helmholtz(found: &Survey, n: usize) -> Option<String> {
    if n == 1 {
        let open = "One coordinate: near any state every law has a Lagrangian (Darboux 1894); only whole motions that return can decide.";
        return Some(open.into());
    }
    let a = found.asymmetry?;
    let claim = match a.is_significant() {
        true => "no multiplier makes the field that of a Lagrangian",
        false => "not more than that",
    };
    Some(format!(
        "Helmholtz: the best multiplier leaves {} of the field's derivatives asymmetric along {} free motions, errors of learning can make {}: {claim}.",
        percent(a.median),
        a.motions,
        percent(a.chance)
    ))
}

fn by_damping(found: &Survey) -> Option<String> {
    let d = found.damping?;
    let claim = match d.is_significant() {
        true => "a force that couples coordinates takes energy out or puts it in",
        false => "no damping couples coordinates",
    };
    Some(format!(
        "Driven motions show M: the rate of M leaves a damping of {}, {} of it off the diagonal, errors of learning can make {}: {claim}.",
        percent(d.whole),
        percent(d.coupled),
        percent(d.chance)
    ))
}

fn by_divergence(found: &Survey) -> Option<String> {
    let d = found.divergence?;
    let claim = match d.is_significant() {
        false => "it cannot be distinguished from 0",
        true if d.rate < 0.0 => "they draw together, as without friction no Lagrangian allows",
        true => "they spread, as no Lagrangian allows",
    };
    Some(format!(
        "Motions that come back ({}) have a mean divergence of {:.1e} ± {:.0e} 1/s: {claim}.",
        d.motions, d.rate, d.error
    ))
}

/// A fraction in per cent with two digits.
fn percent(part: f64) -> String {
    let x = 100.0 * part;
    match x {
        _ if x >= 10.0 => format!("{x:.0} %"),
        _ if x >= 1.0 => format!("{x:.1} %"),
        _ if x >= 0.01 => format!("{x:.2} %"),
        _ => format!("{x:.0e} %"),
    }
}

/// Result of a [`survey`](super::survey()) as an item beside those of [`check`](lagrangian::check()).
///
/// Recordings without a Lagrangian can still be fitted, so the item warns and does not fail.
#[must_use]
pub fn check_item(survey: &Survey) -> Item {
    let verdict = &survey.verdict;
    let finding = format!(
        "{}, confidence {:.0} %. {}",
        verdict.existence,
        100.0 * verdict.confidence,
        verdict.reasons.join(" ")
    );
    let name = "lagrangian";
    let mut item = match verdict.existence {
        Existence::Lagrangian => Item::pass(name, finding),
        Existence::WithFriction => Item {
            remedy: Some("learn viscous and Coulomb friction beside the Lagrangian".into()),
            ..Item::pass(name, finding)
        },
        Existence::NoneFound => Item::warn(
            name,
            finding,
            "fit a plain network, or find the missing force: record it as τ, or add the coordinate that drives it",
        ),
        Existence::Undecided => Item::warn(
            name,
            finding,
            "record more and longer motions with less noise, or give the fits more time",
        ),
    };
    let (asymmetry, damping) = (survey.asymmetry, survey.damping);
    let values = [
        ("confidence", Some(verdict.confidence)),
        ("error_conservative", Some(survey.conservative.relative)),
        ("error_friction", Some(survey.friction.relative)),
        ("error_unrestricted", Some(survey.unrestricted.relative)),
        ("held_out_recordings", Some(survey.recordings as f64)),
        ("held_out_samples", Some(survey.samples as f64)),
        ("helmholtz_asymmetry", asymmetry.map(|a| a.median)),
        ("helmholtz_chance", asymmetry.map(|a| a.chance)),
        ("damping", damping.map(|d| d.whole)),
        ("damping_coupled", damping.map(|d| d.coupled)),
        ("damping_chance", damping.map(|d| d.chance)),
        ("divergence", survey.divergence.map(|d| d.rate)),
        ("divergence_error", survey.divergence.map(|d| d.error)),
    ];
    for (name, value) in values {
        item = value.into_iter().fold(item, |item, x| item.value(name, x));
    }
    item
}
