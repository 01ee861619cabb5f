//! The presentation of a comparison: its verdict in sentences, and its page.

use lagrangian::text::counted;
use lagrangian_report::draw::short;
use lagrangian_report::{Figure, Report, Table};

use super::{Comparison, Difference, Finding, Measure, Row, RunSummary};
use crate::hashing_reader::brief_hash;

impl Measure {
    /// The words of a measure, and the signal where errors are parts of its variance.
    fn words(self) -> (&'static str, Option<&'static str>) {
        match self {
            Self::Torque => ("error of torques", Some("torque")),
            Self::Acceleration => ("error of accelerations", Some("acceleration")),
            Self::Position => ("mean error of the position", None),
            Self::Followed => ("time for which motions are followed", None),
        }
    }

    /// The signal, where errors are parts of its variance.
    pub(super) fn of_variance(self) -> Option<&'static str> {
        self.words().1
    }
}

impl Row {
    /// The measured quantity in words.
    #[must_use]
    pub fn label(&self) -> String {
        let (of, _) = self.signal.words();
        match &self.coordinate {
            Some(name) => format!("{of}, {name}"),
            None => of.into(),
        }
    }

    /// The value of a run with its unit; errors of torques and accelerations in percent of their variance.
    #[must_use]
    pub fn shown(&self, run: usize) -> String {
        self.values[run].map_or_else(none, |value| self.with_unit(value, "%"))
    }

    /// The difference of a run from the first with its interval, and the conclusion from it.
    #[must_use]
    pub fn difference(&self, run: usize) -> Option<[String; 2]> {
        let Difference {
            mean,
            range: (low, high),
            finding,
            ..
        } = *self.differences[run].as_ref()?;
        let signed = |x: f64| format!("{}{}", if x > 0.0 { "+" } else { "" }, self.points(x));
        let interval = match low.is_finite() && high.is_finite() {
            false => String::new(),
            true => format!(" ({} … {})", signed(low), signed(high)),
        };
        let word = match finding {
            Finding::Better => "better",
            Finding::Worse => "worse",
            Finding::Within => "within the spread",
            Finding::Unknown => "one block: no spread is known",
        };
        Some([signed(mean) + &interval, word.into()])
    }

    /// A difference with its unit: percentage points where it is one of parts of a variance.
    fn points(&self, difference: f64) -> String {
        self.with_unit(difference, "points")
    }

    fn with_unit(&self, value: f64, of_variance: &str) -> String {
        let (value, unit) = match self.signal.of_variance() {
            Some(_) => (100.0 * value, of_variance),
            None => (value, self.unit.as_str()),
        };
        format!("{} {unit}", short(value)).trim_end().into()
    }
}

/// The text for a run without a value.
fn none() -> String {
    "–".into()
}

/// The conclusions from differences of figures over all coordinates, and whether the losses can be compared.
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
    let main = |row: &&Row| row.coordinate.is_none() || row.signal == Measure::Position;
    comparison.figures.iter().filter(main)
}

/// The conclusion from the difference of run `k` from the first, with both figures.
fn sentence(row: &Row, k: usize) -> Option<String> {
    let [_, finding] = row.difference(k)?;
    let [own, first] = [k, 0].map(|k| row.shown(k));
    Some(format!("{}: {finding}, {own} against {first}", row.label()))
}

/// The best run by the first figure that all runs have, else that two of them have, and the sentence that states it.
pub(super) fn answer(comparison: &Comparison) -> (Option<String>, String) {
    let whole = |row: &&Row| row.values.iter().all(Option::is_some);
    let mut rows = main_rows(comparison);
    let row = rows.find(whole).or_else(|| main_rows(comparison).next());
    let Some((row, lead)) = row.and_then(|row| Some((row, row.lead.as_ref()?))) else {
        return (None, "No winner: the runs have no figure in common.".into());
    };
    let [best, next] = [lead.best, lead.next].map(|k| &comparison.runs[k].name);
    let [own, other] = [lead.best, lead.next].map(|k| row.shown(k));
    let of = match row.signal.of_variance() {
        Some(_) => " of the variance",
        None => "",
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

/// The page of a comparison, with figures under their headings.
pub(super) fn report(
    comparison: &Comparison,
    figures: impl IntoIterator<Item = (&'static str, Vec<Figure>)>,
) -> Report {
    let names: Vec<&str> = comparison
        .runs
        .iter()
        .map(|run| run.name.as_str())
        .collect();
    let mut tables = vec![
        table(comparison),
        list(comparison),
        settings(comparison, &names),
        data(comparison, &names),
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
    for (heading, own) in figures {
        report.add_figures(heading, own);
    }
    report
}

fn table(comparison: &Comparison) -> Table {
    let runs = &comparison.runs;
    let mut header = vec!["figure".to_string()];
    header.extend(runs.iter().map(|run| run.name.clone()));
    for run in &runs[1..] {
        header.push(format!("{} less {}", run.name, runs[0].name));
        header.push("so it is".into());
    }
    let row = |row: &Row| {
        let mut cells = vec![row.label()];
        cells.extend((0..runs.len()).map(|k| row.shown(k)));
        let differences = (1..runs.len()).map(|k| row.difference(k));
        cells.extend(differences.flat_map(|own| own.unwrap_or([none(), "not known".into()])));
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
    let row = |run: &RunSummary| {
        vec![
            run.name.clone(),
            run.family.clone(),
            run.loss.clone().unwrap_or_else(|| "not known".into()),
            run.least.map_or_else(none, short),
            run.steps.map_or_else(none, |steps| steps.to_string()),
            (run.seconds).map_or_else(none, |s| format!("{} s", short(s))),
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

/// The cells of a row: its names, then a value of each run.
fn cells<const N: usize>(names: [String; N], values: &[Option<String>]) -> Vec<String> {
    let values = values.iter().map(|v| v.clone().unwrap_or_else(none));
    names.into_iter().chain(values).collect()
}

fn settings(comparison: &Comparison, names: &[&str]) -> Table {
    let rows = comparison.settings.iter();
    let rows = rows.map(|own| cells([own.name.replace('_', " ")], &own.values));
    Table::new(
        "Settings that differ; all others are the same.",
        &[&["setting"], names].concat(),
        rows.collect(),
    )
}

fn data(comparison: &Comparison, names: &[&str]) -> Table {
    let rows = comparison.data.iter();
    let rows = rows.map(|own| cells([brief_hash(&own.sha256), own.role.clone()], &own.paths));
    Table::new(
        "Files that not all of the fits share, by their hashes.",
        &[&["SHA-256", "for"], names].concat(),
        rows.collect(),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_of_a_position_without_a_unit_is_not_a_part_of_a_variance() {
        let row = |signal| Row {
            signal,
            coordinate: None,
            unit: String::new(),
            values: vec![Some(0.5)],
            differences: vec![None],
            lead: None,
            blocks: Vec::new(),
        };
        assert_eq!(row(Measure::Position).shown(0), "0.50");
        assert_eq!(row(Measure::Torque).shown(0), "50.0 %");
    }
}
