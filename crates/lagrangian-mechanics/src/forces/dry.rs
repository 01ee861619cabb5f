//! Dry friction as a set of forces: the velocities at which it balances all other forces.

use super::scalar::Scalar;

/// Relative excess of the forces over friction at which a joint at rest starts to move; it covers rounding.
const ROUNDING: f64 = 1e-12;
/// Pivots below this part of their diagonal count as zero.
const PIVOT: f64 = 1e-14;
/// Maximum number of sets of moving joints, for each joint: rounding could otherwise repeat them forever.
const SETS: usize = 64;

/// Solves M v + l ∘ sgn(v) ∋ r, sgn(0) = [−1, 1], for M ≻ 0 (theory.md, equation 130b).
///
/// v is the minimum of the strictly convex ½ v·M v − r·v + Σ lᵢ |vᵢ|. A primal active-set method finds it. It minimises over
/// the moving joints with their present signs, stops those that would reverse, and releases the joint whose friction is
/// exceeded most. Each such minimum lies below the one before it, so no set of signs is repeated, and their number is
/// finite. A joint that its friction holds has v = 0 exactly; lᵢ = 0 is a joint without friction, lᵢ = ∞ one that
/// does not move.
///
/// This problem is the linear complementarity problem with bounds of Moreau (1988) and of Stewart and Trinkle (1996), with
/// M⁻¹ as the matrix from friction to velocities.
#[derive(Debug, Clone)]
pub struct DrySolver<T = f64> {
    /// Direction of each moving joint, 0 for joints at rest.
    sign: Vec<f64>,
    moving: Vec<usize>,
    /// Factors L and D of the moving part of M.
    factor: Vec<T>,
    target: Vec<T>,
}

impl<T: Scalar> DrySolver<T> {
    /// A solver for `n` joints.
    #[must_use]
    pub fn new(n: usize) -> Self {
        Self {
            sign: vec![0.0; n],
            moving: Vec::with_capacity(n),
            factor: vec![T::of(0.0); n * n],
            target: vec![T::of(0.0); n],
        }
    }

    /// Replaces the initial velocities `v` by the solution; M is `[n, n]`, row-major, r, l and v are `[n]`.
    /// Returns `false` where M is not positive definite or a value is not finite; v is then not a solution.
    #[must_use]
    pub fn solve(&mut self, mass: &[T], rest: &[T], limit: &[T], v: &mut [T]) -> bool {
        if !mass.iter().chain(rest).all(|x| x.value().is_finite()) {
            return false;
        }
        for (i, sign) in self.sign.iter_mut().enumerate() {
            let held = limit[i].value().is_infinite();
            if held || v[i].value() == 0.0 {
                (*sign, v[i]) = (0.0, T::of(0.0));
            } else {
                *sign = v[i].value().signum();
            }
            if limit[i].value() == 0.0 {
                *sign = 1.0;
            }
        }
        for _ in 0..SETS * (v.len() + 1) {
            if !self.minimise(mass, rest, limit, v) {
                return false;
            }
            let Some((joint, direction)) = self.exceeded(mass, rest, limit, v) else {
                return v.iter().all(|v| v.value().is_finite());
            };
            self.sign[joint] = direction;
        }
        false
    }

    /// Moves to the minimum with the signs of the moving joints, and stops those that would reverse before it.
    fn minimise(&mut self, mass: &[T], rest: &[T], limit: &[T], v: &mut [T]) -> bool {
        loop {
            let is_moving = |i: &usize| self.sign[*i] != 0.0;
            self.moving.clear();
            self.moving.extend((0..v.len()).filter(is_moving));
            if !self.aim(mass, rest, limit) {
                return false;
            }
            let Some((joint, part)) = self.first_to_stop(limit, v) else {
                let pairs = self.moving.iter().zip(&self.target);
                pairs.for_each(|(&i, target)| v[i] = *target);
                return true;
            };
            for (&i, target) in self.moving.iter().zip(&self.target) {
                v[i] = v[i] + (*target - v[i]).times(part);
            }
            (self.sign[joint], v[joint]) = (0.0, T::of(0.0));
        }
    }

