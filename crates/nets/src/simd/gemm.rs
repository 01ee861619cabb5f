//! One matrix product for everything: C += A · B on 64-byte column panels.
//!
//! A matrix of `r` rows is stored as panels of `LANES` columns, each panel `[r, LANES]`, so that B and C are
//! read and written in order and nothing is ever packed. The factor A is read one number at a time (broadcast),
//! along its rows (layers forward and backward) or along its columns (the gradient of the weights).

use std::ops::Range;

use super::{Isa, Real, Task, Vector};

/// What C holds before the product is added.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Init<'a, T> {
    /// Nothing: C is overwritten.
    Zero,
    /// What it held: C is added to.
    Add,
    /// The same row, `[panels · LANES]`, in rows below a number; nothing in the others.
    Rows(&'a [T], usize),
}

/// C[r, :] = init + `Σ_k` A[r, k] B[k, :], for `rows` rows and `panels` panels of C.
pub(crate) struct Gemm<'a, T> {
    /// Broadcast factor. Row r begins at `(r / LANES) · a_group + (r % LANES) · a_row`.
    pub a: &'a [T],
    /// See `a`.
    pub a_group: usize,
    /// See `a`.
    pub a_row: usize,
    /// Distance of neighbours along k.
    pub a_step: usize,
    /// Vector factor: panel p begins at `p · b_panel`, k at `k · LANES`.
    pub b: &'a [T],
    /// See `b`.
    pub b_panel: usize,
    /// Where the pieces of the sum over k begin in `a` and `b`.
    pub segments: Segments<'a>,
    /// Terms in one piece; the last piece may be shorter.
    pub segment: usize,
    /// Terms in all.
    pub terms: usize,
    /// Result: panel p begins at `p · c_panel`, row r at `r · LANES`.
    pub c: &'a mut [T],
    /// See `c`.
    pub c_panel: usize,
    /// Rows of C.
    pub rows: Range<usize>,
    /// Panels of C.
    pub panels: usize,
    /// What C holds first.
    pub init: Init<'a, T>,
}

/// Where the pieces of a sum begin in both factors.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Segments<'a> {
    /// Piece s begins at `s · a`, `s · b`.
    Even { a: usize, b: usize },
    /// Piece s begins at the s-th pair.
    At(&'a [(usize, usize)]),
}

impl Segments<'_> {
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
            a,
            a_group: lanes * lanes,
            a_row: lanes,
            a_step: 1,
            b,
            b_panel: terms * lanes,
            segments: Segments::Even {
                a: a_rows * lanes,
                b: lanes * lanes,
            },
            segment: lanes,
            terms,
            c,
            c_panel: c_rows * lanes,
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
            a,
            a_group: a_rows * lanes,
            a_row: 1,
            a_step: lanes,
            b,
            b_panel: b_rows * lanes,
            segments: Segments::At(pieces),
            segment: piece,
            terms: piece * pieces.len(),
            c,
            c_panel: rows * lanes,
            rows: 0..rows,
            panels,
            init,
        }
    }

    /// Panics unless every access is inside its slice.
    fn check(&self) {
        if self.rows.is_empty() || self.panels == 0 {
            return;
        }
        let lanes = T::LANES;
        assert_eq!(lanes % 8, 0);
        let row = |r: usize| r / lanes * self.a_group + r % lanes * self.a_row;
        // The offset grows with r inside a group and from group to group.
        let last_in_group = lanes.min(self.rows.end) - 1;
        let last_row = row(self.rows.end - 1).max(row(last_in_group));
        let pieces = self.terms.div_ceil(self.segment.max(1));
        // Pieces that follow each other evenly end where the last one does.
        let first = match self.segments {
            Segments::Even { .. } => pieces.saturating_sub(1),
            Segments::At(_) => 0,
        };
        for s in first..pieces {
            let (a, b) = self.segments.at(s);
            let length = self.segment.min(self.terms - s * self.segment);
            assert!(a + last_row + (length - 1) * self.a_step < self.a.len());
            assert!(b + (self.panels - 1) * self.b_panel + length * lanes <= self.b.len());
        }
        assert!((self.panels - 1) * self.c_panel + self.rows.end * lanes <= self.c.len());
        if let Init::Rows(bias, _) = self.init {
            assert!(self.panels * lanes <= bias.len());
        }
    }
}

/// The number of terms of a sum that are added at a time: two panels of B, of this height, stay in the first-level cache.
const DEPTH: usize = 256;

