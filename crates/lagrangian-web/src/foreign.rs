//! Tables of other programs, made plain before the library reads them: what video tracking and phone sensors export.
//!
//! Tracker writes a line with the name of the mass before the header; phyphox and spreadsheets write decimal commas where the
//! language of the machine has them, with semicolons or tabs between the columns; and spreadsheets write UTF-16 or Latin-1. All of
//! it is unambiguous, and each change is told. Whether angles are in degrees is never guessed.

use std::borrow::Cow;

use lagrangian::trajectory::csv::delimiter;

use crate::error::{Result, bounded};
use crate::limits;

/// Rows that are shown, and letters of each of their cells.
const SHOWN: usize = 5;
const LETTERS: usize = 40;
/// Lines before the header that are passed over at most.
const TITLES: usize = 5;

/// A table as text that the library reads, with what is seen of it.
#[derive(Debug, Default)]
pub(crate) struct Table {
    /// The bytes that the library reads.
    pub(crate) plain: Vec<u8>,
    pub(crate) headers: Vec<String>,
    pub(crate) first: Vec<Vec<String>>,
    pub(crate) notes: Vec<String>,
}

/// The table of a file; bytes that are no text stay as they are, for the library to say what they are.
pub(crate) fn table(bytes: &[u8]) -> Table {
    let mut notes = Vec::new();
    let Some(text) = decoded(bytes, &mut notes) else {
        return Table {
            plain: bytes.to_vec(),
            ..Table::default()
        };
    };
    let text = without_titles(text.trim_start_matches('\u{feff}'), &mut notes);
    let separator = char::from(delimiter(text.as_bytes()));
    let mut lines = text.lines();
    let headers = cells(lines.next().unwrap_or_default(), separator);
    let commas = separator != ','
        && lines
            .clone()
            .any(|line| has_decimal_commas(line, separator));
    let plain = match commas {
        true => {
            notes.push("the numbers have decimal commas, which were read as points".into());
            with_points(text, separator)
        }
        false => text.into(),
    };
    let rows = plain.lines().skip(1).take(SHOWN);
    Table {
        first: rows.map(|line| shown(line, separator)).collect(),
        headers,
        notes,
        plain: plain.into_bytes(),
    }
}

/// The text of a file: UTF-8, else UTF-16 where it begins with its mark, else Latin-1; none where a letter of these is a control
/// character.
fn decoded<'a>(bytes: &'a [u8], notes: &mut Vec<String>) -> Option<Cow<'a, str>> {
    if let Ok(text) = std::str::from_utf8(bytes) {
        return Some(text.into());
    }
    let (text, encoding): (String, _) = match bytes {
        [0xff, 0xfe, rest @ ..] => (utf16(rest, u16::from_le_bytes)?, "UTF-16"),
        [0xfe, 0xff, rest @ ..] => (utf16(rest, u16::from_be_bytes)?, "UTF-16"),
        _ => (bytes.iter().copied().map(char::from).collect(), "Latin-1"),
    };
    let is_text = |letter: char| !letter.is_ascii_control() || "\t\r\n".contains(letter);
    if !text.chars().all(is_text) {
        return None;
    }
    notes.push(format!(
        "the text is not in UTF-8; it was read as {encoding}"
    ));
    Some(text.into())
}

fn utf16(bytes: &[u8], number: fn([u8; 2]) -> u16) -> Option<String> {
    let (pairs, rest) = bytes.as_chunks::<2>();
    let numbers: Vec<u16> = pairs.iter().map(|pair| number(*pair)).collect();
    let text = rest.is_empty().then(|| String::from_utf16(&numbers));
    text?.ok()
}

/// The text from its header on: titles and comments have one cell where the line after them has several.
fn without_titles<'a>(mut text: &'a str, notes: &mut Vec<String>) -> &'a str {
    for _ in 0..TITLES {
        let Some((title, rest)) = text.split_once('\n') else {
            break;
        };
        let next = rest.lines().next().unwrap_or_default();
        let comment = title.starts_with('#') || title.starts_with("sep=");
        let comment = comment && !next.is_empty();
        let alone = !title.contains([',', ';', '\t']) && next.contains([',', ';', '\t']);
        if !comment && !alone {
            break;
        }
        notes.push(format!(
            "the line '{}' before the header was passed over",
            title.trim()
        ));
        text = rest;
    }
    text
}

