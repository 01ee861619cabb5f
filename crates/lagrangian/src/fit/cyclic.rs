//! The cyclic coordinates of a fit: those that were declared, unless the data contradict them, or those that the data show.

use serde_json::json;

use crate::dataset::Dataset;
use crate::models::{Drift, contradiction, drifts};
use crate::train::spec::{AutoSetting, FitSpec};
use lagrangian_motion::{Error, Result};

/// The words for those that the data show, and for none.
const FIND: &str = "find";
const NONE: &str = "none";

impl FitSpec {
    /// Whether the request declares cyclic coordinates, or asks for those that the data show.
    pub(crate) fn keeps_cyclic(&self) -> bool {
        let asked = &self.prepare.cyclic;
        !asked.is_empty() && *asked != [NONE]
    }

    /// The cyclic coordinates of these data, and the choice of those that were found.
    ///
    /// # Errors
    /// [`Error::Setting`] for a name that is not of a coordinate that moves, and for one whose momentum drifts.
    pub(crate) fn cyclic(&self, dataset: &Dataset) -> Result<(Vec<usize>, Option<AutoSetting>)> {
        let (asked, names) = (&self.prepare.cyclic, names(dataset));
        match &asked[..] {
            [] if self.is_open() => Ok(found(dataset)),
            [word] if word == FIND => Ok(found(dataset)),
            [] => Ok((Vec::new(), None)),
            [word] if word == NONE => Ok((Vec::new(), None)),
            _ => {
                let index = |name: &String| {
                    let at = names.iter().position(|own| own == name);
                    let finding = || {
                        format!(
                            "`cyclic` names {name}, which is none of the coordinates {}",
                            names.join(", ")
                        )
                    };
                    at.ok_or_else(|| Error::setting(finding(), "correct the name"))
                };
                let declared: Vec<usize> = asked.iter().map(index).collect::<Result<_>>()?;
                refuse_contradicted(&declared, dataset)?;
                Ok((declared, None))
            }
        }
    }
}

/// The names of the coordinates.
fn names(dataset: &Dataset) -> Vec<&str> {
    let all = &dataset.coordinates.0;
    all.iter().map(|own| &*own.name).collect()
}

/// Those that the data show.
fn found(dataset: &Dataset) -> (Vec<usize>, Option<AutoSetting>) {
    let names = names(dataset);
    let all = drifts(dataset);
    let kept = all
        .iter()
        .enumerate()
        .filter_map(|(i, own)| Some((i, own.filter(|own| own.kept)?)));
    let kept: Vec<(usize, Drift)> = kept.collect();
    if kept.is_empty() {
        return (Vec::new(), None);
    }
    let each = kept
        .iter()
        .map(|(i, own)| format!("{} to {:.1e}", names[*i], own.share));
    let reason = format!(
        "each motion keeps its momentum, but for its own friction and force, as well as noise tells: {}",
        each.collect::<Vec<_>>().join(", ")
    );
    let chosen: Vec<usize> = kept.iter().map(|(i, _)| *i).collect();
    let named: Vec<&str> = chosen.iter().map(|i| names[*i]).collect();
    let choice = AutoSetting::new("cyclic", json!(named), reason);
    (chosen, Some(choice))
}

/// Refuses declared coordinates whose momenta drift.
fn refuse_contradicted(declared: &[usize], dataset: &Dataset) -> Result<()> {
    for &i in declared {
        let name = &dataset.coordinates.0[i].name;
        if dataset.coordinates.is_parameter(i) {
            let finding = format!("`cyclic` names {name}, which is a parameter and never moves");
            return Err(Error::setting(finding, "omit it"));
        }
        if let Some(how) = contradiction(dataset, i) {
            let finding = format!("`cyclic` names {name}, but {how}");
            return Err(Error::setting(finding, "omit it: the data contradict it"));
        }
    }
    Ok(())
}
