//! The flags that name output files, and their treatment.

use std::path::{Path, PathBuf};

use anyhow::Result;
use clap::Args;
use lagrangian_report::{Command, Figure, Report, draw};
use lagrangian_run::{Existing, refuse_existing, refuse_overwriting, write_bytes, write_file};
use serde_json::Value;

use crate::command_line::command_line;
use crate::commands::OutputMode;
use crate::failure::mistake;
use crate::output::{self, Motions};

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

    /// Refuses a file for figures that is one of the inputs or must not be replaced, before any work is done for it.
    pub(crate) fn check(&self, inputs: &[PathBuf]) -> Result<()> {
        refuse_overwriting(&self.out, inputs)?;
        let mut out = self.out.iter();
        Ok(out.try_for_each(|path| refuse_existing(path, self.existing()))?)
    }

    /// As [`Self::check`] for motions, in the format that the name states and with their declarations beside them.
    pub(crate) fn check_motions(&self, inputs: &[PathBuf]) -> Result<()> {
        let layout = self.out.as_ref().map(|path| path.with_extension("toml"));
        refuse_overwriting(&layout, inputs)?;
        refuse_overwriting(&self.out, inputs)?;
        let mut out = self.out.iter();
        out.try_for_each(|path| output::format_of(path).map(|_| ()))?;
        self.check(inputs)
    }

    /// Writes motions to the file, and returns the path of their declarations; without a file, prints them where no JSON is printed.
    pub(crate) fn write_motions(
        &self,
        mode: OutputMode,
        motions: &Motions,
    ) -> Result<Option<PathBuf>> {
        match &self.out {
            Some(path) => motions.write(path, self.existing()).map(Some),
            None if mode.json => Ok(None),
            None => motions.print().map(|()| None),
        }
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
    /// Refuses files for figures that cannot be written, or are inputs, before any work is done for them.
    pub(crate) fn check(&self, inputs: &[PathBuf]) -> Result<()> {
        self.file.check(inputs)?;
        self.check_drawing(inputs)
    }

    /// As [`Self::check`], where motions are written.
    pub(crate) fn check_motions(&self, inputs: &[PathBuf]) -> Result<()> {
        self.file.check_motions(inputs)?;
        self.check_drawing(inputs)
    }

    fn check_drawing(&self, inputs: &[PathBuf]) -> Result<()> {
        refuse_overwriting(&self.plot, inputs)?;
        if let Some(path) = &self.plot {
            Drawing::of(path)?;
            refuse_existing(path, self.file.existing())?;
        }
        Ok(())
    }

    /// Draws the page, or its first figure alone, depending on the name of the file; the page names the command line.
    pub(crate) fn draw(&self, page: impl FnOnce() -> Report) -> Result<()> {
        let Some(path) = &self.plot else {
            return Ok(());
        };
        let (drawing, existing) = (Drawing::of(path)?, self.file.existing());
        let page = Report {
            commands: vec![Command::new("This page", command_line())],
            ..page()
        };
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