/// The cells of a line, separated where no quote is open.
fn split(line: &str, separator: char) -> impl Iterator<Item = &str> {
    // A quote opens where a cell begins, and after one that closed: two of them stand for one.
    let (mut quoted, mut opens) = (false, true);
    line.split(move |letter| {
        if letter == '"' {
            (quoted, opens) = (!quoted && opens, quoted);
            return false;
        }
        let between = letter == separator && !quoted;
        opens = between;
        between
    })
}

fn cells(line: &str, separator: char) -> Vec<String> {
    let plain = |cell: &str| cell.trim().trim_matches('"').trim().to_string();
    split(line, separator).map(plain).collect()
}

/// The cells of a row as the page shows them, each of so many letters at most.
fn shown(line: &str, separator: char) -> Vec<String> {
    let cell = |cell: String| match cell.char_indices().nth(LETTERS) {
        Some((end, _)) => format!("{}…", &cell[..end]),
        None => cell,
    };
    let all = cells(line, separator).into_iter();
    all.take(limits::COLUMNS).map(cell).collect()
}

fn has_decimal_commas(line: &str, separator: char) -> bool {
    split(line, separator).any(is_decimal_comma)
}

fn is_decimal_comma(cell: &str) -> bool {
    let cell = cell.trim().trim_matches('"');
    cell.matches(',').count() == 1 && cell.replacen(',', ".", 1).parse::<f64>().is_ok()
}

/// The rows with points; the header stays as it is.
fn with_points(text: &str, separator: char) -> String {
    let mut plain = String::with_capacity(text.len());
    for (k, line) in text.lines().enumerate() {
        for (i, cell) in split(line, separator).enumerate() {
            if i > 0 {
                plain.push(separator);
            }
            match k > 0 && is_decimal_comma(cell) {
                true => plain += &cell.replacen(',', ".", 1),
                false => plain += cell,
            }
        }
        plain.push('\n');
    }
    plain
}

/// Names that a column of time has, before a unit in brackets.
const TIMES: [&str; 4] = ["t", "time", "zeit", "temps"];
/// Beginnings of names that are no coordinates: rates, forces, and what tells motions apart.
const OTHERS: [&str; 8] = ["qd", "tau", "trajectory", "v", "a_", "dq", "step", "frame"];
/// Parts of units of rates, such as rad/s, m/s² and s⁻¹.
const RATES: [&str; 6] = ["/s", "s^-", "s-1", "s⁻", "rpm", "hz"];

impl Table {
    /// Refuses more columns, or longer names, than a page can show.
    pub(crate) fn within_bounds(&self) -> Result<()> {
        let remedy = "keep the columns of time and of what moves, or use the command `lagrangian`";
        let (columns, most) = (self.headers.len() as f64, limits::COLUMNS as f64);
        bounded("the number of columns", columns, most, remedy)?;
        let longest = self.headers.iter().map(String::len).max();
        let (longest, most) = (longest.unwrap_or(0) as f64, limits::NAME as f64);
        let remedy = "give the columns short names in the first line";
        bounded(
            "the longest name of a column in bytes",
            longest,
            most,
            remedy,
        )
    }

    /// The column that looks like time.
    pub(crate) fn time(&self) -> Option<String> {
        let own = |header: &&String| TIMES.contains(&&*bare(header));
        self.headers.iter().find(own).cloned()
    }

    /// The columns that look like coordinates: `q1 …`, else angles, else x and y, else the first after time; none that is a rate.
    pub(crate) fn coordinates(&self) -> Vec<String> {
        let time = self.time();
        let known = |name: &str| OTHERS.iter().any(|other| name.starts_with(other));
        let rest = self.headers.iter().filter(|h| Some(*h) != time.as_ref());
        let rest: Vec<&String> = rest.filter(|h| !known(&bare(h)) && !is_rate(h)).collect();
        let of = |begins: &[&str]| -> Vec<String> {
            let own = |h: &&&String| begins.iter().any(|b| bare(h).starts_with(b));
            rest.iter().filter(own).map(|h| (*h).clone()).collect()
        };
        let sets = [
            &["q"][..],
            &["theta", "θ", "angle", "phi", "φ"],
            &["x", "y", "z"],
        ];
        let found = sets.into_iter().map(of).find(|found| !found.is_empty());
        found.unwrap_or_else(|| rest.first().map(|h| (*h).clone()).into_iter().collect())
    }

    /// Whether a name speaks of degrees.
    pub(crate) fn speaks_of_degrees(&self) -> bool {
        self.headers
            .iter()
            .any(|h| h.contains('°') || h.to_lowercase().contains("deg"))
    }
}

/// The name of a column without its unit, in lower case.
fn bare(header: &str) -> String {
    let name = header.split(['(', '[']).next().unwrap_or_default();
    name.trim().to_lowercase()
}

