//! Natural gradient (Gauss–Newton, Levenberg–Marquardt) in the space of samples, with momentum.
//!
//! | symbol | meaning | shape |
//! |---|---|---|
//! | r | residuals of the batch, of order one | N |
//! | J | ∂r/∂θ, never formed | N × P |
//! | φ | step, remembered | P |
//! | μ, λ, η | momentum, damping, rate | |
//!
//! φ ← μ φ + Jᵀ (J Jᵀ + λ N I)⁻¹ (r − μ J φ), θ ← θ − η φ, J by its factors (theory.md, equations 19 and 20)
//! (SPRING: Goldshlager, Abrahamsen, Lin 2024, arXiv 2401.10190).

use std::sync::{Mutex, PoisonError};

use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::linalg::cholesky::llt::{self, factor::LltParams};
use faer::{Auto, Conj, Mat, Par};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::batch::{Samples, Value, value};
use super::damping::DampingRule;
use super::learner::{Learner, Loss, Work};
use super::part::Part;
use crate::mlp::simd::{Buffer, Real};
use crate::mlp::{Factors, Gradient, Packed, Terms, TileScratch};

/// Settings of the natural gradient.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct NaturalConfig {
    /// Largest rate η; the schedule scales it.
    pub rate: f64,
    /// Momentum μ.
    pub momentum: f64,
    /// Damping λ at the start; every step multiplies it by √(mean |r| of its batch), at most 1.
    pub damping_first: f64,
    /// Damping λ at the end; it falls geometrically.
    pub damping_last: f64,
    /// What the damping follows.
    pub damping_rule: DampingRule,
    /// Longest step η φ; longer ones are shortened to it.
    pub longest: f64,
}

impl Default for NaturalConfig {
    fn default() -> Self {
        Self {
            rate: 0.5,
            momentum: 0.9,
            damping_first: 1e-1,
            damping_last: 1e-7,
            damping_rule: DampingRule::Schedule,
            longest: 1.0,
        }
    }
}

const BLOCK: usize = 16;

/// J Jᵀ may be rounded to single precision where the damping on its diagonal is more than this share of its largest
/// entry.
const ROUNDED: f64 = 1e-6;

/// Residuals below this share of the mean |r| weigh no more than one of that size.
const SMALL: f64 = 0.1;

/// The memory of a run and the work space of its batches.
pub(crate) struct Natural {
    /// φ.
    pub(crate) phi: Vec<f64>,
    blocks: Vec<Block>,
    tiles: Vec<Tile>,
    /// One for each thread.
    scratch: Vec<Mutex<Scratch>>,
    system: System,
    packed: Packed<f64>,
    packed_phi: Packed<f64>,
}

struct Block {
    work: Work<f64>,
    factors: Factors<f64>,
    /// The same, rounded.
    rounded: Factors<f32>,
    gradient: Gradient<f64>,
    wide: Buffer<f64>,
    /// r − μ J φ, then the solution, `[samples, m]`; J φ and Dᵀ x in S-space, `[samples, k]`.
    right: Vec<f64>,
    raw: Vec<f64>,
    moved: Vec<f64>,
    value: Value,
}

struct Tile {
    row: usize,
    column: usize,
    values: Vec<f64>,
}

/// A symmetric positive definite system with one right-hand side, kept so that a step allocates nothing.
pub(crate) struct System {
    pub(crate) matrix: Mat<f64>,
    pub(crate) right: Mat<f64>,
    memory: MemBuffer,
}

impl System {
    pub(crate) fn new() -> Self {
        Self {
            matrix: Mat::new(),
            right: Mat::new(),
            memory: MemBuffer::new(StackReq::EMPTY),
        }
    }

    pub(crate) fn resize(&mut self, size: usize) {
        if self.matrix.nrows() != size {
            self.matrix = Mat::zeros(size, size);
            self.right = Mat::zeros(size, 1);
            let factor = llt::factor::cholesky_in_place_scratch::<f64>(
                size,
                Par::Seq,
                <LltParams as Auto<f64>>::auto().into(),
            );
            let solve = llt::solve::solve_in_place_scratch::<f64>(size, 1, Par::Seq);
            self.memory = MemBuffer::new(factor.or(solve));
        }
    }

