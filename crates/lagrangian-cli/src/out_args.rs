//! The flags that name output files, and their treatment.

use std::path::{Path, PathBuf};

use anyhow::Result;
use clap::Args;
use lagrangian_report::{Figure, Report, draw};
use lagrangian_run::{Existing, refuse_existing, refuse_overwriting, write_bytes, write_file};
use serde_json::Value;

use crate::commands::OutputMode;
use crate::failure::mistake;
use crate::output;

/// A file to write.
#[derive(Debug, Args)]
pub(crate) struct OutArgs {
    /// File for the figures as JSON
    #[arg(long, value_name = "FILE")]
    pub(crate) out: Option<PathBuf>,

    /// Replace existing files
    #[arg(long)]
    pub(crate) force: bool,
}

impl OutArgs {
    /// The treatment of existing files.
    pub(crate) fn existing(&self) -> Existing {
        Existing::from_force(self.force)
    }

    /// Refuses a file that must not be replaced, before any work is done for it.
    pub(crate) fn refuse_existing(&self) -> Result<()> {
        let mut out = self.out.iter();
        Ok(out.try_for_each(|path| refuse_existing(path, self.existing()))?)
    }

    /// As [`Self::refuse_existing`]; refuses a name without a known format of motions too.
    pub(crate) fn refuse_unwritable(&self) -> Result<()> {
        let mut out = self.out.iter();
        out.try_for_each(|path| output::format_of(path).map(|_| ()))?;
        self.refuse_existing()
    }

    /// Refuses to write over one of the files that are read.
    pub(crate) fn refuse_inputs(&self, inputs: &[PathBuf]) -> Result<()> {
        Ok(refuse_overwriting(&self.out, inputs)?)
    }

    /// As [`Self::refuse_inputs`], where a file that declares the columns is written beside the motions.
    pub(crate) fn refuse_inputs_of_motions(&self, inputs: &[PathBuf]) -> Result<()> {
        let layout = self.out.as_ref().map(|path| path.with_extension("toml"));
        Ok(refuse_overwriting(self.out.iter().chain(&layout), inputs)?)
    }

    /// Writes figures to the file, and as JSON or `text` to standard output.
    pub(crate) fn write_figures(
        &self,
        mode: OutputMode,
        figures: &Value,
        text: impl FnOnce() -> String,
    ) -> Result<()> {
        if let Some(path) = &self.out {
            let json = serde_json::to_vec_pretty(figures)?;
            write_bytes(path, self.existing(), &json)?;
        }
        mode.print(figures, text)
    }
}

/// A file to write, and one to draw.
#[derive(Debug, Args)]
pub(crate) struct PlotArgs {
    #[command(flatten)]
    pub(crate) file: OutArgs,

    /// File for a drawing: .html for a page, .svg or .png for its first figure
    #[arg(long, value_name = "FILE")]
    pub(crate) plot: Option<PathBuf>,
}

impl PlotArgs {
    /// Refuses files that cannot be written or must not be replaced, before any work is done for them.
    pub(crate) fn refuse_unwritable(&self) -> Result<()> {
        self.file.refuse_unwritable()?;
        self.refuse_undrawable()
    }

    /// As [`Self::refuse_unwritable`], where figures are written, and no motions.
    pub(crate) fn refuse_unwritable_figures(&self) -> Result<()> {
        self.file.refuse_existing()?;
        self.refuse_undrawable()
    }

    fn refuse_undrawable(&self) -> Result<()> {
        if let Some(path) = &self.plot {
            Drawing::of(path)?;
            refuse_existing(path, self.file.existing())?;
        }
        Ok(())
    }

    /// Refuses to write over one of the files that are read.
    pub(crate) fn refuse_inputs(&self, inputs: &[PathBuf]) -> Result<()> {
        self.file.refuse_inputs_of_motions(inputs)?;
        Ok(refuse_overwriting(&self.plot, inputs)?)
    }

    /// Draws the page, or its first figure alone, depending on the name of the file.
    pub(crate) fn draw(&self, page: impl FnOnce() -> Report) -> Result<()> {
        let Some(path) = &self.plot else {
            return Ok(());
        };
        let (drawing, existing, page) = (Drawing::of(path)?, self.file.existing(), page());
        let figure = || page.figures.first().cloned().unwrap_or_default();
        match drawing {
            Drawing::Page => write_bytes(path, existing, draw::html(&page).as_bytes()),
            Drawing::Svg => write_bytes(path, existing, draw::svg(&figure())?.as_bytes()),
            Drawing::Png => write_png(path, existing, &figure()),
        }?;
        Ok(())
    }
}

/// Writes a figure as a bitmap.
pub(crate) fn write_png(
    path: &Path,
    existing: Existing,
    figure: &Figure,
) -> lagrangian_run::Result<()> {
    write_file(path, existing, |sink| Ok(draw::png(figure, sink)?))
}

/// The kind of a drawing.
#[derive(Debug, Clone, Copy)]
enum Drawing {
    /// A page of one file.
    Page,
    /// A vector graphic.
    Svg,
    /// A bitmap.
    Png,
}

impl Drawing {
    /// The kind for the extension of a name.
    fn of(path: &Path) -> Result<Self> {
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
