//! Progress on standard error: a bar on a terminal, a plain line now and then elsewhere.

use std::io::{IsTerminal, stderr};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};

/// Time between plain lines.
const LINE_EVERY: Duration = Duration::from_secs(5);

/// Finest division of the bar.
const PARTS: u64 = 1000;

/// Shows the progress of one task.
pub(crate) struct Progress {
    label: String,
    start: Instant,
    shown: Display,
}

enum Display {
    Bar(ProgressBar),
    Lines { last: Option<Instant> },
    Nothing,
}

impl Progress {
    /// Begins; `quiet` hides the progress.
    pub(crate) fn start(label: impl Into<String>, quiet: bool) -> Self {
        let label = label.into();
        let shown = match (quiet, stderr().is_terminal()) {
            (true, _) => Display::Nothing,
            (false, true) => Display::Bar(bar(&label)),
            (false, false) => Display::Lines { last: None },
        };
        Self {
            label,
            start: Instant::now(),
            shown,
        }
    }

    /// Moves to `fraction` (0 to 1) with a message, e.g. `step 120 · 23 steps/s · loss 3.1e-4`; the time left is added.
    pub(crate) fn update(&mut self, fraction: f64, news: &str) {
        let left = time_left(self.start.elapsed(), fraction);
        match &mut self.shown {
            Display::Bar(bar) => {
                #[expect(
                    clippy::cast_possible_truncation,
                    clippy::cast_sign_loss,
                    reason = "it is in 0..=PARTS"
                )]
                bar.set_position((fraction.clamp(0.0, 1.0) * PARTS as f64) as u64);
                bar.set_message(with_time(news, left));
            }
            Display::Lines { last } => {
                if last.is_none_or(|at| at.elapsed() >= LINE_EVERY) {
                    *last = Some(Instant::now());
                    let percent = 100.0 * fraction.clamp(0.0, 1.0);
                    note!("{}: {percent:.0} % · {}", self.label, with_time(news, left));
                }
            }
            Display::Nothing => {}
        }
    }

    /// Ends with a last message, which stays.
    pub(crate) fn finish(self, result: &str) {
        let line = format!(
            "{}: {result} ({})",
            self.label,
            duration(self.start.elapsed())
        );
        match self.shown {
            Display::Bar(bar) => {
                bar.finish_and_clear();
                note!("{line}");
            }
            Display::Lines { .. } => note!("{line}"),
            Display::Nothing => {}
        }
    }
}

fn bar(label: &str) -> ProgressBar {
    let bar = ProgressBar::new(PARTS);
    // OK to fall back: the template is fixed, and a bar of the default style still shows progress.
    let style = ProgressStyle::with_template("{prefix} [{bar:30}] {percent:>3} % · {msg}");
    let style = style.unwrap_or_else(|_| ProgressStyle::default_bar());
    bar.set_style(style.progress_chars("━╸ "));
    bar.set_prefix(label.to_string());
    bar
}

fn with_time(news: &str, left: Option<Duration>) -> String {
    match left {
        Some(left) => format!("{news} · {} left", duration(left)),
        None => news.to_string(),
    }
}

/// The time left in proportion; unknown until some of the work is done.
fn time_left(elapsed: Duration, fraction: f64) -> Option<Duration> {
    if !(fraction > 0.01 && fraction <= 1.0) {
        return None;
    }
    Some(elapsed.mul_f64((1.0 - fraction) / fraction))
}

/// `42 s`, `3 min 05 s`, `2 h 10 min`.
pub(crate) fn duration(d: Duration) -> String {
    let s = d.as_secs();
    match s {
        0 => format!("{:.1} s", d.as_secs_f64()),
        1..60 => format!("{s} s"),
        60..3600 => format!("{} min {:02} s", s / 60, s % 60),
        _ => format!("{} h {:02} min", s / 3600, s % 3600 / 60),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_time_left_follows_from_the_part_that_is_done() {
        assert_eq!(
            time_left(Duration::from_secs(10), 0.25),
            Some(Duration::from_secs(30))
        );
        assert_eq!(
            time_left(Duration::from_secs(10), 1.0),
            Some(Duration::ZERO)
        );
        assert_eq!(time_left(Duration::from_secs(10), 0.0), None);
        assert_eq!(time_left(Duration::from_secs(10), f64::NAN), None);
    }

    #[test]
    fn durations_read_naturally() {
        let read = |s| duration(Duration::from_secs(s));
        assert_eq!(
            [read(42), read(185), read(7800)],
            ["42 s", "3 min 05 s", "2 h 10 min"]
        );
    }
}
