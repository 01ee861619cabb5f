//! The settings that a sweep varies: all combinations of lists, or random draws from lists and ranges.

use lagrangian::settings::Values;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};
use sha2::{Digest, Sha256};

use crate::error::{Error, Result};

/// The most units of a sweep.
pub(super) const MOST_UNITS: usize = 100_000;

/// How the space is searched.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Method {
    /// All combinations.
    #[default]
    Grid,
    /// Random draws.
    Random,
}

/// How many settings are tried, and which.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Search {
    /// All combinations, or random draws.
    pub method: Method,
    /// The number of random draws.
    pub number: Option<usize>,
    /// The seed of the draws.
    pub seed: u64,
}

/// The values of a setting.
#[derive(Debug, Clone, PartialEq)]
enum Choices {
    List(Vec<Value>),
    Range(Range),
}

/// The numbers between two ends.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct Range {
    from: f64,
    to: f64,
    /// Whether their logarithm is drawn evenly.
    #[serde(default)]
    log: bool,
    /// Whether whole numbers are drawn.
    #[serde(default)]
    whole: bool,
}

/// The settings that are varied, in the order of their names.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Space(Vec<(String, Choices)>);

impl Space {
    /// The space of these settings: each a list of values, or a range `{ from, to, log, whole }`.
    ///
    /// # Errors
    /// [`Error::Refused`], which names the setting.
    pub fn of(given: &Map<String, Value>) -> Result<Self> {
        let choices = |(name, value): (&String, &Value)| Ok((name.clone(), read(name, value)?));
        Ok(Self(given.iter().map(choices).collect::<Result<_>>()?))
    }

    /// The settings of each unit.
    ///
    /// # Errors
    /// [`Error::Refused`] for a search that has no end or no number.
    pub fn points(&self, search: &Search) -> Result<Vec<Values>> {
        match (search.method, search.number) {
            (Method::Grid, None) => self.grid(),
            (Method::Grid, Some(_)) => Err(Error::new(
                "'number' is for a random search, and this is a grid",
                "omit it, or search by method = \"random\"",
            )),
            (Method::Random, None | Some(0)) => Err(Error::new(
                "a random search has no number of units",
                "give number = 20",
            )),
            (Method::Random, Some(number)) if number > MOST_UNITS => Err(too_many(number)),
            (Method::Random, Some(number)) => {
                Ok((0..number).map(|k| self.draw(search.seed, k)).collect())
            }
        }
    }

    fn grid(&self) -> Result<Vec<Values>> {
        let mut points = vec![Values::new()];
        for (name, choices) in &self.0 {
            let Choices::List(list) = choices else {
                return Err(Error::new(
                    format!("the setting '{name}' has a range, and a grid has lists"),
                    "give a list of values, or search by method = \"random\"",
                ));
            };
            let count = points.len().saturating_mul(list.len());
            if count > MOST_UNITS {
                return Err(too_many(count));
            }
            let with = |point: &Values, value: &Value| {
                let mut point = point.clone();
                point.insert(name.clone(), value.clone());
                point
            };
            let all = points.iter();
            let all = all.flat_map(|point| list.iter().map(move |value| with(point, value)));
            points = all.collect();
        }
        Ok(points)
    }

    /// The draw with this number, which depends on no other.
    fn draw(&self, seed: u64, number: usize) -> Values {
        let value = |(name, choices): &(String, Choices)| {
            let part = uniform(&format!("{seed}/{number}/{name}"));
            (name.clone(), choices.at(part))
        };
        self.0.iter().map(value).collect()
    }
}

impl Choices {
    /// The value at a part of the whole, 0 to below 1.
    fn at(&self, part: f64) -> Value {
        match self {
            Self::List(list) => {
                #[expect(
                    clippy::cast_possible_truncation,
                    clippy::cast_sign_loss,
                    reason = "it is below the length"
                )]
                let k = (part * list.len() as f64) as usize;
                list[k.min(list.len() - 1)].clone()
            }
            Self::Range(range) => range.at(part),
        }
    }
}

impl Range {
    fn at(self, part: f64) -> Value {
        let Self { from, to, .. } = self;
        // The last of whole numbers has as much of the range as the others.
        let to = if self.whole { to + 1.0 } else { to };
        let x = match self.log {
            true => (from.ln() + part * (to.ln() - from.ln())).exp(),
            false => from + part * (to - from),
        };
        if self.whole {
            #[expect(clippy::cast_possible_truncation, reason = "the ends are bounded")]
            return json!(x.floor().clamp(self.from, self.to) as i64);
        }
        // Six digits, so that a value reads well and does not depend on the mathematical library of a machine.
        let rounded: f64 = format!("{x:.5e}").parse().unwrap_or(x);
        json!(rounded.clamp(from, to))
    }

