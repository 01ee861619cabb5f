//! Flags that are made from the tables of settings of the library, so that each setting is defined once.

use clap::builder::{PossibleValue, PossibleValuesParser, ValueParser};
use clap::parser::ValueSource;
use clap::{Arg, ArgAction, ArgMatches, Args, Command, FromArgMatches};
use lagrangian::fit::{ROLLOUT_SETTINGS, SETTINGS};
use lagrangian::models::FAMILIES;
use lagrangian::settings::{Kind, Named, Range, Setting, Values};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::values::in_range;

/// A table of settings: its heading in `--help`, and its settings, each once.
struct Table {
    heading: &'static str,
    offered: fn() -> Vec<Offered>,
}

/// The settings of all families, of the training and of the rollout loss.
const TABLES: [Table; 3] = [
    Table {
        heading: "Model",
        offered: of_families,
    },
    Table {
        heading: "Training",
        offered: || of_all(SETTINGS),
    },
    Table {
        heading: "Rollout loss",
        offered: || of_all(ROLLOUT_SETTINGS),
    },
];
/// The place of each table.
pub(crate) const OF_FAMILIES: usize = 0;
pub(crate) const OF_TRAINING: usize = 1;
pub(crate) const OF_ROLLOUTS: usize = 2;

/// A setting in the form of a flag.
struct Offered {
    setting: Setting,
    /// The families that have it, where they are few.
    families: Vec<&'static str>,
}

/// The settings of all families, each with the families that have it.
fn of_families() -> Vec<Offered> {
    let mut all: Vec<Offered> = Vec::new();
    for family in FAMILIES {
        for setting in family.settings {
            match all.iter_mut().find(|o| o.setting.name == setting.name) {
                Some(known) => known.families.push(family.name),
                None => all.push(Offered {
                    setting: *setting,
                    families: vec![family.name],
                }),
            }
        }
    }
    all
}

/// Settings that do not depend on the family.
fn of_all(table: &[Setting]) -> Vec<Offered> {
    let offered = |setting: &Setting| Offered {
        setting: *setting,
        families: Vec::new(),
    };
    table.iter().map(offered).collect()
}

/// The given settings of the table at this place.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
#[serde(transparent)]
pub(crate) struct SettingArgs<const TABLE: usize> {
    /// The values by name.
    pub(crate) values: Values,
}

