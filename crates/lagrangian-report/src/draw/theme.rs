//! Colours of a report, and the widths and the order of its curves, defined once for pages and pictures.

use std::collections::BTreeMap;

use crate::Role;

/// A colour by its purpose, on a light and on a dark background.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Ink {
    /// Variable in CSS.
    pub(super) name: &'static str,
    /// On paper and on light screens.
    pub(super) light: [u8; 3],
    dark: [u8; 3],
}

impl Ink {
    const fn new(name: &'static str, light: [u8; 3], dark: [u8; 3]) -> Self {
        Self { name, light, dark }
    }
}

// Blue and orange are distinguishable with every kind of colour vision; contrast with the background is at least 3 : 1 for lines
// and 4.5 : 1 for words.
pub(super) const TRUTH: Ink = Ink::new("truth", [130, 138, 150], [139, 147, 160]);
pub(super) const LNN: Ink = Ink::new("lnn", [29, 99, 209], [106, 166, 255]);
pub(super) const BASELINE: Ink = Ink::new("baseline", [206, 93, 24], [246, 153, 86]);
/// Inks of roles without a fixed colour: enough for the parts of a torque.
const OTHERS: [Ink; 5] = [
    Ink::new("other0", [13, 128, 117], [69, 196, 182]),
    Ink::new("other1", [133, 76, 199], [188, 146, 245]),
    Ink::new("other2", [186, 51, 116], [242, 128, 178]),
    Ink::new("other3", [112, 116, 10], [200, 202, 92]),
    Ink::new("other4", [140, 90, 60], [214, 166, 134]),
];
pub(super) const WORDS: Ink = Ink::new("ink", [27, 31, 38], [230, 233, 238]);
pub(super) const MUTED: Ink = Ink::new("muted", [91, 98, 110], [157, 165, 177]);
pub(super) const GRID: Ink = Ink::new("grid", [231, 233, 237], [43, 48, 56]);
pub(super) const AXIS: Ink = Ink::new("axis", [184, 190, 199], [84, 91, 103]);
pub(super) const SURFACE: Ink = Ink::new("surface", [255, 255, 255], [26, 29, 35]);
const GROUND: Ink = Ink::new("ground", [247, 247, 245], [17, 19, 23]);

/// The inks that drawings use.
const INKS: [Ink; 13] = [
    TRUTH, LNN, BASELINE, OTHERS[0], OTHERS[1], OTHERS[2], OTHERS[3], OTHERS[4], WORDS, MUTED,
    GRID, AXIS, SURFACE,
];

/// The ink of a role.
pub(super) fn of(role: Role) -> Ink {
    match role {
        Role::Truth => TRUTH,
        Role::Lnn => LNN,
        Role::Baseline => BASELINE,
        Role::Reference => WORDS,
        Role::Other(n) => OTHERS[usize::from(n) % OTHERS.len()],
    }
}

/// CSS: variables for both backgrounds, following the system unless `data-theme` on the root overrides it; print is light.
pub(super) fn variables() -> String {
    let (light, dark) = (block(|ink| ink.light), block(|ink| ink.dark));
    format!(
        ":root{{color-scheme:light dark;{light}}}\n\
         @media screen and (prefers-color-scheme:dark){{:root:not([data-theme=light]){{{dark}}}}}\n\
         :root[data-theme=light]{{color-scheme:light}}\n\
         @media screen{{:root[data-theme=dark]{{color-scheme:dark;{dark}}}}}\n"
    )
}

fn block(shade: impl Fn(&Ink) -> [u8; 3]) -> String {
    let variable = |ink: &Ink| format!("--{}:{};", ink.name, hex(shade(ink)));
    INKS.iter().chain([&GROUND]).map(variable).collect()
}

/// CSS: the dots and swatches of a page that represent inks.
pub(super) fn dots() -> String {
    let rule = |ink: &Ink| {
        format!(
            ".dot.{0}{{background:var(--{0})}}.swatch.{0}{{--own:var(--{0})}}\n",
            ink.name
        )
    };
    INKS.iter().map(rule).collect()
}

/// The inks on paper by their names.
pub(super) fn paper() -> BTreeMap<&'static str, String> {
    let shade = |ink: &Ink| (ink.name, hex(ink.light));
    INKS.iter().map(shade).collect()
}

/// Width of a line, px: truth is broad and pale, so that a model that follows it is visible on top of it.
pub(super) fn width(role: Role) -> f64 {
    match role {
        Role::Truth => 3.2,
        Role::Lnn => 1.7,
        Role::Reference => 1.3,
        Role::Baseline | Role::Other(_) => 1.5,
    }
}

/// The order of drawing: later series cover earlier ones.
pub(super) fn depth(role: Role) -> u8 {
    match role {
        Role::Truth => 0,
        Role::Baseline => 1,
        Role::Other(_) => 2,
        Role::Lnn => 3,
        Role::Reference => 4,
    }
}

fn hex([r, g, b]: [u8; 3]) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}
