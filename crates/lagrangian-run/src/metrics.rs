//! The figures of each step of a fit: one JSON object a line, and an event file for `TensorBoard`.

use std::fs::File;
use std::io::Write;

use lagrangian::Progress;
use serde::{Deserialize, Serialize};

use crate::error::{Context, Result};
use crate::record::seconds_now;
use crate::tensorboard::EventWriter;

/// Whether an event file for `TensorBoard` is written beside the metrics.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Tensorboard {
    /// It is written.
    Written,
    /// It is omitted.
    Omitted,
}

/// One line of the metrics.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Metric {
    /// Step of the optimiser.
    pub step: u64,
    /// Time since the start of the fit, s.
    pub seconds: f64,
    /// Figures by name, e.g. `loss/train`; those that are not finite are absent.
    #[serde(flatten)]
    pub figures: std::collections::BTreeMap<String, f64>,
}

impl Metric {
    /// A step of a fit.
    #[must_use]
    pub fn of(progress: &Progress) -> Self {
        Self::new(progress.step as u64, progress.seconds, &figures(progress))
    }

    fn new(step: u64, seconds: f64, figures: &[(&str, f64)]) -> Self {
        let finite = figures.iter().filter(|(_, value)| value.is_finite());
        Self {
            step,
            seconds,
            figures: finite
                .map(|(name, value)| ((*name).into(), *value))
                .collect(),
        }
    }

    /// Steps and values of a figure, where it is known.
    pub(crate) fn curve(metrics: &[Self], name: &str) -> (Vec<f64>, Vec<f64>) {
        let known = metrics.iter();
        let known = known.filter_map(|m| Some((m.step as f64, *m.figures.get(name)?)));
        known.unzip()
    }

    /// The line of the file.
    pub(crate) fn line(&self) -> Result<Vec<u8>> {
        let mut line = serde_json::to_vec(self).context("cannot write the metrics", "")?;
        line.push(b'\n');
        Ok(line)
    }
}

/// The figures of a step of a fit.
pub(crate) fn figures(progress: &Progress) -> Vec<(&'static str, f64)> {
    let mut figures = vec![
        ("loss/train", progress.loss),
        ("learning_rate", progress.rate),
        ("singular", progress.singular as f64),
    ];
    figures.extend(progress.validation.map(|loss| ("loss/validation", loss)));
    figures
}

/// Writes each step's figures to the metrics and to the event file.
#[derive(Debug)]
pub struct Metrics {
    pub(crate) lines: File,
    pub(crate) events: Option<EventWriter<File>>,
}

impl Metrics {
    /// Adds one step.
    ///
    /// # Errors
    /// [`Error::Refused`](crate::Error::Refused) where the disk is full.
    pub fn add(&mut self, step: u64, seconds: f64, figures: &[(&str, f64)]) -> Result<()> {
        let metric = Metric::new(step, seconds, figures);
        let written = self.lines.write_all(&metric.line()?);
        let written = written.and_then(|()| match &mut self.events {
            Some(events) => events.scalars(seconds_now(), step, figures),
            None => Ok(()),
        });
        let hint = "free space on the disk, then continue with `resume`";
        written.context("cannot write the metrics", hint)
    }
}
