//! The largest functions, structs and traits of the product against `sizes.toml`, a list of exceptions that only shrinks.
//!
//! The source is formatted, so that an item ends at the first closing brace with its own indentation.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::fs;
use std::path::Path;

use crate::lines::sources;
use crate::root;

/// An item is measured by its kind: lines of a function, fields of a struct, methods of a trait.
const KINDS: [(&str, usize); 3] = [("fn", 60), ("struct", 12), ("trait", 8)];

/// The items above the size of their kind, by `crate/src/file.rs kind name`.
type Sizes = BTreeMap<String, usize>;

/// Fails where an item is too large and not in the list, or is in the list with another size.
pub(super) fn check(lower: bool) -> Result<(), String> {
    let file = root().join("sizes.toml");
    let text = fs::read_to_string(&file).map_err(|e| format!("{}: {e}", file.display()))?;
    let listed: Sizes = toml::from_str(&text).map_err(|e| format!("{}: {e}", file.display()))?;
    let mut found = Sizes::new();
    for (path, text) in sources(&root().join("crates"))? {
        found.extend(large(&path, &text));
    }
    let grown = grown(&listed, &found);
    if !grown.is_empty() {
        return Err(format!(
            "too large: {}; divide it: at most 60 lines in a function, 12 fields in a struct, 8 methods in a trait",
            grown.join(", ")
        ));
    }
    if lower {
        return fs::write(&file, written(&found)).map_err(|e| format!("{}: {e}", file.display()));
    }
    match listed == found {
        true => Ok(()),
        false => Err(
            "sizes.toml names items that are smaller now: run `cargo xtask lines --lower`".into(),
        ),
    }
}

fn grown(listed: &Sizes, found: &Sizes) -> Vec<String> {
    let above =
        |(item, size): &(&String, &usize)| listed.get(*item).is_none_or(|most| *size > most);
    found
        .iter()
        .filter(above)
        .map(|(item, size)| format!("{item} ({size})"))
        .collect()
}

fn written(found: &Sizes) -> String {
    let mut text = String::from(
        "# Items of the product above 60 lines (fn), 12 fields (struct) or 8 methods (trait), with their sizes. `cargo xtask lines`\n\
         # fails where one grows or another appears; `cargo xtask lines --lower` takes those away that have shrunk.\n",
    );
    for (item, size) in found {
        let _ = writeln!(text, "{item:?} = {size}");
    }
    text
}

/// The items of a file that are above the size of their kind.
fn large(path: &Path, text: &str) -> Sizes {
    let lines: Vec<&str> = text.lines().collect();
    let mut found = Sizes::new();
    for (at, line) in lines.iter().enumerate() {
        let Some((kind, most, name)) = declared(line) else {
            continue;
        };
        let indent = line.len() - line.trim_start().len();
        let is_end = |other: &&str| {
            other.len() - other.trim_start().len() == indent
                && (other.trim_start().starts_with('}') || other.ends_with(';'))
        };
        let Some(length) = lines[at..].iter().position(is_end) else {
            continue;
        };
        let body = &lines[at + 1..at + length.max(1)];
        let own = body
            .iter()
            .filter(|other| other.len() - other.trim_start().len() == indent + 4);
        let size = match kind {
            "fn" => length + 1,
            "struct" => own.filter(|field| is_field(field)).count(),
            _ => own
                .filter(|item| declared(item).is_some_and(|d| d.0 == "fn"))
                .count(),
        };
        if size > most {
            found.insert(format!("{} {kind} {name}", path.display()), size);
        }
    }
    found
}

/// The kind, its largest size, and the name of the item that a line begins.
fn declared(line: &str) -> Option<(&'static str, usize, &str)> {
    let mut words = line.split_whitespace();
    let before = |word: &&str| {
        word.starts_with("pub")
            || ["const", "unsafe", "async", "extern", "\"C\"", "in"].contains(word)
    };
    let word = words.by_ref().find(|word| !before(word))?;
    let (kind, most) = KINDS.into_iter().find(|(kind, _)| *kind == word)?;
    let name = words.next()?;
    let end = name.find(|c: char| !c.is_alphanumeric() && c != '_');
    Some((kind, most, &name[..end.unwrap_or(name.len())]))
}

fn is_field(line: &str) -> bool {
    let field = line.trim_start();
    let field = field
        .split_once(") ")
        .filter(|_| field.starts_with("pub("))
        .map_or(field, |(_, rest)| rest);
    let name = field
        .strip_prefix("pub ")
        .unwrap_or(field)
        .split(": ")
        .next();
    name.is_some_and(|name| {
        field.contains(": ") && name.chars().all(|c| c.is_alphanumeric() || c == '_')
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn functions_fields_and_methods_are_counted() {
        let body = "        a();\n".repeat(60);
        let fields: String = (0..13)
            .map(|k| format!("    pub(crate) a{k}: f64,\n"))
            .collect();
        let methods = "    fn a(&self);\n".repeat(9);
        let text = format!(
            "impl A {{\n    pub(crate) fn long(&self) {{\n{body}    }}\n\n    fn short() {{}}\n}}\n\n\
             pub struct Wide {{\n{fields}}}\n\ntrait Broad {{\n{methods}}}\n"
        );
        let found = large(Path::new("a.rs"), &text);
        let expected = [
            ("a.rs fn long", 62),
            ("a.rs struct Wide", 13),
            ("a.rs trait Broad", 9),
        ];
        assert_eq!(
            found,
            expected.map(|(item, size)| (item.to_string(), size)).into()
        );
    }

    #[test]
    fn an_item_that_grows_or_appears_is_named() {
        let sizes =
            |of: &[(&str, usize)]| -> Sizes { of.iter().map(|(a, n)| ((*a).into(), *n)).collect() };
        let listed = sizes(&[("a", 70), ("b", 65)]);
        assert_eq!(
            grown(&listed, &sizes(&[("a", 69), ("b", 66), ("c", 61)])),
            ["b (66)", "c (61)"]
        );
        assert_eq!(toml::from_str::<Sizes>(&written(&listed)), Ok(listed));
    }
}
