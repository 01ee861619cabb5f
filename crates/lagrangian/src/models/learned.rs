//! Fitted models of any family, behind one type.

use std::any::Any;
use std::fmt::Debug;
use std::sync::Arc;

use serde::Serialize;
use serde_json::Value;

use super::FAMILIES;
use super::family::{EXPERIMENT, experiment};
use super::lattice::family::LearnedLattice;
use super::named::{Named, Parameter};
use crate::saved::WEIGHTS;
use crate::saved::{self, Header, Provenance, SavedModel, Tensor};
use lagrangian_mechanics::Visited;
use lagrangian_mechanics::dynamics::{
    Driven, EulerLagrange, Evaluator, Integration, Mechanical, Model,
};
use lagrangian_mechanics::expression::{self, Equations, Graph};
use lagrangian_mechanics::forces::{Actuation, Applied, Dissipation};
use lagrangian_mechanics::hamiltonian::Hamiltonian;
use lagrangian_mechanics::lagrangian::{Lagrangian, Sum};
use lagrangian_mechanics::rigid::{RigidBodies, RobotShape};
use lagrangian_motion::{Constraint, Coordinates, Result};

/// A fitted model of any family, with the states that its data visited.
#[derive(Debug, Clone)]
pub struct Learned {
    model: Arc<dyn FittedModel>,
    visited: Option<Visited>,
}

/// A fitted model: its motion, its description and its saved form.
pub trait FittedModel: Model + Any + Debug {
    /// The description of the model.
    fn description(&self) -> Description;

    /// The saved form of the model.
    ///
    /// # Errors
    /// [`crate::Error::DamagedModel`] where its description cannot be written.
    fn stored(&self) -> Result<Stored>;

    /// The parts of the model.
    fn parts(&self) -> ModelParts<'_> {
        ModelParts::default()
    }

    /// The parameters of the model that have a name and a unit.
    fn parameters(&self) -> Vec<Parameter> {
        let forces = self.parts().forces;
        Named::of(self.coordinates()).forces(forces).list()
    }

    /// The law of the model as it is written; `None` for one that is no formula.
    fn written(&self) -> Option<WrittenLaw> {
        None
    }

    /// The motion of the model with a shared Lagrangian, for the sum with a nominal model; `None` for a model that cannot be
    /// combined with one.
    fn shared_motion(&self) -> Option<Mechanical<Arc<dyn LearnedLagrangian>>> {
        None
    }

    /// The model with inertia added to its drives, kg·m² or kg, `[n]`; `None` for one without drives.
    fn with_added_inertia(&self, added: &[f64]) -> Option<Learned> {
        let _ = added;
        None
    }

    /// The equations of the model as expressions of a graph.
    ///
    /// # Errors
    /// [`crate::Error::Setting`] for a model whose equations cannot be written down.
    fn equations(&self, graph: Graph) -> Result<Equations> {
        let parts = self.parts();
        let lagrangian = parts.lagrangian.ok_or_else(|| {
            expression::without(&format!(
                "a model of the family {}",
                self.description().family
            ))
        })?;
        expression::of(graph, lagrangian, &parts.forces)
    }
}

/// The parts of a fitted model; `None` for those that it does not have.
#[derive(Clone, Copy, Default)]
#[allow(
    missing_debug_implementations,
    reason = "trait objects have nothing to show"
)]
pub struct ModelParts<'a> {
    /// The Lagrangian.
    pub lagrangian: Option<&'a dyn Lagrangian>,
    /// The Hamiltonian, where the model moves by one in (q, p).
    pub hamiltonian: Option<&'a dyn Hamiltonian>,
    /// The forces beside those of the Lagrangian.
    pub forces: Applied<'a>,
    /// The nominal model beneath it.
    pub nominal: Option<&'a RigidBodies>,
    /// The robot that was identified, whose joints are the coordinates.
    pub robot: Option<&'a RigidBodies>,
    /// The points that are its coordinates, and what joins them.
    pub linkage: Option<Linkage<'a>>,
}

