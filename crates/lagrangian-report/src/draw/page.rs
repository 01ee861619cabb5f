//! The report as one page that needs nothing else: no network, no fonts, no files beside it.

use std::fmt::Write as _;

use serde::Serialize;

use super::{escaped, svg, theme};
use crate::{Animation, Command, Figure, Headline, HeatMap, Panel, Report, Table};

const STYLE: &str = include_str!("page/style.css");
const THEME: &str = include_str!("page/theme.js");
const PLAYER: &str = include_str!("page/player.js");

/// Frames of an animation: 30 a second are smooth, and 4 000 hold two minutes of them.
const RATE: f64 = 30.0;
const MOST_FRAMES: usize = 4_000;

/// Sizes of a figure, px: across the page, in one of two columns, on a phone.
const BROAD: (u32, u32) = (1084, 380);
const WIDE: (u32, u32) = (524, 350);
const NARROW: (u32, u32) = (306, 288);

/// A self-contained page with everything that the report holds.
pub fn html(report: &Report) -> String {
    let mut body = String::new();
    head(&mut body, report);
    section(&mut body, "In motion", &report.animations, |body, all| {
        all.iter().for_each(|one| player(body, one))
    });
    section(&mut body, "Figures", &report.figures, figures);
    section(&mut body, "Space and time", &report.maps, maps);
    section(&mut body, "Tables", &report.tables, |body, all| {
        all.iter().for_each(|one| table(body, one))
    });
    section(&mut body, "Settings", &report.settings, settings);
    section(&mut body, "Make this again", &report.commands, commands);
    let player = if report.animations.is_empty() {
        ""
    } else {
        PLAYER
    };
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">\n\
         <link rel=\"icon\" href=\"data:,\">\n<title>{}</title>\n\
         <style>\n{}{STYLE}{}</style>\n<script>{THEME}</script>\n</head>\n<body>\n<main>\n{body}\
         <footer>Drawn by lagrangian {}. This file needs nothing else: keep it, send it, print it.</footer>\n\
         </main>\n<script>{player}</script>\n</body>\n</html>\n",
        escaped(&report.title),
        theme::variables(),
        theme::classes() + &dots(),
        env!("CARGO_PKG_VERSION"),
    )
}

/// A section with a heading, unless there is nothing in it.
fn section<T>(body: &mut String, heading: &str, items: &[T], fill: impl Fn(&mut String, &[T])) {
    if items.is_empty() {
        return;
    }
    add(body, format_args!("<section>\n<h2>{heading}</h2>\n"));
    fill(body, items);
    body.push_str("</section>\n");
}

fn head(body: &mut String, report: &Report) {
    add(
        body,
        format_args!(
            "<header><h1>{}</h1>\
             <button class=\"theme\" type=\"button\" aria-label=\"Switch between light and dark\">\
             <svg viewBox=\"0 0 24 24\" aria-hidden=\"true\">\
             <path d=\"M12 2a10 10 0 1 0 0 20 10 10 0 0 0 0-20zm0 2.2v15.6a7.8 7.8 0 0 1 0-15.6z\"/></svg></button>\
             <p class=\"subtitle\">{}</p></header>\n",
            escaped(&report.title),
            escaped(&report.subtitle),
        ),
    );
    if !report.headlines.is_empty() {
        body.push_str("<ul class=\"cards\">\n");
        report.headlines.iter().for_each(|one| card(body, one));
        body.push_str("</ul>\n");
    }
    if !report.summary.is_empty() {
        body.push_str("<div class=\"summary\">\n");
        report
            .summary
            .iter()
            .for_each(|sentence| add(body, format_args!("<p>{}</p>\n", escaped(sentence))));
        body.push_str("</div>\n");
    }
}

fn card(body: &mut String, headline: &Headline) {
    let dot = headline
        .role
        .map_or(String::new(), |role| dot(theme::name_of(role)));
    add(
        body,
        format_args!(
            "<li class=\"card\"><span class=\"label\">{dot}{}</span>\
             <span class=\"value\">{}<span class=\"unit\">{}</span></span><span class=\"note\">{}</span></li>\n",
            escaped(&headline.label),
            escaped(&headline.value),
            escaped(&headline.unit),
            escaped(&headline.note),
        ),
    );
}

