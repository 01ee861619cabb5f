//! What an experiment measured: a grid of contestants, quantities and seeds, and what is drawn beside it.

use lagrangian_report::{Axis, Figure, HeatMap, Role, Series, Table};
use serde::Serialize;
use serde_json::{Map, Value, json};

/// Who is compared, and how it is fitted: a `FitConfig` or what makes one.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Contestant<C = ()> {
    /// Its name in JSON and in files.
    pub(crate) key: &'static str,
    /// Its name on the page.
    pub(crate) name: &'static str,
    pub(crate) role: Role,
    pub(crate) config: C,
}

/// A contestant in one line.
pub(crate) const fn contestant<C>(
    key: &'static str,
    name: &'static str,
    role: Role,
    config: C,
) -> Contestant<C> {
    Contestant {
        key,
        name,
        role,
        config,
    }
}

/// A table of contestants: a row has the key, the name on the page, the role, and how it is fitted.
macro_rules! contestants {
    ($($key:literal, $name:literal, $role:ident $(($n:literal))?, $config:expr;)*) => {
        [$(crate::harness::contestant(
            $key,
            $name,
            lagrangian_report::Role::$role $(($n))?,
            $config,
        )),*]
    };
}
pub(crate) use contestants;

/// Which way a quantity is better.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Better {
    Less,
    More,
    /// It says something about the run, not about the model.
    Neither,
}

/// A number that is measured for each contestant and seed.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Quantity {
    /// Its name in JSON.
    pub(crate) key: &'static str,
    /// Its name on the page.
    pub(crate) name: &'static str,
    pub(crate) unit: &'static str,
    pub(crate) better: Better,
}

/// A quantity that is neither good nor bad.
pub(crate) const fn neither(key: &'static str, name: &'static str, unit: &'static str) -> Quantity {
    Quantity {
        key,
        name,
        unit,
        better: Better::Neither,
    }
}

/// A quantity that should be small.
pub(crate) const fn less(key: &'static str, name: &'static str, unit: &'static str) -> Quantity {
    Quantity {
        better: Better::Less,
        ..neither(key, name, unit)
    }
}

/// A quantity that should be large.
pub(crate) const fn more(key: &'static str, name: &'static str, unit: &'static str) -> Quantity {
    Quantity {
        better: Better::More,
        ..neither(key, name, unit)
    }
}

impl Quantity {
    /// The heading of its column: an arrow says which way is better.
    pub(crate) fn heading(&self) -> String {
        let comma = if self.unit.is_empty() { "" } else { ", " };
        let arrow = match self.better {
            Better::Less => " ↓",
            Better::More => " ↑",
            Better::Neither => "",
        };
        format!("{}{comma}{}{arrow}", self.name, self.unit)
    }
}

/// A published line beside ours.
pub(crate) struct Published {
    /// The group that it belongs to.
    pub(crate) group: &'static str,
    pub(crate) name: &'static str,
    /// Keys of quantities with their values.
    pub(crate) values: &'static [(&'static str, f64)],
}

/// A table of published lines: a row has the group, the name, and keys of quantities with their values.
macro_rules! published {
    ($($group:expr, $name:literal, $($key:literal: $value:literal),+;)*) => {
        &[$(crate::harness::Published {
            group: $group,
            name: $name,
            values: &[$(($key, $value)),+],
        }),*]
    };
}
pub(crate) use published;

/// The first item for which `is` holds; where there is none, a new one at the end.
fn entry<T>(items: &mut Vec<T>, is: impl Fn(&T) -> bool, new: impl FnOnce() -> T) -> &mut T {
    let at = items.iter().position(is).unwrap_or_else(|| {
        items.push(new());
        items.len() - 1
    });
    &mut items[at]
}

/// All that was measured for one contestant in one group (a system, a task, a level of noise).
pub(crate) struct Row {
    pub(crate) group: String,
    pub(crate) key: String,
    pub(crate) name: String,
    pub(crate) role: Role,
    /// Why it cannot express the system, known before it was fitted.
    pub(crate) cannot: Vec<&'static str>,
    values: Vec<(&'static str, Vec<f64>)>,
    details: Map<String, Value>,
}

impl Row {
    /// Adds the value of one seed; none, or NaN, where nothing could be measured.
    pub(crate) fn add(
        &mut self,
        quantity: &'static str,
        value: impl Into<Option<f64>>,
    ) -> &mut Self {
        let is = |(key, _): &(&str, Vec<f64>)| *key == quantity;
        let (_, values) = entry(&mut self.values, is, || (quantity, Vec::new()));
        values.push(value.into().unwrap_or(f64::NAN));
        self
    }

    /// Adds to the one value of a quantity that counts.
    pub(crate) fn count(&mut self, quantity: &'static str, value: f64) -> &mut Self {
        let is = |(key, _): &(&str, Vec<f64>)| *key == quantity;
        entry(&mut self.values, is, || (quantity, vec![0.0])).1[0] += value;
        self
    }

    /// Adds what is no number, or more than one, for one seed; it is in the JSON alone.
    pub(crate) fn detail(&mut self, name: &str, value: impl Serialize) -> &mut Self {
        let list = self.details.entry(name).or_insert_with(|| json!([]));
        if let Value::Array(list) = list {
            list.push(json!(value));
        }
        self
    }

