//! Symmetric block-tridiagonal matrices: H = L D Lᵀ in O(N), its inertia, and systems with it.

use lagrangian::mechanics::{diagonalise, dot};

/// K blocks of n × n on the diagonal, and blocks between neighbours; the upper block of the last row couples to what
/// follows and is no part of the matrix.
#[derive(Debug, Clone)]
pub(super) struct BlockTridiagonal {
    n: usize,
    diagonal: Vec<f64>,
    upper: Vec<f64>,
}

/// H = L D Lᵀ with Dₖ = Hₖₖ − Uₖ₋₁ᵀ Dₖ₋₁⁻¹ Uₖ₋₁ (theory.md, equation 76), each block as its eigenvalues
/// and eigenvectors.
#[derive(Debug, Clone)]
pub(super) struct Factored<'a> {
    matrix: &'a BlockTridiagonal,
    /// The Dₖ themselves, `[K, n, n]`.
    blocks: Vec<f64>,
    /// `[K, n]`.
    values: Vec<f64>,
    /// One eigenvector a row, `[K, n, n]`.
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

    pub(super) fn n(&self) -> usize {
        self.n
    }

    /// Number of blocks K.
    pub(super) fn blocks(&self) -> usize {
        self.diagonal.len() / (self.n * self.n)
    }

    pub(super) fn add_diagonal(&mut self, k: usize, i: usize, j: usize, x: f64) {
        self.diagonal[(k * self.n + i) * self.n + j] += x;
    }

    pub(super) fn set_upper(&mut self, k: usize, i: usize, j: usize, x: f64) {
        self.upper[(k * self.n + i) * self.n + j] = x;
    }

    /// The block between `k` and `k + 1`.
    pub(super) fn upper(&self, k: usize) -> &[f64] {
        &self.upper[k * self.n * self.n..][..self.n * self.n]
    }

    /// H − σ 1.
    pub(super) fn shifted(&self, sigma: f64) -> Self {
        let mut shifted = self.clone();
        for k in 0..self.blocks() {
            (0..self.n).for_each(|i| shifted.add_diagonal(k, i, i, -sigma));
        }
        shifted
    }

    /// Bounds of all eigenvalues (Gershgorin).
    pub(super) fn bounds(&self) -> (f64, f64) {
        let (n, count) = (self.n, self.blocks());
        let mut bounds = (f64::INFINITY, f64::NEG_INFINITY);
        for k in 0..count {
            for i in 0..n {
                let row = |x: &[f64], i: usize| -> f64 {
                    x[i * n..(i + 1) * n].iter().map(|x| x.abs()).sum()
                };
                let own = &self.diagonal[k * n * n..][..n * n];
                let center = own[i * n + i];
                let mut radius = row(own, i) - center.abs();
                if k + 1 < count {
                    radius += row(self.upper(k), i);
                }
                if k > 0 {
                    let before = self.upper(k - 1);
                    radius += (0..n).map(|j| before[j * n + i].abs()).sum::<f64>();
                }
                bounds = (bounds.0.min(center - radius), bounds.1.max(center + radius));
            }
        }
        bounds
    }

    /// Its factors; a block that is singular to rounding is taken as barely positive.
    pub(super) fn factor(&self) -> Factored<'_> {
        let n = self.n;
        let entries = self.diagonal.iter().chain(&self.upper);
        let smallest = f64::EPSILON * entries.fold(f64::MIN_POSITIVE, |s, x| s.max(x.abs()));
        let mut factored = Factored {
            matrix: self,
            blocks: self.diagonal.clone(),
            values: vec![0.0; self.blocks() * n],
            vectors: vec![0.0; self.diagonal.len()],
        };
        let mut solved = vec![0.0; n];
        for k in 0..self.blocks() {
            if k > 0 {
                let upper = self.upper(k - 1);
                for j in 0..n {
                    let column: Vec<f64> = (0..n).map(|i| upper[i * n + j]).collect();
                    factored.solve_block(k - 1, &column, &mut solved);
                    for i in 0..n {
                        let product: f64 = (0..n).map(|l| upper[l * n + i] * solved[l]).sum();
                        factored.blocks[(k * n + i) * n + j] -= product;
                    }
                }
            }
            factored.diagonalise(k, smallest);
        }
        factored
    }
}

