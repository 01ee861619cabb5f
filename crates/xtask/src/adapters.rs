//! `cargo xtask adapters`: exported models in the programs that they are exported for.

use super::environment::Environment;
use super::{Failure, cargo, root, succeed, target};

/// Its line of the usage.
pub(super) const USAGE: &str = "\
adapters   runs exported models in CasADi and FMPy, from a virtual environment of its own (target/adapters, 0.5 GB)";

/// The crate whose tests they are, and the packages that these need.
const CRATE: &str = "lagrangian-export";
const PACKAGES: &str = "tests/python/requirements.txt";
/// Those of its tests that need them.
const TESTS: &str = "around";

pub(super) fn main(arguments: &[&str]) -> Result<(), Failure> {
    if let [other, ..] = arguments {
        return Err(Failure::usage(
            format!("adapters does not know '{other}'"),
            USAGE,
        ));
    }
    let list = root().join("crates").join(CRATE).join(PACKAGES);
    let environment = Environment::new(&target().join("adapters"), &list);
    let python = environment.python()?;
    let mut tests = cargo();
    // All packages, so that what was built for the tests serves again.
    tests.args(["test", "--workspace", "--all-features", "--test", TESTS]);
    tests.env("LAGRANGIAN_ADAPTERS_PYTHON", python);
    // CMake is one of the packages.
    tests.env("PATH", environment.path()?);
    succeed(tests.current_dir(root()), "the tests of exported models")?;
    Ok(())
}
