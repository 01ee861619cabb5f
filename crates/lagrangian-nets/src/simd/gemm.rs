//! The matrix product of all passes: C += A · B on 64-byte column panels.
//!
//! A matrix of `r` rows is stored as panels of `LANES` columns, each panel `[r, LANES]`, so that B and C are
//! read and written in order and packing is not needed. The factor A is read one number at a time (broadcast),
//! along its rows (layers forward and backward) or along its columns (the gradient of the weights).

use std::ops::Range;

use super::{Arithmetic, Isa, Memory, Real, Task};

/// Initial content of C, to which the product is added.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Init<'a, T> {
    /// Zero: C is overwritten.
    Zero,
    /// Previous content: C is added to.
    Add,
    /// One row, `[panels · LANES]`, for all rows below a number; zero for the others.
    Rows(&'a [T], usize),
}

/// The factor A, whose row r begins at `(r / LANES) · group + (r % LANES) · row`.
struct Broadcast<'a, T> {
    /// Values of A.
    numbers: &'a [T],
    /// Distance between neighbouring groups of `LANES` rows.
    group: usize,
    /// Distance between neighbouring rows of a group.
    row: usize,
    /// Distance between neighbours along k.
    step: usize,
}

impl<T: Real> Broadcast<'_, T> {
    /// Offset of row r.
    #[inline(always)]
    fn row(&self, r: usize) -> usize {
        r / T::LANES * self.group + r % T::LANES * self.row
    }
}

/// A matrix in panels of `LANES` columns, B or C: row r of panel p begins at `p · panel + r · LANES`.
struct Panels<S> {
    /// Values of the matrix.
    numbers: S,
    /// Distance between neighbouring panels.
    panel: usize,
}

/// The sum over k, in pieces.
struct Sum<'a> {
    /// Offsets of the pieces in A and B.
    pieces: Pieces<'a>,
    /// Number of terms in one piece; the last piece may be shorter.
    length: usize,
    /// Total number of terms.
    terms: usize,
}

/// C[r, :] = init + `Σ_k` A[r, k] B[k, :], for `rows` rows and `panels` panels of C.
pub(crate) struct Gemm<'a, T> {
    /// Broadcast factor.
    a: Broadcast<'a, T>,
    /// Vector factor, with row k for term k.
    b: Panels<&'a [T]>,
    /// Result.
    c: Panels<&'a mut [T]>,
    /// Terms along k.
    sum: Sum<'a>,
    /// Rows of C.
    rows: Range<usize>,
    /// Panels of C.
    panels: usize,
    /// Initial content of C.
    init: Init<'a, T>,
}

/// Offsets of the pieces of a sum in both factors.
#[derive(Debug, Clone, Copy)]
enum Pieces<'a> {
    /// Piece s begins at `s · a`, `s · b`.
    Even { a: usize, b: usize },
    /// Piece s begins at the s-th pair.
    At(&'a [(usize, usize)]),
}

impl Pieces<'_> {
    #[inline(always)]
    fn at(&self, s: usize) -> (usize, usize) {
        match self {
            Self::Even { a, b } => (s * a, s * b),
            Self::At(list) => list[s],
        }
    }
}

