//! A coordinate as an integrated Wiener process, smoothed with its covariance.
//!
//! The p-th derivative of the coordinate is a Wiener process with intensity w. In units h of time the state at a sample is x = (q, h q̇, …, hᵖ q⁽ᵖ⁾);
//! over a step of d units x' = A(d) x + u, Aᵢⱼ = dʲ⁻ⁱ/(j − i)!, and Cov u = w Q(d), Qᵢⱼ = d²ᵖ⁺¹⁻ⁱ⁻ʲ/((2p + 1 − i − j)(p − i)!(p − j)!).
//! The mean is the smoothing spline of degree 2p + 1 (Wahba, J. R. Statist. Soc. B 40, 1978). Observations and steps are rows of one least-squares problem, which reflections solve
//! sample by sample (Paige and Saunders, SIAM J. Numer. Anal. 14, 1977): no covariance is subtracted from another, and steps may be uneven.

#![allow(
    clippy::needless_range_loop,
    reason = "indices of matrices read as in their formulas"
)]

/// Values of the coordinate or its rate at a sample, each over its standard deviation, with the inverse of that.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Observation {
    pub(super) value: Option<(f64, f64)>,
    pub(super) rate: Option<(f64, f64)>,
}

/// A square matrix.
type Matrix<const N: usize> = [[f64; N]; N];

/// The largest state, of order 5.
const LARGEST: usize = 6;
/// A row of the problem at one step: two states, the right-hand side, and zeros.
type Row = [f64; 16];

/// The process with N = p + 1 components of the state.
pub(super) struct Process<const N: usize> {
    /// G with `GᵀG` = Q(1)⁻¹, lower triangular.
    root: Matrix<N>,
    log_determinant: f64,
}

/// One length of a step: G(d), G(d) A(d) and ln |G(d)|, for intensity 1.
#[derive(Clone, Copy)]
struct Step<const N: usize> {
    length: f64,
    root: Matrix<N>,
    moved: Matrix<N>,
    log_determinant: f64,
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
    pub(super) fn new() -> Self {
        let covariance = |i: usize, j: usize| {
            let degree = 2 * N - 1 - i - j;
            1.0 / (degree as f64 * factorial(N - 1 - i) * factorial(N - 1 - j))
        };
        let mut lower = [[0.0; N]; N];
        for i in 0..N {
            for j in 0..=i {
                let sum: f64 = (0..j).map(|k| lower[i][k] * lower[j][k]).sum();
                let rest = covariance(i, j) - sum;
                lower[i][j] = match i == j {
                    true => rest.sqrt(),
                    false => rest / lower[j][j],
                };
            }
        }
        let mut root = [[0.0; N]; N];
        for column in 0..N {
            for i in column..N {
                let sum: f64 = (column..i).map(|k| lower[i][k] * root[k][column]).sum();
                root[i][column] = (f64::from(i == column) - sum) / lower[i][i];
            }
        }
        let log_determinant = (0..N).map(|i| root[i][i].ln()).sum();
        Self {
            root,
            log_determinant,
        }
    }

