//! What a verdict rests on, in sentences.

use super::survey::Survey;
use super::verdict::{Existence, asymmetric, contracts, coupled};

/// A sentence for each kind of evidence on `n` coordinates.
pub(super) fn reasons(found: &Survey, existence: Existence, n: usize) -> Vec<String> {
    let mut reasons = vec![by_errors(found, existence)];
    reasons.extend(by_helmholtz(found, n));
    reasons.extend(by_damping(found));
    reasons.extend(by_divergence(found));
    if existence == Existence::Undecided {
        reasons.push("Record more: longer, more motions, less noise; or fit for longer.".into());
    }
    reasons
}

fn by_errors(found: &Survey, existence: Existence) -> String {
    let fits = [&found.conservative, &found.friction, &found.unrestricted];
    let [c, f, u] = fits.map(|fit| percent(fit.relative));
    let errors = format!(
        "of held-out accelerations a Lagrangian misses {c}, one with friction {f}, a fit of any force {u}"
    );
    match existence {
        Existence::Lagrangian => {
            format!("A Lagrangian explains what any force explains: {errors}.")
        }
        Existence::WithFriction => format!("Friction is needed, and it is enough: {errors}."),
        Existence::NoneFound => {
            format!(
                "There is a law, but none of a Lagrangian with friction of its coordinates: {errors}."
            )
        }
        Existence::Undecided => format!("The fits do not decide: {errors}."),
    }
}

fn by_helmholtz(found: &Survey, n: usize) -> Option<String> {
    if n == 1 {
        return Some(
            "One coordinate: near any state every law has a Lagrangian (Darboux 1894); only whole motions, and those that come back, can tell."
                .into(),
        );
    }
    let (a, sure) = (found.asymmetry.as_ref()?, asymmetric(found)?);
    let much = if sure {
        "no multiplier makes the field that of a Lagrangian"
    } else {
        "no more than that"
    };
    Some(format!(
        "Helmholtz: the best multiplier leaves {} of the field's derivatives asymmetric along {} free motions, errors of learning can make {}: {much}.",
        percent(a.median),
        a.motions,
        percent(a.chance)
    ))
}

fn by_damping(found: &Survey) -> Option<String> {
    let (d, sure) = (found.damping.as_ref()?, coupled(found)?);
    let much = if sure {
        "a force that couples coordinates takes energy out or puts it in"
    } else {
        "no damping couples coordinates"
    };
    Some(format!(
        "Driven motions show M: the rate of M leaves a damping of {}, {} of it off the diagonal, errors of learning can make {}: {much}.",
        percent(d.whole),
        percent(d.coupled),
        percent(d.chance)
    ))
}

fn by_divergence(found: &Survey) -> Option<String> {
    let (c, sure) = (found.contraction?, contracts(found)?);
    let way = match (sure, c.divergence.rate < 0.0) {
        (false, _) => "none that could be told from 0",
        (true, true) => "they draw together, as without friction no Lagrangian allows",
        (true, false) => "they spread, as no Lagrangian allows",
    };
    Some(format!(
        "Motions that come back ({}) have a mean divergence of {:.1e} ± {:.0e} 1/s: {way}.",
        c.divergence.motions,
        c.divergence.rate,
        c.error()
    ))
}

/// A part of the whole, as per cent with two digits.
fn percent(part: f64) -> String {
    let x = 100.0 * part;
    match x {
        _ if x >= 10.0 => format!("{x:.0} %"),
        _ if x >= 1.0 => format!("{x:.1} %"),
        _ if x >= 0.01 => format!("{x:.2} %"),
        _ => format!("{x:.0e} %"),
    }
}
