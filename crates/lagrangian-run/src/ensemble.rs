//! Ensembles in a folder: a file for each member, and one with the calibration of their bands.

use std::path::Path;

use lagrangian::ensemble::{Calibration, Coverage, Ensemble, MEMBERS, fit_ensemble};
use lagrangian::{FitConfig, Learned, Observer, Prepared, Provenance};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use crate::error::{Context, Error, Result};
use crate::files::{Existing, write_bytes};
use crate::input;
use crate::source::read_model;

/// The file with the calibration of the bands of all members.
pub const ENSEMBLE: &str = "ensemble.json";
const FORMAT: &str = "lagrangian-ensemble";
const VERSION: u32 = 1;

/// The content of [`ENSEMBLE`].
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Description {
    format: String,
    version: u32,
    members: usize,
    calibration: Calibration,
    summary: Value,
}

/// An ensemble with its origin, as its folder holds it.
#[derive(Debug)]
pub struct SavedEnsemble {
    /// The ensemble.
    pub ensemble: Ensemble,
    /// The origin of the members.
    pub provenance: Provenance,
    /// The summary of the fit: settings, findings of the check, and the part of the motions of its evaluation in its bands.
    pub summary: Value,
}

impl SavedEnsemble {
    /// Fits an ensemble of this number of members.
    pub(crate) fn fitted(
        data: &Prepared,
        config: &FitConfig,
        members: usize,
        provenance: Provenance,
        shown: &mut dyn Observer,
    ) -> Result<Self> {
        let ensemble = fit_ensemble(&data.dataset, config, members, shown)?;
        let summary = json!({
            "family": config.family.name(),
            "settings": config,
            "members": ensemble.members().len(),
            "held_out": data.held_out,
            "check": { "verdict": data.check.verdict(), "items": data.check.items },
            "coverage": ensemble.coverage(&data.motions),
        });
        Ok(Self {
            ensemble,
            provenance,
            summary,
        })
    }

    /// The part of the motions of its evaluation in its bands; `None` where the summary does not hold it.
    #[must_use]
    pub fn coverage(&self) -> Option<Coverage> {
        Coverage::deserialize(self.summary.get("coverage")?).ok()
    }

    /// Writes the ensemble to a folder, which must exist; files of an earlier one are replaced.
    ///
    /// # Errors
    /// [`Error::Refused`] where the folder cannot be written; as [`Learned::save`].
    pub fn write(&self, folder: &Path) -> Result<()> {
        let members = self.ensemble.members();
        for (k, member) in members.iter().enumerate() {
            let bytes = member.save(self.provenance.clone())?.to_bytes()?;
            write_bytes(&folder.join(member_name(k)), Existing::Replace, &bytes)?;
        }
        let description = Description {
            format: FORMAT.into(),
            version: VERSION,
            members: members.len(),
            calibration: self.ensemble.calibration().clone(),
            summary: self.summary.clone(),
        };
        let text =
            serde_json::to_vec_pretty(&description).context("cannot write the ensemble", "")?;
        write_bytes(&folder.join(ENSEMBLE), Existing::Replace, &text)
    }

    /// Reads the ensemble of a folder.
    ///
    /// # Errors
    /// [`Error::Refused`] for files that are missing, damaged or of another version, which it names.
    pub fn read(folder: &Path) -> Result<Self> {
        let path = folder.join(ENSEMBLE);
        let shown = format!("cannot read the ensemble '{}'", path.display());
        let hint = "give the folder that an ensemble was saved to";
        let text = input::text(&path).context(&shown, hint)?;
        let described: Description = serde_json::from_str(&text).context(&shown, hint)?;
        let (fewest, most) = MEMBERS;
        if described.format != FORMAT
            || described.version != VERSION
            || !(fewest..=most).contains(&described.members)
        {
            return Err(Error::new(
                format!("{shown}: it is not one of this version"),
                "fit the ensemble again",
            ));
        }
        let mut provenance = None;
        let mut member = |k: usize| -> Result<Learned> {
            let own = read_model(&folder.join(member_name(k)), hint)?;
            provenance.get_or_insert(own.provenance);
            Ok(own.model)
        };
        let members = (0..described.members).map(&mut member);
        let members: Vec<Learned> = members.collect::<Result<_>>()?;
        Ok(Self {
            ensemble: Ensemble::new(members, described.calibration).context(shown, hint)?,
            provenance: provenance.unwrap_or_default(),
            summary: described.summary,
        })
    }
}

/// The name of the file of a member.
pub(crate) fn member_name(k: usize) -> String {
    format!("member-{}.safetensors", k + 1)
}

/// Whether a file is that of a member.
pub(crate) fn is_member(name: &str) -> bool {
    (0..MEMBERS.1).any(|k| member_name(k) == name)
}
