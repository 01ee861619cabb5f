//! How far an experiment of many parts is, on standard error; it also knows of Ctrl-C.

use std::io::{IsTerminal, stderr};
use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use indicatif::{ProgressBar, ProgressStyle};
use lagrangian::{Observer, train};

/// Time between plain lines where there is no terminal.
const LINE_EVERY: Duration = Duration::from_secs(5);
/// Finest division of the bar.
const PARTS: f64 = 1000.0;

/// The progress of an experiment whose parts have weights (expected seconds, say). As the observer of a fit it moves
/// within its part.
pub(crate) struct Progress {
    name: &'static str,
    bar: ProgressBar,
    start: Instant,
    last_line: Option<Instant>,
    part: String,
    /// Weights of all parts, of those that are done, and of the current one.
    weights: [f64; 3],
    interrupted: Arc<AtomicBool>,
    quiet: bool,
}

impl Progress {
    /// Begins with one part of weight 1 until [`Progress::plan`] says more.
    pub(super) fn start(name: &'static str, quiet: bool) -> Result<Self> {
        let hidden = quiet || !stderr().is_terminal();
        let bar = if hidden {
            ProgressBar::hidden()
        } else {
            ProgressBar::new(PARTS as u64)
        };
        bar.set_style(ProgressStyle::with_template(
            "{prefix} [{bar:30}] {percent:>3} % · {msg}",
        )?);
        bar.set_prefix(name);
        Ok(Self {
            name,
            bar,
            start: Instant::now(),
            last_line: None,
            part: String::new(),
            weights: [1.0, 0.0, 0.0],
            interrupted: interrupt_flag()?,
            quiet,
        })
    }

    /// Declares the weight of all parts together.
    pub(crate) fn plan(&mut self, total: f64) {
        self.weights[0] = total.max(f64::MIN_POSITIVE);
    }

    /// Ends the part before and begins one of this weight.
    pub(super) fn begin(&mut self, part: String, weight: f64) -> Result<()> {
        self.weights[1] += self.weights[2];
        (self.part, self.weights[2]) = (part, weight);
        self.move_to(0.0, "");
        self.check()
    }

    fn move_to(&mut self, share: f64, news: &str) {
        let [total, done, current] = self.weights;
        let fraction = ((done + share * current) / total).clamp(0.0, 1.0);
        self.bar.set_position((fraction * PARTS) as u64);
        let message = format!("{} · {news}", self.part);
        let due = self.last_line.is_none_or(|at| at.elapsed() >= LINE_EVERY);
        if self.bar.is_hidden() && !self.quiet && due {
            self.last_line = Some(Instant::now());
            eprintln!("{}: {:.0} % · {message}", self.name, 100.0 * fraction);
        }
        self.bar.set_message(message);
    }

    /// Prints what a reader should know before the work goes on.
    pub(super) fn note(&self, text: &str) {
        if !self.quiet {
            self.bar.suspend(|| eprintln!("{text}"));
        }
    }

    /// Ends the experiment where Ctrl-C was pressed.
    pub(crate) fn check(&self) -> Result<()> {
        if self.interrupted.load(Ordering::SeqCst) {
            bail!("interrupted in the part '{}'", self.part);
        }
        Ok(())
    }

    /// Ends; the seconds that all parts took.
    pub(super) fn finish(&self) -> f64 {
        self.bar.finish_and_clear();
        self.start.elapsed().as_secs_f64()
    }
}

impl Observer for Progress {
    fn progress(&mut self, progress: &train::Progress) -> ControlFlow<()> {
        let news = format!("step {} · loss {:.1e}", progress.step, progress.loss);
        self.move_to(progress.share, &news);
        match self.check() {
            Ok(()) => ControlFlow::Continue(()),
            Err(_) => ControlFlow::Break(()),
        }
    }
}

/// The flag becomes true at the first Ctrl-C; the second ends the program.
fn interrupt_flag() -> Result<Arc<AtomicBool>> {
    let flag = Arc::new(AtomicBool::new(false));
    let raised = Arc::clone(&flag);
    ctrlc::set_handler(move || {
        if raised.swap(true, Ordering::SeqCst) {
            std::process::exit(130);
        }
        eprintln!("\nending after this step; press Ctrl-C again to stop at once");
    })
    .context("cannot listen for Ctrl-C")?;
    Ok(flag)
}
