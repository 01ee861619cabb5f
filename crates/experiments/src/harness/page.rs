//! The page that every experiment gets of its grid: a summary with published values beside ours, the spread over the
//! seeds, curves, tables, settings and commands.

use lagrangian::score::{Grade, Judgement};
use lagrangian_report::{Axis, Command, Figure, Headline, Report, Role, Series, Table};

use super::folder::command_line;
use super::results::{Better, Published, Quantity, Results, Row};
use super::spread::{cell, median, scientific};
use super::{Experiment, Layout};

/// What is said of a quick run, on its page and in the terminal.
pub(super) const QUICK: &str = "This was a quick run: it shows that the experiment works. Its numbers are no comparison; omit --quick for one.";

/// Says first of all that the numbers of a quick run are no comparison.
pub(super) fn as_quick(mut report: Report) -> Report {
    let judgement = Judgement {
        grade: Grade::Poor,
        why: "to see that it works".into(),
    };
    let headline = Headline {
        judgement: Some(judgement),
        ..Headline::new("These numbers", "no comparison".into(), "", "a quick run")
    };
    report.headlines.insert(0, headline);
    report.summary.insert(0, QUICK.into());
    report
}

/// What a reader wants to know first.
pub(super) fn summary(experiment: &Experiment, results: &Results) -> Table {
    let table = match experiment.layout {
        Layout::Quantities => by_quantity(experiment, results, experiment.quantities),
        Layout::Groups => by_group(experiment, results),
    };
    Table {
        caption: format!(
            "Median (least … largest) of the seeds; “not” counts those without a finite value. {}",
            experiment.about_quantities
        ),
        ..table
    }
}

/// A line of a table.
pub(crate) fn line(first: impl Into<String>, cells: impl Iterator<Item = String>) -> Vec<String> {
    std::iter::once(first.into()).chain(cells).collect()
}

/// A row for each contestant in each group, a column for each quantity; published lines after those of their group.
fn by_quantity(experiment: &Experiment, results: &Results, quantities: &[Quantity]) -> Table {
    let header = line("model", quantities.iter().map(Quantity::heading));
    let mut lines = vec![("", header)];
    let groups = results.groups();
    for group in &groups {
        for row in results.rows.iter().filter(|row| row.group == *group) {
            let cells = quantities.iter().map(|q| cell(row.values(q.key)));
            lines.push((group, line(name(row), cells)));
        }
        for known in experiment.published.iter().filter(|p| p.group == *group) {
            let cells = quantities.iter().map(|q| published_cell(known, q));
            lines.push((group, line(format!("published: {}", known.name), cells)));
        }
    }
    let grouped = groups.iter().any(|group| !group.is_empty());
    let mut rows = lines.into_iter().map(|(group, cells)| match grouped {
        true => line(group, cells.into_iter()),
        false => cells,
    });
    Table {
        header: rows.next().unwrap_or_default(),
        rows: rows.collect(),
        ..Table::default()
    }
}

/// A row for each contestant, a column for each group, of the first quantity alone.
fn by_group(experiment: &Experiment, results: &Results) -> Table {
    let (groups, Some(quantity)) = (results.groups(), experiment.quantities.first()) else {
        return Table::default();
    };
    let mut names: Vec<String> = Vec::new();
    for row in results.rows.iter().map(name) {
        if !names.contains(&row) {
            names.push(row);
        }
    }
    let ours = |contestant: &String| {
        let cells = groups.iter().map(|group| {
            let mut rows = results.rows.iter();
            rows.find(|row| row.group == *group && name(row) == *contestant)
                .map_or_else(|| "–".into(), |row| cell(row.values(quantity.key)))
        });
        line(contestant, cells)
    };
    let mut published: Vec<&str> = experiment.published.iter().map(|p| p.name).collect();
    published.dedup();
    let theirs = |known: &&str| {
        let cells = groups.iter().map(|group| {
            let mut all = experiment.published.iter();
            all.find(|p| p.group == *group && p.name == *known)
                .map_or_else(|| "–".into(), |p| published_cell(p, quantity))
        });
        line(format!("published: {known}"), cells)
    };
    let ours = names.iter().map(ours);
    Table {
        header: line(quantity.heading(), groups.iter().map(ToString::to_string)),
        rows: ours.chain(published.iter().map(theirs)).collect(),
        ..Table::default()
    }
}

fn name(row: &Row) -> String {
    match row.cannot.is_empty() {
        true => row.name.clone(),
        false => format!("{} (cannot express it)", row.name),
    }
}

fn published_cell(published: &Published, quantity: &Quantity) -> String {
    let mut values = published.values.iter();
    let value = values.find(|(key, _)| *key == quantity.key);
    value.map_or_else(|| "–".into(), |(_, value)| scientific(*value))
}

