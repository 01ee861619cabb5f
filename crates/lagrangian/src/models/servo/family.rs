//! Servos as a family: their data, their settings, their saved form.

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::motion::Recorded;
use super::parameters::Layout;
use super::quantities::quantities;
use super::search::{self, STAGES, Tried};
use super::shooting::standard_errors;
use super::{Friction, Servo, ServoConfig};
use crate::dataset::{Dataset, Timeline};
use crate::models::family::{self, Abilities, Candidate, Entry, Family, Plan, Solution};
use crate::models::learned::{Description, FittedModel, Stored};
use crate::models::named::Parameter;
use crate::saved::WEIGHTS;
use crate::saved::{self, SavedModel};
use crate::train::{Loss, Observer, SharedObserver, TrainingTask};
use lagrangian_motion::Samples;
use lagrangian_motion::settings::{Kind, Range, Setting, named};
use lagrangian_motion::{Error, Result};

/// The row of the table of families.
pub(crate) const ENTRY: Entry = Entry {
    name: NAME,
    about: "a planar chain with position-controlled motors and friction of gears, from goals instead of torques",
    default: family::default::<ServoConfig>,
    settings: SETTINGS,
    choose: family::no_choice,
    read: family::read::<ServoConfig>,
    saved_as: &[NAME],
    load: |saved| Ok(load(saved)?.into()),
    candidates: &[Candidate::new(0, |data, robot| {
        !robot && !data.forced && !data.train.goal.is_empty()
    })],
    jointed: true,
};

/// The name of the family.
pub(crate) const NAME: &str = "servo";

/// The settings of servos.
const SETTINGS: &[Setting] = &[
    Setting::new(
        "friction",
        Kind::Choice(&[
            named("m1", "Coulomb and viscous"),
            named("m2", "the same with an excess near standstill"),
            named("m3", "Coulomb, viscous, and in proportion to the load"),
            named("m4", "as m3, with an excess near standstill"),
            named("m5", "as m4, with shares of their own for motor and load"),
            named("m6", "as m5, with squares of the torques near standstill"),
        ]),
        "The terms of the friction of gears (arXiv 2410.08650)",
    )
    .or("by held-out motions"),
    Setting::new(
        "weight",
        Kind::Number(Range::new(1e-9, 1e9)),
        "The moment m g l of the first link's weight, N·m: without a torque only ratios to it are learned",
    )
    .or("1"),
];

impl Family for ServoConfig {
    fn name(&self) -> &'static str {
        NAME
    }

    fn summary(&self) -> String {
        let friction = self.friction.map_or("chosen", Friction::name);
        format!("friction of gears: {friction}")
    }

    fn abilities(&self) -> Abilities {
        let remedy = "omitted: servos are fitted to positions by simulations";
        Abilities {
            solved: true,
            cyclic: false,
            ..Abilities::of_losses(Loss::SINGLE, remedy)
        }
    }

    fn check(&self, dataset: &Dataset, _task: &TrainingTask) -> Result<()> {
        let n = dataset.coordinates.dof();
        if n > Servo::MAX_JOINTS || dataset.coordinates.parameters().next().is_some() {
            let must = "at most 6, all of which move: choose the columns of one arm";
            return Err(Error::argument("number of joints of a servo", n, must));
        }
        if dataset.train.goal.is_empty() {
            let problem = "a servo is fitted to the goals of its drives, and there are none";
            return Err(Error::setting(problem, "name their columns with `goal`"));
        }
        if self.weight <= 0.0 || !self.weight.is_finite() {
            return Err(Error::argument("weight", self.weight, "a positive number"));
        }
        Ok(())
    }

    fn prepare(&self, _dataset: &Dataset, _task: &TrainingTask) -> Result<Plan> {
        let own = self.clone();
        Ok(Plan::Solve(Box::new(move |dataset, observer| {
            own.solve(dataset, observer)
        })))
    }
}

/// The observer of a fit on any thread, with its present stage and the part of it that is done.
type Watch<'a> = SharedObserver<'a, (String, f64)>;

impl Watch<'_> {
    /// Begins a stage.
    fn stage(&self, what: &str, share: f64) {
        self.tell(|observer, present| {
            *present = (what.into(), share);
            observer.stage(what, share)
        });
    }

    /// Asks the observer whether the fit continues.
    fn should_continue(&self) -> bool {
        self.tell(|observer, (what, share)| observer.stage(what, *share))
    }
}

