//! Fenced blocks of Markdown pages, commands of shell blocks, and commands within sentences.

/// A fenced block of a page.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Block {
    /// The first word after the fence.
    pub(super) language: String,
    /// Number of the line after the fence, from 1.
    pub(super) line: usize,
    /// Its lines without the indentation of the fence.
    pub(super) text: String,
}

/// A command of a shell block.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Printed {
    /// Number of its first line on the page, from 1.
    pub(super) line: usize,
    /// The command on one line, without its comment.
    pub(super) text: String,
    /// What follows `#`.
    pub(super) comment: String,
}

/// The fenced blocks of a page, in its order; a fence within a tab is indented.
pub(super) fn blocks(page: &str) -> Vec<Block> {
    let mut found = Vec::new();
    let mut lines = page.lines().enumerate();
    while let Some((number, line)) = lines.next() {
        let Some(info) = line.trim_start().strip_prefix("```") else {
            continue;
        };
        let indentation = line.len() - line.trim_start().len();
        let language = info.split([' ', ',']).next().unwrap_or_default().trim();
        let inside = lines.by_ref().map(|(_, own)| own);
        let inside = inside.take_while(|own| own.trim() != "```");
        let text = inside.map(|own| own.get(indentation..).unwrap_or(own.trim_start()));
        found.push(Block {
            language: language.into(),
            line: number + 2,
            text: text.collect::<Vec<_>>().join("\n"),
        });
    }
    found
}

/// The commands of a shell block: lines that end in a backslash go on in the next one.
pub(super) fn commands(block: &Block) -> Vec<Printed> {
    let mut found: Vec<Printed> = Vec::new();
    let mut open = false;
    for (k, line) in block.text.lines().enumerate() {
        let (text, comment) = uncommented(line);
        let goes_on = text.ends_with('\\');
        let text = text.trim_end_matches('\\').trim();
        match found.last_mut().filter(|_| open) {
            Some(last) => {
                last.text = format!("{} {text}", last.text);
                last.comment = comment.into();
            }
            None if !text.is_empty() => found.push(Printed {
                line: block.line + k,
                text: text.into(),
                comment: comment.into(),
            }),
            None => {}
        }
        open = goes_on;
    }
    found
}

/// A line before its comment, and the comment; a `#` within quotes or a word begins none.
fn uncommented(line: &str) -> (&str, &str) {
    let (mut quote, mut before) = (None, ' ');
    for (at, c) in line.char_indices() {
        match (quote, c) {
            (Some(own), _) if own == c => quote = None,
            (None, '\'' | '"') => quote = Some(c),
            (None, '#') if before.is_whitespace() => {
                return (line[..at].trim_end(), line[at + 1..].trim());
            }
            _ => {}
        }
        before = c;
    }
    (line.trim_end(), "")
}

/// The words of a command, without their quotes.
pub(super) fn words(command: &str) -> Vec<String> {
    let (mut found, mut word, mut quote) = (Vec::new(), String::new(), None);
    for c in command.chars() {
        match (quote, c) {
            (Some(own), _) if own == c => quote = None,
            (None, '\'' | '"') => quote = Some(c),
            (None, ' ') => found.push(std::mem::take(&mut word)),
            _ => word.push(c),
        }
    }
    found.push(word);
    found.retain(|own| !own.is_empty());
    found
}

/// The commands of `lagrangian` with arguments that stand in backticks within sentences.
pub(super) fn inline(text: &str) -> Vec<String> {
    let mut fenced = false;
    let mut found = Vec::new();
    for paragraph in text.split("\n\n") {
        let sentences = paragraph.lines().filter(|line| {
            let fence = line.trim_start().starts_with("```");
            fenced ^= fence;
            !fence && !fenced
        });
        let sentences = sentences.collect::<Vec<_>>().join(" ");
        let spans = sentences.split('`').skip(1).step_by(2);
        let complete = |span: &&str| span.starts_with("lagrangian ") && words(span).len() > 2;
        found.extend(spans.filter(complete).map(String::from));
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    fn block(text: &str) -> Block {
        Block {
            language: "sh".into(),
            line: 1,
            text: text.into(),
        }
    }

    fn texts(text: &str) -> Vec<String> {
        let found = commands(&block(text)).into_iter();
        found.map(|own| own.text).collect()
    }

    #[test]
    fn blocks_have_a_language_a_line_and_no_indentation() {
        let page = "a\n\n```sh\nb c\n```\n\n=== \"x\"\n\n    ```python tags=[\"y\"]\n    d\n      e\n    ```\n";
        let found = blocks(page);
        assert_eq!(found.len(), 2);
        assert_eq!((found[0].language.as_str(), found[0].line), ("sh", 4));
        assert_eq!(found[1].language, "python");
        assert_eq!(found[1].text, "d\n  e");
    }

    #[test]
    fn a_block_that_never_ends_is_one_to_the_end_of_the_page() {
        assert_eq!(
            blocks("```sh\na").first().map(|own| own.text.as_str()),
            Some("a")
        );
    }

    #[test]
    fn a_backslash_continues_a_command_and_a_comment_is_no_part_of_it() {
        assert_eq!(texts("a --b \\\n    c   # d\n\n# e\nf"), ["a --b c", "f"]);
        let found = commands(&block("a --b \\\n    c   # d"));
        assert_eq!(found.first().map(|own| own.comment.as_str()), Some("d"));
    }

    #[test]
    fn a_number_sign_within_quotes_or_a_word_is_no_comment() {
        assert_eq!(texts("node a.js '#learn' b#c"), ["node a.js '#learn' b#c"]);
    }

    #[test]
    fn words_lose_their_quotes() {
        assert_eq!(words("a  'kp{} x' \"b\""), ["a", "kp{} x", "b"]);
    }

    #[test]
    fn commands_in_sentences_are_found_where_they_have_arguments() {
        let text = "See `lagrangian check`, or `lagrangian\nfit log.csv --out run`.\n\n```sh\nlagrangian `x y z`\n```\n";
        assert_eq!(inline(text), ["lagrangian fit log.csv --out run"]);
    }
}
