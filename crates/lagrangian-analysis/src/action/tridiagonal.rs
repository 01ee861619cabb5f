//! Symmetric block-tridiagonal matrices: H = L D Lᵀ in O(N), inertia, and linear systems.

use lagrangian::mechanics::{diagonalise, dot};

/// K diagonal blocks of n × n, and blocks between neighbours.
#[derive(Debug, Clone)]
pub(super) struct BlockTridiagonal {
    pub(super) n: usize,
    /// Blocks on the diagonal, `[K, n, n]`.
    pub(super) diagonal: Vec<f64>,
    /// Blocks between k and k + 1, `[K, n, n]`; the last one couples to the next node and is outside of the matrix.
    pub(super) upper: Vec<f64>,
}

/// H = L D Lᵀ with Dₖ = Hₖₖ − Uₖ₋₁ᵀ Dₖ₋₁⁻¹ Uₖ₋₁ (theory.md, equation 76).
#[derive(Debug, Clone)]
pub(super) struct Factored<'a> {
    matrix: &'a BlockTridiagonal,
    pub(super) pivots: Vec<Pivot>,
}

/// One block Dₖ with its eigenvalues and eigenvectors.
#[derive(Debug, Clone)]
pub(super) struct Pivot {
    /// Dₖ, `[n, n]`.
    pub(super) block: Vec<f64>,
    values: Vec<f64>,
    /// Eigenvectors as rows, `[n, n]`.
    vectors: Vec<f64>,
}

impl BlockTridiagonal {
    pub(super) fn zeros(n: usize, blocks: usize) -> Self {
        Self {
            n,
            diagonal: vec![0.0; blocks * n * n],
            upper: vec![0.0; blocks * n * n],
        }
    }

    /// Block between `k` and `k + 1`.
    pub(super) fn upper(&self, k: usize) -> &[f64] {
        &self.upper[k * self.n * self.n..][..self.n * self.n]
    }

    /// H − σ 1.
    pub(super) fn shifted(&self, sigma: f64) -> Self {
        let (mut shifted, n) = (self.clone(), self.n);
        for (row, entries) in shifted.diagonal.chunks_exact_mut(n).enumerate() {
            entries[row % n] -= sigma;
        }
        shifted
    }

    fn largest(&self) -> f64 {
        let entries = self.diagonal.iter().chain(&self.upper);
        entries.fold(f64::MIN_POSITIVE, |largest, x| largest.max(x.abs()))
    }

    /// Bound of |λ| for all eigenvalues: a row has 3 n entries (Gershgorin).
    pub(super) fn bound(&self) -> f64 {
        3.0 * self.n as f64 * self.largest()
    }

    /// Factors H; a block that is singular to rounding is treated as barely positive.
    pub(super) fn factor(&self) -> Factored<'_> {
        let n = self.n;
        let smallest = f64::EPSILON * self.largest();
        let mut pivots: Vec<Pivot> = Vec::new();
        for (k, block) in self.diagonal.chunks_exact(n * n).enumerate() {
            let mut block = block.to_vec();
            if let Some(before) = pivots.last() {
                let upper = self.upper(k - 1);
                for j in 0..n {
                    let column: Vec<f64> = (0..n).map(|i| upper[i * n + j]).collect();
                    let solved = before.solve(&column);
                    for i in 0..n {
                        let product: f64 = (0..n).map(|l| upper[l * n + i] * solved[l]).sum();
                        block[i * n + j] -= product;
                    }
                }
            }
            pivots.push(Pivot::of(block, n, smallest));
        }
        Factored {
            matrix: self,
            pivots,
        }
    }
}

impl Pivot {
    /// Eigenvalues and eigenvectors of a block; each |eigenvalue| is at least `smallest`.
    fn of(block: Vec<f64>, n: usize, smallest: f64) -> Self {
        let mean = |ij: usize| 0.5 * (block[ij] + block[ij % n * n + ij / n]);
        let mut values: Vec<f64> = (0..n * n).map(mean).collect();
        let mut vectors = vec![0.0; n * n];
        diagonalise(&mut values, &mut vectors, n);
        let values = values.iter().step_by(n + 1);
        let values = values.map(|x| if x.abs() < smallest { smallest } else { *x });
        Self {
            values: values.collect(),
            block,
            vectors,
        }
    }

