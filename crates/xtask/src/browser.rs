//! `cargo xtask browser`: what the pages do in a real browser, under a mouse, fingers and keys.

use std::env;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::{Failure, built, cargo, in_ci, root, succeed, target};

pub(crate) const USAGE: &str = "\
browser  makes pages whose values are known (target/browser/pages) and reads them in Chromium: values, zoom, legends, keys, fingers,
           accessibility, and whether they look as stored; needs Node 20, npm and Chromium (or CHROMIUM, the path of one)
           --store  stores anew how pages look, in tests/browser/pictures, and tests nothing else
           --where-possible  ends without a failure where one of these is missing, unless CI=true";

/// The folder of the tests, and the one of its folders that reads pages.
const TESTS: &str = "tests/browser";
const FOLDER: &str = "pages";
/// Set to 1, it has the tests of pictures store what they see.
const STORE: &str = "LAGRANGIAN_STORE";
/// Where distributions put the browser.
const BROWSERS: [&str; 3] = [
    "/usr/bin/chromium",
    "/usr/bin/chromium-browser",
    "/usr/bin/google-chrome",
];

pub(crate) fn main(flags: &[&str]) -> Result<(), Failure> {
    let (where_possible, run) = match flags {
        [] => (false, Run::Tests),
        ["--where-possible"] => (true, Run::Tests),
        ["--store"] => (false, Run::StoredPictures),
        [other, ..] => {
            return Err(Failure::usage(
                format!("browser has no flag '{other}'"),
                "browser [--where-possible | --store]",
            ));
        }
    };
    let browser = match ready() {
        Ok(browser) => browser,
        Err(reason) if where_possible && !in_ci() => {
            eprintln!("xtask: browser is skipped: {reason}");
            return Ok(());
        }
        Err(reason) => return Err(reason.into()),
    };
    let pages = target().join("browser").join("pages");
    make(&pages)?;
    test(FOLDER, &browser, run, |node| {
        node.env("LAGRANGIAN_PAGES", pages);
    })?;
    Ok(())
}

/// What is done with the tests of a folder.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) enum Run {
    /// All of them run.
    #[default]
    Tests,
    /// Those of pictures store what they see.
    StoredPictures,
}

/// The browser, once the packages of the tests are there too.
pub(crate) fn ready() -> Result<PathBuf, String> {
    node()?;
    let given = env::var_os("CHROMIUM").map(PathBuf::from);
    let known = BROWSERS.iter().map(PathBuf::from);
    let browser = given.into_iter().chain(known).find(|path| path.is_file());
    let browser = browser.ok_or(
        "there is no Chromium: install it (apt-get install chromium) or set CHROMIUM to its path",
    )?;
    packages(&root().join(TESTS))?;
    Ok(browser)
}

/// Whether Node and npm are there, else what to install.
pub(crate) fn node() -> Result<(), String> {
    for (program, package) in [("node", "nodejs"), ("npm", "npm")] {
        let found = Command::new(program).arg("--version").output();
        if !found.is_ok_and(|output| output.status.success()) {
            return Err(format!(
                "there is no {program}: install it (apt-get install {package}), version 20 of Node or newer"
            ));
        }
    }
    Ok(())
}

/// Installs the packages that the lock file of a folder names.
pub(crate) fn packages(folder: &Path) -> Result<(), String> {
    let mut npm = Command::new("npm");
    npm.args(["ci", "--no-audit", "--no-fund", "--loglevel=error"]);
    succeed(npm.current_dir(folder), "npm ci")
}

/// Runs the tests of a folder in the browser, or has its pictures stored.
pub(crate) fn test(
    folder: &str,
    browser: &Path,
    run: Run,
    set: impl FnOnce(&mut Command),
) -> Result<(), String> {
    let mut node = Command::new("node");
    node.args(["--test", "--test-concurrency=1"]);
    if run == Run::StoredPictures {
        node.arg("--test-name-pattern=looks as stored")
            .env(STORE, "1");
    }
    node.arg(folder).env("CHROMIUM", browser);
    set(&mut node);
    succeed(
        node.current_dir(root().join(TESTS)),
        "the tests in the browser",
    )
}

/// Makes the pages, with what the build of all examples has made already.
fn make(pages: &Path) -> Result<(), String> {
    let mut build = cargo();
    build.args([
        "build",
        "--workspace",
        "--all-features",
        "--example",
        "pages",
    ]);
    succeed(build.current_dir(root()), "the build of the pages")?;
    let program = built("examples").join("pages");
    succeed(Command::new(program).arg(pages), "the making of the pages")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_flag_that_is_unknown_is_refused() {
        assert!(matches!(
            main(&["--where-posible"]),
            Err(Failure::Usage { message, .. }) if message.contains("--where-posible")
        ));
    }
}
