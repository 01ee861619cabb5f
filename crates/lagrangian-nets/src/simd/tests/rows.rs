//! A few rows through a layer, against plain loops.

use super::super::*;
use super::{Draw, agree, each};

struct Through<'a> {
    w: Weights<'a>,
    a: Rows<&'a [f64]>,
    bias: &'a [f64],
    z: Rows<&'a mut [f64]>,
    count: usize,
    /// W y of the first row of z.
    x: &'a mut [f64],
    /// Second derivatives of all rows with the first as weight.
    sums: &'a mut [f64],
    hessian: &'a mut [f64],
}

impl Task for Through<'_> {
    #[inline(always)]
    fn run<I: Isa>(mut self) {
        product::<I>(&self.a, self.w, self.bias, &mut self.z, self.count);
        let z = Rows {
            values: &self.z.values[..],
            stride: self.z.stride,
        };
        let first = &z.values[..z.stride];
        pull::<I>(self.w, first, self.x);
        contract::<I>(first, &z, self.count, self.sums);
        collect::<I>(self.sums, self.hessian);
    }
}

/// z, W z₀ and Σ z₀ `z_r` `z_q` on one instruction set, or by plain loops.
fn through(draw: &mut Draw) {
    let [terms, panels, count] = [1..40, 1..20, 1..12].map(|range| draw.size(range));
    let (a_stride, z_stride) = (terms + draw.size(0..9), panels * 8);
    let (w, bias) = (draw.values(panels * terms * 8), draw.values(z_stride));
    let a = draw.values::<f64>(count * a_stride);
    let pairs = (count * (count + 1) / 2).next_multiple_of(8);
    let run = |level| {
        let mut z = vec![0.0; count * z_stride];
        let mut x = vec![0.0; terms.next_multiple_of(8)];
        let (mut sums, mut hessian) = (vec![0.0; pairs * 8], vec![0.0; pairs]);
        let through = Through {
            w: Weights { panels: &w, terms },
            a: Rows {
                values: &a,
                stride: a_stride,
            },
            bias: &bias,
            z: Rows {
                values: &mut z,
                stride: z_stride,
            },
            count,
            x: &mut x,
            sums: &mut sums,
            hessian: &mut hessian,
        };
        dispatch_on(level, through);
        x.truncate(terms);
        [z, x, hessian].concat()
    };
    agree("rows through a layer", run);
    let weight = |u: usize, k: usize| w[(u / 8 * terms + k) * 8 + u % 8];
    let mut truth: Vec<f64> = Vec::new();
    for r in 0..count {
        for u in 0..z_stride {
            let bias = if r == 0 { bias[u] } else { 0.0 };
            let sum: f64 = (0..terms).map(|k| weight(u, k) * a[r * a_stride + k]).sum();
            truth.push(bias + sum);
        }
    }
    let z = truth.clone();
    for k in 0..terms {
        truth.push((0..z_stride).map(|u| weight(u, k) * z[u]).sum());
    }
    for r in 0..count {
        for q in 0..=r {
            let term = |u: usize| z[u] * z[r * z_stride + u] * z[q * z_stride + u];
            truth.push((0..z_stride).map(term).sum());
        }
    }
    let size = truth.iter().fold(1.0, |m: f64, x| m.max(x.abs()));
    for (found, truth) in run(Level::Portable).iter().zip(&truth) {
        assert!(
            (found - truth).abs() < 1e-13 * size,
            "{found} is not {truth}"
        );
    }
}

#[test]
fn rows_through_a_layer_are_what_plain_loops_make_of_them() {
    each(through);
}
