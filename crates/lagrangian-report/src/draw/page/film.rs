//! A film of a page: a canvas for each of its films, and their pictures for the script that plays them.

use serde_json::json;

use crate::draw::escaped;
use crate::{Animation, Film};

/// One film with its controls.
pub(super) fn film(body: &mut String, animation: &Animation, film: &Film) {
    let [height, width, colours] = film.shape;
    let (title, caption) = (escaped(&animation.title), escaped(&animation.caption));
    put!(
        body,
        "<div class=\"card film\">\n<h3>{title}</h3>\n<p class=\"caption\">{caption}</p>\n\
             <noscript><p>Scripts are off: the film is not shown.</p></noscript>\n<div class=\"panels\">\n"
    );
    let difference = (!film.difference.is_empty()).then_some(&film.difference);
    for name in film.names.iter().chain(difference) {
        let name = escaped(name);
        put!(
            body,
            "<figure class=\"panel\"><canvas width=\"{width}\" height=\"{height}\" role=\"img\" aria-label=\"{name}\"></canvas>\
                 <figcaption>{name}</figcaption></figure>\n"
        );
    }
    let own = json!({
        "width": width, "height": height, "colours": colours, "step": film.step, "pictures": film.pictures,
        "difference": difference.is_some(),
    });
    // Base64 has no character that could end a script.
    put!(
        body,
        "</div>\n<div class=\"controls\"><button class=\"play\" type=\"button\">Play</button>\
             <input class=\"place\" type=\"range\" min=\"0\" value=\"0\" aria-label=\"Picture\"><span class=\"clock\"></span></div>\n\
             <script type=\"application/json\" class=\"pictures\">{own}</script>\n</div>\n"
    );
}
