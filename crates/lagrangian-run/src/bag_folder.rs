//! The files of a ROS 2 bag: its folder names them, and files beside one may be a part of it.

use std::fs;
use std::path::{Component, Path, PathBuf};

use crate::error::{Advise, Error, Result};
use crate::input;

/// The file that describes a bag, in its folder.
const METADATA: &str = "metadata.yaml";

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

/// Refuses a database with a log of writes beside it: messages of the log are not in the file yet.
pub(crate) fn refuse_unfinished(path: &Path) -> Result<()> {
    if path
        .extension()
        .is_none_or(|e| !e.eq_ignore_ascii_case("db3"))
    {
        return Ok(());
    }
    for suffix in ["-wal", "-journal"] {
        let mut name = path.as_os_str().to_owned();
        name.push(suffix);
        let log = PathBuf::from(name);
        if fs::metadata(&log).is_ok_and(|m| m.len() > 0) {
            let (path, log) = (path.display(), log.display());
            return Err(Error::new(
                format!("'{path}' was not closed: '{log}' holds changes that are not in it"),
                format!(
                    "complete a copy of both with `sqlite3 {path} 'PRAGMA wal_checkpoint(TRUNCATE)'`"
                ),
            ));
        }
    }
    Ok(())
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
