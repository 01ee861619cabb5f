//! Pages with figures that a program keeps up to date.

use std::fs;
use std::path::Path;

/// Puts `text` between `<!-- name -->` and `<!-- /name -->` of a page.
pub(super) fn replace(page: &Path, name: &str, text: &str) -> Result<(), String> {
    let old = fs::read_to_string(page).map_err(|e| format!("{}: {e}", page.display()))?;
    let new = replaced(&old, name, text);
    let new = new.map_err(|why| format!("{}: {why}", page.display()))?;
    fs::write(page, new).map_err(|e| format!("{}: {e}", page.display()))
}

fn replaced(page: &str, name: &str, text: &str) -> Result<String, String> {
    let (first, last) = (format!("<!-- {name} -->"), format!("<!-- /{name} -->"));
    let parts = page
        .split_once(&first)
        .and_then(|(before, rest)| Some((before, rest.split_once(&last)?.1)));
    let (before, after) = parts.ok_or(format!("it lacks the lines {first} and {last}"))?;
    Ok(format!("{before}{first}\n{text}{last}{after}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_stands_between_the_marks_is_replaced_and_nothing_else() {
        let page = "a\n<!-- x -->\nold\n<!-- /x -->\nb <!-- y --><!-- /y -->\n";
        let new = "a\n<!-- x -->\nnew\n<!-- /x -->\nb <!-- y --><!-- /y -->\n";
        assert_eq!(replaced(page, "x", "new\n").as_deref(), Ok(new));
        assert!(replaced(page, "z", "").is_err());
        assert!(replaced("<!-- /x --><!-- x -->", "x", "").is_err());
    }
}
