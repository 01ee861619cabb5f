//! Several models for the same data, of which the best on held-out samples is kept.

use nets::Instant;
use serde_json::json;

use super::choice::{Part, ResolvedConfig, foreign, present};
use crate::dataset::Dataset;
use crate::fit::refine::{fit_and_refine, noise, to_be_refined};
use crate::fit::screening::{self, HeldOut, ROUNDING, Screened, WITH_FRICTION, screen};
use crate::fit::{Fit, FitConfig, OptimizerName, fit};
use crate::models::{Candidate, Entry, Formula, WrittenLaw};
use crate::saved;
use crate::score::{CandidateResult, HALF, torque_error};
use crate::train::checkpoint::Checkpoint;
use crate::train::known::DataFacts;
use crate::train::loss::Loss;
use crate::train::observer::{Ending, Observer};
use crate::train::spec::{AutoSetting, FitSpec};
use lagrangian_motion::{Error, Result};
use lagrangian_recordings::Estimate;

/// The friction that is learned beside a network of a driven machine.
const FORCES: [&str; 4] = ["viscous", "drag", "coulomb", "offset"];

/// The settings of friction: those who give one still get several models, all with that friction.
const FRICTION: [&str; 2] = ["forces", "dissipation"];

/// Held-out blocks of the fitted motions show little of the extrapolation of a flexible model. The candidates are ordered
/// by the strength of their assumptions, and one with weaker assumptions must halve the error to be kept.
pub(super) const MARGIN: f64 = 0.5;

/// Torque errors up to this multiple are the same …
const SAME: f64 = 1.1;
/// … and up to twice, where accelerations err by less than this part: so much less must be left by a model that tells no torques, too.
const FAR: f64 = 0.1;

/// A series of so many values is as short as a law.
const SHORT: usize = 14;

/// The steps of a fit where neither steps nor seconds are given: of the natural gradient, and of Adam.
const STEPS: usize = 400;
const ADAM_STEPS: usize = 8000;

/// The best of several fits.
#[derive(Debug)]
pub struct Selection {
    /// The fit that is kept.
    pub fit: Fit,
    /// The settings of that fit, with the chosen ones.
    pub chosen: ResolvedConfig,
    /// All fits, in their order; a single one is not compared.
    pub tried: Vec<CandidateResult>,
}

impl Selection {
    /// The settings of other fits of the model that was kept: those of a law have its terms, whose coefficients alone are open.
    #[must_use]
    pub fn again(&self) -> FitConfig {
        let mut config = self.chosen.config.clone();
        if let Some(law) = self
            .fit
            .model
            .lagrangian_as::<Formula>()
            .filter(|_| is_law(self))
        {
            config.family = law.config().clone().into();
        }
        config
    }
}

impl FitConfig {
    /// The settings of all fits of a request: one, where it names a family. Where it does not, several models are tried: where forces
    /// were recorded the robot of a description, a chain of rigid bodies, and a network with a mass matrix and friction; of free motions
    /// a mass matrix with a potential, Lagrangians of any form, all with friction, and a plain network.
    ///
    /// # Errors
    /// As [`FitConfig::for_data`].
    pub fn candidates(
        dataset: &Dataset,
        estimates: &[Estimate],
        spec: &FitSpec,
    ) -> Result<Vec<ResolvedConfig>> {
        let known = DataFacts::of(dataset, estimates);
        let noise = noise(dataset, estimates, &known);
        let mut candidates = spec.checked()?.candidates(dataset, &known)?;
        if known.filtered && dataset.unfiltered.is_none() {
            // What a low-pass leaves is not white.
            candidates.retain(|own| !own.seeks_law());
        }
        let chosen = |own: Request| {
            let chosen = own.spec.choose(&known)?;
            let name = match &own.name {
                name if name.is_empty() => chosen.name,
                name => name.clone(),
            };
            // Accelerations of a real machine tell less of it than its torques.
            let part = match (own.by_motion, known.filtered) {
                _ if own.seeks_law() => Part::Law,
                (false, _) => Part::First,
                (true, false) => Part::Beside,
                (true, true) => Part::Instead,
            };
            Ok(ResolvedConfig {
                name,
                part,
                ..chosen
            })
        };
        let all: Result<_> = candidates.into_iter().map(chosen).collect();
        Ok(to_be_refined(dataset, &noise, all?))
    }
}

