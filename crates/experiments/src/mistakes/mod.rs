//! Plausible mistakes in otherwise good data, and the stage at which each is found.

pub(crate) mod case;
pub(crate) mod sources;
mod stages;
mod table;

use anyhow::Result;
use lagrangian::Verdict;
use lagrangian::check::Item;
use lagrangian_report::{Role, Table};
use serde_json::{Value, json};

use crate::harness::failure::mistake;
use crate::harness::{Experiment, Lab, neither};
use case::Case;
use sources::SIX;
use stages::{Checked, Fitted, checked, fitted};
use table::{MISTAKES, Mistake, with_accelerations};

pub(crate) const EXPERIMENT: Experiment = Experiment {
    name: "mistakes",
    about: "plausible mistakes in good data, and which stage finds each",
    run,
    title: "Wrong data must not pass in silence",
    text: &[
        "Each mistake is made by one function from good data: an arm of three joints with friction and noise (simulated, 250 Hz), free motions \
         of a double pendulum (simulated, 200 Hz), and the log of a real UR10 (125 Hz, where the reference data are present). The table \
         names the first stage that says so: reading (refused), the check (the name of the finding; “fail” ends a fit, “doubt” lets none be called \
         good, “warn” is printed), or the verdict of a fit, where it is worse, or has another reason, than that of the good data.",
        "With --quick nothing is fitted, and the UR10 is omitted.",
    ],
    parts: Some(PARTS),
    quantities: &[
        neither("made", "mistakes", ""),
        neither("refused", "refused when read", ""),
        neither("failed", "the check fails", ""),
        neither("doubted", "the check doubts", ""),
        neither("warned", "the check warns", ""),
        neither("fitted", "the fit is refused, or worse", ""),
        neither("unknowable", "not to be told from data", ""),
        neither("silent", "in silence", ""),
    ],
    about_quantities: "Mistakes by the stage at which they are found.",
    ..Experiment::EMPTY
};

