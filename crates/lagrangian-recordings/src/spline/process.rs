//! An interpolating spline on uneven stamps, through values and, where known, rates.
//!
//! It is the mean of an integrated Wiener process (Wahba, J. R. Statist. Soc. B 40, 1978), here of intensity [`INTENSITY`] per step beside
//! observations of variance 1. In units h of time the state at a sample is x = (q, h q̇, …, hᵖ q⁽ᵖ⁾); over a step of d units x' = A(d) x + u with
//! Aᵢⱼ = dʲ⁻ⁱ/(j − i)! and Cov u ∝ Q(d), Qᵢⱼ = d²ᵖ⁺¹⁻ⁱ⁻ʲ/((2p + 1 − i − j)(p − i)!(p − j)!). Observations and steps are rows of one least-squares problem, which
//! reflections solve sample by sample (Paige and Saunders, SIAM J. Numer. Anal. 14, 1977): no covariance is subtracted from another.

/// Variance of the p-th derivative's change in a step: far above the observations', so that the spline interpolates.
const INTENSITY: f64 = 1e7;

/// A square matrix.
type Matrix<const N: usize> = [[f64; N]; N];

/// The largest state, of order 5.
const LARGEST: usize = 6;
/// A row of the problem at one step: two states and the right-hand side.
type Row = [f64; 2 * LARGEST + 1];

/// The process with N = p + 1 components of the state.
struct Process<const N: usize> {
    /// G with `GᵀG` = Cov(u)⁻¹ for a step of length 1, lower triangular.
    root: Matrix<N>,
}

/// One length of a step: G(d) and G(d) A(d).
#[derive(Clone, Copy)]
struct Step<const N: usize> {
    length: f64,
    root: Matrix<N>,
    moved: Matrix<N>,
}

impl<const N: usize> Step<N> {
    /// This step where it has the length, else a new one.
    fn or_new(self, process: &Process<N>, length: f64) -> Self {
        match self.length.to_bits() == length.to_bits() {
            true => self,
            false => process.step(length),
        }
    }
}

fn factorial(n: usize) -> f64 {
    (1..=n).map(|k| k as f64).product()
}

impl<const N: usize> Process<N> {
    fn new() -> Self {
        let covariance = |i: usize, j: usize| {
            let degree = 2 * N - 1 - i - j;
            INTENSITY / (degree as f64 * factorial(N - 1 - i) * factorial(N - 1 - j))
        };
        let mut lower = [[0.0; N]; N];
        for i in 0..N {
            for j in 0..=i {
                let sum: f64 = (0..j).map(|k| lower[i][k] * lower[j][k]).sum();
                let rest = covariance(i, j) - sum;
                lower[i][j] = if i == j {
                    rest.sqrt()
                } else {
                    rest / lower[j][j]
                };
            }
        }
        let mut root = [[0.0; N]; N];
        for (i, lower) in lower.iter().enumerate() {
            let mut row: [f64; N] = std::array::from_fn(|j| f64::from(i == j));
            for (factor, above) in lower.iter().zip(&root).take(i) {
                row.iter_mut()
                    .zip(above)
                    .for_each(|(x, y)| *x -= factor * y);
            }
            root[i] = row.map(|x| x / lower[i]);
        }
        Self { root }
    }

    fn step(&self, length: f64) -> Step<N> {
        let mut step = Step {
            length,
            root: self.root,
            moved: [[0.0; N]; N],
        };
        // Q(d) = D Q(1) D with the diagonal D = dᵖ⁻ʲ⁺½.
        let mut scale = length.sqrt();
        for j in (0..N).rev() {
            step.root.iter_mut().for_each(|row| row[j] /= scale);
            scale *= length;
        }
        for (row, moved) in step.root.iter().zip(&mut step.moved) {
            for (j, moved) in moved.iter_mut().enumerate() {
                let mut power = 1.0;
                for k in (0..=j).rev() {
                    *moved += row[k] * power;
                    power *= length / (j - k + 1) as f64;
                }
            }
        }
        step
    }
}

/// Makes the first columns of `rows` upper triangular by reflections: the first `triangle` rows already are, and have as many
/// columns; rows are `width` long.
fn triangularise(rows: &mut [Row], triangle: usize, columns: usize, width: usize) {
    let (upper, lower) = rows.split_at_mut(triangle);
    for c in 0..columns.min(upper.len() + lower.len()) {
        let (pivot, lower) = match c < upper.len() {
            true => (&mut upper[c], &mut *lower),
            false => {
                let (pivot, lower) = lower[c - upper.len()..].split_at_mut(1);
                (&mut pivot[0], lower)
            }
        };
        let below: f64 = lower.iter().map(|row| row[c] * row[c]).sum();
        if below <= 0.0 {
            continue;
        }
        let norm = (pivot[c] * pivot[c] + below).sqrt().copysign(-pivot[c]);
        let head = pivot[c] - norm;
        let factor = 2.0 / (head * head + below);
        let mut dots = [0.0; 2 * LARGEST + 1];
        for j in c + 1..width {
            dots[j] = head * pivot[j];
        }
        for row in &*lower {
            for j in c + 1..width {
                dots[j] += row[c] * row[j];
            }
        }
        for j in c + 1..width {
            pivot[j] -= factor * head * dots[j];
        }
        pivot[c] = norm;
        for row in lower {
            let scale = factor * row[c];
            for j in c + 1..width {
                row[j] -= scale * dots[j];
            }
            row[c] = 0.0;
        }
    }
}

/// A step of the factorisation: R x + S x' = z in the mean, with unit covariance.
struct Kept<const N: usize> {
    own: Matrix<N>,
    next: Matrix<N>,
    z: [f64; N],
}

