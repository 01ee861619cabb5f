//! The weight matrices of a network as they lie in its parameters, and the products that preconditioners are made of.

use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatRef, Par, Side};

use nets::{Kind, Net};

/// A dense layer whose inputs stand side by side, its bias as the last column: W `[rows, columns]`.
#[derive(Debug, Clone)]
pub(super) struct Weights {
    /// Number of the layer.
    pub(super) layer: usize,
    pub(super) rows: usize,
    pub(super) columns: usize,
    /// Where each input begins in the parameters, and its width.
    inputs: Vec<(usize, usize)>,
    bias: Option<usize>,
}

/// All of them.
pub(super) fn weights(net: &Net) -> Vec<Weights> {
    let layers = net.layers.iter().enumerate();
    let of = |(layer, of): (usize, &nets::Layer)| match &of.kind {
        Kind::Dense { inputs, bias } => Some(Weights {
            layer,
            rows: of.width,
            columns: inputs.iter().map(|i| i.width).sum::<usize>() + usize::from(bias.is_some()),
            inputs: inputs.iter().map(|i| (i.at, i.width)).collect(),
            bias: *bias,
        }),
        Kind::Gate { .. } => None,
    };
    layers.filter_map(of).collect()
}

impl Weights {
    /// The matrix of these numbers, which lie as the parameters do.
    pub(super) fn read(&self, from: &[f64]) -> Mat<f64> {
        let mut matrix = Mat::zeros(self.rows, self.columns);
        self.each(|at, row, column| matrix[(row, column)] = from[at]);
        matrix
    }

    /// Writes it back.
    pub(super) fn write(&self, matrix: MatRef<f64>, to: &mut [f64]) {
        self.each(|at, row, column| to[at] = matrix[(row, column)]);
    }

    fn each(&self, mut f: impl FnMut(usize, usize, usize)) {
        let mut first = 0;
        for &(at, width) in &self.inputs {
            for row in 0..self.rows {
                for column in 0..width {
                    f(at + row * width + column, row, first + column);
                }
            }
            first += width;
        }
        if let Some(at) = self.bias {
            (0..self.rows).for_each(|row| f(at + row, row, first));
        }
    }
}

/// A B, on one thread.
pub(super) fn product(left: MatRef<f64>, right: MatRef<f64>) -> Mat<f64> {
    let mut out = Mat::zeros(left.nrows(), right.ncols());
    matmul(out.as_mut(), Accum::Replace, left, right, 1.0, Par::Seq);
    out
}

/// Turns `mean` into β mean + (1 − β) A B.
pub(super) fn remember(mean: &mut Mat<f64>, beta: f64, left: MatRef<f64>, right: MatRef<f64>) {
    *mean *= faer::Scale(beta);
    matmul(mean.as_mut(), Accum::Add, left, right, 1.0 - beta, Par::Seq);
}

/// Eigenvectors (columns) and eigenvalues of a symmetric matrix; none where it is not finite.
pub(super) fn eigen(matrix: &Mat<f64>) -> Option<(Mat<f64>, Vec<f64>)> {
    let found = matrix.self_adjoint_eigen(Side::Lower).ok()?;
    let values: Vec<f64> = (0..matrix.nrows()).map(|i| found.S()[i]).collect();
    let finite = values.iter().all(|x| x.is_finite());
    finite.then(|| (found.U().to_owned(), values))
}
