//! ROS 2 bags: the files of a folder, and the reader that a frontend brings along.

use std::path::{Component, Path, PathBuf};
use std::sync::OnceLock;

use lagrangian::{Layout, Readings};

use crate::error::{Advise, Cause, Error, Result};
use crate::input;

/// The file that describes a bag, in its folder.
const METADATA: &str = "metadata.yaml";

/// Reads a file of a bag, of which the name and the layout are given too.
pub type BagReader = fn(&Path, &str, &Layout) -> Result<Readings, Cause>;

static READER: OnceLock<BagReader> = OnceLock::new();

/// Lets this process read bags, for which the crate has no reader of its own.
pub fn read_bags_by(reader: BagReader) {
    READER.get_or_init(|| reader);
}

/// Whether a file is a bag, by its extension.
#[must_use]
pub fn is_bag(path: &Path) -> bool {
    let extension = path.extension().unwrap_or_default();
    extension == "db3" || extension == "mcap"
}

/// The reader of a file, if it is a bag and this process reads these.
pub(crate) fn reader(path: &Path) -> Option<BagReader> {
    READER.get().copied().filter(|_| is_bag(path))
}

/// The named files, with those of a bag in place of its folder.
///
/// # Errors
/// [`Error::Refused`] for a folder that is not a bag.
pub fn files(named: &[PathBuf]) -> Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for path in named {
        match path.is_dir() {
            true => files.extend(of_bag(path)?),
            false => files.push(path.clone()),
        }
    }
    Ok(files)
}

/// The files of a bag, in the order in which they were recorded.
fn of_bag(folder: &Path) -> Result<Vec<PathBuf>> {
    let shown = format!("cannot read the folder '{}'", folder.display());
    let hint = "give files, or the folder of a ROS 2 bag with its metadata.yaml";
    let text = input::text(&folder.join(METADATA)).advise(format!("{shown}: {METADATA}"), hint)?;
    let names = relative_file_paths(&text);
    let is_inside = |name: &&str| {
        let mut parts = Path::new(*name).components();
        parts.all(|part| matches!(part, Component::Normal(_)))
    };
    match (names.is_empty(), names.iter().find(|name| !is_inside(name))) {
        (true, _) => Err(Error::new(
            format!("{shown}: its {METADATA} names no file"),
            hint,
        )),
        (_, Some(name)) => Err(Error::new(
            format!("{shown}: its {METADATA} names '{name}', which lies outside of it"),
            "give the file itself, if it is part of the bag",
        )),
        _ => Ok(names.iter().map(|name| folder.join(name)).collect()),
    }
}

/// The list `relative_file_paths` of a metadata.yaml, as ROS 2 writes it: a name a line, after a dash.
fn relative_file_paths(text: &str) -> Vec<&str> {
    let lines = text.lines().map(str::trim);
    let list = lines
        .skip_while(|line| *line != "relative_file_paths:")
        .skip(1);
    let names = list.map_while(|line| line.strip_prefix("- "));
    names
        .map(|name| name.trim().trim_matches(['"', '\'']))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_files_of_a_bag_are_those_of_its_list() {
        let text = "rosbag2_bagfile_information:\n  relative_file_paths:\n    - a_0.db3\n    - \"a_1.db3\"\n  duration:\n    - no\n";
        assert_eq!(relative_file_paths(text), ["a_0.db3", "a_1.db3"]);
        assert!(relative_file_paths("version: 5\n").is_empty());
    }
}
