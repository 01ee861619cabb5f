//! Run folders: the layer between files and fits, for the command and for the Python package alike.
//!
//! A run is a folder with the inputs and the results of a fit: settings and hashes of the data
//! ([`RunRecord`]), metrics, checkpoints, the model, and a page. Recordings are read by [`read_file`] with the layout
//! beside them, a [`RunFolder`] is opened and locked, a [`FitSpec`](lagrangian::FitSpec) with its [`Data`] is a [`PreparedFit`], which ends as a [`FitReport`], and [`Page`] presents
//! the assessment of its model.
//!
//! The crate prints nothing. Errors, notes and pages name settings in backticks, as `low_pass`; a [`Frontend`] writes them as its
//! users know them.

pub mod compare;
mod content;
mod ensemble;
mod error;
mod file_names;
mod files;
mod fit;
mod folder;
mod formats;
mod hashing_reader;
mod input;
mod job;
mod metrics;
mod page;
mod partial_files;
mod record;
mod resolved;
mod shell;
mod source;
mod tensorboard;
mod unit;
mod watch;

pub use ensemble::{ENSEMBLE, SavedEnsemble};
pub use error::{Cause, Context, Error, Result};
pub use file_names::{file_name, file_names};
pub use files::{Existing, Sink, refuse_existing, write_bytes, write_file};
pub use folder::{
    CHECKPOINT, ExistingRun, FIGURES, METRICS, MODEL, REPORT, RUN, RunFolder, model_file,
};
pub use formats::{FileFormat, FrontendFormats, TableFacts, files_of, is_bag, read_others_by};
pub use hashing_reader::{FileHash, Hashing, HashingReader, brief_hash};
pub use input::{MOST_TEXT, is_same_name, open, refuse_overwriting, text};
pub use job::{
    Data, Figures, FinishedFit, FitReport, PreparedFit, RunTarget, SampleFacts, prepared,
};
pub use metrics::{Metric, Metrics, Tensorboard};
pub use page::{
    Evaluation, Frontend, Links, MOST_LINKS, Page, Scored, as_chain, coverage_table, energies,
    robot_in_motion, score_tables,
};
pub use partial_files::remove_unfinished;
pub use record::{DataFile, RunRecord};
pub use resolved::Columns;
pub use shell::quoted;
pub use source::{
    ReadFile, ReadModel, Source, delayed, layout_beside, read_file, read_model, unused,
};
pub use unit::unit_name;
pub use watch::Watch;
