//! The plan of a sweep: a TOML file with data, fixed settings, and the settings that are varied.

use std::path::{Path, PathBuf};

use lagrangian::settings::Values;
use lagrangian::trajectory::{Sampling, thin};
use lagrangian::{Layout, Recording, brief};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use super::space::{Search, Space};
use super::unit::{Unit, units};
use crate::bag_folder;
use crate::error::{Advise, Error, Result};
use crate::files::{Existing, write_bytes};
use crate::input;
use crate::job::Data;
use crate::record::DataFile;
use crate::source::{ReadFile, layout_beside, read_file};

/// The record of a sweep in its folder: the data that it began with.
const SWEEP: &str = "sweep.json";

/// The most rows that are used where the plan does not say how many; of longer logs a sample is taken.
const ROWS: usize = 1 << 20;

/// A plan as its file says it.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Plan {
    data: DataPlan,
    /// Settings that all units have.
    #[serde(default)]
    fixed: Values,
    /// Settings that differ, by lists of values or ranges.
    #[serde(default)]
    space: Map<String, Value>,
    /// How the space is searched.
    #[serde(default)]
    search: Search,
    /// The folder of the plan, from which its paths lead.
    #[serde(skip)]
    folder: PathBuf,
}

/// The recordings of a sweep.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct DataPlan {
    files: Vec<PathBuf>,
    #[serde(default)]
    validate: Vec<PathBuf>,
    /// What a layout file says; it goes before the one beside the data.
    #[serde(default)]
    layout: toml::Table,
    /// The most rows that are used.
    rows: Option<usize>,
}

/// A plan with its recordings.
pub struct Planned {
    /// The recordings.
    pub data: Data,
    /// The files that they come from, with their hashes.
    pub files: Vec<DataFile>,
    /// The units, in their order.
    pub units: Vec<Unit>,
    /// The names of the settings that differ.
    pub varied: Vec<String>,
    /// What readers passed over or decided, with the files, in sentences.
    pub told: Vec<String>,
}

/// A part of the units of a sweep.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shard {
    number: usize,
    of: usize,
}

impl Default for Shard {
    fn default() -> Self {
        Self { number: 1, of: 1 }
    }
}

impl Shard {
    /// Whether the unit with this number, from 0, belongs to it: shards take turns, so that each has as many, give or take one.
    #[must_use]
    pub fn has(self, unit: usize) -> bool {
        unit % self.of + 1 == self.number
    }
}

impl std::str::FromStr for Shard {
    type Err = String;

    /// `3/16`: the third of sixteen.
    fn from_str(text: &str) -> Result<Self, String> {
        let wanted = "write it as 3/16: the third of sixteen, from 1/16 to 16/16";
        let part = |text: &str| text.trim().parse::<usize>().map_err(|_| wanted);
        let (number, of) = text.split_once('/').ok_or(wanted)?;
        let (number, of) = (part(number)?, part(of)?);
        match (1..=of).contains(&number) {
            true => Ok(Self { number, of }),
            false => Err(format!("there is no shard {number} of {of}: {wanted}")),
        }
    }
}

impl Plan {
    /// Reads the file of a plan.
    ///
    /// # Errors
    /// [`Error::Refused`], which says where.
    pub fn read(path: &Path) -> Result<Self> {
        let shown = format!("cannot read the plan '{}'", path.display());
        let text = input::text(path)
            .advise(&shown, "give a TOML file with [data], [fixed] and [space]")?;
        let plan: Result<Self, toml::de::Error> = toml::from_str(&text);
        let plan = plan.map_err(|error| brief(&error.to_string()));
        let mut plan = plan.advise(
            &shown,
            "a plan has [data] with files, [fixed], [space] and [search]; see examples/sweep/plan.toml",
        )?;
        plan.folder = path.parent().map(Path::to_path_buf).unwrap_or_default();
        if plan.data.files.is_empty() {
            return Err(Error::new(
                format!("{shown}: [data] names no files"),
                "give files = [\"motion.csv\"]",
            ));
        }
        Ok(plan)
    }

    /// The units, and the recordings that they are fitted to. A robot's description is read from its file.
    ///
    /// # Errors
    /// [`Error::Refused`] for data that cannot be read, and as [`units`].
    pub fn ready(&self) -> Result<Planned> {
        let fixed = self.with_robots()?;
        let space = Space::of(&self.space)?;
        // Settings are refused before long files are read.
        units(&fixed, &space, &self.search, &Data::default())?;
        let (mut files, mut told, mut layouts) = (Vec::new(), Vec::new(), Vec::new());
        let mut read = |role: &str, named: &[PathBuf]| -> Result<Vec<Recording>> {
            let named: Vec<PathBuf> = named.iter().map(|path| self.folder.join(path)).collect();
            let mut all = Vec::new();
            for path in bag_folder::files(&named)? {
                let (file, layout) = self.read_one(&path)?;
                let notes = file.told.iter();
                told.extend(notes.map(|note| format!("'{}': {note}", path.display())));
                files.push(DataFile::new(role, &path, file.hash));
                layouts.push(layout);
                all.extend(file.recordings);
                thin(&mut all, &self.sampling());
            }
            Ok(all)
        };
        let training = read("training", &self.data.files)?;
        let validation = read("validation", &self.data.validate)?;
        let layout = layouts.into_iter().next().unwrap_or_default();
        let data = Data {
            training,
            validation,
            layout: Layout { every: 0, ..layout }.to_toml()?,
            ..Data::default()
        };
        let data = data.hashed();
        Ok(Planned {
            units: units(&fixed, &space, &self.search, &data)?,
            varied: self.space.keys().cloned().collect(),
            data,
            files,
            told,
        })
    }

