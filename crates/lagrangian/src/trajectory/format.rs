//! The file formats, one line each.

use std::io::{Read, Seek, Write};

use super::{Layout, Readings, Table, Trajectory};
use crate::{Error, Result};

/// A file format for trajectories.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// Comma-separated text with a header.
    Csv,
    /// A zip of `NumPy` arrays.
    Npz,
    /// Apache Parquet (feature `parquet`).
    Parquet,
}

impl Format {
    /// All formats with their file extensions.
    pub const ALL: [(Self, &'static str); 3] = [
        (Self::Csv, "csv"),
        (Self::Npz, "npz"),
        (Self::Parquet, "parquet"),
    ];

    /// The format of files with this extension (`txt`, `tsv` and `dat` are text too).
    ///
    /// # Errors
    /// [`Error::Format`] listing the known ones.
    pub fn from_extension(extension: &str) -> Result<Self> {
        let lower = extension.trim_start_matches('.').to_ascii_lowercase();
        if matches!(lower.as_str(), "txt" | "tsv" | "dat") {
            return Ok(Self::Csv);
        }
        Self::ALL
            .iter()
            .find(|(_, e)| *e == lower)
            .map(|(format, _)| *format)
            .ok_or_else(|| Error::Format {
                extension: lower,
                remedy: format!("use one of {}", Self::ALL.map(|(_, e)| e).join(", ")),
            })
    }

    /// The usual extension, without the dot.
    #[must_use]
    pub fn extension(self) -> &'static str {
        match self {
            Self::Csv => "csv",
            Self::Npz => "npz",
            Self::Parquet => "parquet",
        }
    }

    /// Reads all recordings of a file; `name` is given to a recording that has no `trajectory` column.
    ///
    /// # Errors
    /// See [`super::csv::read`]; [`Error::Format`] where this build leaves the format out.
    pub fn read<R>(self, source: R, name: &str, layout: &Layout) -> Result<Readings>
    where
        R: Read + Seek + Send + 'static,
    {
        match self {
            Self::Csv => super::csv::read(source, name, layout),
            Self::Npz => super::npz::read(source, name, layout),
            #[cfg(feature = "parquet")]
            Self::Parquet => super::parquet::read(source, name, layout),
            #[cfg(not(feature = "parquet"))]
            Self::Parquet => Err(without_parquet()),
        }
    }

    /// Writes trajectories so that [`Format::read`] with the default layout finds the same bits.
    ///
    /// Angles are not marked in the file: [`Layout::written`] declares them.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Shape`] if degrees of freedom or signals differ among the trajectories;
    /// [`Error::Format`] where this build leaves the format out.
    pub fn write<W: Write + Seek + Send>(self, sink: W, trajectories: &[Trajectory]) -> Result<()> {
        match self {
            Self::Csv => super::csv::write(sink, trajectories),
            Self::Npz => super::npz::write(sink, trajectories),
            #[cfg(feature = "parquet")]
            Self::Parquet => super::parquet::write(sink, trajectories),
            #[cfg(not(feature = "parquet"))]
            Self::Parquet => Err(without_parquet()),
        }
    }

    /// Writes named columns of numbers.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Shape`] for columns of different lengths; [`Error::Format`] where this build leaves
    /// the format out.
    pub fn write_table<W: Write + Seek + Send>(self, sink: W, table: &Table) -> Result<()> {
        table.validate()?;
        match self {
            Self::Csv => super::csv::write_table(sink, table),
            Self::Npz => super::npz::write_table(sink, table),
            #[cfg(feature = "parquet")]
            Self::Parquet => super::parquet::write_table(sink, table),
            #[cfg(not(feature = "parquet"))]
            Self::Parquet => Err(without_parquet()),
        }
    }
}

#[cfg(not(feature = "parquet"))]
fn without_parquet() -> Error {
    Error::Format {
        extension: "parquet".into(),
        remedy:
            "this build leaves Parquet out; build with --features parquet, or convert to CSV or NPZ"
                .into(),
    }
}

/// Which signals a set of trajectories has, so that every row of a file has the same columns.
pub(super) struct WrittenColumns {
    pub(super) n: usize,
    pub(super) qdd: bool,
    pub(super) p: bool,
    pub(super) tau: bool,
}

impl WrittenColumns {
    pub(super) fn of(trajectories: &[Trajectory]) -> Result<Self> {
        let Some(first) = trajectories.first() else {
            return Err(Error::TooShort {
                what: "the list of trajectories".into(),
                found: 0,
                needed: 1,
            });
        };
        let shape = Self {
            n: first.dof(),
            qdd: first.qdd.is_some(),
            p: first.p.is_some(),
            tau: first.tau.is_some(),
        };
        for t in trajectories {
            let same = t.dof() == shape.n
                && t.qdd.is_some() == shape.qdd
                && t.p.is_some() == shape.p
                && t.tau.is_some() == shape.tau;
            let values = t.len() * shape.n;
            let whole = [
                Some(&t.q),
                Some(&t.qd),
                t.qdd.as_ref(),
                t.p.as_ref(),
                t.tau.as_ref(),
            ];
            if !same || whole.into_iter().flatten().any(|s| s.len() != values) {
                return Err(Error::Shape {
                    what: format!("trajectory '{}'", t.name),
                    found: t.dof(),
                    expected: shape.n,
                    remedy:
                        "trajectories of one file need the same coordinates and the same signals"
                            .into(),
                });
            }
        }
        Ok(shape)
    }

    /// The signals that are there, with the prefix of their columns.
    pub(super) fn signals<'a>(
        &self,
        t: &'a Trajectory,
    ) -> impl Iterator<Item = (&'static str, &'a [f64])> {
        let signals: [(_, Option<&Vec<f64>>); 5] = [
            ("q", Some(&t.q)),
            ("qd", Some(&t.qd)),
            ("qdd", t.qdd.as_ref()),
            ("p", t.p.as_ref()),
            ("tau", t.tau.as_ref()),
        ];
        signals
            .into_iter()
            .filter_map(|(name, signal)| Some((name, signal?.as_slice())))
    }

    /// `t, q1 …, qd1 …`.
    pub(super) fn headers(&self) -> Vec<String> {
        let prefixes = [
            ("q", true),
            ("qd", true),
            ("qdd", self.qdd),
            ("p", self.p),
            ("tau", self.tau),
        ];
        let mut headers = vec!["t".to_owned()];
        for (prefix, _) in prefixes.iter().filter(|(_, there)| *there) {
            headers.extend((1..=self.n).map(|i| format!("{prefix}{i}")));
        }
        headers
    }

    /// Everything but t of sample `k`.
    pub(super) fn row<'a>(&self, t: &'a Trajectory, k: usize) -> impl Iterator<Item = f64> + 'a {
        let n = self.n;
        self.signals(t)
            .collect::<Vec<_>>()
            .into_iter()
            .flat_map(move |(_, s)| s[k * n..(k + 1) * n].iter().copied())
    }
}

/// The names of trajectories, numbered where two have the same, since a name separates them in a file.
pub(super) fn unique_names(trajectories: &[Trajectory]) -> Vec<String> {
    let mut seen = std::collections::HashSet::new();
    trajectories
        .iter()
        .map(|t| {
            let numbered = (2..).map(|i| format!("{}#{i}", t.name));
            let mut names = std::iter::once(t.name.clone()).chain(numbered);
            // OK because the names never end: one of them is new.
            let name = names.find(|name| !seen.contains(name)).unwrap_or_default();
            seen.insert(name.clone());
            name
        })
        .collect()
}
