//! Conserved quantities, as text and as a page.

use lagrangian::score::Judgement;
use lagrangian_analysis::conserved::{Change, Conserved, Drift, Quantity};
use lagrangian_report::draw::short;
use lagrangian_report::{Figure, Headline, Report, Role, Series, Table, conserved_quantity};

use crate::law_args::ConservedArgs;

/// The quantities that the model conserves, and their drift along the motions.
fn answer(found: &Conserved) -> String {
    let kept: Vec<&Quantity> = found
        .quantities
        .iter()
        .filter(|own| own.symmetric)
        .collect();
    let names: Vec<&str> = kept.iter().map(|own| own.name.as_str()).collect();
    let drifts = kept.iter().map(|own| own.data.relative);
    // NaN where the motions leave the domain of the model: then it is the largest.
    let largest = drifts.max_by(f64::total_cmp).unwrap_or(f64::NAN);
    let grades = kept
        .iter()
        .filter_map(|own| own.judgement())
        .map(|own| own.grade);
    let Some(grade) = grades.max() else {
        return "The model conserves none of the quantities that were looked at.".into();
    };
    let why = format!(
        "the model conserves {}; along the motions, the work of forces taken off, the largest drift is {} % of the size",
        names.join(", "),
        short(100.0 * largest)
    );
    Judgement::new(grade, why).sentence()
}

/// The result of the search for linear symmetries, in lines.
fn generators(found: &Conserved) -> Vec<String> {
    match &found.generators {
        None => vec!["linear symmetries: these motions do not distinguish them, or there are too many coordinates".into()],
        Some(all) if all.is_empty() => vec!["linear symmetries: none".into()],
        Some(all) => {
            let head = "linear symmetries, as a basis:".to_string();
            let lines = all.iter().map(|g| format!("  {}", g.text));
            std::iter::once(head).chain(lines).collect()
        }
    }
}

fn kept(quantity: &Quantity) -> &'static str {
    match quantity.symmetric {
        true => "conserved",
        false => "not conserved",
    }
}

/// The terms of F, where the quantity is conserved and F is more than the gauge at rest.
fn gauge(quantity: &Quantity) -> String {
    let terms = quantity.gauge.terms.iter().filter(|_| quantity.symmetric);
    let terms = terms.map(|(name, f)| format!("{f:+.3} {name}"));
    match terms.collect::<Vec<_>>().join(" ") {
        none if none.is_empty() => none,
        terms => format!("less F = {terms}"),
    }
}

pub(super) fn facts(args: &ConservedArgs, found: &Conserved) -> Report {
    Report {
        title: format!("What is conserved, {}", args.subject.subject),
        subtitle: format!(
            "Symmetries measured at {} states; a force along the direction of at most {} of the inertial forces counts as none",
            found.states, args.tolerance
        ),
        answer: answer(found),
        headlines: conserved(found).map(|(_, own)| headline(own)).collect(),
        summary: generators(found),
        tables: vec![table(found)],
        ..Report::default()
    }
}

/// The quantities that the model conserves, numbered.
fn conserved(found: &Conserved) -> impl Iterator<Item = (usize, &Quantity)> {
    (1..)
        .zip(&found.quantities)
        .filter(|(_, own)| own.symmetric)
}

pub(super) fn figures(found: &Conserved) -> Vec<Figure> {
    conserved(found).map(|(k, own)| figure(k, own)).collect()
}

fn headline(quantity: &Quantity) -> Headline {
    let label = format!("Drift of the {}", quantity.name);
    let value = short(100.0 * quantity.data.relative);
    let note = format!(
        "of its size, at most, in {} s",
        short(quantity.data.seconds)
    );
    Headline {
        judgement: quantity.judgement(),
        ..Headline::new(&label, value, "%", note)
    }
}

/// The change along the motions and along rollouts of the model; one entry of the legend for each of the two.
fn figure(number: usize, quantity: &Quantity) -> Figure {
    let lines = |name: &'static str, role, drift: &Drift| -> Vec<Series> {
        let line = |(k, own): (usize, &Change)| {
            let name = if k == 0 { name } else { "" };
            Series::line(name, role, own.t.clone(), own.relative.clone())
        };
        drift.changes.iter().enumerate().map(line).collect()
    };
    let own = quantity.own.iter();
    let mut series = lines("along the motions", Role::Truth, &quantity.data);
    series.extend(own.flat_map(|own| lines("along rollouts of the model", Role::Lnn, own)));
    conserved_quantity(number, &quantity.name, series)
}

fn table(found: &Conserved) -> Table {
    let percent = |drift: &Drift| short(100.0 * drift.relative);
    let row = |own: &Quantity| {
        let drift = own.own.as_ref().map_or("–".into(), percent);
        let (r, data) = (short(own.violation), percent(&own.data));
        vec![
            own.name.clone(),
            kept(own).into(),
            r,
            data,
            drift,
            gauge(own),
        ]
    };
    let all = &found.quantities;
    Table::new(
        "What was looked at. r is the force along the direction of the inertial forces, 0 for a symmetry; a drift is the largest change \
         of the quantity, the work of forces and friction taken off, in % of its size; F is what is taken off the charge.",
        &["quantity", "by the model", "r", "drift along the motions, %", "drift along rollouts, %", "gauge"],
        all.iter().map(row).collect(),
    )
    .with_judgements(all.iter().map(Quantity::judgement).collect())
}
