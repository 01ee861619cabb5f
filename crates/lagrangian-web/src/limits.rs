//! Bounds of the requests of a page: the memory of a tab is limited, and no request may run for minutes without an answer.

/// Largest size of a file, bytes.
pub const FILE: usize = 64 << 20;
/// Largest number of columns of a table.
pub const COLUMNS: usize = 500;
/// Longest name of a column, bytes.
pub const NAME: usize = 200;
/// Largest number of samples of all motions of an experiment.
pub const SAMPLES: usize = 200_000;
/// Largest number of samples of one predicted motion.
pub const PREDICTED: usize = 20_000;
/// Largest width of a hidden layer.
pub const WIDTH: usize = 256;
/// Longest duration of a fit, s.
pub const SECONDS: f64 = 600.0;
/// Largest number of steps of a fit.
pub const STEPS: usize = 1_000_000;
/// Longest slice of a fit between two answers, ms.
pub const SLICE: f64 = 1000.0;
/// Largest number of steps of an integrator for one motion.
pub const INTEGRATED: u64 = 200_000;
/// Largest number of starts of an energy test.
pub const STARTS: usize = 100;
