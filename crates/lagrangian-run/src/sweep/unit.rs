//! One unit of work: from a specification and recordings to a run folder that is named by their hash.

use std::path::{Path, PathBuf};

use lagrangian::settings::Values;
use lagrangian::train::Ending;
use lagrangian::{Observer, RolloutOptions, brief};
use serde::{Deserialize, Serialize};
use serde_json::json;
use sha2::{Digest, Sha256};

use super::space::{Search, Space};
use crate::content::hex;
use crate::error::{Advise, Error, Result};
use crate::folder::{MODEL, Occupied, RUN, RunFolder};
use crate::input;
use crate::job::{Data, Figures, Place};
use crate::metrics::Tensorboard;
use crate::page::{Skin, grade_name};
use crate::spec::Specification;

/// The file of a unit that has ended, written last.
const RESULT: &str = "result.json";

/// Digits of a hash that name a folder: of 100 000 units two are the same with a probability below 10⁻⁹.
const DIGITS: usize = 16;

/// Raised where another meaning of a specification or other bits follow from the same text.
const VERSION: u32 = 2;

/// A fit of a sweep.
#[derive(Debug, Clone, PartialEq)]
pub struct Unit {
    /// The name of its folder: the hash of its specification, of its recordings and of their layout.
    pub id: String,
    /// What is asked of it.
    pub specification: Specification,
    /// Its values of the settings that the sweep varies.
    pub varied: Values,
}

/// What a unit has given.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct UnitResult {
    /// Its family; of several the one that was kept.
    pub family: String,
    /// How far the model can be trusted.
    pub verdict: Option<String>,
    /// The squared error on held-out samples over the variance, mean over the coordinates: of the torques where forces were recorded,
    /// else of the accelerations.
    pub error: Option<f64>,
    /// The best loss of the validation.
    pub loss: Option<f64>,
    /// The steps of the fit.
    pub steps: usize,
    /// Why there is no model, where there is none.
    pub failure: Option<String>,
}

/// How the work on a unit came to its end.
#[derive(Debug, Clone, PartialEq)]
pub enum Ended {
    /// It is done, by this call or by an earlier one.
    Finished(UnitResult),
    /// It was asked to end; a later call goes on.
    Interrupted,
    /// Another process works on it.
    Busy,
}

/// What units are done with.
pub struct Conditions<'a> {
    /// The folder of the units.
    pub root: &'a Path,
    /// Who makes the runs.
    pub skin: &'a dyn Skin,
    /// The command, or the call, that makes them.
    pub command: String,
    /// How predictions are integrated, and what ends them.
    pub options: RolloutOptions,
    /// Whether event files are written.
    pub tensorboard: Tensorboard,
}

/// The units of a sweep: fixed settings with each point of the space; those that are the same are there once.
///
/// # Errors
/// As [`Space::points`] and [`Specification::of`]; [`Error::Refused`] for a setting that is both fixed and varied.
pub fn units(fixed: &Values, space: &Space, search: &Search, data: &Data) -> Result<Vec<Unit>> {
    let mut units: Vec<Unit> = Vec::new();
    let mut known = std::collections::HashSet::new();
    for varied in space.points(search)? {
        if let Some(name) = varied.keys().find(|name| fixed.contains_key(*name)) {
            return Err(Error::new(
                format!("the setting '{name}' is both fixed and varied"),
                "omit one of the two",
            ));
        }
        let all: Values = fixed.clone().into_iter().chain(varied.clone()).collect();
        let unit = Unit::of(Specification::of(&all)?, varied, data)?;
        if known.insert(unit.id.clone()) {
            units.push(unit);
        }
    }
    Ok(units)
}

impl Unit {
    /// The unit of a specification and of recordings that are [`Data::hashed`], with the layout that the model remembers.
    ///
    /// # Errors
    /// [`Error::Refused`] for numbers that JSON has no form for.
    pub fn of(specification: Specification, varied: Values, data: &Data) -> Result<Self> {
        let specification = specification.normal();
        let hashes: Vec<(&str, &str)> = data
            .hashes
            .iter()
            .map(|file| (file.role.as_str(), file.sha256.as_str()))
            .collect();
        let asked = json!({
            "version": (VERSION, env!("CARGO_PKG_VERSION")),
            "asked": specification,
            "data": hashes,
            "layout": data.layout,
        });
        let mut id = hex(&Sha256::digest(asked.to_string().as_bytes()));
        id.truncate(DIGITS);
        Ok(Self {
            id,
            specification,
            varied,
        })
    }

    /// Its folder.
    #[must_use]
    pub fn folder(&self, root: &Path) -> PathBuf {
        root.join(&self.id)
    }

