//! The common part of all benches: their command line, the laps of a clock, the limits of the machine, and one form of a row.
//!
//! `cargo bench --bench NAME -- [WORD…] [--smoke] [--json FILE]`: rows whose names contain all the words; `--smoke` runs
//! each of them a few times only, to check that it works, and so does `cargo test --benches`; `--json` appends a line for
//! each row to a file.
#![allow(dead_code, reason = "no bench uses all of it")]

mod bandwidth;
pub(crate) mod data;
mod limits;
pub(crate) mod networks;
mod options;
mod peak;
mod row;

use std::time::Instant;

use lagrangian::train::Precision;

use limits::Limits;
use options::Options;
use row::Row;

/// The duration of all laps of a row, s, and that of the shortest lap, which the resolution of the clock must not spoil.
const BUDGET: f64 = 0.25;
const LAP: f64 = 5e-5;
/// The smallest and the largest number of laps of a row.
const LEAST: usize = 5;
const MOST: usize = 20_000;

/// The operation that is timed, and its lower bounds.
#[derive(Debug, Clone)]
pub(crate) struct Case {
    /// The name with the sizes.
    pub(crate) name: String,
    /// The number of threads that it may use.
    pub(crate) threads: usize,
    /// The precision of its numbers.
    pub(crate) precision: Precision,
    /// Lower bound of the floating-point operations; 0 where they are not counted.
    pub(crate) operations: f64,
    /// Lower bound of the bytes that are read or written; 0 where they are not counted.
    pub(crate) bytes: f64,
    /// Bytes that are used again, which decide from which cache they come.
    pub(crate) holds: f64,
    /// The number of things that a call completes, and their name.
    pub(crate) things: (f64, &'static str),
}

impl Case {
    /// A case on one thread, in f64, with nothing counted.
    pub(crate) fn new(name: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            threads: 1,
            precision: Precision::F64,
            operations: 0.0,
            bytes: 0.0,
            holds: 0.0,
            things: (1.0, "calls"),
        }
    }
}

/// Times one bench row by row.
pub(crate) struct Meter {
    bench: &'static str,
    options: Options,
    limits: Limits,
}

impl Meter {
    /// Reads the command line and prints the head of the table; `about` describes a row and the counts.
    pub(crate) fn new(bench: &'static str, about: &str) -> Self {
        let options = Options::from_command_line(bench);
        let limits = Limits::new(options.smoke);
        println!("\n{bench}: {about}\n{}\n{}", limits.describe(), row::head());
        options.write(|| limits.to_json(bench, about));
        Self {
            bench,
            options,
            limits,
        }
    }

    /// Whether only a check is wanted that all works.
    pub(crate) fn smoke(&self) -> bool {
        self.options.smoke
    }

    /// Whether this row is selected.
    pub(crate) fn wants(&self, name: &str) -> bool {
        self.options.words.iter().all(|word| name.contains(word))
    }

    /// The sizes of an axis; the first alone for a mere check that all works.
    pub(crate) fn axis<'a, T>(&self, sizes: &'a [T]) -> &'a [T] {
        &sizes[..if self.smoke() { 1 } else { sizes.len() }]
    }

    /// Times a call, which receives the number of calls before it.
    pub(crate) fn calls(&self, case: &Case, mut call: impl FnMut(usize)) {
        if !self.wants(&case.name) {
            return;
        }
        call(0);
        let clock = Instant::now();
        call(1);
        let once = clock.elapsed().as_secs_f64();
        let calls = (LAP / once.max(1e-9)).ceil().clamp(1.0, 1e5) as usize;
        let calls = if self.smoke() { 1 } else { calls };
        let mut laps = self.laps();
        let mut number = 2;
        let mut lap = || {
            let clock = Instant::now();
            (0..calls).for_each(|k| call(number + k));
            number += calls;
            clock.elapsed().as_secs_f64() / calls as f64
        };
        while laps.add(lap()) {}
        self.row(case, laps.seconds);
    }

    /// Laps that the caller makes.
    pub(crate) fn laps(&self) -> Laps {
        Laps {
            seconds: Vec::new(),
            start: Instant::now(),
            least: if self.smoke() { 1 } else { LEAST },
            budget: if self.smoke() { 0.0 } else { BUDGET },
        }
    }

    /// Prints the row of these laps and returns their median, s.
    pub(crate) fn row(&self, case: &Case, laps: Vec<f64>) -> f64 {
        let row = Row::new(case, laps, self.limits.beside(case));
        println!("{}", row.text());
        self.options.write(|| row.to_json(self.bench));
        row.seconds
    }
}

/// The laps of a row.
pub(crate) struct Laps {
    /// The duration of each lap, s.
    pub(crate) seconds: Vec<f64>,
    start: Instant,
    least: usize,
    budget: f64,
}

impl Laps {
    /// Adds a lap; returns whether another one is wanted.
    pub(crate) fn add(&mut self, seconds: f64) -> bool {
        self.seconds.push(seconds);
        let laps = self.seconds.len();
        laps < self.least || laps < MOST && self.start.elapsed().as_secs_f64() < self.budget
    }
}

/// Threads that a bench may use: one, and all (two at least are needed for that).
pub(crate) fn threads() -> Vec<usize> {
    let all = std::thread::available_parallelism().map_or(1, usize::from);
    if all > 1 { vec![1, all] } else { vec![1] }
}

/// Runs on this number of threads.
pub(crate) fn on_threads<R: Send>(threads: usize, run: impl FnOnce() -> R + Send) -> R {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    expect(pool).install(run)
}

/// Unwraps a result that a bench needs.
pub(crate) fn expect<T, E: std::fmt::Display>(result: Result<T, E>) -> T {
    result.unwrap_or_else(|e| panic!("{e}"))
}
