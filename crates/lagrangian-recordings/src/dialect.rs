//! Dialects of text tables: column separator, first line of the table, and names of the columns.
//!
//! A first line with as many cells as the second is the header. Other programs add to it: titles and comments before the
//! header, the point mass of the columns in a line above it (Tracker), short names and units below it (Logger Pro),
//! two headers of keys (`LabVIEW`), or numbers alone (MATLAB).

use lagrangian_motion::counted;
use lagrangian_motion::error::shortened;

/// Largest number of lines before a table.
const MOST_LINES: usize = 400;
/// Largest number of lines between the names of columns and their numbers.
const MOST_BELOW: usize = 3;
/// End of each of the two headers of a `LabVIEW` file.
const END: &str = "***End_of_Header***";
/// Characters that begin a comment.
const COMMENT: [char; 2] = ['#', '%'];

/// The layout of a text table.
#[derive(Debug, Default, PartialEq)]
pub(super) struct Dialect {
    /// The separator of the columns.
    pub(super) separator: u8,
    /// Whether runs of blanks and tabs separate the columns; they are read as a tab.
    pub(super) blanks: bool,
    /// Number of lines before the header, or before the numbers where `headers` are known.
    pub(super) skip: usize,
    /// Names of the columns, if they differ from the header line.
    pub(super) headers: Option<Vec<String>>,
    /// Whether rows may omit their last cell, a comment.
    pub(super) comments: bool,
    /// Skipped or changed parts, in sentences.
    pub(super) notes: Vec<String>,
}

/// The lines of a text and the separator of their cells.
#[derive(Clone, Copy)]
struct Lines<'a> {
    all: &'a [&'a str],
    separator: u8,
}

impl Dialect {
    /// The dialect of a text with plain line ends that starts with `start`.
    pub(super) fn of(start: &str) -> Self {
        let all: Vec<&str> = start.lines().take(MOST_LINES).collect();
        let separator = delimiter(start.as_bytes());
        let first = Lines {
            all: &all,
            separator,
        };
        let named = all.first().and_then(|line| line.strip_prefix("sep="));
        let own = named.and_then(|rest| rest.bytes().next());
        let found = || match own.is_none() && first.begins_with_a_table() {
            true => first.table(0),
            false => {
                let candidates = own.into_iter().chain([separator, b'\t', b';', b',', b' ']);
                let mut lines = candidates.map(|separator| Lines {
                    all: &all,
                    separator,
                });
                lines.find_map(|lines| lines.table(lines.begin()?))
            }
        };
        labview(&all).or_else(found).unwrap_or_else(|| Self {
            separator,
            ..Self::default()
        })
    }
}

/// The dialect of a `LabVIEW` measurement file: two headers of keys, and names of which the last is that of comments.
fn labview(all: &[&str]) -> Option<Dialect> {
    all.first()?
        .starts_with("LabVIEW Measurement")
        .then_some(())?;
    let ends: Vec<usize> = (0..all.len())
        .filter(|&k| all[k].starts_with(END))
        .collect();
    let (at, separator) = (
        ends.get(1)? + 1,
        delimiter(all.get(ends.get(1)? + 1)?.as_bytes()),
    );
    let lines = Lines { all, separator };
    let key = |name: &str| (0..at).rev().find(|&k| all[k].starts_with(name));
    let cells = key("Y_Unit_Label").map(|k| lines.cells(k));
    let mut units = cells.unwrap_or_default().into_iter().skip(1);
    let mut headers: Vec<String> = Vec::new();
    for name in lines.cells(at) {
        let unit = match &*name {
            "X_Value" => "s".into(),
            "Comment" => String::new(),
            _ => units.find(|unit| !unit.is_empty()).unwrap_or_default(),
        };
        let count = headers.iter().filter(|h| h.starts_with(&name)).count();
        let name = match count {
            0 => name,
            _ => format!("{name} {}", count + 1),
        };
        headers.push(with_unit(name, &unit));
    }
    Some(Dialect {
        separator,
        skip: at + 1,
        comments: headers.last().is_some_and(|name| name == "Comment"),
        headers: Some(headers),
        notes: vec!["it is a LabVIEW measurement file, whose headers were passed over".into()],
        ..Dialect::default()
    })
}