impl ServoConfig {
    fn solve(&self, dataset: &Dataset, observer: &mut dyn Observer) -> Result<Solution> {
        let n = dataset.coordinates.dof();
        let motions = recorded(&dataset.train, &dataset.train_times);
        let all: Vec<&Recorded> = motions.iter().collect();
        if all.is_empty() {
            return Err(Error::too_short("the longest recording", 0, SHORTEST));
        }
        let watch = Watch::new(observer, (String::new(), 0.0));
        let chosen = self.choose(&motions, n, &watch);
        let layout = self.layout(n, chosen.friction);
        let fitted = |motions: &[&Recorded]| {
            let fits = search::fit(layout, motions, chosen.stages, &|| watch.should_continue());
            fits.last().cloned().unwrap_or_default()
        };
        let error = |parameters: &[f64], motions: &[&Recorded]| {
            search::error(layout, parameters, motions).powi(2)
        };
        watch.stage("fitting the servo", 0.9);
        let mut parameters = fitted(&all);
        let loss = error(&parameters, &all);
        let held = recorded(&dataset.validation, &dataset.validation_times);
        let held: Vec<&Recorded> = held.iter().collect();
        let validation = (!held.is_empty()).then(|| error(&parameters, &held));
        let mut used = all;
        if validation.is_some() && watch.should_continue() {
            watch.stage("fitting the servo to all motions", 0.95);
            used.extend(held);
            parameters = fitted(&used);
        }
        let errors = standard_errors(layout, &used, &STAGES[..chosen.stages], &parameters);
        let servo = Servo::new(dataset.coordinates.clone(), layout, parameters)?;
        Ok(Solution {
            loss,
            validation,
            model: servo.with_errors(errors)?.into(),
        })
    }

    fn layout(&self, n: usize, friction: Friction) -> Layout {
        Layout {
            n,
            friction,
            weight: self.weight,
        }
    }

    /// The terms and the number of stages with the smallest error on held-out motions; of one motion, M3 after all stages.
    fn choose(&self, motions: &[Recorded], n: usize, watch: &Watch<'_>) -> Tried {
        let folds = search::folds(motions);
        let frictions = self
            .friction
            .map_or(Friction::ALL.to_vec(), |own| vec![own]);
        let mut tried = Vec::new();
        for (k, friction) in frictions.iter().enumerate() {
            if folds.len() < 2 || !watch.should_continue() {
                break;
            }
            let what = format!("holding out motions, friction {}", friction.name());
            watch.stage(&what, 0.9 * k as f64 / frictions.len() as f64);
            let layout = self.layout(n, *friction);
            let go_on = || watch.should_continue();
            tried.extend(search::held_out(
                layout,
                motions,
                &folds,
                STAGES.len(),
                &go_on,
            ));
        }
        search::choose(&tried).unwrap_or(Tried {
            friction: self.friction.unwrap_or(Friction::M3),
            stages: STAGES.len(),
            error: f64::NAN,
        })
    }
}

/// The smallest number of samples of a motion that is simulated.
const SHORTEST: usize = 16;

/// The motions of some samples; one that is too short is omitted.
fn recorded(samples: &Samples, times: &Timeline) -> Vec<Recorded> {
    let runs = times.runs().filter(|run| run.len() >= SHORTEST);
    let motion = |run: std::ops::Range<usize>| {
        let signals = samples.signals.rows(samples.n, &run);
        Recorded::new(&times.t[run], &signals, samples.n)
    };
    runs.map(motion).collect()
}

/// The tensor of the standard errors of all quantities.
const ERRORS: &str = "standard_errors";

/// The saved form of the layout of the parameters.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Shape {
    friction: Friction,
    weight: f64,
}

fn load(saved: &SavedModel) -> Result<Servo> {
    let header = &saved.header;
    let shape: Shape = saved::read("architecture", &header.architecture)?;
    let n = header.coordinates.dof();
    if !(1..=Servo::MAX_JOINTS).contains(&n) || shape.weight <= 0.0 || !shape.weight.is_finite() {
        return Err(saved::damaged(
            "a servo of such joints does not exist".into(),
        ));
    }
    let layout = Layout {
        n,
        friction: shape.friction,
        weight: shape.weight,
    };
    // Earlier versions saved servos without standard errors.
    let (parameters, errors) = match saved.tensors.contains_key(ERRORS) {
        true => {
            let [parameters, errors] = saved.vectors([WEIGHTS, ERRORS])?;
            (parameters, errors)
        }
        false => (saved.weights()?, Vec::new()),
    };
    Servo::new(header.coordinates.clone(), layout, parameters)?.with_errors(errors)
}

impl FittedModel for Servo {
    fn description(&self) -> Description {
        Description::mechanical(NAME, "A chain with position-controlled motors")
    }

    fn stored(&self) -> Result<Stored> {
        let shape = Shape {
            friction: self.layout.friction,
            weight: self.layout.weight,
        };
        let stored = Stored::new(NAME, &shape, &Value::Null, &self.parameters)?;
        Ok(stored.with(ERRORS, &self.errors))
    }

    fn parameters(&self) -> Vec<Parameter> {
        let all = quantities(&self.machine).into_iter().enumerate();
        // A term that the friction does not have is exactly 0.
        let own = all.filter(|(_, quantity)| quantity.value != 0.0);
        own.map(|(k, quantity)| Parameter {
            name: format!(
                "{}_{}",
                quantity.kind, self.coordinates.0[quantity.joint].name
            ),
            value: quantity.value,
            unit: quantity.unit.into(),
            standard_error: self.errors.get(k).copied().filter(|error| *error > 0.0),
        })
        .collect()
    }
}
