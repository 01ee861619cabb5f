//! `cargo xtask api`: the public items of `lagrangian`, read from its documentation, against `public-api.txt`.

use std::collections::BTreeSet;
use std::fs;

use super::{Failure, Step, carry_out, root, target};

/// Its line of the usage.
pub(super) const USAGE: &str = "\
api [--write]

  api  builds the documentation without a warning, and compares the public items of the library
       with crates/lagrangian/public-api.txt
           --write   writes the list anew: a commit that does so says what users gain or lose";

const LIST: &str = "crates/lagrangian/public-api.txt";

const DOCUMENTATION: Step = Step {
    variable: Some(("RUSTDOCFLAGS", "-D warnings")),
    ..Step::of_cargo(
        "documentation",
        &["doc", "--workspace", "--all-features", "--no-deps"],
    )
};

/// Builds the documentation, and compares the list with it.
pub(super) fn main(arguments: &[&str]) -> Result<(), Failure> {
    let write = match arguments {
        [] => false,
        ["--write"] => true,
        [other, ..] => {
            return Err(Failure::usage(
                format!("api does not know '{other}'"),
                USAGE,
            ));
        }
    };
    carry_out(&DOCUMENTATION)?;
    let page = |name: &str| {
        let page = target().join("doc/lagrangian").join(name);
        fs::read_to_string(&page).map_err(|e| format!("{}: {e}", page.display()))
    };
    let items = &root_items(&page("index.html")?) | &items(&page("all.html")?);
    if items.is_empty() {
        return Err(Failure::Work("the documentation lists no item".into()));
    }
    let file = root().join(LIST);
    if write {
        return fs::write(&file, written(&items))
            .map_err(|e| Failure::Work(format!("{}: {e}", file.display())));
    }
    let text = fs::read_to_string(&file).map_err(|e| format!("{}: {e}", file.display()))?;
    let listed = listed(&text);
    let difference = [("is new", &items - &listed), ("is gone", &listed - &items)];
    let lines: Vec<String> = difference
        .iter()
        .flat_map(|(what, items)| items.iter().map(move |item| format!("{item} {what}")))
        .collect();
    match lines.is_empty() {
        true => Ok(()),
        false => Err(Failure::Work(format!(
            "the public items differ from {LIST}: {}; keep them, or run `cargo xtask api --write`",
            lines.join(", ")
        ))),
    }
}

/// Every item that the page of all items links to, with the kind that its file name begins with.
fn items(html: &str) -> BTreeSet<String> {
    let links = html.split("<li><a href=\"").skip(1);
    let item = |link: &str| {
        let (href, rest) = link.split_once("\">")?;
        let kind = href.rsplit('/').next()?.split('.').next()?;
        let (path, _) = rest.split_once("</a>")?;
        (!href.starts_with('#')).then(|| format!("{kind} {path}"))
    };
    links.filter_map(item).collect()
}

/// The modules of the root, and the names that it takes from them.
fn root_items(html: &str) -> BTreeSet<String> {
    let modules = html.split("<a class=\"mod\" href=\"").skip(1);
    let module = |link: &str| Some(format!("mod {}", link.split_once('/')?.0));
    let uses = html.split("<code>pub use ").skip(1);
    let name = |text: &str| {
        let line = text.split_once(";</code>")?.0;
        let tags = line
            .split('<')
            .map(|part| part.rsplit_once('>').map_or(part, |(_, text)| text));
        Some(format!("use {}", tags.collect::<String>()))
    };
    modules
        .filter_map(module)
        .chain(uses.filter_map(name))
        .collect()
}

/// Those of the root first.
fn written(items: &BTreeSet<String>) -> String {
    let inner = |item: &&String| item.contains("::") && !item.starts_with("use ");
    let (inner, outer): (Vec<_>, Vec<_>) = items.iter().partition(inner);
    let mut text = String::from(
        "# The public items of the library, those of its root first; `cargo xtask api` compares them with its documentation.\n",
    );
    for item in outer.into_iter().chain(inner) {
        text.push_str(item);
        text.push('\n');
    }
    text
}

fn listed(text: &str) -> BTreeSet<String> {
    let lines = text.lines().filter(|line| !line.starts_with('#'));
    lines.map(str::to_string).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const PAGE: &str = r##"<li><a href="#structs" title="Structs">Structs</a></li><ul class="all-items"><li><a href="struct.Dataset.html">Dataset</a></li><li><a href="check/fn.check.html">check::check</a></li></ul>"##;

    #[test]
    fn the_page_of_all_items_is_read_and_the_root_comes_first() {
        let items = items(PAGE);
        let text = written(&items);
        assert_eq!(
            text.lines().skip(1).collect::<Vec<_>>(),
            ["struct Dataset", "fn check::check"]
        );
        assert_eq!(listed(&text), items);
    }

    #[test]
    fn modules_and_re_exports_belong_to_the_root() {
        let page = r#"<dt><a class="mod" href="check/index.html">check</a></dt><code>pub use dataset::<a class="struct" href="x">Dataset</a>;</code>"#;
        let expected = ["mod check", "use dataset::Dataset"].map(String::from);
        assert_eq!(root_items(page), BTreeSet::from(expected));
    }
}