impl<const TABLE: usize> Args for SettingArgs<TABLE> {
    fn augment_args(command: Command) -> Command {
        let Table { heading, offered } = &TABLES[TABLE];
        let offered = offered();
        let mut names: Vec<&str> = offered.iter().map(|o| o.setting.name).collect();
        // A longer name first, so that `batch` is not replaced within `batch_first`.
        names.sort_by_key(|name| std::cmp::Reverse(name.len()));
        let arguments = offered.iter().filter_map(|o| argument(o, &names));
        command.args(arguments.map(|argument| argument.help_heading(*heading)))
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl<const TABLE: usize> FromArgMatches for SettingArgs<TABLE> {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let mut args = Self::default();
        args.update_from_arg_matches(matches)?;
        Ok(args)
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        for Offered { setting, .. } in (TABLES[TABLE].offered)() {
            if let Some(value) = given(&setting, matches) {
                self.values.insert(setting.name.into(), value);
            }
        }
        Ok(())
    }
}

/// Flags that another command explains.
#[derive(Debug, Clone, Default)]
pub(crate) struct Hidden<A>(pub(crate) A);

impl<A: Args> Args for Hidden<A> {
    fn augment_args(command: Command) -> Command {
        let flags = A::augment_args(Command::new("hidden"));
        command.args(flags.get_arguments().map(|flag| flag.clone().hide(true)))
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl<A: FromArgMatches> FromArgMatches for Hidden<A> {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        A::from_arg_matches(matches).map(Self)
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        self.0.update_from_arg_matches(matches)
    }
}

/// The flag of a setting; `None` for a robot, which is read from a file of its own.
fn argument(offered: &Offered, names: &[&str]) -> Option<Arg> {
    let Offered { setting, families } = offered;
    let flag = Arg::new(setting.name)
        .long(setting.name.replace('_', "-"))
        .help(help(setting, families, names));
    let flag = match setting.placeholder {
        "" => flag.value_name(setting.name.to_uppercase()),
        placeholder => flag.value_name(placeholder),
    };
    let list = |flag: Arg| flag.action(ArgAction::Append).value_delimiter(',');
    Some(match setting.kind {
        Kind::Robot => return None,
        Kind::Flag => flag
            .value_parser(clap::value_parser!(bool))
            .value_name("BOOL")
            .num_args(0..=1)
            .require_equals(true)
            .default_missing_value("true"),
        Kind::Choice(values) => flag.value_parser(one_of(values)),
        Kind::Choices(values) => list(flag).value_parser(one_of(values)),
        Kind::Integer { min, max } => flag.value_parser(clap::value_parser!(u64).range(min..=max)),
        Kind::Number(range) => flag.value_parser(number(range)),
        Kind::Numbers(range) => list(flag).value_parser(number(range)),
        Kind::Document(values) => flag.value_parser(document(values)),
    })
}

/// The help of a setting: its meaning, the families that have it where they are few, its default.
fn help(setting: &Setting, families: &[&str], names: &[&str]) -> String {
    let mut text = with_flags(setting.help, names);
    if !families.is_empty() && 2 * families.len() <= FAMILIES.len() {
        text += &format!(" ({})", families.join(", "));
    }
    if !setting.default.is_empty() {
        text += &format!(" [default: {}]", with_flags(setting.default, names));
    }
    text
}

/// Names of settings in backticks as their flags.
fn with_flags(text: &str, names: &[&str]) -> String {
    names.iter().fold(text.to_string(), |text, name| {
        text.replace(
            &format!("`{name}`"),
            &format!("--{}", name.replace('_', "-")),
        )
    })
}

/// The values of a table of names, with the help of each.
pub(crate) fn one_of(values: &[Named]) -> PossibleValuesParser {
    let value = |value: &Named| PossibleValue::new(value.name).help(sentence(value.help));
    PossibleValuesParser::new(values.iter().map(value))
}

/// The text with a capital letter first, where it begins with a word and not with a formula.
pub(crate) fn sentence(text: &str) -> String {
    let words = text.split(' ').count() > 2;
    let word = text.split(' ').next().unwrap_or_default();
    let mut letters = text.chars();
    match letters.next() {
        Some(first) if words && word.len() > 2 && word.chars().all(|c| c.is_ascii_alphabetic()) => {
            first.to_uppercase().chain(letters).collect()
        }
        _ => text.into(),
    }
}

fn number(range: Range) -> ValueParser {
    ValueParser::new(move |text: &str| in_range(text, range))
}

/// One of these names, or the JSON document of a file.
fn document(names: &'static [Named]) -> ValueParser {
    ValueParser::new(move |text: &str| -> Result<Value, String> {
        if names.iter().any(|own| own.name == text) {
            return Ok(text.into());
        }
        let all: Vec<&str> = names.iter().map(|own| own.name).collect();
        let all = all.join(", ");
        let bytes = std::fs::read(text).map_err(|error| {
            format!("neither one of {all} nor a file that can be read: {error}")
        })?;
        serde_json::from_slice(&bytes).map_err(|error| format!("the file is no JSON: {error}"))
    })
}

/// The given value of a setting.
fn given(setting: &Setting, matches: &ArgMatches) -> Option<Value> {
    let name = setting.name;
    if setting.kind == Kind::Robot || matches.value_source(name) != Some(ValueSource::CommandLine) {
        return None;
    }
    match setting.kind {
        Kind::Robot => None,
        Kind::Flag => one::<bool>(matches, name),
        Kind::Choice(_) => one::<String>(matches, name),
        Kind::Choices(_) => all::<String>(matches, name),
        Kind::Integer { .. } => one::<u64>(matches, name),
        Kind::Number(_) => one::<f64>(matches, name),
        Kind::Numbers(_) => all::<f64>(matches, name),
        Kind::Document(_) => one::<Value>(matches, name),
    }
}

fn one<V>(matches: &ArgMatches, name: &str) -> Option<Value>
where
    V: Clone + Send + Sync + Into<Value> + 'static,
{
    matches.get_one::<V>(name).cloned().map(Into::into)
}

fn all<V>(matches: &ArgMatches, name: &str) -> Option<Value>
where
    V: Clone + Send + Sync + Into<Value> + 'static,
{
    let values = matches.get_many::<V>(name)?.cloned();
    Some(Value::Array(values.map(Into::into).collect()))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;

    fn parsed<const TABLE: usize>(line: &str) -> Result<Values, clap::Error> {
        let command = SettingArgs::<TABLE>::augment_args(Command::new("fit"));
        let matches = command.try_get_matches_from(line.split(' '))?;
        Ok(SettingArgs::<TABLE>::from_arg_matches(&matches)?.values)
    }

    #[test]
    fn flags_become_the_values_that_the_library_takes() {
        let values = parsed::<OF_FAMILIES>(
            "fit --width 32 --speed-limit 3 --exponential --forces viscous,offset --masses 1,2.5",
        );
        let expected = serde_json::json!({
            "width": 32,
            "speed_limit": 3.0,
            "exponential": true,
            "forces": ["viscous", "offset"],
            "masses": [1.0, 2.5],
        });
        assert_eq!(Value::Object(values.unwrap()), expected);
    }

    #[test]
    fn what_is_not_given_is_absent() {
        assert!(parsed::<OF_FAMILIES>("fit").unwrap().is_empty());
        assert!(parsed::<OF_TRAINING>("fit").unwrap().is_empty());
    }

    #[test]
    fn values_outside_the_table_are_refused() {
        for line in ["fit --width 0", "fit --form round", "fit --speed-limit -1"] {
            assert!(parsed::<OF_FAMILIES>(line).is_err(), "{line}");
        }
        assert!(parsed::<OF_ROLLOUTS>("fit --growth 1").is_err());
    }

    #[test]
    fn help_names_flags_and_the_few_families_that_have_them() {
        let help = SettingArgs::<OF_FAMILIES>::augment_args(Command::new("fit"))
            .render_long_help()
            .to_string();
        let words = help.split_whitespace().collect::<Vec<_>>().join(" ");
        for part in [
            "(see --speed-chart)",
            "(hnn)",
            "[default: 2]",
            "- convex: Convex in q̇",
        ] {
            assert!(words.contains(part), "{part}: {words}");
        }
    }
}
