//! Hamiltonian networks as a family: their losses and data, their training, their saved form.

use serde_json::Value;

use super::{Hnn, HnnConfig, HnnShape, HnnStructure};
use crate::dataset::{Dataset, Momenta};
use crate::models::NetworkShape;
use crate::models::family::{
    self, Abilities, BoxedLearner, Entry, Family, Plan, Residuals, Trained,
};
use crate::models::learned::{Description, FittedModel, Learned, ModelParts, Stored};
use crate::models::settings as shared;
use crate::models::setup::Setup;
use crate::saved::SavedModel;
use crate::train::{AutoSetting, DataFacts, FitSpec, ForceTerms, Loss, TrainingTask};
use lagrangian_mechanics::expression::{Equations, Graph};
use lagrangian_mechanics::hamiltonian::{Canonical, Hamiltonian};
use lagrangian_mechanics::lagrangian::Lagrangian;
use lagrangian_motion::settings::{Kind, Range, Setting, named};
use lagrangian_motion::{Error, Result};
use nets::simd::Real;

/// The row of the table of families.
pub(crate) const ENTRY: Entry = Entry {
    name: NAME,
    about: "Hamiltonian network H(q, p), fitted to (q̇, ṗ) or to motions in (q, p)",
    default: family::default::<HnnConfig>,
    settings: SETTINGS,
    choose,
    read,
    saved_as: &[NAME],
    load,
    candidates: &[],
    jointed: false,
};

const NAME: &str = "hnn";

/// The settings of a Hamiltonian network.
const SETTINGS: &[Setting] = &[
    shared::SPEED_LIMIT,
    shared::WIDTH,
    shared::LAYERS,
    shared::ACTIVATION,
    shared::DISSIPATION,
    shared::FORCES,
    Setting::new(
        "structure",
        Kind::Choice(&[
            named("free", "Any function of q and p"),
            named("mass", "½ pᵀM⁻¹(q)p + V(q), M positive definite by construction"),
            named("none", "None: a plain network of the flow"),
        ]),
        "Any Hamiltonian, one with a mass matrix, or none: the plain flow (q, q̇) → (q̇, q̈) to compare with",
    )
    .or("free"),
    Setting::new(
        "momenta",
        Kind::Choice(&[
            named("recorded", "The recorded ones"),
            named("velocities", "Velocities in their place"),
        ]),
        "What a Hamiltonian network takes for momenta: recorded ones (columns p1, p2, …), or the velocities in their \
         place",
    )
    .or("recorded, or p = m q̇ with masses"),
    Setting::new(
        MASSES,
        Kind::Numbers(Range::new(1e-9, 1e9)),
        "Masses m of p = m q̇, one for each coordinate",
    )
    .shown_as("LIST"),
];

/// The setting for momenta that are masses times velocities.
const MASSES: &str = "masses";

/// Reads a configuration, whose momenta may be given by masses.
fn read(mut settings: Value) -> serde_json::Result<Box<dyn Family>> {
    let masses = settings.as_object_mut().and_then(|own| own.remove(MASSES));
    if let Some(masses) = masses {
        settings["momenta"] = serde_json::json!({ MASSES: masses });
    }
    family::read::<HnnConfig>(settings)
}

/// Refuses momenta that are impossible.
fn choose(_: &DataFacts, spec: &FitSpec) -> Result<Vec<AutoSetting>> {
    let given = |name: &str| spec.settings.get(name).and_then(Value::as_str);
    if given("momenta").is_some() && spec.settings.contains_key(MASSES) {
        return Err(Error::setting(
            "`momenta` and `masses` exclude each other",
            "give one of them",
        ));
    }
    if given("structure") == Some("none") && given("momenta") != Some("velocities") {
        return Err(Error::setting(
            "`structure` none knows no momentum that belongs to a velocity",
            "add `momenta` velocities, or take `structure` free or mass",
        ));
    }
    Ok(Vec::new())
}