/// The request for one of several models.
#[derive(Default)]
struct Request {
    name: String,
    by_motion: bool,
    spec: FitSpec,
}

impl Request {
    /// Whether it is for a law among several models.
    fn seeks_law(&self) -> bool {
        let family = self
            .spec
            .family
            .as_deref()
            .and_then(|name| Entry::by_name(name).ok());
        self.by_motion
            && !self.name.is_empty()
            && family.is_some_and(|entry| (entry.default)().abilities().solved)
    }
}

impl FitSpec {
    /// Whether a robot is given, whose parameters are identified.
    pub(crate) fn has_robot(&self) -> bool {
        let given = self.settings.get("robot");
        self.urdf.is_some() || given.is_some_and(|robot| !robot.is_null())
    }

    /// The settings of friction that are given.
    fn friction(&self) -> Vec<&'static str> {
        let given = present(&self.settings);
        let friction = FRICTION.into_iter();
        friction.filter(|name| given.contains_key(*name)).collect()
    }

    /// Whether several families may be tried: the request does not name the fitted one, or includes a robot.
    pub(crate) fn is_open(&self) -> bool {
        let others = || present(&self.settings).len() > self.friction().len();
        let silent = || !others() && !self.training.contains_key("loss");
        self.family.is_none() && self.nominal.is_none() && (self.has_robot() || silent())
    }

    /// The requests for the models that are tried.
    fn candidates(&self, dataset: &Dataset, known: &DataFacts) -> Result<Vec<Request>> {
        let mut tried = match self.is_open() && dataset.train.steps.is_empty() {
            true => Entry::tried(dataset, self.has_robot()),
            false => Vec::new(),
        };
        let friction = self.friction();
        tried.retain(|(entry, _)| friction.iter().all(|name| entry.has(name)));
        tried.retain(|(entry, _)| !self.keeps_cyclic() || (entry.default)().abilities().cyclic);
        if tried.len() < 2 {
            let family = tried.first().map(|(alone, _)| alone.name.into());
            let spec = Self {
                family: family.or_else(|| self.family.clone()),
                ..self.clone()
            };
            return Ok(vec![Request {
                by_motion: spec.refine,
                spec,
                ..Request::default()
            }]);
        }
        let given = present(&self.settings);
        let has = |name: &str| tried.iter().any(|(entry, _)| entry.has(name));
        if let Some(name) = given.keys().find(|name| !has(name)) {
            let families: Vec<&str> = tried.iter().map(|(entry, _)| entry.name).collect();
            return Err(foreign(
                name,
                &format!("the models that are tried ({})", families.join(", ")),
            ));
        }
        let own = |(entry, own): &(&Entry, &Candidate)| Request {
            name: match friction.is_empty() {
                true => format!("{}{}", entry.name, own.with),
                false => format!("{}{}", entry.name, own.with.trim_end_matches(WITH_FRICTION)),
            },
            by_motion: own.by_motion,
            spec: self.of_candidate(entry, own, known),
        };
        Ok(tried.iter().map(own).collect())
    }

    /// The request for one of several models, with the settings that its family has.
    fn of_candidate(&self, entry: &Entry, candidate: &Candidate, known: &DataFacts) -> Self {
        let (mut spec, forced) = (self.clone(), known.forced);
        spec.family = Some(entry.name.into());
        spec.settings.retain(|name, _| entry.has(name));
        if (entry.default)().abilities().solved {
            spec.training.retain(|name, _| name == "forward");
            return spec;
        }
        let given = !self.friction().is_empty();
        if forced && entry.has("forces") && !given {
            spec.settings.insert("forces".into(), json!(FORCES));
        }
        let own = candidate.settings.iter();
        for (name, value) in own.filter(|own| !((forced || given) && FRICTION.contains(&own.0))) {
            let value = serde_json::from_str(value).unwrap_or_default();
            spec.settings.entry(*name).or_insert(value);
        }
        let training = &mut spec.training;
        let loss = match candidate.by_motion {
            true => Loss::ACCELERATION,
            false => Loss::TORQUE,
        };
        training.entry("loss").or_insert(json!(loss.name()));
        if candidate.by_motion {
            let natural = json!(OptimizerName::Natural);
            training.entry("optimizer").or_insert(natural);
        }
        let adam = json!(OptimizerName::Adam);
        let given = training.get("optimizer");
        let steps = match given.map_or(known.noisy(), |given| *given == adam) {
            true => ADAM_STEPS,
            false => STEPS,
        };
        // Half of the time is for the other models.
        spec.seconds = self.seconds.map(|seconds| 0.5 * seconds);
        spec.steps = self.steps.or(self.seconds.is_none().then_some(steps));
        spec
    }
}

