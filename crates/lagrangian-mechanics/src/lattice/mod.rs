//! Lattices: many sites that obey one law with their neighbours (theory.md, section 34).
//!
//! ```text
//! L = Σᵢ ½ mᵢ q̇ᵢ² + Σ_b Σ_(i, j) of b [ ½ κ_b (q̇ⱼ − q̇ᵢ)² − W_b(qⱼ − qᵢ) ] − Σᵢ U(qᵢ)
//! ```
//!
//! A state costs O(sites): there is no mass matrix but the sparse one of κ, which is solved by conjugate gradients.

mod curve;

use serde::{Deserialize, Serialize};

use crate::dynamics::{Evaluation, Evaluator, Model};
use crate::forces::{Applied, Dissipation};
pub use curve::Basis;
use lagrangian_motion::solve::dot;
use lagrangian_motion::{Coordinates, Error, Result};

/// Bonds that obey one law.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Bonds {
    /// The difference of the indices of two neighbours.
    pub offset: usize,
    /// The two sites of each bond; the number of sites in place of one is a wall at 0.
    pub pairs: Vec<[usize; 2]>,
    /// The functions of W′, the force in a bond by its stretch.
    pub basis: Basis,
}

/// What bounds a chain of sites.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ends {
    /// The last site is a neighbour of the first.
    Ring,
    /// The first and the last sites are bound to walls at 0.
    Walls,
    /// Nothing.
    Free,
}

impl Bonds {
    /// The pairs of a chain of `sites` whose neighbours are `offset` apart.
    #[must_use]
    pub fn of_chain(sites: usize, offset: usize, ends: Ends) -> Vec<[usize; 2]> {
        let last = sites.saturating_sub(offset);
        let inner = (0..last).map(|i| [i, i + offset]);
        let others = match ends {
            // Half a turn apart is the same bond from both sides.
            Ends::Ring if 2 * offset == sites => Vec::new(),
            Ends::Ring => (last..sites).map(|i| [i, i + offset - sites]).collect(),
            Ends::Walls => {
                let left = (0..offset.min(sites)).map(|i| [sites, i]);
                left.chain((last..sites).map(|i| [i, sites])).collect()
            }
            Ends::Free => Vec::new(),
        };
        inner.chain(others).collect()
    }

    /// The same bonds of a chain of another number of sites; `None` where they are not those of a chain.
    fn resized(&self, from: usize, to: usize) -> Option<Self> {
        let all = [Ends::Ring, Ends::Walls, Ends::Free];
        let ends = all
            .into_iter()
            .find(|ends| Self::of_chain(from, self.offset, *ends) == self.pairs)?;
        Some(Self {
            pairs: Self::of_chain(to, self.offset, ends),
            ..self.clone()
        })
    }
}

/// All of a lattice but its parameters.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LatticeShape {
    /// The bonds, by law.
    pub bonds: Vec<Bonds>,
    /// The functions of U′, the force that holds each site, where there is one.
    pub site: Option<Basis>,
}

impl LatticeShape {
    /// The number of parameters of `sites`: a mass for each; the coefficients of W′ and κ for each law; those of U′.
    #[must_use]
    pub fn parameters(&self, sites: usize) -> usize {
        let bonds = self.bonds.iter().map(|own| own.basis.count() + 1);
        sites + bonds.sum::<usize>() + self.site.map_or(0, |own| own.count())
    }

    fn check(&self, sites: usize) -> Result<()> {
        let bases = self
            .bonds
            .iter()
            .map(|own| &own.basis)
            .chain(self.site.as_ref());
        bases.into_iter().try_for_each(Basis::check)?;
        let wrong = |[i, j]: &&[usize; 2]| *i.max(j) > sites || i == j;
        let mut pairs = self.bonds.iter().flat_map(|own| &own.pairs);
        match pairs.find(wrong) {
            Some(pair) => {
                let must =
                    "of two sites, counted from 0, or of one and the number of sites for a wall";
                Err(Error::argument("bond", format!("{pair:?}"), must))
            }
            None => Ok(()),
        }
    }
}

