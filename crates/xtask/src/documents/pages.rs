//! What is read: pages of Markdown, the examples of `--help`, and situations in which the command gives a hint.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use super::fences::{self, Block, Printed};

/// A page, or what stands for one.
#[derive(Debug)]
pub(super) struct Page {
    pub(super) name: String,
    /// The commands of its blocks, in their order.
    pub(super) commands: Vec<Printed>,
    /// The commands within its sentences.
    pub(super) inline: Vec<String>,
    /// Its blocks of code.
    pub(super) code: Vec<Block>,
    /// Whether its commands are alternatives, each for a folder of its own.
    pub(super) apart: bool,
}

/// Folders whose pages record what held when they were written.
const DATED: [&str; 1] = ["docs/adr"];

/// The pages of the repository that a reader follows.
pub(super) fn of_repository(root: &Path) -> Result<Vec<Page>, String> {
    let mut paths: Vec<PathBuf> = [
        "README.md",
        "CONTRIBUTING.md",
        "ARCHITECTURE.md",
        "SECURITY.md",
        "python/README.md",
        "tests/browser/README.md",
    ]
    .iter()
    .map(|own| root.join(own))
    .collect();
    below(&root.join("docs"), &mut paths)?;
    below(&root.join("examples"), &mut paths)?;
    let name = |path: &PathBuf| {
        let own = path.strip_prefix(root).unwrap_or(path);
        own.to_string_lossy().replace('\\', "/")
    };
    let followed = paths
        .iter()
        .filter(|path| !DATED.iter().any(|own| name(path).starts_with(own)) && path.exists());
    followed
        .map(|path| {
            let text = fs::read_to_string(path).map_err(|e| format!("{}: {e}", path.display()))?;
            Ok(of_text(&name(path), &text))
        })
        .collect()
}

/// The pages in a folder and beneath it.
fn below(folder: &Path, found: &mut Vec<PathBuf>) -> Result<(), String> {
    let entries = fs::read_dir(folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let mut entries: Vec<PathBuf> = entries.filter_map(|own| Some(own.ok()?.path())).collect();
    entries.sort();
    for path in entries {
        if path.is_dir() {
            below(&path, found)?;
        } else if path.extension().is_some_and(|own| own == "md") {
            found.push(path);
        }
    }
    Ok(())
}

/// A page of Markdown.
pub(super) fn of_text(name: &str, text: &str) -> Page {
    let (shell, code): (Vec<Block>, Vec<Block>) = fences::blocks(text)
        .into_iter()
        .partition(|own| ["sh", "bash", "console"].contains(&own.language.as_str()));
    Page {
        name: name.into(),
        commands: shell.iter().flat_map(fences::commands).collect(),
        inline: fences::inline(text),
        code,
        apart: false,
    }
}

/// The examples of the command and of each of its subcommands.
pub(super) fn of_help(command: &Path) -> Result<Vec<Page>, String> {
    let overview = said(command, &["--help"])?;
    let names = overview
        .lines()
        .skip_while(|line| !line.starts_with("Commands:"))
        .skip(1)
        .take_while(|line| line.starts_with("  "));
    let names = names.filter_map(|line| line.split_whitespace().next());
    let mut pages = vec![of_examples("lagrangian --help", &overview, false)];
    for name in names.filter(|own| *own != "help") {
        let help = said(command, &[name, "--help"])?;
        pages.push(of_examples(
            &format!("lagrangian {name} --help"),
            &help,
            true,
        ));
    }
    Ok(pages)
}

fn said(command: &Path, arguments: &[&str]) -> Result<String, String> {
    let output = Command::new(command).args(arguments).output();
    let output = output.map_err(|e| format!("{} did not start: {e}", command.display()))?;
    Ok(String::from_utf8_lossy(&output.stdout).into_owned())
}

/// The examples at the end of a help text: lines that begin with the command, and what explains them after three spaces.
fn of_examples(name: &str, help: &str, apart: bool) -> Page {
    let lines = help
        .lines()
        .skip_while(|own| !["Examples:", "Begin with:"].contains(own));
    let lines = lines.skip(1).take_while(|own| own.starts_with("  "));
    let text = lines.map(|line| match line.trim_start().split_once("   ") {
        Some((command, about)) if !command.is_empty() => format!("{command} # {}", about.trim()),
        _ => line.trim_start().to_string(),
    });
    let block = Block {
        language: "sh".into(),
        line: 1,
        text: text.collect::<Vec<_>>().join("\n"),
    };
    Page {
        name: name.into(),
        commands: fences::commands(&block),
        inline: fences::inline(help),
        code: Vec::new(),
        apart,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn examples_of_a_help_text_lose_their_explanation_and_keep_their_continuation() {
        let help = "Usage: x\n\nOptions:\n  -q\n\nExamples:\n  lagrangian a b    about it\n  lagrangian c \\\n      --d\n\nMore:\n  lagrangian e";
        let page = of_examples("x", help, true);
        let texts: Vec<&str> = page.commands.iter().map(|own| own.text.as_str()).collect();
        assert_eq!(texts, ["lagrangian a b", "lagrangian c --d"]);
    }

    #[test]
    fn shell_blocks_are_commands_and_others_code() {
        let page = of_text("x", "```sh\na\n```\n```python\nb\n```\n`lagrangian c d`\n");
        assert_eq!(
            (page.commands.len(), page.code.len(), page.inline.len()),
            (1, 1, 1)
        );
    }
}
