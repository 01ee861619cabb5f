//! Situations in which the command prints a hint, which is then run.

use super::pages::{self, Page};

/// A name, and shell commands, whose comments name the exit code.
const SITUATIONS: [(&str, &str); 7] = [
    ("a check that passes", "lagrangian check motion.csv"),
    (
        "a check of a log with forces and noise",
        "lagrangian check log.csv --angle all",
    ),
    ("a check of noisy positions", "lagrangian check noisy.csv"),
    (
        "a run that exists",
        "lagrangian fit motion.csv --out run --quiet\nlagrangian fit motion.csv --out run  # exit code 2",
    ),
    (
        "a system that is unknown",
        "lagrangian simulate pendulums  # exit code 2",
    ),
    (
        "a model that is no model",
        "lagrangian score motion.csv motion.csv  # exit code 2",
    ),
    ("a demo", "lagrangian demo --out demo"),
];

/// The situations as pages.
pub(super) fn pages() -> impl Iterator<Item = Page> {
    let page = |(name, text): (&str, &str)| pages::of_text(name, &format!("```sh\n{text}\n```\n"));
    SITUATIONS.into_iter().map(page)
}
