//! The report as one self-contained page: no network, no fonts, no other files.

mod arrays;
mod figures;
mod film;
mod player;
mod plots;
mod tables;
mod terms;
mod words;

use plots::Plots;

use lagrangian::score::Grade;

use super::theme::Ink;
use super::{escaped, theme};
use crate::{Figure, Headline, Report};
use terms::explained;

const STYLE: &str = include_str!("page/style.css");
const PLOT_STYLE: &str = include_str!("page/plot/style.css");
const THEME: &str = include_str!("page/theme.js");
const PLAYER: &str = include_str!("page/player.js");
const FILM: &str = include_str!("page/film.js");
/// The library that draws plots, and its style.
const LIBRARY: &str = include_str!("page/uplot/uPlot.iife.min.js");
const LIBRARY_STYLE: &str = include_str!("page/uplot/uPlot.min.css");
/// The parts of the script of plots, in order of dependence.
const PLOT: [&str; 8] = [
    include_str!("page/plot/arrays.js"),
    include_str!("page/plot/axis.js"),
    include_str!("page/plot/paint.js"),
    include_str!("page/plot/hands.js"),
    include_str!("page/plot/plot.js"),
    include_str!("page/plot/legend.js"),
    include_str!("page/plot/save.js"),
    include_str!("page/plot/start.js"),
];
/// Forbids all loading: the page contains everything that it needs.
const POLICY: &str = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data:; \
    base-uri 'none'; form-action 'none'";

/// A self-contained page with the complete report.
#[must_use]
pub fn html(report: &Report) -> String {
    let mut body = String::new();
    let energies: Vec<Option<Figure>> = report.animations.iter().map(player::energy).collect();
    let mut plots = Plots::for_figures(report.figures.iter().chain(energies.iter().flatten()));
    head(&mut body, report);
    let sections = sections(report, &energies, &mut plots);
    contents(&mut body, &sections);
    sections.iter().for_each(|one| one.write(&mut body));
    terms::meanings(&mut body);
    let scripts = scripts(report, &plots);
    let library_style = if plots.is_empty() { "" } else { LIBRARY_STYLE };
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"{POLICY}\">\n\
         <meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">\n\
         <link rel=\"icon\" href=\"data:,\">\n<title>{}</title>\n\
         <style>\n{}{STYLE}{library_style}{PLOT_STYLE}{}</style>\n<script>{THEME}</script>\n</head>\n<body>\n<main>\n{body}\
         <footer>Drawn by lagrangian {}. This file needs nothing else: keep it, send it, print it.</footer>\n\
         </main>\n{scripts}</body>\n</html>\n",
        escaped(&report.title),
        theme::variables(),
        theme::dots(),
        env!("CARGO_PKG_VERSION"),
    )
}

/// The scripts that the page needs, and the data of its plots.
fn scripts(report: &Report, plots: &Plots) -> String {
    let mut scripts = String::new();
    if !report.animations.is_empty() {
        put!(&mut scripts, "<script>{PLAYER}</script>\n");
    }
    if report.animations.iter().any(|one| one.film.is_some()) {
        put!(&mut scripts, "<script>{FILM}</script>\n");
    }
    if let Some(data) = plots.json() {
        // One script has all parts: what they import from each other is in it.
        let lines = PLOT.iter().flat_map(|part| part.lines());
        let own: Vec<&str> = lines.filter(|line| !line.starts_with("import ")).collect();
        let own = own.join("\n");
        put!(
            &mut scripts,
            "<script type=\"application/json\" id=\"plots\">{data}</script>\n<script>{LIBRARY}</script>\n\
                 <script type=\"module\">\n{own}\n</script>\n"
        );
    }
    scripts
}

/// A part of the page that can be folded.
struct Section {
    heading: String,
    body: String,
    is_open: bool,
}

/// Number of figures above which a page shows those of the first section, and folds the others.
const MOST_SHOWN: usize = 20;
/// Number of settings above which they are folded.
const MOST_SETTINGS: usize = 12;