/// Many sites that obey one law with their neighbours, and friction.
///
/// ```
/// use lagrangian_mechanics::Quantities;
/// use lagrangian_mechanics::lattice::{Basis, Bonds, Ends, Lattice, LatticeShape};
/// use lagrangian_motion::Coordinates;
///
/// // Springs of stiffness 4 between 100 unit masses on a ring, each held by one of stiffness 1.
/// let springs = Bonds { offset: 1, pairs: Bonds::of_chain(100, 1, Ends::Ring), basis: Basis::Powers { degree: 1 } };
/// let shape = LatticeShape { bonds: vec![springs], site: Some(Basis::Powers { degree: 1 }) };
/// let parameters = [vec![1.0; 100], vec![0.0, 4.0, 0.0], vec![0.0, 1.0]].concat();
/// let ring = Lattice::new(Coordinates::lines(100), shape, parameters, None)?;
/// let mut q = vec![0.0; 100];
/// q[7] = 0.1;
/// let qdd = ring.forward_dynamics(&q, &[0.0; 100], &[0.0; 100])?;
/// assert!((qdd[7] + 0.9).abs() < 1e-12 && (qdd[6] - 0.4).abs() < 1e-12);
/// # Ok::<(), lagrangian_motion::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Lattice {
    coordinates: Coordinates,
    shape: LatticeShape,
    parameters: Vec<f64>,
    dissipation: Option<Dissipation>,
}

impl Lattice {
    /// A lattice with these parameters, in the order of [`LatticeShape::parameters`].
    ///
    /// # Errors
    /// [`Error::Argument`] for bonds of other sites, or masses that are not positive; [`Error::Shape`] for another number of
    /// parameters; [`Error::NotFinite`]; as [`Dissipation::validate`].
    pub fn new(
        coordinates: Coordinates,
        shape: LatticeShape,
        parameters: Vec<f64>,
        dissipation: Option<Dissipation>,
    ) -> Result<Self> {
        let sites = coordinates.dof();
        shape.check(sites)?;
        let remedy =
            "give a mass for each site, the coefficients and κ of each law, those of the sites";
        let expected = shape.parameters(sites);
        Error::check_shape(
            "parameters of a lattice",
            parameters.len(),
            expected,
            remedy,
        )?;
        Error::check_finite("parameters of a lattice", &parameters)?;
        if let Some(mass) = parameters[..sites].iter().find(|mass| **mass <= 0.0) {
            return Err(Error::argument("mass", mass, "above 0"));
        }
        dissipation.iter().try_for_each(|own| own.validate(sites))?;
        let lattice = Self {
            coordinates,
            shape,
            parameters,
            dissipation,
        };
        let inertias = lattice.laws().map(|own| own.inertia);
        let least = inertias.fold(0.0, f64::min);
        match least < 0.0 {
            true => Err(Error::argument("inertia of a bond", least, "at least 0")),
            false => Ok(lattice),
        }
    }

    /// The bonds and what holds the sites.
    #[must_use]
    pub fn shape(&self) -> &LatticeShape {
        &self.shape
    }

    /// All parameters, in the order of [`LatticeShape::parameters`].
    #[must_use]
    pub fn parameters(&self) -> &[f64] {
        &self.parameters
    }

    /// The mass of each site.
    #[must_use]
    pub fn masses(&self) -> &[f64] {
        &self.parameters[..self.sites()]
    }

    /// Friction, where there is some.
    #[must_use]
    pub fn dissipation(&self) -> Option<&Dissipation> {
        self.dissipation.as_ref()
    }