/// Points in Cartesian coordinates, and what joins them.
#[derive(Debug, Clone, Copy)]
pub struct Linkage<'a> {
    /// The coordinates of each point.
    pub points: &'a [Vec<usize>],
    /// The relations between them.
    pub constraints: &'a [Constraint],
}

/// The description of a fitted model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Description {
    /// The name of the family.
    pub family: &'static str,
    /// The kind of the model in words, such as "A Lagrangian".
    pub what: &'static str,
    /// Whether the motion obeys mechanics, as that of a plain network does not.
    pub mechanical: bool,
}

impl Description {
    /// A model whose motion obeys mechanics.
    pub(crate) const fn mechanical(family: &'static str, what: &'static str) -> Self {
        Self {
            family,
            what,
            mechanical: true,
        }
    }

    /// A model for comparison, whose motion need not obey mechanics.
    pub(crate) const fn plain(family: &'static str, what: &'static str) -> Self {
        Self {
            family,
            what,
            mechanical: false,
        }
    }
}

/// The saved form of a model, apart from its coordinates and forces.
#[derive(Debug, Clone, Default)]
pub struct Stored {
    /// The name of the saved form.
    pub name: String,
    /// The form within the family.
    pub form: Option<String>,
    /// The sizes and activations.
    pub architecture: Value,
    /// The scales.
    pub scaling: Value,
    /// The nominal model beneath it.
    pub nominal: Value,
    /// The tensors by name.
    pub tensors: Vec<(&'static str, Vec<f64>)>,
}

impl Stored {
    /// The saved form of a model with these weights.
    pub(crate) fn new(
        name: &str,
        architecture: &impl Serialize,
        scaling: &impl Serialize,
        weights: &[f64],
    ) -> Result<Self> {
        Ok(Self {
            name: name.into(),
            architecture: saved::describe(architecture)?,
            scaling: saved::describe(scaling)?,
            tensors: vec![(WEIGHTS, weights.to_vec())],
            ..Self::default()
        })
    }

    /// Adds the form within the family.
    pub(crate) fn with_form(mut self, form: &impl Serialize) -> Result<Self> {
        self.form = saved::describe(form)?.as_str().map(String::from);
        Ok(self)
    }

    /// Adds a tensor.
    pub(crate) fn with(mut self, name: &'static str, values: &[f64]) -> Self {
        self.tensors.push((name, values.to_vec()));
        self
    }
}

/// A law as it is written.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct WrittenLaw {
    /// As plain text, such as `L = 0.5 q1'^2 + 9.810(2) cos(q1)`, and what friction does.
    pub text: String,
    /// For LaTeX.
    pub latex: String,
    /// `law`, `expansion` or `none`.
    pub verdict: String,
    /// What that means.
    pub meaning: String,
    /// Whether it explains the data so well that a fit that names no family tries no other model.
    #[serde(skip)]
    pub explains: bool,
}

impl WrittenLaw {
    /// Whether it is the law.
    #[must_use]
    pub fn is_law(&self) -> bool {
        self.verdict == "law"
    }
}

/// A learned Lagrangian.
pub trait LearnedLagrangian: Lagrangian + Any + Debug {
    /// The description of the Lagrangian.
    fn description(&self) -> Description;

    /// The saved form of the Lagrangian.
    ///
    /// # Errors
    /// [`crate::Error::DamagedModel`] where its description cannot be written.
    fn stored(&self) -> Result<Stored>;

    /// The Lagrangian as it is written, with this friction beside it; `None` for one that is no formula.
    fn written(&self, friction: Option<&Dissipation>) -> Option<WrittenLaw> {
        let _ = friction;
        None
    }

    /// The coefficients of its terms, where it is a sum of some.
    fn terms(&self) -> Vec<Parameter> {
        Vec::new()
    }

