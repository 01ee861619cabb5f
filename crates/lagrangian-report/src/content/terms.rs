//! Technical terms, with explanations for pages.

/// A technical term.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Term {
    /// A name for links: lower case, words joined by `-`.
    pub id: &'static str,
    /// Its forms in texts; the first is its name.
    pub forms: &'static [&'static str],
    /// Its meaning, in a sentence or two.
    pub meaning: &'static str,
}

/// The terms that pages explain.
pub const TERMS: [Term; 17] = [
    Term {
        id: "nmse",
        forms: &[
            "nMSE",
            "of its variance",
            "of their variance",
            "of the variance",
        ],
        meaning: "The mean squared error over the variance of the signal (nMSE): 0 % is perfect, 100 % no better than always saying the mean.",
    },
    Term {
        id: "lyapunov",
        forms: &["Lyapunov times", "Lyapunov time"],
        meaning: "The time in which two motions of a chaotic system that begin almost alike part by a factor of e. No prediction lasts many of them.",
    },
    Term {
        id: "noether",
        forms: &["Noether charges", "Noether charge", "Noether's charges"],
        meaning: "A quantity that stays the same because L does not change under a symmetry: momentum by shifts, angular momentum by turns, energy by time (Noether 1918).",
    },
    Term {
        id: "morse",
        forms: &["Morse index"],
        meaning: "The number of independent ways to change a path that make its action less: 0 for a minimum, more after each focus of neighbouring paths.",
    },
    Term {
        id: "mass-matrix",
        forms: &["mass matrix"],
        meaning: "M(q), from velocities to momenta: how hard each coordinate is to accelerate, alone and together with the others. The kinetic energy is ½ q̇ᵀ M q̇.",
    },
    Term {
        id: "condition",
        forms: &["condition number"],
        meaning: "The largest eigenvalue over the smallest: by how much errors of forces can grow in accelerations.",
    },
    Term {
        id: "gauge",
        forms: &["gauge of L", "gauge"],
        meaning: "What can be added to L without a change of any motion: a total derivative of a function of q and t. Data cannot tell it.",
    },
    Term {
        id: "gyroscopic",
        forms: &["Gyroscopic force", "gyroscopic forces"],
        meaning: "A force in proportion to the velocity and across it, as of a magnetic field or a spinning wheel: it turns a motion and does no work.",
    },
    Term {
        id: "validation",
        forms: &["validation"],
        meaning: "Samples that the optimiser never sees: the weights with the least loss there are kept.",
    },
    Term {
        id: "held-back",
        forms: &["held back"],
        meaning: "Kept away from training, so that errors there are those on motions that the model has not seen.",
    },
    Term {
        id: "phase-portrait",
        forms: &["phase portrait"],
        meaning: "Velocity over position: a motion without friction and forces closes or fills a curve of one energy.",
    },
    Term {
        id: "passive-joint",
        forms: &["passive joint"],
        meaning: "A joint without a drive. Its force is 0 but for noise, so that an error in parts of its variance says little.",
    },
    Term {
        id: "inverse-dynamics",
        forms: &["inverse dynamics"],
        meaning: "The forces that a motion needs, from position, velocity and acceleration.",
    },
    Term {
        id: "low-pass",
        forms: &["low-pass"],
        meaning: "A filter that takes away all that is faster than a frequency, from motion and forces alike.",
    },
    Term {
        id: "outside",
        forms: &[
            "outside of the data",
            "outside of those that the model was fitted to",
        ],
        meaning: "Farther from all states of the training data than these are from each other, or beyond their range: there the model extrapolates.",
    },
    Term {
        id: "euler-lagrange",
        forms: &["Euler–Lagrange equation", "Euler–Lagrange"],
        meaning: "d/dt ∂L/∂q̇ − ∂L/∂q = forces: the equation of motion of every mechanical system, which follows from least action.",
    },
    Term {
        id: "ensemble",
        forms: &["ensemble"],
        meaning: "Several models of the same data with other seeds and parts of it: where they part, none of them is sure.",
    },
];

/// A part of a text: a term to explain, or the text between such terms.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Piece<'a> {
    /// Plain text.
    Plain(&'a str),
    /// A term with its explanation.
    Explained(&'a str, &'static Term),
}

/// The parts of a text, with each of [`TERMS`] explained at its first occurrence.
#[must_use]
pub fn pieces(text: &str) -> Vec<Piece<'_>> {
    let mut pieces = Vec::new();
    let mut told: Vec<&str> = Vec::new();
    let (mut begin, mut at) = (0, 0);
    while at < text.len() {
        let found = term_at(text, at).filter(|(term, _)| !told.contains(&term.id));
        let step = text[at..].chars().next().map_or(1, char::len_utf8);
        let Some((term, len)) = found else {
            at += step;
            continue;
        };
        told.push(term.id);
        pieces.push(Piece::Plain(&text[begin..at]));
        pieces.push(Piece::Explained(&text[at..at + len], term));
        at += len;
        begin = at;
    }
    pieces.push(Piece::Plain(&text[begin..]));
    pieces.retain(|piece| *piece != Piece::Plain(""));
    pieces
}

/// The term that begins at an offset of a text, with its length there.
fn term_at(text: &str, at: usize) -> Option<(&'static Term, usize)> {
    let letter = |c: Option<char>| c.is_some_and(char::is_alphanumeric);
    if letter(text[..at].chars().next_back()) {
        return None;
    }
    let is_here = |form: &&&str| {
        let here = text.get(at..at + form.len());
        let ends = || !letter(text[at + form.len()..].chars().next());
        here.is_some_and(|here| here.eq_ignore_ascii_case(form)) && ends()
    };
    let of = |term: &'static Term| Some((term, term.forms.iter().find(is_here)?.len()));
    TERMS.iter().find_map(of)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_word_is_explained_once_whole_and_in_any_case() {
        let text = "NMSE and nMSE; conditions of a Condition number – Noether charges";
        let explained = pieces(text).into_iter().filter_map(|piece| match piece {
            Piece::Explained(word, term) => Some((word, term.id)),
            Piece::Plain(_) => None,
        });
        let explained: Vec<_> = explained.collect();
        let expected = [
            ("NMSE", "nmse"),
            ("Condition number", "condition"),
            ("Noether charges", "noether"),
        ];
        assert_eq!(explained, expected);
    }

    #[test]
    fn the_parts_of_a_text_are_the_text() {
        for text in ["", "q̇ held back – nMSE", "ensembles", "ensemble"] {
            let whole: String = pieces(text)
                .into_iter()
                .map(|piece| match piece {
                    Piece::Plain(part) | Piece::Explained(part, _) => part,
                })
                .collect();
            assert_eq!(whole, text);
        }
        assert_eq!(pieces("ensembles"), [Piece::Plain("ensembles")]);
    }

    #[test]
    fn each_term_has_a_name_of_its_own() {
        for (k, term) in TERMS.iter().enumerate() {
            assert!(TERMS[k + 1..].iter().all(|other| other.id != term.id));
            assert!(
                !term.forms.is_empty() && term.meaning.ends_with('.'),
                "{}",
                term.id
            );
        }
    }
}