    /// Overwrites the right-hand side with the solution. On one thread, so that the bits do not depend on how many
    /// there are.
    pub(crate) fn solve(&mut self) -> bool {
        let stack = MemStack::new(&mut self.memory);
        let (regularization, params) =
            (Default::default(), <LltParams as Auto<f64>>::auto().into());
        let matrix = self.matrix.as_mut();
        if llt::factor::cholesky_in_place(matrix, regularization, Par::Seq, stack, params).is_err()
        {
            return false;
        }
        let stack = MemStack::new(&mut self.memory);
        llt::solve::solve_in_place_with_conj(
            self.matrix.as_ref(),
            Conj::No,
            self.right.as_mut(),
            Par::Seq,
            stack,
        );
        true
    }
}

impl Natural {
    pub(crate) fn new(learner: &dyn Learner<f64>, batch: usize) -> Self {
        let net = learner.net();
        let (m, k) = (learner.residuals_each(), learner.outputs_each());
        let count = batch.div_ceil(BLOCK);
        let block = |_| {
            let work = Work::new(learner, BLOCK);
            Block {
                factors: Factors::new(net, &work.pass),
                rounded: Factors::new(net, &work.pass),
                wide: Buffer::new(work.pass.widest()),
                work,
                gradient: Gradient::new(net),
                right: vec![0.0; BLOCK * m],
                raw: vec![0.0; BLOCK * k],
                moved: Vec::new(),
                value: Value::default(),
            }
        };
        let size = BLOCK * m;
        let tile = |(row, column)| Tile {
            row,
            column,
            values: vec![0.0; size * size],
        };
        let blocks: Vec<Block> = (0..count).map(block).collect();
        let scratch = |_| Some(Mutex::new(Scratch::new(blocks.first()?, k)));
        Self {
            phi: vec![0.0; learner.parameters()],
            scratch: (0..rayon::current_num_threads())
                .filter_map(scratch)
                .collect(),
            blocks,
            tiles: in_squares(count).into_iter().map(tile).collect(),
            system: System::new(),
            packed: Packed::new(net),
            packed_phi: Packed::new(net),
        }
    }

    /// One step at `rate` with damping `damping`; returns the loss before it. A batch whose system cannot be solved
    /// moves nothing but forgets the momentum.
    pub(crate) fn step(
        &mut self,
        learner: &dyn Learner<f64>,
        config: &NaturalConfig,
        loss: Loss,
        (rate, damping): (f64, f64),
        (samples, numbers): (&Samples, &[usize]),
        parameters: &mut [f64],
    ) -> Value {
        let nobody = &mut |_| ();
        self.step_in_parts(
            learner,
            (config, loss),
            (rate, damping),
            (samples, numbers),
            parameters,
            nobody,
        )
    }

    /// [`Natural::step`], which says of each part that it is done.
    pub(crate) fn step_in_parts(
        &mut self,
        learner: &dyn Learner<f64>,
        (config, loss): (&NaturalConfig, Loss),
        (rate, damping): (f64, f64),
        (samples, numbers): (&Samples, &[usize]),
        parameters: &mut [f64],
        done: &mut dyn FnMut(Part),
    ) -> Value {
        let net = learner.net();
        let (weights, extra) = parameters.split_at(net.parameters);
        self.packed.set(net, weights);
        self.packed_phi.set(net, &self.phi[..net.parameters]);
        let terms = learner.terms();
        let used = numbers.len().div_ceil(BLOCK);
        let (packed, packed_phi, phi_extra) =
            (&self.packed, &self.packed_phi, &self.phi[net.parameters..]);
        self.blocks[..used]
            .par_iter_mut()
            .zip(numbers.par_chunks(BLOCK))
            .for_each(|(block, numbers)| {
                samples.gather(numbers, &mut block.work);
                learner.residuals(packed, extra, &mut block.work);
            });
        let m = learner.residuals_each();
        let level = level(&self.blocks[..used], m);
        done(Part::Forward);
        self.blocks[..used].par_iter_mut().for_each(|block| {
            block.weigh(loss, level, m);
            learner.linearise(packed, &mut block.work);
            block.factors.set(net, &block.work.pass, &terms);
            block.raw.fill(0.0);
            block
                .work
                .pass
                .push_forward(net, packed_phi, &terms, &mut block.wide, &mut block.raw);
            block.by_sample(learner.points());
            block.subtract_momentum(config.momentum, phi_extra, learner);
        });
        done(Part::Backward);
        let value = self.blocks[..used]
            .iter()
            .fold(Value::default(), |sum, b| sum.add(b.value));
        let mean_square = match loss.is_absolute() {
            true => level * level,
            false => value.mean(),
        };
        let damping = config.damping_rule.on_batch(damping, mean_square);
        // Far from the solution the quadratic model is poor; near it, damping is all that slows the step.
        let damping = damping * level.min(1.0).sqrt();
        self.gram(learner, used, &terms, damping);
        done(Part::Products);
        let solved = self.solve(used, m, damping);
        done(Part::Solve);
        if !solved {
            self.phi.fill(0.0);
            return value;
        }
        self.blocks[..used].par_iter_mut().for_each(|block| {
            block.unmix();
            block.by_point(learner.points());
            block.gradient.clear();
            let Block {
                work,
                raw,
                wide,
                gradient,
                ..
            } = block;
            work.pass
                .pull_back_factors(net, &terms, raw, wide, gradient);
        });
        done(Part::PullBack);
        self.advance(learner, config, used, rate, parameters);
        done(Part::Update);
        value
    }