impl Lines<'_> {
    fn cells(&self, k: usize) -> Vec<String> {
        cells(self.all[k], self.separator)
    }

    fn is_blank(&self, k: usize) -> bool {
        self.all[k].trim().is_empty()
    }

    /// The next line after `k` that is not blank.
    fn after(&self, k: usize) -> Option<usize> {
        (k + 1..self.all.len()).find(|&k| !self.is_blank(k))
    }

    /// Whether a cell of line `k` is a number.
    fn has_numbers(&self, k: usize) -> bool {
        self.cells(k).iter().any(|cell| is_number(cell))
    }

    /// Whether all cells of line `k` are numbers, or empty.
    fn is_of_numbers(&self, k: usize) -> bool {
        let cells = self.cells(k);
        let mut filled = cells.iter().filter(|cell| !cell.is_empty()).peekable();
        filled.peek().is_some() && filled.all(|cell| is_number(cell))
    }

    /// Whether the first two lines have the same number of cells, and more than one.
    fn begins_with_a_table(&self) -> bool {
        let second = (!self.all.is_empty()).then(|| self.after(0)).flatten();
        let count = |k| cells(self.all[k], self.separator).len();
        second.is_some_and(|second| count(0) > 1 && count(0) == count(second))
    }

    /// The first of the trailing lines with the same number of cells, more than one. It must be a line of names, a line of numbers
    /// that a comment names, or the first line of the text; another of these lines must hold numbers.
    fn begin(&self) -> Option<usize> {
        let filled: Vec<usize> = (0..self.all.len()).filter(|&k| !self.is_blank(k)).collect();
        // The last line may be cut.
        let whole = &filled[..filled.len().saturating_sub(1).max(filled.len().min(2))];
        let count = |k: usize| self.cells(k).len();
        let last = count(*whole.last()?);
        let same = whole.iter().rev().take_while(|&&k| count(k) == last);
        let begin = *same.last()?;
        let named = begin > 0 && self.commented(begin - 1, last).is_some();
        let numbers = self.is_of_numbers(begin);
        let names = !self.has_numbers(begin) || numbers && (named || begin == filled[0]);
        let data = whole.iter().any(|&k| k >= begin && self.has_numbers(k));
        (last > 1 && names && data).then_some(begin)
    }

    /// The names in a comment, if there are `count` of them.
    fn commented(&self, k: usize, count: usize) -> Option<Vec<String>> {
        let names = self.all[k].strip_prefix(COMMENT)?;
        Some(cells(names.trim(), self.separator)).filter(|cells| cells.len() == count)
    }

    /// The dialect of a table that begins at this line.
    fn table(&self, begin: usize) -> Option<Dialect> {
        let mut at = begin;
        let mut notes = Vec::new();
        let mut names = self.cells(at);
        let mut data = at;
        if self.is_of_numbers(at) {
            let above = at.checked_sub(1);
            match above.and_then(|k| self.commented(k, names.len())) {
                Some(commented) => names = commented,
                None => {
                    names = (1..=names.len()).map(|i| format!("c{i}")).collect();
                    let last = names.len();
                    notes.push(format!(
                        "there is no line of names: the columns are called c1 … c{last}"
                    ));
                }
            }
        } else {
            let comment = |k: usize| self.all[k].starts_with(COMMENT);
            while let Some(next) = self
                .after(at)
                .filter(|&k| comment(at) && !self.has_numbers(k))
            {
                at = next;
            }
            names = self
                .commented(at, self.cells(at).len())
                .unwrap_or(self.cells(at));
            let filled = names.iter().filter(|own| !own.is_empty()).count();
            let is_above = names[0].is_empty() || filled == 1 && names.len() > 2;
            if is_above && let Some(below) = self.after(at).filter(|&k| !self.has_numbers(k)) {
                names = of_masses(&names, self.cells(below), &mut notes);
                at = below;
            }
            data = self.add_units(at, &mut names)?;
        }
        let passed: Vec<usize> = (0..begin).filter(|&k| !self.is_blank(k)).collect();
        if let [first, others @ ..] = &passed[..] {
            let title = shortened(self.all[*first].trim());
            let more = match others.len() {
                0 => "was".into(),
                more => format!("and {} after it were", counted(more, "line")),
            };
            notes.push(format!("the line '{title}' {more} passed over"));
        }
        let plain = names == self.cells(at) && data == self.after(at).unwrap_or(data) && data > at;
        Some(Dialect {
            separator: if self.separator == b' ' {
                b'\t'
            } else {
                self.separator
            },
            blanks: self.separator == b' ',
            skip: if plain { at } else { data },
            headers: (!plain).then_some(names),
            comments: false,
            notes,
        })
    }

    /// Appends the units below the names to them; returns the first line of numbers.
    fn add_units(&self, at: usize, names: &mut [String]) -> Option<usize> {
        let first = self.after(at)?;
        let mut data = first;
        let mut units = None;
        for _ in 0..MOST_BELOW {
            let cells = self.cells(data);
            let filled = cells.iter().filter(|cell| !cell.is_empty()).count();
            if self.has_numbers(data) {
                break;
            }
            if cells.len() != names.len() || 2 * filled <= cells.len() {
                return Some(first);
            }
            units = Some(cells);
            let Some(next) = self.after(data) else {
                return Some(first);
            };
            data = next;
        }
        if !self.has_numbers(data) {
            return Some(first);
        }
        for (name, unit) in names.iter_mut().zip(units.unwrap_or_default()) {
            *name = with_unit(std::mem::take(name), &unit);
        }
        Some(data)
    }
}

