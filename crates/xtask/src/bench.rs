//! `cargo xtask bench`: every bench of the library, and its figures into docs/performance.md.

use std::fmt::Write;
use std::fs;

use serde_json::Value;

use super::{Failure, cargo, page};

/// Its line of the usage.
pub(super) const USAGE: &str = "\
bench [--smoke] [WORD…]

  bench  every hot function against the limits of the machine; writes target/bench/bench.jsonl and, without words, the
         tables of docs/performance.md
           WORD      the rows whose names contain all the words alone
           --smoke   each row once: only whether it works";

/// Runs the benches; words and `--smoke` are theirs.
pub(super) fn main(arguments: &[&str]) -> Result<(), Failure> {
    let unknown = |a: &&&str| a.starts_with('-') && **a != "--smoke";
    match arguments.iter().find(unknown) {
        Some(flag) => Err(Failure::Usage {
            message: format!("bench does not know '{flag}'"),
            hint: format!("usage: cargo xtask {USAGE}"),
        }),
        None => bench(arguments),
    }
}

fn bench(arguments: &[&str]) -> Result<(), Failure> {
    let root = crate::root();
    let fail = |e: std::io::Error| format!("{}: {e}", root.display());
    let root = root.canonicalize().map_err(fail)?;
    let folder = root.join("target/bench");
    let file = folder.join("bench.jsonl");
    fs::create_dir_all(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    fs::write(&file, "").map_err(|e| format!("{}: {e}", file.display()))?;
    let mut command = cargo();
    command.current_dir(&root);
    command.args([
        "bench",
        "--package",
        "lagrangian",
        "--package",
        "experiments",
        "--",
    ]);
    command.arg("--json").arg(&file).args(arguments);
    let status = command
        .status()
        .map_err(|e| format!("cargo did not start: {e}"))?;
    if !status.success() {
        return Err(format!("the benches failed ({status})").into());
    }
    let text = fs::read_to_string(&file).map_err(|e| format!("{}: {e}", file.display()))?;
    let lines: Result<Vec<Value>, _> = text.lines().map(serde_json::from_str).collect();
    let lines = lines.map_err(|e| format!("{}: {e}", file.display()))?;
    if !lines.iter().any(|line| line.get("row").is_some()) {
        let words: Vec<&str> = arguments
            .iter()
            .copied()
            .filter(|a| *a != "--smoke")
            .collect();
        return Err(Failure::Usage {
            message: format!("no row is named by '{}'", words.join(" ")),
            hint: "`cargo xtask bench --smoke` names all rows".into(),
        });
    }
    let table = markdown(&lines);
    if !arguments.is_empty() {
        return Ok(());
    }
    page::replace(&root.join("docs/performance.md"), "bench", &table).map_err(Failure::from)
}

/// A table for each bench, from a line for its head and one for each of its rows.
fn markdown(lines: &[Value]) -> String {
    let text = |line: &Value, key: &str| line[key].as_str().unwrap_or("–").to_owned();
    let list = |line: &Value, key: &str| -> Vec<String> {
        let cells = line[key].as_array().into_iter().flatten();
        cells
            .map(|c| c.as_str().unwrap_or("–").to_owned())
            .collect()
    };
    let mut out = String::from("\n");
    for line in lines {
        let cells = if line.get("columns").is_some() {
            let columns = list(line, "columns");
            // Writing to a string cannot fail.
            let _ = write!(
                out,
                "\n**{}**: {}.\n{}.\n\n|  | {} |\n|{}",
                text(line, "bench"),
                text(line, "about"),
                text(line, "machine"),
                columns.join(" | "),
                "---|".repeat(columns.len() + 1),
            );
            out.push('\n');
            continue;
        } else {
            list(line, "cells")
        };
        let _ = writeln!(out, "| {} | {} |", text(line, "row"), cells.join(" | "));
    }
    out.push('\n');
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_row_of_a_bench_becomes_one_line_of_its_table() {
        let lines = [
            serde_json::json!({ "bench": "b", "about": "calls", "machine": "m", "columns": ["time", "±"] }),
            serde_json::json!({ "bench": "b", "row": "n 2", "cells": ["1 ms", "–"] }),
        ];
        let table = "|  | time | ± |\n|---|---|---|\n| n 2 | 1 ms | – |\n";
        assert!(markdown(&lines).contains(table), "{}", markdown(&lines));
    }

    #[test]
    fn unknown_flags_are_refused_before_anything_is_built() {
        let refused = main(&["--fast"]).map_err(|failure| failure.report());
        let (text, code) = refused.err().unwrap_or_default();
        assert!(text.contains("'--fast'") && text.contains("usage") && code == 2);
    }
}
