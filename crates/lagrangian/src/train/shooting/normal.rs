//! The normal equations of the parameters, with the starts of segments eliminated.

use faer::linalg::matmul::matmul;
use faer::linalg::solvers::Solve;
use faer::prelude::{Reborrow, ReborrowMut};
use faer::{Accum, Mat, MatMut, MatRef, Par, Side};
use lagrangian_motion::parallel::prelude::*;

use super::problem::{BLOCK, Problem, Segment};
use lagrangian_motion::solve::dot;

/// Bytes of the rows of J that are held at a time.
const HELD: usize = 64 << 20;

/// Rows and columns of a tile of Jᵀ J.
const TILE: usize = 192;

/// Jᵀ J and Jᵀr of what the starts leave, and what gives the starts.
pub(super) struct Normal {
    /// Jᵀ J `[P, P]`, its lower triangle.
    pub(super) matrix: Mat<f64>,
    /// Jᵀr.
    pub(super) right: Vec<f64>,
    starts: Vec<BestStart>,
}

/// The best start of a segment for a change of the parameters.
pub(crate) struct BestStart {
    /// R⁻¹, `[d, d]`.
    inverse: Vec<f64>,
    /// Qᵀ r, `[d]`.
    right: Vec<f64>,
    /// Qᵀ J, `[d, P]`.
    slopes: Vec<f64>,
}

/// A segment without its start.
pub(crate) struct Reduced {
    /// (J − Q Qᵀ J, S), `[m, P + d]`.
    pub(crate) rows: Vec<f64>,
    /// r − Q Qᵀ r, `[m]`.
    pub(crate) residual: Vec<f64>,
    pub(crate) start: BestStart,
}

impl Normal {
    /// The equations at these parameters and starts; `None` where a rollout fails. The bits do not depend on the number of
    /// threads.
    pub(super) fn of(problem: &Problem<'_>, theta: &[f64], segments: &[Segment]) -> Option<Self> {
        let (at, count) = (problem.at(theta), theta.len());
        let columns = count + problem.state();
        let longest = segments.iter().map(|s| s.samples).max()?;
        let bytes = longest * problem.noise.len() * columns * size_of::<f64>();
        let held = (HELD / bytes / BLOCK).max(1) * BLOCK;
        let starts = (0..count).step_by(TILE);
        let tiles: Vec<_> = starts
            .flat_map(|i| (0..=i).step_by(TILE).map(move |j| (i, j)))
            .collect();
        let mut normal = Self {
            matrix: Mat::zeros(count, count),
            right: vec![0.0; count],
            starts: Vec::with_capacity(segments.len()),
        };
        for some in segments.chunks(held) {
            let blocks = some.par_chunks(BLOCK);
            let reduced: Vec<_> = blocks
                .map(|block| problem.reduced(&at, block, true))
                .collect();
            let reduced: Vec<_> = reduced
                .into_iter()
                .collect::<Option<Vec<_>>>()?
                .into_iter()
                .flatten()
                .collect();
            let products = tiles
                .par_iter()
                .map(|&tile| product(&reduced, columns, count, tile));
            let products: Vec<_> = products.collect();
            for (&(i, j), product) in tiles.iter().zip(&products) {
                let mut part =
                    normal
                        .matrix
                        .as_mut()
                        .submatrix_mut(i, j, product.nrows(), product.ncols());
                part += product;
            }
            for Reduced {
                rows,
                residual,
                start,
            } in reduced
            {
                for (row, r) in rows.chunks_exact(columns).zip(&residual) {
                    normal
                        .right
                        .iter_mut()
                        .zip(row)
                        .for_each(|(sum, x)| *sum += r * x);
                }
                normal.starts.push(start);
            }
        }
        Some(normal)
    }

    /// The solution δ of (Jᵀ J + A + μ M) δ = −(Jᵀr + A θ) and how much it should lower the objective.
    pub(super) fn solve(
        &self,
        theta: &[f64],
        prior: &[f64],
        metric: &[f64],
        damping: f64,
    ) -> Option<(Vec<f64>, f64)> {
        let count = theta.len();
        let mut matrix = self.matrix.clone();
        for i in 0..count {
            matrix[(i, i)] += prior[i] + damping * metric[i];
        }
        let slope: Vec<f64> = (0..count)
            .map(|i| self.right[i] + prior[i] * theta[i])
            .collect();
        let solution = matrix
            .llt(Side::Lower)
            .ok()?
            .solve(Mat::from_fn(count, 1, |i, _| -slope[i]));
        let delta = solution.col_as_slice(0).to_vec();
        let damped: f64 = delta
            .iter()
            .zip(metric)
            .map(|(x, m)| damping * m * x * x)
            .sum();
        delta.iter().all(|x| x.is_finite()).then(|| {
            let foreseen = damped - dot(&delta, &slope);
            (delta, foreseen)
        })
    }

