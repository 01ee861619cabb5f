//! A printed command as it is run: the program that is called, the files that it makes, and those that its comment names.

use super::fences::{Printed, words};

/// Flags whose value is a file or folder that the command makes.
const OUTPUTS: [&str; 6] = ["--out", "--plot", "--c", "--fmu", "--gif", "--pictures"];

/// Endings of files that a comment may claim.
const CLAIMED: [&str; 5] = [".html", ".csv", ".toml", ".safetensors", ".json"];

/// The command with the programs that the tests have built.
pub(super) fn runnable(text: &str) -> String {
    let pairs = [
        ("cargo run --release -p experiments -- ", "experiments "),
        ("cargo run --release -- ", "lagrangian "),
        ("cargo run -- ", "lagrangian "),
    ];
    pairs
        .iter()
        .fold(text.to_string(), |own, (from, to)| own.replace(from, to))
}

/// Whether it assigns a variable and does nothing else.
pub(super) fn is_assignment(text: &str) -> bool {
    let name = text.split('=').next().unwrap_or_default();
    let is_name = !name.is_empty() && name.chars().all(|c| c.is_ascii_uppercase() || c == '_');
    is_name && name != text && words(text).len() == 1
}

/// The files and folders that a command makes by its flags and by `>`.
pub(super) fn outputs(text: &str) -> Vec<String> {
    let words = words(text);
    let after = words
        .windows(2)
        .filter(|pair| pair[0] == ">" || OUTPUTS.contains(&pair[0].as_str()));
    let after = after.map(|pair| pair[1].clone());
    let joined = words.iter().filter_map(|word| {
        let (flag, value) = word.split_once('=')?;
        OUTPUTS.contains(&flag).then(|| value.to_string())
    });
    after
        .chain(joined)
        .filter(|own| !own.contains('$'))
        .collect()
}

/// The words of a command that name what it reads, as far as a word can tell.
pub(super) fn inputs(text: &str) -> Vec<String> {
    let made = match text.contains("--resume") {
        true => Vec::new(),
        false => outputs(text),
    };
    let all = words(text).into_iter().flat_map(|word| {
        let value = word.split_once('=').map(|(_, value)| value.to_string());
        [Some(word), value]
    });
    // What is made in a folder needs the folder.
    let read = |own: &String| own.contains('/') || !made.contains(own);
    all.flatten().filter(read).collect()
}

/// The files that a comment names: words with a folder and an ending.
pub(super) fn claimed(comment: &str) -> Vec<String> {
    let trimmed = comment
        .split_whitespace()
        .map(|own| own.trim_matches(|c: char| ",;:()`.".contains(c)));
    trimmed
        .filter(|own| own.contains('/') && CLAIMED.iter().any(|end| own.ends_with(end)))
        .map(String::from)
        .collect()
}

/// The exit code that a comment names, else 0.
pub(super) fn code(printed: &Printed) -> i32 {
    let after = printed.comment.split("exit code ").nth(1);
    let digits = after.map(|own| {
        own.chars()
            .take_while(char::is_ascii_digit)
            .collect::<String>()
    });
    digits.and_then(|own| own.parse().ok()).unwrap_or(0)
}

/// The commands that an output proposes: lines `next:` and `try:`, and what stands in backticks.
pub(super) fn hints(output: &str) -> Vec<String> {
    let lines = output.lines().filter_map(|line| {
        let line = line.trim();
        let own = line
            .strip_prefix("next: ")
            .or_else(|| line.strip_prefix("try: "));
        own.map(String::from)
    });
    let quoted = output.lines().flat_map(super::fences::inline);
    let mut found: Vec<String> = Vec::new();
    for hint in lines.chain(quoted) {
        if !found.contains(&hint) {
            found.push(hint);
        }
    }
    found
}

/// Whether a command has a word that stands for something of the reader's: FILES, or an ellipsis.
pub(super) fn is_pattern(text: &str) -> bool {
    let upper = |word: &String| {
        word.len() > 1
            && word
                .chars()
                .all(|c| c.is_ascii_uppercase() || "_/".contains(c))
    };
    text.contains('…') || words(text).iter().any(upper)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn printed(comment: &str) -> Printed {
        Printed {
            line: 1,
            text: String::new(),
            comment: comment.into(),
        }
    }

    #[test]
    fn programs_are_those_that_were_built() {
        assert_eq!(runnable("cargo run --release -- demo"), "lagrangian demo");
        assert_eq!(
            runnable("cargo run --release -p experiments -- list"),
            "experiments list"
        );
        assert_eq!(runnable("cargo xtask test"), "cargo xtask test");
    }

    #[test]
    fn an_assignment_stands_alone() {
        assert!(is_assignment("D=../shared/data"));
        assert!(is_assignment("HOW=\"--a b\""));
        assert!(!is_assignment("LAGRANGIAN_SIMD=portable lagrangian demo"));
        assert!(!is_assignment("lagrangian"));
    }

    #[test]
    fn what_is_made_is_no_input() {
        let text = "lagrangian fit a.csv --out run --plot=b.html > c.json";
        assert_eq!(outputs(text), ["run", "c.json", "b.html"]);
        let inputs = inputs(text);
        assert!(inputs.contains(&"a.csv".to_string()) && !inputs.contains(&"run".to_string()));
    }

    #[test]
    fn a_comment_may_name_a_file_and_an_exit_code() {
        assert_eq!(
            claimed("a folder; open run/report.html"),
            ["run/report.html"]
        );
        assert_eq!(
            claimed("see docs/adr/0050, or report.html"),
            Vec::<String>::new()
        );
        assert_eq!(code(&printed("refused, exit code 2")), 2);
        assert_eq!(code(&printed("code")), 0);
    }

    #[test]
    fn hints_are_found_once() {
        let output = "next: lagrangian fit a.csv --out run\nhint: run `lagrangian simulate list`\n→ `lagrangian simulate list`";
        assert_eq!(
            hints(output),
            ["lagrangian fit a.csv --out run", "lagrangian simulate list"]
        );
        assert!(
            is_pattern("lagrangian fit FILES --out run") && !is_pattern("lagrangian fit a.csv -q")
        );
    }
}
