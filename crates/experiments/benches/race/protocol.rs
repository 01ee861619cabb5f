//! Requests and answers as lines of JSON: the same that the peers in `bench/peers/contest.py` speak.

use std::io::{BufRead, Stdin, stdin};
use std::path::PathBuf;
use std::time::Instant;

use lagrangian::train::Precision;
use serde::{Deserialize, Serialize};

/// What is to be timed. Sizes that a task does not have are 0.
#[derive(Debug, Clone, Deserialize)]
#[serde(default)]
pub(crate) struct Task {
    pub(crate) name: String,
    pub(crate) dof: usize,
    pub(crate) width: usize,
    /// Samples of a step, or states of a call.
    pub(crate) batch: usize,
    /// Rows of a log.
    pub(crate) rows: usize,
    pub(crate) precision: Precision,
    /// Steps of the beginning whose results are compared.
    pub(crate) check: usize,
    /// Where the others find data and weights.
    pub(crate) file: PathBuf,
    /// Whether that file is to be written.
    pub(crate) write: bool,
    /// Steps of a whole fit.
    pub(crate) steps: usize,
    /// Where the weights along a fit are written.
    pub(crate) history: PathBuf,
    /// The folder of recordings.
    pub(crate) recordings: PathBuf,
}

impl Default for Task {
    fn default() -> Self {
        Self {
            name: String::new(),
            dof: 2,
            width: 64,
            batch: 1,
            rows: 1000,
            precision: Precision::F64,
            check: 3,
            file: PathBuf::new(),
            steps: 100,
            history: PathBuf::new(),
            recordings: PathBuf::new(),
            write: false,
        }
    }
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Request {
    Task(Box<Task>),
    Laps(usize),
    End,
}

#[derive(Debug, Serialize)]
#[serde(rename_all = "lowercase")]
enum Reply {
    Ready { compile_ms: f64, check: Vec<f64> },
    Ms(f64),
    Error(String),
}

/// The two ends of the line.
pub(crate) struct Talk(Stdin);

impl Talk {
    pub(crate) fn new() -> Self {
        Self(stdin())
    }

    /// The next request; `None` when there are no more.
    pub(crate) fn request(&self) -> Option<Request> {
        let mut line = String::new();
        match self.0.lock().read_line(&mut line) {
            Ok(count) if count > 0 => serde_json::from_str(&line)
                .inspect_err(|e| self.error(&format!("not a request: {e}: {line}")))
                .ok(),
            _ => None,
        }
    }

    /// The task is ready; `check` is what it gave at the beginning.
    pub(crate) fn ready(&self, check: Vec<f64>) {
        let compile_ms = 0.0;
        answer(&Reply::Ready { compile_ms, check });
    }

    /// One iteration took so long.
    pub(crate) fn ms(&self, ms: f64) {
        answer(&Reply::Ms(ms));
    }

    pub(crate) fn error(&self, message: &str) {
        answer(&Reply::Error(message.into()));
    }

    /// Answers requests for laps of `iteration` until the end.
    pub(crate) fn serve(&self, check: Vec<f64>, mut iteration: impl FnMut()) {
        self.ready(check);
        while let Some(Request::Laps(laps)) = self.request() {
            let clock = Instant::now();
            (0..laps).for_each(|_| iteration());
            self.ms(1e3 * clock.elapsed().as_secs_f64() / laps.max(1) as f64);
        }
    }
}

fn answer(reply: &Reply) {
    match serde_json::to_string(reply) {
        Ok(line) => println!("{line}"),
        Err(e) => println!("{{\"error\": \"{e}\"}}"),
    }
}