    /// The coefficients of W′, and κ, of each law.
    pub fn laws(&self) -> impl Iterator<Item = Law<'_>> {
        let mut rest = &self.parameters[self.sites()..];
        self.shape.bonds.iter().map(move |bonds| {
            let (own, others) = rest.split_at(bonds.basis.count() + 1);
            rest = others;
            let (inertia, coefficients) = (own[own.len() - 1], &own[..own.len() - 1]);
            Law {
                bonds,
                coefficients,
                inertia,
            }
        })
    }

    /// The functions and coefficients of U′, where there is one.
    #[must_use]
    pub fn site(&self) -> Option<(Basis, &[f64])> {
        let basis = self.shape.site?;
        let first = self.parameters.len() - basis.count();
        Some((basis, &self.parameters[first..]))
    }

    /// The same law on a chain of another number of sites.
    ///
    /// # Errors
    /// [`Error::Setting`] for a lattice that is not a chain of equal sites; [`Error::Argument`] for fewer sites than its bonds span.
    pub fn resized(&self, sites: usize) -> Result<Self> {
        let own = self.sites();
        let equal = |all: &[f64]| all.iter().all(|x| x.total_cmp(&all[0]).is_eq());
        let bonds = self
            .shape
            .bonds
            .iter()
            .map(|bonds| bonds.resized(own, sites));
        let bonds: Option<Vec<Bonds>> = bonds.collect();
        let dissipation = self.dissipation.as_ref();
        let (Some(bonds), true) = (
            bonds,
            equal(self.masses()) && dissipation.is_none_or(|own| equal(&own.viscous)),
        ) else {
            return Err(Error::setting(
                "this lattice is not a chain of equal sites, so that its law does not say what more sites would do",
                "record as many sites as are needed",
            ));
        };
        let span = bonds.iter().map(|bonds| 2 * bonds.offset).max();
        if sites <= span.unwrap_or(0) || sites > MOST_SITES {
            let must = "above twice the distance of neighbours, and at most 1000000";
            return Err(Error::argument("sites", sites, must));
        }
        let first = &self.coordinates.0[0];
        let stem = first.name.trim_end_matches(|c: char| c.is_ascii_digit());
        let named = (1..=sites).map(|i| lagrangian_motion::Coordinate {
            name: format!("{stem}{i}"),
            ..first.clone()
        });
        let masses = vec![self.masses()[0]; sites];
        Self::new(
            Coordinates(named.collect()),
            LatticeShape {
                bonds,
                site: self.shape.site,
            },
            [&masses, &self.parameters[own..]].concat(),
            dissipation.map(|own| Dissipation::viscous(vec![own.viscous[0]; sites])),
        )
    }

    fn sites(&self) -> usize {
        self.coordinates.dof()
    }

    fn is_coupled(&self) -> bool {
        self.laws().any(|own| own.inertia != 0.0)
    }

    /// The stretch of a bond between two sites; that of the number of sites is a wall.
    fn stretch(&self, q: &[f64], [i, j]: [usize; 2]) -> f64 {
        let at = |i: usize| q.get(i).copied().unwrap_or(0.0);
        self.coordinates.difference(0, at(j), at(i))
    }

    /// Adds the forces of bonds and sites.
    fn add_forces(&self, q: &[f64], force: &mut [f64]) {
        for law in self.laws() {
            for [i, j] in law.bonds.pairs.iter().copied() {
                let stretch = self.stretch(q, [i, j]);
                let pull = law.bonds.basis.value(law.coefficients, stretch);
                add(force, i, pull);
                add(force, j, -pull);
            }
        }
        if let Some((basis, coefficients)) = self.site() {
            let each = q.iter().zip(force);
            each.for_each(|(q, force)| *force -= basis.value(coefficients, *q));
        }
    }

    fn potential(&self, q: &[f64]) -> f64 {
        let of_bonds = self.laws().map(|law| {
            let pairs = law.bonds.pairs.iter();
            let each = pairs.map(|pair| self.stretch(q, *pair));
            each.map(|own| law.bonds.basis.integral(law.coefficients, own))
                .sum::<f64>()
        });
        let of_sites = self.site().map(|(basis, coefficients)| {
            let each = q.iter().map(|q| basis.integral(coefficients, *q));
            each.sum::<f64>()
        });
        of_bonds.chain(of_sites).sum()
    }

    /// Writes M x.
    fn weigh(&self, x: &[f64], out: &mut [f64]) {
        let each = out.iter_mut().zip(self.masses().iter().zip(x));
        each.for_each(|(out, (mass, x))| *out = mass * x);
        for law in self.laws().filter(|own| own.inertia != 0.0) {
            for [i, j] in law.bonds.pairs.iter().copied() {
                let at = |i: usize| x.get(i).copied().unwrap_or(0.0);
                let push = law.inertia * (at(j) - at(i));
                add(out, i, -push);
                add(out, j, push);
            }
        }
    }
}