/// Fits all candidates and keeps the best on held-out samples.
///
/// One that seeks a law comes first, and is kept alone where it finds it; a series that is none where its held-out accelerations are
/// better than those of all others by more than chance, or of which none halves them and it is short: one that leaves more than noise, too, where no noise hides the accelerations. Those that learn torques come next: the one with the smallest torque error is kept, where a later candidate must halve the error
/// of an earlier one. Those that learn accelerations are trained for a few steps and compared; the best is trained on, without its
/// friction where it needs none. Of driven motions it replaces the other where it explains torques as well and accelerations much
/// better, or accelerations alone so far better that no torques are worth it; of noisy ones, where it explains accelerations better. `resume` continues from a checkpoint of the candidate that
/// wrote it.
///
/// # Errors
/// As [`fit`](fn@super::fit), where none of them can be fitted.
pub fn select(
    dataset: &Dataset,
    candidates: Vec<ResolvedConfig>,
    resume: Option<&Checkpoint>,
    observer: &mut dyn Observer,
) -> Result<Selection> {
    let (laws, candidates): (Vec<_>, Vec<_>) = candidates
        .into_iter()
        .partition(|own| own.part == Part::Law);
    let (mut tried, mut series) = (Vec::new(), None);
    if resume.is_none() {
        for law in laws {
            match formula_first(dataset, law, &mut tried, observer) {
                Some(mut own) if is_law(&own) => {
                    own.tried = tried;
                    return Ok(own);
                }
                own => series = series.or(own),
            }
        }
    }
    let noisy = candidates.iter().any(|own| !own.noise.is_empty());
    let mut kept = select_others(dataset, candidates, resume, observer)?;
    // What is no law may be nearer to it than any network.
    let errors = |own: &Selection| Explained::of(&own.fit, dataset);
    let is_nearer = |own: &Selection| {
        let short = is_short(own, noisy);
        let [own, kept] = [errors(own), errors(&kept)];
        // Accelerations of a real machine tell less of it than its torques, and forces that do not act nothing.
        let torques = dataset.unfiltered.is_none() || own.torque <= kept.torque;
        let act = !dataset.forced || own.torque <= HALF;
        let better = match short {
            true => {
                let halved = kept.errors.mean() <= MARGIN * own.errors.mean();
                !(halved && own.errors.exceed(&kept.errors))
            }
            false => kept.errors.exceed(&own.errors),
        };
        torques && act && better
    };
    if let Some(series) = series.filter(is_nearer) {
        let others = std::mem::replace(&mut kept, series).tried;
        kept.tried = others;
        tried.iter_mut().for_each(|own| own.failure = None);
    }
    kept.tried.splice(0..0, tried);
    Ok(kept)
}

/// Whether a model is a law, beside which no other is needed.
fn is_law(own: &Selection) -> bool {
    own.fit.model.written().is_some_and(|own| own.explains)
}

/// Whether a model is a series of few values that explains the data nearly to their noise, or as well as its errors of accelerations say
/// where these are not noisy. Beyond the data it errs less than a network that does the same.
fn is_short(own: &Selection, noisy: bool) -> bool {
    let model = &own.fit.model;
    let explains = |own: WrittenLaw| own.verdict == "expansion" || !noisy;
    model.written().is_some_and(explains) && model.parameters().len() <= SHORT
}

