//! What a comparison says: its verdict in sentences, and its page.

use lagrangian::{Model, counted};

use lagrangian_report::draw::short;
use lagrangian_report::{Figure, Report, Role, Table};

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
        let signed = |x: f64| format!("{}{}", if x > 0.0 { "+" } else { "" }, self.points(x));
        let (mean, (low, high)) = (signed(difference.mean), difference.range);
        match low.is_finite() && high.is_finite() {
            false => mean,
            true => format!("{mean} ({} … {})", signed(low), signed(high)),
        }
    }

    /// A difference with its unit: percentage points where it is one of parts of a variance.
    fn points(&self, difference: f64) -> String {
        match self.unit.as_str() {
            "" => format!("{} points", short(100.0 * difference)),
            unit => format!("{} {unit}", short(difference)),
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
            .filter_map(|row| sentence(row, k))
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

/// What the difference of run `k` from the first says, with both figures.
fn sentence(row: &Row, k: usize) -> Option<String> {
    let found = match row.differences.get(k)?.as_ref()?.finding {
        Finding::Better => "better",
        Finding::Worse => "worse",
        Finding::Within => "no difference beyond its spread",
        Finding::Unknown => "too little data to say",
    };
    let [own, first] = [row.values[k]?, row.values[0]?].map(|value| row.shown(value));
    Some(format!("{}: {found}, {own} against {first}", row.label()))
}

/// The best run by the first figure that all runs have, else that two of them have, and the sentence that says so.
pub(super) fn answer(comparison: &Comparison) -> (Option<String>, String) {
    let whole = |row: &&Row| row.values.iter().all(Option::is_some);
    let mut rows = main_rows(comparison);
    let row = rows.find(whole).or_else(|| main_rows(comparison).next());
    let Some((row, lead)) = row.and_then(|row| Some((row, row.lead.as_ref()?))) else {
        return (None, "No winner: the runs have no figure in common.".into());
    };
    let [best, next] = [lead.best, lead.next].map(|k| &comparison.runs[k].name);
    let [own, other] =
        [lead.best, lead.next].map(|k| row.values[k].map_or("–".into(), |x| row.shown(x)));
    let of = if row.unit.is_empty() {
        " of the variance"
    } else {
        ""
    };
    let figures = format!("{} {own}{of} against {other}", row.label());
    let (low, high) = lead.difference.range;
    let (low, high) = (low.abs().min(high.abs()), low.abs().max(high.abs()));
    let winner = lead.difference.finding == Finding::Better;
    let text = match lead.difference.finding {
        Finding::Better => format!(
            "{best} is better than {next}: {figures}; with 95 % certainty by {} to {}.{}",
            row.points(low),
            row.points(high),
            match comparison.runs[lead.best].seen.is_empty() {
                true => "",
                false => " But it knows these data from its fit.",
            }
        ),
        Finding::Unknown => format!(
            "No sure winner: {best} leads {next}, {figures}, but one block of motion does not tell how sure that is."
        ),
        _ => format!("No winner: {best} and {next} differ by less than their spread, {figures}."),
    };
    (winner.then(|| best.clone()), text)
}

/// The page of a comparison.
pub(super) fn report(
    comparison: &Comparison,
    runs: &[Run],
    ground: &Ground,
    measured: &Measured,
) -> Report {
    let names: Vec<&str> = runs.iter().map(|run| run.name.as_str()).collect();
    let mut drawn: Vec<Figure> = figures::blocks(measured, &names).into_iter().collect();
    if let Some(first) = ground.motions.first() {
        let coordinates = runs[0].model.coordinates();
        drawn.extend(figures::motions(first, coordinates, measured, &names));
        drawn.extend(figures::torques(first, coordinates, measured, &names));
    }
    let drawable = |figure: &Figure| figure.series.iter().any(|series| !series.x.is_empty());
    drawn.retain(drawable);
    let mut tables = vec![
        table(comparison),
        list(comparison),
        settings(comparison),
        data(comparison),
    ];
    tables.retain(|table| !table.rows.is_empty());
    let mut report = Report {
        title: format!("{} side by side", names.join(", ")),
        subtitle: format!(
            "{} · {} · {}",
            comparison.on,
            counted(comparison.motions, "motion"),
            counted(comparison.samples, "sample")
        ),
        answer: comparison.answer.clone(),
        summary: comparison.verdict.clone(),
        tables,
        ..Report::default()
    };
    report.add_figures("Errors and motions", drawn);
    report.add_figures(
        "Training",
        Some(figures::losses(comparison, runs)).filter(drawable),
    );
    report
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
            "All models on the same motions ({}). Errors are squared errors over the variance of the signal, their differences in percentage points. In brackets the interval that holds the \
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
