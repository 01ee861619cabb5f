//! Settings as data: names, meanings and values, so that every interface for people
//! (flags of a command, keyword arguments, forms) is generated from one table.
//!
//! Values that a person gives are passed as one JSON object, [`Values`], from names to values.

use serde_json::{Map, Value};

use crate::error::shortened;
use crate::{Error, Result};

/// Values of settings by name; absent names were not given.
pub type Values = Map<String, Value>;

/// Description of a setting.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Setting {
    /// The name, in lower case with underscores.
    pub name: &'static str,
    /// Effect of the setting, in a sentence without a full stop; with the names of other settings in backticks.
    pub help: &'static str,
    /// The values that it accepts.
    pub kind: Kind,
    /// The default, in words; empty without one.
    pub default: &'static str,
    /// The placeholder of its value in a synopsis; empty for its name.
    pub placeholder: &'static str,
    /// Another setting without which it has no effect, if there is one.
    pub needs: Option<Need>,
}

/// The setting that another one needs to have an effect on a fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Need {
    /// Name of the setting.
    pub setting: &'static str,
    /// Its values under which the other one has an effect; empty for any value.
    pub values: &'static [&'static str],
}

/// The values that a setting accepts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Kind {
    /// One of these names.
    Choice(&'static [Named]),
    /// Some of these names, as a JSON array.
    Choices(&'static [Named]),
    /// A switch that is on or off.
    Flag,
    /// A whole number in this range, both ends included.
    Integer {
        /// The smallest value.
        min: u64,
        /// The largest value.
        max: u64,
    },
    /// A number in this range.
    Number(Range),
    /// Several numbers in this range.
    Numbers(Range),
    /// A robot as `RobotConfig`.
    Robot,
    /// One of these names, or a document: a JSON object or array.
    Document(&'static [Named]),
}

/// A named value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Named {
    /// The name.
    pub name: &'static str,
    /// The meaning of the value.
    pub help: &'static str,
}

/// A range of numbers, both ends included.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Range {
    /// The smallest value.
    pub min: f64,
    /// The largest value.
    pub max: f64,
}

impl Setting {
    /// A setting without a default or a placeholder.
    #[must_use]
    pub const fn new(name: &'static str, kind: Kind, help: &'static str) -> Self {
        Self {
            name,
            help,
            kind,
            default: "",
            placeholder: "",
            needs: None,
        }
    }

    /// Sets the default, in words.
    #[must_use]
    pub const fn or(self, default: &'static str) -> Self {
        Self { default, ..self }
    }

    /// Declares that the setting has no effect without these values of another one; an empty list means any value.
    #[must_use]
    pub const fn needing(self, setting: &'static str, values: &'static [&'static str]) -> Self {
        Self {
            needs: Some(Need { setting, values }),
            ..self
        }
    }

    /// Sets the placeholder.
    #[must_use]
    pub const fn shown_as(self, placeholder: &'static str) -> Self {
        Self {
            placeholder,
            ..self
        }
    }
}

impl Setting {
    /// Refuses a value that is not of the kind of the setting.
    ///
    /// # Errors
    /// [`Error::Setting`], with the setting, the value, and the accepted values.
    pub fn check(&self, value: &Value) -> Result<()> {
        let all =
            |items: &dyn Fn(&Value) -> bool| value.as_array().is_some_and(|v| v.iter().all(items));
        let one_of = |names: &[Named], value: &Value| {
            let name = value.as_str();
            names.iter().any(|known| Some(known.name) == name)
        };
        let fits = match self.kind {
            Kind::Choice(names) => one_of(names, value),
            Kind::Choices(names) => all(&|value| one_of(names, value)),
            Kind::Flag => value.is_boolean(),
            Kind::Integer { min, max } => value.as_u64().is_some_and(|x| (min..=max).contains(&x)),
            Kind::Number(range) => value.as_f64().is_some_and(|x| range.contains(x)),
            Kind::Numbers(range) => all(&|value| value.as_f64().is_some_and(|x| range.contains(x))),
            Kind::Robot => value.is_object(),
            Kind::Document(names) => one_of(names, value) || value.is_object() || value.is_array(),
        };
        match fits {
            true => Ok(()),
            false => Err(Error::setting(
                format!("`{}` is {}", self.name, shortened(&value.to_string())),
                format!("it must be {}", self.kind.wanted()),
            )),
        }
    }
}

impl Kind {
    /// The accepted values, in words.
    #[must_use]
    pub fn wanted(&self) -> String {
        let names = |values: &[Named]| {
            let names: Vec<&str> = values.iter().map(|value| value.name).collect();
            names.join(", ")
        };
        match self {
            Self::Choice(values) => format!("one of {}", names(values)),
            Self::Choices(values) => format!("a list of some of {}", names(values)),
            Self::Flag => "true or false".into(),
            Self::Integer { min, max } => format!("a whole number from {min} to {max}"),
            Self::Number(range) => format!("a number {}", range.words()),
            Self::Numbers(range) => format!("a list of numbers {}", range.words()),
            Self::Robot => "a robot".into(),
            Self::Document(values) => format!("one of {}, or a document", names(values)),
        }
    }
}

impl Range {
    /// Bounds of positive quantities in SI units: values outside are mistakes.
    pub const POSITIVE: Self = Self::new(1e-12, 1e12);
    /// Bounds of quantities that may be 0.
    pub const NON_NEGATIVE: Self = Self::new(0.0, 1e12);

