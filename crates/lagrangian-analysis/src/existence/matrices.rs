//! Small square matrices, row-major `[n, n]`.

use lagrangian::mechanics::product;

/// An orthonormal basis of the symmetric matrices.
pub(super) fn basis(n: usize) -> Vec<Vec<f64>> {
    let pairs = (0..n).flat_map(|i| (i..n).map(move |j| (i, j)));
    let one = |(i, j): (usize, usize)| {
        let mut g = vec![0.0; n * n];
        let weight = if i == j { 1.0 } else { 0.5_f64.sqrt() };
        (g[i * n + j], g[j * n + i]) = (weight, weight);
        g
    };
    pairs.map(one).collect()
}

/// gP − (gP)ᵀ.
pub(super) fn skew_part(n: usize, g: &[f64], p: &[f64]) -> Vec<f64> {
    let gp = product(g, p, n);
    (0..n * n)
        .map(|at| gp[at] - gp[at % n * n + at / n])
        .collect()
}

/// The unit matrix.
pub(super) fn identity(n: usize) -> Vec<f64> {
    (0..n * n)
        .map(|at| f64::from(u8::from(at / n == at % n)))
        .collect()
}
