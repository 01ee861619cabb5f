//! The number of computing threads: that of the cores, or a reasonable one from the environment.

use std::env;

use rayon::ThreadPoolBuilder;

/// The variable of the environment that the pool of threads reads.
const VARIABLE: &str = "RAYON_NUM_THREADS";

/// More threads than this only cost memory, bytes of stack for each.
const MOST: usize = 256;

/// Bounds the number of threads from the environment.
pub(crate) fn bound() {
    let asked = env::var_os(VARIABLE).and_then(|text| text.to_str()?.trim().parse().ok());
    if asked.is_none_or(|count: usize| count <= MOST) {
        return;
    }
    note!("note: {VARIABLE}: {MOST} threads are used, the most");
    // OK to ignore: a pool that exists already is used as it is.
    let _ = ThreadPoolBuilder::new().num_threads(MOST).build_global();
}