/// The largest number of sites of a chain.
const MOST_SITES: usize = 1_000_000;

/// One law of bonds with its parameters.
#[derive(Debug, Clone, Copy)]
pub struct Law<'a> {
    /// The bonds that obey it.
    pub bonds: &'a Bonds,
    /// The coefficients of W′.
    pub coefficients: &'a [f64],
    /// κ, the inertia of the rate of a stretch.
    pub inertia: f64,
}

/// Adds a force to a site; a wall takes any.
fn add(force: &mut [f64], site: usize, by: f64) {
    if let Some(force) = force.get_mut(site) {
        *force += by;
    }
}

impl Model for Lattice {
    fn coordinates(&self) -> &Coordinates {
        &self.coordinates
    }

    fn evaluator(&self) -> Box<dyn Evaluator + '_> {
        Box::new(LatticeEvaluator {
            lattice: self,
            coupled: self.is_coupled(),
            force: vec![0.0; self.sites()],
            descent: [const { Vec::new() }; 3].map(|_: Vec<f64>| vec![0.0; self.sites()]),
        })
    }
}

/// Evaluates a lattice.
struct LatticeEvaluator<'a> {
    lattice: &'a Lattice,
    coupled: bool,
    force: Vec<f64>,
    /// The residual, the direction and M times it, of conjugate gradients.
    descent: [Vec<f64>; 3],
}

/// The largest number of sites whose mass matrix is written out.
const MOST_PAIRED: usize = 128;

/// A residual of M x = b in parts of b, squared, that is rounding.
const ROUNDING: f64 = 1e-30;

impl LatticeEvaluator<'_> {
    /// Solves M x = force by conjugate gradients from x = force / m; whether it is solved.
    fn solve(&mut self, x: &mut [f64]) -> bool {
        let Self {
            lattice,
            force,
            descent: [residual, direction, weighed],
            coupled,
        } = self;
        let each = x.iter_mut().zip(force.iter().zip(lattice.masses()));
        each.for_each(|(x, (force, mass))| *x = force / mass);
        if !*coupled {
            return true;
        }
        lattice.weigh(x, weighed);
        for (residual, (force, weighed)) in residual.iter_mut().zip(force.iter().zip(&*weighed)) {
            *residual = force - weighed;
        }
        direction.copy_from_slice(residual);
        let least = ROUNDING * dot(force, force);
        let mut square = dot(residual, residual);
        for _ in 0..2 * x.len() {
            if square <= least {
                return true;
            }
            lattice.weigh(direction, weighed);
            let along = square / dot(direction, weighed);
            for k in 0..x.len() {
                x[k] += along * direction[k];
                residual[k] -= along * weighed[k];
            }
            let next = dot(residual, residual);
            for (direction, residual) in direction.iter_mut().zip(&*residual) {
                *direction = residual + next / square * *direction;
            }
            square = next;
        }
        square <= 1e10 * least
    }
}