fn player(body: &mut String, animation: &Animation) {
    let clip = animation.resampled(RATE, MOST_FRAMES);
    let duration = clip.duration();
    add(
        body,
        format_args!(
            "<div class=\"card player\">\n<h3>{}</h3>\n<p class=\"caption\">{}</p>\n<div class=\"panels\">\n",
            escaped(&animation.title),
            escaped(&animation.caption)
        ),
    );
    for panel in &clip.panels {
        let (name, dot) = (escaped(&panel.name), dot(theme::name_of(panel.role)));
        add(
            body,
            format_args!(
                "<figure><canvas role=\"img\" aria-label=\"{name}, moving\"></canvas>\
                 <figcaption><span>{dot}{name}</span><output></output></figcaption></figure>\n"
            ),
        );
    }
    add(
        body,
        format_args!(
            "</div>\n<canvas class=\"strip\" aria-hidden=\"true\"></canvas>\n<div class=\"controls\">\
             <button class=\"play\" type=\"button\">Play</button><span class=\"clock\"></span>\
             <input class=\"slider\" type=\"range\" min=\"0\" max=\"{duration}\" step=\"any\" value=\"0\" \
             aria-label=\"Time\">\
             <label><span class=\"word\">Speed</span> <select class=\"speed\"><option value=\"0.25\">¼×</option><option value=\"0.5\">½×</option>\
             <option value=\"1\" selected>1×</option><option value=\"2\">2×</option><option value=\"5\">5×</option>\
             </select></label><label><input class=\"trails\" type=\"checkbox\" checked> Trails</label></div>\n\
             <script type=\"application/json\">{}</script>\n</div>\n",
            json(&clip)
        ),
    );
}

#[derive(Serialize)]
struct Clip {
    dt: f64,
    duration: f64,
    panels: Vec<ClipPanel>,
}

#[derive(Serialize)]
struct ClipPanel {
    ink: &'static str,
    lengths: Vec<f64>,
    end: f64,
    /// Thousandths of a radian.
    angles: Vec<Option<i64>>,
    error: Option<Vec<Option<f64>>>,
}

/// What the player needs, short, and safe inside a script element.
fn json(clip: &Animation) -> String {
    let duration = clip.duration();
    let frames = clip
        .panels
        .iter()
        .map(|panel| panel.t.len())
        .max()
        .unwrap_or(0);
    let dt = if frames > 1 {
        duration / (frames - 1) as f64
    } else {
        1.0
    };
    let data = Clip {
        dt,
        duration,
        panels: clip.panels.iter().map(clip_panel).collect(),
    };
    serde_json::to_string(&data)
        .unwrap_or_else(|_| "{}".into())
        .replace('<', "\\u003c")
}

fn clip_panel(panel: &Panel) -> ClipPanel {
    let thousandths = |angle: &f64| angle.is_finite().then(|| (angle * 1e3).round() as i64);
    let rounded = |error: &f64| {
        error
            .is_finite()
            .then(|| format!("{error:.2e}").parse().ok())
            .flatten()
    };
    ClipPanel {
        ink: theme::name_of(panel.role),
        lengths: panel
            .lengths
            .iter()
            .map(|length| if length.is_finite() { *length } else { 0.0 })
            .collect(),
        end: panel.t.last().copied().unwrap_or(0.0),
        angles: panel.angles.iter().map(thousandths).collect(),
        error: panel
            .energy_error
            .as_ref()
            .map(|errors| errors.iter().map(rounded).collect()),
    }
}

/// Two columns where there is room; the first of an odd number goes across both.
fn figures(body: &mut String, figures: &[Figure]) {
    let odd = figures.len() % 2 == 1;
    add(
        body,
        format_args!("<div class=\"figures{}\">\n", if odd { " odd" } else { "" }),
    );
    for (k, figure) in figures.iter().enumerate() {
        add(
            body,
            format_args!(
                "<figure class=\"card figure\" id=\"figure-{}\"><figcaption><h3>{}</h3><p class=\"caption\">{}</p>\
                 </figcaption>",
                escaped(&figure.id),
                escaped(&figure.title),
                escaped(&figure.caption)
            ),
        );
        let broad = (odd && k == 0).then_some((BROAD, "broad"));
        for (size, class) in [(WIDE, "wide"), (NARROW, "narrow")]
            .into_iter()
            .chain(broad)
        {
            let drawn = svg::inline(figure, size, class);
            body.push_str(
                &drawn.unwrap_or_else(|error| format!("<p>{}</p>", escaped(&error.to_string()))),
            );
        }
        body.push_str("</figure>\n");
    }
    body.push_str("</div>\n");
}