/// A source of good data: its name, and where they come from.
type Source = (&'static str, fn(&Lab) -> Result<Option<Case>>);

/// The names of the sources.
const PARTS: &str = "arm, free double pendulum, ur10_real, six of an arm, six pendulums, six double pendulums, six carts, six Furuta pendulums \
                     or six free double pendulums";

const SOURCES: [Source; 9] = [
    ("arm", sources::arm),
    ("free double pendulum", sources::pendulum),
    ("ur10_real", sources::ur10),
    ("six of an arm", sources::six_of_arm),
    ("six pendulums", |_| SIX[0].case(1).map(Some)),
    ("six double pendulums", |_| SIX[1].case(1).map(Some)),
    ("six carts", |_| SIX[2].case(1).map(Some)),
    ("six Furuta pendulums", |_| SIX[3].case(1).map(Some)),
    ("six free double pendulums", |_| SIX[4].case(1).map(Some)),
];

/// The time of the fit of a network, s.
const SECONDS: f64 = 4.0;

/// How a mistake ends: the quantity that counts it, the cell of the table, and what was said.
struct End {
    quantity: &'static str,
    text: String,
    said: String,
}

impl End {
    fn new(quantity: &'static str, text: impl Into<String>, said: impl Into<String>) -> Self {
        Self {
            quantity,
            text: text.into(),
            said: said.into(),
        }
    }
}

fn run(lab: &mut Lab) -> Result<()> {
    let sources = chosen(lab)?;
    lab.plan(sources.len() * MISTAKES.len());
    let mut columns = Vec::new();
    for (name, make) in sources {
        let Some(good) = make(lab)? else { continue };
        let ends = ends(lab, name, &good)?;
        tally(lab, name, &ends);
        columns.push((name, ends));
        lab.write("mistakes.md", markdown(&matrix(&columns)).as_bytes())?;
    }
    lab.results.tables.push(matrix(&columns));
    Ok(())
}

/// The sources that are asked for.
fn chosen(lab: &Lab) -> Result<Vec<Source>> {
    let count = if lab.quick() { 2 } else { SOURCES.len() };
    let Some(only) = &lab.args.only else {
        return Ok(SOURCES[..count].to_vec());
    };
    let named: Vec<Source> = SOURCES.into_iter().filter(|s| s.0 == only).collect();
    match named.is_empty() {
        true => Err(mistake(
            format!("the experiment 'mistakes' has no part '{only}'"),
            format!("give --only one of: {PARTS}"),
        )),
        false => Ok(named),
    }
}

/// What the stages say of good data.
struct Good {
    /// Without and with accelerations.
    checked: [Checked; 2],
    /// Without and with the description, where something is fitted.
    fitted: Option<[Fitted; 2]>,
}

impl Good {
    fn of(lab: &mut Lab, good: &Case) -> Self {
        let checked = [checked(good), checked(&with_accelerations(good))];
        let plain = Case {
            urdf: None,
            ..good.clone()
        };
        let mut fit = |case: &Case| fitted(case, &checked[0], SECONDS, &mut lab.progress);
        let fitted = (!lab.args.quick).then(|| [fit(&plain), fit(good)]);
        Self { checked, fitted }
    }
}

/// How each mistake ends for one source; none where it cannot be made.
fn ends(lab: &mut Lab, source: &str, good: &Case) -> Result<Vec<Option<End>>> {
    lab.begin(format!("{source}, good data"))?;
    let base = Good::of(lab, good);
    let mut ends = Vec::new();
    for mistake in MISTAKES {
        lab.begin(format!("{source}, {}", mistake.name))?;
        let case = mistake.made(good);
        ends.push(case.map(|case| end(lab, mistake, &base, &case)));
        lab.progress.check()?;
    }
    Ok(ends)
}

fn end(lab: &mut Lab, mistake: &Mistake, base: &Good, case: &Case) -> End {
    let found = checked(case);
    if let Checked::Refused(said) = &found {
        return End::new("refused", "refused", said);
    }
    if let Some(item) = found.news(&base.checked[usize::from(mistake.needs_accelerations())]) {
        let (quantity, word) = match item {
            Item {
                verdict: Verdict::Fail,
                ..
            } => ("failed", "fail"),
            Item { doubtful: true, .. } => ("doubted", "doubt"),
            _ => ("warned", "warn"),
        };
        return End::new(quantity, format!("{word}: {}", item.name), &item.finding);
    }
    // What the check says needs no fit: a doubt is part of its verdict.
    if let Some(good) = &base.fitted {
        let fit = fitted(case, &found, SECONDS, &mut lab.progress);
        if let Some(reason) = fit.news(&good[usize::from(case.urdf.is_some())]) {
            return End::new("fitted", format!("fit: {}", fit.word()), reason);
        }
    }
    match mistake.unknowable {
        Some(_) => End::new("unknowable", "not from data", ""),
        None => End::new("silent", "—", ""),
    }
}

/// Counts the ends of a source.
fn tally(lab: &mut Lab, source: &str, ends: &[Option<End>]) {
    let said = MISTAKES.iter().zip(ends).filter_map(|(mistake, end)| {
        let End { text, said, .. } = end.as_ref()?;
        Some((
            mistake.name.to_string(),
            json!({ "end": text, "said": said }),
        ))
    });
    let said: serde_json::Map<String, Value> = said.collect();
    let row = lab.results.row("", source, source, Role::Lnn);
    row.detail("ends", said);
    row.add("made", ends.iter().flatten().count() as f64);
    for quantity in [
        "refused",
        "failed",
        "doubted",
        "warned",
        "fitted",
        "unknowable",
        "silent",
    ] {
        let own = ends.iter().flatten().filter(|e| e.quantity == quantity);
        row.add(quantity, own.count() as f64);
    }
}

/// A row for each mistake, a column for each source.
fn matrix(columns: &[(&str, Vec<Option<End>>)]) -> Table {
    let names = columns.iter().map(|(name, _)| (*name).to_string());
    let header = ["mistake".to_string()].into_iter().chain(names).collect();
    let row = |(k, mistake): (usize, &Mistake)| {
        let cell = |(_, ends): &(&str, Vec<Option<End>>)| {
            ends[k]
                .as_ref()
                .map_or_else(String::new, |end| end.text.clone())
        };
        let cells = columns.iter().map(cell);
        [mistake.name.to_string()]
            .into_iter()
            .chain(cells)
            .collect()
    };
    Table {
        caption: "The stage at which each mistake is found; empty where it cannot be made.".into(),
        header,
        rows: MISTAKES.iter().enumerate().map(row).collect(),
        ..Table::default()
    }
}

/// The table as Markdown, followed by why some mistakes cannot be told from data.
fn markdown(table: &Table) -> String {
    let line = |cells: &[String]| format!("| {} |\n", cells.join(" | "));
    let mut text = line(&table.header);
    text += &line(&vec!["---".to_string(); table.header.len()]);
    text.extend(table.rows.iter().map(|row| line(row)));
    text.push('\n');
    for mistake in MISTAKES {
        if let Some(why) = mistake.unknowable {
            text += &format!("- *{}*: {why}.\n", mistake.name);
        }
    }
    text
}
