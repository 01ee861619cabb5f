//! A stationary path and its properties: action, momenta, energies, and its kind.

use serde::Serialize;

use super::discrete::{DiscreteAction, Path};
use super::second_variation::SecondVariation;
use lagrangian::mechanics::{Jet, Jets, Lagrangian, SymmetricSolver, dot};
use lagrangian::score::{Grade, Judgement, Outside, extrapolation};
use lagrangian::{Signals, Trajectory};

/// Kind of a stationary path: whether it is a minimum of the action.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum PathKind {
    /// All neighbouring paths with the same ends have more action.
    Minimum,
    /// The end lies beyond a conjugate point: some neighbouring paths have less action.
    Saddle,
    /// The end is conjugate to the start within the accuracy of the grid: some neighbouring paths have equal action.
    Conjugate,
    /// M is not positive definite along the path, which cannot be a minimum.
    Irregular,
}

/// A path along which the action is stationary.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StationaryPath {
    /// Nodes of the path.
    #[serde(skip)]
    pub path: Path,
    /// Action S, J·s.
    pub action: f64,
    /// Error of the action, estimated from a grid half as fine.
    pub action_error: f64,
    /// Error of the nodes, estimated likewise, in the units of the coordinates.
    pub path_error: f64,
    /// Residual force: the largest |∂S/∂q| / h of a node, in the units of the forces.
    pub residual: f64,
    /// Momenta at both ends, −∂S/∂q₀ and ∂S/∂q₁, `[n]` each.
    pub momenta: [Vec<f64>; 2],
    /// Velocities at both ends, from the momenta, `[n]` each.
    pub velocities: [Vec<f64>; 2],
    /// Energies at both ends, J; ∂S/∂T = −H.
    pub energies: [f64; 2],
    /// Kind of the path: whether it is a minimum of the action.
    #[serde(rename = "verdict")]
    pub kind: PathKind,
    /// Second variation: Morse index, conjugate times, and the mode of least curvature.
    pub second_variation: SecondVariation,
}

impl StationaryPath {
    /// Grade of the path by three criteria: the grid error relative to the extent of the path, other paths of equal
    /// action, and states of the path outside of those of the model's fit.
    #[must_use]
    pub fn judgement(&self, outside: Option<&Outside>) -> Judgement {
        let part = self.path_error / extent(&self.path).max(f64::MIN_POSITIVE);
        let percent = 100.0 * part;
        let coarse = format!("its error is {percent:.1} % of the way; more steps make it smaller");
        let resolved = Judgement::new(Grade::of_change(part), coarse);
        let kind = match self.kind {
            PathKind::Minimum | PathKind::Saddle => None,
            PathKind::Conjugate => {
                let why = "the ends are conjugate: a neighbouring path has the same action";
                Some(Judgement::new(Grade::Fair, why))
            }
            PathKind::Irregular => {
                let why = "M is not positive definite along it, which it is for every machine";
                Some(Judgement::new(Grade::Poor, why))
            }
        };
        let reasons = [Some(resolved), kind, extrapolation(outside)].into_iter();
        let reasons = reasons.flatten().filter(|own| own.grade != Grade::Good);
        let (grades, why): (Vec<_>, Vec<_>) = reasons.map(|own| (own.grade, own.why)).unzip();
        let grade = grades.into_iter().max().unwrap_or(Grade::Good);
        Judgement::new(grade, why.join("; "))
    }
}

/// Largest distance from the first node in any coordinate.
pub(super) fn extent(path: &Path) -> f64 {
    let first = path.node(0);
    let rows = path.q.chunks_exact(path.dof);
    rows.flat_map(|q| q.iter().zip(first))
        .fold(0.0, |far: f64, (a, b)| far.max((a - b).abs()))
}

impl StationaryPath {
    /// The stationary path on the finer of two grids; `path_error` is the largest error of a node.
    pub(super) fn of(
        lagrangian: &dyn Lagrangian,
        action: &mut DiscreteAction<'_>,
        [coarse, path]: [Path; 2],
        path_error: f64,
    ) -> Self {
        let fine = action.action(&path);
        let action_error = (fine - action.action(&coarse)).abs() / 3.0;
        let coarse_index = action.hessian(&coarse).0.factor().inertia();
        let second_variation = action.second_variation(&path);
        let gradient = action.gradient(&path).into_iter();
        let residual = gradient.fold(0.0, |r: f64, g| r.max(g.abs())) / path.step();
        let momenta = action.end_momenta(&path);
        let mut jets = lagrangian.jets();
        let last = path.segments();
        let mut end = |node: usize, segment: usize, p: &[f64]| {
            let pairs = path.node(segment).iter().zip(path.node(segment + 1));
            let start = pairs.map(|(a, b)| (b - a) / path.step()).collect();
            velocity(&mut *jets, path.node(node), p, start)
        };
        let (first, e0) = end(0, 0, &momenta[0]);
        let (last, e1) = end(last, last - 1, &momenta[1]);
        let kind = match second_variation.morse_index {
            _ if !second_variation.convex => PathKind::Irregular,
            index if index != coarse_index => PathKind::Conjugate,
            0 => PathKind::Minimum,
            _ => PathKind::Saddle,
        };
        Self {
            path,
            action: fine,
            action_error,
            path_error,
            residual,
            momenta,
            velocities: [first, last],
            energies: [e0, e1],
            kind,
            second_variation,
        }
    }

    /// The path as a trajectory. Velocities are central differences inside, and follow from the momenta at the ends.
    #[must_use]
    pub fn trajectory(&self, name: &str) -> Trajectory {
        let (path, last) = (&self.path, self.path.segments());
        let mut qd = self.velocities[0].clone();
        for k in 1..last {
            let pairs = path.node(k - 1).iter().zip(path.node(k + 1));
            qd.extend(pairs.map(|(a, b)| (b - a) / (2.0 * path.step())));
        }
        qd.extend(&self.velocities[1]);
        Trajectory::new(
            name,
            path.times(),
            Signals {
                q: path.q.clone(),
                qd,
                ..Signals::default()
            },
        )
    }

    /// Whether both are equal within rounding.
    pub(super) fn is_same(&self, other: &Self) -> bool {
        let apart = self.path.q.iter().zip(&other.path.q);
        let far = apart.fold(0.0, |far: f64, (a, b)| far.max((a - b).abs()));
        far <= 1e-6 * extent(&self.path) + 1e-12
    }
}

/// Velocity q̇ with ∂L/∂q̇ = p at q, by Newton's method from `qd`, which is also used where M is indefinite, and the energy there.
fn velocity(jets: &mut dyn Jets, q: &[f64], p: &[f64], mut qd: Vec<f64>) -> (Vec<f64>, f64) {
    let mut jet = Jet::default();
    let mut solver = SymmetricSolver::new(q.len());
    let mut step = vec![0.0; q.len()];
    for _ in 0..30 {
        jets.jet(q, &qd, &mut jet);
        let pairs = p.iter().zip(&jet.momentum);
        let missing: Vec<f64> = pairs.map(|(p, own)| p - own).collect();
        solver.solve(&jet.mass_matrix, &missing, &mut step);
        qd.iter_mut().zip(&step).for_each(|(v, d)| *v += d);
        let mut pairs = step.iter().zip(&qd);
        if pairs.all(|(d, v)| d.abs() <= 1e-13 * v.abs()) {
            break;
        }
    }
    jets.jet(q, &qd, &mut jet);
    let energy = dot(p, &qd) - jet.lagrangian[0];
    (qd, energy)
}