/// A model that is the law, or a series; what became of it is added to those that were tried.
fn formula_first(
    dataset: &Dataset,
    mut chosen: ResolvedConfig,
    tried: &mut Vec<CandidateResult>,
    observer: &mut dyn Observer,
) -> Option<Selection> {
    let clock = Instant::now();
    let fitted = fit(dataset, &chosen.config, None, observer);
    let written = fitted.as_ref().ok().and_then(|fit| fit.model.written());
    tried.push(CandidateResult {
        family: chosen.config.family.name().into(),
        name: chosen.name.clone(),
        acceleration_nmse: fitted
            .as_ref()
            .ok()
            .map(|fit| screening::held_out(fit, dataset, 0).mean()),
        seconds: clock.elapsed().as_secs_f64(),
        failure: match (&fitted, &written) {
            (Err(error), _) => Some(error.to_string()),
            (Ok(_), Some(written)) if !written.explains => Some(written.meaning.clone()),
            _ => None,
        },
        ..CandidateResult::default()
    });
    let (fit, written) = (fitted.ok()?, written?);
    let reason = format!("{}: {}", written.text, written.meaning);
    chosen
        .choices
        .insert(0, AutoSetting::new("model", &*chosen.name, reason));
    let tried = Vec::new();
    Some(Selection { fit, chosen, tried })
}

/// As [`select`], of candidates that seek no law.
fn select_others(
    dataset: &Dataset,
    candidates: Vec<ResolvedConfig>,
    resume: Option<&Checkpoint>,
    observer: &mut dyn Observer,
) -> Result<Selection> {
    let (mut by_motion, by_torque): (Vec<_>, Vec<_>) = candidates
        .into_iter()
        .partition(|own| own.part != Part::First);
    if by_torque.is_empty() {
        return select_by_motion(dataset, by_motion, resume, observer);
    }
    let begun = resume.filter(|own| begun(&by_motion, own).is_some());
    let rest = resume.filter(|_| begun.is_none());
    let several = by_torque.len() + by_motion.len() > 1;
    let first = select_by_torque(dataset, (by_torque, several), rest, observer);
    let fitted = first.as_ref().ok();
    let known = fitted.map(|own| Explained::of(&own.fit, dataset));
    if known
        .as_ref()
        .is_some_and(|own| own.errors.mean() < ROUNDING)
    {
        return first;
    }
    // Where torques are explained, a model that does not tell them must be far better.
    let torques = known.as_ref().is_some_and(|own| own.torque <= HALF);
    by_motion.retain(|own| !torques || own.part == Part::Beside);
    let noisy = by_motion.iter().any(|own| !own.noise.is_empty());
    let ended = |own: &Selection| own.fit.ending == Ending::Interrupted;
    if by_motion.is_empty() || first.as_ref().is_ok_and(ended) {
        return first;
    }
    let second = select_by_motion(dataset, by_motion, begun, observer);
    let (first, known, mut second) = match (first, known, second) {
        (Ok(first), Some(known), Ok(second)) => (first, known, second),
        (first, _, Err(_)) => return first,
        (.., second) => return second,
    };
    let third = dataset.compared().len() / 3;
    let other = screening::held_out(&second.fit, dataset, third).mean();
    let own = Explained::of(&second.fit, dataset);
    // Both have the noise of accelerations: their difference has not.
    let better = match noisy && own.torque.is_finite() {
        true => known.errors.exceed(&own.errors),
        false => own.replaces(&known, other),
    };
    if better && !own.torque.is_finite() {
        second.chosen.choices[0].reason += &format!(
            "; the best model of torques ({}) leaves {:.1e} of these errors, but this one tells no torques",
            first.chosen.name,
            known.errors.mean(),
        );
    }
    let tried = [&*first.tried, &second.tried].concat();
    let kept = if better { second } else { first };
    Ok(Selection { tried, ..kept })
}

/// The parts of torques and accelerations of held-out samples that a model leaves.
struct Explained {
    torque: f64,
    errors: HeldOut,
}

impl Explained {
    fn of(fit: &Fit, dataset: &Dataset) -> Self {
        let torque = torque_error(&fit.model, dataset.compared());
        Self {
            torque: torque.map_or(f64::INFINITY, |error| error.unexplained()),
            errors: screening::held_out(fit, dataset, 0),
        }
    }

    /// Whether a model that learned accelerations, of which it leaves `other` with the forces of other samples, replaces one that
    /// learned torques.
    fn replaces(&self, first: &Self, other: f64) -> bool {
        let [motion, before] = [self, first].map(|own| own.errors.mean());
        let accelerations = motion <= MARGIN * before;
        // Noise of accelerations is an error of torques, and less of one for a mass matrix that is too small.
        let far = motion <= FAR * before && self.torque <= first.torque / MARGIN;
        let torques = self.torque <= SAME * first.torque || far;
        // Where forces have nothing to do with the motion, a model of the motion is not one of the machine.
        let forces = motion <= MARGIN * other;
        let least = match first.torque > HALF {
            true => MARGIN * first.torque,
            false => FAR * before,
        };
        let alone = motion <= least && forces;
        !before.is_finite() && torques || accelerations && (torques || alone)
    }
}