    /// How much of the fall that the quadratic model foresaw for the batch of the last step became true; `values` are its
    /// losses before and after.
    pub(crate) fn gain(
        &self,
        learner: &dyn Learner<f64>,
        at: (f64, f64),
        (before, after): (Value, Value),
        batch: usize,
    ) -> f64 {
        // Absolute values are squares over the mean |r| of the batch (see `Block::weigh`).
        let unit = match learner.loss().0.is_absolute() {
            true => before.mean(),
            false => 1.0,
        };
        let foreseen = before.mean() - self.foreseen(learner, at, batch) / unit;
        (before.mean() - after.mean()) / foreseen.max(f64::MIN_POSITIVE)
    }

    /// The mean square that the quadratic model foresees for the batch of the last step, taken at `rate` with damping
    /// `damping`: with x = (J Jᵀ + λ N I)⁻¹ (r − μ J φ), J φ after the step is r − λ N x whatever the momentum.
    fn foreseen(
        &self,
        learner: &dyn Learner<f64>,
        (rate, damping): (f64, f64),
        batch: usize,
    ) -> f64 {
        let m = learner.residuals_each();
        let used = &self.blocks[..batch.div_ceil(BLOCK)];
        let damping = damping * level(used, m).min(1.0).sqrt() * (used.len() * BLOCK * m) as f64;
        let squares = used.iter().flat_map(|block| {
            let pairs = block.work.residual.iter().zip(&block.right);
            pairs.map(|(r, x)| ((1.0 - rate) * r + rate * damping * x).powi(2))
        });
        squares.sum::<f64>() / (batch * learner.counted()).max(1) as f64
    }

    /// The lower triangle of J Jᵀ, tile by tile: those on the diagonal in double precision, then the others, in single
    /// where `damping` hides the rounding.
    fn gram(&mut self, learner: &dyn Learner<f64>, used: usize, terms: &Terms, damping: f64) {
        let count = BLOCK * learner.residuals_each();
        let Self {
            blocks,
            tiles,
            scratch,
            ..
        } = self;

        let (mut diagonal, mut others): (Vec<_>, Vec<_>) = tiles
            .iter_mut()
            .filter(|t| t.row < used)
            .partition(|t| t.row == t.column);
        let work = (&blocks[..], &scratch[..]);
        fill(
            &mut diagonal,
            work,
            learner,
            terms,
            |b| &b.factors,
            Scratch::double,
        );
        let largest = diagonal
            .iter()
            .flat_map(|t| t.values.iter().step_by(count + 1))
            .fold(0.0, |largest: f64, x| largest.max(*x));
        if damping * (used * count) as f64 > ROUNDED * largest {
            blocks[..used]
                .par_iter_mut()
                .for_each(|b| b.rounded.set(learner.net(), &b.work.pass, terms));
            let work = (&blocks[..], &scratch[..]);
            fill(
                &mut others,
                work,
                learner,
                terms,
                |b| &b.rounded,
                Scratch::single,
            );
        } else {
            fill(
                &mut others,
                work,
                learner,
                terms,
                |b| &b.factors,
                Scratch::double,
            );
        }
    }