    /// The segments with their best starts after a change `delta` of the parameters.
    pub(super) fn moved(&self, segments: &[Segment], delta: &[f64]) -> Vec<Segment> {
        let each = segments.iter().zip(&self.starts);
        each.map(|(segment, best)| best.of(segment, delta))
            .collect()
    }
}

/// A tile of Jᵀ J, its first row and column given.
fn product(reduced: &[Reduced], columns: usize, count: usize, (i, j): (usize, usize)) -> Mat<f64> {
    let (height, width) = (TILE.min(count - i), TILE.min(count - j));
    let mut tile = Mat::zeros(height, width);
    for segment in reduced {
        let rows = MatRef::from_column_major_slice(&segment.rows, columns, segment.residual.len());
        let (left, right) = (rows.subrows(i, height), rows.subrows(j, width));
        matmul(
            tile.as_mut(),
            Accum::Add,
            left,
            right.transpose(),
            1.0,
            Par::Seq,
        );
    }
    tile
}

impl Reduced {
    /// |r|² before the start was eliminated, and the part of it that the start is foreseen to take away.
    pub(crate) fn value(&self) -> [f64; 2] {
        let (left, along) = (&self.residual, &self.start.right);
        let gain = dot(along, along);
        [dot(left, left) + gain, gain]
    }
}

impl BestStart {
    /// The change of the start to the best one after a change `delta` of the parameters, which is empty where they are held.
    pub(crate) fn change(&self, delta: &[f64]) -> Vec<f64> {
        let d = self.right.len();
        let along =
            |i: usize| self.right[i] + dot(&self.slopes[i * delta.len()..][..delta.len()], delta);
        let along: Vec<f64> = (0..d).map(along).collect();
        // A start that has no direction to go stays.
        let rows = self.inverse.chunks_exact(d.max(1));
        rows.map(|row| -dot(row, &along)).collect()
    }

    /// The segment with the best start after a change `delta` of the parameters.
    pub(super) fn of(&self, segment: &Segment, delta: &[f64]) -> Segment {
        let pairs = segment.start.iter().zip(self.change(delta));
        let start = pairs.map(|(x, by)| x + by).collect();
        Segment { start, ..*segment }
    }
}

/// Eliminates the start from the rows (J, S) `[m, P + d]` and the residuals of a segment.
pub(crate) fn eliminate(
    mut rows: Vec<f64>,
    mut residual: Vec<f64>,
    count: usize,
    d: usize,
) -> Reduced {
    let m = residual.len();
    let all = MatMut::from_row_major_slice_mut(&mut rows, m, count + d);
    let (mut jacobian, of_start) = all.split_at_col_mut(count);
    let qr = of_start.qr();
    let q = qr.compute_thin_Q();
    let upper = qr.thin_R();
    let mut slopes = vec![0.0; d * count];
    let mut along = MatMut::from_row_major_slice_mut(&mut slopes, d, count);
    matmul(
        along.rb_mut(),
        Accum::Replace,
        q.transpose(),
        jacobian.rb(),
        1.0,
        Par::Seq,
    );
    matmul(
        jacobian.rb_mut(),
        Accum::Add,
        &q,
        along.rb(),
        -1.0,
        Par::Seq,
    );
    let mut right = vec![0.0; d];
    let mut along = MatMut::from_column_major_slice_mut(&mut right, d, 1);
    let mut left = MatMut::from_column_major_slice_mut(&mut residual, m, 1);
    matmul(
        along.rb_mut(),
        Accum::Replace,
        q.transpose(),
        left.rb(),
        1.0,
        Par::Seq,
    );
    matmul(left.rb_mut(), Accum::Add, &q, along.rb(), -1.0, Par::Seq);
    Reduced {
        start: BestStart {
            inverse: inverse(upper),
            right,
            slopes,
        },
        rows,
        residual,
    }
}

/// R⁻¹ of an upper triangle, `[d, d]`; 0 in the rows of zero pivots, whose part of the start stays.
fn inverse(upper: MatRef<'_, f64>) -> Vec<f64> {
    let d = upper.ncols();
    let mut inverse = vec![0.0; d * d];
    for c in 0..d {
        for i in (0..=c).rev() {
            let known: f64 = (i + 1..=c)
                .map(|k| upper[(i, k)] * inverse[k * d + c])
                .sum();
            let (unit, pivot) = (if i == c { 1.0 } else { 0.0 }, upper[(i, i)]);
            inverse[i * d + c] = if pivot == 0.0 {
                0.0
            } else {
                (unit - known) / pivot
            };
        }
    }
    inverse
}
