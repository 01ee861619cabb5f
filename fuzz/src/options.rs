//! The flags of the driver.

use std::path::PathBuf;

use fuzz::{TARGETS, Target};

const USAGE: &str = "\
usage: fuzz TARGET [--seconds N | --executions N] [--seed N] [--faults FOLDER] [--repeat FILE]";

/// When a run ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Limit {
    Seconds(f64),
    Executions(u64),
}

/// What is asked for.
#[derive(Debug, Clone)]
pub(crate) struct Options {
    pub(crate) target: Target,
    pub(crate) limit: Limit,
    pub(crate) seed: u64,
    pub(crate) corpus: PathBuf,
    pub(crate) faults: PathBuf,
    /// A file that is executed once, in the place of a run.
    pub(crate) repeat: Option<PathBuf>,
}

impl Options {
    pub(crate) fn read(words: &[&str]) -> Result<Self, String> {
        let (name, mut flags) = match words {
            [name, flags @ ..] => (*name, flags.iter()),
            [] => return Err(USAGE.into()),
        };
        let target = TARGETS.into_iter().find(|target| target.name == name);
        let known = TARGETS.map(|target| target.name).join(", ");
        let own = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
        let mut options = Self {
            target: target.ok_or_else(|| format!("'{name}' is no target: {known}\n{USAGE}"))?,
            limit: Limit::Seconds(10.0),
            seed: 0,
            corpus: own.join("corpus"),
            faults: own.join("../target/fuzz"),
            repeat: None,
        };
        while let Some(flag) = flags.next() {
            let value = flags
                .next()
                .ok_or_else(|| format!("{flag} needs a value\n{USAGE}"))?;
            let wrong = || format!("{flag} does not take '{value}'\n{USAGE}");
            match *flag {
                "--seconds" => {
                    options.limit = Limit::Seconds(value.parse().map_err(|_| wrong())?);
                }
                "--executions" => {
                    options.limit = Limit::Executions(value.parse().map_err(|_| wrong())?);
                }
                "--seed" => options.seed = value.parse().map_err(|_| wrong())?,
                "--faults" => options.faults = value.into(),
                "--repeat" => options.repeat = Some(value.into()),
                _ => return Err(format!("there is no flag {flag}\n{USAGE}")),
            }
        }
        Ok(options)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flags_are_read_and_unknown_ones_refused() {
        let read = |words: &[&str]| Options::read(words).map(|o| (o.target.name, o.limit, o.seed));
        let given = ["csv", "--executions", "7", "--seed", "3"];
        assert_eq!(read(&given), Ok(("csv", Limit::Executions(7), 3)));
        for bad in [
            &["pdf"][..],
            &["csv", "--seed"],
            &["csv", "--seed", "x"],
            &["csv", "--a", "1"],
        ] {
            assert!(read(bad).is_err(), "{bad:?}");
        }
    }
}
