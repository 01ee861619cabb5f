//! Every colour of a report, once: charts, pages, SVG files and bitmaps take it from here.

use plotters::style::RGBColor;

use crate::Role;

/// A colour by its purpose, on a light and on a dark ground.
pub(super) struct Ink {
    /// Class in SVG, variable in CSS.
    pub(super) name: &'static str,
    light: [u8; 3],
    dark: [u8; 3],
}

/// Blue and orange stay apart for every kind of colour vision; contrast with the ground is at least 3 : 1 for lines
/// and 4.5 : 1 for words.
pub(super) const INKS: [Ink; 13] = [
    Ink {
        name: "truth",
        light: [130, 138, 150],
        dark: [139, 147, 160],
    },
    Ink {
        name: "lnn",
        light: [29, 99, 209],
        dark: [106, 166, 255],
    },
    Ink {
        name: "baseline",
        light: [206, 93, 24],
        dark: [246, 153, 86],
    },
    Ink {
        name: "other0",
        light: [13, 128, 117],
        dark: [69, 196, 182],
    },
    Ink {
        name: "other1",
        light: [133, 76, 199],
        dark: [188, 146, 245],
    },
    Ink {
        name: "other2",
        light: [186, 51, 116],
        dark: [242, 128, 178],
    },
    Ink {
        name: "other3",
        light: [112, 116, 10],
        dark: [200, 202, 92],
    },
    Ink {
        name: "other4",
        light: [140, 90, 60],
        dark: [214, 166, 134],
    },
    Ink {
        name: "ink",
        light: [27, 31, 38],
        dark: [230, 233, 238],
    },
    Ink {
        name: "muted",
        light: [91, 98, 110],
        dark: [157, 165, 177],
    },
    Ink {
        name: "grid",
        light: [231, 233, 237],
        dark: [43, 48, 56],
    },
    Ink {
        name: "axis",
        light: [184, 190, 199],
        dark: [84, 91, 103],
    },
    Ink {
        name: "surface",
        light: [255, 255, 255],
        dark: [26, 29, 35],
    },
];

/// Inks of roles without a colour of their own: a torque has as many parts.
const OTHERS: u8 = 5;

const GROUND: Ink = Ink {
    name: "ground",
    light: [247, 247, 245],
    dark: [17, 19, 23],
};

/// The light variant of an ink, by which a canvas recognises it.
pub(super) fn colour(name: &str) -> RGBColor {
    let [r, g, b] = INKS
        .iter()
        .find(|ink| ink.name == name)
        .map_or([0, 0, 0], |ink| ink.light);
    RGBColor(r, g, b)
}

/// The ink of a role.
pub(super) fn name_of(role: Role) -> &'static str {
    match role {
        Role::Truth => "truth",
        Role::Lnn => "lnn",
        Role::Baseline => "baseline",
        Role::Other(n) => INKS[3 + usize::from(n % OTHERS)].name,
    }
}

/// The name of the ink with this light variant.
pub(super) fn name_of_colour(rgb: (u8, u8, u8)) -> &'static str {
    INKS.iter()
        .find(|ink| ink.light == [rgb.0, rgb.1, rgb.2])
        .map_or("ink", |ink| ink.name)
}

/// CSS: variables for both grounds, following the system unless `data-theme` on the root says otherwise.
pub(super) fn variables() -> String {
    let (light, dark) = (block(|ink| ink.light), block(|ink| ink.dark));
    format!(
        ":root{{color-scheme:light dark;{light}}}\n\
         @media (prefers-color-scheme:dark){{:root:not([data-theme=light]){{{dark}}}}}\n\
         :root[data-theme=light]{{color-scheme:light}}\n\
         :root[data-theme=dark]{{color-scheme:dark;{dark}}}\n"
    )
}

/// CSS: the classes that the SVG canvas writes.
pub(super) fn classes() -> String {
    let mut css = String::from(".l{fill:none;stroke-linejoin:round;stroke-linecap:round}\n");
    for Ink { name, .. } in &INKS {
        css += &format!(".l.{name}{{stroke:var(--{name})}}.f.{name}{{fill:var(--{name})}}\n");
    }
    css
}

fn block(shade: impl Fn(&Ink) -> [u8; 3]) -> String {
    let variable = |ink: &Ink| {
        let [r, g, b] = shade(ink);
        format!("--{}:#{r:02x}{g:02x}{b:02x};", ink.name)
    };
    INKS.iter().chain([&GROUND]).map(variable).collect()
}
