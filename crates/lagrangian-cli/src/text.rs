//! A report as text for a terminal: what its page says, without figures.

use lagrangian_report::{Headline, Report, Table};

/// The answer, the subtitle, the headline numbers, the conclusions and the tables of a report.
pub(crate) fn of(report: &Report) -> String {
    let first = [&report.answer, &report.subtitle].map(String::clone);
    let numbers = report.headlines.iter().map(headline);
    let lines = first.into_iter().chain(numbers);
    let lines = lines.chain(report.summary.iter().cloned());
    let lines = lines.filter(|line| !line.is_empty());
    let lines: String = lines.map(|line| line + "\n").collect();
    report
        .tables
        .iter()
        .map(table)
        .fold(lines, |all, own| all + &own)
}

fn headline(own: &Headline) -> String {
    let value = format!("{}: {} {}", own.label, own.value, own.unit);
    let mut parts = vec![value.trim_end().to_string(), own.note.clone()];
    parts.extend(own.judgement.iter().map(|own| own.text()));
    parts.retain(|part| !part.is_empty());
    parts.join(", ")
}

/// A table under its caption, in columns as wide as their widest cells; the verdict on a row ends it.
pub(crate) fn table(table: &Table) -> String {
    if table.rows.is_empty() {
        return String::new();
    }
    let column = |j: usize| Column::of(table, j);
    let columns: Vec<Column> = (0..table.header.len()).map(column).collect();
    let line = |cells: &[String], verdict: &str| {
        let cells = columns
            .iter()
            .zip(cells)
            .map(|(own, cell)| own.padded(cell));
        let cells: Vec<String> = cells.chain([verdict.to_string()]).collect();
        format!("  {}", cells.join("  ")).trim_end().to_string() + "\n"
    };
    let head = if table.judgements.is_empty() {
        ""
    } else {
        "verdict"
    };
    let mut text = format!("\n{}\n{}", table.caption, line(&table.header, head));
    for (k, row) in table.rows.iter().enumerate() {
        let verdict = table.judgements.get(k).and_then(Option::as_ref);
        text += &line(row, &verdict.map_or_else(String::new, |own| own.text()));
    }
    text
}

/// The width of a column, and whether it holds numbers, which are aligned to the right.
struct Column {
    width: usize,
    is_number: bool,
}

impl Column {
    fn of(table: &Table, j: usize) -> Self {
        let cells = || table.rows.iter().filter_map(|row| row.get(j));
        let widths = cells()
            .chain([&table.header[j]])
            .map(|cell| cell.chars().count());
        let begins =
            |cell: &String| cell.starts_with(|c: char| c.is_ascii_digit() || "−–+≥".contains(c));
        Self {
            width: widths.max().unwrap_or(0),
            is_number: cells().all(begins),
        }
    }

    fn padded(&self, cell: &str) -> String {
        let width = self.width;
        match self.is_number {
            true => format!("{cell:>width$}"),
            false => format!("{cell:<width$}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lagrangian::score::{Grade, Judgement};

    #[test]
    fn numbers_stand_below_each_other_and_verdicts_at_the_end() {
        let rows = [["shoulder", "1.20"], ["elbow", "−12.0"]];
        let rows = rows.map(|row| row.map(String::from).to_vec()).to_vec();
        let own = Table::new("Errors.", &["joint", "RMS"], rows);
        let own = own.with_judgements(vec![Some(Judgement::new(Grade::Good, "small")), None]);
        let expected = "\nErrors.\n  joint       RMS  verdict\n  shoulder   1.20  good: small\n  elbow     −12.0\n";
        assert_eq!(table(&own), expected);
    }
}