impl<'a, T: Real> Gemm<'a, T> {
    /// C = init + A · B with A in panels of `a_rows` rows, for some `rows` of it: a dense layer, forward or backward.
    /// `b` holds a matrix of `terms` rows in panels.
    #[expect(
        clippy::too_many_arguments,
        reason = "three matrices and the rows that are wanted"
    )]
    pub(crate) fn along_rows(
        a: &'a [T],
        a_rows: usize,
        b: &'a [T],
        terms: usize,
        c: &'a mut [T],
        c_rows: usize,
        rows: Range<usize>,
        panels: usize,
        init: Init<'a, T>,
    ) -> Self {
        let lanes = T::LANES;
        Self {
            a: Broadcast {
                numbers: a,
                group: lanes * lanes,
                row: lanes,
                step: 1,
            },
            b: Panels {
                numbers: b,
                panel: terms * lanes,
            },
            c: Panels {
                numbers: c,
                panel: c_rows * lanes,
            },
            sum: Sum {
                pieces: Pieces::Even {
                    a: a_rows * lanes,
                    b: lanes * lanes,
                },
                length: lanes,
                terms,
            },
            rows,
            panels,
            init,
        }
    }

    /// C = init + Σ over pieces of A[piece]ᵀ · B[piece], with A and B in panels of `a_rows` and `b_rows` rows,
    /// each piece `piece` rows of both that begin at the given pair of rows: the gradient of a layer's weights.
    #[expect(
        clippy::too_many_arguments,
        reason = "three matrices and the pieces that are wanted"
    )]
    pub(crate) fn along_columns(
        a: &'a [T],
        a_rows: usize,
        b: &'a [T],
        b_rows: usize,
        pieces: &'a [(usize, usize)],
        piece: usize,
        c: &'a mut [T],
        rows: usize,
        panels: usize,
        init: Init<'a, T>,
    ) -> Self {
        let lanes = T::LANES;
        Self {
            a: Broadcast {
                numbers: a,
                group: a_rows * lanes,
                row: 1,
                step: lanes,
            },
            b: Panels {
                numbers: b,
                panel: b_rows * lanes,
            },
            c: Panels {
                numbers: c,
                panel: rows * lanes,
            },
            sum: Sum {
                pieces: Pieces::At(pieces),
                length: piece,
                terms: piece * pieces.len(),
            },
            rows: 0..rows,
            panels,
            init,
        }
    }

    /// Panics unless every access is inside the slices.
    fn check(&self) {
        if self.rows.is_empty() || self.panels == 0 {
            return;
        }
        let lanes = T::LANES;
        assert_eq!(lanes % 8, 0);
        let (a, b, c, sum) = (&self.a, &self.b, &self.c, &self.sum);
        // The offset grows with r inside a group and from group to group.
        let last_in_group = lanes.min(self.rows.end) - 1;
        let last_row = a.row(self.rows.end - 1).max(a.row(last_in_group));
        let pieces = sum.terms.div_ceil(sum.length.max(1));
        // Pieces at even distances end where the last one does.
        let first = match sum.pieces {
            Pieces::Even { .. } => pieces.saturating_sub(1),
            Pieces::At(_) => 0,
        };
        for s in first..pieces {
            let (in_a, in_b) = sum.pieces.at(s);
            let length = sum.length.min(sum.terms - s * sum.length);
            assert!(in_a + last_row + (length - 1) * a.step < a.numbers.len());
            assert!(in_b + (self.panels - 1) * b.panel + length * lanes <= b.numbers.len());
        }
        assert!((self.panels - 1) * c.panel + self.rows.end * lanes <= c.numbers.len());
        if let Init::Rows(bias, _) = self.init {
            assert!(self.panels * lanes <= bias.len());
        }
    }
}

/// Number of terms of a sum that are added at a time: two panels of B, of this height, stay in the first-level cache.
const DEPTH: usize = 256;

impl<T: Real> Task for Gemm<'_, T> {
    #[inline(always)]
    fn run<I: Isa>(mut self) {
        self.check();
        let Sum { length, terms, .. } = self.sum;
        let goes = terms.div_ceil(DEPTH).max(1);
        let depth = terms.div_ceil(goes).next_multiple_of(length.max(1));
        let mut from = 0;
        loop {
            let to = terms.min(from + depth);
            self.go::<I>(from..to);
            if to == terms {
                break;
            }
            (from, self.init) = (to, Init::Add);
        }
    }
}

impl<T: Real> Gemm<'_, T> {
    /// Adds some terms to all of C. Few rows are combined with many panels, to compute enough sums at a time.
    #[inline(always)]
    fn go<I: Isa>(&mut self, terms: Range<usize>) {
        let rows = self.rows.len();
        let mut p = 0;
        while p < self.panels {
            let left = self.panels - p;
            let wide = I::TILE_PANELS == 2;
            p += match left {
                8.. if wide && rows == 1 => column::<I, T, 8>(self, p, &terms),
                4.. if wide && rows < 4 => column::<I, T, 4>(self, p, &terms),
                2.. if wide || rows < 4 => column::<I, T, 2>(self, p, &terms),
                _ => column::<I, T, 1>(self, p, &terms),
            };
        }
    }
}

