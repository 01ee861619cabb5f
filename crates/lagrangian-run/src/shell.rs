//! Words of a command line, quoted for a shell.

/// A word, quoted where a shell would interpret it.
#[must_use]
pub fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./,:=+@%".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        word.into()
    } else {
        format!("'{}'", word.replace('\'', r"'\''"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_words_of_a_command_line_are_quoted_for_the_shell() {
        assert_eq!(
            [quoted("a.csv"), quoted("my file"), quoted("it's")],
            ["a.csv", "'my file'", r"'it'\''s'"]
        );
    }
}