    /// The standard errors of the friction beside it, where they are known: viscous, Coulomb and by drag, `[3, n]`, then of dampers between
    /// coordinates, `[n, n]`; else empty.
    fn friction_errors(&self) -> &[f64] {
        &[]
    }

    /// The inertias of rotors, kg·m², `[n]`, where it keeps them apart; else empty.
    fn rotors(&self) -> &[f64] {
        &[]
    }

    /// The Lagrangian with inertia added to its rotors, kg·m² or kg, `[n]`, where it keeps these apart.
    fn with_added_inertia(&self, added: &[f64]) -> Option<Self>
    where
        Self: Sized,
    {
        let _ = added;
        None
    }
}

impl<L: LearnedLagrangian + Clone> FittedModel for Mechanical<L> {
    fn description(&self) -> Description {
        self.lagrangian.description()
    }

    fn stored(&self) -> Result<Stored> {
        self.lagrangian.stored()
    }

    fn parts(&self) -> ModelParts<'_> {
        ModelParts {
            lagrangian: Some(&self.lagrangian),
            forces: self.applied(),
            ..ModelParts::default()
        }
    }

    fn parameters(&self) -> Vec<Parameter> {
        let terms = Named::of(self.coordinates()).terms(self.lagrangian.terms());
        let terms = terms.with_friction_errors(self.lagrangian.friction_errors());
        let forces = terms.forces(self.applied());
        forces.rotors(self.lagrangian.rotors()).list()
    }

    fn written(&self) -> Option<WrittenLaw> {
        self.lagrangian.written(self.applied().dissipation)
    }

    fn with_added_inertia(&self, added: &[f64]) -> Option<Learned> {
        let lagrangian = self.lagrangian.with_added_inertia(added)?;
        Some(self.clone().with(|_| Ok(lagrangian)).ok()?.into())
    }

    fn shared_motion(&self) -> Option<Mechanical<Arc<dyn LearnedLagrangian>>> {
        let shared = |lagrangian: L| Ok(Arc::new(lagrangian) as Arc<dyn LearnedLagrangian>);
        self.clone().with(shared).ok()
    }
}

/// The sum of a nominal model and of a network that learned the forces that it omits.
type WithNominal = Sum<RigidBodies, Arc<dyn LearnedLagrangian>>;

/// The prefix of the family of a network with a nominal model.
const NOMINAL: &str = "nominal+";

impl FittedModel for Mechanical<WithNominal> {
    fn description(&self) -> Description {
        let family = self.lagrangian.rest().description().family;
        Description::mechanical(
            family,
            "A robot and a Lagrangian of what its description leaves",
        )
    }

    fn stored(&self) -> Result<Stored> {
        let mut stored = self.lagrangian.rest().stored()?;
        stored.name.insert_str(0, NOMINAL);
        stored.nominal = saved::describe(&RobotShape::of(self.lagrangian.known()))?;
        Ok(stored)
    }

    fn parts(&self) -> ModelParts<'_> {
        ModelParts {
            lagrangian: Some(&self.lagrangian),
            forces: self.applied(),
            nominal: Some(self.lagrangian.known()),
            ..ModelParts::default()
        }
    }
}

impl<M: FittedModel> From<M> for Learned {
    fn from(model: M) -> Self {
        Self {
            model: Arc::new(model),
            visited: None,
        }
    }
}

impl Model for Learned {
    fn coordinates(&self) -> &Coordinates {
        self.model.coordinates()
    }

    fn moves(&self) -> bool {
        self.model.moves()
    }

    fn nominal(&self) -> Option<&dyn Model> {
        let robot = self.model.parts().nominal;
        robot.map(|robot| robot as &dyn Model)
    }

    fn evaluator(&self) -> Box<dyn Evaluator + '_> {
        self.model.evaluator()
    }

    fn mechanics(&self) -> Option<EulerLagrange<'_>> {
        self.model.mechanics()
    }

    fn driven(&self) -> Option<&dyn Driven> {
        self.model.driven()
    }

    fn integration(&self) -> Integration<'_> {
        self.model.integration()
    }

    fn visited(&self) -> Option<&Visited> {
        self.visited.as_ref()
    }
}