impl<T: Real> Task for Gemm<'_, T> {
    #[inline(always)]
    fn run<I: Isa>(mut self) {
        self.check();
        let goes = self.terms.div_ceil(DEPTH).max(1);
        let depth = self
            .terms
            .div_ceil(goes)
            .next_multiple_of(self.segment.max(1));
        let mut from = 0;
        loop {
            let to = self.terms.min(from + depth);
            self.go::<I>(from..to);
            if to == self.terms {
                break;
            }
            (from, self.init) = (to, Init::Add);
        }
    }
}

impl<T: Real> Gemm<'_, T> {
    /// Adds some terms to all of C. Few rows are taken with many panels, so that enough sums are computed at a time.
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

/// All rows of P neighbouring panels; returns P.
#[inline(always)]
fn column<I: Isa, T: Real, const P: usize>(
    g: &mut Gemm<'_, T>,
    p: usize,
    terms: &Range<usize>,
) -> usize {
    let mut r = g.rows.start;
    let end = g.rows.end;
    // Where rows do not follow each other evenly throughout, a tile begins at a multiple of its height, so that none crosses a
    // group of LANES rows.
    let even = g.a_group == T::LANES * g.a_row;
    let wide = I::TILE_PANELS == 2;
    while r < end {
        let left = end - r;
        // SAFETY: `check` has seen that all rows, panels and terms are inside the slices.
        r += unsafe {
            match left {
                // No single row is left over, whose one sum would wait for itself.
                5 if P <= 2 && wide && even => tile::<I, T, P, 5>(g, p, r, terms),
                6 if P <= 2 && wide && even => tile::<I, T, P, 6>(g, p, r, terms),
                7 if P <= 2 && wide && even => tile::<I, T, P, 7>(g, p, r, terms),
                9 | 10 if P <= 2 && wide && even => tile::<I, T, P, 5>(g, p, r, terms),
                11 if P <= 2 && wide && even => tile::<I, T, P, 6>(g, p, r, terms),
                8.. if P <= 2 && wide && (even || r.is_multiple_of(8)) => {
                    tile::<I, T, P, 8>(g, p, r, terms)
                }
                4.. if P <= 2 && (even || r.is_multiple_of(4)) => {
                    tile::<I, T, P, 4>(g, p, r, terms)
                }
                3 if P <= 4 && (even || r.is_multiple_of(4)) => tile::<I, T, P, 3>(g, p, r, terms),
                2.. if P <= 4 && (even || r.is_multiple_of(2)) => {
                    tile::<I, T, P, 2>(g, p, r, terms)
                }
                _ => tile::<I, T, P, 1>(g, p, r, terms),
            }
        };
    }
    P
}

/// R rows of P panels, in registers; returns R.
#[inline(always)]
unsafe fn tile<I: Isa, T: Real, const P: usize, const R: usize>(
    g: &mut Gemm<'_, T>,
    p: usize,
    r: usize,
    terms: &Range<usize>,
) -> usize {
    let lanes = T::LANES;
    let c = unsafe { g.c.as_mut_ptr().add(p * g.c_panel + r * lanes) };
    let row = r / lanes * g.a_group + r % lanes * g.a_row;
    // SAFETY: the caller's, for every pointer below.
    unsafe {
        let mut sum = [[T::Vec::<I>::splat(T::default()); P]; R];
        match g.init {
            Init::Zero => {}
            Init::Add => {
                for (i, row) in sum.iter_mut().enumerate() {
                    for (j, x) in row.iter_mut().enumerate() {
                        *x = T::Vec::<I>::load_ptr(c.add(j * g.c_panel + i * lanes));
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
        let mut s = terms.start / g.segment.max(1);
        while left > 0 {
            let length = left.min(g.segment);
            let (a_start, b_start) = g.segments.at(s);
            let mut a = g.a.as_ptr().add(a_start + row);
            let mut b = g.b.as_ptr().add(b_start + p * g.b_panel);
            for _ in 0..length {
                let mut y = [T::Vec::<I>::splat(T::default()); P];
                for (j, y) in y.iter_mut().enumerate() {
                    *y = T::Vec::<I>::load_ptr(b.add(j * g.b_panel));
                }
                for (i, row) in sum.iter_mut().enumerate() {
                    let x = T::Vec::<I>::splat(*a.add(i * g.a_row));
                    for (j, z) in row.iter_mut().enumerate() {
                        *z = x.fma(y[j], *z);
                    }
                }
                a = a.add(g.a_step);
                b = b.add(lanes);
            }
            left -= length;
            s += 1;
        }
        for (i, row) in sum.iter().enumerate() {
            for (j, x) in row.iter().enumerate() {
                x.store_ptr(c.add(j * g.c_panel + i * lanes));
            }
        }
    }
    R
}