    /// Solves for the weights of the residuals; `false` if the system is not positive definite.
    fn solve(&mut self, used: usize, m: usize, damping: f64) -> bool {
        let count = BLOCK * m;
        let size = used * count;
        let places = self.places(used, count);
        let system = &mut self.system;
        system.resize(places.iter().flatten().count());
        for tile in self.tiles.iter().filter(|t| t.row < used) {
            let rows = &places[tile.row * count..][..count];
            for (column, place) in places[tile.column * count..][..count].iter().enumerate() {
                let Some(place) = *place else { continue };
                let target = system.matrix.col_as_slice_mut(place);
                for (values, row) in tile.values.chunks_exact(count).zip(rows) {
                    if let Some(row) = *row {
                        target[row] = values[column];
                    }
                }
            }
        }
        for i in 0..system.matrix.nrows() {
            system.matrix[(i, i)] += damping * size as f64;
        }
        // Row i · samples + s of a block belongs to residual i of sample s.
        let place = |b: usize, k: usize| places[b * count + k % m * BLOCK + k / m];
        for (b, block) in self.blocks[..used].iter().enumerate() {
            for (k, x) in block.right.iter().enumerate() {
                if let Some(row) = place(b, k) {
                    system.right[(row, 0)] = *x;
                }
            }
        }
        if system.matrix.nrows() > 0 && !system.solve() {
            return false;
        }
        for (b, block) in self.blocks[..used].iter_mut().enumerate() {
            for (k, x) in block.right.iter_mut().enumerate() {
                *x = place(b, k).map_or(0.0, |row| system.right[(row, 0)]);
            }
        }
        self.blocks[..used]
            .iter()
            .all(|b| b.right.iter().all(|x| x.is_finite()))
    }

    /// The row of each residual in the system; none for those that weigh nothing (of parameters, of padding), whose rows
    /// of J Jᵀ are zeros.
    fn places(&self, used: usize, count: usize) -> Vec<Option<usize>> {
        let mut places = vec![None; used * count];
        let own = |tile: &&Tile| tile.row == tile.column && tile.row < used;
        for tile in self.tiles.iter().filter(own) {
            for (i, place) in places[tile.row * count..][..count].iter_mut().enumerate() {
                *place = (tile.values[i * count + i] != 0.0).then_some(0);
            }
        }
        for (row, place) in places.iter_mut().flatten().enumerate() {
            *place = row;
        }
        places
    }

    /// φ ← μ φ + Jᵀ x, θ ← θ − η φ.
    fn advance(
        &mut self,
        learner: &dyn Learner<f64>,
        config: &NaturalConfig,
        used: usize,
        rate: f64,
        parameters: &mut [f64],
    ) {
        let (net, n, k) = (learner.net(), learner.dof(), learner.outputs_each());
        self.phi.iter_mut().for_each(|x| *x *= config.momentum);
        if let Some((first, rest)) = self.blocks[..used].split_first_mut() {
            rest.iter()
                .for_each(|block| first.gradient.add(&block.gradient));
            first.gradient.add_to(net, &mut self.phi);
        }
        for block in &mut self.blocks[..used] {
            let kinds = learner.extra();
            block.by_sample(learner.points());
            for (at, slope) in block.work.extra.iter().enumerate() {
                let (output, kind) = (at / kinds, at % kinds);
                let coordinate = learner.coordinate(output % k);
                self.phi[net.parameters + kind * n + coordinate] += slope * block.raw[output];
            }
        }
        let length = rate * self.phi.iter().map(|x| x * x).sum::<f64>().sqrt();
        if !length.is_finite() {
            self.phi.fill(0.0);
            return;
        }
        let rate = if length > config.longest {
            rate * config.longest / length
        } else {
            rate
        };
        parameters
            .iter_mut()
            .zip(&self.phi)
            .for_each(|(theta, x)| *theta -= rate * x);
        learner.project(parameters);
    }
}

