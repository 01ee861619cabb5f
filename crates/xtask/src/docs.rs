//! `cargo xtask docs`: builds the documentation as a site in target/site; its tutorials run on the way.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::environment::Environment;
use crate::python;
use crate::{Failure, in_ci, root, succeed, target};

pub(crate) const USAGE: &str = "\
docs     builds the documentation in target/site, in a virtual environment of its own (target/docs), and runs its tutorials; warnings are
           errors
           --quick     with short fits: the test of all pages
           --as-built  takes the Python module as it lies in python/lagrangian, built or not by the newest source
           --where-possible  ends without a failure where its packages cannot be fetched, unless CI=true";

/// How the site is built.
#[derive(Debug, Default, PartialEq)]
struct Options {
    quick: bool,
    as_built: bool,
    where_possible: bool,
}

pub(crate) fn main(flags: &[&str]) -> Result<(), Failure> {
    let options = options(flags)?;
    let root = root();
    let wanted = root.join("docs").join("tools").join("requirements.txt");
    let made = Environment::new(&target().join("docs"), &wanted).python();
    let python = match made {
        Ok(python) => python,
        Err(reason) if options.where_possible && !in_ci() => {
            eprintln!("xtask: docs is skipped: {reason}");
            return Ok(());
        }
        Err(reason) => return Err(reason.into()),
    };
    if !options.as_built {
        python::build(&root)?;
    }
    build(&root, &python, &options)?;
    println!(
        "xtask: the documentation is in {}",
        target().join("site").join("index.html").display()
    );
    Ok(())
}

fn options(flags: &[&str]) -> Result<Options, Failure> {
    let mut options = Options::default();
    for flag in flags {
        match *flag {
            "--quick" => options.quick = true,
            "--as-built" => options.as_built = true,
            "--where-possible" => options.where_possible = true,
            other => {
                return Err(Failure::usage(
                    format!("docs has no flag '{other}'"),
                    "docs [--quick] [--as-built] [--where-possible]",
                ));
            }
        }
    }
    Ok(options)
}

/// Builds the site; every page, link and cell must be right.
fn build(root: &Path, python: &Path, options: &Options) -> Result<(), String> {
    let site: PathBuf = target().join("site");
    fs::create_dir_all(&site).map_err(|e| format!("cannot make {}: {e}", site.display()))?;
    let mut tests = Command::new(python);
    tests.args(["-m", "unittest", "discover", "--quiet", "-s", "docs/tools"]);
    succeed(tests.current_dir(root), "the tests of docs/tools")?;
    let mut command = Command::new(python);
    command
        .args(["-m", "mkdocs", "build", "--strict", "--quiet", "--site-dir"])
        .arg(&site);
    command.current_dir(root);
    command.env("LAGRANGIAN_QUICK", if options.quick { "1" } else { "0" });
    command.env("NO_MKDOCS_2_WARNING", "1");
    succeed(&mut command, "mkdocs")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flags_are_read_and_others_refused() {
        let wanted = Options {
            quick: true,
            as_built: true,
            where_possible: false,
        };
        assert_eq!(options(&["--as-built", "--quick"]), Ok(wanted));
        assert!(matches!(
            options(&["--quik"]),
            Err(Failure::Usage { message, .. }) if message.contains("--quik")
        ));
    }
}