/// The first quantity of the first contestant of each group, beside what is published or the plain network.
fn headlines(experiment: &Experiment, results: &Results) -> Vec<Headline> {
    let Some(quantity) = experiment.quantities.first() else {
        return Vec::new();
    };
    let headline = |group: &&str| {
        let of_group = || results.rows.iter().filter(|row| row.group == **group);
        let main = of_group()
            .find(|row| row.role == Role::Lnn)
            .or(of_group().next())?;
        let median = |row: &Row| median(row.values(quantity.key));
        let published = experiment.published.iter().filter(|p| p.group == *group);
        let published =
            published.map(|p| format!("published {}: {}", p.name, published_cell(p, quantity)));
        let plain = of_group().filter(|row| row.role == Role::Baseline);
        let plain = plain.map(|row| format!("{}: {}", row.name, scientific(median(row))));
        let value = median(main);
        value.is_finite().then(|| Headline {
            label: [quantity.name, *group].join(if group.is_empty() { "" } else { ", " }),
            value: scientific(value),
            unit: quantity.unit.into(),
            note: line(&main.name, published.chain(plain)).join("; "),
            role: Some(main.role),
            judgement: None,
        })
    };
    let groups = results.groups();
    groups.iter().filter_map(headline).take(6).collect()
}

/// The first quantity of all contestants of a group, a dot for each seed.
fn spread(experiment: &Experiment, results: &Results, group: &str) -> Option<Figure> {
    let quantity = experiment.quantities.first()?;
    let rows = results.rows.iter().filter(|row| row.group == group);
    let rows: Vec<&Row> = rows.collect();
    let series = rows.iter().enumerate().map(|(at, row)| {
        let y = row.values(quantity.key).to_vec();
        Series::points(&row.name, row.role, vec![at as f64; y.len()], y)
    });
    let series: Vec<Series> = series.filter(|s| s.y.iter().any(|y| *y > 0.0)).collect();
    let several = rows.len() > 1 && rows.iter().any(|row| row.values(quantity.key).len() > 1);
    let places = (1..=rows.len()).map(|k| k.to_string()).collect();
    let better = match quantity.better {
        Better::Less => " Less is better.",
        Better::More => " More is better.",
        Better::Neither => "",
    };
    (several && !series.is_empty()).then(|| Figure {
        id: format!(
            "spread-{}",
            group.to_lowercase().replace([' ', ',', '%'], "-")
        ),
        title: [quantity.name, group].join(if group.is_empty() { "" } else { ", " }),
        caption: format!("A dot for each seed, contestants in the order of the table.{better}"),
        x: Axis::of_names("contestant", places),
        y: Axis::log(quantity.name, quantity.unit),
        series,
    })
}

/// The whole page.
pub(super) fn report(experiment: &Experiment, results: Results) -> Report {
    let groups = results.groups();
    let spreads = groups
        .iter()
        .filter_map(|g| spread(experiment, &results, g));
    // What no run gave values for is left out, as the learning of models that are solved at once.
    let is_drawn = |series: &Series| series.y.iter().any(|y| y.is_finite());
    let figures = results.figures().into_iter().chain(spreads);
    let figures = figures.filter(|figure| figure.series.iter().any(is_drawn));
    let figures = figures.collect();
    let mut tables = vec![summary(experiment, &results)];
    if !experiment.details.is_empty() {
        tables.push(Table {
            caption: "More of the same runs.".into(),
            ..by_quantity(experiment, &results, experiment.details)
        });
    }
    let text = experiment.text.iter().map(|text| (*text).to_string());
    Report {
        title: experiment.title.into(),
        subtitle: experiment.about.into(),
        headlines: headlines(experiment, &results),
        summary: text.chain(results.text).collect(),
        figures,
        maps: results.maps,
        tables: tables.into_iter().chain(results.tables).collect(),
        settings: results.settings,
        commands: vec![Command {
            makes: "This page; all figures as JSON with --json".into(),
            line: command_line(),
        }],
        ..Report::default()
    }
}

/// A table as lines of text, its columns aligned.
pub(crate) fn as_text(table: &Table) -> String {
    let rows: Vec<&Vec<String>> = std::iter::once(&table.header).chain(&table.rows).collect();
    let width = |k: usize| {
        let cells = rows.iter().filter_map(|row| row.get(k));
        cells.map(|cell| cell.chars().count()).max().unwrap_or(0)
    };
    let line = |row: &&Vec<String>| {
        let cells = row.iter().enumerate();
        let cells = cells.map(|(k, cell)| format!("{cell:<0$}", width(k)));
        cells.collect::<Vec<_>>().join("  ").trim_end().to_string() + "\n"
    };
    rows.iter().map(line).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_columns_of_a_printed_table_are_aligned() {
        let row = |cells: [&str; 2]| cells.map(str::to_string).to_vec();
        let table = Table {
            header: row(["model", "MSE"]),
            rows: vec![row(["δ", "1.0"]), row(["a plain network", "2"])],
            ..Table::default()
        };
        assert_eq!(
            as_text(&table),
            "model            MSE\nδ                1.0\na plain network  2\n"
        );
    }
}