    /// The files that it reads.
    ///
    /// # Errors
    /// [`Error::Refused`] for a folder that is no bag.
    pub fn inputs(&self) -> Result<Vec<PathBuf>> {
        let named = self.data.files.iter().chain(&self.data.validate);
        let named: Vec<PathBuf> = named.map(|path| self.folder.join(path)).collect();
        bag_folder::files(&named)
    }

    fn sampling(&self) -> Sampling {
        Sampling {
            rows: self.data.rows.unwrap_or(ROWS),
            seed: 0,
            stretch: Sampling::LONGEST,
        }
    }

    fn read_one(&self, path: &Path) -> Result<(ReadFile, Layout)> {
        let own = Layout::from_toml(&self.data.layout.to_string()).advise(
            "cannot read the layout of the plan",
            "it says what a layout file may say",
        )?;
        let layout = match layout_beside(path) {
            None => own,
            Some(beside) => {
                let shown = format!("cannot read the layout '{}'", beside.display());
                let text = input::text(&beside).advise(&shown, "check that it may be read")?;
                let rename = "correct it, or rename it if it is not about the data";
                own.or(Layout::from_toml(&text).advise(shown, rename)?)
            }
        };
        let sampled = Layout {
            sample: Some(self.sampling()),
            ..layout.clone()
        };
        let advice = "name the columns in [data.layout], as a layout file does";
        Ok((read_file(path, &sampled, advice)?, layout))
    }

    /// The fixed settings, with the text of descriptions in place of their paths.
    fn with_robots(&self) -> Result<Values> {
        let mut fixed = self.fixed.clone();
        for name in ["urdf", "nominal"] {
            let given = fixed.get(name).and_then(Value::as_str);
            let path = given.map(|given| self.folder.join(given));
            if let Some(path) = path.filter(|path| path.is_file()) {
                let shown = format!("cannot read the robot '{}'", path.display());
                let text = input::text(&path).advise(shown, "give a URDF file")?;
                fixed.insert(name.into(), Value::String(text));
            }
        }
        Ok(fixed)
    }
}

impl Planned {
    /// Writes down the data that the sweep begins with; of a sweep that has begun they must be the same.
    ///
    /// # Errors
    /// [`Error::Refused`], which names the file that has changed.
    pub fn begin(&self, root: &Path) -> Result<()> {
        begin(root, &self.data, &self.files)
    }
}

/// The record of a sweep: what its data hold, and the files that they came from.
#[derive(Debug, Serialize, Deserialize)]
struct Begun {
    data: Vec<DataFile>,
    /// The layout of the recordings, which their models remember.
    #[serde(default)]
    layout: String,
    #[serde(default)]
    files: Vec<DataFile>,
}

/// Writes down the data and the layout of a sweep that begins in a folder; of one that has begun they must be the same.
///
/// # Errors
/// [`Error::Refused`], which names what has changed.
pub fn begin(root: &Path, data: &Data, files: &[DataFile]) -> Result<()> {
    let path = root.join(SWEEP);
    let shown = format!("cannot read '{}'", path.display());
    if !path.is_file() {
        let made = std::fs::create_dir_all(root);
        let cannot = format!("cannot write to the folder '{}'", root.display());
        made.advise(
            cannot,
            "give another `out` that is a folder you may write to",
        )?;
        let begun = Begun {
            data: data.hashes.clone(),
            layout: data.layout.clone(),
            files: files.to_vec(),
        };
        let bytes = serde_json::to_vec_pretty(&begun).advise(shown, "")?;
        return write_bytes(&path, Existing::Replace, &bytes);
    }
    let another = "give another `out`, or remove that folder";
    let text = input::text(&path).advise(&shown, another)?;
    let then: Begun = serde_json::from_str(&text).advise(shown, another)?;
    let same = then.data == data.hashes;
    if same && then.layout == data.layout {
        return Ok(());
    }
    let known = |file: &&DataFile| then.files.iter().any(|then| then.sha256 == file.sha256);
    let changed = files.iter().find(|file| !known(file));
    let named = match changed {
        Some(file) => format!("'{}'", file.path),
        None if same => "the layout of the data".into(),
        None => "the data".into(),
    };
    Err(Error::new(
        format!(
            "{named} changed since the sweep in '{}' began",
            root.display()
        ),
        "bring the old state back, or give another `out`",
    ))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;

    #[test]
    fn shards_are_disjoint_and_complete() {
        for of in 1..=7 {
            let shard = |number: usize| format!("{number}/{of}").parse::<Shard>().unwrap();
            for unit in 0..20 {
                let having = (1..=of).filter(|number| shard(*number).has(unit));
                assert_eq!(having.count(), 1);
            }
        }
        assert!((0..5).all(|unit| Shard::default().has(unit)));
    }

    #[test]
    fn a_shard_that_is_none_is_refused() {
        for bad in ["5/4", "0/4", "1/0", "3", "a/b", "-1/4", "", "1/2/3"] {
            assert!(bad.parse::<Shard>().is_err(), "{bad}");
        }
    }
}
