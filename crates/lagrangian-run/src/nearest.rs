//! The name that was probably meant.

/// A name is meant if at most a third of its letters, and one more, are wrong.
fn is_near(distance: usize, name: &str) -> bool {
    distance <= 1 + name.len() / 3
}

/// The nearest of some names, if one is near.
pub(crate) fn nearest<'a>(name: &str, known: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    // A longer word is no slip of the pen.
    let name = name.get(..name.len().min(64))?;
    let distances = known.map(|known| (distance(name, known), known));
    let (distance, near) = distances.min_by_key(|(distance, _)| *distance)?;
    is_near(distance, name).then_some(near)
}

/// The number of letters to insert, omit or replace on the way from one word to the other (Levenshtein, 1965).
fn distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, letter) in a.chars().enumerate() {
        let mut diagonal = std::mem::replace(&mut row[0], i + 1);
        for (j, other) in b.iter().enumerate() {
            let replaced = diagonal + usize::from(letter != *other);
            diagonal = row[j + 1];
            row[j + 1] = replaced.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slip_finds_its_name_and_another_word_finds_none() {
        let known = ["width", "layers", "learning_rate"];
        let near = |name| nearest(name, known.into_iter());
        assert_eq!(near("widht"), Some("width"));
        assert_eq!(near("learning-rate"), Some("learning_rate"));
        assert_eq!(near("colour"), None);
        assert_eq!(distance("kitten", "sitting"), 3);
    }
}