    /// Dₖ⁻¹ b.
    fn solve(&self, b: &[f64]) -> Vec<f64> {
        let mut x = vec![0.0; b.len()];
        for (v, value) in self.vectors.chunks_exact(b.len()).zip(&self.values) {
            let weight = dot(v, b) / value;
            x.iter_mut().zip(v).for_each(|(x, v)| *x += weight * v);
        }
        x
    }

    /// Number of negative eigenvalues.
    pub(super) fn negative(&self) -> usize {
        self.values.iter().filter(|x| **x < 0.0).count()
    }
}

impl Factored<'_> {
    /// Number of negative eigenvalues of H, the sum over all Dₖ (Sylvester).
    pub(super) fn inertia(&self) -> usize {
        self.pivots.iter().map(Pivot::negative).sum()
    }

    /// Replaces b by H⁻¹ b.
    pub(super) fn solve(&self, b: &mut [f64]) {
        let (n, count) = (self.matrix.n, self.pivots.len());
        for k in 1..count {
            let x = self.pivots[k - 1].solve(&b[(k - 1) * n..k * n]);
            let upper = self.matrix.upper(k - 1);
            for i in 0..n {
                b[k * n + i] -= (0..n).map(|l| upper[l * n + i] * x[l]).sum::<f64>();
            }
        }
        for k in (0..count).rev() {
            let (own, next) = b[k * n..].split_at_mut(n);
            if k + 1 < count {
                let rows = self.matrix.upper(k).chunks_exact(n);
                let pairs = own.iter_mut().zip(rows);
                pairs.for_each(|(x, row)| *x -= dot(row, &next[..n]));
            }
            own.copy_from_slice(&self.pivots[k].solve(own));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};

    fn random(n: usize, blocks: usize, shift: f64) -> (BlockTridiagonal, Vec<f64>) {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(7);
        let mut matrix = BlockTridiagonal::zeros(n, blocks);
        let size = n * blocks;
        let mut dense = vec![0.0; size * size];
        for k in 0..blocks {
            for i in 0..n {
                for j in 0..=i {
                    let x = rng.random_range(-1.0..1.0) + if i == j { shift } else { 0.0 };
                    for (i, j) in [(i, j), (j, i)] {
                        matrix.diagonal[(k * n + i) * n + j] = x;
                        dense[(k * n + i) * size + k * n + j] = x;
                    }
                }
                for j in 0..n {
                    let x = rng.random_range(-1.0..1.0);
                    matrix.upper[(k * n + i) * n + j] = x;
                    if k + 1 < blocks {
                        dense[(k * n + i) * size + (k + 1) * n + j] = x;
                        dense[((k + 1) * n + j) * size + k * n + i] = x;
                    }
                }
            }
        }
        (matrix, dense)
    }

    #[test]
    fn a_block_of_zeros_is_no_obstacle() {
        // (0 1; 1 0) along a chain: eigenvalues 2 cos(k π/(K + 1)), as many below 0 as above.
        let mut matrix = BlockTridiagonal::zeros(1, 8);
        matrix.upper.fill(1.0);
        assert_eq!(matrix.factor().inertia(), 4);
    }

    #[test]
    fn inertia_bound_and_solutions_are_those_of_the_dense_matrix() {
        for (n, shift) in [(1, 0.0), (2, 0.0), (3, 1.5), (3, -4.0)] {
            let (matrix, dense) = random(n, 12, shift);
            let size = 12 * n;
            let (mut a, mut vectors) = (dense.clone(), dense.clone());
            diagonalise(&mut a, &mut vectors, size);
            let values: Vec<f64> = (0..size).map(|i| a[i * size + i]).collect();
            let factored = matrix.factor();
            assert_eq!(
                factored.inertia(),
                values.iter().filter(|x| **x < 0.0).count()
            );
            let bound = matrix.bound();
            assert!(values.iter().all(|x| x.abs() <= bound));
            let b: Vec<f64> = (0..size).map(|i| (i as f64).sin()).collect();
            let mut x = b.clone();
            factored.solve(&mut x);
            for (row, b) in dense.chunks_exact(size).zip(&b) {
                assert!((dot(row, &x) - b).abs() < 1e-9);
            }
        }
    }
}