/// Computes all rows of P neighbouring panels; returns P.
#[inline(always)]
fn column<I: Isa, T: Real, const P: usize>(
    g: &mut Gemm<'_, T>,
    p: usize,
    terms: &Range<usize>,
) -> usize {
    let mut r = g.rows.start;
    let end = g.rows.end;
    // Where rows are not evenly spaced throughout, a tile begins at a multiple of its height, so that it does not cross a
    // group of LANES rows.
    let even = g.a.group == T::LANES * g.a.row;
    let wide = I::TILE_PANELS == 2;
    let tall = I::TILE_ROWS >= 4;
    while r < end {
        let left = end - r;
        // SAFETY: `check` has verified that all rows, panels and terms are inside the slices.
        r += unsafe {
            match left {
                // Avoids a single last row, whose only sum would wait for itself.
                5 if P <= 2 && wide && even => tile::<I, T, P, 5>(g, p, r, terms),
                6 if P <= 2 && wide && even => tile::<I, T, P, 6>(g, p, r, terms),
                7 if P <= 2 && wide && even => tile::<I, T, P, 7>(g, p, r, terms),
                9 | 10 if P <= 2 && wide && even => tile::<I, T, P, 5>(g, p, r, terms),
                11 if P <= 2 && wide && even => tile::<I, T, P, 6>(g, p, r, terms),
                8.. if P <= 2 && wide && (even || r.is_multiple_of(8)) => {
                    tile::<I, T, P, 8>(g, p, r, terms)
                }
                4.. if P <= 2 && tall && (even || r.is_multiple_of(4)) => {
                    tile::<I, T, P, 4>(g, p, r, terms)
                }
                3 if P <= 4 && tall && (even || r.is_multiple_of(4)) => {
                    tile::<I, T, P, 3>(g, p, r, terms)
                }
                2.. if P <= 4 && (even || r.is_multiple_of(2)) => {
                    tile::<I, T, P, 2>(g, p, r, terms)
                }
                _ => tile::<I, T, P, 1>(g, p, r, terms),
            }
        };
    }
    P
}

/// Computes R rows of P panels in registers; returns R.
#[inline(always)]
unsafe fn tile<I: Isa, T: Real, const P: usize, const R: usize>(
    g: &mut Gemm<'_, T>,
    p: usize,
    r: usize,
    terms: &Range<usize>,
) -> usize {
    let lanes = T::LANES;
    let c = unsafe { g.c.numbers.as_mut_ptr().add(p * g.c.panel + r * lanes) };
    let row = g.a.row(r);
    // SAFETY: the caller's, for every pointer below.
    unsafe {
        let mut sum = [[T::Vec::<I>::splat(T::default()); P]; R];
        match g.init {
            Init::Zero => {}
            Init::Add => {
                for (i, row) in sum.iter_mut().enumerate() {
                    for (j, x) in row.iter_mut().enumerate() {
                        *x = T::Vec::<I>::load_ptr(c.add(j * g.c.panel + i * lanes));
                    }
                }
            }
            Init::Rows(bias, end) => {
                for row in sum.iter_mut().take(end.saturating_sub(r)) {
                    for (j, x) in row.iter_mut().enumerate() {
                        *x = T::Vec::<I>::load_ptr(bias.as_ptr().add((p + j) * lanes));
                    }
                }
            }
        }
        let mut left = terms.len();
        let mut s = terms.start / g.sum.length.max(1);
        while left > 0 {
            let length = left.min(g.sum.length);
            let (a_start, b_start) = g.sum.pieces.at(s);
            let mut a = g.a.numbers.as_ptr().add(a_start + row);
            let mut b = g.b.numbers.as_ptr().add(b_start + p * g.b.panel);
            for _ in 0..length {
                let mut y = [T::Vec::<I>::splat(T::default()); P];
                for (j, y) in y.iter_mut().enumerate() {
                    *y = T::Vec::<I>::load_ptr(b.add(j * g.b.panel));
                }
                for (i, row) in sum.iter_mut().enumerate() {
                    let x = T::Vec::<I>::splat(*a.add(i * g.a.row));
                    for (j, z) in row.iter_mut().enumerate() {
                        *z = x.fma(y[j], *z);
                    }
                }
                a = a.add(g.a.step);
                b = b.add(lanes);
            }
            left -= length;
            s += 1;
        }
        for (i, row) in sum.iter().enumerate() {
            for (j, x) in row.iter().enumerate() {
                x.store_ptr(c.add(j * g.c.panel + i * lanes));
            }
        }
    }
    R
}