    /// The range between two numbers.
    #[must_use]
    pub const fn new(min: f64, max: f64) -> Self {
        Self { min, max }
    }

    /// Whether a number lies in it.
    #[must_use]
    pub fn contains(self, x: f64) -> bool {
        (self.min..=self.max).contains(&x)
    }

    /// The range in words, after "a number".
    #[must_use]
    pub fn words(self) -> String {
        let Self { min, max } = self;
        match min {
            x if x > 0.0 => format!("above 0, from {} to {}", shown(min), shown(max)),
            0.0 => format!("0 or above, at most {}", shown(max)),
            _ => format!("from {} to {}", shown(min), shown(max)),
        }
    }
}

impl Need {
    /// The other setting with the values that it must have, in words.
    #[must_use]
    pub fn words(self) -> String {
        let words = format!("`{}` {}", self.setting, self.values.join(" or "));
        words.trim_end().into()
    }

    /// Whether the other setting has one of the needed values.
    pub fn is_met(self, value: Option<&Value>) -> bool {
        let named = |value: &Value| value.as_str().is_some_and(|x| self.values.contains(&x));
        value.is_some_and(|value| self.values.is_empty() || named(value))
    }
}

/// A bound as people write it.
fn shown(x: f64) -> String {
    match x.abs() {
        size if size == 0.0 || (1e-3..1e6).contains(&size) => x.to_string(),
        _ => format!("{x:e}"),
    }
}

/// A named value for a table.
#[must_use]
pub const fn named(name: &'static str, help: &'static str) -> Named {
    Named { name, help }
}

/// Whether `value` is the mark of older records for a setting that was not given.
#[must_use]
pub fn is_absent(value: &Value) -> bool {
    match value {
        Value::Null | Value::Bool(false) => true,
        Value::Array(items) => items.is_empty(),
        _ => false,
    }
}

/// Larger numbers of differences are counted, not named.
const MOST_NAMED: usize = 4;

/// The settings in which two JSON objects differ, in words: `optimizer.name was "natural" and is "adam"`; `None` if they are
/// equal.
#[must_use]
pub fn difference(then: &Value, now: &Value) -> Option<String> {
    let mut all = Vec::new();
    compare("", then, now, &mut all);
    let more = all.len().saturating_sub(MOST_NAMED);
    all.truncate(MOST_NAMED);
    if more > 0 {
        all.push(format!("{more} more differ"));
    }
    (!all.is_empty()).then(|| all.join("; "))
}

fn compare(path: &str, then: &Value, now: &Value, found: &mut Vec<String>) {
    let (Value::Object(old), Value::Object(new)) = (then, now) else {
        if then != now {
            found.push(format!("{path} was {} and is {}", brief(then), brief(now)));
        }
        return;
    };
    let added = new.keys().filter(|key| !old.contains_key(*key));
    for key in old.keys().chain(added) {
        let path = match path {
            "" => key.clone(),
            _ => format!("{path}.{key}"),
        };
        let value = |all: &Values| all.get(key).cloned().unwrap_or_default();
        compare(&path, &value(old), &value(new), found);
    }
}

/// A value in the form that messages use.
fn brief(value: &Value) -> String {
    match value {
        Value::Null => "not given".into(),
        other => shortened(&other.to_string()),
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn a_value_of_another_kind_is_refused_with_its_setting_and_what_it_must_be() {
        let number = Setting::new("rate", Kind::Number(Range::new(1e-3, 1e6)), "");
        let list = Setting::new(
            "terms",
            Kind::Choices(const { &[named("a", ""), named("b", "")] }),
            "",
        );
        let whole = Setting::new("steps", Kind::Integer { min: 1, max: 9 }, "");
        for (setting, good, bad, words) in [
            (
                &number,
                json!(0.5),
                json!(0),
                "`rate` is 0: it must be a number above 0, from 0.001 to 1e6",
            ),
            (
                &list,
                json!(["b"]),
                json!(["c"]),
                "`terms` is [\"c\"]: it must be a list of some of a, b",
            ),
            (
                &whole,
                json!(9),
                json!("x"),
                "`steps` is \"x\": it must be a whole number from 1 to 9",
            ),
        ] {
            assert!(setting.check(&good).is_ok());
            let message = setting.check(&bad).map_err(|e| e.to_string());
            assert_eq!(message, Err(words.into()));
        }
    }

    #[test]
    fn differences_are_named_with_both_values() {
        let then = json!({ "batch": 256, "optimizer": { "name": "natural" } });
        assert_eq!(difference(&then, &then), None);
        let now = json!({ "batch": 256, "optimizer": { "name": "adam" } });
        let words = "optimizer.name was \"natural\" and is \"adam\"";
        assert_eq!(difference(&then, &now).as_deref(), Some(words));
        let many = json!({ "a": 1, "b": 1, "c": 1, "d": 1, "e": 1 });
        let words = difference(&many, &json!({})).unwrap_or_default();
        assert!(
            words.ends_with("d was 1 and is not given; 1 more differ"),
            "{words}"
        );
        let less = json!({ "batch": 256 });
        let words = "optimizer was {\"name\":\"natural\"} and is not given";
        assert_eq!(difference(&then, &less).as_deref(), Some(words));
    }
}
