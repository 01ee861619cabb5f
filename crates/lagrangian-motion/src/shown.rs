//! Safe display of texts from files.

use std::fmt::Write;

/// Whether a character is displayed as a code: control characters, ends of lines, and characters that reverse, join or hide
/// the text around them (Unicode Technical Report 36), or are forbidden in XML.
#[must_use]
pub fn is_hidden(letter: char) -> bool {
    letter.is_control()
        || matches!(letter,
            '\u{ad}' | '\u{61c}' | '\u{180e}' | '\u{200b}' | '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}'
            | '\u{2060}'..='\u{206f}' | '\u{feff}' | '\u{fff9}'..='\u{fffb}' | '\u{fffe}' | '\u{ffff}' | '\u{e0000}'..='\u{e007f}')
}

/// A name for display: in one line, with the code in place of each character that [`is_hidden`].
///
/// ```
/// assert_eq!(lagrangian_motion::shown("θ 1"), "θ 1");
/// assert_eq!(lagrangian_motion::shown("q\u{202e}1\n"), r"q\u{202e}1\u{a}");
/// ```
#[must_use]
pub fn shown(name: &str) -> String {
    escaped(name, |_| false)
}

/// Lines for display: like [`shown`], but ends of lines are preserved.
#[must_use]
pub fn shown_lines(text: &str) -> String {
    escaped(text, |letter| letter == '\n')
}

/// JSON for display: each character that [`is_hidden`] is replaced by its code, except ends of lines between values.
#[must_use]
pub fn shown_json(json: &str) -> String {
    let mut shown = String::with_capacity(json.len());
    for letter in json.chars() {
        if letter == '\n' || !is_hidden(letter) {
            shown.push(letter);
            continue;
        }
        for code in letter.encode_utf16(&mut [0; 2]) {
            // OK: writing to a string does not fail.
            let _ = write!(shown, "\\u{code:04x}");
        }
    }
    shown
}

fn escaped(text: &str, stays: impl Fn(char) -> bool) -> String {
    let mut shown = String::with_capacity(text.len());
    for letter in text.chars() {
        match is_hidden(letter) && !stays(letter) {
            true => shown.extend(letter.escape_unicode()),
            false => shown.push(letter),
        }
    }
    shown
}
