//! The figures and maps of a page: a box for the plot of each, which the script draws, in groups that share a legend.

use super::plots::{Plots, words_id};
use super::terms::explained;
use super::words;
use crate::draw::escaped;
use crate::{Figure, HeatMap, Series};

/// Figures in two columns where they fit; consecutive ones with equal series have one legend.
pub(super) fn figures(body: &mut String, figures: &[Figure], plots: &mut Plots) {
    for group in groups(figures) {
        let odd = if group.figures.len() % 2 == 1 {
            " odd"
        } else {
            ""
        };
        let shared = if group.shared { " shared" } else { "" };
        put!(
            body,
            "<div class=\"group{shared}\"><div class=\"figures{odd}\">\n"
        );
        for figure in group.figures {
            let card = Card {
                id: format!("figure-{}", figure.id),
                title: &figure.title,
                caption: &figure.caption,
                words: words::of_figure(figure),
                number: plots.figure(figure),
            };
            card.write(body);
        }
        body.push_str("</div></div>\n");
    }
}

/// Maps in two columns where they fit.
pub(super) fn maps(body: &mut String, maps: &[HeatMap], plots: &mut Plots) {
    body.push_str("<div class=\"group\"><div class=\"figures\">\n");
    for map in maps {
        let card = Card {
            id: format!("map-{}", map.id),
            title: &map.title,
            caption: &map.caption,
            words: words::of_map(map),
            number: plots.map(map),
        };
        card.write(body);
    }
    body.push_str("</div></div>\n");
}

const EMPTY: &str = "<p class=\"empty\">There is nothing to draw: no value is finite, or none is positive on a logarithmic axis.</p>";

const NO_SCRIPT: &str = "<noscript><p class=\"caption\">Scripts are off: the figure is not drawn. Its range is told above, the tables of this \
    page have the results, and with scripts each figure saves its numbers as CSV.</p></noscript>";

struct Card<'a> {
    id: String,
    title: &'a str,
    caption: &'a str,
    words: String,
    /// The number of its plot, if there is something to draw.
    number: Option<usize>,
}

impl Card<'_> {
    fn write(&self, body: &mut String) {
        let [id, title, words] = [&self.id, self.title, &self.words].map(escaped);
        let caption = explained(self.caption);
        let (live, drawn) = match self.number {
            None => (String::new(), EMPTY.into()),
            Some(number) => (
                format!(" data-plot=\"{number}\""),
                format!(
                    "<p class=\"unseen\" id=\"{}\">{words}</p><div class=\"plot\"></div>{NO_SCRIPT}",
                    words_id(number)
                ),
            ),
        };
        let caption = if caption.is_empty() {
            caption
        } else {
            format!("<p class=\"caption\">{caption}</p>")
        };
        put!(
            body,
            "<figure class=\"card figure\" id=\"{id}\"{live}><figcaption><h3>{title}</h3>{caption}</figcaption>\
                 {drawn}</figure>\n"
        );
    }
}

/// Consecutive figures.
#[derive(Debug, PartialEq)]
struct Group<'a> {
    figures: &'a [Figure],
    /// Whether they have one legend.
    shared: bool,
}

/// Runs of figures with equal series, and runs of other figures.
fn groups(figures: &[Figure]) -> Vec<Group<'_>> {
    let mut groups: Vec<Group> = Vec::new();
    let mut start = 0;
    let mut single_from = 0;
    while start < figures.len() {
        let rest = &figures[start..];
        let alike = rest
            .windows(2)
            .take_while(|pair| share_series(&rest[0], &pair[1]));
        let end = start + 1 + alike.count();
        if end - start > 1 {
            push_single(&mut groups, &figures[single_from..start]);
            groups.push(Group {
                figures: &figures[start..end],
                shared: true,
            });
            single_from = end;
        }
        start = end;
    }
    push_single(&mut groups, &figures[single_from..]);
    groups
}

fn push_single<'a>(groups: &mut Vec<Group<'a>>, figures: &'a [Figure]) {
    if !figures.is_empty() {
        groups.push(Group {
            figures,
            shared: false,
        });
    }
}

/// Whether one legend serves both: at least half of the names are common, and each name has the same style in both.
fn share_series(a: &Figure, b: &Figure) -> bool {
    fn named(figure: &Figure) -> Vec<&Series> {
        let series = figure.series.iter();
        series.filter(|one| !one.name.is_empty()).collect()
    }
    let (a, b) = (named(a), named(b));
    let twin = |one: &&Series| b.iter().find(|other| other.name == one.name).copied();
    let twins: Vec<(&Series, &Series)> = a
        .iter()
        .filter_map(|one| Some((*one, twin(one)?)))
        .collect();
    let alike = twins
        .iter()
        .all(|(one, other)| one.role == other.role && one.kind == other.kind);
    alike && !twins.is_empty() && 2 * twins.len() >= a.len().max(b.len())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Role;

    fn figure(names: &[&str]) -> Figure {
        let line = |name: &&str| Series::line(name, Role::Lnn, vec![0.0, 1.0], vec![0.0, 1.0]);
        Figure {
            series: names.iter().map(line).collect(),
            ..Figure::default()
        }
    }

    #[test]
    fn figures_that_share_their_series_stand_together() {
        let all = [
            figure(&["loss"]),
            figure(&["gravity", "inertial", "measured"]),
            figure(&["gravity", "measured"]),
            figure(&["force"]),
            figure(&["power"]),
        ];
        let runs: Vec<(usize, bool)> = groups(&all)
            .iter()
            .map(|group| (group.figures.len(), group.shared))
            .collect();
        assert_eq!(runs, [(1, false), (2, true), (2, false)]);
        assert!(groups(&[]).is_empty());
    }
}