    /// Joint that comes to rest first on the line to the target, and the fraction of the line up to there.
    fn first_to_stop(&self, limit: &[T], v: &[T]) -> Option<(usize, f64)> {
        let turning = self.moving.iter().zip(&self.target).filter_map(|(&i, y)| {
            let (v, y) = (v[i].value(), y.value());
            let turns = limit[i].value() > 0.0 && y * self.sign[i] <= 0.0;
            let way = v - y;
            turns.then(|| (i, if way == 0.0 { 0.0 } else { v / way }))
        });
        turning.min_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// Joint at rest whose friction is exceeded most, and the direction in which it starts.
    fn exceeded(&self, mass: &[T], rest: &[T], limit: &[T], v: &[T]) -> Option<(usize, f64)> {
        let excess = |i: usize| {
            let (mut force, mut size) = (rest[i].value(), rest[i].value().abs());
            for &j in &self.moving {
                let part = mass[i * v.len() + j].value() * v[j].value();
                (force, size) = (force - part, size + part.abs());
            }
            let limit = limit[i].value();
            let beyond = force.abs() - limit;
            (beyond > ROUNDING * (size + limit)).then_some((i, force.signum(), beyond))
        };
        let resting = (0..v.len()).filter(|&i| self.sign[i] == 0.0);
        let most = resting
            .filter_map(excess)
            .max_by(|a, b| a.2.total_cmp(&b.2));
        most.map(|(i, direction, _)| (i, direction))
    }

    /// Solves M v = r − l ∘ sgn for the moving joints, the others at rest, by L D Lᵀ; `false` where M is not definite.
    fn aim(&mut self, mass: &[T], rest: &[T], limit: &[T]) -> bool {
        let (n, m) = (self.sign.len(), self.moving.len());
        let a = &mut self.factor;
        for j in 0..m {
            for i in j..m {
                let mut sum = mass[self.moving[i] * n + self.moving[j]];
                for k in 0..j {
                    sum = sum - a[i * n + k] * a[j * n + k] * a[k * n + k];
                }
                a[i * n + j] = if i == j { sum } else { sum / a[j * n + j] };
            }
            let diagonal = mass[self.moving[j] * (n + 1)].value();
            let pivot = a[j * (n + 1)].value();
            if pivot.is_nan() || pivot <= PIVOT * diagonal.abs() {
                return false;
            }
        }
        for j in 0..m {
            let i = self.moving[j];
            let friction = match limit[i].value() {
                0.0 => T::of(0.0),
                _ => limit[i].times(self.sign[i]),
            };
            self.target[j] = rest[i] - friction;
        }
        self.substitute(m);
        true
    }

    /// Solves L D Lᵀ x = target in place.
    fn substitute(&mut self, m: usize) {
        let (n, a, x) = (self.sign.len(), &self.factor, &mut self.target);
        for i in 0..m {
            for k in 0..i {
                x[i] = x[i] - a[i * n + k] * x[k];
            }
        }
        for i in (0..m).rev() {
            x[i] = x[i] / a[i * (n + 1)];
            for k in i + 1..m {
                x[i] = x[i] - a[k * n + i] * x[k];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::forces::Sensitive;
    use lagrangian_motion::solve::{SymmetricSolver, dot};

    /// A problem of n joints, some without friction: M, r, l.
    fn problem(n: usize, rng: &mut ChaCha8Rng) -> [Vec<f64>; 3] {
        let mut random = |n: usize| -> Vec<f64> {
            let numbers = (0..n).map(|_| rng.random_range(-1.0..1.0));
            numbers.collect()
        };
        let (a, rest) = (random(n * n), random(n));
        let limit = random(n).iter().map(|x| x.max(0.0)).collect();
        let entry = |k: usize| {
            let (i, j) = (k / n, k % n);
            dot(&a[i * n..(i + 1) * n], &a[j * n..(j + 1) * n]) + f64::from(u8::from(i == j)) * 1e-3
        };
        [(0..n * n).map(entry).collect(), rest, limit]
    }

    /// The friction r − M v.
    fn friction(mass: &[f64], rest: &[f64], v: &[f64]) -> Vec<f64> {
        let rows = mass.chunks_exact(v.len()).zip(rest);
        rows.map(|(row, r)| r - dot(row, v)).collect()
    }

    #[test]
    fn friction_opposes_all_that_moves_and_holds_what_it_can_wherever_the_search_begins() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let [mut held, mut moved] = [0; 2];
        for k in 0..2000 {
            let n = 1 + k % 9;
            let [mass, rest, limit] = problem(n, &mut rng);
            let mut v: Vec<f64> = (0..n).map(|_| rng.random_range(-1.0..1.0)).collect();
            let mut solver = DrySolver::new(n);
            assert!(solver.solve(&mass, &rest, &limit, &mut v));
            for (i, g) in friction(&mass, &rest, &v).into_iter().enumerate() {
                let size =
                    rest[i].abs() + n as f64 * 1e2 * v.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
                let right = match v[i] == 0.0 {
                    true => g.abs() <= limit[i] + 1e-13 * size,
                    false => (g - limit[i] * v[i].signum()).abs() < 1e-13 * size,
                };
                assert!(right, "{i} of {n}: {g} {} {}", limit[i], v[i]);
                *if v[i] == 0.0 { &mut held } else { &mut moved } += 1;
            }
            let mut from_rest = vec![0.0; n];
            assert!(solver.solve(&mass, &rest, &limit, &mut from_rest));
            let pairs = v.iter().zip(&from_rest);
            assert!(pairs.fold(0.0_f64, |m, (a, b)| m.max((a - b).abs())) < 1e-8);
        }
        assert!(held > 1000 && moved > 1000, "{held} {moved}");
    }

    #[test]
    fn friction_takes_energy_from_the_motion_without_it() {
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        for k in 0..500 {
            let n = 1 + k % 7;
            let [mass, rest, limit] = problem(n, &mut rng);
            let (mut v, mut free) = (vec![0.0; n], vec![0.0; n]);
            let _ = SymmetricSolver::new(n).solve(&mass, &rest, &mut free);
            assert!(DrySolver::new(n).solve(&mass, &rest, &limit, &mut v));
            // ½ v·M v ≤ ½ free·M free, with M free = r.
            let energy = |v: &[f64]| {
                let rows = mass.chunks_exact(n).zip(v);
                0.5 * rows.map(|(row, x)| x * dot(row, v)).sum::<f64>()
            };
            assert!(energy(&v) <= 0.5 * dot(&free, &rest) * (1.0 + 1e-9));
        }
    }

    #[test]
    fn derivatives_are_those_of_differences_and_a_joint_that_is_held_stays() {
        let mass = [2.0, 0.5, 0.3, 0.5, 1.0, 0.2, 0.3, 0.2, 1.5];
        let solved = |a: f64| {
            let mut v = [0.1; 3];
            let rest = [1.0 + a, 0.2, -2.0];
            let limit = [0.3 * a, f64::INFINITY, 0.4];
            assert!(DrySolver::new(3).solve(&mass, &rest, &limit, &mut v));
            v
        };
        let one = |x: f64| Sensitive::<1>::of(x);
        let a = Sensitive::<1>::variable(0.7, 0);
        let mut v = [one(0.1); 3];
        let rest = [one(1.0) + a, one(0.2), one(-2.0)];
        let limit = [a.times(0.3), one(f64::INFINITY), one(0.4)];
        assert!(DrySolver::new(3).solve(&mass.map(one), &rest, &limit, &mut v));
        let (up, down) = (solved(0.7 + 1e-6), solved(0.7 - 1e-6));
        for i in 0..3 {
            let slope = (up[i] - down[i]) / 2e-6;
            assert!(
                (v[i].slope[0] - slope).abs() < 1e-8,
                "{i}: {:?} {slope}",
                v[i]
            );
        }
        assert!(v[1].value == 0.0 && v[0].value > 0.0 && v[2].value < 0.0);
    }

    #[test]
    fn masses_that_are_not_definite_and_numbers_that_are_not_finite_have_no_solution() {
        let solve = |mass: [f64; 4], rest: [f64; 2]| {
            DrySolver::new(2).solve(&mass, &rest, &[0.1; 2], &mut [0.0; 2])
        };
        assert!(solve([1.0, 0.0, 0.0, 1.0], [1.0; 2]));
        assert!(!solve([1.0, 2.0, 2.0, 1.0], [1.0; 2]));
        assert!(!solve([f64::NAN, 0.0, 0.0, 1.0], [1.0; 2]));
        assert!(!solve([1.0, 0.0, 0.0, 1.0], [f64::INFINITY, 1.0]));
    }
}
