//! A figure as plain data: two axes and series, each with its role.

use serde::{Deserialize, Serialize};

/// One figure.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct Figure {
    /// A name for links and files: lower case, words joined by `-`.
    pub id: String,
    /// Title, in a few words.
    pub title: String,
    /// Description, in one or two sentences.
    pub caption: String,
    /// The horizontal axis.
    pub x: Axis,
    /// The vertical axis.
    pub y: Axis,
    /// The series, the first at the bottom.
    pub series: Vec<Series>,
}

/// One axis of a figure.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct Axis {
    /// The quantity, e.g. `time`.
    pub label: String,
    /// Its unit; empty for a dimensionless number.
    pub unit: String,
    /// Linear or logarithmic.
    pub scale: Scale,
    /// Fixed ends of the axis, if they must not follow from the data (a diverging baseline would flatten all other curves).
    pub range: Option<(f64, f64)>,
    /// The names at 0, 1, 2, … for an axis of categories; otherwise empty.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub names: Vec<String>,
}

/// The scale of an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Scale {
    /// Equal differences have equal lengths.
    #[default]
    Linear,
    /// Equal ratios have equal lengths; zero and negative values are gaps.
    Log,
}

/// The system or model of a series: a role has the same colour throughout the report.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Role {
    /// The measured or analytic system.
    Truth,
    /// The learned Lagrangian.
    Lnn,
    /// The plain network.
    Baseline,
    /// A reference to follow: dashed, and on top of the motion that follows it.
    Reference,
    /// Anything else, numbered from 0.
    Other(u8),
}

/// The style of a series.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// A line through the points, broken at gaps.
    #[default]
    Line,
    /// A dot at each point.
    Points,
    /// A line with a band from `y_low` to `y_high`.
    Band,
}

/// One signal of a figure; NaN is a gap.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Series {
    /// Its name in the legend; an empty name is omitted from the legend.
    pub name: String,
    /// The system or model of the series.
    pub role: Role,
    /// Its style.
    pub kind: Kind,
    /// Abscissae, `[len]`.
    #[serde(with = "super::gaps")]
    pub x: Vec<f64>,
    /// Ordinates, `[len]`.
    #[serde(with = "super::gaps")]
    pub y: Vec<f64>,
    /// Lower edge of a band, `[len]`, otherwise empty.
    #[serde(with = "super::gaps", default)]
    pub y_low: Vec<f64>,
    /// Upper edge of a band, `[len]`, otherwise empty.
    #[serde(with = "super::gaps", default)]
    pub y_high: Vec<f64>,
}

impl Axis {
    /// A linear axis.
    #[must_use]
    pub fn linear(label: &str, unit: &str) -> Self {
        Self {
            label: label.into(),
            unit: unit.into(),
            ..Self::default()
        }
    }

    /// A linear axis of the velocity of a coordinate with this unit; empty if the unit is unknown.
    #[must_use]
    pub fn velocity(name: &str, unit: &str) -> Self {
        Self::linear(&format!("velocity of {name}"), &Self::rate(unit))
    }

    /// The unit of the rate of a quantity with this unit: rad/s for rad, empty if unknown.
    #[must_use]
    pub fn rate(unit: &str) -> String {
        Self::per(unit, "s")
    }

    /// The unit of the acceleration of a quantity with this unit: rad/s² for rad, empty if unknown.
    #[must_use]
    pub fn acceleration(unit: &str) -> String {
        Self::per(unit, "s²")
    }

    fn per(unit: &str, time: &str) -> String {
        match unit {
            "" => String::new(),
            unit => format!("{unit}/{time}"),
        }
    }

    /// A logarithmic axis.
    #[must_use]
    pub fn log(label: &str, unit: &str) -> Self {
        Self {
            scale: Scale::Log,
            ..Self::linear(label, unit)
        }
    }

    /// An axis of categories at 0, 1, 2, …, with half a unit free at both ends.
    #[must_use]
    pub fn of_names(label: &str, names: Vec<String>) -> Self {
        let last = names.len() as f64 - 1.0;
        Self {
            names,
            ..Self::linear(label, "").between(-0.5, last + 0.5)
        }
    }

    /// Fixes the ends of the axis.
    #[must_use]
    pub fn between(self, low: f64, high: f64) -> Self {
        Self {
            range: Some((low, high)),
            ..self
        }
    }

    /// Label and unit, e.g. `time (s)`.
    #[must_use]
    pub fn text(&self) -> String {
        if self.unit.is_empty() {
            self.label.clone()
        } else {
            format!("{} ({})", self.label, self.unit)
        }
    }
}

impl Series {
    /// A line through (x, y).
    #[must_use]
    pub fn line(name: &str, role: Role, x: Vec<f64>, y: Vec<f64>) -> Self {
        Self {
            name: name.into(),
            role,
            kind: Kind::Line,
            x,
            y,
            y_low: Vec::new(),
            y_high: Vec::new(),
        }
    }

    /// Dots at (x, y).
    #[must_use]
    pub fn points(name: &str, role: Role, x: Vec<f64>, y: Vec<f64>) -> Self {
        Self {
            kind: Kind::Points,
            ..Self::line(name, role, x, y)
        }
    }

    /// The median of several runs at each x, with the band that contains the middle 80 % of them.
    ///
    /// `runs` is `[runs][≤ len]`; a run that ended early counts up to its end.
    #[must_use]
    pub fn spread(name: &str, role: Role, x: Vec<f64>, runs: &[Vec<f64>]) -> Self {
        Self::band(name, role, x, runs, [0.1, 0.5, 0.9])
    }

    /// The median of a few runs at each x, with the band from the smallest to the largest; `runs` as in
    /// [`Series::spread`].
    #[must_use]
    pub fn range(name: &str, role: Role, x: Vec<f64>, runs: &[Vec<f64>]) -> Self {
        Self::band(name, role, x, runs, [0.0, 0.5, 1.0])
    }

    fn band(name: &str, role: Role, x: Vec<f64>, runs: &[Vec<f64>], levels: [f64; 3]) -> Self {
        let mut quantiles = [const { Vec::new() }; 3];
        for k in 0..x.len() {
            let mut values: Vec<f64> = runs
                .iter()
                .filter_map(|run| run.get(k).copied())
                .filter(|y| y.is_finite())
                .collect();
            values.sort_by(f64::total_cmp);
            for (column, level) in quantiles.iter_mut().zip(levels) {
                column.push(quantile(&values, level));
            }
        }
        let [y_low, y, y_high] = quantiles;
        Self {
            kind: Kind::Band,
            y_low,
            y_high,
            ..Self::line(name, role, x, y)
        }
    }
}

/// Linear interpolation between the order statistics; NaN of an empty slice.
fn quantile(sorted: &[f64], level: f64) -> f64 {
    let Some(last) = sorted.len().checked_sub(1) else {
        return f64::NAN;
    };
    let place = level * last as f64;
    let below = place.floor() as usize;
    let above = (below + 1).min(last);
    sorted[below] + (place - below as f64) * (sorted[above] - sorted[below])
}
