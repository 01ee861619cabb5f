//! `cargo xtask deny`: licences, sources and known faults of all packages that are linked, by `deny.toml`.

use super::{Failure, cargo};

/// Its line of the usage.
pub(super) const USAGE: &str = "\
deny [--offline]

  deny  licences, sources, bans and advisories of every package, by `cargo deny` and deny.toml
           --offline   without advisories, whose database is on the net";

/// Runs the checks, or says what to install.
pub(super) fn main(arguments: &[&str]) -> Result<(), Failure> {
    let checks: &[&str] = match arguments {
        [] => &["advisories", "bans", "licenses", "sources"],
        ["--offline"] => &["bans", "licenses", "sources"],
        [other, ..] => {
            return Err(Failure::usage(
                format!("deny does not know '{other}'"),
                USAGE,
            ));
        }
    };
    let present = cargo().args(["deny", "--version"]).output();
    if !present.is_ok_and(|output| output.status.success()) {
        let remedy = "run `cargo install --locked cargo-deny` (minutes)";
        return Err(Failure::Work(format!("cargo deny is missing: {remedy}")));
    }
    let root = crate::root();
    let status = cargo()
        .current_dir(root)
        .args(["deny", "--all-features", "--workspace", "check"])
        .args(checks)
        .status()
        .map_err(|e| format!("cargo did not start: {e}"))?;
    match status.success() {
        true => Ok(()),
        false => Err(Failure::Work(format!(
            "cargo deny found something ({status})"
        ))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_flag_that_is_not_known_is_refused_with_the_usage() {
        let Err(Failure::Usage { message, hint }) = main(&["--fast"]) else {
            panic!("it was not refused");
        };
        assert!(message.contains("--fast") && hint.contains("deny"));
    }
}
