//! `lagrangian score`.

use std::process::ExitCode;

use anyhow::{Result, bail};

use super::Manner;
use crate::cli::ScoreArgs;

pub(super) fn run(_args: &ScoreArgs, _manner: Manner) -> Result<ExitCode> {
    bail!("`lagrangian score` is not part of this build yet")
}