impl Learned {
    /// The law of the model as it is written; `None` for one that is no formula.
    #[must_use]
    pub fn written(&self) -> Option<WrittenLaw> {
        self.model.written()
    }

    /// The model with inertia added to its drives, kg·m² or kg, `[n]`; `None` for one without drives.
    pub(crate) fn with_added_inertia(&self, added: &[f64]) -> Option<Self> {
        let model = self.model.with_added_inertia(added)?;
        Some(Self {
            visited: self.visited.clone(),
            ..model
        })
    }

    /// The model with the states that its data visited, beyond which a correction of a nominal model fades.
    pub(crate) fn with_visited(self, visited: Option<Visited>) -> Self {
        let corrected = self.downcast_ref::<Mechanical<WithNominal>>();
        let limited = corrected.zip(visited.clone()).and_then(|(own, visited)| {
            let sum = own.clone().with(|sum| Ok(sum.limited_to(visited)));
            Some(Arc::new(sum.ok()?) as Arc<dyn FittedModel>)
        });
        Self {
            model: limited.unwrap_or(self.model),
            visited,
        }
    }

    /// The model, if it is one of type `M`, such as `Mechanical<Lnn>`.
    #[must_use]
    pub fn downcast_ref<M: FittedModel>(&self) -> Option<&M> {
        (&*self.model as &dyn Any).downcast_ref()
    }

    /// The Lagrangian that was learned, if it is one of type `L`, such as [`Lnn`](crate::models::Lnn).
    #[must_use]
    pub fn lagrangian_as<L: LearnedLagrangian + Clone>(&self) -> Option<&L> {
        self.downcast_ref::<Mechanical<L>>()
            .map(|model| &model.lagrangian)
    }

