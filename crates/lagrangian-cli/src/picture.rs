//! Files of `--plot`: a page of everything, or a picture of one figure.

use std::path::Path;

use anyhow::Result;
use lagrangian_report::draw;
use lagrangian_report::{Figure, Report};

use crate::failure::mistake;
use crate::output::{self, Existing};

/// What a file is drawn as.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Drawing {
    /// A page of one file.
    Page,
    /// A vector graphic.
    Svg,
    /// A bitmap.
    Png,
}

impl Drawing {
    /// By the end of the name.
    pub(crate) fn of(path: &Path) -> Result<Self> {
        match path.extension().and_then(|e| e.to_str()) {
            Some("html") => Ok(Self::Page),
            Some("svg") => Ok(Self::Svg),
            Some("png") => Ok(Self::Png),
            _ => Err(mistake(
                format!("cannot draw '{}'", path.display()),
                "end the name of --plot with .html, .svg or .png",
            )),
        }
    }
}

/// Writes the page, or the figure alone, as the name of the file says.
pub(crate) fn write(
    path: &Path,
    existing: Existing,
    page: impl FnOnce() -> Report,
    figure: impl FnOnce() -> Figure,
) -> Result<()> {
    match Drawing::of(path)? {
        Drawing::Page => output::write_bytes(path, existing, draw::html(&page()).as_bytes()),
        Drawing::Svg => output::write_bytes(path, existing, draw::svg(&figure()).as_bytes()),
        Drawing::Png => output::write_file(path, existing, |sink| {
            Ok(draw::png(&figure(), 1280, 840, sink)?)
        }),
    }
}
