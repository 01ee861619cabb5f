//! What a comparison says: its verdict in sentences, and its page.

use lagrangian::score::{Grade, Judgement};
use lagrangian::{Model, counted};

use lagrangian_report::draw::short;
use lagrangian_report::{Headline, Report, Role, Table};

use super::figures;
use super::measured::Measured;
use super::{About, Comparison, Difference, Finding, Ground, Row, Run};

/// Letters of a hash that are shown.
const LETTERS: usize = 12;

impl Row {
    /// What it measures, in words.
    #[must_use]
    pub fn label(&self) -> String {
        let of = match self.signal {
            "torque" => "error of torques",
            "acceleration" => "error of accelerations",
            "position" => "mean error of the position",
            _ => "time for which motions are followed",
        };
        match &self.coordinate {
            Some(name) => format!("{of}, {name}"),
            None => of.into(),
        }
    }

    /// A value of it with its unit; errors of torques and accelerations in percent of their variance.
    #[must_use]
    pub fn shown(&self, value: f64) -> String {
        match self.unit.as_str() {
            "" => format!("{} %", short(100.0 * value)),
            unit => format!("{} {unit}", short(value)),
        }
    }

    /// What follows from a difference, in words.
    #[must_use]
    pub fn word(&self, difference: &Difference) -> &'static str {
        word(difference.finding)
    }

    /// A difference with its interval.
    #[must_use]
    pub fn difference(&self, difference: &Difference) -> String {
        let signed = |x: f64| format!("{}{}", if x > 0.0 { "+" } else { "" }, self.shown(x));
        let (low, high) = difference.range;
        match low.is_finite() && high.is_finite() {
            false => signed(difference.mean),
            true => format!(
                "{} ({} … {})",
                signed(difference.mean),
                signed(low),
                signed(high)
            ),
        }
    }
}

/// The word for what follows from a difference.
fn word(finding: Finding) -> &'static str {
    match finding {
        Finding::Better => "better",
        Finding::Worse => "worse",
        Finding::Within => "within the spread",
        Finding::Unknown => "one block: no spread is known",
    }
}

/// What follows from the differences of figures over all coordinates, and whether the losses can be compared.
pub(super) fn verdict(comparison: &Comparison) -> Vec<String> {
    let mut verdict = Vec::new();
    let first = &comparison.runs[0];
    for (k, other) in comparison.runs.iter().enumerate().skip(1) {
        let parts: Vec<String> = main_rows(comparison)
            .filter_map(|row| sentence(row, row.differences.get(k)?.as_ref()?))
            .collect();
        let parts = match parts.is_empty() {
            true => "the two have no figure in common".into(),
            false => parts.join("; "),
        };
        verdict.push(format!("{} against {}: {parts}.", other.name, first.name));
    }
    for run in comparison.runs.iter().filter(|run| !run.seen.is_empty()) {
        let seen = run.seen.iter().map(|s| format!("{} ({})", s.file, s.role));
        let (name, seen) = (&run.name, seen.collect::<Vec<_>>().join(", "));
        let chosen = run.seen.iter().all(|s| s.role == "validation");
        verdict.push(match chosen {
            true => format!("{name} chose its weights by these data: {seen}. Its errors are a little too good."),
            false => format!(
                "{name} knows these data from its fit: {seen}. Its errors are not those of motions that it has not seen."
            ),
        });
    }
    verdict.push(match comparison.losses_differ.is_empty() {
        true => "The losses of the fits can be compared: they are of one kind, on the same data, prepared alike.".into(),
        false => format!(
            "The losses of the fits cannot be compared: {}. The figures here can, as all models are measured on the same prepared motions.",
            comparison.losses_differ.join("; ")
        ),
    });
    verdict
}

fn main_rows(comparison: &Comparison) -> impl Iterator<Item = &Row> {
    let main = |row: &&Row| row.coordinate.is_none() || row.signal == "position";
    comparison.figures.iter().filter(main)
}

fn sentence(row: &Row, difference: &Difference) -> Option<String> {
    let found = match difference.finding {
        Finding::Better => "is better by",
        Finding::Worse => "is worse by",
        Finding::Within => {
            return Some(format!("{}: no difference beyond its spread", row.label()));
        }
        Finding::Unknown => {
            return Some(format!("{}: too little data to say", row.label()));
        }
    };
    let size = row.shown(difference.mean.abs());
    Some(format!("{} {found} {size}", row.label()))
}

