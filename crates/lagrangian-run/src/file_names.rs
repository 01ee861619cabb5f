//! Names of files from names of other origin.

use std::collections::HashSet;

/// The largest number of letters of a name, which leaves room for additions.
const LONGEST: usize = 48;
/// Devices of Windows, whatever the extension; some bear a digit.
const DEVICES: [&str; 4] = ["con", "prn", "aux", "nul"];
const PORTS: [&str; 2] = ["com", "lpt"];

/// A name for a file in any folder, without its extension: letters, digits, `-` and `_` of `text` stay, anything else becomes `-`. It is
/// never empty, hidden, a path or a device.
#[must_use]
pub fn file_name(text: &str) -> String {
    let is_kept = |c: char| c.is_alphabetic() || c.is_ascii_digit() || c == '_';
    let plain = |c: char| if is_kept(c) { c } else { '-' };
    let name: String = text.chars().take(LONGEST).map(plain).collect();
    let name = name.trim_matches('-');
    let lower = name.to_ascii_lowercase();
    let port = lower.strip_suffix(|c: char| c.is_ascii_digit());
    let is_device = DEVICES.contains(&&*lower) || port.is_some_and(|port| PORTS.contains(&port));
    match name.is_empty() || is_device {
        true => format!("file-{name}").trim_end_matches('-').into(),
        false => name.into(),
    }
}

/// [`file_name`] of each text, with a number where a name is taken, even if it differs in the case of its letters.
#[must_use]
pub fn file_names<'a>(texts: impl IntoIterator<Item = &'a str>) -> Vec<String> {
    let mut taken = HashSet::new();
    let mut free = |text: &str| {
        let own = file_name(text);
        let numbered = (2_usize..).map(|k| format!("{own}-{k}"));
        let mut names = std::iter::once(own.clone()).chain(numbered);
        // OK because numbers do not end.
        let name = names.find(|name| taken.insert(name.to_lowercase()));
        name.unwrap_or(own)
    };
    texts.into_iter().map(&mut free).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn any_name_becomes_one_of_a_file_in_its_folder() {
        for (text, name) in [
            ("parity-torque-of-q_1", "parity-torque-of-q_1"),
            ("x/../../../EVIL", "x----------EVIL"),
            ("..", "file"),
            ("", "file"),
            (".bashrc", "bashrc"),
            ("-rf", "rf"),
            ("C:\\Windows", "C--Windows"),
            ("con", "file-con"),
            ("CON.txt", "CON-txt"),
            ("LPT1", "file-LPT1"),
            ("com¹", "com"),
            ("COM10", "COM10"),
            ("a\0b\n\u{202e}c", "a-b--c"),
            ("θ1", "θ1"),
        ] {
            assert_eq!(file_name(text), name, "{text:?}");
        }
        assert_eq!(file_name(&"θ".repeat(5000)).chars().count(), LONGEST);
    }

    #[test]
    fn names_that_become_alike_stay_apart() {
        let names = file_names(["a/b", "a\\b", "A-B", "a-b-2", "a-b"]);
        assert_eq!(names, ["a-b", "a-b-2", "A-B-3", "a-b-2-2", "a-b-4"]);
    }
}