/// The parts of the page that are not empty, in their order.
fn sections(report: &Report, energies: &[Option<Figure>], plots: &mut Plots) -> Vec<Section> {
    let mut all = Vec::new();
    all.extend(section("In motion", &report.animations, |body, all| {
        for (one, energy) in all.iter().zip(energies) {
            match &one.film {
                Some(film) => film::film(body, one, film),
                None => player::player(body, one, energy.as_slice(), plots),
            }
        }
    }));
    let (mut rest, first) = (&report.figures[..], all.len());
    let headings = report
        .headings
        .iter()
        .map(|own| (own.text.as_str(), own.figures));
    for (heading, count) in headings.chain([("Figures", usize::MAX)]) {
        let (own, others) = rest.split_at(count.min(rest.len()));
        rest = others;
        let made = section(heading, own, |body, all| figures::figures(body, all, plots));
        let is_open = all.len() == first || report.figures.len() <= MOST_SHOWN;
        all.extend(made.map(|own| Section { is_open, ..own }));
    }
    all.extend(section("Maps", &report.maps, |body, all| {
        figures::maps(body, all, plots)
    }));
    all.extend(section("Tables", &report.tables, |body, all| {
        all.iter().for_each(|one| tables::table(body, one));
    }));
    let settings = section("Settings", &report.settings, tables::settings);
    let is_open = report.settings.len() <= MOST_SETTINGS;
    all.extend(settings.map(|own| Section { is_open, ..own }));
    all.extend(section(
        "Make this again",
        &report.commands,
        tables::commands,
    ));
    all
}

/// A section with a heading, unless it is empty.
fn section<T>(heading: &str, items: &[T], fill: impl FnOnce(&mut String, &[T])) -> Option<Section> {
    let mut body = String::new();
    fill(&mut body, items);
    (!items.is_empty()).then(|| Section {
        heading: heading.into(),
        body,
        is_open: true,
    })
}

impl Section {
    fn id(&self) -> String {
        format!("section-{}", self.heading.to_lowercase().replace(' ', "-"))
    }

    fn write(&self, body: &mut String) {
        let (id, heading, own) = (escaped(&self.id()), escaped(&self.heading), &self.body);
        let open = if self.is_open { " open" } else { "" };
        put!(
            body,
            "<details class=\"section\" id=\"{id}\"{open}><summary><h2>{heading}</h2></summary>\n{own}</details>\n"
        );
    }
}

/// Links to the sections, which stay in view, if there are several.
fn contents(body: &mut String, sections: &[Section]) {
    if sections.len() < 3 {
        return;
    }
    let link = |one: &Section| {
        format!(
            "<li><a href=\"#{}\">{}</a></li>",
            escaped(&one.id()),
            escaped(&one.heading)
        )
    };
    let links: String = sections.iter().map(link).collect();
    put!(
        body,
        "<nav class=\"contents\" aria-label=\"Contents\"><ul>{links}</ul></nav>\n"
    );
}

fn head(body: &mut String, report: &Report) {
    put!(
        body,
        "<header><h1>{}</h1>\
             <button class=\"theme\" type=\"button\" aria-label=\"Switch between light and dark\">\
             <svg viewBox=\"0 0 24 24\" aria-hidden=\"true\">\
             <path d=\"M12 2a10 10 0 1 0 0 20 10 10 0 0 0 0-20zm0 2.2v15.6a7.8 7.8 0 0 1 0-15.6z\"/></svg></button>\
             <p class=\"subtitle\">{}</p></header>\n",
        escaped(&report.title),
        escaped(&report.subtitle),
    );
    if !report.answer.is_empty() {
        let answer = explained(&report.answer);
        put!(body, "<p class=\"answer\">{answer}</p>\n");
    }
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
            .for_each(|sentence| put!(body, "<p>{}</p>\n", explained(sentence)));
        body.push_str("</div>\n");
    }
}

fn card(body: &mut String, headline: &Headline) {
    let dot = headline
        .role
        .map_or(String::new(), |role| dot(theme::of(role)));
    let judgement = headline.judgement.as_ref();
    let class = judgement.map_or("card", |own| match own.grade {
        Grade::Good => "card good",
        Grade::Fair => "card fair",
        Grade::Poor => "card poor",
    });
    let chip = judgement.filter(|own| headline.value != own.grade.name());
    let chip = chip.map_or(String::new(), |own| {
        format!("<span class=\"judgement\">{}</span>", tables::chip(own))
    });
    put!(
        body,
        "<li class=\"{class}\"><span class=\"label\">{dot}{}</span>\
             <span class=\"value\">{}<span class=\"unit\">{}</span></span>{chip}<span class=\"note\">{}</span></li>\n",
        explained(&headline.label),
        escaped(&headline.value),
        escaped(&headline.unit),
        explained(&headline.note),
    );
}

/// A dot in the colour of a role.
fn dot(ink: Ink) -> String {
    format!("<span class=\"dot {}\"></span>", ink.name)
}