impl Family for HnnConfig {
    fn name(&self) -> &'static str {
        NAME
    }

    fn summary(&self) -> String {
        format!(
            "{:?}, {} × {}, {:?}",
            self.structure, self.layers, self.width, self.activation
        )
    }

    fn abilities(&self) -> Abilities {
        const LOSSES: &[Loss] = &[Loss::ACCELERATION, Loss::ACCELERATION_L1, Loss::ROLLOUT];
        let remedy = "acceleration (or acceleration-l1 for absolute errors, or rollout): a Hamiltonian network is fitted to (q̇, ṗ), or to motions in (q, p)";
        Abilities {
            rates: 2,
            ..Abilities::of_losses(LOSSES, remedy)
        }
    }

    fn check(&self, dataset: &Dataset, task: &TrainingTask) -> Result<()> {
        let argument = |name, value: &str, must| {
            let value = value.into();
            Err(Error::Argument { name, value, must })
        };
        let forces = task.forces != ForceTerms::default();
        if task.loss == Loss::ROLLOUT && forces {
            let must = "omitted, or learned under another loss";
            return argument(
                "forces",
                "under the rollout loss of a Hamiltonian network",
                must,
            );
        }
        if !self.momenta.canonical() && dataset.forced {
            let must = "recorded, or p = m q̇ with `masses`: a force changes p, not q̇";
            return argument("momenta", "velocities, with forces in the data", must);
        }
        if !self.momenta.canonical() && forces {
            let must = "omitted, or momenta recorded or p = m q̇ with `masses`";
            return argument("forces", "beside velocities in the place of momenta", must);
        }
        family::check_first_order(task)?;
        family::check_speed_limit(self.speed_limit, dataset, task)
    }

    fn momenta(&self) -> Option<&Momenta> {
        Some(&self.momenta)
    }

    fn prepare(&self, dataset: &Dataset, task: &TrainingTask) -> Result<Plan> {
        let (mut setup, dataset) = Setup::new(dataset, task)?;
        let (scaling, weights) = dataset.phase_scaling(self)?;
        setup.weights = weights;
        let shape = HnnShape::new(dataset.coordinates.clone(), self.clone(), scaling)?;
        Ok(Plan::train(shape, setup))
    }
}

impl Trained for HnnShape {
    fn learner<'a, T: Real>(&'a self, setup: &'a Setup, of: Residuals) -> BoxedLearner<'a, T> {
        Box::new(setup.learner(self, of))
    }

    fn assemble(&self, setup: &Setup, parameters: &[f64]) -> Result<Learned> {
        let (weights, extra) = parameters.split_at(self.net().parameters);
        let hnn = Hnn::assemble(self.clone(), weights.to_vec())?;
        let dissipation = setup.forces.dissipation(extra);
        let actuation = setup.forces.actuation(setup.terms, extra)?;
        Ok(Canonical::with(hnn, dissipation, actuation)?.into())
    }
}

impl FittedModel for Canonical<Hnn> {
    fn description(&self) -> Description {
        match self.hamiltonian().config().structure {
            HnnStructure::Free => Description::mechanical(NAME, "A Hamiltonian"),
            HnnStructure::Mass => Description::mechanical(NAME, "A Hamiltonian with a mass matrix"),
            HnnStructure::None => Description::plain(NAME, "A plain flow"),
        }
    }

    fn stored(&self) -> Result<Stored> {
        let hnn = self.hamiltonian();
        hnn.stored_as(NAME)?.with_form(&hnn.config().structure)
    }

    fn parts(&self) -> ModelParts<'_> {
        let canonical = self.hamiltonian().canonical();
        ModelParts {
            lagrangian: canonical.then_some(&self.mechanical().lagrangian as &dyn Lagrangian),
            hamiltonian: Some(self.hamiltonian()),
            forces: self.mechanical().applied(),
            ..ModelParts::default()
        }
    }

    fn equations(&self, graph: Graph) -> Result<Equations> {
        let applied = self.mechanical().applied();
        self.hamiltonian().equations(graph, &applied)
    }
}

fn load(saved: &SavedModel) -> Result<Learned> {
    let hnn = Hnn::load(saved, saved.weights()?)?;
    let (dissipation, actuation) = saved.forces()?;
    Ok(Canonical::with(hnn, dissipation, actuation)?.into())
}
