//! Gates, whose product with the velocities is taken over the truncated algebra, forward and backward.

use std::ops::Range;

use super::{Arithmetic, Isa, Memory, Real, Shape, Task, Vector};

/// Both sides of a gate z = `Σ_j` `g_j` `v_j` + `g_n`: the gates g (from q) and the velocities v.
pub(crate) struct Gates<'a, T> {
    /// Shape of the gated layer.
    pub shape: Shape,
    /// Number of degrees of freedom.
    pub n: usize,
    /// Gates in panels: block j of `shape.panels` panels multiplies `v_j`, the last block is added.
    pub g: &'a [T],
    /// Velocities, `[components, samples, n]`.
    pub v: &'a [T],
}

impl<T: Real> Gates<'_, T> {
    #[inline(always)]
    fn gate<V: Vector<Elem = T>>(&self, j: usize, p: usize, c: usize, s: usize) -> V {
        V::load(&self.g[self.shape.at::<T>(j * self.shape.panels + p, c, s)..])
    }
    #[inline(always)]
    fn velocity<V: Vector<Elem = T>>(&self, j: usize, c: usize, s: usize) -> V {
        V::splat(self.v[(c * self.shape.samples + s) * self.n + j])
    }
    /// Pairs (component of one factor, component of the other) whose products make component c of a product.
    #[inline(always)]
    fn pairs(&self, c: usize) -> ([(usize, usize); 4], usize) {
        let mixed = self.shape.mixed(0);
        match c {
            0 => ([(0, 0); 4], 1),
            c if c < mixed => ([(c, 0), (0, c), (0, 0), (0, 0)], 2),
            c => {
                let i = 2 + c - mixed;
                ([(c, 0), (i, 1), (1, i), (0, c)], 4)
            }
        }
    }
}

/// Components of z = `Σ_j` `g_j` `v_j` + `g_n`.
pub(crate) struct GateForward<'a, T> {
    pub gates: Gates<'a, T>,
    pub components: Range<usize>,
    pub z: &'a mut [T],
}

impl<T: Real> Task for GateForward<'_, T> {
    #[inline(always)]
    fn run<I: Isa>(self) {
        let (g, n) = (&self.gates, self.gates.n);
        for p in 0..g.shape.panels {
            for c in self.components.clone() {
                let (pairs, count) = g.pairs(c);
                for s in 0..g.shape.samples {
                    let mut sum = g.gate::<T::Vec<I>>(n, p, c, s);
                    for j in 0..n {
                        for &(cg, cv) in &pairs[..count] {
                            sum = g
                                .gate::<T::Vec<I>>(j, p, cg, s)
                                .fma(g.velocity(j, cv, s), sum);
                        }
                    }
                    sum.store(&mut self.z[g.shape.at::<T>(p, c, s)..]);
                }
            }
        }
    }
}

/// Sensitivity to the gates, from the sensitivity yz to z.
pub(crate) struct GateReverse<'a, T> {
    pub gates: Gates<'a, T>,
    pub components: Range<usize>,
    pub yz: &'a [T],
    /// Sensitivity to the gates, in the panels of the gates; overwritten.
    pub yg: &'a mut [T],
    /// Sensitivity to the velocities, `[samples, n]`, if component 0 is requested; added to.
    pub yv: Option<&'a mut [T]>,
    /// As in [`Contract`], with the number of directions; added to.
    pub hessian: Option<(&'a mut [T], usize)>,
}

impl<T: Real> Task for GateReverse<'_, T> {
    #[inline(always)]
    fn run<I: Isa>(mut self) {
        let (g, n) = (&self.gates, self.gates.n);
        for p in 0..g.shape.panels {
            for c in self.components.clone() {
                let (pairs, count) = g.pairs(c);
                for s in 0..g.shape.samples {
                    let y = |c| T::Vec::<I>::load(&self.yz[g.shape.at::<T>(p, c, s)..]);
                    for j in 0..n {
                        let mut sum = T::Vec::<I>::of(0.0);
                        for &(cy, cv) in &pairs[..count] {
                            sum = y(cy).fma(g.velocity(j, cv, s), sum);
                        }
                        sum.store(&mut self.yg[g.shape.at::<T>(j * g.shape.panels + p, c, s)..]);
                    }
                    y(c).store(&mut self.yg[g.shape.at::<T>(n * g.shape.panels + p, c, s)..]);
                }
            }
        }
        if let Some(yv) = &mut self.yv {
            velocity_sensitivity::<I, T>(g, self.yz, yv);
        }
        if let Some((hessian, directions)) = &mut self.hessian {
            gate_curvature::<I, T>(g, self.yz, *directions, hessian);
        }
    }
}

/// `yv_j` += `Σ_units` yz₀ `g_j`.
#[inline(always)]
fn velocity_sensitivity<I: Isa, T: Real>(g: &Gates<'_, T>, yz: &[T], yv: &mut [T]) {
    for s in 0..g.shape.samples {
        for j in 0..g.n {
            let mut sum = T::Vec::<I>::of(0.0);
            for p in 0..g.shape.panels {
                let y = T::Vec::<I>::load(&yz[g.shape.at::<T>(p, 0, s)..]);
                sum = y.fma(g.gate(j, p, 0, s), sum);
            }
            let y = &mut yv[s * g.n + j];
            *y = *y + sum.sum();
        }
    }
}

/// hessian[t, u] += `Σ_units` yz₀ `Σ_j` (`g_j,t` `v_j,u` + `g_j,u` `v_j,t`).
#[inline(always)]
fn gate_curvature<I: Isa, T: Real>(g: &Gates<'_, T>, yz: &[T], n: usize, hessian: &mut [T]) {
    for s in 0..g.shape.samples {
        for i in 0..n {
            for k in (0..=i).chain([n]) {
                let (t, u) = (2 + i, if k == n { 1 } else { 2 + k });
                let mut sum = T::Vec::<I>::of(0.0);
                for p in 0..g.shape.panels {
                    let y = T::Vec::<I>::load(&yz[g.shape.at::<T>(p, 0, s)..]);
                    for j in 0..g.n {
                        let cross = g.gate::<T::Vec<I>>(j, p, t, s).mul(g.velocity(j, u, s));
                        sum = y.fma(
                            g.gate::<T::Vec<I>>(j, p, u, s)
                                .fma(g.velocity(j, t, s), cross),
                            sum,
                        );
                    }
                }
                let h = &mut hessian[(s * n + i) * (n + 1) + k];
                *h = *h + sum.sum();
            }
        }
    }
}
