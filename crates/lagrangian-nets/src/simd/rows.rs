//! Products of one state with the weights of a dense layer, in double precision.
//!
//! A state consists of a few rows, its value and some tangents. The weights are read once for all of them, and for forward and
//! reverse passes from the same panels, `[panels, terms, 8]`: forward, one term at a time for eight units; backward, eight
//! terms at a time summed over the units. Thus the weights of a layer of 64 units stay in the first-level cache, unlike the
//! two copies that [`Gemm`](super::Gemm) reads.

use super::{Arithmetic, Isa, Memory};

/// Number of values in a vector of f64.
const LANES: usize = 8;

/// Weights of a layer in panels of its units.
#[derive(Clone, Copy)]
pub(crate) struct Weights<'a> {
    /// Panel p, term k, unit u of the panel at `(p · terms + k) · 8 + u`.
    pub panels: &'a [f64],
    /// Number of values that a unit reads.
    pub terms: usize,
}

impl Weights<'_> {
    /// Number of panels of units.
    #[inline(always)]
    pub(crate) fn count(&self) -> usize {
        self.panels.len() / (self.terms * LANES).max(1)
    }

    /// Weights of term `k` in panel `p`.
    #[inline(always)]
    pub(crate) fn column<I: Isa>(&self, p: usize, k: usize) -> I::F64 {
        I::F64::load(&self.panels[(p * self.terms + k) * LANES..])
    }
}

/// Rows at a distance of `stride` values.
pub(crate) struct Rows<S> {
    pub values: S,
    pub stride: usize,
}

/// z = a W, and the bias in row 0, for `count` rows.
#[inline(always)]
pub(crate) fn product<I: Isa>(
    a: &Rows<&[f64]>,
    w: Weights<'_>,
    bias: &[f64],
    z: &mut Rows<&mut [f64]>,
    count: usize,
) {
    let panels = w.count();
    if count == 0 || panels == 0 {
        return;
    }
    assert!((count - 1) * a.stride + w.terms <= a.values.len());
    assert!((count - 1) * z.stride + panels * LANES <= z.values.len());
    assert!(panels * w.terms * LANES <= w.panels.len() && panels * LANES <= bias.len());
    // As many sums as fit in registers, and few enough rows that several panels are summed at a time.
    let chunk = count.div_ceil(count.div_ceil(5));
    let mut r = 0;
    while r < count {
        let rows = chunk.min(count - r);
        let mut p = 0;
        while p < panels {
            let left = panels - p;
            // SAFETY: the assertions: all rows and panels are inside the slices.
            p += unsafe {
                match (rows, left) {
                    (1, 8..) => tile::<I, 1, 8>(a, w, bias, z, (r, p)),
                    (1, 4..) => tile::<I, 1, 4>(a, w, bias, z, (r, p)),
                    (1, 2..) => tile::<I, 1, 2>(a, w, bias, z, (r, p)),
                    (1, _) => tile::<I, 1, 1>(a, w, bias, z, (r, p)),
                    (2, 8..) if I::TILE_PANELS == 2 => tile::<I, 2, 8>(a, w, bias, z, (r, p)),
                    (2, 2..) => tile::<I, 2, 2>(a, w, bias, z, (r, p)),
                    (2, _) => tile::<I, 2, 1>(a, w, bias, z, (r, p)),
                    (3, 4..) if I::TILE_PANELS == 2 => tile::<I, 3, 4>(a, w, bias, z, (r, p)),
                    (3, _) => tile::<I, 3, 1>(a, w, bias, z, (r, p)),
                    (4, 4..) if I::TILE_PANELS == 2 => tile::<I, 4, 4>(a, w, bias, z, (r, p)),
                    (4, _) => tile::<I, 4, 1>(a, w, bias, z, (r, p)),
                    (_, 4..) if I::TILE_PANELS == 2 => tile::<I, 5, 4>(a, w, bias, z, (r, p)),
                    (_, _) => tile::<I, 5, 1>(a, w, bias, z, (r, p)),
                }
            };
        }
        r += rows;
    }
}

/// Computes R rows of P panels in registers; returns P.
#[inline(always)]
unsafe fn tile<I: Isa, const R: usize, const P: usize>(
    a: &Rows<&[f64]>,
    w: Weights<'_>,
    bias: &[f64],
    z: &mut Rows<&mut [f64]>,
    (r, p): (usize, usize),
) -> usize {
    // SAFETY: the caller's, for every pointer below.
    unsafe {
        let panel = w.terms * LANES;
        let mut sum = [[I::F64::splat(0.0); P]; R];
        if r == 0 {
            for (j, sum) in sum[0].iter_mut().enumerate() {
                *sum = I::F64::load_ptr(bias.as_ptr().add((p + j) * LANES));
            }
        }
        let mut x = a.values.as_ptr().add(r * a.stride);
        let mut y = w.panels.as_ptr().add(p * panel);
        for _ in 0..w.terms {
            let mut weight = [I::F64::splat(0.0); P];
            for (j, weight) in weight.iter_mut().enumerate() {
                *weight = I::F64::load_ptr(y.add(j * panel));
            }
            for (i, row) in sum.iter_mut().enumerate() {
                let x = I::F64::splat(*x.add(i * a.stride));
                for (sum, weight) in row.iter_mut().zip(weight) {
                    *sum = x.fma(weight, *sum);
                }
            }
            x = x.add(1);
            y = y.add(LANES);
        }
        let out = z.values.as_mut_ptr().add(r * z.stride + p * LANES);
        for (i, row) in sum.iter().enumerate() {
            for (j, sum) in row.iter().enumerate() {
                sum.store_ptr(out.add(i * z.stride + j * LANES));
            }
        }
    }
    P
}

