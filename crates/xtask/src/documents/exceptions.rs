//! The one list of commands and blocks that the chore does not run as they are printed, each with a reason.

/// What is done in place of a command.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Instead {
    /// `--help` is appended: the subcommand, the flags and their values must exist.
    Spelling,
    /// It is a chore of this program, whose usage must name it.
    Chore,
    /// It runs where this program is installed.
    Where(&'static str),
    /// Nothing.
    Omit,
}

/// A command or block that is treated otherwise.
#[derive(Debug)]
pub(super) struct Exception {
    /// The page; empty for all.
    pub(super) page: &'static str,
    /// A part of its text.
    pub(super) part: &'static str,
    pub(super) instead: Instead,
    pub(super) reason: &'static str,
}

const fn everywhere(part: &'static str, instead: Instead, reason: &'static str) -> Exception {
    on("", part, instead, reason)
}

const fn on(
    page: &'static str,
    part: &'static str,
    instead: Instead,
    reason: &'static str,
) -> Exception {
    Exception {
        page,
        part,
        instead,
        reason,
    }
}

/// The exceptions; the first that fits is taken.
pub(super) const EXCEPTIONS: &[Exception] = &[
    everywhere(
        "cargo xtask ",
        Instead::Chore,
        "a chore, most of which are steps of `cargo xtask test`",
    ),
    everywhere(
        "experiments ",
        Instead::Spelling,
        "takes minutes to hours; the tests of the crate run each one in part",
    ),
    everywhere(
        "formula swings-network",
        Instead::Spelling,
        "a network that is cut short has learned no law; tests/cli/formulas.rs asks one",
    ),
    everywhere(
        "formula run --json",
        Instead::Spelling,
        "a network that is cut short has learned no law",
    ),
    everywhere(
        "--goal goal",
        Instead::Spelling,
        "a servo is solved at once, which takes minutes; tests/cli/servos.rs fits one",
    ),
    everywhere("cargo test ", Instead::Omit, "a step of `cargo xtask test`"),
    everywhere(
        "cargo clippy ",
        Instead::Omit,
        "a step of `cargo xtask test`",
    ),
    everywhere(
        "cargo bench",
        Instead::Omit,
        "takes minutes; `cargo xtask test` runs each row once",
    ),
    everywhere("cargo doc ", Instead::Omit, "a step of `cargo xtask test`"),
    everywhere(
        "cargo install ",
        Instead::Omit,
        "builds for minutes what the tests have built already",
    ),
    everywhere(
        "pip install ",
        Instead::Omit,
        "builds for minutes; `cargo xtask wheel` builds, installs and tries the package",
    ),
    everywhere(
        "pip wheel ",
        Instead::Omit,
        "builds for minutes; `cargo xtask wheel` does it",
    ),
    everywhere("git clone ", Instead::Omit, "needs the network"),
    everywhere(
        "http.server",
        Instead::Omit,
        "serves until it is stopped; the tests in the browser serve the same files",
    ),
    everywhere(
        "cmake ",
        Instead::Where("cmake"),
        "needs CMake; the tests of exported models compile the same files",
    ),
    on(
        "docs/tutorials/race.md",
        "contestants.py",
        Instead::Omit,
        "takes minutes, with packages of others",
    ),
    on(
        "examples/pixels/README.md",
        "compare.py",
        Instead::Omit,
        "takes minutes; the tests of films cover what it calls",
    ),
    on(
        "examples/mujoco_swing_up/README.md",
        "run.py",
        Instead::Omit,
        "takes minutes; the tests of plants run it on a cart and a pole",
    ),
    on(
        "tests/browser/README.md",
        "npm install",
        Instead::Omit,
        "needs the network",
    ),
    on(
        "tests/browser/README.md",
        "node audits.js",
        Instead::Omit,
        "needs Chromium and Lighthouse",
    ),
    on(
        "lagrangian track --help",
        "--robot iiwa7",
        Instead::Spelling,
        "a model of seven joints that was fitted for a second moves no robot",
    ),
    // Blocks of code.
    on(
        "docs/controllers.md",
        "#include \"arm.h\"",
        Instead::Omit,
        "a fragment; the tests of exported models compile and run the example that is exported with each",
    ),
    on(
        "docs/controllers.md",
        "mod arm;",
        Instead::Omit,
        "a fragment; the tests of exported models build the declarations for Rust",
    ),
    on(
        "docs/controllers.md",
        "import casadi",
        Instead::Omit,
        "needs CasADi: `cargo xtask adapters` runs it",
    ),
    on(
        "docs/controllers.md",
        "import fmpy",
        Instead::Omit,
        "needs FMPy: `cargo xtask adapters` runs it",
    ),
    on(
        "docs/saved-models.md",
        "def read(path)",
        Instead::Omit,
        "python/tests/test_saved_models.py runs it",
    ),
    on(
        "docs/python.md",
        "lagrangian.torch",
        Instead::Omit,
        "needs PyTorch: `cargo xtask python` runs its tests where it is installed",
    ),
];

/// The exception of a command or block, where it is one.
pub(super) fn of(page: &str, text: &str) -> Option<&'static Exception> {
    let fits =
        |own: &&Exception| (own.page.is_empty() || own.page == page) && text.contains(own.part);
    EXCEPTIONS.iter().find(fits)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_exception_has_a_reason_and_the_first_that_fits_is_taken() {
        assert!(EXCEPTIONS.iter().all(|own| own.reason.len() > 10));
        let found = of("README.md", "cargo xtask test").map(|own| own.instead);
        assert_eq!(found, Some(Instead::Chore));
        assert!(of("README.md", "lagrangian fit a.csv").is_none());
    }

    #[test]
    fn an_exception_of_one_page_is_none_of_another() {
        assert!(of("docs/controllers.md", "import fmpy").is_some());
        assert!(of("docs/python.md", "import fmpy").is_none());
    }
}
