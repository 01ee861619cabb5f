//! `cargo xtask lines`: the lines of each crate of the product against `budget.toml`, and the sizes of its items.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};

use super::{Failure, root, sizes};

/// Its line of the usage.
pub(super) const USAGE: &str = "\
lines [--lower]

  lines  lines of product source in each crate, without tests, against budget.toml
           and its largest functions, structs and traits against sizes.toml
           --lower   writes the lines and sizes of today as the budget of all that is below its own";

/// Crates that are not shipped: comparisons of papers, and these chores.
const APART: [&str; 2] = ["experiments", "xtask"];

/// Counts, prints the table, and fails where a crate is above its budget or has none.
pub(super) fn main(arguments: &[&str]) -> Result<(), Failure> {
    let lower = match arguments {
        [] => false,
        ["--lower"] => true,
        [other, ..] => {
            return Err(Failure::usage(
                format!("lines does not know '{other}'"),
                USAGE,
            ));
        }
    };
    let file = root().join("budget.toml");
    let budget = read(&file)?;
    let counted = count(&root().join("crates"))?;
    println!("{}", table(&counted, &budget));
    let above = above(&counted, &budget);
    if !above.is_empty() {
        return Err(Failure::Work(format!(
            "above the budget of budget.toml: {}; remove lines, or raise the budget in a commit that says what they buy",
            above.join(", ")
        )));
    }
    sizes::check(lower)?;
    if lower {
        fs::write(&file, written(&counted))
            .map_err(|e| format!("cannot write {}: {e}", file.display()))?;
    }
    Ok(())
}

type Lines = BTreeMap<String, usize>;

fn read(file: &Path) -> Result<Lines, String> {
    let text =
        fs::read_to_string(file).map_err(|e| format!("cannot read {}: {e}", file.display()))?;
    toml::from_str(&text).map_err(|e| format!("{}: {e}", file.display()))
}

fn written(counted: &Lines) -> String {
    let mut text = String::from(
        "# Lines of product source in each crate, without tests: `cargo xtask lines` fails above them.\n\
         # A commit that raises one says what it bought; `cargo xtask lines --lower` lowers them.\n",
    );
    for (name, lines) in counted {
        let _ = writeln!(text, "{name} = {lines}");
    }
    text
}

fn above(counted: &Lines, budget: &Lines) -> Vec<String> {
    let over = counted
        .iter()
        .filter(|(name, lines)| budget.get(*name).is_none_or(|allowed| *lines > allowed));
    over.map(|(name, lines)| match budget.get(name) {
        Some(allowed) => format!("{name} by {}", lines - allowed),
        None => format!("{name}, which has no budget"),
    })
    .collect()
}

fn table(counted: &Lines, budget: &Lines) -> String {
    let mut text = String::new();
    for (name, lines) in counted {
        let allowed = budget.get(name).map_or(String::new(), usize::to_string);
        let _ = writeln!(text, "{name:24} {lines:7} of {allowed:>7}");
    }
    let total: usize = counted.values().sum();
    let _ = write!(text, "{:24} {total:7}", "product");
    text
}

/// The lines of each crate in the folder.
fn count(crates: &Path) -> Result<Lines, String> {
    let shipped = shipped(crates)?;
    let mut counted: Lines = shipped.into_iter().map(|name| (name, 0)).collect();
    for (path, text) in sources(crates)? {
        let name = path.iter().next().unwrap_or_default();
        *counted.entry(name.to_string_lossy().into()).or_default() += text.lines().count();
    }
    Ok(counted)
}

fn entries(folder: &Path) -> Result<Vec<PathBuf>, String> {
    let listed =
        fs::read_dir(folder).map_err(|e| format!("cannot list {}: {e}", folder.display()))?;
    Ok(listed.flatten().map(|entry| entry.path()).collect())
}

/// The files of the crates of the product with their text without tests, by their paths from the folder of the crates.
pub(super) fn sources(crates: &Path) -> Result<Vec<(PathBuf, String)>, String> {
    let mut found = Vec::new();
    for name in shipped(crates)? {
        of_folder(crates, &Path::new(&name).join("src"), &mut found)?;
    }
    Ok(found)
}

/// The names of the crates of the product.
fn shipped(crates: &Path) -> Result<Vec<String>, String> {
    let name = |path: PathBuf| Some(path.file_name()?.to_str()?.to_string());
    let names = entries(crates)?.into_iter().filter_map(name);
    let is_shipped =
        |name: &String| !APART.contains(&name.as_str()) && crates.join(name).join("src").is_dir();
    Ok(names.filter(is_shipped).collect())
}

fn of_folder(
    crates: &Path,
    folder: &Path,
    found: &mut Vec<(PathBuf, String)>,
) -> Result<(), String> {
    for path in entries(&crates.join(folder))? {
        let own = folder.join(path.file_name().unwrap_or_default());
        if path.is_dir() && !path.ends_with("tests") {
            of_folder(crates, &own, found)?;
        } else if path.extension().is_some_and(|e| e == "rs") && !path.ends_with("tests.rs") {
            let text = fs::read_to_string(&path)
                .map_err(|e| format!("cannot read {}: {e}", path.display()))?;
            found.push((own, without_tests(&text)));
        }
    }
    Ok(())
}

/// The text of a file without its modules of tests, which end at a brace in the first column.
fn without_tests(text: &str) -> String {
    let mut lines = Vec::new();
    let mut inside = false;
    let mut kept = text.lines().peekable();
    while let Some(line) = kept.next() {
        let opens = line == "#[cfg(test)]"
            && kept.peek().is_some_and(|next| {
                next.starts_with("#[allow") || (next.starts_with("mod ") && next.ends_with('{'))
            });
        inside |= opens;
        lines.extend((!inside).then_some(line));
        inside &= line != "}";
    }
    lines.join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(of: &[(&str, usize)]) -> Lines {
        of.iter()
            .map(|(name, n)| ((*name).to_string(), *n))
            .collect()
    }

    #[test]
    fn modules_of_tests_do_not_count() {
        let text = "fn a() {\n}\n\n#[cfg(test)]\nmod tests {\n    fn b() {\n    }\n}\nfn c() {}\n";
        assert_eq!(without_tests(text).lines().count(), 4);
        let text = "#[cfg(test)]\nmod tests;\nfn a() {}";
        assert_eq!(without_tests(text), text);
    }

    #[test]
    fn a_crate_above_its_budget_or_without_one_is_named() {
        let counted = lines(&[("a", 11), ("b", 5), ("c", 1)]);
        let budget = lines(&[("a", 10), ("b", 5)]);
        assert_eq!(
            above(&counted, &budget),
            ["a by 1", "c, which has no budget"]
        );
    }

    #[test]
    fn a_written_budget_is_read_again() {
        let counted = lines(&[("a", 11), ("lagrangian-b", 5)]);
        assert_eq!(toml::from_str::<Lines>(&written(&counted)), Ok(counted));
    }
}
