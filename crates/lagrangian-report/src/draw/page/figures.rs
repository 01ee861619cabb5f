//! The figures and maps of a page.

use super::add;
use super::terms::explained;
use crate::draw::{escaped, svg};
use crate::{Figure, HeatMap};

/// Sizes of a figure, px: across the page, in one of two columns, on a phone.
const BROAD: (u32, u32) = (1084, 380);
const WIDE: (u32, u32) = (524, 350);
const NARROW: (u32, u32) = (306, 288);

/// Two columns where they fit; the first of an odd number spans both.
pub(super) fn figures(body: &mut String, figures: &[Figure]) {
    let odd = figures.len() % 2 == 1;
    let class = if odd { "figures odd" } else { "figures" };
    add(body, format_args!("<div class=\"{class}\">\n"));
    for (k, figure) in figures.iter().enumerate() {
        let broad = (odd && k == 0).then_some((BROAD, "broad"));
        let sizes = [(WIDE, "wide"), (NARROW, "narrow")]
            .into_iter()
            .chain(broad);
        let drawn: String = sizes
            .map(|(size, class)| svg::inline(figure, size, class))
            .collect();
        let Figure {
            id, title, caption, ..
        } = figure;
        card(body, &format!("figure-{id}"), [title, caption], &drawn);
    }
    body.push_str("</div>\n");
}

/// Two columns where they fit.
pub(super) fn maps(body: &mut String, maps: &[HeatMap]) {
    body.push_str("<div class=\"figures\">\n");
    for map in maps {
        let drawn = svg::inline_map(map, WIDE, "map");
        card(
            body,
            &format!("map-{}", map.id),
            [&map.title, &map.caption],
            &drawn,
        );
    }
    body.push_str("</div>\n");
}

fn card(body: &mut String, id: &str, words: [&str; 2], drawn: &str) {
    let (id, [title, caption]) = (escaped(id), [escaped(words[0]), explained(words[1])]);
    add(
        body,
        format_args!(
            "<figure class=\"card figure\" id=\"{id}\"><figcaption><h3>{title}</h3><p class=\"caption\">{caption}</p>\
             </figcaption>{drawn}</figure>\n"
        ),
    );
}