impl Evaluator for LatticeEvaluator<'_> {
    fn forward_dynamics(
        &mut self,
        q: &[f64],
        qd: &[f64],
        tau: &[f64],
        qdd: &mut [f64],
    ) -> Evaluation {
        let n = self.force.len().max(1);
        let mut singular = 0;
        let states = q.chunks_exact(n).zip(qd.chunks_exact(n));
        let signals = tau.chunks_exact(n).zip(qdd.chunks_exact_mut(n));
        for ((q, qd), (tau, qdd)) in states.zip(signals) {
            self.force.copy_from_slice(tau);
            self.lattice.add_forces(q, &mut self.force);
            if let Some(own) = &self.lattice.dissipation {
                own.take_out(qd, &mut self.force);
            }
            singular += usize::from(!self.solve(qdd));
        }
        Evaluation::of(qdd, n, singular)
    }

    fn inverse_dynamics(
        &mut self,
        q: &[f64],
        qd: &[f64],
        qdd: &[f64],
        tau: &mut [f64],
    ) -> Evaluation {
        let n = self.force.len().max(1);
        let states = q.chunks_exact(n).zip(qd.chunks_exact(n));
        let signals = qdd.chunks_exact(n).zip(tau.chunks_exact_mut(n));
        for ((q, qd), (qdd, tau)) in states.zip(signals) {
            self.lattice.weigh(qdd, tau);
            self.force.fill(0.0);
            self.lattice.add_forces(q, &mut self.force);
            let each = tau.iter_mut().zip(&self.force);
            each.for_each(|(tau, force)| *tau -= force);
            if let Some(own) = &self.lattice.dissipation {
                own.put_in(qd, tau);
            }
        }
        Evaluation::of(tau, n, 0)
    }

    /// Not of more sites than a matrix of all pairs is good for.
    fn mass_matrix(&mut self, q: &[f64], _: &[f64], mass: &mut [f64]) -> Evaluation {
        let n = self.force.len().max(1);
        if n > MOST_PAIRED {
            return Evaluation::Unsupported;
        }
        let mut unit = vec![0.0; n];
        for mass in mass.chunks_exact_mut(n * n).take(q.len() / n) {
            for (i, row) in mass.chunks_exact_mut(n).enumerate() {
                unit[i] = 1.0;
                self.lattice.weigh(&unit, row);
                unit[i] = 0.0;
            }
        }
        Evaluation::Regular
    }

    fn bias(&mut self, q: &[f64], _: &[f64], bias: &mut [f64]) -> Evaluation {
        let n = self.force.len().max(1);
        for (q, bias) in q.chunks_exact(n).zip(bias.chunks_exact_mut(n)) {
            bias.fill(0.0);
            self.lattice.add_forces(q, bias);
            bias.iter_mut().for_each(|x| *x = -*x);
        }
        Evaluation::of(bias, n, 0)
    }

    fn momentum(&mut self, _: &[f64], qd: &[f64], p: &mut [f64]) -> Evaluation {
        let n = self.force.len().max(1);
        for (qd, p) in qd.chunks_exact(n).zip(p.chunks_exact_mut(n)) {
            self.lattice.weigh(qd, p);
        }
        Evaluation::of(p, n, 0)
    }

    fn energy(&mut self, q: &[f64], qd: &[f64], energy: &mut [f64]) -> Evaluation {
        let n = self.force.len().max(1);
        let states = q.chunks_exact(n).zip(qd.chunks_exact(n));
        for ((q, qd), energy) in states.zip(energy.iter_mut()) {
            self.lattice.weigh(qd, &mut self.force);
            *energy = 0.5 * dot(&self.force, qd) + self.lattice.potential(q);
        }
        Evaluation::of(energy, 1, 0)
    }

    fn applied(&self) -> Applied<'_> {
        Applied {
            dissipation: self.lattice.dissipation.as_ref(),
            ..Applied::default()
        }
    }
}
