//! `cargo xtask sanitize`: the unit tests of the crate with `unsafe` code under `AddressSanitizer`.

use std::path::PathBuf;
use std::process::Command;

use super::{Failure, cargo};

/// Its line of the usage.
pub(super) const USAGE: &str = "\
sanitize [--where-possible]

  sanitize  the unit tests of `lagrangian-nets` under AddressSanitizer, in target/sanitizer; fails where the toolchain lacks it
           --where-possible  says what is missing and succeeds";

/// Without optimisation no access is removed before the sanitizer sees it, and the build takes seconds.
const PROFILE: [&str; 4] = [
    "--config",
    "profile.dev.opt-level=0",
    "--config",
    "profile.dev.package.\"*\".opt-level=0",
];

/// Runs the tests, or says why it cannot.
pub(super) fn main(arguments: &[&str]) -> Result<(), Failure> {
    let required = match arguments {
        [] => true,
        ["--where-possible"] => false,
        [other, ..] => {
            return Err(Failure::usage(
                format!("sanitize does not know '{other}'"),
                USAGE,
            ));
        }
    };
    match toolchain() {
        Ok(host) => test(&host).map_err(Failure::from),
        Err(missing) if required => Err(Failure::Work(missing)),
        Err(missing) => {
            eprintln!("xtask: sanitize was omitted: {missing}");
            Ok(())
        }
    }
}

fn test(host: &str) -> Result<(), String> {
    let root = crate::root();
    let status = cargo()
        .current_dir(&root)
        .args([
            "test",
            "--package",
            "lagrangian-nets",
            "--lib",
            "--target",
            host,
        ])
        .args(PROFILE)
        // The option is unstable, but the runtime comes with the stable toolchain.
        .env("RUSTC_BOOTSTRAP", "1")
        .env("RUSTFLAGS", "-Zsanitizer=address")
        .env("CARGO_TARGET_DIR", root.join("target/sanitizer"))
        .status()
        .map_err(|e| format!("cargo did not start: {e}"))?;
    match status.success() {
        true => Ok(()),
        false => Err(format!(
            "the tests under AddressSanitizer failed ({status})"
        )),
    }
}

/// The target of this machine, where the toolchain has the runtime of the sanitizer for it; else what is missing.
fn toolchain() -> Result<String, String> {
    let about = rustc(&["--version", "--verbose"])?;
    let host = about.lines().find_map(|line| line.strip_prefix("host: "));
    let host = host.ok_or("rustc does not name its host")?;
    let libraries: PathBuf = [
        rustc(&["--print", "sysroot"])?.trim(),
        "lib/rustlib",
        host,
        "lib",
    ]
    .iter()
    .collect();
    let files = std::fs::read_dir(&libraries);
    let files = files.map_err(|e| format!("{}: {e}", libraries.display()))?;
    let names = files.filter_map(|file| file.ok()?.file_name().into_string().ok());
    match names.into_iter().any(|name| is_runtime(&name)) {
        true => Ok(host.into()),
        false => Err(format!(
            "the toolchain has no runtime of AddressSanitizer for {host} (librustc-*_rt.asan.* in {})",
            libraries.display()
        )),
    }
}

fn is_runtime(file: &str) -> bool {
    file.starts_with("librustc") && file.contains("_rt.asan.")
}

fn rustc(arguments: &[&str]) -> Result<String, String> {
    let program = std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    let output = Command::new(program).args(arguments).output();
    let output = output.map_err(|e| format!("rustc did not start: {e}"))?;
    Ok(String::from_utf8_lossy(&output.stdout).into_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_runtime_is_known_by_its_name() {
        assert!(is_runtime("librustc-stable_rt.asan.a"));
        assert!(is_runtime("librustc-stable_rt.asan.dylib"));
        assert!(!is_runtime("librustc-stable_rt.tsan.a"));
        assert!(!is_runtime("libcore-0123.rlib"));
    }

    #[test]
    fn a_flag_that_is_not_known_is_refused_with_the_usage() {
        let Err(Failure::Usage { message, hint }) = main(&["--memory"]) else {
            panic!("it was not refused");
        };
        assert!(message.contains("--memory") && hint.contains("sanitize"));
    }
}
