//! Saved models, and the preparation of recordings for them, as for their fits.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use anyhow::Result;
use lagrangian::saved::Preparation;
use lagrangian::text::counted;
use lagrangian::trajectory::Topology;
use lagrangian::{Coordinates, EstimateOptions, Layout, Learned, Model, Recording, Trajectory};
use lagrangian_run::{FileHash, read_model};

use crate::cli::{DataArgs, EstimateArgs, RecordedArgs};
use crate::data;
use crate::failure::mistake;

/// A saved model, and the preparation of its recordings.
pub(crate) struct Fitted {
    pub(crate) model: Learned,
    pub(crate) preparation: Preparation,
}

/// Motions for a model.
pub(crate) struct ModelMotions {
    pub(crate) motions: Vec<Trajectory>,
    /// The files that they come from, each with its hash.
    pub(crate) hashes: Vec<(PathBuf, FileHash)>,
    /// The signals that were estimated.
    pub(crate) estimated: BTreeSet<&'static str>,
    /// The flags of the columns, completed.
    pub(crate) data: DataArgs,
}

impl Fitted {
    /// The flags of the columns, completed by those of the data that the model was fitted to.
    pub(crate) fn completed(&self, data: &DataArgs) -> Result<DataArgs> {
        Ok(DataArgs {
            fitted: Some(Layout::from_toml(&self.preparation.layout)?),
            model: Some(self.model.coordinates().clone()),
            ..data.clone()
        })
    }

    /// The flags, completed by the settings of the model's fit, and the options of estimates; reports the completed flags.
    pub(crate) fn complete(&self, given: &RecordedArgs) -> Result<(DataArgs, EstimateOptions)> {
        let (own, mut data) = (&self.preparation, self.completed(&given.data)?);
        let options = self.estimates(&given.estimate);
        if data.delay.is_empty() && !own.delay.is_empty() {
            data.fitted_delay.clone_from(&own.delay);
            let words = own.delay.iter().map(|s| (1e9 * s).round() / 1e6);
            let words: Vec<String> = words.map(|ms| ms.to_string()).collect();
            note!(
                "note: as for the fit of the model: --delay={}",
                words.join(",")
            );
        }
        Ok((data, options))
    }

    /// The motions of files, read and prepared as for the fit of the model.
    pub(crate) fn motions(&self, files: &[PathBuf], given: &RecordedArgs) -> Result<ModelMotions> {
        let (data, options) = self.complete(given)?;
        let read = data::read_sample(files, &data, None)?;
        require_coordinates(&read.recordings, self.model.coordinates())?;
        let (motions, estimates) = data::trajectories(read.recordings, &options)?;
        Ok(ModelMotions {
            motions,
            hashes: read.hashes,
            estimated: data::estimated_signals(&estimates),
            data,
        })
    }

    /// The options of estimates: those of the flags, else those of the model's fit, which are reported.
    pub(crate) fn estimates(&self, estimate: &EstimateArgs) -> EstimateOptions {
        if estimate.smooth || estimate.low_pass.is_some() {
            return estimate.options();
        }
        let own = &self.preparation;
        let smooth = own.smooth.then(|| "--smooth".to_string());
        let same = smooth.or_else(|| own.low_pass.map(|hertz| format!("--low-pass {hertz}")));
        if let Some(same) = same {
            note!("note: as for the fit of the model: {same}");
        }
        own.estimates()
    }
}

/// Reads a saved model.
pub(crate) fn model(path: &Path) -> Result<Learned> {
    Ok(fitted(path)?.model)
}

/// Reads a saved model, and the preparation of its recordings.
pub(crate) fn fitted(path: &Path) -> Result<Fitted> {
    let saved = read_model(path, "give the model.safetensors of a run")?;
    if saved.provenance.unverified {
        note!(
            "note: '{}' was written before models held a checksum: damage to it may not show",
            path.display()
        );
    }
    Ok(Fitted {
        model: saved.model,
        preparation: saved.provenance.preparation.unwrap_or_default(),
    })
}

/// Refuses recordings of another number of coordinates than the model's.
pub(crate) fn require_dof(recordings: &[Recording], coordinates: &Coordinates) -> Result<()> {
    let (n, expected) = (
        recordings.first().map_or(0, Recording::dof),
        coordinates.dof(),
    );
    if n == expected {
        return Ok(());
    }
    Err(mistake(
        format!(
            "the data has {}, the model {expected}",
            counted(n, "coordinate")
        ),
        "name the columns of the model's coordinates with --q, in their order",
    ))
}

/// Refuses recordings of other coordinates than the model's: of another number, or angles where it has none. Other names
/// may mean the same coordinates, and are reported.
pub(crate) fn require_coordinates(
    recordings: &[Recording],
    coordinates: &Coordinates,
) -> Result<()> {
    require_dof(recordings, coordinates)?;
    let Some(first) = recordings.first() else {
        return Ok(());
    };
    let pairs = first.coordinates.0.iter().zip(&coordinates.0);
    if let Some((own, model)) = pairs
        .clone()
        .find(|(own, model)| own.topology != model.topology)
    {
        let is = |topology| match topology {
            Topology::Circle => "an angle",
            Topology::Line => "a position on a line",
            Topology::Parameter => "a parameter",
        };
        return Err(mistake(
            format!(
                "'{}' is {} in the data, and '{}' is {} in the model",
                own.name,
                is(own.topology),
                model.name,
                is(model.topology)
            ),
            "declare the coordinates of the data as those of the model, with --angle and --parameters",
        ));
    }
    for (own, model) in pairs.filter(|(own, model)| own.name != model.name) {
        note!(
            "note: '{}' of the data is taken as '{}' of the model",
            own.name,
            model.name
        );
    }
    Ok(())
}
