//! Terms with an explanation on demand: a button in the text, and the explanation.

use crate::draw::escaped;
use crate::{Piece, TERMS, pieces};

/// A text made safe for HTML, with buttons for its terms.
pub(super) fn explained(text: &str) -> String {
    let piece = |piece| match piece {
        Piece::Plain(part) => escaped(part),
        Piece::Explained(word, term) => format!(
            "<button class=\"term\" type=\"button\" popovertarget=\"term-{}\">{}</button>",
            term.id,
            escaped(word)
        ),
    };
    pieces(text).into_iter().map(piece).collect()
}

/// The explanations of the terms that a page has buttons for.
pub(super) fn meanings(body: &mut String) {
    for term in &TERMS {
        if !body.contains(&format!("popovertarget=\"term-{}\"", term.id)) {
            continue;
        }
        let (name, meaning) = (escaped(term.forms[0]), escaped(term.meaning));
        put!(
            body,
            "<div class=\"meaning\" id=\"term-{}\" popover><strong>{name}</strong> {meaning}</div>\n",
            term.id
        );
    }
}