    /// Its result, if it has ended and the model that it speaks of is there.
    ///
    /// # Errors
    /// [`Error::Refused`] for a file that cannot be read.
    pub fn result(&self, root: &Path) -> Result<Option<UnitResult>> {
        let path = self.folder(root).join(RESULT);
        if !path.is_file() {
            return Ok(None);
        }
        let shown = format!("cannot read '{}'", path.display());
        let again = "remove that folder, and the unit is done again";
        let text = input::text(&path).advise(&shown, again)?;
        let result: UnitResult = serde_json::from_str(&text).advise(shown, again)?;
        let is_whole = result.failure.is_some() || self.folder(root).join(MODEL).is_file();
        Ok(is_whole.then_some(result))
    }

    /// Does it: fits in its folder, goes on where an earlier attempt was ended, or takes the result that is there. What the library
    /// refuses is a result too, a failure.
    ///
    /// # Errors
    /// [`Error::Refused`] where the folder cannot be written or read.
    pub fn run(&self, data: &Data, with: &Conditions, shown: &mut dyn Observer) -> Result<Ended> {
        if let Some(result) = self.result(with.root)? {
            return Ok(Ended::Finished(result));
        }
        let path = self.folder(with.root);
        // With a result, its run has ended: there is nothing to resume.
        let occupied = match path.join(RUN).is_file() && !path.join(RESULT).exists() {
            true => Occupied::Resume,
            false => Occupied::Restart,
        };
        let Some(folder) = RunFolder::open_if_free(&path, occupied)? else {
            return Ok(Ended::Busy);
        };
        // Another process may have done it since.
        if let Some(result) = self.result(with.root)? {
            return Ok(Ended::Finished(result));
        }
        // A result without its model does not outlive the new attempt.
        let _ = std::fs::remove_file(path.join(RESULT));
        let place = Place {
            folder: &folder,
            skin: with.skin,
            command: with.command.clone(),
            settings: json!({ "unit": self.id, "varied": self.varied, "asked": self.specification }),
            tensorboard: with.tensorboard,
            figures: Figures::Written,
        };
        let result = match self.fitted(data, &place, with, shown) {
            Ok(None) => return Ok(Ended::Interrupted),
            Ok(Some(result)) => result,
            Err(error) if error.library().is_some_and(is_of_the_settings) => self.failed(&error),
            Err(error) => return Err(error),
        };
        let bytes = serde_json::to_vec_pretty(&result).advise("cannot write the result", "")?;
        folder.write(RESULT, &bytes)?;
        Ok(Ended::Finished(result))
    }

    /// The result of the fit; none where it was asked to end before.
    fn fitted(
        &self,
        data: &Data,
        place: &Place,
        with: &Conditions,
        shown: &mut dyn Observer,
    ) -> Result<Option<UnitResult>> {
        let mut ready = self.specification.ready(data.clone())?;
        ready.source = Some(format!("unit {}", self.id));
        let fitted = ready.fit(Some(place), shown)?.ended(None);
        if fitted.fit.ending == Ending::Interrupted {
            return Ok(None);
        }
        let (score, assessment) = fitted.assessed(Some(place), &with.options)?;
        if score.stopped > 0 || with.options.stop.is_asked() {
            return Ok(None);
        }
        let error = match fitted.forced {
            true => score.torque.or(score.acceleration),
            false => score.acceleration.or(score.torque),
        };
        let mean = |nmse: &[f64]| nmse.iter().sum::<f64>() / nmse.len().max(1) as f64;
        Ok(Some(UnitResult {
            family: fitted.fit.model.family().into(),
            verdict: Some(grade_name(assessment.verdict).into()),
            error: error.map(|e| mean(&e.nmse)).filter(|e| e.is_finite()),
            loss: Some(fitted.fit.best).filter(|loss| loss.is_finite()),
            steps: fitted.fit.steps,
            failure: None,
        }))
    }

    fn failed(&self, error: &Error) -> UnitResult {
        UnitResult {
            family: self.specification.family.clone().unwrap_or_default(),
            verdict: None,
            error: None,
            loss: None,
            steps: 0,
            failure: Some(brief(&error.to_string())),
        }
    }
}

/// Whether another machine would fail in the same way: files that cannot be read or written, or are damaged, are no result.
fn is_of_the_settings(error: &lagrangian::Error) -> bool {
    use lagrangian::Error as Of;
    !matches!(
        error,
        Of::Io(_)
            | Of::NotAModel { .. }
            | Of::NewerModel { .. }
            | Of::DamagedModel { .. }
            | Of::Tensor { .. }
    )
}
