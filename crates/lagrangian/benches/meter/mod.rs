//! What all benches share: their command line, the laps of a clock, the limits of the machine, and one form of a row.
//!
//! `cargo bench --bench NAME -- [WORD…] [--smoke] [--json FILE]`: rows whose names contain all the words; `--smoke` runs
//! each of them a few times only, to see that it works, and so does `cargo test --benches`; `--json` appends a line for
//! each row to a file.
#![allow(dead_code, reason = "no bench uses all of it")]

pub(crate) mod data;
mod limits;
pub(crate) mod networks;
mod options;
mod row;

use std::time::Instant;

use lagrangian::train::Precision;

use limits::Limits;
use options::Options;
use row::Row;

/// Seconds that the laps of a row take in all, and the shortest lap, which the clock must not spoil.
const BUDGET: f64 = 0.25;
const LAP: f64 = 5e-5;
/// Laps of a row, at least and at most.
const LEAST: usize = 5;
const MOST: usize = 20_000;

/// What is timed, and what it cannot do without.
#[derive(Debug, Clone)]
pub(crate) struct Case {
    /// Its name with its sizes.
    pub(crate) name: String,
    /// Threads that it may use.
    pub(crate) threads: usize,
    /// Numbers that it computes with.
    pub(crate) precision: Precision,
    /// Floating-point operations that cannot be saved; 0 where they are not counted.
    pub(crate) operations: f64,
    /// Bytes that must be read or written; 0 where they are not counted.
    pub(crate) bytes: f64,
    /// Bytes that it comes back to, which decide from which cache they come.
    pub(crate) holds: f64,
    /// Things that a call gets done, and their name.
    pub(crate) things: (f64, &'static str),
}

impl Case {
    /// On one thread, in f64, with nothing counted.
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
    /// Reads the command line and prints the head of the table; `about` says what a row is and what is counted.
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

    /// Whether it is only to be seen that all works.
    pub(crate) fn smoke(&self) -> bool {
        self.options.smoke
    }

    /// Whether this row was asked for.
    pub(crate) fn wants(&self, name: &str) -> bool {
        self.options.words.iter().all(|word| name.contains(word))
    }

    /// The sizes of an axis; the first alone where all is only to be seen to work.
    pub(crate) fn axis<'a, T>(&self, sizes: &'a [T]) -> &'a [T] {
        &sizes[..if self.smoke() { 1 } else { sizes.len() }]
    }

    /// Times a call, which is told how many came before it.
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

    /// Laps that somebody else makes.
    pub(crate) fn laps(&self) -> Laps {
        Laps {
            seconds: Vec::new(),
            start: Instant::now(),
            least: if self.smoke() { 1 } else { LEAST },
            budget: if self.smoke() { 0.0 } else { BUDGET },
        }
    }

    /// Prints the row of these laps; gives their median, s.
    pub(crate) fn row(&self, case: &Case, laps: Vec<f64>) -> f64 {
        let row = Row::new(case, laps, self.limits.beside(case));
        println!("{}", row.text());
        self.options.write(|| row.to_json(self.bench));
        row.seconds
    }
}

/// The laps of a row.
pub(crate) struct Laps {
    /// Of each, s.
    pub(crate) seconds: Vec<f64>,
    start: Instant,
    least: usize,
    budget: f64,
}

impl Laps {
    /// Notes a lap; says whether another one is wanted.
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

/// Runs on so many threads.
pub(crate) fn on_threads<R: Send>(threads: usize, run: impl FnOnce() -> R + Send) -> R {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    expect(pool).install(run)
}

/// What a bench cannot go on without.
pub(crate) fn expect<T, E: std::fmt::Display>(result: Result<T, E>) -> T {
    result.unwrap_or_else(|e| panic!("{e}"))
}
