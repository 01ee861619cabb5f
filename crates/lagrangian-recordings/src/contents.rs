//! Contents of a file to write, independent of its format.

use std::collections::HashSet;

use super::Table;
use lagrangian_motion::{Error, Result};
use lagrangian_motion::{Signal, Trajectory};

/// The rows of some trajectories, as arrays that share them.
pub(super) struct Contents<'a> {
    /// Name and number of rows of each trajectory.
    pub(super) trajectories: Vec<(String, usize)>,
    /// The arrays, in the order of their columns.
    pub(super) arrays: Vec<Array<'a>>,
}

/// One signal of all rows.
pub(super) struct Array<'a> {
    pub(super) name: String,
    /// Number of its columns, `name1 …`; `None` for a single column `name`.
    pub(super) columns: Option<usize>,
    /// Its values for each trajectory, `[rows, columns]`.
    pub(super) values: Vec<&'a [f64]>,
}

impl<'a> Contents<'a> {
    /// Time and signals of motions, whose coordinates and known signals must be equal.
    pub(super) fn of_motions(motions: &'a [Trajectory]) -> Result<Self> {
        let known = motions.iter().find(|t| !t.is_empty());
        let Some(first) = known.or(motions.first()) else {
            return Err(Error::too_short("the list of trajectories", 0, 1));
        };
        let n = first.dof();
        let is_written = |signal: &Signal| *signal == Signal::Q || first.values(*signal).is_some();
        let signals: Vec<Signal> = Signal::IN_FILES.into_iter().filter(is_written).collect();
        let needed = |t: &Trajectory, signal: Signal| match signals.contains(&signal) {
            true => t.len() * n,
            false => 0,
        };
        let all = |t| Signal::IN_FILES.into_iter().map(move |signal| (t, signal));
        let differs =
            |(t, signal): &(&Trajectory, Signal)| t.get(*signal).len() != needed(t, *signal);
        if let Some((t, signal)) = motions.iter().flat_map(all).find(differs) {
            let what = format!("{} of trajectory '{}'", signal.name(), t.name);
            let remedy = "trajectories of one file need the same coordinates and the same signals";
            let found = t.get(signal).len();
            return Err(Error::shape(what, found, needed(t, signal), remedy));
        }
        let time = Array {
            name: "t".into(),
            columns: None,
            values: motions.iter().map(|motion| &motion.t[..]).collect(),
        };
        let array = |signal: &Signal| Array {
            name: signal.name().into(),
            columns: Some(n),
            values: motions
                .iter()
                .map(|motion| &motion.get(*signal)[..])
                .collect(),
        };
        let lengths = motions.iter().map(Trajectory::len);
        Ok(Self {
            trajectories: unique_names(motions).into_iter().zip(lengths).collect(),
            arrays: std::iter::once(time)
                .chain(signals.iter().map(array))
                .collect(),
        })
    }

    /// The columns of a table, each of which must have a value for each row.
    pub(super) fn of_table(table: &'a Table) -> Result<Self> {
        let array = |(name, column): &'a (String, Vec<f64>)| {
            let remedy = "give one value for each sample of the trajectories";
            let rows = table.trajectories.iter().map(|t| t.1).sum();
            Error::check_shape(format_args!("column '{name}'"), column.len(), rows, remedy)?;
            let mut rest = &column[..];
            let mut part =
                |(_, rows): &(String, usize)| rest.split_off(..*rows).unwrap_or_default();
            Ok(Array {
                name: name.clone(),
                columns: None,
                values: table.trajectories.iter().map(&mut part).collect(),
            })
        };
        Ok(Self {
            trajectories: table.trajectories.clone(),
            arrays: table.columns.iter().map(array).collect::<Result<_>>()?,
        })
    }

    /// Whether a column `trajectory` separates several trajectories.
    pub(super) fn is_of_several(&self) -> bool {
        self.trajectories.len() > 1
    }

    /// The names of the columns, that of the trajectories first where there is one.
    pub(super) fn headers(&self) -> Vec<String> {
        let mut headers: Vec<String> = Vec::new();
        headers.extend(self.is_of_several().then(|| "trajectory".into()));
        for array in &self.arrays {
            match array.columns {
                None => headers.push(array.name.clone()),
                Some(n) => headers.extend((1..=n).map(|i| format!("{}{i}", array.name))),
            }
        }
        headers
    }

    /// The values of row `k` of a trajectory, by number.
    pub(super) fn row(&'a self, trajectory: usize, k: usize) -> impl Iterator<Item = f64> {
        let row = move |array: &'a Array<'a>| {
            let n = array.columns.unwrap_or(1);
            &array.values[trajectory][k * n..][..n]
        };
        self.arrays.iter().flat_map(row).copied()
    }
}

/// Names of trajectories, numbered where two are equal, since a name separates them in a file; without zero bytes, which
/// text must not contain.
fn unique_names(trajectories: &[Trajectory]) -> Vec<String> {
    let mut used = HashSet::new();
    let unique = |t: &Trajectory| {
        let name = t.name.replace('\0', "\u{fffd}");
        let numbered = (2..).map(|i| format!("{name}#{i}"));
        let mut names = std::iter::once(name.clone()).chain(numbered);
        // OK because there are infinitely many candidates: one of them is new.
        names
            .find(|name| used.insert(name.clone()))
            .unwrap_or_default()
    };
    trajectories.iter().map(unique).collect()
}