/// The lower triangle of a matrix of `count` × `count` tiles, square after square, so that the factors of neighbours are
/// still at hand.
fn in_squares(count: usize) -> Vec<(usize, usize)> {
    let mut tiles: Vec<_> = (0..count)
        .flat_map(|i| (0..=i).map(move |j| (i, j)))
        .collect();
    tiles.sort_by_key(|&(i, j)| (i / SQUARE, j / SQUARE, i, j));
    tiles
}

/// Tiles on the side of a square.
const SQUARE: usize = 2;

/// What a thread needs for a tile, in both precisions: kept, because memory of this size is dear to ask for.
struct Scratch {
    double: TileScratch<f64>,
    single: TileScratch<f32>,
    raw: Vec<f64>,
}

impl Scratch {
    fn new(block: &Block, outputs: usize) -> Self {
        Self {
            double: TileScratch::new(&block.factors),
            single: TileScratch::new(&block.rounded),
            raw: vec![0.0; (BLOCK * outputs).pow(2)],
        }
    }

    fn double(&mut self) -> (&mut TileScratch<f64>, &mut [f64]) {
        (&mut self.double, &mut self.raw)
    }

    fn single(&mut self) -> (&mut TileScratch<f32>, &mut [f64]) {
        (&mut self.single, &mut self.raw)
    }
}

/// Fills tiles of J Jᵀ from the factors of the blocks; `of` gives these and their scratch.
fn fill<S: Real>(
    tiles: &mut [&mut Tile],
    (blocks, scratch): (&[Block], &[Mutex<Scratch>]),
    learner: &dyn Learner<f64>,
    terms: &Terms,
    factors: impl Fn(&Block) -> &Factors<S> + Sync + Send,
    of: impl Fn(&mut Scratch) -> (&mut TileScratch<S>, &mut [f64]) + Sync + Send,
) {
    let net = learner.net();
    tiles.par_iter_mut().for_each(|tile| {
        let mine = rayon::current_thread_index().unwrap_or(0) % scratch.len();
        let mut mine = scratch[mine].lock().unwrap_or_else(PoisonError::into_inner);
        let (scratch, raw) = of(&mut mine);
        let (left, right) = (&blocks[tile.row], &blocks[tile.column]);
        factors(left).tile(net, factors(right), terms, scratch, raw);
        mix_tile(&left.work, &right.work, learner, raw, &mut tile.values);
    });
}

/// Mean |r| of the batch, never zero.
fn level(blocks: &[Block], m: usize) -> f64 {
    let residuals = || {
        blocks
            .iter()
            .flat_map(|b| &b.work.residual[..b.work.count * m])
    };
    let counted = blocks.iter().map(|b| b.work.count * b.work.counted);
    let mean = residuals().map(|r| r.abs()).sum::<f64>() / counted.sum::<usize>().max(1) as f64;
    if mean.is_finite() {
        mean.max(1e-12)
    } else {
        1.0
    }
}

impl Block {
    /// Turns residuals into those whose squares are minimised, and leaves the padding of the block out.
    fn weigh(&mut self, loss: Loss, level: f64, m: usize) {
        let work = &mut self.work;
        self.value = value(work, loss, m);
        let k = work.mix.len() / work.residual.len();
        for at in 0..work.residual.len() {
            let r = work.residual[at];
            let weight = match loss {
                _ if at >= work.count * m => 0.0,
                // |r| = r² / |r|: squares, reweighted at every step, in units of the mean |r| of the batch.
                _ if loss.is_absolute() => (level / r.abs().max(SMALL * level)).sqrt(),
                _ => 1.0,
            };
            work.residual[at] = r * weight;
            work.mix[at * k..at * k + k]
                .iter_mut()
                .for_each(|d| *d *= weight);
        }
    }

