//! `lagrangian report`.

use std::process::ExitCode;

use anyhow::{Result, bail};

use super::Manner;
use crate::cli::ReportArgs;

pub(super) fn run(_args: &ReportArgs, _manner: Manner) -> Result<ExitCode> {
    bail!("`lagrangian report` is not part of this build yet")
}
