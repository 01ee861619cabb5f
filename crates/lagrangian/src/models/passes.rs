//! Passes through a network for one state and for blocks of them.

use nets::{Net, Pass};

/// The number of samples of a block when many states are evaluated at once.
pub(crate) const BLOCK: usize = 16;

/// Passes for one state and for blocks, made when first needed.
#[derive(Debug, Default)]
pub(crate) struct Passes {
    one: Option<Pass<f64>>,
    block: Option<Pass<f64>>,
}

/// The states of a block.
#[derive(Debug, Clone, Copy)]
pub(crate) struct States {
    start: usize,
    /// The number of states in the block; the rest of its samples repeat the first.
    pub(crate) count: usize,
}

impl States {
    /// The number of the state of sample `s`. The last block repeats its first state, so that every lane holds a valid one.
    pub(crate) fn of(&self, s: usize) -> usize {
        self.start + if s < self.count { s } else { 0 }
    }
}

impl Passes {
    /// Calls `f` with a pass of this capacity for each block of `m` states.
    pub(crate) fn each(
        &mut self,
        (net, capacity): (&Net, usize),
        m: usize,
        mut f: impl FnMut(&mut Pass<f64>, States),
    ) {
        let (samples, pass) = match m {
            1 => (1, &mut self.one),
            _ => (BLOCK, &mut self.block),
        };
        let pass = pass.get_or_insert_with(|| Pass::new(net, samples, capacity));
        for start in (0..m).step_by(samples) {
            let count = samples.min(m - start);
            f(pass, States { start, count });
        }
    }
}