    /// right = r − μ D (J φ in S-space, in `raw`).
    fn subtract_momentum(&mut self, momentum: f64, phi_extra: &[f64], learner: &dyn Learner<f64>) {
        let n = learner.dof();
        let kinds = phi_extra.len() / n;
        let (m, k) = (self.right.len() / BLOCK, self.raw.len() / BLOCK);
        for (at, raw) in self.raw.iter_mut().enumerate() {
            for e in 0..kinds {
                *raw +=
                    self.work.extra[at * kinds + e] * phi_extra[e * n + learner.coordinate(at % k)];
            }
        }
        for (at, right) in self.right.iter_mut().enumerate() {
            let along = &self.raw[at / m * k..][..k];
            let row = &self.work.mix[at * k..][..k];
            let pushed = row.iter().zip(along).map(|(d, x)| d * x).sum::<f64>();
            *right = self.work.residual[at] - momentum * pushed;
        }
    }

    /// Brings `raw` from the order of the pass, `[point, sample, n]`, to that of the samples, `[sample, n, point]`.
    fn by_sample(&mut self, points: usize) {
        self.reorder(points, |by_point, by_sample| (by_sample, by_point));
    }

    /// Brings `raw` back.
    fn by_point(&mut self, points: usize) {
        self.reorder(points, |by_point, by_sample| (by_point, by_sample));
    }

    /// Moves every number of `raw` to the first of the places that `way` says, from the second.
    fn reorder(&mut self, points: usize, way: impl Fn(usize, usize) -> (usize, usize)) {
        if points == 1 {
            return;
        }
        let n = self.raw.len() / BLOCK / points;
        self.moved.clone_from(&self.raw);
        for (s, i, j) in
            (0..BLOCK).flat_map(|s| (0..n).flat_map(move |i| (0..points).map(move |j| (s, i, j))))
        {
            let (to, from) = way((j * BLOCK + s) * n + i, (s * n + i) * points + j);
            self.raw[to] = self.moved[from];
        }
    }

    /// raw = Dᵀ right.
    fn unmix(&mut self) {
        let (m, k) = (self.right.len() / BLOCK, self.raw.len() / BLOCK);
        for (at, raw) in self.raw.iter_mut().enumerate() {
            let (s, column) = (at / k, at % k);
            *raw = (0..m)
                .map(|i| self.work.mix[(s * m + i) * k + column] * self.right[s * m + i])
                .sum();
        }
    }
}

/// K = D (S-space tile + extra parameters) D'ᵀ (theory.md, section 7), rows and columns i · samples + s.
fn mix_tile(
    left: &Work<f64>,
    right: &Work<f64>,
    learner: &dyn Learner<f64>,
    raw: &mut [f64],
    out: &mut [f64],
) {
    let kinds = learner.extra();
    let same = |i: usize, j: usize| learner.coordinate(i) == learner.coordinate(j);
    let (m, k) = (left.residual.len() / BLOCK, left.along.len() / BLOCK);
    let raw_size = k * BLOCK;
    for (i, j) in pairs(k).filter(|(i, j)| kinds > 0 && same(*i, *j)) {
        for s in 0..BLOCK {
            let row = &mut raw[(i * BLOCK + s) * raw_size + j * BLOCK..][..BLOCK];
            for e in 0..kinds {
                let slope = left.extra[(s * k + i) * kinds + e];
                for (t, x) in row.iter_mut().enumerate() {
                    *x += slope * right.extra[(t * k + j) * kinds + e];
                }
            }
        }
    }
    out.fill(0.0);
    let mut between = [0.0; BLOCK];
    for s in 0..BLOCK {
        for (i, l) in (0..m).flat_map(|i| (0..k).map(move |l| (i, l))) {
            // Σ over the outputs of the left sample, then over those of the right ones.
            between.fill(0.0);
            for (c, d) in left.mix[(s * m + i) * k..][..k].iter().enumerate() {
                let source = &raw[(c * BLOCK + s) * raw_size + l * BLOCK..][..BLOCK];
                if *d != 0.0 {
                    between
                        .iter_mut()
                        .zip(source)
                        .for_each(|(x, y)| *x += d * y);
                }
            }
            for j in 0..m {
                let target = &mut out[(i * BLOCK + s) * m * BLOCK + j * BLOCK..][..BLOCK];
                for (t, (x, y)) in target.iter_mut().zip(&between).enumerate() {
                    *x += y * right.mix[(t * m + j) * k + l];
                }
            }
        }
    }
}

/// All pairs of numbers below `k`.
fn pairs(k: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..k).flat_map(move |i| (0..k).map(move |j| (i, j)))
}