/// Fits all candidates, each wholly, and keeps the one with the smallest torque error on held-out samples.
fn select_by_torque(
    dataset: &Dataset,
    (candidates, several): (Vec<ResolvedConfig>, bool),
    resume: Option<&Checkpoint>,
    observer: &mut dyn Observer,
) -> Result<Selection> {
    let mut best: Option<(f64, Fit, ResolvedConfig)> = None;
    let mut failure = None;
    let mut tried = Vec::new();
    for chosen in candidates {
        let clock = Instant::now();
        let own = resume.filter(|_| !chosen.config.family.abilities().solved);
        let fitted = fit(dataset, &chosen.config, own, observer);
        let error = fitted.as_ref().map_or(f64::INFINITY, |fit| match several {
            true => held_out(fit, dataset),
            false => 0.0,
        });
        tried.push(CandidateResult {
            family: chosen.config.family.name().into(),
            torque_nmse: (several && fitted.is_ok()).then_some(error),
            seconds: clock.elapsed().as_secs_f64(),
            failure: fitted.as_ref().err().map(Error::to_string),
            ..CandidateResult::default()
        });
        match fitted {
            Ok(fit) => {
                let interrupted = fit.ending == Ending::Interrupted;
                let better = |least: f64| least.is_nan() || error <= MARGIN * least;
                if best.as_ref().is_none_or(|(least, ..)| better(*least)) {
                    best = Some((error, fit, chosen));
                }
                if interrupted {
                    break;
                }
            }
            Err(error) => failure = Some(error),
        }
    }
    let Some((_, fit, mut chosen)) = best else {
        return Err(failure.unwrap_or_else(|| Error::argument("candidates", 0, "at least one")));
    };
    if several {
        let family = chosen.config.family.name();
        chosen
            .choices
            .insert(0, AutoSetting::new("model", family, reason(&tried)));
    }
    Ok(Selection { fit, chosen, tried })
}

/// The candidate that wrote a checkpoint, perhaps without its friction.
fn begun(candidates: &[ResolvedConfig], checkpoint: &Checkpoint) -> Option<ResolvedConfig> {
    let wrote = |own: &ResolvedConfig| {
        let settings = saved::describe(&own.config);
        settings.is_ok_and(|now| checkpoint.check_config(&now).is_ok())
    };
    let free = candidates
        .iter()
        .filter_map(ResolvedConfig::without_friction);
    candidates.iter().cloned().chain(free).find(wrote)
}

/// Trains the best of several models that learn accelerations.
fn select_by_motion(
    dataset: &Dataset,
    candidates: Vec<ResolvedConfig>,
    resume: Option<&Checkpoint>,
    observer: &mut dyn Observer,
) -> Result<Selection> {
    let (mut chosen, mut tried, reason) = match resume.and_then(|own| begun(&candidates, own)) {
        Some(chosen) => (
            chosen,
            Vec::new(),
            "it was chosen when the fit began".into(),
        ),
        None => {
            let Screened { chosen, tried } = screen(dataset, candidates, observer)?;
            let reason = screening::reason(&tried);
            (chosen, tried, reason)
        }
    };
    let setting = AutoSetting::new("model", &*chosen.name, reason);
    chosen.choices.insert(0, setting);
    let (fit, refined) = fit_and_refine(dataset, &mut chosen, resume, observer)?;
    tried.extend(refined);
    Ok(Selection { fit, chosen, tried })
}

/// The torque error of a model on validation samples, or on the training samples without validation samples; with a passive joint,
/// whose torque has no variance, all squares count alike.
fn held_out(fit: &Fit, dataset: &Dataset) -> f64 {
    let error = torque_error(&fit.model, dataset.compared());
    error.map_or(f64::INFINITY, |error| match error.nmse_mean.is_finite() {
        true => error.nmse_mean,
        false => error.unexplained(),
    })
}

fn reason(tried: &[CandidateResult]) -> String {
    format!(
        "of the models that explain the torques of held-out samples about as well as the best it takes most for granted; their \
         squared errors in parts of the variance: {}",
        CandidateResult::list(tried, 2)
    )
}
