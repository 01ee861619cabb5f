//! Blocks of time, and the selection that is drawn from them for each member.

use std::ops::Range;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::dataset::{Dataset, Timeline};
use crate::fit::FitConfig;
use crate::train::Loss;
use lagrangian_motion::Samples;
use lagrangian_motion::{Error, Result, Signals, Trajectory};

/// The number of blocks that long recordings are cut into, together; a short recording is one block.
const BLOCKS: usize = 40;
/// The smallest number of samples of a block, and the smallest number of blocks.
const SHORTEST: usize = 20;
const FEWEST: usize = 4;

/// The blocks of the training samples, and those that each member is fitted to.
pub(super) struct Bags {
    pub(super) blocks: Vec<Range<usize>>,
    drawn: Vec<Vec<usize>>,
}

impl Bags {
    /// Draws as many blocks as exist, with replacement, for each member.
    pub(super) fn new(dataset: &Dataset, config: &FitConfig, members: usize) -> Result<Self> {
        let blocks = blocks(dataset, config);
        if blocks.len() < FEWEST {
            return Err(Error::too_short(
                "the data of an ensemble, which is divided into blocks,",
                dataset.train.len(),
                FEWEST * shortest(config),
            ));
        }
        let mut rng = ChaCha8Rng::seed_from_u64(config.seed);
        let mut draw = || {
            let count = blocks.len();
            let mut own: Vec<usize> = (0..count).map(|_| rng.random_range(0..count)).collect();
            own.sort_unstable();
            own
        };
        let drawn = (0..members).map(|_| draw()).collect();
        Ok(Self { blocks, drawn })
    }

    /// The data that a member is fitted to.
    pub(super) fn dataset(&self, all: &Dataset, member: usize) -> Dataset {
        let mut train = Samples::empty(all.train.n);
        let mut times = Timeline::default();
        for block in self.drawn[member].iter().map(|&b| self.blocks[b].clone()) {
            if !all.train_times.t.is_empty() {
                times.begins.push(times.t.len());
                times.t.extend(&all.train_times.t[block.clone()]);
            }
            append(&all.train, block, &mut train);
        }
        Dataset {
            train,
            train_times: times,
            unfiltered: None,
            ..all.clone()
        }
    }

    /// The members that have not seen a block.
    pub(super) fn without(&self, block: usize) -> impl Iterator<Item = usize> + '_ {
        let members = self.drawn.iter().enumerate();
        members
            .filter(move |(_, own)| own.binary_search(&block).is_err())
            .map(|(member, _)| member)
    }
}

/// The shortest block for such a fit, in samples.
fn shortest(config: &FitConfig) -> usize {
    match config.loss == Loss::ROLLOUT {
        true => SHORTEST.max(2 * config.rollout.horizon + 2),
        false => SHORTEST,
    }
}

fn blocks(dataset: &Dataset, config: &FitConfig) -> Vec<Range<usize>> {
    let samples = dataset.train.len();
    let length = samples.div_ceil(BLOCKS).max(shortest(config));
    let runs: Vec<Range<usize>> = match dataset.train_times.t.is_empty() {
        true => std::iter::once(0..samples).collect(),
        false => dataset.train_times.runs().collect(),
    };
    let cut = |run: Range<usize>| {
        let parts = (run.len() / length).max(1);
        (0..parts).map(move |k| {
            let at = |k: usize| run.start + k * run.len() / parts;
            at(k)..at(k + 1)
        })
    };
    runs.into_iter().flat_map(cut).collect()
}

fn append(all: &Samples, block: Range<usize>, to: &mut Samples) {
    let n = all.n;
    for ((_, to), (_, from)) in to.signals.iter_mut().zip(all.signals.iter()) {
        if !from.is_empty() {
            to.extend(&from[block.start * n..block.end * n]);
        }
    }
    if !all.weights.is_empty() {
        to.weights.extend(&all.weights[block.clone()]);
    }
    if !all.steps.is_empty() {
        to.steps.extend(&all.steps[2 * block.start..2 * block.end]);
    }
}

/// A block as a motion; without times where the samples have none.
pub(super) fn motion(dataset: &Dataset, block: Range<usize>) -> Trajectory {
    let mut samples = Samples::empty(dataset.train.n);
    append(&dataset.train, block.clone(), &mut samples);
    let times = &dataset.train_times.t;
    let t = times.get(block).map(<[f64]>::to_vec).unwrap_or_default();
    let Signals { tau, .. } = &mut samples.signals;
    if !dataset.forced {
        tau.clear();
    }
    Trajectory::new("block", t, samples.signals)
}