/// Whether the unit of a column is that of a rate, as a gyroscope's rad/s.
fn is_rate(header: &str) -> bool {
    let (_, unit) = header.split_once(['(', '[']).unwrap_or_default();
    let unit = unit.to_lowercase().replace("/ s", "/s");
    RATES.iter().any(|part| unit.contains(part))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_column_whose_unit_is_a_rate_is_no_coordinate() {
        let gyroscope = "\"Time (s)\",\"Gyroscope x (rad/s)\",\"Absolute (rad/s)\"\n0,1,1\n";
        assert!(table(gyroscope.as_bytes()).coordinates().is_empty());
        for unit in ["m/s^2", "°/s", "deg / s", "rad s^-1", "m·s⁻¹", "rpm"] {
            let read = table(format!("t [s],angle rate [{unit}],angle (rad)\n0,1,2\n").as_bytes());
            assert_eq!(read.coordinates(), ["angle (rad)"], "{unit}");
        }
        let read = table(b"Time (s),Velocity (m/s),Position (m)\n0,1,2\n");
        assert_eq!(read.coordinates(), ["Position (m)"]);
    }

    #[test]
    fn decimal_commas_between_semicolons_become_points_and_the_header_stays() {
        let read = table(b"\"Time (s)\";\"x\"\n0,5;1,25e-1\n1;-2,5\n");
        assert_eq!(read.plain, b"\"Time (s)\";\"x\"\n0.5;1.25e-1\n1;-2.5\n");
        assert_eq!(read.notes.len(), 1);
        assert_eq!(read.time().as_deref(), Some("Time (s)"));
    }

    #[test]
    fn a_comma_between_columns_is_no_decimal_comma() {
        let read = table(b"t,q1\n0,5\n1,6\n");
        assert_eq!(read.plain, b"t,q1\n0,5\n1,6\n");
        assert!(read.notes.is_empty());
    }

    #[test]
    fn the_title_of_a_tracker_export_is_passed_over_and_told() {
        let read = table(b"mass A\nt\tx\ty\n0\t1\t2\n");
        assert_eq!(read.headers, ["t", "x", "y"]);
        assert_eq!(read.coordinates(), ["x", "y"]);
        assert!(read.notes[0].contains("'mass A'"));
        let read = table(b"sep=;\r\nt;x\r\n0;1\r\n");
        assert_eq!(read.headers, ["t", "x"]);
    }

    #[test]
    fn what_stands_in_quotes_separates_nothing() {
        let read = table(b"\"angle, left, smoothed (deg)\";\"t; s\"\n\"0,5\";1\n");
        assert_eq!(read.headers, ["angle, left, smoothed (deg)", "t; s"]);
        assert_eq!(read.first, [["0.5", "1"]]);
        let read = table(b"a 5\" tube,t,\"a \"\"b\"\", c\"\n1,2,3\n");
        assert_eq!(read.headers, ["a 5\" tube", "t", "a \"\"b\"\", c"]);
    }

    #[test]
    fn a_table_in_another_encoding_is_read_and_told() {
        let text = "Zeit (s);Winkel (°)\n0,5;1\n";
        let latin: Vec<u8> = text.chars().map(|c| c as u8).collect();
        let wide = |bytes: fn(u16) -> [u8; 2]| -> Vec<u8> {
            let all = std::iter::once(0xfeff).chain(text.encode_utf16());
            all.flat_map(bytes).collect()
        };
        for (bytes, encoding) in [
            (latin, "Latin-1"),
            (wide(u16::to_le_bytes), "UTF-16"),
            (wide(u16::to_be_bytes), "UTF-16"),
        ] {
            let read = table(&bytes);
            assert_eq!(read.headers, ["Zeit (s)", "Winkel (°)"]);
            assert_eq!(read.first, [["0.5", "1"]]);
            assert!(read.notes[0].contains(encoding), "{:?}", read.notes);
        }
    }

    #[test]
    fn a_long_cell_is_shown_by_its_beginning() {
        let read = table(format!("t,q1\n0,{}\n", "9".repeat(1000)).as_bytes());
        assert_eq!(read.first[0][1], "9".repeat(LETTERS) + "…");
    }

    #[test]
    fn bytes_that_are_no_text_are_left_to_the_library() {
        for bytes in [
            [0xff, 0xfe, 0, 0],
            [0xff, 0xfe, 0, 0xd8],
            [0x89, b'P', 0, 1],
        ] {
            assert_eq!(table(&bytes).plain, bytes);
        }
    }
}