/// x = W y, for `y` with a value for each unit. `x` has a value for each term, padded to whole vectors; the padding is
/// overwritten with arbitrary values.
#[inline(always)]
pub(crate) fn pull<I: Isa>(w: Weights<'_>, y: &[f64], x: &mut [f64]) {
    let panels = w.count();
    assert!(panels * LANES <= y.len() && w.terms.next_multiple_of(LANES) <= x.len());
    assert!(panels * w.terms * LANES <= w.panels.len());
    for first in (0..w.terms).step_by(LANES) {
        let mut sums = [I::F64::splat(0.0); LANES];
        let full = first + LANES <= w.terms;
        for p in 0..panels {
            // SAFETY: the assertions.
            unsafe {
                let y = I::F64::load_ptr(y.as_ptr().add(p * LANES));
                let weight = w.panels.as_ptr().add((p * w.terms + first) * LANES);
                for (k, sum) in sums.iter_mut().enumerate() {
                    // The padding of the last vector repeats its last term.
                    let k = if full { k } else { k.min(w.terms - first - 1) };
                    *sum = I::F64::load_ptr(weight.add(k * LANES)).fma(y, *sum);
                }
            }
        }
        I::sums(sums).store(&mut x[first..]);
    }
}

/// Adds Σ over the units of weight `z_r` `z_q` to sum r (r + 1)/2 + q, a vector each, for all rows r ≥ q.
#[inline(always)]
pub(crate) fn contract<I: Isa>(weight: &[f64], z: &Rows<&[f64]>, count: usize, sums: &mut [f64]) {
    let panels = weight.len() / LANES;
    assert!(count == 0 || (count - 1) * z.stride + panels * LANES <= z.values.len());
    assert!(count * (count + 1) / 2 * LANES <= sums.len());
    for r in (0..count).step_by(4) {
        for q in (0..r).step_by(4) {
            // SAFETY: the assertions: all rows, panels and sums are inside the slices.
            unsafe {
                match count - r {
                    1 => block::<I, 1, 4>(weight, z, (r, q), sums),
                    2 => block::<I, 2, 4>(weight, z, (r, q), sums),
                    3 => block::<I, 3, 4>(weight, z, (r, q), sums),
                    _ => block::<I, 4, 4>(weight, z, (r, q), sums),
                }
            }
        }
        // SAFETY: as above.
        unsafe {
            match count - r {
                1 => block::<I, 1, 1>(weight, z, (r, r), sums),
                2 => block::<I, 2, 2>(weight, z, (r, r), sums),
                3 => block::<I, 3, 3>(weight, z, (r, r), sums),
                _ => block::<I, 4, 4>(weight, z, (r, r), sums),
            }
        }
    }
}

/// Sums of R rows with Q others, or with themselves.
#[inline(always)]
unsafe fn block<I: Isa, const R: usize, const Q: usize>(
    weight: &[f64],
    z: &Rows<&[f64]>,
    (r, q): (usize, usize),
    sums: &mut [f64],
) {
    let own = r == q;
    let mut sum = [[I::F64::splat(0.0); Q]; R];
    // SAFETY: the caller's, for every pointer below.
    unsafe {
        let row = |r: usize, at: usize| I::F64::load_ptr(z.values.as_ptr().add(r * z.stride + at));
        for at in (0..weight.len() / LANES).map(|p| p * LANES) {
            let weight = I::F64::load_ptr(weight.as_ptr().add(at));
            let mut other = [I::F64::splat(0.0); Q];
            for (j, other) in other.iter_mut().enumerate() {
                *other = row(q + j, at);
            }
            for (i, sum) in sum.iter_mut().enumerate() {
                let weighed = weight.mul(if own {
                    other[i.min(Q - 1)]
                } else {
                    row(r + i, at)
                });
                for (j, sum) in sum.iter_mut().enumerate() {
                    if !own || j <= i {
                        *sum = weighed.fma(other[j], *sum);
                    }
                }
            }
        }
        for (i, sum) in sum.iter().enumerate() {
            for (j, sum) in sum.iter().enumerate() {
                if !own || j <= i {
                    let r = r + i;
                    let to = sums.as_mut_ptr().add((r * (r + 1) / 2 + q + j) * LANES);
                    I::F64::load_ptr(to).add(*sum).store_ptr(to);
                }
            }
        }
    }
}

/// Sums of vectors, eight at a time, in `out`, which holds whole vectors.
#[inline(always)]
pub(crate) fn collect<I: Isa>(vectors: &[f64], out: &mut [f64]) {
    let groups = vectors.chunks_exact(LANES * LANES);
    for (group, out) in groups.zip(out.chunks_exact_mut(LANES)) {
        let mut rows = [I::F64::splat(0.0); LANES];
        for (row, from) in rows.iter_mut().zip(group.chunks_exact(LANES)) {
            *row = I::F64::load(from);
        }
        I::sums(rows).store(out);
    }
}