/// The page of a comparison.
pub(super) fn report(
    comparison: &Comparison,
    runs: &[Run],
    ground: &Ground,
    measured: &Measured,
) -> Report {
    let names: Vec<&str> = runs.iter().map(|run| run.name.as_str()).collect();
    let mut drawn = vec![figures::losses(comparison, runs)];
    drawn.extend(figures::blocks(measured, &names));
    if let Some(first) = ground.motions.first() {
        let coordinates = runs[0].model.coordinates();
        drawn.extend(figures::motions(first, coordinates, measured, &names));
        drawn.extend(figures::torques(first, coordinates, measured, &names));
    }
    drawn.retain(|figure| figure.series.iter().any(|series| !series.x.is_empty()));
    let mut tables = vec![
        table(comparison),
        list(comparison),
        settings(comparison),
        data(comparison),
    ];
    tables.retain(|table| !table.rows.is_empty());
    Report {
        title: format!("{} side by side", names.join(", ")),
        subtitle: format!(
            "{} · {} · {}",
            comparison.on,
            counted(comparison.motions, "motion"),
            counted(comparison.samples, "sample")
        ),
        headlines: headlines(comparison),
        summary: comparison.verdict.clone(),
        figures: drawn,
        tables,
        ..Report::default()
    }
}

/// The differences of the main figures.
fn headlines(comparison: &Comparison) -> Vec<Headline> {
    let mut headlines = Vec::new();
    for row in main_rows(comparison) {
        for (k, difference) in row.differences.iter().enumerate() {
            let Some(difference) = difference else {
                continue;
            };
            let (first, other) = (&comparison.runs[0].name, &comparison.runs[k].name);
            let value = row.values[k].map_or("–".into(), |value| row.shown(value));
            let than = row.values[0].map_or("–".into(), |value| row.shown(value));
            let label = format!("{other}: {}", row.label());
            let note = format!("{first}: {than}; {}", word(difference.finding));
            let of_variance = row.values[k].filter(|_| row.unit.is_empty());
            let judged = of_variance.map(|nmse| Judgement {
                grade: Grade::of_error(nmse),
                why: String::new(),
            });
            headlines.push(Headline {
                role: Some(role(k)),
                judged,
                ..Headline::new(&label, value, "", note)
            });
        }
    }
    headlines
}

pub(super) fn role(k: usize) -> Role {
    Role::Other(u8::try_from(k).unwrap_or(u8::MAX))
}

fn table(comparison: &Comparison) -> Table {
    let mut header = vec!["figure".to_string()];
    header.extend(comparison.runs.iter().map(|run| run.name.clone()));
    for run in &comparison.runs[1..] {
        header.push(format!("{} less {}", run.name, comparison.runs[0].name));
        header.push("so it is".into());
    }
    let row = |row: &Row| {
        let mut cells = vec![row.label()];
        let value = |value: &Option<f64>| value.map_or("–".into(), |value| row.shown(value));
        cells.extend(row.values.iter().map(value));
        for difference in &row.differences[1..] {
            let shown = difference
                .as_ref()
                .map(|own| [row.difference(own), word(own.finding).into()]);
            cells.extend(shown.unwrap_or_else(|| ["–".into(), "not known".into()]));
        }
        cells
    };
    Table {
        caption: format!(
            "All models on the same motions ({}). Errors are squared errors over the variance of the signal. In brackets the interval that holds the \
             difference with 95 %, from the differences in blocks of the motions.",
            comparison.on
        ),
        header,
        rows: comparison.figures.iter().map(row).collect(),
        ..Table::default()
    }
}

fn list(comparison: &Comparison) -> Table {
    let row = |run: &About| {
        vec![
            run.name.clone(),
            run.family.clone(),
            run.loss.clone().unwrap_or_else(|| "not known".into()),
            run.least.map_or("–".into(), short),
            run.steps.map_or("–".into(), |steps| steps.to_string()),
            run.seconds
                .map_or("–".into(), |s| format!("{} s", short(s))),
        ]
    };
    let caption = match comparison.losses_differ.is_empty() {
        true => "The fits.",
        false => "The fits. Their losses are of different kinds or data: do not compare them.",
    };
    Table::new(
        caption,
        &["run", "model", "loss", "least, validation", "steps", "time"],
        comparison.runs.iter().map(row).collect(),
    )
}

fn settings(comparison: &Comparison) -> Table {
    let mut header = vec!["setting"];
    header.extend(comparison.runs.iter().map(|run| run.name.as_str()));
    let row = |setting: &super::Setting| {
        let value = |v: &Option<String>| v.clone().unwrap_or_else(|| "–".into());
        let name = setting.name.replace('_', " ");
        std::iter::once(name)
            .chain(setting.values.iter().map(value))
            .collect()
    };
    let rows = comparison.settings.iter().map(row).collect();
    Table::new(
        "Settings that differ; all others are the same.",
        &header,
        rows,
    )
}

fn data(comparison: &Comparison) -> Table {
    let mut header = vec!["SHA-256", "for"];
    header.extend(comparison.runs.iter().map(|run| run.name.as_str()));
    let row = |data: &super::DataUse| {
        let hash = data.sha256.get(..LETTERS).unwrap_or(&data.sha256);
        let path = |path: &Option<String>| path.clone().unwrap_or_else(|| "–".into());
        let cells = [format!("{hash}…"), data.role.clone()].into_iter();
        cells.chain(data.paths.iter().map(path)).collect()
    };
    let rows = comparison.data.iter().map(row).collect();
    Table::new(
        "Files that not all of the fits share, by their hashes.",
        &header,
        rows,
    )
}
