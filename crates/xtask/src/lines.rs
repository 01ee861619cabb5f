//! `cargo xtask lines`: the lines of each crate of the product against `budget.toml`.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::fs;
use std::path::Path;

use super::{Failure, root};

/// Its line of the usage.
pub(super) const USAGE: &str = "\
lines [--lower]

  lines  lines of product source in each crate, without tests, against budget.toml
           --lower   writes the lines of today as the budget of every crate that is below its own";

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
    let mut counted = Lines::new();
    for entry in entries(crates)? {
        let name = entry
            .file_name()
            .map_or(String::new(), |name| name.to_string_lossy().into_owned());
        if !APART.contains(&name.as_str()) && entry.join("src").is_dir() {
            counted.insert(name, of_folder(&entry.join("src"))?);
        }
    }
    Ok(counted)
}

fn entries(folder: &Path) -> Result<Vec<std::path::PathBuf>, String> {
    let listed =
        fs::read_dir(folder).map_err(|e| format!("cannot list {}: {e}", folder.display()))?;
    Ok(listed.flatten().map(|entry| entry.path()).collect())
}

fn of_folder(folder: &Path) -> Result<usize, String> {
    let mut lines = 0;
    for path in entries(folder)? {
        if path.is_dir() && !path.ends_with("tests") {
            lines += of_folder(&path)?;
        } else if path.extension().is_some_and(|e| e == "rs") && !path.ends_with("tests.rs") {
            let text = fs::read_to_string(&path)
                .map_err(|e| format!("cannot read {}: {e}", path.display()))?;
            lines += without_tests(&text);
        }
    }
    Ok(lines)
}

/// The lines of a file without its modules of tests, which end at a brace in the first column.
fn without_tests(text: &str) -> usize {
    let mut lines = 0;
    let mut inside = false;
    let mut kept = text.lines().peekable();
    while let Some(line) = kept.next() {
        let opens = line == "#[cfg(test)]"
            && kept.peek().is_some_and(|next| {
                next.starts_with("#[allow") || (next.starts_with("mod ") && next.ends_with('{'))
            });
        inside |= opens;
        lines += usize::from(!inside);
        inside &= line != "}";
    }
    lines
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
        assert_eq!(without_tests(text), 4);
        assert_eq!(without_tests("#[cfg(test)]\nmod tests;\nfn a() {}\n"), 3);
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
