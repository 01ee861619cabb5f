//! The bounds of what a page can ask for: a tab has no gigabytes to spare, and nothing may take minutes without a word.

/// The most bytes of a file.
pub const FILE: usize = 64 << 20;
/// The most columns of a table.
pub const COLUMNS: usize = 500;
/// The longest name of a column, in bytes.
pub const NAME: usize = 200;
/// The most samples of all motions of an experiment.
pub const SAMPLES: usize = 200_000;
/// The most samples of one predicted motion.
pub const PREDICTED: usize = 20_000;
/// The widest hidden layer.
pub const WIDTH: usize = 256;
/// The longest fit, s.
pub const SECONDS: f64 = 600.0;
/// The most steps of a fit.
pub const STEPS: usize = 1_000_000;
/// The longest slice of a fit between two answers, ms.
pub const SLICE: f64 = 1000.0;
/// The most steps of an integrator for one motion.
pub const INTEGRATED: u64 = 200_000;
/// The most starts of an energy test.
pub const STARTS: usize = 100;