    fn step(&self, length: f64) -> Step<N> {
        let mut step = Step {
            length,
            root: self.root,
            moved: [[0.0; N]; N],
            log_determinant: self.log_determinant,
        };
        // Q(d) = D Q(1) D with the diagonal D = dᵖ⁻ʲ⁺½.
        let mut scale = length.sqrt();
        for j in (0..N).rev() {
            step.log_determinant -= scale.ln();
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
    // Loops of a length that is known are done several columns at a time.
    match width.div_ceil(4) {
        1 => reflect::<4>(rows, triangle, columns),
        2 => reflect::<8>(rows, triangle, columns),
        3 => reflect::<12>(rows, triangle, columns),
        _ => reflect::<16>(rows, triangle, columns),
    }
}

/// As [`triangularise`] of rows of length `W`. What is left of the diagonal is zero, and stays so.
fn reflect<const W: usize>(rows: &mut [Row], triangle: usize, columns: usize) {
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
        let mut dots = [0.0; W];
        for j in 0..W {
            dots[j] = head * pivot[j];
        }
        for row in &*lower {
            let own = row[c];
            for j in 0..W {
                dots[j] += own * row[j];
            }
        }
        let scale = factor * head;
        for j in 0..W {
            pivot[j] -= scale * dots[j];
        }
        pivot[c] = norm;
        for row in lower {
            let scale = factor * row[c];
            for j in 0..W {
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
pub(super) struct Forward<const N: usize> {
    kept: Vec<Kept<N>>,
    r: Matrix<N>,
    z: [f64; N],
    chi_squared: f64,
    log_determinant: f64,
    /// Errors of the samples as those before them predict them, over their deviations; zeros while the state is unknown.
    pub(super) innovations: Vec<f64>,
}

impl<const N: usize> Forward<N> {
    /// ln p of the observations without a constant, for a flat prior of the first state.
    pub(super) fn log_likelihood(&self) -> f64 {
        let last: f64 = (0..N).map(|i| self.r[i][i].abs().ln()).sum();
        self.log_determinant - last - 0.5 * self.chi_squared
    }

    /// Squared residuals, and ln p without them.
    pub(super) fn parts(&self) -> (f64, f64) {
        (
            self.chi_squared,
            self.log_likelihood() + 0.5 * self.chi_squared,
        )
    }

    /// Goes over one step, whose first state is eliminated; writes what is known of its second one. `link` is the
    /// difference of two samples whose noise is correlated: the factors of both, and the right-hand side.
    fn advance(
        &mut self,
        step: &Step<N>,
        log_w: f64,
        link: Option<[f64; 3]>,
        rest: &mut [Row; LARGEST + 2],
    ) -> Kept<N> {
        let scale = (-0.5 * log_w).exp();
        let mut rows = [Row::default(); 2 * LARGEST + 1];
        for i in 0..N {
            rows[i][..N].copy_from_slice(&self.r[i]);
            rows[i][2 * N] = self.z[i];
            for j in 0..N {
                rows[N + i][j] = -step.moved[i][j] * scale;
                rows[N + i][N + j] = step.root[i][j] * scale;
            }
        }
        let last = 2 * N + usize::from(link.is_some());
        if let Some([own, next, y]) = link {
            (rows[2 * N][0], rows[2 * N][N], rows[2 * N][2 * N]) = (own, next, y);
            self.log_determinant += next.ln();
        }
        triangularise(&mut rows[..last], N, N, 2 * N + 1);
        let part = |i: usize, from: usize| std::array::from_fn(|j| rows[i][from + j]);
        let eliminated: f64 = (0..N).map(|i| rows[i][i].abs().ln()).sum();
        self.log_determinant += step.log_determinant - 0.5 * N as f64 * log_w - eliminated;
        for i in 0..last - N {
            rest[i][..=N].copy_from_slice(&rows[N + i][N..=2 * N]);
        }
        Kept {
            own: std::array::from_fn(|i| part(i, 0)),
            next: std::array::from_fn(|i| part(i, N)),
            z: std::array::from_fn(|i| rows[i][2 * N]),
        }
    }

    /// Adds a sample to the first `count` rows, which say what the others imply for it.
    fn absorb(
        &mut self,
        rows: &mut [Row; LARGEST + 2],
        mut count: usize,
        observation: &Observation,
    ) {
        for (column, seen) in [observation.value, observation.rate]
            .into_iter()
            .enumerate()
        {
            if let Some((y, inverse)) = seen {
                rows[count] = Row::default();
                rows[count][column] = inverse;
                rows[count][N] = y;
                self.log_determinant += inverse.ln();
                count += 1;
            }
        }
        triangularise(&mut rows[..count], 0, N, N + 1);
        for i in 0..N {
            self.r[i].copy_from_slice(&rows[i][..N]);
            self.z[i] = rows[i][N];
        }
        let innovations = rows[N..count].iter().map(|row| row[N]);
        self.chi_squared += innovations.clone().map(|e| e * e).sum::<f64>();
        self.innovations.extend(innovations);
    }
}

/// What a smoother takes: the lengths of the steps `[len − 1]` in units of time, the samples `[len]`, and ln w of each step.
#[derive(Clone, Copy)]
pub(super) struct Problem<'a> {
    pub(super) steps: &'a [f64],
    pub(super) observations: &'a [Observation],
    /// Correlation of the noise of two values that are one unit of time apart.
    pub(super) memory: f64,
}

impl Problem<'_> {
    /// The value of sample `k` less what the noise of the one before tells of its own, over what is left of that.
    fn link(&self, k: usize) -> Option<[f64; 3]> {
        let [before, own] = [k - 1, k].map(|k| self.observations[k].value);
        let ((y, inverse), (next, inverse_of_next)) = (before?, own?);
        let memory = self.memory.powf(self.steps[k - 1]);
        let rest = (1.0 - memory * memory).sqrt();
        let link = [-memory * inverse, inverse_of_next, next - memory * y];
        Some(link.map(|x| x / rest))
    }

    /// Goes through the samples; `keep` stores what the way back needs.
    pub(super) fn forward<const N: usize>(
        self,
        process: &Process<N>,
        log_w: impl Fn(usize) -> f64,
        keep: bool,
    ) -> Forward<N> {
        let mut out = Forward {
            kept: Vec::with_capacity(if keep { self.steps.len() } else { 0 }),
            r: [[0.0; N]; N],
            z: [0.0; N],
            chi_squared: 0.0,
            log_determinant: 0.0,
            innovations: Vec::new(),
        };
        let mut step = process.step(1.0);
        for (k, observation) in self.observations.iter().enumerate() {
            let (mut rest, mut own) = ([Row::default(); LARGEST + 2], *observation);
            let mut count = N;
            if k > 0 {
                step = step.or_new(process, self.steps[k - 1]);
                let link = (self.memory > 0.0).then(|| self.link(k)).flatten();
                if link.is_some() {
                    (own.value, count) = (None, N + 1);
                }
                let kept = out.advance(&step, log_w(k - 1), link, &mut rest);
                if keep {
                    out.kept.push(kept);
                }
            }
            out.absorb(&mut rest, count, &own);
        }
        out
    }

    /// Goes back through the samples, after `forward` with the same intensities.
    pub(super) fn backward<const N: usize>(
        self,
        process: &Process<N>,
        forward: &Forward<N>,
        log_w: impl Fn(usize) -> f64,
    ) -> Smoothed<N> {
        let mut state = forward.z;
        back(&forward.r, &mut state);
        let root = inverse(&forward.r);
        let mut covariance = product(&root, &transposed(&root));
        let mut out = Smoothed {
            states: vec![(state, covariance)],
            steps: Vec::with_capacity(self.steps.len()),
        };
        let mut step = process.step(1.0);
        for (k, kept) in forward.kept.iter().enumerate().rev() {
            step = step.or_new(process, self.steps[k]);
            let inverse = inverse(&kept.own);
            let next = (state, covariance);
            let passed = times(&kept.next, &next.0);
            state = std::array::from_fn(|i| kept.z[i] - passed[i]);
            back(&kept.own, &mut state);
            // x = T x' + R⁻¹ ε up to the mean, ε of unit covariance.
            let gain = product(&inverse, &kept.next);
            covariance = sum(
                &product(&inverse, &transposed(&inverse)),
                &product(&product(&gain, &next.1), &transposed(&gain)),
            );
            out.states.push((state, covariance));
            // G (x' − A x) = (G + G A T) x' − G A R⁻¹ ε.
            let scale = (-0.5 * log_w(k)).exp();
            let (ahead, behind) = (times(&step.root, &next.0), times(&step.moved, &state));
            let mean: [f64; N] = std::array::from_fn(|i| scale * (ahead[i] - behind[i]));
            let follow = sum(&step.root, &product(&step.moved, &gain));
            let own = product(&step.moved, &inverse);
            let spread = sum(
                &product(&product(&follow, &next.1), &transposed(&follow)),
                &product(&own, &transposed(&own)),
            );
            out.steps.push(StepFit::new(&mean, &spread, scale * scale));
        }
        out.states.reverse();
        out.steps.reverse();
        out
    }
}

/// Means and covariances of all states, and what each step says of its intensity.
pub(super) struct Smoothed<const N: usize> {
    pub(super) states: Vec<([f64; N], Matrix<N>)>,
    pub(super) steps: Vec<StepFit>,
}

/// The derivative of ln p by ln w of one step, and its Fisher information.
#[derive(Debug, Clone, Copy)]
pub(super) struct StepFit {
    pub(super) slope: f64,
    pub(super) information: f64,
}

impl StepFit {
    /// From the mean of G u and its covariance for intensity 1 over `scale`: ½ (E|e|² − N) and ½ |1 − C|².
    fn new<const N: usize>(mean: &[f64; N], spread: &Matrix<N>, scale: f64) -> Self {
        let (mut power, mut information) = (0.0, 0.0);
        for i in 0..N {
            power += mean[i] * mean[i] + scale * spread[i][i];
            for j in 0..N {
                information += (f64::from(i == j) - scale * spread[i][j]).powi(2);
            }
        }
        Self {
            slope: 0.5 * (power - N as f64),
            information: 0.5 * information,
        }
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

fn times<const N: usize>(a: &Matrix<N>, x: &[f64; N]) -> [f64; N] {
    std::array::from_fn(|i| a[i].iter().zip(x).map(|(a, x)| a * x).sum())
}

fn sum<const N: usize>(a: &Matrix<N>, b: &Matrix<N>) -> Matrix<N> {
    std::array::from_fn(|i| std::array::from_fn(|j| a[i][j] + b[i][j]))
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
