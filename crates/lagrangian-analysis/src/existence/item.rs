//! The result of a survey as an item of the check of recordings.

use lagrangian::Item;

use super::{Existence, Survey};

/// The result of a [`survey`](super::survey()) as an item beside those of [`check`](lagrangian::check()).
///
/// Recordings without a Lagrangian can be fitted all the same, so it warns and does not fail.
#[must_use]
pub fn check_item(survey: &Survey) -> Item {
    let verdict = &survey.verdict;
    let finding = format!(
        "{}, confidence {:.0} %. {}",
        verdict.existence,
        100.0 * verdict.confidence,
        verdict.reasons.join(" ")
    );
    let item = match verdict.existence {
        Existence::Lagrangian => Item::pass("lagrangian", finding),
        Existence::WithFriction => Item {
            remedy: Some("learn viscous and Coulomb friction beside the Lagrangian".into()),
            ..Item::pass("lagrangian", finding)
        },
        Existence::NoneFound => Item::warn(
            "lagrangian",
            finding,
            "fit a plain network, or find the missing force: record it as τ, or add the coordinate that drives it",
        ),
        Existence::Undecided => Item::warn(
            "lagrangian",
            finding,
            "record more and longer motions with less noise, or give the fits more time",
        ),
    };
    let mut item = item
        .value("confidence", survey.verdict.confidence)
        .value("error_conservative", survey.conservative.relative)
        .value("error_friction", survey.friction.relative)
        .value("error_unrestricted", survey.unrestricted.relative)
        .value("held_out_recordings", survey.recordings as f64)
        .value("held_out_samples", survey.samples as f64);
    for (i, hidden) in survey.hidden.iter().enumerate() {
        item = item.value(format!("hidden_acceleration_{}", i + 1), *hidden);
    }
    if let Some(a) = &survey.asymmetry {
        item = item
            .value("helmholtz_asymmetry", a.median)
            .value("helmholtz_chance", a.chance);
    }
    if let Some(d) = &survey.damping {
        item = item
            .value("damping", d.whole)
            .value("damping_coupled", d.coupled)
            .value("damping_chance", d.chance);
    }
    if let Some(c) = &survey.contraction {
        item = item
            .value("divergence", c.divergence.rate)
            .value("divergence_error", c.error());
    }
    item
}