    /// The values of a quantity, one for each seed.
    pub(crate) fn values(&self, quantity: &str) -> &[f64] {
        let known = self.values.iter().find(|(key, _)| *key == quantity);
        known.map_or(&[], |(_, values)| values)
    }

    fn json(&self) -> Value {
        let mut all = self.details.clone();
        all.extend(
            self.values
                .iter()
                .map(|(key, values)| ((*key).to_string(), json!(values))),
        );
        if !self.cannot.is_empty() {
            all.insert("cannot_express".into(), json!(self.cannot));
        }
        all.into()
    }
}

/// A figure whose curves come seed by seed: curves of one name become a median with its range.
pub(crate) struct Plot {
    figure: Figure,
    curves: Vec<Curve>,
}

struct Curve {
    name: String,
    role: Role,
    x: Vec<f64>,
    runs: Vec<Vec<f64>>,
}

impl Plot {
    /// What there is to see in it.
    pub(crate) fn caption(&mut self, caption: impl Into<String>) -> &mut Self {
        self.figure.caption = caption.into();
        self
    }

    pub(crate) fn x(&mut self, x: Axis) -> &mut Self {
        self.figure.x = x;
        self
    }

    pub(crate) fn y(&mut self, y: Axis) -> &mut Self {
        self.figure.y = y;
        self
    }

    /// Adds the curve of one seed. One at other abscissae than the first of its name is not drawn.
    pub(crate) fn add(&mut self, name: &str, role: Role, x: &[f64], y: Vec<f64>) -> &mut Self {
        let is = |curve: &Curve| curve.name == name;
        let curve = entry(&mut self.curves, is, || Curve {
            name: name.into(),
            role,
            x: x.to_vec(),
            runs: Vec::new(),
        });
        let bits = |x: &[f64]| x.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        if bits(&curve.x) == bits(x) {
            curve.runs.push(y);
        }
        self
    }

    /// Adds the curve of one seed unless one of its name is there: a truth is the same for all.
    pub(crate) fn once(&mut self, name: &str, role: Role, x: &[f64], y: Vec<f64>) -> &mut Self {
        match self.curves.iter().any(|curve| curve.name == name) {
            true => self,
            false => self.add(name, role, x, y),
        }
    }

    /// Adds a dot to the series of this name.
    pub(crate) fn dot(&mut self, name: &str, role: Role, x: f64, y: f64) -> &mut Self {
        let new = || Series::points(name, role, Vec::new(), Vec::new());
        let series = entry(&mut self.figure.series, |s| s.name == name, new);
        series.x.push(x);
        series.y.push(y);
        self
    }

    fn figure(&self) -> Figure {
        let series = |curve: &Curve| match &curve.runs[..] {
            [run] => Series::line(&curve.name, curve.role, curve.x.clone(), run.clone()),
            runs => Series::range(&curve.name, curve.role, curve.x.clone(), runs),
        };
        let mut figure = self.figure.clone();
        figure.series.extend(self.curves.iter().map(series));
        figure
    }
}

/// The grid, and what is drawn and written beside it.
#[derive(Default)]
pub(crate) struct Results {
    pub(crate) rows: Vec<Row>,
    /// More tables, below the summary.
    pub(crate) tables: Vec<Table>,
    pub(crate) maps: Vec<HeatMap>,
    pub(crate) settings: Vec<(String, String)>,
    /// More sentences, after those of the experiment.
    pub(crate) text: Vec<String>,
    /// Values beside the grid, in the JSON alone.
    pub(crate) others: Map<String, Value>,
    plots: Vec<Plot>,
}

impl Results {
    /// The row of a contestant in a group; a new one where there is none.
    pub(crate) fn row(&mut self, group: &str, key: &str, name: &str, role: Role) -> &mut Row {
        let known = |row: &Row| row.group == group && row.key == key;
        entry(&mut self.rows, known, || Row {
            group: group.into(),
            key: key.into(),
            name: name.into(),
            role,
            cannot: Vec::new(),
            values: Vec::new(),
            details: Map::new(),
        })
    }

    /// The figure with this id; a new one where there is none.
    pub(crate) fn plot(&mut self, id: impl Into<String>, title: impl Into<String>) -> &mut Plot {
        let (id, title) = (id.into(), title.into());
        let is = |plot: &Plot| plot.figure.id == id;
        entry(&mut self.plots, is, || Plot {
            figure: Figure {
                id: id.clone(),
                title,
                ..Figure::default()
            },
            curves: Vec::new(),
        })
    }

    pub(super) fn figures(&self) -> Vec<Figure> {
        self.plots.iter().map(Plot::figure).collect()
    }

    /// The groups, in the order in which they were measured.
    pub(super) fn groups(&self) -> Vec<&str> {
        let mut groups: Vec<&str> = Vec::new();
        for row in &self.rows {
            if !groups.contains(&row.group.as_str()) {
                groups.push(&row.group);
            }
        }
        groups
    }

    /// Group by group and contestant by contestant; those without a group stand at the top.
    pub(super) fn json(&self) -> Map<String, Value> {
        let mut all = self.others.clone();
        for row in &self.rows {
            match row.group.as_str() {
                "" => all.insert(row.key.clone(), row.json()),
                group => {
                    let group = all.entry(group).or_insert_with(|| json!({}));
                    group[row.key.as_str()] = row.json();
                    None
                }
            };
        }
        all
    }
}