    /// The name of the family.
    #[must_use]
    pub fn family(&self) -> &'static str {
        self.model.description().family
    }

    /// The description of the model.
    #[must_use]
    pub fn description(&self) -> Description {
        self.model.description()
    }

    /// The Lagrangian, where the model has one.
    #[must_use]
    pub fn lagrangian(&self) -> Option<&dyn Lagrangian> {
        self.model.parts().lagrangian
    }

    /// The equations of the model as expressions of a graph, for code generators.
    ///
    /// # Errors
    /// [`crate::Error::Setting`] for a model whose equations cannot be written down.
    pub fn equations(&self, graph: Graph) -> Result<Equations> {
        self.model.equations(graph)
    }

    /// The law of a lattice on another number of sites.
    ///
    /// # Errors
    /// [`crate::Error::Setting`] for a model that is not a chain of equal sites; [`crate::Error::Argument`] for too few sites.
    pub fn with_sites(&self, sites: usize) -> Result<Self> {
        let lattice = self.downcast_ref::<LearnedLattice>();
        let none = || {
            crate::Error::setting(
                format!("a model of the family {} has no sites", self.family()),
                "fit one of `family` lattice",
            )
        };
        lattice.ok_or_else(none)?.with_sites(sites)
    }

    /// The Hamiltonian, where the model moves by one in (q, p).
    #[must_use]
    pub fn hamiltonian(&self) -> Option<&dyn Hamiltonian> {
        self.model.parts().hamiltonian
    }

    /// The friction, where it exists.
    #[must_use]
    pub fn dissipation(&self) -> Option<&Dissipation> {
        self.model.parts().forces.dissipation
    }

    /// The map from inputs to forces, where inputs are not the forces themselves.
    #[must_use]
    pub fn actuation(&self) -> Option<&Actuation> {
        self.model.parts().forces.actuation
    }

    /// The nominal model beneath it, where there is one.
    #[must_use]
    pub fn nominal(&self) -> Option<&RigidBodies> {
        self.model.parts().nominal
    }

    /// The robot whose joints are the coordinates, where the model has one: identified, or nominal.
    #[must_use]
    pub fn robot(&self) -> Option<&RigidBodies> {
        let parts = self.model.parts();
        parts.robot.or(parts.nominal)
    }

    /// The points that are the coordinates, and what joins them, where the model is one of points.
    #[must_use]
    pub fn linkage(&self) -> Option<Linkage<'_>> {
        self.model.parts().linkage
    }

    /// The parameters that have a name and a unit: friction, offsets, gains, rotor inertias, or all of an identified robot. The
    /// units of a model of free motions show that its forces and inertias are known up to one common factor.
    #[must_use]
    pub fn parameters(&self) -> Vec<Parameter> {
        let mut parameters = self.model.parameters();
        if self.visited.as_ref().is_some_and(Visited::is_free) {
            parameters.iter_mut().for_each(Parameter::up_to_a_factor);
        }
        parameters
    }

    /// The sum of a nominal model and of a network that learned the forces that it omits.
    pub(crate) fn with_nominal(
        nominal: RigidBodies,
        rest: Mechanical<Arc<dyn LearnedLagrangian>>,
    ) -> Result<Self> {
        Ok(rest.with(|rest| Sum::new(nominal, rest))?.into())
    }

    /// The saved form of the model with its provenance.
    ///
    /// # Errors
    /// [`crate::Error::Tensor`] where a weight is not finite, [`crate::Error::DamagedModel`] where its description cannot be
    /// written.
    pub fn save(&self, provenance: Provenance) -> Result<SavedModel> {
        let stored = self.model.stored()?;
        let header = Header {
            family: stored.name,
            form: stored.form,
            coordinates: self.coordinates().clone(),
            architecture: stored.architecture,
            scaling: stored.scaling,
            dissipation: saved::describe(&self.dissipation())?,
            actuation: saved::describe(&self.actuation())?,
            nominal: stored.nominal,
            visited: self.visited.clone(),
            provenance,
        };
        let tensor = |(name, values): (&str, Vec<f64>)| {
            Ok((name.to_string(), Tensor::new(vec![values.len()], values)?))
        };
        let tensors = stored.tensors.into_iter().map(tensor);
        Ok(SavedModel {
            header,
            tensors: tensors.collect::<Result<_>>()?,
        })
    }

    /// The model of a saved form.
    ///
    /// # Errors
    /// [`crate::Error::DamagedModel`] for an unknown family or a description that does not fit its family;
    /// [`crate::Error::Tensor`], [`crate::Error::Shape`] or [`crate::Error::Argument`] for weights that do not belong to it.
    pub fn load(saved: &SavedModel) -> Result<Self> {
        if let Some(visited) = &saved.header.visited {
            visited.check(&saved.header.coordinates)?;
        }
        Ok(Self::without_visited(saved)?.with_visited(saved.header.visited.clone()))
    }

    fn without_visited(saved: &SavedModel) -> Result<Self> {
        let header = &saved.header;
        let Some(family) = header.family.strip_prefix(NOMINAL) else {
            return load(saved);
        };
        let mut rest = saved.clone();
        rest.header.family = family.into();
        let rest = load(&rest)?.model.shared_motion().ok_or_else(|| {
            saved::damaged(format!(
                "'{family}' cannot be combined with a nominal model"
            ))
        })?;
        let shape: RobotShape = saved::read("nominal model", &header.nominal)?;
        Self::with_nominal(shape.bodies(&header.coordinates)?, rest)
    }
}

/// Loads a model by the row of its family.
fn load(saved: &SavedModel) -> Result<Learned> {
    let name = &*saved.header.family;
    match FAMILIES.iter().find(|entry| entry.saved_as.contains(&name)) {
        Some(entry) => (entry.load)(saved),
        None if name == EXPERIMENT => Err(experiment()),
        None => Err(saved::damaged(format!(
            "'{name}' is not a known family of models"
        ))),
    }
}
