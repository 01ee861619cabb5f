//! The page that every experiment gets of its grid: a summary with published values beside ours, the spread over the
//! seeds, curves, tables, settings and commands.

use lagrangian_report::{Axis, Command, Figure, Headline, Report, Role, Series, Table};

use super::args::Args;
use super::folder::command_line;
use super::results::{Better, Published, Quantity, Results, Row};
use super::spread::{cell, scientific};
use super::{Experiment, Layout};

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

/// A row for each contestant in each group, a column for each quantity; published lines after those of their group.
fn by_quantity(experiment: &Experiment, results: &Results, quantities: &[Quantity]) -> Table {
    let groups = results.groups();
    let grouped = groups.iter().any(|group| !group.is_empty());
    let line = |group: &str, name: String, cells: Vec<String>| {
        let first = grouped.then(|| group.to_string());
        first
            .into_iter()
            .chain([name])
            .chain(cells)
            .collect::<Vec<_>>()
    };
    let mut rows = Vec::new();
    for group in &groups {
        for row in results.rows.iter().filter(|row| row.group == *group) {
            let cells = quantities.iter().map(|q| cell(row.values(q.key)));
            rows.push(line(group, name(row), cells.collect()));
        }
        for published in experiment.published.iter().filter(|p| p.group == *group) {
            let cells = quantities.iter().map(|q| published_cell(published, q));
            rows.push(line(
                group,
                format!("published: {}", published.name),
                cells.collect(),
            ));
        }
    }
    let header = quantities.iter().map(Quantity::heading).collect();
    Table {
        header: line("", "model".into(), header),
        rows,
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
        let of = |group: &&str| {
            let mut rows = results.rows.iter();
            rows.find(|row| row.group == **group && name(row) == *contestant)
                .map_or_else(|| "–".into(), |row| cell(row.values(quantity.key)))
        };
        std::iter::once(contestant.clone())
            .chain(groups.iter().map(of))
            .collect::<Vec<_>>()
    };
    let mut published: Vec<&str> = experiment.published.iter().map(|p| p.name).collect();
    published.dedup();
    let theirs = |known: &&str| {
        let of = |group: &&str| {
            let mut all = experiment.published.iter();
            all.find(|p| p.group == *group && p.name == *known)
                .map_or_else(|| "–".into(), |p| published_cell(p, quantity))
        };
        let first = format!("published: {known}");
        std::iter::once(first)
            .chain(groups.iter().map(of))
            .collect::<Vec<_>>()
    };
    let header = groups.iter().map(|group| (*group).to_string());
    Table {
        header: std::iter::once(quantity.heading()).chain(header).collect(),
        rows: names
            .iter()
            .map(ours)
            .chain(published.iter().map(theirs))
            .collect(),
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
    let value = published
        .values
        .iter()
        .find(|(key, _)| *key == quantity.key);
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
        let published = experiment.published.iter().filter(|p| p.group == *group);
        let published =
            published.map(|p| format!("published {}: {}", p.name, published_cell(p, quantity)));
        let plain = of_group().filter(|row| row.role == Role::Baseline);
        let plain =
            plain.map(|row| format!("{}: {}", row.name, scientific(row.median(quantity.key))));
        let value = main.median(quantity.key);
        value.is_finite().then(|| Headline {
            label: [quantity.name, *group].join(if group.is_empty() { "" } else { ", " }),
            value: scientific(value),
            unit: quantity.unit.into(),
            note: std::iter::once(main.name.clone())
                .chain(published)
                .chain(plain)
                .collect::<Vec<_>>()
                .join("; "),
            role: Some(main.role),
        })
    };
    results
        .groups()
        .iter()
        .filter_map(headline)
        .take(6)
        .collect()
}

/// The first quantity of all contestants of a group, a dot for each seed.
fn spread(experiment: &Experiment, results: &Results, group: &str) -> Option<Figure> {
    let quantity = experiment.quantities.first()?;
    let rows: Vec<&Row> = results
        .rows
        .iter()
        .filter(|row| row.group == group)
        .collect();
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
pub(super) fn report(
    experiment: &Experiment,
    results: Results,
    args: &Args,
    seconds: f64,
) -> Report {
    let mut figures = results.figures();
    figures.extend(
        results
            .groups()
            .iter()
            .filter_map(|group| spread(experiment, &results, group)),
    );
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
        settings: results
            .settings
            .into_iter()
            .chain(settings(args, seconds))
            .collect(),
        commands: vec![Command {
            makes: "This page; all figures as JSON with --json".into(),
            line: command_line(),
        }],
        ..Report::default()
    }
}

fn settings(args: &Args, seconds: f64) -> [(String, String); 4] {
    let length = if args.quick {
        "quick: to see that it works, not for comparisons"
    } else {
        "full"
    };
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    [
        (
            "Seeds",
            format!("{} from {}", args.seeds().len(), args.seed),
        ),
        ("Whole experiment", format!("{seconds:.0} s")),
        ("Threads", threads.to_string()),
        ("Length", length.into()),
    ]
    .map(|(name, value)| (name.to_string(), value))
}

/// A table as lines of text, its columns aligned.
pub(super) fn as_text(table: &Table) -> String {
    let rows: Vec<&Vec<String>> = std::iter::once(&table.header).chain(&table.rows).collect();
    let width = |k: usize| {
        let cells = rows.iter().filter_map(|row| row.get(k));
        cells.map(|cell| cell.chars().count()).max().unwrap_or(0)
    };
    let line = |row: &&Vec<String>| {
        let cells = row
            .iter()
            .enumerate()
            .map(|(k, cell)| format!("{cell:<0$}", width(k)));
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
