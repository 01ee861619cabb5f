//! The tables of a page, its settings and its commands.

use lagrangian::score::Judgement;

use super::terms::explained;
use crate::draw::escaped;
use crate::{Command, Table};

/// Number of rows above which a table is folded.
const FOLDED: usize = 12;

/// A table that scrolls if it is wider than the page, and that is folded if it is long.
pub(super) fn table(body: &mut String, table: &Table) {
    // A column without a name has no heading.
    let heading = |cell: &String| match cell.as_str() {
        "" => "<td></td>".into(),
        name => format!("<th scope=\"col\">{}</th>", explained(name)),
    };
    let verdict = (!table.judgements.is_empty())
        .then(|| "<th scope=\"col\" class=\"verdict\">verdict</th>".to_string());
    let header = table.header.iter().map(heading).chain(verdict);
    let header: String = header.collect();
    let caption = escaped(&table.caption);
    let [fold, end] = fold(table.rows.len());
    put!(
        body,
        "<div class=\"card table\"><p class=\"caption\">{}</p>{fold}\
             <div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"{caption}\"><table>\
             <thead><tr>{header}</tr></thead><tbody>\n",
        explained(&table.caption)
    );
    for (k, row) in table.rows.iter().enumerate() {
        let verdict = table.judgements.get(k).map(|judgement| {
            let chip = judgement.as_ref().map(chip).unwrap_or_default();
            format!("<td class=\"verdict\">{chip}</td>")
        });
        let cells = row
            .iter()
            .map(|cell| format!("<td>{}</td>", breakable(cell)))
            .chain(verdict);
        put!(body, "<tr>{}</tr>\n", cells.collect::<String>());
    }
    put!(body, "</tbody></table></div>{end}</div>\n");
}

/// The text before and after the rows of a table: empty, or the elements that fold them.
fn fold(rows: usize) -> [String; 2] {
    match rows {
        0..=FOLDED => Default::default(),
        _ => [
            format!("<details class=\"rows\"><summary>{rows} rows</summary>"),
            "</details>".into(),
        ],
    }
}

/// A cell with possible line breaks: between its parts, `a / b` or `a; b`, and before the range of a
/// number, `median (least … largest)`.
fn breakable(cell: &str) -> String {
    let separator = if cell.contains(" / ") { " / " } else { "; " };
    let parts: Vec<String> = cell.split(separator).map(part).collect();
    match &parts[..] {
        [one] => one.clone(),
        parts => format!(
            "<span class=\"part\">{}</span>",
            parts.join(&format!("{separator}</span><span class=\"part\">"))
        ),
    }
}

/// Number of letters above which a cell is a sentence, which is not compared with others.
const SENTENCE: usize = 40;

/// The words of verdicts, which are coloured if they are a whole cell or part of one.
const GRADES: [&str; 3] = ["good", "fair", "poor"];

/// One part of a cell: a number with or without its range, a word, or a sentence.
fn part(text: &str) -> String {
    let range = text
        .split_once(" (")
        .filter(|(_, range)| range.contains('…'));
    if let Some((figure, range)) = range {
        let (figure, range) = (escaped(figure), escaped(range));
        return format!("{figure}<span class=\"range\"> ({range}</span>");
    }
    if GRADES.contains(&text) {
        return format!("<span class=\"grade {text}\">{text}</span>");
    }
    let class = if text.chars().count() > SENTENCE {
        "text"
    } else if text.chars().any(|c| c.is_ascii_digit()) {
        return escaped(text);
    } else {
        "words"
    };
    format!("<span class=\"{class}\">{}</span>", escaped(text))
}

/// A verdict: its coloured word, and the reason.
pub(super) fn chip(judgement: &Judgement) -> String {
    let word = judgement.grade.name();
    let why = match judgement.why.is_empty() {
        true => String::new(),
        false => format!(" <span class=\"why\">{}</span>", explained(&judgement.why)),
    };
    format!("<span class=\"grade {word}\">{word}</span>{why}")
}

/// The settings of a run, by name.
pub(super) fn settings(body: &mut String, settings: &[(String, String)]) {
    body.push_str("<dl class=\"card\">\n");
    for (name, value) in settings {
        let (name, value) = (escaped(name), escaped(value));
        put!(body, "<div><dt>{name}</dt><dd>{value}</dd></div>\n");
    }
    body.push_str("</dl>\n");
}

/// The lines to enter, each with a button that copies it.
pub(super) fn commands(body: &mut String, commands: &[Command]) {
    body.push_str("<div class=\"card commands\">\n");
    for Command { makes, line } in commands {
        put!(
            body,
            "<div class=\"command\"><div class=\"makes\">{}</div><div class=\"line\">\
                 <pre tabindex=\"0\"><code>{}</code></pre><button type=\"button\">Copy</button></div></div>\n",
            escaped(makes),
            escaped(line)
        );
    }
    body.push_str("</div>\n");
}
