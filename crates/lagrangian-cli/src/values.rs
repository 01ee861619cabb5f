//! Values on the command line that are refused before anything runs.

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use lagrangian::integrate::Method;
use lagrangian::settings::Range;
use lagrangian_run::Links;
use serde::{Deserialize, Serialize};

/// A whole number within bounds, which the message names.
fn whole(text: &str, least: u64, most: u64) -> Result<u64, String> {
    let number = text.trim().parse().ok();
    let number = number.filter(|x| (least..=most).contains(x));
    number.ok_or_else(|| format!("it must be a whole number, {least} or above, at most {most}"))
}

/// A seed that a TOML file can hold.
pub(crate) fn seed(text: &str) -> Result<u64, String> {
    whole(text, 0, i64::MAX as u64)
}

/// A number of steps, at least one.
pub(crate) fn steps(text: &str) -> Result<u64, String> {
    whole(text, 1, 1_000_000_000)
}

/// A count, which may be 0.
pub(crate) fn count(text: &str) -> Result<usize, String> {
    whole(text, 0, 1_000_000).map(|count| count as usize)
}

/// The largest number of rows that are used; `None` for all.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub(crate) struct Rows(pub(crate) Option<usize>);

/// The smallest number of rows of a sample of a long log.
const FEWEST_ROWS: usize = 1000;

/// A number of rows, or `all`.
pub(crate) fn rows(text: &str) -> Result<Rows, String> {
    let text = text.trim();
    let count = text.parse().ok().filter(|n| *n >= FEWEST_ROWS);
    match count {
        Some(count) => Ok(Rows(Some(count))),
        None if text == "all" => Ok(Rows(None)),
        None => Err(format!(
            "it must be a whole number, {FEWEST_ROWS} or above, or `all`"
        )),
    }
}

impl TryFrom<String> for Rows {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        rows(&text)
    }
}

impl From<Rows> for String {
    fn from(rows: Rows) -> Self {
        rows.0.map_or_else(|| "all".into(), |n| n.to_string())
    }
}

/// The name of a column, joint or topic.
pub(crate) fn name(text: &str) -> Result<String, String> {
    let name = text.trim();
    match name.is_empty() {
        true => Err("it names nothing: give a name, or omit the flag or the comma".into()),
        false => Ok(name.into()),
    }
}

/// A number within bounds, which the message names.
pub(crate) fn in_range(text: &str, range: Range) -> Result<f64, String> {
    let found = number(text).filter(|x| range.contains(*x));
    found.ok_or_else(|| format!("it must be a number {}", range.words()))
}

/// A number above 0.
pub(crate) fn positive(text: &str) -> Result<f64, String> {
    in_range(text, Range::POSITIVE)
}

/// A number, 0 or above.
pub(crate) fn non_negative(text: &str) -> Result<f64, String> {
    in_range(text, Range::NON_NEGATIVE)
}

/// A tolerance that an adaptive method can meet.
pub(crate) fn tolerance(text: &str) -> Result<f64, String> {
    in_range(text, Range::new(1e-15, 1.0))
}

/// A number of any sign.
pub(crate) fn finite(text: &str) -> Result<f64, String> {
    in_range(text, Range::new(-1e12, 1e12))
}

/// A part of something, less than all of it.
pub(crate) fn fraction(text: &str) -> Result<f64, String> {
    in_range(text, Range::new(0.0, 0.99))
}

/// The methods of integration by their names.
pub(crate) fn method() -> impl TypedValueParser<Value = Method> {
    let values = Method::TABLE.map(|(_, named)| PossibleValue::new(named.name).help(named.help));
    PossibleValuesParser::new(values).try_map(|name| name.parse::<Method>())
}

/// The reference of the angles of a drawn chain.
pub(crate) fn links() -> impl TypedValueParser<Value = Links> {
    let names = PossibleValuesParser::new(["absolute", "relative", "horizontal"]);
    names.try_map(|name| serde_json::from_value(name.into()))
}

/// `name=value`.
pub(crate) fn assignment(text: &str) -> Result<(String, f64), String> {
    let example = "write it as name=value, e.g. length=2";
    let (name, value) = text.split_once('=').ok_or(example)?;
    let value = finite(value).map_err(|why| format!("'{value}': {why}: {example}"))?;
    Ok((name.trim().into(), value))
}

fn number(text: &str) -> Option<f64> {
    text.trim().parse().ok().filter(|x: &f64| x.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_must_be_above_0_and_finite() {
        assert_eq!(positive("1e-3"), Ok(1e-3));
        for bad in ["0", "-1", "nan", "inf", "fast", ""] {
            assert!(positive(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn a_parameter_is_a_name_and_a_number() {
        assert_eq!(assignment("length=2"), Ok(("length".into(), 2.0)));
        for bad in ["length", "length=", "length=long"] {
            assert!(assignment(bad).is_err(), "{bad}");
        }
    }
}