    fn refused(self) -> Option<&'static str> {
        let whole = |x: f64| x.fract() == 0.0 && x.abs() < 9e15;
        match self {
            Self { from, to, .. } if !(from.is_finite() && to.is_finite() && from < to) => {
                Some("give two numbers, 'from' below 'to'")
            }
            Self {
                log: true, from, ..
            } if from <= 0.0 => Some("a logarithmic range begins above 0"),
            Self {
                whole: true,
                from,
                to,
                ..
            } if !(whole(from) && whole(to)) => Some("a range of whole numbers has whole ends"),
            _ => None,
        }
    }
}

fn read(name: &str, value: &Value) -> Result<Choices> {
    let refused = |remedy: &str| {
        let finding = format!("the values of '{}' cannot be used", lagrangian::brief(name));
        Error::new(finding, remedy)
    };
    match value {
        Value::Array(list) if list.is_empty() => Err(refused("the list is empty: give values")),
        Value::Array(list) => Ok(Choices::List(list.clone())),
        Value::Object(_) => {
            let range: Range = serde_json::from_value(value.clone()).map_err(|e| {
                refused(&format!(
                    "give a range as {{ from = 1e-3, to = 1e-1, log = true }} ({e})"
                ))
            })?;
            range
                .refused()
                .map_or(Ok(Choices::Range(range)), |words| Err(refused(words)))
        }
        _ => Err(refused(
            "give a list of values, or a range { from, to }; one value is among the fixed settings",
        )),
    }
}

fn too_many(count: usize) -> Error {
    Error::new(
        format!("the sweep has {count} units"),
        format!("make it smaller: at most {MOST_UNITS}"),
    )
}

/// A number from 0 to below 1 that a text determines.
fn uniform(text: &str) -> f64 {
    let hash = Sha256::digest(text.as_bytes());
    let first = hash
        .iter()
        .take(8)
        .fold(0_u64, |x, b| x << 8 | u64::from(*b));
    // 53 bits: each is a number of its own.
    (first >> 11) as f64 / (1_u64 << 53) as f64
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;

    fn space(given: Value) -> Result<Space> {
        Space::of(given.as_object().unwrap())
    }

    fn random(number: usize) -> Search {
        Search {
            method: Method::Random,
            number: Some(number),
            seed: 7,
        }
    }

    #[test]
    fn a_grid_has_all_combinations_once() {
        let space = space(json!({ "width": [8, 16], "seed": [0, 1, 2] })).unwrap();
        let points = space.points(&Search::default()).unwrap();
        assert_eq!(points.len(), 6);
        assert_eq!(
            Value::Object(points[1].clone()),
            json!({ "seed": 0, "width": 16 })
        );
        assert!((1..6).all(|k| !points[..k].contains(&points[k])));
    }

    #[test]
    fn random_draws_fill_their_ranges_and_do_not_depend_on_their_number() {
        let space = space(json!({
            "learning_rate": { "from": 1e-3, "to": 1e-1, "log": true },
            "layers": { "from": 1, "to": 3, "whole": true },
            "form": ["convex", "free"],
        }));
        let space = space.unwrap();
        let points = space.points(&random(300)).unwrap();
        assert_eq!(points[..10], space.points(&random(10)).unwrap());
        let numbers =
            |name: &str| -> Vec<f64> { points.iter().filter_map(|p| p[name].as_f64()).collect() };
        let rates = numbers("learning_rate");
        assert!(rates.iter().all(|x| (1e-3..=1e-1).contains(x)));
        let below = rates.iter().filter(|x| **x < 1e-2).count();
        assert!((100..200).contains(&below), "half of them: {below}");
        let layers = numbers("layers");
        assert!([1.0, 2.0, 3.0].iter().all(|x| layers.contains(x)));
        assert!(points.iter().any(|p| p["form"] == "free"));
    }

    #[test]
    fn spaces_without_an_end_are_refused() {
        for bad in [
            json!({ "width": [] }),
            json!({ "width": 3 }),
            json!({ "width": { "from": 3, "to": 1 } }),
            json!({ "width": { "from": 0, "to": 1, "log": true } }),
            json!({ "width": { "from": 0.5, "to": 3, "whole": true } }),
            json!({ "width": { "form": 3, "to": 1 } }),
        ] {
            assert!(space(bad.clone()).is_err(), "{bad}");
        }
        let range = space(json!({ "width": { "from": 1, "to": 3 } })).unwrap();
        assert!(range.points(&Search::default()).is_err());
        let long: Vec<u32> = (0..1000).collect();
        let large = space(json!({ "a": long, "b": long })).unwrap();
        assert!(large.points(&Search::default()).is_err());
        assert!(range.points(&random(0)).is_err());
        assert!(range.points(&random(usize::MAX)).is_err());
    }
}
