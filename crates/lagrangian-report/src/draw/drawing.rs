//! One drawing: SVG elements with classes as colours, for light and dark pages, files and bitmaps.

use std::fmt::Write as _;

use super::curve::Point;
use super::escaped;
#[cfg(feature = "raster")]
use super::text;
use super::theme::{self, Ink};

/// Units per px of a drawing: whole units keep paths short, and a curve needs finer steps than a px.
const UNIT: f64 = 8.0;

/// The representation of words.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Letters {
    /// Text, in the reader's own font.
    Text,
    /// Outlines of the embedded font, identical everywhere.
    #[cfg(feature = "raster")]
    Outlines,
}

/// The horizontal anchor of a text.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Across {
    Left,
    Middle,
    Right,
}

/// The vertical anchor of a text.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Upright {
    Top,
    Middle,
    Bottom,
}

/// The style of a text.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Lettering {
    pub(super) across: Across,
    pub(super) upright: Upright,
    /// Font size, px.
    pub(super) size: f64,
    pub(super) ink: Ink,
    pub(super) weight: Weight,
}

/// The weight of letters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Weight {
    Regular,
    Bold,
}

/// The style of a line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Stroke {
    /// Width, px.
    pub(super) width: f64,
    pub(super) ink: Ink,
    pub(super) dashed: bool,
}

/// The elements of a drawing; positions and lengths are in px, y downwards.
#[derive(Debug)]
pub(super) struct Drawing {
    width: u32,
    height: u32,
    letters: Letters,
    elements: String,
}

impl Drawing {
    /// An empty drawing with a background in the surface colour.
    pub(super) fn new((width, height): (u32, u32), letters: Letters) -> Self {
        let mut drawing = Self {
            width,
            height,
            letters,
            elements: String::new(),
        };
        let (right, bottom) = (f64::from(width), f64::from(height));
        drawing.rectangle((0.0, 0.0), (right, bottom), theme::SURFACE);
        drawing
    }

    pub(super) fn width(&self) -> f64 {
        f64::from(self.width)
    }

    pub(super) fn height(&self) -> f64 {
        f64::from(self.height)
    }

    /// An open line through points.
    pub(super) fn line(&mut self, points: &[Point], width: f64, ink: Ink) {
        let stroke = Stroke {
            width,
            ink,
            dashed: false,
        };
        self.stroke(points, stroke);
    }

    /// An open line through points, solid or dashed.
    pub(super) fn stroke(&mut self, points: &[Point], stroke: Stroke) {
        if points.len() > 1 {
            self.path(stroke, &path(points));
        }
    }

    /// Filled circles that share a path, which keeps clouds of them small.
    pub(super) fn discs(&mut self, centres: &[Point], radius: f64, ink: Ink) {
        let mut data = String::new();
        for centre in centres {
            add(
                &mut data,
                format_args!("M{} {}h0", units(centre.0), units(centre.1)),
            );
        }
        if !centres.is_empty() {
            let stroke = Stroke {
                width: 2.0 * radius,
                ink,
                dashed: false,
            };
            self.path(stroke, &data);
        }
    }

    /// The interior of a closed polygon.
    pub(super) fn polygon(&mut self, corners: &[Point], ink: Ink) {
        self.fill(ink, &format!("{}z", path(corners)));
    }

    /// A filled rectangle with its sides along the axes.
    pub(super) fn rectangle(&mut self, from: Point, to: Point, ink: Ink) {
        self.polygon(&[from, (to.0, from.1), to, (from.0, to.1)], ink);
    }