/// Prefixes columns with the names of their point masses, if there are several.
fn of_masses(masses: &[String], names: Vec<String>, notes: &mut Vec<String>) -> Vec<String> {
    let count = masses.iter().filter(|mass| !mass.is_empty()).count();
    if count == 1 {
        let mass = masses.concat();
        notes.push(format!("the columns are those of '{mass}'"));
        return names;
    }
    let mut mass = "";
    let mut own = Vec::new();
    for (k, name) in names.into_iter().enumerate() {
        mass = masses.get(k).filter(|m| !m.is_empty()).map_or(mass, |m| m);
        own.push(match mass.is_empty() || name.is_empty() {
            true => name,
            false => format!("{mass}: {name}"),
        });
    }
    own
}

fn with_unit(name: String, unit: &str) -> String {
    match unit.is_empty() || name.is_empty() || name.ends_with([')', ']']) {
        true => name,
        false => format!("{name} ({unit})"),
    }
}

/// The separator of a CSV text: the comma, semicolon or tab that is most frequent between the names of its header.
/// Quoted text separates nothing.
fn delimiter(start: &[u8]) -> u8 {
    // `max` returns the last of equals, so the comma comes last.
    let mut counts = [(b'\t', 0), (b';', 0), (b',', 0)];
    // A quote opens at the start of a name, or after one that closed: two of them represent one.
    let (mut quoted, mut opens) = (false, true);
    for &byte in start {
        match byte {
            b'"' => (quoted, opens) = (!quoted && opens, quoted),
            b'\n' if !quoted => break,
            _ if quoted => {}
            _ => {
                let own = counts.iter_mut().find(|(separator, _)| *separator == byte);
                opens = own.is_some();
                own.into_iter().for_each(|(_, count)| *count += 1);
            }
        }
    }
    let most = counts.into_iter().max_by_key(|(_, count)| *count);
    most.map_or(b',', |(separator, _)| separator)
}

/// Cells of a line, separated outside of quotes; a blank as separator means runs of blanks and tabs.
pub(super) fn cells(line: &str, separator: u8) -> Vec<String> {
    if separator == b' ' {
        return line.split_whitespace().map(String::from).collect();
    }
    // A quote opens at the start of a cell, or after one that closed: two of them represent one.
    let (mut quoted, mut opens) = (false, true);
    let between = |letter: char| {
        if letter == '"' {
            (quoted, opens) = (!quoted && opens, quoted);
            return false;
        }
        opens = letter == char::from(separator) && !quoted;
        opens
    };
    let plain = |cell: &str| cell.trim().trim_matches('"').trim().to_string();
    line.split(between).map(plain).collect()
}

/// Whether a cell is a number, with a decimal point or comma.
fn is_number(cell: &str) -> bool {
    cell.parse::<f64>().is_ok() || with_point(cell).is_some()
}

/// The value of a cell with a decimal comma.
pub(super) fn with_point(cell: &str) -> Option<f64> {
    let one = cell.matches(',').count() == 1;
    one.then(|| cell.replacen(',', ".", 1).parse().ok())?
}
