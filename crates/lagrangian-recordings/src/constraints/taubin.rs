//! Taubin's eigenproblem: the combinations of features that stay constant, by their distance in units of the noise.

use std::collections::BTreeMap;

use lagrangian_motion::Constraint;
use lagrangian_motion::solve::{diagonalise, inverse_root};
use lagrangian_motion::statistics::sort_by_number;

/// Positions of all motions, rows of `n`, and the noise of each coordinate, `[n]`.
pub(super) struct Cloud {
    pub(super) n: usize,
    pub(super) rows: Vec<f64>,
    pub(super) noise: Vec<f64>,
}

/// A combination of features that is nearly constant.
#[derive(Debug, Clone)]
pub(super) struct Relation {
    /// Its value, in units of length: the gradient has size 1 in mean square.
    pub(super) constraint: Constraint,
    /// The distance of the positions from it, root mean square, in units of the noise.
    pub(super) distance: f64,
    /// The same in units of length.
    pub(super) scatter: f64,
}

impl Cloud {
    pub(super) fn states(&self) -> impl Iterator<Item = &[f64]> {
        self.rows.chunks_exact(self.n)
    }

    /// All combinations c of the features, the one that is most nearly constant first: min cᵀA c / cᵀD c, A their covariance and
    /// D = Σ ∇f σ² ∇fᵀ (Taubin 1991).
    pub(super) fn relations(&self, features: &[Constraint]) -> Vec<Relation> {
        let k = features.len();
        let Moments {
            means,
            mut spread,
            mut noise,
            slope,
        } = self.moments(features);
        let unit: Vec<f64> = (0..k).map(|i| noise[i * k + i].sqrt().recip()).collect();
        if !unit.iter().all(|u| u.is_finite()) {
            return Vec::new();
        }
        for ij in 0..k * k {
            let unit = unit[ij / k] * unit[ij % k];
            spread[ij] *= unit;
            noise[ij] *= unit;
        }
        let Some(root) = inverse_root(&noise, k, CUTOFF) else {
            return Vec::new();
        };
        let product = lagrangian_motion::solve::product;
        let (mut whitened, mut vectors) = (
            product(&product(&root, &spread, k), &root, k),
            vec![0.0; k * k],
        );
        diagonalise(&mut whitened, &mut vectors, k);
        let centre = |(own, mean): (&Constraint, &f64)| Constraint {
            constant: Some(-mean),
            ..own.clone()
        };
        let centred: Vec<Constraint> = features.iter().zip(&means).map(centre).collect();
        let of = |at: usize| {
            let own = &vectors[at * k..][..k];
            let back = |i: usize| unit[i] * (0..k).map(|j| root[i * k + j] * own[j]).sum::<f64>();
            let c: Vec<f64> = (0..k).map(back).collect();
            let size: f64 = (0..k * k)
                .map(|ij| c[ij / k] * slope[ij] * c[ij % k])
                .sum::<f64>()
                .sqrt();
            let distance = whitened[at * k + at].max(0.0).sqrt();
            let c: Vec<f64> = c.iter().map(|c| c / size).collect();
            Relation {
                constraint: combined(&centred, &c),
                distance,
                scatter: distance / size,
            }
        };
        let mut all: Vec<Relation> = (0..k).map(of).collect();
        sort_by_number(&mut all, |own| own.distance);
        all
    }
}

/// Of features: their means, `[k]`, their covariance, that of their noise and the products of their gradients, `[k, k]`.
struct Moments {
    means: Vec<f64>,
    spread: Vec<f64>,
    noise: Vec<f64>,
    slope: Vec<f64>,
}

impl Cloud {
    fn moments(&self, features: &[Constraint]) -> Moments {
        let k = features.len();
        let count = self.states().count() as f64;
        let value = |own: &Constraint, q: &[f64]| own.value(q).unwrap_or_default();
        let mean = |own| self.states().map(|q| value(own, q)).sum::<f64>() / count;
        let means: Vec<f64> = features.iter().map(mean).collect();
        let [mut spread, mut noise, mut slope] = [(); 3].map(|()| vec![0.0; k * k]);
        for q in self.states() {
            let centred = features.iter().zip(&means);
            let values: Vec<f64> = centred.map(|(own, mean)| value(own, q) - mean).collect();
            let rows: Vec<Vec<f64>> = features.iter().map(|own| own.row(q)).collect();
            for ij in 0..k * k {
                let (i, j) = (ij / k, ij % k);
                spread[ij] += values[i] * values[j] / count;
                for (s, (a, b)) in self.noise.iter().zip(rows[i].iter().zip(&rows[j])) {
                    noise[ij] += (s * a) * (s * b) / count;
                    slope[ij] += a * b / count;
                }
            }
        }
        Moments {
            means,
            spread,
            noise,
            slope,
        }
    }
}

/// Features whose gradients are more nearly dependent than this are not told apart.
const CUTOFF: f64 = 1e-10;

/// Σ c f.
pub(super) fn combined(features: &[Constraint], c: &[f64]) -> Constraint {
    let (mut slopes, mut products) = (BTreeMap::new(), BTreeMap::new());
    let mut constant = Some(0.0);
    for (own, c) in features.iter().zip(c) {
        own.slopes
            .iter()
            .for_each(|(j, b)| *slopes.entry(*j).or_insert(0.0) += c * b);
        own.products
            .iter()
            .for_each(|(j, k, a)| *products.entry((*j, *k)).or_insert(0.0) += c * a);
        constant = constant.zip(own.constant).map(|(sum, own)| sum + c * own);
    }
    Constraint {
        name: String::new(),
        slopes: slopes.into_iter().collect(),
        products: products.into_iter().map(|((j, k), a)| (j, k, a)).collect(),
        constant,
    }
}