    /// The elements that `draw` adds, with edges that end at pixels: no seam is visible between adjacent shapes.
    pub(super) fn with_sharp_edges(&mut self, draw: impl FnOnce(&mut Self)) {
        self.elements
            .push_str(r#"<g shape-rendering="crispEdges">"#);
        draw(self);
        self.elements.push_str("</g>");
    }

    /// A line of words at a point.
    pub(super) fn text(&mut self, words: &str, at: Point, lettering: Lettering) {
        let at = (at.0, at.1 + drop_to_baseline(lettering));
        match self.letters {
            Letters::Text => self.written(words, at, lettering),
            #[cfg(feature = "raster")]
            Letters::Outlines => self.outlined(words, at, lettering),
        }
    }

    fn written(&mut self, words: &str, (x, y): Point, lettering: Lettering) {
        let anchor = match lettering.across {
            Across::Left => "",
            Across::Middle => r#" text-anchor="middle""#,
            Across::Right => r#" text-anchor="end""#,
        };
        let weight = match lettering.weight {
            Weight::Regular => "",
            Weight::Bold => r#" font-weight="600""#,
        };
        let (x, y, size) = (units(x), units(y), units(lettering.size));
        let (class, words) = (lettering.ink.name, escaped(words));
        self.element(format_args!(
            r#"<text class="f {class}" x="{x}" y="{y}" font-size="{size}"{anchor}{weight}>{words}</text>"#
        ));
    }

    #[cfg(feature = "raster")]
    fn outlined(&mut self, words: &str, (x, y): Point, lettering: Lettering) {
        let size = lettering.size;
        let left = match lettering.across {
            Across::Left => x,
            Across::Middle => x - 0.5 * text::width(words, size),
            Across::Right => x - text::width(words, size),
        };
        // The font has one weight: writing it twice, with a small offset, makes it bold.
        let offsets: &[f64] = match lettering.weight {
            Weight::Regular => &[0.0],
            Weight::Bold => &[0.0, 0.035],
        };
        for offset in offsets {
            let start = (UNIT * (left + offset * size), UNIT * y);
            self.fill(lettering.ink, &text::outlines(words, UNIT * size, start));
        }
    }

    fn path(&mut self, stroke: Stroke, data: &str) {
        let (class, opacity) = (stroke.ink.name, opacity(stroke.ink));
        let width = units(stroke.width);
        let dashes = if stroke.dashed {
            format!(
                r#" stroke-linecap="butt" stroke-dasharray="{} {}""#,
                units(5.0),
                units(4.0)
            )
        } else {
            String::new()
        };
        self.element(format_args!(
            r#"<path class="l {class}" stroke-width="{width}"{opacity}{dashes} d="{data}"/>"#
        ));
    }

    fn fill(&mut self, ink: Ink, data: &str) {
        let (class, opacity) = (ink.name, opacity(ink));
        self.element(format_args!(
            r#"<path class="f {class}"{opacity} d="{data}"/>"#
        ));
    }

    fn element(&mut self, element: std::fmt::Arguments) {
        add(&mut self.elements, element);
    }

    /// The drawing as an element of a page with the classes of the theme.
    pub(super) fn inline(&self, class: &str, label: &str) -> String {
        format!(
            "<svg class=\"{class}\" viewBox=\"{}\" role=\"img\" aria-label=\"{}\">{}</svg>",
            self.view_box(),
            escaped(label),
            self.elements
        )
    }

    /// The drawing as a file with its own style.
    pub(super) fn file(&self, style: &str, label: &str) -> String {
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{}\" height=\"{}\" viewBox=\"{}\" role=\"img\" \
             aria-label=\"{}\"><style>{style}</style>{}</svg>\n",
            self.width,
            self.height,
            self.view_box(),
            escaped(label),
            self.elements
        )
    }

    fn view_box(&self) -> String {
        format!("0 0 {} {}", units(self.width()), units(self.height()))
    }
}

/// Distance of the baseline of a text below its anchor, px.
fn drop_to_baseline(lettering: Lettering) -> f64 {
    let ems = match lettering.upright {
        Upright::Top => 0.96,
        Upright::Middle => 0.36,
        Upright::Bottom => -0.24,
    };
    ems * lettering.size
}

fn opacity(ink: Ink) -> String {
    if ink.opacity < 1.0 {
        format!(r#" opacity="{:.2}""#, ink.opacity)
    } else {
        String::new()
    }
}

/// Path data with relative steps, which are short.
fn path(points: &[Point]) -> String {
    let mut data = String::new();
    let mut last = None;
    for (x, y) in points.iter().map(|(x, y)| (units(*x), units(*y))) {
        match last {
            None => add(&mut data, format_args!("M{x} {y}")),
            Some((from_x, from_y)) => {
                add(&mut data, format_args!("l{} {}", x - from_x, y - from_y))
            }
        }
        last = Some((x, y));
    }
    data
}

/// Converts px to units.
fn units(px: f64) -> i32 {
    (px * UNIT).round() as i32
}

/// Appends to a text.
pub(super) fn add(text: &mut String, more: std::fmt::Arguments) {
    text.write_fmt(more).ok(); // OK because writing to a string cannot fail
}