/// The samples so far: R x = z in the mean, with unit covariance.
struct Forward<const N: usize> {
    kept: Vec<Kept<N>>,
    r: Matrix<N>,
    z: [f64; N],
}

impl<const N: usize> Forward<N> {
    /// Goes over one step, whose first state is eliminated, to a sample's value and rate.
    fn advance(&mut self, step: &Step<N>, value: f64, rate: Option<f64>) {
        let mut rows = [Row::default(); 2 * LARGEST];
        let (known, steps) = rows.split_at_mut(N);
        for (row, (r, z)) in known.iter_mut().zip(self.r.iter().zip(&self.z)) {
            row[..N].copy_from_slice(r);
            row[2 * N] = *z;
        }
        for (row, (root, moved)) in steps.iter_mut().zip(step.root.iter().zip(&step.moved)) {
            row[..N].copy_from_slice(&moved.map(|x| -x));
            row[N..2 * N].copy_from_slice(root);
        }
        triangularise(&mut rows[..2 * N], N, N, 2 * N + 1);
        let part = |i: usize, from: usize| std::array::from_fn(|j| rows[i][from + j]);
        self.kept.push(Kept {
            own: std::array::from_fn(|i| part(i, 0)),
            next: std::array::from_fn(|i| part(i, N)),
            z: std::array::from_fn(|i| rows[i][2 * N]),
        });
        let mut rest = [Row::default(); LARGEST + 2];
        for i in 0..N {
            rest[i][..=N].copy_from_slice(&rows[N + i][N..=2 * N]);
        }
        self.absorb(rest, value, rate);
    }

    /// Adds a sample to the `N` rows that tell what the others imply for it.
    fn absorb(&mut self, mut rows: [Row; LARGEST + 2], value: f64, rate: Option<f64>) {
        let seen = [Some(value), rate].into_iter().enumerate();
        let mut count = N;
        for (column, y) in seen.filter_map(|(column, y)| Some((column, y?))) {
            rows[count][column] = 1.0;
            rows[count][N] = y;
            count += 1;
        }
        triangularise(&mut rows[..count], 0, N, N + 1);
        for ((r, z), row) in self.r.iter_mut().zip(&mut self.z).zip(&rows) {
            r.copy_from_slice(&row[..N]);
            *z = row[N];
        }
    }
}

/// The state at a sample, and the part of its value that the value itself decides.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Knot {
    pub(super) state: [f64; 3],
    pub(super) leverage: f64,
}

/// The spline of degree 2N − 1 at all samples; `steps` are the `len − 1` lengths between them, in units of time, and rates are per
/// unit of time. There are more samples than N.
pub(super) fn spline<const N: usize>(
    steps: &[f64],
    values: &[f64],
    rates: Option<&[f64]>,
) -> Vec<Knot> {
    let process = Process::<N>::new();
    let rate = |k: usize| rates.map(|rates| rates[k]);
    let mut forward = Forward {
        kept: Vec::with_capacity(steps.len()),
        r: [[0.0; N]; N],
        z: [0.0; N],
    };
    forward.absorb([Row::default(); LARGEST + 2], values[0], rate(0));
    let mut step = process.step(1.0);
    for (k, length) in steps.iter().enumerate() {
        step = step.or_new(&process, *length);
        forward.advance(&step, values[k + 1], rate(k + 1));
    }
    forward.back()
}

impl<const N: usize> Forward<N> {
    /// Goes back through the samples.
    fn back(self) -> Vec<Knot> {
        let mut state = self.z;
        back(&self.r, &mut state);
        let root = inverse(&self.r);
        let mut covariance = product(&root, &transposed(&root));
        let knot = |state: &[f64; N], covariance: &Matrix<N>| Knot {
            state: std::array::from_fn(|i| state[i]),
            leverage: covariance[0][0],
        };
        let mut out = vec![knot(&state, &covariance)];
        for kept in self.kept.iter().rev() {
            let passed: [f64; N] =
                std::array::from_fn(|i| kept.next[i].iter().zip(&state).map(|(a, x)| a * x).sum());
            state = std::array::from_fn(|i| kept.z[i] - passed[i]);
            back(&kept.own, &mut state);
            let inverse = inverse(&kept.own);
            let gain = product(&inverse, &kept.next);
            let own = product(&inverse, &transposed(&inverse));
            let ahead = product(&product(&gain, &covariance), &transposed(&gain));
            covariance = std::array::from_fn(|i| std::array::from_fn(|j| own[i][j] + ahead[i][j]));
            out.push(knot(&state, &covariance));
        }
        out.reverse();
        out
    }
}

/// Solves R x = b for an upper triangle, in place.
fn back<const N: usize>(r: &Matrix<N>, b: &mut [f64; N]) {
    for i in (0..N).rev() {
        let known: f64 = (i + 1..N).map(|j| r[i][j] * b[j]).sum();
        b[i] = (b[i] - known) / r[i][i];
    }
}

/// The inverse of an upper triangle.
fn inverse<const N: usize>(r: &Matrix<N>) -> Matrix<N> {
    let columns: Matrix<N> = std::array::from_fn(|c| {
        let mut unit = std::array::from_fn(|i| f64::from(i == c));
        back(r, &mut unit);
        unit
    });
    transposed(&columns)
}

fn transposed<const N: usize>(a: &Matrix<N>) -> Matrix<N> {
    std::array::from_fn(|i| std::array::from_fn(|j| a[j][i]))
}

fn product<const N: usize>(a: &Matrix<N>, b: &Matrix<N>) -> Matrix<N> {
    let mut out = [[0.0; N]; N];
    for (out, a) in out.iter_mut().zip(a) {
        for (a, b) in a.iter().zip(b) {
            for (out, b) in out.iter_mut().zip(b) {
                *out += a * b;
            }
        }
    }
    out
}
