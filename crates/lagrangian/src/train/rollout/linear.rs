//! Small dense algebra of one state.

/// Writes A⁻¹ to `inverse`, both `[d, d]` row-major, by Gauss and Jordan with row pivots; overwrites A. `false` where A
/// is singular.
pub(crate) fn invert(a: &mut [f64], inverse: &mut [f64], d: usize) -> bool {
    inverse.fill(0.0);
    (0..d).for_each(|i| inverse[i * d + i] = 1.0);
    for j in 0..d {
        let size = |i: &usize| a[i * d + j].abs();
        let Some(best) = (j..d).max_by(|i, k| size(i).total_cmp(&size(k))) else {
            return false;
        };
        let pivot = a[best * d + j];
        if !pivot.is_finite() || pivot.abs() < f64::MIN_POSITIVE {
            return false;
        }
        for k in 0..d {
            a.swap(j * d + k, best * d + k);
            inverse.swap(j * d + k, best * d + k);
        }
        for matrix in [&mut *a, &mut *inverse] {
            matrix[j * d..][..d].iter_mut().for_each(|x| *x /= pivot);
        }
        for i in (0..d).filter(|i| *i != j) {
            let factor = a[i * d + j];
            for k in 0..d {
                a[i * d + k] -= factor * a[j * d + k];
                inverse[i * d + k] -= factor * inverse[j * d + k];
            }
        }
    }
    inverse.iter().all(|x| x.is_finite())
}

/// out += factor · Mᵀ x, with M `[d, d]`.
pub(crate) fn add_transposed(m: &[f64], x: &[f64], factor: f64, out: &mut [f64]) {
    let d = x.len();
    for (row, &x) in m.chunks_exact(d).zip(x) {
        let weight = factor * x;
        out.iter_mut().zip(row).for_each(|(o, m)| *o += weight * m);
    }
}

/// out = M x.
pub(super) fn product(m: &[f64], x: &[f64], out: &mut [f64]) {
    for (row, out) in m.chunks_exact(x.len()).zip(out) {
        *out = lagrangian_motion::solve::dot(row, x);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_matrix_times_its_inverse_is_one_and_a_singular_one_has_none() {
        let m = [0.0, 2.0, -1.0, 3.0, 0.5, 0.0, 1.0, 1.0, 4.0];
        let (mut a, mut inverse) = (m, [0.0; 9]);
        assert!(invert(&mut a, &mut inverse, 3));
        for i in 0..3 {
            for j in 0..3 {
                let x: f64 = (0..3).map(|k| m[i * 3 + k] * inverse[k * 3 + j]).sum();
                assert!((x - f64::from(u8::from(i == j))).abs() < 1e-14);
            }
        }
        assert!(!invert(&mut [1.0, 2.0, 2.0, 4.0], &mut [0.0; 4], 2));
    }
}
