//! A canvas that writes SVG whose colours are classes, so that one drawing serves light and dark.

use std::convert::Infallible;
use std::fmt::Write as _;

use plotters_backend::text_anchor::{HPos, VPos};
use plotters_backend::{
    BackendColor, BackendCoord, BackendStyle, BackendTextStyle, DrawingBackend, DrawingErrorKind,
    FontStyle,
};

use super::{UNIT, escaped, theme};

/// Writes the elements of one drawing, without the enclosing `<svg>`.
pub(super) struct SvgCanvas<'a> {
    out: &'a mut String,
    size: (u32, u32),
    /// The dots of one style share a path: colour, opacity, radius.
    dots: Option<(&'static str, f64, u32)>,
}

type Drawn = Result<(), DrawingErrorKind<Infallible>>;

impl<'a> SvgCanvas<'a> {
    pub(super) fn new(out: &'a mut String, width: u32, height: u32) -> Self {
        Self {
            out,
            size: (width * UNIT as u32, height * UNIT as u32),
            dots: None,
        }
    }

    fn element(&mut self, text: std::fmt::Arguments) {
        if self.dots.take().is_some() {
            self.out.push_str("\"/>");
        }
        self.out.write_fmt(text).ok(); // OK because writing to a string cannot fail
    }
}

impl DrawingBackend for SvgCanvas<'_> {
    type ErrorType = Infallible;

    fn get_size(&self) -> (u32, u32) {
        self.size
    }

    fn ensure_prepared(&mut self) -> Drawn {
        Ok(())
    }

    fn present(&mut self) -> Drawn {
        self.element(format_args!(""));
        Ok(())
    }

    fn draw_pixel(&mut self, at: BackendCoord, colour: BackendColor) -> Drawn {
        self.draw_rect(at, (at.0 + 1, at.1 + 1), &colour, true)
    }

    fn draw_line<S: BackendStyle>(
        &mut self,
        from: BackendCoord,
        to: BackendCoord,
        style: &S,
    ) -> Drawn {
        self.draw_path([from, to], style)
    }

    fn draw_rect<S: BackendStyle>(
        &mut self,
        from: BackendCoord,
        to: BackendCoord,
        style: &S,
        filled: bool,
    ) -> Drawn {
        let corners = [from, (to.0, from.1), to, (from.0, to.1)];
        if filled {
            self.fill_polygon(corners, style)
        } else {
            self.draw_path(corners.into_iter().chain([from]), style)
        }
    }

    fn draw_path<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(
        &mut self,
        path: I,
        style: &S,
    ) -> Drawn {
        let colour = style.color();
        let (class, opacity) = (theme::name_of_colour(colour.rgb), opacity(colour.alpha));
        let data = relative(path);
        let width = style.stroke_width();
        self.element(format_args!(
            r#"<path class="l {class}" stroke-width="{width}"{opacity} d="{data}"/>"#
        ));
        Ok(())
    }

    fn draw_circle<S: BackendStyle>(
        &mut self,
        at: BackendCoord,
        radius: u32,
        style: &S,
        _filled: bool,
    ) -> Drawn {
        let BackendColor { alpha, rgb } = style.color();
        let kind = (theme::name_of_colour(rgb), alpha, radius);
        if self.dots != Some(kind) {
            let (class, opacity, width) = (kind.0, opacity(alpha), 2 * radius);
            self.element(format_args!(
                r#"<path class="l {class}" stroke-width="{width}"{opacity} d=""#
            ));
            self.dots = Some(kind);
        }
        write!(self.out, "M{} {}h0", at.0, at.1).ok(); // OK because writing to a string cannot fail
        Ok(())
    }

    fn fill_polygon<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(
        &mut self,
        path: I,
        style: &S,
    ) -> Drawn {
        let BackendColor { alpha, rgb } = style.color();
        let (class, opacity, data) = (theme::name_of_colour(rgb), opacity(alpha), relative(path));
        self.element(format_args!(
            r#"<path class="f {class}"{opacity} d="{data}z"/>"#
        ));
        Ok(())
    }

    fn draw_text<S: BackendTextStyle>(&mut self, text: &str, style: &S, at: BackendCoord) -> Drawn {
        let class = theme::name_of_colour(style.color().rgb);
        let anchor = match style.anchor().h_pos {
            HPos::Left => "",
            HPos::Center => r#" text-anchor="middle""#,
            HPos::Right => r#" text-anchor="end""#,
        };
        let weight = if matches!(style.style(), FontStyle::Bold) {
            r#" font-weight="600""#
        } else {
            ""
        };
        let (x, y) = (at.0, baseline(at.1, style.anchor().v_pos, style.size()));
        let (size, text) = (style.size(), escaped(text));
        self.element(format_args!(
            r#"<text class="f {class}" x="{x}" y="{y}" font-size="{size}"{anchor}{weight}>{text}</text>"#
        ));
        Ok(())
    }
}

/// Where the baseline of a text lies whose box is anchored at `y`.
pub(super) fn baseline(y: i32, anchor: VPos, size: f64) -> i32 {
    let share = match anchor {
        VPos::Top => 0.96,
        VPos::Center => 0.36,
        VPos::Bottom => -0.24,
    };
    y + (share * size).round() as i32
}

fn opacity(alpha: f64) -> String {
    if alpha < 1.0 {
        format!(r#" opacity="{alpha:.2}""#)
    } else {
        String::new()
    }
}

/// Path data with relative steps, which are short.
fn relative(path: impl IntoIterator<Item = BackendCoord>) -> String {
    let mut data = String::new();
    let mut last = None;
    for (x, y) in path {
        match last {
            None => write!(data, "M{x} {y}"),
            Some((from_x, from_y)) => write!(data, "l{} {}", x - from_x, y - from_y),
        }
        .ok(); // OK because writing to a string cannot fail
        last = Some((x, y));
    }
    data
}
