//! The command line as it could be typed again.

/// The command line.
pub(crate) fn command_line() -> String {
    command_words().join(" ")
}

/// Its words, quoted for a shell.
pub(crate) fn command_words() -> Vec<String> {
    let words = std::env::args_os()
        .skip(1)
        .map(|word| quoted(&word.to_string_lossy()));
    std::iter::once("lagrangian".into()).chain(words).collect()
}

fn quoted(word: &str) -> String {
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
    fn the_command_line_is_quoted_for_the_shell() {
        assert_eq!(
            [quoted("a.csv"), quoted("my file"), quoted("it's")],
            ["a.csv", "'my file'", r"'it'\''s'"]
        );
    }
}