/// Two columns where there is room.
fn maps(body: &mut String, maps: &[HeatMap]) {
    body.push_str("<div class=\"figures\">\n");
    for map in maps {
        let drawn = svg::inline_map(map, WIDE, "map");
        let drawn = drawn.unwrap_or_else(|error| format!("<p>{}</p>", escaped(&error.to_string())));
        add(
            body,
            format_args!(
                "<figure class=\"card figure\" id=\"map-{}\"><figcaption><h3>{}</h3><p class=\"caption\">{}</p>\
                 </figcaption>{drawn}</figure>\n",
                escaped(&map.id),
                escaped(&map.title),
                escaped(&map.caption)
            ),
        );
    }
    body.push_str("</div>\n");
}

fn table(body: &mut String, table: &Table) {
    let cells = |tag: &str, row: &[String]| {
        row.iter()
            .map(|cell| match tag {
                "td" => format!("<td>{}</td>", breakable(cell)),
                _ => format!("<{tag}>{}</{tag}>", escaped(cell)),
            })
            .collect::<String>()
    };
    let scope = "th scope=\"col\"";
    let header = cells("th", &table.header).replace("<th>", &format!("<{scope}>"));
    let caption = escaped(&table.caption);
    add(
        body,
        format_args!(
            "<div class=\"card table\"><p class=\"caption\">{caption}</p>\
             <div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"{caption}\"><table>\
             <thead><tr>{header}</tr></thead><tbody>\n"
        ),
    );
    table
        .rows
        .iter()
        .for_each(|row| add(body, format_args!("<tr>{}</tr>\n", cells("td", row))));
    body.push_str("</tbody></table></div></div>\n");
}

/// A cell that may be broken where there is no room: between its parts, `a / b` or `a; b`, and before the range of a
/// figure, `median (least … largest)`.
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

/// Letters of a cell beyond which it is read, not compared.
const SENTENCE: usize = 40;

fn part(text: &str) -> String {
    match text
        .split_once(" (")
        .filter(|(_, range)| range.contains('…'))
    {
        None if text.chars().count() > SENTENCE => {
            format!("<span class=\"text\">{}</span>", escaped(text))
        }
        None if text.chars().any(|c| c.is_ascii_digit()) => escaped(text),
        None => format!("<span class=\"words\">{}</span>", escaped(text)),
        Some((figure, range)) => format!(
            "{}<span class=\"range\"> ({}</span>",
            escaped(figure),
            escaped(range)
        ),
    }
}

fn settings(body: &mut String, settings: &[(String, String)]) {
    body.push_str("<dl class=\"card\">\n");
    for (name, value) in settings {
        add(
            body,
            format_args!(
                "<div><dt>{}</dt><dd>{}</dd></div>\n",
                escaped(name),
                escaped(value)
            ),
        );
    }
    body.push_str("</dl>\n");
}

fn commands(body: &mut String, commands: &[Command]) {
    body.push_str("<div class=\"card commands\">\n");
    for Command { makes, line } in commands {
        add(
            body,
            format_args!(
                "<div class=\"command\"><div class=\"makes\">{}</div><div class=\"line\">\
                 <pre tabindex=\"0\"><code>{}</code></pre><button type=\"button\">Copy</button></div></div>\n",
                escaped(makes),
                escaped(line)
            ),
        );
    }
    body.push_str("</div>\n");
}

fn dot(ink: &str) -> String {
    format!("<span class=\"dot {ink}\"></span>")
}

/// CSS: the dots of the theme's inks.
fn dots() -> String {
    theme::INKS
        .iter()
        .map(|ink| format!(".dot.{0}{{background:var(--{0})}}\n", ink.name))
        .collect()
}

fn add(body: &mut String, text: std::fmt::Arguments) {
    body.write_fmt(text).ok(); // OK because writing to a string cannot fail
}