impl Factored<'_> {
    /// The eigenvalues of block `k`, none smaller than `smallest`.
    fn diagonalise(&mut self, k: usize, smallest: f64) {
        let n = self.matrix.n;
        let size = n * n;
        let mut block = self.blocks[k * size..][..size].to_vec();
        for i in 0..n {
            for j in 0..i {
                let mean = 0.5 * (block[i * n + j] + block[j * n + i]);
                (block[i * n + j], block[j * n + i]) = (mean, mean);
            }
        }
        diagonalise(&mut block, &mut self.vectors[k * size..][..size], n);
        for i in 0..n {
            let value = block[i * n + i];
            let small = value.abs() < smallest;
            self.values[k * n + i] = if small { smallest } else { value };
        }
    }

    /// Dₖ⁻¹ b.
    fn solve_block(&self, k: usize, b: &[f64], x: &mut [f64]) {
        let n = self.matrix.n;
        x.fill(0.0);
        for i in 0..n {
            let v = &self.vectors[(k * n + i) * n..][..n];
            let weight = dot(v, b) / self.values[k * n + i];
            x.iter_mut().zip(v).for_each(|(x, v)| *x += weight * v);
        }
    }

    /// Dₖ, `[n, n]`.
    pub(super) fn block(&self, k: usize) -> &[f64] {
        let size = self.matrix.n * self.matrix.n;
        &self.blocks[k * size..][..size]
    }

    /// Negative eigenvalues of Dₖ; their sum over k is that of H (Sylvester).
    pub(super) fn negative(&self, k: usize) -> usize {
        let n = self.matrix.n;
        let values = &self.values[k * n..][..n];
        values.iter().filter(|x| **x < 0.0).count()
    }

    /// Negative eigenvalues of H.
    pub(super) fn inertia(&self) -> usize {
        self.values.iter().filter(|x| **x < 0.0).count()
    }

    /// Replaces b by H⁻¹ b.
    pub(super) fn solve(&self, b: &mut [f64]) {
        let (n, count) = (self.matrix.n, self.matrix.blocks());
        let mut x = vec![0.0; n];
        for k in 1..count {
            self.solve_block(k - 1, &b[(k - 1) * n..k * n], &mut x);
            let upper = self.matrix.upper(k - 1);
            for i in 0..n {
                b[k * n + i] -= (0..n).map(|l| upper[l * n + i] * x[l]).sum::<f64>();
            }
        }
        for k in (0..count).rev() {
            if k + 1 < count {
                let upper = self.matrix.upper(k);
                for i in 0..n {
                    let next = &b[(k + 1) * n..(k + 2) * n];
                    let coupled = dot(&upper[i * n..(i + 1) * n], next);
                    b[k * n + i] -= coupled;
                }
            }
            self.solve_block(k, &b[k * n..(k + 1) * n], &mut x);
            b[k * n..(k + 1) * n].copy_from_slice(&x);
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
                    matrix.set_upper(k, i, j, x);
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
        (0..8).for_each(|k| matrix.set_upper(k, 0, 0, 1.0));
        assert_eq!(matrix.factor().inertia(), 4);
    }

    #[test]
    fn inertia_bounds_and_solutions_are_those_of_the_dense_matrix() {
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
            let (low, high) = matrix.bounds();
            assert!(values.iter().all(|x| (low..=high).contains(x)));
            let b: Vec<f64> = (0..size).map(|i| (i as f64).sin()).collect();
            let mut x = b.clone();
            factored.solve(&mut x);
            for (row, b) in dense.chunks_exact(size).zip(&b) {
                assert!((dot(row, &x) - b).abs() < 1e-9);
            }
        }
    }
}
